"""Pairs that break while only some participants are updated, as text, Markdown and JSON."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import groupby
from operator import attrgetter
from typing import Final, NamedTuple

from cqos_core.analysis.version_breaks import Break, Updated, VersionBreaks
from cqos_core.formatters import phrases
from cqos_core.formatters.json_report import versioned
from cqos_core.formatters.markdown import as_markdown
from cqos_core.formatters.terminal import clean, hanging, paint
from cqos_core.model.finding import Severity, plural
from cqos_core.model.finding_json import place_json
from cqos_core.model.grouping import grouped

_WHEN: Final = {
    (Updated.PUBLISHER,): "once `{0}` is updated, until `{1}` is",
    (Updated.SUBSCRIBER,): "once `{1}` is updated, until `{0}` is",
    (Updated.PUBLISHER, Updated.SUBSCRIBER): "unless `{0}` and `{1}` are updated at once",
    (Updated.BOTH,): "once `{0}` and `{1}` are updated",
    (Updated.PUBLISHER, Updated.BOTH): "once `{0}` is updated",
    (Updated.SUBSCRIBER, Updated.BOTH): "once `{1}` is updated",
    (*Updated,): "as soon as `{0}` or `{1}` is updated",
}


class ComparedVersions(NamedTuple):
    """The comparison of both versions of one system."""

    path: str
    found: VersionBreaks


# Text


def breaks_as_text(compared: Sequence[ComparedVersions], old: str, columns: int, *, color: bool) -> Iterator[str]:
    """Yield text lines: what breaks on each topic, and the order of updates."""
    colors, wrapped = paint(color=color), partial(hanging, columns)
    for one in compared:
        for topic, breaks in groupby(one.found.breaks, key=lambda each: each.topic):
            yield colors(clean(topic), "title")
            for same in _alike(breaks):
                severity = _severity(same[0])
                head, *rest = wrapped(f"{severity}: {_pair(same[0])} {_when(same[0])}", 2)
                yield from (head.replace(severity, colors(severity, severity), 1), *rest)
                finding = same[0].finding
                place = f"{phrases.position(finding.place)}: " if finding.place is not None else ""
                yield from wrapped(f"{place}{finding.code}: {finding.message}", 4)
                if len(same) > 1:
                    yield f"    {plural(len(same), 'pair')} like this"
                if finding.accepted is not None:
                    yield from wrapped(f"accepted: {finding.accepted}", 4)
            yield ""
        yield from (clean(line) for line in _end(one, old))


def _severity(each: Break) -> Severity:
    if each.finding.accepted is not None:
        return Severity.NOTE
    return Severity.ERROR if each.counts else Severity.WARNING


def _pair(each: Break) -> str:
    before = "new" if each.before is None else each.before
    after = "no longer matched" if each.after is None else each.after
    return clean(f"`{each.publisher}` → `{each.subscriber}`: {before} → {after}")


def _when(each: Break) -> str:
    return clean(_WHEN[each.worse].format(each.publishing, each.subscribing))


def _alike(breaks: Iterable[Break]) -> Iterable[list[Break]]:
    """Group breaks of one cause: the same rule, participants and updates."""
    key = attrgetter("finding.code", "publishing", "subscribing", "worse", "before", "after", "counts")
    return grouped((key(each), each) for each in breaks).values()


def _end(one: ComparedVersions, old: str) -> Iterator[str]:
    """Yield the order of updates, and the counts."""
    found = one.found
    if found.unavoidable:
        yield "No order of updates avoids all of this: some pairs are worse once both ends are updated."
    if found.order:
        yield f"update {', then '.join(map(_step, found.order))}"
    sure = sum(each.counts for each in found.breaks)
    open_ones = sum(each.finding.accepted is None and not each.counts for each in found.breaks)
    accepted = sum(each.finding.accepted is not None for each in found.breaks)
    counts = [f"{plural(sure, 'pair')} break{'s' if sure == 1 else ''}" if sure else "nothing breaks"]
    counts += [f"{plural(open_ones, 'pair')} may break"] if open_ones else []
    counts += [f"{accepted} accepted"] if accepted else []
    changed = plural(len(found.changed), "participant") + " changed" if found.changed else "no participant changed"
    yield f"{one.path} against {old}: {', '.join(counts)}; {changed}"


def _step(groups: Sequence[Sequence[str]]) -> str:
    named = [" with ".join(f"`{name}`" for name in group) for group in groups]
    return " and ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)


# Markdown and JSON


def breaks_as_markdown(compared: Sequence[ComparedVersions], old: str) -> Iterator[str]:
    """Yield lines for a comment in a pull request."""
    yield f"### C-QoS: updates against {as_markdown(old)}"
    for one in compared:
        yield ""
        *order, total = _end(one, old)
        yield f"**{as_markdown(total)}**"
        yield from ("", *(f"- {as_markdown(line)}" for line in order)) if order else ()
        alike = [
            same for _, breaks in groupby(one.found.breaks, key=lambda each: each.topic) for same in _alike(breaks)
        ]
        if alike:
            yield from ("", "| | topic | pair | when | why |", "| - | ----- | ---- | ---- | --- |")
        for same in alike:
            first, more = same[0], f" and {len(same) - 1} more" if len(same) > 1 else ""
            why = f"{first.finding.code}: {first.finding.message}"
            why += f" (accepted: {first.finding.accepted})" if first.finding.accepted is not None else ""
            cells = (str(_severity(first)), first.topic, _pair(first) + more, _when(first), why)
            yield f"| {' | '.join(map(as_markdown, cells))} |"


def breaks_as_json(compared: Sequence[ComparedVersions], old: str) -> str:
    """Return what breaks, as JSON."""
    systems = [
        {
            "path": one.path,
            "pairs": one.found.pairs,
            "changed": list(one.found.changed),
            "order": [[list(group) for group in step] for step in one.found.order],
            "unavoidable": one.found.unavoidable,
            "breaks": [
                {
                    "topic": each.topic,
                    "publisher": each.publisher,
                    "subscriber": each.subscriber,
                    "participants": [each.publishing, each.subscribing],
                    "worse_after": [str(updated) for updated in each.worse],
                    "before": each.before and str(each.before),
                    "after": each.after and str(each.after),
                    "code": each.finding.code,
                    "message": each.finding.message,
                    "place": place_json(each.finding.place, lambda place: place),
                    "accepted": each.finding.accepted,
                }
                for each in one.found.breaks
            ],
        }
        for one in compared
    ]
    return versioned({"against": old, "systems": systems})
