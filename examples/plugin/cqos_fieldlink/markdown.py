"""A report as a Markdown table, for the description of a merge request."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cqos_core import Finding, Report
    from cqos_core.model.style import Style


def render(report: Report, style: Style) -> str:
    """Return a heading with the verdict, and a row for each finding that ``style`` wants shown."""
    shown = [finding for finding in report.findings if finding.severity.rank <= style.show.rank]
    lines = [f"### {_cell(report.system or 'QoS')}: {report.verdict}", ""]
    if not shown:
        return "\n".join([*lines, f"Pairs judged: {report.pair_count}. Nothing was found."]) + "\n"
    lines += ["| rule | where | what | what to do |", "| ---- | ----- | ---- | ---------- |"]
    return "\n".join([*lines, *map(_row, shown)]) + "\n"


def _row(finding: Finding) -> str:
    where = str(finding.place or finding.topic or "")
    help_text = " or ".join(remedy.text for remedy in finding.remedies) or finding.help or ""
    cells = (f"{finding.severity} {finding.code}", where, finding.message, help_text)
    return f"| {' | '.join(map(_cell, cells))} |"


def _cell(text: str) -> str:
    """Escape a text, which may come from a file, so that it stays one cell without markup."""
    for mark in "\\|<>[]*_":
        text = text.replace(mark, f"\\{mark}")
    return " ".join(text.split())
