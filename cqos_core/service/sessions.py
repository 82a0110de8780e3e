"""What the edits of a session do; a session lives in one process and is called by one caller at a time."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from cqos.v1 import report_pb2, session_pb2
from cqos_core.messages import (
    FieldProblem,
    endpoint_problems,
    from_message,
    participant_problems,
    profile_problems,
    report_message,
)
from cqos_core.service.answers import bounded, decode, read_system, refusal_message
from cqos_core.service.refusal import Refused, unfit
from cqos_core.session import Session

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.system import System


class EditSession:
    """One open system, and the report that its caller has."""

    def __init__(self, most_endpoints: int) -> None:
        """Wait for the first message."""
        self._most = most_endpoints
        self._session: Session | None = None
        self._known = _Known()
        self._told: report_pb2.Report | None = None
        self._revision = 0

    def edit(self, data: bytes) -> bytes:
        """Answer one message of the stream.

        Raises:
            Refused: it ends the stream.
        """
        request = decode(session_pb2.EditRequest, data)
        response = session_pb2.EditResponse(revision=request.revision)
        kind = request.WhichOneof("edit")
        if self._session is None:
            if kind != "open":
                raise unfit([FieldProblem("open", "the first message of a stream opens a system")])
            self._open(read_system(request.open, self._most, "open"))
        else:
            try:
                if kind != "changes":
                    raise unfit([FieldProblem("changes", "after the first message, changes are needed")])
                self._change(self._session, request.changes)
            except Refused as refused:
                response.refusal.CopyFrom(refusal_message(refused.fields))
                return response.SerializeToString()
        self._report(request.revision, response)
        return response.SerializeToString()

    def _open(self, system: System) -> None:
        self._session = Session(system)
        self._known = _Known(
            {each.id: each.participant for each in system.endpoints},
            set(system.participants),
            set(system.profiles),
            set(system.topics),
        )

    def _change(self, session: Session, changes: session_pb2.Changes) -> None:
        """Do all of the changes, or none.

        Raises:
            Refused: one of them cannot be done.
        """
        after = self._known.copy()
        wrong = [
            problem for index, change in enumerate(changes.changes) for problem in after.do(change, f"changes[{index}]")
        ]
        if wrong:
            raise unfit(wrong)
        bounded(len(after.endpoints), self._most, "changes")
        for change in changes.changes:
            _do(session, change)
        self._known = after

    def _report(self, revision: int, response: session_pb2.EditResponse) -> None:
        session = self._session
        assert session is not None  # noqa: S101 - the first message opened it
        whole = report_message(session.report())
        response.judged = session.judged
        delta = None if self._told is None else difference(self._told, whole)
        if delta is None:
            response.report.CopyFrom(whole)
        else:
            delta.base_revision = self._revision
            response.delta.CopyFrom(delta)
        self._told, self._revision = whole, revision


class _Known:
    """What a system has by name, so that a change can be refused before anything is changed."""

    def __init__(
        self,
        endpoints: dict[str, str] | None = None,
        participants: set[str] | None = None,
        profiles: set[str] | None = None,
        topics: set[str] | None = None,
    ) -> None:
        self.endpoints = endpoints or {}
        self.participants = participants or set()
        self.profiles = profiles or set()
        self.topics = topics or set()

    def copy(self) -> _Known:
        return _Known(dict(self.endpoints), set(self.participants), set(self.profiles), set(self.topics))

    def do(self, change: session_pb2.Change, path: str) -> Iterator[FieldProblem]:
        """Follow a change, and yield why it cannot be done."""
        kind = change.WhichOneof("change")
        if kind is None:
            yield FieldProblem(path, "a change is needed")
            return
        where, value = f"{path}.{kind}", getattr(change, kind)
        if kind == "put_endpoint":
            yield from endpoint_problems(value, self.participants, where)
            self.endpoints[value.id] = value.participant
        elif kind == "put_participant":
            yield from participant_problems(value, where)
            self.participants.add(value.id)
        elif kind == "put_profile":
            yield from profile_problems(value, where)
            self.profiles.add(value.name)
        elif kind == "put_topic":
            self.topics.add(value.name)
        elif kind.startswith("remove_"):
            yield from self._remove(kind.removeprefix("remove_"), value, where)

    def _remove(self, kind: str, name: str, where: str) -> Iterator[FieldProblem]:
        entries: dict[str, str] | set[str] = getattr(self, f"{kind}s")
        if name not in entries:
            yield FieldProblem(where, f"there is no {kind} `{name}`")
        elif isinstance(entries, dict):
            del entries[name]
        else:
            entries.discard(name)
        if kind == "participant":
            self.endpoints = {each: owner for each, owner in self.endpoints.items() if owner != name}


def _do(session: Session, change: session_pb2.Change) -> None:
    kind = change.WhichOneof("change")
    if kind == "set_option":
        option = change.set_option
        session.set_option(option.pack, option.name, option.value if option.HasField("value") else None)
    elif kind == "put_endpoint":
        session.put(from_message(change.put_endpoint))
    elif kind == "remove_endpoint":
        session.remove(change.remove_endpoint)
    elif kind is not None:
        value: Any = getattr(change, kind)
        getattr(session, kind)(value if kind.startswith("remove_") else from_message(value))


# --- what differs between two reports ---


def difference(old: report_pb2.Report, new: report_pb2.Report) -> session_pb2.ReportDelta | None:
    """Return what makes ``new`` of ``old``; None where that would be no smaller than ``new`` itself."""
    gone_groups, new_groups = _changes(old.groups, new.groups)
    gone_findings, new_findings = _changes(old.findings, new.findings)
    if len(new_groups) + len(new_findings) >= max(len(new.groups) + len(new.findings), 1):
        return None
    summary = report_pb2.Report()
    summary.CopyFrom(new)
    summary.ClearField("groups")
    summary.ClearField("findings")
    return session_pb2.ReportDelta(
        summary=summary,
        removed_groups=gone_groups,
        added_groups=[session_pb2.PlacedGroup(position=at, group=new.groups[at]) for at in new_groups],
        removed_findings=gone_findings,
        added_findings=[session_pb2.PlacedFinding(position=at, finding=new.findings[at]) for at in new_findings],
    )


def _changes(old: Sequence[Any], new: Sequence[Any]) -> tuple[list[int], list[int]]:
    """Positions in ``old`` of what is gone, and in ``new`` of what was added; what is kept is in the same order."""
    places: dict[bytes, deque[int]] = {}
    for position, each in enumerate(old):
        places.setdefault(each.SerializeToString(deterministic=True), deque()).append(position)
    kept: set[int] = set()
    added = []
    last = -1
    for position, each in enumerate(new):
        found = places.get(each.SerializeToString(deterministic=True))
        while found and found[0] < last:
            found.popleft()
        if found:
            last = found.popleft()
            kept.add(last)
        else:
            added.append(position)
    return [position for position in range(len(old)) if position not in kept], added
