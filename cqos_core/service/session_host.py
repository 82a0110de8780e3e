"""Hosts sessions in worker processes, and moves them to another process if theirs is busy or lost."""

from __future__ import annotations

import asyncio
import itertools
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from cqos_core.remote.refusal import BUSY, Refused, session_lost
from cqos_core.service import worker_frames
from cqos_core.service.fair_scheduler import FairPool
from cqos_core.service.model_copies import ModelCopy
from cqos_core.service.worker_process import (
    CallFailedError,
    SessionLostError,
    WorkerDiedError,
    WorkerLostError,
    WorkerMemoryError,
    WorkerProcess,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from cqos_core.service.caller_quotas import Caller, SharedBytes
    from cqos_core.service.settings import Limits


_PATIENCE_SECONDS: Final = 1.0
"""How long an edit waits for those of other callers before its session moves to another process."""

_MOST_KEPT: Final = 1_000


async def _within(seconds: float, answer: Coroutine[Any, Any, bytes]) -> bytes:
    """Return an answer within ``seconds``. Its work goes on, because other sessions share the process.

    Raises:
        Refused: it took longer.
    """
    task = asyncio.ensure_future(answer)
    try:
        done, _ = await asyncio.wait({task}, timeout=seconds)
    except asyncio.CancelledError:
        task.cancel()
        raise
    if not done:
        task.cancel()
        raise Refused("DEADLINE_EXCEEDED", f"there is no answer: it took more than {seconds:g} seconds")
    return task.result()


class _SessionProcess:
    """A worker process with sessions.

    Attributes:
        sessions: the caller of each open session, by number.
        guests: the same, with sessions that are being opened.
    """

    def __init__(self, limits: Limits) -> None:
        self.process = WorkerProcess(limits)
        self.turns = FairPool([self.process], WorkerProcess.start)
        self.sessions: dict[int, str] = {}
        self.guests: dict[int, str] = {}


class SessionHost:
    """Worker processes, and the sessions in them.

    The messages of a session are kept within limits, so that it can continue in another process if its own is busy or lost.
    """

    def __init__(self, limits: Limits, copies: SharedBytes, lost: Callable[[str], None] = lambda _why: None) -> None:
        """Take the limits, and the room for kept messages."""
        self.limits = limits
        self.copies = copies
        self.lost = lost
        self._homes = [_SessionProcess(limits) for _ in range(limits.session_workers)]
        self._next = itertools.count(1)
        self._open = 0
        self._leaving: set[asyncio.Task[None]] = set()

    async def warm(self) -> None:
        """Start one process ahead of the first session."""
        await self._homes[0].process.start()

    async def begin(self, caller: Caller) -> HostedSession:
        """Return a new session in the process with the fewest.

        Raises:
            Refused: there are too many.
        """
        self._count()
        return HostedSession(self, next(self._next), caller)

    def begin_model(self, caller: str) -> HostedModel:
        """Return a new session of single calls in the process with the fewest.

        Raises:
            Refused: there are too many.
        """
        self._count()
        return HostedModel(self, next(self._next), caller)

    def _count(self) -> None:
        if self._open >= self.limits.sessions:
            limit = f"{self.limits.sessions} sessions are open already; try again later"
            raise Refused("RESOURCE_EXHAUSTED", limit, reason=BUSY)
        self._open += 1

    def ended(self) -> None:
        """Note that a session is closed."""
        self._open -= 1

    def home_for(self, caller: str, number: int, before: _SessionProcess | None = None) -> _SessionProcess:
        """Return the process for a session: the one with the fewest, and not ``before``. One caller may use all but one."""
        if before is not None:
            before.guests.pop(number, None)
        own = [each for each in self._homes if caller in each.guests.values()]
        free = own if len(own) >= max(len(self._homes) - 1, 1) else self._homes
        candidates = [each for each in free if each is not before] or [
            each for each in self._homes if each is not before
        ]
        home = min(candidates or self._homes, key=lambda each: len(each.guests))
        home.guests[number] = caller
        return home

    def move(self, before: _SessionProcess, caller: str, number: int) -> _SessionProcess:
        """Move a session to another process; it is closed in the former one when that is free."""
        home = self.home_for(caller, number, before)
        if home is not before and before.sessions.pop(number, None) is not None:
            leaving = asyncio.ensure_future(self.leave(before, caller, number))
            self._leaving.add(leaving)
            leaving.add_done_callback(self._leaving.discard)
        return home

    async def leave(self, home: _SessionProcess, caller: str, number: int) -> None:
        """Close a session in a process."""
        frame = worker_frames.Frame(worker_frames.CLOSE_SESSION, number, b"")
        with suppress(WorkerLostError, CallFailedError, Refused):  # a process that ended has no sessions
            await home.turns.use(caller, lambda process: process.call(frame, self.limits.seconds))

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.process.close() for each in self._homes))


class HostedModel:
    """A session of single calls in a worker process. Its documents are kept, so that it can move to another process."""

    def __init__(self, host: SessionHost, number: int, caller: str) -> None:
        """Choose a process of ``host``."""
        self._host, self._number, self._caller = host, number, caller
        self._home = host.home_for(caller, number)
        self._copy: ModelCopy | None = None
        self._opening = self._closed = False

    async def open(self, data: bytes, seconds: float) -> bytes:
        """Open the session, within ``seconds``.

        Raises:
            Refused: it is not opened.
            FailedError: that failed.
        """

        async def opened(process: WorkerProcess) -> bytes:
            self._opening = True
            try:
                answered = await process.call(
                    worker_frames.Frame(worker_frames.OPEN_MODEL, self._number, data), self._host.limits.seconds
                )
            except WorkerLostError as error:
                self._lost(self._home, error)
                raise
            finally:
                self._opening = False
            self._home.sessions[self._number] = self._caller
            self._copy = ModelCopy(data)
            if self._closed:  # its caller did not wait
                await self._forgotten(process, self._home)
            return answered

        try:
            return await _within(seconds, self._home.turns.use(self._caller, opened))
        except WorkerLostError as error:
            raise error.refused from None

    async def edit(self, data: bytes) -> bytes:
        """Answer an edit.

        Raises:
            SessionGoneError: the session is lost.
            FailedError: it failed.
        """
        try:
            return await self._somewhere(data)
        except WorkerLostError as error:
            raise SessionLostError(f"the session is lost: {error}") from None

    async def _somewhere(self, data: bytes) -> bytes:
        """Return the answer of its process; if that is busy or dies, that of another one, once."""
        try:
            return await self._answered(data, _PATIENCE_SECONDS)
        except asyncio.TimeoutError:
            self._home = self._host.move(self._home, self._caller, self._number)
        except WorkerDiedError:
            pass
        return await self._answered(data, None)

    async def _answered(self, data: bytes, patience: float | None) -> bytes:
        home = self._home
        return await home.turns.use(self._caller, lambda process: self._edited(home, process, data), patience)

    async def _edited(self, home: _SessionProcess, process: WorkerProcess, data: bytes) -> bytes:
        copy, seconds = self._copy, self._host.limits.seconds
        assert copy is not None  # noqa: S101 - it is open
        try:
            if self._number not in home.sessions:
                for kind, message in copy.frames():
                    await process.call(worker_frames.Frame(kind, self._number, message), seconds)
                home.sessions[self._number] = self._caller
            answered = await process.call(worker_frames.Frame(worker_frames.EDIT_SESSION, self._number, data), seconds)
        except WorkerLostError as error:
            self._lost(home, error)
            raise
        copy.follow(data, answered)
        return answered

    def _lost(self, home: _SessionProcess, error: WorkerLostError) -> None:
        """Record that a process is lost; its sessions continue in other processes."""
        self._host.lost(str(error))
        home.sessions.clear()

    async def _forgotten(self, process: WorkerProcess, home: _SessionProcess) -> None:
        if home.sessions.pop(self._number, None) is not None:
            frame = worker_frames.Frame(worker_frames.CLOSE_SESSION, self._number, b"")
            with suppress(WorkerLostError, CallFailedError, Refused):
                await process.call(frame, self._host.limits.seconds)

    async def close(self) -> None:
        """Close the session as soon as its process is free."""
        self._closed = True
        home = self._home
        if self._opening or self._number in home.sessions:
            await home.turns.use(self._caller, lambda process: self._forgotten(process, home))
        home.guests.pop(self._number, None)
        self._host.ended()


class HostedSession:
    """A session of a stream in a worker process."""

    def __init__(self, host: SessionHost, number: int, caller: Caller) -> None:
        """Choose a process of ``host``."""
        self._host, self._number, self._owner = host, number, caller
        self._caller = caller.name
        self._home = host.home_for(caller.name, number)
        self._begun = False
        self._messages: list[bytes] | None = []
        self._kept = 0

    async def edit(self, data: bytes) -> bytes:
        """Answer one edit.

        Raises:
            Refused: it ends the session.
            FailedError: it failed.
        """
        try:
            answered = await self._somewhere(data)
        except WorkerMemoryError as error:
            raise error.refused from None
        except WorkerLostError as error:
            raise session_lost(str(error)) from None
        self._keep(data)
        return answered

    def _keep(self, data: bytes) -> None:
        """Keep a message for another process, as long as the caller has room."""
        if self._messages is None:
            return
        self._messages.append(data)
        self._kept += len(data)
        room = self._host.copies.put(self._owner, self, self._kept, self._forget)
        if not room or len(self._messages) > _MOST_KEPT:
            self._forget()

    def _forget(self) -> None:
        """Drop the messages: from now on the session ends with its process."""
        self._host.copies.forget(self._caller, self)
        self._messages = None

    async def _somewhere(self, data: bytes) -> bytes:
        """Return the answer of its process; if that is busy or dies, that of another one, once."""
        movable = self._messages is not None
        try:
            return await self._answered(data, _PATIENCE_SECONDS if movable else None)
        except asyncio.TimeoutError:
            self._home = self._host.move(self._home, self._caller, self._number)
        except WorkerDiedError:
            if not movable:
                raise
        return await self._answered(data, None)

    async def _answered(self, data: bytes, patience: float | None) -> bytes:
        home = self._home
        return await home.turns.use(self._caller, lambda process: self._edited(home, process, data), patience)

    async def _edited(self, home: _SessionProcess, process: WorkerProcess, data: bytes) -> bytes:
        try:
            if self._number not in home.sessions:
                await self._settle(home, process)
            return await process.call(
                worker_frames.Frame(worker_frames.EDIT_SESSION, self._number, data), self._host.limits.seconds
            )
        except WorkerLostError as error:
            # Other sessions of the process continue from their kept messages.
            self._host.lost(str(error))
            home.sessions.clear()
            raise

    async def _settle(self, home: _SessionProcess, process: WorkerProcess) -> None:
        """Open the session in a process, or repeat its messages there."""
        if not self._begun:
            frame = worker_frames.Frame(worker_frames.OPEN_SESSION, self._number, b"")
        elif self._messages is None:
            raise WorkerLostError("its process ended", "ABORTED")
        else:
            frame = worker_frames.Frame(
                worker_frames.REOPEN_SESSION, self._number, worker_frames.pack_messages(self._messages)
            )
        await process.call(frame, self._host.limits.seconds)
        self._begun = True
        home.sessions[self._number] = self._caller

    async def close(self) -> None:
        """Forget it."""
        self._host.ended()
        self._forget()
        self._home.guests.pop(self._number, None)
        if self._home.sessions.pop(self._number, None) is not None:
            await self._host.leave(self._home, self._caller, self._number)
