"""Known findings, kept in a file: they do not count, and new ones do.

A finding is known if an entry has its rule and its topic, and names all its endpoints. So moved
lines, changed values, other words and further instances do not make it new. A baseline never hides a new endpoint.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Finding, Severity
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from cqos_core.model.report import Report

VERSION: Final = 1
"""Version of the file's form."""


@dataclass(frozen=True, slots=True)
class BaselineEntry:
    """One known finding.

    Attributes:
        topics: the finding's topics, all of them; none where its members are instances, which decide what they are on.
        members: everybody it concerns: endpoint ids, or those of participants and brokers; of instances their template.
        message: its message; compared only if the finding has neither a topic nor a member.
        more_codes: further rules of the finding.
        file: where several files were checked each by itself, the file it is about; None means any.
    """

    code: str
    topics: frozenset[str]
    members: frozenset[str]
    message: str
    file: str | None = None
    more_codes: frozenset[str] = frozenset()

    @property
    def codes(self) -> frozenset[str]:
        """All rules that the finding is of."""
        return self.more_codes | {self.code}

    def covers(self, other: BaselineEntry) -> bool:
        """Whether ``other``, a finding of today, was known when this entry was written."""
        if not other.codes <= self.codes or self.file not in {None, other.file}:
            return False
        # A finding without a topic, or without members, is about something else.
        if bool(other.topics) != bool(self.topics) or bool(other.members) != bool(self.members):
            return False
        if not other.members and not other.topics:
            return self.message == other.message
        return other.topics <= self.topics and other.members <= self.members

    def names(self) -> list[tuple[str, ...]]:
        """Return the keys of the entry: its topics and members, else its message."""
        named = [*(("topic", topic) for topic in self.topics), *(("member", member) for member in self.members)]
        return [(code, *name) for code in self.codes for name in named or [("message", self.message)]]


@dataclass(slots=True)
class Baseline:
    """The content of a baseline file, and which of its entries were met."""

    path: str
    entries: tuple[BaselineEntry, ...]
    _met: set[BaselineEntry] = field(default_factory=set)
    _filed: dict[tuple[str, ...], list[BaselineEntry]] = field(init=False)

    def __post_init__(self) -> None:
        self._filed = grouped((name, entry) for entry in self.entries for name in entry.names())

    def mark(self, report: Report, file: str | None = None) -> Report:
        """Return ``report`` with every known finding accepted, which says so; ``file`` is the path of its input."""
        return replace(report, findings=tuple(self._marked(finding, file) for finding in report.findings))

    def _marked(self, finding: Finding, file: str | None) -> Finding:
        today = entry_of(finding, None if file is None else name_of(file, self.path))
        covering = self._covering(today)
        if not covering and today.more_codes:
            # An older C-QoS reported each of the rules by itself.
            alone = [replace(today, code=code, more_codes=frozenset()) for code in today.codes]
            each = [self._covering(one) for one in alone]
            covering = [entry for entries in each for entry in entries] if all(each) else []
        self._met.update(covering)
        if not covering or finding.accepted is not None:
            return finding
        return replace(finding, accepted=f"known: it is in the baseline {self.path}")

    def _covering(self, today: BaselineEntry) -> list[BaselineEntry]:
        # An entry that covers the finding has all its names, so those under its rarest name are enough.
        near = min((self._filed.get(name, []) for name in today.names()), key=len)
        return [entry for entry in near if entry.covers(today)]

    def gone(self, files: Iterable[str] = ()) -> int:
        """Return the number of entries without a finding, among those about any file or one of ``files``."""
        checked = {None, *(name_of(file, self.path) for file in files)}
        return sum(1 for entry in self.entries if entry not in self._met and entry.file in checked)


def name_of(file: str, baseline: str) -> str:
    """Name ``file`` as the baseline does: relative to its folder, so that both can move together."""
    folder = os.path.realpath(Path(baseline).parent)
    try:
        return Path(os.path.relpath(os.path.realpath(file), folder)).as_posix()
    except ValueError:  # on another drive
        return Path(os.path.realpath(file)).as_posix()


def entry_of(finding: Finding, file: str | None = None) -> BaselineEntry:
    """Return the entry of a finding."""
    return BaselineEntry(
        code=finding.code,
        topics=frozenset(
            topic
            for topic in (finding.topic, *finding.more_topics)
            if topic is not None and not any(side.templates for side in finding.sides)
        ),
        members=frozenset(member for side in finding.sides for member in side.templates or side.members),
        message=finding.message,
        file=file,
        more_codes=frozenset(finding.more_codes),
    )


def write_baseline(path: str, reports: Iterable[tuple[str | None, Report]]) -> str:
    """Return the text of a baseline that is to stand at ``path``.

    It holds the warnings and errors of ``reports`` that are not accepted; beside each report stands the file to limit
    its entries to, or None. Notes are left out: they never count.
    """
    entries = {
        entry_of(finding, None if file is None else name_of(file, path))
        for file, report in reports
        for finding in report.findings
        if finding.accepted is None and finding.severity is not Severity.NOTE
    }
    listed = sorted(map(_as_json, entries), key=json.dumps)
    return json.dumps({"baseline": VERSION, "findings": listed}, indent=2) + "\n"


def _as_json(entry: BaselineEntry) -> dict[str, Any]:
    return {
        "code": entry.code,
        "topics": sorted(entry.topics),
        "endpoints": sorted(entry.members),
        "message": entry.message,
        **({"more_codes": sorted(entry.more_codes)} if entry.more_codes else {}),
        **({} if entry.file is None else {"file": entry.file}),
    }


def read_baseline(path: str, data: bytes) -> Baseline:
    """Read the content of a baseline file; ``path`` names it in messages.

    Raises:
        InputError: it is no baseline, or one of a later version of C-QoS.
    """
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise _unfit(path, f"it is no JSON: {error}") from None
    if not isinstance(document, dict) or "baseline" not in document:
        raise _unfit(path, "it is no object with the key `baseline`")
    if document["baseline"] != VERSION:
        version = json.dumps(document["baseline"])[:40]
        raise _unfit(path, f"it has version {version}, this C-QoS reads version {VERSION}")
    findings = document.get("findings")
    if not isinstance(findings, list):
        raise _unfit(path, "`findings` is no list")
    return Baseline(path, tuple(_entry(path, index, stated) for index, stated in enumerate(findings)))


def _entry(path: str, index: int, stated: object) -> BaselineEntry:
    where = f"findings[{index}]"
    if not isinstance(stated, dict):
        raise _unfit(path, f"`{where}` is no object")
    texts = {key: stated.get(key) for key in ("code", "message")}
    lists: dict[str, Any] = {"topics": None, "endpoints": None, "more_codes": []}
    lists |= {key: stated[key] for key in lists.keys() & stated.keys()}
    for key, text in {**texts, "file": stated.get("file", "")}.items():
        if not isinstance(text, str):
            raise _unfit(path, f"`{where}.{key}` is no text")
    for key, names in lists.items():
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise _unfit(path, f"`{where}.{key}` is no list of texts")
    return BaselineEntry(
        code=stated["code"],
        topics=frozenset(stated["topics"]),
        members=frozenset(stated["endpoints"]),
        message=stated["message"],
        file=stated.get("file"),
        more_codes=frozenset(lists["more_codes"]),
    )


def _unfit(path: str, reason: str) -> InputError:
    help_text = "write it anew with --write-baseline"
    return InputError([Problem("CQ606", f"this is no baseline of C-QoS: {reason}", Place(path), help_text)])
