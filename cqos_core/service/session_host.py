"""Sessions in worker processes: in which process each lives, and how it moves to another."""

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
"""How long an edit waits for another caller's before its session moves to another process."""

_MOST_KEPT: Final = 1_000


async def _within(seconds: float, answer: Coroutine[Any, Any, bytes]) -> bytes:
    """Wait so long for an answer. What makes it goes on: others live in the same process.

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
    """A process that sessions live in.

    Attributes:
        sessions: whose those are that it has.
        guests: whose those are that it has or is asked for, also while it opens them.
    """

    def __init__(self, limits: Limits) -> None:
        self.process = WorkerProcess(limits)
        self.turns = FairPool([self.process], WorkerProcess.start)
        self.sessions: dict[int, str] = {}
        self.guests: dict[int, str] = {}


class SessionHost:
    """Sessions and the processes that they live in.

    The messages of each are kept within limits, so that a session whose process ended, or is kept busy by another caller,
    goes on in another one.
    """

    def __init__(self, limits: Limits, copies: SharedBytes, lost: Callable[[str], None] = lambda _why: None) -> None:
        """Keep as many as the limits allow, and of their messages what ``copies`` has room for."""
        self.limits = limits
        self.copies = copies
        self.lost = lost
        self._homes = [_SessionProcess(limits) for _ in range(limits.session_workers)]
        self._next = itertools.count(1)
        self._open = 0
        self._leaving: set[asyncio.Task[None]] = set()

    async def warm(self) -> None:
        """Start one process, so that the first session need not wait for it."""
        await self._homes[0].process.start()

    async def begin(self, caller: Caller) -> HostedSession:
        """Open a session in the process that has fewest.

        Raises:
            Refused: there are too many.
        """
        self._count()
        return HostedSession(self, next(self._next), caller)

    def begin_model(self, caller: str) -> HostedModel:
        """Begin a session of single calls in the process that has fewest.

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
        """Let a session live in another process than before, that with the fewest; one caller has all but one at most."""
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
        """Let a session live in a process that is less busy, and close it in the one before when that has time."""
        home = self.home_for(caller, number, before)
        if home is not before and before.sessions.pop(number, None) is not None:
            leaving = asyncio.ensure_future(self.leave(before, caller, number))
            self._leaving.add(leaving)
            leaving.add_done_callback(self._leaving.discard)
        return home

    async def leave(self, home: _SessionProcess, caller: str, number: int) -> None:
        """Close a session in a process."""
        frame = worker_frames.Frame(worker_frames.CLOSE_SESSION, number, b"")
        with suppress(WorkerLostError, CallFailedError, Refused):  # a process that ended has no session any more
            await home.turns.use(caller, lambda process: process.call(frame, self.limits.seconds))

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.process.close() for each in self._homes))


class HostedModel:
    """A session in a worker process. Its documents are kept, so that it goes on in another process as a stream does."""

    def __init__(self, house: SessionHost, number: int, caller: str) -> None:
        """Live in one of the processes of ``house``."""
        self._house, self._number, self._caller = house, number, caller
        self._home = house.home_for(caller, number)
        self._copy: ModelCopy | None = None
        self._opening = self._closed = False

    async def open(self, data: bytes, seconds: float) -> bytes:
        """Open it; what the answer takes beyond ``seconds`` is nobody's but the worker's, where others live, too.

        Raises:
            Refused: it is not opened.
            FailedError: that failed.
        """

        async def opened(process: WorkerProcess) -> bytes:
            self._opening = True
            try:
                answered = await process.call(
                    worker_frames.Frame(worker_frames.OPEN_MODEL, self._number, data), self._house.limits.seconds
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
        """Let the process of the session answer; where that is busy or dies, another one, once."""
        try:
            return await self._answered(data, _PATIENCE_SECONDS)
        except asyncio.TimeoutError:
            self._home = self._house.move(self._home, self._caller, self._number)
        except WorkerDiedError:
            pass
        return await self._answered(data, None)

    async def _answered(self, data: bytes, patience: float | None) -> bytes:
        home = self._home
        return await home.turns.use(self._caller, lambda process: self._edited(home, process, data), patience)

    async def _edited(self, home: _SessionProcess, process: WorkerProcess, data: bytes) -> bytes:
        copy, seconds = self._copy, self._house.limits.seconds
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
        """Note that a process is gone; all that lived there go on elsewhere."""
        self._house.lost(str(error))
        home.sessions.clear()

    async def _forgotten(self, process: WorkerProcess, home: _SessionProcess) -> None:
        if home.sessions.pop(self._number, None) is not None:
            frame = worker_frames.Frame(worker_frames.CLOSE_SESSION, self._number, b"")
            with suppress(WorkerLostError, CallFailedError, Refused):
                await process.call(frame, self._house.limits.seconds)

    async def close(self) -> None:
        """Forget it, as soon as its process is free."""
        self._closed = True
        home = self._home
        if self._opening or self._number in home.sessions:
            await home.turns.use(self._caller, lambda process: self._forgotten(process, home))
        home.guests.pop(self._number, None)
        self._house.ended()


class HostedSession:
    """A session in a worker process."""

    def __init__(self, house: SessionHost, number: int, caller: Caller) -> None:
        """Live in one of the processes of ``house``."""
        self._house, self._number, self._owner = house, number, caller
        self._caller = caller.name
        self._home = house.home_for(caller.name, number)
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
        """Keep a message for another process, as long as its caller has room for it."""
        if self._messages is None:
            return
        self._messages.append(data)
        self._kept += len(data)
        room = self._house.copies.put(self._owner, self, self._kept, self._forget)
        if not room or len(self._messages) > _MOST_KEPT:
            self._forget()

    def _forget(self) -> None:
        """Keep none: from now on it lives no longer than its process."""
        self._house.copies.forget(self._caller, self)
        self._messages = None

    async def _somewhere(self, data: bytes) -> bytes:
        """Let the process of the session answer; where that is busy or dies, another one, once."""
        movable = self._messages is not None
        try:
            return await self._answered(data, _PATIENCE_SECONDS if movable else None)
        except asyncio.TimeoutError:
            self._home = self._house.move(self._home, self._caller, self._number)
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
                worker_frames.Frame(worker_frames.EDIT_SESSION, self._number, data), self._house.limits.seconds
            )
        except WorkerLostError as error:
            # The others that live there go on from what was kept of them.
            self._house.lost(str(error))
            home.sessions.clear()
            raise

    async def _settle(self, home: _SessionProcess, process: WorkerProcess) -> None:
        """Begin in a process, or go on there."""
        if not self._begun:
            frame = worker_frames.Frame(worker_frames.OPEN_SESSION, self._number, b"")
        elif self._messages is None:
            raise WorkerLostError("its process ended", "ABORTED")
        else:
            frame = worker_frames.Frame(
                worker_frames.REOPEN_SESSION, self._number, worker_frames.pack_messages(self._messages)
            )
        await process.call(frame, self._house.limits.seconds)
        self._begun = True
        home.sessions[self._number] = self._caller

    async def close(self) -> None:
        """Forget it."""
        self._house.ended()
        self._forget()
        self._home.guests.pop(self._number, None)
        if self._home.sessions.pop(self._number, None) is not None:
            await self._house.leave(self._home, self._caller, self._number)
