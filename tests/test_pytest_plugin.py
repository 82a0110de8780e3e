"""The pytest plugin, in runs of pytest of its own."""

import re
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
GOOD, BAD = (EXAMPLES / name for name in ("smart_agriculture.yaml", "mobile_robot.yaml"))


def run(pytester, text):
    pytester.makepyfile(text)
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", "-p", "no:hypothesispytest")


def test_a_failed_assertion_shows_the_findings(pytester):
    result = run(
        pytester,
        f"""
        import cqos

        def test_directly():
            assert cqos.check({str(BAD)!r}).ok

        def test_with_a_name():
            report = cqos.check({str(BAD)!r})
            assert not report.fails(), "my own words"

        def test_pair():
            pair = cqos.check_pair("ros2", offered={{"durability": "volatile"}}, requested={{"durability": "transient_local"}})
            assert pair.verdict == "compatible"

        def test_good():
            assert cqos.check({str(GOOD)!r}).ok

        def test_other():
            good = cqos.check({str(GOOD)!r})
            assert good.pair_count == 3
        """,
    )
    result.assert_outcomes(passed=1, failed=4)
    assert not [line for line in result.outlines if line.startswith("E") and "smart-agriculture: compatible:" in line]
    lines = result.outlines
    assert len([line for line in lines if re.match(r"E +error\[ROS101\]", line)]) == 4
    assert len([line for line in lines if re.match(r"E .*\^\^ requested here", line)]) > 2
    result.stdout.fnmatch_lines(["E*my own words"])
    result.stdout.fnmatch_lines(["E*incompatible", "E*ROS102*"])


@pytest.mark.parametrize("setting", ["", "[pytest]\ncqos_files = designs/*.yaml\n"])
def test_system_files_are_tests(pytester, setting):
    pytester.path.joinpath("designs").mkdir()
    end = "yaml" if setting else "cqos.yaml"
    for name, source in (("good", GOOD), ("bad", BAD)):
        pytester.path.joinpath("designs", f"{name}.{end}").write_bytes(source.read_bytes())
    pytester.path.joinpath("designs", f"broken.{end}").write_text("cqos: 1\nparticipants: 3\n", encoding="utf-8")
    pytester.path.joinpath("other.yaml").write_text("a: 1\n", encoding="utf-8")
    if setting:
        pytester.makeini(setting)
    result = run(pytester, "")
    result.assert_outcomes(passed=1, failed=2)
    result.stdout.fnmatch_lines(["*cqos check bad.*", "error[[]ROS*"])
    result.stdout.fnmatch_lines(["*cqos check broken.*", "*broken.*:2:*must be a map*"])


def test_a_run_that_does_not_use_it_imports_nothing_of_it(pytester):
    pytester.makepyfile(
        """
        import sys

        def test_loaded():
            loaded = sorted(name for name in sys.modules if name.startswith("cqos"))
            assert loaded == ["cqos_core", "cqos_core.cli", "cqos_core.cli.pytest_plugin"]
        """
    )
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(passed=1)
