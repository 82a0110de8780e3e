"""No value is missed: neither one that no rule turns at, nor one that was cut off without a word; and warnings are avoided."""

from itertools import islice, pairwise

import pytest

from cqos_core.analysis.plan import is_known, members_of
from cqos_core.api import context
from cqos_core.language.domains import Flag
from cqos_core.language.expression import offered, requested
from cqos_core.language.policy import Policy
from cqos_core.packs.pack import RulePack
from cqos_core.packs.rule import forbids, requires
from cqos_planning import slots
from cqos_planning.search import find_repair
from cqos_planning.slots import weighed
from plugins.planning.tests.systems import (
    NAME,
    WHERE,
    again,
    changed,
    cheaper,
    is_repaired,
    model_of,
    report_of,
    system_text,
)

MOST_CHOICES = 40
CROWD = "cqos: 1\nprotocol: ros2\nparticipants:\n" + "".join(
    f"  p{number}: {{publishes: {{t: {{deadline: {number + 2}s}}}}}}\n" for number in range(8)
)


def denser(slot):
    """The candidates of a slot, and further ones between and beside them, each with the weight that it would have."""
    stated = {each.value: () for each in slot.candidates[1:]}
    numbers = sorted(value for value in stated if isinstance(value, int) and not isinstance(value, bool))
    if len(numbers) < 2:
        return slot.candidates
    between = {(low + min(high, 4 * low + 4)) // 2 for low, high in pairwise(numbers)}
    beside = {value for each in numbers for value in (each - 1, each + 1)}
    more = [value for value in sorted(between | beside) if value not in stated and slot.policy.domain.has(value)]
    return (
        *slot.candidates,
        *(each for value in more for each in weighed(slot, {**stated, value: ()}) if each.value == value),
    )


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("protocol", ["post", "ros2", "dds", "mqtt"])
def test_no_value_beside_the_candidates_repairs_with_less_weight(protocol, seed, solver):
    text = system_text(protocol, 300 + seed, 1 + seed % 2, 2)
    plan = find_repair({NAME: text}, again, WHERE)
    if plan.conflicts or not plan.changes:
        return
    assert plan.cut == ()
    system, model, before = again({NAME: text}), model_of(text), plan.before
    known = {place: len(slot.candidates) for place, slot in model.slots.items()}
    for slot in model.slots.values():
        slot.candidates = denser(slot)
    new = (
        chosen
        for chosen in cheaper(model, plan.weight)
        if any(number >= known[place] for place, number in chosen.items())
    )
    for chosen in islice(new, MOST_CHOICES):
        assert not is_repaired(before, report_of(changed(system, model, chosen))), chosen


def test_values_that_were_not_tried_are_named(solver, monkeypatch):
    text = (CROWD + "  s: {subscribes: {t: {deadline: 1s}}}\n").encode()
    whole = find_repair({NAME: text}, again, WHERE)
    assert whole.cut == ()
    monkeypatch.setattr(slots, "MOST_VALUES", 6)
    plan = find_repair({NAME: text}, again, WHERE)
    assert plan.cut == ("deadline on `/t`: 6 of 10 values were tried, those nearest to what is stated",)
    assert whole.weight <= plan.weight


def pack_that_warns_of(name):
    """A protocol in which two settings of a publisher do equally well, and C-QoS warns of one."""
    first, second, wanted = (Policy(each, Flag(), "false", "A switch.") for each in ("first", "second", "wanted"))
    warned = {"first": first, "second": second}[name]
    rules = (
        requires(
            offered(first) | offered(second) | ~requested(wanted), code="WISH101", name="off", because="both are off"
        ),
        forbids(~~warned, code="WISH201", name="odd", because="it is odd", severity="warning"),
    )
    return RulePack(id="w", title="W", policies=(first, second, wanted), rules=rules, source="made up")


@pytest.mark.parametrize("name", ["first", "second"])
def test_of_plans_with_the_same_weight_the_one_without_a_warning_is_taken(name, solver):
    text = b"cqos: 1\nprotocol: w\nparticipants:\n  a: {publishes: {t: {}}}\n  b: {subscribes: {t: {wanted: true}}}\n"
    plan = find_repair({NAME: text}, again, context([pack_that_warns_of(name)]))
    assert plan.confirmed
    assert plan.proven
    assert [each.policy for each in plan.changes] == [{"first": "second", "second": "first"}[name]]
    assert plan.brought == ()


@pytest.mark.parametrize(("protocol", "seed"), [("ros2", 28), ("dds", 0), ("post", 12), ("post", 58)])
def test_a_warning_that_no_plan_of_the_same_weight_avoids_is_named(protocol, seed, solver):
    text = system_text(protocol, seed, 1 + seed % 2, 1 + seed // 2 % 2)
    plan = find_repair({NAME: text}, again, WHERE)
    assert plan.brought
    system, model, before = again({NAME: text}), model_of(text), plan.before
    known = {(each.code, member) for each in before.findings for member in members_of(each)}
    for chosen in islice(cheaper(model, plan.weight + 1), MOST_CHOICES):
        after = report_of(changed(system, model, chosen))
        warned = any(each.severity.value == "warning" and not is_known(each, known) for each in after.findings)
        assert warned or not is_repaired(before, after), chosen
