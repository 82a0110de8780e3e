"""What requests ask for: their messages, the fields of the answer, and what answers of several calls have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from google.protobuf import json_format
from google.protobuf.message import DecodeError, Message

from cqos.v1 import check_pb2, report_pb2, session_pb2
from cqos_core.model.caches import keep
from cqos_core.model.finding import Severity
from cqos_core.remote.messages import EVERYTHING, report_message, to_message, unknown_paths
from cqos_core.remote.refusal import Refused, too_much, unfit
from cqos_core.remote.request_problems import FieldProblem

if TYPE_CHECKING:
    from cqos_core.model.report import PairReport, Report

_MOST_PATHS: Final = 100
_MOST_OF_A_BYTE: Final = 8
"""Bytes that reading one byte of a message takes, in messages of many small parts."""
_SEVERITIES: Final[Mapping[int, Severity]] = {
    report_pb2.SEVERITY_ERROR: Severity.ERROR,
    report_pb2.SEVERITY_WARNING: Severity.WARNING,
}


def decode_json(kind: Any, data: bytes) -> Any:
    """Read a request from JSON; fields that a newer caller knows are passed over, as in the binary form.

    Raises:
        Refused: ``data`` is none.
    """
    refused = f"the request is no {kind.DESCRIPTOR.full_name}"
    if not data.lstrip().startswith(b"{"):  # what else is JSON is read as a message of some kind
        found = "something else" if data else "nothing"
        raise Refused("INVALID_ARGUMENT", f"{refused}: expected a JSON object, found {found}")
    try:
        return json_format.Parse(data, kind(), ignore_unknown_fields=True)
    except (json_format.ParseError, UnicodeDecodeError, RecursionError) as error:
        raise Refused("INVALID_ARGUMENT", f"{refused}: {error}") from None


def decode(kind: Any, data: bytes) -> Any:
    """Read a message.

    Raises:
        Refused: ``data`` is none of this kind.
    """
    try:
        return kind.FromString(data)
    except DecodeError as error:
        if "alloc failed" in str(error):  # there is nothing wrong with the message
            raise MemoryError from None
        # Protobuf before 7 gives no reason. Where there is not so much memory, this raises MemoryError.
        if str(error).endswith("'"):
            bytearray(_MOST_OF_A_BYTE * len(data))
        name = kind.DESCRIPTOR.full_name
        message = f"the request is no {name}: it cannot be decoded, or a text in it is not UTF-8"
        raise Refused("INVALID_ARGUMENT", message) from None


def reported(
    report: Report, paths: frozenset[str] = EVERYTHING, least_severe: Severity = Severity.NOTE
) -> report_pb2.Report:
    """Return the message of a report, with the versions of what judged."""
    from cqos_core.remote.catalogue import versions

    message = report_message(report, paths, least_severe)
    if not paths or "versions" in paths:
        message.versions.update(versions())
    return message


def write_pair(
    message: report_pb2.PairReport, report: PairReport, paths: frozenset[str] = EVERYTHING
) -> report_pb2.PairReport:
    """Write a report on one pair into its message, which is empty, and return that.

    Its lines and guarantees are mostly those of other pairs, and written once. To copy a report takes longer than to read it.
    """
    parts = [to_message(report, report_pb2.PairReport, paths or _OF_ONE_PAIR).SerializeToString()]
    for name in () if paths else _OF_MANY:
        for each in getattr(report, name):
            known = _PARTS.get(id(each))
            # It is kept with its bytes, so that no other one gets its identity.
            parts.append(known[1] if known is not None and known[0] is each else _part(name, each))
    message.SetInParent()
    message.MergeFromString(b"".join(parts))
    return message


_OF_MANY: Final = {"policies": report_pb2.PolicyComparison, "guarantees": report_pb2.Guarantee}
_OF_ONE_PAIR: Final = frozenset(report_pb2.PairReport.DESCRIPTOR.fields_by_name).difference(_OF_MANY)
_MOST_BYTES: Final = 4_096
_PARTS: Final[dict[int, tuple[object, bytes]]] = {}


def _part(name: str, value: object) -> bytes:
    """Return the bytes of a message that has one item of one field, and remember them."""
    whole: Any = report_pb2.PairReport
    data: bytes = whole(**{name: [to_message(value, _OF_MANY[name])]}).SerializeToString()
    if len(data) <= _MOST_BYTES:
        keep(_PARTS, id(value), (value, data))
    return data


def paths_of(request: Any, kind: type[Message], path: str = "") -> frozenset[str]:
    """Return the fields that an answer of ``kind`` shall have.

    Raises:
        Refused: there is no such field.
    """
    paths = tuple(request.fields.paths) if request.HasField("fields") else ()
    if len(paths) > _MOST_PATHS:
        raise too_much(f"{path}fields", f"it has {len(paths)} paths, at most {_MOST_PATHS} are read")
    wrong = [
        FieldProblem(f"{path}fields", f"`{each[:60]}`: no field `{part[:60]}`; there are {', '.join(known) or 'none'}")
        for each, part, known in unknown_paths(kind, paths)
    ]
    if wrong:
        raise unfit(wrong)
    return frozenset(paths)


def least_severe(
    request: check_pb2.CheckDocumentRequest | check_pb2.CheckSystemRequest | session_pb2.OpenSessionRequest,
) -> Severity:
    """Return the least severity of the findings that an answer shall have."""
    return _SEVERITIES.get(request.least_severe, Severity.NOTE)


def refusal_message(fields: Sequence[FieldProblem]) -> check_pb2.Refusal:
    """Return what is wrong as part of an answer."""
    return check_pb2.Refusal(
        problems=[check_pb2.FieldProblem(field=each.field, description=each.description) for each in fields]
    )
