"""Writes Python code with a `QoSProfile` for each endpoint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.files.export import Exported
from cqos_ros2.exporters.code import comment_text, snippets
from cqos_ros2.exporters.values import DURATIONS
from cqos_ros2.policies import AVOID_CONVENTIONS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.files.export import ExportContext
    from cqos_core.model.system import System
    from cqos_ros2.exporters.code import Snippet
    from cqos_ros2.exporters.values import Value

_SECOND: Final = 1_000_000_000
_ENUMERATIONS: Final = {
    "history": "HistoryPolicy",
    "reliability": "ReliabilityPolicy",
    "durability": "DurabilityPolicy",
    "liveliness": "LivelinessPolicy",
}


def write(system: System, context: ExportContext) -> Exported:
    """Write a module of constants."""
    notes: dict[str, None] = {}
    found = list(snippets(system, context, notes))
    head = f"# QoS profiles{comment_text(f' of {system.name}' if system.name else '')}"
    lines = [head, "", *imports(name for each in found for name in each.values)]
    for each in found:
        lines += ["", *_profile(each)]
    return Exported("\n".join(lines) + "\n" if found else "", len(found), tuple(notes))


def profile_arguments(values: Mapping[str, Value]) -> list[str]:
    """Return the arguments of a `QoSProfile`."""
    return [f"{name}={_value(value)}" for name, value in values.items()]


def imports(policies: Iterable[str], *others: str) -> list[str]:
    """Return the imports that profiles of some policies need, in order, with ``others`` among them."""
    used = set(policies)
    durations = ["from rclpy.duration import Duration"] if used & DURATIONS else []
    names = sorted({"QoSProfile", *(_ENUMERATIONS[name] for name in used & _ENUMERATIONS.keys())})
    return [*durations, *others, f"from rclpy.qos import {', '.join(names)}"]


def _profile(snippet: Snippet) -> list[str]:
    values = [f"    {name}={_value(value)}," for name, value in snippet.values.items()]
    return [f"# {comment_text(snippet.about)}", f"{snippet.name.upper()} = QoSProfile(", *values, ")"]


def _value(value: Value) -> str:
    name = value.policy.name
    if name in _ENUMERATIONS:
        return f"{_ENUMERATIONS[name]}.{(value.word or '').upper()}"
    if name in DURATIONS:
        seconds, rest = divmod(value.number, _SECOND)
        parts = [f"seconds={seconds}" if seconds else "", f"nanoseconds={rest}" if rest else ""]
        return f"Duration({', '.join(filter(None, parts))})"
    return str(bool(value.number)) if value.policy is AVOID_CONVENTIONS else str(value.number)
