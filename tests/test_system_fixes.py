"""Remedies for a whole system: what they fix, and what they leave."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check
from cqos_core.analysis.system_fixes import fix_system
from cqos_core.model.finding import Severity
from cqos_core.model.system import Acceptance
from tests.made_up_protocol import CONTEXT, POST, reader, world, writer


def errors(system):
    return [
        each for each in check(system, packs=[POST]).findings if each.severity is Severity.ERROR and not each.accepted
    ]


def changes(fixed):
    return sorted(
        (name, each.remedy.policy, each.remedy.value) for each in fixed.applied for name in each.remedy.members
    )


def test_the_best_remedy_of_each_error():
    system = world(writer("t", "w", care="plain", sealed=True), reader("t", "r", care="signed"))
    fixed = fix_system(system, CONTEXT, "configuration")
    assert changes(fixed) == [("w", "care", "signed")]
    assert fixed.changed == {("w", "care")}
    assert (errors(fixed.system), fixed.left) == ([], ())
    assert system.endpoints[0].overlay == {}, "the system itself stays as it is"


def test_what_a_remedy_states_counts_as_stated():
    """Else it would be offered against a rule about stated values, which then refuses it."""
    system = world(writer("t", "w"), reader("t", "r", delay="1ms"))
    (error,) = [each for each in errors(system) if each.code == "POST102"]
    assert "offer delay `1ms` on w" not in [remedy.text for remedy in error.remedies]


def test_a_promise_of_the_program_is_only_made_if_that_is_allowed():
    system = world(writer("t", "w", delay="9s"), reader("t", "r", delay="1s"))
    assert changes(fix_system(system, CONTEXT, "configuration")) == [("r", "delay", "9s")]
    system = world(writer("t", "w", delay="9s"), *(reader("t", f"r{n}", delay="1s") for n in range(2)))
    first = fix_system(system, CONTEXT, "first")
    assert errors(first.system) == []


def test_several_errors_with_one_remedy_need_one_change():
    system = world(
        writer("t", "w", care="plain"), *(reader("t", f"r{n}", care=c) for n, c in enumerate(("signed", "insured")))
    )
    fixed = fix_system(system, CONTEXT, "configuration")
    assert errors(fixed.system) == []
    assert len({(name, policy) for name, policy, _ in changes(fixed)}) <= 2


def test_accepted_errors_are_left_alone():
    system = world(
        writer("t", "w", care="plain"), reader("t", "r", care="signed"), accept=[Acceptance("POST101", "so be it")]
    )
    fixed = fix_system(system, CONTEXT, "first")
    assert (fixed.applied, fixed.left) == ((), ())


def test_what_cannot_be_fixed_is_left():
    system = world(writer("t", "w", stamp="A"), reader("t", "r", stamp="B"))
    fixed = fix_system(system, CONTEXT, "first")
    assert (fixed.applied, [each.code for each in fixed.left]) == ((), ["POST403"])


def test_equal_ids_do_not_get_mixed_up():
    system = world(writer("t", "w", care="plain"), writer("t", "w", care="plain"), reader("t", "r", care="signed"))
    fixed = fix_system(system, CONTEXT, "configuration")
    assert errors(fixed.system) == []
    assert [each.id for each in fixed.system.endpoints] == ["w", "w~2", "r"]


CARES = st.sampled_from(["plain", "signed", "insured", "best", "usual"])
DELAYS = st.sampled_from(["500ms", "1s", "5s", "infinite"])


@st.composite
def posts(draw):
    parts = [
        draw(st.sampled_from([writer, reader]))(
            "t", f"e{number}", care=draw(CARES), delay=draw(DELAYS), sealed=draw(st.booleans())
        )
        for number in range(draw(st.integers(0, 6)))
    ]
    return world(*parts)


@pytest.mark.parametrize("wanted", ["first", "configuration"])
@given(posts())
def test_no_pair_becomes_worse(wanted, system):
    before = {(pair.publisher, pair.subscriber): pair.verdict.rank for pair in check(system, packs=[POST]).pairs}
    fixed = fix_system(system, CONTEXT, wanted)
    after = {(pair.publisher, pair.subscriber): pair.verdict.rank for pair in check(fixed.system, packs=[POST]).pairs}
    assert len(errors(fixed.system)) == len(fixed.left)
    assert sum(after.values()) <= sum(before.values())
    if wanted == "configuration":
        assert all(each.remedy.kind == "configuration" for each in fixed.applied)


def test_a_remedy_of_no_endpoint_setting_is_left():
    """What a participant states, or what an application requires, is no setting of an endpoint to lay over."""
    from cqos_core.api import context, read

    text = b"""cqos: 1
protocol: ros2
participants:
  a: {publishes: {/t: {reliability: best_effort}}}
  b: {subscribes: {/t: {reliability: best_effort, needs: {loss_free: true}}}}
"""
    system = read(text)
    before = [each for each in check(system).findings if each.severity is Severity.ERROR]
    assert {remedy.policy for each in before for remedy in each.remedies} == {"need.loss_free"}
    fixed = fix_system(system, context(), "configuration")
    assert (fixed.applied, {each.code for each in fixed.left}) == ((), {each.code for each in before})
