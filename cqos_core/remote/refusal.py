"""Why a call is not answered, in the words of google.rpc."""

from __future__ import annotations

from itertools import accumulate, takewhile
from typing import TYPE_CHECKING, Any, Final

from google.protobuf import any_pb2, duration_pb2
from google.rpc import code_pb2, error_details_pb2, status_pb2

from cqos.v1 import report_pb2
from cqos_core.remote.messages import to_message
from cqos_core.remote.request_problems import FieldProblem

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from google.protobuf.message import Message

    from cqos_core.model.problems import Problem

DOMAIN: Final = "cqos"
SESSION_LOST: Final = "SESSION_LOST"
SESSION_ELSEWHERE: Final = "SESSION_ELSEWHERE"
"""Another process may have the session; for the caller that is as if none had it."""
LEFT_OUT: Final = "DETAILS_LEFT_OUT"
TOO_LARGE: Final = "TOO_LARGE"
"""Sending it again gets the same answer."""
CALLER_QUOTA: Final = "CALLER_QUOTA"
"""The caller has too much under way; it may send it again when less is."""
BUSY: Final = "BUSY"
"""All callers together have; it may be sent again later."""
WORKER_LOST: Final = "WORKER_LOST"
"""A fault of the service; it may be sent again later."""
LATER: Final = frozenset({CALLER_QUOTA, BUSY, WORKER_LOST})
"""Reasons for which a call that was refused may be sent again."""
_AFTER: Final = error_details_pb2.RetryInfo(retry_delay=duration_pb2.Duration(seconds=1))
_LISTS: Final = ((error_details_pb2.BadRequest, "field_violations"), (report_pb2.InputProblems, "problems"))
_LONGEST_MESSAGE: Final = 2048
"""As it travels."""
_ENTRY_BYTES: Final = 8
_LISTED: Final = 3
_LEFT_OUT_BYTES: Final = 256


class Refused(Exception):  # noqa: N818 - it is a refusal
    """A call that is answered with a status other than OK.

    Attributes:
        code: name of a `google.rpc.Code`.
        fields: what is wrong with the request.
        documents: what is wrong with documents in it.
        reason: for programs, where the code does not say enough.
    """

    def __init__(
        self,
        code: str,
        message: str,
        fields: Iterable[FieldProblem] = (),
        documents: Sequence[Problem] = (),
        reason: str = "",
    ) -> None:
        """Say why."""
        super().__init__(message)
        self.code, self.message, self.reason = code, message, reason
        self.fields, self.documents = tuple(fields), tuple(documents)

    def status(self) -> status_pb2.Status:
        """Return all of it as one message."""
        violations = [
            error_details_pb2.BadRequest.FieldViolation(field=each.field, description=each.description)
            for each in self.fields
        ]
        problems = [to_message(each, report_pb2.Problem) for each in self.documents]
        details: list[tuple[object, Message]] = [
            (violations, error_details_pb2.BadRequest(field_violations=violations)),
            (problems, report_pb2.InputProblems(problems=problems)),
            (self.reason, error_details_pb2.ErrorInfo(reason=self.reason, domain=DOMAIN)),
            (self.reason in LATER, _AFTER),
        ]
        status = status_pb2.Status(code=code_pb2.Code.Value(self.code), message=self.message)
        for is_there, detail in details:
            if is_there:
                status.details.add().Pack(detail)
        return status


class StatusRefused(Refused):
    """A refusal that comes from a worker as the message it is to become."""

    def __init__(self, status: status_pb2.Status) -> None:
        """Keep the message."""
        info = error_details_pb2.ErrorInfo()
        reasons = [info.reason for detail in status.details if detail.Unpack(info)]
        super().__init__(code_pb2.Code.Name(status.code), status.message, reason=next(iter(reasons), ""))
        self._status = status

    def status(self) -> status_pb2.Status:
        """Return it."""
        return self._status


def fitted(status: status_pb2.Status, most: int) -> status_pb2.Status:
    """Return as much of ``status`` as fits in so many bytes; among its details is how many entries of them do not.

    gRPC sends it behind the answer, and callers take some kilobytes there: of more they would hear nothing at all.
    """
    message = _clipped(status.message)
    if message == status.message and status.ByteSize() <= most:
        return status
    out = status_pb2.Status(code=status.code, message=message)
    lists: list[tuple[Any, str, Sequence[Any]]] = []
    for detail in status.details:
        found = next(((kind, field) for kind, field in _LISTS if detail.Is(kind.DESCRIPTOR)), None)
        if found is None:
            out.details.add().CopyFrom(detail)
        else:
            lists.append((*found, getattr(_unpacked(detail, found[0]), found[1])))
    whole = max((len(entries) for _, _, entries in lists), default=0)
    sizes = (
        sum(entries[number].ByteSize() + _ENTRY_BYTES for _, _, entries in lists if number < len(entries))
        for number in range(whole)
    )
    room = most - out.ByteSize() - _LEFT_OUT_BYTES
    kept = sum(1 for _ in takewhile(lambda used: used <= room, accumulate(sizes)))
    for kind, field, entries in lists if kept else ():
        out.details.add().Pack(kind(**{field: entries[:kept]}))
    if kept < whole:
        numbers = {"left_out": str(whole - kept), "kept": str(kept)}
        out.details.add().Pack(error_details_pb2.ErrorInfo(reason=LEFT_OUT, domain=DOMAIN, metadata=numbers))
    return out


def _unpacked(detail: any_pb2.Any, kind: Any) -> Any:
    made = kind()
    detail.Unpack(made)
    return made


def _clipped(message: str) -> str:
    """A message as long as it may be; of what is not ASCII, each byte travels as three."""
    sizes = (1 if " " <= each <= "~" else 3 * len(each.encode("utf-8", "replace")) for each in message)
    most = sum(1 for _ in takewhile(lambda size: size <= _LONGEST_MESSAGE, accumulate(sizes)))
    return message if most == len(message) else f"{message[:most]}…"


def unfit(fields: Sequence[FieldProblem]) -> Refused:
    """Return the refusal of a request with wrong fields."""
    listed = [f"{each.field}: {each.description}" for each in fields]
    more = [f"and {len(fields) - _LISTED} more"] if len(fields) > _LISTED else []
    return Refused("INVALID_ARGUMENT", "; ".join([*listed[:_LISTED], *more]), fields)


def too_much(field: str, description: str) -> Refused:
    """Return the refusal of a request that asks for more than is allowed."""
    return Refused(
        "RESOURCE_EXHAUSTED", f"{field}: {description}", [FieldProblem(field, description)], reason=TOO_LARGE
    )


def no_session(why: str, reason: str = SESSION_LOST) -> Refused:
    """Return the refusal of a call for a session that is not here."""
    message = f"{why}; open another session with the documents as they now stand"
    return Refused("FAILED_PRECONDITION", message, reason=reason)


def session_lost(why: str) -> Refused:
    """Return the end of a session whose worker is gone."""
    message = f"the session is lost: {why}; open another one with the model as it now stands"
    return Refused("ABORTED", message, reason=SESSION_LOST)
