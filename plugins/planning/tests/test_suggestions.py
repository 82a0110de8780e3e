"""Settings from requirements: applied and checked again, there is no finding; and what is stated stays."""

from itertools import islice

import pytest

import cqos_core as cqos
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.finding import Severity
from cqos_planning.constraints import Goals
from cqos_planning.model import build
from cqos_planning.search import find_repair
from cqos_planning.suggestion import find_suggestion, is_open
from plugins.planning.tests.systems import NAME, REACHABLE, WHERE, again, changed, cheaper, open_text, report_of
from tests.effort import EXPLORE

MOST_CHOICES = 40
SYSTEMS = {
    "ros2": "protocol: ros2\nparticipants:\n  a: {publishes: {t: }}\n  b: {subscribes: {t: {needs: {late_join: 3, latest: true}}}}\n",
    "restart": "protocol: ros2\nparticipants:\n  a: {publishes: {t: }}\n"
    "  b: {subscribes: {t: {needs: {late_join: 1, survives: [subscriber_restart]}}}}\n",
    "dds": "protocol: dds\nparticipants:\n  a: {publishes: {t: }}\n  b: {subscribes: {t: {needs: {late_join: 2, latest: true}}}}\n",
    "mqtt": "protocol: mqtt\nbrokers: {main: {max_queued_messages: 100}}\ntopics: {t: {period: 1s}}\nparticipants:\n"
    "  a: {publishes: {t: }}\n  b: {subscribes: {t: {taken_every: 1s, needs: {late_join: 1, latest: true}}}}\n",
}


def suggested(text):
    return find_suggestion({NAME: f"cqos: 1\n{text}".encode()}, again, WHERE)


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize("name", SYSTEMS)
def test_after_a_suggestion_nothing_is_found(name):
    plan = suggested(SYSTEMS[name])
    assert plan.confirmed, plan.conflict
    assert plan.proven
    assert plan.changes
    after = report_of(again(plan.edited.texts))
    assert str(after.verdict) == "compatible"
    assert [each for each in after.findings if each.severity is not Severity.NOTE] == []


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize(
    ("protocol", "need", "fact"),
    [
        ("ros2", "max_gap: 2s", "state the `period` of the topic and the option `repair_time`"),
        ("dds", "max_gap: 2s", "state the `period` of the topic and the option `repair_time`"),
        ("mqtt", "latest: true", "state `taken_every` of the subscription"),
    ],
)
def test_where_a_fact_is_missing_the_conflict_says_which(protocol, need, fact):
    text = f"protocol: {protocol}\nparticipants:\n  a: {{publishes: {{t: }}}}\n  b: {{subscribes: {{t: {{needs: {{{need}}}}}}}}}\n"
    plan = suggested(text)
    assert not plan.confirmed
    assert any(fact in part for part in plan.conflict), plan.conflict


@pytest.mark.usefixtures("solver")
def test_what_is_stated_stays():
    text = SYSTEMS["ros2"].replace("{t: }", "{t: {reliability: best_effort}}")
    plan = suggested(text)
    assert not plan.confirmed
    assert any("ROS" in part and "`a/publisher/t`" in part for part in plan.conflict)


@pytest.mark.usefixtures("solver")
def test_without_requirements_nothing_is_suggested():
    plan = suggested("protocol: ros2\nparticipants:\n  a: {publishes: {t: }}\n  b: {subscribes: {t: }}\n")
    assert plan.confirmed
    assert plan.changes == ()


@pytest.mark.usefixtures("solver")
def test_the_library_plans_for_files_and_bytes(tmp_path):
    text = f"cqos: 1\n{SYSTEMS['ros2']}".encode()
    (tmp_path / "a.yaml").write_bytes(text)
    of_bytes, of_file = cqos.suggest(text), cqos.suggest(tmp_path / "a.yaml")
    assert [each.text for each in of_bytes.changes] == [each.text for each in of_file.changes]
    of_file.edited.write()
    assert cqos.repair(tmp_path).changes == ()
    with pytest.raises(TypeError, match="give paths or bytes"):
        cqos.repair(cqos.read(text))


SIZES = (5, 20, 100, 500) if EXPLORE else (5,)


@pytest.mark.usefixtures("solver")
@pytest.mark.explored
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("protocol", [*REACHABLE])
def test_whatever_is_required_nothing_is_found_after_a_suggestion(protocol, seed, size):
    text = open_text(protocol, size, seed)
    plan = find_suggestion({NAME: text}, again, WHERE)
    assert plan.confirmed
    assert plan.proven
    assert not plan.conflicts
    after = report_of(again({NAME: plan.edited.texts.get(NAME, text)}))
    assert str(after.verdict) == "compatible"
    assert [each for each in after.findings if each.severity is not Severity.NOTE] == []


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("protocol", [*REACHABLE])
def test_no_weaker_settings_meet_the_requirements(protocol, seed):
    text = open_text(protocol, 3, seed)
    plan = find_suggestion({NAME: text}, again, WHERE)
    assert plan.confirmed
    system = again({NAME: text})
    topics = Pipeline(system, WHERE).topics
    model = build(topics, [*topics], Goals(decide=True), may=is_open)
    for chosen in islice(cheaper(model, plan.weight), MOST_CHOICES):
        after = report_of(changed(system, model, chosen))
        found = [each for each in after.findings if each.severity is not Severity.NOTE]
        assert found or str(after.verdict) != "compatible", chosen


@pytest.mark.usefixtures("solver")
def test_each_setting_says_what_it_costs():
    text = """\
protocol: dds
options: {dds: {implementation: cyclonedds}}
topics: {map: {period: 1s, size: 60000, keyed: false}}
participants:
  mapper: {publishes: {map: }}
  planner: {subscribes: {map: {needs: {late_join: 5}}}}
"""
    plan = suggested(text)
    costs = {(each.policy, each.members[0].split("/")[0]): each.costs for each in plan.changes}
    assert "memory: at most 300kB, at most 60kB without it" in costs["durability_service.history_depth", "mapper"]
    assert "late_join: 5, 1 without it" in costs["history.depth", "planner"]
    assert any(each.startswith("traffic of `map`: ") for each in costs["reliability", "planner"])
    silent = suggested(text.replace(", size: 60000", ""))
    assert not any(cost.startswith(("memory", "traffic")) for each in silent.changes for cost in each.costs)


@pytest.mark.usefixtures("solver")
def test_a_plan_names_the_links_whose_load_it_multiplies():
    text = """\
cqos: 1
protocol: dds
topics: {map: {period: 1s, size: 60000, keyed: false}, log: {period: 1s, size: 60000, keyed: false}}
participants:
  mapper: {publishes: {map: {reliability: best_effort}, log: {reliability: reliable}}}
  planner: {subscribes: {map: {reliability: reliable}, log: {reliability: reliable}}}
links: {radio: {participants: planner, rate: 10Mbit/s}}
"""
    plan = find_repair({NAME: text.encode()}, again, WHERE)
    assert plan.grown == ("link `radio` to planner: 960kbit/s with the changes, 480kbit/s before, 2 times as much",)
    more = text.replace("period: 1s, size: 60000, keyed: false}}", "period: 1s, keyed: false}}")
    grown = find_repair({NAME: more.encode()}, again, WHERE).grown
    assert grown == ("link `radio` to planner: 480kbit/s with the changes, nothing before",)


@pytest.mark.usefixtures("solver")
def test_a_change_that_needs_a_further_fact_is_refused_with_that_fact():
    text = SYSTEMS["mqtt"].replace("topics: {t: {period: 1s}}\n", "")
    conflict = suggested(text).conflict
    assert any(part.startswith("MQTT334") and "state `period` of all topics" in part for part in conflict), conflict
    assert not any("--option what comes" in part for part in conflict)
