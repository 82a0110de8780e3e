"""Descriptions of codes: one row of the tables of the core and of rule packs."""

from __future__ import annotations

from typing import Literal

from cqos_core.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class CodeInfo:
    """A code under which the core, or an importer of a rule pack, reports.

    Attributes:
        name: the bad pattern in kebab case.
        severity: of the finding; a problem that stops the reading is always an error.
        summary: one sentence.
        reason: why it matters.
        help: what to do about it, as a finding says it that has no better advice.
        aliases: former codes and names.
        leaves_out: where it reports that a part of an input was not read and may decide: what kind of part, as ``file``.
        missing: how many endpoints such a part has at least; 0: it decides about those that were read.
    """

    code: str
    name: str
    severity: Literal["error", "warning", "note"]
    summary: str
    reason: str = ""
    aliases: tuple[str, ...] = ()
    help: str = ""
    leaves_out: str = ""
    missing: int = 0

    @property
    def spellings(self) -> frozenset[str]:
        """Its code, name and aliases in lower case."""
        return frozenset(spelling.lower() for spelling in (self.code, self.name, *self.aliases))
