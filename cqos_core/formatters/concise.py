"""One line per finding, as compilers write them and editors read them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.formatters import terminal, wording
from cqos_core.formatters.places import Places

if TYPE_CHECKING:
    from cqos_core.formatters.style import Style
    from cqos_core.report import Finding, Report


def render_concise(report: Report, style: Style) -> str:
    """Return ``file:line:col: error[CODE] message`` for each finding, and one line with the verdict and all counts."""
    findings = wording.shown(report, style)
    places = Places(findings, style.sources)
    paint = terminal.paint(color=style.color)

    def line(finding: Finding) -> str:
        place = finding.place
        where = wording.heading(report) if place is None else wording.position(places.exact(place))
        head = paint(terminal.clean(f"{finding.severity}[{finding.code}]"), finding.severity)
        accepted = "" if finding.accepted is None else f" (accepted: {finding.accepted})"
        lead = f"{terminal.clean(where)}: " if where else ""
        return f"{lead}{head} {terminal.clean(finding.message + accepted)}"

    return "\n".join([*map(line, findings), wording.summary(report, style, paint)]) + "\n"
