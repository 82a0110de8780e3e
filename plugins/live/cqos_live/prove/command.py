"""``cqos prove``: a pair on the middleware itself, before the fix and after it."""

from __future__ import annotations

import json
import os
import re
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cqos_core.analysis.explanation import endpoints_of
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.cli.console import colored, emit, say
from cqos_core.cli.errors import WrongUsageError, say_error
from cqos_core.cli.exit_codes import CLEAN, FINDINGS, UNUSABLE
from cqos_core.cli.explain import ends_of
from cqos_core.cli.file_output import write_file
from cqos_core.cli.help import usual
from cqos_core.cli.input_reader import prepare_reader
from cqos_core.cli.outputs import STDOUT, OutputPairingCommand, OutputTarget, check_output_paths, pair_outputs
from cqos_core.cli.parameters import color_option, debug_option, formats_option, nearest, output_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, reading_options
from cqos_core.files.source_files import STDIN
from cqos_core.formatters.proofs import run_record, timeline
from cqos_core.formatters.terminal import clean, paint
from cqos_core.model.finding import Severity, plural
from cqos_core.model.problems import CqosError, InvalidValueError
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.prover import FAULTS, Fault

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from cqos_core.analysis.run_plan import Trial
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.finding import Finding, Remedy
    from cqos_core.model.report import Report
    from cqos_core.model.system import System
    from cqos_core.packs.prover import Outcome


_PAIR = 2


class _FaultType(click.ParamType):  # type: ignore[type-arg]  # generic since click 8.5 only
    """``link_outage=2s``."""

    name = "fault"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        from cqos_core.language.domains import Duration
        from cqos_core.language.values import INFINITE

        if isinstance(value, Fault):
            return value
        kind, _, text = value.partition("=")
        if kind not in FAULTS:
            raise WrongUsageError(f"there is no fault `{kind}`", nearest(kind, FAULTS), ctx, param)
        try:
            nanoseconds = Duration().parse(text or "1s")
        except InvalidValueError as error:
            raise WrongUsageError(f"{kind}: {error.message}", error.advice(), ctx, param) from None
        if nanoseconds == INFINITE:
            raise WrongUsageError(f"{kind} takes a time, found {text!r}", f"write {kind}=2s", ctx, param)
        return Fault(kind, nanoseconds / 1_000_000_000)


@click.command(
    cls=OutputPairingCommand,
    epilog="Exit codes: 0 every run did what C-QoS says; 1 one did not; 2 wrong usage, input that cannot be read, or a pair "
    "that cannot be run here; 3 internal error.",
)
@usual("--on", "--fault", "--format", "--output", "--launch", "--option")
@click.argument("arguments", nargs=-1, required=True, metavar="PATH... [CODE | PUBLISHER SUBSCRIBER]")
@click.option(
    "--on",
    metavar="NAME",
    default="",
    help="Run on this implementation, for instance fastdds. Without it, on the one that the options of the pair name.",
)
@click.option(
    "--fault",
    type=_FaultType(),
    metavar="FAULT=TIME",
    help=f"Inject a fault in the middle of the run, for instance link_outage=2s. Faults are {', '.join(FAULTS)}. Without it, each "
    "fault runs that the needs of the subscriber name under `survives`.",
)
@formats_option(click.Choice(["text", "json"]))
@output_option(several=True)
@reading_options
@color_option
@debug_option
@click.pass_context
def prove(
    ctx: click.Context,
    *,
    arguments: tuple[str, ...],
    on: str,
    fault: Fault | None,
    formats: tuple[str, ...],
    outputs: tuple[str, ...],
    reading: ReadingOptions,
    color: str,
) -> None:
    """Run pairs on real middleware: show what arrives, then apply the fix and show it again.

    Starts a publisher and a subscriber with exactly the resolved values of a pair, as processes of their own on loopback.
    With CODE, the first pair of that finding runs; with two ids, that pair; with neither, one pair of each error.

    \b
    Examples:
      cqos prove system.yaml                       one pair of each error, before and after the fix
      cqos prove system.yaml ROS101 --on fastdds   the first pair of this finding
      cqos prove system.yaml lidar/publisher/scan nav/subscriber/scan --fault link_outage=2s
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    from cqos_core.analysis.run_plan import named

    paths, asked = _split(arguments)
    reader = prepare_reader(reading, paths)
    sinks = pair_outputs(ctx, formats, outputs, "text")
    written = [sink.path for sink in sinks if sink.path != STDOUT]
    check_output_paths("--output", written, paths)
    system, loaded = reader.read_system(paths, color, partly=True)
    read = (*system.sources, *reader.config.sources, *reader.config.packs, *reader.options.pack_files)
    check_output_paths("--output", written, read)
    system = named(with_profiles_tried(system, reader.protocol), reader.context)
    files = [path for path, _ in loaded.systems]
    chosen = _chosen(system, asked, reader.context)
    if chosen is None:
        ctx.exit(UNUSABLE)
    again = None if STDIN in files else partial(reader.reread, files)
    session = _Session(reader.context, on, fault, color, OutputTarget("text") in sinks, again)
    for publisher, subscriber, finding in chosen:
        session.prove(system, publisher, subscriber, finding)
    session.end(sinks)
    ctx.exit(UNUSABLE if session.failed or loaded.problems else FINDINGS if session.wrong else CLEAN)


def _split(arguments: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Tell paths from what follows them: a code, or two ids."""
    number = 1
    while number < len(arguments) and (arguments[number] == STDIN or os.path.exists(arguments[number])):  # noqa: PTH110
        number += 1
    paths, asked = tuple(arguments[:number]), tuple(arguments[number:])
    if len(asked) > _PAIR:
        raise WrongUsageError(
            f"{', '.join(f'`{each}`' for each in asked)} are no paths",
            "after the paths come one code, or the ids of a publisher and a subscriber",
        )
    return paths, asked


def _chosen(system: System, asked: Sequence[str], where: CheckContext) -> list[tuple[str, str, Finding | None]] | None:
    """Return the pairs to run, each with the finding that it stands for; None where there is no such thing."""
    from cqos_core.checking.checker import check_system

    if len(asked) == _PAIR:
        ends = ends_of(asked, endpoints_of(system, where))
        return None if ends is None else [(ends[0].id, ends[1].id, None)]
    report = check_system(system, where)
    pairs = [(pair, each) for each in report.findings if (pair := _pair_of(each, report)) is not None]
    if asked:
        code = asked[0].lower()
        found = [(pair, each) for pair, each in pairs if code in {each.code.lower(), each.name.lower()}][:1]
        if not found:
            codes = dict.fromkeys(each.code for _, each in pairs)
            known = f"the findings about pairs are {', '.join(codes)}" if codes else "there are no findings about pairs"
            say_error(f"there is no finding {asked[0]} about a pair here", known)
            return None
    else:
        found = [(pair, each) for pair, each in pairs if each.severity is Severity.ERROR]
        if not found:
            say("no pair has an error; name a publisher and a subscriber to run them", severity="note")
    firsts = dict(reversed(found))
    return [(*pair, firsts[pair]) for pair in dict.fromkeys(pair for pair, _ in found)]


def _pair_of(finding: Finding, report: Report) -> tuple[str, str] | None:
    """Return the first pair of a finding; of a finding about an endpoint, the endpoint's first pair."""
    ends = {
        role: [m for side in finding.sides if side.role == role for m in side.members]
        for role in (PUBLISHER, SUBSCRIBER)
    }
    if ends[PUBLISHER] and ends[SUBSCRIBER]:
        return ends[PUBLISHER][0], ends[SUBSCRIBER][0]
    alone = {*ends[PUBLISHER], *ends[SUBSCRIBER]}
    for group in report.groups if alone else ():
        if finding.code in group.codes or alone & {*group.publishers, *group.subscribers}:
            for pair in ((p, s) for p in group.publishers for s in group.subscribers):
                if alone & set(pair):
                    return pair
    return None


class _Session:
    """The runs of one command."""

    def __init__(
        self,
        where: CheckContext,
        on: str,
        fault: Fault | None,
        color: str,
        shown: bool,  # noqa: FBT001
        again: Callable[[Mapping[str, bytes]], System] | None,
    ) -> None:
        self.where, self.on, self.fault, self.color, self.shown, self.again = where, on, fault, color, shown, again
        self.paint = paint(color=colored(color, sys.stdout if shown else None))
        self.runs: list[dict[str, Any]] = []
        self.lines: list[str] = []
        self.wrong = self.failed = 0

    def prove(self, system: System, publisher: str, subscriber: str, finding: Finding | None) -> None:
        """Run one pair with each fault that is asked for or needed, and once more with its fixes if it has errors."""
        from cqos_core.analysis import run_plan
        from cqos_live.prove import outcomes

        try:
            trial = run_plan.prepare(system, publisher, subscriber, self.where, self.on, self.fault)
            self.show(
                f"publisher `{clean(publisher)}`, subscriber `{clean(subscriber)}` on {trial.protocol} topic "
                f"`{clean(trial.topic)}`"
            )
            trials = [
                run_plan.prepare(system, publisher, subscriber, self.where, trial.on, fault)
                for fault in (() if self.fault else trial.survives)
            ]
            for each in trials or [trial]:
                self.run(each, ())
                fixed = (
                    None
                    if finding is None and each.report.verdict == "compatible"
                    else outcomes.fixed(each, self.where, finding, self.again)
                )
                if fixed is not None:
                    self.run(*fixed)
        except CqosError as error:
            self.failed += 1
            say_error(f"{publisher} and {subscriber}: {error.what}", error.help, self.color)
        self.show("")

    def run(self, trial: Trial, fixes: Sequence[Remedy]) -> None:
        """Run a pair and show what happened."""
        from cqos_live.prove import outcomes

        codes = dict.fromkeys(each.code for each in trial.report.findings if each.severity is Severity.ERROR)
        said = f"{trial.report.verdict} ({', '.join(codes)})" if codes else str(trial.report.verdict)
        with Progress(f"running on {trial.prover.title}"):
            outcome = trial.run()
        for fix in fixes:
            written = "" if fix.edits and self.again is not None else ", which no file here has a place for"
            self.show(f"  with the fix{written}: {clean(fix.text)}")
        fault = "" if trial.plan.fault is None else f" with {trial.plan.fault}"
        self.show(f"  on {outcome.by}{fault}, C-QoS says {said}")
        for line in timeline(outcome.events):
            self.show(f"    {clean(line)}")
        self.show(self.paint(f"  {clean(outcomes.summary(outcome))}", "title"))
        for code, message in outcomes.not_seen(trial, outcome, self.where):
            self.show(f"  this run does not show {code}: {clean(message)}")
        wrong = outcomes.disagreements(trial, outcome, self.where)
        if wrong:
            self.wrong += 1
            file = case_file(trial, outcome)
            for each in wrong:
                last = each == wrong[-1]
                say_error(each, f"report this case to the authors of the rule pack: {file}" if last else "", self.color)
        self.runs.append(run_record(trial, outcome, fixes, wrong))

    def show(self, line: str) -> None:
        """Write a line of the result, at once where it goes to standard output."""
        self.lines.append(line + "\n")
        if self.shown:
            emit(line + "\n")

    def end(self, sinks: Sequence[OutputTarget]) -> None:
        """Write the total, and what goes to files or is for programs."""
        if self.runs:
            outcome = f"{self.wrong} not as C-QoS says" if self.wrong else "all as C-QoS says"
            self.show(f"{plural(len(self.runs), 'run')}: {outcome}")
        texts = {"json": json.dumps({"version": 1, "runs": self.runs}, indent=2) + "\n", "text": "".join(self.lines)}
        for sink in sinks:
            if sink != OutputTarget("text"):
                sink.write(texts[sink.format])


def case_file(trial: Trial, outcome: Outcome) -> Path:
    """Write the case of a disagreement into the current folder, as a case file of the pack, and return its name."""
    codes = [each.code for each in trial.report.findings if each.severity is Severity.ERROR]
    rule = codes[0] if codes else trial.plan.protocol.upper()
    name = re.sub(r"[^A-Za-z0-9]+", "-", f"{rule} {trial.publisher} {trial.subscriber}").strip("-")[:80]
    file = Path(f"cqos-prove-{name}.yml")
    plan = trial.plan
    case = {
        "name": f"seen on {outcome.by}",
        "offered": dict(plan.publisher.values),
        "requested": dict(plan.subscriber.values),
        "options": dict(plan.subscriber.participant),
        "expect": "ok" if outcome.arrived else "error",
    }
    from cqos_live.prove.outcomes import summary

    head = f"# C-QoS says {trial.report.verdict}; {outcome.by}: {summary(outcome)}\n"
    write_file(str(file), head + json.dumps({"rule": rule, "cases": [case]}, indent=2) + "\n")
    return file
