"""Who calls, and how much of the service each of them has at the moment."""

from __future__ import annotations

import asyncio
import ipaddress
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, Final
from urllib.parse import unquote

from cqos_core.service.refusal import Refused

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.service.observing import Meter
    from cqos_core.service.settings import Limits

_IPV6_NETWORK: Final = 64


class Caller:
    """One who calls.

    Attributes:
        name: what tells it from others; a sum of its token at most, never the token.
        turn: held while something is answered in the process that serves: others come between two of its answers.
    """

    def __init__(self, name: str) -> None:
        """Begin with nothing."""
        self.name = name
        self.turn = asyncio.Lock()
        self.calls = 0
        self.bytes = 0
        self.sessions = 0


class Callers:
    """All who have calls under way."""

    def __init__(self, limits: Limits, meter: Meter) -> None:
        """Let each have the share that the limits allow."""
        self._limits = limits
        self._meter = meter
        self._calls = _part(limits.calls, limits.share)
        self._sessions = _part(limits.sessions, limits.share)
        self._bytes = max(_part(limits.bytes_together, limits.share), limits.message_bytes)
        self._held = 0
        self._known: dict[str, Caller] = {}

    @contextmanager
    def calling(self, name: str) -> Iterator[Caller]:
        """Count a call.

        Raises:
            Refused: its caller has too many under way.
        """
        caller = self._known.get(name) or Caller(name)
        if caller.calls >= self._calls:
            told = f"one caller may have {self._calls} of the {self._limits.calls} calls at the same time"
            raise Refused("RESOURCE_EXHAUSTED", f"{told}, and so many of yours are under way; send fewer at a time")
        self._known[name] = caller
        caller.calls += 1
        try:
            yield caller
        finally:
            caller.calls -= 1
            if not caller.calls:
                del self._known[name]

    @contextmanager
    def holding(self, caller: Caller) -> Iterator[Callable[[int], None]]:
        """Count the bytes of a request while it is under way: what is yielded is told how many have come.

        Raises:
            Refused: those of its caller, or of all, are too many; of a request that needs no worker they never are.
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
        self._meter.bytes(more)

    def _refuse_more(self, caller: Caller, size: int) -> None:
        whole = self._limits.bytes_together
        if caller.bytes + size > self._bytes:
            told = f"one caller may have {self._bytes} of the {whole} bytes of requests at the same time"
            now = f"of yours {caller.bytes} are under way, and these are {size} more; send fewer at a time"
            raise Refused("RESOURCE_EXHAUSTED", f"{told}; {now}")
        if self._held + size > whole:
            told = f"requests of {self._held} bytes are under way, and these are {size} more"
            raise Refused("RESOURCE_EXHAUSTED", f"{told}, this service takes {whole} at the same time; try again later")

    @contextmanager
    def editing(self, caller: Caller) -> Iterator[None]:
        """Count a session.

        Raises:
            Refused: its caller has too many open.
        """
        if caller.sessions >= self._sessions:
            told = f"one caller may have {self._sessions} of the {self._limits.sessions} sessions"
            raise Refused("RESOURCE_EXHAUSTED", f"{told}, and so many of yours are open already; close one")
        caller.sessions += 1
        try:
            yield
        finally:
            caller.sessions -= 1


def _part(whole: int, share: float) -> int:
    return max(int(whole * share), 1)


@lru_cache(maxsize=4_096)
def origin(peer: str) -> str:
    """Return what calls from one place have in common, of a peer as gRPC or HTTP tells it: ``ipv4:192.0.2.1:5000``.

    That is the address of a machine, of IPv6 its network; on this machine it is the connection, since all share an address.
    """
    text = unquote(peer)
    for scheme in ("ipv4:", "ipv6:"):
        text = text.removeprefix(scheme)
    host, _, _ = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return text
    if isinstance(address, ipaddress.IPv6Address):
        if address.ipv4_mapped is None:
            return text if address.is_loopback else str(ipaddress.ip_network((address, _IPV6_NETWORK), strict=False))
        address = address.ipv4_mapped
    return text if address.is_loopback else str(address)
