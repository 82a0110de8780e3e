"""Small models in a few lines of text, for cases of behaviour.

A model has a text for each pool. A line is a node or a way of flows::

    s: start R/PT6H              a timer: R… is a cycle, P… a duration, 2… a date
    p: throw x deadline=2        a signal, and a QoS attribute
    g: event                     gateways: xor, and, or, complex, event
    t: task times=3              loops: times=K (multi-instance), loop=K (standard)
    i: start in=sub              inside of a sub-process
    b: boundary y on=t keep      keep: it does not interrupt
    p ~> y                       a message flow, also to a node of another pool; `E ~> y`: from a pool
    s -> p -> e                  a node that is not declared is a task, or an end where nothing follows

The name of a pool is ``A``, ``A*3`` (three of them), ``A*`` (several), ``A domain=5`` (settings), or ``-PC`` for a process without a pool.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_HEAD = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos" id="D" qos:protocol="{}">'
)
_TAGS = {
    "start": "startEvent",
    "end": "endEvent",
    "throw": "intermediateThrowEvent",
    "catch": "intermediateCatchEvent",
    "boundary": "boundaryEvent",
    "task": "task",
    "send": "sendTask",
    "call": "callActivity",
    "sub": "subProcess",
    "eventsub": "subProcess",
    "adhoc": "adHocSubProcess",
    "transaction": "transaction",
    "xor": "exclusiveGateway",
    "and": "parallelGateway",
    "or": "inclusiveGateway",
    "complex": "complexGateway",
    "event": "eventBasedGateway",
}
_EVENTS = frozenset({"start", "end", "throw", "catch", "boundary"})
_DEFINITIONS = ("message", "conditional", "error", "escalation", "terminate", "compensate", "cancel")


def model(
    pools: Mapping[str, str], *, protocol: str = "ros2", external: Sequence[str] = (), options: Sequence[str] = ()
) -> bytes:
    """Return the BPMN text of a model; ``options`` are ``name=value`` of the pack, or of `bpmn`."""
    processes = [_Process(name, text) for name, text in pools.items()]
    signals = sorted({signal for process in processes for signal in process.signals})
    parts = [_HEAD.format(protocol)]
    for each in options:
        name, value = each.split("=")
        owner, _, name = name.rpartition(".")
        parts.append(
            f'<extensionElements><qos:option protocol="{owner or protocol}" name="{name}" value="{value}"/></extensionElements>'
        )
    for name in signals:
        outside = ' qos:external="true"' if name in external else ""
        parts.append(f'<signal id="signal-{name}" name="{name}"{outside}/>')
    drawn = "".join([*(each.pool for each in processes), *(each.messages for each in processes)])
    parts.append(f'<collaboration id="C">{drawn}</collaboration>' if drawn else "")
    parts += [each.xml for each in processes]
    return "\n".join([*parts, "</definitions>"]).encode()


class _Process:
    """One process and its pool."""

    def __init__(self, header: str, text: str) -> None:
        name, *settings = header.split()
        name, marked, several = name.partition("*")
        self.signals: set[str] = set()
        self._lines: dict[str, list[str]] = {}
        self._flows: list[tuple[str, str]] = []
        self.messages = ""
        self._read(text)
        identifier = name[1:] if name.startswith("-") else f"P{name}"
        body = "".join(
            self._node(each, kind, words) for each, (kind, *words) in self._lines.items() if not self._inside(words)
        )
        flows = "".join(f'<sequenceFlow sourceRef="{a}" targetRef="{b}"/>' for a, b in self._flows)
        self.xml = f'<process id="{identifier}">{body}{flows}</process>'
        stated = "".join(f' qos:{key}="{value}"' for key, value in (each.split("=") for each in settings))
        maximum = f' maximum="{several}"' if several else ""
        mark = f"<participantMultiplicity{maximum}/>" if marked else ""
        pool = f'<participant id="{name}" processRef="{identifier}"{stated}>{mark}</participant>'
        self.pool = "" if name.startswith("-") else pool

    def _read(self, text: str) -> None:
        for line in filter(None, map(str.strip, text.splitlines())):
            if "~>" in line:
                source, target = map(str.strip, line.split("~>"))
                self.messages += f'<messageFlow id="{source}-{target}" sourceRef="{source}" targetRef="{target}"/>'
            elif "->" in line:
                way = [each.strip() for each in line.split("->")]
                self._flows += pairwise(way)
            else:
                name, _, rest = line.partition(":")
                self._lines[name] = rest.split()
        for name in dict.fromkeys(each for flow in self._flows for each in flow):
            last = all(start != name for start, _ in self._flows)
            self._lines.setdefault(name, ["end" if last else "task"])

    @staticmethod
    def _inside(words: Sequence[str]) -> str:
        return next((each[3:] for each in words if each.startswith("in=")), "")

    def _node(self, name: str, kind: str, words: Sequence[str]) -> str:
        tag, attributes = _TAGS[kind], [f'id="{name}"']
        inner: list[str] = []
        needs: list[str] = []
        definitions: list[str] = []
        if kind == "eventsub":
            attributes.append('triggeredByEvent="true"')
        for word in words:
            key, equals, value = word.partition("=")
            if key.startswith("need."):
                needs.append(f'<qos:need name="{key[5:]}" value="{value}"/>')
            elif equals:
                self._stated(key, value, attributes, inner, definitions)
            elif word == "keep":
                attributes.append('cancelActivity="false"' if kind == "boundary" else 'isInterrupting="false"')
            elif word == "all":
                attributes.append('parallelMultiple="true"')
            elif word == "compensating":
                attributes.append('isForCompensation="true"')
            elif word in _DEFINITIONS:
                definitions.append(f"<{word}EventDefinition/>")
            elif kind in _EVENTS:
                definitions.append(self._definition(word))
        extensions = f"<extensionElements>{''.join(needs)}</extensionElements>" if needs else ""
        inner += [self._node(each, k, w) for each, (k, *w) in self._lines.items() if self._inside(w) == name]
        return f"<{tag} {' '.join(attributes)}>{extensions}{''.join(definitions)}{''.join(inner)}</{tag}>"

    @staticmethod
    def _stated(key: str, value: str, attributes: list[str], inner: list[str], definitions: list[str]) -> None:
        if key == "on":
            attributes.append(f'attachedToRef="{value}"')
        elif key == "calls":
            attributes.append(f'calledElement="{value}"')
        elif key == "times":
            cardinality = f"<loopCardinality>{value}</loopCardinality>"
            inner.append(f"<multiInstanceLoopCharacteristics>{cardinality}</multiInstanceLoopCharacteristics>")
        elif key == "loop":
            maximum = f' loopMaximum="{value}"' if value != "any" else ""
            inner.append(f"<standardLoopCharacteristics{maximum}/>")
        elif key == "link":
            definitions.append(f'<linkEventDefinition name="{value}"/>')
        elif key in {"cycle", "duration", "date"}:
            tag = f"time{key.capitalize()}"
            definitions.append(f"<timerEventDefinition><{tag}>{value}</{tag}></timerEventDefinition>")
        elif key != "in":
            attributes.append(f'qos:{key}="{value}"')

    def _definition(self, word: str) -> str:
        if word[0] in "RP2$":
            kind = {"R": "timeCycle", "P": "timeDuration", "$": "timeDuration", "2": "timeDate"}[word[0]]
            return f"<timerEventDefinition><{kind}>{word}</{kind}></timerEventDefinition>"
        self.signals.add(word)
        return f'<signalEventDefinition signalRef="signal-{word}"/>'
