"""Literal times of timers: durations and cycles of ISO 8601. Any other text fixes nothing."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import TYPE_CHECKING, Final

from cqos_core.bpmn.document import BPMN
from cqos_core.model.flow import Timer

if TYPE_CHECKING:
    from cqos_core.bpmn.element import Element

_NUMBER: Final = r"(\d{1,9}(?:[.,]\d{1,9})?)"
_DURATION: Final = re.compile(
    rf"P(?=[\dT])(?:{_NUMBER}Y)?(?:{_NUMBER}M)?(?:{_NUMBER}W)?(?:{_NUMBER}D)?"
    rf"(?:T(?=\d)(?:{_NUMBER}H)?(?:{_NUMBER}M)?(?:{_NUMBER}S)?)?",
    re.ASCII,
)
INFINITE: Final = 2**63 - 1
"""Nanoseconds of the shortest time that is too long to be one."""
_DAY: Final = 86_400
_SECONDS: Final = (365 * _DAY, 28 * _DAY, 7 * _DAY, _DAY, 3_600, 60, 1)
"""Of a year, a month, a week and so on; the shortest that there are."""
_CYCLE: Final = re.compile(r"R(-?\d{0,9})/(.+)", re.ASCII)
_DATE: Final = re.compile(r"\d{4}-\d\d-\d\d(?:T\d\d:\d\d(?::\d\d(?:\.\d{1,9})?)?Z?)?", re.ASCII)
_TEXTS: Final = {f"{BPMN}timeDate": "date", f"{BPMN}timeDuration": "duration", f"{BPMN}timeCycle": "cycle"}


def read_timer(definition: Element) -> Timer | None:
    """Return the timer that a ``timerEventDefinition`` states; None where it states none, or several."""
    stated = list(definition.having(*_TEXTS))
    if len(stated) != 1:
        return None
    (element,) = stated
    text = element.text.strip()
    kind = _TEXTS[element.tag]
    if kind == "date":
        return Timer("date", count=1 if _DATE.fullmatch(text) else None, text=text)
    if kind == "duration":
        wait = nanoseconds(text)
        open_ended = any(each in text.partition("T")[0] for each in "YM")
        return Timer("duration", wait, None if open_ended else wait, None if wait is None else 1, text)
    wait, count = _cycle(text)
    return Timer("cycle", wait, None, count, text)


def nanoseconds(text: str) -> int | None:
    """Return the shortest time that a duration of ISO 8601 may mean, None for any other text: ``PT6H``, ``P1M`` (28 days)."""
    found = _DURATION.fullmatch(text)
    if found is None:
        return None
    numbers = [Fraction(each.replace(",", ".")) if each else Fraction(0) for each in found.groups()]
    time = int(sum(number * seconds for number, seconds in zip(numbers, _SECONDS, strict=True)) * 10**9)
    return time if time < INFINITE else None


def _cycle(text: str) -> tuple[int | None, int | None]:
    """Return the time between two firings of ``R3/PT10S`` and how many there are at most, each None where it is open.

    Engines differ between k and k + 1 firings of ``Rk/…``. ``R``, ``R0`` and ``R-1`` go on for ever.
    """
    found = _CYCLE.fullmatch(text)
    if found is None:
        return None, None
    times, rest = found[1], found[2].split("/")
    waits = [wait for each in rest if (wait := nanoseconds(each)) is not None]
    # With a start or an end beside the duration the time between two firings is the same.
    if len(waits) != 1 or len(rest) > 2:  # noqa: PLR2004 - interval and one end
        return None, None
    repeated = int(times) if times not in {"", "-"} else 0
    return waits[0], repeated + 1 if repeated > 0 else None
