"""What the calls of a session do that are one message each: open a model or documents, change them, answer what that changes.

A session lives in one process and is called by one caller at a time. Documents are read again as a whole, and compared with what is
open: so an edit of one event costs what it touches, and an edit of nothing that is read costs the reading.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos.v1 import check_pb2, report_pb2, session_pb2
from cqos_core.checking.session import Session
from cqos_core.matching.pipeline import CheckContext, context
from cqos_core.model.endpoint_rows import RowEndpoint
from cqos_core.model.finding import Severity
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InputError
from cqos_core.model.system import NAMED, Endpoint, System
from cqos_core.plugins import load_plugins
from cqos_core.remote.asked import decode, least_severe, paths_of, refusal_message
from cqos_core.remote.catalogue import versions
from cqos_core.remote.description import DescribedEndpoint, describe, described_endpoints
from cqos_core.remote.edit_session import OpenNames, answer_with, changed
from cqos_core.remote.messages import EVERYTHING, below, report_message, to_message
from cqos_core.remote.refusal import TOO_LARGE, Refused, unfit
from cqos_core.remote.request_problems import FieldProblem
from cqos_core.remote.request_systems import read_documents, read_system

if TYPE_CHECKING:
    from cqos_core.model.report import Report

_WHOLE = ("name", "protocol", "partial", "hypothetical", "overlays", "checks", "accept", "severities", "notes", "flows")
"""Parts of a system that one edit replaces."""
_LOCAL: Final = frozenset({"put_endpoint", "remove_endpoint", "set_notes", "set_name", "set_flows"})
"""Edits after which no endpoint is described otherwise than those that they name."""
_NESTED = "values are nested too deep, which is refused"


class OpenModel:
    """One open session, and what its caller knows of it."""

    def __init__(self, most_endpoints: int) -> None:
        """Wait to be opened."""
        self._most = most_endpoints
        self._documents: _Documents | None = None
        self._where: CheckContext = context()
        self._session = Session()
        self._known = OpenNames(System())
        self._written = _ReportWriter(EVERYTHING, Severity.NOTE)
        self._told = report_pb2.Report()
        self._revision = 0
        self._described: _Described | None = None

    def open(self, data: bytes) -> bytes:
        """Answer the request that opens it; the name of the session is the caller's to add.

        Raises:
            Refused: it cannot be opened.
        """
        try:
            return self._opened(decode(session_pb2.OpenSessionRequest, data))
        except RecursionError:
            raise Refused("INVALID_ARGUMENT", _NESTED) from None
        except InputError as error:  # bridges make too much of what was read
            text = "\n".join(map(str, error.problems))
            raise Refused("RESOURCE_EXHAUSTED", text, documents=error.problems, reason=TOO_LARGE) from None

    def _opened(self, request: session_pb2.OpenSessionRequest) -> bytes:
        paths = paths_of(request, report_pb2.Report)
        self._written = _ReportWriter(paths, least_severe(request))
        if request.WhichOneof("input") == "documents":
            self._documents = _Documents(request.documents)
            self._where, system = self._documents.read(self._most)
        elif request.WhichOneof("input") == "system":
            system = read_system(request.system, self._most)
            self._known = OpenNames(system)
        else:
            raise unfit([FieldProblem("input", "`system` or `documents` is needed")])
        self._session = self._afresh(system)
        self._told = self._written.message(self._session.report())
        self._revision = request.revision
        response = session_pb2.OpenSessionResponse(revision=request.revision, report=self._told)
        if request.describe:
            self._described = _Described()
            self._described.follow(self._session, self._where, None)
            response.endpoints.extend(self._described.endpoints)
            response.participants.extend(self._described.participants)
        return response.SerializeToString()

    def edit(self, data: bytes) -> bytes:
        """Answer an edit; one that cannot be done leaves everything as it was.

        Raises:
            Refused: the message is none.
        """
        request = decode(session_pb2.EditSessionRequest, data)
        response = session_pb2.EditSessionResponse(revision=request.revision)
        try:
            try:
                touched = self._follow(request)
            except RecursionError:
                raise unfit([FieldProblem(request.WhichOneof("edit") or "edit", _NESTED)]) from None
        except Refused as refused:
            response.refusal.CopyFrom(refusal_message(refused.fields))
            response.refusal.documents.extend(to_message(each, report_pb2.Problem) for each in refused.documents)
            return response.SerializeToString()
        self._answer(request, response, touched)
        return response.SerializeToString()

    def _afresh(self, system: System) -> Session:
        session = Session(system, protocol=self._where.default_protocol, most_endpoints=self._most)
        session.report()
        return session

    def _follow(self, request: session_pb2.EditSessionRequest) -> list[str] | None:
        """Do an edit; return the ids of the endpoints that it touches, None where others may be described otherwise.

        Raises:
            Refused: it cannot be done.
        """
        kind = request.WhichOneof("edit")
        if kind == "documents":
            if self._documents is None:
                raise unfit([FieldProblem("documents", "this session has a model, which `changes` change")])
            return self._put_documents(self._documents, request.documents)
        if kind != "changes":
            self._session.report()  # which counts what it judges
            return []
        if self._documents is not None:
            raise unfit([FieldProblem("changes", "this session has documents, which `documents` change")])
        known = self._known
        may_fail = bool(known.routes) or any(each.HasField("put_bridge") for each in request.changes.changes)
        before = self._session.system if may_fail else System()
        self._known = changed(self._session, known, request.changes, self._most)
        self._check_or_return(before, known, "changes")
        kinds = [each.WhichOneof("change") for each in request.changes.changes]
        if any(each not in {"put_endpoint", "remove_endpoint"} for each in kinds):
            return None
        return [each.put_endpoint.id or each.remove_endpoint for each in request.changes.changes]

    def _put_documents(self, documents: _Documents, changes: session_pb2.DocumentChanges) -> list[str] | None:
        before, after = documents.system, documents.changed(changes)
        _, system = after.read(self._most)
        edits = None if before is None else _edits(before, system)
        if before is not None and edits is not None:
            try:
                for kind, value in edits:
                    self._session.edit(kind, value)
                self._session.report()
            except (InputError, KeyError, RecursionError):
                # What went wrong halfway is found again from the beginning, or the session is what it was.
                self._session, edits = self._afresh(before), None
        if edits is None:
            self._session = self._new_session(system)
        self._documents = after
        if edits is None or any(kind not in _LOCAL for kind, _ in edits):
            return None
        return [value if kind == "remove_endpoint" else value.id for kind, value in edits if kind.endswith("endpoint")]

    def _new_session(self, system: System) -> Session:
        try:
            return self._afresh(system)
        except InputError as error:
            raise unfit([FieldProblem("documents", str(each)) for each in error.problems]) from None

    def _check_or_return(self, before: System, known: OpenNames, field: str) -> None:
        """Check what an edit made; where that cannot be checked, go back.

        Raises:
            Refused: bridges make too much of it.
        """
        try:
            self._session.report()
        except InputError as error:
            self._session, self._known = self._afresh(before), known
            raise unfit([FieldProblem(field, str(each)) for each in error.problems]) from None

    def _answer(
        self,
        request: session_pb2.EditSessionRequest,
        response: session_pb2.EditSessionResponse,
        touched: list[str] | None,
    ) -> None:
        response.judged = self._session.judged
        whole = self._written.message(self._session.report())
        known = self._told if request.base_revision == self._revision else None
        answer_with(response, known, self._revision, whole)
        self._told, self._revision = whole, request.revision
        if self._described is not None:
            put, removed, participants = self._described.follow(self._session, self._where, touched)
            if response.HasField("report"):
                put, removed, participants = self._described.endpoints, (), self._described.participants
            response.endpoints.extend(put)
            response.removed_endpoints.extend(removed)
            response.participants.extend(participants)


# --- documents ---


class _Documents:
    """The documents of a session, and the system that they are."""

    def __init__(self, message: check_pb2.Documents) -> None:
        """Take them as they came; places that name an element get no line, which every edit would move."""
        self._message = check_pb2.Documents()
        self._message.CopyFrom(message)
        self._fields: dict[str, str] = {}
        self.system: System | None = None
        for name, info in load_plugins().importers.items():
            if info.drawn:
                self._message.reading.switches[name].settings["lines"] = "false"

    def changed(self, changes: session_pb2.DocumentChanges) -> _Documents:
        """Return what changes make of them.

        Raises:
            Refused: a document to remove is not there.
        """
        documents = {each.name: each for each in self._message.documents}
        wrong = [
            FieldProblem(f"documents.removed[{index}]", f"there is no document `{name[:60]}`")
            for index, name in enumerate(changes.removed)
            if name not in documents
        ]
        if wrong:
            raise unfit(wrong)
        for name in changes.removed:
            documents.pop(name, None)
        documents |= {each.name: each for each in changes.put}
        if not documents:
            raise unfit([FieldProblem("documents.removed", "at least one document has to remain")])
        message = check_pb2.Documents(documents=documents.values(), reading=self._message.reading)
        message.included.extend(self._message.included)
        after = _Documents(message)
        after._fields = {each.name: f"documents.put[{index}].content" for index, each in enumerate(changes.put)}
        return after

    def read(self, most: int) -> tuple[CheckContext, System]:
        """Read them.

        Raises:
            Refused: they cannot be read, or hold too many endpoints.
        """
        names = Counter(each.name for each in self._message.documents)
        twice = [
            FieldProblem(f"documents.documents[{index}].name", "in a session each document has a name of its own")
            for index, each in enumerate(self._message.documents)
            if names[each.name] > 1
        ]
        if twice:
            raise unfit(twice)
        try:
            where, self.system = read_documents(self._message, most, "documents.")
        except Refused as refused:
            if refused.documents and self._fields:
                sources = [each.place.source if each.place else "" for each in refused.documents]
                fields = [
                    FieldProblem(self._fields.get(source, "documents"), str(each))
                    for source, each in zip(sources, refused.documents, strict=True)
                ]
                raise Refused(refused.code, refused.message, fields, refused.documents) from None
            raise
        return where, self.system


def _edits(before: System, after: System) -> list[tuple[str, Any]] | None:
    """Return the edits that make one system of another; None where they differ in a part that no edit changes."""
    old, new = _by_id(before.endpoints), _by_id(after.endpoints)
    if old is None or new is None or before.sources != after.sources or before.options != after.options:
        return None
    put: list[tuple[str, Any]] = []
    gone: list[tuple[str, Any]] = []
    for kind in NAMED:
        was, now = getattr(before, kind), getattr(after, kind)
        put += [(f"put_{kind[:-1]}", each) for name, each in now.items() if was.get(name) != each]
        gone += [(f"remove_{kind[:-1]}", name) for name in was if name not in now]
    return [
        *put,
        *(("remove_endpoint", name) for name in old if name not in new),
        *(("put_endpoint", each) for name, each in new.items() if name not in old or not _alike(old[name], each)),
        *gone,
        *((f"set_{each}", getattr(after, each)) for each in _WHOLE if getattr(before, each) != getattr(after, each)),
    ]


def _by_id(endpoints: Sequence[Endpoint]) -> dict[str, Endpoint] | None:
    """Endpoints by id; None where two have one id, so that their order counts."""
    found = {each.id: each for each in endpoints}
    return found if len(found) == len(endpoints) else None


def _alike(one: Endpoint, other: Endpoint) -> bool:
    if isinstance(one, RowEndpoint) and isinstance(other, RowEndpoint):
        return one.states_like(other)
    return one == other


# --- what a caller knows ---


class _ReportWriter:
    """Writes the reports of a session; what was in the last one is not written again."""

    def __init__(self, paths: frozenset[str], least: Severity) -> None:
        self._paths, self._least = paths, least
        self._known: dict[int, tuple[object, Any]] = {}

    def message(self, report: Report) -> report_pb2.Report:
        """Return the message of a report."""
        heard = [each for each in report.findings if each.severity.rank <= self._least.rank]
        known: dict[int, tuple[object, Any]] = {}
        parts = {
            "findings": self._parts(heard, "findings", report_pb2.Finding, known),
            "groups": self._parts(report.groups, "groups", report_pb2.Group, known),
        }
        self._known = known
        frame = self._paths and frozenset(each for each in self._paths if each.partition(".")[0] not in parts)
        if frame or not self._paths:
            message = report_message(replace(report, findings=(), groups=()), frame)
            if not frame or any(each.partition(".")[0] == "counts" for each in frame):
                counted = report_message(report, frozenset(("counts",)))
                message.counts.CopyFrom(counted.counts)
            if not frame or "versions" in frame:
                message.versions.update(versions())
        else:
            message = report_pb2.Report()
        for name, found in parts.items():
            getattr(message, name).extend(found)
        return message

    def _parts(self, found: Iterable[Any], name: str, kind: Any, known: dict[int, tuple[object, Any]]) -> list[Any]:
        paths = below(self._paths, name)
        if paths is None:
            return []
        made = []
        for each in found:
            entry = self._known.get(id(each))
            if entry is None or entry[0] is not each:
                entry = each, to_message(each, kind, paths)
            known[id(each)] = entry
            made.append(entry[1])
        return made


_Differences: TypeAlias = """tuple[
    Iterable[check_pb2.DescribedEndpoint], Sequence[str], Sequence[check_pb2.DescribedParticipant]
]"""
"""New and other endpoints, ids of those that are gone, and participants."""


class _Described:
    """The description of a system, as its caller has it."""

    def __init__(self) -> None:
        self._endpoints: dict[str, check_pb2.DescribedEndpoint] = {}
        self._of: dict[str, list[str]] = {}
        self.participants: list[check_pb2.DescribedParticipant] = []

    @property
    def endpoints(self) -> Iterable[check_pb2.DescribedEndpoint]:
        """All endpoints."""
        return self._endpoints.values()

    def follow(self, session: Session, where: CheckContext, touched: list[str] | None) -> _Differences:
        """Describe what an edit touched, None for anything; return new and other endpoints, ids that are gone, and participants."""
        resolved = None if touched is None else session.resolved(touched)
        if touched is None or resolved is None:
            return self._afresh(session.system, where)
        now: dict[str, list[DescribedEndpoint]] = {
            stated.id: list(described_endpoints(stated, parts)) for stated, parts in resolved
        }
        before = {name for each in touched for name in self._of.pop(each, ())}
        self._of |= {name: [each.id for each in found] for name, found in now.items()}
        messages = {each.id: _message(each) for found in now.values() for each in found}
        put = [each for name, each in messages.items() if self._endpoints.get(name) != each]
        removed = [name for name in before if name not in messages]
        for name in removed:
            self._endpoints.pop(name, None)
        self._endpoints |= messages
        return put, removed, []

    def _afresh(self, system: System, where: CheckContext) -> _Differences:
        found = describe(system, where)
        before, participants = self._endpoints, self.participants
        self._endpoints = {each.id: _message(each) for each in found.endpoints}
        self._of = grouped((each.stated, each.id) for each in found.endpoints)
        self.participants = [to_message(each, check_pb2.DescribedParticipant) for each in found.participants]
        put = [each for name, each in self._endpoints.items() if before.get(name) != each]
        removed = [name for name in before if name not in self._endpoints]
        return put, removed, self.participants if participants != self.participants else []


def _message(endpoint: DescribedEndpoint) -> check_pb2.DescribedEndpoint:
    return to_message(endpoint, check_pb2.DescribedEndpoint)
