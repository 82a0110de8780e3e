"""Random ends of pairs: values of all policies of a pack, some not known, and what rules say of two of them."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

from cqos_bulk.forms import spans
from cqos_core.language.domains import Names
from cqos_core.language.evaluate import NO_SIGNAL
from cqos_core.language.expression import Literal
from cqos_core.language.policy import UNMATCHED
from cqos_core.language.values import ANYTHING, INFINITE, UNREAD, WrittenValue
from cqos_core.matching.judge import passed_over
from cqos_core.model.problems import InvalidValueError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_bulk.forms import Column, RuleForm
    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack


class End:
    """One end: values, and the policies that its middleware does not match on."""

    def __init__(self, pack: RulePack, seed: random.Random, constants: dict[int, list[Any]]) -> None:
        size = len(pack.policies)
        values = [seed.choice(constants[at]) if seed.random() < 0.85 else ANYTHING for at in range(size)]
        written = [_written(seed, policy) for policy in pack.policies]
        self.values = (*values, *written)
        never = [
            at for at, each in enumerate(pack.policies) if any(UNMATCHED in t.values() for t in each.enforced.values())
        ]
        self.unmatched = frozenset(at for at in never if seed.random() < 0.2)
        self.needs: frozenset[str] = frozenset()

    def cells(self, pack: RulePack, columns: Sequence[Column]) -> list[int | str | None]:
        return spans(pack.vocabulary, self.values, self.unmatched, columns)


def _written(seed: random.Random, policy: Policy) -> WrittenValue | None:
    if seed.random() < 0.4:
        return None
    texts = [*map(policy.domain.format, policy.domain.candidates()), *policy.words, "1"]
    return UNREAD if seed.random() < 0.2 else WrittenValue(policy.word(seed.choice(texts)), here=seed.random() < 0.5)


def random_ends(pack: RulePack, number: int, seed: str) -> list[tuple[End, End]]:
    """Return pairs of ends whose values stand at and beside those that conditions compare with."""
    known = {at: _values_of(policy) for at, policy in enumerate(pack.policies)}
    for bound in pack.bound_rules:
        texts = [each.value for each in bound.bound.condition.walk() if isinstance(each, Literal)]
        for use in (*bound.bound.uses, *bound.bound.aggregate_uses):
            known[use.index] += _read(pack.policies[use.index], texts)
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    return [(End(pack, chosen, known), End(pack, chosen, known)) for _ in range(number)]


def _values_of(policy: Policy) -> list[Any]:
    domain = policy.domain
    if isinstance(domain, Names):
        return [(), ("a",), ("a", "b")]
    if domain.candidates():
        return [*domain.candidates()]
    if domain.ordered:
        return [domain.lowest, domain.highest, 1, 2, 10**9, INFINITE // 2 + 1, INFINITE // 3]
    return ["", "?", "a", 'it\'s \\ "b"', "/a/b", "ü\uffff"]


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
