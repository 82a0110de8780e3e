"""What the join of a workspace reports: ROS970-ROS989."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.code_info import CodeInfo
from cqos_core.model.system import ImportNote

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.model.settings import Place
    from cqos_core.model.system import Part

CODES: Final = (
    CodeInfo(
        "ROS970",
        "two-nodes-of-one-name",
        "warning",
        "A launch starts two nodes with one full name.",
        "ROS 2 takes parameters, services and logs of one node for those of the other.",
    ),
    CodeInfo(
        "ROS971",
        "section-names-no-node",
        "warning",
        "A section of a parameter file misses a node by a typing error or a namespace.",
        "ROS 2 matches sections with full names of nodes. The node gets no parameter of the section.",
    ),
    CodeInfo(
        "ROS972",
        "remap-matches-nothing",
        "warning",
        "A remap renames a topic that its node does not have.",
        "ROS 2 ignores such a remap silently. The node keeps the names in its code.",
    ),
    CodeInfo(
        "ROS973",
        "name-near-a-topic",
        "warning",
        "A parameter or a remap names a topic without a partner, and another topic has nearly the same name and the same type.",
        "Endpoints match on equal names only.",
    ),
    CodeInfo(
        "ROS974",
        "override-not-accepted",
        "warning",
        "No endpoint of the node accepts a parameter `qos_overrides`.",
        "The node ignores the parameter silently. An endpoint accepts the policies that its code opts in, under its full topic name.",
    ),
    CodeInfo(
        "ROS975",
        "managed-node-missing",
        "warning",
        "A lifecycle manager activates a node that the launch does not start.",
        "The manager waits for the services of the node, and activates no node after it.",
    ),
    CodeInfo(
        "ROS976",
        "lifecycle-node-not-activated",
        "warning",
        "Nothing in a launch activates a lifecycle node, or only when a program asks.",
        "A lifecycle node publishes only while it is active.",
    ),
    CodeInfo(
        "ROS977",
        "open-end",
        "note",
        "A topic of a launch has its partner outside of it.",
        "The launch is a part of a system. The message says what the partner has to offer or may request.",
    ),
    CodeInfo(
        "ROS978",
        "nodes-not-known",
        "note",
        "A launch starts nodes without a node file.",
        "Their endpoints are not known, so C-QoS calls no partner missing that they may be.",
        help="write a node file `PACKAGE.node.yaml` into the package",
    ),
    CodeInfo(
        "ROS979",
        "not-known-of-a-node",
        "note",
        "Something about the endpoints of a node is not known.",
        "C-QoS leaves such endpoints out of pairs, or their policies unknown.",
    ),
    CodeInfo(
        "ROS980",
        "launch-not-decided",
        "note",
        "Something of a launch is not known: an include, a condition, an argument.",
        "Nodes that start under an open condition are not checked.",
        help="decide with `--launch-arg NAME:=VALUE`, the environment with `--define NAME=VALUE`",
    ),
    CodeInfo(
        "ROS981",
        "plugin-class-misspelt",
        "warning",
        "A parameter names the class of a plugin that its package does not have, and a class of nearly the same name is there.",
        "The node fails when it loads the plugin.",
    ),
    CodeInfo(
        "ROS982",
        "middleware-configuration-not-read",
        "note",
        "A launch configures the middleware of nodes by a variable of the environment.",
        "What the variable or its file says may keep nodes apart, drop samples or replace their quality of service. No verdict counts it.",
        help="compare the file by hand; C-QoS reads profiles of Fast DDS and Connext and `cyclonedds.xml` as files of their own",
        leaves_out="variable",
    ),
    CodeInfo(
        "ROS983",
        "processes-not-read",
        "note",
        "A launch starts processes that are no nodes.",
        "Such a process may publish and subscribe: `ros2 topic pub`, a simulator, a script. C-QoS does not know its endpoints.",
        help="start it as a node of a package, so that a node file can say what it does",
    ),
    CodeInfo(
        "ROS984",
        "perhaps-one-topic",
        "warning",
        "A topic without publisher and one without subscriber differ in their namespace only, and a node is not known that may be a partner.",
        "Endpoints match on equal names only. With all nodes known, this is CQ403.",
    ),
)
_BY_CODE: Final = {each.code: each for each in CODES}


def note(
    code: str,
    message: str,
    place: Place | None,
    advice: str | None = None,
    unread: Iterable[Part] = (),
    total: int = 0,
) -> ImportNote:
    """Return a note with the severity of its code, and with the advice of the code unless it has its own.

    Args:
        code: one of `CODES`.
        message: one sentence.
        place: where it is.
        advice: what to do.
        unread: what it says is not read although it may decide.
        total: how many such parts there are, read or not; 0: that is not known.
    """
    info = _BY_CODE[code]
    advice = advice or info.help or None
    return ImportNote(code, info.severity, message, place, advice, parts=tuple(unread), total=total)
