"""Real configuration files: the endpoints, overlays and notes of each, and the problems of broken ones.

`expected/` holds what was read by hand: every endpoint, overlay and note, each value with its line and column.
"""

from pathlib import Path

import pytest

from cqos_core import InputError, check
from cqos_core.files.importer_choice import recognise
from cqos_core.files.system_merge import merge
from cqos_core.model.finding import Severity
from cqos_core.model.source import ReadContext, Source
from cqos_core.plugins import load_plugins

HERE = Path(__file__).parent
IMPORTERS = (
    "qos_overrides",
    "rviz",
    "gz_bridge",
    "ros1_bridge",
    "domain_bridge",
    "zenoh_bridge",
    "ros2_model",
    "fastdds",
)
FILES = [file for name in IMPORTERS for file in sorted((HERE / "cases" / name).iterdir())]


def read(importer, data, name="file"):
    source = Source(name, data if isinstance(data, bytes) else data.encode())
    return load_plugins().importers[importer].load_reader()(source, ReadContext())


def problems(importer, data):
    with pytest.raises(InputError) as refused:
        read(importer, data)
    return [str(problem) for problem in refused.value.problems]


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_every_case(file, describe):
    source = Source(file.name, file.read_bytes())
    info = recognise(source, load_plugins(), beside={"ros2"})
    assert info.name == file.parent.name
    expected = (HERE / "expected" / file.parent.name / f"{file.name}.txt").read_text(encoding="utf-8")
    assert describe(info.load_reader()(source, ReadContext())) == expected


def test_every_expectation_has_its_case():
    expected = {f"{file.parent.name}/{file.name.removesuffix('.txt')}" for file in (HERE / "expected").rglob("*.txt")}
    assert expected == {f"{file.parent.name}/{file.name}" for file in FILES}


@pytest.mark.parametrize("importer", IMPORTERS)
@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_a_file_of_another_kind_or_cut_anywhere_is_read_or_refused_with_places(importer, file):
    data = file.read_bytes()
    cuts = range(0, len(data), 97) if importer == file.parent.name else [len(data)]
    for cut in cuts:
        try:
            read(importer, data[:cut])
        except InputError as error:
            refused = error
        else:
            continue
        assert all((problem.place.line or 0) >= 1 for problem in refused.problems)


YAML = tuple(name for name in IMPORTERS if name not in {"ros2_model", "fastdds"})


@pytest.mark.parametrize("importer", YAML)
@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ("", "file:1:1: there is nothing in this file"),
        ("# only a comment\n", "file:1:1: there is nothing in this file"),
        ("a: [1", "file:1:4: this is not YAML: `[` of line 1, column 4, is not closed"),
        ("a: 1\n---\nb: 2\n", "file:3:1: another document begins here; only one is read"),
        ("\x00", "file:1:1: the control character U+0000 is not allowed in YAML"),
        (b"a: \xff", "file:1:4: the bytes here are no text"),
        ("&a [*a]", "file:1:5: `*a` stands within `&a`, which it repeats"),
        ("[" * 100, "file:1:65: lists and maps are nested deeper than 64 here, which is refused"),
        ("a: !!python/object:os.system x", "file:1:4: the tag `!!python/object:os.system` means nothing here"),
    ],
    ids=["empty", "comment", "cut", "two", "nul", "bytes", "itself", "deep", "tag"],
)
def test_what_is_no_document_is_refused_with_its_place(importer, data, expected):
    assert problems(importer, data)[0].startswith(expected)


@pytest.mark.parametrize(
    ("importer", "data", "expected"),
    [
        ("qos_overrides", "[a]", ["file:1:1: `parameters` must be a map, found a list"]),
        ("qos_overrides", "n: {ros__parameters: [1]}", ["file:1:22: `ros__parameters` must be a map, found a list"]),
        ("rviz", "Panels: []", ["file:1:1: a configuration of RViz needs `Visualization Manager`"]),
        (
            "rviz",
            "Visualization Manager: {Displays: [1, {Enabled: maybe}], Tools: 3}",
            [
                "file:1:36: `Displays` must be a list of maps, found `1`",
                "file:1:49: `Enabled` must be true or false, found `maybe`",
                "file:1:65: `Tools` must be a list, found `3`",
            ],
        ),
        ("rviz", "Visualization Manager: x", ["file:1:24: `Visualization Manager` must be a map, found `x`"]),
        ("gz_bridge", "a: 1", ["file:1:1: `configuration` must be a list, found a map"]),
        (
            "gz_bridge",
            "- [1]\n- x",
            [
                "file:1:3: `configuration` must be a list of maps, found a list",
                "file:2:3: `configuration` must be a list of maps, found `x`",
            ],
        ),
        (
            "gz_bridge",
            "- {topic_name: [1], ros_type_name: a/B, direction: GZ_TO_ROS, publisher_queue: many}",
            [
                "file:1:16: `topic_name` must be a text, found a list",
                "file:1:80: `publisher_queue` must be a whole number, found `many`",
            ],
        ),
        ("ros1_bridge", "topics: {a: 1}", ["file:1:9: `topics` must be a list, found a map"]),
        ("ros1_bridge", "topics:\n- {type: a/B}", ["file:2:3: an entry of `topics` needs `topic`"]),
        (
            "ros1_bridge",
            "services_1_to_2: [1, {}]",
            [
                "file:1:19: `services_1_to_2` must be a list of maps, found `1`",
                "file:1:22: an entry of `services_1_to_2` needs `service`",
            ],
        ),
        ("domain_bridge", "topics: 3", ["file:1:9: `topics` must be a map, found `3`"]),
        (
            "domain_bridge",
            "from_domain: x\nto_domain: 1\ntopics: {/a: 5, /b: {type: a/B}}",
            [
                "file:1:14: `from_domain` must be a whole number, found `x`",
                "file:1:14: `from_domain` must be a whole number, found `x`",
                "file:3:14: `/a` must be a map, found `5`",
            ],
        ),
        (
            "domain_bridge",
            "name: a\nname: b\ntopics: {/a: {type: a/B, type: a/C, from_domain: 1, to_domain: 2}}",
            [
                "file:2:1: key `name` stands twice in one map (keep one of them)",
                "file:3:26: key `type` stands twice in one map (keep one of them)",
            ],
        ),
    ],
)
def test_all_parts_of_another_kind_are_problems(importer, data, expected):
    assert problems(importer, data) == expected


def test_a_map_of_one_name_many_times_is_one_route_with_a_note_for_each():
    names = "".join("  a: {type: a/B}\n" for _ in range(2_000))
    system = read("domain_bridge", f"from_domain: 1\nto_domain: 2\ntopics:\n{names}")
    assert len(system.bridges["domain_bridge"].routes) == 1
    assert len(system.notes) == 1_999


@pytest.mark.parametrize(
    ("importer", "data"),
    [
        ("qos_overrides", "n: {ros__parameters: }"),
        ("qos_overrides", "n: {ros__parameters: {qos_overrides: }}\nm:"),
        ("rviz", "Visualization Manager: {Displays: , Tools: ~}"),
        ("gz_bridge", "[]"),
        ("ros1_bridge", "topics:\nservices_1_to_2: []"),
        ("domain_bridge", "from_domain: 1\ntopics:"),
        ("domain_bridge", "topics: {}"),
        ("fastdds", "<profiles/>"),
    ],
)
def test_parts_that_are_empty_state_nothing(importer, data):
    system = read(importer, data)
    assert [endpoint.topic for endpoint in system.endpoints if endpoint.label != "transform listener"] == []
    assert (system.overlays, system.notes) == ([], [])


@pytest.mark.parametrize(
    ("flag", "shown"), [("true", "true"), ("yes", "true"), ("Off", "false"), ("'true'", None), ("2", None)]
)
def test_flags_are_those_of_yaml_1_1(flag, shown):
    over = (
        f"n: {{ros__parameters: {{qos_overrides: {{/a: {{publisher: {{avoid_ros_namespace_conventions: {flag}}}}}}}}}}}"
    )
    found = [setting.text for overlay in read("qos_overrides", over).overlays for setting in overlay.settings.values()]
    assert found == ([] if shown is None else [shown])


def test_values_that_bridges_do_not_read_get_a_note():
    notes = read("domain_bridge", "from_domain: 1\nto_domain: 2\ntopics: {/a: {type: a/B, qos: {depth: -1}}}").notes
    assert [(note.code, note.message) for note in notes] == [
        ("ROS950", "domain_bridge does not start with this: `-1` is no depth")
    ]
    notes = read("ros1_bridge", "topics: [{topic: /a, type: a/B, qos: {liveliness: [1]}}]").notes
    assert [(note.code, note.message) for note in notes] == [
        ("ROS951", "ros1_bridge ignores `liveliness`: a list is none of its values")
    ]
    system = read("ros1_bridge", "topics: [{topic: /a, type: a/B, qos: {depth: 3, history: keep_last, liveliness: 1}}]")
    assert {name: setting.text for name, setting in system.endpoints[0].settings.items()} == {
        "history": "keep_last",
        "depth": "3",
        "liveliness": "automatic",
    }


def test_a_duration_of_fast_dds_has_no_other_fields():
    xml = "<profiles><data_writer profile_name='/a'><qos><deadline><period><fraction>1</fraction></period></deadline></qos></data_writer></profiles>"
    system = read("fastdds", xml)
    (overlay,) = system.overlays
    assert list(overlay.settings) == ["partition"]
    assert "period/fraction" in str(overlay.settings["partition"].unknown)
    assert [note.message for note in system.notes if note.code == "ROS960"] == [
        "elements that ROS 2 has no policy for: `period/fraction`"
    ]


@pytest.mark.parametrize("name", ["<robot>/battery", "$(var prefix)/battery"])
def test_names_that_a_launch_file_fills_in_are_not_checked(name):
    entry = f"- {{ros_topic_name: '{name}', ros_type_name: a/B, gz_type_name: a.B}}\n"
    service = f"- {{service_name: '{name}', ros_type_name: a/B}}\n"
    system = read("gz_bridge", entry + service)
    assert (system.endpoints, [note.code for note in system.notes]) == ([], ["ROS943", "ROS943"])


FAST_PARTICIPANT = (
    "<profiles><participant profile_name='p' {}><rtps><builtin>{}</builtin></rtps></participant></profiles>"
)
DEFAULT = "is_default_profile='true'"
PEERS = "<initialPeersList><locator/></initialPeersList>"
FILTERS = "<discovery_config><ignoreParticipantFlags>FILTER_SAME_PROCESS</ignoreParticipantFlags></discovery_config>"


@pytest.mark.parametrize(
    ("attribute", "inner", "unknown", "parts"),
    [
        (DEFAULT, PEERS, False, ["participant/rtps/builtin/initialPeersList"]),
        (DEFAULT, FILTERS, True, ["participant/rtps/builtin/discovery_config/ignoreParticipantFlags"]),
        (DEFAULT, FILTERS.replace("FILTER_SAME_PROCESS", "NO_FILTER"), False, []),
        (DEFAULT, "<avoid_builtin_multicast>true</avoid_builtin_multicast>", False, []),
        ("", FILTERS, False, []),  # which rmw_fastrtps never takes
    ],
)
def test_elements_of_the_default_participant_that_may_decide_are_named(attribute, inner, unknown, parts):
    system = read("fastdds", FAST_PARTICIPANT.format(attribute, inner))
    assert bool([each for each in system.overlays if "partition" in each.settings]) is unknown
    assert [part.name for note in system.notes for part in note.parts] == parts


@pytest.mark.parametrize(
    ("inner", "unknown", "parts"),
    [
        ("<Discovery><Tag>a</Tag></Discovery>", True, ["Discovery/Tag"]),
        ("<Discovery><Peers><Peer Address='a'/></Peers></Discovery>", False, ["Discovery/Peers"]),
        ("<General><Interfaces/></General>", False, []),
        ("<General><AllowMulticast>true</AllowMulticast></General>", False, []),
        ("<General><NobodyHasThis>1</NobodyHasThis></General>", True, ["General/NobodyHasThis"]),
    ],
)
def test_parts_of_cyclone_dds_that_may_decide_are_named(inner, unknown, parts):
    system = read("cyclonedds", f"<CycloneDDS><Domain>{inner}</Domain></CycloneDDS>")
    assert bool([each for each in system.overlays if "partition" in each.settings]) is unknown
    assert [part.name for note in system.notes for part in note.parts] == parts


SNAPSHOT = """$ ros2 topic info /tf_static --verbose
Type: tf2_msgs/msg/TFMessage

Publisher count: 1

Node name: robot_state_publisher
Node namespace: /
Topic type: tf2_msgs/msg/TFMessage
Endpoint type: PUBLISHER
GID: 01
QoS profile:
  Reliability: RELIABLE
  History (Depth): KEEP_LAST (1)
  Durability: TRANSIENT_LOCAL
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite

Subscription count: 1

Node name: ros_bridge
Node namespace: /
Topic type: tf2_msgs/msg/TFMessage
Endpoint type: SUBSCRIPTION
GID: 02
QoS profile:
  Reliability: BEST_EFFORT
  History (Depth): KEEP_LAST (1)
  Durability: VOLATILE
  Lifespan: Infinite
  Deadline: Infinite
  Liveliness: AUTOMATIC
  Liveliness lease duration: Infinite
"""
LATCHED = (
    "topics: [{topic: /tf_static, type: tf2_msgs/msg/TFMessage, qos: {history: keep_all, durability: transient_local}}]"
)


def test_a_bridge_does_not_take_back_what_it_publishes():
    """Also where a snapshot shows its subscription: only what other nodes publish reaches it."""
    report = check(read("ros1_bridge", LATCHED))
    assert {each.code for each in report.findings if each.severity is not Severity.NOTE} == {"CQ404"}
    report = check(merge([read("ros1_bridge", LATCHED), read("topic_info", SNAPSHOT)]))
    (late,) = [each for each in report.findings if each.code == "ROS202"]
    assert {each for each in late.endpoints if "/publisher/" in each} == {"/robot_state_publisher/publisher/tf_static"}
    both = (
        "- {topic_name: /a, ros_type_name: a/B, gz_type_name: a.B, direction: BIDIRECTIONAL, qos_profile: SENSOR_DATA}"
    )
    assert not check(read("gz_bridge", both)).groups
