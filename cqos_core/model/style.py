"""The style of a report: the few choices that all formatters share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Edit, Severity

if TYPE_CHECKING:
    from cqos_core.model.report import Report


def _nothing(edits: Sequence[Edit]) -> Mapping[str, Sequence[tuple[int, int, str]]]:  # noqa: ARG001 - where no file can be edited
    return {}


def _unknown(report: Report) -> None:
    """Return None."""


@dataclass(frozen=True, slots=True)
class Style:
    """Choices of the caller; every formatter ignores what does not concern it.

    Attributes:
        show: findings up to this severity are printed in full by the text formats (``warning``: notes are counted only).
        not_checked: list in the text formats what no check of the protocols can see, rather than count it.
        coverage: list in the text formats what was not read although it may decide.
        codes: beginnings of the codes of rules, in lower case: if any, the text formats print the findings of these rules only.
        listed: the caller asked for all that is shown, so the text format gives no summary in place of it.
        apart: the text formats print each finding, also where several have one cause.
        losses: list in the text formats which subscribers get nothing, or lose some of their publishers.
        color: ANSI colours; the caller honours ``NO_COLOR`` and whether the stream is a terminal.
        width: columns of the terminal, for the text formats.
        sources: source name to its bytes, for excerpts and exact columns.
        folder: absolute; paths below it are written relative to it in formats that need relative ones.
        documentation: URL of the documentation, for formats that link to rules; empty without one.
        replaced: returns the replacements of edits in the texts of `sources`, by name: start, end, and the new text; nothing
            where they cannot be applied. For formats that carry fixes.
        tool_version: of C-QoS, for formats that name their tool.
        checked: returns the `System` of a report, the `CheckContext` and the runs on middleware; None if they are unknown.
    """

    show: Severity = Severity.WARNING
    color: bool = False
    width: int = 100
    sources: Mapping[str, bytes] = field(default_factory=dict)
    tool_version: str = ""
    not_checked: bool = False
    coverage: bool = False
    losses: bool = False
    codes: tuple[str, ...] = ()
    listed: bool = False
    apart: bool = False
    folder: str = ""
    documentation: str = ""
    replaced: Callable[[Sequence[Edit]], Mapping[str, Sequence[tuple[int, int, str]]]] = _nothing
    checked: Callable[[Report], Any] = _unknown

    def rule_url(self, code: str) -> str:
        """Return the address of the page about a rule; empty where the documentation has no address."""
        return f"{self.documentation.rstrip('/')}/rules/{code}" if self.documentation else ""
