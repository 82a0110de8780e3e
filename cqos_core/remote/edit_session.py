"""What the edits of a session do; a session lives in one process and is called by one caller at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

from google.protobuf.message import Message

from cqos.v1 import report_pb2, session_pb2
from cqos_core.checking.session import Session
from cqos_core.model.problems import InputError
from cqos_core.model.system import NAMED, System
from cqos_core.remote.asked import decode, refusal_message, reported
from cqos_core.remote.messages import change_value
from cqos_core.remote.refusal import Refused, unfit
from cqos_core.remote.request_problems import FieldProblem, endpoint_problems, named_problems, part_problems
from cqos_core.remote.request_systems import bounded, read_system


class EditSession:
    """One open system, and the report that its caller has."""

    def __init__(self, most_endpoints: int) -> None:
        """Wait for the first message."""
        self._most = most_endpoints
        self._session: Session | None = None
        self._known = OpenNames(System())
        self._told: report_pb2.Report | None = None
        self._revision = 0

    def edit(self, data: bytes) -> bytes:
        """Answer one message of the stream.

        Raises:
            Refused: it ends the stream.
        """
        request = decode(session_pb2.EditRequest, data)
        response = session_pb2.EditResponse(revision=request.revision)
        opening = self._session is None
        try:
            self._follow(request)
        except Refused as refused:
            if opening:
                raise
            response.refusal.CopyFrom(refusal_message(refused.fields))
        else:
            self._report(request.revision, response)
        return response.SerializeToString()

    def repeat(self, messages: Sequence[bytes]) -> None:
        """Do again what was done in another process: its caller has the last report already."""
        for data in messages:
            request = decode(session_pb2.EditRequest, data)
            with suppress(Refused):  # as it was then
                self._follow(request)
                self._revision = request.revision
        self._report(self._revision, session_pb2.EditResponse(revision=self._revision))

    def _follow(self, request: session_pb2.EditRequest) -> None:
        """Open a system, or change the one that is open.

        Raises:
            Refused: that cannot be done.
        """
        kind = request.WhichOneof("edit")
        if self._session is not None:
            if kind != "changes":
                raise unfit([FieldProblem("changes", "after the first message, changes are needed")])
            self._known = changed(self._session, self._known, request.changes, self._most)
            return
        if kind != "open":
            raise unfit([FieldProblem("open", "the first message of a stream opens a system")])
        system = read_system(request.open, self._most, "open")
        self._session, self._known = Session(system, most_endpoints=self._most), OpenNames(system)

    def _report(self, revision: int, response: session_pb2.EditResponse) -> None:
        session = self._session
        assert session is not None  # noqa: S101 - the first message opened it
        try:
            whole = reported(session.report())
        except InputError as error:  # bridges make too much of it: the session cannot go on
            raise unfit(
                [FieldProblem("changes" if self._told else "open", str(each)) for each in error.problems]
            ) from None
        response.judged = session.judged
        answer_with(response, self._told, self._revision, whole)
        self._told, self._revision = whole, revision


def answer_with(
    response: session_pb2.EditResponse | session_pb2.EditSessionResponse,
    known: report_pb2.Report | None,
    revision: int,
    whole: report_pb2.Report,
) -> None:
    """Answer with a report, or with what makes it of the one that the caller has from a ``revision`` if that is smaller."""
    delta = None if known is None else difference(known, whole)
    if delta is None:
        response.report.CopyFrom(whole)
    else:
        delta.base_revision = revision
        response.delta.CopyFrom(delta)


def changed(session: Session, known: OpenNames, changes: session_pb2.Changes, most: int) -> OpenNames:
    """Do all of the changes to a session, or none; return what the system then has by name.

    Raises:
        Refused: one of them cannot be done.
    """
    after = known.copy()
    wrong = [
        problem for index, change in enumerate(changes.changes) for problem in after.do(change, f"changes[{index}]")
    ]
    if wrong:
        raise unfit(wrong)
    bounded(after.size, most, "changes")
    for change in changes.changes:
        session.edit(*change_value(change))
    return after


class OpenNames:
    """What a system has by name, so that a change can be refused before anything is changed."""

    def __init__(self, system: System) -> None:
        self.endpoints = {each.id: each.participant for each in system.endpoints}
        self.names = {kind: set(getattr(system, kind)) for kind in NAMED}
        self.routes = {each.id: len(each.routes) for each in system.bridges.values()}

    @property
    def size(self) -> int:
        """How many endpoints there are, two for each route of a bridge among them."""
        return len(self.endpoints) + 2 * sum(self.routes.values())

    def copy(self) -> OpenNames:
        """Return a copy that changes by itself."""
        made = OpenNames(System())
        made.endpoints, made.routes = dict(self.endpoints), dict(self.routes)
        made.names = {kind: set(names) for kind, names in self.names.items()}
        return made

    def do(self, change: session_pb2.Change, path: str) -> Iterator[FieldProblem]:
        """Follow a change, and yield why it cannot be done."""
        kind = change.WhichOneof("change")
        if kind is None:
            yield FieldProblem(path, "a change is needed")
            return
        where, value = f"{path}.{kind}", getattr(change, kind)
        verb, _, what = kind.partition("_")
        if kind == "put_endpoint":
            yield from endpoint_problems(value, self.names["participants"], where)
            self.endpoints[value.id] = value.participant
        elif verb == "put":
            yield from named_problems(value, where)
            name = getattr(value, NAMED[f"{what}s"])
            self.names[f"{what}s"].add(name)
            if what == "bridge":
                self.routes[name] = len(value.routes)
        elif verb == "remove":
            yield from self._remove(what, value, where)
        elif isinstance(value, Message):
            yield from part_problems(value, where)

    def _remove(self, kind: str, name: str, where: str) -> Iterator[FieldProblem]:
        entries: dict[str, str] | set[str] = self.endpoints if kind == "endpoint" else self.names[f"{kind}s"]
        if name not in entries:
            yield FieldProblem(where, f"there is no {kind} `{name}`")
        elif isinstance(entries, dict):
            del entries[name]
        else:
            entries.discard(name)
        if kind == "participant":
            self.endpoints = {each: owner for each, owner in self.endpoints.items() if owner != name}
        elif kind == "bridge":
            self.routes.pop(name, None)


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
        if not found:
            added.append(position)
            continue
        last = found.popleft()
        kept.add(last)
    return [position for position in range(len(old)) if position not in kept], added
