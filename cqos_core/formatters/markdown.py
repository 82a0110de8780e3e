"""The format ``markdown``, for summaries of pipeline steps and for comments in pull requests."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.formatters import phrases, terminal
from cqos_core.formatters.causes import causes, same_cause
from cqos_core.formatters.places import Places, relative

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.formatters.causes import Cause
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style

_MOST: Final = 200  # causes: a summary of GitHub may have 1 MiB
# Characters of markup, mentions, emojis and links.
_SPECIAL = re.compile(r"[\\`*_{}\[\]<>&#|~@!$:]|(?<=www)\.", re.IGNORECASE)
_MOST_UNREAD: Final = 100  # parts of one system: as above
_NAME = re.compile(r"`([^`]+)`")


def render_markdown(report: Report, style: Style) -> str:
    """Return a heading and a table of findings for each system that was checked by itself."""
    lines = [line for part in report.parts or (report,) for line in _section(part, style)]
    if report.parts:
        total = phrases.total(report, style, terminal.paint(color=False), asks=False)
        lines = [f"**{as_markdown(total)}**", "", *lines]
    lines += [f"- {as_markdown(each)}" for each in phrases.assumed(report)]
    return "\n".join(lines).rstrip("\n") + "\n"


def _section(report: Report, style: Style) -> Iterator[str]:
    counts = as_markdown(phrases.counts(report, style, asks=False))
    yield f"### C-QoS: {as_markdown(phrases.heading(report) or 'system')}"
    yield from ("", f"**{report.verdict_words}**{phrases.beside(report)}: {counts}", "")
    found = causes([each for each in phrases.shown(report, style) if each.accepted is None], style)
    if found:
        yield from ("| | where | what | what to do |", "| - | ----- | ---- | ---------- |")
        yield from (*_rows(found[:_MOST], style), "")
    if rest := sum(len(cause.findings) for cause in found[_MOST:]):
        yield from (f"{rest} more findings are not listed.", "")
    if report.coverage.unread:
        covered = [*phrases.coverage(report)]
        yield from (f"- {as_markdown(each)}" for each in covered[:_MOST_UNREAD])
        if rest := len(covered[_MOST_UNREAD:]):
            yield f"- {rest} more are not listed."
        yield ""


def _rows(found: Sequence[Cause], style: Style) -> Iterator[str]:
    places = Places([finding for cause in found for finding in cause.findings], style.sources)
    for cause in found:
        finding = cause.first
        where = ""
        if finding.place is not None:
            place = places.exact(finding.place)
            where = relative(place.source, style) + (f":{place.line}" if place.line is not None else "")
        url = style.rule_url(finding.code)
        code = f"[{as_markdown(finding.code)}]({url})" if url else as_markdown(finding.code)
        advice = "<br>".join(as_markdown(each) for each in cause.helps)
        more = [same_cause(cause, places)] if cause.more else []
        what = "<br>".join(map(as_markdown, [finding.message, *more]))
        yield f"| {finding.severity} {code} | {as_markdown(where)} | {what} | {advice} |"


def as_markdown(text: str) -> str:
    """Return a text that Markdown shows as it is; names in backticks become code."""
    parts = _NAME.split(terminal.clean(text))
    return "".join(f"<code>{_plain(part)}</code>" if number % 2 else _plain(part) for number, part in enumerate(parts))


def _plain(text: str) -> str:
    return _SPECIAL.sub(lambda found: f"&#{ord(found[0])};", text)
