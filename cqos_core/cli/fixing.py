"""What ``cqos check --fix`` and ``--diff`` do with one system: apply fixes to its files, or print them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from cqos_core.checking.checker import check_system
from cqos_core.cli.streams import replace_files
from cqos_core.model.problems import CqosError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.cli.reading import InputReader
    from cqos_core.files.units import Unit
    from cqos_core.model.report import Report
    from cqos_core.model.system import System


class FixOutcome(NamedTuple):
    """The system and the report after fixes, what changed as a diff, and what to say of it.

    Attributes:
        refused: why nothing was written; empty where it was, or where nothing was to be written.
    """

    system: System
    report: Report
    diff: str
    notes: tuple[str, ...] = ()
    refused: str = ""


def fixed(
    unit: Unit,
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
    from cqos_core.files.applying import fix_all

    def read(texts: Mapping[str, bytes]) -> System:
        return reader.again(unit.files, texts)

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
    verb = "fixed" if write else "would fix"
    notes = [f"{verb} {finding.code}: {remedy.text}" for finding, remedy in done.applied]
    notes += [f"not fixed, {finding.code} on `{finding.topic or '-'}`: {reason}" for finding, reason in done.left]
    return FixOutcome(read({**system.sources, **done.edited.texts}), done.report, done.edited.diff(), tuple(notes))
