"""What `cqos check` does with whatever lies at a path: it finds the launch file, or prints the command that works."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.command_process import run_here

EXAMPLES = Path(__file__).resolve().parents[4] / "examples"
MANIFEST = "<package><name>{}</name></package>"
TALKER = '<node pkg="bot" exec="talker"/>'
INCLUDE = '<include file="$(find-pkg-share {})/launch/{}"{}/>'
FACTS = "cqos_nodes: 1\npackage: bot\nnodes:\n  talker: {name: talker, publishes: {chatter: {type: std_msgs/msg/String}}}\n  listener: {name: listener, subscribes: {chatter: {type: std_msgs/msg/String}}}\n"
LISTENER = '<node pkg="bot" exec="listener"/>'
SOURCE = """import rclpy
from rclpy.node import Node
from std_msgs.msg import String
class Talker(Node):
    def __init__(self):
        super().__init__('talker')
        self.create_publisher(String, 'chatter', 10)
def main():
    rclpy.init()
    rclpy.spin(Talker())
"""
SETUP = (
    "from setuptools import setup\nsetup(name='bot', entry_points={'console_scripts': ['talker = bot.talker:main']})\n"
)


def launch(*body):
    return f"<launch>{''.join(body)}</launch>"


def write(root, files):
    for name, content in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content) if isinstance(content, bytes) else path.write_text(content)
    return root


BOT = {"src/bot/package.xml": MANIFEST.format("bot"), "src/bot/bot.node.yaml": FACTS}
PAIR = launch(TALKER, LISTENER)
OTHER = {"src/arm_bringup/package.xml": MANIFEST.format("arm_bringup")}


def commands(text):
    """The lines that a message asks to write."""
    return [line.strip() for line in text.splitlines() if re.match(r" +(?:cqos|echo|mkdir|printf|ros2) ", line)]


def follow(lines, folder):
    """Run lines as a shell does, `cqos` as the command; return how the last one ended."""
    done = None
    for line in lines:
        if line.startswith("cqos "):
            words = subprocess.run(
                ["sh", "-c", f"printf '%s\\n' {line[5:]}"], capture_output=True, text=True, check=True
            )
            done = run_here(words.stdout.splitlines(), folder)
            assert done.code in {0, 1}, f"{line}\n{done.out}{done.err}"
        else:
            subprocess.run(["sh", "-ec", line], cwd=folder, check=True)
    assert done is not None
    return done


# Workspaces


@pytest.mark.parametrize("path", [".", "src", "src/bot", "src/bot/launch", "src/bot/launch/a.launch.xml"])
def test_the_only_launch_file_is_checked(tmp_path, path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": PAIR})
    done = run_here(["check", path], tmp_path)
    assert done.code == 0, done.out + done.err
    assert "compatible: 1 topic, 1 pair judged" in done.out
    (said,) = [line for line in done.err.splitlines() if "a.launch.xml" in line]
    assert "so it is checked, as `cqos check " in said
    again = follow([said.partition("`")[2].partition("`")[0]], tmp_path)
    assert again.out.splitlines()[-1].partition(": ")[2] == done.out.splitlines()[-1].partition(": ")[2]


def test_a_launch_file_that_includes_all_others_is_checked(tmp_path):
    parts = {
        "src/bot/launch/talker.launch.xml": launch(TALKER),
        "src/bot/launch/listener.launch.xml": launch(
            INCLUDE.format("bot", "talker.launch.xml", ' if="false"'), LISTENER
        ),
        "src/bot/launch/robot.launch.xml": launch(INCLUDE.format("bot", "listener.launch.xml", "")),
        "src/bot/test/test_bot.launch.xml": launch(INCLUDE.format("bot", "robot.launch.xml", "")),
    }
    write(tmp_path, {**BOT, **parts})
    done = run_here(["check", "."], tmp_path)
    assert "bot:robot.launch.xml: " in done.out
    assert "bot:robot.launch.xml includes all 2 others (without 1 launch file of tests), so it is checked" in done.err


def test_several_launch_files_are_named_with_the_command_for_the_most_likely(tmp_path):
    files = {
        "src/bot/launch/all.launch.xml": launch(TALKER, TALKER, LISTENER, INCLUDE.format("bot", "part.launch.xml", "")),
        "src/bot/launch/part.launch.xml": launch(TALKER),
        "src/arm_bringup/launch/arm.launch.py": "def generate_launch_description():\n    return None\n",
        "src/arm_bringup/launch/helper.py": "import launch\n",
        "src/old/launch/ros1.launch": '<launch><node pkg="a" type="b" name="c"/></launch>',
    }
    write(tmp_path, {**BOT, **OTHER, **files})
    done = run_here(["check", ".", "--option", "ros2.distro=jazzy"], tmp_path)
    assert (done.code, done.out) == (1, "")
    assert done.err.startswith(
        "error[CQ062] .: 3 launch files, and --launch names none, so nothing that they start is checked"
    )
    first = "cqos check . --option ros2.distro=jazzy --launch arm_bringup:arm.launch.py"
    assert commands(done.err) == [first]
    assert "bot:all.launch.xml: starts 4 nodes, includes part.launch.xml" in done.err
    assert "included by others: part.launch.xml" in done.err
    assert "ros1" not in done.err


def test_without_a_bringup_package_what_starts_most_is_the_most_likely(tmp_path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": launch(TALKER), "src/bot/launch/b.launch.xml": PAIR})
    done = run_here(["check", "src"], tmp_path)
    assert done.code == 1
    assert commands(done.err) == ["cqos check src --launch bot:b.launch.xml"]
    assert "compatible: 1 topic, 1 pair judged" in follow(commands(done.err), tmp_path).out


def test_a_whole_system_beside_the_launch_files_is_still_checked(tmp_path):
    shutil.copy(EXAMPLES / "mobile_robot.yaml", tmp_path)
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": launch(TALKER), "src/bot/launch/b.launch.xml": PAIR})
    done = run_here(["check", ".", "--format", "concise"], tmp_path)
    assert done.code == 1
    assert "mobile-robot: incompatible" in done.out
    assert "error[CQ062]" in done.err


def test_programs_see_that_nothing_was_chosen(tmp_path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": launch(TALKER), "src/bot/launch/b.launch.xml": PAIR})
    report = json.loads(run_here(["check", ".", "--format", "json"], tmp_path).out)
    assert (report["verdict"], report["findings"][0]["code"]) == ("unknown", "CQ062")


@pytest.mark.parametrize("command", [["explain", "."], ["convert", ".", "--to", "yaml"], ["why", ".", "/chatter"]])
def test_other_commands_find_the_launch_file_too(tmp_path, command):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": PAIR})
    done = run_here(command, tmp_path)
    assert "chatter" in done.out
    assert "bot:a.launch.xml is the only launch file" in done.err
    write(tmp_path, {"src/bot/launch/b.launch.xml": launch(TALKER)})
    undecided = run_here(command, tmp_path)
    assert undecided.code == 2
    assert commands(undecided.err) == [f"cqos {' '.join(command)} --launch bot:a.launch.xml"]


def test_arguments_hold_for_a_launch_file_that_is_found(tmp_path):
    body = '<arg name="listen" default="false"/><node pkg="bot" exec="listener" if="$(var listen)"/>'
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": launch(TALKER, body)})
    assert "0 pairs judged" in run_here(["check", "."], tmp_path).out
    done = run_here(["check", "src/bot/launch/a.launch.xml", "--launch-arg", "listen:=true"], tmp_path)
    assert "1 pair judged" in done.out


def test_what_is_named_beside_a_workspace_is_part_of_the_system(tmp_path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": launch(TALKER)})
    write(tmp_path, {"ear.yaml": "cqos: 1\nprotocol: ros2\nparticipants: {ear: {subscribes: {/chatter: }}}\n"})
    for paths in (["."], ["src/bot/launch/a.launch.xml"], [".", "src/bot/launch/a.launch.xml"]):
        done = run_here(["check", *paths, "ear.yaml"], tmp_path)
        assert "1 pair judged" in done.out, done.out + done.err


def test_a_recording_beside_a_workspace_is_read_as_a_recording(tmp_path):
    shutil.copytree(EXAMPLES / "robot_workspace", tmp_path / "ws")
    shutil.copytree(EXAMPLES / "robot_directory" / "bag", tmp_path / "bag")
    named = run_here(["check", "ws", "bag", "--launch", "bot:sim.launch.xml"], tmp_path)
    found = run_here(["check", "ws", "bag"], tmp_path)
    assert named.out == found.out
    assert "bot:sim.launch.xml + bag: " in named.out


def test_an_installed_workspace_without_sources_is_read(tmp_path):
    share = "install/bot/share/bot"
    files = {f"{share}/package.xml": MANIFEST.format("bot"), f"{share}/bot.node.yaml": FACTS}
    write(tmp_path, {**files, f"{share}/launch/a.launch.xml": PAIR})
    for path in (".", "install", f"{share}/launch/a.launch.xml"):
        done = run_here(["check", path], tmp_path)
        assert "1 pair judged" in done.out, done.out + done.err


def test_excluded_launch_files_do_not_count(tmp_path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": PAIR, "src/bot/launch/b.launch.xml": launch(TALKER)})
    write(tmp_path, {"src/off/launch/c.launch.xml": launch(TALKER), "src/off/COLCON_IGNORE": ""})
    done = run_here(["check", ".", "--exclude", "b.launch.xml"], tmp_path)
    assert "bot:a.launch.xml is the only launch file" in done.err


def test_fixes_are_written_into_files_of_the_workspace(tmp_path):
    shutil.copytree(EXAMPLES / "robot_workspace", tmp_path, dirs_exist_ok=True)
    done = run_here(["check", ".", "--fix"], tmp_path)
    assert "fixed ROS202" in done.err
    assert "Durability Policy: Transient Local" in (tmp_path / "src/bot/config/bot.rviz").read_text()
    assert "ROS202" not in run_here(["check", "src", "--launch", "bot:sim.launch.xml"], tmp_path).out


def test_revisions_are_read_alike(tmp_path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": PAIR})
    git = ["git", "-c", "user.email=a@b", "-c", "user.name=a"]
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "x"]):
        subprocess.run([*git, *words], cwd=tmp_path, check=True)
    done = run_here(["diff", ".", "--against", ".#ref=HEAD"], tmp_path)
    assert "no difference; 2 endpoints in both" in done.out, done.out + done.err
    assert "a.launch.xml is the only launch file of HEAD:., so it is checked" in done.err


def test_launch_files_that_are_named_start_together(tmp_path):
    both = {"src/bot/launch/a.launch.xml": launch(TALKER), "src/bot/launch/b.launch.xml": launch(LISTENER)}
    write(tmp_path, {**BOT, **both})
    done = run_here(["check", *both], tmp_path)
    assert "1 pair judged" in done.out
    again = follow([done.err.partition("`")[2].partition("`")[0]], tmp_path)
    assert again.out == done.out


# Single files


def test_a_launch_file_without_a_workspace_comes_with_the_command(tmp_path):
    write(tmp_path, {"a.launch.py": "def generate_launch_description():\n    return []\n"})
    done = run_here(["check", "a.launch.py"], tmp_path)
    assert done.code == 2
    assert "no workspace is around it" in done.err
    assert commands(done.err) == ["cqos check . --launch a.launch.py"]


def test_a_workspace_above_the_packages_is_found(tmp_path):
    write(tmp_path, {**BOT, "start/a.launch.xml": PAIR})
    assert "1 pair judged" in run_here(["check", "start/a.launch.xml"], tmp_path).out
    assert "1 pair judged" in run_here(["check", "a.launch.xml"], tmp_path / "start").out


def test_the_option_for_launch_files_without_a_folder_comes_with_the_command(tmp_path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": PAIR})
    done = run_here(["check", "--launch", "src/bot/launch/a.launch.xml", "src/bot/launch/a.launch.xml"], tmp_path)
    assert done.code == 2
    assert "1 pair judged" in follow([done.err.rpartition("write `")[2].rpartition("`")[0]], tmp_path).out


def test_a_node_file_comes_with_the_commands_that_check_its_nodes(tmp_path):
    write(tmp_path, BOT)
    done = run_here(["check", "src/bot/bot.node.yaml"], tmp_path)
    assert done.code == 2
    assert "1 pair judged" in follow(commands(done.err), tmp_path).out
    write(tmp_path, {"src/bot/launch/a.launch.xml": PAIR})
    (tmp_path / "src/nodes.launch.yaml").unlink()
    done = run_here(["check", "src/bot/bot.node.yaml"], tmp_path)
    assert commands(done.err) == ["cqos check src --launch bot:a.launch.xml"]


@pytest.mark.parametrize("path", ["nodes", "nodes/bot.node.yaml"])
def test_a_node_file_outside_of_a_package_comes_with_the_commands_too(tmp_path, path):
    write(tmp_path, {"nodes/bot.node.yaml": FACTS})
    done = run_here(["check", path], tmp_path)
    assert done.code == 2
    assert "1 pair judged" in follow(commands(done.err), tmp_path).out


def test_names_in_printed_commands_are_quoted(tmp_path):
    text = FACTS.replace("package: bot", "package: 'x; touch hacked'").replace("talker:", "'$(touch hacked)':")
    write(tmp_path, {"a b/bot.node.yaml": text})
    done = run_here(["check", "a b/bot.node.yaml"], tmp_path)
    for line in commands(done.err):
        subprocess.run(["sh", "-c", line.replace("cqos ", "echo ")], cwd=tmp_path, check=False, capture_output=True)
    assert not [*tmp_path.rglob("hacked")], done.err


@pytest.mark.parametrize("name", ["package.xml", "config/nav.yaml"])
def test_a_file_of_a_package_comes_with_the_command_that_reads_it(tmp_path, name):
    shutil.copytree(EXAMPLES / "robot_workspace", tmp_path, dirs_exist_ok=True)
    done = run_here(["check", f"src/bot/{name}"], tmp_path)
    assert (done.code, commands(done.err)) == (2, ["cqos check src --launch bot:sim.launch.xml"])


# Sources and recordings


@pytest.mark.parametrize("path", [".", "src", "src/bot", "src/bot/bot", "src/bot/bot/talker.py"])
def test_sources_without_a_launch_file_come_with_the_commands(tmp_path, path):
    files = {"src/bot/setup.py": SETUP, "src/bot/bot/__init__.py": "", "src/bot/bot/talker.py": SOURCE}
    write(tmp_path, {"src/bot/package.xml": MANIFEST.format("bot"), **files})
    done = run_here(["check", path], tmp_path)
    assert done.code == 2
    assert "no launch file says which nodes run" in done.err
    lines = commands(done.err)
    assert lines[0].startswith("cqos learn ")
    assert "1 endpoint read" in follow(lines, tmp_path).out
    assert run_here(["check", path], tmp_path).code in {0, 2}


@pytest.mark.parametrize("path", ["app", "app/talker.py"])
def test_sources_outside_of_a_package_come_with_the_commands(tmp_path, path):
    cpp = (
        '#include "rclcpp/rclcpp.hpp"\nclass T : public rclcpp::Node { public: T() : Node("t") {'
        ' p_ = create_subscription<std_msgs::msg::String>("chatter", 10, nullptr); } };\n'
        "int main(int c, char** v) { rclcpp::init(c, v); rclcpp::spin(std::make_shared<T>()); }\n"
    )
    write(tmp_path, {"app/talker.py": SOURCE, "app/lib/ear.cpp": cpp})
    done = run_here(["check", path], tmp_path)
    assert done.code == 2
    judged = follow(commands(done.err), tmp_path).out
    assert ("1 pair judged" if path == "app" else "1 endpoint read") in judged, judged + done.err


def test_sources_beside_what_is_read_are_told(tmp_path):
    files = {"src/bot/setup.py": SETUP, "src/bot/bot/__init__.py": "", "src/bot/bot/talker.py": SOURCE}
    write(tmp_path, {"src/bot/package.xml": MANIFEST.format("bot"), **files})
    shutil.copy(EXAMPLES / "robot_directory/config/porter.rviz", tmp_path / "src/bot")
    done = run_here(["check", "."], tmp_path)
    assert "sources of 1 package, and no launch file says which nodes run" in done.err


def test_sources_of_clients_come_with_the_commands(tmp_path):
    client = (
        "import paho.mqtt.client as mqtt\nc = mqtt.Client(client_id='a')\nc.connect('h')\nc.publish('a/b', 1, qos=1)\n"
    )
    write(tmp_path, {"app/pub.py": client})
    for path in ("app", "app/pub.py"):
        done = run_here(["check", path], tmp_path)
        assert done.code == 2
        assert commands(done.err) == ["cqos learn app --output app/systems", "cqos check app/systems"]


def test_the_storage_of_a_recording_comes_with_the_commands(tmp_path):
    write(tmp_path, {"bag/a_0.mcap": b"\x89MCAP0\r\n", "old/b.db3": b""})
    shutil.copy(EXAMPLES / "robot_directory/bag/metadata.yaml", tmp_path / "old")
    for path in ("bag", "bag/a_0.mcap"):
        assert commands(run_here(["check", path], tmp_path).err) == ["ros2 bag reindex bag", "cqos check bag"]
    done = run_here(["check", "old/b.db3"], tmp_path)
    assert (done.code, commands(done.err)) == (2, ["cqos check old"])
    assert follow(commands(done.err), tmp_path).code == 0


# A folder with many things


def test_a_home_folder_is_told_thing_by_thing(tmp_path):
    home = tmp_path / "home"
    shutil.copytree(Path(__file__).with_name("simulation"), home / "ros2_ws")
    shutil.copytree(EXAMPLES / "robot_workspace", home / "old_ws")
    shutil.copytree(EXAMPLES / "robot_directory/bag", home / "bags/run1")
    shutil.copy(EXAMPLES / "robot_directory/config/porter.rviz", home)
    write(home, {"mosquitto.conf": "listener 1883\nallow_anonymous true\n", "notes.txt": "buy milk\n"})
    done = run_here(["check", "home"], tmp_path)
    assert done.code == 1
    assert commands(done.err) == [
        "cqos check home/ros2_ws --launch shop_bringup:simulation.launch.py",
        "cqos check home/old_ws --launch bot:sim.launch.xml",
        "cqos check home/mosquitto.conf",
        "cqos check home/porter.rviz",
        "cqos check home/bags/run1",
    ]
    for line in commands(done.err):
        follow([line], tmp_path)


def test_a_workspace_further_down_is_checked_where_nothing_else_lies(tmp_path):
    shutil.copytree(EXAMPLES / "robot_workspace", tmp_path / "projects/ws")
    done = run_here(["check", "projects"], tmp_path)
    assert "bot:sim.launch.xml is the only launch file of projects/ws" in done.err
    shutil.copytree(EXAMPLES / "robot_directory/bag", tmp_path / "projects/run1")
    done = run_here(["check", "projects"], tmp_path)
    assert (done.code, done.out) == (1, "")
    assert commands(done.err) == ["cqos check projects/ws --launch bot:sim.launch.xml", "cqos check projects/run1"]


def test_a_folder_without_a_workspace_is_checked_as_before(tmp_path):
    shutil.copytree(EXAMPLES / "robot_directory", tmp_path / "robot")
    done = run_here(["check", "robot"], tmp_path)
    assert (done.code, "2 systems: 1 incompatible" in done.out) == (1, True)


# What is assumed


@pytest.mark.parametrize("option", [[], ["--option", "ros2.distro=jazzy"]])
def test_distributions_that_node_files_are_for_are_named(tmp_path, option):
    shutil.copytree(EXAMPLES / "robot_workspace", tmp_path, dirs_exist_ok=True)
    done = run_here(["check", ".", *option], tmp_path)
    assert ("assumed: ros2.distro humble or jazzy" in done.out) is not bool(option)
    (tmp_path / "cqos.toml").write_text('[options.ros2]\ndistro = "jazzy"\n')
    configured = run_here(["check", "."], tmp_path)
    assert "assumed: ros2.distro" not in configured.out
    assert "4 pairs judged" in configured.out


def test_the_folder_that_is_missing_stands_before_the_names(tmp_path):
    write(tmp_path, {**BOT, "src/bot/launch/a.launch.xml": PAIR})
    write(tmp_path, {"ear.yaml": "cqos: 1\nprotocol: ros2\nparticipants: {ear: {subscribes: {/chatter: }}}\n"})
    done = run_here(["why", "ear.yaml", "/chatter", "--launch", "bot:a.launch.xml"], tmp_path)
    assert done.code == 2
    assert "help: write `cqos why . ear.yaml /chatter --launch bot:a.launch.xml`" in done.err
