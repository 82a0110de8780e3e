"""The format ``concise``: one line per cause, as compilers print them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.formatters import phrases, terminal
from cqos_core.formatters.causes import causes, same_cause
from cqos_core.formatters.places import Places

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.report import Report
    from cqos_core.model.style import Style


def render_concise(report: Report, style: Style) -> str:
    """Return ``file:line:col: error[CODE] message`` for each cause, and for each system the verdict and all counts.

    A line ends with a similar name, if there is one, and with the other findings of the cause.
    """
    paint = terminal.paint(color=style.color)
    lines = [line for one in report.parts or (report,) for line in _lines(one, style, paint)]
    if report.parts:
        lines.append(phrases.total(report, style, paint))
    covered = phrases.coverage(report) if style.coverage else ()
    return "\n".join([*lines[:-1], *covered, *phrases.assumed(report), lines[-1]]) + "\n"


def _lines(report: Report, style: Style, paint: terminal.Paint) -> Iterator[str]:
    found = causes(phrases.shown(report, style), style)
    places = Places([finding for cause in found for finding in cause.findings], style.sources)
    for cause in found:
        finding = cause.first
        place = finding.place
        where = phrases.heading(report) if place is None else phrases.position(places.exact(place))
        head = paint(terminal.clean(f"{finding.severity}[{finding.code}]"), finding.severity)
        meant = f"; {finding.help}" if finding.help is not None and _MEANT in finding.help else ""
        more = f" ({same_cause(cause, places)})" if cause.more else ""
        accepted = "" if finding.accepted is None else f" (accepted: {finding.accepted})"
        lead = f"{terminal.clean(where)}: " if where else ""
        yield f"{lead}{head} {terminal.clean(finding.message + meant + more + accepted)}"
    yield from phrases.verdict(report, style, paint)


_MEANT = "did you mean"
"""The beginning of help that proposes a similar name; other help is in the longer formats."""
