"""The service as Python sees it: what the library answers, from another process. Results are the library's own values.

>>> from cqos_core.remote.client import Client
>>> with Client("127.0.0.1:50051") as client:           # doctest: +SKIP
...     client.check("system.yaml").verdict
"""

from __future__ import annotations

import asyncio
import itertools
import os
import queue
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from types import MappingProxyType
from typing import (
    TYPE_CHECKING,
    Any,
    Concatenate,
    Final,
    Generic,
    NamedTuple,
    ParamSpec,
    TypeAlias,
    TypeVar,
    overload,
)

import grpc
from google.protobuf.message import DecodeError
from google.rpc import error_details_pb2, status_pb2

from cqos.v1 import (
    catalogue_pb2,
    catalogue_pb2_grpc,
    check_pb2,
    check_pb2_grpc,
    report_pb2,
    session_pb2,
    session_pb2_grpc,
    system_pb2,
)
from cqos_core.api import read
from cqos_core.checking.pipeline import as_text, exact_places
from cqos_core.checking.session import Edits
from cqos_core.importers.source import Source, no_files
from cqos_core.inputs.files import open_file, read_path
from cqos_core.inputs.loading import Given, included_files
from cqos_core.model.problems import CqosError, InputError, Problem
from cqos_core.model.system import System
from cqos_core.model.tls import try_tls
from cqos_core.remote.messages import (
    FieldProblem,
    change_message,
    from_message,
    pair_value,
    report_value,
    system_message,
)

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator, Mapping, Sequence

    from typing_extensions import Self

    from cqos_core.analysis.differences import Diff
    from cqos_core.checking.pipeline import SettingValue
    from cqos_core.model.report import PairReport, Report

T = TypeVar("T")
P = ParamSpec("P")
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
_OPTIONS: Final = (
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


# --- questions and answers, whoever asks ---


def _document_request(
    files: Iterable[File], importer: str | None, protocol: str | None, options: OptionValues
) -> check_pb2.CheckDocumentRequest:
    documents, included = _documents(files, importer, protocol)
    reading = _reading(importer, protocol, options)
    return check_pb2.CheckDocumentRequest(documents=documents, included=included, reading=reading)


def _documents(
    files: Iterable[File], importer: str | None, protocol: str | None
) -> tuple[list[check_pb2.Document], list[check_pb2.Document]]:
    """Bring files along, and what they include: the service cannot read them.

    Raises:
        InputError: some are missing, or there are none; with what is wrong with the others as well.
    """
    files = list(files)
    given: list[Given] = []
    try:
        for each in files:
            if isinstance(each, bytes):
                number = sum(known.opener is no_files for known in given) + 1
                given.append(Given(Source("<bytes>" if number == 1 else f"<bytes {number}>", each)))
            else:
                given.append(Given(read_path(os.fspath(each)), open_file))
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


def _reading(importer: str | None, protocol: str | None, options: OptionValues) -> check_pb2.Reading:
    return check_pb2.Reading(
        importer=importer,
        protocol=protocol,
        options={pack: system_pb2.Options(settings=_texts(settings)) for pack, settings in options.items()},
    )


def _texts(values: Values) -> dict[str, str]:
    return {name: as_text(value) for name, value in values.items()}


def _pair_request(question: PairQuestion, revision: int = 0) -> check_pb2.CheckPairRequest:
    return check_pb2.CheckPairRequest(
        revision=revision,
        protocol=question.protocol,
        offered=_texts(question.offered),
        requested=_texts(question.requested),
        options=_texts(question.options),
        topic=_texts(question.topic),
    )


def _input(inputs: Sequence[File | System], protocol: str | None, options: OptionValues) -> dict[str, Any]:
    system, files = _parted(inputs)
    if system is not None:
        return {"system": system_message(system)}
    documents, included = _documents(files, None, protocol)
    reading = _reading(None, protocol, options)
    return {"documents": check_pb2.Documents(documents=documents, included=included, reading=reading)}


def _parted(inputs: Sequence[File | System]) -> tuple[System | None, list[File]]:
    """Tell one system from files; the two cannot be asked about together."""
    systems = [each for each in inputs if isinstance(each, System)]
    files = [each for each in inputs if not isinstance(each, System)]
    if len(systems) > 1 or (systems and files):
        raise TypeError("give one system, or files; `cqos_core.read` puts several together")
    return (systems[0] if systems else None), files


class _Questions:
    """The requests of a stream of pairs; gRPC would tell nobody what whoever makes the questions raises."""

    def __init__(self, questions: Iterable[PairQuestion]) -> None:
        self._questions = questions
        self._failure: Exception | None = None

    def __iter__(self) -> Iterator[check_pb2.CheckPairsRequest]:
        try:
            for number, question in enumerate(self._questions, 1):
                yield check_pb2.CheckPairsRequest(pair=_pair_request(question, number))
        except Exception as error:  # noqa: BLE001 - it is raised where the answers are waited for
            self._failure = error

    def raise_if_failed(self) -> None:
        """Raise what was raised, after the answers to all before it."""
        if self._failure is not None:
            raise self._failure


def _pair_answer(response: check_pb2.CheckPairsResponse) -> PairReport | PairRefusedError:
    if response.WhichOneof("outcome") == "refusal":
        return PairRefusedError(_fields(response.refusal))
    return pair_value(response.report)


def _fields(refusal: check_pb2.Refusal) -> list[FieldProblem]:
    return [FieldProblem(each.field, each.description) for each in refusal.problems]


def _raised(error: grpc.RpcError | grpc.aio.AioRpcError) -> CqosError:
    """Return what the library would have raised, or what went wrong on the way."""
    call: Any = error
    code = call.code().name
    trailing = dict(call.trailing_metadata() or ())
    fields: list[FieldProblem] = []
    details = trailing.get("grpc-status-details-bin", b"")
    try:
        status = status_pb2.Status.FromString(details if isinstance(details, bytes) else b"")
    except DecodeError:  # of whatever stands between
        status = status_pb2.Status()
    reason, left_out = "", ""
    retry = None
    wrong: list[Problem] = []
    for detail in status.details:
        problems, bad, info = report_pb2.InputProblems(), error_details_pb2.BadRequest(), error_details_pb2.ErrorInfo()
        later = error_details_pb2.RetryInfo()
        if detail.Unpack(problems):
            wrong += [from_message(each) for each in problems.problems]
        elif detail.Unpack(bad):
            fields += [FieldProblem(each.field, each.description) for each in bad.field_violations]
        elif detail.Unpack(info) and info.reason == _LEFT_OUT:
            left_out = info.metadata["left_out"]
        elif detail.Unpack(info):
            reason = info.reason
        elif detail.Unpack(later):
            retry = later.retry_delay.seconds + later.retry_delay.nanos / 1e9
    if wrong and left_out:
        wrong.append(Problem(wrong[-1].code, f"{left_out} more problems are not listed"))
    if wrong:
        return InputError(wrong)
    request_id = trailing.get("x-request-id", "")
    kind = SessionLostError if reason == _LOST else ServiceError
    request_id = request_id if isinstance(request_id, str) else ""
    return kind(code, call.details() or "", fields, request_id, reason, retry)


def _metadata(token: str | None) -> tuple[tuple[str, str], ...]:
    token = (os.environ.get(TOKEN_VARIABLE, "") if token is None else token).strip()
    if not (token.isascii() and token.isprintable()):
        raise CqosError("the token has characters other than printable ASCII, which no header can carry")
    taken = (("cqos-error-bytes", str(_ERROR_BYTES)),)
    return (*taken, ("authorization", f"Bearer {token}")) if token else taken


def _target(address: str, authority: str | None, certificate: str | None, key: str | None) -> tuple[str, Any]:
    """Return where to connect, and the credentials for TLS if it is spoken."""
    authority = authority or os.environ.get(AUTHORITY_VARIABLE)
    secure = address.startswith(_SECURE) or authority is not None or certificate is not None
    target = address.removeprefix(_SECURE).removeprefix(_PLAIN).rstrip("/")
    if not target:
        raise CqosError(f"`{address}` is no address: expected host:port, for instance 127.0.0.1:50051")
    names = ("certificate", "key")
    if secure and certificate is None and key is None:
        names = CERTIFICATE_VARIABLES
        certificate, key = (os.environ.get(name) for name in names)
    try_tls(certificate, key, authority, names=(*names, "authority"))
    if not secure:
        return target, None

    def content(path: str | None) -> bytes | None:
        return None if path is None else Path(path).read_bytes()

    return target, grpc.ssl_channel_credentials(content(authority), content(key), content(certificate))


# --- the calls, which both clients share ---


@dataclass(frozen=True, slots=True)
class _Call(Generic[T]):
    """A call of one message: the stub's method, the request, and what its answer becomes."""

    method: Any
    request: Any
    read: Callable[[Any], T]


class _call(Generic[P, T]):  # noqa: N801 - it decorates
    """Makes a method of both clients from one that returns the call: `Client` waits, `AsyncClient` returns an awaitable."""

    def __init__(self, build: Callable[Concatenate[Any, P], _Call[T]]) -> None:
        self._build = build

    @overload
    def __get__(self, client: Client, owner: type[Any]) -> Callable[P, T]: ...
    @overload
    def __get__(self, client: AsyncClient, owner: type[Any]) -> Callable[P, Awaitable[T]]: ...
    @overload
    def __get__(self, client: None, owner: type[Any]) -> Callable[Concatenate[Any, P], _Call[T]]: ...
    def __get__(self, client: Any, owner: type[Any]) -> Any:
        """Return the method of one client."""
        if client is None:
            return self._build

        @wraps(self._build)
        def ask(*arguments: P.args, **named: P.kwargs) -> Any:
            return client._ask(self._build(client, *arguments, **named))  # noqa: SLF001 - the two are one

        return ask


class _Service:
    """The calls of a service."""

    _channels: Any = grpc

    def __init__(
        self,
        address: str,
        *,
        token: str | None = None,
        authority: str | None = None,
        certificate: str | None = None,
        key: str | None = None,
        timeout: float = 30.0,
    ) -> None:
        """Connect to ``address``, when the first call is made.

        Args:
            address: ``host:port``, or ``https://host:port`` for TLS.
            token: bearer token; else that of the variable ``CQOS_TOKEN``.
            authority: path of the certificates to trust, which asks for TLS; else that of ``CQOS_SERVER_CA``; else
                those of the system.
            certificate: path of one's own certificate, where the service asks for one; else that of ``CQOS_CLIENT_CERT``.
            key: path of its private key; else that of ``CQOS_CLIENT_KEY``.
            timeout: seconds that one answer may take.
        """
        target, credentials = _target(address, authority, certificate, key)
        options = list(_OPTIONS)
        self._channel = (
            self._channels.insecure_channel(target, options)
            if credentials is None
            else self._channels.secure_channel(target, credentials, options)
        )
        self._checks: Any = check_pb2_grpc.CheckServiceStub(self._channel)
        self._catalogue: Any = catalogue_pb2_grpc.CatalogueServiceStub(self._channel)
        self._sessions: Any = session_pb2_grpc.SessionServiceStub(self._channel)
        self._given: dict[str, Any] = {"metadata": _metadata(token)}
        self._timeout = timeout

    @_call
    def check(
        self,
        *inputs: File | System,
        importer: str | None = None,
        protocol: str | None = None,
        options: OptionValues | None = None,
    ) -> _Call[Report]:
        """Check files, which are read here and understood there, or one system; see `cqos_core.check`.

        What files include is sent along; directories are not searched.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: there is no answer.
        """
        system, files = _parted(inputs)
        if system is None:
            request = _document_request(files, importer, protocol, options or {})
            return _Call(self._checks.CheckDocument, request, lambda response: report_value(response.report))
        if importer is not None or protocol is not None or options:
            raise TypeError("importer, protocol and options are for files; a system has its own")
        return self._check_system(system)

    @_call
    def check_system(self, system: System) -> _Call[Report]:
        """Check a system as it is.

        Raises:
            ServiceError: there is no answer.
        """
        return self._check_system(system)

    def _check_system(self, system: System) -> _Call[Report]:
        request = check_pb2.CheckSystemRequest(system=system_message(system))
        # Exact columns are found here, where the files are.
        return _Call(
            self._checks.CheckSystem,
            request,
            lambda response: exact_places(report_value(response.report), system.sources),
        )

    @_call
    def check_pair(
        self,
        protocol: str,
        offered: Values | None = None,
        requested: Values | None = None,
        options: Values | None = None,
        topic: Values | None = None,
    ) -> _Call[PairReport]:
        """Judge one offer against one request; see `cqos_core.check_pair`.

        Raises:
            ServiceError: there is no answer.
        """
        question = PairQuestion(protocol, offered or {}, requested or {}, options or {}, topic or {})
        return _Call(self._checks.CheckPair, _pair_request(question), lambda response: pair_value(response.report))

    @_call
    def explain(
        self,
        *inputs: File | System,
        publisher: str,
        subscriber: str,
        protocol: str | None = None,
        options: OptionValues | None = None,
    ) -> _Call[PairReport]:
        """Explain one pair of a system; see `cqos_core.explain`.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: there is no such endpoint, or no answer.
        """
        given = _input(inputs, protocol, options or {})
        request = check_pb2.ExplainRequest(publisher=publisher, subscriber=subscriber, **given)
        return _Call(self._checks.Explain, request, lambda response: pair_value(response.report))

    @_call
    def diff(
        self,
        a: File | System,
        b: File | System,
        *,
        protocol: str | None = None,
        options: OptionValues | None = None,
        topics: Sequence[str] = (),
        ignored: Sequence[str] = (),
    ) -> _Call[Diff]:
        """Compare two systems; see `cqos_core.diff`. Protocol and options are for files.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: there is no answer.
        """
        one, other = (check_pb2.DiffInput(**_input([each], protocol, options or {})) for each in (a, b))
        request = check_pb2.DiffRequest(a=one, b=other, topics=topics, ignored=ignored)
        return _Call(self._checks.Diff, request, lambda response: from_message(response.diff))

    @_call
    def convert(
        self,
        *inputs: File | System,
        to: str,
        settings: Mapping[str, str] | None = None,
        protocol: str | None = None,
        options: OptionValues | None = None,
    ) -> _Call[Written]:
        """Write a system in the form of an exporter, which ``settings`` belong to.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: there is no such form, or no answer.
        """
        given = _input(inputs, protocol, options or {})
        request = check_pb2.ConvertRequest(exporter=to, settings=settings, **given)
        return _Call(
            self._checks.Convert,
            request,
            lambda response: Written(response.text, response.expressed, tuple(response.notes)),
        )

    @_call
    def packs(self) -> _Call[catalogue_pb2.ListPacksResponse]:
        """Return the rule packs and formats that the service has.

        Raises:
            ServiceError: there is no answer.
        """
        return _Call(self._catalogue.ListPacks, catalogue_pb2.ListPacksRequest(), lambda response: response)

    @_call
    def rule(self, code: str) -> _Call[catalogue_pb2.GetRuleResponse]:
        """Return one rule by its code, and its pack.

        Raises:
            ServiceError: no pack has it, or there is no answer.
        """
        return _Call(self._catalogue.GetRule, catalogue_pb2.GetRuleRequest(code=code), lambda response: response)

    @_call
    def pack(self, pack_id: str) -> _Call[catalogue_pb2.Pack]:
        """Return one rule pack.

        Raises:
            ServiceError: the service has no pack of this id, or there is no answer.
        """
        request = catalogue_pb2.GetPackRequest(id=pack_id)
        return _Call(self._catalogue.GetPack, request, lambda response: response.pack)

    def _edit(self, *requests: Iterator[session_pb2.EditRequest]) -> Any:
        return self._sessions.Edit(*requests, **self._given)


# --- for programs that wait ---


class Client(_Service):
    """Asks a service; every call waits for its answer. Use it as a context manager, or `close` it."""

    def __enter__(self) -> Self:
        """Use it."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """End the connection."""
        self._channel.close()

    def _ask(self, call: _Call[T]) -> T:
        try:
            response = call.method(call.request, timeout=self._timeout, **self._given)
        except grpc.RpcError as error:
            raise _raised(error) from None
        return call.read(response)

    def check_pairs(self, questions: Iterable[PairQuestion]) -> Iterator[PairReport | PairRefusedError]:
        """Judge pair after pair over one stream, in order; a pair that cannot be judged is answered by its refusal.

        Raises:
            ServiceError: the stream ended.
        """
        requests = _Questions(questions)
        try:
            for response in self._checks.CheckPairs(iter(requests), **self._given):
                yield _pair_answer(response)
        except grpc.RpcError as error:
            raise _raised(error) from None
        requests.raise_if_failed()

    def session(self, system: System | None = None) -> RemoteSession:
        """Keep a system open for edits, as `cqos_core.Session` does. Use it as a context manager, or `close` it."""
        return RemoteSession(self, system or System())


class _Changes(Edits):
    """Collects the edits of a system, and follows the answers to them."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._sources = system.sources
        self._waiting: list[session_pb2.Change] = []
        self._told: Report | None = None
        self._revisions = itertools.count(1)
        self.judged = 0

    def edit(self, kind: str, value: Any) -> None:
        """Keep an edit for the next report."""
        self._waiting.append(change_message(kind, value))

    def _request(self) -> session_pb2.EditRequest:
        revision = next(self._revisions)
        if self._told is None:
            return session_pb2.EditRequest(revision=revision, open=system_message(self._system))
        waiting, self._waiting = self._waiting, []
        return session_pb2.EditRequest(revision=revision, changes=session_pb2.Changes(changes=waiting))

    def _followed(self, response: session_pb2.EditResponse) -> Report:
        """Return the report that an answer makes of the one before.

        Raises:
            ServiceError: the changes cannot be done, and none of them was.
        """
        kind = response.WhichOneof("outcome")
        if kind == "refusal":
            fields = _fields(response.refusal)
            told = "; ".join(f"{each.field}: {each.description}" for each in fields)
            raise ServiceError("INVALID_ARGUMENT", told, fields)
        self.judged = response.judged
        if kind == "report" or self._told is None:
            self._told = report_value(response.report)
        else:
            self._told = followed(self._told, response.delta)
        return exact_places(self._told, self._sources)


def followed(before: Report, delta: session_pb2.ReportDelta) -> Report:
    """Return the report that a delta makes of the one before."""
    return replace(
        report_value(delta.summary),
        groups=_placed(before.groups, delta.removed_groups, [(e.position, e.group) for e in delta.added_groups]),
        findings=_placed(
            before.findings, delta.removed_findings, [(e.position, e.finding) for e in delta.added_findings]
        ),
    )


def _placed(before: Sequence[Any], removed: Iterable[int], added: Iterable[tuple[int, Any]]) -> tuple[Any, ...]:
    gone = set(removed)
    kept = [each for position, each in enumerate(before) if position not in gone]
    for position, message in added:
        kept.insert(position, from_message(message))
    return tuple(kept)


class RemoteSession(_Changes):
    """A system kept open by the service: collect changes, then ask for the `report`."""

    def __init__(self, client: Client, system: System) -> None:
        """Open it, when the first report is asked for."""
        super().__init__(system)
        self._requests: queue.SimpleQueue[session_pb2.EditRequest | None] = queue.SimpleQueue()
        self._client = client
        self._stream: Any = None

    def __enter__(self) -> Self:
        """Use it."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """Let the service forget it."""
        self._requests.put(None)
        if self._stream is not None:
            self._stream.cancel()

    def report(self) -> Report:
        """Send what has changed since the last report, and return the report on the whole system.

        Raises:
            SessionLostError: the service no longer has the system.
            ServiceError: the changes cannot be done, and none of them was; or there is no answer.
        """
        first = self._told is None
        report = self._exchange()
        # What was changed before it was opened is changed now.
        return self._exchange() if first and self._waiting else report

    def _exchange(self) -> Report:
        if self._stream is None:
            self._stream = self._client._edit(iter(self._requests.get, None))  # noqa: SLF001 - the two are one
        self._requests.put(self._request())
        try:
            return self._followed(next(self._stream))
        except StopIteration:
            raise SessionLostError("ABORTED", "the stream has ended") from None
        except grpc.RpcError as error:
            raise _raised(error) from None


# --- for programs that do something else meanwhile ---


class AsyncClient(_Service):
    """Asks a service from a running event loop; see `Client`. Use it as an async context manager, or `close` it."""

    _channels = grpc.aio

    async def __aenter__(self) -> Self:
        """Use it."""
        return self

    async def __aexit__(self, *error: object) -> None:
        """Close it."""
        await self.close()

    async def close(self) -> None:
        """End the connection."""
        await self._channel.close()

    async def _ask(self, call: _Call[T]) -> T:
        try:
            response = await call.method(call.request, timeout=self._timeout, **self._given)
        except grpc.aio.AioRpcError as error:
            raise _raised(error) from None
        return call.read(response)

    async def check_pairs(self, questions: Iterable[PairQuestion]) -> AsyncIterator[PairReport | PairRefusedError]:
        """Judge pair after pair over one stream; see `Client.check_pairs`."""
        requests = _Questions(questions)
        try:
            async for response in self._checks.CheckPairs(iter(requests), **self._given):
                yield _pair_answer(response)
        except grpc.aio.AioRpcError as error:
            raise _raised(error) from None
        requests.raise_if_failed()

    def session(self, system: System | None = None) -> AsyncSession:
        """Keep a system open for edits; see `Client.session`."""
        return AsyncSession(self, system or System())


class AsyncSession(_Changes):
    """A system kept open by the service; see `RemoteSession`."""

    def __init__(self, client: AsyncClient, system: System) -> None:
        """Open it, when the first report is asked for."""
        super().__init__(system)
        self._client = client
        self._stream: Any = None

    async def __aenter__(self) -> Self:
        """Use it."""
        return self

    async def __aexit__(self, *error: object) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """Let the service forget it."""
        if self._stream is not None:
            self._stream.cancel()

    async def report(self) -> Report:
        """Send what has changed, and return the report on the whole system; see `RemoteSession.report`."""
        if self._stream is None:
            self._stream = self._client._edit()  # noqa: SLF001 - the two are one
        while True:
            first = self._told is None
            try:
                await self._stream.write(self._request())
                response = await self._stream.read()
                if response is grpc.aio.EOF:
                    # The status says why; asking for it raises nothing.
                    raise SessionLostError((await self._stream.code()).name, await self._stream.details())
            except grpc.aio.AioRpcError as error:
                raise _raised(error) from None
            except asyncio.InvalidStateError:  # it was closed, or one who waited was cancelled
                raise SessionLostError("ABORTED", "the stream has ended") from None
            report = self._followed(response)
            if not (first and self._waiting):
                return report
