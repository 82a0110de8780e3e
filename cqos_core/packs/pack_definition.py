"""The definition of a rule pack by its author: policies, rules, presets, dialects and topic matching of one protocol."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING

from cqos_core.language.policy import LEVELS, Policy
from cqos_core.language.values import normalise
from cqos_core.language.vocabulary import Function, Vocabulary
from cqos_core.model.dataclass import dataclass
from cqos_core.packs.completion import SystemFacts
from cqos_core.packs.costs import Costs
from cqos_core.packs.property_panel import Panel
from cqos_core.packs.timing import Timing
from cqos_core.packs.topic_matching import TopicMatching

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from typing_extensions import Self

    from cqos_core.language.expression import Operand
    from cqos_core.model.code_info import CodeInfo
    from cqos_core.packs.guarantee import Proof, Unaffected
    from cqos_core.packs.log_mismatches import ListTopic, LogMismatch
    from cqos_core.packs.presets import CommonMistake, Convention, Dialect, Preset
    from cqos_core.packs.rule import Rule
    from cqos_core.packs.wire import Wire


@dataclass(frozen=True, slots=True)
class Derivation:
    """A value of a pair that neither end states, such as the QoS with which a message arrives.

    Attributes:
        name: for people, such as ``arrives with QoS``.
        operand: over the policies of both ends, with few values.
        policy: the policy whose values it has.
        doc: how it comes about, in a few words.
    """

    name: str
    operand: Operand
    policy: Policy
    doc: str = ""


@dataclass(frozen=True, slots=True)
class Implementations:
    """What is known of programs that implement the protocol.

    Attributes:
        option: the option, or the policy of brokers, whose value names one: ``rmw``.
        proofs: which guarantees were seen under which faults on one that ran.
        provers: by name, the ``"module:object"`` of what runs pairs on it, a `cqos_core.packs.prover.Prover`; the first is used
            where the system names none.
    """

    option: str = ""
    proofs: tuple[Proof, ...] = ()
    provers: Mapping[str, str] = field(default_factory=dict)


def no_mismatches(line: str) -> tuple[LogMismatch, ...]:  # noqa: ARG001 - the signature of all that read output
    """Read nothing from the output of programs."""
    return ()


@dataclass(frozen=True, eq=False)
class PackDefinition:
    """The definition of a rule pack by its author: everything that C-QoS knows about one protocol.

    Attributes:
        id: its name in systems: ``ros2``.
        title: for people: ``ROS 2``.
        policies: of all levels; their order is the order of display.
        rules: judging rules and matching conditions.
        presets: by canonical name.
        base_preset: the preset of unset policies, before policy defaults; None for none.
        dialects: by name; ``yaml`` is used where an importer's dialect is not listed.
        conventions: facts about well-known topics.
        functions: named functions its sentences use.
        topic_matching: how names are resolved and endpoints expanded.
        system_facts: what follows from all participants, endpoints and brokers of the protocol together.
        wire: the protocol underneath, where endpoints of this one meet endpoints of that one.
        variants: ``(option, value)`` to the pack that judges when the system's option has that value.
        not_checked: what no QoS check of this protocol can see, for the report.
        codes: what the importers that come with the pack report.
        read_log: yields what one line of a program's output says of endpoints that do not fit.
        implementations: what is known of programs that implement the protocol: proofs, and what runs pairs.
        unaffected: guarantees that faults leave as they are; a fault with neither this nor a rule leaves a guarantee open.
        derivations: values of a pair that no end states; `cqos explain` shows them.
        timing: which policies say something about time.
        costs: bytes of samples, on the wire and in histories.
        panel: how people see the settings.
        common_mistakes: settings often written by mistake, for messages; the first that matches is named.
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
    topic_matching: TopicMatching = field(default_factory=TopicMatching)
    system_facts: SystemFacts = field(default_factory=SystemFacts)
    wire: Wire | None = None
    variants: Mapping[tuple[str, str], Self] = field(default_factory=dict)
    not_checked: tuple[str, ...] = ()
    codes: tuple[CodeInfo, ...] = ()
    read_log: Callable[[str], Iterable[LogMismatch | ListTopic]] = no_mismatches
    implementations: Implementations = field(default_factory=Implementations)
    unaffected: tuple[Unaffected, ...] = ()
    derivations: tuple[Derivation, ...] = ()
    timing: Timing = field(default_factory=Timing)
    costs: Costs = field(default_factory=Costs)
    panel: Panel = field(default_factory=Panel)
    groups: tuple[str, ...] = ()
    common_mistakes: tuple[CommonMistake, ...] = ()
    source: str = ""
    validated: bool = False

    @cached_property
    def vocabulary(self) -> Vocabulary:
        """The policies by index."""
        return Vocabulary(self.policies, self.functions)

    @cached_property
    def spellings(self) -> Mapping[str, Mapping[str, int]]:
        """Per level: normalised name or alias → index."""
        found: dict[str, dict[str, int]] = {level: {} for level in LEVELS}
        for index, policy in enumerate(self.policies):
            for spelling in policy.spellings:
                found[policy.level][spelling] = index
        return found

    def find(self, level: str, name: str, dialect: Dialect | None = None) -> int | None:
        """Index of the policy that ``name`` spells at ``level``, or None."""
        word = normalise(name)
        if dialect is not None and word in dialect.names:
            word = normalise(dialect.names[word])
        return self.spellings[level].get(word)
