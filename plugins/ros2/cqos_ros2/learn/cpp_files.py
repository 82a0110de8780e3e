"""Reads files of C++: what they define, and the statements of functions. Needs tree-sitter, extra ``source``."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from cqos_ros2.learn.cpp_branches import TRANSPARENT, taken
from cqos_ros2.learn.cpp_expressions import (
    CppFile,
    arguments_of,
    declared_name,
    expression,
    parameters_of,
    plain_name,
    text_of,
)
from cqos_ros2.learn.program import (
    CASE,
    Assign,
    Call,
    Class,
    Do,
    Function,
    If,
    Items,
    Leave,
    Literal,
    Loop,
    Name,
    NotFollowed,
    Operation,
    Return,
    fits,
    last_part,
)
from cqos_ros2.learn.searching import inside

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tree_sitter import Node, Parser

    from cqos_core.model.system import Place
    from cqos_ros2.learn.program import Expression, Program, Statement

_REGISTERS: Final = "RCLCPP_COMPONENTS_REGISTER_NODE"
_EXPORTS: Final = frozenset(("PLUGINLIB_EXPORT_CLASS", "PLUGINLIB_DECLARE_CLASS"))
_ALIASES: Final = {"alias_declaration": "name", "type_definition": "declarator"}
_BLOCKS: Final = frozenset(("compound_statement", "labeled_statement", "ERROR"))
_OF_EACH: Final = re.compile(r"(?:const )?(?:std::)?vector<\s*([A-Z_a-z:]*[A-Z]\w*)\s*>")
"""A list of structures: those have names of their own, with a capital letter."""
_ARGUMENTS: Final = re.compile(r"<.*>")
_PLAIN_NAMES: Final = frozenset(("type_identifier", "identifier"))
_VALUE_TYPES: Final = frozenset(("argument_list", "initializer_list"))


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
            made.initial[name] = _initial(made.fields[name].rstrip("*&"), value, file)


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


def _initial(type_text: str, value: Node, file: CppFile) -> Expression:
    """Return what a declaration with a value makes: of a class, an object; else the value."""
    if value.type not in _VALUE_TYPES:
        return expression(value, file)
    of = _OF_EACH.fullmatch(type_text)
    if of is not None and value.type == "initializer_list":
        place = file.place(value)
        items = tuple(
            Call(Name(of[1]), each.items, (), ("{",), place) if isinstance(each, Items) else each
            for each in arguments_of(value, file)
        )
        return Call(Name(type_text), items, (), ("{",), place)
    designated = any(each.type == "initializer_pair" for each in value.named_children)
    arguments = (expression(value, file),) if designated else arguments_of(value, file)
    if type_text == "auto" and len(arguments) == 1:
        return arguments[0]
    return Call(Name(type_text), arguments, (), ("{",) if value.type == "initializer_list" else (), file.place(value))


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


# Statements


def block(node: Node, file: CppFile) -> tuple[Statement, ...]:
    """Return the statements of a block, or of one statement."""
    if node.type in {"compound_statement", "ERROR", "case_statement"} or node.type.startswith("preproc_"):
        return tuple(found for each in node.named_children for found in _statement(each, file))
    return tuple(_statement(node, file))


def _statement(node: Node, file: CppFile) -> Iterator[Statement]:
    kind, place = node.type, file.place(node)
    reader = _STATEMENTS.get(kind)
    if reader is not None:
        yield from reader(node, file)
    elif kind == "declaration":
        yield from (
            Assign(Name(name), value, place, declares=True, type=text) for name, value, text in declared_in(node, file)
        )
    elif kind == "return_statement":
        value = next(iter(node.named_children), None)
        yield Return(None if value is None else expression(value, file), place)
    elif kind in {"for_range_loop", "for_statement", "while_statement", "do_statement"}:
        yield from _loop(node, file)
    elif kind in {"throw_statement", "break_statement", "continue_statement"}:
        yield Leave(kind.partition("_")[0])
    elif kind in {"preproc_if", "preproc_ifdef"}:
        yield from _preprocessed(node, file)
    elif kind in _BLOCKS:
        yield from block(node, file)


def _try(node: Node, file: CppFile) -> Iterator[Statement]:
    place = file.place(node)
    yield from block(node.child_by_field_name("body") or node, file)
    for each in node.named_children:
        body = each.child_by_field_name("body") if each.type == "catch_clause" else None
        if body is not None:
            yield If(NotFollowed("an exception"), block(body, file), (), place)


def _expression_statement(node: Node, file: CppFile) -> Iterator[Statement]:
    inner = next((each for each in node.named_children if each.type != "comment"), None)
    if inner is None:
        return
    place = file.place(node)
    if inner.type == "assignment_expression":
        left, right = inner.child_by_field_name("left"), inner.child_by_field_name("right")
        target, value = expression(left, file), expression(right, file)
        sign = text_of(inner.child_by_field_name("operator"))
        if sign != "=":
            value = Operation(sign[:-1], (target, value))
        yield Assign(target, value, place)
        if right is not None and right.type == "assignment_expression":
            yield Assign(expression(right.child_by_field_name("left"), file), value, place)
    elif inner.type == "update_expression":
        target = expression(inner.child_by_field_name("argument"), file)
        yield Assign(target, NotFollowed(text_of(inner)), place)
    else:
        yield Do(expression(inner, file), place)


def declared_in(node: Node, file: CppFile) -> Iterator[tuple[str, Expression, str]]:
    """Yield name, value and type of each variable that a declaration makes."""
    type_text = text_of(node.child_by_field_name("type"))
    for index, child in enumerate(node.children):
        if node.field_name_for_child(index) != "declarator":
            continue
        if child.type == "init_declarator":
            value = child.child_by_field_name("value")
            if value is not None:
                yield declared_name(child), _initial(type_text, value, file), type_text
        elif child.type == "function_declarator":
            given = _given(child, file)
            if given:
                yield declared_name(child), Call(Name(type_text), given, (), (), file.place(child)), type_text
        elif child.type in {"identifier", "qualified_identifier"}:
            made = Call(Name(type_text), (), (), (), file.place(child))
            yield declared_name(child), made, type_text
        else:
            yield declared_name(child), NotFollowed(text_of(child)[:60]), type_text


def _given(node: Node, file: CppFile) -> tuple[Expression, ...]:
    """Return the arguments of `Talker talker(node, topic)`, which reads like the declaration of a function; none where it is one."""
    listed = node.child_by_field_name("parameters")
    parts = [] if listed is None else [each for each in listed.named_children if each.type != "comment"]
    found: list[Expression] = []
    for each in parts:
        named, called = each.child_by_field_name("type"), each.child_by_field_name("declarator")
        inner = () if called is None else _given(called, file)  # `std::ref(node)`
        names = (*_PLAIN_NAMES, *(("qualified_identifier",) if inner else ()))
        if named is None or named.type not in names or len(each.named_children) != 1 + bool(inner):
            return ()
        made = expression(named, file)
        found.append(Call(made, inner, (), (), file.place(each)) if inner else made)
    return tuple(found)


def _if(node: Node, file: CppFile) -> Iterator[Statement]:
    place = file.place(node)
    condition_node = node.child_by_field_name("condition")
    condition: Expression = NotFollowed("")
    for each in condition_node.named_children if condition_node is not None else ():
        if each.type in {"declaration", "init_statement"}:
            inner = each if each.type == "declaration" else each.named_children[0]
            for name, value, text in declared_in(inner, file):
                yield Assign(Name(name), value, place, declares=True, type=text)
                condition = Name(name)
        else:
            condition = expression(each, file)
    then, otherwise = node.child_by_field_name("consequence"), node.child_by_field_name("alternative")
    rest: tuple[Statement, ...] = ()
    if otherwise is not None:
        rest = (
            tuple(found for each in otherwise.named_children for found in block(each, file))
            if otherwise.type == "else_clause"
            else block(otherwise, file)
        )
    yield If(condition, () if then is None else block(then, file), rest, place)


def _loop(node: Node, file: CppFile) -> Iterator[Statement]:
    place, body = file.place(node), node.child_by_field_name("body")
    statements = () if body is None else block(body, file)
    if node.type == "for_range_loop":
        declarator = node.child_by_field_name("declarator")
        if declarator is not None and declarator.type == "reference_declarator":
            declarator = declarator.named_children[0]
        names = (
            tuple(text_of(each) for each in declarator.named_children)
            if declarator is not None and declarator.type == "structured_binding_declarator"
            else (declared_name(declarator),)
        )
        yield Loop(names, expression(node.child_by_field_name("right"), file), statements, place)
        return
    start = node.child_by_field_name("initializer")
    declared = [*declared_in(start, file)] if start is not None and start.type == "declaration" else []
    if len(declared) == 1:
        name, first, _ = declared[0]
        past = _counted(node, name, file)
        if past is not None and not any(
            isinstance(each, Assign) and each.target == Name(name) for each in inside(statements)
        ):
            yield Loop((name,), Call(Name("#range"), (first, past), (), (), place), statements, place)
            return
    yield from (Assign(Name(name), NotFollowed("a counter"), place, declares=True) for name, _, _ in declared)
    yield Loop((), None, statements, place)


def _counted(node: Node, name: str, file: CppFile) -> Expression | None:
    """Return the number before which a loop stops that counts up by one from a number; None for any other loop."""
    condition, update = node.child_by_field_name("condition"), text_of(node.child_by_field_name("update"))
    if condition is None or condition.type != "binary_expression" or update not in {f"{name}++", f"++{name}"}:
        return None
    sign, left = text_of(condition.child_by_field_name("operator")), text_of(condition.child_by_field_name("left"))
    past = expression(condition.child_by_field_name("right"), file)
    if left != name or sign not in {"<", "!=", "<="}:
        return None
    return past if sign != "<=" else Operation("+", (past, Literal(1)))


def _switch(node: Node, file: CppFile) -> Iterator[Statement]:
    """Yield a switch as decisions one after the other; where one case runs into the next, what it is taken under is not followed."""
    body, place = node.child_by_field_name("body"), file.place(node)
    subject = expression(node.child_by_field_name("condition"), file)
    found: list[tuple[Expression, tuple[Statement, ...]]] = []
    default: tuple[Statement, ...] = ()
    waiting: list[Expression] = []
    cases = [each for each in body.named_children if each.type == "case_statement"] if body is not None else []
    labels = Literal(frozenset(text_of(each.child_by_field_name("value")) for each in cases))
    for each in cases:
        value = each.child_by_field_name("value")
        statements = tuple(s for inner in each.named_children if inner != value for s in _statement(inner, file))
        tests = (
            [*waiting, Operation(CASE, (subject, expression(value, file), labels))] if value is not None else waiting
        )
        if not statements:
            waiting = tests
            continue
        waiting = []
        ends = isinstance(statements[-1], (Leave, Return))
        kept = (
            statements[:-1]
            if ends and isinstance(statements[-1], Leave) and statements[-1].kind != "throw"
            else statements
        )
        if value is None:
            default = kept
        else:
            test = tests[0] if len(tests) == 1 else Operation("or", tuple(tests))
            found.append((test if ends else NotFollowed("a case without break", (test,)), kept))
    rest = default
    for test, statements in reversed(found):
        rest = (If(test, statements, rest, place),)
    yield from rest


def _preprocessed(node: Node, file: CppFile) -> Iterator[Statement]:
    """Yield what stands under a condition of the preprocessor, as a decision that is not known."""
    condition = node.child_by_field_name("condition") or node.child_by_field_name("name")
    other = node.child_by_field_name("alternative")
    then = tuple(
        found for each in node.named_children if each not in (condition, other) for found in _statement(each, file)
    )
    rest: tuple[Statement, ...] = ()
    if other is not None:
        rest = tuple(_preprocessed(other, file)) if other.type == "preproc_elif" else block(other, file)
    yield If(NotFollowed(f"#if {text_of(condition)[:60]}"), then, rest, file.place(node))


_STATEMENTS: Final[dict[str, Callable[[Node, CppFile], Iterator[Statement]]]] = {
    "expression_statement": _expression_statement,
    "if_statement": _if,
    "switch_statement": _switch,
    "try_statement": _try,
}
