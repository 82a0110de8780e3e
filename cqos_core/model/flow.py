"""The control flow of processes as plain data: starts, sequences, waits and repetitions. It names no protocol and no file format.

A `ControlFlow` is a graph. Its nodes refer to each other by their positions in `ControlFlow.nodes`. A process is a node, and so is
a sub-process; what is inside them names them as `FlowNode.parent`.
"""

from __future__ import annotations

from typing import Final, Literal, NamedTuple, TypeAlias

from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import Immutable, Place

EventKind: TypeAlias = Literal["start", "end", "throw", "catch", "boundary"]
"""``end`` and ``throw`` throw; ``start``, ``catch`` and ``boundary`` catch."""
ActivityKind: TypeAlias = Literal["task", "call", "subprocess", "adhoc", "transaction"]
"""``adhoc`` and ``transaction`` are sub-processes."""
GatewayKind: TypeAlias = Literal["exclusive", "inclusive", "parallel", "complex", "event_based", "event_start"]
"""``event_based`` waits for one of the catches behind it; ``event_start`` does so as the start of its process."""
NodeKind: TypeAlias = Literal["process", EventKind, ActivityKind, GatewayKind, "unknown"]
"""The kinds of nodes; ``unknown`` was not understood."""
OutsideKind: TypeAlias = Literal["signal", "message", "timer", "conditional"]
"""Triggers that come from outside of the process instance."""
InsideKind: TypeAlias = Literal["link", "error", "escalation", "compensation", "cancel", "terminate"]
"""Triggers that an instance gives itself."""
TriggerKind: TypeAlias = Literal[OutsideKind, InsideKind, "unknown"]
"""The kinds of triggers; an ``unknown`` one was not understood, so it may happen at any time."""
WITHIN: Final = frozenset({"process", "subprocess", "adhoc", "transaction"})
"""The kinds of nodes that other nodes are in."""


@dataclass(frozen=True, slots=True)
class Timer(Immutable):
    """When a timer fires.

    Attributes:
        kind: ``date``: once; ``duration``: once, after a time; ``cycle``: repeatedly, with a time between.
        wait: nanoseconds that pass at least before it fires (duration), or between two times that it fires (cycle). None where the
            text does not fix them: an expression, a date, cron text.
        due: nanoseconds after which a duration is over for certain; None where that is open, as it is of a month.
        count: how often it fires at most; None: no limit is known.
        text: as written.
    """

    kind: Literal["date", "duration", "cycle"]
    wait: int | None = None
    due: int | None = None
    count: int | None = None
    text: str = ""


@dataclass(frozen=True, slots=True)
class Trigger(Immutable):
    """One definition of an event: its trigger, or its action.

    Attributes:
        timer: of a timer.
        link: name of a link, which joins a throwing event with a catching one in the same scope.
    """

    kind: TriggerKind
    timer: Timer | None = None
    link: str = ""


class FlowRunner(NamedTuple):
    """A participant that runs a process, and how many of it there are; None: no limit is known."""

    participant: str
    several: int | None = 1


class FlowEnds(NamedTuple):
    """The positions of the nodes from and to which a token or a message goes."""

    source: int
    target: int


@dataclass(frozen=True, slots=True)
class FlowNode(Immutable):
    """An event, an activity, a gateway, or a process.

    Attributes:
        id: of the element in its file; empty where it has none.
        parent: position of the process or sub-process around it; None for a process.
        triggers: of an event; several mean that any of them is enough, and with ``all_triggers`` that each is needed.
        interrupting: a boundary event ends its activity, the start of an event sub-process ends what is around it.
        attached: position of the activity of a boundary event; None elsewhere, and where its file does not have it.
        by_event: it is an event sub-process, which no token enters.
        times: how often the activity, with what is inside or called, is done for each token at most; None: no limit is known.
        least_times: how often it is done at least.
        calls: position of the process that a call activity runs; None where that is not in the same file.
        called: the name of that process as it is stated; empty where nothing is, None where an engine computes it.
        compensates: it is done only to compensate for something, so no token enters it.
        endpoints: ids of the endpoints that it throws to or catches from, one or more for each participant of its process.
        participants: of a process: those that run it.
        has_pool: of a process: a participant shows it, or no process calls it. A start without trigger then happens by itself.
        label: name for people, or empty.
    """

    id: str
    kind: NodeKind
    parent: int | None
    triggers: tuple[Trigger, ...] = ()
    all_triggers: bool = False
    interrupting: bool = True
    attached: int | None = None
    by_event: bool = False
    times: int | None = 1
    least_times: int = 1
    calls: int | None = None
    called: str | None = ""
    compensates: bool = False
    endpoints: tuple[str, ...] = ()
    participants: tuple[FlowRunner, ...] = ()
    has_pool: bool = True
    label: str = ""
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class ControlFlow(Immutable):
    """The processes of one file.

    Attributes:
        source: name of the file, as places have it. Endpoint ids of nodes are those of endpoints of this file.
        nodes: in no order.
        flows: in no order.
        messages: message flows between two nodes. An event that is the target of one gets messages over these only.
    """

    source: str
    nodes: tuple[FlowNode, ...] = ()
    flows: tuple[FlowEnds, ...] = ()
    messages: tuple[FlowEnds, ...] = ()


def positions_missing(flow: ControlFlow) -> str | None:
    """Say which position of a graph means nothing: a node is in an earlier one, and names others that are there; None if all do."""
    size = len(flow.nodes)
    for at, node in enumerate(flow.nodes):
        around = None if node.parent is None or not 0 <= node.parent < at else flow.nodes[node.parent]
        if (around is None) is not (node.kind == "process") or (around and around.kind not in WITHIN):
            return f"node {at}, `{node.id}`, is in none of the processes and sub-processes before it"
        if any(each is not None and not 0 <= each < size for each in (node.attached, node.calls)):
            return f"node {at}, `{node.id}`, names a node that is not there"
    if any(not 0 <= each < size for ends in (*flow.flows, *flow.messages) for each in ends):
        return "a flow names a node that is not there"
    return None
