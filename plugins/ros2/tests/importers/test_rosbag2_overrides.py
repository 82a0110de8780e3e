"""Files for `--qos-profile-overrides-path`: what they replace, and what `ros2 bag` refuses."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cqos_core import InputError, Problem, System, check
from cqos_core.files.importer_choice import recognise
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import ReadContext, Source
from cqos_core.plugins import load_plugins
from cqos_ros2.importers.detect_observed import claims_rosbag2_overrides
from cqos_ros2.importers.rosbag2 import PLAYER, RECORDER
from cqos_ros2.importers.rosbag2_overrides import read
from cqos_ros2.pack import PACK
from tests.explained_values import facts, rows
from tests.growth.linear import assert_linear

CASES = Path(__file__).parent / "cases" / "rosbag2_overrides"
FILES = sorted(CASES.iterdir())
BAG = """\
rosbag2_bagfile_information:
  version: 9
  topics_with_message_count:
    - topic_metadata: {name: /imu, offered_qos_profiles: []}
    - topic_metadata:
        name: /camera/image
        offered_qos_profiles:
        - history: keep_last
          depth: 1
          reliability: best_effort
          durability: transient_local
          deadline: {sec: 1, nsec: 0}
          lifespan: {sec: 1, nsec: 0}
          liveliness: manual_by_topic
          liveliness_lease_duration: {sec: 1, nsec: 0}
          avoid_ros_namespace_conventions: false
    - topic_metadata: {name: /map, offered_qos_profiles: []}
"""
POLICIES = (
    *("history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness"),
    *("liveliness_lease_duration", "avoid_ros_namespace_conventions"),
)


def overrides(text):
    return read(Source("o.yaml", text.encode()), ReadContext())


def laid_over(text, seen_as="player"):
    """The bag's topics, and the overrides laid over them."""
    switches = {"rosbag2": {"as": seen_as}}
    sources = (Source("metadata.yaml", BAG.encode()), Source("o.yaml", text.encode()))
    return merge([read_source(source, None, switches) for source in sources])


def values(system):
    """The values of each topic of a bag, `?` for what is not known."""
    return {name.partition("/")[2].partition("/")[2]: row for name, row in rows(system, PACK, POLICIES).items()}


def problems(text):
    with pytest.raises(InputError) as error:
        overrides(text)
    return [(each.code, each.place.line, each.place.column) for each in error.value.problems]


DEFAULT = "keep_last 10 reliable volatile infinite infinite automatic infinite false"


def test_an_override_replaces_the_whole_profile():
    """What it does not state has its default, not the recorded value."""
    found = values(laid_over((CASES / "reference.yaml").read_text()))
    assert found["camera/image"] == "keep_last 2 best_effort volatile 50ms infinite automatic infinite false"
    assert found["imu"] == DEFAULT


def test_every_policy_can_be_overridden():
    found = values(laid_over((CASES / "everything.yaml").read_text()))
    assert found["imu"] == "keep_all 10 reliable transient_local 1500ms 10s manual_by_topic 2s false"
    assert found["map"] == "keep_last 1 reliable volatile infinite infinite automatic infinite false"


def test_origin_and_place_show_where_a_value_comes_from():
    found = facts(laid_over((CASES / "reference.yaml").read_text()), of="rosbag2_player/publisher/camera/image")
    origins = {name: found[name] for name in ("reliability", "deadline", "durability")}
    assert {name: (fact.origin, str(fact.place)) for name, fact in origins.items()} == {
        "reliability": ("rosbag2 override", "o.yaml:5:16"),
        "deadline": ("rosbag2 override", "o.yaml:6:13"),
        "durability": ("rosbag2 override", "o.yaml:2:1"),
    }


def test_with_the_recorder_it_is_the_subscriptions_that_are_overridden():
    system = laid_over("/imu: {depth: 3, reliability: best_effort}\n", "recorder")
    row = "keep_last 3 best_effort volatile infinite infinite automatic infinite false"
    assert rows(system, PACK, POLICIES)["rosbag2_recorder/subscriber/imu"] == row


def test_what_was_recorded_is_not_overridden():
    switches = {"rosbag2": {"as": "recorded"}}
    bag = BAG.replace("/imu, offered_qos_profiles: []}", "/imu, offered_qos_profiles: []}\n      message_count: 1")
    system = read_source(Source("metadata.yaml", bag.encode()), None, switches)
    assert values(merge([system, overrides("/imu: {depth: 3}\n")]))["imu"].startswith("? ?")


@pytest.mark.parametrize("topic", ["/imus", "imu", "/*", "/im[u]", "/IMU"])
def test_an_override_of_an_unplayed_topic_is_reported(topic):
    """There are no patterns in these files."""
    system = merge([read_source(Source("m.yaml", BAG.encode())), overrides(f"'{topic}': {{depth: 3}}\n")])
    assert "CQ214" in [finding.code for finding in check(system).findings]


@pytest.mark.parametrize(
    ("wanted", "other", "node"), [("player", "recorder", PLAYER), ("recorder", "player", RECORDER)]
)
def test_an_override_without_effect_names_the_switch(wanted, other, node):
    switches = {"rosbag2": {"as": wanted}}
    over = read_source(Source("o.yaml", b"/imu: {depth: 3}\n"), "rosbag2_overrides", switches)
    (finding,) = (each for each in check(over).findings if each.code == "CQ214")
    assert f"`{node}`" in finding.message
    assert f"for the {other} read it with `--switch rosbag2.as={other}`" in str(finding.help)


def test_unknown_can_be_written_but_not_created():
    system = merge([read_source(Source("m.yaml", BAG.encode())), overrides("/imu: {depth: 3, reliability: unknown}\n")])
    (finding,) = (each for each in check(system).findings if each.severity == "error")
    assert finding.code == "ROS305"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("/t: {depth: 1, deadline: {sec: 1}}", [("CQ010", 1, 26)]),
        ("/t: {depth: 1, deadline: {nsec: 1}}", [("CQ010", 1, 26)]),
        ("/t: {depth: 1, lifespan: {sec: -1, nsec: 0}}", [("CQ011", 1, 26)]),
        ("/t: {depth: 1, lifespan: {sec: 0, nsec: -1}}", [("CQ011", 1, 26)]),
        ("/t: {depth: 1, lifespan: {sec: 9223372036, nsec: 854775808}}", [("CQ011", 1, 26)]),
        ("/t: {depth: 1, lifespan: {sec: one, nsec: 0}}", [("CQ011", 1, 32)]),
        ("/t: {depth: 1, lifespan: {sec: '1', nsec: 0}}", [("CQ011", 1, 32)]),
        ("/t: {depth: 1, lifespan: 5}", [("CQ009", 1, 26)]),
        ("/t: {depth: 1, lifespan: 5s}", [("CQ009", 1, 26)]),
        ("/t: {depth: 1, reliabilty: reliable}", [("CQ006", 1, 16)]),
        ("/t: {depth: 1, queue_size: 5}", [("CQ006", 1, 16)]),
        ("/t: {history: keep_last}", [("CQ010", 1, 1)]),
        ("/t: {reliability: reliable}", [("CQ010", 1, 1)]),
        ("/t: {}", [("CQ010", 1, 1)]),
        ("/t: {depth: -1}", [("CQ011", 1, 13)]),
        ("/t: {depth: '1'}", [("CQ011", 1, 13)]),
        ("/t: {depth: ten}", [("CQ011", 1, 13)]),
        ("/t: {depth: [1]}", [("CQ011", 1, 13)]),
        ("/t: {depth: 1, reliability: 1}", [("CQ011", 1, 29)]),
        ("/t: {depth: 1, reliability: best effort}", [("CQ011", 1, 29)]),
        ("/t: {depth: 1, history: all}", [("CQ011", 1, 25)]),
        ("/t: {depth: 1, liveliness: {}}", [("CQ011", 1, 28)]),
        ("/t: {depth: 1, avoid_ros_namespace_conventions: maybe}", [("CQ011", 1, 49)]),
        ("/t: {depth: 1, avoid_ros_namespace_conventions: [a]}", [("CQ011", 1, 49)]),
        ("/t:", [("CQ009", 1, 4)]),
        ("/t: reliable", [("CQ009", 1, 5)]),
        ("[a]", [("CQ009", 1, 1)]),
        ("", [("CQ010", 1, 1)]),
        ("# nothing\n", [("CQ010", 1, 1)]),
        ("/t: {depth: 1", [("CQ001", 1, 5)]),
        ("/a: {depth: -1}\n/b: {colour: 1, depth: 1}", [("CQ011", 1, 13), ("CQ006", 2, 6)]),
    ],
)
def test_what_ros2_bag_refuses(text, expected):
    assert problems(text) == expected


@pytest.mark.parametrize(
    ("text", "nanoseconds"),
    [
        ("{sec: 0, nsec: 0}", "0ns"),
        ("{sec: 1, nsec: 5}", "1000000005ns"),
        ("{sec: 0.5, nsec: 0}", "500000000ns"),
        ("{sec: -1, nsec: 2000000000}", "1000000000ns"),
        ("{sec: 9223372036, nsec: 854775807}", "9223372036854775807ns"),
        ("{}", "unspecified"),
        ("~", "unspecified"),
    ],
)
def test_durations(text, nanoseconds):
    (overlay,) = overrides(f"/t: {{depth: 1, deadline: {text}}}").overlays
    assert overlay.settings["deadline"].text == nanoseconds


# What is claimed


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_files_are_recognised_by_their_content(file):
    found = recognise(Source("whatever.yaml", file.read_bytes()), load_plugins())
    assert found is not None
    assert found.name == "rosbag2_overrides"


@pytest.mark.parametrize(
    ("text", "claimed"),
    [
        ("/t:\n  depth: 1\n", True),
        ("'/t':\n  depth: 1\n", True),
        ('"/t" :\r\n  depth: 1\r\n', True),
        ("/t: {depth: 1}\n/u: {history: keep_all}\n", True),
        ('{"/t": {"depth": 1}}', True),
        ("# comment\n---\n/t:\n  # why\n  reliability: reliable\n", True),
        ("/t:\n  depth: 1\nu:\n  depth: 1\n", False),
        ("t:\n  depth: 1\n", False),
        ("/**:\n  ros__parameters:\n    depth: 1\n", False),
        ("/node:\n  ros__parameters:\n    depth: 1\n", False),
        ("/t:\n  colour: red\n", False),
        ("/*:\n  depth: 1\n", False),
        ("- /t:\n    depth: 1\n", False),
        ("topics:\n  /t:\n    depth: 1\n", False),
        ("cqos: 1\nparticipants: {a: {publishes: {/t: {depth: 1}}}}\n", False),
        ("<a depth: 1>", False),
        ("depth: 1\n", False),
        ("", False),
    ],
)
def test_what_is_claimed(text, claimed):
    assert claims_rosbag2_overrides("o.yaml", text.encode()) is claimed


@pytest.mark.parametrize("piece", ["a", " ", "/a ", "{", "/t: {depth: ", ": "])
def test_claims_take_linear_time(piece):
    def claim(size: int) -> None:
        line = (piece * size)[:size]
        claims_rosbag2_overrides("o.yaml", f"{line}\n depth: 1\n{line}".encode())

    assert_linear(claim, 15_000)


SNIPPETS = [
    *("", "\n", "\t", " ", ":", "- ", '"', "'", "\\", "[", "]", "{", "}", "&a ", "*a", "<<: ", "!!int ", "|\n", "#"),
    *("~", "null", "99999999999999999999999", "-1", "1e99", ".nan", "unknown", "\x00", "\ufeff", "\u2028", "0x10"),
]


@settings(deadline=None)
@given(
    st.sampled_from([file.read_text() for file in FILES]),
    st.lists(st.tuples(st.integers(0, 600), st.integers(0, 40), st.sampled_from(SNIPPETS)), max_size=5),
)
def test_whatever_is_changed_gives_a_system_or_located_problems(text, changes):
    for start, length, word in changes:
        text = text[:start] + word + text[start + length :]
    claims_rosbag2_overrides("o.yaml", text.encode())
    refused: tuple[Problem, ...] = ()
    try:
        system = read_source(Source("o.yaml", text.encode()), "rosbag2_overrides")
    except InputError as error:
        system, refused = System(), error.problems
    places = [each.place for each in refused] + [each.place for each in system.overlays]
    assert all(place is not None and place.line for place in places)
    check(read_source(Source("m.yaml", BAG.encode())), system)


def test_of_a_key_that_stands_twice_the_last_counts():
    system = read(Source("o.yaml", b"/t: {depth: 1, depth: 2}"), ReadContext())
    assert [overlay.settings["depth"].text for overlay in system.overlays] == ["2"]
    assert [note.code for note in system.notes] == ["CQ005"]
