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
from cqos_core.service.turns import Turns
from cqos_core.service.worker import METHOD_NAMES

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.service.settings import Limits

_STARTING_SECONDS: Final = 60.0
_ENDING_SECONDS: Final = 5.0
_NUMBERS: Final = {name: number for number, name in enumerate(METHOD_NAMES)}


class LostError(Exception):
    """The process is gone, or was ended because it took too long.

    Attributes:
        refused: what the caller of a call without memory hears.
    """

    def __init__(self, why: str, code: str) -> None:
        """Say why, and the code of the status that it makes."""
        super().__init__(why)
        self.refused = Refused(code, f"there is no answer: {why}")


class SpentError(LostError):
    """It took all memory that it may have, and is gone."""

    def __init__(self, status: status_pb2.Status) -> None:
        """Refuse the call with what the process said at last."""
        super().__init__("it took all memory that it may have", "RESOURCE_EXHAUSTED")
        self.refused = StatusRefused(status)


class FailedError(Exception):
    """A call raised what nobody had expected; the text is its traceback."""


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

        The answer has to be awaited even if the caller goes away: whoever comes next must not get it.

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
            except TimeoutError:
                await self.end()
                raise LostError(f"it took more than {seconds:g} seconds", "DEADLINE_EXCEEDED") from None
            except (OSError, EOFError):
                raise await self._died(process) from None
            if answer.kind == frames.SPENT:
                await self._died(process)
                raise SpentError(status_pb2.Status.FromString(answer.data))
        if answer.kind == frames.OK:
            return answer.data
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
            try:
                await asyncio.wait_for(_answered(process), _STARTING_SECONDS)
            except (TimeoutError, OSError, EOFError):
                await self.end()
                raise LostError("its process does not start", "UNAVAILABLE") from None
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

    async def close(self) -> None:
        """End it for good."""
        self._closed = True
        await self.end()

    async def _died(self, process: asyncio.subprocess.Process) -> LostError:
        """Say how a process ended that nobody ended; one that is killed meanwhile would not tell."""
        if self._closed:
            return _service_ends()
        with suppress(TimeoutError):
            await asyncio.wait_for(process.wait(), _ENDING_SECONDS)
        how = f"its process ended (exit code {process.returncode}), probably for lack of memory"
        await self.end()
        return LostError(how, "RESOURCE_EXHAUSTED")

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
        """Keep as many as the limits allow; ``lost`` is told of each that had to be ended, and why."""
        self._limits = limits
        self._lost = lost
        self._all = [Process(limits) for _ in range(limits.workers)]
        # One that had to be ended is started again before the next call needs it.
        self._turns = Turns(self._all, Process.start, limits.waiting)

    async def warm(self) -> None:
        """Start one process, so that the first call need not wait for it."""
        await self._all[0].start()

    async def call(self, caller: str, method: str, data: bytes, seconds: float, *, json: bool = False) -> bytes:
        """Let a worker answer a call, in ``json`` or binary; waiting for one counts.

        Raises:
            Refused: it is refused, too many wait already, or it took too long.
            FailedError: it failed.
        """
        loop = asyncio.get_running_loop()
        until = loop.time() + seconds
        frame = frames.Frame(frames.ANSWER_JSON if json else frames.ANSWER, _NUMBERS[method], data)
        try:
            return await self._turns.use(
                caller, lambda process: process.call(frame, max(until - loop.time(), 0.001)), seconds
            )
        except TimeoutError:
            raise Refused("DEADLINE_EXCEEDED", f"no worker was free within {seconds:g} seconds") from None
        except LostError as error:
            self._lost(str(error))
            raise error.refused from None

    @property
    def numbers(self) -> list[int]:
        """Process ids of those that run."""
        return [each.number for each in self._all if each.number is not None]

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.close() for each in self._all))


class _Home:
    """A process that sessions live in, and who they are."""

    def __init__(self, limits: Limits) -> None:
        self.process = Process(limits)
        self.turns = Turns([self.process], Process.start)
        self.sessions: set[int] = set()


class Sessions:
    """Sessions and the processes that they live in."""

    def __init__(self, limits: Limits, lost: Callable[[str], None] = lambda _why: None) -> None:
        """Keep as many as the limits allow."""
        self._limits = limits
        self._lost = lost
        self._homes = [_Home(limits) for _ in range(limits.session_workers)]
        self._next = itertools.count(1)

    @property
    def open(self) -> int:
        """How many are open."""
        return sum(len(each.sessions) for each in self._homes)

    @property
    def numbers(self) -> list[int]:
        """Process ids of those that run."""
        return [each.process.number for each in self._homes if each.process.number is not None]

    async def begin(self, caller: str) -> HostedSession:
        """Open a session in the process that has fewest.

        Raises:
            Refused: there are too many.
        """
        if self.open >= self._limits.sessions:
            raise Refused("RESOURCE_EXHAUSTED", f"{self._limits.sessions} sessions are open already; try again later")
        home = min(self._homes, key=lambda each: len(each.sessions))
        session = HostedSession(home, next(self._next), caller, self._limits.seconds, self._lost)
        await session.open()
        return session

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.process.close() for each in self._homes))


class HostedSession:
    """A session in a worker process."""

    def __init__(self, home: _Home, number: int, caller: str, seconds: float, lost: Callable[[str], None]) -> None:
        """Live in ``home``; an edit may take so many ``seconds``."""
        self._home = home
        self._number = number
        self._caller = caller
        self._seconds = seconds
        self._lost = lost

    async def open(self) -> None:
        """Begin.

        Raises:
            Refused: it is lost already.
        """
        self._home.sessions.add(self._number)
        try:
            await self._call(frames.OPEN_SESSION, b"")
        except BaseException:
            self._home.sessions.discard(self._number)
            raise

    async def edit(self, data: bytes) -> bytes:
        """Answer one edit.

        Raises:
            Refused: it ends the session.
            FailedError: it failed.
        """
        return await self._call(frames.EDIT_SESSION, data)

    async def _call(self, kind: int, data: bytes) -> bytes:
        frame = frames.Frame(kind, self._number, data)
        try:
            return await self._home.turns.use(self._caller, lambda process: self._answered(process, frame))
        except SpentError as error:
            raise error.refused from None
        except LostError as error:
            raise session_lost(str(error)) from None

    async def _answered(self, process: Process, frame: frames.Frame) -> bytes:
        if self._number not in self._home.sessions and frame.kind != frames.CLOSE_SESSION:
            raise LostError("its process ended", "ABORTED")
        try:
            return await process.call(frame, self._seconds)
        except LostError as error:
            # All that live there are lost with it.
            self._lost(str(error))
            self._home.sessions.clear()
            raise

    async def close(self) -> None:
        """Forget it."""
        if self._number in self._home.sessions:
            self._home.sessions.discard(self._number)
            with suppress(LostError, FailedError, Refused):
                await self._call(frames.CLOSE_SESSION, b"")
