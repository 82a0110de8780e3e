"""The format ``text``: at most eight lines per finding; many findings begin with a summary."""

from __future__ import annotations

from collections import Counter
from itertools import takewhile
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.formatters import phrases, terminal
from cqos_core.formatters.causes import causes, places_of, same_cause
from cqos_core.formatters.full import marked_places, render_excerpt, value_of
from cqos_core.formatters.places import Places
from cqos_core.formatters.tables import table
from cqos_core.model.dataclass import dataclass
from cqos_core.model.encoding import decode
from cqos_core.model.finding import Severity, plural
from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from cqos_core.formatters.causes import Cause
    from cqos_core.model.finding import Finding, Remedy, Side
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style

_LINES: Final = 8
"""The most lines of a finding."""
_FEW: Final = 10
"""More findings than this begin with a summary."""
_SCREEN: Final = 40
"""The most lines of the summary and the findings below it; one finding is always shown."""
_RULES: Final = 20
"""The most rules in the summary."""
_REWRITTEN: Final = 60
"""The most findings with the new text of a line: for each, its file is read again."""
_HEADLINE, _HELP = 3, 2  # lines
_FILES: Final = 3
_WIDE: Final = 10_000
_BEFORE: Final = 12
"""Characters that are shown before a change in a line that is too long."""
_LEAST: Final = 20
"""The least cells of a text in a narrow terminal."""
_NOTHING: Final = "CQ404"  # the other findings say why nothing was compared


def render_text(report: Report, style: Style) -> str:
    """Return the report as text for a person at a terminal of ``style.width`` columns; the verdict is its last line."""
    paint = terminal.paint(color=style.color)
    parts = [(part, causes(phrases.shown(part, style), style)) for part in report.parts or (report,)]
    found = [cause for _, part in parts for cause in part]
    page = Page(style, Places([each for cause in found for each in cause.findings], style.sources))
    summary = len(found) > _FEW and not style.listed
    blocks = [page.summary(found)] if summary else []
    for part, own in parts:
        explained = any(each.first.code != _NOTHING and each.first.severity is not Severity.NOTE for each in own)
        if not summary:
            blocks += [page.finding(each, alone=not explained) for each in own]
        if report.parts:
            verdict = [*phrases.verdict(part, style, paint)]
            if blocks and blocks[-1].verdict and (summary or not own):
                blocks[-1].lines.extend(verdict)  # nothing to tell it apart from the line before
            else:
                blocks.append(_Block(verdict, verdict=True))
    end = [*_remarks(report, style, found, summary=summary), *phrases.conclusion(report, style, paint)]
    if not found and not report.parts:  # a correct design is one line
        end[-1] = "; ".join([end[-1], *phrases.assumed(report)])
    if summary:
        room = _SCREEN - sum(len(each.lines) + 1 for each in blocks) - len(end)
        blocks[1:1] = page.worst(found, room)
    return "\n\n".join("\n".join(each) for each in [*(block.lines for block in blocks), end]) + "\n"


def _remarks(report: Report, style: Style, found: Sequence[Cause], *, summary: bool) -> Iterator[str]:
    """Yield the remarks above the verdict."""
    paint = terminal.paint(color=style.color)
    if style.losses:
        from cqos_core.formatters.snapshot_changes import subscriber_losses

        yield from subscriber_losses(report)
    texts = [f"not checked: {'; '.join(report.not_checked)}"] if style.not_checked and report.not_checked else []
    texts += phrases.coverage(report) if style.coverage else ()
    texts += phrases.assumed(report) if found or report.parts else ()
    if style.codes and not found:
        texts.append("there is no finding of the rules that --show names")
    if found:
        code = min(found, key=lambda each: each.first.severity.rank).first.code
        loud = [cause for cause in found[:_FEW] if cause.first.severity is not Severity.NOTE]
        fixes = (fix for cause in loud for fix in cause.first.remedies)
        shown = [f"`--show all` lists all findings, `--show {code}` one rule"] if summary else []
        shown += ["`--fix` applies fixes"] if any(fix.is_automatic for fix in fixes) else []
        shown += ["`--format full` has the reasons"] + ([] if summary else [f"`cqos rule {code}` explains a rule"])
        texts.append(f"more: {', '.join(shown)}")
    for text in texts:
        yield from (paint(line, "quiet") for line in terminal.hanging(style.width, text, 0))


def _fitting(parts: Sequence[tuple[int, list[str]]]) -> list[str]:
    """Return the lines of parts that fit into `_LINES`; parts of lower rank are kept first."""
    room = _LINES
    kept: set[int] = set()
    full: set[int] = set()
    for number, (rank, lines) in sorted(enumerate(parts), key=lambda each: each[1][0]):
        if len(lines) > room or rank in full:
            full.add(rank)  # without the first one, the next of its kind would look complete
            continue
        kept.add(number)
        room -= len(lines)
    return [line for number, (_, lines) in enumerate(parts) if number in kept for line in lines]


@dataclass(slots=True)
class _Block:
    """Lines of one block, and whether they are verdicts of systems."""

    lines: list[str]
    verdict: bool = False


class Page:
    """Writes findings, each within `_LINES`."""

    def __init__(self, style: Style, places: Places) -> None:
        self._style = style
        self._places = places
        self._paint = terminal.paint(color=style.color)
        self._rewritten = 0

    # Findings

    def finding(self, cause: Cause, *, alone: bool = True) -> _Block:
        """Return the lines of one cause. Unless it stands ``alone``, a finding that others explain has only its headline."""
        first = cause.first
        if first.code == _NOTHING and not alone:
            return _Block(self._headline(first))
        # In the order of the page, each with its rank: higher ranks are dropped first, 0 never.
        parts: list[tuple[int, list[str]]] = [(0, self._headline(first)), (0, self._others(cause))]
        where, other = self._where(first)
        fix = next((each for each in first.remedies if each.edits), None)
        written = [] if fix is None else self._written(fix, first)
        valued = any(side.facts for side in first.sides)  # the lines with the places say what stands there
        parts += [(0, where), (5 if valued else 2, [] if written else self._excerpt(first)), (3, other)]
        for number, sentence in enumerate(cause.helps):
            own = written if fix is not None and fix.text in sentence else []
            written = [] if own else written
            if number == 0:
                parts += [(0, self._paragraph("help:", "help", sentence, _HELP)), (1, own)]
            else:
                lines = self._paragraph("help:", "help", sentence, 1 if own else _HELP)
                parts.append((1 if own else 4, [*lines, *own]))
        if first.worlds:
            parts.append((6, self._paragraph("note:", "title", phrases.worlds(first.worlds), 1)))
        if first.accepted is not None:
            parts.append((0, self._paragraph("accepted:", "title", first.accepted, 1)))
        return _Block(_fitting(parts))

    def answer(self, cause: Cause, compared: Collection[str]) -> list[str]:
        """Return a finding about a pair in three or four lines: its message, unless the values are ``compared`` above, and its fix."""
        first = cause.first
        named = first.code in compared
        headline = [self._head(first, first.name)] if named else _cut(self._headline(first), 2)
        helps = [each for sentence in cause.helps[:1] for each in self._paragraph("help:", "help", sentence, 1)]
        fixes = [each for each in first.remedies[:1] if each.edits and first.help is None]
        return [*headline, *helps, *(line for fix in fixes for line in self._written(fix, first))]

    def _head(self, finding: Finding, text: str) -> str:
        head = terminal.clean(f"{finding.severity}[{finding.code}]")
        return f"{self._paint(head, finding.severity)} {self._paint(terminal.clean(text), 'title')}"

    def _headline(self, finding: Finding) -> list[str]:
        """Return severity, code, name and message."""
        head, name = (terminal.clean(text) for text in (f"{finding.severity}[{finding.code}]", f"{finding.name}:"))
        text = f"{head} {name} {terminal.clean(finding.message)}"
        first, *rest = _cut(terminal.wrap(text, self._style.width - 2), _HEADLINE)
        painted = self._paint(head, finding.severity) + first.removeprefix(head).replace(
            name, self._paint(name, "title"), 1
        )
        return [painted if first.startswith(head) else first, *(f"  {line}" for line in rest)]

    def _others(self, cause: Cause) -> list[str]:
        """Return the line on the other findings of a cause."""
        return self._paragraph("", "", same_cause(cause, self._places), 1) if cause.more else []

    def _where(self, finding: Finding) -> tuple[list[str], list[str]]:
        """Return the line with the first place of a finding, and the line with that of the other side."""
        lines: list[list[str]] = []
        seen = set()
        for side in finding.sides:
            place = next((place for _, place in marked_places(side) if place is not None), None)
            if place is None or place in seen:
                continue
            seen.add(place)
            where = phrases.position(self._places.exact(place))
            line = _short(f"{where}  {_stated_values(side, self._places)}".rstrip(), self._style.width - 6)
            lines.append([f"  {self._paint(':::' if lines else '-->', 'frame')} {line}"])
        return (lines[0] if lines else []), (lines[1] if len(lines) > 1 else [])

    def _excerpt(self, finding: Finding) -> list[str]:
        """Return the source line of a finding, underlined."""
        marks = [(side, place) for side in finding.sides for _, place in marked_places(side) if place is not None]
        return render_excerpt(marks[0][1], self._style).splitlines() if marks else []

    def _written(self, fix: Remedy, finding: Finding) -> list[str]:
        """Return the new text of the line that a fix changes, if it changes a file."""
        if self._rewritten >= _REWRITTEN:
            return []
        self._rewritten += 1
        lines = [*changed_lines(fix, self._style)]
        if not lines:
            return []
        first = lines[0]
        more = f" (and {plural(len(lines) - 1, 'more line')})" if len(lines) > 1 else ""
        place = terminal.clean(
            f"line {first.number}" if {first.source} == _files(finding) else f"{first.source}:{first.number}"
        )
        label = f"write: {place}: "
        text = _around(first.text, first.changed, self._style.width - terminal.cells(f"  {label}{more}"))
        return [f"  {self._paint('write:', 'help')}{label.removeprefix('write:')}{text}{more}"]

    def _paragraph(self, label: str, role: str, text: str, most: int) -> list[str]:
        """Return wrapped text behind a label, under which its further lines are indented."""
        hang = len(label) + 1 if label else 0
        lines = _cut(terminal.wrap(terminal.clean(text), self._style.width - 2 - hang), most)
        lead = f"{self._paint(label, role)} " if label else ""
        return [f"  {lead if number == 0 else ' ' * hang}{line}" for number, line in enumerate(lines)]

    # Summary

    def summary(self, found: Sequence[Cause]) -> _Block:
        """Return the summary: the number of findings of each rule, and their places."""
        findings = [finding for cause in found for finding in cause.findings]
        files = Counter(each.place.source for each in findings if each.place is not None)
        below, alone = _common_folder(files), next(iter(files)) if len(files) == 1 else ""
        by_rule = grouped(((each.severity, each.code, each.name), each) for each in findings)
        ordered = sorted(by_rule.items(), key=lambda rule: (rule[0][0].rank, -len(rule[1]), rule[0][1]))
        rules = [(f"  {severity}", code, str(len(own)), name) for (severity, code, name), own in ordered[:_RULES]]
        used = sum(
            max(terminal.cells(terminal.clean(cell)) + 2 for cell in column) for column in zip(*rules, strict=True)
        )
        rows = [
            (*rule, _short(places_of(own, self._places, alone, below), self._style.width - used))
            for rule, (_, own) in zip(rules, ordered, strict=False)
        ]

        def color(piece: str, column: int) -> str:
            return self._paint(piece, piece.strip()) if column == 0 and piece.strip() else piece

        counts = [plural(sum(f.severity is each for f in findings), each) for each in Severity]
        counted = ", ".join(text for text in counts if not text.startswith("0 "))
        causes_of = f" of {plural(len(found), 'cause')}" if len(found) < len(findings) else ""
        inside = f" in {alone}" if alone else f" below {below}" if below else ""
        lines = [terminal.clean(f"{plural(len(findings), 'finding')}{causes_of}{inside}: {counted}")]
        if len(files) > 1:
            named = [f"{source.removeprefix(below)} {count}" for source, count in files.most_common(_FILES)]
            more = [f"{plural(len(files) - _FILES, 'more file')}"] if len(files) > _FILES else []
            lines.append(_short(f"  in {', '.join([*named, *more])}", self._style.width))
        lines += table(("",) * 5, rows, _WIDE, color)[1:]  # no cell is broken
        if len(ordered) > _RULES:
            rest = sum(len(own) for _, own in ordered[_RULES:])
            lines.append(f"  {plural(rest, 'finding')} of {plural(len(ordered) - _RULES, 'other rule')}")
        return _Block(lines)

    def worst(self, found: Sequence[Cause], room: int) -> Iterator[_Block]:
        """Yield the worst findings that fit into ``room`` lines, at least one."""
        for number, cause in enumerate(sorted(found, key=lambda each: each.first.severity.rank)):
            block = self.finding(cause, alone=False)
            room -= len(block.lines) + 1
            if room < 0 and number:
                return
            yield block


def _common_folder(files: Collection[str]) -> str:
    """Return the common folder of several files, with a slash."""
    if len(files) < 2:  # noqa: PLR2004 - several
        return ""
    levels = zip(*(file.split("/")[:-1] for file in files), strict=False)
    return "".join(f"{names[0]}/" for names in takewhile(lambda names: len(set(names)) == 1, levels))


class ChangedLine(NamedTuple):
    """A line that a fix changes: its file, number and new text, and the first character that differs."""

    source: str
    number: int
    text: str
    changed: int


def changed_lines(fix: Remedy, style: Style) -> Iterator[ChangedLine]:
    """Yield the lines that a fix changes."""
    for source, made in style.replaced(fix.edits).items():
        before = decode(style.sources[source])
        grown = 0
        for start, end, text in sorted(made):
            first = before.rfind("\n", 0, start) + 1
            last = before.find("\n", end)
            last = len(before) if last < 0 else last
            old = before[first:last].split("\n")
            new = (before[first:start] + text + before[end:last]).split("\n")
            line = before.count("\n", 0, start) + 1 + grown
            grown += len(new) - len(old)
            for number, written in enumerate(new):
                if written not in old and written.strip():
                    before_it = old[min(number, len(old) - 1)].strip()
                    same = takewhile(lambda pair: pair[0] == pair[1], zip(written.strip(), before_it, strict=False))
                    yield ChangedLine(source, line + number, written.strip(), sum(1 for _ in same))


def _stated_values(side: Side, places: Places) -> str:
    """Return the stated values of a side: ``requested here: reliability reliable (preset default)``."""
    facts = [(fact, place) for fact, place in marked_places(side) if fact is not None]
    if not facts:
        return side.name
    excerpts = (None if place is None else places.excerpt(place) for _, place in facts)
    values = ", ".join(
        # A word says by itself what a written zero means; a number contradicts it.
        f"{fact.policy} {value_of(fact, excerpt if fact.value[:1].isdigit() else None)}"
        for (fact, _), excerpt in zip(facts, excerpts, strict=True)
    )
    label = phrases.label(side.label, facts[0][0])
    return f"{label}: {values}" if label else values


def _cut(lines: list[str], most: int) -> list[str]:
    """Return the first lines; an ellipsis marks that lines are left out."""
    return lines if len(lines) <= most else [*lines[: most - 1], f"{lines[most - 1]} …"]


def _files(finding: Finding) -> set[str]:
    """Return the files of the first places of all sides."""
    places = (place for side in finding.sides for _, place in marked_places(side)[:1])
    return {place.source for place in places if place is not None}


def _around(text: str, changed: int, room: int) -> str:
    """Return a line; if it is too long, the part around its change."""
    if terminal.cells(terminal.clean(text)) <= room or changed < _BEFORE:
        return _short(text, room)
    start = max(1, min(changed - _BEFORE, len(text) - room + 1))
    return f"…{_short(text[start:], room - 1)}"


def _short(text: str, room: int) -> str:
    """Return clean text of at most ``room`` columns, cut with an ellipsis."""
    text = terminal.clean(text)
    room = max(room, _LEAST)
    if terminal.cells(text) <= room:
        return text
    kept = ""
    for character in text:
        if terminal.cells(kept + character) > room - 1:
            break
        kept += character
    return f"{kept}…"
