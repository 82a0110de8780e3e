"""``cqos explain --log``: what running programs say of endpoints that do not fit, explained."""

from __future__ import annotations

import json
import sys
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

import click

from cqos_core.analysis.runtime_logs import explain_alone, explain_misfits
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading import prepare
from cqos_core.cli.streams import colored, emit, width
from cqos_core.files.opening import STDIN, STDIN_NAME
from cqos_core.formatters import wording
from cqos_core.formatters.full import render_full
from cqos_core.formatters.json_report import render_json
from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.logs import misfits
from cqos_core.model.problems import CqosError
from cqos_core.model.remarks import plural
from cqos_core.model.report import Group, Report, Severity, Verdict
from cqos_core.model.style import Style
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.analysis.runtime_logs import Explained
    from cqos_core.cli.reading import InputReader, ReadingOptions
    from cqos_core.model.logs import Occurrence
    from cqos_core.model.system import System

_CLEAN, _FOUND = 0, 1
_VERSION: Final = 1
_MOST_PAIRS: Final = 10


def explain_log(
    ctx: click.Context, *, log: str, paths: tuple[str, ...], reading: ReadingOptions, form: str, color: str
) -> None:
    """Read a log, and explain it by the system in ``paths``, if there is one."""
    if log == STDIN and STDIN in paths:
        raise click.UsageError("only one of the log and the paths can be standard input.", ctx)
    reader = prepare(reading, paths)
    system = reader.one(paths, color)[0] if paths else None
    with Progress("reading"):
        occurrences, lines = _read(log, reader)
        if system is None:
            explained = explain_alone(occurrences, reader.context)
        else:
            explained = explain_misfits(occurrences, system, reader.context)
    style = Style(
        show=Severity.NOTE,
        color=colored(color, sys.stdout),
        width=width(),
        sources={} if system is None else system.sources,
        tool_version=version("cqos-core"),
    )
    report = _report(explained)
    emit(
        _as_json(explained, log, lines, report, style)
        if form == "json"
        else _as_text(explained, log, lines, system, report, style)
    )
    ctx.exit(_FOUND if explained else _CLEAN)


def _read(log: str, reader: InputReader) -> tuple[list[Occurrence], int]:
    packs = (reader.context.find_pack(pack_id) for pack_id in load_plugins().packs)
    readers = [pack.read_log for pack in packs if pack is not None]
    try:
        if log == STDIN:
            if sys.stdin is None:
                raise click.UsageError("`--log -` reads standard input, which is closed.")
            return misfits(STDIN_NAME, sys.stdin.buffer, readers)
        with open(log, "rb") as stream:  # noqa: PTH123 - any text may be given
            return misfits(log, stream, readers)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise CqosError(f"{log}: cannot be read: {reason}") from None


def _report(explained: Sequence[Explained]) -> Report:
    """Put the pairs that are meant and their findings into the form that formatters take."""
    pairs = dict.fromkeys(pair for each in explained for pair in each.pairs)
    findings = {id(finding): finding for each in explained for finding in each.findings}
    protocol = explained[0].occurrence.misfit.protocol if explained else ""
    return Report(
        max((pair.verdict for pair in pairs), key=lambda verdict: verdict.rank, default=Verdict.UNKNOWN),
        tuple(Group(pair.topic, (pair.publisher,), (pair.subscriber,), pair.verdict, protocol) for pair in pairs),
        tuple(findings.values()),
        topics=len({pair.topic for pair in pairs}),
    )


# Text


def _as_text(
    explained: Sequence[Explained], log: str, lines: int, system: System | None, report: Report, style: Style
) -> str:
    colors = paint(color=style.color)
    if not explained:
        return f"{clean(log)}: in {plural(lines, 'line')} no program says that an endpoint does not fit\n"
    topics: dict[str, list[Explained]] = {}
    for each in explained:
        topics.setdefault(each.occurrence.misfit.topic or "a topic that is not named", []).append(each)
    text = []
    for topic, members in topics.items():
        text.append(colors(clean(topic), "title"))
        for each in members:
            text += _lines(each, style.width, alone=system is None)
        text.append("")
    if system is None:
        advice = "Of several policies that do not fit, only the last is named. To see all of them, and what to change, "
        text += wrap(f"{advice}give the files of the system too: cqos explain --log {clean(log)} PATH...", style.width)
        return "\n".join(text) + "\n"
    return "\n".join(text) + "\n" + (render_full(report, style) if report.groups else "")


def _lines(each: Explained, width: int, *, alone: bool) -> list[str]:
    misfit, place = each.occurrence.misfit, wording.position(each.occurrence.place)
    times = "" if each.occurrence.count == 1 else f", {each.occurrence.count} times"
    owner = f" of {misfit.participant}" if misfit.participant else ""
    other, does = ("subscriber", "requests") if misfit.role == "publisher" else ("publisher", "offers")
    named = f": {misfit.named}" if misfit.named else ""
    lines = [
        *_paragraph(
            f"{place}{times}: a {misfit.role}{owner} discovered a {other} that {does} what does not fit{named}",
            width,
            2,
        )
    ]
    if alone:
        for rule in each.rules:
            lines += _paragraph(f"{rule.code} {rule.name}: {rule.because} ({rule.clause})", width, 4)
    for pair in each.pairs[:_MOST_PAIRS]:
        codes = ", ".join(_codes(each, pair.publisher, pair.subscriber))
        lines += _paragraph(f"{pair.publisher} and {pair.subscriber}: {pair.verdict}, {codes}", width, 4)
    if len(each.pairs) > _MOST_PAIRS:
        lines.append(f"    and {len(each.pairs) - _MOST_PAIRS} more pairs")
    if each.remark:
        lines += _paragraph(each.remark, width, 4)
    return lines


def _paragraph(text: str, width: int, indent: int) -> list[str]:
    first, *rest = wrap(clean(text), width - indent - 2)
    return [f"{' ' * indent}{first}", *(f"{' ' * (indent + 2)}{line}" for line in rest)]


def _codes(each: Explained, publisher: str, subscriber: str) -> list[str]:
    return [finding.code for finding in each.findings if {publisher, subscriber} <= {*finding.endpoints}]


# JSON


def _as_json(explained: Sequence[Explained], log: str, lines: int, report: Report, style: Style) -> str:
    document = {
        "version": _VERSION,
        "log": log,
        "lines": lines,
        "misfits": [_misfit(each) for each in explained],
        # As they are in the JSON report.
        "findings": json.loads(render_json(report, style))["findings"],
    }
    return json.dumps(document, indent=2) + "\n"


def _misfit(each: Explained) -> dict[str, Any]:
    misfit, place = each.occurrence.misfit, each.occurrence.place
    return {
        "protocol": misfit.protocol,
        "topic": misfit.topic,
        "participant": misfit.participant,
        "role": misfit.role,
        "named": misfit.named,
        "policies": list(misfit.policies),
        "count": each.occurrence.count,
        "place": {"source": place.source, "line": place.line},
        "rules": [rule.code for rule in each.rules],
        "pairs": [
            {
                "topic": pair.topic,
                "publisher": pair.publisher,
                "subscriber": pair.subscriber,
                "verdict": pair.verdict.value,
                "rules": _codes(each, pair.publisher, pair.subscriber),
            }
            for pair in each.pairs
        ],
        "remark": each.remark or None,
    }
