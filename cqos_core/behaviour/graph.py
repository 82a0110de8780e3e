"""The control flow of all files as one graph, with what each event throws and catches."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Final, NamedTuple, TypeAlias

from cqos_core.model.dataclass import dataclass
from cqos_core.model.flow import WITHIN, ControlFlow, FlowNode, TriggerKind
from cqos_core.model.grouping import grouped

EndpointKey: TypeAlias = tuple[str, str]
"""The name of a file and the id of an endpoint in it."""
ENTERED: Final = frozenset({"process", "subprocess"})
"""Kinds of nodes whose content runs once and in order for each entry."""

UNENTERED: Final = frozenset({"process", "start", "event_start", "boundary"})
"""Kinds of nodes to which no flow may lead."""


@dataclass(frozen=True, slots=True)
class Wiring:
    """The topics of endpoints.

    Attributes:
        thrown: the topics to which an endpoint publishes.
        caught: the topics from which an endpoint takes samples.
        others: topics on which others than the processes of the model may publish.
        replayed: endpoints that may get an earlier sample again each time they subscribe.
        anything: the topic of some publisher is unknown, so it may publish on any.
    """

    thrown: Mapping[EndpointKey, frozenset[Hashable]]
    caught: Mapping[EndpointKey, frozenset[Hashable]]
    others: frozenset[Hashable] = frozenset()
    replayed: frozenset[EndpointKey] = frozenset()
    anything: bool = False

    def is_open(self, topic: Hashable) -> bool:
        """Whether others than the processes of the model may publish on a topic."""
        return self.anything or topic in self.others


class MessageFlow(NamedTuple):
    """A message flow, by the positions of its nodes."""

    source: int
    target: int


@dataclass(slots=True)
class Graph:
    """Nodes of all files, by their positions; the lists have one entry for each node.

    Attributes:
        files: the name of the file of each node.
        parent: the process or sub-process around a node; of a process the node itself.
        process: the process around a node.
        inside: nodes directly in a process or sub-process.
        after, before: where flows from and to a node lead.
        boundary: boundary events of an activity.
        attached: the activity of a boundary event; None for all else.
        called: the processes that a call activity runs.
        calls: the call activities that run a process.
        throws: topics to which a node throws.
        catches: topics from which a node catches; None where they are not known.
        sends, brought: the message flows from a node, and those over which alone messages come to an event.
        replayed: a catch may get a sample again for each token.
        drawn: the process around the node has flows, so that only drawn flows happen.
        loose: processes and sub-processes with a flow to a missing node, or to one that accepts no flow, so that it may lead to
            any node.
        called_anywhere: a call activity runs a process whose name is computed.
    """

    nodes: list[FlowNode] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    parent: list[int] = field(default_factory=list)
    process: list[int] = field(default_factory=list)
    inside: list[list[int]] = field(default_factory=list)
    after: list[list[int]] = field(default_factory=list)
    before: list[list[int]] = field(default_factory=list)
    boundary: list[list[int]] = field(default_factory=list)
    attached: list[int | None] = field(default_factory=list)
    called: list[list[int]] = field(default_factory=list)
    calls: list[list[int]] = field(default_factory=list)
    throws: list[frozenset[Hashable]] = field(default_factory=list)
    catches: list[frozenset[Hashable] | None] = field(default_factory=list)
    sends: list[list[MessageFlow]] = field(default_factory=list)
    brought: list[list[MessageFlow]] = field(default_factory=list)
    replayed: list[bool] = field(default_factory=list)
    drawn: list[bool] = field(default_factory=list)
    thrown_at: dict[Hashable, list[int]] = field(default_factory=dict)
    caught_at: dict[Hashable, list[int]] = field(default_factory=dict)
    loose: set[int] = field(default_factory=set)
    called_anywhere: bool = False

    def is_entry(self, at: int) -> bool:
        """Whether a node without incoming flow gets a token when its process or sub-process begins."""
        node = self.nodes[at]
        if self.before[at] or node.by_event or node.compensates or node.kind in {"process", "boundary", "event_start"}:
            return False
        if node.kind == "start":
            return self.nodes[self.parent[at]].kind != "process" and not self.nodes[self.parent[at]].by_event
        return not (node.kind == "catch" and any(each.kind == "link" for each in node.triggers))

    def idles(self, process: int) -> bool:
        """Whether a participant may run a process without a start event, because of nodes without incoming flow."""
        return self.nodes[process].has_pool and any(self.is_entry(at) for at in self.inside[process])

    def heard(self, at: int) -> TriggerKind:
        """Return the kind of triggers that the endpoints of a node stand for."""
        return "signal" if any(each.kind == "signal" for each in self.nodes[at].triggers) else "message"

    def within(self, process: int) -> Iterator[int]:
        """Yield all nodes that are in a process, at any depth."""
        waiting = [process]
        while waiting:
            at = waiting.pop()
            yield from self.inside[at]
            waiting += self.inside[at]

    def is_alone(self, at: int) -> bool:
        """Whether no flow leads to a node or from it."""
        return not (self.before[at] or self.after[at])


def joined_graph(flows: Sequence[ControlFlow], signals: Wiring) -> Graph:
    """Return the graph of all files."""
    graph = Graph()
    for flow in flows:
        _add(graph, flow, signals)
    _call(graph)
    for at, node in enumerate(graph.nodes):
        if node.kind == "unknown" and not (node.id and graph.after[at]):
            graph.loose.update(graph.parent[each] for each in graph.before[at])
        if graph.before[at] and (node.kind in UNENTERED or node.by_event):
            graph.loose.add(graph.parent[at])
    graph.thrown_at = grouped((topic, at) for at, topics in enumerate(graph.throws) for topic in topics)
    graph.caught_at = grouped(
        (topic, at)
        for at, (node, topics) in enumerate(zip(graph.nodes, graph.catches, strict=True))
        if node.kind in {"start", "catch", "boundary"}
        for topic in topics or ()
    )
    return graph


def link_catches(graph: Graph) -> dict[tuple[int, str], list[int]]:
    """Return the events that catch links, by their process and the name of the link."""
    return grouped(
        ((graph.process[at], each.link), at)
        for at, node in enumerate(graph.nodes)
        if node.kind == "catch"
        for each in node.triggers
        if each.kind == "link"
    )


def _add(graph: Graph, flow: ControlFlow, signals: Wiring) -> None:
    first = len(graph.nodes)
    for at, node in enumerate(flow.nodes, first):
        parent = at if node.parent is None else first + node.parent
        graph.nodes.append(node)
        graph.files.append(flow.source)
        graph.parent.append(parent)
        graph.process.append(at)
        graph.attached.append(None if node.attached is None else first + node.attached)
        for lists in (graph.inside, graph.after, graph.before, graph.boundary, graph.called, graph.calls):
            lists.append([])
        graph.sends.append([])
        graph.brought.append([])
        keys = [(flow.source, each) for each in node.endpoints]
        graph.throws.append(frozenset(topic for key in keys for topic in signals.thrown.get(key, ())))
        graph.replayed.append(any(key in signals.replayed for key in keys))
        known = bool(keys) and all(signals.caught.get(key) for key in keys)
        graph.catches.append(frozenset(topic for key in keys for topic in signals.caught[key]) if known else None)
    size = len(graph.nodes)
    for at in range(first, size):
        node = graph.nodes[at]
        if graph.parent[at] != at:
            graph.inside[graph.parent[at]].append(at)
        activity = graph.attached[at]
        if activity is not None:
            graph.boundary[activity].append(at)
        if node.calls is not None:
            graph.called[at].append(first + node.calls)
    for source, target in flow.messages:
        message = MessageFlow(first + source, first + target)
        graph.sends[message.source].append(message)
        # A message that has a topic comes by that.
        if not graph.nodes[message.target].endpoints:
            graph.brought[message.target].append(message)
    drawing = set()
    for start, end in flow.flows:
        graph.after[first + start].append(first + end)
        graph.before[first + end].append(first + start)
        drawing |= {first + start, first + end}
    _find_processes(graph, first, drawing)


def _find_processes(graph: Graph, first: int, drawing: set[int]) -> None:
    """Find the process of each node, and which processes draw flows."""
    processes = [at for at in range(first, len(graph.nodes)) if graph.nodes[at].kind == "process"]
    drawn = set()
    for process in processes:
        waiting = [process]
        while waiting:
            at = waiting.pop()
            graph.process[at] = process
            if at in drawing:
                drawn.add(process)
            waiting += graph.inside[at] if graph.nodes[at].kind in WITHIN else ()
    graph.drawn += [graph.process[at] in drawn for at in range(first, len(graph.nodes))]


def _call(graph: Graph) -> None:
    """Connect call activities with processes, also with those of other files by name."""
    by_name = grouped((node.id, at) for at, node in enumerate(graph.nodes) if node.kind == "process" and node.id)
    for at, node in enumerate(graph.nodes):
        if node.kind != "call":
            continue
        if node.called is None:
            graph.called_anywhere = True
        elif node.calls is None:
            graph.called[at] += by_name.get(node.called, ())
        for process in graph.called[at]:
            graph.calls[process].append(at)
