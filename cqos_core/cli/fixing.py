"""What ``cqos check --fix`` and ``--diff`` do with one system: apply fixes to its files, or print them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from cqos_core.checking.checker import check_system
from cqos_core.cli.streams import write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.cli.reading import InputReader
    from cqos_core.files.units import Unit
    from cqos_core.model.report import Report
    from cqos_core.model.system import System


class FixOutcome(NamedTuple):
    """The system and the report after fixes, what changed as a diff, and what to say of it."""

    system: System
    report: Report
    diff: str
    notes: tuple[str, ...]


def fixed(
    unit: Unit, system: System, reader: InputReader, counted: Callable[[Report], Report], *, write: bool
) -> FixOutcome:
    """Apply fixes to the files of a system, in memory or, with ``write``, in place.

    Raises:
        CqosError: a file cannot be written.
    """
    from cqos_core.files.applying import fix_all

    def read(texts: Mapping[str, bytes]) -> System:
        return reader.again(unit.files, texts)

    done = fix_all(
        system.sources, lambda texts: counted(check_system(read(texts), reader.context)), reader.options.importer
    )
    if write:
        for name, data in done.edited.texts.items():
            write_bytes(name, data)
    verb = "fixed" if write else "would fix"
    notes = [f"{verb} {finding.code}: {remedy.text}" for finding, remedy in done.applied]
    notes += [f"not fixed, {finding.code} on `{finding.topic or '-'}`: {reason}" for finding, reason in done.left]
    return FixOutcome(read({**system.sources, **done.edited.texts}), done.report, done.edited.diff(), tuple(notes))
