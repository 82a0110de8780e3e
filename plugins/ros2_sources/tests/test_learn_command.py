"""The command `cqos learn` and the join with `cqos check`, from outside; hostile sources."""

from __future__ import annotations

import os
from typing import NamedTuple

import pytest
import yaml

from cqos_core.cli.app import run as command
from cqos_core.model.source import Source
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.reading import endpoints, read_node_file

pytestmark = pytest.mark.usefixtures("parser")


class Done(NamedTuple):
    """How a run ended."""

    exit_code: int
    output: str


DRIVER = """
class Driver : public rclcpp::Node {
public:
  Driver() : Node("driver") {
    pub_ = create_publisher<sensor_msgs::msg::LaserScan>(declare_parameter<std::string>("topic", "scan"), rclcpp::SensorDataQoS());
  }
};
int main() { rclcpp::spin(std::make_shared<Driver>()); }
"""
FILTER = """
class Filter : public rclcpp::Node {
public:
  Filter() : Node("filter") { sub_ = create_subscription<sensor_msgs::msg::LaserScan>("scan", 10, [](const sensor_msgs::msg::LaserScan &) {}); }
};
int main() { rclcpp::spin(std::make_shared<Filter>()); }
"""
FILES = {
    "package.xml": "<package><name>bot</name></package>",
    "CMakeLists.txt": "project(bot)\nforeach(name driver filter)\nadd_executable(${name} src/${name}.cpp)\nendforeach()\n",
    "src/driver.cpp": DRIVER,
    "src/filter.cpp": FILTER,
    "launch/bot.launch.xml": '<launch>\n<node pkg="bot" exec="driver"/>\n<node pkg="bot" exec="filter"/>\n</launch>\n',
}


@pytest.fixture
def workspace(tmp_path):
    for name, content in FILES.items():
        path = tmp_path / "src" / "bot" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    return tmp_path / "src"


@pytest.fixture
def run(capsys):
    def of(*arguments):
        code = command([*map(str, arguments)])
        out, err = capsys.readouterr()
        return Done(code, out + err)

    return of


def test_check_knows_nodes_from_their_sources(workspace, run):
    found = run(
        "check", workspace, "--launch", "bot:bot.launch.xml", "--option", "ros2.distro=jazzy", "--format", "concise"
    )
    assert found.exit_code == 1, found.output
    assert "error[ROS101]" in found.output
    assert "filter.cpp:4" in found.output or "driver.cpp:5" in found.output


def test_a_node_file_wins_over_sources(workspace, run):
    (workspace / "bot" / "bot.node.yaml").write_text(
        "cqos_nodes: 1\npackage: bot\nnodes:\n  filter: {name: filter, subscribes: {scan: {type: sensor_msgs/msg/LaserScan, qos: sensor_data}}}\n"
    )
    found = run(
        "check", workspace, "--launch", "bot:bot.launch.xml", "--option", "ros2.distro=jazzy", "--format", "concise"
    )
    assert found.exit_code == 0, found.output


def test_learn_writes_and_check_keeps_it_true(workspace, run):
    assert run("learn", workspace).exit_code == 0
    file = workspace / "bot" / "bot.node.yaml"
    assert "${topic}: {type: sensor_msgs/msg/LaserScan, qos: sensor_data, at: 'src/driver.cpp:5'}" in file.read_text()
    assert run("learn", workspace, "--diff").exit_code == 0
    driver = workspace / "bot" / "src" / "driver.cpp"
    driver.write_text("\n\n" + DRIVER)
    assert run("learn", workspace, "--diff").exit_code == 0, "a line that moved is no difference"
    driver.write_text(DRIVER.replace('"scan"', '"laser"').replace("rclcpp::SensorDataQoS()", "5"))
    found = run("learn", workspace, "--diff")
    assert found.exit_code == 1
    assert "parameters.topic.default is `scan` in the file, `laser` in the sources" in found.output
    assert (
        "publishes `${topic}`: it is `sensor_data` in the file, {depth: `5`} in the sources (src/driver.cpp:5)"
        in found.output.replace("qos is", "it is")
    )


def test_a_confirmed_entry_stays(workspace, run):
    run("learn", workspace)
    file = workspace / "bot" / "bot.node.yaml"
    text = file.read_text().replace("qos: {depth: 10}, at: 'src/filter.cpp:4'", "qos: {depth: 99}, confirmed: true")
    file.write_text(text)
    assert "depth: 99" in text
    assert run("learn", workspace).exit_code == 0
    assert "depth: 99" in file.read_text()
    assert run("learn", workspace, "--diff").exit_code == 0


def test_a_name_that_a_person_gave_takes_the_place_of_what_was_unknown(workspace, run):
    driver = workspace / "bot" / "src" / "driver.cpp"
    driver.write_text(DRIVER.replace('declare_parameter<std::string>("topic", "scan")', "read_it()"))
    run("learn", workspace)
    file = workspace / "bot" / "bot.node.yaml"
    text = file.read_text()
    assert "(unknown 1): {unknown: '`read_it` is not followed', " in text
    text = text.replace("(unknown 1): {unknown: '`read_it` is not followed', ", "scan: {confirmed: true, ")
    file.write_text(text)
    assert run("learn", workspace, "--diff").exit_code == 0
    assert run("learn", workspace).exit_code == 0
    assert "unknown" not in file.read_text()


CORRECTIONS = """
# The driver of 2025 loses no scan.
corrections:
  nodes:
    driver:
      publishes:
        ${topic}: {qos: {reliability: reliable}}  # measured
"""


def test_corrections_stay_and_take_the_place_of_what_was_learned(workspace, run):
    run("learn", workspace)
    file = workspace / "bot" / "bot.node.yaml"
    learned = file.read_text()
    file.write_text(learned + CORRECTIONS)
    assert run("learn", workspace, "--diff").exit_code == 0
    assert run("learn", workspace).exit_code == 0
    assert file.read_text() == learned + CORRECTIONS.lstrip()
    read = read_node_file(Source(str(file), file.read_bytes()))
    (scan,) = (each.entry for each in endpoints(read.nodes["driver"]) if each.name == "${topic}")
    assert scan.get(form.TYPE) == "sensor_msgs/msg/LaserScan"
    assert [(each.get(form.PROFILE), each.settings["reliability"].text) for each in scan.require(form.QOS)] == [
        (None, "reliable")
    ]


def test_corrections_in_a_file_on_one_line_stay(workspace, run):
    file = workspace / "bot" / "bot.node.yaml"
    file.write_text(
        "{cqos_nodes: 1, package: bot, from: {by: learn}, nodes: {driver: {}}, corrections: {nodes: {driver: {name: mine}}}}"
    )
    assert run("learn", workspace).exit_code == 0
    assert yaml.safe_load(file.read_text())["corrections"] == {"nodes": {"driver": {"name": "mine"}}}


def test_corrections_that_stand_first_do_not_repeat_the_head(workspace, run):
    run("learn", workspace)
    file = workspace / "bot" / "bot.node.yaml"
    learned = file.read_text()
    file.write_text(learned.replace("cqos_nodes:", CORRECTIONS.lstrip() + "cqos_nodes:"))
    assert run("learn", workspace).exit_code == 0
    assert file.read_text() == learned + CORRECTIONS.lstrip()


def test_a_correction_that_needs_a_line_that_goes_away_is_refused(workspace, run):
    run("learn", workspace)
    file = workspace / "bot" / "bot.node.yaml"
    text = file.read_text().replace("package: bot", "package: &name bot")
    text += "corrections: {nodes: {driver: {name: *name}}}\n"
    file.write_text(text)
    done = run("learn", workspace)
    assert (done.exit_code, file.read_text()) == (2, text)
    assert "in `corrections`, `*name` refers to an anchor" in done.output


def test_corrections_in_a_file_by_hand_are_those_of_the_person(workspace, run):
    file = workspace / "bot" / "bot.node.yaml"
    text = "cqos_nodes: 1\npackage: bot\nnodes: {mine: {}}\ncorrections: {nodes: {mine: {name: x}}}\n"
    file.write_text(text)
    done = run("learn", workspace)
    assert (done.exit_code, file.read_text()) == (0, text)
    assert "left as it is" in done.output


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_corrections_are_kept_in_any_encoding_that_is_read(workspace, run, encoding):
    run("learn", workspace)
    file = workspace / "bot" / "bot.node.yaml"
    learned = file.read_text()
    file.write_bytes((learned + CORRECTIONS).encode(encoding))
    assert run("learn", workspace).exit_code == 0
    assert file.read_text() == learned + CORRECTIONS.lstrip()


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "${topic}:",
            "laser:",
            "node `driver`: that it publishes `laser` is corrected, and the sources do not have it",
        ),
        ("driver:", "pilot:", "node `pilot`: it is corrected, and the sources do not have it"),
    ],
)
def test_a_correction_of_what_the_sources_no_longer_have_is_refused(workspace, run, before, after, message):
    run("learn", workspace)
    file = workspace / "bot" / "bot.node.yaml"
    learned = file.read_text()
    text = learned.replace(before, after) + CORRECTIONS.replace(before, after)
    file.write_text(text)
    checked = run("learn", workspace, "--diff")
    assert (checked.exit_code, message in checked.output) == (1, True)
    done = run("learn", workspace)
    assert (done.exit_code, message in done.output) == (2, True)
    assert file.read_text() == text


def test_a_file_by_hand_is_not_overwritten(workspace, run):
    file = workspace / "bot" / "bot.node.yaml"
    file.write_text("cqos_nodes: 1\npackage: bot\nnodes: {driver: {name: mine}}\n")
    found = run("learn", workspace)
    assert "left as it is" in found.output
    assert "mine" in file.read_text()


@pytest.mark.parametrize("arguments", [["nowhere"], [".", "--package", "bto"]])
def test_wrong_usage(workspace, arguments, monkeypatch, run):
    monkeypatch.chdir(workspace)
    found = run("learn", *arguments)
    assert found.exit_code == 2
    assert "Traceback" not in found.output


HOSTILE: dict[str, str | bytes] = {
    "syntax errors": "class X : public rclcpp::Node { X() : Node( { { ((( create_publisher<",
    "deep": "int main() { auto x = " + "(" * 5000 + "1" + ")" * 5000 + "; }",
    "not UTF-8": b'\xff\xfe int main() { auto n = std::make_shared<rclcpp::Node>("\xe4"); }',
    "itself": "class A : public A { A() : A() {} }; void f() { f(); } int main() { f(); auto a = std::make_shared<A>(); }",
    "huge": b"// " + b"x" * 3_000_000,
    "many branches": "int main() { int x = 0; " + "if (rand()) { x = 1; } " * 3000 + "}",
    "nested calls": "".join(f"void f{n}() {{ f{n + 1}(); f{n + 1}(); f{n + 1}(); }}\n" for n in range(40))
    + "void f40() {} int main() { f0(); }",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_sources_end_with_a_report(workspace, name, run):
    content = HOSTILE[name]
    path = workspace / "bot" / "src" / "driver.cpp"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    found = run("learn", workspace)
    assert found.exit_code == 0, found.output
    assert "Traceback" not in found.output


@pytest.mark.parametrize(
    "content", [b"def (", b"\xff\xff = 1", b"x = " + b"(" * 500 + b")" * 500, b"x" * 3_000_000, b"\0"]
)
def test_hostile_python_ends_with_a_report(workspace, content, run):
    (workspace / "bot" / "setup.py").write_bytes(content)
    (workspace / "bot" / "node.py").write_bytes(content)
    found = run("learn", workspace)
    assert found.exit_code == 0, found.output


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="no links")
def test_links_in_a_circle(workspace, run):
    (workspace / "bot" / "loop").symlink_to(workspace / "bot", target_is_directory=True)
    (workspace / "bot" / "src" / "again.cpp").symlink_to(workspace / "bot" / "src" / "again.cpp")
    assert run("learn", workspace).exit_code == 0


def test_a_package_of_the_same_name_beside_it_is_left_alone(workspace, run):
    other = workspace / "another"
    other.mkdir()
    (other / "package.xml").write_text(FILES["package.xml"])
    found = run("learn", workspace / "bot")
    assert found.exit_code == 0, found.output
    assert (workspace / "bot" / "bot.node.yaml").exists()
    assert not (other / "bot.node.yaml").exists()
