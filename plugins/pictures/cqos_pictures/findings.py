"""Data of findings for the page: sentences, marked excerpts of sources, and fixes as changed lines."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.formatters import phrases
from cqos_core.formatters.causes import causes, places_of, same_cause
from cqos_core.formatters.fingerprint import fingerprint
from cqos_core.formatters.full import marked_places, value_label
from cqos_core.formatters.places import Places
from cqos_core.model.encoding import decode
from cqos_core.model.finding import plural
from cqos_core.model.grouping import grouped
from cqos_pictures.graph import is_wrong
from cqos_pictures.page_text import first_names, state, text_pieces

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.formatters.causes import Cause
    from cqos_core.model.excerpt import Excerpt
    from cqos_core.model.finding import Finding, Remedy, Severity
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style
    from cqos_pictures.anchors import Anchors
    from cqos_pictures.graph import Key, Usage

_MOST_FINDINGS: Final = 200
_MOST_FIXED: Final = 60  # findings: for each fix its file is read again
_MOST_EXCERPTS: Final = 6
_LONGEST: Final = 240


class FindingLink(NamedTuple):
    """A link from other parts of the page to a finding."""

    severity: Severity
    code: str
    rule: str
    target: str


class Findings:
    """Prepares the findings of one report for the page."""

    def __init__(self, report: Report, style: Style, anchors: Anchors) -> None:
        """Choose the worst findings to show."""
        # Anchors in the order of the report stay the same when other findings are accepted.
        found = [(each, anchors.give("finding", each.code, fingerprint(each))) for each in report.findings]
        found.sort(key=lambda each: (each[0].accepted is not None, each[0].severity.rank))
        self._shown = found[:_MOST_FINDINGS]
        self._style = style
        self._places = Places([each for each, _ in self._shown], style.sources)
        self._texts: dict[str, list[str]] = {}

    def links(self, used: Usage) -> dict[Key, list[FindingLink]]:
        """Return the findings about each topic and owner that nobody accepted."""
        return grouped(
            (key, FindingLink(each.severity, each.code, each.name, f"#{anchor}"))
            for each, anchor in self._shown
            if each.accepted is None
            for key in used.named(each)
        )

    def data(self, own: Mapping[Key, str]) -> list[dict[str, Any]]:
        """Return the data of the shown findings; ``own`` has the anchors of topics."""
        return [
            {"anchor": anchor, **self._finding(each, number, own)} for number, (each, anchor) in enumerate(self._shown)
        ]

    def _finding(self, finding: Finding, number: int, own: Mapping[Key, str]) -> dict[str, Any]:
        style = self._style
        topics = [topic for topic in (finding.topic, *finding.more_topics) if topic is not None]
        linked = style.documentation.startswith(("https://", "http://"))
        fixes = finding.remedies[:3] if number < _MOST_FIXED else ()
        changes = [self._diff(each) for each in fixes]
        plain = [each for number, each in enumerate(finding.remedies) if number >= len(fixes) or not changes[number]]
        helps = phrases.helps(replace(finding, remedies=tuple(plain)))
        notes = [text_pieces(each) for each in (*self._same_cause(finding), *_notes(finding), *finding.notes)]
        count = plural(finding.pairs, "pair") if finding.pairs > 1 else ""
        because = [] if finding.because in finding.message else text_pieces(finding.because)
        excerpts = list(self._excerpts(finding))
        return {
            "state": state(wrong=is_wrong(finding)),
            "place": self._position(finding),
            "severity": finding.severity.value,
            "code": finding.code,
            "name": finding.name,
            "link": f"{style.documentation.rstrip('/')}/rules/{finding.code}" if linked else "",
            "message": text_pieces(finding.message),
            "accepted": finding.accepted or "",
            "excerpts": excerpts,
            "has_excerpts": bool(excerpts),
            "helps": [text_pieces(each) for each in helps],
            "diffs": [each for each in changes if each],
            "notes": notes,
            "has_notes": bool(notes),
            "because": because,
            "clause": finding.clause,
            "reason_word": "Reason" if because else "Clause" if finding.clause else "",
            "has_fixes": bool(helps or any(changes)),
            "topics": [
                {"topic": topic, "target": f"#{own['topic', topic]}" if ("topic", topic) in own else ""}
                for topic in first_names(topics, 6)
            ],
            "pairs": count,
        }

    def _position(self, finding: Finding) -> str:
        """Return file and line of a finding, else its topic."""
        if finding.place is None:
            return finding.topic or ""
        return phrases.position(replace(self._places.exact(finding.place), column=None))

    def _excerpts(self, finding: Finding) -> Iterator[dict[str, Any]]:
        """Yield source lines with all marks of the finding."""
        lines: dict[tuple[str, int, str], list[tuple[Excerpt, str, bool]]] = {}
        for number, side in enumerate(finding.sides):
            for fact, place in marked_places(side):
                excerpt = None if place is None else self._places.excerpt(place)
                if place is None or excerpt is None:
                    if place is not None:
                        policy = "" if fact is None else f"{fact.policy} {phrases.value(fact)}"
                        who = ", ".join(first_names(side.members, 3))
                        yield {"where": phrases.position(place), "who": f"{who} {policy}".strip(), "lines": []}
                    continue
                label, value = (side.label, "") if fact is None else value_label(side.label, fact, excerpt)
                named = f"{fact.policy} " if fact is not None and value else ""
                text = (
                    f"{', '.join(first_names(side.members, 2))} {label}{': ' if label and value else ''}{named}{value}"
                )
                key = (place.source, excerpt.line, excerpt.text)
                lines.setdefault(key, []).append((excerpt, text.strip(), number == 0))
        for (source, line, text), marks in list(lines.items())[:_MOST_EXCERPTS]:
            yield {
                "where": f"{source}:{line}",
                "who": "",
                "lines": [
                    *self._context(source, line - 1),
                    {
                        "number": line,
                        "hit": True,
                        "pieces": list(_pieces(text, [mark for mark, _, _ in marks])),
                        "labels": list(dict.fromkeys(label for _, label, _ in marks)),
                    },
                    *self._context(source, line + 1),
                ],
            }

    def _context(self, source: str, line: int) -> list[dict[str, Any]]:
        text = self._text(source)
        if not 0 < line <= len(text) or not text[line - 1].strip():
            return []
        pieces = [{"marked": False, "text": text[line - 1].rstrip("\r").replace("\t", "    ")[:_LONGEST]}]
        return [{"number": line, "hit": False, "pieces": pieces, "labels": []}]

    @cached_property
    def _causes(self) -> dict[int, Cause]:
        return {
            id(each): cause
            for cause in causes([each for each, _ in self._shown], self._style)
            for each in cause.findings
        }

    def _same_cause(self, finding: Finding) -> Iterator[str]:
        """Yield a note on other findings of the same cause: the first lists the others, and they name the first."""
        cause = self._causes[id(finding)]
        if finding is not cause.first:
            where = places_of([cause.first], self._places)
            yield f"the same cause as {cause.first.code} {where}".rstrip()
        elif cause.more:
            yield same_cause(cause, self._places)

    def _text(self, source: str) -> list[str]:
        if source not in self._texts:
            self._texts[source] = decode(self._style.sources.get(source, b"")).split("\n")
        return self._texts[source]

    def _diff(self, remedy: Remedy) -> dict[str, Any] | None:
        """Return the lines that a fix changes, before and after; None if no file changes."""
        lines: list[dict[str, str]] = []
        where = ""
        for source, made in (self._style.replaced(remedy.edits) if remedy.edits else {}).items():
            before = decode(self._style.sources[source])
            for start, end, text in sorted(made):
                first = before.rfind("\n", 0, start) + 1
                last = before.find("\n", end)
                last = len(before) if last < 0 else last
                where = where or f"{source}:{before.count(chr(10), 0, start) + 1}"
                old, new = before[first:last], before[first:start] + text + before[end:last]
                lines += _changed(old.split("\n"), new.split("\n"))
        return {"fix": text_pieces(phrases.fix(remedy)), "where": where, "changes": lines} if lines else None


def _changed(old: Sequence[str], new: Sequence[str]) -> list[dict[str, str]]:
    """Return removed and added lines."""
    stay = {line for line in old if line in new}
    return [
        {"sign": sign, "kind": kind, "text": line.rstrip("\r").replace("\t", "    ")[:_LONGEST]}
        for lines, sign, kind in ((old, "−", "gone"), (new, "+", "came"))  # noqa: RUF001
        for line in lines
        if line not in stay
    ]


def _pieces(text: str, marks: Sequence[Excerpt]) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a line, each marked or not."""
    at = 0
    for mark in sorted(marks, key=lambda each: each.column):
        start, end = max(mark.column - 1, at), mark.column - 1 + mark.width
        if end <= at:
            continue
        yield {"marked": False, "text": text[at:start].replace("\t", "    ")}
        yield {"marked": True, "text": text[start:end]}
        at = end
    yield {"marked": False, "text": text[at:].replace("\t", "    ")}


def _notes(finding: Finding) -> Iterator[str]:
    if finding.worlds:
        yield phrases.worlds(finding.worlds)
