"""Files of ROS 2 that hold no QoS, or hold it for another command: what they are, and what to check instead."""

from __future__ import annotations

import re
from typing import Final

_STORAGE: Final = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd")
_PARAMETERS: Final = re.compile(rb"^[ \t]*[\"']?ros__parameters[\"']?[ \t]*:", re.MULTILINE)
_LAUNCH: Final = re.compile(rb"generate_launch_description|<launch\b|^launch[ \t]*:", re.MULTILINE)
_LIST: Final = re.compile(rb"(?:/[A-Za-z_]\w*)+(?:[ \t]+\[[\w/]+\])?")


def recording(name: str, head: bytes) -> tuple[str, str] | None:
    """Say what the storage of a recording is."""
    if not name.lower().endswith(_STORAGE) and not head.startswith(b"\x89MCAP"):
        return None
    advice = "check its folder: QoS is read from metadata.yaml, which `ros2 bag reindex` writes anew"
    return "this is the storage of a rosbag2 recording", advice


def parameters(name: str, head: bytes) -> tuple[str, str] | None:
    """Say what parameters without overrides, launch files and lists of topics are."""
    if _PARAMETERS.search(head):
        what = "these are parameters of ROS 2 nodes without `qos_overrides`, so there is no QoS in them to check"
        return what, "`cqos check FOLDER --launch FILE` reads them with the launch file that gives them to nodes"
    if _LAUNCH.search(head):
        what = "this is a launch file, which names no quality of service itself"
        return what, f"`cqos check FOLDER --launch {name}` checks what it starts, with the packages in FOLDER"
    lines = [line.strip() for line in head.splitlines() if line.strip()]
    if lines and all(_LIST.fullmatch(line) for line in lines):
        advice = "`ros2 topic info --verbose TOPIC` prints the QoS of its endpoints"
        return "this is a list of topics, without QoS", advice
    return None
