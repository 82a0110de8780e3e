"""RViz: its displays meet publishers, it listens to transforms, and what it does not ask for is not invented."""

import pytest

from cqos_core import check
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import ReadContext, Source
from cqos_ros2.importers.rviz import read

MAP = """\
Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/Map
      Enabled: true
      Topic: {Durability Policy: DURABILITY, Value: /map}
"""
SERVER = "cqos: 1\nprotocol: ros2\nparticipants:\n  map_server: {publishes: {/map: {durability: volatile}}}\n"


def checked(durability, server=SERVER):
    rviz = Source("v.rviz", MAP.replace("DURABILITY", durability).encode())
    return check(merge([read_source(Source("d.yaml", server.encode())), read_source(rviz)]))


def test_a_display_requests_what_it_states():
    assert checked("Volatile").verdict == "compatible"
    report = checked("Transient Local")
    assert report.verdict == "incompatible"
    (finding,) = [finding for finding in report.findings if finding.code == "ROS102"]
    assert (finding.place.source, finding.place.line, finding.place.column) == ("v.rviz", 5, 34)


def test_unmatched_transforms_and_goals_are_only_notes():
    assert [finding for finding in checked("Volatile").findings if finding.severity != "note"] == []


def test_transforms_are_requested_as_tf2_does():
    server = SERVER.replace("/map: {durability: volatile}", "/map: default, /tf_static: {depth: 1}")
    report = checked("Volatile", server)
    assert ["/tf_static"] == [finding.topic for finding in report.findings if finding.code == "ROS102"]


@pytest.mark.parametrize("name", ["Global Costmap", "a b"])
def test_a_group_that_is_not_enabled_enables_nothing(name):
    text = (
        "Visualization Manager:\n  Displays:\n  - Class: rviz_common/Group\n    Enabled: false\n    Displays:\n"
        "    - {Class: rviz_common/Group, Enabled: true, Displays: [{Class: rviz_default_plugins/Map, Name: NAME, "
        "Topic: {Value: /map}}]}\n"
    )
    system = read(Source("v.rviz", text.replace("NAME", name).encode()), ReadContext())
    assert [endpoint.topic for endpoint in system.endpoints] == ["/tf", "/tf_static"]
    assert [note.message for note in system.notes] == [f"1 display that is not enabled: `{name}`"]


def test_many_displays_that_are_not_enabled_are_counted():
    display = "  - {Class: rviz_default_plugins/Map, Enabled: false, Name: MAP, Topic: {Value: /map}}\n"
    displays = "".join(display.replace("MAP", f"m{number}") for number in range(7))
    system = read(Source("v.rviz", f"Visualization Manager:\n  Displays:\n{displays}".encode()), ReadContext())
    (note,) = system.notes
    assert note.message == "7 displays that are not enabled: `m0`, `m1`, `m2`, `m3`, `m4` and 2 more"


@pytest.mark.parametrize(("topic", "expected"), [("/image", "sensor_msgs/msg/Image"), ("/image/compressed", None)])
def test_what_a_transport_sends_has_a_type_of_its_own(topic, expected):
    text = MAP.replace("/Map", "/Image").replace("DURABILITY", "Volatile").replace("/map", topic)
    assert read(Source("v.rviz", text.encode()), ReadContext()).endpoints[0].type == expected


@pytest.mark.parametrize("published", [False, True])
def test_updates_of_a_map_are_checked_only_if_published(published):
    updates = "/map_updates: {reliability: best_effort}"
    server = SERVER.replace("{/map: ", f"{{{updates}, /map: ") if published else SERVER
    rviz = MAP.replace("DURABILITY", "Volatile") + "      Update Topic: {Value: /map_updates}\n"
    report = check(
        merge([read_source(Source("d.yaml", server.encode())), read_source(Source("v.rviz", rviz.encode()))])
    )
    spoken = [(each.code, each.topic) for each in report.findings if each.severity != "note"]
    assert spoken == ([("ROS101", "/map_updates")] if published else [])


WRITTEN = """
Visualization Manager:
  "": true
  Displays:
    - Class: rviz_default_plugins/LaserScan
      Enabled: true
      Topic: {Value: /scan, Depth: 3, Reliability Policy: Reliable, Reliability Policy: Best Effort, Filter size: 10}
"""


def test_of_a_key_that_stands_twice_the_last_counts_and_an_empty_one_is_none():
    system = read(Source("v.rviz", WRITTEN.encode()), ReadContext())
    assert system.endpoints[0].settings["reliability"].text == "Best Effort"
    assert [(note.code, note.severity, note.place.line) for note in system.notes] == [("CQ005", "note", 7)]


@pytest.mark.parametrize(
    ("key", "meant"),
    [("Reliabilty Policy", "Reliability Policy"), ("durability policy", "Durability Policy"), ("Color", None)],
)
def test_a_key_that_looks_like_qos_and_is_not_read_is_a_warning(key, meant):
    text = WRITTEN.replace("Reliability Policy: Reliable, Reliability Policy", key)
    notes = read(Source("v.rviz", text.encode()), ReadContext()).notes
    assert [(note.code, note.severity, note.help) for note in notes] == (
        [("CQ040", "warning", f"did you mean `{meant}`?")] if meant else []
    )


ROBOT = "cqos: 1\nprotocol: ros2\nparticipants:\n  rsp: {publishes: {/robot_description: {durability: transient_local, depth: 1}}}\n"
MODEL = """\
Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/RobotModel
      Description Topic: {Depth: %s, Durability Policy: Volatile, Value: /robot_description}
"""


@pytest.mark.parametrize(("depth", "codes"), [("5", []), ("1", ["ROS202"])])
def test_a_robot_model_is_latched_until_a_key_of_its_topic_differs_from_the_defaults(depth, codes):
    report = check(
        merge([read_source(Source("d.yaml", ROBOT.encode())), read_source(Source("v.rviz", (MODEL % depth).encode()))])
    )
    assert [finding.code for finding in report.findings if finding.severity != "note"] == codes
