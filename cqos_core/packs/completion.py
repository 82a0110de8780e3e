"""Values that follow from all participants and endpoints of a system together."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

from cqos_core.language.values import Anything, is_plain
from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Endpoint


@dataclass(frozen=True, slots=True, eq=False)
class KnownEntity:
    """A participant, an endpoint or a broker with resolved values, as `RulePack.complete` takes it.

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
        """Return the stated value of a policy, from the settings, a profile, a preset or an overlay; None if nothing states it."""
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
    """Settings and endpoints that follow from a whole system.

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
    """Tells which participants a pack treats alike, so that each kind is completed once in a fleet of millions.

    Beside the listed data, `RulePack.complete` reads of a participant only its own settings and endpoints, and which of these have
    the same topic. Without the facts of a broker, texts in ``texts`` and ``topics`` decide no rule.

    Attributes:
        reads: from a written topic, all that the pack reads of it beside the topics that it matches.
        reaches: whether a topic matches others than itself.
        finder: from topics that do, a function that yields those that match a name.
        topics: settings of participants that name topics.
        shared: settings of participants that count by whether another participant has the same text.
        texts: settings of participants, each with a function that returns one text for all equivalent texts.
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


def nothing_follows(
    participants: Sequence[KnownEntity],  # noqa: ARG001 - the signature of all
    endpoints: Sequence[KnownEntity],  # noqa: ARG001
    brokers: Mapping[str, KnownEntity],  # noqa: ARG001
) -> Completion:
    """Add nothing to what a system states."""
    return Completion()


def nothing_summed(endpoints: Sequence[Any]) -> Mapping[int, Mapping[str, Value]]:  # noqa: ARG001 - as above
    """Add nothing to the values of endpoints."""
    return {}
