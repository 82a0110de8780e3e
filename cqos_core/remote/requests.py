"""Requests to a service and what its answers mean, for both clients: files, pairs, credentials, errors."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import (
    TYPE_CHECKING,
    Any,
    Final,
    NamedTuple,
    TypeAlias,
)

import grpc
from google.protobuf import field_mask_pb2
from google.protobuf.message import DecodeError
from google.rpc import error_details_pb2, status_pb2

from cqos.v1 import (
    check_pb2,
    report_pb2,
    system_pb2,
)
from cqos_core.files.inputs import read
from cqos_core.files.source_files import open_file, read_path
from cqos_core.files.source_reader import GivenSource, included_files
from cqos_core.language.domains import SettingValue, as_text
from cqos_core.model.finding import Severity
from cqos_core.model.problems import CqosError, InputError, Problem
from cqos_core.model.source import Source, no_files
from cqos_core.model.system import System
from cqos_core.remote.messages import (
    from_message,
    pair_value,
    system_message,
)
from cqos_core.remote.request_problems import FieldProblem
from cqos_core.remote.tls import try_tls

if TYPE_CHECKING:
    from cqos_core.model.report import PairReport

File: TypeAlias = "str | os.PathLike[str] | bytes"
OptionValues: TypeAlias = "Mapping[str, Mapping[str, SettingValue]]"
Values: TypeAlias = "Mapping[str, SettingValue]"

TOKEN_VARIABLE: Final = "CQOS_TOKEN"  # noqa: S105 - its name
"""The environment variable that a token is taken from where none is given."""
AUTHORITY_VARIABLE: Final = "CQOS_SERVER_CA"
"""The environment variable that names the certificates to trust where none are given."""
CERTIFICATE_VARIABLES: Final = ("CQOS_CLIENT_CERT", "CQOS_CLIENT_KEY")
"""The environment variables that name one's own certificate and its private key where none are given and TLS is spoken."""
_SECURE: Final = "https://"
_PLAIN: Final = "http://"
_LOST: Final = "SESSION_LOST"
_RETRIES: Final = (
    '{"methodConfig": [{"name": [{"service": "cqos.v1.CheckService"}, {"service": "cqos.v1.CatalogueService"}], \
"retryPolicy": {"maxAttempts": 4, "initialBackoff": "0.1s", "maxBackoff": "1s", "backoffMultiplier": 2, \
"retryableStatusCodes": ["UNAVAILABLE", "CANCELLED"]}}]}'
)
_NONE: Final[Mapping[str, str]] = MappingProxyType({})
_ERROR_BYTES: Final = 32 * 1024
"""Of what is wrong with a request; in text it is a third more."""
_LEFT_OUT: Final = "DETAILS_LEFT_OUT"
OPTIONS: Final = (
    ("grpc.max_receive_message_length", -1),
    ("grpc.max_metadata_size", 2 * _ERROR_BYTES),
    ("grpc.absolute_max_metadata_size", 4 * _ERROR_BYTES),
    ("grpc.service_config", _RETRIES),
)


class ServiceError(CqosError):
    """The service did not answer, or refused to.

    Attributes:
        code: name of the gRPC status: ``UNAVAILABLE``, ``INVALID_ARGUMENT`` …
        fields: what is wrong with the request, where that is the reason.
        request_id: by which the service's log calls the call, where it failed.
        reason: for programs: ``TOO_LARGE`` (it is never answered), ``CALLER_QUOTA``, ``BUSY``, ``WORKER_LOST``, or empty.
        retry_after: seconds after which the call may be made again; None where that does not help.
    """

    def __init__(
        self,
        code: str,
        message: str,
        fields: Sequence[FieldProblem] = (),
        request_id: str = "",
        reason: str = "",
        retry_after: float | None = None,
    ) -> None:
        """Keep what a program may ask for."""
        super().__init__(f"the service answers {code}: {message}")
        self.code = code
        self.fields = tuple(fields)
        self.request_id = request_id
        self.reason = reason
        self.retry_after = retry_after


class SessionLostError(ServiceError):
    """The worker that the session lived in is gone: open another one with the system as it now stands."""


class Written(NamedTuple):
    """What `convert` wrote.

    Attributes:
        text: the whole file.
        expressed: how many endpoints, or topics, are in it.
        notes: what the form cannot say.
    """

    text: str
    expressed: int
    notes: tuple[str, ...]


class PairQuestion(NamedTuple):
    """One pair of `check_pairs`; the fields are those of `cqos_core.check_pair`."""

    protocol: str
    offered: Values = _NONE
    requested: Values = _NONE
    options: Values = _NONE
    topic: Values = _NONE


class PairRefusedError(CqosError):
    """One pair of `check_pairs` cannot be judged; the others can. It is among the answers, and never raised."""

    def __init__(self, fields: Sequence[FieldProblem]) -> None:
        """Keep what is wrong."""
        super().__init__("; ".join(f"{each.field}: {each.description}" for each in fields))
        self.fields = tuple(fields)


def asked_of_report(fields: Iterable[str], least_severe: str = "note") -> dict[str, Any]:
    """Return the fields of a request that say which part of a report its answer shall have."""
    asked: dict[str, Any] = {}
    if paths := list(fields):
        asked["fields"] = field_mask_pb2.FieldMask(paths=paths)
    if least_severe != Severity.NOTE:
        asked["least_severe"] = f"SEVERITY_{Severity(least_severe).upper()}"
    return asked


def _documents(
    files: Iterable[File], importer: str | None, protocol: str | None
) -> tuple[list[check_pb2.Document], list[check_pb2.Document]]:
    """Bring files along, and what they include: the service cannot read them.

    Raises:
        InputError: some or all are missing; with the mistakes of the others as well.
    """
    files = list(files)
    given: list[GivenSource] = []
    try:
        for each in files:
            if isinstance(each, bytes):
                number = sum(known.opener is no_files for known in given) + 1
                given.append(GivenSource(Source("<bytes>" if number == 1 else f"<bytes {number}>", each)))
            else:
                given.append(GivenSource(read_path(os.fspath(each)), open_file))
    except InputError:  # the library tells what is wrong with all of them
        read(*files, importer=importer, protocol=protocol)
        raise
    if not files:
        read()
    # Bytes have no folder, so that nothing is looked for where there are no files.
    named = any(each.opener is open_file for each in given)
    included = included_files(given, importer, protocol=protocol) if named else ()
    return [_document(each.source) for each in given], [_document(each) for each in included]


def _document(source: Source) -> check_pb2.Document:
    return check_pb2.Document(name=source.name, content=source.data)


def _texts(values: Values) -> dict[str, str]:
    return {name: as_text(value) for name, value in values.items()}


def pair_request(question: PairQuestion, revision: int = 0) -> check_pb2.CheckPairRequest:
    """Return the request to check one pair."""
    return check_pb2.CheckPairRequest(
        revision=revision,
        protocol=question.protocol,
        offered=_texts(question.offered),
        requested=_texts(question.requested),
        options=_texts(question.options),
        topic=_texts(question.topic),
    )


def input_fields(inputs: Sequence[File | System], protocol: str | None, options: OptionValues) -> dict[str, Any]:
    """Return the fields of a request that bring a system, or files."""
    system, files = split_inputs(inputs)
    if system is not None:
        return {"system": system_message(system)}
    return {"documents": check_pb2.Documents(**document_fields(files, None, protocol, options))}


def document_fields(
    files: Iterable[File], importer: str | None, protocol: str | None, options: OptionValues
) -> dict[str, Any]:
    """Return the fields of a message that bring files, and say how to read them.

    Raises:
        InputError: a file cannot be read.
    """
    documents, included = _documents(files, importer, protocol)
    stated = {pack: system_pb2.Options(settings=_texts(settings)) for pack, settings in options.items()}
    reading = check_pb2.Reading(importer=importer, protocol=protocol, options=stated)
    return {"documents": documents, "included": included, "reading": reading}


def split_inputs(inputs: Sequence[File | System]) -> tuple[System | None, list[File]]:
    """Tell one system from files; the two cannot be asked about together."""
    systems = [each for each in inputs if isinstance(each, System)]
    files = [each for each in inputs if not isinstance(each, System)]
    if len(systems) > 1 or (systems and files):
        raise TypeError("give one system, or files; `cqos_core.read` puts several together")
    return (systems[0] if systems else None), files


class Questions:
    """The requests of a stream of pairs; they keep an exception of the iterator, which gRPC swallows."""

    def __init__(self, questions: Iterable[PairQuestion]) -> None:
        self._questions = questions
        self._failure: Exception | None = None

    def __iter__(self) -> Iterator[check_pb2.CheckPairsRequest]:
        try:
            for number, question in enumerate(self._questions, 1):
                yield check_pb2.CheckPairsRequest(pair=pair_request(question, number))
        except Exception as error:  # noqa: BLE001 - it is raised where the answers are waited for
            self._failure = error

    def raise_if_failed(self) -> None:
        """Raise what was raised, after the answers to all before it."""
        if self._failure is not None:
            raise self._failure


def pair_answer(response: check_pb2.CheckPairsResponse) -> PairReport | PairRefusedError:
    """Return the answer to one pair of a stream."""
    if response.WhichOneof("outcome") == "refusal":
        return PairRefusedError(field_problems(response.refusal))
    return pair_value(response.report)


def field_problems(refusal: check_pb2.Refusal) -> list[FieldProblem]:
    """Return what is wrong with a request."""
    return [FieldProblem(each.field, each.description) for each in refusal.problems]


def raised(error: grpc.RpcError | grpc.aio.AioRpcError) -> CqosError:
    """Return what the library would have raised, or what went wrong on the way."""
    call: Any = error
    trailing = dict(call.trailing_metadata() or ())
    details, request_id = (trailing.get(name, b"") for name in ("grpc-status-details-bin", "x-request-id"))
    try:
        status = status_pb2.Status.FromString(details if isinstance(details, bytes) else b"")
    except DecodeError:  # of whatever stands between
        status = status_pb2.Status()
    problems, bad, infos, later = (_unpacked(status, kind) for kind in _DETAILS)
    reasons = {each.reason: each.metadata for each in infos}
    left_out = reasons.pop(_LEFT_OUT, {}).get("left_out")
    wrong = [from_message(each) for message in problems for each in message.problems]
    if wrong and left_out:
        wrong.append(Problem(wrong[-1].code, f"{left_out} more problems are not listed"))
    if wrong:
        return InputError(wrong)
    reason = next(iter(reasons), "")
    kind = SessionLostError if reason == _LOST else ServiceError
    return kind(
        call.code().name,
        call.details() or "",
        [FieldProblem(each.field, each.description) for message in bad for each in message.field_violations],
        request_id if isinstance(request_id, str) else "",
        reason,
        next((each.retry_delay.seconds + each.retry_delay.nanos / 1e9 for each in later), None),
    )


_DETAILS: Final[tuple[Any, ...]] = (
    report_pb2.InputProblems,
    error_details_pb2.BadRequest,
    error_details_pb2.ErrorInfo,
    error_details_pb2.RetryInfo,
)


def _unpacked(status: status_pb2.Status, kind: Any) -> list[Any]:
    made = (kind() for _ in status.details)
    return [message for message, detail in zip(made, status.details, strict=True) if detail.Unpack(message)]


def metadata(token: str | None) -> tuple[tuple[str, str], ...]:
    """Return the headers of each call.

    Raises:
        CqosError: no header can carry the token.
    """
    token = (os.environ.get(TOKEN_VARIABLE, "") if token is None else token).strip()
    if not (token.isascii() and token.isprintable()):
        raise CqosError("the token has characters other than printable ASCII, which no header can carry")
    taken = (("cqos-error-bytes", str(_ERROR_BYTES)),)
    return (*taken, ("authorization", f"Bearer {token}")) if token else taken


def target_of(address: str, authority: str | None, certificate: str | None, key: str | None) -> tuple[str, Any]:
    """Return where to connect, and the credentials for TLS if it is spoken."""
    authority = authority or os.environ.get(AUTHORITY_VARIABLE)
    secure = address.startswith(_SECURE) or authority is not None or certificate is not None
    target = address.removeprefix(_SECURE).removeprefix(_PLAIN).rstrip("/")
    if not target:
        raise CqosError(f"`{address}` is no address", "write host:port, for instance 127.0.0.1:50051")
    names = ("certificate", "key")
    if secure and certificate is None and key is None:
        names = CERTIFICATE_VARIABLES
        certificate, key = (os.environ.get(name) for name in names)
    try_tls(certificate, key, authority, names=(*names, "authority"))
    if not secure:
        return target, None

    files = (None if path is None else Path(path).read_bytes() for path in (authority, key, certificate))
    return target, grpc.ssl_channel_credentials(*files)
