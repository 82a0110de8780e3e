"""``cqos check``: read systems, check them, and report."""

from __future__ import annotations

import os
import sys
from dataclasses import field, replace
from importlib.metadata import metadata, version
from itertools import starmap
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from cqos_core.checking.assumptions import with_imported
from cqos_core.checking.checker import check_system
from cqos_core.cli.console import colored, emit, say, say_problems, width
from cqos_core.cli.errors import WrongUsageError, say_error, wrong_usage
from cqos_core.cli.exit_codes import CLEAN, FINDINGS, NO_ENDPOINT, NO_PAIR, UNUSABLE
from cqos_core.cli.file_output import write_file
from cqos_core.cli.finding_filter import code_prefixes, filter_of_options
from cqos_core.cli.help import usual
from cqos_core.cli.input_choices import input_notes
from cqos_core.cli.input_reader import path_problems, prepare_reader
from cqos_core.cli.outputs import DEFAULT_FORMAT, STDOUT, OutputPairingCommand, check_output_paths, pair_outputs, render
from cqos_core.cli.parameters import (
    Registered,
    Run,
    color_option,
    debug_option,
    diff_option,
    fail_on_option,
    fix_option,
    formats_option,
    nearest,
    output_option,
    refuse_absent,
    show_option,
    together_option,
    watch_option,
    weaken_option,
)
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, options_given, reading_options
from cqos_core.files.check_units import check_units
from cqos_core.files.source_files import STDIN, read_path
from cqos_core.formatters.multi_system import without_repetition
from cqos_core.formatters.phrases import listed
from cqos_core.importers.format_detection import SMALLEST_SYSTEM, claims_yaml
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Severity, plural
from cqos_core.model.problems import CqosError
from cqos_core.model.style import Style
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from cqos_core.analysis.baseline import Baseline
    from cqos_core.cli.check_fixes import FixOutcome
    from cqos_core.cli.finding_filter import FindingFilter
    from cqos_core.cli.input_reader import InputReader
    from cqos_core.cli.outputs import OutputTarget
    from cqos_core.config import Config
    from cqos_core.files.check_units import CheckUnit
    from cqos_core.files.path_loader import Loaded
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Edit
    from cqos_core.model.problems import Problem
    from cqos_core.model.report import Report
    from cqos_core.model.source import Replacement
    from cqos_core.model.system import System

_PACKS_STAY = "a service has rule packs of its own: --server does not go with --pack"
_PACKS_THERE = "write one of them; `cqos serve --pack FILE` gives a service the pack"
_NAMED = 3  # more paths than this are not repeated
_NOT_CHECKED, _LOSSES, _COVERAGE = "not-checked", "subscribers", "coverage"
_SHOW = {"errors": Severity.ERROR, "warnings": Severity.WARNING, "notes": Severity.NOTE, "all": Severity.NOTE}
_SHOWN = (*_SHOW, _NOT_CHECKED, _LOSSES, _COVERAGE)
_FAIL = {"error": Severity.ERROR, "warning": Severity.WARNING}


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """The options of ``cqos check`` that are not about reading; each field is the parameter of an option below."""

    each: bool
    together: bool
    formats: tuple[str, ...]
    outputs: tuple[str, ...]
    show: tuple[str, ...]
    select: tuple[str, ...]
    ignore: tuple[str, ...]
    fail_on: str | None
    require_pairs: bool
    require_coverage: int | None
    fix: bool
    weaken: bool
    show_diff: bool
    proofs: str | None
    baseline: str | None
    write_baseline: str | None
    server: str | None
    watch: bool
    color: str
    quiet: bool


@click.command(
    cls=OutputPairingCommand,
    epilog="Exit codes: 0 clean; 1 findings at or above the fail level; 2 wrong usage, input that cannot be read, or "
    "nothing to check; 3 internal error.",
)
@usual(
    "--fix",
    "--weaken",
    "--diff",
    "--launch",
    "--option",
    "--format",
    "--output",
    "--show",
    "--select",
    "--fail-on",
    "--baseline",
)
@click.argument("paths", nargs=-1, required=True, metavar="PATH...")
@click.option("--each", is_flag=True, help="Check each file by itself, as in a directory.")
@together_option
@reading_options
@formats_option(Registered("formatters"))
@output_option(several=True)
@show_option(*_SHOWN, codes=True)
@click.option(
    "--select",
    metavar="CODES",
    multiple=True,
    help="Report findings of these rules only. Codes, beginnings of codes, or names, separated by commas.",
)
@click.option("--ignore", metavar="CODES", multiple=True, help="Do not report findings of these rules.")
@fail_on_option(*_FAIL)
@click.option("--require-pairs", is_flag=True, help="Exit with 1 where no pair was compared, also of parts of systems.")
@click.option(
    "--require-coverage",
    type=click.IntRange(0, 100),
    metavar="PERCENT",
    help="Exit with 1 where fewer of a hundred endpoints were read and are known. 100 fails if anything was not read that may decide.",
)
@fix_option
@weaken_option
@diff_option
@click.option("--proofs", metavar="FILE", help="Show these runs of `cqos prove --format json` in the format html.")
@click.option("--baseline", metavar="FILE", help="Findings in this file are known and no longer count; new ones do.")
@click.option(
    "--write-baseline",
    metavar="FILE",
    help="Write the errors and warnings found now to FILE, as the baseline of later checks; then they do not count.",
)
@click.option(
    "--server",
    metavar="ADDRESS",
    help="Let the service at ADDRESS check what is read here: HOST:PORT, or https://HOST:PORT. The variable CQOS_TOKEN "
    "holds a token for it, CQOS_SERVER_CA names the certificates to trust, CQOS_CLIENT_CERT and CQOS_CLIENT_KEY a "
    "certificate of one's own and its key.",
)
@watch_option
@color_option
@click.option("--quiet", "-q", is_flag=True, help="Print only errors; the exit code and --output files have the rest.")
@debug_option
@click.pass_context
def check(ctx: click.Context, /, *, paths: tuple[str, ...], reading: ReadingOptions, **given: Any) -> None:
    """Check designs, and report each pair as compatible, incompatible or unknown.

    Paths named together are one system, whatever their formats. In a folder, each whole system (a system file, a diagram)
    is checked by itself, and parts of systems (snapshots, recordings, parameters) are put together; all other files are
    passed over. The path `-` is standard input.

    With --fix, C-QoS applies the first fix of each error and warning that weakens nothing and breaks nothing, checks again, and
    reports what is left.

    \b
    Examples:
      cqos check system.yaml                         one file
      cqos check robot.yaml station.bpmn             two files, one system
      cqos check .                                   whatever lies below this folder
      cqos check model.bpmn --option ros2.rmw=zenoh  under an assumption
      cqos check a.yaml --format full --format sarif --output cqos.sarif
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    options = CheckOptions(**given)
    if isinstance(ctx.obj, Run):
        ctx.obj.silent = options.quiet
    if not options.watch:
        ctx.exit(_check_once(ctx, paths, reading, options)[0])
    if STDIN in paths or options.fix or options.show_diff or options.write_baseline:
        what = "--watch goes with neither `-`, --fix, --diff nor --write-baseline"
        raise WrongUsageError(what, "write `cqos check PATH --watch`, and the other command by itself", ctx)
    from cqos_core.cli.watch import watch  # which few runs need

    ctx.exit(watch(paths, reading.importer, lambda: _check_once(ctx, paths, reading, options)))


def _check_once(
    ctx: click.Context, paths: tuple[str, ...], reading: ReadingOptions, options: CheckOptions
) -> tuple[int, list[str]]:
    """Check all paths once; return the exit code, and the files on which the result depends."""
    reader = prepare_reader(reading, paths)
    config = reader.config
    sinks = pair_outputs(ctx, options.formats, options.outputs, _default_format(config))
    check_output_paths("--output", (sink.path for sink in sinks if sink.path != STDOUT), paths)
    check_output_paths("--write-baseline", filter(None, [options.write_baseline]), paths)
    if options.each and options.together:
        raise WrongUsageError("--each and --together exclude each other", "write one of them", ctx)
    select = filter_of_options(options.select, options.ignore, reader.context)
    codes = code_prefixes("--show", [each for each in options.show if each not in _SHOWN], reader.context, _SHOWN)
    if codes and any(each in _SHOW for each in options.show):
        raise WrongUsageError("--show takes severities or rules, not both", "write one of them", ctx)
    if options.server is not None and (reading.pack_files or config.packs):
        raise WrongUsageError(_PACKS_STAY, _PACKS_THERE, ctx)
    if options.weaken and not (options.fix or options.show_diff):
        what = "--weaken says which fixes --fix and --diff take, and neither is given"
        raise WrongUsageError(what, "write --fix or --diff too", ctx)
    if options.fix or options.show_diff:
        _refuse_fixing(ctx, paths, options.server or options.write_baseline)
    work = _CheckRun(
        reader,
        options,
        select,
        _read_known_findings(options.baseline or config.baseline, options.write_baseline),
        codes,
    )
    if options.proofs is not None:
        from cqos_core.formatters.proofs import runs_from_json

        work.proofs = runs_from_json(options.proofs, read_path(options.proofs).data)
    work.run(paths)
    # Folders have many inputs, and files include others.
    read = [*work.files(), *filter(None, [options.proofs])]
    check_output_paths("--output", (sink.path for sink in sinks if sink.path != STDOUT), read)
    check_output_paths("--write-baseline", filter(None, [options.write_baseline]), read)
    if options.show_diff:  # which takes standard output
        emit("".join(work.diffs))
        sinks = [sink for sink in sinks if sink.path != STDOUT]
    return work.finish(sinks), work.files()


def _refuse_fixing(ctx: click.Context, paths: Sequence[str], other: str | None) -> None:
    """Refuse options and paths that --fix and --diff cannot be combined with."""
    if other is not None:
        what = "--fix and --diff go with neither --server nor --write-baseline"
        raise WrongUsageError(what, "write `cqos check PATH --fix`, and the other command by itself", ctx)
    if STDIN in paths:
        raise WrongUsageError("--fix and --diff change files, and `-` is none", "write the path of the file", ctx)


def _default_format(config: Config) -> str:
    name = config.format or DEFAULT_FORMAT
    known = load_plugins().formatters
    if name not in known:
        refuse_absent("formatters", name, f"the format `{name}` of {config.path}")
        raise wrong_usage(f"format of {config.path}", f"there is no format `{name}`", nearest(name, known))
    return name


def _read_known_findings(baseline: str | None, written: str | None) -> Baseline | None:
    """Read the baseline; None without one, and where this run writes that very file."""
    if baseline is None or (written is not None and os.path.realpath(baseline) == os.path.realpath(written)):
        return None
    from cqos_core.analysis.baseline import read_baseline  # which few runs need

    return read_baseline(baseline, read_path(baseline).data)


class _CheckedSystem(NamedTuple):
    """One checked system: its path, its report, and the configuration in force."""

    path: str
    report: Report
    config: Config
    system: System
    context: CheckContext


@dataclass(slots=True)
class _CheckRun:
    """One run of ``cqos check``.

    Attributes:
        finding_filter: keeps the findings that --select and --ignore leave.
        shown_codes: codes of the rules that --show names.
        loaded: what was read.
        reports: one per system.
        grouping_note: a note on how files were grouped into systems.
        input_notes: notes on inputs that were found without being named.
        path_problems: problems of paths that need a choice or another command.
        empty_messages: messages about paths in which nothing could be checked.
        has_begun_file: an empty path holds a system file that has been begun.
        refused_fixes: why fixes were not written.
    """

    reader: InputReader
    options: CheckOptions
    finding_filter: FindingFilter
    baseline: Baseline | None
    shown_codes: tuple[str, ...] = ()
    loaded: Loaded = field(init=False)
    reports: list[_CheckedSystem] = field(default_factory=list)
    grouping_note: str = ""
    sources: dict[str, bytes] = field(default_factory=dict)
    input_notes: list[str] = field(default_factory=list)
    path_problems: list[Problem] = field(default_factory=list)
    empty_messages: list[str] = field(default_factory=list)
    has_begun_file: bool = False
    passed_over: int = 0
    diffs: list[str] = field(default_factory=list)
    fixes: list[FixOutcome] = field(default_factory=list)
    refused_fixes: list[str] = field(default_factory=list)
    proofs: Sequence[Mapping[str, Any]] = ()

    def run(self, paths: Sequence[str]) -> None:
        """Read and check everything."""
        options = self.options
        with Progress("reading", quiet=options.quiet) as progress:
            self.loaded = self.reader.load(paths, progress.step)
            grouping = "each" if options.each else "together" if options.together else ""
            found, self.grouping_note = check_units(self.loaded, grouping)
            progress.start("checking")
            alone = len(found) == 1
            for number, unit in enumerate(found):
                # Of a single system, its topics are counted.
                progress.step(number, len(found))
                self._check(unit, progress.step if alone else lambda _done, _all: None, alone=alone)
            reports = without_repetition(
                [each.report for each in self.reports], [each.config.sources for each in self.reports]
            )
            self.reports = [each._replace(report=new) for each, new in zip(self.reports, reports, strict=True)]
        self.input_notes, self.path_problems = input_notes(self.loaded, paths), path_problems(self.loaded, paths)
        unsaid = not self.loaded.problems and not self.path_problems and not self.empty_messages
        if unsaid and not any(each.endpoints or each.partial for each in reports):
            self.empty_messages.append(
                f"{', '.join(paths[:_NAMED])}: nothing there could be checked, no endpoint was found"
            )

    def _check(self, unit: CheckUnit, step: Callable[[int, int], None], *, alone: bool) -> None:
        reader, options = self.reader.nearest(unit.path), self.options
        system = reader.merged_for_check(unit.systems)
        report = self.finding_filter(self._judged(system, reader, step))
        if (options.fix or options.show_diff) and report.findings:
            from cqos_core.cli.check_fixes import fix_unit

            done = fix_unit(
                unit, system, reader, self.finding_filter, write=not options.show_diff, weaken=options.weaken
            )
            system, report = done.system, done.report
            self.diffs.append(done.diff)
            self.fixes.append(done)
            if done.refused:
                self.refused_fixes.append(done.refused)
        if not report.endpoints and not report.partial:
            only_profiles = bool(system.profiles) and not (system.endpoints or system.bridges)
            if unit.named and (alone or not only_profiles):
                self.empty_messages.append(_nothing_checked(unit.path, len(system.endpoints)))
                self.has_begun_file |= not system.endpoints and any(starmap(claims_yaml, system.sources.items()))
            elif all(finding.code == "CQ404" for finding in report.findings):
                # Many a diagram in a directory has no signals, and nothing to say about them; profiles are for others.
                self.passed_over += 1
                return
        self.sources |= {**reader.config.sources, **system.sources}
        self.reports.append(_CheckedSystem(unit.path, report, reader.config, system, reader.context))

    def _judged(self, system: System, reader: InputReader, step: Callable[[int, int], None]) -> Report:
        """Check one system, here or where --server says."""
        if self.options.server is None:
            return check_system(system, reader.context, step)
        if reader.config.packs:
            raise WrongUsageError(_PACKS_STAY, _PACKS_THERE)
        # gRPC is slow to import, and most checks need none of it.
        from cqos_core.remote.client import Client

        with Client(self.options.server) as client:
            report = client.check_system(replace(system, protocol=system.protocol or reader.protocol))
        # The contract does not carry what importers assume.
        return replace(report, assumed=with_imported(report.assumed, system)) if system.assumed else report

    def files(self) -> list[str]:
        """Return the files on which the result depends."""
        config = self.reader.config
        read = (each.file.path for each in self.loaded.outcomes)
        others = (*config.packs, *self.reader.options.pack_files, *([self.baseline.path] if self.baseline else ()))
        return [*read, *self.sources, *config.sources, *others]

    def finish(self, sinks: Sequence[OutputTarget]) -> int:
        """Write everything and return the exit code."""
        found = self.reports
        if self.baseline is not None:
            self.reports = [each._replace(report=self.baseline.mark(each.report, each.path)) for each in found]
        say_problems([*self.loaded.problems, *self.path_problems], self.options.color)
        written = self._write(sinks) and self._write_baseline(found)
        self._say_rest()
        unreadable = self.loaded.problems or (self.path_problems and not self.loaded.detected.open)
        if unreadable or self.empty_messages or self.refused_fixes or not written:
            return UNUSABLE
        if self.loaded.detected.open:
            return FINDINGS
        if self.options.write_baseline is not None:
            return CLEAN
        fail_on = self.options.fail_on
        failed = (each.report.fails(_FAIL[fail_on or each.config.fail_on or "error"]) for each in self.reports)
        missed = [self._nothing_compared(), self._too_little_read()]
        return FINDINGS if any(missed) or any(failed) else CLEAN

    def _nothing_compared(self) -> bool:
        """Whether pairs are required, by a whole system or by --require-pairs, and none was compared."""
        required = self.options.require_pairs or any(each.report.misses_pairs for each in self.reports)
        missed = required and not any(each.report.pair_count for each in self.reports)
        if missed:
            self._fault(NO_PAIR)
        return missed

    def _too_little_read(self) -> bool:
        """Whether the coverage of a system is below --require-coverage."""
        required = self.options.require_coverage
        if required is None:
            return False
        # Each by itself: a system of which little was read must not hide behind others.
        missed = [each for each in self.reports if each.report.coverage.percent < required]
        for each in missed:
            self._fault(
                f"{each.path}: coverage is {each.report.coverage.percent} %, less than the {required} % required; "
                "list the rest with --show coverage"
            )
        return bool(missed)

    def _write(self, sinks: Sequence[OutputTarget]) -> bool:
        """Write every report, files first; return whether all of it could be written."""
        written = True
        reports, problems = [each.report for each in self.reports], [*self.loaded.problems, *self.path_problems]
        for sink in sorted(sinks, key=lambda sink: sink.path == STDOUT):
            if self.options.quiet and sink.path == STDOUT:
                continue
            try:
                with Progress("writing", quiet=self.options.quiet):
                    text = render(sink, reports, problems, self._style(sink))
                sink.write(text)
            except CqosError as error:
                self._fault(str(error))
                written = False
        return written

    def _style(self, sink: OutputTarget) -> Style:
        shown = self.options.show or self.reader.config.show
        loudest = (_SHOW[each] for each in shown if each in _SHOW)
        return Style(
            show=max(loudest, key=lambda each: each.rank, default=Severity.WARNING),
            color=colored(self.options.color, sys.stdout if sink.path == STDOUT else None),
            width=width(),
            sources=self.sources,
            tool_version=version("cqos-core"),
            not_checked=_NOT_CHECKED in shown or "all" in shown,
            apart="all" in shown,
            losses=_LOSSES in shown,
            coverage=_COVERAGE in shown or "all" in shown,
            codes=self.shown_codes,
            listed=bool(self.shown_codes) or any(each in _SHOW for each in self.options.show),
            folder=os.getcwd(),  # noqa: PTH109 - text
            documentation=_documentation(),
            replaced=self._replaced,
            checked=self._checked,
        )

    def _checked(self, report: Report) -> Any:
        found = ((each.system, each.context, self.proofs) for each in self.reports if each.report is report)
        return next(found, None)

    def _replaced(self, edits: Sequence[Edit]) -> Mapping[str, Sequence[Replacement]]:
        from cqos_core.files.edited_files import replacements_of

        return replacements_of(self.sources, edits, self.reader.options.importer)

    def _write_baseline(self, found: Sequence[_CheckedSystem]) -> bool:
        target = self.options.write_baseline
        if target is None:
            return True
        if self.loaded.problems or self.path_problems:
            self._fault(f"{target} is not written: findings in what cannot be read would be missing from it")
            return False
        # Only where several systems are checked can one hide behind another's entry.
        limited = [(each.path if len(found) > 1 else None, each.report) for each in found]
        from cqos_core.analysis.baseline import write_baseline

        try:
            write_file(target, write_baseline(target, limited))
        except CqosError as error:
            self._fault(str(error))
            return False
        self._note(f"the findings are written to {target}; from now on use --baseline {target}")
        return True

    def _say_rest(self) -> None:
        """Print notes on what was left out, and errors about paths in which nothing was checked."""
        for message in (*self.empty_messages, *self.refused_fixes):
            self._fault(message)
        if self.has_begun_file:
            say(f"write `{SMALLEST_SYSTEM}`", severity="help", choice=self.options.color)
        loaded = self.loaded
        for note in self.input_notes:
            self._note(note)
        for applies, text in (
            (self.grouping_note, self.grouping_note),
            (loaded.not_searched, f"not searched: {listed(loaded.not_searched)}; name such a folder to search it"),
            (loaded.skipped, f"{plural(loaded.skipped, 'file')} of other formats skipped"),
            (loaded.parts, _parts(loaded.parts)),
            (self.passed_over, f"{plural(self.passed_over, 'file')} without any endpoint passed over"),
        ):
            if applies:
                self._note(text)
        gone = 0 if self.baseline is None else self.baseline.gone(each.path for each in self.reports)
        if self.baseline is not None and gone and not loaded.problems:
            entries = "1 entry" if gone == 1 else f"{gone} entries"
            self._note(f"{entries} of {self.baseline.path} found no more; write it anew with --write-baseline")
        if self.fixes:
            from cqos_core.cli.check_fixes import fix_summary

            for text in fix_summary(
                self.fixes, options_given(click.get_current_context()), write=not self.options.show_diff
            ):
                self._note(text)

    def _note(self, text: str) -> None:
        if not self.options.quiet:
            say(text, severity="note", choice=self.options.color)

    def _fault(self, text: str) -> None:
        say_error(text, choice=self.options.color)


def _documentation() -> str:
    """The URL of the documentation, as the distribution states it; empty where it states none."""
    urls = (text.partition(",") for text in metadata("cqos-core").get_all("Project-URL") or ())
    return next((url.strip() for label, _, url in urls if label.strip().lower() == "documentation"), "")


def _parts(parts: Mapping[str, str]) -> str:
    if len(parts) > 1:
        return f"{len(parts)} files are checked as parts of others, which include them"
    return "".join(f"{path} is checked as part of {whole}, which includes it" for path, whole in parts.items())


def _nothing_checked(path: str, endpoints: int) -> str:
    if not endpoints:
        return f"{path}: {NO_ENDPOINT}"
    return f"{path}: none of its {plural(endpoints, 'endpoint')} could be checked, see the findings"
