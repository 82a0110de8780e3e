"""Diagrams for tests of the page: pools with signal events, each with a place in the drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

_HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
    'xmlns:bpmndi="http://www.omg.org/spec/BPMN/20100524/DI" xmlns:dc="http://www.omg.org/spec/DD/20100524/DC" '
    'xmlns:qos="http://qos" id="Definitions_1" targetNamespace="t"'
)
THROW, CATCH, START, END, BOUNDARY = (
    *("intermediateThrowEvent", "intermediateCatchEvent", "startEvent", "endEvent", "boundaryEvent"),
)


@dataclass(frozen=True)
class Event:
    """A signal event.

    Attributes:
        qos: attributes in the namespace of C-QoS.
        inside: XML of its extension elements.
    """

    id: str
    kind: str
    topic: str
    qos: Mapping[str, str] | None = None
    inside: str = ""

    def xml(self, host: str) -> str:
        """The element; a boundary event is at ``host``."""
        qos = "".join(f" qos:{name}={quoteattr(value)}" for name, value in (self.qos or {}).items())
        at = f' attachedToRef="{host}"' if self.kind == BOUNDARY else ""
        inside = f"<extensionElements>{self.inside}</extensionElements>" if self.inside else ""
        signal = f'<signalEventDefinition id="{self.id}_d" signalRef={quoteattr("S_" + ident(self.topic))}/>'
        return f'<{self.kind} id="{self.id}" name={quoteattr(self.id)}{at}{qos}>{inside}{signal}</{self.kind}>\n'


@dataclass(frozen=True)
class Pool:
    """A pool.

    Attributes:
        qos: attributes in the namespace of C-QoS.
        calls: id of a process that a call activity runs.
    """

    name: str
    events: tuple[Event, ...]
    qos: str = ""
    calls: str = ""


def ident(topic: str) -> str:
    """An id for the signal of a topic."""
    return "".join(each if each.isalnum() else f"_{ord(each)}_" for each in topic)


def drawing(*pools: Pool, attributes: str = "", called: Mapping[str, tuple[Event, ...]] | None = None) -> str:
    """Write a diagram: one pool below the other, 40 events in a row; ``called`` has processes without a pool."""
    called = called or {}
    everything = [
        *(event for pool in pools for event in pool.events),
        *(each for some in called.values() for each in some),
    ]
    topics = dict.fromkeys(event.topic for event in everything)
    signals = "".join(f'<signal id="S_{ident(each)}" name={quoteattr(each)}/>\n' for each in topics)
    participants = "".join(
        f'<participant id="Pool_{pool.name}" name={quoteattr(pool.name)} processRef="Process_{pool.name}"{pool.qos}/>\n'
        for pool in pools
    )
    shapes = "".join(_shapes(pools))
    return (
        f'{_HEAD}{attributes}>\n{signals}<collaboration id="Collaboration_1">\n{participants}</collaboration>\n'
        + "".join(map(_process, pools))
        + "".join(_plain(name, events) for name, events in called.items())
        + '<bpmndi:BPMNDiagram id="Diagram_1"><bpmndi:BPMNPlane id="Plane_1" bpmnElement="Collaboration_1">\n'
        + f"{shapes}</bpmndi:BPMNPlane></bpmndi:BPMNDiagram>\n</definitions>\n"
    )


def _process(pool: Pool) -> str:
    host = f"Task_{pool.name}"
    task = f'<task id="{host}" name="Work"/>\n'
    call = f'<callActivity id="Call_{pool.name}" calledElement="{pool.calls}"/>\n' if pool.calls else ""
    return f'<process id="Process_{pool.name}">\n{task}{call}{"".join(event.xml(host) for event in pool.events)}</process>\n'


def _plain(name: str, events: tuple[Event, ...]) -> str:
    return f'<process id="{name}">\n{"".join(event.xml("") for event in events)}</process>\n'


def _shapes(pools: Iterable[Pool]) -> Iterable[str]:
    top = 80
    for pool in pools:
        rows = (len(pool.events) + 39) // 40
        height = 140 + 90 * rows
        yield _shape(
            f"Pool_{pool.name}",
            160,
            top,
            max(700, 200 + 110 * min(len(pool.events), 40)),
            height,
            ' isHorizontal="true"',
        )
        yield _shape(f"Task_{pool.name}", 240, top + 20, 100, 80)
        if pool.calls:
            yield _shape(f"Call_{pool.name}", 400, top + 20, 100, 80)
        for number, event in enumerate(pool.events):
            if event.kind == BOUNDARY:
                yield _shape(event.id, 322, top + 82, 36, 36)
            else:
                yield _shape(event.id, 240 + 110 * (number % 40), top + 140 + 90 * (number // 40), 36, 36)
        top += height + 20


def _shape(element: str, x: int, y: int, width: int, height: int, more: str = "") -> str:
    bounds = f'<dc:Bounds x="{x}" y="{y}" width="{width}" height="{height}"/>'
    return f'<bpmndi:BPMNShape id="{element}_di" bpmnElement="{element}"{more}>{bounds}</bpmndi:BPMNShape>\n'


def many(events: int) -> str:
    """A diagram of two pools with as many events, in pairs."""
    pairs = events // 2
    strong, weak = {"reliability": "reliable"}, {"reliability": "best_effort"}
    throws = tuple(Event(f"Throw_{n}", THROW, f"line{n}", strong) for n in range(pairs))
    catches = tuple(Event(f"Catch_{n}", CATCH, f"line{n}", weak if n % 2 else strong) for n in range(pairs))
    return drawing(Pool("A", throws), Pool("B", catches))


def written(folder: Path, name: str, text: str) -> Path:
    """Write a file of a test."""
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file
