"""Finds the events that may happen: the least set of nodes, with the most favourable conditions, delays and messages.

A node outside of the set happens in no run (BPMN 2.0.2, 13.2 to 13.5).

Events that happen at most once in a run exclude more. A wait that ends once is not ended by an event that only happens afterwards. A gateway
at which a token chooses once has one branch in each run, so nothing happens that needs two of them, such as a parallel join behind both. The
search therefore keeps for each node, as bits of a number, the waits that have certainly ended and the branches that were certainly taken
when the node happens. These sets only shrink while the search finds more paths to the node, so it terminates. By induction over the time
of a run, each event that happens is in the set, and its bits are true.
"""

from __future__ import annotations

from functools import reduce
from operator import and_, or_
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from cqos_core.behaviour.graph import MessageFlow, link_catches
from cqos_core.model.dataclass import dataclass
from cqos_core.model.flow import WITHIN

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
    from collections.abc import Set as AbstractSet

    from cqos_core.behaviour.graph import Graph, Wiring

_WAITING: Final = frozenset({"start", "catch", "boundary"})
_MOST_WAITS: Final = 256
"""The most waits that are followed; any event may end further ones."""
_BRANCHES: Final = 2
_MOST_BRANCHES: Final = 512
"""The most branches of gateways that are followed; a run may take several of a further gateway."""
_BUDGET: Final = 20
"""The most steps for each node of the model; a longer search is repeated without waits."""


class Block(NamedTuple):
    """Why a token that waits goes on in no run.

    Attributes:
        kind: ``late``: the samples of ``topic`` are sent only after its wait has ended; ``branch``: they are sent only if a token takes
            another branch of ``gateway``; ``silent``: no run sends them; ``together``: what it waits for is on two branches of ``gateway``;
            ``join``: it waits for a token that waits for it at ``gateway``; ``message``: no message flow brings what it waits for.
        gateway: a gateway at which a token takes one branch, or a join.
        topic: a topic for which it waits.
    """

    kind: Literal["late", "branch", "silent", "together", "join", "message"]
    gateway: int | None = None
    topic: Hashable = None


@dataclass(frozen=True, slots=True)
class ReachableEvents:
    """The events that may happen.

    Attributes:
        arrived: nodes at which a token may arrive, or that may wait for their event.
        fired: nodes that may happen.
        thrown: topics on which samples may be published.
        blocks: nodes at which a token waits in vain, and why: catches that do not happen, and joins to which all tokens but not in one run come.
    """

    arrived: AbstractSet[int]
    fired: AbstractSet[int]
    thrown: AbstractSet[Hashable]
    blocks: Mapping[int, Block]


@dataclass(frozen=True, slots=True)
class SingleEvents:
    """Events that happen at most once in a run, each with a bit.

    Attributes:
        waits: the end of a wait, by the node that ends it. A catch behind an event-based gateway shares the wait of the gateway. The wait
            of a boundary event ends with its activity.
        branches: the choice of a branch, by the gateway and the first node of the branch.
        choices: by gateway: the bits of all its branches.
    """

    waits: Mapping[int, int]
    branches: Mapping[tuple[int, int], int]
    choices: Mapping[int, int]

    def may_be(self, happened: int) -> bool:
        """Return whether all of some bits may be true in one run: no gateway has two branches among them."""
        return self.torn(happened) is None

    def torn(self, happened: int) -> int | None:
        """Return a gateway that has two branches among some bits; None if there is none."""
        for gateway, bits in self.choices.items():
            taken = happened & bits
            if taken & (taken - 1):
                return gateway
        return None


_NOTHING: Final = SingleEvents({}, {}, {})


def reachable_events(
    graph: Graph,
    signals: Wiring,
    *,
    missing: bool,
    single: SingleEvents = _NOTHING,
    stuck: Mapping[int, int] = MappingProxyType({}),
    messages: bool = False,
) -> ReachableEvents:
    """Return the events that may happen.

    Args:
        graph: the nodes.
        signals: what they throw and catch.
        missing: events also happen that wait for topics without publisher.
        single: events that happen at most once.
        stuck: joins that never happen, each with the join for which it waits.
        messages: messages come only over message flows, to events that have some.
    """
    if single != _NOTHING:
        search = _Search(graph, signals, missing=missing, single=single, stuck=stuck, messages=messages)
        if search.run(_BUDGET * len(graph.nodes)):
            return search.found()
    search = _Search(graph, signals, missing=missing, single=_NOTHING, stuck=stuck, messages=messages)
    search.run()
    return search.found()


def single_events(graph: Graph, is_single: Callable[[int], bool]) -> SingleEvents:
    """Return the waits and choices that happen at most once in a run, where ``is_single`` says so of a token at a node."""
    waits = _single_waits(graph, is_single)
    branches: dict[tuple[int, int], int] = {}
    choices: dict[int, int] = {}
    for at, node in enumerate(graph.nodes):
        following = graph.after[at]
        if node.kind not in {"exclusive", "event_based"} or len(set(following)) < max(len(following), _BRANCHES):
            continue
        if len(branches) + len(following) > _MOST_BRANCHES or not is_single(at):
            continue
        bits = [1 << (_MOST_WAITS + len(branches) + number) for number in range(len(following))]
        branches |= {(at, each): bit for each, bit in zip(following, bits, strict=True)}
        choices[at] = sum(bits)
    return SingleEvents(waits, branches, choices)


def _single_waits(graph: Graph, is_single: Callable[[int], bool]) -> dict[int, int]:
    waits: dict[int, int] = {}
    for at, node in enumerate(graph.nodes):
        if node.kind not in {"catch", "boundary"} or not (graph.catches[at] or graph.brought[at]):
            continue
        owner = _owner(graph, at)
        if owner not in waits and len(waits) < _MOST_WAITS and is_single(owner):
            waits[owner] = 1 << len(waits)
    return waits


def _gateway(graph: Graph, at: int) -> int:
    """Return the node where a token waits for a catch: the event-based gateway before it, or the catch."""
    before = graph.before[at]
    return before[0] if len(before) == 1 and graph.nodes[before[0]].kind == "event_based" else at


def _owner(graph: Graph, at: int) -> int:
    """Return the node whose wait an event ends: its activity, the event-based gateway before it, or the event."""
    activity = graph.attached[at]
    return activity if activity is not None else _gateway(graph, at) if graph.nodes[at].kind == "catch" else at


class _Search:
    """One search that begins with all events that happen by themselves."""

    def __init__(
        self,
        graph: Graph,
        signals: Wiring,
        *,
        missing: bool,
        single: SingleEvents,
        stuck: Mapping[int, int],
        messages: bool,
    ) -> None:
        self._graph = graph
        self._signals = signals
        self._missing = missing
        self._single = single
        self._stuck = stuck
        self._messages = messages
        self._waits = single.waits
        self._arrived: dict[int, int] = {}
        self._fired: dict[int, int] = {}
        self._thrown: dict[Hashable, int] = {}
        self._incoming: dict[int, dict[int, int]] = {}
        self._waiting: dict[int, None] = {}
        self._links = link_catches(graph)

    def found(self) -> ReachableEvents:
        """Return the result."""
        thrown = {each for each in self._thrown if not isinstance(each, MessageFlow)}
        return ReachableEvents(self._arrived.keys(), self._fired.keys(), thrown, dict(self._blocks()))

    def _blocks(self) -> Iterator[tuple[int, Block]]:
        """Yield the nodes at which a token waits in vain."""
        graph = self._graph
        for at, before in self._arrived.items():
            if at not in self._fired and self._awaited(at):
                yield at, self._block(at, before)
        for at, came in self._incoming.items():
            if at in self._stuck:
                yield at, Block("join", self._stuck[at])
                continue
            gateway = self._single.torn(reduce(or_, came.values()))
            if at not in self._fired and len(came) == len(set(graph.before[at])) and gateway is not None:
                yield at, Block("together", gateway)

    def _block(self, at: int, before: int) -> Block:
        """Return why a token waits in vain for the samples of an event; of several topics, the first that does not come."""
        wait, together = self._wait(at), before
        if self._brought(at):
            return Block("message")
        for topic in sorted(self._graph.catches[at] or (), key=str):
            ended = self._comes(topic)
            if ended is None:
                return Block("silent", topic=topic)
            if ended & wait:
                return Block("late", topic=topic)
            gateway = self._single.torn(before | ended)
            if gateway is not None:
                return Block("branch", gateway, topic)
            together |= ended
        return Block("together", self._single.torn(together))

    def run(self, budget: int | None = None) -> bool:
        """Run the search; return whether it ended within the budget of steps. Without waits each node is one step."""
        graph = self._graph
        linked = {
            (graph.process[at], each.link)
            for at, node in enumerate(graph.nodes)
            if node.kind in {"throw", "end"}
            for each in node.triggers
        }
        for at, node in enumerate(graph.nodes):
            open_ended = not graph.drawn[at] or node.kind in {"unknown", "event_start"}
            unattached = node.kind == "boundary" and graph.attached[at] is None
            if open_ended or unattached or (node.kind == "process" and self._runs_alone(at)):
                self._fire(at, 0)
            elif node.kind == "start" and graph.nodes[graph.parent[at]].kind == "process":
                self._start(at)
        for key, catches in self._links.items():
            if key not in linked:
                for at in catches:
                    self._fire(at, 0)
        while self._waiting and budget != 0:
            budget = None if budget is None else budget - 1
            at = next(iter(self._waiting))
            del self._waiting[at]
            self._follow(at)
        return not self._waiting

    def _runs_alone(self, process: int) -> bool:
        """Whether a process begins by itself: one without any start event, or with a node to which no flow leads."""
        graph = self._graph
        starts = any(graph.nodes[at].kind in {"start", "event_start"} for at in graph.inside[process])
        return graph.idles(process) or (not starts and (graph.nodes[process].has_pool or graph.called_anywhere))

    def _start(self, at: int) -> None:
        """Let the start event of a process wait for its triggers; without any it happens with its process."""
        node = self._graph.nodes[at]
        own = self._graph.nodes[self._graph.process[at]].has_pool or self._graph.called_anywhere
        if node.triggers or own:
            self._arrive(at, 0)

    def _arrive(self, at: int, ended: int) -> None:
        """Let a token arrive at a node when the waits ``ended`` have ended."""
        known = self._arrived.get(at)
        if known is not None:
            ended &= known
        if ended == known:
            return
        self._arrived[at] = ended
        if self._graph.nodes[at].kind in _WAITING:
            self._await(at)
        else:
            self._fire(at, ended)

    def _await(self, at: int) -> None:
        """Fire the event that a token waits for, if its trigger may come."""
        graph, node = self._graph, self._graph.nodes[at]
        activity, wait = graph.attached[at], self._wait(at)
        heard = self._heard(at, wait)
        if heard is not None:
            ends = wait if activity is None or node.interrupting else 0
            self._fire(at, self._arrived[at] | heard | ends | self._single.branches.get((_owner(graph, at), at), 0))

    def _wait(self, at: int) -> int:
        """Return the bit of the wait that an event ends."""
        return self._waits.get(_owner(self._graph, at), 0)

    def _awaited(self, at: int) -> Collection[Hashable]:
        """Return the topics or message flows for which an event waits; none if what comes there is not known."""
        return self._graph.catches[at] or self._brought(at)

    def _brought(self, at: int) -> Collection[Hashable]:
        """Return the message flows to an event, if messages come over these only."""
        return self._graph.brought[at] if self._messages else ()

    def _heard(self, at: int, wait: int) -> int | None:
        """Return what has happened when the trigger of an event comes; None if it does not come during the wait."""
        node, topics = self._graph.nodes[at], self._awaited(at)
        heard = self._graph.heard(at)
        others = any(each.kind != heard for each in node.triggers)
        if not topics or (others and not node.all_triggers):
            return 0
        before, may_be = self._arrived[at], self._single.may_be
        came = [
            ended
            for topic in topics
            if (ended := self._comes(topic)) is not None and not ended & wait and may_be(before | ended)
        ]
        if node.all_triggers and not self._brought(at):
            together = reduce(or_, came, before)
            return together if len(came) == len(topics) and may_be(together) else None
        return reduce(and_, came) if came else None

    def _comes(self, topic: Hashable) -> int | None:
        if isinstance(topic, MessageFlow):
            return self._thrown.get(topic)
        missing = self._missing and topic not in self._graph.thrown_at
        return 0 if missing or self._signals.is_open(topic) else self._thrown.get(topic)

    def _fire(self, at: int, ended: int) -> None:
        known = self._fired.get(at)
        if known is not None:
            ended &= known
        if ended != known:
            self._arrived.setdefault(at, ended)
            self._fired[at] = ended
            self._waiting[at] = None

    def _follow(self, at: int) -> None:
        """Continue from a node that happens."""
        graph, node, ended = self._graph, self._graph.nodes[at], self._fired[at]
        for event in graph.boundary[at]:
            self._arrive(event, ended)
        left = ended | self._waits.get(at, 0) if graph.boundary[at] else ended
        chosen = self._single.branches if node.kind == "exclusive" else {}
        for following in graph.after[at]:
            self._step(at, following, left | chosen.get((at, following), 0))
        if at in graph.loose:
            for inside in graph.inside[at]:
                self._arrive(inside, 0)
        if node.kind in WITHIN:
            self._enter(at, ended)
        for process in graph.called[at]:
            self._call(process, ended)
        if node.kind == "start":
            self._fire(graph.parent[at], ended)
        if node.kind in {"throw", "end"}:
            for each in node.triggers:
                for catch in self._links.get((graph.process[at], each.link), ()) if each.kind == "link" else ():
                    self._fire(catch, ended)
        for topic in (*graph.throws[at], *graph.sends[at]):
            self._throw(topic, ended)

    def _throw(self, topic: Hashable, ended: int) -> None:
        """Publish on a topic."""
        known = self._thrown.get(topic)
        if known is not None:
            ended &= known
        if ended != known:
            self._thrown[topic] = ended
            catches = [topic.target] if isinstance(topic, MessageFlow) else self._graph.caught_at.get(topic, ())
            for catch in catches:
                if catch in self._arrived:
                    self._await(catch)

    def _step(self, source: int, at: int, ended: int) -> None:
        """Send a token over one flow; a parallel gateway waits for all its flows."""
        if at in self._stuck:
            self._incoming.setdefault(at, {})[source] = ended
            return
        if self._graph.nodes[at].kind == "parallel":
            came = self._incoming.setdefault(at, {})
            came[source] = ended
            if len(came) < len(set(self._graph.before[at])):
                return
            ended = reduce(or_, came.values())
            if not self._single.may_be(ended):
                return
        self._arrive(at, ended)

    def _enter(self, at: int, ended: int) -> None:
        """Start the content of a process or sub-process."""
        graph = self._graph
        anyhow = graph.nodes[at].kind in {"adhoc", "transaction"}
        for inside in graph.inside[at]:
            node = graph.nodes[inside]
            if node.by_event:
                for each in graph.inside[inside]:
                    if graph.nodes[each].kind == "start":
                        self._arrive(each, ended)
            elif anyhow or node.compensates or graph.is_entry(inside):
                self._arrive(inside, ended)

    def _call(self, process: int, ended: int) -> None:
        """Start a process that a call activity runs."""
        graph = self._graph
        starts = [at for at in graph.inside[process] if graph.nodes[at].kind in {"start", "event_start"}]
        for at in starts:
            if not graph.nodes[at].triggers:
                self._fire(at, ended)
        if not starts:
            self._fire(process, ended)
