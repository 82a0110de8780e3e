"""The paper's case study: as a diagram and as a system file it is one system, with one set of verdicts and values."""

import re
from pathlib import Path

import pytest

import cqos_core as cqos

EXAMPLES = Path(__file__).parents[2] / "examples"
DIAGRAM = EXAMPLES / "smart_agriculture.bpmn"
SYSTEM_FILE = EXAMPLES / "smart_agriculture.yaml"

# The events of the diagram, and what they are in the system file.
SAME = {
    "Drone_ThrowReq": "drone/publisher/req_weather_data",
    "Station_CatchReq": "weather_station/subscriber/req_weather_data",
    "Station_ThrowResp": "weather_station/publisher/resp_weather_data",
    "Drone_CatchResp": "drone/subscriber/resp_weather_data",
}
PAIRS = (("Drone_ThrowReq", "Station_CatchReq"), ("Station_ThrowResp", "Drone_CatchResp"))
TABLE_2 = {
    "history": ("keep_last",) * 4,
    "depth": ("1", "1", "5", "5"),
    "reliability": ("best_effort", "best_effort", "reliable", "reliable"),
    "durability": ("volatile", "volatile", "transient_local", "volatile"),
    "deadline": ("2s",) * 4,
    "lifespan": ("10s",) * 4,
    "liveliness": ("automatic",) * 4,
    "liveliness_lease_duration": ("10s",) * 4,
}


def compared(path, publisher, subscriber):
    """What both ends of a pair have of each policy, and whether that fits."""
    pair = cqos.explain(path, publisher=publisher, subscriber=subscriber)
    return pair.verdict, {
        each.policy: (each.offered.value, each.requested.value, each.verdict) for each in pair.policies
    }


def renamed(groups):
    """Who meets whom and how that ends, in the ids of the system file."""
    return {
        (
            tuple(SAME.get(p, p) for p in group.publishers),
            tuple(SAME.get(s, s) for s in group.subscribers),
        ): group.verdict
        for group in groups
    }


@pytest.mark.parametrize(("publisher", "subscriber"), PAIRS)
def test_both_forms_have_the_same_values(publisher, subscriber):
    diagram = compared(DIAGRAM, publisher, subscriber)
    assert diagram == compared(SYSTEM_FILE, SAME[publisher], SAME[subscriber])
    assert diagram[0] == "compatible"


def test_both_forms_have_the_same_verdicts():
    diagram, system_file = cqos.check(DIAGRAM), cqos.check(SYSTEM_FILE)
    assert renamed(diagram.groups) == renamed(system_file.groups)
    assert diagram.verdict == system_file.verdict == "compatible"
    assert {finding.severity for finding in system_file.findings} == {cqos.Severity.NOTE}
    loud = {(each.code, each.endpoints) for each in diagram.findings if each.severity is not cqos.Severity.NOTE}
    assert loud == {
        ("BP101", ("Drone_ThrowReq",)),
        ("BP101", ("Station_ThrowResp",)),
        ("BP102", ("Station_CatchReq",)),
        ("BP102", ("Drone_CatchResp",)),
    }
    assert diagram.ok


@pytest.mark.parametrize("policy", TABLE_2)
def test_the_values_are_those_of_the_papers_table_2(policy):
    found = []
    for publisher, subscriber in PAIRS:
        _, values = compared(SYSTEM_FILE, SAME[publisher], SAME[subscriber])
        found += values[policy][:2]
    assert tuple(found) == TABLE_2[policy]


def test_the_diagram_meets_the_system_file():
    """Both read as one system: what is called `Req weather data` there is `req_weather_data` here."""
    report = cqos.check(DIAGRAM, SYSTEM_FILE)
    assert report.verdict == "compatible"
    assert report.pair_count == 8


BASE = {"BP101 Drone_ThrowReq", "BP101 Station_ThrowResp", "BP102 Station_CatchReq", "BP102 Drone_CatchResp"}


def behaviour(*changes):
    """Report the findings about behaviour of the diagram, where events have other attributes or requirements."""
    text = DIAGRAM.read_text(encoding="utf-8")
    for event, old, new in changes:
        before, start, rest = text.partition(f'id="{event}"')
        assert old in rest, event
        text = before + start + rest.replace(old, new, 1)
    report = cqos.check(text.encode(), importer="bpmn")
    return report, {f"{each.code} {each.sides[0].members[0]}" for each in report.findings if each.code[:2] == "BP"}


def test_manual_liveliness_of_the_request_waits_for_the_timer():
    manual = "automatic", "manual_by_topic"
    _, found = behaviour(("Drone_ThrowReq", *manual), ("Station_CatchReq", *manual))
    assert found == BASE | {"BP105 Drone_ThrowReq"}


def test_a_second_station_that_a_message_starts_may_answer_at_any_time():
    text = DIAGRAM.read_text(encoding="utf-8")
    signal = re.search(r'<bpmn:\w+ id="Station_ThrowResp".*?signalRef="(\w+)"', text, re.DOTALL)[1]
    other = f"""<bpmn:process id="Other"><bpmn:startEvent id="o"><bpmn:messageEventDefinition/></bpmn:startEvent>
    <bpmn:endEvent id="q"><bpmn:signalEventDefinition signalRef="{signal}"/></bpmn:endEvent>
    <bpmn:sequenceFlow id="oq" sourceRef="o" targetRef="q"/></bpmn:process></bpmn:definitions>"""
    report = cqos.check(text.replace("</bpmn:definitions>", other).encode(), importer="bpmn")
    found = {f"{each.code} {each.sides[0].members[0]}" for each in report.findings if each.code[:2] == "BP"}
    # The first station still misses the deadline that it offers: BP101 counts what one participant sends.
    assert found == BASE - {"BP102 Drone_CatchResp"}


@pytest.mark.parametrize(
    ("durability", "lifespan", "found"),
    [("transient_local", "0", {"BP108 Drone_CatchResp"}), ("transient_local", "10", set()), ("volatile", "0", set())],
)
def test_the_answer_of_the_round_before_may_be_kept(durability, lifespan, found):
    kept = ("Drone_CatchResp", 'durability="volatile"', f'durability="{durability}"')
    lives = [(each, 'lifespan="10"', f'lifespan="{lifespan}"') for each in ("Drone_CatchResp", "Station_ThrowResp")]
    assert behaviour(kept, *lives)[1] == BASE | found


@pytest.mark.parametrize(
    ("gap", "verdict", "found"), [("1h", "incompatible", {"BP114 Station_CatchReq"}), ("6h", None, set())]
)
def test_a_required_gap_that_the_timer_excludes(gap, verdict, found):
    need = f'><bpmn:extensionElements><qos:need name="max_gap" value="{gap}"/></bpmn:extensionElements>'
    report, seen = behaviour(("Station_CatchReq", ">", need))
    assert seen == BASE | found
    assert (report.verdict == verdict) is (verdict is not None)
