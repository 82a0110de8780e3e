"""Files that no importer reads: the advice for each."""

import pytest

from cqos_core.files.source_reader import read_source
from cqos_core.files.unrecognised_files import unrecognised_problem
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.plugins import load_plugins

LOG = (
    "[WARN] [1.2] [talker]: New subscription discovered on topic '/chatter', requesting incompatible QoS. No messages will "
    "be sent to it. Last incompatible policy: RELIABILITY_QOS_POLICY\n"
)


@pytest.mark.parametrize(
    ("name", "text", "what", "advice"),
    [
        ("a.yaml", " \n", "the file is empty", "cqos: 1"),
        ("a.yaml", "# a\n\n  # b\n", "nothing in this file but comments", "cqos: 1"),
        ("a.xml", "<?xml version='1.0'?><!-- a\nb -->", "nothing in this file but comments", "cqos: 1"),
        ("nav2_params.yaml", "amcl:\n  ros__parameters:\n    a: 1\n", "parameters of ROS 2 nodes", "--launch FILE"),
        ("a.launch.py", "def generate_launch_description(): ...", "a launch file", "--launch a.launch.py"),
        ("topics.txt", "/scan\n/tf [tf2_msgs/msg/TFMessage]\n", "a list of topics", "ros2 topic info"),
        ("bag_0.mcap", "\x89MCAP0", "the storage of a rosbag2 recording", "metadata.yaml"),
        ("node.log", f"start\n{LOG}", "what running programs print", "cqos explain --log node.log"),
        ("known.json", '{"baseline": 1, "findings": []}', "a baseline of C-QoS", "--baseline"),
        ("r.json", '{"version": 1, "tool": {"name": "cqos"', "a report of C-QoS", "check the files"),
        ("pack.yaml", "id: x\ntitle: X\npolicies: []\n", "a rule pack", "--pack"),
        ("cqos.toml", "fail_on = 'error'\n", "a configuration", "--config"),
        ("a.bin", "a\0b", "no text", "cqos packs"),
        ("a.yaml", "coqs: 1\n", "no installed importer", "did you mean `cqos: 1`?"),
        ("a.txt", "words\n", "no installed importer", "cqos packs"),
    ],
)
def test_a_file_for_something_else_is_named(name, text, what, advice):
    source = Source(name, text.encode("latin-1"))
    problem = unrecognised_problem(source, load_plugins())
    assert what in problem.message
    assert advice in (problem.help or "")
    with pytest.raises(InputError) as raised:
        read_source(source)
    assert raised.value.problems == (problem,)
