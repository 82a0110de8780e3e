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
    from collections.abc import Iterator

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
        self.sessions = 0


class Callers:
    """All who have calls under way."""

    def __init__(self, limits: Limits) -> None:
        """Let each have the share that the limits allow."""
        self._limits = limits
        self._calls = _part(limits.calls, limits.share)
        self._sessions = _part(limits.sessions, limits.share)
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
