"""What a repair prefers, keeps and reports, on systems that are written out."""

import pytest

from cqos_core.model.finding import Verdict
from cqos_planning.search import find_repair
from plugins.planning.tests.systems import NAME, WHERE, again


def repaired(text, **wishes):
    return find_repair({NAME: text.encode()}, again, WHERE, **wishes)


def texts(plan):
    return [each.text for each in plan.changes]


def two(offered, requested, more=""):
    return f"""\
cqos: 1
protocol: ros2
participants:
  a: {{publishes: {{t: {{{offered}}}}}}}
  b: {{subscribes: {{t: {{{requested}}}}}}}
{more}"""


@pytest.mark.usefixtures("solver")
class TestPreferences:
    def test_a_setting_comes_before_a_promise_of_the_program(self):
        plan = repaired(two("deadline: 1s", "deadline: 500ms"))
        assert texts(plan) == ["request deadline `1s` on b/subscriber/t"]
        assert plan.changes[0].weakens

    def test_a_stronger_value_comes_before_a_weaker_one(self):
        assert texts(repaired(two("reliability: best_effort", "reliability: reliable"))) == [
            "offer reliability `reliable` on a/publisher/t"
        ]

    def test_one_endpoint_comes_before_a_shared_profile(self):
        text = """\
cqos: 1
protocol: ros2
profiles:
  cheap: {reliability: best_effort}
participants:
  a: {publishes: {t: cheap, u: cheap}}
  b: {subscribes: {t: {reliability: reliable}}}
"""
        plan = repaired(text)
        assert texts(plan) == ["offer reliability `reliable` on a/publisher/t"]
        assert b"t: {profile: cheap, reliability: reliable}, u: cheap" in plan.edited.texts[NAME]

    def test_a_shared_profile_comes_before_many_endpoints(self):
        names = [f"t{number}" for number in range(6)]
        publishers = ", ".join(f"{name}: cheap" for name in names)
        subscribers = ", ".join(f"{name}: {{reliability: reliable}}" for name in names)
        text = f"""\
cqos: 1
protocol: ros2
profiles:
  cheap: {{reliability: best_effort}}  # for cameras
participants:
  a: {{publishes: {{{publishers}}}}}
  b: {{subscribes: {{{subscribers}}}}}
"""
        plan = repaired(text)
        assert len(plan.changes) == 1
        assert plan.changes[0].shared
        assert len(plan.changes[0].members) == 6
        assert b"cheap: {reliability: reliable}  # for cameras" in plan.edited.texts[NAME]

    def test_equal_endpoints_change_together(self):
        more = "".join(f"  b{number}: {{subscribes: {{t: {{reliability: reliable}}}}}}\n" for number in range(5))
        plan = repaired(two("reliability: best_effort", "reliability: reliable", more))
        assert texts(plan) == ["offer reliability `reliable` on a/publisher/t"]

    def test_a_pattern_keeps_endpoints(self):
        plan = repaired(two("reliability: best_effort", "reliability: reliable"), keep=("a/*",))
        assert texts(plan) == ["request reliability `best_effort` on b/subscriber/t"]

    def test_a_profile_that_a_kept_endpoint_uses_stays(self):
        text = """\
cqos: 1
protocol: ros2
profiles:
  cheap: {reliability: best_effort}
participants:
  a: {publishes: {t0: cheap, t1: cheap, t2: cheap, t3: cheap}}
  kept: {publishes: {x: cheap}}
  b: {subscribes: {t0: , t1: , t2: , t3: }}
"""
        plan = repaired(text, keep=("kept",))
        assert len(plan.changes) == 4
        assert not any(each.shared for each in plan.changes)


@pytest.mark.usefixtures("solver")
class TestResults:
    def test_requirements_hold_afterwards_with_the_reason_of_each_change(self):
        plan = repaired(two("reliability: best_effort", "reliability: best_effort, needs: {late_join: 3}"))
        assert plan.confirmed
        assert plan.after.verdict is Verdict.COMPATIBLE
        assert all(each.because for each in plan.changes)
        assert {"durability", "reliability"} <= {each.policy for each in plan.changes}

    def test_a_change_that_breaks_another_topic_is_answered_there(self):
        text = """\
cqos: 1
protocol: mqtt
brokers:
  hub: {maximum_qos: 1}
participants:
  a: {broker: hub, publishes: {t: {qos: 2}}}
  b: {broker: hub, subscribes: {t: {qos: 2, needs: {duplicate_free: true}}}}
"""
        plan = repaired(text)
        assert plan.confirmed == (not plan.conflict)
        assert plan.after.verdict is not Verdict.INCOMPATIBLE or plan.conflict

    def test_unknown_pairs_stay_unless_the_caller_decides_them(self):
        text = two("durability: system_default", "durability: transient_local")
        assert repaired(text).changes == ()
        plan = repaired(text, decide=True)
        assert texts(plan) == ["offer durability `transient_local` on a/publisher/t"]
        assert plan.after.verdict is Verdict.COMPATIBLE

    def test_accepted_findings_stay(self):
        accepted = "accept: [{rule: ROS101, because: it is a test}]\n"
        assert repaired(two("reliability: best_effort", "reliability: reliable", accepted)).changes == ()

    def test_what_the_middleware_decides_is_left_to_the_check(self):
        text = two("reliability: best_effort", "reliability: best_available, durability: transient_local")
        plan = repaired(text)
        assert plan.confirmed
        assert plan.after.verdict is not Verdict.INCOMPATIBLE

    def test_without_the_solver_the_message_says_how_to_install_it(self, monkeypatch):
        from cqos_core import CqosError

        monkeypatch.setitem(__import__("sys").modules, "ortools.sat.python", None)
        with pytest.raises(CqosError, match=r"install .*planning"):
            repaired(two("reliability: best_effort", "reliability: reliable"))


QUEUE = """\
cqos: 1
protocol: mqtt
brokers: {{hub: {{max_queued_messages: 10}}}}
options: {{mqtt: {{outage: 60s, protocol_version: 3.1.1}}}}
topics: {{t: {{period: 1s}}}}
participants:
  a: {{broker: hub, client_id: a, clean_session: false, publishes: {{t: {{qos: 1}}}}}}
  b: {{broker: hub, client_id: b, clean_session: false, subscribes: {{t: {{qos: 1, taken_every: 1s, needs: {{{needs}}}}}}}}}
"""


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize(
    ("code", "needs"),
    [
        ("MQTT407", "offline: 60s"),
        ("MQTT420", "loss_free: true, survives: [link_outage]"),
        ("MQTT320", "latest: true, survives: [link_outage]"),
    ],
)
def test_a_queue_that_fills_too_early_gets_room_for_just_what_comes(code, needs):
    text = QUEUE.format(needs=needs)
    plan = repaired(text)
    assert code in {each.code for each in plan.before.findings}
    assert texts(plan) == ["set max_queued_messages `61` of broker hub"]
    assert plan.proven
    assert plan.after.verdict is Verdict.COMPATIBLE
    less = find_repair({NAME: text.replace("messages: 10", "messages: 60").encode()}, again, WHERE)
    assert texts(less) == ["set max_queued_messages `61` of broker hub"]
    assert repaired(text.replace("messages: 10", "messages: 61")).changes == ()
