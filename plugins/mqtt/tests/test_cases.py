"""Every rule on both sides of every boundary: the case files in `cases/`."""

from pathlib import Path

import pytest

from cqos_core.testing import load_cases, run_case
from cqos_mqtt.pack import PACK

CASES = Path(__file__).parent / "cases"


@pytest.mark.parametrize("file", sorted(CASES.glob("*.yml")), ids=lambda file: file.stem)
def test_cases(file: Path):
    wrong = []
    for case in load_cases(file, "mqtt"):
        try:
            run_case(case, [PACK])
        except AssertionError as error:
            wrong.append(str(error))
    assert not wrong, "\n".join(wrong)


def test_every_rule_has_cases_that_speak_and_cases_that_are_silent():
    cases = load_cases(CASES, "mqtt")
    for rule in PACK.rules:
        expected = {case.content["expect"] for case in cases if case.rule == rule.code}
        assert "ok" in expected, rule.code
        assert expected - {"ok"}, rule.code


def test_case_files_are_named_after_their_rule():
    for path in CASES.glob("*.yml"):
        assert path.read_text(encoding="utf-8").startswith(f"rule: {path.stem}\n")
