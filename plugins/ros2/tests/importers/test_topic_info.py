"""Snapshots: every shape that `ros2 topic info --verbose` had, and what stands around it in a terminal."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cqos_core import InputError, Problem, System, check
from cqos_core.files.importer_choice import recognise
from cqos_core.files.source_reader import read_source
from cqos_core.model.source import ReadContext, Source
from cqos_core.plugins import load_plugins
from cqos_ros2.importers.detect_observed import claims_topic_info
from cqos_ros2.importers.topic_headings import full_name, heading, named_by_file
from cqos_ros2.importers.topic_info import read
from cqos_ros2.pack import PACK
from tests.explained_values import rows
from tests.growth.linear import assert_linear

CASES = Path(__file__).parent / "cases" / "topic_info"
FILES = sorted(CASES.iterdir())
POLICIES = ("reliability", "history", "depth", "durability", "lifespan", "deadline", "liveliness", "lease_duration")


def snapshot(text, name="dump.txt", topic=None):
    options = {} if topic is None else {"topic_info": {"topic": topic}}
    return read(Source(name, text.encode()), ReadContext(options=options))


def from_case(name):
    return read(Source(name, (CASES / name).read_bytes()), ReadContext())


def values(system):
    """Each endpoint with its type and values, `?` for what is not known."""
    shown = rows(system, PACK, POLICIES)
    return [f"{each.id} | {each.type or '?'} | {shown[each.id]}" for each in system.endpoints]


def said(system):
    return [
        f"{note.code} {note.severity} {note.place.line}:{note.place.column} {note.message}" for note in system.notes
    ]


def problems(text, **where):
    with pytest.raises(InputError) as error:
        snapshot(text, **where)
    return [(each.code, each.place.line, each.place.column) for each in error.value.problems]


BLOCK = """\
Node name: {node}
Node namespace: /
Topic type: std_msgs/msg/String
Endpoint type: {kind}
GID: {gid}
QoS profile:
  Reliability: {reliability}
  Durability: VOLATILE
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite

"""


def block(node="talker", kind="PUBLISHER", gid="01.02", reliability="RELIABLE"):
    return BLOCK.format(node=node, kind=kind, gid=gid, reliability=reliability)


def whole(publishers="", subscriptions="", counts=(0, 0)):
    first, second = f"Publisher count: {counts[0]}", f"Subscription count: {counts[1]}"
    return f"Type: std_msgs/msg/String\n\n{first}\n\n{publishers}{second}\n\n{subscriptions}"


# Every shape

EXPECTED = {
    "foxy_fastdds.txt": [
        "/mavros/imu/publisher/mavros/imu/data | sensor_msgs/msg/Imu | best_effort ? ? volatile infinite infinite automatic infinite",
        "/mavros/setpoint_position/subscriber/mavros/setpoint_position/local | geometry_msgs/msg/PoseStamped | reliable ? ? transient_local 20ms 30ms manual_by_topic infinite",
    ],
    "galactic_cyclonedds.txt": [
        "/minimal_publisher/publisher/topic | std_msgs/msg/String | reliable ? ? volatile infinite infinite automatic infinite",
        "/minimal_subscriber/subscriber/topic | std_msgs/msg/String | reliable ? ? volatile infinite infinite automatic infinite",
    ],
    "humble_headings.md": [
        "_CREATED_BY_BARE_DDS_APP_@01.0f.0b.5c.8b.7d.00.00.01.00.00.00.00.00.01.03/publisher/utlidar/imu | sensor_msgs/msg/Imu | reliable ? ? volatile infinite infinite automatic infinite",
        "_CREATED_BY_BARE_DDS_APP_@01.0f.0b.5c.8b.7d.00.00.01.00.00.00.00.00.02.03/publisher/utlidar/imu | sensor_msgs/msg/Imu | best_effort ? ? volatile infinite infinite automatic infinite",
        "/localization/filter/subscriber/utlidar/imu#01.0f.10.96.e7.38.59.9d.01.00.00.00.00.00.7d.04 | sensor_msgs/msg/Imu | reliable ? ? volatile infinite infinite automatic infinite",
        "/localization/filter/subscriber/utlidar/imu#01.0f.10.96.e7.38.59.9d.01.00.00.00.00.00.7e.04 | sensor_msgs/msg/Imu | best_effort keep_last ? volatile infinite infinite automatic infinite",
    ],
    "iron_type_hash.txt": [
        "/demo/speaker/publisher/chatter | std_msgs/msg/String | reliable keep_last 10 volatile infinite 2s automatic infinite",
    ],
    "jazzy_loop.txt": [
        "/map_server/publisher/map | nav_msgs/msg/OccupancyGrid | reliable keep_last 1 transient_local infinite infinite automatic infinite",
        "_NODE_NAME_UNKNOWN_@01.10.6c.2f.1e.0a.9b.42.6d.7f.01.b2.00.00.15.03/publisher/map | nav_msgs/msg/OccupancyGridUpdate | ? keep_all ? ? infinite infinite ? infinite",
        "/planner/global/costmap/subscriber/map | nav_msgs/msg/OccupancyGrid | reliable keep_last 1 transient_local infinite infinite manual_by_topic 5s",
    ],
    "documentation_indented.txt": [
        "/ImagePublisher/publisher/camera/image_raw | sensor_msgs/msg/Image | best_effort keep_last 100 volatile infinite infinite automatic infinite",
    ],
}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_what_every_shape_shows(file):
    assert values(from_case(file.name)) == EXPECTED[file.name]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_shape_is_recognised_by_its_content(file):
    found = recognise(Source("whatever", file.read_bytes()[:65536]), load_plugins())
    assert found is not None
    assert found.name == "topic_info"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        *((name, []) for name in EXPECTED if name != "jazzy_loop.txt"),
        ("jazzy_loop.txt", ["ROS903 note 59:18 3 publishers of `/tf_static` are counted, 0 shown"]),
    ],
)
def test_every_shape_gives_its_expected_notes(name, expected):
    assert said(from_case(name)) == expected


def test_endpoints_are_observed_and_their_values_have_places():
    system = from_case("iron_type_hash.txt")
    (endpoint,) = system.endpoints
    assert endpoint.observed
    assert system.protocol == "ros2"
    assert str(endpoint.place) == "iron_type_hash.txt:7:12"
    places = {name: (setting.place.line, setting.place.column) for name, setting in endpoint.settings.items()}
    assert places["reliability"] == (14, 16)
    assert places["history"] == (15, 20)
    assert places["depth"] == (15, 31)
    assert places["liveliness_lease_duration"] == (20, 30)


def test_nodes_are_participants_and_what_is_no_node_is_one_for_each_endpoint():
    participants = from_case("humble_headings.md").participants
    assert [participant.label for participant in participants.values()] == [
        "a DDS application (01.0f.0b.5c.8b.7d.00.00.01.00.00.00.00.00.01.03)",
        "a DDS application (01.0f.0b.5c.8b.7d.00.00.01.00.00.00.00.00.02.03)",
        "/localization/filter",
    ]


def test_nothing_is_invented():
    """Values that discovery does not report are unknown, and rules about creating endpoints do not apply to running ones."""
    report = check(
        snapshot(
            whole(block(), block("listener", "SUBSCRIPTION", reliability="UNKNOWN"), (1, 1)).replace(
                "Infinite", "UNKNOWN"
            ),
            topic="/t",
        )
    )
    assert not [finding for finding in report.findings if finding.code.startswith("ROS3")]
    reliable = snapshot(whole(block(reliability="UNKNOWN"), block("listener", "SUBSCRIPTION"), (1, 1)), topic="/t")
    assert check(reliable).verdict == "unknown"
    assert check(from_case("galactic_cyclonedds.txt")).verdict == "compatible"


def test_a_snapshot_shows_what_does_not_fit():
    report = check(from_case("humble_headings.md"))
    assert report.verdict == "incompatible"
    (finding,) = (each for each in report.findings if each.code == "ROS101")
    assert [str(fact.place) for side in finding.sides for fact in side.facts] == [
        "humble_headings.md:45:16",
        "humble_headings.md:29:16",
    ]


# The name of the topic


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("$ ros2 topic info -v /chatter", "/chatter"),
        ("user@host:~/ws$ ros2 topic info /a/b_1 --verbose", "/a/b_1"),
        ('jetson@nano:~$ ros2 topic info -v "/mavros/pose"', "/mavros/pose"),
        ("ros2 topic info --spin-time 5 --no-daemon -v '/x' | tee x.txt", "/x"),
        ("➜  ~ ros2 topic info chatter -v", "/chatter"),
        ("From `ros2 topic info -v /scan`:", "/scan"),
        ("### /chatter", "/chatter"),
        ("## Topic /robot/scan", "/robot/scan"),
        ("=== /chatter ===", "/chatter"),
        ("--- /chatter ---", "/chatter"),
        ("> **/chatter**", "/chatter"),
        ("* `/chatter`:", "/chatter"),
        ("Topic: /chatter", "/chatter"),
        ("topic name = /chatter", "/chatter"),
        ("[/chatter]", "/chatter"),
        ("/chatter", "/chatter"),
        ("/chatter:", "/chatter"),
        ("/chatter [std_msgs/msg/String]", "/chatter"),
        ("$ for t in $(ros2 topic list); do ros2 topic info -v $t; done", None),
        ("$ ros2 topic list", None),
        ("Unknown topic '/chatter'", None),
    ],
)
def test_lines_that_say_what_comes_next(line, name):
    said = heading(line)
    assert said is not None
    assert said.name == name
    if name is not None:
        assert line[said.column - 1 :].startswith(name.removeprefix("/") if name not in line else name)


@pytest.mark.parametrize(
    "line",
    ["", "   ", "...", "text about /chatter and more", "/not a topic", "/1st", "a/b", "//", "/x" * 400, "# a comment"],
)
def test_lines_that_say_nothing(line):
    assert heading(line) is None


@pytest.mark.parametrize(
    ("name", "topic"),
    [
        ("chatter.txt", "/chatter"),
        ("logs/ros2_topic_info__scan.txt", "/scan"),
        ("topic_info_robot__scan.log", "/robot/scan"),
        ("info-chatter.txt", "/chatter"),
        ("camera.info.txt", "/camera"),
        ("dump.txt", None),
        ("map_info.txt", None),
        ("map-snapshot.txt", None),
        ("ros2_topic_info.txt", None),
        ("ros2_topic_info_dump.txt", None),
        ("2024-01-01.txt", None),
        ("<stdin>", None),
        ("<bytes>", None),
        ("", None),
    ],
)
def test_names_of_files(name, topic):
    assert named_by_file(name) == topic


def test_the_file_name_is_a_guess_and_said_to_be_one():
    system = snapshot(whole(block(), counts=(1, 0)), "chatter.txt")
    assert [endpoint.topic for endpoint in system.endpoints] == ["/chatter"]
    assert system.endpoints[0].topic_is_guess
    assert said(system) == ["ROS902 note 1:7 the snapshot is taken to be of `/chatter`, after the name of the file"]


def test_the_switch_names_the_one_topic_without_a_name():
    text = f"{whole(block(), counts=(1, 0))}### /named\n{whole(block(), counts=(1, 0))}"
    system = snapshot(text, topic="given")
    assert [endpoint.topic for endpoint in system.endpoints] == ["/given", "/named"]
    assert not system.notes
    assert not any(endpoint.topic_is_guess for endpoint in system.endpoints)
    assert snapshot(whole(), "chatter.txt", topic="/given").notes == []


def test_a_snapshot_without_a_name_is_a_topic_of_its_own():
    def topics(*arguments, **options):
        system = snapshot(*arguments, **options)
        return [endpoint.topic for endpoint in system.endpoints], [line[:12] for line in said(system)]

    one = whole(block(), counts=(1, 0))
    assert topics(one, "map_info.txt") == (["/unnamed/in_map_info_txt/line_1"], ["ROS901 note "])
    two = ["/unnamed/in_chatter_txt/line_1", "/unnamed/in_chatter_txt/line_20"]
    assert topics(one * 2, "chatter.txt") == (two, ["ROS901 note "] * 2)
    assert full_name("/a//b") is None


def test_of_a_list_of_topics_none_is_the_one_that_follows():
    (line,) = said(snapshot(f"$ ros2 topic list\n/chatter\n\n/rosout\n\n{whole()}"))
    assert line.startswith("ROS901 note 6:7")
    assert snapshot(f"$ ros2 topic list\n/chatter\n/rosout\n$ ros2 topic info /chatter -v\n{whole()}").notes == []


@pytest.mark.parametrize("switches", [{"topic": "no name"}, {"topic": ""}, {"topics": "/x"}])
def test_switches_that_make_no_sense_are_refused(switches):
    with pytest.raises(InputError) as error:
        read(Source("x", whole().encode()), ReadContext(options={"topic_info": switches}))
    assert [each.code for each in error.value.problems] == ["CQ047"]


# Whole and not whole


def test_counts_that_disagree_are_a_note():
    system = snapshot("/t\n" + whole(block(), counts=(2, 1)))
    assert said(system) == [
        "ROS903 note 4:18 2 publishers of `/t` are counted, 1 shown",
        "ROS903 note 19:21 1 subscribers of `/t` are counted, 0 shown",
    ]
    hidden = [(part.kind, part.name, part.endpoints) for each in system.notes for part in each.parts]
    assert hidden == [("endpoint", "publisher of /t", 1), ("endpoint", "subscriber of /t", 1)]


def test_without_verbose_nothing_is_shown():
    system = snapshot("Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 1\n", topic="/t")
    assert [note.help for note in system.notes] == ["take the snapshot with `--verbose`"] * 2
    eloquent = snapshot("Type: std_msgs/msg/String\nPublisher count: 1\nSubscriber count: 0\n", topic="/t")
    assert [note.code for note in eloquent.notes] == ["ROS903"]


def test_truncated_output_is_a_warning():
    text = "/t\n" + whole(block(), counts=(1, 0))
    assert [note.code for note in snapshot(text.partition("Subscription")[0]).notes] == ["ROS904"]
    cut = snapshot(text.partition("  Deadline")[0])
    assert said(cut) == [
        "ROS904 warning 6:12 this endpoint lacks Deadline, Liveliness and Liveliness lease duration: the output is cut off",
        "ROS904 warning 2:7 the snapshot of `/t` ends before its subscriptions: the output is cut off",
    ]
    assert values(cut) == [
        "/talker/publisher/t | std_msgs/msg/String | reliable ? ? volatile infinite ? ? ?",
    ]
    bare = snapshot(text.partition("Node namespace")[0])
    assert values(bare) == ["/talker/publisher/t | ? | ? ? ? ? ? ? ? ?"]


def test_an_endpoint_without_a_side_is_refused():
    assert problems("/t\n" + block().partition("Endpoint type")[0]) == [("CQ011", 2, 12)]
    assert problems("/t\n" + block(kind="INVALID")) == [("CQ011", 5, 16)]


def test_a_block_alone_is_enough():
    system = snapshot(f"We see\n\n{block()}and more", "chatter.txt")
    assert values(system) == [
        "/talker/publisher/chatter | std_msgs/msg/String | reliable ? ? volatile infinite infinite automatic infinite"
    ]
    assert [note.code for note in system.notes] == ["ROS902"]


def test_an_unknown_policy_is_a_warning():
    text = "/t\n" + whole(block().replace("  Lifespan", "  Ownership: SHARED\n  Lifespan"), counts=(1, 0))
    assert said(snapshot(text)) == [
        "ROS905 warning 14:3 `Ownership` is no policy that `ros2 topic info` is known to print"
    ]


def test_the_same_endpoint_seen_twice_is_one():
    first, second = (whole(block(reliability=word), counts=(1, 0)) for word in ("RELIABLE", "BEST_EFFORT"))
    same = snapshot(f"/t\n{first}/t\n{first}")
    assert len(same.endpoints) == 1
    assert not same.notes
    changed = snapshot(f"/t\n{first}/t\n{second}")
    assert values(changed)[0].endswith("best_effort ? ? volatile infinite infinite automatic infinite")
    assert [note.code for note in changed.notes] == ["ROS906"]
    restarted = snapshot(f"/t\n{whole(block() + block(gid='01.03'), counts=(2, 0))}")
    assert [endpoint.id for endpoint in restarted.endpoints] == [
        "/talker/publisher/t#01.02",
        "/talker/publisher/t#01.03",
    ]


def test_endpoints_without_a_gid_stay_apart():
    text = whole(block(node="_NODE_NAME_UNKNOWN_", gid="") * 2 + block(gid="") * 2, counts=(4, 0))
    assert [endpoint.id for endpoint in snapshot("/t\n" + text).endpoints] == [
        "_NODE_NAME_UNKNOWN_@1/publisher/t",
        "_NODE_NAME_UNKNOWN_@2/publisher/t",
        "/talker/publisher/t#1",
        "/talker/publisher/t#2",
    ]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_the_encodings_of_windows(encoding):
    data = (CASES / "iron_type_hash.txt").read_text().replace("\n", "\r\n").encode(encoding)
    assert claims_topic_info("x", data)
    assert values(read(Source("x.txt", data), ReadContext())) == EXPECTED["iron_type_hash.txt"]


@pytest.mark.parametrize("data", [b"", b"\n", b"Type: x\n", b"\x00\xff", b"Node: x\nType: y"])
def test_what_holds_no_snapshot_is_refused(data):
    assert not claims_topic_info("x.txt", data)
    with pytest.raises(InputError) as error:
        read(Source("x.txt", data), ReadContext())
    assert [(each.code, each.place.line) for each in error.value.problems] == [("CQ001", 1)]


# Whatever the input

WORDS = [
    *(
        "Type:",
        "Publisher count: 1",
        "Subscription count: 99999999999999999999",
        "Node name:",
        "Endpoint type: INVALID",
    ),
    *(
        "GID: ..",
        "QoS profile:",
        "  Deadline: -1",
        "  History (Depth): KEEP_LAST (",
        "/t",
        "### /t",
        "$ ros2 topic info",
    ),
    *("\r\n", "\n\n", "\x00", "\t", "é", "➜", ":" * 50, " " * 200, "A" * 100),
]


@settings(deadline=None)
@given(
    st.sampled_from([file.read_text() for file in FILES]),
    st.lists(st.tuples(st.integers(0, 5000), st.integers(0, 300), st.sampled_from(["", *WORDS])), max_size=6),
)
def test_whatever_is_changed_gives_a_system_or_located_problems(text, changes):
    for start, length, word in changes:
        text = text[:start] + word + text[start + length :]
    refused: tuple[Problem, ...] = ()
    try:
        system = read_source(Source("x.txt", text.encode("utf-8", "replace")), "topic_info")
    except InputError as error:
        system, refused = System(), error.problems
    places = [each.place for each in refused] + [each.place for each in system.endpoints]
    assert all(place is not None and place.line for place in places)
    assert {endpoint.participant for endpoint in system.endpoints} <= system.participants.keys()
    check(system)


@pytest.mark.parametrize("piece", ["A", "A ", " ", "/a", "=", ":"])
def test_long_lines_take_linear_time(piece):
    def look(size: int) -> None:
        line = (piece * size)[:size]
        text = f"{line}\n{block()}{line}\n".encode()
        assert claims_topic_info("x", text)
        read(Source("chatter.txt", text), ReadContext())

    assert_linear(look, 50_000)
