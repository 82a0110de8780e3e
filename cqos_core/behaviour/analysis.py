"""All that control flow says about time, of one system."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from cqos_core.behaviour.counting import Counting, added
from cqos_core.behaviour.graph import joined
from cqos_core.behaviour.order import Order
from cqos_core.behaviour.reach import reached

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Sequence

    from cqos_core.behaviour.counting import Rate
    from cqos_core.behaviour.graph import Graph, Wiring
    from cqos_core.behaviour.reach import Reached
    from cqos_core.model.flow import ControlFlow


class Behaviour:
    """What the control flow of a system says for certain. Each analysis runs when it is first asked for, and once.

    Attributes:
        graph: the nodes; all else names them by their positions in it.
    """

    def __init__(self, graph: Graph, signals: Wiring) -> None:
        """See `analysed`."""
        self.graph = graph
        self.signals = signals

    @cached_property
    def reached(self) -> Reached:
        """What may happen, where topics without any publisher in the system have one elsewhere."""
        return reached(self.graph, self.signals, missing=True)

    @cached_property
    def reached_alone(self) -> Reached:
        """What may happen, where nothing publishes that the system does not have."""
        return reached(self.graph, self.signals, missing=False)

    @cached_property
    def counting(self) -> Counting:
        """How often everything happens at most."""
        return Counting(self.graph, self.signals)

    @cached_property
    def order(self) -> Order:
        """What happens before what."""
        return Order(self.graph, self.signals)

    def thrown(self, nodes: Iterable[int]) -> Rate | None:
        """Return how often some nodes throw together."""
        return added(self.counting.throws(at) for at in nodes)

    def on_topic(self, topic: Hashable) -> Rate | None:
        """Return how often samples come on a topic; None where something else than the processes may publish there."""
        return self.counting.of_topic(topic)

    def is_once(self, at: int) -> bool:
        """Whether a node happens at most once."""
        bound = self.counting.throws(at)
        return bound is not None and bound.once <= 1 and not bound.rate


def analysed(flows: Sequence[ControlFlow], signals: Wiring) -> Behaviour:
    """Return what the control flow of all files says, where ``signals`` says which endpoints match."""
    return Behaviour(joined(flows, signals), signals)
