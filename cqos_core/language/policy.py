"""Policies: their domains, how values are read and printed, and values that are not known for certain.

Inside, a plain value is an integer (the rank of a choice, nanoseconds, a count, a flag), a text, or a tuple of
texts; so every comparison of the language is a comparison of plain Python values, and of column values too.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from cqos_core.language.expression import Term
from cqos_core.model.memory import LONGEST_REMEMBERED
from cqos_core.model.problems import InvalidValueError

if TYPE_CHECKING:
    from collections.abc import Mapping

INFINITE: Final = 2**63 - 1
"""An infinite duration in nanoseconds, and an unlimited count."""


@dataclass(frozen=True, slots=True)
class Anything:
    """Any value of the policy's domain; ``cause`` says why it is not known.

    ``code``: of the finding that reports the cause, so that what follows from it needs none of its own.
    """

    cause: str
    code: str = ""

    @property
    def told(self) -> bool:
        """Whether the cause is a finding of its own."""
        return bool(self.code)


@dataclass(frozen=True, slots=True)
class Depends:
    """A value that depends on an assumption: ``on`` names it (``ros2.rmw``), ``cases`` give the value under each."""

    on: str
    cases: tuple[tuple[str, Value], ...]


@dataclass(frozen=True, slots=True)
class FromPeers:
    """A value taken from the other side when the endpoint is created; `settle` turns it into a plain one or `Depends`.

    A bridge may also copy what it does not meet itself: on its publishing side what publishers offer on its other one.

    Attributes:
        alone: the value without any peer, as text.
        peers: how the peers' values are put together: ``largest``, ``largest_stated``, ``smallest_stated``,
            ``strongest_if_all``, ``strongest_if_any``, ``any`` (that of whichever is found first) or ``constant`` (always
            ``alone``).
        waits: the endpoint is created only when a peer is there, so ``alone`` counts only where peers differ.
        side: who is copied: its ``peers``; the ``publishers`` or the ``subscribers``, over a bridge where it is one of them
            itself; or of both sides those that are there ``first``.
    """

    alone: str
    peers: str
    waits: bool = False
    side: Literal["peers", "publishers", "subscribers", "first"] = "peers"


@dataclass(frozen=True, slots=True)
class OneOf:
    """A word of an option that leaves open which of several values it has: a vendor's name without its version."""

    values: tuple[str, ...]


Plain: TypeAlias = int | str | tuple[str, ...]
Value: TypeAlias = Plain | Anything | Depends | FromPeers


COMBINATIONS: Final = (
    "any",
    "constant",
    "largest",
    "largest_stated",
    "smallest_stated",
    "strongest_if_all",
    "strongest_if_any",
)
"""What `FromPeers.peers` may be."""


def is_plain(value: Value) -> bool:
    """Whether the value is known for certain."""
    return isinstance(value, (int, str, tuple))


@dataclass(frozen=True, slots=True)
class PerRole:
    """A word that means different things for publishers and subscribers."""

    publisher: Meaning
    subscriber: Meaning


@dataclass(frozen=True, slots=True)
class ByOption:
    """A word whose meaning depends on a deployment option; ``otherwise`` serves the values not listed."""

    option: str
    meanings: tuple[tuple[str, Meaning], ...]
    otherwise: Meaning | None = None


ANYTHING: Final = Anything("its value is not known")
Meaning: TypeAlias = str | PerRole | ByOption | Anything | FromPeers | OneOf


def by_option(option: str, otherwise: Meaning | None = None, **meanings: Meaning) -> ByOption:
    """Write a `ByOption` like a sentence: ``by_option("rmw", cyclonedds="reliable", zenoh="best_effort")``."""
    return ByOption(option, tuple(meanings.items()), otherwise)


def normalise(text: str) -> str:
    """``Keep Last`` → ``keep_last``: lower case, blanks and hyphens as underscores."""
    return _remembered(text) if len(text) <= LONGEST_REMEMBERED else _normalised(text)


def _normalised(text: str) -> str:
    return re.sub(r"[\s\-]+", "_", text.strip()).lower()


_remembered = lru_cache(maxsize=16_384)(_normalised)


def flow(text: str, expected: str = "") -> Any:
    """Read YAML flow spelling with every scalar left as text.

    Raises:
        InvalidValueError: where the text is no YAML, or nested so deep that the parser's stack might not hold it.
    """
    import yaml

    depth = deepest = 0
    for bracket in _BRACKETS.findall(text):
        depth += 1 if bracket in "[{" else -1
        deepest = max(deepest, depth)
    if deepest > _MAXIMUM_DEPTH:
        raise InvalidValueError(f"`{text[:60]}` is nested deeper than {_MAXIMUM_DEPTH} levels", expected)
    try:
        return yaml.load(text, Loader=getattr(yaml, "CBaseLoader", yaml.BaseLoader))  # noqa: S506 - makes text only
    except (yaml.YAMLError, UnicodeError) as error:
        message = f"`{text[:60]}` cannot be read: {str(error).splitlines()[0]}"
        raise InvalidValueError(message, expected) from None


_BRACKETS: Final = re.compile(r"[\[{}\]]")
_MAXIMUM_DEPTH: Final = 200


class Domain:
    """A kind of value: reads text, prints values, and knows its smallest and largest value."""

    kind: str = "text"
    ordered: bool = False
    lowest: int = 0
    highest: int = INFINITE

    def parse(self, text: str) -> Plain:
        """Read ``text``; raise `InvalidValueError` where it is none of this domain's values."""
        raise NotImplementedError

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
        """What is allowed, for messages."""
        return "text"

    def describe(self) -> dict[str, Any]:
        """Describe the domain for machines."""
        return {"kind": self.kind, "ordered": self.ordered}


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
        word = self.word(text)
        rank = self._ranks.get(word)
        if rank is None:
            from cqos_core.model.spelling import nearest

            near = nearest(word, self.names) or ""
            raise InvalidValueError(f"`{text}` is not one of its values", self.expected(), near)
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
        if self.ordered and len(self.names) > 1:
            return " < ".join(self.names)
        return ", ".join(self.names)

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
_PRINTED: Final = ("d", "h", "min", "s", "ms", "us", "ns")
_NUMBER: Final = r"\d{1,30}(?:\.\d{1,30})?"
_DURATION: Final = re.compile(rf"(?:{_NUMBER}\s*[a-zµμ]+\s*)+", re.IGNORECASE)
_DURATION_PART: Final = re.compile(rf"({_NUMBER})\s*([a-zµμ]+)", re.IGNORECASE)
_ISO: Final = re.compile(
    rf"P(?:(?P<w>{_NUMBER})W)?(?:(?P<d>{_NUMBER})D)?"
    rf"(?:T(?:(?P<h>{_NUMBER})H)?(?:(?P<m>{_NUMBER})M)?(?:(?P<s>{_NUMBER})S)?)?",
    re.IGNORECASE,
)
_ISO_UNITS: Final = {
    "w": 7 * _UNITS["d"],
    "d": _UNITS["d"],
    "h": _UNITS["h"],
    "m": _UNITS["m"],
    "s": _UNITS["s"],
}
_BARE: Final = re.compile(_NUMBER)


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
        if normalise(stripped) in _INFINITE_WORDS:
            return INFINITE
        total = self._total(stripped)
        return INFINITE if total >= INFINITE or total in self.infinities else total

    def _total(self, text: str) -> int:
        if text.startswith("{"):
            return _from_fields(text)
        if _DURATION.fullmatch(text):
            parts = _DURATION_PART.findall(text)
            if all(unit.lower() in _UNITS for _, unit in parts):
                return sum(_nanoseconds(number, _UNITS[unit.lower()], text) for number, unit in parts)
        iso = _ISO.fullmatch(text)
        if iso is not None and any(iso.groups()):
            return sum(_nanoseconds(number, _ISO_UNITS[k], text) for k, number in iso.groupdict().items() if number)
        if re.fullmatch(r"-\s*[\d.].*", text):
            message = f"`{text}` is negative"
            raise InvalidValueError(message, self.expected())
        if re.fullmatch(r"\+?[\d.]+(?:e[+-]?\d+)?", text, re.IGNORECASE):
            return self._bare(text, self.bare_unit)
        rate = _RATE.fullmatch(text)
        if rate is not None and (hertz := Decimal(rate["number"])) > 0:
            period = self.format(round(_SECOND / (hertz * _RATES[rate["unit"].lower()])))
            message = f"`{text}` is a rate, not a duration; its period is {period}"
            raise InvalidValueError(message, self.expected(), period)
        message = f"`{text}` is not a duration"
        raise InvalidValueError(message, self.expected())

    def _bare(self, text: str, unit: str | None) -> int:
        try:
            number = Decimal(text)
        except InvalidOperation:
            message = f"`{text}` is not a number"
            raise InvalidValueError(message, self.expected()) from None
        if number == 0:
            return 0
        if unit is None:
            message = f"`{text}` has no unit"
            raise InvalidValueError(message, f"a unit after it, for instance {text}s or {text}ms")
        if number.adjusted() > _LARGEST_EXPONENT:
            return INFINITE
        if number.adjusted() < -_LARGEST_EXPONENT:
            raise _too_fine(text)
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
        unit = next(unit for unit in _PRINTED if number % _UNITS[unit] == 0)
        return f"{number // _UNITS[unit]}{unit}"

    def around(self, value: int) -> tuple[int, ...]:
        """Return the neighbours in steps of `step`; nothing is next to zero and to infinite but zero and infinite."""
        if value <= 0 or value >= INFINITE:
            return (max(0, min(value, INFINITE)), INFINITE)
        below, above = value - value % self.step, value + -value % self.step
        near = (below, above) if below != above else (below, below + self.step, below - self.step)
        return (*(each for each in near if each), INFINITE)

    def expected(self) -> str:
        """Give examples."""
        return "a duration such as 2s, 500ms, 1.5h, PT2S, or infinite"

    def describe(self) -> dict[str, Any]:
        """Add the unit."""
        return {**super().describe(), "unit": "ns"}


_LARGEST_EXPONENT: Final = 30
_SECOND: Final = 1_000_000_000
_RATES: Final = {"hz": 1, "khz": 1_000}
_RATE: Final = re.compile(r"(?P<number>\d{1,9}(?:\.\d{1,9})?)\s*(?P<unit>k?hz)", re.IGNORECASE)
_DIGITS_OF_A_MARK: Final = 19
"""Characters of a total near the largest one; shorter texts are no such mark and need not be read for it."""


def _nanoseconds(number: str, unit: int, text: str) -> int:
    whole, _, fraction = number.partition(".")
    fraction = fraction.rstrip("0")
    if len(fraction) > _LARGEST_EXPONENT:
        raise _too_fine(text)
    parts: int = 10 ** len(fraction)
    exact, rest = divmod(int(whole + fraction) * unit, parts)
    if rest:
        raise _too_fine(text)
    return exact


def _too_fine(text: str) -> InvalidValueError:
    return InvalidValueError(f"`{text}` is finer than a nanosecond", "whole nanoseconds")


def _from_fields(text: str) -> int:
    fields = flow(text, "{sec: 2, nsec: 0}")
    if not isinstance(fields, dict) or not fields:
        message = f"`{text}` is not a duration"
        raise InvalidValueError(message, "{sec: 2, nsec: 0}")
    total = 0
    for key, number in fields.items():
        unit = _UNITS["s"] if key in _SECONDS_KEYS else 1 if key in _NANOSECONDS_KEYS else None
        if unit is None or not isinstance(number, str) or not re.fullmatch(r"\d{1,20}", number):
            message = f"`{key}: {number}` is no part of a duration"
            raise InvalidValueError(message, "{sec: 2, nsec: 0} with whole numbers that are not negative")
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
        word = normalise(text)
        if word in self.unlimited or text.strip() in self.unlimited:
            return INFINITE
        if not re.fullmatch(r"[+-]?\d{1,20}", text.strip()):
            message = f"`{text}` is not a whole number"
            raise InvalidValueError(message, self.expected())
        number = int(text)
        if not self.lowest <= number <= self.maximum:
            message = f"`{text}` is out of range"
            raise InvalidValueError(message, self.expected())
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


_TRUE: Final = frozenset({"true", "1", "yes", "on"})
_FALSE: Final = frozenset({"false", "0", "no", "off"})


class Flag(Domain):
    """True or false; false < true."""

    kind = "flag"
    ordered = True
    highest = 1

    def parse(self, text: str) -> int:
        """Read ``true`` or ``false``, also ``1 0 yes no on off``."""
        word = normalise(text)
        if word in _TRUE or word in _FALSE:
            return int(word in _TRUE)
        message = f"`{text}` is neither true nor false"
        raise InvalidValueError(message, self.expected())

    def format(self, value: Plain) -> str:
        """Print ``true`` or ``false``."""
        return "true" if value else "false"

    def candidates(self) -> tuple[Plain, ...]:
        """Both."""
        return (0, 1)

    def expected(self) -> str:
        """Name both."""
        return "true or false"


class Names(Domain):
    """A list of names, such as partitions; order is kept."""

    kind = "names"

    def parse(self, text: str) -> tuple[str, ...]:
        """Read ``[a, b]``; a single bare name is a list of one."""
        if not text.strip().startswith("["):
            return (text.strip(),) if text.strip() else ()
        read = flow(text, self.expected())
        if not isinstance(read, list) or not all(isinstance(item, str) for item in read):
            message = f"`{text}` is not a list of names"
            raise InvalidValueError(message, self.expected())
        return tuple(read)

    def format(self, value: Plain) -> str:
        """Print in YAML flow form."""
        import json

        names: tuple[str, ...] = value  # type: ignore[assignment]
        plain = re.compile(r"[A-Za-z_/][\w/.]*")
        words = (n if plain.fullmatch(n) else _escaped(json.dumps(n, ensure_ascii=False)) for n in names)
        return f"[{', '.join(words)}]"

    def expected(self) -> str:
        """Give an example."""
        return "a list of names such as [a, b]"


def _escaped(text: str) -> str:
    """Write out what YAML allows only as an escape; it has none for pairs of surrogates, which JSON writes."""
    return "".join(c if c.isprintable() or ord(c) > _LARGEST_ESCAPE else f"\\u{ord(c):04x}" for c in text)


_LARGEST_ESCAPE: Final = 0xFFFF


class Text(Domain):
    """Free text, compared for equality only."""

    kind = "text"

    def parse(self, text: str) -> str:
        """Keep the text."""
        return text

    def expected(self) -> str:
        """Anything goes."""
        return "text"


YES: Final = "yes"
UNMATCHED: Final = "unmatched"
NO: Final = "no"
"""How a middleware treats a policy: enforces it; offers it but never refuses a pair for it; ignores it."""

ENDPOINT: Final = "endpoint"
TOPIC: Final = "topic"
BROKER: Final = "broker"
NEED: Final = "need"
"""Level of what is said of an endpoint without being a setting of it: what its application needs."""
LEVELS: Final = (ENDPOINT, TOPIC, "participant", BROKER, "option", NEED)
BOTH: Final = ("publisher", "subscriber")
Stronger: TypeAlias = Literal["higher", "lower", ""]
DIRECTIONS: Final[tuple[Stronger, ...]] = ("higher", "lower", "")


@dataclass(frozen=True, eq=False, repr=False)
class Policy(Term):
    """One named QoS setting. In a sentence it stands for the endpoint's own value; comparisons build sentences.

    ``==`` is taken by the language, so policies are told apart by ``name`` and ``level``.

    Attributes:
        name: canonical snake_case name; with dots where a policy has several fields.
        domain: its kind of value.
        default: text of the default, or per role; None for a fact, which has no value until somebody states one.
        doc: one sentence for property panels and docs.
        clause: where the standard defines it.
        level: what it is a setting of: ``endpoint``, ``topic``, ``participant``, ``broker`` or ``option``; or ``need``.
        roles: which endpoints have it.
        aliases: other names it is read by.
        words: values that are no plain ones (``system_default``) and what they mean.
        zero: the word that a zero stands for, or None where zero means zero.
        enforced: per option and its value, how the middleware treats the policy: ``no`` (ignored: takes its default, and
            stating it is a warning) or ``unmatched`` (works, but never stops a match); whatever is not listed is ``yes``.
        promise: a stronger offer is a promise the program must keep, so that remedies on it need code.
        assume: for options: the values taken into account while it is unset; empty means all.
        fallback: for options: the value that stands in for one this pack does not know yet, with a warning.
        entities: what it is set on, in the words of the standard, where that is more than an endpoint.
        changeable: whether it may change while the endpoint lives; None where the standard does not say.
        stronger: which of its values promise or demand more: ``higher``, ``lower``, or empty where neither does. A fix that
            moves the other way weakens the design, says so, and comes last.
        derived: a fact that follows from others, as ``doc`` says: a system cannot state it, and no fix sets it.
        follows: names of the policies that a derived one follows from, where a fix may change them.
        together: it follows from several endpoints, also from those on other topics.
    """

    name: str
    domain: Domain
    default: str | Mapping[str, str] | None = None
    doc: str = ""
    clause: str = ""
    level: str = ENDPOINT
    roles: tuple[str, ...] = BOTH
    aliases: tuple[str, ...] = ()
    words: Mapping[str, Meaning] = field(default_factory=dict)
    zero: str | None = None
    enforced: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    promise: bool = False
    assume: tuple[str, ...] = ()
    fallback: str | None = None
    entities: tuple[str, ...] = ()
    changeable: bool | None = None
    stronger: Stronger = ""
    derived: bool = False
    follows: tuple[str, ...] = ()
    together: bool = False

    def __post_init__(self) -> None:
        """Make it the term it is."""
        # A level that there is not is one of the mistakes that the pack reports.
        scope = _OWN_SCOPE.get(self.level, self.level)
        object.__setattr__(self, "scope", scope)
        object.__setattr__(self, "key", ("term", scope, self.name))

    def __hash__(self) -> int:
        """Hash by name and level."""
        return hash(self.key)

    @cached_property
    def spellings(self) -> frozenset[str]:
        """All normalised names it is read by."""
        return frozenset(normalise(name) for name in (self.name, *self.aliases))

    def default_for(self, role: str) -> str | None:
        """Return the default's text for an endpoint of ``role``, or None for a fact."""
        if self.default is None or isinstance(self.default, str):
            return self.default
        return self.default.get(role)

    def word(self, text: str) -> str:
        """How a text counts as written: as a special word, or as its value in one spelling."""
        word = self.domain.word(text)
        if word in self.words:
            return word
        try:
            return normalise(self.domain.format(self.domain.parse(text)))
        except InvalidValueError:
            return word

    def weakens(self, before: Value, after: Value) -> bool:
        """Whether a change promises or demands less than before."""
        if not self.stronger or not isinstance(before, int) or not isinstance(after, int):
            return False
        return after < before if self.stronger == "higher" else after > before

    @property
    def unbounded(self) -> tuple[Value, ...]:
        """The values of one that follows from several endpoints that bound nothing: its default, and no limit."""
        if not self.together:
            return ()
        return (INFINITE, self.domain.parse(self.default)) if isinstance(self.default, str) else (INFINITE,)

    def spelling(self, value: Plain) -> str | None:
        """Return a text that is read back as exactly this value; None where there is no such text."""
        text = self.domain.format(value)
        if self.domain.word(text) in self.words or (value == 0 and self.zero is not None):
            return None
        try:
            return text if self.domain.parse(text) == value else None
        except InvalidValueError:
            return None

    def expected(self) -> str:
        """What may be written, for messages: the domain's values and the special words."""
        words = ", ".join(self.words)
        return f"{self.domain.expected()}{f', or {words}' if words else ''}"

    def format(self, value: Value) -> str:
        """Print a value for people; undetermined ones say what they depend on."""
        match value:
            case Anything(cause):
                return f"unknown ({cause})"
            case Depends(on, cases):
                listed = ", ".join(f"{self.format(v)} with {on.rpartition('.')[2]}={name}" for name, v in cases)
                return f"undetermined ({listed})"
            case FromPeers():
                return "taken from peers"
        return self.domain.format(value)


_OWN_SCOPE: Final = {
    ENDPOINT: "own",
    "topic": "topic",
    "participant": "participant",
    "broker": "broker",
    "option": "option",
    NEED: "requested",
}
