"""Reads the file for `--qos-profile-overrides-path` of `ros2 bag play` and `ros2 bag record`, as an overlay.

A profile in it replaces what the player would offer, or the recorder request, on its topic: policies that it does not
state have their defaults, whatever was recorded. What `ros2 bag` refuses is refused here.
"""

from __future__ import annotations

import glob
import re
from decimal import Decimal
from typing import Final

from cqos_core.importers.source_reading import SourceReading, described, did_you_mean, listed, read_switches, shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, flag, is_null, whole_number
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.settings import Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Overlay
from cqos_ros2.importers.configuration import RosFile
from cqos_ros2.importers.rosbag2 import PLAYER, RECORDER, SWITCHES
from cqos_ros2.policies import (
    AVOID_CONVENTIONS,
    DEADLINE,
    DEPTH,
    DURABILITY,
    HISTORY,
    LEASE,
    LIFESPAN,
    LIVELINESS,
    RAW_SETTINGS,
    RELIABILITY,
)
from cqos_ros2.presets import PRESETS

# What rclpy reads by name, in any case.
_WORDS: Final = {
    HISTORY.name: ("system_default", "keep_last", "keep_all", "unknown"),
    RELIABILITY.name: ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    DURABILITY.name: ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    LIVELINESS.name: ("system_default", "automatic", "manual_by_node", "manual_by_topic", "unknown", "best_available"),
}
_DURATIONS: Final = (DEADLINE.name, LIFESPAN.name, LEASE.name)
_FIELDS: Final = {"sec": 1_000_000_000, "nsec": 1}
_KNOWN: Final = (*_WORDS, DEPTH.name, *_DURATIONS, AVOID_CONVENTIONS.name)
_NUMBER: Final = re.compile(r"[-+]?\d{1,20}(?:\.\d{0,20})?", re.ASCII)
_LARGEST: Final = 2**63 - 1


class _Overrides(RosFile):
    """Reads a file of overrides; what `ros2 bag` would refuse is refused."""

    def run(self) -> None:
        """Read every topic."""
        wanted = read_switches("rosbag2", self.context, SWITCHES).get("as", "player")
        node, role = (RECORDER, SUBSCRIBER) if wanted == "recorder" else (PLAYER, PUBLISHER)
        other = "player" if wanted == "recorder" else "recorder"
        advice = f"for the {other} read it with `--switch rosbag2.as={other}`; for `{node}` correct the topic, or add its endpoint"
        documents = read_tree(self, repeated="last").documents  # as PyYAML does, which `ros2 bag` reads them with
        for key, profile in _topics(documents[0], self) if documents and not self.problems else ():
            self.system.overlays.append(
                Overlay(
                    name="rosbag2 override",
                    settings=self.profile(key, profile),
                    role=role,
                    topic=glob.escape(key.text),
                    participant=node,
                    protocol="ros2",
                    place=self.place(key),
                    advice=advice,
                )
            )
        if not self.problems and not self.system.overlays:
            self.problem("CQ010", "there is no topic in this file", ScalarNode("", 1, 1, plain=True))

    def profile(self, topic: ScalarNode, profile: MappingNode) -> Settings:
        """Return all settings of a profile, those among them that have their defaults."""
        place = self.place(topic)
        settings = {name: Setting(text, place, derived=True) for name, text in PRESETS["default"].settings.items()}
        # Values go to rclpy as they stand, so `unknown`, which it reads, is one that nothing can be created with.
        settings[RAW_SETTINGS.name] = Setting("true", place, derived=True)
        for name, (key, value) in profile.entries.items():
            if name not in _KNOWN:
                message = f"an override has no policy {shown(name)}{did_you_mean(name, _KNOWN)}"
                self.problem("CQ006", message, key, f"allowed: {', '.join(_KNOWN)}")
            elif (text := _text(name, value, self)) is not None:
                settings[name] = Setting(text, self.place(value))
        history, depth = (profile.entries.get(policy.name) for policy in (HISTORY, DEPTH))
        if depth is None and (history is None or settings[HISTORY.name].text == "keep_last"):
            needed = f"a `{DEPTH.name}` beside history keep_last" if history else f"`{HISTORY.name}` or `{DEPTH.name}`"
            self.problem("CQ010", f"the override of {shown(topic.text)} needs {needed}", topic)
        return settings


def _topics(root: Node, reading: SourceReading) -> list[tuple[ScalarNode, MappingNode]]:
    """Return the topics of the file with their profiles."""
    if not isinstance(root, MappingNode):
        reading.problem("CQ009", f"the file must be a map of topics, found {described(root)}", root)
        return []
    topics = []
    for key, profile in root.entries.values():
        if isinstance(profile, MappingNode):
            topics.append((key, profile))
        else:
            message = f"{shown(key.text)} must be a map of policies, found {described(profile)}"
            reading.problem("CQ009", message, profile)
    return topics


def _text(name: str, value: Node, reading: SourceReading) -> str | None:
    """Return the value of a policy in our spelling; report a refused one and return None."""
    if name in _DURATIONS:
        return _duration(name, value, reading)
    scalar = value if isinstance(value, ScalarNode) else ScalarNode("", None, None, plain=False)
    words, word = _WORDS.get(name, ()), scalar.text.lower()
    if words:
        expected, text = listed(words), word if word in words else None
    elif name == DEPTH.name:
        expected, number = "a whole number that is not negative", whole_number(scalar)
        text = None if number is None or number < 0 else str(number)
    else:
        expected, stated = "true or false", flag(scalar)
        text = None if stated is None else str(stated).lower()
    if text is None:
        message = f"{shown(name)} must be {expected}, found {described(value)}{did_you_mean(word, words)}"
        reading.problem("CQ011", message, value)
    return text


def _duration(name: str, value: Node, reading: SourceReading) -> str | None:
    """Return a duration in nanoseconds; an empty one is not specified."""
    if is_null(value) or (isinstance(value, MappingNode) and not value.entries):
        return "unspecified"
    if not isinstance(value, MappingNode):
        reading.problem("CQ009", f"{shown(name)} must be `{{sec: 0, nsec: 0}}`, found {described(value)}", value)
        return None
    total = 0
    for part, unit in _FIELDS.items():
        if part not in value.entries:
            reading.problem("CQ010", f"{shown(name)} needs `{part}`: it must have both `sec` and `nsec`", value)
            return None
        _, node = value.entries[part]
        if not isinstance(node, ScalarNode) or not node.plain or not _NUMBER.fullmatch(node.text):
            reading.problem("CQ011", f"`{part}` must be a number, found {described(node)}", node)
            return None
        total += int(Decimal(node.text) * unit)
    if not 0 <= total <= _LARGEST:
        wrong = "is negative" if total < 0 else "is longer than any that ROS 2 has"
        reading.problem("CQ011", f"{shown(name)} {wrong}", value)
        return None
    return f"{total}ns"


read = _Overrides.load
