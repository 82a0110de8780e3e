"""The kinds of values: each reads text, prints values, and knows its smallest and its largest value."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import timedelta
from itertools import accumulate
from typing import Any, Final, TypeAlias

from cqos_core.language.values import INFINITE, Plain, normalise
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.regular_expressions import regular_expression


def flow(text: str, expected: str = "") -> Any:
    """Read YAML flow spelling with every scalar left as text.

    Raises:
        InvalidValueError: where the text is no YAML, or nested so deep that the parser's stack might not hold it.
    """
    if _LIST.fullmatch(text):
        return text[1:-1].split(", ") if len(text) > len("[]") else []
    if _MAP.fullmatch(text):
        return dict(each.split(": ") for each in text[1:-1].split(", "))
    import yaml  # 11 ms of a start, where no text needs it

    depths = accumulate(1 if bracket in "[{" else -1 for bracket in _BRACKETS.findall(text))
    if max(depths, default=0) > _MAXIMUM_DEPTH:
        raise InvalidValueError(f"`{text[:60]}` is nested deeper than {_MAXIMUM_DEPTH} levels", expected)
    try:
        return yaml.load(text, Loader=getattr(yaml, "CBaseLoader", yaml.BaseLoader))  # noqa: S506 - makes text only
    except (yaml.YAMLError, UnicodeError) as error:
        raise InvalidValueError(f"`{text[:60]}` cannot be read: {str(error).splitlines()[0]}", expected) from None


_LIST: Final = regular_expression(r"\[(?:\w+(?:, \w+)*)?\]", re.ASCII)
_MAP: Final = regular_expression(r"\{\w{1,99}: \w+(?:, \w{1,99}: \w+)*\}", re.ASCII)
_BRACKETS: Final = regular_expression(r"[\[{}\]]")
_MAXIMUM_DEPTH: Final = 200
_TRUE: Final = frozenset({"true", "1", "yes", "on"})
_FALSE: Final = frozenset({"false", "0", "no", "off"})
_FLAG_LETTERS: Final = {"t": "true", "y": "true", "enabled": "true", "f": "false", "n": "false", "disabled": "false"}
_LARGEST_ESCAPE: Final = 0xFFFF


class Domain:
    """A kind of value: reads text, prints values, and knows its smallest and largest value."""

    kind: str = "text"
    ordered: bool = False
    lowest: int = 0
    highest: int = INFINITE
    example: str = "text"

    def parse(self, text: str) -> Plain:
        """Read ``text``; raise `InvalidValueError` where it is none of this domain's values."""
        raise NotImplementedError

    def read(self, text: str) -> Plain | None:
        """Read ``text``; None where it is none of this domain's values."""
        try:
            return self.parse(text)
        except InvalidValueError:
            return None

    def format(self, value: Plain) -> str:
        """Print ``value`` so that `parse` reads it back."""
        return str(value)

    def word(self, text: str) -> str:
        """Normalise ``text`` for comparison with special words."""
        return normalise(text)

    def with_unit(self, text: str, unit: str | None) -> str:  # noqa: ARG002 - for durations
        """Add the unit that a file format fixes to a number without one."""
        return text

    def candidates(self) -> tuple[Plain, ...]:
        """All values where they are few, else nothing."""
        return ()

    def has(self, value: Plain) -> bool:
        """Whether ``value`` is one of this domain's values."""
        return not isinstance(value, int) or self.lowest <= value <= self.highest

    def around(self, value: int) -> tuple[int, ...]:
        """Return the values at and next to a number, as candidates for fixes."""
        return (value, value + 1, value - 1)

    def expected(self) -> str:
        """Return the allowed values, for messages."""
        return self.example

    def describe(self) -> dict[str, Any]:
        """Describe the domain for machines."""
        return {"kind": self.kind, "ordered": self.ordered}

    def refused(self, message: str, near: str | None = None) -> InvalidValueError:
        """Return the error for a text that is none of this domain's values."""
        return InvalidValueError(message, self.expected(), near or "")


_DENIAL: Final = regular_expression(r"(?:\b|_)(?:not?|non|un|never)_?$")
"""The end of a prefix that negates a name: `not_reliable`, `unreliable`."""


class Choice(Domain):
    """One of a few names, weakest first where they are ordered.

    ``affixes`` are spellings found around the names in the wild (``_reliability_qos``, ``rmw_qos_policy_reliability_``),
    ``synonyms`` maps other normalised spellings to names.
    """

    kind = "choice"

    def __init__(
        self,
        *names: str,
        ordered: bool = True,
        affixes: tuple[str, ...] = (),
        synonyms: Mapping[str, str] | None = None,
    ) -> None:
        """List the canonical names, weakest first."""
        self.names = names
        self.ordered = ordered
        self.affixes = affixes
        self.synonyms = dict(synonyms or {})
        self.highest = len(names) - 1
        self._ranks = {name: rank for rank, name in enumerate(names)}

    def word(self, text: str) -> str:
        """Normalise ``text`` and take known affixes and synonyms away."""
        word = normalise(text)
        for affix in self.affixes:
            if affix.endswith("_") and word.startswith(affix):
                word = word.removeprefix(affix)
            elif affix.startswith("_") and word.endswith(affix):
                word = word.removesuffix(affix)
        return self.synonyms.get(word, word)

    def parse(self, text: str) -> int:
        """Read a name, its synonyms or affixed spellings into its rank."""
        rank = self._ranks.get(word := self.word(text))
        if rank is None:
            from cqos_core.model.spelling import nearest, same_start

            # A program writes `Policy.VALUE` or `Policy::VALUE`.
            last = self.word(re.split(r"\.|::", text)[-1])
            near = last if last in self._ranks else nearest(word, self.names) or same_start(word, self.names)
            denied = near is not None and _DENIAL.search(word.removesuffix(near)) is not None
            raise self.refused(f"`{text}` is not one of its values", None if denied else near)
        return rank

    def format(self, value: Plain) -> str:
        """Print the name of a rank."""
        return self.names[int(value)]  # type: ignore[arg-type]

    def candidates(self) -> tuple[Plain, ...]:
        """All ranks."""
        return tuple(range(len(self.names)))

    def around(self, value: int) -> tuple[int, ...]:
        """Without an order, no value is next to another."""
        return super().around(value) if self.ordered else (value,)

    def expected(self) -> str:
        """List the names in their order."""
        return (" < " if self.ordered else ", ").join(self.names)

    def describe(self) -> dict[str, Any]:
        """Add the values."""
        return {**super().describe(), "values": list(self.names)}


_UNITS: Final = {
    "ns": 1,
    "us": 1_000,
    "µs": 1_000,
    "μs": 1_000,
    "ms": 1_000_000,
    "s": 1_000_000_000,
    "sec": 1_000_000_000,
    "m": 60_000_000_000,
    "min": 60_000_000_000,
    "h": 3_600_000_000_000,
    "d": 86_400_000_000_000,
    "nanosecond": 1,
    "nanoseconds": 1,
    "seconds": 1_000_000_000,
}
_PRINTED: Final = tuple((unit, _UNITS[unit]) for unit in ("d", "h", "min", "s", "ms", "us"))
_NUMBER: Final = r"\d{1,30}(?:\.\d{1,30})?"
_DURATION: Final = regular_expression(rf"(?:{_NUMBER}\s*[a-zµμ]+\s*)+", re.IGNORECASE)
_DURATION_PART: Final = regular_expression(rf"({_NUMBER})\s*([a-zµμ]+)", re.IGNORECASE)
_ISO: Final = regular_expression(
    rf"P(?:(?P<w>{_NUMBER})W)?(?:(?P<d>{_NUMBER})D)?"
    rf"(?:T(?:(?P<h>{_NUMBER})H)?(?:(?P<m>{_NUMBER})M)?(?:(?P<s>{_NUMBER})S)?)?",
    re.IGNORECASE,
)
_ISO_UNITS: Final = _UNITS | {"w": 7 * _UNITS["d"]}
_BARE: Final = regular_expression(_NUMBER)
_MISTAKEN: Final = {
    **dict.fromkeys(("msec", "msecs", "milli", "millis", "millisec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("usec", "usecs", "micro", "micros", "microsec", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("nsec", "nsecs", "nano", "nanos", "nanosec"), "ns"),
    **dict.fromkeys(("second", "secs", "sek", "sekunde", "sekunden"), "s"),
    **dict.fromkeys(("mins", "minute", "minutes", "minuten"), "min"),
    **dict.fromkeys(("hr", "hrs", "hour", "hours", "stunde", "stunden"), "h"),
    **dict.fromkeys(("day", "days", "tag", "tage"), "d"),
}
"""Units as people spell them, which are not read, and what to write."""


def is_unit(unit: str | None) -> bool:
    """Whether bare numbers may be read in ``unit``; None, which refuses them, is fine."""
    return unit is None or unit in _UNITS


_INFINITE_WORDS: Final = frozenset({"infinite", "infinity", "inf", ".inf", "duration_infinity", "never"})
_SECONDS_KEYS: Final = ("sec", "secs", "seconds")
_NANOSECONDS_KEYS: Final = ("nsec", "nsecs", "nanosec", "nanoseconds")


class Duration(Domain):
    """A time span in integer nanoseconds, or infinite; never negative.

    ``infinities`` are nanosecond totals that some vendor writes for infinite. A value as large as the largest
    representable one is infinite too. ``step`` is the smallest difference of two values, in nanoseconds.
    """

    kind = "duration"
    ordered = True
    example = "a duration such as 2s, 500ms, 1.5h, PT2S, or infinite"
    step: int = 1

    def __init__(
        self,
        *,
        infinities: tuple[int, ...] = (),
        bare_unit: str | None = None,
        words: Mapping[int, str] | None = None,
    ) -> None:
        """``bare_unit`` is the unit of a number without one, where a format fixes it (``s``); None refuses it.

        ``words`` are nanosecond totals that stand for a special word of the policy.
        """
        self.infinities = frozenset(infinities)
        self.words = dict(words or {})
        self.bare_unit = bare_unit

    def word(self, text: str) -> str:
        """Normalise ``text``; a total that stands for a word is that."""
        if self.words and len(text) >= _DIGITS_OF_A_MARK and any(map(str.isdigit, text)):
            try:
                return self.words.get(self._total(self.with_unit(text.strip(), "ns")), normalise(text))
            except InvalidValueError:
                pass
        return normalise(text)

    def parse(self, text: str) -> int:
        """Read ``2s``, ``500ms``, ``1.5h``, ``PT2S``, ``{sec: 2, nsec: 0}`` or ``infinite``."""
        stripped = text.strip()
        if whole := _WHOLE.fullmatch(stripped):
            total = int(whole[1]) * _UNITS[whole[2]]
        elif normalise(stripped) in _INFINITE_WORDS:
            return INFINITE
        else:
            total = self._total(stripped)
        return INFINITE if total >= INFINITE or total in self.infinities else total

    def _total(self, text: str) -> int:
        if text.startswith("{"):
            return _from_fields(text)
        if parts := _parts(text):
            return sum(_nanoseconds(number, unit, text) for number, unit in parts)
        if re.fullmatch(r"-\s*[\d.].*", text):
            raise self.refused(f"`{text}` is negative")
        if re.fullmatch(r"\+?[\d.]+(?:e[+-]?\d+)?", text, re.IGNORECASE):
            return self._bare(text, self.bare_unit)
        from decimal import Decimal  # it takes 1 ms to import, and durations are mostly stated with their unit

        rate = _RATE.fullmatch(text)
        if rate is not None and (hertz := Decimal(rate["number"])) > 0:
            period = self.format(round(_SECOND / (hertz * _RATES[rate["unit"].lower()])))
            raise self.refused(f"`{text}` is a rate, not a duration; its period is {period}", period)
        if (called := _CALL.fullmatch(text)) is not None:
            spans = [(called["number"], _CALLED.get((called["word"] or called["name"]).lower(), 0))]
            if called["rest"] is not None:
                spans = [(called["number"], _UNITS["s"]), (called["rest"], 1)]
            if all(unit for _, unit in spans):
                near = self.format(sum(_nanoseconds(number, unit, text) for number, unit in spans))
                raise self.refused(f"`{text}` is not a duration", near)
        if "_" in text and _parts(joined := text.replace("_", "")):
            raise self.refused(f"`{text}` is not a duration", joined)
        meant = _BARE.match(text)
        unit = _MISTAKEN.get(text[meant.end() :].strip().lower(), "") if meant else ""
        raise self.refused(f"`{text}` is not a duration", f"{meant[0]}{unit}" if meant and unit else "")

    def _bare(self, text: str, unit: str | None) -> int:
        from decimal import Decimal, InvalidOperation

        try:
            number = Decimal(text)
        except InvalidOperation:
            raise self.refused(f"`{text}` is not a number") from None
        if number == 0:
            return 0
        if unit is None:
            whole = f"0{text}" if text.startswith(".") else text
            raise InvalidValueError(f"`{text}` has no unit", f"a unit after it, for instance {whole}s or {whole}ms")
        if number.adjusted() > _LARGEST_EXPONENT:
            return INFINITE
        if number.adjusted() < -_LARGEST_EXPONENT:
            raise InvalidValueError(f"`{text}` is finer than a nanosecond", "whole nanoseconds")
        return _nanoseconds(f"{number:f}", _UNITS[unit], text)

    def with_unit(self, text: str, unit: str | None) -> str:
        """Add ``unit`` to a bare number."""
        return f"{text}{unit}" if unit is not None and _BARE.fullmatch(text.strip()) else text

    def format(self, value: Plain) -> str:
        """Print in the largest unit that is exact: ``2s``, ``500ms``, ``infinite``."""
        number = int(value)  # type: ignore[arg-type]
        if number >= INFINITE:
            return "infinite"
        if number == 0:
            return "0s"
        for unit, size in _PRINTED:
            if number % size == 0:
                return f"{number // size}{unit}"
        return f"{number}ns"

    def around(self, value: int) -> tuple[int, ...]:
        """Return the neighbours in steps of `step`; nothing is next to zero and to infinite but zero and infinite."""
        if value <= 0 or value >= INFINITE:
            return (max(0, min(value, INFINITE)), INFINITE)
        below, above = value - value % self.step, value + -value % self.step
        near = (below, above) if below != above else (below, below + self.step, below - self.step)
        return (*(each for each in near if each), INFINITE)

    def describe(self) -> dict[str, Any]:
        """Add the unit."""
        return {**super().describe(), "unit": "ns"}


_WHOLE_NUMBER: Final = regular_expression(r"[+-]?\d{1,20}")
_WHOLE: Final = regular_expression(r"([0-9]{1,18})(ns|us|ms|s)")  # the usual spelling
_LARGEST_EXPONENT: Final = 30
_MOST_DIGITS: Final = 64
_SECOND: Final = 1_000_000_000
_RATES: Final = {"hz": 1, "fps": 1, "khz": 1_000}
_RATE: Final = regular_expression(r"(?P<number>\d{1,9}(?:\.\d{1,9})?)\s*(?P<unit>k?hz|fps)", re.IGNORECASE)
_CALL: Final = regular_expression(
    r"(?:\w+(?:\.|::))*(?P<name>\w+)[({]\s*(?:(?P<word>\w+)\s*=\s*)?(?P<number>\d{1,12}(?:\.\d{1,9})?)\s*(?:,\s*(?P<rest>\d{1,9})\s*)?[)}]"
)
_CALLED: Final = {
    **dict.fromkeys(("s", "sec", "seconds", "from_seconds"), 1_000_000_000),
    **dict.fromkeys(("ms", "msec", "milliseconds"), 1_000_000),
    **dict.fromkeys(("us", "usec", "microseconds"), 1_000),
    **dict.fromkeys(("ns", "nsec", "nanosec", "nanoseconds"), 1),
    **dict.fromkeys(("minutes",), 60_000_000_000),
}
"""Functions and arguments of programs that make a time span of a number."""
_DIGITS_OF_A_MARK: Final = 19
"""Characters of a total near the largest one; shorter texts are no such mark and need not be read for it."""


def _parts(text: str) -> list[tuple[str, int]]:
    """The numbers of a time span, each with its unit; none where the text has another form."""
    if _DURATION.fullmatch(text):
        parts = [(number, _UNITS.get(unit.lower(), 0)) for number, unit in _DURATION_PART.findall(text)]
        if all(unit for _, unit in parts):
            return parts
    iso = _ISO.fullmatch(text)
    return [] if iso is None else [(number, _ISO_UNITS[unit]) for unit, number in iso.groupdict().items() if number]


def _nanoseconds(number: str, unit: int, text: str) -> int:
    whole, _, fraction = number.partition(".")
    digits = whole + fraction.rstrip("0")
    exact, rest = (
        divmod(int(digits) * unit, 10 ** (len(digits) - len(whole))) if len(digits) <= _MOST_DIGITS else (0, 1)
    )
    if rest:
        raise InvalidValueError(f"`{text}` is finer than a nanosecond", "whole nanoseconds")
    return exact


def _from_fields(text: str) -> int:
    fields = flow(text, "{sec: 2, nsec: 0}")
    if not isinstance(fields, dict) or not fields:
        raise InvalidValueError(f"`{text}` is not a duration", "{sec: 2, nsec: 0}")
    total = 0
    for key, number in fields.items():
        unit = _UNITS["s"] if key in _SECONDS_KEYS else 1 if key in _NANOSECONDS_KEYS else None
        if unit is None or not isinstance(number, str) or not re.fullmatch(r"\d{1,20}", number):
            raise InvalidValueError(
                f"`{key}: {number}` is no part of a duration",
                "{sec: 2, nsec: 0} with whole numbers that are not negative",
            )
        total += int(number) * unit
    return total


class Count(Domain):
    """A whole number; ``unlimited`` lists spellings of no limit."""

    kind = "count"
    ordered = True

    def __init__(
        self, minimum: int = 0, maximum: int = 2**31 - 1, *, unlimited: tuple[str, ...] = (), unit: str = ""
    ) -> None:
        """Bounds are inclusive; ``unit`` is for people (``bytes``)."""
        self.lowest = minimum
        self.maximum = maximum
        self.unlimited = unlimited
        self.highest = INFINITE if unlimited else maximum
        self.unit = unit

    def parse(self, text: str) -> int:
        """Read a whole number within the bounds, or a word for unlimited."""
        if self.unlimited and (normalise(text) in self.unlimited or text.strip() in self.unlimited):
            return INFINITE
        if not _WHOLE_NUMBER.fullmatch(text.strip()):
            raise self.refused(f"`{text}` is not a whole number")
        number = int(text)
        if not self.lowest <= number <= self.maximum:
            raise self.refused(f"`{text}` is out of range")
        return number

    def around(self, value: int) -> tuple[int, ...]:
        """Return the value, its neighbours, and no limit; nothing is next to no limit."""
        near = (value, value + 1, value - 1) if value < INFINITE else ()
        return (*near, INFINITE) if self.unlimited else near

    def has(self, value: Plain) -> bool:
        """Whether it is within the bounds, or unlimited where that is allowed."""
        number = int(value)  # type: ignore[arg-type]
        return self.lowest <= number <= self.maximum or (bool(self.unlimited) and number == INFINITE)

    def format(self, value: Plain) -> str:
        """Print the number, or the first word for unlimited."""
        return self.unlimited[0] if self.unlimited and value == INFINITE else str(value)

    def expected(self) -> str:
        """Say the bounds."""
        words = f", or {self.unlimited[0]}" if self.unlimited else ""
        return f"a whole number from {self.lowest} to {self.maximum}{words}"

    def describe(self) -> dict[str, Any]:
        """Add bounds, unit and the word for unlimited."""
        bounds = {"minimum": self.lowest, "maximum": self.maximum, "unit": self.unit}
        return {**super().describe(), **bounds, "unlimited": self.unlimited[0] if self.unlimited else None}


class Flag(Domain):
    """True or false; false < true."""

    kind = "flag"
    example = "true or false"
    ordered = True
    highest = 1

    def parse(self, text: str) -> int:
        """Read ``true`` or ``false``, also ``1 0 yes no on off``."""
        word = normalise(text)
        if word in _TRUE or word in _FALSE:
            return int(word in _TRUE)
        from cqos_core.model.spelling import nearest

        near = _FLAG_LETTERS.get(word) or nearest(word, ("true", "false"))
        raise self.refused(f"`{text}` is neither true nor false", near)

    def format(self, value: Plain) -> str:
        """Print ``true`` or ``false``."""
        return "true" if value else "false"

    def candidates(self) -> tuple[Plain, ...]:
        """Both."""
        return (0, 1)


class Names(Domain):
    """A list of names, such as partitions; order is kept."""

    kind = "names"
    example = "a list of names such as [a, b]"

    def parse(self, text: str) -> tuple[str, ...]:
        """Read ``[a, b]``; a single bare name is a list of one."""
        if not text.strip().startswith("["):
            return (text.strip(),) if text.strip() else ()
        read = flow(text, self.expected())
        if not isinstance(read, list) or not all(isinstance(item, str) for item in read):
            raise self.refused(f"`{text}` is not a list of names")
        return tuple(read)

    def format(self, value: Plain) -> str:
        """Print in YAML flow form."""
        import json

        names: tuple[str, ...] = value  # type: ignore[assignment]
        plain = re.compile(r"[A-Za-z_/][\w/.]*")
        words = (n if plain.fullmatch(n) else _escaped(json.dumps(n, ensure_ascii=False)) for n in names)
        return f"[{', '.join(words)}]"


def _escaped(text: str) -> str:
    """Write out what YAML allows only as an escape; it has none for pairs of surrogates, which JSON writes."""
    return "".join(c if c.isprintable() or ord(c) > _LARGEST_ESCAPE else f"\\u{ord(c):04x}" for c in text)


class Text(Domain):
    """Free text, compared for equality only."""

    def parse(self, text: str) -> str:
        """Keep the text."""
        return text


SettingValue: TypeAlias = "str | int | bool | timedelta | Sequence[str]"


def as_text(value: SettingValue) -> str:
    """Write a Python value in the spelling of the YAML form; raise `TypeError` for a type that has none."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, timedelta):
        return f"{(value.days * 86_400 + value.seconds) * 10**9 + value.microseconds * 1_000}ns"
    if isinstance(value, int):
        return "infinite" if value == INFINITE else str(value)
    if isinstance(value, (list, tuple)):
        return Names().format(tuple(value))
    raise TypeError(f"{value!r} is no setting: give text, int, bool, timedelta, INFINITE or a list of names")
