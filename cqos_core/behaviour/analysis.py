"""The analyses of the control flow of one system."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.event_order import Order
from cqos_core.behaviour.event_rates import EventRates, is_single, sum_of_rates
from cqos_core.behaviour.graph import joined_graph
from cqos_core.behaviour.inclusive_joins import stuck_joins
from cqos_core.behaviour.reachability import ReachableEvents, reachable_events, single_events

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Sequence

    from cqos_core.behaviour.event_rates import Rate
    from cqos_core.behaviour.graph import Graph, Wiring
    from cqos_core.behaviour.reachability import SingleEvents
    from cqos_core.model.flow import ControlFlow

_ROUNDS: Final = 3
"""The most repetitions of reachability and rates, which depend on each other."""


class Behaviour:
    """The analyses of the control flow of a system. Each runs once, on first use.

    Attributes:
        flows: the control flow of each file.
        signals: which endpoints match.
        graph: the nodes; all else names them by their positions in it.
    """

    def __init__(self, flows: Sequence[ControlFlow], signals: Wiring) -> None:
        """See `behaviour_of`."""
        self.flows = (*flows,)
        self.signals = signals
        self.graph: Graph = joined_graph(flows, signals)

    @cached_property
    def reachable_in_any_order(self) -> ReachableEvents:
        """Events that may happen if topics without publisher have one elsewhere, signals come in any order, and messages from anywhere."""
        return reachable_events(self.graph, self.signals, missing=True)

    @cached_property
    def reachable(self) -> ReachableEvents:
        """Events that may happen in the order of events, as joins wait, and if messages come only over message flows."""
        return self._as_drawn(missing=True)

    @cached_property
    def reachable_alone(self) -> ReachableEvents:
        """Events that may happen if only publishers of the system publish."""
        return self._as_drawn(missing=False)

    @property
    def rates(self) -> EventRates:
        """How often events happen at most."""
        return self._ordered_and_rates[1]

    @cached_property
    def _ordered_and_rates(self) -> tuple[ReachableEvents, EventRates]:
        """Events that may happen in the order of events, and rates: they depend on each other, so both are repeated."""
        known = self.reachable_in_any_order
        counting = EventRates(self.graph, self.signals, known.fired)
        for _ in range(_ROUNDS):
            known = reachable_events(self.graph, self.signals, missing=True, single=self._single(counting))
            earlier, counting = counting, EventRates(self.graph, self.signals, known.fired, counting)
            if counting.bounds == earlier.bounds:
                break
        return known, counting

    def _single(self, counting: EventRates) -> SingleEvents:
        return single_events(self.graph, lambda at: is_single(counting.bounds[at]))

    def _as_drawn(self, *, missing: bool) -> ReachableEvents:
        """Return the events that may happen if all that is drawn is considered."""
        ordered, rates = self._ordered_and_rates
        if missing and not self._stuck and not any(self.graph.brought):
            return ordered
        single = self._single(rates)
        return reachable_events(
            self.graph, self.signals, missing=missing, single=single, stuck=self._stuck, messages=True
        )

    @cached_property
    def _stuck(self) -> dict[int, int]:
        return stuck_joins(self.graph)

    @cached_property
    def order(self) -> Order:
        """The order of events."""
        return Order(self.graph, self.signals, self.rates.token)

    def thrown(self, nodes: Iterable[int]) -> Rate | None:
        """Return how often some nodes throw together."""
        return sum_of_rates(self.rates.throws(at) for at in nodes)

    def on_topic(self, topic: Hashable) -> Rate | None:
        """Return how often samples come on a topic; None if others than the processes may publish there."""
        return self.rates.of_topic(topic)

    def is_once(self, at: int) -> bool:
        """Whether a node happens at most once."""
        return is_single(self.rates.throws(at))


def behaviour_of(flows: Sequence[ControlFlow], signals: Wiring) -> Behaviour:
    """Return the analyses of the control flow of all files; ``signals`` has the topics of endpoints.

    The last result is cached: most edits of a session change settings, but neither flows nor topics.
    """
    for known in _LAST:
        same = len(known.flows) == len(flows) and all(
            one is other for one, other in zip(known.flows, flows, strict=True)
        )
        if same and known.signals == signals:
            return known
    _LAST[:] = [Behaviour(flows, signals)]
    return _LAST[0]


_LAST: Final[list[Behaviour]] = []
"""The last result, if there is one."""
