"""C-QoS decides: correct designs are known to be correct, and what is refused carries a fix as text for its file.

`python -m tests.decisive.test_decisive` writes the tables of docs/benchmarks.md.
"""

from __future__ import annotations

import re
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import pytest

from cqos_core import Severity, Verdict, check
from tests.laws.test_fixes import CASES
from tests.laws.test_fixes import reports as reports_of_cases

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core import Finding, Report

ROOT: Final = Path(__file__).parents[2]
PAGE: Final = ROOT / "docs/benchmarks.md"
TABLE: Final = re.compile(r"<!-- (?P<name>\w+) -->\n\n.*?(?=\n\n)", re.DOTALL)
DESIGNS: Final = sorted((Path(__file__).parent / "designs").iterdir())
EXAMPLES: Final = {
    "mobile_robot.yaml": ("mobile_robot.yaml",),
    "mqtt_greenhouse.yaml": ("mqtt_greenhouse.yaml",),
    "robot_directory": tuple(
        f"robot_directory/{name}"
        for name in ("robot.yaml", "config/lidar.yaml", "config/porter.rviz", "bag/metadata.yaml", "drivers.txt")
    ),
    "smart_agriculture.bpmn": ("smart_agriculture.bpmn",),
    "smart_agriculture_incompatible.bpmn": ("smart_agriculture_incompatible.bpmn",),
    "vehicle_qos.xml": ("vehicle_qos.xml",),
    "weather_station.yaml": ("mixed/weather_station.yaml",),
    "zenoh_fleet": tuple(f"zenoh_fleet/{name}" for name in ("fleet.yaml", "carrier.json5", "desk.json5")),
}
MOST_UNKNOWN: Final = 0.02
LEAST_FIXED: Final = 0.95
LEAST_AS_TEXT: Final = 0.80


class Shares(NamedTuple):
    """Pair errors of one source, how many of them have a fix, a fix as text, and one that weakens nothing."""

    errors: int = 0
    fixed: int = 0
    as_text: int = 0
    strengthened: int = 0

    def __add__(self, other: tuple[int, ...]) -> Shares:  # type: ignore[override]
        return Shares(*(mine + its for mine, its in zip(self, other, strict=True)))


def files_of(design: Path) -> list[Path]:
    return sorted(design.iterdir()) if design.is_dir() else [design]


@cache
def report_of(*files: Path) -> Report:
    return check(*files)


def unknown_pairs(report: Report) -> int:
    return sum(group.pairs for group in report.groups if group.verdict is Verdict.UNKNOWN)


def pair_errors(report: Report) -> list[Finding]:
    return [
        each
        for each in report.findings
        if each.severity is Severity.ERROR and each.verdict is Verdict.INCOMPATIBLE and each.pairs
    ]


def shares(findings: Iterable[Finding]) -> Shares:
    found = Shares()
    for each in findings:
        remedies = each.remedies
        found += (
            1,
            bool(remedies),
            any(remedy.edits for remedy in remedies),
            any(not remedy.weakens for remedy in remedies),
        )
    return found


@cache
def all_shares() -> dict[str, Shares]:
    found = {
        f"case files of {pack}": sum(
            (shares(pair_errors(report)) for _, _, report in reports_of_cases(pack)), start=Shares()
        )
        for pack in CASES
    }
    reports = (report_of(*(ROOT / "examples" / name for name in names)) for names in EXAMPLES.values())
    return {**found, "examples": sum((shares(pair_errors(report)) for report in reports), start=Shares())}


def table(name: str) -> str:
    rows: list[tuple[str, ...]]
    if name == "designs":
        rows = [("design", "files", "pairs", "unknown")]
        for design in DESIGNS:
            report = report_of(*files_of(design))
            rows.append((design.name, str(len(files_of(design))), str(report.pair_count), str(unknown_pairs(report))))
    else:
        rows = [("source", "pair errors", "with a fix", "as text for the file", "with a fix that weakens nothing")]
        rows += [(source, *map(str, found)) for source, found in all_shares().items()]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [f"| {' | '.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))} |" for row in rows]
    lines.insert(1, f"| {' | '.join('-' * width for width in widths)} |")
    return f"<!-- {name} -->\n\n" + "\n".join(lines)


def stated(name: str) -> str:
    return next(each[0] for each in TABLE.finditer(PAGE.read_text(encoding="utf-8")) if each["name"] == name)


def test_there_are_designs_of_many_kinds():
    assert len(DESIGNS) >= 15


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.name)
def test_a_correct_design_has_no_loud_finding(design):
    report = report_of(*files_of(design))
    assert report.pair_count >= 2
    assert [str(each) for each in report.findings if each.severity is not Severity.NOTE] == []
    assert report.verdict is Verdict.COMPATIBLE


def test_few_pairs_of_correct_designs_are_unknown():
    reports = [report_of(*files_of(design)) for design in DESIGNS]
    assert sum(map(unknown_pairs, reports)) <= MOST_UNKNOWN * sum(report.pair_count for report in reports)


def test_nearly_every_pair_error_has_a_fix_as_text_for_its_file():
    for source, found in all_shares().items():
        assert found.fixed >= LEAST_FIXED * found.errors, source
        assert found.as_text >= LEAST_AS_TEXT * found.fixed, source


def test_the_page_has_these_figures():
    assert stated("designs") == table("designs")
    figures = [[int(cell) for cell in row.split("|")[2:-1]] for row in stated("fixes").splitlines()[4:]]
    for written, found in zip(figures, all_shares().values(), strict=True):
        # A new case shifts the counts a little; the shares are what the page promises.
        for now, then in zip(found[1:], written[1:], strict=True):
            assert now / found.errors == pytest.approx(then / written[0], abs=0.03)


if __name__ == "__main__":
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(TABLE.sub(lambda each: table(each["name"]), page), encoding="utf-8")
    sys.stdout.write(f"{PAGE.relative_to(ROOT)}\n")
