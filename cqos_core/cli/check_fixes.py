"""``cqos check --fix`` and ``--diff`` for one system: apply fixes to its files, or print them."""

from __future__ import annotations

import shlex
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.checking.checker import check_system
from cqos_core.cli.file_output import replace_files
from cqos_core.model.problems import CqosError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cqos_core.cli.input_reader import InputReader
    from cqos_core.files.check_units import CheckUnit
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_core.model.system import System


_LISTED: Final = 10
_FEW: Final = 3  # commands


class FixOutcome(NamedTuple):
    """The system and the report after fixes, and what changed as a diff.

    Attributes:
        fixed: what was fixed, and how, one sentence each.
        left: errors and warnings that need a decision, each with the reason.
        repairable: whether `cqos repair` may propose a change for any of these.
        weakening: whether --weaken fixes any of these.
        files: of the system.
        refused: why nothing was written; empty where it was, or where nothing was to be written.
    """

    system: System
    report: Report
    diff: str
    fixed: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    repairable: bool = False
    weakening: bool = False
    files: tuple[str, ...] = ()
    refused: str = ""


def fix_unit(
    unit: CheckUnit,
    system: System,
    reader: InputReader,
    counted: Callable[[Report], Report],
    *,
    write: bool,
    weaken: bool,
) -> FixOutcome:
    """Apply fixes to the files of a system, in memory or, with ``write``, in place: to none where one of them changed meanwhile.

    ``weaken``: also fixes that ask for less than the design does.
    """
    from cqos_core.files.file_fixes import fix_all

    def read(texts: Mapping[str, bytes]) -> System:
        return reader.reread(unit.files, texts)

    done = fix_all(
        system.sources,
        lambda texts: counted(check_system(read(texts), reader.context)),
        reader.options.importer,
        weaken=weaken,
    )
    if write:
        try:
            replace_files(done.edited.texts, done.edited.before)
        except CqosError as error:
            return FixOutcome(system, counted(check_system(system, reader.context)), "", refused=str(error))
    return FixOutcome(
        read({**system.sources, **done.edited.texts}),
        done.report,
        done.edited.diff(),
        tuple(f"{finding.code}: {remedy.text}" for finding, remedy in done.applied),
        tuple(f"{finding.code}{_on(finding)}: {reason}" for finding, reason in done.left),
        any(finding.remedies or finding.verdict is not None for finding, _ in done.left),
        any(
            remedy.weakens and replace(remedy, weakens=False).is_automatic
            for finding, _ in done.left
            for remedy in finding.remedies
        ),
        unit.files,
    )


def _on(finding: Finding) -> str:
    return f" on `{finding.topic}`" if finding.topic is not None else ""


def fix_summary(outcomes: Sequence[FixOutcome], options: Sequence[str], *, write: bool) -> Iterator[str]:
    """Yield lines on what was fixed, what needs a decision, and the commands that propose changes; ``options`` are those about reading."""
    done = [outcome for outcome in outcomes if not outcome.refused]
    verb, fixed = "fixed" if write else "would fix", [text for outcome in done for text in outcome.fixed]
    left = [text for outcome in done for text in outcome.left]
    for what, texts in ((f"{verb} ", fixed), ("needs a decision, ", left)):
        yield from (f"{what}{text}" for text in texts[:_LISTED])
        if len(texts) > _LISTED:
            yield f"{what}{len(texts) - _LISTED} more"
    if not left:
        return
    commands = [
        f"`{shlex.join(['cqos', 'repair', *outcome.files, *options, '--diff'])}`"
        for outcome in done
        if outcome.repairable
    ]
    more = (
        [f"{' and '.join(commands[:_FEW])} {'proposes' if len(commands) == 1 else 'propose'} changes"]
        if commands
        else []
    )
    more += ["--weaken lets --fix ask for less"] if any(outcome.weakening for outcome in done) else []
    needs = "needs" if len(left) == 1 else "need"
    yield "; ".join([f"{verb} {len(fixed)}, {len(left)} {needs} a decision", *more])
