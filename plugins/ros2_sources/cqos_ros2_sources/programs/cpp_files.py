"""Reads files of C++: what they define. Needs tree-sitter."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from cqos_ros2_sources.programs.cpp_expressions import (
    CppFile,
    arguments_of,
    declared_name,
    parameters_of,
    plain_name,
    returned_type,
    text_of,
)
from cqos_ros2_sources.programs.cpp_statements import block, declared_in, initial_value
from cqos_ros2_sources.programs.names import fits, last_part
from cqos_ros2_sources.programs.program import (
    Class,
    Do,
    Function,
    NotFollowed,
)
from cqos_ros2_sources.programs.ros_version_branches import TRANSPARENT, taken

if TYPE_CHECKING:
    from tree_sitter import Node, Parser

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.program import Expression, Program, Statement

_REGISTERS: Final = "RCLCPP_COMPONENTS_REGISTER_NODE"
_EXPORTS: Final = frozenset(("PLUGINLIB_EXPORT_CLASS", "PLUGINLIB_DECLARE_CLASS"))
_ALIASES: Final = {"alias_declaration": "name", "type_definition": "declarator"}
_ARGUMENTS: Final = re.compile(r"<.*>")


def parser() -> Parser:
    """Return a parser of C++.

    Raises:
        ImportError: tree-sitter is not installed.
    """
    import tree_sitter
    import tree_sitter_cpp

    return tree_sitter.Parser(tree_sitter.Language(tree_sitter_cpp.language()))


def read_definitions(root: Node, file: CppFile, program: Program) -> None:
    """Add what a file defines to a program."""
    waiting: list[tuple[Node, str, tuple[str, ...]]] = [(root, "", ())]
    while waiting:
        node, scope, templates = waiting.pop()
        for each in taken(node, file):
            if each.type in TRANSPARENT:
                waiting.append((each, scope, _type_parameters(each)))
            elif each.type == "namespace_definition":
                name = text_of(each.child_by_field_name("name"))
                body = each.child_by_field_name("body")
                if body is not None:
                    program.namespaces.add(_inside(scope, name))
                    waiting.append((body, _inside(scope, name), ()))
            else:
                _define(each, scope, templates, file, program)


def _inside(scope: str, name: str) -> str:
    return f"{scope}::{name}".strip(":") if name else scope


def _type_parameters(node: Node) -> tuple[str, ...]:
    listed = node.child_by_field_name("parameters") if node.type == "template_declaration" else None
    if listed is None:
        return ()
    return tuple(
        text_of(each.named_children[-1])
        for each in listed.named_children
        if each.named_children and each.type == "type_parameter_declaration"
    )


def _define(node: Node, scope: str, templates: tuple[str, ...], file: CppFile, program: Program) -> None:
    if node.type in {"class_specifier", "struct_specifier"}:
        _class(node, scope, templates, file, program)
    elif node.type == "function_definition":
        _function(node, scope, templates, file, program)
    elif node.type == "declaration":
        inner = node.child_by_field_name("type")
        if inner is not None and inner.type in {"class_specifier", "struct_specifier"}:
            _class(inner, scope, templates, file, program)
        _declaration(node, scope, file, program)
        for name, value, _ in declared_in(node, file):
            program.constants.setdefault(last_part(name), []).append((_inside(scope, name), value, file.path))
    elif node.type in _ALIASES:
        name = text_of(node.child_by_field_name(_ALIASES[node.type]))
        written = text_of(node.child_by_field_name("type"))
        program.scoped.setdefault(name, []).append((_inside(scope, name), written))
        if program.aliases.setdefault(name, written) != written:
            program.aliases[name] = name  # it stands for several things
    elif node.type == "using_declaration" and not text_of(node).startswith("using namespace"):
        program.aliases.setdefault(last_part(text_of(node.named_children[-1])), text_of(node.named_children[-1]))
    elif (
        node.type == "expression_statement" and node.named_children and node.named_children[0].type == "call_expression"
    ):
        _macro(node.named_children[0], file, program)


def _macro(node: Node, file: CppFile, program: Program) -> None:
    name = text_of(node.child_by_field_name("function"))
    listed = node.child_by_field_name("arguments")
    arguments = [text_of(each) for each in listed.named_children] if listed is not None else []
    if name == _REGISTERS and arguments:
        program.registered[arguments[0]] = file.place(node)
    elif name in _EXPORTS and arguments:
        program.plugins[arguments[0]] = file.place(node)


def _class(node: Node, scope: str, templates: tuple[str, ...], file: CppFile, program: Program) -> None:
    body, name_node = node.child_by_field_name("body"), node.child_by_field_name("name")
    if body is None or name_node is None:
        return
    name = _inside(scope, plain_name(name_node))
    clause = next((each for each in node.named_children if each.type == "base_class_clause"), None)
    bases = (
        tuple(file.plain(text_of(each)) for each in clause.named_children if each.type != "access_specifier")
        if clause is not None
        else ()
    )
    made = Class(name, bases, file.place(node), templates=templates)
    program.classes.setdefault(last_part(name), []).append(made)
    waiting = [(body, ())]
    while waiting:
        part, inner_templates = waiting.pop()
        for each in taken(part, file):
            if each.type in TRANSPARENT:
                waiting.append((each, _type_parameters(each)))  # type: ignore[arg-type]
            elif each.type == "field_declaration":
                _fields(each, made, file, program)
            else:
                _define(each, name, inner_templates, file, program)


def _fields(node: Node, made: Class, file: CppFile, program: Program) -> None:
    type_node = node.child_by_field_name("type")
    if type_node is not None and type_node.type in {"class_specifier", "struct_specifier"}:
        _class(type_node, made.name, (), file, program)
    _declaration(node, made.name, file, program)
    for index, child in enumerate(node.children):
        if node.field_name_for_child(index) != "declarator":
            continue
        if child.type == "function_declarator":
            if not any(each.type == "type_qualifier" for each in child.named_children):
                made.declared.add(declared_name(child))
            continue
        name = declared_name(child)
        made.fields[name] = text_of(type_node) + {"pointer_declarator": "*", "reference_declarator": "&"}.get(
            child.type, ""
        )
        if any(each.type == "type_qualifier" for each in node.named_children):
            made.fixed.add(name)
        value = node.child_by_field_name("default_value")
        if value is not None:
            made.initial[name] = initial_value(made.fields[name].rstrip("*&"), value, file)


def _declaration(node: Node, scope: str, file: CppFile, program: Program) -> None:
    """Keep the default arguments of a function that is declared here and defined elsewhere."""
    for child in node.children:
        if child.type == "function_declarator":
            parameters = parameters_of(child.child_by_field_name("parameters"), file)
            if any(each.default is not None for each in parameters):
                name = _inside(scope, declared_name(child.child_by_field_name("declarator")))
                program.declared.setdefault(last_part(name), []).append(
                    Function(name, parameters, (), file.place(child))
                )


def complete(program: Program) -> None:
    """Give functions the default arguments of their declarations; a namespace is no class that owns them."""
    classes = {each.name for found in program.classes.values() for each in found}
    for found in program.functions.values():
        for function in found:
            if function.owner in program.namespaces and function.owner not in classes:
                function.owner = ""
    for last, declared in program.declared.items():
        functions = program.functions.get(last, [])
        for number, function in enumerate(functions):
            for each in declared:
                alike = [one.type for one in each.parameters] == [one.type for one in function.parameters]
                if alike and fits(each.name, function.name):
                    merged = tuple(
                        replace(own, default=own.default or other.default)
                        for own, other in zip(function.parameters, each.parameters, strict=True)
                    )
                    functions[number] = replace(function, parameters=merged)


def _function(node: Node, scope: str, templates: tuple[str, ...], file: CppFile, program: Program) -> None:
    declarator, body = node.child_by_field_name("declarator"), node.child_by_field_name("body")
    while declarator is not None and declarator.type != "function_declarator":
        declarator = declarator.child_by_field_name("declarator") or next(
            (each for each in declarator.named_children if "declarator" in each.type), None
        )
    if declarator is None:
        return
    name = _inside(scope, _ARGUMENTS.sub("", declared_name(declarator.child_by_field_name("declarator"))))
    initializers = next((each for each in node.named_children if each.type == "field_initializer_list"), None)
    if body is not None and body.type == "try_statement":
        body = body.child_by_field_name("body") or body
    static = any(each.type == "storage_class_specifier" and text_of(each) == "static" for each in node.children)
    made = Function(
        name,
        parameters_of(declarator.child_by_field_name("parameters"), file),
        () if body is None else partial(_body, body, file),
        file.place(node),
        owner=name.rpartition("::")[0],
        templates=templates,
        initializers=()
        if initializers is None
        else tuple(
            _initializer(each, file) for each in initializers.named_children if each.type == "field_initializer"
        ),
        static=static,
        returns=returned_type(node),
        source=node.text or b"",
    )
    program.functions.setdefault(made.last, []).append(made)


def _body(node: Node, file: CppFile) -> tuple[Statement, ...]:
    try:
        return block(node, file)
    except RecursionError:
        return (Do(NotFollowed("it is nested too deeply"), file.place(node)),)


def _initializer(node: Node, file: CppFile) -> tuple[str, tuple[Expression, ...], Place]:
    parts = node.named_children
    name = file.plain(text_of(parts[0])) if parts else ""
    return name, arguments_of(parts[-1], file) if len(parts) > 1 else (), file.place(node)
