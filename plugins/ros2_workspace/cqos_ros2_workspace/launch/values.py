"""Values of launch files that need not be known: joined texts, alternatives, and unknown parts with their causes.

A known value is a plain Python value. Everything else is one of the classes below. An alternative keeps the guards under which
it holds, so that one undecided argument is one assumption wherever it is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from cqos_core.model.settings import Place

MOST_CASES: Final = 64
"""How many alternatives one value may have; more are unknown."""


LONGEST_TEXT: Final = 1_000_000
"""How many characters a text may have that is made of others."""


class Guard(NamedTuple):
    """One decision that the files leave open: whether a subject has a value.

    Attributes:
        subject: what is not known: the name of a launch argument, ``environment X``, or an expression as written.
        value: what it is compared with; ``true`` for a condition.
        holds: whether it has this value.
    """

    subject: str
    value: str
    holds: bool

    def __str__(self) -> str:
        return f"{self.subject} {'is' if self.holds else 'is not'} {self.value or 'empty'}"

    def negated(self) -> Guard:
        """Return the other branch."""
        return self._replace(holds=not self.holds)


Guards: TypeAlias = tuple[Guard, ...]


@dataclass(frozen=True, slots=True)
class Unknown:
    """A value that the files do not decide.

    Attributes:
        cause: why, as a sentence without a full stop.
        place: where the cause stands.
        subject: what to call it in a guard; empty: the cause.
    """

    cause: str
    place: Place | None = None
    subject: str = ""

    def guard(self, value: str) -> Guard:
        """Return the guard that it has ``value``; a flag is the same flag however it is spelled."""
        return Guard(self.name, value.lower() if value.lower() in {"true", "false"} else value, holds=True)

    @property
    def name(self) -> str:
        """What to call it: its subject, else the cause with its place, so that no two unknown values are taken for one."""
        if self.subject or self.place is None:
            return self.subject or self.cause
        return f"{self.cause} ({self.place.source.rpartition('/')[2]}:{self.place.line})"


@dataclass(frozen=True, slots=True)
class Joined:
    """A text with unknown parts."""

    parts: tuple[str | Unknown, ...]


@dataclass(frozen=True, slots=True)
class Either:
    """One of a few values, each under guards; at most one case holds."""

    cases: tuple[tuple[Guards, Any], ...]


@dataclass(frozen=True, slots=True)
class When:
    """A member of a list that is there under guards."""

    guards: Guards
    value: Any


_COMPARED: Final = (str, int, float, bool, Unknown, Joined)
Text: TypeAlias = str | Unknown | Joined | Either


def both(first: Guards, second: Guards) -> Guards | None:
    """Return the guards of both, None where they exclude each other."""
    found = dict.fromkeys(first)
    for guard in second:
        if guard.negated() in found or (guard.holds and any(_excludes(each, guard) for each in found)):
            return None
        found[guard] = None
    return tuple(found)


def _excludes(one: Guard, other: Guard) -> bool:
    return one.holds and one.subject == other.subject and one.value != other.value


def otherwise(guards: Guards) -> Iterator[Guards]:
    """Yield the guards of all other cases, each exclusive of the rest."""
    for number, guard in enumerate(guards):
        yield (*guards[:number], guard.negated())


def cases(value: Any) -> tuple[tuple[Guards, Any], ...]:
    """Return the alternatives of a value with their guards; one without guards where it has none."""
    return value.cases if isinstance(value, Either) else (((), value),)


def either(found: Iterable[tuple[Guards, Any]]) -> Any:
    """Return one value of alternatives; equal ones and nested ones are joined."""
    flat: list[tuple[Guards, Any]] = []
    for guards, value in found:
        for inner, each in cases(value):
            held = both(guards, inner)
            if held is not None:
                flat.append((held, each))
    if len(flat) == 1 and not flat[0][0]:
        return flat[0][1]
    if flat and all(_same(each, flat[0][1]) for _, each in flat):
        return flat[0][1]
    if len(flat) > MOST_CASES:
        return Unknown(f"more than {MOST_CASES} combinations of undecided conditions")
    return Either(tuple(flat))


def _same(one: Any, other: Any) -> bool:
    """Whether two values are equal; of lists and objects, whether they are one: comparing those may take for ever."""
    plain = type(one) is type(other) and isinstance(one, _COMPARED) and type(one) in _COMPARED
    return one is other or (plain and bool(one == other))


def only_where(guards: Guards, value: Any) -> Any:
    """Return a value that is there where ``guards`` hold and nowhere else; None where they exclude each other."""
    if not guards:
        return value
    found = ((both((), (*guards, *inner)), each) for inner, each in cases(value))
    there = tuple((held, each) for held, each in found if held is not None)
    return Either(there) if there else None


def where_held(value: Any, guards: Guards) -> Any:
    """Return what `only_where` made, as it is where ``guards`` hold; None where they exclude it."""
    if not isinstance(value, Either):
        return value
    left = _left(value, guards)
    if len(left) == 1 and not left[0][0]:
        return left[0][1]
    return Either(tuple(left)) if left else None


def under(value: Any, guards: Guards) -> Any:
    """Return a value as it is where ``guards`` hold: alternatives that they exclude are gone."""
    return either(_left(value, guards)) if isinstance(value, Either) else value


def _left(value: Either, guards: Guards) -> list[tuple[Guards, Any]]:
    """Return the cases that ``guards`` do not exclude, each without what they say already."""
    known = set(guards)
    return [(tuple(g for g in each if g not in known), v) for each, v in value.cases if both(guards, each) is not None]


def replaced(old: Any, new: Any, guards: Guards) -> Any:
    """Return the value of a name that had ``old`` and is given ``new`` under guards."""
    if not guards:
        return new
    return either([(guards, new), *((each, under(old, each)) for each in otherwise(guards))])


def undecided(guard: Guard) -> Either:
    """Return the truth value that is true where ``guard`` holds."""
    return Either((((guard,), True), ((guard.negated(),), False)))


def lift(function: Callable[..., Any], *values: Any) -> Any:
    """Apply a function to every combination of alternatives; a value that is not known makes the result unknown."""
    combinations = 1
    for value in values:
        combinations *= len(cases(value))
    if combinations > MOST_CASES:
        return Unknown(f"more than {MOST_CASES} combinations of undecided conditions")
    found: list[tuple[Guards, Any]] = []
    for combination in product(*map(cases, values)):
        held: Guards | None = ()
        for guards, _ in combination:
            held = None if held is None else both(held, guards)
        if held is not None:
            found.append((held, function(*(value for _, value in combination))))
    return either(found)


def join(parts: Iterable[Any]) -> Text:
    """Return the text that texts make one after the other."""
    return lift(_joined, *parts)  # type: ignore[no-any-return]


def _joined(*parts: Any) -> Text:
    flat: list[str | Unknown] = []
    for part in parts:
        for each in part.parts if isinstance(part, Joined) else (part,):
            if isinstance(each, str) and flat and isinstance(flat[-1], str):
                flat[-1] += each
            elif each != "":
                flat.append(each)
    if not flat:
        return ""
    if len(flat) > MOST_CASES or sum(len(each) for each in flat if isinstance(each, str)) > LONGEST_TEXT:
        return Unknown(f"a text of more than {LONGEST_TEXT} characters, or with more than {MOST_CASES} unknown parts")
    return flat[0] if len(flat) == 1 else Joined(tuple(flat))


def unknown_parts(value: Any) -> Iterator[Unknown]:
    """Yield everything in a value that is not known; a list that stands in it several times is looked into once."""
    waiting, seen = [value], set()
    while waiting:
        each = waiting.pop()
        if isinstance(each, Unknown):
            yield each
        elif isinstance(each, (Joined, Either, When, dict, list, tuple)) and id(each) not in seen:
            seen.add(id(each))
            waiting += reversed(_members(each))


def _members(value: Any) -> list[Any]:
    if isinstance(value, Joined):
        return list(value.parts)
    if isinstance(value, Either):
        return [each for _, each in value.cases]
    if isinstance(value, When):
        return [value.value]
    return [*value.values()] if isinstance(value, dict) else [*value]


def first_unknown(*values: Any) -> Unknown | None:
    """Return the first part that is not known."""
    return next((part for value in values for part in unknown_parts(value)), None)


def shown(value: Any, depth: int = 6) -> str:
    """Return a value as a person reads it: unknown parts as ``?``, alternatives one after the other; cut where it is deep."""
    if depth < 0:
        return "…"
    if isinstance(value, str):
        return value
    if isinstance(value, Unknown):
        return "?"
    if isinstance(value, Joined):
        return "".join(part if isinstance(part, str) else "?" for part in value.parts)
    if isinstance(value, Either):
        texts = [f"{shown(each, depth - 1)} if {' and '.join(map(str, guards))}" for guards, each in value.cases]
        return f"({'; '.join(texts)})"
    if value is None:
        return "not set"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(shown(each, depth - 1) for each in value)}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {shown(each, depth - 1)}' for key, each in value.items())}}}"
    return str(value)
