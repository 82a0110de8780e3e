"""The control flow of a BPMN model: its nodes and sequence flows as `ControlFlow`.

What is not understood becomes a node or a trigger of kind ``unknown``. No analysis claims anything about it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, cast

from cqos_core.bpmn.document import (
    BPMN,
    CALL_ACTIVITY,
    DEFINITION_REFERENCE,
    EXTENSIONS,
    MESSAGE_FLOW,
    PARTICIPANT,
    PROCESS,
    ZEEBE_CALL,
    identity,
    of_bpmn,
    split,
)
from cqos_core.bpmn.names import fold, is_computed, whole_number
from cqos_core.bpmn.timers import read_timer
from cqos_core.model.flow import ControlFlow, FlowEnds, FlowNode, FlowRunner, Timer, Trigger
from cqos_core.model.lazy_tuple import lazy_tuple

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.endpoints import Endpoints
    from cqos_core.bpmn.participants import Pools
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.model.flow import NodeKind, TriggerKind

_SEQUENCE_FLOW: Final = f"{BPMN}sequenceFlow"
_MULTI_INSTANCE: Final = f"{BPMN}multiInstanceLoopCharacteristics"
_STANDARD_LOOP: Final = f"{BPMN}standardLoopCharacteristics"
_CARDINALITY: Final = f"{BPMN}loopCardinality"
_TASKS: Final = ("", "user", "manual", "service", "script", "businessRule", "send", "receive")
_KINDS: Final[dict[str, NodeKind]] = {
    "startEvent": "start",
    "endEvent": "end",
    "intermediateThrowEvent": "throw",
    "implicitThrowEvent": "throw",
    "intermediateCatchEvent": "catch",
    "boundaryEvent": "boundary",
    **{f"{name}Task" if name else "task": "task" for name in _TASKS},
    "callActivity": "call",
    "subProcess": "subprocess",
    "adHocSubProcess": "adhoc",
    "transaction": "transaction",
    "exclusiveGateway": "exclusive",
    "inclusiveGateway": "inclusive",
    "parallelGateway": "parallel",
    "complexGateway": "complex",
    "eventBasedGateway": "event_based",
}
_EVENTS: Final = frozenset({"start", "end", "throw", "catch", "boundary"})
_ACTIVITIES: Final = frozenset({"task", "call", "subprocess", "adhoc", "transaction"})
_STARTING: Final = frozenset({"eventBasedGateway", "receiveTask"})
_TRIGGERS: Final = frozenset(
    {"signal", "message", "timer", "link", "conditional"}
    | {"error", "escalation", "compensation", "cancel", "terminate"}
)
_SIGNAL: Final = (Trigger("signal"),)
_UNKNOWN: Final = Trigger("unknown")
_CATCHES: Final = frozenset({"start", "catch", "boundary"})


def read_flow(reading: DiagramReading, endpoints: Endpoints, pools: Pools) -> None:
    """Add the control flow of a diagram to its system; it is made when it is first read."""
    called = reading.system.processes or reading.document.all(CALL_ACTIVITY)
    if called or any(each.tag == _SEQUENCE_FLOW for each in reading.document.root.walk()):
        reading.system.flows = lazy_tuple(lambda: [_Drawing(reading, endpoints, pools).flow()])


class _Drawing:
    """One diagram that becomes a graph."""

    def __init__(self, reading: DiagramReading, endpoints: Endpoints, pools: Pools) -> None:
        self._document = reading.document
        self._endpoints = endpoints
        self._pools = pools
        self._nodes: list[FlowNode] = []
        self._at: dict[Element, int] = {}
        self._by_id: dict[str, int] = {}
        self._flows: list[tuple[Element, int]] = []
        self._attached: list[tuple[int, str]] = []
        self._calls: list[tuple[int, Element]] = []
        self._received: set[str] | None = None

    def flow(self) -> ControlFlow:
        """Return the graph."""
        for process in self._document.all(PROCESS):
            self._within(process, self._add(process, self._process(process)))
        drawn = [
            FlowEnds(self._end(flow, "sourceRef", at), self._end(flow, "targetRef", at)) for flow, at in self._flows
        ]
        for at, name in self._attached:
            found = self._by_id.get(name.rpartition(":")[2])
            self._nodes[at] = replace(self._nodes[at], attached=found)
        for at, activity in self._calls:
            called = self._document.called_by(activity)
            self._nodes[at] = replace(self._nodes[at], calls=None if called is None else self._at.get(called))
        return ControlFlow(self._document.name, tuple(self._nodes), tuple(drawn), tuple(self._messages()))

    def _messages(self) -> Iterator[FlowEnds]:
        """Yield the message flows of each event to which only nodes of this file send messages."""
        sources: dict[int, list[int | None]] = {}
        wide: set[int | str] = set()
        for flow in self._document.all(MESSAGE_FLOW):
            source, target = (self._known(flow.get(each) or "") for each in ("sourceRef", "targetRef"))
            if target is None:
                pool = self._document.find(PARTICIPANT, flow.get("targetRef") or "", flow)
                wide |= set() if pool is None else {self._pools.by_element[pool].id}
            elif self._nodes[target].kind in _CATCHES:
                sources.setdefault(target, []).append(source)
            else:
                wide.add(target)
        for target, known in sources.items():
            waits = any(each.kind == "message" for each in self._nodes[target].triggers)
            if waits and None not in known and not self._is_within(target, wide):
                yield from (FlowEnds(source, target) for source in known if source is not None)

    def _is_within(self, at: int, wide: set[int | str]) -> bool:
        """Whether an event may take a message that is sent to a pool, or to an activity, around it."""
        while (parent := self._nodes[at].parent) is not None:
            at = parent
            if at in wide:
                return True
        return any(each.participant in wide for each in self._nodes[at].participants)

    def _known(self, name: str) -> int | None:
        """Return the node of an id; None if it is a pool, unclear or not there."""
        name = name.strip()
        found = self._by_id.get(name, self._by_id.get(name.rpartition(":")[2]))
        return None if found is None or self._nodes[found].kind in {"unknown", "process"} else found

    def _add(self, element: Element | None, node: FlowNode) -> int:
        at = len(self._nodes)
        self._nodes.append(node)
        if element is not None:
            self._at[element] = at
        if node.id and self._by_id.setdefault(node.id, at) != at:
            # Which of them a flow means is open.
            self._by_id[node.id] = len(self._nodes)
            self._nodes.append(FlowNode(node.id, "unknown", node.parent))
        return at

    def _within(self, process: Element, at: int) -> None:
        """Add what is in a process, and in its sub-processes."""
        waiting = [(process, at)]
        while waiting:
            around, at = waiting.pop()
            for child in of_bpmn(around):
                kind = _KINDS.get(split(child.tag)[1])
                if child in self._document.parts.runs:
                    for name, tag, ids in self._endpoints.of_run(child):
                        self._add(None, FlowNode(name, _KINDS[split(tag)[1]], at, _SIGNAL, endpoints=ids))
                elif child.tag == _SEQUENCE_FLOW:
                    self._flows.append((child, at))
                elif kind is not None:
                    inside = self._add(child, self._node(child, kind, at))
                    self._note(child, kind, inside)
                    if kind in {"subprocess", "adhoc", "transaction"}:
                        waiting.append((child, inside))

    def _note(self, element: Element, kind: NodeKind, at: int) -> None:
        """Keep what names other nodes until all are there."""
        if kind == "boundary":
            self._attached.append((at, element.get("attachedToRef") or ""))
        elif element.tag == CALL_ACTIVITY:
            self._calls.append((at, element))

    def _end(self, flow: Element, attribute: str, parent: int) -> int:
        """Return the node at one end of a flow; one that is not there is unknown."""
        reference = (flow.get(attribute) or "").strip()
        found = self._by_id.get(reference, self._by_id.get(reference.rpartition(":")[2]))
        if found is None:
            found = len(self._nodes)
            self._nodes.append(FlowNode(reference, "unknown", parent))
            self._by_id[reference] = found
        return found

    def _process(self, process: Element) -> FlowNode:
        runners = self._pools.of_process[process]
        participants = tuple(FlowRunner(each.id, self._pools.several.get(each.id, 1)) for each in runners)
        own = process in self._pools.own
        return FlowNode(identity(process) or "", "process", None, participants=participants, has_pool=own)

    def _node(self, element: Element, kind: NodeKind, parent: int) -> FlowNode:
        local = split(element.tag)[1]
        if local in _STARTING and _is(element, "instantiate"):
            kind = "event_start"
        triggers = tuple(self._triggers(element)) if kind in _EVENTS else ()
        ids = self._endpoints.of(element)
        if ids and kind in _CATCHES and self._may_come_from_elsewhere(element, triggers):
            triggers = (*triggers, _UNKNOWN)
        times, least = _times(element) if kind in _ACTIVITIES else (1, 1)
        timed = any(each.timer is not None for each in triggers)
        return FlowNode(
            identity(element) or "",
            kind,
            parent,
            triggers,
            all_triggers=_is(element, "parallelMultiple"),
            interrupting=not any((element.get(each) or "").strip() in _NO for each in _INTERRUPTING),
            by_event=_is(element, "triggeredByEvent"),
            times=times,
            least_times=least,
            called=self._called(element) if element.tag == CALL_ACTIVITY else "",
            compensates=_is(element, "isForCompensation"),
            endpoints=ids,
            label=fold(element.get("name")) if timed else "",
            place=self._document.place(element) if timed else None,
        )

    def _may_come_from_elsewhere(self, event: Element, triggers: Sequence[Trigger]) -> bool:
        """Whether an event takes a message that no message flow brings: its sender may be drawn nowhere."""
        if not any(each.kind == "message" for each in triggers):
            return False
        if self._received is None:
            ends = (flow.get("targetRef") or "" for flow in self._document.all(MESSAGE_FLOW))
            self._received = {each.strip().rpartition(":")[2] for each in ends}
        return (identity(event) or "").rpartition(":")[2] not in self._received

    def _triggers(self, event: Element) -> Iterator[Trigger]:
        for child in of_bpmn(event):
            referred = child.tag == DEFINITION_REFERENCE
            found = self._document.look_up(self._document.definitions, child.text, child) if referred else child
            if found is None:
                yield _UNKNOWN
                continue
            kind, ending, _ = split(found.tag)[1].partition("EventDefinition")
            if not ending:
                continue
            if kind == "compensate":
                kind = "compensation"
            if kind == "timer":
                yield Trigger("timer", read_timer(found) or Timer("cycle"))
            elif kind == "link":
                yield Trigger("link", link=fold(found.get("name")))
            else:
                yield Trigger(cast("TriggerKind", kind) if kind in _TRIGGERS else "unknown")

    def _called(self, activity: Element) -> str | None:
        """Return the name of the process that a call activity runs; None where an engine computes it."""
        stated = [activity.get("calledElement") or ""]
        for extensions in activity.having(EXTENSIONS):
            stated += [each.get("processId") or "" for each in extensions.having(ZEEBE_CALL)]
        names = [each.strip() for each in stated if each.strip()]
        if any(is_computed(each) for each in names):
            return None
        return names[0].rpartition(":")[2] if names else ""


_INTERRUPTING: Final = ("cancelActivity", "isInterrupting")
_NO: Final = frozenset({"false", "0"})


def _is(element: Element, attribute: str) -> bool:
    return (element.get(attribute) or "").strip() in {"true", "1"}


def _times(element: Element) -> tuple[int | None, int]:
    """Return how often an activity is done for each token, at most and at least."""
    for loop in element.having(_MULTI_INSTANCE, _STANDARD_LOOP):
        if loop.tag == _STANDARD_LOOP:
            return whole_number(loop.get("loopMaximum")), 0 if _is(loop, "testBefore") else 1
        # An attribute such as `camunda:collection` says more than the cardinality.
        cardinality = [each.text for each in loop.having(_CARDINALITY)]
        foreign = any(split(name)[0] for name in loop.attrib) or any(True for _ in loop.having(EXTENSIONS))
        times = whole_number(cardinality[0]) if len(cardinality) == 1 and not foreign else None
        early = any(True for _ in loop.having(f"{BPMN}completionCondition"))
        return times, 0 if times is None else 1 if early else times
    return 1, 1
