"""A system with its control flow: which nodes throw to and catch from which endpoints."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING

from cqos_core.behaviour.analysis import behaviour_of
from cqos_core.behaviour.graph import Wiring
from cqos_core.behaviour.policy_values import may_be_kept
from cqos_core.matching.judge import failed_match_conditions
from cqos_core.model.grouping import grouped
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.behaviour.analysis import Behaviour
    from cqos_core.behaviour.graph import EndpointKey
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.matching.topic_groups import TopicKey
    from cqos_core.model.system import System
    from cqos_core.resolving.resolved_endpoint import Resolved


class FlowModel:
    """A system with its control flow.

    Attributes:
        topics: the endpoints by protocol and topic.
        behaviour: the analyses of the control flow.
    """

    def __init__(self, pipeline: Pipeline) -> None:
        """Assign endpoints to the nodes that throw to and catch from them."""
        self.topics: Mapping[TopicKey, Sequence[Resolved]] = pipeline.topics
        self._names = _FlowNames(pipeline.system)
        keyed = ((self._names.key(each), each) for each in pipeline.endpoints)
        self._ends = grouped((key, each) for key, each in keyed if key is not None)
        self.behaviour: Behaviour = behaviour_of(pipeline.system.flows, self._signals(pipeline))

    def _signals(self, pipeline: Pipeline) -> Wiring:
        ends = [(self._names.key(each), topic, each) for topic, on_it in self.topics.items() for each in on_it]
        own = [(key, topic, each) for key, topic, each in ends if key is not None]
        thrown, caught = (
            grouped((key, topic) for key, topic, each in own if each.role == role) for role in (PUBLISHER, SUBSCRIBER)
        )
        keeping = {topic for _, topic, each in ends if each.role == PUBLISHER and may_be_kept(each)}
        others = {topic for key, topic, each in ends if each.external or (key is None and each.role == PUBLISHER)}
        catching = (each for each in own if each[2].role == SUBSCRIBER and each[1] in keeping)
        known = {each.stated_id for each in pipeline.endpoints if each.key is not None}
        anything = any(each.role == PUBLISHER and each.id not in known for each in pipeline.system.endpoints)
        return Wiring(
            {key: frozenset(topics) for key, topics in thrown.items()},
            {key: frozenset(topics) for key, topics in caught.items()},
            frozenset(others),
            frozenset(key for key, _, each in catching if may_be_kept(each)),
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
        """Yield every subscriber in the control flow, with its topics."""
        for key, ends in self._ends.items():
            topics = self.behaviour.signals.caught.get(key)
            yield from ((each, topics) for each in ends if topics and each.role == SUBSCRIBER)


class _FlowNames:
    """Finds the endpoint in a file for a resolved one, because several files may use one id."""

    def __init__(self, system: System) -> None:
        drawn = ((name, flow.source) for flow in system.flows for node in flow.nodes for name in node.endpoints)
        self._sources = {name: {*sources} for name, sources in grouped(drawn).items()}
        self._stated = Counter(each.id for each in system.endpoints)

    def key(self, end: Resolved) -> EndpointKey | None:
        """Return file and id; None if no control flow has the endpoint, or it is ambiguous."""
        sources = self._sources.get(end.stated_id)
        if sources is None:
            return None
        place = end.endpoint.place
        if place is not None and place.source in sources:
            return place.source, end.stated_id
        alone = len(sources) == 1 and self._stated[end.stated_id] == 1
        return (next(iter(sources)), end.stated_id) if alone else None


def has_control_flow(system: System) -> bool:
    """Whether a system has control flow, is whole, and is no trial."""
    return not (system.partial or system.hypothetical) and any(flow.flows for flow in system.flows)
