"""Kinds of value as MQTT writes them: levels of QoS, whole seconds, sizes without limit."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

from cqos_core.model.problems import InvalidValueError
from cqos_core.packs import INFINITE, Choice, Count, Duration, Flag, Names, Plain, normalise

_S: Final = 1_000_000_000
EACH: Final = "each_message"
"""A broker saves each message before it acknowledges it."""
LONGEST: Final = 2**32 - 1
"""Four bytes of seconds; all bits set stand for never, where a field says so."""


def quality() -> Choice:
    """Return the domain of a QoS; a higher level is no stronger one in every respect, but it is granted as a maximum."""
    return Choice(
        "0",
        "1",
        "2",
        synonyms={
            "at_most_once": "0",
            "at_least_once": "1",
            "exactly_once": "2",
            **{f"{word}{level}": level for word in ("qos", "qos_") for level in "012"},
        },
    )


class Raised(Choice):
    """Whether QoS are raised, as the one to which they are: 0 is as good as not, 2 raises all."""

    flag: Final = Flag()

    def __init__(self) -> None:
        """Have the levels of a QoS, so that it can be compared with one."""
        super().__init__(*quality().names)

    def parse(self, text: str) -> int:
        """Read a flag."""
        return self.highest * self.flag.parse(text)

    def format(self, value: Plain) -> str:
        """Print a flag."""
        return self.flag.format(value)

    def candidates(self) -> tuple[Plain, ...]:
        """Both."""
        return (0, self.highest)

    def around(self, value: int) -> tuple[int, ...]:
        """Between the two is nothing."""
        return (value,)

    def expected(self) -> str:
        """Name both."""
        return self.flag.expected()

    def describe(self) -> dict[str, Any]:
        """Describe a flag."""
        return self.flag.describe()


class Seconds(Duration):
    """A whole number of seconds, as the fields of MQTT hold it; a bare number is in seconds."""

    step = _S

    def __init__(self, maximum: int = LONGEST) -> None:
        """``maximum`` is the largest number that the field has room for."""
        super().__init__(bare_unit="s", infinities=(LONGEST * _S,))
        self.maximum = maximum

    def parse(self, text: str) -> int:
        """Read ``60``, ``60s``, ``1min`` or ``infinite``."""
        value = super().parse(text)
        if value == INFINITE:
            return value
        if value % _S:
            raise InvalidValueError(f"`{text}` is no whole number of seconds", self.expected())
        if value > self.maximum * _S:
            raise InvalidValueError(f"`{text}` is more than the field has room for", self.expected())
        return value

    def expected(self) -> str:
        """Say the bounds."""
        return f"whole seconds from 0 to {self.maximum}, with or without unit"


class Saving(Duration):
    """How often a broker saves, in seconds as Mosquitto counts them: 0 is never, and `EACH` comes before any period."""

    def __init__(self) -> None:
        """A bare number is in seconds."""
        super().__init__(bare_unit="s")

    def parse(self, text: str) -> int:
        """Read ``30min``, ``infinite``, ``0`` for never, or ``each_message``."""
        if normalise(text) == EACH:
            return 0
        return super().parse(text) or INFINITE

    def format(self, value: Plain) -> str:
        """Print a duration, or `EACH`."""
        return super().format(value) if value else EACH

    def expected(self) -> str:
        """Name the words."""
        return f"{super().expected()}, 0 for never, or {EACH}"


class Access(Names):
    """Lines of access control: what, who, and on which filter."""

    what: Final = ("read", "write", "readwrite", "deny")

    def parse(self, text: str) -> tuple[str, ...]:
        """Read ``["read alice farm/#"]``."""
        # All clients of a broker have the same lines, perhaps thousands.
        return self._lines(text)

    @lru_cache(maxsize=16)  # noqa: B019 - there is one of these, for the whole process
    def _lines(self, text: str) -> tuple[str, ...]:
        lines = super().parse(text)
        for line in lines:
            parts = line.split(" ", 2)
            if len(parts) < 3 or parts[0] not in self.what:  # noqa: PLR2004 - what, who and the filter
                raise InvalidValueError(f"`{line}` is no line of access control", self.expected())
        return lines

    def expected(self) -> str:
        """Give the parts."""
        return f"a list of lines, each one of {', '.join(self.what)}, then the user (`*`, `-`), then the filter"


def unlimited(least: int = 1, most: int = LONGEST, unit: str = "") -> Count:
    """Return the domain of a limit that need not be there."""
    return Count(least, most, unlimited=("unlimited", "none", "no_limit"), unit=unit)
