"""The form for reading: a paragraph per finding with excerpts and remedies, and a summary at the end."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING

from cqos_core.formatters import terminal, wording
from cqos_core.formatters.places import Places
from cqos_core.remarks import plural

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.excerpt import Excerpt
    from cqos_core.formatters.style import Style
    from cqos_core.report import Fact, Finding, Report, Side
    from cqos_core.system import Place

_FACTS = 3  # a side with more values than this names the others without an excerpt
_TAB = 4
_NARROWEST_EXCERPT = 30
_LABEL = 50  # cells that what is said at a value gets, even if it then begins left of the value


def render_full(report: Report, style: Style) -> str:
    """Return the report as text for a person at a terminal of ``style.width`` columns."""
    findings = wording.shown(report, style)
    places = Places(findings, style.sources)
    page = _Page(style, places, _gutter(findings, places))
    reasons: set[tuple[str, str]] = set()
    blocks = []
    for finding in findings:
        # A reason is read once; below it, the code is reminder enough.
        known = (finding.code, finding.because) in reasons
        reasons.add((finding.code, finding.because))
        blocks.append("\n".join(page.finding(finding, explain=not known)))
    blocks.append("\n".join(page.summary(report)))
    return "\n\n".join(blocks) + "\n"


def _gutter(findings: Iterable[Finding], places: Places) -> int:
    """Columns for line numbers: the same in the whole report, so that everything in it is aligned."""
    stated = (place for finding in findings for side in finding.sides for _, place in _stated(side))
    lines = [places.exact(place).line for place in stated if place is not None]
    return max(2, *(len(str(line)) for line in lines if line is not None), 0)


def _stated(side: Side) -> list[tuple[Fact | None, Place | None]]:
    """What to point at on one side: each value where it was stated, or only the side itself."""
    return [(fact, fact.place or side.place) for fact in _pointed(side)] or [(None, side.place)]


def _pointed(side: Side) -> tuple[Fact, ...]:
    """The values to show with an excerpt: those that somebody stated, or, if nobody did, the defaults."""
    stated = tuple(fact for fact in side.facts if fact.origin != "default")
    return (stated or side.facts)[:_FACTS]


@dataclass(frozen=True, slots=True)
class _Mark:
    """One thing to point at: what it is (``policy``), what to say about it, and its excerpt if there is one."""

    place: Place | None
    policy: str
    text: str
    excerpt: Excerpt | None


@dataclass(frozen=True, slots=True)
class _Pen:
    """How one side is drawn: what underlines its values, and in which role."""

    underline: str
    role: str


class _Page:
    """Draws findings; everything it is given passes `terminal.clean` before it is measured."""

    def __init__(self, style: Style, places: Places, gutter: int) -> None:
        self._style = style
        self._paint = terminal.paint(color=style.color)
        self._places = places
        self._indent = " " * gutter
        self._room = max(style.width - gutter - 3, _NARROWEST_EXCERPT)

    def finding(self, finding: Finding, *, explain: bool) -> Iterator[str]:
        """Yield the lines of one finding; ``explain`` adds the rule's reason."""
        yield self._title(finding)
        yield from self._paragraph("", "", finding.message)
        for number, side in enumerate(finding.sides):
            yield from self._side(side, _Pen("^", finding.severity) if number == 0 else _Pen("-", "frame"), number)
        for sentence in wording.helps(finding):
            yield from self._paragraph("help:", "help", sentence)
        for sentence in _notes(finding):
            yield from self._paragraph("note:", "title", sentence)
        if explain and finding.because:
            yield from self._paragraph("why:", "title", finding.because)
        if finding.accepted is not None:
            yield from self._paragraph("accepted:", "title", finding.accepted)
        clause = f"; {finding.clause}" if finding.clause else ""
        yield from self._paragraph("see:", "quiet", f"cqos rule {finding.code}{clause}")

    def summary(self, report: Report) -> Iterator[str]:
        """Yield the verdict with all counts, and what was not looked at."""
        yield wording.summary(report, self._style, self._paint)
        if report.not_checked:
            text = terminal.clean(f"not checked: {'; '.join(report.not_checked)}")
            for number, line in enumerate(terminal.wrap(text, self._style.width - 2)):
                yield self._paint(f"{'  ' if number else ''}{line}", "quiet")

    def _title(self, finding: Finding) -> str:
        head = self._paint(terminal.clean(f"{finding.severity}[{finding.code}]"), finding.severity)
        return f"{head} {self._paint(terminal.clean(finding.name), 'title')}"

    def _paragraph(self, label: str, role: str, text: str) -> Iterator[str]:
        """Yield wrapped text behind a label, under which its further lines are indented."""
        hang = len(label) + 1 if label else 0
        width = self._style.width - len(self._indent) - hang
        for number, line in enumerate(terminal.wrap(terminal.clean(text), width)):
            lead = self._paint(label, role) + " " if label and number == 0 else " " * hang
            yield f"{self._indent}{lead}{line}"

    def _side(self, side: Side, pen: _Pen, number: int) -> Iterator[str]:
        marks = [self._mark(side, fact, place) for fact, place in _stated(side)]
        for index, (_, together) in enumerate(groupby(marks, key=self._line_of)):
            # Editors and people go to the first place; all others are beside it.
            yield from self._place("-->" if index == number == 0 else ":::", side, list(together), pen)
        pointed = _pointed(side)
        if rest := [fact for fact in side.facts if fact not in pointed]:
            values = ", ".join(f"{fact.policy} {wording.value(fact)}" for fact in rest)
            yield from self._paragraph("  =", "frame", f"also {values}")

    def _mark(self, side: Side, fact: Fact | None, place: Place | None) -> _Mark:
        excerpt = None if place is None else self._places.excerpt(place)
        exact = None if place is None else self._places.exact(place)
        if fact is None:
            return _Mark(exact, "", side.label, excerpt)
        return _Mark(exact, fact.policy, _saying(side.label, fact, excerpt), excerpt)

    def _line_of(self, mark: _Mark) -> object:
        """What marks share that are drawn under one line: of one too long to be shown whole, those at one value only."""
        if mark.excerpt is None or mark.place is None:
            return id(mark)
        long = _Line(mark.excerpt.text).width > self._room
        return mark.place.source, mark.excerpt.line, mark.excerpt.text, mark.excerpt.column if long else None

    def _place(self, arrow: str, side: Side, marks: list[_Mark], pen: _Pen) -> Iterator[str]:
        """Yield the location of one or more marks, then their line with every mark under it."""
        first = marks[0]
        policies = ", ".join(mark.policy for mark in marks if mark.policy)
        who = wording.listed(side.members) + (f" . {policies}" if policies else "")
        where = "" if first.place is None else wording.position(first.place)
        said = first.text if first.excerpt is None else ""
        parts = [part for part in map(terminal.clean, (where, who, said)) if part]
        if parts:  # what is said of the whole system stands nowhere
            yield f"{self._indent}{self._paint(arrow, 'frame')} {'  '.join(parts)}"
        if first.excerpt is not None:
            yield from self._excerpt(first.excerpt, marks, pen)

    def _excerpt(self, excerpt: Excerpt, marks: list[_Mark], pen: _Pen) -> Iterator[str]:
        bar = self._paint(f"{self._indent} |", "frame")
        line = _Line(excerpt.text)
        left, right = line.window(excerpt, self._room)
        yield bar
        number = self._paint(f"{excerpt.line:>{len(self._indent)}} |", "frame")
        yield f"{number} {line.cut(left, right)}".rstrip()
        for mark, marked in ((mark, mark.excerpt) for mark in marks if mark.excerpt is not None):
            about = terminal.clean(f"{mark.policy} {mark.text}" if len(marks) > 1 else mark.text)
            before, length = line.underline(marked, left, right)
            for row in _sign(before, pen.underline * length, about, self._room):
                yield f"{bar} {' ' * (len(row) - len(row.lstrip()))}{self._paint(row.lstrip(), pen.role)}"


def _sign(before: int, underline: str, about: str, room: int) -> list[str]:
    """Return the underline at its column with what it says behind it, or below it where it does not fit."""
    row = " " * before + underline
    if before + len(underline) + 1 + terminal.cells(about) <= room:
        return [f"{row} {about}".rstrip()]
    indent = max(0, min(before, room - min(terminal.cells(about), _LABEL)))
    return [row, *(" " * indent + line for line in terminal.wrap(about, room - indent))]


class _Line:
    """One line of a source as a terminal shows it: each character's text and the cell where it begins."""

    def __init__(self, text: str) -> None:
        self._pieces: list[str] = []
        self._starts = [0]
        for character in text:
            start = self._starts[-1]
            piece = " " * (_TAB - start % _TAB) if character == "\t" else terminal.clean(character)
            self._pieces.append(piece)
            self._starts.append(start + terminal.cells(piece))

    @property
    def width(self) -> int:
        """Cells of the whole line."""
        return self._starts[-1]

    def window(self, excerpt: Excerpt, room: int) -> tuple[int, int]:
        """Return which characters to show, as a slice: all, or those around the marked ones that fit in ``room``."""
        if self.width <= room:
            return 0, len(self._pieces)
        marked = excerpt.column - 1
        # An ellipsis takes a cell on either side; what stands before a value says whose value it is.
        target = max(0, self._starts[marked] - room // 3)
        left = next(index for index, start in enumerate(self._starts) if start >= target)
        right = left
        while right < len(self._pieces) and self._starts[right + 1] - self._starts[left] <= room - 2:
            right += 1
        return left, right

    def cut(self, left: int, right: int) -> str:
        """Return the characters of a window, with an ellipsis where others are left out."""
        before, after = "…" if left else "", "…" if right < len(self._pieces) else ""
        return f"{before}{''.join(self._pieces[left:right])}{after}"

    def underline(self, excerpt: Excerpt, left: int, right: int) -> tuple[int, int]:
        """Return how many cells of a window precede the marked characters, and how many these take."""
        first = min(max(excerpt.column - 1, left), right)
        last = min(max(first + excerpt.width, first), right)
        before = self._starts[first] - self._starts[left] + (1 if left else 0)
        return before, max(1, self._starts[last] - self._starts[first])


def _saying(label: str, fact: Fact, excerpt: Excerpt | None) -> str:
    """What to write at a value: the value itself only where it cannot be read from what is underlined."""
    if excerpt is not None and _reads(excerpt, fact.value):
        return ", ".join(part for part in (label, wording.origin(fact)) if part)
    return f"{label}: {wording.value(fact)}" if label else wording.value(fact)


def _reads(excerpt: Excerpt, value: str) -> bool:
    """Whether the underlined words are the value, or hold it as an attribute does."""
    start = excerpt.column - 1
    marked = excerpt.text[start : start + excerpt.width]
    return re.search(rf"(?<![\w-]){re.escape(value)}(?![\w-])", marked) is not None


def _notes(finding: Finding) -> Iterator[str]:
    if finding.worlds:
        yield wording.worlds(finding.worlds)
    topics = [topic for topic in (finding.topic, *finding.more_topics) if topic is not None]
    if finding.pairs > 1 or len(topics) > 1:
        pairs = f"{plural(finding.pairs, 'pair')} like this" if finding.pairs else "the same"
        yield pairs + (f" on {wording.listed(topics)}" if topics else "")
    yield from finding.notes
