"""Sessions of single calls in this process: their owners, sizes and timeouts."""

from __future__ import annotations

import asyncio
import logging
import secrets
import traceback
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Final

from cqos.v1 import session_pb2
from cqos_core.remote.asked import decode
from cqos_core.remote.refusal import SESSION_ELSEWHERE, Refused, no_session
from cqos_core.service.call_handlers import METHODS
from cqos_core.service.log_lines import log_event
from cqos_core.service.worker_process import CallFailedError, SessionLostError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Coroutine, Mapping

    from cqos_core.service.caller_quotas import Caller, Callers
    from cqos_core.service.session_host import HostedModel, SessionHost
    from cqos_core.service.telemetry import Meter

_CALL: Final = "/cqos.v1.SessionService/"
SESSIONS: Final[Mapping[str, tuple[Any, Any]]] = {
    f"{_CALL}OpenSession": (session_pb2.OpenSessionRequest, session_pb2.OpenSessionResponse),
    f"{_CALL}EditSession": (session_pb2.EditSessionRequest, session_pb2.EditSessionResponse),
    f"{_CALL}CloseSession": (session_pb2.CloseSessionRequest, session_pb2.CloseSessionResponse),
}
"""The calls that belong to a session, each with its request and response."""
REQUESTS: Final[Mapping[str, Any]] = {path: each.request for path, each in METHODS.items()} | {
    path: request for path, (request, _) in SESSIONS.items()
}
"""The request of every call of one message."""
_NAME_BYTES: Final = 18
_SHOWN: Final = 60


class _OpenSession:
    """One open session.

    Attributes:
        owner: the name of the caller that opened it.
        keep: sets how many bytes it holds.
        sizes: the bytes of each document, or of the model.
        held: releases its part of the caller's quota.
    """

    def __init__(self, model: HostedModel, owner: str, keep: Callable[[int], None], sizes: dict[str, int]) -> None:
        self.model, self.owner, self.keep, self.sizes = model, owner, keep, sizes
        self.held = ExitStack()
        self.turn = asyncio.Lock()
        self.ending: asyncio.TimerHandle | None = None


class OpenSessions:
    """Sessions by name. A name tells the process that has the session, and cannot be guessed."""

    def __init__(self, host: SessionHost, callers: Callers, meter: Meter, tokens: Container[str]) -> None:
        """Keep sessions in the processes of ``host``; a session of a caller with one of the ``tokens`` is private."""
        self._host, self._callers, self._meter, self._tokens = host, callers, meter, tokens
        self._process = secrets.token_hex(4)
        self._open: dict[str, _OpenSession] = {}
        self._running: set[asyncio.Task[Any]] = set()

    async def answer(self, caller: Caller, method: str, data: bytes, seconds: float) -> bytes:
        """Answer a call for a session.

        Raises:
            Refused: there is no such session here, or it is not opened.
            FailedError: a worker failed.
        """
        request = decode(SESSIONS[method][0], data)
        known = dict(zip(SESSIONS, (self._opened, self._edited, self._closed), strict=True))
        return await known[method](caller, request, data, seconds)

    async def _opened(self, caller: Caller, request: Any, data: bytes, seconds: float) -> bytes:
        name = f"{self._process}.{secrets.token_urlsafe(_NAME_BYTES)}"
        with ExitStack() as held:
            held.enter_context(self._callers.count_session(caller))
            keep = held.enter_context(self._callers.hold_session(caller))
            sizes = _sizes_of(request.documents) if request.HasField("documents") else {"": len(data)}
            keep(sum(sizes.values()))
            found = _OpenSession(self._host.begin_model(caller.name), caller.name, keep, sizes)
            try:
                answered = await found.model.open(data, seconds)
            except BaseException:
                self._later(_close_and_release(found.model, held.pop_all()))
                raise
            found.held = held.pop_all()
        self._open[name] = found
        self._meter.add("sessions")
        self._wait(name, found)
        idle = int(self._host.limits.idle_seconds)
        return answered + session_pb2.OpenSessionResponse(session=name, idle_seconds=idle).SerializeToString()

    async def _edited(self, caller: Caller, request: Any, data: bytes, seconds: float) -> bytes:
        """Edit a session; an edit that has begun is completed, also if nobody waits for its answer."""
        found = self._find(request.session, caller)
        begun = asyncio.Event()
        task = asyncio.ensure_future(self._done(found, request, data, begun))
        try:
            await asyncio.wait({task}, timeout=seconds)
        finally:
            if not begun.is_set():
                task.cancel()
            elif not task.done():
                self._abandon(task)
        if not task.done():
            more = ", and the session stays open" if begun.is_set() else ", and the edit is not done"
            raise Refused("DEADLINE_EXCEEDED", f"there is no answer: it took more than {seconds:g} seconds{more}")
        return task.result()

    async def _done(self, found: _OpenSession, request: Any, data: bytes, begun: asyncio.Event) -> bytes:
        async with found.turn:
            begun.set()
            if self._open.get(request.session) is not found:
                raise no_session("the session was closed meanwhile")
            self._wait(request.session, found)
            sizes = _sizes_after(found.sizes, request)
            found.keep(sum(sizes.values()))
            try:
                answered = await found.model.edit(data)
            except SessionLostError as error:
                await self._close(request.session)
                raise no_session(str(error)) from None
            if session_pb2.EditSessionResponse.FromString(answered).HasField("refusal"):
                found.keep(sum(found.sizes.values()))
            else:
                found.sizes = sizes
            return answered

    def _later(self, work: Coroutine[Any, Any, Any]) -> None:
        self._abandon(asyncio.ensure_future(work))

    def _abandon(self, task: asyncio.Task[Any]) -> None:
        """Let a task run on although no caller waits for it."""
        self._running.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[Any]) -> None:
        self._running.discard(task)
        error = None if task.cancelled() else task.exception()
        # Refusals and ended processes are expected; any other exception is a defect.
        if error is not None and not isinstance(error, (Refused, WorkerLostError, SessionLostError)):
            trace = str(error) if isinstance(error, CallFailedError) else "".join(traceback.format_exception(error))
            log_event(logging.ERROR, "internal error", traceback=trace)

    async def _closed(self, caller: Caller, request: Any, _data: bytes, _seconds: float) -> bytes:
        found = self._open.get(request.session)
        if found is not None and self._may_use(found, caller):
            await self._close(request.session)
        elif not request.session.startswith(f"{self._process}."):
            self._find(request.session, caller)
        return session_pb2.CloseSessionResponse(revision=request.revision).SerializeToString()

    def _find(self, name: str, caller: Caller) -> _OpenSession:
        found = self._open.get(name)
        if found is not None and self._may_use(found, caller):
            return found
        if name.startswith(f"{self._process}."):
            raise no_session("there is no such session any more: it was closed, idle for too long, or its worker ended")
        why = f"this process has no session `{name[:_SHOWN]}`" if name else "the name of a session is needed"
        raise no_session(why, SESSION_ELSEWHERE)

    def _may_use(self, found: _OpenSession, caller: Caller) -> bool:
        """Whether a caller may use a session: by its token if the owner has one, else by knowing the name."""
        return found.owner == caller.name or found.owner not in self._tokens

    def _wait(self, name: str, found: _OpenSession) -> None:
        """Restart the timeout after which an idle session is closed."""
        if found.ending is not None:
            found.ending.cancel()
        found.ending = asyncio.get_running_loop().call_later(self._host.limits.idle_seconds, self._forget, name)

    def _forget(self, name: str) -> None:
        self._later(self._close(name))

    async def _close(self, name: str) -> None:
        found = self._open.pop(name, None)
        if found is not None:
            self._meter.add("sessions", more=-1)
            if found.ending is not None:
                found.ending.cancel()
            found.held.close()
            await found.model.close()


async def _close_and_release(model: HostedModel, held: ExitStack) -> None:
    """Close an abandoned session, and then release its part of the caller's quota."""
    with held:
        await model.close()


def _sizes_of(documents: Any) -> dict[str, int]:
    """Return the bytes of documents by name; included files have a name that no document has."""
    sizes = {each.name: each.ByteSize() for each in documents.documents}
    return sizes | {"\0included": sum(each.ByteSize() for each in documents.included)}


def _sizes_after(sizes: dict[str, int], request: Any) -> dict[str, int]:
    if request.HasField("changes"):
        # The whole request is kept in memory.
        return sizes | {"": sizes.get("", 0) + request.ByteSize()}
    kept = {name: size for name, size in sizes.items() if name not in request.documents.removed}
    return kept | {each.name: each.ByteSize() for each in request.documents.put}
