"""Rules bound to the policies of their pack."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from cqos_core.language.binder import bind
from cqos_core.language.expression import in_, option
from cqos_core.language.policy import BOTH, ENDPOINT, Policy
from cqos_core.language.vocabulary import Vocabulary, role_of, scope_of
from cqos_core.model.dataclass import dataclass
from cqos_core.packs.rule import SEVERITIES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.language.bound_condition import BoundCondition
    from cqos_core.packs.rule import Rule, SeverityName


@dataclass(frozen=True)
class BoundRule:
    """A rule of a pack with these policies, and the scope that follows from its terms."""

    rule: Rule
    vocabulary: Vocabulary
    scope: str
    role: str | None

    @cached_property
    def bound(self) -> BoundCondition:
        """Its condition, bound when it is first asked: a start of the command asks a third of the rules.

        Raises:
            ConditionError: it cannot be bound.
        """
        return bind(self.rule.condition, self.vocabulary)

    @cached_property
    def absent(self) -> Mapping[str, tuple[int, ...]]:
        """By role, the policies that it reads of an endpoint itself and that endpoints of the role do not have."""
        policies = self.vocabulary.policies
        own = [
            use.index for use in self.bound.uses if use.term.scope == "own" and policies[use.index].level == ENDPOINT
        ]
        return {role: tuple(index for index in own if role not in policies[index].roles) for role in BOTH}

    @property
    def severities(self) -> dict[str, SeverityName]:
        """By value of the option that it depends on, the severity; a plain severity stands alone under an empty value."""
        by = self.rule.severity
        if isinstance(by, str):
            return {"": by}
        listed, domain = dict(by.meanings), self.option.domain
        found = {text: listed.get(text, by.otherwise) for text in map(domain.format, domain.candidates())}
        return {text: severity for text, severity in found.items() if severity is not None}  # type: ignore[misc]

    @property
    def option(self) -> Policy:
        """The option on which the severity depends."""
        return self.vocabulary.policies[self.vocabulary.indices["option", self.rule.severity.option]]  # type: ignore[union-attr]

    @property
    def severity(self) -> SeverityName:
        """The severity by default: that of the option's default, or the worst where the rule is not checked then."""
        found = self.severities
        usual = None if "" in found else found.get(str(self.option.default))
        return min(found.values(), key=SEVERITIES.index) if usual is None else usual

    def by_severity(self) -> Iterator[BoundRule]:
        """Yield the rule once for each severity, limited to the values of the option that give it.

        A rule that forbids something of pairs as an error becomes a rule that requires the opposite: an undecided pair is unknown.
        """
        if isinstance(self.rule.severity, str):
            yield self._opposite() if self.breaks_pairs else self
            return
        found, condition = self.severities, self.rule.condition
        for severity in dict.fromkeys(found.values()):
            here = in_(option(self.option), *(value for value, each in found.items() if each == severity))
            limited = condition & here if self.rule.kind == "forbids" else condition | ~here
            rule = replace(self.rule, condition=limited, severity=severity)
            yield from BoundRule(rule, self.vocabulary, self.scope, self.role).by_severity()

    @property
    def breaks_pairs(self) -> bool:
        """Whether it forbids something of pairs as an error."""
        return self.scope == "pair" and self.rule.kind == "forbids" and self.rule.severity == "error"

    def _opposite(self) -> BoundRule:
        rule = replace(self.rule, kind="requires", condition=~self.rule.condition)
        return BoundRule(rule, self.vocabulary, self.scope, self.role)


def bind_rule(rule: Rule, vocabulary: Vocabulary) -> BoundRule:
    """Bind a rule; `BoundRule.bound` raises where its condition cannot be."""
    # A guarantee is one of pairs, even where it rests on one side alone.
    scope = "pair" if rule.guarantee else scope_of(rule.condition)
    return BoundRule(rule, vocabulary, scope, rule.role or role_of(rule.condition))
