"""Worker processes: they answer calls that may take long, and sessions live in them."""

from __future__ import annotations

import asyncio
import itertools
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from google.rpc import status_pb2

from cqos_core.service import frames
from cqos_core.service.refusal import Refused, StatusRefused, session_lost
from cqos_core.service.worker import METHOD_NAMES

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.service.settings import Limits

_STARTING_SECONDS: Final = 60.0
_NUMBERS: Final = {name: number for number, name in enumerate(METHOD_NAMES)}


class LostError(Exception):
    """The process is gone, or was ended because it took too long."""


class FailedError(Exception):
    """A call raised what nobody had expected; the text is its traceback."""


class Process:
    """One worker process; it is started by its first call, and answers one call at a time."""

    def __init__(self, limits: Limits) -> None:
        """Remember what it may use."""
        self._limits = limits
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()

    async def call(self, frame: frames.Frame, seconds: float) -> bytes:
        """Let it answer, within the time that is left.

        The answer is awaited even if the caller goes away: whoever comes next must not get it.

        Raises:
            Refused: the call is refused.
            FailedError: it failed.
            LostError: there is no answer.
        """
        answering = asyncio.ensure_future(self._call(frame, seconds))
        answering.add_done_callback(_seen)
        return await asyncio.shield(answering)

    async def _call(self, frame: frames.Frame, seconds: float) -> bytes:
        async with self._turn:
            process = await self._started()
            try:
                answer = await asyncio.wait_for(_exchange(process, frame), seconds)
            except TimeoutError:
                await self.end()
                raise LostError(f"it took more than {seconds:g} seconds") from None
            except (OSError, EOFError):
                await self.end()
                raise LostError("its process ended") from None
        if answer.kind == frames.OK:
            return answer.data
        if answer.kind == frames.REFUSED:
            raise StatusRefused(status_pb2.Status.FromString(answer.data))
        raise FailedError(answer.data.decode())

    async def _started(self) -> asyncio.subprocess.Process:
        process = self._process
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
            try:
                await asyncio.wait_for(_answered(process), _STARTING_SECONDS)
            except (TimeoutError, OSError, EOFError):
                await self.end()
                raise LostError("its process does not start") from None
        return process

    async def start(self) -> None:
        """Start it, so that the next call need not wait for that; what fails now fails then."""
        async with self._turn:
            with suppress(LostError):
                await self._started()

    @property
    def number(self) -> int | None:
        """Its process id, while it runs."""
        return None if self._process is None or self._process.returncode is not None else self._process.pid

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


def _seen(answering: asyncio.Future[bytes]) -> None:
    """Look at how it ended: whoever asked has gone perhaps, and nobody else does."""
    if not answering.cancelled():
        answering.exception()


async def _exchange(process: asyncio.subprocess.Process, frame: frames.Frame) -> frames.Frame:
    calls = process.stdin
    assert calls is not None  # noqa: S101 - it is a pipe
    calls.write(frame.encoded())
    await calls.drain()
    return await _answered(process)


async def _answered(process: asyncio.subprocess.Process) -> frames.Frame:
    answers = process.stdout
    assert answers is not None  # noqa: S101 - it is a pipe
    kind, number, size = frames.head(await answers.readexactly(frames.HEAD_SIZE))
    return frames.Frame(kind, number, await answers.readexactly(size))


class Pool:
    """Workers for calls without memory."""

    def __init__(self, limits: Limits, lost: Callable[[], None] = lambda: None) -> None:
        """Keep as many as the limits allow; ``lost`` is told of each that had to be ended."""
        self._limits = limits
        self._lost = lost
        self._all = [Process(limits) for _ in range(limits.workers)]
        self._free: asyncio.LifoQueue[Process] = asyncio.LifoQueue()
        for process in reversed(self._all):
            self._free.put_nowait(process)
        self._waiting = 0
        self._busy: set[asyncio.Task[None]] = set()

    async def warm(self) -> None:
        """Start one process, so that the first call need not wait for it."""
        await self._all[0].start()

    async def call(self, method: str, data: bytes, seconds: float) -> bytes:
        """Let a worker answer a call; waiting for one counts.

        Raises:
            Refused: it is refused, too many wait already, or it took too long.
            FailedError: it failed.
        """
        if self._free.empty() and self._waiting >= self._limits.waiting:
            raise Refused("RESOURCE_EXHAUSTED", f"{self._waiting} calls wait already; try again later")
        loop = asyncio.get_running_loop()
        until = loop.time() + seconds
        self._waiting += 1
        try:
            process = await asyncio.wait_for(self._free.get(), seconds)
        except TimeoutError:
            raise Refused("DEADLINE_EXCEEDED", f"no worker was free within {seconds:g} seconds") from None
        finally:
            self._waiting -= 1
        work = asyncio.ensure_future(
            process.call(frames.Frame(frames.ANSWER, _NUMBERS[method], data), max(until - loop.time(), 0.001))
        )
        # The worker is free when it has answered, not when its caller goes away.
        back = asyncio.ensure_future(self._return(process, work))
        self._busy.add(back)
        back.add_done_callback(self._busy.discard)
        try:
            return await asyncio.shield(work)
        except LostError as error:
            self._lost()
            raise Refused("DEADLINE_EXCEEDED", f"there is no answer: {error}") from None

    async def _return(self, process: Process, work: asyncio.Future[bytes]) -> None:
        await asyncio.wait([work])
        _seen(work)
        await process.start()  # another one, where it had to be ended
        self._free.put_nowait(process)

    @property
    def numbers(self) -> list[int]:
        """Process ids of those that run."""
        return [each.number for each in self._all if each.number is not None]

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.end() for each in self._all))


class Sessions:
    """Sessions and the processes that they live in."""

    def __init__(self, limits: Limits, lost: Callable[[], None] = lambda: None) -> None:
        """Keep as many as the limits allow."""
        self._limits = limits
        self._lost = lost
        self._homes: dict[Process, set[int]] = {Process(limits): set() for _ in range(limits.session_workers)}
        self._next = itertools.count(1)

    @property
    def open(self) -> int:
        """How many are open."""
        return sum(map(len, self._homes.values()))

    @property
    def numbers(self) -> list[int]:
        """Process ids of those that run."""
        return [each.number for each in self._homes if each.number is not None]

    async def begin(self) -> HostedSession:
        """Open a session in the process that has fewest.

        Raises:
            Refused: there are too many.
        """
        if self.open >= self._limits.sessions:
            raise Refused("RESOURCE_EXHAUSTED", f"{self._limits.sessions} sessions are open already; try again later")
        home = min(self._homes, key=lambda each: len(self._homes[each]))
        number = next(self._next)
        self._homes[home].add(number)
        session = HostedSession(self, home, number, self._limits.seconds)
        try:
            await session.call(frames.OPEN_SESSION, b"")
        except BaseException:
            self._homes[home].discard(number)
            raise
        return session

    async def lose(self, home: Process) -> None:
        """Forget all sessions of a process that is gone."""
        self._lost()
        self._homes[home].clear()

    def forget(self, home: Process, number: int) -> None:
        """Forget one session."""
        self._homes[home].discard(number)

    def has(self, home: Process, number: int) -> bool:
        """Whether a session is still there."""
        return number in self._homes[home]

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.end() for each in self._homes))


class HostedSession:
    """A session in a worker process."""

    def __init__(self, sessions: Sessions, home: Process, number: int, seconds: float) -> None:
        """Belong to ``sessions``."""
        self._sessions = sessions
        self._home = home
        self._number = number
        self._seconds = seconds

    async def edit(self, data: bytes) -> bytes:
        """Answer one edit.

        Raises:
            Refused: it ends the session.
            FailedError: it failed.
        """
        return await self.call(frames.EDIT_SESSION, data)

    async def call(self, kind: int, data: bytes) -> bytes:
        """Let the process answer."""
        if not self._sessions.has(self._home, self._number):
            raise session_lost("its process ended")
        try:
            return await self._home.call(frames.Frame(kind, self._number, data), self._seconds)
        except LostError as error:
            await self._sessions.lose(self._home)
            raise session_lost(str(error)) from None

    async def close(self) -> None:
        """Forget it."""
        if self._sessions.has(self._home, self._number):
            self._sessions.forget(self._home, self._number)
            with suppress(LostError, FailedError, Refused):
                await self._home.call(frames.Frame(frames.CLOSE_SESSION, self._number, b""), self._seconds)
