"""Nodes of ROS 2 and programs of DDS on one topic: names, types, domains, services, what is not known."""

import json
from typing import Any

import pytest

from cqos_core import Report, check

STRING = {"type": "std_msgs::msg::dds_::String_"}
NODE_STRING = {"type": "std_msgs/msg/String"}
XCDR1 = {"data_representation": ["xcdr1"]}


def judged(node: dict[str, Any], program: dict[str, Any], **more: Any) -> Report:
    """A node on Cyclone DDS and a program on Cyclone DDS, unless they say otherwise."""
    system = {
        "cqos": 1,
        "participants": {
            "node": {"protocol": "ros2", "rmw": "cyclonedds", **node},
            "program": {"protocol": "dds", "implementation": "cyclonedds", **program},
        },
        **more,
    }
    return check(json.dumps(system).encode(), importer="yaml")


def codes(report: Report) -> list[str]:
    return [code for finding in report.findings for code in (finding.code, *finding.more_codes)]


def test_a_mixed_pair_is_judged_by_the_rules_of_the_wire():
    report = judged(
        {"publishes": {"/chatter": {**NODE_STRING, "reliability": "best_effort"}}},
        {"subscribes": {"rt/chatter": {**STRING, "reliability": "reliable"}}},
    )
    (group,) = report.groups
    assert (group.protocol, group.topic, str(group.verdict)) == ("dds", "rt/chatter", "incompatible")
    (finding,) = report.findings
    assert finding.code == "DDS101"
    assert {member for side in finding.sides for member in side.members} == {
        "node/publisher/chatter",
        "program/subscriber/rt/chatter",
    }


def test_a_remedy_for_a_node_is_in_the_words_of_the_finding_and_names_the_node():
    report = judged(
        {"publishes": {"/chatter": {"liveliness_lease_duration": "2s"}}},
        {"subscribes": {"rt/chatter": {"liveliness.lease_duration": "1s"}}},
    )
    (finding,) = report.findings
    assert finding.code == "DDS105"
    assert {(remedy.role, remedy.value) for remedy in finding.remedies} == {("publisher", "1s"), ("subscriber", "2s")}


@pytest.mark.parametrize(
    ("node", "program", "pairs"),
    [
        ("/chatter", "rt/chatter", 1),
        ("chatter", "rt/chatter", 1),
        ("/robot/chatter", "rt/robot/chatter", 1),
        ("/chatter", "chatter", 0),
        ("/chatter", "/chatter", 0),
        ("/chatter", "rt/Chatter", 0),
    ],
)
def test_names_on_the_wire(node: str, program: str, pairs: int):
    report = judged({"publishes": {node: {}}}, {"subscribes": {program: {}}})
    assert report.pair_count == pairs


def test_a_node_in_a_namespace_has_it_on_the_wire():
    report = judged({"namespace": "/robot", "publishes": {"chatter": {}}}, {"subscribes": {"rt/robot/chatter": {}}})
    assert (report.verdict, report.pair_count) == ("compatible", 1)


@pytest.mark.parametrize(("program", "pairs"), [("/chatter", 1), ("rt/chatter", 0)])
def test_a_topic_without_the_conventions_of_ros_2_keeps_its_name(program: str, pairs: int):
    node = {"publishes": {"/chatter": {"avoid_ros_namespace_conventions": True}}}
    assert judged(node, {"subscribes": {program: {}}}).pair_count == pairs


@pytest.mark.parametrize(
    ("type_name", "said"),
    [
        ("std_msgs::msg::dds_::String_", []),
        ("std_msgs::msg::String", ["DDS402", "CQ404", "CQ402"]),
        ("String", ["DDS402", "CQ404", "CQ402"]),
        (None, []),
    ],
)
def test_types_are_compared_as_they_are_mangled(type_name: str | None, said: list[str]):
    reader = {} if type_name is None else {"type": type_name}
    report = judged({"publishes": {"/chatter": NODE_STRING}}, {"subscribes": {"rt/chatter": reader}})
    assert codes(report) == said


def test_a_service_is_two_topics_on_the_wire():
    request = {"type": "demo::srv::dds_::Add_Request_", "reliability": "reliable"}
    response = {"type": "demo::srv::dds_::Add_Response_", "reliability": "reliable"}
    report = judged(
        {"serves": {"/add": {"type": "demo/srv/Add"}}},
        {
            "publishes": {"rq/addRequest": {**request, **XCDR1}},
            "subscribes": {"rr/addReply": {**response, "deadline": "1s"}},
        },
    )
    assert {(group.topic, str(group.verdict)) for group in report.groups} == {
        ("rq/addRequest", "compatible"),
        ("rr/addReply", "incompatible"),
    }
    assert codes(report) == ["DDS103"]


def test_domains_are_compared_across_protocols():
    node = {"domain": 3, "publishes": {"/chatter": {}}}
    apart = judged(node, {"domain": 4, "subscribes": {"rt/chatter": {}}})
    assert apart.pair_count == 0
    assert "DDS401" in codes(apart)
    assert judged(node, {"domain": 3, "subscribes": {"rt/chatter": {}}}).pair_count == 1


def test_zenoh_is_on_no_wire_of_dds():
    node = {"rmw": "zenoh", "publishes": {"/chatter": {}}}
    assert judged(node, {"subscribes": {"rt/chatter": {}}}).pair_count == 0


def test_a_partition_keeps_a_program_from_nodes():
    program = {"subscribers": {"left": {"partition": ["left"], "subscribes": {"rt/chatter": {}}}}}
    report = judged({"publishes": {"/chatter": {}}}, program)
    assert report.pair_count == 0
    assert "DDS403" in codes(report)


def test_a_verdict_that_depends_on_the_middleware_is_given_for_each():
    system = {
        "cqos": 1,
        "participants": {
            "node": {"protocol": "ros2", "subscribes": {"/chatter": {"reliability": "system_default"}}},
            "program": {"protocol": "dds", "publishes": {"rt/chatter": {"reliability": "best_effort"}}},
        },
    }
    report = check(json.dumps(system).encode(), importer="yaml")
    (finding,) = [finding for finding in report.findings if finding.code == "DDS101"]
    assert report.verdict == "unknown"
    assert {label: str(verdict) for label, verdict in finding.worlds.items()} == {
        "ros2.rmw=cyclonedds": "incompatible",
        "ros2.rmw=fastdds": "compatible",
        "ros2.rmw=connext": "compatible",
    }


@pytest.mark.parametrize("role", ["publishes", "subscribes"])
def test_policies_that_a_side_lacks_on_the_wire_are_not_reported(role: str):
    other = {"publishes": "subscribes", "subscribes": "publishes"}[role]
    node = {role: {"/chatter": {"lifespan": "10s", "history": "keep_last", "depth": 3}}}
    report = judged(node, {other: {"rt/chatter": XCDR1}})
    assert report.verdict == "compatible"
    # Its own pack has something to say of a subscription with a lifespan.
    assert codes(report) == ([] if role == "publishes" else ["ROS311"])


def test_middlewares_of_nodes_are_implementations_of_programs():
    report = judged(
        {"rmw": "fastdds", "publishes": {"/chatter": {"durability": "volatile"}}},
        {"implementation": "connext", "subscribes": {"rt/chatter": {}}},
    )
    assert (report.verdict, codes(report)) == ("compatible", ["DDS220"])


def test_what_a_running_node_never_sets_is_known():
    seen = {"reliability": "reliable", "durability": "volatile", "deadline": "infinite", "liveliness": "automatic"}
    times = {"liveliness_lease_duration": "infinite", "lifespan": "infinite", "observed": True}
    report = judged({"publishes": {"/chatter": {**seen, **times}}}, {"subscribes": {"rt/chatter": {}}})
    assert (report.verdict, codes(report)) == ("compatible", [])


def test_what_discovery_does_not_tell_of_a_node_stays_unknown():
    report = judged(
        {"publishes": {"/chatter": {"reliability": "reliable", "observed": True}}},
        {"subscribes": {"rt/chatter": {"liveliness.lease_duration": "1s"}}},
    )
    assert report.verdict == "unknown"
    assert codes(report) == ["DDS105"]


def test_a_node_keeps_for_late_readers_what_its_history_says():
    """Cyclone DDS keeps by its durability service, which rmw_cyclonedds sets."""
    latched = {"durability": "transient_local", "reliability": "reliable"}
    report = judged(
        {"publishes": {"/map": {**latched, "depth": 10}}}, {"subscribes": {"rt/map": {**latched, "history.depth": 5}}}
    )
    assert (report.verdict, codes(report)) == ("compatible", ["DDS203"])


def test_pairs_of_one_protocol_are_judged_once_and_by_their_own_pack():
    system = {
        "cqos": 1,
        "options": {"ros2": {"rmw": "cyclonedds"}, "dds": {"implementation": "cyclonedds", "extensibility": "final"}},
        "participants": {
            "talker": {"protocol": "ros2", "publishes": {"/chatter": {}}},
            "listener": {"protocol": "ros2", "subscribes": {"/chatter": {}}},
            "writer": {"protocol": "dds", "publishes": {"rt/chatter": {}}},
            "reader": {"protocol": "dds", "subscribes": {"rt/chatter": {}}},
        },
    }
    report = check(json.dumps(system).encode(), importer="yaml")
    assert sorted((pair.publisher.partition("/")[0], pair.subscriber.partition("/")[0]) for pair in report.pairs) == [
        ("talker", "listener"),
        ("talker", "reader"),
        ("writer", "listener"),
        ("writer", "reader"),
    ]
    assert {(group.protocol, group.verdict) for group in report.groups} == {
        ("ros2", "compatible"),
        ("dds", "compatible"),
    }


def test_nodes_alone_are_on_no_other_topic():
    system = {"cqos": 1, "protocol": "ros2", "participants": {"talker": {"publishes": {"/chatter": {}}}}}
    report = check(json.dumps(system).encode(), importer="yaml")
    assert {group.protocol for group in report.groups} <= {"ros2"}
    assert not any("rt/" in finding.message for finding in report.findings)


# Facts of a topic, in either protocol

TIMES = {"options": {"ros2": {"repair_time": "1ms"}}, "topics": {"/chatter": {"period": "100ms"}}}
SURE = {**XCDR1, "reliability": "reliable"}
NO_LOSS = {"needs": {"loss_free": True}}


@pytest.mark.parametrize(
    ("node", "program"),
    [
        (
            {"subscribes": {"/chatter": {"depth": 10, "taken_every": "10ms", **NO_LOSS}}},
            {"publishes": {"rt/chatter": SURE | {"history.depth": 10}}},
        ),
        (
            {"publishes": {"/chatter": {"depth": 10}}},
            {"subscribes": {"rt/chatter": SURE | {"history.depth": 10, "taken_every": "10ms"} | NO_LOSS}},
        ),
    ],
)
def test_facts_of_ros_2_decide_needs_on_the_wire(node: dict[str, Any], program: dict[str, Any]):
    unknown, known = judged(node, program), judged(node, program, **TIMES)
    assert (unknown.verdict, codes(unknown)) == ("unknown", ["DDS505", "DDS506"])
    assert (known.verdict, codes(known)) == ("compatible", [])


def test_what_they_decide_may_be_that_a_need_is_not_met():
    program = {"publishes": {"rt/chatter": SURE | {"history.depth": 1}}}
    report = judged({"subscribes": {"/chatter": {"depth": 10, **NO_LOSS}}}, program, **TIMES)
    (finding,) = [finding for finding in report.findings if finding.severity == "error"]
    assert (report.verdict, finding.code) == ("incompatible", "DDS505")
    facts = {fact.policy: (fact.value, fact.origin) for side in finding.sides for fact in side.facts}
    assert facts["period"] == ("100ms", "topic")
    assert facts["repair_time"][0] == "1ms"


@pytest.mark.parametrize(("stated", "verdict"), [("1ms", "incompatible"), ("100ms", "compatible")])
def test_what_the_topic_on_the_wire_states_itself_counts_there(stated: str, verdict: str):
    options = {"ros2": {"repair_time": "20ms"}}
    topics = {"/chatter": {"period": "1s"}, "rt/chatter": {"period": stated, "protocol": "dds"}}
    node = {"publishes": {"/chatter": {"depth": 5}}}
    program = {"subscribes": {"rt/chatter": SURE | {"history.depth": 5, "taken_every": "0s"} | NO_LOSS}}
    assert judged(node, program, options=options, topics=topics).verdict == verdict


def test_nodes_that_do_not_agree_say_nothing_of_the_network():
    system = {
        "cqos": 1,
        "topics": {"/chatter": {"period": "100ms"}},
        "participants": {
            "near": {"protocol": "ros2", "rmw": "cyclonedds", "round_trip_time": "1ms", **_hears()},
            "far": {"protocol": "ros2", "rmw": "cyclonedds", "round_trip_time": "1s", **_hears()},
            "program": {
                "protocol": "dds",
                "implementation": "cyclonedds",
                "publishes": {"rt/chatter": SURE | {"history.depth": 10}},
            },
        },
    }
    report = check(json.dumps(system).encode(), importer="yaml")
    assert report.verdict == "unknown"
    assert set(codes(report)) == {"DDS505", "DDS506"}


def _hears() -> dict[str, Any]:
    return {"subscribes": {"/chatter": {"depth": 10, **NO_LOSS}}}


def test_a_latched_topic_is_latched_for_programs_too():
    latched = {"reliability": "reliable", "durability": "transient_local"}
    report = judged({"publishes": {"/map": {**latched, "depth": 1}}}, {"subscribes": {"rt/map": SURE}})
    alone = judged({"publishes": {"/elsewhere": {**latched, "depth": 1}}}, {"subscribes": {"rt/elsewhere": SURE}})
    assert "DDS202" in codes(report)
    assert "DDS202" not in codes(alone)
    again_and_again = judged({"publishes": {"/map": {"depth": 1}}}, {"subscribes": {"rt/map": SURE}})
    assert "DDS207" not in codes(again_and_again)
