"""Follows one marked text of a file through a check, and prints each class of the project whose instance holds it or its value.

python -m tests.setting_forms yaml|bpmn
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

import cqos_core

TEXT, VALUE = "7919", 7919
YAML = b"""cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds}}
participants:
  a: {publishes: {/t: {depth: 7919, reliability: best_effort}}}
  b: {subscribes: {/t: {depth: 3, reliability: reliable}}}
"""
BPMN = b"""<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos" id="D" targetNamespace="t">
<signal id="S" name="t"/>
<collaboration id="C"><participant id="P" name="A" processRef="A"/><participant id="Q" name="B" processRef="B"/></collaboration>
<process id="A"><intermediateThrowEvent id="a" qos:depth="7919" qos:reliability="best_effort">
<signalEventDefinition id="c" signalRef="S"/></intermediateThrowEvent></process>
<process id="B"><intermediateCatchEvent id="b" qos:depth="3" qos:reliability="reliable">
<signalEventDefinition id="d" signalRef="S"/></intermediateCatchEvent></process>
</definitions>
"""
FILES = {"yaml": YAML, "bpmn": BPMN}
_DEEPEST, _LONGEST = 3, 400


def holds(value: Any, depth: int = 0) -> bool:
    """Return whether a value is the marked text or number, or a collection with it."""
    if isinstance(value, (str, int)):
        return value in {TEXT, VALUE} and not isinstance(value, bool)
    if depth == _DEEPEST or not isinstance(value, (tuple, list, set, frozenset, dict)) or len(value) > _LONGEST:
        return False
    members = (*value, *value.values()) if isinstance(value, dict) else value
    return any(holds(each, depth + 1) for each in members)


def parts(instance: Any) -> Iterator[Any]:
    """Yield what an instance holds."""
    yield from getattr(instance, "__dict__", {}).values()
    for each in type(instance).__mro__:
        slots = each.__dict__.get("__slots__", ())
        for name in (slots,) if isinstance(slots, str) else slots:
            if hasattr(type(instance), name) and name in vars(each):
                try:
                    yield vars(each)[name].__get__(instance)
                except AttributeError:
                    continue  # not set yet
    if isinstance(instance, (tuple, list)):
        yield tuple(instance)


def followed(data: bytes) -> list[str]:
    """Return the classes through which a marked text of a file goes, as module and name, in order."""
    found: dict[type, None] = {}

    def look(instance: Any) -> None:
        kind = type(instance)
        if kind not in found and kind.__module__.startswith("cqos") and any(map(holds, parts(instance))):
            found[kind] = None

    def trace(frame: Any, event: str, argument: Any) -> Any:
        if not frame.f_globals.get("__name__", "").startswith("cqos"):
            return None
        for value in frame.f_locals.values() if event == "return" else ():
            look(value)
            members = value.values() if isinstance(value, dict) else value
            if isinstance(value, (tuple, list, dict)) and len(value) < _LONGEST:
                for each in members:
                    look(each)
        if event == "return":
            look(argument)
        frame.f_trace_lines = False
        return trace

    str(cqos_core.check(data.replace(TEXT.encode(), b"5")).to_dict())  # imports and compiles what the other needs
    sys.settrace(trace)
    try:
        str(cqos_core.check(data).to_dict())
    finally:
        sys.settrace(None)
    return [f"{each.__module__.removeprefix('cqos_core.')}.{each.__name__}" for each in found]


if __name__ == "__main__":
    sys.stdout.write("".join(f"{each}\n" for each in followed(FILES[sys.argv[1]])))
