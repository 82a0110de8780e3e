"""NoDL documents: read as one node each, joined with a launch, and written."""

from __future__ import annotations

import pytest

from tests.command_process import run_here

CAMERA = """nodl_version: 2
parameters: {rate: {type: double}}
publishers:
  - name: "~/image"
    type: sensor_msgs/msg/Image
    qos:
      history: KEEP_LAST
      depth: 5
      reliability: BEST_EFFORT
      durability: VOLATILE
      deadline_ns: 100000000
      liveliness: AUTOMATIC
subscriptions: [{name: mode, type: std_msgs/String, qos: {history: KEEP_ALL, reliability: RELIABLE, lifespan_ns: 0}}]
service_servers: [{name: "~/reset", type: std_srvs/srv/Empty}]
"""
VIEWER = """cqos: 1
protocol: ros2
participants:
  viewer: {subscribes: {/camera/image: {type: sensor_msgs/msg/Image, reliability: reliable}}}
"""


def checked(folder, *names, more=()):
    return run_here(["check", *names, "--together", "--format", "concise", *more], folder)


def test_a_document_is_a_node_of_the_name_of_its_file(tmp_path):
    (tmp_path / "camera.nodl.yaml").write_text(CAMERA)
    (tmp_path / "viewer.yaml").write_text(VIEWER)
    done = checked(tmp_path, "camera.nodl.yaml", "viewer.yaml")
    assert done.code == 1
    assert "ROS101] publisher `camera/publisher/~/image` offers reliability best_effort" in done.out


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("BEST_EFFORT", "best_effort", "`reliability` has no allowed value"),
        ("depth: 5", "depht: 5", "did you mean `depth`?"),
        ("nodl_version: 2", "nodl_version: 3", "only version 2 of NoDL is read"),
        ("parameters: {rate: {type: double}}", "include: [{ref: 'nodl://a/b'}]", "documents that it includes are not read"),
    ],
)  # fmt: skip
def test_what_is_not_read_is_reported_and_not_known(tmp_path, old, new, message):
    (tmp_path / "camera.nodl.yaml").write_text(CAMERA.replace(old, new))
    done = run_here(["check", "camera.nodl.yaml"], tmp_path)
    assert message in done.out.replace("\n  ", " ")
    if "reliability" in message:
        (tmp_path / "viewer.yaml").write_text(VIEWER)
        assert "unknown" in checked(tmp_path, "camera.nodl.yaml", "viewer.yaml").out.splitlines()[-1]


def test_a_written_document_is_read_back_as_the_same(tmp_path):
    (tmp_path / "camera.nodl.yaml").write_text(CAMERA)
    first = run_here(["convert", "camera.nodl.yaml", "--to", "nodl"], tmp_path)
    (tmp_path / "camera.nodl.yaml").write_text(first.out)
    again = run_here(["convert", "camera.nodl.yaml", "--to", "nodl"], tmp_path)
    assert (first.code, first.err) == (0, "")
    assert again.out == first.out
    assert "deadline_ns: 100000000" in first.out
    assert "std_msgs/msg/String" in first.out


def test_an_endpoint_without_type_is_named_and_nodes_are_kept_apart(tmp_path):
    (tmp_path / "system.yaml").write_text(
        "cqos: 1\nprotocol: ros2\nparticipants:\n  a: {publishes: {/x: {type: p/msg/A}, /y: }}\n  b: {subscribes: {/x: {type: p/msg/A}}}\n"
    )
    done = run_here(["convert", "system.yaml", "--to", "nodl"], tmp_path)
    assert done.out.count("nodl_version: 2") == 2
    assert "`a/publisher/y` is left out: NoDL needs its type" in done.err
    assert "put each of these into a file of its own" in done.err


def test_a_launch_takes_the_document_of_a_package(tmp_path):
    package = tmp_path / "src" / "bot"
    (package / "launch").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>bot</name></package>")
    (package / "driver.nodl.yaml").write_text(CAMERA)
    inner = '<remap from="/front/image" to="/camera/image"/>'
    launch = f'<launch><node pkg="bot" exec="driver" name="front">{inner}</node></launch>'
    (package / "launch" / "a.launch.xml").write_text(launch)
    (tmp_path / "viewer.yaml").write_text(VIEWER)
    done = checked(tmp_path, "viewer.yaml", "src", more=("--launch", "bot:a.launch.xml"))
    assert "ROS101] publisher `/front/publisher/camera/image` offers reliability best_effort" in done.out
