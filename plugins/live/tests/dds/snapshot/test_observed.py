"""From what discovery tells to a system; and the names of ROS 2, read backwards."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import System, check
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Role
from cqos_live.dds.snapshot import ros
from cqos_live.dds.snapshot.observed import system_of
from cqos_live.dds.snapshot.ros import RosName, demangled
from cqos_live.dds.snapshot.seen_endpoints import Seen, SeenEndpoint, SeenNode, SeenParticipant, SeenTopic

STRING = "std_msgs::msg::dds_::String_"
PLAIN = {"data_representation": "[xcdr1]", "ownership": "shared", "partition": "[]", "durability": "volatile"}
WRITER, READER = ("p", PUBLISHER), ("p", SUBSCRIBER)


def endpoint(role: Role, topic: str, type_name: str = STRING, key: str = "p1", **settings: Any) -> SeenEndpoint:
    return SeenEndpoint(key, "p", role, topic, type_name, {**PLAIN, **settings})


def seen(*endpoints: SeenEndpoint, implementation: str | None = "cyclonedds") -> Seen:
    return Seen(7, [SeenParticipant("p", "node", implementation)], list(endpoints))


def said(system: System) -> list[tuple[str, ...]]:
    return [(each.protocol or "dds", each.kind, each.topic or "", each.type or "") for each in system.endpoints]


@pytest.mark.parametrize(
    ("topic", "type_name", "name"),
    [
        ("rt/chatter", STRING, RosName("topic", "/chatter", "std_msgs/msg/String")),
        (
            "rt/robot/scan",
            "sensor_msgs::msg::dds_::LaserScan_",
            RosName("topic", "/robot/scan", "sensor_msgs/msg/LaserScan"),
        ),
        ("/chatter", STRING, RosName("topic", "/chatter", "std_msgs/msg/String", plain=True)),
        ("rq/addRequest", "demo::srv::dds_::Add_Request_", RosName("request", "/add", "demo/srv/Add")),
        ("rr/addReply", "demo::srv::dds_::Add_Response_", RosName("response", "/add", "demo/srv/Add")),
        (
            "rq/go/_action/send_goalRequest",
            "nav::action::dds_::Go_SendGoal_Request_",
            RosName("request", "/go/_action/send_goal", "nav/action/Go_SendGoal"),
        ),
        # not named by the rules of ROS 2
        ("rt/chatter", "std_msgs::msg::String", None),
        ("rt/chatter", "Chatter", None),
        ("chatter", STRING, None),
        ("rt", STRING, None),
        ("rt/", STRING, None),
        ("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", None),
        ("rq/add", "demo::srv::dds_::Add_Request_", None),
        ("rq/Request", "demo::srv::dds_::Add_Request_", None),
        ("rq/addRequest", "demo::srv::dds_::Add_", None),
        ("rr/addRequest", "demo::srv::dds_::Add_Response_", None),
        ("rp/parameters", STRING, None),
    ],
)
def test_names_of_ros_2(topic: str, type_name: str, name: RosName | None):
    assert demangled(topic, type_name) == name


def test_a_topic_of_ros_2_is_one():
    system = system_of(seen(endpoint(PUBLISHER, "rt/chatter", reliability="reliable", deadline="1s")), with_ros=True)
    assert said(system) == [("ros2", "message", "/chatter", "std_msgs/msg/String")]
    (only,) = system.endpoints
    assert only.id == "node/publisher/chatter"
    assert only.observed
    assert {name: setting.text for name, setting in only.settings.items()} == {
        "durability": "volatile",
        "reliability": "reliable",
        "deadline": "1s",
    }
    assert system.participants["node"].settings["rmw"].text == "cyclonedds"
    assert {pack: options["domain"].text for pack, options in system.options.items()} == {"dds": "7", "ros2": "7"}


def test_a_topic_that_goes_without_its_prefix_says_so():
    (only,) = system_of(seen(endpoint(PUBLISHER, "/chatter")), with_ros=True).endpoints
    assert only.topic == "/chatter"
    assert only.settings["avoid_ros_namespace_conventions"].text == "true"


@pytest.mark.parametrize(
    "lost",
    [
        {"ownership": "exclusive"},
        {"partition": "[left]"},
        {"durability": "transient"},
        {"latency_budget": "1ms"},
        {"destination_order": "by_source_timestamp"},
        {"presentation.access_scope": "topic"},
        {"presentation.coherent_access": "true"},
        {"presentation.ordered_access": "true"},
        {"time_based_filter": "1s"},
        {"data_representation": "[xcdr2]"},
        {"data_representation": "[xcdr1, xcdr2]"},
    ],
    ids=lambda lost: next(f"{name}={text}" for name, text in lost.items()),
)
def test_nothing_that_matters_is_lost_in_the_words_of_ros_2(lost: dict[str, str]):
    (only,) = system_of(seen(endpoint(SUBSCRIBER, "rt/chatter", **lost)), with_ros=True).endpoints
    assert (only.protocol, only.topic, only.type) == (None, "rt/chatter", STRING)
    assert only.label == "/chatter of ROS 2"


def test_an_unreported_representation_is_not_invented():
    unknown = endpoint(PUBLISHER, "rt/chatter")
    del unknown.settings["data_representation"]
    assert said(system_of(seen(unknown), with_ros=True)) == [("dds", "message", "rt/chatter", STRING)]


@pytest.mark.parametrize("implementation", ["opendds", "rustdds", "dust", None])
def test_who_does_not_run_ros_2_stays_in_dds(implementation: str | None):
    system = system_of(seen(endpoint(PUBLISHER, "rt/chatter"), implementation=implementation), with_ros=True)
    assert said(system) == [("dds", "message", "rt/chatter", STRING)]
    settings = system.participants["node"].settings
    assert settings.keys() == ({"implementation"} if implementation else set())


def test_without_the_pack_of_ros_2_all_stays_in_dds():
    system = system_of(seen(endpoint(PUBLISHER, "rt/chatter")), with_ros=False)
    assert said(system) == [("dds", "message", "rt/chatter", STRING)]
    assert system.options.keys() == {"dds"}


REQUEST, RESPONSE = "demo::srv::dds_::Add_Request_", "demo::srv::dds_::Add_Response_"


def test_a_service_is_made_of_its_topics():
    server = [
        endpoint(SUBSCRIBER, "rq/addRequest", REQUEST, "1", reliability="reliable"),
        endpoint(PUBLISHER, "rr/addReply", RESPONSE, "2", reliability="reliable", lifespan="infinite"),
    ]
    client = [
        endpoint(PUBLISHER, "rq/addRequest", REQUEST, "3", reliability="reliable", lifespan="infinite"),
        endpoint(SUBSCRIBER, "rr/addReply", RESPONSE, "4", reliability="reliable"),
    ]
    system = system_of(seen(*server, *client), with_ros=True)
    assert said(system) == [
        ("ros2", "service_server", "/add", "demo/srv/Add"),
        ("ros2", "service_client", "/add", "demo/srv/Add"),
    ]
    report = check(system)
    assert (report.verdict, report.pair_count) == ("compatible", 2)


def test_what_makes_no_service_stays_what_it_is():
    unlike = [
        endpoint(SUBSCRIBER, "rq/addRequest", REQUEST, "1", reliability="reliable"),
        endpoint(PUBLISHER, "rr/addReply", RESPONSE, "2", reliability="best_effort"),
        endpoint(PUBLISHER, "rr/addReply", RESPONSE, "3", reliability="best_effort"),
    ]
    system = system_of(seen(*unlike), with_ros=True)
    assert sorted(said(system)) == [
        ("dds", "message", "rq/addRequest", REQUEST),
        ("dds", "message", "rr/addReply", RESPONSE),
        ("dds", "message", "rr/addReply", RESPONSE),
    ]
    assert len({each.id for each in system.endpoints}) == 3


def test_participants_are_called_by_what_is_known_of_them():
    people = [
        SeenParticipant("0110aaaa-0000-0000-0000-0001000001c1", "talker", "cyclonedds", "python", "12", "robot"),
        SeenParticipant("0110aaaa-0000-0000-0000-0002000001c1", "", "cyclonedds", "talker"),
        SeenParticipant("010faaaa-0000-0000-0000-0003000001c1", "/", "fastdds", "", "13", "robot"),
    ]
    stranger = SeenEndpoint("e", "9999bbbb-0000-0000-0000-0004000001c1", PUBLISHER, "t", "T", {})
    system = system_of(Seen(0, people, [stranger]), with_ros=True)
    assert {each.id: each.label for each in system.participants.values()} == {
        "talker": "talker (python, pid 12, on robot)",
        "talker~2": None,
        "fastdds_aaaa0000000000000003": "fastdds_aaaa0000000000000003 (pid 13, on robot)",
        "participant_bbbb0000000000000004": None,
    }


def test_nodes_take_their_endpoints_out_of_the_process():
    what = seen(
        endpoint(PUBLISHER, "rt/a", key="1"),
        endpoint(PUBLISHER, "rt/b", key="2"),
        endpoint(PUBLISHER, "rt/c", key="3", partition="[left]"),
        endpoint(PUBLISHER, "rt/d", key="4"),
    )
    what.nodes = [
        SeenNode("p", "/left", "eye", frozenset({"1"})),
        SeenNode("p", "/right", "eye", frozenset({"2", "3"})),
        SeenNode("nobody", "/", "gone", frozenset({"4"})),
    ]
    system = system_of(what, with_ros=True)
    assert {each.topic: each.participant for each in system.endpoints} == {
        "/a": "eye",
        "/b": "eye~2",
        "rt/c": "eye~2",
        "/d": "node",
    }
    namespaces = {name: each.settings.get("namespace") for name, each in system.participants.items()}
    assert {name: each and each.text for name, each in namespaces.items()} == {
        "eye": "/left",
        "eye~2": None,
        "node": None,
    }
    assert not [each for each in check(system).findings if each.severity == "error"]


def test_nodes_are_separate_participants_only_with_the_ros_2_pack():
    what = seen(endpoint(PUBLISHER, "rt/a", key="1"))
    what.nodes = [SeenNode("p", "/", "eye", frozenset({"1"}))]
    assert system_of(what, with_ros=False).participants.keys() == {"node"}


def test_an_unused_topic_is_listed_with_its_type():
    what = seen(endpoint(PUBLISHER, "used", "Used"))
    what.topics = [SeenTopic("used", "Used"), SeenTopic("spare", "Spare")]
    system = system_of(what, with_ros=True)
    assert {name: topic.settings["type"].text for name, topic in system.topics.items()} == {"spare": "Spare"}


names = st.from_regex(r"[a-z][a-z0-9_]{0,5}(/[a-z][a-z0-9_]{0,5}){0,2}", fullmatch=True)
words = st.from_regex(r"[A-Za-z][A-Za-z0-9]{0,5}", fullmatch=True)


@given(st.text(max_size=12), st.text(max_size=12))
def test_any_name_is_read_without_a_fault(topic, type_name):
    assert demangled(topic, f"a::msg::dds_::{type_name}_") is None or topic.count("/")


@given(names, words, words)
def test_no_two_topics_of_the_wire_are_one_in_ros_2(name, package, message):
    types = f"{package}::msg::dds_::{message}_"
    prefixed, plain = demangled(f"rt/{name}", types), demangled(f"/{name}", types)
    assert prefixed is not None
    assert plain is not None
    assert (prefixed.name, prefixed.plain) != (plain.name, plain.plain)


def test_the_policies_of_ros_2_are_those_that_its_pack_puts_on_the_wire():
    from cqos_ros2.pack import PACK as ROS2
    from cqos_ros2.wire import WIRE

    # No announcement contains how often a program takes samples.
    unseen = ("durability_service.", "taken_every")
    pairs = {(on_wire, own) for own, on_wire in WIRE.translations() if not on_wire.startswith(unseen)}
    # What a file of the middleware sets makes it no endpoint that all of ROS 2 knows.
    others = {(on_wire, own) for on_wire, own in pairs if on_wire in ros.ALWAYS and on_wire not in ros.POLICIES}
    assert {own: set(ros.ALWAYS[on_wire]) for on_wire, own in others} == {
        policy.name: {policy.default} for policy in ROS2.policies if policy.unseen
    }
    assert pairs - others == set(ros.POLICIES.items())


@given(names, words, words)
def test_names_come_back_as_the_pack_of_ros_2_mangles_them(name, package, message):
    from cqos_ros2 import wire

    topic, type_name = wire.topic(f"/{name}", {}), wire.type_name(f"{package}/msg/{message}")
    assert topic is not None
    assert demangled(topic, type_name) == RosName("topic", f"/{name}", f"{package}/msg/{message}")


@pytest.mark.parametrize(
    ("kinds", "keyed"), [((True, True), "true"), ((False,), "false"), ((True, False), None), ((None,), None)]
)
def test_a_topic_has_keys_where_all_its_endpoints_say_so(kinds: tuple[bool | None, ...], keyed: str | None):
    ends = [SeenEndpoint(f"p{n}", "p", PUBLISHER, "t", "T", {}, keyed=kind) for n, kind in enumerate(kinds)]
    topics = system_of(seen(*ends), with_ros=False).topics
    assert {name: each.settings["keyed"].text for name, each in topics.items()} == (
        {} if keyed is None else {"t": keyed}
    )
