"""Law: a repair is checked, and no change of less weight repairs the system; otherwise nothing does."""

from itertools import islice

import pytest

from cqos_core.model.finding import Verdict
from cqos_planning.search import find_repair
from cqos_planning.solver import Task, conflict, solve
from plugins.planning.tests.systems import (
    NAME,
    WHERE,
    again,
    changed,
    cheaper,
    is_confirmed,
    is_repaired,
    model_of,
    repaired_pairs,
    report_of,
    system_text,
)
from tests.effort import EXPLORE

MOST_CHOICES = 60
"""Systems with more choices of less weight than this are left out: all are tried."""
WITHOUT_REPAIR = 1_300


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(16 if EXPLORE else 4))
@pytest.mark.parametrize("protocol", ["post", "ros2", "dds", "mqtt"])
def test_no_change_of_less_weight_repairs_a_small_system(protocol, seed, solver):
    text = system_text(protocol, seed, 1 + seed % 2, 1 + seed // 2 % 2)
    plan = find_repair({NAME: text}, again, WHERE)
    assert plan.confirmed == (not plan.conflict)
    if plan.confirmed:
        assert plan.proven
        assert is_confirmed(plan, text)
    system, model = again({NAME: text}), model_of(text)
    choices = [*islice(cheaper(model, plan.weight if plan.confirmed else WITHOUT_REPAIR), MOST_CHOICES + 1)]
    if len(choices) <= MOST_CHOICES:
        before = report_of(system)
        for chosen in choices:
            assert not is_repaired(before, report_of(changed(system, model, chosen))), chosen


def after_of(plan):
    """The report of the changed texts, from scratch."""
    return report_of(again({**plan.edited.before, **plan.edited.texts}))


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(10 if EXPLORE else 2))
@pytest.mark.parametrize("protocol", ["post", "ros2", "dds", "mqtt"])
def test_of_a_system_without_repair_as_much_is_repaired_as_possible(protocol, seed, solver):
    text, keep = system_text(protocol, 100 + seed, 2, 2), ("publishes_0", "subscribes_0")
    plan = find_repair({NAME: text}, again, WHERE, keep=keep)
    before = report_of(again({NAME: text}))
    done = repaired_pairs(before, after_of(plan))
    assert done is not None
    system, model = again({NAME: text}), model_of(text, keep)
    for chosen in islice(cheaper(model, WITHOUT_REPAIR), MOST_CHOICES):
        found = repaired_pairs(before, report_of(changed(system, model, chosen)))
        weight = sum(model.slots[place].candidates[number].weight for place, number in chosen.items())
        assert found is None or not found > done, (chosen, plan)
        assert found is None or found != done or weight >= plan.weight, (chosen, plan)


def test_a_plan_without_a_warning_is_preferred(solver):
    system = b"""\
cqos: 1
protocol: post
participants:
  a: {publishes: {t: {care: plain}}}
"""
    assert find_repair({NAME: system}, again, WHERE).brought == ()


def test_each_part_of_a_conflicting_set_is_needed(solver):
    system = b"""\
cqos: 1
protocol: ros2
participants:
  camera: {publishes: {image: {reliability: best_effort, deadline: 1s}}}
  other: {publishes: {image: {reliability: best_effort}}}
  viewer: {subscribes: {image: {reliability: reliable, deadline: 1s}}}
  log: {subscribes: {log: }}
  talker: {publishes: {log: {reliability: best_effort}}}
"""
    plan = find_repair({NAME: system}, again, WHERE, keep=("camera", "other", "viewer"))
    assert [each.text for each in plan.changes] == ["offer reliability `reliable` on talker/publisher/log"]
    assert len(plan.conflicts) == 2, "one for each pair that stays"
    kept = [part for part in plan.conflict if part.startswith("`--keep")]
    found = [part for part in plan.conflict if part.startswith("ROS")]
    assert len(found) == 1
    assert len(kept) == 2, "one for each end of the pair, and none for the others"
    assert after_of(plan).verdict == Verdict.INCOMPATIBLE
    assert repaired_pairs(plan.before, after_of(plan)) == {("talker/publisher/log", "log/subscriber/log")}
    fewer = find_repair({NAME: system}, again, WHERE, keep=("camera", "other"))
    assert fewer.confirmed
    assert not fewer.conflicts


def test_a_conflict_of_the_solver_has_no_part_too_many(solver):
    task = Task(
        {place: [0, 1] for place in "abc"},
        [("never", False), ("fine", True)],
        {"a": "kept", "b": "kept too"},
        [("cut", {"a": 1, "b": 1})],
    )
    assert conflict(task) == ["never"]
    assert solve(task) is None
