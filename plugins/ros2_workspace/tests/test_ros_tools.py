"""`ros2 qos` by the interface that ros2cli documents, and `ament_cqos`. Neither needs ROS here."""

import argparse
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from lxml import etree

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
GOOD, BAD = (str(EXAMPLES / name) for name in ("smart_agriculture.yaml", "mobile_robot.yaml"))


@pytest.fixture
def qos():
    """What ros2cli does: load the entry point, make an instance, set its name, let it add arguments."""
    (entry,) = entry_points(group="ros2cli.command", name="qos")
    extension = entry.load()()
    extension.NAME = entry.name
    parser = argparse.ArgumentParser("ros2")
    command = parser.add_subparsers(dest="command").add_parser("qos")
    extension.add_arguments(command, "ros2 qos")

    def run(*arguments):
        return extension.main(parser=parser, args=parser.parse_args(["qos", *arguments]))

    return run


def test_check_has_the_options_and_exit_codes_of_cqos(qos, capsys, tmp_path):
    assert qos("check", GOOD) == 0
    assert "smart-agriculture: compatible" in capsys.readouterr().out
    assert qos("check", "--format", "concise", "--format", "json", "--output", str(tmp_path / "a.json"), BAD) == 1
    assert "error[ROS101]" in capsys.readouterr().out
    assert (tmp_path / "a.json").read_text(encoding="utf-8").startswith("{")
    assert qos("check", "no_such_file.yaml") == 2
    assert qos("check", "--format", "nonsense", GOOD) == 2


def test_explain_takes_a_file_and_two_endpoints(qos, capsys):
    ends = [f"{EXAMPLES}/mobile_robot.yaml", "lidar_driver/publisher/scan", "safety_monitor/subscriber/scan"]
    assert qos("explain", *ends) == 1
    assert "publisher `lidar_driver/publisher/scan`" in capsys.readouterr().out


def test_help_lists_the_verbs_and_their_options(qos, capsys):
    assert qos() == 0
    shown = capsys.readouterr().out
    assert all(verb in shown for verb in ("check", "explain"))
    with pytest.raises(SystemExit, match="0"):
        qos("check", "--help")
    assert "--together" in capsys.readouterr().out


def test_ament_cqos_is_a_linter(capsys, tmp_path, monkeypatch):
    (entry,) = entry_points(group="console_scripts", name="ament_cqos")
    main = entry.load()
    result = tmp_path / "results" / "package" / "cqos.xunit.xml"
    assert main([BAD, "--xunit-file", str(result)]) == 1
    assert "error[ROS101]" in capsys.readouterr().out
    assert etree.parse(result).getroot().get("failures") not in {None, "0"}
    package = tmp_path / "package"
    package.mkdir()
    (package / "good.yaml").write_bytes(Path(GOOD).read_bytes())
    (package / "bad.yaml").write_bytes(Path(BAD).read_bytes())
    monkeypatch.chdir(package)
    assert (main([]), main(["--exclude", "bad.yaml"])) == (1, 0)
