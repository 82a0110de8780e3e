"""Evaluates the rules of a pack over the profiles of a fleet: as forms over columns, or in Python if a rule has no form."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.policy import ENDPOINT
from cqos_core.language.spans import FALSE, TRUE, joined
from cqos_core.language.values import Anything, Range, in_world, is_plain, worlds_of
from cqos_core.matching.judge import ask, of_end, signals_on
from cqos_core.matching.topic_groups import equal_in_pairs
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_fleet.forms import Column, RuleForm, cell_of, failing, form_of, forms_of, whole

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.language.vocabulary import Vocabulary
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_fleet.profiles import FleetProfiles, KnownProfile

_MOST_COMBINATIONS: Final = 20_000
_MOST_WORLDS: Final = 16
_SIDES: Final = (False, True)


class Judge(NamedTuple):
    """The rules of a pack over the profiles of a fleet.

    Attributes:
        rules: of pairs, those that may report anything.
        matching: conditions of matching that may keep profiles apart.
        columns: what the rules read; those of matching stand apart, as what is not known keeps no pair apart.
        table: by name the kind and values of the columns of profiles; `example` is the number of the profile, raised by the number
            of all where it is left to Python.
    """

    rules: Sequence[RuleForm]
    matching: Sequence[RuleForm]
    columns: Sequence[Column]
    matching_columns: Sequence[Column]
    table: dict[str, tuple[str, list[Any]]]


def column_name(judge: Judge, column: Column, *, matching: bool = False) -> str:
    """Return the name that a column has in tables."""
    listed = judge.matching_columns if matching else judge.columns
    return f"{'m' if matching else 'v'}{listed.index(column)}"


def judge_of(profiles: FleetProfiles) -> Judge:
    """Return the rules over all profiles, with the columns that they read, and which profiles are left to Python."""
    pack, known, vocabulary = profiles.pack, profiles.known, profiles.pack.vocabulary
    asked = (
        each
        for each in pack.by_scope.get("pair", ())
        if not each.rule.guarantee and (each.severity in profiles.severities or each.rule.kind == "requires")
    )
    rules, formless = forms_of(asked)
    matching, more = forms_of(pack.by_scope["meets"])
    python = _speaking([bound for bound, _ in (*formless, *more)], known)
    read = {column.policy for rule in (*rules, *matching) for column in rule.columns()}
    opened = [_opened(each, sorted(read)) for each in known]
    ends, others = _common(known, opened)
    python |= others
    worlds = _worlds(vocabulary, ends)
    if worlds is None:
        python = {*range(len(known))}
        worlds = [{}]
    constants = _constants(vocabulary, known, {column for rule in (*rules, *matching) for column in rule.columns()})

    def ready(rule: RuleForm) -> RuleForm:
        found = [form_of(rule.bound, {**constants, **world}) for world in worlds]
        reports, quiet = (
            joined("and", forms) for forms in zip(*[(each.reports, each.quiet) for each in found], strict=True)
        )
        return RuleForm(rule.bound, reports, quiet)

    live = [each for each in map(ready, rules) if each.quiet != TRUE and (each.reports, each.unknown) != (FALSE, FALSE)]
    apart = [each for each in map(ready, matching) if each.quiet != TRUE]
    columns = sorted({column for each in live for column in each.columns()})
    separate = sorted({column for each in apart for column in each.quiet.reads()})
    table = _table(profiles, columns, separate, python)
    return Judge(live, apart, columns, separate, table)


_SPANNED: Final = (int, str, Anything)
_Open = tuple[tuple[int, Any], ...]
"""By index, values that depend on assumptions or peers."""


def _opened(each: KnownProfile, read: Iterable[int]) -> _Open:
    values = each.resolved.profile.values
    return tuple([(at, values[at]) for at in read if not isinstance(values[at], (*_SPANNED, tuple))])


def _common(known: Sequence[KnownProfile], opened: Sequence[_Open]) -> tuple[tuple[_Open, _Open], set[int]]:
    """Return what depends on assumptions at each end for most profiles, and the profiles with other open values."""
    ends: list[_Open] = []
    others: set[int] = set()
    for role in (PUBLISHER, SUBSCRIBER):
        here = [at for at, each in enumerate(known) if each.resolved.role == role]
        usual = Counter(opened[at] for at in here).most_common(1)
        ends.append(usual[0][0] if usual else ())
        others |= {at for at in here if opened[at] != ends[-1]}
    return (ends[0], ends[1]), others


def _worlds(vocabulary: Vocabulary, ends: tuple[_Open, _Open]) -> list[dict[Column, Any]] | None:
    """Return the columns that depend on assumptions as constants, for each assignment of these; None where there are too many."""
    worlds = worlds_of(value for end in ends for _, value in end)
    if worlds is None or len(worlds) > _MOST_WORLDS:
        return None
    found = []
    for world in worlds:
        constants: dict[Column, Any] = {}
        for second, end in zip(_SIDES, ends, strict=True):
            for index, value in end:
                here = in_world(value, world)
                span: tuple[int | str, int | str] = whole(vocabulary.policies[index].domain)
                if isinstance(here, Range):
                    span = here
                elif isinstance(here, (int, str)):
                    span = (here, here)
                for most in (False, True):
                    constants[Column(second, index, "value", most)] = span[most]
        found.append(constants)
    return found


def _speaking(rules: Iterable[BoundRule], known: Sequence[KnownProfile]) -> set[int]:
    """Return the publishers that a rule without a column form reports beside any subscriber."""
    found: set[int] = set()
    for bound in rules:
        sides: tuple[dict[Any, list[int]], dict[Any, list[int]]] = ({}, {})
        for at, each in enumerate(known):
            second = each.resolved.role != PUBLISHER
            values = each.resolved.profile.values
            sides[second].setdefault(tuple([values[index] for index in bound.bound.sides[second]]), []).append(at)
        few = len(sides[0]) * len(sides[1]) <= _MOST_COMBINATIONS
        others = [known[alike[0]].resolved.profile.values for alike in sides[1].values()]
        for alike in sides[0].values():
            values = known[alike[0]].resolved.profile.values
            if not few or any(ask(bound, values, other) is not None for other in others):
                found.update(alike)
    return found


def _constants(vocabulary: Vocabulary, known: Sequence[KnownProfile], columns: Iterable[Column]) -> dict[Column, Any]:
    """Return the columns that all profiles of their end have alike, and know."""
    found: dict[Column, Any] = {}
    sides = [[each.resolved.profile for each in known if (each.resolved.role != PUBLISHER) is side] for side in _SIDES]
    for column in columns:
        cells = set()
        for profile in sides[column.second]:
            value = profile.values[column.policy]
            cells.add(
                None if isinstance(value, Anything) else cell_of(vocabulary, profile.values, profile.unmatched, column)
            )
            if len(cells) > 1 or None in cells:
                break
        else:
            if cells:
                found[column] = cells.pop()
    return found


def _table(
    profiles: FleetProfiles, columns: Sequence[Column], separate: Sequence[Column], python: set[int]
) -> dict[str, tuple[str, list[Any]]]:
    """Return the columns of profiles: their values at their own end, and what sorts topics."""
    pack, known = profiles.pack, profiles.known
    signal, loud = _of_signals(profiles)
    parts = _parts(profiles)
    table: dict[str, tuple[str, list[Any]]] = {
        "p": ("number", [*range(len(known))]),
        "publishers": ("number", [int(each.resolved.role == PUBLISHER) for each in known]),
        "subscribers": ("number", [int(each.resolved.role != PUBLISHER) for each in known]),
        "part": ("number", parts),
        "example": (
            "small",
            [at + len(known) * (at in python or at in loud or _left_open(each)) for at, each in enumerate(known)],
        ),
        "offering": (
            "small",
            [s if each.resolved.role == PUBLISHER else None for s, each in zip(signal, known, strict=True)],
        ),
        "requesting": (
            "small",
            [s if each.resolved.role != PUBLISHER else None for s, each in zip(signal, known, strict=True)],
        ),
    }
    for letter, listed in (("v", columns), ("m", separate)):
        for at, column in enumerate(listed):
            cells = [
                _cell(pack.vocabulary, each, column, hide=letter == "m")
                if (each.resolved.role != PUBLISHER) is column.second
                else None
                for each in known
            ]
            kind = "text" if any(isinstance(cell, str) for cell in cells) else "small"
            table[f"{letter}{at}"] = (kind, cells)
    numbers: dict[Any, int] = {}
    seen = zip(*(table[f"v{at}"][1] for at in range(len(columns))), strict=True) if columns else ((),) * len(known)
    ends = ((each.resolved.role, each.version, *cells) for each, cells in zip(known, seen, strict=True))
    table["alike"] = ("number", [numbers.setdefault(each, len(numbers)) for each in ends])
    return table


def _cell(vocabulary: Vocabulary, each: KnownProfile, column: Column, *, hide: bool) -> int | str | None:
    profile = each.resolved.profile
    if hide and isinstance(profile.values[column.policy], Anything):
        return None
    return cell_of(vocabulary, profile.values, profile.unmatched, column)


def _left_open(each: KnownProfile) -> bool:
    """Whether a verdict of a profile rests on more than the rules of pairs."""
    profile, role = each.resolved.profile, each.resolved.role
    ends = of_end(profile, role, False, False)
    return bool(ends or profile.from_peers or profile.needs or profile.unread or profile.refused)


def _of_signals(profiles: FleetProfiles) -> tuple[list[int], set[int]]:
    """Return a number for what rules over topics read of each profile, and those that they report by themselves."""
    rules = profiles.pack.by_scope.get("signal", ())
    counted = [
        at
        for at, bound in enumerate(rules)
        if bound.severity in profiles.severities and not _is_silent(bound, profiles.known)
    ]
    read = dict.fromkeys(at for pos in counted for at in (*rules[pos].bound.own, *rules[pos].bound.aggregated))
    mask = sum(1 << at for at in counted)
    numbers: dict[Any, int] = {}
    found, loud = [], set()
    name = profiles.pack.find("topic", "name")
    for at, each in enumerate(profiles.known):
        profile = each.resolved.profile
        found.append(numbers.setdefault(tuple([profile.values[i] for i in read if i != name]), len(numbers)))
        if signals_on(profile, each.resolved.role, observed=False) & mask:
            loud.add(at)
    return found, loud


def _is_silent(bound: BoundRule, known: Sequence[KnownProfile]) -> bool:
    """Whether a part of what a rule forbids holds for no profile, as it reads values that all profiles have alike."""
    waiting, vocabulary = [bound.bound.condition] if bound.rule.kind == "forbids" else [], bound.bound.vocabulary
    while waiting:
        part = waiting.pop()
        if part.name == "&":
            waiting += part.args  # type: ignore[arg-type] # the parts of a condition are conditions
        elif (fails := failing(part, vocabulary, {})) is not None:
            read = {*fails.reads()}
            alike = _constants(vocabulary, known, [one._replace(second=end) for one in read for end in _SIDES])
            ends = [alike.get(one._replace(second=end)) for one in read for end in _SIDES]
            if None not in ends and failing(part, vocabulary, alike) == TRUE and ends[::2] == ends[1::2]:
                return True
    return False


def _parts(profiles: FleetProfiles) -> list[int]:
    """Return a number for the known values of participants that matching needs to be equal, such as their domain."""
    policies = profiles.pack.policies
    every = [each.resolved.profile.values for each in profiles.known]
    indices = [
        at
        for at in equal_in_pairs(profiles.pack)
        if policies[at].level != ENDPOINT and all(is_plain(values[at]) for values in every)
    ]
    numbers: dict[Any, int] = {}
    return [numbers.setdefault(tuple([values[at] for at in indices]), len(numbers)) for values in every]
