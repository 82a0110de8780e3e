"""Branches of the preprocessor at the top of files and in classes of C++: which of them ROS 2 compiles."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_ros2_sources.programs.cpp_expressions import text_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tree_sitter import Node

    from cqos_ros2_sources.programs.cpp_expressions import CppFile

TRANSPARENT: Final = frozenset(
    (
        "translation_unit",
        "declaration_list",
        "linkage_specification",
        "preproc_if",
        "preproc_ifdef",
        "preproc_else",
        "preproc_elif",
        "ERROR",
        "field_declaration_list",
        "template_declaration",
        "export_declaration",
    )
)
_OTHERWISE: Final = frozenset(("preproc_else", "preproc_elif", "preproc_elifdef"))
_ROS_1: Final = re.compile(rb"""[<"]ros/ros\.h[>"]""")
"""What no program of ROS 2 includes, but for bridges between both."""
_ROS_2: Final = re.compile(rb"""[<"]rclcpp(_lifecycle)?/""")
_SIDES: Final = 2


def taken(node: Node, file: CppFile) -> list[Node]:
    """Return what stands in a part of a file, without branches of the preprocessor that are for ROS 1 or that its own macros turn off."""
    found = node.named_children
    if node.type != "translation_unit" and not node.type.startswith("preproc_"):
        return found
    asked = node.child_by_field_name("condition")
    sides = [file.plain(text_of(each)) for each in asked.named_children] if asked is not None else []
    decided = len(sides) == _SIDES and all(each.isdigit() for each in sides) and "==" in text_of(asked)
    included = b"".join(each.text or b"" for each in found if each.type == "preproc_include")
    first_version = _ROS_1.search(included) and not _ROS_2.search(included)
    if first_version or (decided and sides[0] != sides[1]):
        return [each for each in found if each.type in _OTHERWISE]
    return [each for each in found if each.type not in _OTHERWISE] if decided else found


def parts_of(node: Node, file: CppFile) -> Iterator[Node]:
    """Yield a part of a file and what it holds outside of functions and classes."""
    waiting = [node]
    while waiting:
        each = waiting.pop()
        yield each
        if each.type in TRANSPARENT or each.type == "namespace_definition":
            waiting += reversed(taken(each, file))
