"""The format ``full``: a paragraph per finding with excerpts and fixes, and a summary at the end."""

from __future__ import annotations

import re
from dataclasses import field
from itertools import groupby
from typing import TYPE_CHECKING

from cqos_core.formatters import phrases, terminal
from cqos_core.formatters.places import Places
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Severity, Side, plural
from cqos_core.model.regular_expressions import regular_expression

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.model.excerpt import Excerpt
    from cqos_core.model.finding import Fact, Finding
    from cqos_core.model.report import Report
    from cqos_core.model.settings import Place
    from cqos_core.model.style import Style

_FACTS = 3  # a side with more values than this names the others without an excerpt
_TAB = 4
_NOTHING = "CQ404"  # the other findings say why nothing was compared
_NARROWEST_EXCERPT = 30
_ZERO = regular_expression(r"""(?:^|=\s*["'])0s?["']?$""")  # a word or an attribute for another value
_LABEL = 50  # least cells for the label of a value


def render_full(report: Report, style: Style) -> str:
    """Return the report as text for a person at a terminal of ``style.width`` columns; the verdict is its last line."""
    said, paint = _PrintedTexts(), terminal.paint(color=style.color)
    blocks: list[str] = []
    apart: list[str] = []  # of several systems, each with its verdict
    for one in report.parts or (report,):
        findings = phrases.shown(one, style)
        places = Places(findings, style.sources)
        page = _Page(style, places, _gutter(findings, places), said)
        explained = any(each.code != _NOTHING and each.severity is not Severity.NOTE for each in findings)
        found = [
            "\n".join(page.headline(each) if explained and each.code == _NOTHING else page.finding(each))
            for each in findings
        ]
        if report.parts and not found and blocks and apart:
            blocks[-1] += "\n" + "\n".join(
                phrases.verdict(one, style, paint)
            )  # nothing to tell it apart from the line before
            continue
        blocks += found
        apart = ["\n".join(phrases.verdict(one, style, paint))] if report.parts else []
        blocks += apart
    blocks.append("\n".join(_end(report, style)))
    return "\n\n".join(blocks) + "\n"


def render_excerpt(place: Place, style: Style) -> str:
    """Return the source line of a place with the value underlined; empty if the source is not known."""
    places = Places((), style.sources)
    excerpt = places.excerpt(place)
    if excerpt is None:
        return ""
    page = _Page(style, places, max(2, len(str(excerpt.line))), _PrintedTexts())
    return "\n".join(page.excerpt(excerpt))


@dataclass(slots=True)
class _PrintedTexts:
    """Texts that were printed already: each reason and note is printed once."""

    read: set[tuple[str, ...]] = field(default_factory=set)

    def is_new(self, *text: str) -> bool:
        """Return whether a text was not printed yet, and record it."""
        new = text not in self.read
        self.read.add(text)
        return new


def _end(report: Report, style: Style) -> Iterator[str]:
    """Yield the last lines: what was not checked, coverage, assumptions, and the verdict or total."""
    paint = terminal.paint(color=style.color)
    if style.losses:
        from cqos_core.formatters.snapshot_changes import subscriber_losses

        yield from subscriber_losses(report)
    listed = "; ".join(report.not_checked)
    count = f"{plural(len(report.not_checked), 'thing')}, listed with --show not-checked"
    not_checked = [f"not checked: {listed if style.not_checked else count}"] if listed else []
    for text in (*not_checked, *(phrases.coverage(report) if style.coverage else ()), *phrases.assumed(report)):
        yield from (paint(line, "quiet") for line in terminal.hanging(style.width, text, 0))
    yield from phrases.conclusion(report, style, paint)


def _gutter(findings: Iterable[Finding], places: Places) -> int:
    """Return the width of line numbers, which is the same in the whole report."""
    stated = (place for finding in findings for side in finding.sides for _, place in marked_places(side))
    lines = [places.exact(place).line for place in stated if place is not None]
    return max(2, *(len(str(line)) for line in lines if line is not None), 0)


def marked_places(side: Side) -> list[tuple[Fact | None, Place | None]]:
    """Return the values of one side with their places, or None and the place of the side."""
    return [(fact, fact.place or side.place) for fact in _marked_facts(side)] or [(None, side.place)]


def _marked_facts(side: Side) -> tuple[Fact, ...]:
    """Return the values to show with an excerpt: the stated ones, else the defaults."""
    stated = tuple(fact for fact in side.facts if fact.origin != "default")
    return (stated or side.facts)[:_FACTS]


@dataclass(frozen=True, slots=True)
class _Mark:
    """One underlined value: its policy, its label, and its excerpt if there is one.

    ``value`` is empty if the underlined text shows it.
    """

    place: Place | None
    policy: str
    label: str
    value: str
    excerpt: Excerpt | None
    side: Side
    pen: _Pen

    @property
    def text(self) -> str:
        """The label, and the value if the underlined text does not show it."""
        return f"{self.label}: {self.value}" if self.label and self.value else self.label or self.value


@dataclass(frozen=True, slots=True)
class _Pen:
    """How one side is drawn: its underline character, and its role for colours."""

    underline: str
    role: str


def _leftmost(excerpts: Iterable[Excerpt]) -> Excerpt:
    return min(excerpts, key=lambda excerpt: excerpt.column)


class _Page:
    """Draws findings. All texts pass `terminal.clean` before they are measured."""

    def __init__(self, style: Style, places: Places, gutter: int, said: _PrintedTexts) -> None:
        self._style = style
        self._said = said
        self._paint = terminal.paint(color=style.color)
        self._places = places
        self._indent = " " * gutter
        self._room = max(style.width - gutter - 3, _NARROWEST_EXCERPT)

    def finding(self, finding: Finding) -> Iterator[str]:
        """Yield the lines of one finding."""
        yield from self.headline(finding)
        yield from self._sides(finding)
        for sentence in phrases.helps(finding):
            yield from self._paragraph("help:", "help", sentence)
        for sentence in (*_notes(finding), *(note for note in finding.notes if self._said.is_new("note", note))):
            yield from self._paragraph("note:", "title", sentence)
        if self._said.is_new("why", finding.code, finding.because) and finding.because not in finding.message:
            yield from self._paragraph("why:", "title", finding.because)
        if finding.accepted is not None:
            yield from self._paragraph("accepted:", "title", finding.accepted)
        if self._said.is_new("see", finding.code, finding.clause):
            clause = f"; {finding.clause}" if finding.clause else ""
            yield from self._paragraph("see:", "quiet", f"cqos rule {finding.code}{clause}")

    def headline(self, finding: Finding) -> Iterator[str]:
        """Yield severity, code, name and message."""
        head, name = (terminal.clean(text) for text in (f"{finding.severity}[{finding.code}]", f"{finding.name}:"))
        first, *rest = terminal.wrap(f"{head} {name} {terminal.clean(finding.message)}", self._style.width - 2)
        painted = self._paint(head, finding.severity) + first.removeprefix(head).replace(
            name, self._paint(name, "title"), 1
        )
        yield painted if first.startswith(head) else first
        yield from (f"  {line}" for line in rest)

    def _paragraph(self, label: str, role: str, text: str) -> Iterator[str]:
        """Yield wrapped text behind a label, under which its further lines are indented."""
        hang = len(label) + 1 if label else 0
        width = self._style.width - len(self._indent) - hang
        for number, line in enumerate(terminal.wrap(terminal.clean(text), width)):
            lead = self._paint(label, role) + " " if label and number == 0 else " " * hang
            yield f"{self._indent}{lead}{line}"

    def _sides(self, finding: Finding) -> Iterator[str]:
        """Yield the places of all sides, and each source line with its marks."""
        blocks: list[list[_Mark]] = []
        for number, side in enumerate(finding.sides):
            pen = _Pen("^", finding.severity) if number == 0 else _Pen("-", "frame")
            for mark in (self._mark(side, pen, fact, place) for fact, place in marked_places(side)):
                if blocks and self._in_one_view([*blocks[-1], mark]):
                    blocks[-1].append(mark)
                else:
                    blocks.append([mark])
        for number, block in enumerate(blocks):
            by_side = [list(same) for _, same in groupby(block, key=lambda mark: id(mark.side))]
            for index, marks in enumerate(by_side):
                # Editors jump to the first place, so only that one has the arrow.
                yield from self._location("-->" if number == index == 0 else ":::", marks)
            if block[0].excerpt is not None:
                yield from self._excerpt(block)
            following = blocks[number + 1][0].side if number + 1 < len(blocks) else None
            for marks in by_side:
                if marks[0].side is not following:
                    yield from self._rest(marks[0].side)

    def _rest(self, side: Side) -> Iterator[str]:
        pointed = _marked_facts(side)
        if rest := [fact for fact in side.facts if fact not in pointed]:
            values = ", ".join(f"{fact.policy} {phrases.value(fact)}" for fact in rest)
            yield from self._paragraph("  =", "frame", f"also {values}")

    def _mark(self, side: Side, pen: _Pen, fact: Fact | None, place: Place | None) -> _Mark:
        excerpt = None if place is None else self._places.excerpt(place)
        exact = None if place is None else self._places.exact(place)
        if fact is None:
            return _Mark(exact, "", side.label, "", excerpt, side, pen)
        return _Mark(exact, fact.policy, *value_label(side.label, fact, excerpt), excerpt, side, pen)

    def _in_one_view(self, marks: Sequence[_Mark]) -> bool:
        """Whether all marks are on one line, and in one window of it if the line is too long."""
        excerpts = [mark.excerpt for mark in marks if mark.excerpt is not None]
        lines = {(mark.place.source, mark.excerpt.line) for mark in marks if mark.place and mark.excerpt}
        texts = {excerpt.text for excerpt in excerpts}
        if len(excerpts) < len(marks) or len(lines) > 1 or len(texts) > 1:
            return False
        _, right = _Line(excerpts[0].text).window(_leftmost(excerpts), self._room)
        return all(excerpt.column - 1 + excerpt.width <= right for excerpt in excerpts)

    def _location(self, arrow: str, marks: Sequence[_Mark]) -> Iterator[str]:
        """Yield the place of one side, with the policies of its marks."""
        first = marks[0]
        policies = ", ".join(mark.policy for mark in marks if mark.policy)
        who = phrases.listed(first.side.members) + (f" . {policies}" if policies else "")
        where = "" if first.place is None else phrases.position(first.place)
        said = first.text if first.excerpt is None else ""
        parts = [part for part in map(terminal.clean, (where, who, said)) if part]
        if parts:  # a finding about the whole system has no place
            yield f"{self._indent}{self._paint(arrow, 'frame')} {'  '.join(parts)}"

    def excerpt(self, excerpt: Excerpt) -> Iterator[str]:
        """Yield a source line with the excerpt underlined."""
        yield from self._excerpt([_Mark(None, "", "", "", excerpt, Side("system", ()), _Pen("^", "error"))])

    def _excerpt(self, marks: Sequence[_Mark]) -> Iterator[str]:
        bar = self._paint(f"{self._indent} |", "frame")
        excerpt = _leftmost([mark.excerpt for mark in marks if mark.excerpt is not None])
        line = _Line(excerpt.text)
        left, right = line.window(excerpt, self._room)
        number = self._paint(f"{excerpt.line:>{len(self._indent)}} |", "frame")
        yield f"{number} {line.cut(left, right)}".rstrip()
        for alike in _rows(marks):
            spans = [line.underline(mark.excerpt or excerpt, left, right) for mark in alike]
            before, underline = spans[0][0], ""
            for start, length in spans:
                underline = underline.ljust(start - before)
                underline += alike[0].pen.underline * (start + length - before - len(underline))
            for row in _underline_rows(before, underline, terminal.clean(_about(alike, marks)), self._room):
                yield f"{bar} {' ' * (len(row) - len(row.lstrip()))}{self._paint(row.lstrip(), alike[0].pen.role)}"


def _rows(marks: Sequence[_Mark]) -> list[list[_Mark]]:
    """Group marks into rows with one label each: values of one side that the line shows, or that have one place."""
    rows: list[list[_Mark]] = []
    for mark in marks:
        last = rows[-1][-1] if rows else None
        if last is not None and (last.side, last.pen) == (mark.side, mark.pen) and _one_row(rows[-1], mark):
            rows[-1].append(mark)
        else:
            rows.append([mark])
    return [sorted(row, key=lambda mark: mark.excerpt.column if mark.excerpt else 0) for row in rows]


def _one_row(row: Sequence[_Mark], mark: _Mark) -> bool:
    if row[0].excerpt == mark.excerpt:
        return row[-1].label == mark.label
    plain = all(not each.value for each in (*row, mark))
    return (
        plain and len({each.label for each in (*row, mark)}) == 1 and all(each.excerpt != mark.excerpt for each in row)
    )


def _about(row: Sequence[_Mark], marks: Sequence[_Mark]) -> str:
    """Return the label of one row; it names the policies if there are several rows."""
    label = row[0].label
    if len(row) > 1:
        values = ", ".join(f"{mark.policy} {mark.value}" for mark in row if mark.value)
        return f"{label}: {values}" if label and values else label or values
    [mark] = row
    text = mark.text
    return f"{mark.policy} {text}" if len({each.policy for each in marks}) > 1 and len(marks) > 1 else text


def _underline_rows(before: int, underline: str, about: str, room: int) -> list[str]:
    """Return the underline with its label behind it, or below it if the line is too short."""
    row = " " * before + underline
    if before + len(underline) + 1 + terminal.cells(about) <= room:
        return [f"{row} {about}".rstrip()]
    indent = max(0, min(before, room - min(terminal.cells(about), _LABEL)))
    return [row, *(" " * indent + line for line in terminal.wrap(about, room - indent))]


class _Line:
    """One source line on a terminal: the text of each character and its first cell."""

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
        # An ellipsis takes a cell on either side. Text before a value is kept, because it names the value.
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


def value_label(label: str, fact: Fact, excerpt: Excerpt | None) -> tuple[str, str]:
    """Return the label of a value, and the value itself if the underlined text does not show it."""
    label = phrases.label(label, fact)
    if excerpt is not None and _has_value(excerpt, fact.value):
        return ", ".join(part for part in (label, phrases.origin(fact)) if part), ""
    return label, value_of(fact, excerpt)


def value_of(fact: Fact, excerpt: Excerpt | None) -> str:
    """Return a value with its origin; where a written zero stands for another value, both."""
    value = phrases.value(fact)
    stands = excerpt is not None and not _has_value(excerpt, fact.value) and _ZERO.search(_marked_text(excerpt))
    return f"`0` means {value}" if stands else value


def _marked_text(excerpt: Excerpt) -> str:
    start = excerpt.column - 1
    return excerpt.text[start : start + excerpt.width]


def _has_value(excerpt: Excerpt, value: str) -> bool:
    """Whether the underlined text is the value, or contains it as a word."""
    return re.search(rf"(?<![\w-]){re.escape(value)}(?![\w-])", _marked_text(excerpt)) is not None


def _notes(finding: Finding) -> Iterator[str]:
    if finding.worlds:
        yield phrases.worlds(finding.worlds)
    topics = [topic for topic in (finding.topic, *finding.more_topics) if topic is not None]
    if finding.pairs > 1 or len(topics) > 1:
        pairs = f"{plural(finding.pairs, 'pair')} like this" if finding.pairs else "the same"
        yield pairs + (f" on {phrases.listed(topics)}" if topics else "")
