"""The preprocessor of C++: macros that stand for a text, a number, or one expression, and branches that divide a block."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_ros2_sources.programs.cpp_expressions import text_of
from cqos_ros2_sources.programs.cpp_statements import declared_in
from cqos_ros2_sources.programs.program import Function, Literal, Return, Variable
from cqos_ros2_sources.programs.ros_version_branches import parts_of

if TYPE_CHECKING:
    from tree_sitter import Node, Parser

    from cqos_ros2_sources.programs.cpp_expressions import CppFile
    from cqos_ros2_sources.programs.program import Expression, Program

_LONGEST_MACRO: Final = 300
_DIRECTIVE: Final = re.compile(rb"\s*#\s*(if|ifdef|ifndef|else|elif|endif)\b")
_WORD: Final = re.compile(r"[\w:]+")
_PARAMETER: Final = re.compile(rb"\s*(?:const\s+)?[\w:<>]+[\s&*]+\w+\s*,\s*$")
_TEXTS: Final = re.compile(rb"//.*|\"(?:[^\"\\]|\\.)*\"|'(?:[^'\\]|\\.)'|/\*.*?\*/")


def read_macros(root: Node, file: CppFile, parse: Parser, program: Program) -> None:
    """Take the macros of a file that stand for a text or a number, and those that are like a function with one expression."""
    for node in parts_of(root, file):
        if node.type == "preproc_function_def":
            _function_macro(node, file, parse, program)
        elif node.type == "preproc_def":
            value = text_of(node.child_by_field_name("value"))
            name = text_of(node.child_by_field_name("name"))
            if _WORD.fullmatch(value):
                file.macros[name] = value
            if value.startswith('"') and value.endswith('"') and value.count('"') == 2:  # noqa: PLR2004 - its two quotes
                found: Expression = Literal(value[1:-1])
            elif value.isdigit():
                found = Literal(int(value))
            else:
                continue
            program.constants.setdefault(name, []).append((name, found, file.path))


def _function_macro(node: Node, file: CppFile, parse: Parser, program: Program) -> None:
    name, value = text_of(node.child_by_field_name("name")), text_of(node.child_by_field_name("value"))
    listed = node.child_by_field_name("parameters")
    if len(value) > _LONGEST_MACRO or listed is None or "#" in value:
        return
    tree = parse.parse(f"auto made = {value};".encode()).root_node
    found = next((each for each in tree.named_children), None)
    if tree.has_error or found is None or found.type != "declaration" or len(tree.named_children) > 1:
        return
    place = file.place(node)
    for _, made, _ in declared_in(found, replace(file, macro=place)):
        parameters = tuple(Variable(text_of(each)) for each in listed.named_children)
        program.functions.setdefault(name, []).append(
            Function(name, parameters, (Return(made, place),), place, macro=True)
        )


def divided(data: bytes) -> list[int]:
    """Return the lines of groups of the preprocessor that divide a block or a list of parameters: without those of the first branch."""
    found: list[int] = []
    open_groups: list[list[list[int]]] = []
    lines = data.split(b"\n")
    for number, line in enumerate(lines, 1):
        word = _DIRECTIVE.match(line)
        kind = word[1] if word is not None else b""
        if kind in {b"if", b"ifdef", b"ifndef"}:
            open_groups.append([[0, number, number]])
        elif kind in {b"else", b"elif"} and open_groups:
            open_groups[-1][-1][2] = number
            open_groups[-1].append([0, number, number])
        elif kind == b"endif" and open_groups:
            group = open_groups.pop()
            group[-1][2] = number
            first = lines[group[0][1] : group[0][2] - 1]
            if any(balance for balance, _, _ in group) or (first and all(map(_PARAMETER.match, first))):
                found += [group[0][1], number, *(each for _, start, end in group[1:] for each in range(start, end))]
            if open_groups:
                open_groups[-1][-1][0] += group[0][0]
        elif open_groups:
            plain = _TEXTS.sub(b"", line)
            open_groups[-1][-1][0] += plain.count(b"{") - plain.count(b"}")
    return sorted(set(found))


def without_lines(data: bytes, numbers: list[int]) -> bytes:
    """Return a file in which some lines are empty: places stay as they are."""
    lines, dropped = data.split(b"\n"), set(numbers)
    return b"\n".join(b"" if number in dropped else line for number, line in enumerate(lines, 1))
