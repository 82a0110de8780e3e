"""The definition of a rule pack by its author: policies, rules, presets, dialects and topic matching of one protocol."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from cqos_core.language.policy import LEVELS, Policy
from cqos_core.language.values import normalise
from cqos_core.language.vocabulary import Function, Vocabulary
from cqos_core.model.dataclass import dataclass
from cqos_core.packs.completion import Completion, Folding, KnownEntity, nothing_follows, nothing_summed
from cqos_core.packs.costs import Costs
from cqos_core.packs.property_panel import Panel
from cqos_core.packs.timing import Timing
from cqos_core.packs.topic_matching import TopicMatching

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from typing_extensions import Self

    from cqos_core.language.expression import Operand
    from cqos_core.language.values import Value
    from cqos_core.model.codes import CodeInfo
    from cqos_core.packs.guarantee import Proof, Unaffected
    from cqos_core.packs.logs import ListTopic, LogMismatch
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
        complete: adds what follows from all participants, endpoints and brokers of the protocol together.
        sum_up: from all endpoints of the protocol (`cqos_core.resolving.resolved_endpoint.Resolved`), by position of an endpoint the values of its derived
            policies that follow from the others, such as what all topics of a client bring together.
        folding: which participants `complete` and `sum_up` cannot tell apart; None: a fleet has each of its systems checked whole.
        wire: the protocol underneath, where endpoints of this one meet endpoints of that one.
        variants: ``(option, value)`` to the pack that judges when the system's option has that value.
        not_checked: what no QoS check of this protocol can see, for the report.
        codes: codes of the importers that come with the pack.
        read_log: yields the mismatches of endpoints in one line of a program's output.
        provers: by name of an implementation, the ``"module:object"`` of what runs pairs on it, a `cqos_core.packs.prover.Prover`; the
            first is used where the system names none.
        unaffected: guarantees that faults leave as they are; a fault with neither this nor a rule leaves a guarantee open.
        derivations: values of a pair that no end states; `cqos explain` shows them.
        proofs: which guarantees were seen under which faults on a running implementation.
        implementation_option: the option, or the policy of brokers, whose value `proofs` name; empty without proofs.
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
    complete: Callable[[Sequence[KnownEntity], Sequence[KnownEntity], Mapping[str, KnownEntity]], Completion] = (
        nothing_follows
    )
    sum_up: Callable[[Sequence[Any]], Mapping[int, Mapping[str, Value]]] = nothing_summed
    folding: Folding | None = None
    wire: Wire | None = None
    variants: Mapping[tuple[str, str], Self] = field(default_factory=dict)
    not_checked: tuple[str, ...] = ()
    codes: tuple[CodeInfo, ...] = ()
    read_log: Callable[[str], Iterable[LogMismatch | ListTopic]] = no_mismatches
    provers: Mapping[str, str] = field(default_factory=dict)
    unaffected: tuple[Unaffected, ...] = ()
    derivations: tuple[Derivation, ...] = ()
    proofs: tuple[Proof, ...] = ()
    implementation_option: str = ""
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
