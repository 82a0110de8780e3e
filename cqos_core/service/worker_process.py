"""One worker process, as the service sees it: its calls, and the ways in which it ends."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from google.rpc import status_pb2

from cqos_core.remote.refusal import WORKER_LOST, Refused, StatusRefused
from cqos_core.service import worker_frames

if TYPE_CHECKING:
    from cqos_core.service.settings import Limits


_STARTING_SECONDS: Final = 60.0

_ENDING_SECONDS: Final = 5.0

_NICE: Final = 5
"""The priority of workers: the processor is first for those who answer at once."""


class WorkerLostError(Exception):
    """The process is gone, or was ended because it took too long.

    Attributes:
        refused: what the caller of a call without memory hears.
    """

    def __init__(self, why: str, code: str) -> None:
        """Say why, and the code of the status that it makes."""
        super().__init__(why)
        self.refused = Refused(code, f"there is no answer: {why}", reason=WORKER_LOST if code == "UNAVAILABLE" else "")


class WorkerDiedError(WorkerLostError):
    """The process ended by itself or by a signal; another one may well answer."""


class WorkerMemoryError(WorkerLostError):
    """It took all memory that it may have, and is gone."""

    def __init__(self, status: status_pb2.Status) -> None:
        """Refuse the call with what the process said at last."""
        super().__init__("it took all memory that it may have", "RESOURCE_EXHAUSTED")
        self.refused = StatusRefused(status)


class SessionLostError(Exception):
    """A session of single calls has lost its process, and cannot go on in another one; the text says why."""


class CallFailedError(Exception):
    """A call raised an unexpected exception; the text is its traceback."""


class WorkerProcess:
    """One worker process; it is started by its first call, and answers one call at a time."""

    def __init__(self, limits: Limits) -> None:
        """Remember what it may use."""
        self._limits = limits
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._closed = False

    async def call(self, frame: worker_frames.Frame, seconds: float) -> bytes:
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
                raise WorkerLostError(f"it took more than {seconds:g} seconds", "DEADLINE_EXCEEDED") from None
            except (OSError, EOFError):
                raise await self._died(process) from None
            if answer.kind == worker_frames.SPENT:
                await self._died(process)
                raise WorkerMemoryError(status_pb2.Status.FromString(answer.data))
        if answer.kind == worker_frames.OK:
            return answer.data
        if answer.kind == worker_frames.GONE:
            raise WorkerDiedError("its process ended", "ABORTED")
        if answer.kind == worker_frames.REFUSED:
            raise StatusRefused(status_pb2.Status.FromString(answer.data))
        raise CallFailedError(answer.data.decode())

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
                await asyncio.wait_for(_read_answer(process), _STARTING_SECONDS)
            except (asyncio.TimeoutError, OSError, EOFError):
                await self.end()
                raise WorkerLostError("its process does not start", "UNAVAILABLE") from None
        return process

    async def start(self) -> None:
        """Start it, so that the next call need not wait for that; what fails now fails then."""
        async with self._turn:
            with suppress(WorkerLostError):
                await self._started()

    async def close(self) -> None:
        """End it for good."""
        self._closed = True
        await self.end()

    async def _died(self, process: asyncio.subprocess.Process) -> WorkerLostError:
        """Return how a process ended by itself; if it is killed meanwhile, its exit code is lost."""
        if self._closed:
            return _service_ends()
        with suppress(TimeoutError):
            await asyncio.wait_for(process.wait(), _ENDING_SECONDS)
        code = process.returncode or 0
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        await self.end()
        return WorkerDiedError(f"the worker process ended while it answered ({how})", "UNAVAILABLE")

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


def _service_ends() -> WorkerLostError:
    return WorkerLostError("the service ends", "UNAVAILABLE")


async def _exchange(process: asyncio.subprocess.Process, frame: worker_frames.Frame) -> worker_frames.Frame:
    calls = process.stdin
    assert calls is not None  # noqa: S101 - it is a pipe
    calls.write(frame.encoded())
    with suppress(OSError):  # one that ends for lack of memory says so, even if it did not take all of it
        await calls.drain()
    return await _read_answer(process)


async def _read_answer(process: asyncio.subprocess.Process) -> worker_frames.Frame:
    answers = process.stdout
    assert answers is not None  # noqa: S101 - it is a pipe
    kind, number, size = worker_frames.head(await answers.readexactly(worker_frames.HEAD_SIZE))
    return worker_frames.Frame(kind, number, await answers.readexactly(size))
