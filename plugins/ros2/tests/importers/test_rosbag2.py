"""Recordings: every layout of `metadata.yaml`, what the player makes of it, and what the recorder asks for."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from cqos_core import InputError, Problem, System, check
from cqos_core.cli.app import cli
from cqos_core.files.file_search import find_files
from cqos_core.files.importer_choice import recognise
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import ReadContext, Source
from cqos_core.plugins import load_plugins
from cqos_ros2.importers.detect_observed import claims_rosbag2
from cqos_ros2.importers.rosbag2 import read
from cqos_ros2.pack import PACK
from tests import explained_values

CASES = Path(__file__).parent / "cases" / "rosbag2"
FILES = sorted(CASES.iterdir())
POLICIES = (
    *("history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness"),
    *("liveliness_lease_duration", "avoid_ros_namespace_conventions"),
)


def bag(text, seen_as=None, name="run/metadata.yaml"):
    options = {} if seen_as is None else {"rosbag2": {"as": seen_as}}
    return read(Source(name, text.encode()), ReadContext(options=options))


def from_case(name, seen_as=None):
    return bag((CASES / name).read_text(), seen_as)


def rows(system):
    """The values of each topic, `?` for what is not known."""
    return {name.partition("/")[2]: row for name, row in explained_values.rows(system, PACK, POLICIES).items()}


def said(system):
    return [
        f"{note.code} {note.severity} {note.place.line}:{note.place.column} {note.message}" for note in system.notes
    ]


def problems(text, **how):
    with pytest.raises(InputError) as error:
        bag(text, **how)
    return [(each.code, each.place.line, each.place.column) for each in error.value.problems]


SENSOR = "keep_last 10 best_effort volatile infinite infinite automatic infinite false"
LATCHED = "keep_last 10 reliable transient_local infinite infinite automatic infinite false"
DEFAULT = "keep_last 10 reliable volatile infinite infinite automatic infinite false"
IMU = {"publisher/imu": SENSOR}

# Every layout, as the player

EXPECTED = {
    **{f"v{version}_no_qos.yaml": {"publisher/chatter": DEFAULT, "publisher/tf": DEFAULT} for version in (1, 2, 3)},
    **{f"v4_foxy_{rmw}.yaml": IMU for rmw in ("fastdds", "connext", "cyclonedds")},
    "v4_galactic.yaml": {"publisher/ros_can/twist": DEFAULT},
    "v5_humble.yaml": {
        **IMU,
        "publisher/map": LATCHED,
        "publisher/pose": "keep_last 10 reliable volatile 200ms 1s manual_by_topic 2s false",
        "publisher/mixed": DEFAULT,
        "publisher/quiet": DEFAULT,
    },
    "v6_in_between.yaml": IMU,
    "v7_iron.yaml": {**IMU, "publisher/left": DEFAULT},
    "v8_in_between.yaml": IMU,
    "v9_jazzy.yaml": {
        **IMU,
        "publisher/map": LATCHED,
        "publisher/rosout": DEFAULT,
        "publisher/odd": "keep_last 10 ? ? infinite infinite ? infinite false",
    },
    "v9_integer_codes.yaml": IMU,
    "no_version_codes.yaml": {},
    "no_version_words.yaml": {},
    "v5_words_in_block_text.yaml": IMU,
    "v5_list_of_a_converter.yaml": {},
}
NO_VERSION = ["ROS912 error 2:3 the description has no `version`: rosbag2 cannot read this"]
SAID = {
    "no_version_codes.yaml": NO_VERSION,
    "no_version_words.yaml": NO_VERSION,
    **{
        f"v{version}_no_qos.yaml": [
            "ROS910 note 11:15 what the publishers of `/chatter` and `/tf` offered was not recorded"
        ]
        for version in (1, 2, 3)
    },
    "v5_humble.yaml": [
        "ROS910 note 35:15 what the publishers of `/quiet` offered was not recorded",
        "ROS911 note 29:15 the recorded publishers of `/mixed` differ in `reliability` and `durability`, so the player offers the default profile",
    ],
    "v7_iron.yaml": ["ROS910 note 18:15 what the publishers of `/left` offered was not recorded"],
    "v9_jazzy.yaml": ["ROS910 note 70:15 what the publishers of `/rosout` offered was not recorded"],
    "v5_list_of_a_converter.yaml": [
        "ROS913 error 14:31 `offered_qos_profiles` is a list, in version 5 it must be a text with YAML in it: rosbag2 cannot read this",
    ],
}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_what_the_player_offers(file):
    assert rows(from_case(file.name)) == EXPECTED[file.name]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_layout_gives_its_expected_notes(file):
    assert said(from_case(file.name)) == SAID.get(file.name, [])


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_layout_is_recognised_by_its_content(file):
    found = recognise(Source("whatever.yaml", file.read_bytes()[:65536]), load_plugins())
    assert found is not None
    assert found.name == "rosbag2"


@pytest.mark.parametrize(
    ("text", "claimed"),
    [
        ("# recorded\n---\nrosbag2_bagfile_information:\n", True),
        ('{"rosbag2_bagfile_information": {}}', True),
        ("\ufeffrosbag2_bagfile_information :\n", True),
        ("rosbag2_bagfile_informations:\n", False),
        ("a: b\nrosbag2_bagfile_information:\n", False),
        ("# Bags\n\nA description begins with\n\nrosbag2_bagfile_information:\n", False),
        ("", False),
    ],
)
def test_what_is_claimed(text, claimed):
    assert claims_rosbag2("metadata.yaml", text.encode()) is claimed


def test_a_bag_is_found_in_a_directory(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "metadata.yaml").write_bytes((CASES / "v5_humble.yaml").read_bytes())
    (folder / "run_0.db3").write_bytes(b"SQLite format 3\0")
    found = find_files([str(folder)], load_plugins(), "rosbag2")
    assert [Path(file.path).name for file in found.files] == ["metadata.yaml"]


def test_the_player_is_one_participant_with_places_of_values_in_the_text():
    system = from_case("v5_humble.yaml")
    assert list(system.participants) == ["rosbag2_player"]
    assert system.name == "run"
    imu, _, pose, mixed, _ = system.endpoints
    assert (imu.id, imu.topic, imu.type) == ("rosbag2_player/publisher/imu", "/imu", "sensor_msgs/msg/Imu")
    assert not imu.observed
    assert str(imu.place) == "run/metadata.yaml:11:15"
    lines = (CASES / "v5_humble.yaml").read_text().split("\n")
    for name, wanted in (
        ("reliability", "2\\n  durab"),
        ("lifespan", "sec: 9223372036\\n    nsec: 854775807\\n  live"),
    ):
        place = imu.settings[name].place
        assert place.line == 14
        assert lines[13][place.column - 1 :].startswith(wanted)
    assert imu.settings["deadline"].text == "{sec: 9223372036, nsec: 854775807}"
    deadline = pose.settings["deadline"].place
    assert lines[deadline.line - 1][deadline.column - 1 :].startswith("sec: 0\\n    nsec: 200")
    assert mixed.settings == {}


@pytest.mark.parametrize(
    "text",
    [
        "|\n            - history: keep_last\n              reliability: best_effort",
        "|-\n\n            # before\n            - history: keep_last\n              reliability: best_effort",
        "'- {history: keep_last, reliability: best_effort}'",
        '"- history: keep_last\\n  reliability: \\\n            best_effort"',
        '"[{history: keep_last,\n\n            reliability: best_effort}]"',
        "\n          - history: keep_last\n            reliability: best_effort",
        "[{history: keep_last, reliability: best_effort}]",
    ],
)
def test_places_in_every_way_to_write_a_profile(text):
    content = minimal(text)
    setting = bag(content, "recorded").endpoints[0].settings["reliability"]
    assert setting.text == "best_effort"
    line = content.split("\n")[setting.place.line - 1]
    assert line[setting.place.column - 1 :].startswith("best_effort")


def minimal(profiles, version=None):
    """A description with these profiles, of a version that has them so."""
    if version is None:
        version = f"  version: {9 if profiles.startswith(('[', chr(10), '{')) else 5}\n"
    return (
        f"rosbag2_bagfile_information:\n{version}  topics_with_message_count:\n    - topic_metadata:\n"
        f"        name: /t\n        offered_qos_profiles: {profiles}\n      message_count: 2\n"
    )


def profile(**changes):
    forever = {"sec": 9223372036, "nsec": 854775807}
    stated = {
        "history": "unknown",
        "depth": 0,
        "reliability": "reliable",
        "durability": "volatile",
        "deadline": forever,
        "lifespan": forever,
        "liveliness": "automatic",
        "liveliness_lease_duration": forever,
        "avoid_ros_namespace_conventions": "false",
    }
    return str({**stated, **changes}).replace("'", "")


# The rule of the player: rosbag2, test_qos.cpp

SOON, LATER = {"sec": 1, "nsec": 0}, {"sec": 2, "nsec": 0}


@pytest.mark.parametrize(
    ("second", "agrees"),
    [
        ({}, True),
        ({"history": "keep_last", "depth": 3}, True),
        ({"lifespan": LATER}, True),
        ({"avoid_ros_namespace_conventions": "true"}, True),
        ({"reliability": "reliable"}, False),
        ({"durability": "transient_local"}, False),
        ({"deadline": LATER}, False),
        ({"liveliness": "manual_by_topic"}, False),
        ({"liveliness_lease_duration": SOON}, False),
        ({"deadline": {"sec": 0, "nsec": 0}}, False),
        ({"deadline": {"sec": 2147483647, "nsec": 4294967295}}, True),
        ({"deadline": {"sec": 2147483647, "nsec": 2147483647}}, True),
    ],
)
def test_when_recorded_publishers_agree(second, agrees):
    system = bag(
        minimal(f"[{profile(reliability='best_effort')}, {profile(**{'reliability': 'best_effort', **second})}]")
    )
    assert rows(system)["publisher/t"] == (SENSOR if agrees else DEFAULT)
    assert [note.code for note in system.notes] == ([] if agrees else ["ROS911"])


def test_the_lifespan_is_that_of_the_first():
    first, second = profile(lifespan=SOON), profile(lifespan=LATER)
    assert rows(bag(minimal(f"[{first}, {second}]")))["publisher/t"].split()[5] == "1s"


@pytest.mark.parametrize("policy", ["reliability", "durability", "liveliness"])
def test_what_was_recorded_as_unknown_cannot_be_played(policy):
    report = check(bag(minimal(f"[{profile(**{policy: 'unknown'})}]")))
    assert [finding.code for finding in report.findings if finding.severity == "error"] == ["ROS305"]
    assert not [finding.code for finding in check(bag(minimal(f"[{profile()}]"))).findings if "ROS3" in finding.code]


def test_the_marker_of_best_available_is_read():
    """No running publisher has it, but files edited by hand may."""
    marker = {"sec": 9223372036, "nsec": 854775806}
    system = bag(minimal(f"[{profile(deadline=marker, reliability='best_available')}]"))
    assert rows(system)["publisher/t"].startswith("keep_last 10 reliable volatile ?")


LISTENER = Source("a.yaml", b"cqos: 1\nprotocol: ros2\nparticipants: {ui: {subscribes: {/t: {}}}}\n")
CODES = {"history": 3, "reliability": 1, "durability": 2, "liveliness": 1}


@pytest.mark.parametrize("policy", ["reliability", "durability", "liveliness"])
def test_codes_that_mean_nothing_are_findings_with_their_place(policy):
    content = minimal(f"[{profile(**{**CODES, policy: 42})}]")
    report = check(bag(content, "recorded"))
    (place,) = (str(each.place) for each in report.findings if each.code == "CQ203")
    line, column = map(int, place.split(":")[1:3])
    assert content.split("\n")[line - 1][column - 1 :].startswith("42")


# As rosbag2 reads values: the history says whether they are codes or words


@pytest.mark.parametrize("policy", ["reliability", "history", "durability", "liveliness"])
@pytest.mark.parametrize(
    "word", ["42", "1", "Reliable", "KEEP_LAST", "best-effort", "RMW_QOS_POLICY_DURABILITY_VOLATILE"]
)
def test_a_word_that_rosbag2_does_not_know_is_unknown_to_it(policy, word):
    """Also a code beside a history in words; but a code as history makes codes of the others."""
    if (policy, word) == ("history", "1"):
        return
    content = minimal(f"[{profile(**{policy: word})}]")
    system = bag(content)
    (note,) = system.notes
    assert (note.code, note.severity) == ("ROS916", "warning")
    assert content.split("\n")[note.place.line - 1][note.place.column - 1 :].startswith(word)
    # The player has a history of its own.
    assert check(merge([read_source(LISTENER), system])).verdict == (
        "compatible" if policy == "history" else "incompatible"
    )


def test_manual_by_node_in_words_is_unknown_to_rosbag2():
    assert [note.code for note in bag(minimal(f"[{profile(liveliness='manual_by_node')}]")).notes] == ["ROS916"]


@pytest.mark.parametrize("policy", ["reliability", "durability", "liveliness"])
def test_a_word_beside_a_history_in_codes_is_refused(policy):
    content = minimal(f"[{profile(**{**CODES, policy: 'system_default'})}]")
    (note,) = bag(content).notes
    assert (note.code, note.severity) == ("ROS915", "error")


def test_codes_in_a_list_are_codes():
    """No rosbag2 writes them, but Jazzy and newer read them."""
    system = bag(minimal(f"[{profile(**CODES)}]"))
    assert not system.notes
    assert rows(system)["publisher/t"] == DEFAULT


@pytest.mark.parametrize(
    "changes",
    [
        {"deadline": "infinite"},
        {"deadline": 1000},
        {"lifespan": {"sec": 1}},
        {"lifespan": {"sec": -1, "nsec": 0}},
        {"liveliness_lease_duration": {"sec": 0.5, "nsec": 0}},
        {"depth": "many"},
        {"avoid_ros_namespace_conventions": "perhaps"},
        {"reliability": ["reliable"]},
    ],
)
def test_values_of_another_kind_are_refused(changes):
    assert [note.code for note in bag(minimal(f"[{profile(**changes)}]")).notes] == ["ROS915"]


@pytest.mark.parametrize(
    "text",
    [
        minimal(f"[{profile()}]", ""),
        minimal(f"[{profile()}]", "  version: 5\n"),
        minimal(f"'[{profile(**CODES)}]'", "  version: 9\n"),
        minimal(f"[{profile(durability='~')}]"),
        minimal(f"[{profile(deadline='infinite')}]"),
        minimal(f"[{profile(**{**CODES, 'durability': 'volatile'})}]"),
        minimal("~"),
    ],
)
def test_of_what_rosbag2_does_not_open_nothing_is_compatible(text):
    report = check(merge([read_source(LISTENER), bag(text)]))
    (error,) = [finding for finding in report.findings if finding.severity == "error"]
    assert report.verdict == "unknown"
    assert error.code in {"ROS912", "ROS913", "ROS915"}


@pytest.mark.parametrize("missing", ["history", "reliability", "deadline", "avoid_ros_namespace_conventions"])
def test_a_value_of_nothing_is_missing(missing):
    assert [note.code for note in bag(minimal(f"[{profile(**{missing: '~'})}]")).notes] == ["ROS912"]


@pytest.mark.parametrize(("history", "lacks"), [("keep_last", True), ("keep_all", False), ("unknown", False)])
def test_keep_last_needs_a_depth(history, lacks):
    text = minimal(f"[{profile(history=history)}]").replace("depth: 0, ", "")
    assert [note.code for note in bag(text).notes] == (["ROS912"] if lacks else [])


@pytest.mark.parametrize("version", [0, 1, 2, 3])
def test_before_version_4_profiles_are_not_read(version):
    kept = profile(durability="transient_local")
    system = bag(minimal(f"[{kept}]", f"  version: {version}\n"))
    assert rows(system) == {"publisher/t": DEFAULT}
    assert [note.code for note in system.notes] == ["ROS910"]


@pytest.mark.parametrize(
    ("form", "humble", "jazzy", "unset"),
    [
        (lambda: minimal(f'"[{profile(**CODES)}]"'), "compatible", "compatible", "compatible"),
        (lambda: minimal(f'"[{profile()}]"'), "incompatible", "compatible", "unknown"),
        (lambda: minimal(f"[{profile()}]"), "incompatible", "compatible", "compatible"),
        (lambda: minimal(f"[{profile(**CODES)}]"), "incompatible", "compatible", "compatible"),
    ],
)
def test_which_distribution_plays_it(form, humble, jazzy, unset):
    for distro, verdict in (("humble", humble), ("iron", humble), ("jazzy", jazzy), ("rolling", jazzy), ("", unset)):
        options = {"ros2": {"distro": distro}} if distro else {}
        system = merge([read_source(LISTENER), bag(form())])
        assert check(system, options=options).verdict == verdict, distro


# As the recorder, and as what was recorded


def test_the_recorder_takes_what_all_publishers_offer():
    stack = b"""
cqos: 1
protocol: ros2
participants:
  a: {publishes: {/t: {durability: transient_local}}}
  b: {publishes: {/t: {reliability: best_effort, durability: transient_local}}}
"""
    recorder = bag(minimal("[]"), "recorder")
    assert [endpoint.id for endpoint in recorder.endpoints] == ["rosbag2_recorder/subscriber/t"]
    assert recorder.endpoints[0].external
    one = read_source(Source("a.yaml", stack.replace(b"  b:", b"  # b:")))
    assert check(one, recorder).verdict == "compatible"
    both = read_source(Source("a.yaml", stack))
    # Whom the recorder sees first decides, as its own warning says.
    assert check(both, bag(minimal("[]"), "recorder")).verdict == "unknown"


def test_a_recorder_without_publishers_is_only_a_note():
    report = check(bag(minimal("[]"), "recorder"))
    assert [finding.code for finding in report.findings] == ["CQ404"]


def test_what_was_recorded_is_observed():
    system = from_case("v5_humble.yaml", "recorded")
    assert rows(system) == {
        "publisher/imu": "? ? best_effort volatile infinite infinite automatic infinite false",
        "publisher/map": "? ? reliable transient_local infinite infinite automatic infinite false",
        "publisher/pose": "? ? reliable volatile 200ms 1s manual_by_topic 2s false",
        "publisher/pose#2": "keep_last 7 reliable volatile 200ms 3s manual_by_topic 2s false",
        "publisher/mixed": "? ? reliable transient_local infinite infinite automatic infinite false",
        "publisher/mixed#2": "? ? best_effort volatile infinite infinite automatic infinite false",
    }
    assert all(endpoint.observed for endpoint in system.endpoints)
    assert not system.notes


def test_messages_without_profiles_come_from_an_unknown_publisher():
    assert rows(bag(minimal("[]"), "recorded")) == {"publisher/t": "? ? ? ? ? ? ? ? ?"}
    depth = bag(minimal("[{history: unknown, depth: 10}]"), "recorded")
    assert rows(depth)["publisher/t"].startswith("? ? ")


@pytest.mark.parametrize("switches", [{"as": "both"}, {"is": "player"}])
def test_switches_that_make_no_sense_are_refused(switches):
    with pytest.raises(InputError) as error:
        read(Source("x", b""), ReadContext(options={"rosbag2": switches}))
    assert [each.code for each in error.value.problems] == ["CQ047"]


# Odd, cut off, mixed and hostile files


@pytest.mark.parametrize(
    ("version", "nothing"),
    [(5, '""'), (5, "''"), (5, "'[]'"), (5, "|\n"), (9, "[]"), (3, ""), (3, "~"), (3, '"# nothing"')],
)
def test_every_way_to_say_that_nothing_is_known(nothing, version):
    system = bag(minimal(nothing, f"  version: {version}\n"))
    assert rows(system) == {"publisher/t": DEFAULT}
    assert [note.code for note in system.notes] == ["ROS910"]


@pytest.mark.parametrize("version", [4, 5, 8, 9, 10])
@pytest.mark.parametrize("nothing", ["", "~", "null"])
def test_profiles_that_are_missing_are_refused(nothing, version):
    codes = [note.code for note in bag(minimal(nothing, f"  version: {version}\n")).notes]
    assert codes == [*(["ROS914"] if version > 9 else []), "ROS912"]


def test_a_text_without_a_list_is_refused():
    assert problems(minimal('"# nothing"')) == [("CQ009", 6, 31)]


@pytest.mark.parametrize(
    ("version", "text", "code"),
    [(8, "''", None), (8, "[]", "ROS913"), (9, "[]", None), (9, "''", "ROS913"), (3, "[]", None), (10, "[]", "ROS914")],
)
def test_layouts_of_another_version(version, text, code):
    codes = [note.code for note in bag(minimal(text, f"  version: {version}\n"), "recorded").notes]
    assert codes == ([] if code is None else [code])


@pytest.mark.parametrize(("version", "unread"), [(9, []), (10, ["file"])])
def test_a_newer_recording_is_not_read_whole(version, unread):
    report = check(minimal("[]", f"  version: {version}\n").encode())
    assert [each.kind for each in report.coverage.unread] == unread


def test_odd_profiles_are_warnings():
    system = bag(minimal("[{history: keep_last, depth: 1, colour: red, durability: ~}]"))
    assert said(system) == [
        "ROS905 warning 6:63 `colour` is no policy that rosbag2 is known to record",
        "ROS912 error 6:32 the recorded profile lacks `reliability`, `durability`, `deadline`, `lifespan`, `liveliness`, `liveliness_lease_duration` and `avoid_ros_namespace_conventions`: rosbag2 cannot read this",
    ]


def test_topics_that_are_cut_off_are_missed():
    text = (CASES / "v5_humble.yaml").read_text()
    cut = text[: text.index("    - topic_metadata:\n        name: /mixed")]
    assert said(bag(cut)) == [
        "ROS904 warning 8:18 the recording has 22 messages, its topics only 17: some of them are missing"
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", [("CQ009", 1, 1)]),
        ("a: 1\n", [("CQ010", 1, 1)]),
        ("- a\n", [("CQ009", 1, 1)]),
        ("rosbag2_bagfile_information:\n", [("CQ010", 1, 1)]),
        ("rosbag2_bagfile_information: []\n", [("CQ009", 1, 30)]),
        ("rosbag2_bagfile_information: {version: 5}\n", [("CQ010", 1, 30)]),
        ("rosbag2_bagfile_information: {topics_with_message_count: {}}\n", [("CQ009", 1, 58)]),
        ("rosbag2_bagfile_information: {version: five, topics_with_message_count: []}\n", [("CQ011", 1, 40)]),
        ("rosbag2_bagfile_information: {topics_with_message_count: [a, {}, {topic_metadata: b}]}\n", [
            ("CQ009", 1, 59), ("CQ010", 1, 62), ("CQ009", 1, 83)]),
        ("rosbag2_bagfile_information: {topics_with_message_count: [{topic_metadata: {}}]}\n", [("CQ010", 1, 76)]),
        ("rosbag2_bagfile_information: {topics_with_message_count: [{topic_metadata: {name: []}}]}\n", [("CQ010", 1, 83)]),
        (minimal("{history: 3}"), [("CQ009", 6, 31)]),
        (minimal("[3]"), [("CQ009", 6, 32)]),
        (minimal("'- 3'"), [("CQ009", 6, 34)]),
        (minimal("a text"), [("CQ009", 6, 31)]),
        (minimal("'- {history: 3'"), [("CQ001", 6, 31)]),
        (minimal('"- history: 3\\n- \\u0000"'), [("CQ001", 6, 31)]),
        (minimal('"- &a [*a]"'), [("CQ002", 6, 31)]),
        (minimal(f'"{"[" * 200}"'), [("CQ002", 6, 31)]),
        ("rosbag2_bagfile_information:\n\ttopics: 1\n", [("CQ001", 2, 1)]),
        ("rosbag2_bagfile_information: {a: 1, a: 2}\n", [("CQ005", 1, 37)]),
        ((CASES / "v5_humble.yaml").read_text().partition("  durability")[0], [("CQ001", 14, 31)]),
    ],
)  # fmt: skip
def test_mistakes_are_problems_with_their_place(text, expected):
    assert problems(text) == expected


def test_a_text_with_a_thousand_faults_is_one_problem():
    many = "\\n".join(f"a{number}: *b" for number in range(1200))
    assert problems(minimal(f'"{many}"')) == [("CQ017", 6, 31)]


SNIPPETS = [
    *(
        "",
        "\n",
        "\t",
        " ",
        ":",
        "- ",
        '"',
        "'",
        "\\n",
        "\\",
        "[",
        "]",
        "{",
        "}",
        "&a ",
        "*a",
        "<<: ",
        "!!int ",
        "|\n",
        "#",
    ),
    *("~", "null", "99999999999999999999999", "-1", "unknown", "\x00", "\ufeff", "\u2028", "\\ud800", "version: 9\n"),
]


@settings(deadline=None)
@given(
    st.sampled_from([file.read_text() for file in FILES]),
    st.lists(st.tuples(st.integers(0, 3000), st.integers(0, 80), st.sampled_from(SNIPPETS)), max_size=5),
    st.sampled_from(["player", "recorder", "recorded"]),
)
def test_whatever_is_changed_gives_a_system_or_located_problems(text, changes, seen_as):
    for start, length, word in changes:
        text = text[:start] + word + text[start + length :]
    source = Source("run/metadata.yaml", text.encode("utf-8", "surrogatepass"))
    refused: tuple[Problem, ...] = ()
    try:
        system = read_source(source, "rosbag2", {"rosbag2": {"as": seen_as}})
    except InputError as error:
        system, refused = System(), error.problems
    places = [each.place for each in refused] + [each.place for each in system.endpoints]
    assert all(place is not None and place.line for place in places)
    check(system)


# One command

STACK = """\
cqos: 1
system: stack
protocol: ros2
participants:
  estimator:
    subscribes:
      /imu: {reliability: reliable}
  planner:
    subscribes:
      /map: {durability: transient_local, depth: 1}
      /quiet: {durability: transient_local}
"""


@pytest.fixture
def stack(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("stack.yaml").write_text(STACK)
    Path("bag").mkdir()
    Path("bag/metadata.yaml").write_bytes((CASES / "v5_humble.yaml").read_bytes())
    Path("bag/run_0.db3").write_bytes(b"SQLite format 3\0")


def run(*arguments):
    return CliRunner().invoke(cli, ["check", *arguments, "--no-config", "--color", "never"])


@pytest.mark.usefixtures("stack")
def test_will_this_bag_play_into_my_stack():
    done = run("stack.yaml", "bag/", "--together")
    assert done.exit_code == 1
    assert "2 errors" in done.stdout
    for line in (
        "error[ROS101] reliability-weaker-than-requested",
        "--> stack.yaml:7:27  requested here: reliability reliable",
        "::: bag/metadata.yaml:14:73  offered here: reliability best_effort",
        "error[ROS102] durability-weaker-than-requested",
        "--> stack.yaml:11:28  requested here: durability transient_local",
        "::: bag/metadata.yaml:35:15  offered here: durability volatile",
    ):
        assert line in done.stdout


@pytest.mark.usefixtures("stack")
def test_topics_in_the_bag_only_are_notes():
    done = run("stack.yaml", "bag/", "--together", "--format", "json")
    assert '"CQ402"' in done.stdout
    warnings = run("stack.yaml", "bag/", "--together")
    assert "CQ402" not in warnings.stdout
    assert "warning[" not in warnings.stdout


@pytest.mark.usefixtures("stack")
def test_overrides_make_the_stack_compatible():
    Path("bag/o.yaml").write_text(
        "/imu: {depth: 5, reliability: reliable}\n/quiet: {depth: 1, durability: transient_local}\n"
    )
    done = run("stack.yaml", "bag/", "--together")
    assert done.exit_code == 0, done.stdout
    assert "compatible" in done.stdout
