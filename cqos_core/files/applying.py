"""Fixes applied to files: new texts from edits, read back and checked again."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from cqos_core.files.edits import edited, replacements
from cqos_core.files.loading import GivenSource, read_together, recognise
from cqos_core.files.opening import open_file, read_path
from cqos_core.files.writing import replace_all
from cqos_core.model.core_findings import asks_less
from cqos_core.model.dataclass import dataclass
from cqos_core.model.encoding import decode
from cqos_core.model.finding import Edit, Finding, Remedy, Severity, Verdict
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InputError
from cqos_core.model.source import Inserter, Replacement, Source
from cqos_core.model.system import System
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from cqos_core.model.report import Report

_ROUNDS: Final = 1000
"""More fixes than this are not applied in one run."""


@dataclass(frozen=True, slots=True)
class Edited:
    """Texts before and after edits.

    Attributes:
        before: the bytes of every source, by name.
        texts: the new bytes of those that differ.
        left: edits that could not be applied, each with the reason.
    """

    before: Mapping[str, bytes]
    texts: Mapping[str, bytes]
    left: tuple[tuple[Edit, str], ...] = ()

    def diff(self) -> str:
        """Return the changes as a unified diff."""
        return "".join(
            line for name, data in self.texts.items() for line in _diff(name, decode(self.before[name]), decode(data))
        )

    def write(self) -> None:
        """Write every changed text to the file of its name, each whole or not at all.

        Raises:
            ChangedFileError: a file no longer holds what was read of it; none is written.
            OSError: a file cannot be written; it holds what it held before.
        """
        replace_all(self.texts, self.before)


def _diff(name: str, before: str, after: str) -> Iterable[str]:
    for line in difflib.unified_diff(before.splitlines(keepends=True), after.splitlines(keepends=True), name, name):
        yield line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"


def apply_edits(sources: Mapping[str, bytes], edits: Iterable[Edit], importer: str | None = None) -> Edited:
    """Apply edits to texts by the name of their source; ``importer`` reads all of them, if given."""
    edits = list(dict.fromkeys(edits))
    left = [
        (each, f"`{each.place.source}` is none of the inputs") for each in edits if each.place.source not in sources
    ]
    texts = {}
    for name, own in grouped((each.place.source, each) for each in edits).items():
        if name in sources:
            source = Source(name, sources[name])
            made = edited(source, own, partial(_inserter, source, importer))
            left += made.left
            if made.data != sources[name]:
                texts[name] = made.data
    return Edited(dict(sources), texts, tuple(left))


def replacements_of(
    sources: Mapping[str, bytes], edits: Iterable[Edit], importer: str | None = None
) -> dict[str, list[Replacement]]:
    """Return what edits replace in each source, by its name; nothing where one of them cannot be applied."""
    found = {}
    for name, own in grouped((each.place.source, each) for each in edits).items():
        source = Source(name, sources.get(name, b""))
        found[name], left = replacements(source, own, partial(_inserter, source, importer))
        if left or name not in sources:
            return {}
    return found


def _inserter(source: Source, importer: str | None) -> Inserter | None:
    try:
        info = recognise(source, load_plugins(), importer)
    except InputError:
        return None
    return None if info is None else info.load_inserter()


def opened_sources(systems: Iterable[System], edits: Iterable[Edit] = ()) -> dict[str, bytes]:
    """Return the bytes of every file that systems were read from, and of further ones that edits name."""
    found = {name: data for system in systems for name, data in system.sources.items()}
    for name in {edit.place.source: None for edit in edits if edit.place.source not in found}:
        with suppress(InputError):  # the edit says that its source is none of the inputs
            found[name] = read_path(name).data
    return found


def read_texts(
    names: Sequence[str],
    texts: Mapping[str, bytes],
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    protocol: str | None = None,
    folders: Mapping[str, GivenSource] | None = None,
) -> list[System]:
    """Read sources by name with the bytes that ``texts`` has of them; other files that they include are opened.

    ``folders`` are those of the names that are folders, as they were read before.

    Raises:
        InputError: with what is wrong with all of them.
    """

    def opener(name: str, relative_to: str) -> Source:
        if name in texts and name.startswith("<bytes"):
            return Source(name, texts[name])
        source = open_file(name, relative_to)
        known = source.name if relative_to or name not in texts else name
        return replace(source, name=known, data=texts.get(known, source.data))

    whole = folders or {}
    given = [
        replace(whole[name], opener=opener) if name in whole else GivenSource(opener(name, ""), opener)
        for name in names
    ]
    found = read_together(given, importer, switches, protocol=protocol)
    problems = [problem for each in found if isinstance(each, InputError) for problem in each.problems]
    if problems:
        raise InputError(problems)
    return [each for each in found if isinstance(each, System)]


@dataclass(frozen=True, slots=True)
class Fixed:
    """What applying fixes gave.

    Attributes:
        edited: the texts.
        applied: what was fixed, and how, in the order of application.
        left: errors and warnings that are still there, each with the reason.
        report: of the new texts.
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
) -> Fixed:
    """Apply the first fix of each error and warning that weakens nothing, breaks nothing and needs no other program.

    Each is kept only if the new texts can be read, its finding is gone, and no error is there that was not before.

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
            # One of them does not work: find one that does, for their places hold only until the first is applied.
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
    return Fixed(Edited(dict(sources), changed), tuple(applied), left, report)


def _wanted(report: Report) -> list[Finding]:
    return [each for each in report.findings if each.severity is not Severity.NOTE and each.accepted is None]


def _key(finding: Finding) -> object:
    return finding.code, finding.topic, tuple(side.members for side in finding.sides)


def _best(finding: Finding, *, weaken: bool) -> tuple[Remedy | None, str]:
    """Return the fix to apply, or the reason why there is no such one."""
    if not finding.remedies:
        return None, finding.help or "no change of a single value fixes it"
    refused = []
    for remedy in finding.remedies:
        objections = (
            # Less is asked for where a requirement is not met, not where a fact is missing.
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
    """Apply fixes together; None where they cannot be, where one does not work, or where they bring an error."""
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
    """Whether a report still has a finding, of any of the endpoints that were changed."""
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
