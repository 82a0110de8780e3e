"""Fair scheduler: gives a free worker to the caller with the least accumulated usage.

It counts time, not calls. So a caller that sends many large calls delays no caller that sends a small one now and then.
"""

from __future__ import annotations

import asyncio
import itertools
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Iterable
from dataclasses import field
from typing import Any, Final, Generic, TypeVar

from cqos_core.model.dataclass import dataclass
from cqos_core.remote.refusal import BUSY, CALLER_QUOTA, Refused

T = TypeVar("T")
R = TypeVar("R")
_REMEMBERED_SECONDS: Final = 60.0


@dataclass(slots=True, eq=False)
class _Share(Generic[T]):
    """The usage of one caller.

    Attributes:
        waiting: its queued calls, each with the number of its arrival.
        using: how many resources it uses at the moment.
        spent: seconds of use, counted from the level of the others when it came.
        seen: when it last began or ended a use.
    """

    spent: float
    seen: float
    waiting: deque[tuple[int, asyncio.Future[T]]] = field(default_factory=deque)
    using: int = 0

    @property
    def idle(self) -> bool:
        return not self.waiting and not self.using


class FairPool(Generic[T]):
    """A pool of resources, each used by one call at a time."""

    def __init__(
        self, resources: Iterable[T], restore: Callable[[T], Awaitable[None]], most_waiting: int | None = None
    ) -> None:
        """Share ``resources``; ``restore`` makes one ready after each use. At most ``most_waiting`` calls may wait; None: any number."""
        self._free = list(resources)[::-1]
        self._restore = restore
        # A caller that floods leaves one free for others, if there are several.
        self._most_using = max(len(self._free) - 1, 1)
        self._most_waiting = most_waiting
        self._waiting = 0
        self._shares: dict[str, _Share[T]] = {}
        self._served = 0.0
        self._arrivals = itertools.count()
        self._returning: set[asyncio.Task[None]] = set()

    @property
    def waiting(self) -> int:
        """How many calls wait for a resource."""
        return self._waiting

    async def use(self, caller: str, work: Callable[[T], Coroutine[Any, Any, R]], seconds: float | None = None) -> R:
        """Wait for a resource, and run ``work`` with it; the work is completed even if the caller is cancelled.

        Raises:
            TimeoutError: no resource was free within ``seconds``.
            Refused: too many wait, and most of them are this caller's.
        """
        share = self._share(caller)
        resource = await self._turn(share, seconds)
        doing = asyncio.ensure_future(work(resource))
        back = asyncio.ensure_future(self._return(share, resource, doing))
        self._returning.add(back)
        back.add_done_callback(self._returning.discard)
        return await asyncio.shield(doing)

    def _share(self, caller: str) -> _Share[T]:
        """Return the share of a caller, and drop shares that are idle for 60 s."""
        now = asyncio.get_running_loop().time()
        for name in [n for n, each in self._shares.items() if each.idle and each.seen < now - _REMEMBERED_SECONDS]:
            del self._shares[name]
        share = self._shares.setdefault(caller, _Share(self._served, now))
        if share.idle:  # an absent caller saves up no time
            share.spent = max(share.spent, self._served)
        share.seen = now
        return share

    async def _turn(self, share: _Share[T], seconds: float | None) -> T:
        if not self._free:
            self._make_room(share)
        turn: asyncio.Future[T] = asyncio.get_running_loop().create_future()
        mine = (next(self._arrivals), turn)
        share.waiting.append(mine)
        self._waiting += 1
        self._hand_out()
        try:
            await asyncio.wait({turn}, timeout=seconds)
        except asyncio.CancelledError:
            if turn.done() and turn.exception() is None:  # it came in the same moment
                self._give_back(share, turn.result())
            raise
        finally:
            if mine in share.waiting:
                share.waiting.remove(mine)
                self._waiting -= 1
        if not turn.done():
            raise asyncio.TimeoutError
        return turn.result()

    def _make_room(self, share: _Share[T]) -> None:
        """Evict the newest queued call of the caller with the longest queue.

        Raises:
            Refused: that is the caller of this call.
        """
        if self._most_waiting is None or self._waiting < self._most_waiting:
            return
        most = max(self._shares.values(), key=lambda each: len(each.waiting))
        if len(most.waiting) <= len(share.waiting) + 1:
            message = f"{self._waiting} calls wait already, {len(share.waiting)} of them yours; try again later"
            raise Refused("RESOURCE_EXHAUSTED", message, reason=BUSY)
        _, last = most.waiting.pop()
        self._waiting -= 1
        message = f"{len(most.waiting)} more calls of yours wait, and others need a place, too; send fewer at a time"
        last.set_exception(Refused("RESOURCE_EXHAUSTED", message, reason=CALLER_QUOTA))

    def _hand_out(self) -> None:
        while self._free:
            # Only a caller without others may use all.
            ready = [
                each
                for each in self._shares.values()
                if each.waiting and (each.using < self._most_using or len(self._shares) == 1)
            ]
            if not ready:
                return
            share = min(ready, key=lambda each: (each.using, each.spent, each.waiting[0][0]))
            _, turn = share.waiting.popleft()
            self._waiting -= 1
            share.using += 1
            self._served = max(self._served, share.spent)
            share.seen = asyncio.get_running_loop().time()
            turn.set_result(self._free.pop())

    async def _return(self, share: _Share[T], resource: T, doing: asyncio.Task[Any]) -> None:
        began = asyncio.get_running_loop().time()
        await asyncio.wait({doing})
        if not doing.cancelled():
            doing.exception()  # the caller may be gone; an exception that is not read is logged
        await self._restore(resource)
        share.spent += asyncio.get_running_loop().time() - began
        self._give_back(share, resource)

    def _give_back(self, share: _Share[T], resource: T) -> None:
        share.using -= 1
        share.seen = asyncio.get_running_loop().time()
        self._free.append(resource)
        self._hand_out()
