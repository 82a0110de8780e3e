"""The service as Python sees it: what the library answers, from another process. Results are the library's own values.

>>> from cqos_core.remote.client import Client
>>> with Client("127.0.0.1:50051") as client:           # doctest: +SKIP
...     client.check("system.yaml").verdict
"""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager, AbstractContextManager
from functools import wraps
from typing import (
    TYPE_CHECKING,
    Any,
    Concatenate,
    Generic,
    ParamSpec,
    TypeVar,
    overload,
)

import grpc

from cqos.v1 import (
    catalogue_pb2,
    catalogue_pb2_grpc,
    check_pb2,
    check_pb2_grpc,
    plan_pb2,
    session_pb2,
    session_pb2_grpc,
)
from cqos_core.model.dataclass import dataclass
from cqos_core.model.exact_columns import with_exact_columns
from cqos_core.model.system import System
from cqos_core.remote.description import Description
from cqos_core.remote.messages import (
    from_message,
    pair_value,
    report_value,
    system_message,
)
from cqos_core.remote.requests import (
    OPTIONS,
    PairQuestion,
    PairRefusedError,
    Questions,
    ServiceError,
    SessionLostError,
    Written,
    asked_of_report,
    document_fields,
    input_fields,
    metadata,
    pair_answer,
    pair_request,
    raised,
    split_inputs,
    target_of,
)
from cqos_core.remote.sessions import AsyncSession, RemoteSession

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.model.report import PairReport, Report
    from cqos_core.model.system_diff import Diff
    from cqos_core.remote.requests import File, OptionValues, Values

__all__ = [
    "AsyncClient",
    "AsyncSession",
    "Client",
    "PairQuestion",
    "PairRefusedError",
    "RemoteSession",
    "ServiceError",
    "SessionLostError",
    "Written",
]

T = TypeVar("T")
P = ParamSpec("P")


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
        target, credentials = target_of(address, authority, certificate, key)
        options = list(OPTIONS)
        self._channel = (
            self._channels.insecure_channel(target, options)
            if credentials is None
            else self._channels.secure_channel(target, credentials, options)
        )
        self._checks: Any = check_pb2_grpc.CheckServiceStub(self._channel)
        self._catalogue: Any = catalogue_pb2_grpc.CatalogueServiceStub(self._channel)
        self._sessions: Any = session_pb2_grpc.SessionServiceStub(self._channel)
        self._given: dict[str, Any] = {"metadata": metadata(token)}
        self._timeout = timeout

    @_call
    def check(
        self,
        *inputs: File | System,
        importer: str | None = None,
        protocol: str | None = None,
        options: OptionValues | None = None,
        fields: Sequence[str] = (),
        least_severe: str = "note",
    ) -> _Call[Report]:
        """Check files, which are read here and understood there, or one system; see `cqos_core.check`.

        What files include is sent along; directories are not searched.

        Args:
            inputs: files, or one system.
            importer: what reads the files; detected if None.
            protocol: rule pack of participants that state none.
            options: by rule pack.
            fields: the fields of the report to compute and send, as in the contract: ``findings.code``; the report then has
                nothing in the others. All if empty.
            least_severe: ``error``, ``warning`` or ``note``: findings that are less severe are not sent. The verdict is
                that of all.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: there is no answer.
        """
        system, files = split_inputs(inputs)
        if system is None:
            asked = asked_of_report(fields, least_severe)
            request = check_pb2.CheckDocumentRequest(
                **document_fields(files, importer, protocol, options or {}), **asked
            )
            return _Call(self._checks.CheckDocument, request, lambda response: report_value(response.report))
        if importer is not None or protocol is not None or options:
            raise TypeError("importer, protocol and options are for files; a system has its own")
        return self._check_system(system, fields, least_severe)

    @_call
    def check_system(self, system: System, *, fields: Sequence[str] = (), least_severe: str = "note") -> _Call[Report]:
        """Check a system as it is; ``fields`` and ``least_severe`` are those of `check`.

        Raises:
            ServiceError: there is no answer.
        """
        return self._check_system(system, fields, least_severe)

    def _check_system(self, system: System, fields: Sequence[str], least_severe: str) -> _Call[Report]:
        asked = asked_of_report(fields, least_severe)
        request = check_pb2.CheckSystemRequest(system=system_message(system), **asked)
        # Exact columns are found here, where the files are.
        return _Call(
            self._checks.CheckSystem,
            request,
            lambda response: with_exact_columns(report_value(response.report), system.sources),
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
        return _Call(self._checks.CheckPair, pair_request(question), lambda response: pair_value(response.report))

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
        given = input_fields(inputs, protocol, options or {})
        request = check_pb2.ExplainRequest(publisher=publisher, subscriber=subscriber, **given)
        return _Call(self._checks.Explain, request, lambda response: pair_value(response.report))

    @_call
    def describe(
        self, *inputs: File | System, protocol: str | None = None, options: OptionValues | None = None
    ) -> _Call[Description]:
        """Describe the endpoints of a system: where they stand, and their values with the origin of each.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: there is no answer.
        """
        request = check_pb2.DescribeRequest(**input_fields(inputs, protocol, options or {}))
        return _Call(self._checks.Describe, request, _description)

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
        one, other = (check_pb2.DiffInput(**input_fields([each], protocol, options or {})) for each in (a, b))
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
        given = input_fields(inputs, protocol, options or {})
        request = check_pb2.ConvertRequest(exporter=to, settings=settings, **given)
        return _Call(
            self._checks.Convert,
            request,
            lambda response: Written(response.text, response.expressed, tuple(response.notes)),
        )

    @_call
    def suggest(
        self,
        *files: File,
        importer: str | None = None,
        protocol: str | None = None,
        options: OptionValues | None = None,
    ) -> _Call[plan_pb2.Plan]:
        """Return the weakest settings that meet all requirements; see `cqos_core.suggest`.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: the service has no solver, or there is no answer.
        """
        documents = check_pb2.Documents(**document_fields(files, importer, protocol, options or {}))
        request = check_pb2.SuggestRequest(documents=documents)
        return _Call(self._checks.Suggest, request, lambda response: response.plan)

    @_call
    def repair(
        self,
        *files: File,
        keep: Sequence[str] = (),
        decide: bool = False,
        importer: str | None = None,
        protocol: str | None = None,
        options: OptionValues | None = None,
    ) -> _Call[plan_pb2.Plan]:
        """Return the smallest repair; see `cqos_core.repair`.

        Raises:
            InputError: a file cannot be read or understood.
            ServiceError: the service has no solver, or there is no answer.
        """
        documents = check_pb2.Documents(**document_fields(files, importer, protocol, options or {}))
        request = check_pb2.RepairRequest(documents=documents, keep=keep, decide=decide)
        return _Call(self._checks.Repair, request, lambda response: response.plan)

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


def _description(response: check_pb2.DescribeResponse) -> Description:
    endpoints = tuple(map(from_message, response.endpoints))
    return Description(response.system, endpoints, tuple(map(from_message, response.participants)))


# --- for programs that wait ---


class Client(_Service, AbstractContextManager["Client"]):
    """Asks a service; every call waits for its answer. Use it as a context manager, or `close` it."""

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
            raise raised(error) from None
        return call.read(response)

    def check_pairs(self, questions: Iterable[PairQuestion]) -> Iterator[PairReport | PairRefusedError]:
        """Judge pair after pair over one stream, in order; a pair that cannot be judged is answered by its refusal.

        Raises:
            ServiceError: the stream ended.
        """
        requests = Questions(questions)
        try:
            for response in self._checks.CheckPairs(iter(requests), **self._given):
                yield pair_answer(response)
        except grpc.RpcError as error:
            raise raised(error) from None
        requests.raise_if_failed()

    def session(self, system: System | None = None) -> RemoteSession:
        """Keep a system open for edits, as `cqos_core.Session` does. Use it as a context manager, or `close` it."""
        return RemoteSession(self, system or System())


# --- for programs that do something else meanwhile ---


class AsyncClient(_Service, AbstractAsyncContextManager["AsyncClient"]):
    """Asks a service from a running event loop; see `Client`. Use it as an async context manager, or `close` it."""

    _channels = grpc.aio

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
            raise raised(error) from None
        return call.read(response)

    async def check_pairs(self, questions: Iterable[PairQuestion]) -> AsyncIterator[PairReport | PairRefusedError]:
        """Judge pair after pair over one stream; see `Client.check_pairs`."""
        requests = Questions(questions)
        try:
            async for response in self._checks.CheckPairs(iter(requests), **self._given):
                yield pair_answer(response)
        except grpc.aio.AioRpcError as error:
            raise raised(error) from None
        requests.raise_if_failed()

    def session(self, system: System | None = None) -> AsyncSession:
        """Keep a system open for edits; see `Client.session`."""
        return AsyncSession(self, system or System())
