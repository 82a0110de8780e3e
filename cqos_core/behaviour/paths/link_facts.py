"""Reads the stated facts of links: rate, loss, MTU and round trip."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.paths.time_ranges import DURATION
from cqos_core.language.values import INFINITE
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InvalidValueError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.model.chains import StatedLink
    from cqos_core.model.settings import Place

_RATE: Final = re.compile(r"(?P<number>\d+(\.\d+)?)\s*(?P<factor>[kKMG]?)(?P<unit>bit|b|B)(/s|ps)")
_FACTORS: Final = {"": 1, "k": 1_000, "K": 1_000, "M": 1_000_000, "G": 1_000_000_000}
_LOSS: Final = re.compile(r"(?P<number>\d+(\.\d+)?)\s*(?P<percent>%)?")
_LEAST_MTU: Final = 68
_MOST_MTU: Final = 65_535


@dataclass(frozen=True, slots=True)
class LinkFault:
    """A value of a link that cannot be read."""

    message: str
    place: Place | None
    help: str


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """The stated facts of a link; None if not stated.

    Attributes:
        rate: bytes a second, in each direction.
        loss: part of the packets that are lost, from 0 to 1.
        mtu: bytes of the largest IP packet.
        round_trip: nanoseconds.
    """

    link: StatedLink
    rate: float | None = None
    loss: float | None = None
    mtu: int | None = None
    round_trip: int | None = None
    faults: tuple[LinkFault, ...] = ()


def facts_of(link: StatedLink) -> LinkFacts:
    """Return the facts of a link; a value that is unknown or cannot be read counts as not stated."""
    found: dict[str, float] = {}
    faults = []
    for name, setting in link.settings.items():
        if setting.unknown:
            continue
        try:
            found[name] = _READ[name](setting.text.strip())
        except InvalidValueError as error:
            message = f"link `{link.name}`: `{name}` cannot be read: {error.message}"
            faults.append(LinkFault(message, setting.place, error.advice()))
    whole = {name: int(found[name]) for name in ("mtu", "round_trip") if name in found}
    return LinkFacts(
        link=link,
        rate=found.get("rate"),
        loss=found.get("loss"),
        mtu=whole.get("mtu"),
        round_trip=whole.get("round_trip"),
        faults=tuple(faults),
    )


def _rate(text: str) -> float:
    match = _RATE.fullmatch(text)
    if match is None or float(match["number"]) == 0:
        raise InvalidValueError(f"`{text}` is no rate", "a rate such as 10Mbit/s, 250kbit/s or 1.5MB/s")
    return float(match["number"]) * _FACTORS[match["factor"]] / (1 if match["unit"] == "B" else 8)


def _loss(text: str) -> float:
    match = _LOSS.fullmatch(text)
    part = None if match is None else float(match["number"]) / (100 if match["percent"] else 1)
    if part is None or part > 1:
        raise InvalidValueError(f"`{text}` is no part of packets", "a part such as 1% or 0.01")
    return part


def _mtu(text: str) -> float:
    if not (text.isascii() and text.isdigit() and _LEAST_MTU <= int(text[:9]) <= _MOST_MTU):
        raise InvalidValueError(f"`{text}` is no MTU", f"a number of bytes from {_LEAST_MTU} to {_MOST_MTU}")
    return int(text)


def _round_trip(text: str) -> float:
    time = DURATION.parse(text)
    if time >= INFINITE:
        raise InvalidValueError(f"`{text}` is no time of a round trip", DURATION.expected())
    return time


_READ: Final[dict[str, Callable[[str], float]]] = {"rate": _rate, "loss": _loss, "mtu": _mtu, "round_trip": _round_trip}


def rate_text(rate: float) -> str:
    """Return a rate in bytes a second as bits: ``7.4Mbit/s``."""
    return f"{_with_letter(rate * 8)}bit/s"


def size_text(size: float) -> str:
    """Return a number of bytes: ``1.5MB``."""
    return f"{_with_letter(size)}B"


def _with_letter(number: float) -> str:
    """Return a number with three digits and a letter for its magnitude."""
    factor, letter = next(((many, name) for many, name in _LETTERS if number >= many), (1, ""))
    return f"{number / factor:{'.3g' if number < _THREE_DIGITS * factor else '.0f'}}{letter}"


_LETTERS: Final = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
_THREE_DIGITS: Final = 999
