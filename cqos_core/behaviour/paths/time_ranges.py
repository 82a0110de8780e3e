"""Ranges of durations that are not known exactly."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final, NamedTuple

from cqos_core.language.domains import Duration
from cqos_core.language.values import INFINITE
from cqos_core.model.problems import InvalidValueError

DURATION: Final = Duration()
_EXPECTED: Final = "a range of durations such as <=20ms, 5ms..20ms, >=5ms, or one that is exact, such as 20ms"
_RANGE: Final = re.compile(r"(?P<sign><=|>=|≤|≥)?(?P<first>.*?)(\.\.(?P<last>.*))?", re.DOTALL)


class TimeRange(NamedTuple):
    """From ``low`` to ``high`` nanoseconds; ``high`` is None if there is no upper bound."""

    low: int = 0
    high: int | None = None

    def plus(self, other: TimeRange) -> TimeRange:
        """Return the range of the sum."""
        high = None if self.high is None or other.high is None else self.high + other.high
        return TimeRange(self.low + other.low, high)

    @property
    def spread(self) -> TimeRange:
        """The range of the difference of two values."""
        return TimeRange(0, None if self.high is None else self.high - self.low)

    def within(self, limit: int) -> bool | None:
        """Whether all values are at most ``limit``; False if none is, None if only some are."""
        if self.high is not None and self.high <= limit:
            return True
        return False if self.low > limit else None

    def __str__(self) -> str:
        """Return ``5ms to 20ms``, ``20ms``, ``5ms or more`` or ``not known``."""
        low = DURATION.format(self.low)
        if self.high is None:
            return f"{low} or more" if self.low else "not known"
        return low if self.high == self.low else f"{low} to {DURATION.format(self.high)}"


ANY_TIME: Final = TimeRange()
NO_TIME: Final = TimeRange(0, 0)


def covering_range(ranges: Iterable[TimeRange]) -> TimeRange:
    """Return the smallest range that covers some ranges, of which there is at least one."""
    lows, highs = zip(*ranges, strict=True)
    return TimeRange(min(lows), None if None in highs else max(highs))


def read_range(text: str) -> TimeRange:
    """Read ``<=20ms``, ``>=5ms``, ``5ms..20ms`` or ``20ms``.

    Raises:
        InvalidValueError: it is no range.
    """
    found = _RANGE.fullmatch(text.strip())
    if found is None or (found["sign"] and found["last"] is not None):
        raise InvalidValueError(f"`{text}` is no range of durations", _EXPECTED)
    try:
        first, last = (
            DURATION.parse(found[name]) for name in ("first", "last" if found["last"] is not None else "first")
        )
    except InvalidValueError as error:
        raise InvalidValueError(str(error), _EXPECTED, error.near) from None
    if first >= INFINITE:
        raise InvalidValueError(f"`{text}` bounds nothing", _EXPECTED)
    if last < first:
        raise InvalidValueError(f"`{text}` begins after its end", _EXPECTED)
    low = 0 if found["sign"] in {"<=", "≤"} else first
    return TimeRange(low, None if found["sign"] in {">=", "≥"} or last >= INFINITE else last)
