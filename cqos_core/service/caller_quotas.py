"""Quotas of callers: calls, bytes, sessions and processor time that each uses at the moment."""

from __future__ import annotations

import asyncio
import ipaddress
import re
import time
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, Final
from urllib.parse import unquote

from cqos_core.remote.refusal import BUSY, CALLER_QUOTA, Refused

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cqos_core.service.settings import Limits
    from cqos_core.service.telemetry import Meter

_IPV4: Final = 4
_IPV6_NETWORK: Final = 64
_OWN_PART: Final = 0.5
_ALL_PARTS: Final = 0.6
_AT_ONCE: Final = 4
"""The most calls of a caller for answers in the serving process; with more, workers answer all of them."""
_SAVED_SECONDS: Final = 0.1
_REMEMBERED_SECONDS: Final = 60.0
_MOST_REMEMBERED: Final = 10_000
_WATCHES_EACH: Final = 16
_WATCHES: Final = 256


class TimeBudget:
    """Seconds of processor time in the serving process: a part of elapsed time, saved up to a limit."""

    def __init__(self, part: float, saved: float = _SAVED_SECONDS) -> None:
        """Begin with the most that can be saved."""
        self._part = part
        self._most = self._left = saved
        self._seen = time.monotonic()

    @property
    def left(self) -> float:
        """Seconds that may be used now; negative after more was used."""
        now = time.monotonic()
        self._left = min(self._left + (now - self._seen) * self._part, self._most)
        self._seen = now
        return self._left

    def spend(self, seconds: float) -> None:
        """Subtract used seconds."""
        self._left -= seconds


class Caller:
    """A caller of the service.

    Attributes:
        name: its identity: a hash of its token, never the token.
        share: the part of all resources that it may use.
        turn: held while the serving process answers it, so that other callers come between two answers.
        budget: the time that it may use in the serving process; beyond that, workers answer it.
        seen: when it last called.
        going: how many of its calls are being evicted.
    """

    def __init__(self, name: str, share: float) -> None:
        """Begin with nothing."""
        self.name = name
        self.share = share
        self.turn = asyncio.Lock()
        self.budget = TimeBudget(_OWN_PART)
        self.seen = time.monotonic()
        self.calls = self.bytes = self.sessions = self.watches = self.kept = self.going = 0

    @property
    def idle(self) -> bool:
        """Whether it has no call, watch or session."""
        return not (self.calls or self.watches or self.sessions)


class SharedBytes:
    """A bounded number of bytes that callers share. If they are too many, those of the caller with the most are dropped."""

    def __init__(self, whole: int) -> None:
        """Hold at most ``whole`` bytes."""
        self.whole = whole
        self.held = 0
        self._sizes: dict[str, dict[object, tuple[int, Callable[[], None]]]] = {}

    def of(self, caller: str) -> int:
        """Return how many bytes a caller holds."""
        return sum(size for size, _ in self._sizes.get(caller, {}).values())

    def put(self, caller: Caller, key: object, size: int, drop: Callable[[], None]) -> bool:
        """Hold ``size`` bytes under a key, in place of its former ones; ``drop`` is called when they are evicted.

        Return whether there is room: not beyond the share of the caller, nor if no other caller holds more.
        """
        self.forget(caller.name, key)
        if self.of(caller.name) + size > max(_part(self.whole, caller.share), size if not self.held else 0):
            return False
        while self.held and self.held + size > self.whole:
            most = max(self._sizes, key=self.of)
            if self.of(most) <= self.of(caller.name) + size:
                return False
            first = next(iter(self._sizes[most]))
            _, gone = self._sizes[most][first]
            self.forget(most, first)
            gone()
        self._sizes.setdefault(caller.name, {})[key] = (size, drop)
        self.held += size
        return True

    def forget(self, caller: str, key: object) -> None:
        """Release the bytes of a key."""
        own = self._sizes.get(caller, {})
        if key in own:
            self.held -= own.pop(key)[0]
        if not own:
            self._sizes.pop(caller, None)


class Callers:
    """The callers with calls under way, and what each of them uses."""

    def __init__(self, limits: Limits, meter: Meter, shares: Mapping[str, float] | None = None) -> None:
        """Give each caller the share of the limits, or its own of ``shares``."""
        self._limits = limits
        self._meter = meter
        self._shares = shares or {}
        self._held = self.calls = self.watches = self.kept = self._going = 0
        self._waiting: dict[Caller, dict[object, Callable[[], None]]] = {}
        self.copies = SharedBytes(limits.bytes_kept)
        self._unread = SharedBytes(limits.bytes_together)
        self._known: dict[str, Caller] = {}
        self._budget = TimeBudget(_ALL_PARTS)

    def _caller(self, name: str) -> Caller:
        """Return the caller of a name; idle callers are forgotten after a while."""
        caller = self._known.get(name)
        if caller is None:
            now = time.monotonic()
            crowded = len(self._known) >= _MOST_REMEMBERED
            for gone in (
                [each for each in self._known.values() if each.idle] if crowded or not len(self._known) % 64 else ()
            ):
                if crowded or gone.seen < now - _REMEMBERED_SECONDS:
                    del self._known[gone.name]
            caller = self._known[name] = Caller(name, self._shares.get(name, self._limits.share))
        caller.seen = time.monotonic()
        return caller

    def may_answer_here(self, caller: Caller) -> bool:
        """Whether a caller, and all callers together, may use more time of the serving process."""
        return caller.calls <= _AT_ONCE and caller.budget.left > 0 and self._budget.left > 0

    def answered_here(self, caller: Caller, seconds: float) -> None:
        """Subtract the time of an answer in the serving process."""
        caller.budget.spend(seconds)
        self._budget.spend(seconds)

    async def time_for(self, caller: Caller) -> None:
        """Wait until a caller may use the serving process again."""
        while min(caller.budget.left, self._budget.left) <= 0:  # noqa: ASYNC110 - it refills with time
            await asyncio.sleep(_SAVED_SECONDS)

    @contextmanager
    def count_watch(self, name: str) -> Iterator[None]:
        """Count a stream that watches health; it needs no token, and does not count as a call.

        Raises:
            Refused: its caller has too many, or all have.
        """
        caller = self._caller(name)
        if caller.watches >= _WATCHES_EACH or self.watches >= _WATCHES:
            limit = f"one caller may watch {_WATCHES_EACH} times at once, all together {_WATCHES} times"
            raise Refused("RESOURCE_EXHAUSTED", f"{limit}; ask `Check` now and then", reason=CALLER_QUOTA)
        with _counted("watches", self, caller):
            yield

    @contextmanager
    def count_call(self, name: str) -> Iterator[Caller]:
        """Count a call.

        Raises:
            Refused: its caller has too many under way.
        """
        caller = self._caller(name)
        most = _part(self._limits.calls, caller.share)
        if caller.calls >= most:
            limit = f"one caller may have {most} of the {self._limits.calls} calls at the same time"
            raise Refused(
                "RESOURCE_EXHAUSTED",
                f"{limit}, and so many of yours are under way; send fewer at a time",
                reason=CALLER_QUOTA,
            )
        if self.calls - self._going >= self._limits.calls and not self._one_gives_way(caller):
            limit = f"{self.calls} calls are under way already, which is all that this service takes"
            raise Refused("RESOURCE_EXHAUSTED", f"{limit}; try again later", reason=BUSY)
        with _counted("calls", self, caller):
            yield caller

    def _one_gives_way(self, caller: Caller) -> bool:
        """Evict a waiting call of the caller with the most calls, if that has more than ``caller`` will have; return whether one was evicted."""
        most = max(self._waiting, key=lambda each: each.calls - each.going, default=None)
        if most is None or most.calls - most.going <= caller.calls + 1:
            return False
        _, give_way = self._waiting[most].popitem()
        if not self._waiting[most]:
            del self._waiting[most]
        most.going += 1
        self._going += 1
        give_way()
        return True

    @contextmanager
    def waiting_place(self, caller: Caller, give_way: Callable[[], None]) -> Iterator[None]:
        """Mark a call as waiting for a message of its caller; ``give_way`` is called when it is evicted, and must end the wait."""
        mine = object()
        self._waiting.setdefault(caller, {})[mine] = give_way
        try:
            yield
        finally:
            own = self._waiting.get(caller, {})
            if own.pop(mine, None) is None:
                caller.going -= 1
                self._going -= 1
            elif not own:
                del self._waiting[caller]

    @contextmanager
    def hold_answer(self, caller: Caller, size: int, drop: Callable[[], None]) -> Iterator[None]:
        """Count the bytes of an answer until it is read; ``drop`` is called when they are evicted.

        Raises:
            Refused: the caller, or all of them, have too many answers that they do not read.
        """
        key = object()
        if size > self._limits.inline_bytes and not self._unread.put(caller, key, size, drop):
            limit = f"this service keeps {self._unread.whole} bytes of answers that wait to be read"
            now = f"{self._unread.of(caller.name)} of them are yours, and this answer has {size} more"
            raise Refused("RESOURCE_EXHAUSTED", f"{limit}; {now}; read the answers before", reason=CALLER_QUOTA)
        try:
            yield
        finally:
            self._unread.forget(caller.name, key)

    @contextmanager
    def hold_request(self, caller: Caller) -> Iterator[Callable[[int], None]]:
        """Count the bytes of a request while it is under way; the yielded function adds bytes that arrived.

        Raises:
            Refused: the caller, or all callers, have too many; a request that needs no worker is never refused.
        """
        mine = 0

        def hold(size: int) -> None:
            nonlocal mine
            if mine + size > self._limits.inline_bytes:
                self._refuse_more(caller, size)
            mine += size
            self._count(caller, size)

        try:
            yield hold
        finally:
            self._count(caller, -mine)

    def _count(self, caller: Caller, more: int) -> None:
        caller.bytes += more
        self._held += more
        self._meter.add("bytes", more=more)

    def _refuse_more(self, caller: Caller, size: int) -> None:
        whole = self._limits.bytes_together
        most = max(_part(whole, caller.share), self._limits.message_bytes)
        if caller.bytes + size > most:
            limit = f"one caller may have {most} of the {whole} bytes of requests at the same time"
            now = f"of yours {caller.bytes} are under way, and these are {size} more; send fewer at a time"
            raise Refused("RESOURCE_EXHAUSTED", f"{limit}; {now}", reason=CALLER_QUOTA)
        if self._held + size > whole:
            limit = f"requests of {self._held} bytes are under way, and these are {size} more"
            limit += f", this service takes {whole} at the same time; try again later"
            raise Refused("RESOURCE_EXHAUSTED", limit, reason=BUSY)

    @contextmanager
    def count_session(self, caller: Caller) -> Iterator[None]:
        """Count a session.

        Raises:
            Refused: its caller has too many open.
        """
        most = _part(self._limits.sessions, caller.share)
        if caller.sessions >= most:
            limit = f"one caller may have {most} of the {self._limits.sessions} sessions"
            raise Refused(
                "RESOURCE_EXHAUSTED", f"{limit}, and so many of yours are open already; close one", reason=CALLER_QUOTA
            )
        with _counted("sessions", caller):
            yield

    @contextmanager
    def hold_session(self, caller: Caller) -> Iterator[Callable[[int], None]]:
        """Count the bytes that a session holds between calls; the yielded function sets their number.

        Raises:
            Refused: those of its caller, or of all, would be too many.
        """
        whole, mine = self._limits.bytes_kept, 0
        most = max(_part(whole, caller.share), self._limits.message_bytes)

        def keep(size: int) -> None:
            nonlocal mine
            more = size - mine
            if more > 0 and caller.kept + more > most:
                limit = f"one caller may have {most} of the {whole} bytes that open sessions hold"
                raise Refused("RESOURCE_EXHAUSTED", f"{limit}; close a session of yours", reason=CALLER_QUOTA)
            if more > 0 and self.kept + more > max(whole, self._limits.message_bytes):
                limit = f"open sessions hold {self.kept} of the {whole} bytes that this service has for them"
                raise Refused("RESOURCE_EXHAUSTED", f"{limit}; try again later", reason=BUSY)
            mine, caller.kept, self.kept = size, caller.kept + more, self.kept + more

        try:
            yield keep
        finally:
            keep(0)


@contextmanager
def _counted(what: str, *where: Caller | Callers) -> Iterator[None]:
    """Add one to a counter during the block."""
    for each in where:
        setattr(each, what, getattr(each, what) + 1)
    try:
        yield
    finally:
        for each in where:
            setattr(each, what, getattr(each, what) - 1)


def _part(whole: int, share: float) -> int:
    return max(int(whole * share), 1)


@lru_cache(maxsize=4_096)
def caller_address(peer: str) -> str:
    """Return the identity of a peer, which gRPC or HTTP gives as ``ipv4:192.0.2.1:5000``.

    It is the address of a machine, or its network for IPv6. On this machine it is the connection, because all peers share the
    address.
    """
    text = re.sub("^(ipv4:|ipv6:)+", "", unquote(peer))
    host = text.rpartition(":")[0].removeprefix("[").removesuffix("]")
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return text
    address = getattr(address, "ipv4_mapped", None) or address
    if address.is_loopback:
        return text
    return str(ipaddress.ip_network((address, _IPV6_NETWORK), strict=False) if address.version != _IPV4 else address)
