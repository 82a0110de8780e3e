"""Endpoints of a system and the control flow that throws to and catches from them."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.analysis import analysed
from cqos_core.behaviour.graph import Wiring
from cqos_core.language.binder import bind
from cqos_core.language.domains import Duration
from cqos_core.language.policy import ENDPOINT
from cqos_core.language.values import INFINITE
from cqos_core.matching.judge import failed_match_conditions
from cqos_core.model.codes import CODES
from cqos_core.model.finding import Finding, Remedy, Severity, Side
from cqos_core.model.grouping import grouped
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.resolving.finding_facts import fact

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.behaviour.analysis import Behaviour
    from cqos_core.behaviour.graph import EndpointKey
    from cqos_core.language.expression import Condition
    from cqos_core.language.values import Plain
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.finding import Verdict
    from cqos_core.model.system import System
    from cqos_core.resolving.resolved_endpoint import Resolved

THROWN: Final = "thrown here"
CAUGHT: Final = "caught here"


class Drawn:
    """A system, and what its control flow says.

    Attributes:
        topics: the endpoints by protocol and topic.
        behaviour: what the control flow says.
    """

    def __init__(self, pipeline: Pipeline) -> None:
        """Find out which nodes throw to and catch from which endpoints."""
        self.topics: Mapping[TopicKey, Sequence[Resolved]] = pipeline.topics
        self._names = _DrawnNames(pipeline.system)
        keyed = ((self._names.key(each), each) for each in pipeline.endpoints)
        self._ends = grouped((key, each) for key, each in keyed if key is not None)
        self.behaviour: Behaviour = analysed(pipeline.system.flows, self._signals(pipeline))

    def _signals(self, pipeline: Pipeline) -> Wiring:
        ends = [(self._names.key(each), topic, each) for topic, on_it in self.topics.items() for each in on_it]
        own = [(key, topic, each) for key, topic, each in ends if key is not None]
        thrown, caught = (
            grouped((key, topic) for key, topic, each in own if each.role == role) for role in (PUBLISHER, SUBSCRIBER)
        )
        keeping = {topic for _, topic, each in ends if each.role == PUBLISHER and _may_be_kept(each)}
        others = {topic for key, topic, each in ends if each.external or (key is None and each.role == PUBLISHER)}
        catching = (each for each in own if each[2].role == SUBSCRIBER and each[1] in keeping)
        known = {each.stated_id for each in pipeline.endpoints if each.key is not None}
        anything = any(each.role == PUBLISHER and each.id not in known for each in pipeline.system.endpoints)
        return Wiring(
            {key: frozenset(topics) for key, topics in thrown.items()},
            {key: frozenset(topics) for key, topics in caught.items()},
            frozenset(others),
            frozenset(key for key, _, each in catching if _may_be_kept(each)),
            anything,
        )

    def ends(self, at: int) -> list[Resolved]:
        """Return the endpoints of a node."""
        graph = self.behaviour.graph
        keys = ((graph.files[at], each) for each in graph.nodes[at].endpoints)
        return [end for key in keys for end in self._ends.get(key, ())]

    @cached_property
    def _nodes(self) -> Mapping[str, Sequence[int]]:
        return grouped((end.id, at) for at in range(len(self.behaviour.graph.nodes)) for end in self.ends(at))

    def nodes(self, ends: Iterable[Resolved]) -> list[int]:
        """Return the nodes that throw to or catch from some endpoints."""
        return sorted({at for end in ends for at in self._nodes.get(end.id, ())})

    def on(self, topic: Hashable, role: str) -> list[Resolved]:
        """Return the endpoints of one role on a topic."""
        return [each for each in self.topics.get(topic, ()) if each.role == role]  # type: ignore[call-overload]

    def partners(self, end: Resolved, topics: Iterable[Hashable]) -> list[Resolved]:
        """Return the publishers on some topics that form a pair with a subscriber there."""
        return [
            each
            for topic in topics
            for each in self.on(topic, PUBLISHER)
            if not failed_match_conditions(each.profile, end.profile)
        ]

    def partners_here(self, end: Resolved) -> list[Resolved]:
        """Return the publishers that form a pair with a subscriber on the topic that it names."""
        return self.partners(end, [(end.pack.id, end.key)])

    def subscribers(self) -> Iterator[tuple[Resolved, frozenset[Hashable]]]:
        """Yield every subscriber that the control flow draws, with its topics."""
        for key, ends in self._ends.items():
            topics = self.behaviour.signals.caught.get(key)
            yield from ((each, topics) for each in ends if topics and each.role == SUBSCRIBER)


class _DrawnNames:
    """Tells which endpoint of a file a resolved one is: several files may use one id."""

    def __init__(self, system: System) -> None:
        drawn = ((name, flow.source) for flow in system.flows for node in flow.nodes for name in node.endpoints)
        self._sources = {name: {*sources} for name, sources in grouped(drawn).items()}
        self._stated = Counter(each.id for each in system.endpoints)

    def key(self, end: Resolved) -> EndpointKey | None:
        """Return file and id, None where no control flow draws it, or where that is open."""
        sources = self._sources.get(end.stated_id)
        if sources is None:
            return None
        place = end.endpoint.place
        if place is not None and place.source in sources:
            return place.source, end.stated_id
        alone = len(sources) == 1 and self._stated[end.stated_id] == 1
        return (next(iter(sources)), end.stated_id) if alone else None


def draws(system: System) -> bool:
    """Whether a system has control flow about which something can be said: it is whole, and no mere trial."""
    return not (system.partial or system.hypothetical) and any(flow.flows for flow in system.flows)


def finite(end: Resolved, policy: str) -> int | None:
    """Return the value of a policy of an endpoint, None where it is infinite, not known, or the pack has no such policy."""
    indices = end.pack.vocabulary.indices
    if not policy or (ENDPOINT, policy) not in indices:
        return None
    value = end.profile.values[indices[ENDPOINT, policy]]
    return value if isinstance(value, int) and value < INFINITE else None


def is_one_of(end: Resolved, meaning: tuple[str, tuple[str, ...]]) -> bool | None:
    """Return whether a policy of an endpoint has one of some values; None where that is not known."""
    name, texts = meaning
    if not name:
        return False
    value = end.profile.values[end.pack.vocabulary.indices[ENDPOINT, name]]
    domain = end.pack.policy(name).domain
    return value in {domain.parse(text) for text in texts} if isinstance(value, (int, str)) else None


def _may_be_kept(end: Resolved) -> bool:
    """Whether samples may be kept for subscribers that come later, as far as one end says."""
    return not end.pack.timing.kept[0] or _keeps(end) is not False


def _keeps(end: Resolved) -> bool | None:
    kept = end.pack.timing.kept
    return True if kept[0] and end.role not in end.pack.policy(kept[0]).roles else is_one_of(end, kept)


def keep(publisher: Resolved, subscriber: Resolved) -> bool | None:
    """Return whether both ends keep samples for a subscription that comes later; None where that is not known."""
    timing = publisher.pack.timing
    answers = {_keeps(publisher), _keeps(subscriber), _judged(timing.replayed, publisher, subscriber)}
    return False if False in answers else None if None in answers else True


def kept_for(publisher: Resolved, subscriber: Resolved) -> int | None:
    """Return for how long an intermediary keeps samples for later subscriptions; None where nothing limits it for certain."""
    timing = publisher.pack.timing
    return finite(publisher, timing.kept_for) if _judged(timing.expires, publisher, subscriber) else None


def _judged(condition: Condition | None, publisher: Resolved, subscriber: Resolved) -> bool | None:
    if condition is None:
        return True
    values = publisher.profile.values, subscriber.profile.values
    return bind(condition, publisher.pack.vocabulary).judge(*values).result


def needed(end: Resolved, word: str) -> int | None:
    """Return what an endpoint requires of a guarantee, None where it requires nothing or that is not known."""
    index, nothing = end.pack.needs.get(word, (None, None))
    value = None if index is None else end.profile.values[index]
    return value if isinstance(value, int) and value != nothing else None


def time_text(nanoseconds: int) -> str:
    """Return a duration in the spelling of system files."""
    return Duration().format(nanoseconds)


def behaviour_finding(
    code: str,
    message: str,
    ends: Sequence[Resolved],
    *,
    policies: Iterable[str] = (),
    beside: Iterable[Side] = (),
    assumed: Iterable[str] = (),
    worlds: Mapping[str, Verdict] = MappingProxyType({}),
    severity: Severity | None = None,
    fix: Remedy | None = None,
) -> Finding:
    """Make a finding about endpoints of one role.

    Args:
        code: of `CODES`.
        message: one sentence.
        ends: the endpoints; the first one shows its values of ``policies``.
        policies: names of policies; empty ones are passed over.
        beside: what else shows the reason.
        assumed: what the claim rests on.
        worlds: for a claim that depends on a reading, the verdict of each.
        severity: where it is not that of the code.
        fix: of `draft`.
    """
    info = CODES[code]
    ends = sorted(ends, key=lambda each: each.id)
    first = ends[0]
    indices = (first.pack.vocabulary.indices[ENDPOINT, name] for name in policies if name)
    own = [fact(first, first.profile, index) for index in indices]
    members = tuple(dict.fromkeys(each.id for each in ends))
    side = Side(first.role, members, THROWN if first.role == PUBLISHER else CAUGHT, tuple(own), first.endpoint.place)
    return Finding(
        code=code,
        name=info.name,
        severity=severity or Severity(info.severity),
        message=message,
        topic=first.shown,
        sides=(side, *beside),
        notes=tuple(f"assumed: {each}" for each in assumed),
        because=info.reason,
        help=info.help,
        worlds=worlds,
        remedies=() if fix is None else (fix,),
    )


def draft(ends: Sequence[Resolved], policy: str, value: Plain) -> Remedy | None:
    """Return a change of a policy of some endpoints that ends a finding. What else it does is not known yet."""
    first = ends[0]
    if (ENDPOINT, policy) not in first.pack.vocabulary.indices:
        return None
    members = tuple(sorted({each.id for each in ends}))
    return Remedy(
        role=PUBLISHER if first.role == PUBLISHER else SUBSCRIBER,
        members=members,
        policy=policy,
        value=first.pack.policy(policy).domain.format(value),
        kind="configuration",
        text="",
    )
