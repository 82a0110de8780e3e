"""Sessions: systems that a service keeps open for edits."""

from __future__ import annotations

import asyncio
import itertools
import queue
from contextlib import AbstractAsyncContextManager, AbstractContextManager
from dataclasses import replace
from typing import (
    TYPE_CHECKING,
    Any,
)

import grpc

from cqos.v1 import (
    session_pb2,
)
from cqos_core.checking.system_editor import SystemEditor
from cqos_core.model.exact_columns import with_exact_columns
from cqos_core.remote.messages import (
    change_message,
    from_message,
    report_value,
    system_message,
)
from cqos_core.remote.requests import ServiceError, SessionLostError, field_problems, raised

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.model.report import Report
    from cqos_core.model.system import System


class _Changes(SystemEditor):
    """Collects the edits of a system, and follows the answers to them."""

    def __init__(self, client: Any, system: System) -> None:
        """Open it, when the first report is asked for."""
        self._client, self._system = client, system
        self._stream: Any = None
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
            fields = field_problems(response.refusal)
            message = "; ".join(f"{each.field}: {each.description}" for each in fields)
            raise ServiceError("INVALID_ARGUMENT", message, fields)
        self.judged = response.judged
        if kind == "report" or self._told is None:
            self._told = report_value(response.report)
        else:
            self._told = followed(self._told, response.delta)
        return with_exact_columns(self._told, self._system.sources)


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


class RemoteSession(_Changes, AbstractContextManager["RemoteSession"]):
    """A system kept open by the service: collect changes, then ask for the `report`."""

    def __init__(self, client: Any, system: System) -> None:
        """Open it, when the first report is asked for."""
        super().__init__(client, system)
        self._requests: queue.SimpleQueue[session_pb2.EditRequest | None] = queue.SimpleQueue()

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """Let the service forget it."""
        self._requests.put(None)
        # grpcio takes a lock when it forgets a stream. At the end of the program the thread that has it may be gone.
        stream, self._stream = self._stream, iter(())
        if isinstance(stream, grpc.Call):
            stream.cancel()

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
            raise raised(error) from None


class AsyncSession(_Changes, AbstractAsyncContextManager["AsyncSession"]):
    """A system kept open by the service; see `RemoteSession`."""

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
                raise raised(error) from None
            except asyncio.InvalidStateError:  # it was closed, or one who waited was cancelled
                raise SessionLostError("ABORTED", "the stream has ended") from None
            report = self._followed(response)
            if not (first and self._waiting):
                return report
