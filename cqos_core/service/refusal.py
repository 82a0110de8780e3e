"""Why a call is not answered, in the words of google.rpc."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from google.protobuf import duration_pb2
from google.rpc import code_pb2, error_details_pb2, status_pb2

from cqos.v1 import report_pb2
from cqos_core.remote.messages import to_message
from cqos_core.remote.request_problems import FieldProblem

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.model.problems import Problem

DOMAIN: Final = "cqos"
SESSION_LOST: Final = "SESSION_LOST"
LEFT_OUT: Final = "DETAILS_LEFT_OUT"
TOO_LARGE: Final = "TOO_LARGE"
"""Sending it again gets the same answer."""
CALLER_QUOTA: Final = "CALLER_QUOTA"
"""The caller has too much under way; it may send it again when less is."""
BUSY: Final = "BUSY"
"""All callers together have; it may be sent again later."""
WORKER_LOST: Final = "WORKER_LOST"
"""A fault of the service; it may be sent again later."""
LATER: Final = {CALLER_QUOTA: 1.0, BUSY: 1.0, WORKER_LOST: 1.0}
"""Seconds after which a call that was refused for a reason may be sent again."""
_LISTS: Final = ((error_details_pb2.BadRequest, "field_violations"), (report_pb2.InputProblems, "problems"))
_LONGEST_MESSAGE: Final = 2048
"""As it travels."""
_ENTRY_BYTES: Final = 8
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
        self.code = code
        self.message = message
        self.fields = tuple(fields)
        self.documents = tuple(documents)
        self.reason = reason

    def status(self) -> status_pb2.Status:
        """Return all of it as one message."""
        status = status_pb2.Status(code=code_pb2.Code.Value(self.code), message=self.message)
        if self.fields:
            violations = [
                error_details_pb2.BadRequest.FieldViolation(field=each.field, description=each.description)
                for each in self.fields
            ]
            status.details.add().Pack(error_details_pb2.BadRequest(field_violations=violations))
        if self.documents:
            problems = [to_message(each, report_pb2.Problem) for each in self.documents]
            status.details.add().Pack(report_pb2.InputProblems(problems=problems))
        if self.reason:
            status.details.add().Pack(error_details_pb2.ErrorInfo(reason=self.reason, domain=DOMAIN))
            if self.reason in LATER:
                delay = duration_pb2.Duration(seconds=int(LATER[self.reason]))
                status.details.add().Pack(error_details_pb2.RetryInfo(retry_delay=delay))
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
        for kind, field in _LISTS:
            found: Any = kind()
            if detail.Unpack(found):
                lists.append((kind, field, getattr(found, field)))
                break
        else:
            out.details.add().CopyFrom(detail)
    whole = max((len(entries) for _, _, entries in lists), default=0)
    room, kept = most - out.ByteSize() - _LEFT_OUT_BYTES, 0
    for number in range(whole):
        room -= sum(entries[number].ByteSize() + _ENTRY_BYTES for _, _, entries in lists if number < len(entries))
        if room < 0:
            break
        kept += 1
    for kind, field, entries in lists:
        if kept:
            out.details.add().Pack(kind(**{field: entries[:kept]}))
    if kept < whole:
        left_out = error_details_pb2.ErrorInfo(
            reason=LEFT_OUT, domain=DOMAIN, metadata={"left_out": str(whole - kept), "kept": str(kept)}
        )
        out.details.add().Pack(left_out)
    return out


def _clipped(message: str) -> str:
    """A message as long as it may be; of what is not ASCII, each byte travels as three."""
    size = 0
    for at, character in enumerate(message):
        size += 1 if " " <= character <= "~" else 3 * len(character.encode("utf-8", "replace"))
        if size > _LONGEST_MESSAGE:
            return f"{message[:at]}…"
    return message


def unfit(fields: Sequence[FieldProblem]) -> Refused:
    """Return the refusal of a request with wrong fields."""
    listed = "; ".join(f"{each.field}: {each.description}" for each in fields[:3])
    more = f"; and {len(fields) - 3} more" if len(fields) > 3 else ""  # noqa: PLR2004
    return Refused("INVALID_ARGUMENT", listed + more, fields)


def too_much(field: str, description: str) -> Refused:
    """Return the refusal of a request that asks for more than is allowed."""
    return Refused(
        "RESOURCE_EXHAUSTED", f"{field}: {description}", [FieldProblem(field, description)], reason=TOO_LARGE
    )


def session_lost(why: str) -> Refused:
    """Return the end of a session whose worker is gone."""
    message = f"the session is lost: {why}; open another one with the model as it now stands"
    return Refused("ABORTED", message, reason=SESSION_LOST)
