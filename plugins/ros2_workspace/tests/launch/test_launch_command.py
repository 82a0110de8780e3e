"""The command ``cqos launch``, from outside."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from cqos_core.cli.app import run

FILE = """<launch>
  <arg name="sim"/>
  <arg name="ns" default="robot"/>
  <group><push-ros-namespace namespace="$(var ns)"/>
    <node pkg="p" exec="driver" name="scan" unless="$(var sim)"><remap from="scan" to="front"/></node>
  </group>
  <include file="$(find-pkg-share other)/launch/x.launch.py"/>
</launch>
"""


@pytest.fixture
def root(workspace):
    return workspace({"bot/launch/bot.launch.xml": FILE})


def printed(capsys, *arguments):
    code = run(["launch", *arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_the_text(root, capsys):
    code, out, err = printed(capsys, str(root / "bot/launch/bot.launch.xml"))
    assert (code, err) == (0, "")
    assert out == (
        f"bot/launch/bot.launch.xml in {root} (1 package)\n"
        "1 node would start.\n"
        "\n"
        "bot/launch/bot.launch.xml\n"
        "  5: /robot/scan  node p driver\n"
        "      only if sim is not true\n"
        "      scan → front\n"
        "\n"
        "Not read:\n"
        "  1 include of packages that are not in the workspace: other\n"
        "\n"
        "Not decided (decide with --launch-arg NAME:=VALUE, the environment with --define NAME=VALUE):\n"
        "  sim: compared with `true`\n"
    )


def test_json_by_package_and_file(root, capsys):
    code, out, _ = printed(capsys, str(root), "bot:bot.launch.xml", "--launch-arg", "sim:=false", "--format", "json")
    found = json.loads(out)
    assert (code, found["version"], found["undecided"]) == (0, 1, {})
    (node,) = found["instances"]
    assert (node["namespace"], node["name"], node["remaps"]) == ("/robot", "scan", [{"from": "scan", "to": "front"}])
    assert node["place"]["line"] == 5
    assert [each["missing_package"] for each in found["not_read"]] == ["other"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["bot:bott.launch.xml"], "did you mean `bot.launch.xml`"),
        (["bott:bot.launch.xml"], "did you mean `bot`"),
        (["nothing.launch.py"], "there is no file `nothing.launch.py`"),
        (["bot:bot.launch.xml", "--launch-arg", "simm:=true"], "did you mean `sim`"),
        (["bot:bot.launch.xml", "--launch-arg", "sim=true"], "write NAME:=VALUE"),
        (["/no/such/folder", "bot:bot.launch.xml"], "there is no folder"),
    ],
)
def test_wrong_usage_says_what_to_do(root, capsys, arguments, words):
    given = arguments if arguments[0].startswith("/") else [str(root), *arguments]
    code, out, err = printed(capsys, *given)
    assert (code, out) == (2, "")
    assert words in " ".join(err.split())


def test_an_unreadable_launch_fails(workspace, capsys):
    root = workspace({"bot/bad.launch.py": "def (:\n"})
    code, out, _ = printed(capsys, str(root / "bot/bad.launch.py"))
    assert code == 1
    assert "this is not Python" in out


def test_help_lists_the_command():
    from cqos_core.cli.app import cli

    assert "launch" in CliRunner().invoke(cli, ["--help"]).output
