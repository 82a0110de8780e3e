"""One line per finding, as compilers write them and editors read them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.formatters import terminal, wording
from cqos_core.formatters.places import Places

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.report import Report
    from cqos_core.model.style import Style


def render_concise(report: Report, style: Style) -> str:
    """Return ``file:line:col: error[CODE] message`` for each finding, and for each system the verdict and all counts."""
    paint = terminal.paint(color=style.color)
    lines = [line for one in report.parts or (report,) for line in _lines(one, style, paint)]
    if report.parts:
        lines.append(wording.total(report, style, paint))
    return "\n".join([*lines[:-1], *wording.assumed(report), lines[-1]]) + "\n"


def _lines(report: Report, style: Style, paint: terminal.Paint) -> Iterator[str]:
    findings = wording.shown(report, style)
    places = Places(findings, style.sources)
    for finding in findings:
        place = finding.place
        where = wording.heading(report) if place is None else wording.position(places.exact(place))
        head = paint(terminal.clean(f"{finding.severity}[{finding.code}]"), finding.severity)
        accepted = "" if finding.accepted is None else f" (accepted: {finding.accepted})"
        lead = f"{terminal.clean(where)}: " if where else ""
        yield f"{lead}{head} {terminal.clean(finding.message + accepted)}"
    yield from wording.verdict(report, style, paint)
