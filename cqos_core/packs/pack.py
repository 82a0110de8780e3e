"""Rule packs: the definition of a protocol by an author, and everything derived from it."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from functools import cached_property
from typing import TYPE_CHECKING

from cqos_core.language.binder import bind
from cqos_core.language.expression import Term, Test, definitions
from cqos_core.language.policy import ENDPOINT, NEED, Policy
from cqos_core.language.values import normalise
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_core.packs.bound_rule import BoundRule, bind_rule
from cqos_core.packs.guarantee import WORDS, unstated
from cqos_core.packs.pack_definition import PackDefinition

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.language.bound_condition import BoundCondition
    from cqos_core.language.expression import Node
    from cqos_core.language.values import Plain
    from cqos_core.model.code_info import CodeInfo
    from cqos_core.model.system import Broker
    from cqos_core.packs.pack_definition import Derivation
    from cqos_core.packs.rule import Rule


@dataclass(frozen=True, eq=False)
class RulePack(PackDefinition):
    """Everything that C-QoS knows about one protocol: a `PackDefinition`, and values derived from it."""

    def __post_init__(self) -> None:
        """Bind every rule and read every default, so that a mistake shows when the pack is loaded, unless it is `validated`.

        Raises:
            PackError: naming every mistake found.
        """
        if self.validated:
            return
        from cqos_core.packs.pack_validation import validate

        validate(self)

    @cached_property
    def bound_rules(self) -> tuple[BoundRule, ...]:
        """The rules by code; each is bound to the policies when it is first asked."""
        return tuple(bind_rule(rule, self.vocabulary) for rule in sorted(self.rules, key=lambda rule: rule.code))

    @cached_property
    def judging_rules(self) -> tuple[BoundRule, ...]:
        """The rules by severity, and those that leave a guarantee open under a fault that the pack does not cover."""
        derived = (bind_rule(rule, self.vocabulary) for rule in unstated(self.rules, self.unaffected))
        stated = (each for bound in self.bound_rules for each in bound.by_severity())
        return (*stated, *derived)

    @cached_property
    def asked(self) -> frozenset[int]:
        """Indices of the policies whose spelling a rule asks for."""
        every = (node for rule in self.rules for node in rule.condition.walk())
        asked = (node.args[0] for node in every if isinstance(node, Test) and node.name in {"stated", "stated_here"})
        return frozenset(self.vocabulary.find(term) for term in asked if isinstance(term, Term))

    @cached_property
    def derived(self) -> tuple[tuple[Derivation, tuple[tuple[str, BoundCondition], ...]], ...]:
        """By derivation, each value that it may have, with the sentence that it has it."""
        return tuple(
            (
                each,
                tuple(
                    (text, bind(each.operand == text, self.vocabulary))
                    for text in (each.policy.domain.format(value) for value in each.policy.domain.candidates())
                ),
            )
            for each in self.derivations
        )

    @cached_property
    def by_scope(self) -> Mapping[str, tuple[BoundRule, ...]]:
        """Rules by scope; matching conditions under ``meets``. Guarantees come last: only compatible pairs have them."""
        ordered = sorted(self.judging_rules, key=lambda bound: bool(bound.rule.guarantee))
        found = grouped(("meets" if bound.rule.kind == "meets" else bound.scope, bound) for bound in ordered)
        return {"meets": (), **{scope: tuple(rules) for scope, rules in found.items()}}

    @cached_property
    def participant_rules(self) -> tuple[BoundRule, ...]:
        """The rules over participants, brokers and options, which no single topic can answer."""
        return tuple(bound for scope in ("participant", "broker", "system") for bound in self.by_scope.get(scope, ()))

    @cached_property
    def one_way(self) -> tuple[tuple[int, Plain], ...]:
        """`TopicMatching.one_way` as values by index."""
        return tuple(
            (self.vocabulary.indices[ENDPOINT, name], self.policy(name).domain.parse(text))
            for name, text in self.topic_matching.one_way.items()
        )

    @cached_property
    def preset_names(self) -> Mapping[str, str]:
        """Normalised preset name or alias → canonical name."""
        return {
            normalise(spelling): name for name, preset in self.presets.items() for spelling in (name, *preset.aliases)
        }

    def is_fixed(self, broker: Broker) -> bool:
        """Whether a broker has a preset whose values its users cannot change."""
        named = [self.preset_names.get(normalise(ref.name)) for ref in broker.profiles]
        names = named or self.presets_at(broker.id)
        return any(name is not None and self.presets[name].fixed for name in names)

    def presets_at(self, address: str) -> list[str]:
        """Return the presets that a broker at an address has for certain, where it names none."""
        host = re.sub(r":\d+$", "", address.rpartition("://")[2].lower())
        return [name for name, each in self.presets.items() if any(fnmatchcase(host, at) for at in each.hosts)]

    @cached_property
    def needs(self) -> Mapping[str, tuple[int, Plain]]:
        """By word of `cqos_core.packs.guarantee`, the index of its need in the values, and its "not required" value."""
        found = {}
        for index, policy in enumerate(self.policies):
            if policy.level == NEED and (word := WORDS.get(policy.aliases[0] if policy.aliases else "")):
                found[word.name] = (index, word.nothing)
        return found

    @cached_property
    def guaranteed(self) -> Mapping[str, tuple[BoundRule, ...]]:
        """By word of `cqos_core.packs.guarantee`, the rules on which its guarantee rests."""
        found = grouped((bound.rule.guarantee, bound) for bound in self.judging_rules if bound.rule.guarantee)
        return {word: tuple(rules) for word, rules in found.items()}

    @cached_property
    def definitions(self) -> Mapping[str, Node]:
        """The definitions that its conditions use, by name, as `cqos_core.language.parser.parse` takes them."""
        return definitions(*(bound.rule.condition for bound in self.bound_rules))

    def policy(self, name: str, level: str = ENDPOINT) -> Policy:
        """Return the policy of that name or alias.

        Raises:
            KeyError: it is missing.
        """
        index = self.find(level, name)
        if index is None:
            raise KeyError(name)
        return self.policies[index]

    def rule(self, code_or_name: str) -> Rule | None:
        """Return the rule with that code, name or alias, or None."""
        return self._rules.get(code_or_name.lower())

    def code(self, code_or_name: str) -> CodeInfo | None:
        """Return the importers' code with that code, name or alias, or None."""
        return self._codes.get(code_or_name.lower())

    @cached_property
    def _rules(self) -> Mapping[str, Rule]:
        """By code, name and alias in lower case; the first of a spelling counts."""
        return {
            spelling.lower(): rule
            for rule in reversed(self.rules)
            for spelling in (rule.code, rule.name, *rule.aliases)
        }

    @cached_property
    def _codes(self) -> Mapping[str, CodeInfo]:
        """By code, name and alias in lower case; the first of a spelling counts."""
        return {spelling: info for info in reversed(self.codes) for spelling in info.spellings}
