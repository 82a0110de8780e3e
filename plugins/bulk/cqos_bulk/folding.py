"""Forms with some columns as constants: those that all profiles have alike, and values that depend on assumptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_bulk.forms import FALSE, TRUE, Column, ColumnForm, compared, joined, negated, whole
from cqos_core.language.values import INFINITE, Range, in_world, worlds_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.language.vocabulary import Vocabulary

Constants = dict[Column, Any]
_MOST_WORLDS: Final = 16


def folded(form: ColumnForm, constants: Mapping[Column, Any]) -> ColumnForm:
    """Return a form in which these columns are constants."""
    op, args = form
    if op == "column":
        return ColumnForm("constant", (constants[args[0]],)) if args[0] in constants else form
    if op == "constant":
        return form
    parts = tuple(folded(arg, constants) for arg in args)
    match op:
        case "and" | "or":
            return joined(op, parts)
        case "not":
            return negated(parts[0])
        case "<" | "<=" | "==":
            return compared(op, *parts)
        case "if" if parts[0] in {TRUE, FALSE}:
            return parts[1] if parts[0] == TRUE else parts[2]
    if op in _COMPUTED and all(part.op == "constant" for part in parts):
        return ColumnForm("constant", (_COMPUTED[op](*(part.args[0] for part in parts)),))
    return ColumnForm(op, parts)


_COMPUTED: Final[dict[str, Any]] = {
    "min": min,
    "max": max,
    "+": lambda one, other: min(one + other, INFINITE),
    "*": lambda one, other: min(one * other, INFINITE),
}


def in_all_worlds(form: ColumnForm, worlds: Sequence[Constants]) -> ColumnForm:
    """Return whether a form holds under each of several assignments of assumptions."""
    return joined("and", (folded(form, each) for each in worlds))


def worlds_of_ends(vocabulary: Vocabulary, ends: tuple[Mapping[int, Any], Mapping[int, Any]]) -> list[Constants] | None:
    """Return the columns that depend on assumptions as constants, for each assignment of these.

    Args:
        vocabulary: of the pack.
        ends: of publishers and of subscribers, by index the values that depend on assumptions.

    Returns:
        One assignment without constants where nothing depends on any; None where there are too many.
    """
    worlds = worlds_of(value for end in ends for value in end.values())
    if worlds is None or len(worlds) > _MOST_WORLDS:
        return None
    found = []
    for world in worlds:
        constants: Constants = {}
        for second, end in enumerate(ends):
            for index, value in end.items():
                here = in_world(value, world)
                span: tuple[int | str, int | str] = whole(vocabulary.policies[index].domain)
                if isinstance(here, Range):
                    span = here
                elif isinstance(here, (int, str)):
                    span = (here, here)
                for most in (False, True):
                    constants[Column(bool(second), index, "value", most)] = span[most]
        found.append(constants)
    return found
