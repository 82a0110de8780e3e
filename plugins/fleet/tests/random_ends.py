"""Random ends of pairs: values of all policies of a pack, some not known, and what rules say of two of them."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any, NamedTuple

from cqos_core.api import context
from cqos_core.language.bound_condition import NO_SIGNAL
from cqos_core.language.domains import Names
from cqos_core.language.expression import Literal
from cqos_core.language.policy import UNMATCHED
from cqos_core.language.values import ANYTHING, INFINITE, UNREAD, WrittenValue
from cqos_core.matching.judge import passed_over
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.system import PUBLISHER
from cqos_fleet.forms import cell_of
from cqos_fleet.profiles import FleetProfiles

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack
    from cqos_fleet.forms import Column, RuleForm


class End(NamedTuple):
    """One end: values, and the policies that its middleware does not match on."""

    values: tuple[Any, ...]
    unmatched: frozenset[int]
    needs: frozenset[str] = frozenset()

    def cells(self, pack: RulePack, columns: Sequence[Column]) -> list[int | str | None]:
        return [cell_of(pack.vocabulary, self.values, self.unmatched, column) for column in columns]


def _random_end(pack: RulePack, seed: random.Random, constants: dict[int, list[Any]]) -> End:
    values = [seed.choice(constants[at]) if seed.random() < 0.85 else ANYTHING for at in range(len(pack.policies))]
    written = [_written(seed, policy) for policy in pack.policies]
    never = [
        at for at, each in enumerate(pack.policies) if any(UNMATCHED in t.values() for t in each.enforced.values())
    ]
    return End((*values, *written), frozenset(at for at in never if seed.random() < 0.2))


def ends_of_system(pack: RulePack, rows: Sequence[Mapping[str, str]], number: int, seed: str) -> list[tuple[End, End]]:
    """Return pairs of a publisher and a subscriber of a system; what depends on assumptions or peers is not known."""
    profiles = FleetProfiles(pack, context(), "note", {})
    profiles.add(rows)
    sides: tuple[list[End], list[End]] = ([], [])
    for each in profiles.known:
        values, size = each.resolved.profile.values, len(pack.policies)
        plain = [value if isinstance(value, (int, str, tuple)) else ANYTHING for value in values[:size]]
        end = End((*plain, *values[size:]), each.resolved.profile.unmatched)
        sides[each.resolved.role != PUBLISHER].append(end)
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    return [(chosen.choice(sides[0]), chosen.choice(sides[1])) for _ in range(number)]


def _written(seed: random.Random, policy: Policy) -> WrittenValue | None:
    if seed.random() < 0.4:
        return None
    texts = [*map(policy.domain.format, policy.domain.candidates()), *policy.words, "1"]
    return UNREAD if seed.random() < 0.2 else WrittenValue(policy.word(seed.choice(texts)), here=seed.random() < 0.5)


def random_ends(pack: RulePack, number: int, seed: str) -> list[tuple[End, End]]:
    """Return pairs of ends whose values stand at and beside those that conditions compare with."""
    known = known_values(pack)
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    return [(_random_end(pack, chosen, known), _random_end(pack, chosen, known)) for _ in range(number)]


def known_values(pack: RulePack) -> dict[int, list[Any]]:
    """Return values of each policy, by its index: ends of its kind, and what conditions compare it with."""
    known = {at: _values_of(policy) for at, policy in enumerate(pack.policies)}
    for bound in pack.bound_rules:
        texts = [each.value for each in bound.bound.condition.walk() if isinstance(each, Literal)]
        for use in (*bound.bound.uses, *bound.bound.aggregate_uses):
            known[use.index] += _read(pack.policies[use.index], texts)
    return known


def _values_of(policy: Policy) -> list[Any]:
    domain = policy.domain
    if isinstance(domain, Names):
        return [(), ("a",), ("a", "b")]
    if domain.candidates():
        return [*domain.candidates()]
    if domain.ordered:
        return [domain.lowest, domain.highest, 1, 2, 10**9, INFINITE // 2 + 1, INFINITE // 3]
    return ["", "?", "a", 'it\'s \\ "b"', "/a/b", "ü\uffff", "/\U0001f916'"]


def _read(policy: Policy, texts: Iterable[object]) -> list[Any]:
    found = []
    for text in texts:
        if isinstance(text, str):
            try:
                found.append(policy.domain.parse(text))
            except InvalidValueError:
                continue
    return found


def said(rule: RuleForm, first: End, second: End) -> tuple[bool, bool]:
    """Return what the rule itself says: whether it reports for certain, and whether it cannot be decided."""
    bound, kind = rule.bound, rule.bound.rule.kind
    skipped = bound.scope == "pair" and not bound.rule.guarantee and passed_over(bound, first, second)  # type: ignore[arg-type]
    result = bound.bound.open(first.values, second.values, NO_SIGNAL)
    if skipped:
        return False, False
    return result is (kind == "forbids"), kind == "requires" and result is None
