"""The format ``statistics``: the number of findings of each rule, errors first, then the most frequent."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from cqos_core.formatters import phrases, terminal

if TYPE_CHECKING:
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style


def render_statistics(report: Report, style: Style) -> str:
    """Return the number, severity, code and name of each rule with findings that count, and the verdict or total as the last line."""
    paint = terminal.paint(color=style.color)
    counted = [each for each in phrases.shown(report, style) if each.accepted is None]
    rows = Counter((each.severity, each.code, each.name) for each in counted)
    digits = max((len(str(count)) for count in rows.values()), default=0)
    width = max((len(code) for _, code, _ in rows), default=0)
    lines = [
        f"{count:>{digits}}  {paint(f'{severity:<7}', severity)}  {terminal.clean(f'{code:<{width}}  {name}')}"
        for (severity, code, name), count in sorted(rows.items(), key=lambda row: (row[0][0].rank, -row[1], row[0][1:]))
    ]
    return "\n".join([*lines, *phrases.conclusion(report, style, paint)]) + "\n"
