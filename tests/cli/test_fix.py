"""``cqos check --fix`` and ``--diff``."""

import json
import re

import pytest

from cqos_core.cli import check_fixes
from cqos_planning import plan_command

SYSTEM = """cqos: 1
protocol: ros2
# my robot
participants:
  lidar:
    publishes:
      /scan: {reliability: best_effort}   # cheap
  planner:
    subscribes:
      /scan: {reliability: reliable}
      /map: {durability: transient_local}
  maps: {publishes: {/map: }}
"""


def test_fixes_are_written_and_checked_again(cqos, files):
    (files / "a.yaml").write_text(SYSTEM, encoding="utf-8")
    done = cqos("check", "--fix", "a.yaml")
    assert done.code == 0
    assert "note: fixed ROS101: offer reliability `reliable` on lidar/publisher/scan" in done.err
    text = (files / "a.yaml").read_text(encoding="utf-8")
    assert "# my robot" in text
    assert "/scan: {reliability: reliable}   # cheap" in text
    assert "maps: {publishes: {/map: {durability: transient_local} }}" in text


def test_a_diff_writes_nothing(cqos, files):
    (files / "a.yaml").write_text(SYSTEM, encoding="utf-8")
    done = cqos("check", "--diff", "a.yaml")
    assert "-      /scan: {reliability: best_effort}   # cheap\n" in done.out
    assert "+      /scan: {reliability: reliable}   # cheap\n" in done.out
    assert (files / "a.yaml").read_text(encoding="utf-8") == SYSTEM


def test_what_weakens_or_needs_code_is_left_with_its_reason(cqos, files):
    text = SYSTEM.replace("best_effort", "reliable").replace("{reliability: reliable}\n", "{deadline: 1s}\n")
    (files / "a.yaml").write_text(text, encoding="utf-8")
    done = cqos("check", "--fix", "a.yaml")
    assert done.code == 1
    assert "needs a decision, ROS103 on `/scan`: offer deadline `1s`" in done.err
    assert "is a promise that the program must keep" in done.err


MANY = """cqos: 1
protocol: ros2
participants:
  a: {publishes: {/tf: {durability: volatile}}}
  b: {publishes: {/tf: {durability: volatile}}}
  bridge: {subscribes: {/tf: {durability: transient_local}}}
"""


def test_the_fix_of_the_fewest_endpoints_comes_first_and_says_that_it_asks_for_less(cqos, files):
    (files / "a.yaml").write_text(MANY, encoding="utf-8")
    first, second = json.loads(cqos("check", "--format", "json", "a.yaml").out)["findings"][0]["remedies"]
    assert (first["role"], first["weakens"]) == ("subscriber", True)
    assert (second["role"], second["weakens"]) == ("publisher", False)
    text = cqos("check", "--format", "full", "a.yaml").out
    asked, offered = (text.index(each) for each in ("(asks for less)", "offer durability"))
    assert asked < offered


@pytest.mark.parametrize(
    ("option", "changed"),
    [((), ["/tf: {durability: transient_local}"] * 3), (("--weaken",), ["/tf: {durability: volatile}"] * 3)],
)
def test_a_fix_that_asks_for_less_is_taken_with_weaken_only(cqos, files, option, changed):
    (files / "a.yaml").write_text(MANY, encoding="utf-8")
    assert cqos("check", "--fix", *option, "a.yaml").code == 0
    assert re.findall(r"/tf: {[^}]*}", (files / "a.yaml").read_text(encoding="utf-8")) == changed


def test_fixing_ends_with_what_needs_a_decision_and_the_command_that_proposes_it(cqos, files):
    (files / "a.yaml").write_text(MANY + SYSTEM.partition("participants:\n")[2], encoding="utf-8")
    (files / "a.yaml").write_text(
        (files / "a.yaml").read_text().replace("{/tf: {durability: transient_local}}", "{/tf: {deadline: 1s}}"),
        encoding="utf-8",
    )
    done = cqos("check", "--fix", "a.yaml", "--option", "ros2.rmw=fastdds")
    lines = [line.removeprefix("note: ") for line in " ".join(done.err.split()).split("note: ")]
    assert [line.split(":")[0] for line in lines if line.startswith(("fixed ROS", "needs"))] == [
        "fixed ROS101",
        "fixed ROS102",
        "needs a decision, ROS103 on `/tf`",
    ]
    assert lines[-1] == (
        "fixed 2, 1 needs a decision; `cqos repair a.yaml --option ros2.rmw=fastdds --diff` proposes changes; "
        "--weaken lets --fix ask for less"
    )


def test_nothing_is_left_to_decide(cqos, files):
    (files / "a.yaml").write_text(SYSTEM, encoding="utf-8")
    assert "decision" not in cqos("check", "--fix", "a.yaml").err


def test_weaken_without_fix_is_refused(cqos, files):
    (files / "a.yaml").write_text(MANY, encoding="utf-8")
    assert cqos("check", "--weaken", "a.yaml").code == 2


@pytest.mark.parametrize("arguments", [("--fix", "-"), ("--diff", "--server", "h:1", "a.yaml")])
def test_what_cannot_be_fixed_in_place_is_refused(cqos, files, arguments):
    (files / "a.yaml").write_text(SYSTEM, encoding="utf-8")
    assert cqos("check", *arguments).code == 2


def append_before(monkeypatch, where, name, file):
    """Let another program append a line when the command has read the file and calls a function."""
    real = getattr(where, name)

    def call(*arguments, **named):
        with file.open("a") as other:
            other.write("# a line of another program\n")
        return real(*arguments, **named)

    monkeypatch.setattr(where, name, call)


@pytest.mark.parametrize("arguments", [("check", "--fix"), ("repair", "--fix")])
def test_a_fix_of_a_file_that_another_program_changed_is_refused(arguments, monkeypatch, cqos, files):
    file = files / "a.yaml"
    file.write_text(SYSTEM)
    append_before(monkeypatch, check_fixes if arguments[0] == "check" else plan_command, "replace_files", file)
    done = cqos(*arguments, "a.yaml")
    assert done.code == 2
    assert "is not written: another program changed the file after it was read" in done.err
    assert "fixed ROS101" not in done.err
    assert file.read_text() == SYSTEM + "# a line of another program\n"
