"""``cqos breaking``: what an update of a system breaks while only some participants have it."""

from __future__ import annotations

import json
import os
import sys
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from cqos_core.analysis.breaking import Updated, find_breaks
from cqos_core.cli.parameters import color_option, debug_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading import UNUSABLE, ReadingOptions, prepare, reading_options
from cqos_core.cli.streams import colored, emit, say, say_problems, width
from cqos_core.cli.units import units
from cqos_core.files.opening import STDIN
from cqos_core.files.revisions import NotThereError, at_same_paths
from cqos_core.formatters import wording
from cqos_core.formatters.markdown import as_markdown
from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.remarks import plural
from cqos_core.model.report import Severity
from cqos_core.model.report_form import place_form

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.analysis.breaking import Break, Breaking
    from cqos_core.cli.reading import InputReader
    from cqos_core.cli.units import Unit
    from cqos_core.files.loading import Loaded

_CLEAN, _BREAKS = 0, 1
_VERSION: Final = 1
_WHEN: Final = {
    (Updated.PUBLISHER,): "once `{0}` is updated, until `{1}` is",
    (Updated.SUBSCRIBER,): "once `{1}` is updated, until `{0}` is",
    (Updated.PUBLISHER, Updated.SUBSCRIBER): "unless `{0}` and `{1}` are updated at once",
    (Updated.BOTH,): "once `{0}` and `{1}` are updated",
    (Updated.PUBLISHER, Updated.BOTH): "once `{0}` is updated",
    (Updated.SUBSCRIBER, Updated.BOTH): "once `{1}` is updated",
    (*Updated,): "as soon as `{0}` or `{1}` is updated",
}


class _Compared(NamedTuple):
    """One system in both versions: its path, and what was found."""

    path: str
    found: Breaking


@click.command(
    epilog="Exit codes: 0 nothing breaks; 1 a pair breaks; 2 wrong usage, or input that cannot be read; 3 internal error."
)
@click.argument("paths", nargs=-1, required=True, metavar="NEW...")
@click.option(
    "--against",
    "old",
    required=True,
    metavar="OLD",
    help="The old version: a path, or .git#ref=NAME for NEW in a git revision: a branch, a tag or a commit.",
)
@click.option("--together", is_flag=True, help="Compare all files as one system, those of directories too.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json", "markdown"]),
    default="text",
    show_default=True,
    help="For people, for programs, or for a comment in a pull request.",
)
@click.option(
    "--fail-on",
    type=click.Choice(["error", "warning"]),
    default="error",
    show_default=True,
    help="Exit with 1 where a pair certainly breaks; with `warning`, also where that is not known.",
)
@reading_options
@color_option
@debug_option
@click.pass_context
def breaking(
    ctx: click.Context,
    *,
    paths: tuple[str, ...],
    old: str,
    together: bool,
    form: str,
    fail_on: str,
    reading: ReadingOptions,
    color: str,
) -> None:
    """Find pairs that get worse while a system is updated, and the order in which to update it.

    Robots are updated one after the other, so old publishers meet new subscribers, and new publishers old ones. C-QoS
    checks each pair in every mix, and reports those that are worse than in the old version. It names the participants that
    have to be updated at once, and an order in which nothing breaks.

    \b
    Examples:
      cqos breaking designs --against .git#ref=main
      cqos breaking new.yaml --against old.yaml --format markdown
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    if STDIN in (*paths, old):
        raise click.UsageError("breaking compares paths, and `-` is none.", ctx)
    reader = prepare(reading, paths)
    with Progress("reading") as progress:
        loaded = reader.load(paths, progress.step)
        before = _old(reader, at_same_paths(old, paths), color)
        if not _usable(loaded, color) or (before is not None and not _usable(before, color)):
            ctx.exit(UNUSABLE)
        progress.start("comparing")
        compared = list(_compare(reader, loaded, before, color, together=together)) if before is not None else []
    if form == "json":
        emit(_as_json(compared, old))
    elif form == "markdown":
        emit("\n".join(_as_markdown(compared, old)) + "\n")
    else:
        emit("\n".join(_as_text(compared, old, color=colored(color, sys.stdout))) + "\n")
    ctx.exit(_BREAKS if any(_fails(each, fail_on) for one in compared for each in one.found.breaks) else _CLEAN)


def _fails(each: Break, fail_on: str) -> bool:
    return each.counts or (fail_on == "warning" and each.finding.accepted is None)


def _old(reader: InputReader, paths: Sequence[str], color: str) -> Loaded | None:
    try:
        return reader.load(paths)
    except NotThereError as error:
        say(f"{error}, so nothing can break", severity="note", choice=color)
        return None


def _usable(loaded: Loaded, color: str) -> bool:
    say_problems(loaded.problems, color)
    return not loaded.problems


def _compare(reader: InputReader, new: Loaded, old: Loaded, color: str, *, together: bool) -> Iterator[_Compared]:
    """Yield each system that both versions have; one system of each is compared whatever their names are."""
    now, before = (units(each, "together" if together else "")[0] for each in (new, old))
    known = {_name(unit): unit for unit in before}
    for unit in now:
        was = before[0] if len(now) == len(before) == 1 else known.pop(_name(unit), None)
        if was is None:
            say(f"{unit.path} is new", severity="note", choice=color)
            continue
        here = reader.nearest(unit.path)
        yield _Compared(unit.path, find_breaks(here.whole(was.systems), here.whole(unit.systems), here.context))
    if len(now) != 1 or len(before) != 1:
        for name in known:
            say(f"{name} is there no longer", severity="note", choice=color)


def _name(unit: Unit) -> str:
    """Return the path of a system below the folder in which it was found."""
    path = unit.path.rpartition(":")[2]
    folder = unit.folder.rpartition(":")[2]
    return os.path.relpath(path, folder) if folder else os.path.normpath(path)


# Text


def _as_text(compared: Sequence[_Compared], old: str, *, color: bool) -> Iterator[str]:
    colors = paint(color=color)
    for one in compared:
        for topic, breaks in groupby(one.found.breaks, key=lambda each: each.topic):
            yield colors(clean(topic), "title")
            for same in _alike(breaks):
                severity = _severity(same[0])
                head, *rest = _wrapped(f"{severity}: {_pair(same[0])} {_when(same[0])}", 2)
                yield from (head.replace(severity, colors(severity, severity), 1), *rest)
                finding = same[0].finding
                place = f"{wording.position(finding.place)}: " if finding.place is not None else ""
                yield from _wrapped(f"{place}{finding.code}: {finding.message}", 4)
                if len(same) > 1:
                    yield f"    {plural(len(same), 'pair')} like this"
                if finding.accepted is not None:
                    yield from _wrapped(f"accepted: {finding.accepted}", 4)
            yield ""
        yield from (clean(line) for line in _end(one, old))


def _wrapped(text: str, indent: int) -> Iterator[str]:
    for number, line in enumerate(wrap(clean(text), width() - indent - 2)):
        yield " " * (indent if number == 0 else indent + 2) + line


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


def _alike(breaks: Iterable[Break]) -> list[list[Break]]:
    """Put breaks of one cause together: those of the same rule between the same participants, after the same updates."""
    found: dict[tuple[Any, ...], list[Break]] = {}
    for each in breaks:
        key = (each.finding.code, each.publishing, each.subscribing, each.worse, each.before, each.after, each.counts)
        found.setdefault(key, []).append(each)
    return [*found.values()]


def _end(one: _Compared, old: str) -> Iterator[str]:
    """Yield what to update in which order, and how much was found."""
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


def _as_markdown(compared: Sequence[_Compared], old: str) -> Iterator[str]:
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


def _as_json(compared: Sequence[_Compared], old: str) -> str:
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
                    "place": place_form(each.finding.place, lambda place: place),
                    "accepted": each.finding.accepted,
                }
                for each in one.found.breaks
            ],
        }
        for one in compared
    ]
    return json.dumps({"version": _VERSION, "against": old, "systems": systems}, indent=2) + "\n"
