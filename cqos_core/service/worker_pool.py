"""The pool of worker processes for calls without sessions."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from cqos_core.remote.refusal import Refused
from cqos_core.service import worker_frames
from cqos_core.service.fair_scheduler import FairPool
from cqos_core.service.worker import METHOD_NAMES
from cqos_core.service.worker_process import WorkerDiedError, WorkerLostError, WorkerProcess

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.service.settings import Limits


_NUMBERS: Final = {name: number for number, name in enumerate(METHOD_NAMES)}


class WorkerPool:
    """Workers for calls without sessions."""

    def __init__(self, limits: Limits, lost: Callable[[str], None] = lambda _why: None) -> None:
        """Keep as many workers as the limits allow; ``lost`` is called with the reason when one is lost."""
        self._limits = limits
        self._lost = lost
        self._all = [WorkerProcess(limits) for _ in range(limits.workers)]
        # A lost worker is started again before its next call.
        self._workers = FairPool(self._all, WorkerProcess.start, limits.waiting)

    async def warm(self) -> None:
        """Start one worker ahead of the first call."""
        await self._all[0].start()

    @property
    def waiting(self) -> int:
        """How many calls wait for a worker."""
        return self._workers.waiting

    async def call(self, caller: str, kind: int, method: str, data: bytes, seconds: float) -> bytes:
        """Return the answer of a worker to a call of a kind of `worker_frames`; the time includes the wait for a worker.

        If its process dies, another one is asked once, because calls have no side effects.

        Raises:
            Refused: it is refused, too many wait already, or it took too long.
            FailedError: it failed.
        """
        frame, loop = worker_frames.Frame(kind, _NUMBERS.get(method, 0), data), asyncio.get_running_loop()
        until = loop.time() + seconds

        def left() -> float:
            return max(until - loop.time(), 0.001)

        died = None
        while True:
            try:
                return await self._workers.use(caller, lambda process: process.call(frame, left()), left())
            except asyncio.TimeoutError:
                if died is not None:
                    raise died.refused from None
                raise Refused("DEADLINE_EXCEEDED", f"no worker was free within {seconds:g} seconds") from None
            except WorkerLostError as error:
                self._lost(str(error))
                if died is not None or not isinstance(error, WorkerDiedError):
                    raise error.refused from None
                died = error

    async def close(self) -> None:
        """End all."""
        await asyncio.gather(*(each.close() for each in self._all))
