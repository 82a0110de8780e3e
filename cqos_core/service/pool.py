"""Worker processes: they answer calls that may take long, and sessions live in them."""

from __future__ import annotations

import asyncio
import itertools
import os
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from google.rpc import status_pb2

from cqos_core.remote.refusal import BUSY, WORKER_LOST, Refused, StatusRefused, session_lost
from cqos_core.service import frames
from cqos_core.service.fair_scheduler import Turns
from cqos_core.service.model_copies import ModelCopy
from cqos_core.service.worker import METHOD_NAMES

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from cqos_core.service.callers import Caller, Shared
    from cqos_core.service.settings import Limits

_STARTING_SECONDS: Final = 60.0
_ENDING_SECONDS: Final = 5.0
_PATIENCE_SECONDS: Final = 1.0
"""How long an edit waits for another caller's before its session moves to another process."""
_MOST_KEPT: Final = 1_000
_NICE: Final = 5
"""The priority of workers: the processor is first for those who answer at once."""
_NUMBERS: Final = {name: number for number, name in enumerate(METHOD_NAMES)}


class LostError(Exception):
    """The process is gone, or was ended because it took too long.

    Attributes:
        refused: what the caller of a call without memory hears.
    """

    def __init__(self, why: str, code: str) -> None:
        """Say why, and the code of the status that it makes."""
        super().__init__(why)
        self.refused = Refused(code, f"there is no answer: {why}", reason=WORKER_LOST if code == "UNAVAILABLE" else "")


class DiedError(LostError):
    """The process ended by itself or by a signal; another one may well answer."""


class SpentError(LostError):
    """It took all memory that it may have, and is gone."""

    def __init__(self, status: status_pb2.Status) -> None:
        """Refuse the call with what the process said at last."""
        super().__init__("it took all memory that it may have", "RESOURCE_EXHAUSTED")
        self.refused = StatusRefused(status)


class SessionGoneError(Exception):
    """A session of single calls has lost its process, and cannot go on in another one; the text says why."""


class FailedError(Exception):
    """A call raised an unexpected exception; the text is its traceback."""


class Process:
    """One worker process; it is started by its first call, and answers one call at a time."""

    def __init__(self, limits: Limits) -> None:
        """Remember what it may use."""
        self._limits = limits
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._closed = False

    async def call(self, frame: frames.Frame, seconds: float) -> bytes:
        """Let it answer, within the time that is left.

        The answer has to be awaited even if the caller goes away: the next caller must not get it.

        Raises:
            Refused: the call is refused.
            FailedError: it failed.
            SpentError: it takes more memory than there is.
            LostError: there is no answer.
        """
        async with self._turn:
            process = await self._started()
            try:
                answer = await asyncio.wait_for(_exchange(process, frame), seconds)
            except asyncio.TimeoutError:
                await self.end()
                raise LostError(f"it took more than {seconds:g} seconds", "DEADLINE_EXCEEDED") from None
            except (OSError, EOFError):
                raise await self._died(process) from None
            if answer.kind == frames.SPENT:
                await self._died(process)
                raise SpentError(status_pb2.Status.FromString(answer.data))
        if answer.kind == frames.OK:
            return answer.data
        if answer.kind == frames.GONE:
            raise DiedError("its process ended", "ABORTED")
        if answer.kind == frames.REFUSED:
            raise StatusRefused(status_pb2.Status.FromString(answer.data))
        raise FailedError(answer.data.decode())

    async def _started(self) -> asyncio.subprocess.Process:
        process = self._process
        if self._closed:
            raise _service_ends()
        if process is None or process.returncode is not None:
            process = self._process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "cqos_core.service.worker",
                str(self._limits.endpoints),
                str(self._limits.worker_memory),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
            )
            if hasattr(os, "setpriority"):  # from here: what it imports takes a second of a processor
                with suppress(OSError):
                    os.setpriority(os.PRIO_PROCESS, process.pid, os.getpriority(os.PRIO_PROCESS, 0) + _NICE)
            try:
                await asyncio.wait_for(_answered(process), _STARTING_SECONDS)
            except (asyncio.TimeoutError, OSError, EOFError):
                await self.end()
                raise LostError("its process does not start", "UNAVAILABLE") from None
        return process

    async def start(self) -> None:
        """Start it, so that the next call need not wait for that; what fails now fails then."""
        async with self._turn:
            with suppress(LostError):
                await self._started()

    async def close(self) -> None:
        """End it for good."""
        self._closed = True
        await self.end()

    async def _died(self, process: asyncio.subprocess.Process) -> LostError:
        """Return how a process ended by itself; if it is killed meanwhile, its exit code is lost."""
        if self._closed:
            return _service_ends()
        with suppress(TimeoutError):
            await asyncio.wait_for(process.wait(), _ENDING_SECONDS)
        code = process.returncode or 0
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        await self.end()
        return DiedError(f"the worker process ended while it answered ({how})", "UNAVAILABLE")

    async def end(self) -> None:
        """End it at once."""
        process, self._process = self._process, None
        if process is None:
            return
        with suppress(ProcessLookupError):
            process.kill()
        if process.stdin is not None:
            process.stdin.close()
        await process.wait()


def _service_ends() -> LostError:
    return LostError("the service ends", "UNAVAILABLE")


async def _exchange(process: asyncio.subprocess.Process, frame: frames.Frame) -> frames.Frame:
    calls = process.stdin
    assert calls is not None  # noqa: S101 - it is a pipe
    calls.write(frame.encoded())
    with suppress(OSError):  # one that ends for lack of memory says so, even if it did not take all of it
        await calls.drain()
    return await _answered(process)


async def _answered(process: asyncio.subprocess.Process) -> frames.Frame:
    answers = process.stdout
    assert answers is not None  # noqa: S101 - it is a pipe
    kind, number, size = frames.head(await answers.readexactly(frames.HEAD_SIZE))
    return frames.Frame(kind, number, await answers.readexactly(size))


class Pool:
    """Workers for calls without memory."""

    def __init__(self, limits: Limits, lost: Callable[[str], None] = lambda _why: None) -> None:
        """Keep as many as the limits allow; call ``lost`` with the reason for each that had to be ended."""
        self._limits = limits
        self._lost = lost
        self._all = [Process(limits) for _ in range(limits.workers)]
        # One that had to be ended is started again before the next call needs it.
        self._turns = Turns(self._all, Process.start, limits.waiting)

    async def warm(self) -> None:
        """Start one process, so that the first call need not wait for it."""
        await self._all[0].start()

    @property
    def waiting(self) -> int:
        """How many calls wait for a worker."""
        return self._turns.waiting

    async def call(self, caller: str, kind: int, method: str, data: bytes, seconds: float) -> bytes:
        """Let a worker answer a call of a kind of `frames`; waiting for one counts.

        Where its process dies, another one is asked once: an answer has no effect but itself.

        Raises:
            Refused: it is refused, too many wait already, or it took too long.
            FailedError: it failed.
        """
        frame, loop = frames.Frame(kind, _NUMBERS.get(method, 0), data), asyncio.get_running_loop()
        until = loop.time() + seconds

        def left() -> float:
            return max(until - loop.time(), 0.001)

        died = None
        while True:
            try:
                return await self._turns.use(caller, lambda process: process.call(frame, left()), left())
            except asyncio.TimeoutError:
                if died is not None:
                    raise died.refused from None
                raise Refused("DEADLINE_EXCEEDED", f"no worker was free within {seconds:g} seconds") from None
            except LostError as error:
                self._lost(str(error))
                if died is not None or not isinstance(error, DiedError):
                    raise error.refused from None
                died = error

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.close() for each in self._all))


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


class _Home:
    """A process that sessions live in.

    Attributes:
        sessions: whose those are that it has.
        guests: whose those are that it has or is asked for, also while it opens them.
    """

    def __init__(self, limits: Limits) -> None:
        self.process = Process(limits)
        self.turns = Turns([self.process], Process.start)
        self.sessions: dict[int, str] = {}
        self.guests: dict[int, str] = {}


class Sessions:
    """Sessions and the processes that they live in.

    The messages of each are kept within limits, so that a session whose process ended, or is kept busy by another caller,
    goes on in another one.
    """

    def __init__(self, limits: Limits, copies: Shared, lost: Callable[[str], None] = lambda _why: None) -> None:
        """Keep as many as the limits allow, and of their messages what ``copies`` has room for."""
        self.limits = limits
        self.copies = copies
        self.lost = lost
        self._homes = [_Home(limits) for _ in range(limits.session_workers)]
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

    def home_for(self, caller: str, number: int, before: _Home | None = None) -> _Home:
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

    def move(self, before: _Home, caller: str, number: int) -> _Home:
        """Let a session live in a process that is less busy, and close it in the one before when that has time."""
        home = self.home_for(caller, number, before)
        if home is not before and before.sessions.pop(number, None) is not None:
            leaving = asyncio.ensure_future(self.leave(before, caller, number))
            self._leaving.add(leaving)
            leaving.add_done_callback(self._leaving.discard)
        return home

    async def leave(self, home: _Home, caller: str, number: int) -> None:
        """Close a session in a process."""
        frame = frames.Frame(frames.CLOSE_SESSION, number, b"")
        with suppress(LostError, FailedError, Refused):  # a process that ended has no session any more
            await home.turns.use(caller, lambda process: process.call(frame, self.limits.seconds))

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.process.close() for each in self._homes))


class HostedModel:
    """A session in a worker process. Its documents are kept, so that it goes on in another process as a stream does."""

    def __init__(self, house: Sessions, number: int, caller: str) -> None:
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

        async def opened(process: Process) -> bytes:
            self._opening = True
            try:
                answered = await process.call(
                    frames.Frame(frames.OPEN_MODEL, self._number, data), self._house.limits.seconds
                )
            except LostError as error:
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
        except LostError as error:
            raise error.refused from None

    async def edit(self, data: bytes) -> bytes:
        """Answer an edit.

        Raises:
            SessionGoneError: the session is lost.
            FailedError: it failed.
        """
        try:
            return await self._somewhere(data)
        except LostError as error:
            raise SessionGoneError(f"the session is lost: {error}") from None

    async def _somewhere(self, data: bytes) -> bytes:
        """Let the process of the session answer; where that is busy or dies, another one, once."""
        try:
            return await self._answered(data, _PATIENCE_SECONDS)
        except asyncio.TimeoutError:
            self._home = self._house.move(self._home, self._caller, self._number)
        except DiedError:
            pass
        return await self._answered(data, None)

    async def _answered(self, data: bytes, patience: float | None) -> bytes:
        home = self._home
        return await home.turns.use(self._caller, lambda process: self._edited(home, process, data), patience)

    async def _edited(self, home: _Home, process: Process, data: bytes) -> bytes:
        copy, seconds = self._copy, self._house.limits.seconds
        assert copy is not None  # noqa: S101 - it is open
        try:
            if self._number not in home.sessions:
                for kind, message in copy.frames():
                    await process.call(frames.Frame(kind, self._number, message), seconds)
                home.sessions[self._number] = self._caller
            answered = await process.call(frames.Frame(frames.EDIT_SESSION, self._number, data), seconds)
        except LostError as error:
            self._lost(home, error)
            raise
        copy.follow(data, answered)
        return answered

    def _lost(self, home: _Home, error: LostError) -> None:
        """Note that a process is gone; all that lived there go on elsewhere."""
        self._house.lost(str(error))
        home.sessions.clear()

    async def _forgotten(self, process: Process, home: _Home) -> None:
        if home.sessions.pop(self._number, None) is not None:
            frame = frames.Frame(frames.CLOSE_SESSION, self._number, b"")
            with suppress(LostError, FailedError, Refused):
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

    def __init__(self, house: Sessions, number: int, caller: Caller) -> None:
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
        except SpentError as error:
            raise error.refused from None
        except LostError as error:
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
        except DiedError:
            if not movable:
                raise
        return await self._answered(data, None)

    async def _answered(self, data: bytes, patience: float | None) -> bytes:
        home = self._home
        return await home.turns.use(self._caller, lambda process: self._edited(home, process, data), patience)

    async def _edited(self, home: _Home, process: Process, data: bytes) -> bytes:
        try:
            if self._number not in home.sessions:
                await self._settle(home, process)
            return await process.call(frames.Frame(frames.EDIT_SESSION, self._number, data), self._house.limits.seconds)
        except LostError as error:
            # The others that live there go on from what was kept of them.
            self._house.lost(str(error))
            home.sessions.clear()
            raise

    async def _settle(self, home: _Home, process: Process) -> None:
        """Begin in a process, or go on there."""
        if not self._begun:
            frame = frames.Frame(frames.OPEN_SESSION, self._number, b"")
        elif self._messages is None:
            raise LostError("its process ended", "ABORTED")
        else:
            frame = frames.Frame(frames.REOPEN_SESSION, self._number, frames.packed(self._messages))
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
