"""The parts of a rule pack beside policies and rules: presets, dialects, conventions, and what follows from a whole system."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any, Literal

from cqos_core.language.policy import ENDPOINT, Policy
from cqos_core.language.values import Anything, is_plain
from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from cqos_core.language.expression import Condition, Operand
    from cqos_core.language.values import Value
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Endpoint
    from cqos_core.packs.logs import Misfit


@dataclass(frozen=True, slots=True)
class Preset:
    """A named bundle of values that comes with the pack.

    Attributes:
        settings: policy name to text; policies not named keep their defaults.
        level: whose policies these are: ``endpoint`` or ``broker``.
        needs: option and the least value of it that has this preset, for instance ``("distro", "iron")``; None: always.
        aliases: other spellings; compared normalised.
        fixed: its users cannot change these values, such as limits of a cloud service, so no fix does.
        hosts: patterns of addresses at which a broker has these values for certain, where it names no profile.
    """

    settings: Mapping[str, str]
    doc: str = ""
    needs: tuple[str, str] | None = None
    aliases: tuple[str, ...] = ()
    level: Literal["endpoint", "broker"] = ENDPOINT
    fixed: bool = False
    hosts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Slip:
    """What people write who think of another protocol, and what to write here.

    Attributes:
        written: a regular expression for a setting, ``name: value``, or for the name of a profile, whole and without regard to case.
        write: what to write in its place, in which a backslash and a number stand for a group.
    """

    written: str
    write: str


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A participant, an endpoint or a broker as `RulePack.complete` sees it: with resolved values, never with their text.

    Attributes:
        id, place, template, external: as stated.
        read: returns the value of a policy and its place, or None where nothing states it.
        find_needs: returns the guarantees that an endpoint needs.
        role, topic, participant, kind: of an endpoint.
    """

    id: str
    read: Callable[[Policy], tuple[Value, Place | None] | None] = field(repr=False)
    find_needs: Callable[[], Collection[str]] = field(repr=False, default=tuple)
    place: Place | None = None
    template: str | None = None
    external: bool = False
    role: str = ""
    topic: str | None = None
    participant: str = ""
    kind: str = ""

    @property
    def needs(self) -> Collection[str]:
        """The guarantees that an endpoint needs, in the words of `cqos_core.packs.guarantee`."""
        return self.find_needs()

    def value(self, policy: Policy) -> Value | None:
        """Return what is stated of a policy, in the settings, a profile, a preset or an overlay; None where nothing is."""
        found = self.read(policy)
        return None if found is None else found[0]

    def setting(self, policy: Policy) -> Setting | None:
        """Return the same as a setting in its one spelling; it is unknown where the value is not plain."""
        found = self.read(policy)
        if found is None:
            return None
        value, place = found
        if is_plain(value):
            return Setting(policy.domain.format(value), place)  # type: ignore[arg-type]
        code = value.code if isinstance(value, Anything) else ""
        return Setting("", place, unknown=policy.format(value), reported=code)


@dataclass(frozen=True, slots=True)
class Completion:
    """What follows from all that a system states together, and nothing in it states alone.

    Attributes:
        participants: settings by id of the participant.
        endpoints: settings by position of the endpoint.
        implied: endpoints that participants have by their own settings, such as the message that a connection leaves behind.
    """

    participants: Mapping[str, Settings] = field(default_factory=dict)
    endpoints: Mapping[int, Settings] = field(default_factory=dict)
    implied: tuple[Endpoint, ...] = ()


@dataclass(frozen=True, slots=True)
class Folding:
    """Which participants a pack cannot tell apart, so that each kind of them is completed once in a fleet of millions.

    Beside what is listed here, `RulePack.complete` reads of a participant only its own settings and endpoints, and of these, which
    have the same topic. Without the facts of a broker, texts in ``texts`` and ``topics`` decide no rule.

    Attributes:
        reads: from a written topic, all that the pack reads of it beside the topics that it matches.
        reaches: whether a topic matches others than itself.
        finder: from topics that do, a function that yields those that match a name.
        topics: settings of participants that name topics.
        shared: settings of participants that count by whether another participant has the same text.
        texts: settings of participants, each with what gives one text for all that count alike.
        own: policies of participants whose value is the participant's own name, or the default.
        heard: the values, as of `RulePack.sum_up`, of all subscribers of a participant: for each of them its profile, and how many topics
            it hears from which publishers (profiles, with their number).
    """

    reads: Callable[[str], str]
    reaches: Callable[[str], bool]
    finder: Callable[[Collection[str]], Callable[[str], Iterable[str]]]
    heard: Callable[[Sequence[tuple[Sequence[tuple[Mapping[Any, int], int]], Any]]], Mapping[str, Value]]
    topics: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    texts: Mapping[str, Callable[[str], str]] = field(default_factory=dict)
    own: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Dialect:
    """How one kind of file writes the pack's settings.

    Attributes:
        names: attribute name (normalised) to policy name, beside the policies' own aliases.
        codes: policy name to its integer codes: ``{"history": {"0": "keep_last"}}``.
        bare_unit: unit of a duration without one (``s``, ``ns``); None refuses it.
        zero_is_unset: a numeric zero of a count or duration means "not stated".
        ignore: attribute names (normalised) that are no settings of this pack.
        writes: policy name to the attribute that a person writes, where that is not its name; empty: it has no place there.
        words: those special words of policies that have a place in such files; None: all that people write.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    codes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    bare_unit: str | None = None
    zero_is_unset: bool = False
    ignore: frozenset[str] = frozenset()
    writes: Mapping[str, str] = field(default_factory=dict)
    words: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Convention:
    """What users of a protocol agree on about some topics: facts that hold unless stated otherwise.

    Attributes:
        pattern: shell pattern over the resolved topic name.
        settings: topic-level settings: ``{"latched": "true"}``.
        external: the other side is usually part of no design (a log collector, say), so a missing partner is no finding.
    """

    pattern: str
    settings: Mapping[str, str] = field(default_factory=dict)
    external: bool = False
    doc: str = ""


@dataclass(frozen=True, slots=True)
class Derivation:
    """What a pair amounts to in a value that neither end states: the QoS with which a message arrives.

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
class Timing:
    """Which policies say something about time: `cqos_core.behaviour.timer_findings` and its like compares them with what control flow says.

    Names are those of policies; where the pack has no such policy they are empty. A pair is a policy and those of its values that
    have the meaning.

    Attributes:
        gap: the longest time between two samples, offered and requested.
        lease: the time without a sign of liveliness after which a publisher counts as lost.
        asserted_on_topic: kinds of liveliness that only samples on the topic assert.
        asserted_by_participant: those that any sample of the participant asserts.
        lifespan: how long a sample lives, from when it is published, wherever it is.
        kept: the durability with which samples are kept for subscribers that come later. An end that has no such policy is not asked.
        replayed: when, with that, the last sample of a publisher reaches a subscriber that comes later; None: always.
        kept_for: how long it is kept for them, where that limits neither its time on the network nor in queues of subscribers.
        expires: when `kept_for` has an effect; None: always.
        certain: the reliability with which these get them.
        unlimited: the history that keeps all samples.
        depth: how many samples are kept otherwise.
        owned: the ownership with which one publisher counts at a time.
        strength: which publisher that is.
        period: the fact of topics that says how often samples come.
        latched: the fact of topics that says that the last sample is meant for later subscribers.
        keyed: the fact of topics that says that they have instances, each with a history of its own.
    """

    gap: str = ""
    lease: str = ""
    asserted_on_topic: tuple[str, tuple[str, ...]] = ("", ())
    asserted_by_participant: tuple[str, tuple[str, ...]] = ("", ())
    lifespan: str = ""
    kept: tuple[str, tuple[str, ...]] = ("", ())
    replayed: Condition | None = None
    kept_for: str = ""
    expires: Condition | None = None
    certain: tuple[str, tuple[str, ...]] = ("", ())
    unlimited: tuple[str, tuple[str, ...]] = ("", ())
    depth: str = ""
    owned: tuple[str, tuple[str, ...]] = ("", ())
    strength: str = ""
    period: str = ""
    latched: str = ""
    keyed: str = ""


def no_misfits(line: str) -> tuple[Misfit, ...]:  # noqa: ARG001 - the signature of all that read output
    """Read nothing from the output of programs."""
    return ()


def nothing_follows(
    participants: Sequence[Known],  # noqa: ARG001 - the signature of all
    endpoints: Sequence[Known],  # noqa: ARG001
    brokers: Mapping[str, Known],  # noqa: ARG001
) -> Completion:
    """Add nothing to what a system states."""
    return Completion()


def nothing_summed(endpoints: Sequence[Any]) -> Mapping[int, Mapping[str, Value]]:  # noqa: ARG001 - as above
    """Add nothing to the values of endpoints."""
    return {}
