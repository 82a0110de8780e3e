"""Reads statements of C++ functions, from the syntax tree of tree-sitter."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_ros2_sources.programs.cpp_expressions import (
    CppFile,
    arguments_of,
    assigned,
    declared_name,
    expression,
    is_pointer,
    text_of,
)
from cqos_ros2_sources.programs.program import (
    CASE,
    POINTS,
    STATIC,
    Assign,
    Attribute,
    Call,
    Do,
    Element,
    If,
    Items,
    Leave,
    Literal,
    Loop,
    Name,
    NotFollowed,
    Operation,
    Return,
    Try,
    call_name,
)
from cqos_ros2_sources.programs.statement_search import calls_in, inside
from cqos_ros2_sources.walk.other_writers import CHANGING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tree_sitter import Node

    from cqos_ros2_sources.programs.program import Expression, Statement

_BLOCKS: Final = frozenset(("compound_statement", "labeled_statement", "ERROR"))
_OF_EACH: Final = re.compile(r"(?:const )?(?:std::)?vector<\s*([A-Z_a-z:]*[A-Z]\w*)\s*>")
"""A list of structures: those have names of their own, with a capital letter."""
_PLAIN_NAMES: Final = frozenset(("type_identifier", "identifier"))
_VALUE_TYPES: Final = frozenset(("argument_list", "initializer_list"))


# Statements


def block(node: Node, file: CppFile) -> tuple[Statement, ...]:
    """Return the statements of a block, or of one statement."""
    if node.type in {"compound_statement", "ERROR", "case_statement"} or node.type.startswith("preproc_"):
        return tuple(found for each in node.named_children for found in _statement(each, file))
    return tuple(_statement(node, file))


def _statement(node: Node, file: CppFile) -> Iterator[Statement]:
    """Yield a statement, behind the assignments in its expressions."""
    start = len(file.pending)
    found = [*_read(node, file)]
    before = file.pending[start:]
    del file.pending[start:]
    yield from before
    yield from found


def _read(node: Node, file: CppFile) -> Iterator[Statement]:
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
    bodies = [each.child_by_field_name("body") for each in node.named_children if each.type == "catch_clause"]
    handlers = tuple(block(each, file) for each in bodies if each is not None)
    yield Try(block(node.child_by_field_name("body") or node, file), handlers, file.place(node))


def _expression_statement(node: Node, file: CppFile) -> Iterator[Statement]:
    inner = next((each for each in node.named_children if each.type != "comment"), None)
    if inner is None:
        return
    if inner.type == "assignment_expression":
        yield assigned(inner, file)
        return
    made = expression(inner, file)
    if inner.type != "update_expression":
        yield Do(made, file.place(node))


def declared_in(node: Node, file: CppFile) -> Iterator[tuple[str, Expression, str]]:
    """Yield name, value and type of each variable that a declaration makes."""
    type_text = text_of(node.child_by_field_name("type"))
    for index, child in enumerate(node.children):
        if node.field_name_for_child(index) != "declarator":
            continue
        names = _bound_names(child)
        if names:
            held = f"#{child.start_point[0]}:{child.start_point[1]}"
            mark = _marked(type_text, node, child)
            yield held, expression(child.child_by_field_name("value"), file), mark
            yield from ((name, Element(Name(held), Literal(index)), mark) for index, name in enumerate(names))
        elif child.type == "init_declarator":
            value = child.child_by_field_name("value")
            if value is not None:
                written, made = _marked(type_text, node, child), initial_value(type_text, value, file)
                pointed = value.type == "pointer_expression" and value.children[0].type == "*"
                copy = pointed and not written.endswith(("&", "*"))
                yield declared_name(child), Operation(POINTS, (made,)) if copy else made, written
        elif child.type == "function_declarator":
            given = _given(child, file)
            if given:
                made = Call(Name(type_text), given, (), (), file.place(child))
                yield declared_name(child), made, _marked(type_text, node, child)
        elif child.type in {"identifier", "qualified_identifier"}:
            made = Call(Name(type_text), (), (), (), file.place(child))
            yield declared_name(child), made, _marked(type_text, node, child)
        else:
            yield declared_name(child), NotFollowed(text_of(child)[:60]), type_text


def _bound_names(declarator: Node) -> list[str]:
    """Return the names of a structured binding; none where it is another declaration."""
    inner = declarator.child_by_field_name("declarator")
    if inner is not None and inner.type == "reference_declarator" and inner.named_children:
        inner = inner.named_children[0]
    binding = inner is not None and inner.type == "structured_binding_declarator"
    return [text_of(each) for each in inner.named_children] if inner is not None and binding else []


def _marked(type_text: str, node: Node, child: Node) -> str:
    """Return the type of a variable with the sign of a reference or pointer; `const` stands before one that changes nothing, `static` before one that is made once."""
    declarator = child.child_by_field_name("declarator")
    mark = {"reference_declarator": "&", "pointer_declarator": "*"}.get(declarator.type if declarator else "", "")
    if not mark and type_text == "auto" and is_pointer(child.child_by_field_name("value")):
        mark = "*"
    words = {text_of(each) for each in node.children if each.type in {"type_qualifier", "storage_class_specifier"}}
    kept = STATIC if "static" in words else "const " if mark and "const" in words else ""
    return kept + type_text + mark


def _given(node: Node, file: CppFile) -> tuple[Expression, ...]:
    """Return the arguments of `Talker talker(node, topic)`, which reads like the declaration of a function; none where it is one."""
    listed = node.child_by_field_name("parameters")
    parts = [] if listed is None else [each for each in listed.named_children if each.type != "comment"]
    found: list[Expression] = []
    for each in parts:
        named, called = each.child_by_field_name("type"), each.child_by_field_name("declarator")
        inner = () if called is None else _given(called, file)  # `std::ref(node)`
        calls = bool(inner) or (called is not None and text_of(called) == "()")  # `get_node()`
        names = (*_PLAIN_NAMES, *(("qualified_identifier",) if calls else ()))
        if named is None or named.type not in names or len(each.named_children) != 1 + calls:
            return ()
        made = expression(named, file)
        found.append(Call(made, inner, (), (), file.place(each)) if calls else made)
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
        refers = declarator is not None and declarator.type == "reference_declarator"
        copies = declarator is not None and declarator.type not in {"reference_declarator", "pointer_declarator"}
        if declarator is not None and refers:
            declarator = declarator.named_children[0]
        names = (
            tuple(text_of(each) for each in declarator.named_children)
            if declarator is not None and declarator.type == "structured_binding_declarator"
            else (declared_name(declarator),)
        )
        over = expression(node.child_by_field_name("right"), file)
        yield Loop(names, over, statements, place, copies=copies)
        if refers and any(_changes(each, names) for each in inside(statements)):
            yield Assign(over, NotFollowed(""), place)
        return
    start = node.child_by_field_name("initializer")
    declared = [*declared_in(start, file)] if start is not None and start.type == "declaration" else []
    if not declared:
        expression(start, file)
    head = _changed_in_head(node, {name for name, _, _ in declared}, file)
    if len(declared) == 1:
        name, first, _ = declared[0]
        past = _counted(node, name, file)
        if past is not None and not any(
            isinstance(each, Assign) and each.target == Name(name) for each in inside(statements)
        ):
            yield Loop((name,), Call(Name("#range"), (first, past), (), (), place), statements, place)
            return
    yield from (Assign(Name(name), NotFollowed("a counter"), place, declares=True) for name, _, _ in declared)
    yield Loop((), None, (*statements, *head), place)


def _changes(statement: Statement, names: tuple[str, ...]) -> bool:
    """Whether a statement sets a name, or calls a method that may change what it holds."""
    if isinstance(statement, Assign):
        return isinstance(statement.target, Name) and statement.target.text in names and not statement.declares
    if not isinstance(statement, Do) or not isinstance(statement.expression, Call):
        return False
    called = statement.expression.function
    of = called.of if isinstance(called, Attribute) else None
    return isinstance(of, Name) and of.text in names and call_name(statement.expression) in CHANGING


def _changed_in_head(node: Node, own: set[str], file: CppFile) -> tuple[Statement, ...]:
    """Take what the condition and the step of a loop set as not known, apart from the names of the loop; return what they call."""
    first = len(file.pending)
    head = tuple(
        Do(expression(part, file), file.place(part))
        for name in ("condition", "update")
        if (part := node.child_by_field_name(name)) is not None
    )
    file.pending[first:] = [
        Assign(each.target, NotFollowed(""), each.place)
        for each in file.pending[first:]
        if not isinstance(each.target, Name) or each.target.text not in own
    ]
    return tuple(each for each in head if any(True for _ in calls_in((each,))))


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


def initial_value(type_text: str, value: Node, file: CppFile) -> Expression:
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
