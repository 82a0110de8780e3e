"""All that control flow says about time, of one system."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Final

from cqos_core.behaviour.event_order import Order
from cqos_core.behaviour.event_rates import Counting, added, is_single
from cqos_core.behaviour.graph import joined
from cqos_core.behaviour.reachability import reached, single_waits

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Sequence

    from cqos_core.behaviour.event_rates import Rate
    from cqos_core.behaviour.graph import Graph, Wiring
    from cqos_core.behaviour.reachability import Reached
    from cqos_core.model.flow import ControlFlow

_ROUNDS: Final = 3
"""How often what may happen is looked for again, when less of it happens."""


class Behaviour:
    """What the control flow of a system says for certain. Each analysis runs when it is first asked for, and once.

    Attributes:
        flows: the control flow of each file.
        signals: which endpoints match.
        graph: the nodes; all else names them by their positions in it.
    """

    def __init__(self, flows: Sequence[ControlFlow], signals: Wiring) -> None:
        """See `analysed`."""
        self.flows = (*flows,)
        self.signals = signals
        self.graph: Graph = joined(flows, signals)

    @cached_property
    def reached_anyhow(self) -> Reached:
        """What may happen, where topics without any publisher in the system have one elsewhere, and signals come in any order."""
        return reached(self.graph, self.signals, missing=True)

    @property
    def reached(self) -> Reached:
        """What may happen, where a wait that ends at most once is not ended by what happens later."""
        return self._counted[0]

    @cached_property
    def reached_alone(self) -> Reached:
        """What may happen, where nothing publishes that the system does not have."""
        return reached(self.graph, self.signals, missing=False, waits=self._waits(self.counting))

    @property
    def counting(self) -> Counting:
        """How often everything happens at most."""
        return self._counted[1]

    @cached_property
    def _counted(self) -> tuple[Reached, Counting]:
        """What may happen and how often: the one follows from the other, so each is looked at again."""
        known = self.reached_anyhow
        counting = Counting(self.graph, self.signals, known.fired)
        for _ in range(_ROUNDS):
            known = reached(self.graph, self.signals, missing=True, waits=self._waits(counting))
            earlier, counting = counting, Counting(self.graph, self.signals, known.fired, counting)
            if counting.bounds == earlier.bounds:
                break
        return known, counting

    def _waits(self, counting: Counting) -> dict[int, int]:
        return single_waits(self.graph, lambda at: is_single(counting.bounds[at]))

    @cached_property
    def order(self) -> Order:
        """What happens before what."""
        return Order(self.graph, self.signals, self.counting.token)

    def thrown(self, nodes: Iterable[int]) -> Rate | None:
        """Return how often some nodes throw together."""
        return added(self.counting.throws(at) for at in nodes)

    def on_topic(self, topic: Hashable) -> Rate | None:
        """Return how often samples come on a topic; None where something else than the processes may publish there."""
        return self.counting.of_topic(topic)

    def is_once(self, at: int) -> bool:
        """Whether a node happens at most once."""
        return is_single(self.counting.throws(at))


def analysed(flows: Sequence[ControlFlow], signals: Wiring) -> Behaviour:
    """Return what the control flow of all files says, where ``signals`` says which endpoints match.

    The last answer is remembered: most edits of a session change settings, and neither flows nor topics.
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
"""The last answer, or nothing."""
