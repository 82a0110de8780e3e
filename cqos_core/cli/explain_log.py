"""``cqos explain --log``: explain log lines about incompatible endpoints."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, NoReturn

from cqos_core.analysis.runtime_logs import LogExplanation, explain_alone, explain_mismatches
from cqos_core.cli.console import colored, emit, width
from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.exit_codes import CLEAN, FINDINGS
from cqos_core.cli.input_reader import InputReader, prepare_reader
from cqos_core.cli.progress import Progress
from cqos_core.files.source_files import STDIN, STDIN_NAME
from cqos_core.formatters.log_mismatches import mismatches_as_json, mismatches_as_text
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.problems import CqosError
from cqos_core.model.report import Group, Report
from cqos_core.model.style import Style
from cqos_core.packs.log_mismatches import Occurrence, read_mismatches
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    import click

    from cqos_core.cli.reading_options import ReadingOptions


def explain_log(
    ctx: click.Context, *, log: str, paths: tuple[str, ...], reading: ReadingOptions, form: str, color: str
) -> NoReturn:
    """Read a log, explain it by the system in ``paths``, if there is one, and exit."""
    if log == STDIN and STDIN in paths:
        raise WrongUsageError("the log and a path are both standard input", "write the path of one of them", ctx)
    reader = prepare_reader(reading, paths)
    system = reader.read_system(paths, color)[0] if paths else None
    with Progress("reading"):
        occurrences, lines = _read(log, reader)
        if system is None:
            explained = explain_alone(occurrences, reader.context)
        else:
            explained = explain_mismatches(occurrences, system, reader.context)
    style = Style(
        show=Severity.NOTE,
        color=colored(color, sys.stdout),
        width=width(),
        sources={} if system is None else system.sources,
        tool_version=version("cqos-core"),
    )
    report = _report(explained)
    emit(
        mismatches_as_json(explained, log, lines, report, style)
        if form == "json"
        else mismatches_as_text(explained, log, lines, system, report, style)
    )
    ctx.exit(FINDINGS if explained else CLEAN)


def _read(log: str, reader: InputReader) -> tuple[list[Occurrence], int]:
    packs = (reader.context.find_pack(pack_id) for pack_id in load_plugins().packs)
    readers = [pack.read_log for pack in packs if pack is not None]
    try:
        if log == STDIN:
            if sys.stdin is None:
                raise WrongUsageError("`--log -` reads standard input, which is closed", "write the path of the log")
            return read_mismatches(STDIN_NAME, sys.stdin.buffer, readers)
        with open(log, "rb") as stream:  # noqa: PTH123 - any text may be given
            return read_mismatches(log, stream, readers)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise CqosError(f"{log}: cannot be read: {reason}") from None


def _report(explained: Sequence[LogExplanation]) -> Report:
    """Return a report of the pairs that the log lines are about."""
    pairs = dict.fromkeys(pair for each in explained for pair in each.pairs)
    findings = {id(finding): finding for each in explained for finding in each.findings}
    protocol = explained[0].occurrence.misfit.protocol if explained else ""
    return Report(
        max((pair.verdict for pair in pairs), key=lambda verdict: verdict.rank, default=Verdict.UNKNOWN),
        tuple(Group(pair.topic, (pair.publisher,), (pair.subscriber,), pair.verdict, protocol) for pair in pairs),
        tuple(findings.values()),
        topics=len({pair.topic for pair in pairs}),
    )
