"""Writes a C++ header with an `rclcpp::QoS` for each endpoint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.files.export import Exported
from cqos_ros2.exporters.code import comment_text, snippets
from cqos_ros2.exporters.values import DURATIONS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.files.export import ExportContext
    from cqos_core.model.system import System
    from cqos_ros2.exporters.code import Snippet
    from cqos_ros2.exporters.values import Value

_UNITS: Final = (
    ("seconds", 1_000_000_000),
    ("milliseconds", 1_000_000),
    ("microseconds", 1_000),
    ("nanoseconds", 1),
)
# The functions that every distribution has; other values are given as those of rmw.
_CALLS: Final = {
    ("reliability", "reliable"): "reliable()",
    ("reliability", "best_effort"): "best_effort()",
    ("durability", "transient_local"): "transient_local()",
    ("durability", "volatile"): "durability_volatile()",
}


def write(system: System, context: ExportContext) -> Exported:
    """Write a header with a function for each endpoint."""
    notes: dict[str, None] = {}
    found = list(snippets(system, context, notes))
    durations = any(name in DURATIONS for each in found for name in each.values)
    lines = [
        f"// QoS profiles{comment_text(f' of {system.name}' if system.name else '')}",
        "#pragma once",
        "",
        *(["#include <chrono>", ""] if durations else []),
        '#include "rclcpp/qos.hpp"',
        "",
        "namespace qos",
        "{",
    ]
    for each in found:
        lines += ["", *_function(each)]
    lines += ["", "}  // namespace qos"]
    return Exported("\n".join(lines) + "\n" if found else "", len(found), tuple(notes))


def _function(snippet: Snippet) -> list[str]:
    calls = list(_calls(snippet.values))
    return [
        f"/// {comment_text(snippet.about)}",
        f"inline rclcpp::QoS {snippet.name}()",
        "{",
        f"  return rclcpp::QoS({_history(snippet.values)})",
        *(f"    .{call}" for call in calls[:-1]),
        f"    .{calls[-1]};",
        "}",
    ]


def _history(values: dict[str, Value]) -> str:
    history = values["history"].word if "history" in values else "keep_last"
    depth = values["depth"].number if "depth" in values else 10
    if history == "keep_all":
        return "rclcpp::KeepAll()"
    if history == "keep_last":
        return f"rclcpp::KeepLast({depth})"
    return f"rclcpp::QoSInitialization({_rmw('history', history)}, {depth})"


def _calls(values: dict[str, Value]) -> Iterator[str]:
    for name, value in values.items():
        if name in DURATIONS:
            unit, size = next(each for each in _UNITS if value.number % each[1] == 0)
            yield f"{name}(std::chrono::{unit}({value.number // size}))"
        elif name == "avoid_ros_namespace_conventions":
            yield f"{name}({'true' if value.number else 'false'})"
        elif value.word is not None and name != "history":
            yield _CALLS.get((name, value.word), f"{name}({_rmw(name, value.word)})")


def _rmw(policy: str, word: str | None) -> str:
    return f"RMW_QOS_POLICY_{policy.upper()}_{(word or '').upper()}"
