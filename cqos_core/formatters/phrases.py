"""Phrases that several formatters share: counts, lists of members, fixes, assumptions, the verdict line."""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from typing import TYPE_CHECKING

from cqos_core.formatters.terminal import clean
from cqos_core.model.core_findings import asks_less
from cqos_core.model.finding import Severity, Verdict, plural
from cqos_core.model.regular_expressions import regular_expression

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.formatters.terminal import Paint
    from cqos_core.model.finding import Fact, Finding, Remedy
    from cqos_core.model.report import Report
    from cqos_core.model.settings import Place
    from cqos_core.model.style import Style

_LISTED = 3  # more names than this are counted
_ORIGINS = {"profile": "from profile", "option": "from option", "overlay": "from an overlay"}
_OPTION = regular_expression(r"([\w-]+\.[\w.-]+)=([^,]+)")
_PHRASES = (
    (Verdict.COMPATIBLE, "fits with"),
    (Verdict.INCOMPATIBLE, "not with"),
    (Verdict.UNKNOWN, "cannot be known with"),
)


def listed(names: Sequence[str]) -> str:
    """Return ``a, b, c``, or ``a, b and 12 more``."""
    if len(names) <= _LISTED:
        return ", ".join(names)
    return f"{', '.join(names[: _LISTED - 1])} and {len(names) - _LISTED + 1} more"


def position(place: Place) -> str:
    """Return ``file:line:column``, as far as it is known."""
    known = (place.source, place.line, None if place.line is None else place.column)
    return ":".join(str(part) for part in known if part is not None)


def origin(fact: Fact) -> str:
    """Return the origin of a value in words; empty if the endpoint states it."""
    if fact.origin == "explicit":
        return ""
    kind, _, name = fact.origin.partition(" ")
    return f"{_ORIGINS.get(kind, kind)} {name}".rstrip()


_ELSEWHERE = ("topic", "option", "convention", "settled by ")
"""Beginnings of the origins of values that no end of a pair states."""


def label(side: str, fact: Fact) -> str:
    """Return the label of a value: that of the side, such as ``offered here``, or ``set here`` for a value from elsewhere."""
    return "set here" if side and fact.origin.startswith(_ELSEWHERE) else side


def value(fact: Fact) -> str:
    """Return a value with its origin: ``reliable (from profile response)``; without, if the endpoint states it."""
    if fact.value == "unknown" and fact.origin == "default":  # a fact: what has a default is known
        return "unknown (not stated)"
    written = fact.value or '""'
    return f"{written} ({origin(fact)})" if origin(fact) else written


def shown(report: Report, style: Style) -> list[Finding]:
    """Return the findings that a text format prints: of the chosen rules, else up to a severity; accepted ones only with notes."""
    return [
        finding
        for finding in report.findings
        if (
            any(code.lower().startswith(style.codes) for code in (finding.code, *finding.more_codes))
            if style.codes
            else finding.severity.rank <= style.show.rank and (finding.accepted is None or style.show is Severity.NOTE)
        )
    ]


def helps(finding: Finding) -> list[str]:
    """Return the fixes in their order, one sentence each; consecutive fixes without remarks share a sentence."""
    sentences: list[str] = []
    for costly, remedies in groupby(finding.remedies, key=lambda remedy: bool(_remarks(remedy))):
        texts = [fix(remedy) for remedy in remedies]
        sentences += texts if costly else [", or ".join(texts)]
    # Fixes are alternatives: without "or", the second line would read as a second step.
    found = [f"or {text}" if number else text for number, text in enumerate(sentences)]
    return found if finding.help is None else [finding.help, *found]


def message_and_helps(finding: Finding) -> str:
    """Return the message, and below it a line for each help."""
    return "\n".join([finding.message, *(f"help: {sentence}" for sentence in helps(finding))])


def fix(remedy: Remedy) -> str:
    """Return a fix in words, with its costs."""
    remarks = _remarks(remedy)
    return f"{remedy.text} ({remarks})" if remarks else remedy.text


def _remarks(remedy: Remedy) -> str:
    remarks = (
        (remedy.weakens, asks_less(remedy)),
        (remedy.kind == "needs_code", "the program must keep this promise"),
        (remedy.breaks, f"makes {plural(remedy.breaks or 0, 'other pair')} worse"),
    )
    return "; ".join([*(text for holds, text in remarks if holds), *remedy.costs])


def worlds(verdicts: Mapping[str, Verdict]) -> str:
    """Return the verdicts by assumption: ``fits with cyclonedds, connext; not with fastdds``."""
    names = _assumptions(verdicts)
    ordered = sorted(verdicts.items())
    phrases = [
        f"{phrase} {', '.join(names[world] for world, verdict in ordered if verdict is wanted)}"
        for wanted, phrase in _PHRASES
        if wanted in verdicts.values()
    ]
    return "; ".join(phrases)


def _assumptions(worlds: Iterable[str]) -> dict[str, str]:
    """Return a name for each assumption: ``ros2.rmw=fastdds`` becomes ``fastdds`` if all are about one option."""
    found = {world: _OPTION.fullmatch(world) for world in worlds}
    if len({match and match[1] for match in found.values()}) > 1:
        return {world: world for world in found}
    return {world: match[2] if match else world for world, match in found.items()}


def heading(report: Report) -> str:
    """Return the name of the system, else its sources, else an empty text."""
    if report.system or not report.sources:
        return report.system
    more = len(report.sources) - 1
    return f"{report.sources[0]} and {more} more" if more else report.sources[0]


def assumed(report: Report) -> Iterator[str]:
    """Yield ``assumed: ros2.rmw cyclonedds, fastdds or connext`` for each option that is not stated."""
    for each in report.assumed:
        *others, last = each.values or ("no value with which all endpoints can exist",)
        yield clean(f"assumed: {each.option} {', '.join(others)}{' or ' if others else ''}{last}")


def counts(report: Report, style: Style, *, asks: bool = True) -> str:
    """Return ``2 topics, 4 pairs judged, 1 error, 2 notes (shown with --show notes)``.

    ``asks``: name the option that lists parts which were not read, unless it was given.
    """
    parts = [plural(report.topics, "topic"), f"{plural(report.pair_count, 'pair')} judged"]
    if report.hypothetical:
        parts.append(f"{plural(report.hypothetical, 'hypothetical pair')} tried")
    for severity in Severity:
        if (number := report.count(severity)) and not (severity is Severity.ERROR and beside(report)):
            hidden = f" (shown with --show {severity}s)" if severity.rank > style.show.rank else ""
            parts.append(plural(number, severity) + hidden)
    if accepted := sum(finding.accepted is not None for finding in report.findings):
        parts.append(f"{accepted} accepted")
    counted = ", ".join(parts if report.findings else [*parts, "no findings"])
    unread = ", ".join(not_read(report))
    hidden = " (listed with --show coverage)" if asks and not style.coverage else ""
    return f"{counted}; not read: {unread}{hidden}" if unread else counted


def not_read(report: Report) -> list[str]:
    """Return how many parts of each kind were not read: ``3 of 14 nodes``, ``1 include``."""
    totals = report.coverage.totals
    # One part may have several causes.
    distinct = dict.fromkeys((each.kind, each.name or each.cause, each.place) for each in report.coverage.unread)
    kinds = Counter(kind for kind, *_ in distinct)
    return [
        clean(f"{number} of {plural(totals[kind], kind)}" if totals.get(kind, 0) > number else plural(number, kind))
        for kind, number in kinds.items()
    ]


def coverage(report: Report) -> Iterator[str]:
    """Yield the coverage, and each part of the inputs that was not read."""
    covered = report.coverage
    known = covered.endpoints - len(covered.unclear)
    missing = sum(each.endpoints for each in covered.unread)
    more = f", and at least {plural(missing, 'endpoint')} not read" if missing else ""
    if covered.endpoints:
        yield f"coverage: {covered.percent} %: {known} of {plural(covered.endpoints, 'endpoint')} known whole{more}"
    else:
        yield "coverage: no endpoint was read"
    for each in covered.unread:
        name, cause = (f" `{each.name}`" if each.name else ""), (f": {each.cause}" if each.cause else "")
        yield clean(
            f"not read: {each.kind}{name}{cause}{f' ({position(each.place)})' if each.place is not None else ''}"
        )
    # Ids are unique in one system only.
    for one in report.parts or (report,):
        said = {each.place.element for each in one.coverage.unread if each.place is not None}
        yield from (clean(f"not known whole: `{name}`") for name in one.coverage.unclear if name not in said)


def beside(report: Report) -> str:
    """Return ``, 2 errors`` if there are errors although all pairs are compatible."""
    errors = report.count(Severity.ERROR)
    return f", {plural(errors, 'error')}" if errors and report.verdict is Verdict.COMPATIBLE else ""


def verdict(report: Report, style: Style, paint: Paint) -> Iterator[str]:
    """Yield the line ``name: verdict: counts``; before it, for a part of a system, a line on endpoints without partner."""
    name = f"{clean(heading(report))}: " if heading(report) else ""
    if loose := _loose_ends(report):
        yield f"{name}{loose}"
    errors = paint(beside(report), Severity.ERROR) if beside(report) else ""
    yield f"{name}{paint(report.verdict_words, report.verdict)}{errors}: {counts(report, style)}"


def _loose_ends(report: Report) -> str:
    if not report.partial or (report.endpoints and not report.unmatched):
        return ""
    read = plural(report.endpoints, "endpoint")
    loose = f"{read} read, {report.unmatched} without partner in it" if report.endpoints else "no endpoint in it"
    return f"part of a system: {loose}; name the files of the other participants beside it"


def conclusion(report: Report, style: Style, paint: Paint) -> list[str]:
    """Return the last lines of a report: its verdict, or the total of several systems."""
    return [total(report, style, paint)] if report.parts else [*verdict(report, style, paint)]


def total(report: Report, style: Style, paint: Paint, *, asks: bool = True) -> str:
    """Return ``total: 3 systems: 2 compatible, 1 unknown: counts``, one line; ``asks`` as in `counts`."""
    parts = sorted(report.parts, key=lambda part: (-part.verdict.rank, part.verdict_words))
    verdicts = Counter((part.verdict, part.verdict_words) for part in parts)
    counted = ", ".join(paint(f"{number} {words}", each) for (each, words), number in verdicts.items())
    return (
        f"total: {plural(len(report.parts), 'system')}: {counted}{beside(report)}: {counts(report, style, asks=asks)}"
    )
