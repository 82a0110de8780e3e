"""One worker process on the side of the service: its calls, and the errors when it ends."""

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
"""The priority of workers: the serving process goes first."""


class WorkerLostError(Exception):
    """The process is gone, or was killed because it took too long.

    Attributes:
        refused: the refusal for the caller.
    """

    def __init__(self, why: str, code: str) -> None:
        """Take the reason, and the code of the status."""
        super().__init__(why)
        self.refused = Refused(code, f"there is no answer: {why}", reason=WORKER_LOST if code == "UNAVAILABLE" else "")


class WorkerDiedError(WorkerLostError):
    """The process ended by itself or by a signal; another one may answer."""


class WorkerMemoryError(WorkerLostError):
    """The process used all memory that it may have, and ended."""

    def __init__(self, status: status_pb2.Status) -> None:
        """Take the last status of the process."""
        super().__init__("it took all memory that it may have", "RESOURCE_EXHAUSTED")
        self.refused = StatusRefused(status)


class SessionLostError(Exception):
    """A session has lost its process, and cannot continue in another one; the text has the reason."""


class CallFailedError(Exception):
    """A call raised an unexpected exception; the text is the traceback."""


class WorkerProcess:
    """One worker process. Its first call starts it, and it answers one call at a time."""

    def __init__(self, limits: Limits) -> None:
        """Take the limits of the process."""
        self._limits = limits
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._closed = False

    async def call(self, frame: worker_frames.Frame, seconds: float) -> bytes:
        """Return the answer to a call, within ``seconds``.

        The answer must be awaited even if the caller is gone: else the next caller would get it.

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
            if hasattr(os, "setpriority"):  # set here, because the imports of the worker take a second
                with suppress(OSError):
                    os.setpriority(os.PRIO_PROCESS, process.pid, os.getpriority(os.PRIO_PROCESS, 0) + _NICE)
            try:
                await asyncio.wait_for(_read_answer(process), _STARTING_SECONDS)
            except (asyncio.TimeoutError, OSError, EOFError):
                await self.end()
                raise WorkerLostError("its process does not start", "UNAVAILABLE") from None
        return process

    async def start(self) -> None:
        """Start the process ahead of the next call; a failure is reported by that call."""
        async with self._turn:
            with suppress(WorkerLostError):
                await self._started()

    async def close(self) -> None:
        """End the process for good."""
        self._closed = True
        await self.end()

    async def _died(self, process: asyncio.subprocess.Process) -> WorkerLostError:
        """Return the error of a process that ended by itself, with its exit code or signal."""
        if self._closed:
            return _service_ends()
        with suppress(TimeoutError):
            await asyncio.wait_for(process.wait(), _ENDING_SECONDS)
        code = process.returncode or 0
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        await self.end()
        return WorkerDiedError(f"the worker process ended while it answered ({how})", "UNAVAILABLE")

    async def end(self) -> None:
        """End the connection at once."""
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
    with suppress(OSError):  # a worker out of memory still answers, although it did not read all
        await calls.drain()
    return await _read_answer(process)


async def _read_answer(process: asyncio.subprocess.Process) -> worker_frames.Frame:
    answers = process.stdout
    assert answers is not None  # noqa: S101 - it is a pipe
    kind, number, size = worker_frames.head(await answers.readexactly(worker_frames.HEAD_SIZE))
    return worker_frames.Frame(kind, number, await answers.readexactly(size))
