"""What importers of ROS 2 files report has a code like everything else: explained, named, and changed in severity."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from cqos_core.cli.app import cli
from cqos_ros2.importers.codes import CODES

SNAPSHOT = "Type: a/msg/A\nPublisher count: 1\nSubscription count: 0\n"
SYSTEM = "cqos: 1\nprotocol: ros2\n{}\nparticipants: {{a: {{publishes: {{/t: {{}}}}, subscribes: {{/t: {{}}}}}}}}\n"


def run(*arguments):
    return CliRunner().invoke(cli, arguments)


@pytest.mark.parametrize("info", CODES, ids=lambda info: info.code)
def test_every_code_is_explained(info):
    by_code, by_name = run("rule", info.code.lower()), run("rule", info.name)
    assert by_code.stdout == by_name.stdout
    assert by_code.stdout.startswith(f"{info.code} {info.name}\n")
    assert "the importers of ROS 2" in " ".join(by_code.stdout.split())
    assert json.loads(run("rule", info.code, "--format", "json").stdout)["pack"] == "ros2"


def test_codes_are_listed_with_the_pack():
    assert "ROS910  qos-not-recorded" in run("packs", "ros2").stdout
    listed = json.loads(run("packs", "ros2", "--format", "json").stdout)["codes"]
    assert [each["code"] for each in listed] == [info.code for info in CODES]


@pytest.mark.parametrize("name", ["ROS903", "counts-disagree"])
def test_findings_are_named_and_their_severity_can_be_changed(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    Path("t.txt").write_text(f"/t\n{SNAPSHOT}")
    for level, expected in (("error", 1), ("off", 0)):
        Path("s.yaml").write_text(SYSTEM.format(f"severities: {{{name}: {level}}}"))
        done = run("check", "s.yaml", "t.txt", "--format", "json", "--no-config")
        found = [each for each in json.loads(done.stdout)["findings"] if each["code"] == "ROS903"]
        assert done.exit_code == expected
        assert [each["name"] for each in found] == ["counts-disagree"] * expected
        assert "CQ603" not in done.stdout


def test_a_snapshot_without_the_name_of_its_topic_is_one_topic(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("dump.txt").write_text(SNAPSHOT)
    done = run("check", "dump.txt", "--format", "json", "--no-config")
    assert done.exit_code == 0
    named = [each["severity"] for each in json.loads(done.stdout)["findings"] if each["name"] == "topic-without-name"]
    assert named == ["note"]
