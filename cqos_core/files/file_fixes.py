"""Applies the fixes of all findings to files, and checks each result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from cqos_core.files.edited_files import Edited, apply_edits
from cqos_core.model.core_findings import asks_less
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Finding, Remedy, Severity, Verdict
from cqos_core.model.problems import InputError

if TYPE_CHECKING:
    from cqos_core.model.report import Report


_ROUNDS: Final = 1000
"""More fixes than this are not applied in one run."""


@dataclass(frozen=True, slots=True)
class FileFixes:
    """The result of applying fixes.

    Attributes:
        edited: the texts before and after.
        applied: the findings that were fixed, each with its fix, in the order of application.
        left: errors and warnings that are still there, each with the reason.
        report: the report of the new texts.
    """

    edited: Edited
    applied: tuple[tuple[Finding, Remedy], ...]
    left: tuple[tuple[Finding, str], ...]
    report: Report


def fix_all(
    sources: Mapping[str, bytes],
    check: Callable[[Mapping[str, bytes]], Report],
    importer: str | None = None,
    *,
    weaken: bool = False,
) -> FileFixes:
    """Apply the first fix of each error and warning that weakens nothing, breaks nothing and needs no change of a program.

    A fix is kept only if the new texts can be read, its finding is gone, and there is no new error.

    Args:
        sources: the texts, by name.
        check: reads and checks texts.
        importer: reads all of them, if given.
        weaken: also apply fixes that ask for less, or promise less, than the design does.
    """
    texts, report = dict(sources), check(sources)
    applied: list[tuple[Finding, Remedy]] = []
    refused: dict[object, str] = {}
    while len(applied) < _ROUNDS:
        judged = [
            (finding, _best(finding, weaken=weaken)) for finding in _wanted(report) if _key(finding) not in refused
        ]
        refused |= {_key(finding): reason for finding, (remedy, reason) in judged if remedy is None}
        chosen = [(finding, remedy) for finding, (remedy, _) in judged if remedy is not None]
        tried = _attempt(texts, report, chosen, check, importer)
        if chosen and tried is None:
            # One of them fails: try each alone. Places of the others are valid only until the first is applied.
            for single in chosen:
                tried = _attempt(texts, report, [single], check, importer)
                if tried is not None:
                    chosen = [single]
                    break
                refused[_key(single[0])] = f"its fix does not work here: {single[1].text}"
        if tried is None:
            break
        texts, report = tried
        applied += chosen
    changed = {name: data for name, data in texts.items() if data != sources[name]}
    left = tuple((finding, refused.get(_key(finding), "it came up late")) for finding in _wanted(report))
    return FileFixes(Edited(dict(sources), changed), tuple(applied), left, report)


def _wanted(report: Report) -> list[Finding]:
    return [each for each in report.findings if each.severity is not Severity.NOTE and each.accepted is None]


def _key(finding: Finding) -> object:
    return finding.code, finding.topic, tuple(side.members for side in finding.sides)


def _best(finding: Finding, *, weaken: bool) -> tuple[Remedy | None, str]:
    """Return the fix to apply; None with the reason if there is none."""
    if not finding.remedies:
        return None, finding.help or "no change of a single value fixes it"
    refused = []
    for remedy in finding.remedies:
        objections = (
            # A requirement may be lowered if it is violated, not if a fact is missing.
            (remedy.weakens and (not weaken or finding.verdict is Verdict.UNKNOWN), asks_less(remedy)),
            (remedy.breaks, "makes other pairs worse"),
            (remedy.kind == "needs_code", "is a promise that the program must keep"),
            (not remedy.edits, "is of no file that can be edited"),
        )
        why = next((text for is_so, text in objections if is_so), None)
        if why is None:
            return remedy, ""
        refused.append(f"{remedy.text}: {why}")
    return None, refused[0]


def _attempt(
    texts: Mapping[str, bytes],
    report: Report,
    chosen: Sequence[tuple[Finding, Remedy]],
    check: Callable[[Mapping[str, bytes]], Report],
    importer: str | None,
) -> tuple[dict[str, bytes], Report] | None:
    """Return the texts and the report after some fixes; None if they cannot be applied, one has no effect, or a new error appears."""
    made = apply_edits(texts, (edit for _, remedy in chosen for edit in remedy.edits), importer)
    if made.left or not made.texts:
        return None
    new = {**texts, **made.texts}
    try:
        after = check(new)
    except InputError:
        return None
    worse = _doubtful(after) > _doubtful(report) or _errors(after) - _errors(report)
    if worse or any(_is_there(finding, remedy, after) for finding, remedy in chosen):
        return None
    return new, after


def _doubtful(report: Report) -> int:
    """Return how many pairs are not known to be compatible."""
    return sum(group.pairs for group in report.groups if group.verdict is not Verdict.COMPATIBLE)


def _errors(report: Report) -> set[tuple[str, str | None, str]]:
    return {
        (each.code, each.topic, member)
        for each in report.findings
        if each.severity is Severity.ERROR
        for side in each.sides
        for member in side.members
    }


def _is_there(finding: Finding, remedy: Remedy, report: Report) -> bool:
    """Whether a report still has a finding about one of the changed endpoints."""
    return any(
        each.code == finding.code
        and each.topic == finding.topic
        and any(set(remedy.members) & set(side.members) for side in each.sides)
        and all(
            any(other.role == side.role and set(other.members) & set(side.members) for other in each.sides)
            for side in finding.sides
        )
        for each in report.findings
    )
