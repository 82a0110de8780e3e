"""Law: ROS 2 and DDS say the same of the same values, whether both ends are nodes, both are programs, or one of each."""

import re
from dataclasses import replace
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check, check_pair
from cqos_core.language.expression import unfolded
from cqos_core.model.report import Report
from cqos_core.model.settings import Setting
from cqos_core.model.source import ReadContext, Source
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, Role, System
from cqos_core.packs.guarantee import LINK
from cqos_dds.importers import unmodelled_elements as dds
from cqos_dds.pack import PACK as DDS
from cqos_ros2.importers import unmodelled_elements as ros2
from cqos_ros2.importers.fastdds_xml import read as read_fastdds_xml
from cqos_ros2.pack import PACK as ROS2
from cqos_ros2.wire import WIRE

DURATIONS = ["1ns", "999999999ns", "1s", "1000000001ns", "1h", "infinite"]
VALUES: dict[str, list[str]] = {
    "reliability": ["best_effort", "reliable"],
    "durability": ["volatile", "transient_local"],
    "deadline": DURATIONS,
    "liveliness": ["automatic", "manual_by_node", "manual_by_topic"],
    "liveliness_lease_duration": DURATIONS,
    "lifespan": DURATIONS,
    "history": ["keep_last", "keep_all"],
    "depth": ["1", "5", "1000"],
}
SAME_RULE = {f"ROS10{number}": f"DDS10{number}" for number in range(1, 6)}
Settings = dict[str, str]

# Every value is stated: defaults of ROS 2 and DDS are not the same.
settings = st.fixed_dictionaries({name: st.sampled_from(values) for name, values in VALUES.items()})


def on_wire(stated: Settings) -> Settings:
    """The same values as a program of DDS writes them."""
    found = dict(WIRE.fixed)
    for own, wire in WIRE.translations():
        if own in stated:
            found[wire] = WIRE.words.get(stated[own], stated[own])
    return found


def judged(offered: Settings, requested: Settings, rmw: str) -> Report:
    """Judge the pair on four topics: nodes on both ends, a node on one, on the other, on none."""
    system = System(
        participants={
            "node": Participant("node", "ros2", {"rmw": Setting(rmw)}),
            "other_node": Participant("other_node", "ros2", {"rmw": Setting(rmw)}),
            "program": Participant("program", "dds", {"implementation": Setting(rmw)}),
            "other_program": Participant("other_program", "dds", {"implementation": Setting(rmw)}),
        }
    )

    def add(role: Role, owner: str, name: str, stated: Settings) -> None:
        ours = owner.endswith("node")
        system.endpoints.append(
            Endpoint(
                id=f"{owner}/{role}/{name}",
                role=role,
                topic=f"/{name}" if ours else f"rt/{name}",
                participant=owner,
                settings={
                    key: Setting(text) for key, text in (stated if ours else on_wire(stated)).items() if _has(role, key)
                },
                type="std_msgs/msg/String" if ours else "std_msgs::msg::dds_::String_",
            )
        )

    for name, publisher, subscriber in (
        ("nodes", "node", "other_node"),
        ("node_first", "node", "program"),
        ("node_last", "program", "node"),
        ("programs", "program", "other_program"),
    ):
        add(PUBLISHER, publisher, name, offered)
        add(SUBSCRIBER, subscriber, name, requested)
    return check(system)


def _has(role: Role, name: str) -> bool:
    return role == PUBLISHER or not name.startswith(("lifespan", "durability_service", "liveliness.announcement"))


def verdicts(report: Report) -> dict[str, tuple[Any, set[str]]]:
    """The verdict on each topic, and the rules of request and offer that were broken, by their codes in DDS."""
    found: dict[str, tuple[Any, set[str]]] = {}
    for group in report.groups:
        codes = {SAME_RULE.get(code, code) for code in group.codes}
        found[group.topic.rpartition("/")[2]] = group.verdict, codes & set(SAME_RULE.values())
    return found


@given(settings, settings, st.sampled_from(["cyclonedds", "fastdds", "connext"]))
def test_ros_2_and_dds_say_the_same_of_the_same_values(offered, requested, rmw):
    found = verdicts(judged(offered, requested, rmw))
    assert found.keys() == {"nodes", "node_first", "node_last", "programs"}
    assert found["node_first"] == found["node_last"] == found["programs"] == found["nodes"]


def test_each_rule_of_request_and_offer_is_reached_on_each_topic():
    fine = {name: values[-1] for name, values in VALUES.items()} | {"deadline": "1s", "liveliness_lease_duration": "1s"}
    worse = {
        "ROS101": {"reliability": "best_effort"},
        "ROS102": {"durability": "volatile"},
        "ROS103": {"deadline": "1000000001ns"},
        "ROS104": {"liveliness": "manual_by_node"},
        "ROS105": {"liveliness_lease_duration": "1h"},
    }
    for code, change in worse.items():
        found = verdicts(judged({**fine, **change}, fine, "cyclonedds"))
        assert set(found) == {"nodes", "node_first", "node_last", "programs"}
        assert all(each == ("incompatible", {SAME_RULE[code]}) for each in found.values()), (code, found)


SAME_CONDITION = {
    **{f"ROS10{number}": f"DDS10{number}" for number in range(1, 4)},
    "ROS202": "DDS202",
    "ROS310": "DDS340",
    "ROS316": "DDS339",
    "ROS318": "DDS341",
    "ROS319": "DDS343",
    "ROS321": "DDS345",
    "ROS401": "DDS401",
    "ROS505": "DDS505",
    "ROS506": "DDS506",
    "ROS509": "DDS516",
    "ROS522": "DDS538",
    "ROS545": "DDS547",
    "ROS546": "DDS548",
    "ROS572": "DDS511",
    "ROS573": "DDS557",
    "ROS574": "DDS558",
    "ROS575": "DDS559",
    "ROS576": "DDS560",
}
OWN_NAMES = {wire: own for own, wire in (*WIRE.translations(), *WIRE.options.items(), *WIRE.facts.items())}


@pytest.mark.parametrize(("ours", "theirs"), SAME_CONDITION.items())
def test_a_rule_of_both_packs_has_one_condition(ours, theirs):
    """The packs do not import each other, so this holds their common rules together."""
    one, other = (str(unfolded(pack.rule(code).condition)) for pack, code in ((ROS2, ours), (DDS, theirs)))
    assert re.sub(r"[a-z_.]+", lambda word: OWN_NAMES.get(word[0], word[0]), other) == one


FACTS: Final = {
    "outage": ["1s", "1h"],
    "repair_time": ["1ns", "100ms", "1h"],
    "rediscovery_time": ["1ns", "100ms", "1h"],
    "round_trip_time": ["5ms"],
}
OF_TOPICS: Final = {"period": ["1ms", "1s", "infinite"], "keyed": ["true", "false"], "size": ["8"]}
SAID_OF_BOTH: Final = ("latest", "loss_free", "late_join", "offline", "max_gap")
"""What rests on histories, lifespans, repair and rediscovery."""
# A writer of Cyclone DDS with many bytes on the way waits (DDS544); rmw_cyclonedds lets it wait for ever, which no policy of ROS 2 states.
ON_THE_WIRE: Final = {"cyclonedds": {"reliability.max_blocking_time": "infinite"}}


def some(table: dict[str, list[str]]) -> Any:
    return st.fixed_dictionaries({}, optional={name: st.sampled_from(texts) for name, texts in table.items()})


@given(settings, settings, some({"taken_every": ["1ns", "1s"]}), some(FACTS), some(OF_TOPICS))
def test_ros_2_and_dds_give_the_same_of_the_same_values(offered, requested, taken, options, facts):
    found = []
    for pack, rmw in ((ROS2, "rmw"), (DDS, "implementation")):
        ends = [offered, requested | taken]
        sides = ends if pack is ROS2 else [on_wire(end) for end in ends]
        first, second = (
            {name: text for name, text in side.items() if _has(role, name)}
            for role, side in zip((PUBLISHER, SUBSCRIBER), sides, strict=True)
        )
        first |= ON_THE_WIRE["cyclonedds"] if pack is DDS else {}
        report = check_pair(pack.id, first, second, {rmw: "cyclonedds", **options}, facts, packs=[pack])
        found.append(
            {
                (each.word, cell.fault): cell.value
                for each in report.guarantees
                if each.word in SAID_OF_BOTH
                for cell in each.cells
                if cell.fault in {LINK, "link_outage", "subscriber_restart"}
            }
        )
    assert found[0] == found[1]


# Fast DDS reads neither from XML (XMLElementParser.cpp), and no rmw sets them.
NO_NODE_SETS: Final = {
    "destination_order",
    *(f"presentation.{each}" for each in ("access_scope", "coherent_access", "ordered_access")),
    # Of files of implementations; a profile of ROS 2 that has such an element is unknown.
    *("compression_ids", "disable_positive_acks", "extensions", "topic_kind", "type_extensibility"),
}


def deciding() -> set[str]:
    """The policies of endpoints on which it rests whether two endpoints of DDS match."""
    rules = [
        each for scope in ("pair", "meets") for each in DDS.by_scope[scope] if each.rule.kind in {"requires", "meets"}
    ]
    found = {DDS.policies[index] for each in rules if not each.rule.guarantee for index in each.bound.indices}
    return {policy.name for policy in found if policy.level == "endpoint"}


def test_whatever_decides_a_match_is_carried():
    carried = {on_wire for _, on_wire in WIRE.translations()} | WIRE.fixed.keys() | {"type"}
    assert deciding() - carried == NO_NODE_SETS


XML = {
    "reliability": "<reliability><kind>BEST_EFFORT</kind></reliability>",
    "durability": "<durability><kind>VOLATILE</kind></durability>",
    "deadline": "<deadline><period><sec>2</sec></period></deadline>",
    "liveliness": "<liveliness><kind>AUTOMATIC</kind></liveliness>",
    "liveliness.lease_duration": "<liveliness><lease_duration><sec>2</sec></lease_duration></liveliness>",
    "latency_budget": "<latencyBudget><duration><sec>2</sec></duration></latencyBudget>",
    "ownership": "<ownership><kind>EXCLUSIVE</kind></ownership>",
    "partition": "<partition><names><name>left</name></names></partition>",
}
ASKED = {
    "reliability": "reliable",
    "durability": "transient_local",
    "deadline": "1s",
    "liveliness": "manual_by_topic",
    "liveliness.lease_duration": "1s",
}


def test_a_profile_may_set_each_policy_that_decides_a_match():
    from cqos_ros2.importers.fastdds_profiles import _FIELDS

    assert {field.policy for field in _FIELDS.values()} & deciding() == XML.keys()


def end(role: Role, owner: str, settings: dict[str, Setting], *, observed: bool = False) -> Endpoint:
    """One end of the topic of a node and a program."""
    topic, kind = ("/t", "std_msgs/msg/String") if owner == "node" else ("rt/t", "std_msgs::msg::dds_::String_")
    return Endpoint(
        id=owner, role=role, topic=topic, participant=owner, settings=settings, type=kind, observed=observed
    )


@pytest.mark.parametrize("observed", [False, True])
@pytest.mark.parametrize("rmw", ["fastdds", None])
@pytest.mark.parametrize("policy", XML)
def test_what_a_profile_sets_of_a_node_is_compared_with_a_program(policy, rmw, observed):
    """A node that leaves all to Fast DDS, or was seen to run, and a program that would match it without the profile."""
    profile = f'<dds><profiles><data_writer profile_name="w" is_default_profile="true"><qos>{XML[policy]}'
    xml = f"{profile}</qos></data_writer></profiles></dds>"
    system = read_fastdds_xml(Source("p.xml", xml.encode()), ReadContext())
    left_open = {} if observed else dict.fromkeys(("reliability", "durability"), Setting("system_default"))
    seen = {"reliability": "reliable", "durability": "volatile", "deadline": "infinite", "liveliness": "automatic"}
    seen |= {"liveliness_lease_duration": "infinite", "lifespan": "infinite"}
    system.participants |= {
        "node": Participant("node", "ros2", {} if rmw is None else {"rmw": Setting(rmw)}),
        "program": Participant("program", "dds", {"implementation": Setting("cyclonedds")}),
    }
    asked = {name: Setting(text) for name, text in ASKED.items() if name == policy}
    settings = {name: Setting(text) for name, text in seen.items()} if observed else left_open
    system.endpoints += [
        end(PUBLISHER, "node", settings, observed=observed),
        end(SUBSCRIBER, "program", asked),
    ]
    without = replace(system, overlays=[])
    if policy in ASKED and observed:
        assert check(system).verdict == check(without).verdict  # What was seen is so, whatever files say.
    else:
        assert check(system).verdict != "compatible"
        assert policy in ASKED or check(without).verdict == "compatible"


def test_a_running_node_has_the_partition_and_ownership_that_nodes_have():
    endpoints = [end(PUBLISHER, "node", {}, observed=True), end(SUBSCRIBER, "program", {})]
    ends = {"node": Participant("node", "ros2"), "program": Participant("program", "dds")}
    report = check(System(participants=ends, endpoints=endpoints))
    assert not {"DDS107", "DDS403", "DDS404"} & {finding.code for finding in report.findings}


def test_both_packs_sort_elements_of_participants_alike():
    ours = replace(
        dds.FAST_PARTICIPANT,
        cannot_matter=without(dds.FAST_PARTICIPANT.cannot_matter),
        may_decide=without(dds.FAST_PARTICIPANT.may_decide),
    )
    theirs = replace(ros2.FAST_PARTICIPANT, cannot_matter=without(ros2.FAST_PARTICIPANT.cannot_matter))
    assert (ours, dds.CYCLONE) == (theirs, ros2.CYCLONE)
    assert {*ours.cannot_matter.items()} == {*theirs.cannot_matter.items()}
    assert {*dds.CYCLONE.cannot_matter.items()} == {*ros2.CYCLONE.cannot_matter.items()}


def without(patterns):
    """Patterns but for the domain, which ROS 2 states itself."""
    return {pattern: each for pattern, each in patterns.items() if not pattern.startswith("domainId")}
