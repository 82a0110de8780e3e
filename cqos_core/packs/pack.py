"""Rule packs: the policies, rules, presets, dialects and meeting of one protocol, as one value."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from cqos_core.language.binding import bind
from cqos_core.language.expression import Term, Test, definitions
from cqos_core.language.policy import ENDPOINT, LEVELS, NEED, Policy
from cqos_core.language.values import normalise
from cqos_core.language.vocabulary import Function, Vocabulary
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_core.packs.bound_rule import BoundRule, bind_rule
from cqos_core.packs.costs import Costs
from cqos_core.packs.guarantee import WORDS, unstated
from cqos_core.packs.meeting import Meeting, Wire
from cqos_core.packs.panel import Panel
from cqos_core.packs.parts import (
    Completion,
    Convention,
    Derivation,
    Dialect,
    Folding,
    Known,
    Preset,
    Slip,
    Timing,
    no_misfits,
    nothing_follows,
    nothing_summed,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.language.evaluate import BoundCondition
    from cqos_core.language.expression import Node
    from cqos_core.language.values import Plain, Value
    from cqos_core.model.codes import CodeInfo
    from cqos_core.model.system import Broker
    from cqos_core.packs.guarantee import Proof, Unaffected
    from cqos_core.packs.logs import About, Misfit
    from cqos_core.packs.rule import Rule


@dataclass(frozen=True, eq=False)
class RulePack:
    """Everything C-QoS knows about one protocol.

    Attributes:
        id: what systems name it by: ``ros2``.
        title: for people: ``ROS 2``.
        policies: of all levels; their order is the order of display.
        rules: judging rules and meeting conditions.
        presets: by canonical name.
        base_preset: what unset policies take their values from, before policy defaults; None for none.
        dialects: by name; ``yaml`` is used where an importer's dialect is not listed.
        conventions: facts about well-known topics.
        functions: named functions its sentences use.
        meeting: how names are resolved and endpoints expanded.
        complete: adds what follows from all participants, endpoints and brokers of the protocol together.
        sum_up: from all endpoints of the protocol (`cqos_core.resolving.resolved.Resolved`), by position of an endpoint the values of its derived
            policies that follow from the others, such as what all topics of a client bring together.
        folding: which participants `complete` and `sum_up` cannot tell apart; None: a fleet has each of its systems checked whole.
        wire: the protocol underneath, where endpoints of this one meet endpoints of that one.
        variants: ``(option, value)`` to the pack that judges when the system's option has that value.
        not_checked: what no QoS check of this protocol can see, for the report.
        codes: what the importers that come with the pack report.
        read_log: yields what one line of a program's output says of endpoints that do not fit.
        provers: by name of an implementation, the ``"module:object"`` of what runs pairs on it, a `cqos_core.analysis.proving.Prover`; the
            first is used where the system names none.
        unaffected: guarantees that faults leave as they are; a fault with neither this nor a rule leaves a guarantee open.
        derivations: values of a pair that no end states; `cqos explain` shows them.
        proofs: which guarantees were seen under which faults on a running implementation.
        implementation_option: the option, or the policy of brokers, whose value `proofs` name; empty without proofs.
        timing: which policies say something about time.
        costs: what samples cost in bytes, on the wire and in histories.
        panel: how people see the settings.
        slips: what is often written by mistake, for messages; the first that fits is named.
        groups: words under which participants may group endpoints that share settings: ``publishers``, ``subscribers``.
        source: where the facts come from.
        validated: whether its authors have it validated in their tests, so that a start need not.
    """

    id: str
    title: str
    policies: tuple[Policy, ...]
    rules: tuple[Rule, ...]
    summary: str = ""
    presets: Mapping[str, Preset] = field(default_factory=dict)
    base_preset: str | None = None
    dialects: Mapping[str, Dialect] = field(default_factory=dict)
    conventions: tuple[Convention, ...] = ()
    functions: tuple[Function, ...] = ()
    meeting: Meeting = field(default_factory=Meeting)
    complete: Callable[[Sequence[Known], Sequence[Known], Mapping[str, Known]], Completion] = nothing_follows
    sum_up: Callable[[Sequence[Any]], Mapping[int, Mapping[str, Value]]] = nothing_summed
    folding: Folding | None = None
    wire: Wire | None = None
    variants: Mapping[tuple[str, str], RulePack] = field(default_factory=dict)
    not_checked: tuple[str, ...] = ()
    codes: tuple[CodeInfo, ...] = ()
    read_log: Callable[[str], Iterable[Misfit | About]] = no_misfits
    provers: Mapping[str, str] = field(default_factory=dict)
    unaffected: tuple[Unaffected, ...] = ()
    derivations: tuple[Derivation, ...] = ()
    proofs: tuple[Proof, ...] = ()
    implementation_option: str = ""
    timing: Timing = field(default_factory=Timing)
    costs: Costs = field(default_factory=Costs)
    panel: Panel = field(default_factory=Panel)
    groups: tuple[str, ...] = ()
    slips: tuple[Slip, ...] = ()
    source: str = ""
    validated: bool = False

    def __post_init__(self) -> None:
        """Bind every rule and read every default, so that a mistake shows when the pack is loaded, unless it is `validated`.

        Raises:
            PackError: naming every mistake found.
        """
        if self.validated:
            return
        from cqos_core.packs.validation import validate

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
    def vocabulary(self) -> Vocabulary:
        """The policies by index."""
        return Vocabulary(self.policies, self.functions)

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
        """Rules by scope; meeting conditions under ``meets``. Guarantees come last: they are of pairs that fit."""
        ordered = sorted(self.judging_rules, key=lambda bound: bool(bound.rule.guarantee))
        found = grouped(("meets" if bound.rule.kind == "meets" else bound.scope, bound) for bound in ordered)
        return {"meets": (), **{scope: tuple(rules) for scope, rules in found.items()}}

    @cached_property
    def beyond_topics(self) -> tuple[BoundRule, ...]:
        """The rules over participants, brokers and options, which no single topic can answer."""
        return tuple(bound for scope in ("participant", "broker", "system") for bound in self.by_scope.get(scope, ()))

    @cached_property
    def one_way(self) -> tuple[tuple[int, Plain], ...]:
        """`Meeting.one_way` as values by index."""
        return tuple(
            (self.vocabulary.indices[ENDPOINT, name], self.policy(name).domain.parse(text))
            for name, text in self.meeting.one_way.items()
        )

    @cached_property
    def spellings(self) -> Mapping[str, Mapping[str, int]]:
        """Per level: normalised name or alias → index."""
        found: dict[str, dict[str, int]] = {level: {} for level in LEVELS}
        for index, policy in enumerate(self.policies):
            for spelling in policy.spellings:
                found[policy.level][spelling] = index
        return found

    @cached_property
    def preset_names(self) -> Mapping[str, str]:
        """Normalised preset name or alias → canonical name."""
        return {
            normalise(spelling): name for name, preset in self.presets.items() for spelling in (name, *preset.aliases)
        }

    def is_fixed(self, broker: Broker) -> bool:
        """Whether a broker has a preset whose values its users cannot change."""
        names = [self.preset_names.get(normalise(ref.name)) for ref in broker.profiles]
        return any(name is not None and self.presets[name].fixed for name in names)

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
        """The definitions that its conditions use, by name: what `cqos_core.language.expression.parse` reads them with."""
        return definitions(*(bound.rule.condition for bound in self.bound_rules))

    def find(self, level: str, name: str, dialect: Dialect | None = None) -> int | None:
        """Index of the policy that ``name`` spells at ``level``, or None."""
        word = normalise(name)
        if dialect is not None and word in dialect.names:
            word = normalise(dialect.names[word])
        return self.spellings[level].get(word)

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
        """Return what an importer of the pack reports under that code, name or alias, or None."""
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

    def describe(self) -> dict[str, Any]:
        """Describe the pack for machines: enough to draw a property panel for a protocol never seen before."""
        from cqos_core.packs.catalogue import describe_pack

        return describe_pack(self)
