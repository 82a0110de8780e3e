"""Reads expressions of C++, from the syntax tree of tree-sitter."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.settings import Place
from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.programs.program import (
    ADDRESS,
    POINTED,
    Assign,
    Attribute,
    Call,
    Closure,
    Conditional,
    Element,
    Function,
    Items,
    Literal,
    Name,
    NotFollowed,
    Operation,
    Pairs,
    Reference,
    Variable,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from tree_sitter import Node

    from cqos_ros2_sources.programs.program import Expression, Statement

DEEPEST: Final = 120
"""How deep syntax may be nested; deeper parts are not followed."""
_MOST_MACROS: Final = 4
_MAKERS: Final = frozenset(("make_shared", "make_unique", "allocate_shared", "make_optional", "make_any"))
_IN_PLACE: Final = frozenset(("emplace_back", "emplace_front", "emplace"))
"""Methods that make an object of the class that stands between their brackets."""
_CASTS: Final = frozenset(
    (
        "static_cast",
        "dynamic_cast",
        "const_cast",
        "dynamic_pointer_cast",
        "static_pointer_cast",
        "move",
        "forward",
        "ref",
        "cref",
    )
)
_NAMES: Final = frozenset(
    (
        "identifier",
        "qualified_identifier",
        "field_identifier",
        "type_identifier",
        "namespace_identifier",
        "template_function",
        "template_type",
        "template_method",
        "primitive_type",
        "operator_name",
        "destructor_name",
        "dependent_name",
    )
)
_ESCAPES: Final = {"n": "\n", "t": "\t", "r": "\r", "0": "\0"}
_OPERATORS: Final = {"&&": "and", "||": "or", "!": "not"}
_SECONDS: Final = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "min": 60 * 10**9, "h": 3600 * 10**9}


@dataclass(slots=True)
class CppFile:
    """One file that is read.

    Attributes:
        path: as shown.
        body: reads the statements of a block; the reader of statements provides it.
        macros: one word each that macros of the file stand for.
        pending: assignments in expressions that were read; they come before the statement.
        macro: where the macro stands whose text is read; None outside of macros.
    """

    path: str
    body: Callable[[Node, CppFile], tuple[Statement, ...]]
    depth: int = 0
    macros: dict[str, str] = field(default_factory=dict)
    pending: list[Assign] = field(default_factory=list)
    macro: Place | None = None

    def plain(self, text: str) -> str:
        """Return what a word stands for where it is a macro of the file; else the word itself."""
        for _ in range(_MOST_MACROS):
            text = self.macros.get(text, text)
        return text

    def place(self, node: Node) -> Place:
        """Return where a part of the file stands."""
        return self.macro or Place(self.path, node.start_point[0] + 1, node.start_point[1] + 1)


def text_of(node: Node | None) -> str:
    """Return the source of a part on one line, without comments of its own."""
    if node is None or node.text is None:
        return ""
    return " ".join(node.text.decode("utf-8", "replace").split())


def expression(node: Node | None, file: CppFile) -> Expression:
    """Return an expression; what is not followed says so."""
    if node is None or file.depth > DEEPEST:
        return NotFollowed(text_of(node)[:60])
    file.depth += 1
    try:
        reader = _READERS.get(node.type)
        if reader is not None:
            return reader(node, file)
        if node.type in _NAMES:
            return _name(node, file)
        return NotFollowed(text_of(node)[:60], tuple(expression(each, file) for each in node.named_children))
    finally:
        file.depth -= 1


def arguments_of(node: Node | None, file: CppFile) -> tuple[Expression, ...]:
    """Return the arguments in a list of them."""
    if node is None:
        return ()
    return tuple(expression(each, file) for each in node.named_children if each.type != "comment")


def _name(node: Node, file: CppFile) -> Expression:
    del file
    return Name(plain_name(node))


def plain_name(node: Node) -> str:
    """Return a name without the template arguments of its last part."""
    if node.type in {"template_function", "template_method", "template_type"}:
        return text_of(node.child_by_field_name("name"))
    if node.type == "dependent_name" and node.named_children:  # `a.template get<T>()`
        return plain_name(node.named_children[-1])
    if node.type == "qualified_identifier":
        inner = node.child_by_field_name("name")
        scope = node.child_by_field_name("scope")
        return f"{text_of(scope)}::{plain_name(inner)}" if inner is not None and scope is not None else text_of(node)
    return text_of(node)


def template_arguments(node: Node | None) -> tuple[str, ...]:
    """Return the template arguments of the last part of a name."""
    while node is not None and node.type in {"qualified_identifier", "field_expression", "dependent_name"}:
        node = node.child_by_field_name("name") or node.child_by_field_name("field")
    if node is None or node.type not in {"template_function", "template_method", "template_type"}:
        return ()
    arguments = node.child_by_field_name("arguments")
    return () if arguments is None else tuple(text_of(each) for each in arguments.named_children)


def string_text(node: Node) -> str:
    """Return the value of a text literal."""
    if node.type == "concatenated_string":
        return "".join(string_text(each) for each in node.named_children if each.type != "comment")
    if node.type == "raw_string_literal":
        return next(
            (
                each.text.decode("utf-8", "replace")
                for each in node.named_children
                if each.type == "raw_string_content" and each.text
            ),
            "",
        )
    raw = (node.text or b"").decode("utf-8", "replace")
    return _escaped(raw[raw.find('"') + 1 : raw.rfind('"')])


def _character(node: Node, file: CppFile) -> Expression:
    del file
    return Literal(_escaped(text_of(node).partition("'")[2][:-1]))


def _escaped(raw: str) -> str:
    return re.sub(r"\\(.)", lambda found: _ESCAPES.get(found[1], found[1]), raw)


def _string(node: Node, file: CppFile) -> Expression:
    if any(each.type == "identifier" for each in node.named_children):  # a macro among the texts
        return Operation("+", tuple(expression(each, file) for each in node.named_children))
    return Literal(string_text(node))


def number(text: str) -> int | float | None:
    """Return the value of a number of C++."""
    plain = text.replace("'", "").rstrip("uUlLzZ")
    try:
        return int(plain, 8) if re.fullmatch(r"0[0-7]+", plain) else int(plain, 0)
    except ValueError:
        pass
    try:
        return float(plain.rstrip("fF"))
    except ValueError:
        return None


def _number(node: Node, file: CppFile) -> Expression:
    del file
    value = number(text_of(node))
    return NotFollowed(text_of(node)) if value is None else Literal(value)


def _suffixed(node: Node, file: CppFile) -> Expression:
    inner, suffix = node.named_children[0], text_of(node.named_children[-1])
    if inner.type in {"string_literal", "raw_string_literal"}:
        return Literal(string_text(inner))
    value = number(text_of(inner))
    if value is None or suffix not in _SECONDS:
        return NotFollowed(text_of(node))
    return Call(Name("std::chrono::nanoseconds"), (Literal(round(value * _SECONDS[suffix])),), (), (), file.place(node))


def _call(node: Node, file: CppFile) -> Expression:
    function = node.child_by_field_name("function")
    arguments = arguments_of(node.child_by_field_name("arguments"), file)
    if function is None:
        return NotFollowed(text_of(node)[:60], arguments)
    types = template_arguments(function)
    place = file.place(node)
    if function.type == "field_expression":
        return _method(function, arguments, types, place, file)
    cast = function.type == "parenthesized_expression" and text_of(function).endswith("_t)")  # it reads like a call
    if function.type == "primitive_type" or cast:
        return arguments[0] if len(arguments) == 1 else NotFollowed(text_of(node)[:60], arguments)
    if function.type not in _NAMES:
        return Call(expression(function, file), arguments, (), types, place)
    name_text = plain_name(function)
    last = last_part(name_text)
    if last in _MAKERS and types:
        made = arguments[1:] if last == "allocate_shared" else arguments
        return Call(Name(types[0]), made, (), (), place)
    if last == "optional" and types and Name("std::in_place") in arguments[:1]:
        return Call(Name(types[0]), arguments[1:], (), (), place)
    if last == "make_shared" and "::" in name_text:
        return Call(Name(name_text.rpartition("::")[0]), arguments, (), (), place)
    if last in _CASTS and len(arguments) == 1:
        return arguments[0]
    if last == "bind" and arguments:
        listed = node.child_by_field_name("arguments")
        parts = listed.named_children if listed is not None else ()
        return _bound(tuple(_item(each, file) for each in parts if each.type != "comment"), place)
    return Call(Name(name_text), arguments, (), types, place)


def _method(
    function: Node, arguments: tuple[Expression, ...], types: tuple[str, ...], place: Place, file: CppFile
) -> Expression:
    of = expression(function.child_by_field_name("argument"), file)
    name = function.child_by_field_name("field")
    last = plain_name(name) if name is not None else ""
    if last in _IN_PLACE and types:
        return Call(Name(types[0]), arguments, (), (), place)
    return Call(Attribute(of, last), arguments, (), types, place)


def _bound(arguments: tuple[Expression, ...], place: Place) -> Expression:
    """Return what `std::bind` makes: a function, with what it is handed already."""
    first, given = arguments[0], arguments[1:]
    if isinstance(first, Operation):  # `&tune`
        first = first.operands[0]
    if isinstance(first, (Reference, Name)):
        return Reference(first.name if isinstance(first, Reference) else first.text, given)
    if isinstance(first, Closure) and not given:
        return first
    return Call(Name("std::bind"), arguments, (), (), place)


def _new(node: Node, file: CppFile) -> Expression:
    made = text_of(node.child_by_field_name("type"))
    return Call(Name(made), arguments_of(node.child_by_field_name("arguments"), file), (), (), file.place(node))


def _compound(node: Node, file: CppFile) -> Expression:
    made = text_of(node.child_by_field_name("type"))
    return Call(Name(made), arguments_of(node.child_by_field_name("value"), file), (), (), file.place(node))


def _field(node: Node, file: CppFile) -> Expression:
    field_node = node.child_by_field_name("field")
    of = expression(node.child_by_field_name("argument"), file)
    return Attribute(of, plain_name(field_node)) if field_node is not None else NotFollowed(text_of(node)[:60])


def _pointer(node: Node, file: CppFile) -> Expression:
    inner = node.child_by_field_name("argument")
    address = node.children[0].type == "&"
    if address and inner is not None and inner.type == "qualified_identifier":
        return Reference(plain_name(inner))
    return expression(inner, file)


def _binary(node: Node, file: CppFile) -> Expression:
    sign = text_of(node.child_by_field_name("operator"))
    left, start = expression(node.child_by_field_name("left"), file), len(file.pending)
    sides = (left, expression(node.child_by_field_name("right"), file))
    if sign in {"&&", "||"}:
        _unsure(start, file)
    return Operation(_OPERATORS.get(sign, sign), sides)


def _unary(node: Node, file: CppFile) -> Expression:
    sign = text_of(node.child_by_field_name("operator"))
    inner = expression(node.child_by_field_name("argument"), file)
    if sign == "-" and isinstance(inner, Literal) and isinstance(inner.value, (int, float)):
        return Literal(-inner.value)
    return Operation(_OPERATORS.get(sign, sign), (inner,))


def _conditional(node: Node, file: CppFile) -> Expression:
    condition, start = expression(node.child_by_field_name("condition"), file), len(file.pending)
    then, otherwise = (expression(node.child_by_field_name(name), file) for name in ("consequence", "alternative"))
    _unsure(start, file)
    return Conditional(condition, then, otherwise)


def _inner(node: Node, file: CppFile) -> Expression:
    inner = [each for each in node.named_children if each.type != "comment"]
    if any(each.type == "ERROR" for each in inner):  # `(this->*method)`
        return NotFollowed(text_of(node)[:60], tuple(expression(each, file) for each in inner))
    return expression(inner[-1], file) if inner else NotFollowed(text_of(node)[:60])


def _cast(node: Node, file: CppFile) -> Expression:
    return expression(node.child_by_field_name("value"), file)


def _element(node: Node, file: CppFile) -> Expression:
    indices = node.child_by_field_name("indices")
    key = next((each for each in indices.named_children), None) if indices is not None else None
    return Element(expression(node.child_by_field_name("argument"), file), expression(key, file))


def _lambda(node: Node, file: CppFile) -> Expression:
    declarator = node.child_by_field_name("declarator")
    listed = declarator.child_by_field_name("parameters") if declarator is not None else None
    body = node.child_by_field_name("body")
    statements = file.body(body, file) if body is not None else ()
    place = file.place(node)
    made = Function("lambda", parameters_of(listed, file), statements, place, returns=_trailing(declarator))
    return _captured(made, node.child_by_field_name("captures"), file)


def _trailing(declarator: Node | None) -> str:
    """Return the type of what a function returns that is written behind it; empty where it is not."""
    found = (
        []
        if declarator is None
        else [each for each in declarator.named_children if each.type == "trailing_return_type"]
    )
    return text_of(found[0]).removeprefix("->").strip() if found else ""


def returned_type(node: Node) -> str:
    """Return the type of what the definition of a function returns, with ``&`` or ``*`` at its end."""
    declarator = node.child_by_field_name("declarator")
    marks = {"reference_declarator": "&", "pointer_declarator": "*"}
    if declarator is not None and declarator.type in marks:
        return text_of(node.child_by_field_name("type")) + marks[declarator.type]
    return _trailing(declarator) or text_of(node.child_by_field_name("type"))


def _captured(made: Function, captures: Node | None, file: CppFile) -> Closure:
    """Return a lambda with what it holds itself, and what it refers to."""
    values: list[tuple[str, Expression]] = []
    references: list[str] = []
    all_values, refers = False, False
    for each in captures.children if captures is not None else ():
        if each.type == "identifier":
            name = text_of(each)
            values += [] if refers else [(name, Name(name))]
            references += [name] if refers else []
        elif each.type == "lambda_default_capture":
            all_values = text_of(each) == "="
        elif each.type == "lambda_capture_initializer" and each.named_children:
            value = expression(each.named_children[-1], file)
            by_reference = each.children[0].type == "&"
            values.append((text_of(each.named_children[0]), Operation(ADDRESS, (value,)) if by_reference else value))
        refers = each.type == "&"
    return Closure(made, tuple(values), all_values, tuple(references))


def parameters_of(node: Node | None, file: CppFile) -> tuple[Variable, ...]:
    """Return the parameters of a function."""
    found = []
    for each in node.named_children if node is not None else ():
        if each.type not in {
            "parameter_declaration",
            "optional_parameter_declaration",
            "variadic_parameter_declaration",
        }:
            continue
        type_text = text_of(each.child_by_field_name("type"))
        declarator = each.child_by_field_name("declarator")
        if type_text == "void" and declarator is None:
            continue  # `f(void)` of C
        whole = text_of(each)
        constant = whole.startswith("const ") or " const &" in whole or " const&" in whole
        name = declared_name(declarator)
        default = each.child_by_field_name("default_value")
        by_reference = declarator is not None and "reference" in declarator.type and not constant and "&&" not in whole
        kind = "*" if each.type == "variadic_parameter_declaration" else ""
        if declarator is not None:
            type_text += "*" if "pointer" in declarator.type else "&" if "reference" in declarator.type else ""
        found.append(
            Variable(name, type_text, None if default is None else expression(default, file), by_reference, kind)
        )
    return tuple(found)


def declared_name(node: Node | None) -> str:
    """Return the name that a declarator declares; empty where it has none."""
    while node is not None and node.type not in _NAMES:
        inner = node.child_by_field_name("declarator")
        if inner is None:
            inner = next(
                (each for each in node.named_children if each.type in _NAMES or "declarator" in each.type), None
            )
        node = inner
    return "" if node is None else plain_name(node)


def _flag(node: Node, file: CppFile) -> Expression:
    del file
    return Literal(node.type == "true")


def _items(node: Node, file: CppFile) -> Expression:
    pairs = [each for each in node.named_children if each.type == "initializer_pair"]
    if not pairs:
        return Items(tuple(_item(each, file) for each in node.named_children if each.type != "comment"))
    found = []
    for each in pairs:
        names = [text_of(part).lstrip(".") for part in each.children_by_field_name("designator")]
        found.append((Literal(".".join(names)), expression(each.child_by_field_name("value"), file)))
    return Pairs(tuple(found))


def _item(node: Node, file: CppFile) -> Expression:
    """Return an element of a list; a pointer says so, because others are copies."""
    made = expression(node, file)
    return Operation(ADDRESS, (made,)) if is_pointer(node) else made


def is_pointer(node: Node | None) -> bool:
    """Whether an expression makes a pointer or reference, as written: ``&qos``, ``std::ref(qos)``, ``std::make_shared<…>(…)``, ``new …``."""
    if node is None or node.type == "new_expression":
        return node is not None
    if node.type == "pointer_expression":
        return node.children[0].type == "&"
    function = node.child_by_field_name("function") if node.type == "call_expression" else None
    return function is not None and last_part(plain_name(function)) in {"ref", *_MAKERS}


def _null(node: Node, file: CppFile) -> Expression:
    del node, file
    return Literal(None)


def _this(node: Node, file: CppFile) -> Expression:
    del node, file
    return Name("this")


def assigned(node: Node, file: CppFile) -> Assign:
    """Return an assignment; one to what a call returns may change what the call is made on, or is handed."""
    target = expression(node.child_by_field_name("left"), file)
    value = expression(node.child_by_field_name("right"), file)
    if isinstance(target, Call):
        changed = (target.function.of,) if isinstance(target.function, Attribute) else target.arguments
        file.pending += [Assign(each, NotFollowed(""), file.place(node)) for each in changed]
    sign = text_of(node.child_by_field_name("operator"))
    left = node.child_by_field_name("left")
    if left is not None and left.type == "pointer_expression" and not isinstance(target, Call):
        target = Element(target, POINTED)
    return Assign(target, value if sign == "=" else Operation(sign[:-1], (target, value)), file.place(node))


def _assignment(node: Node, file: CppFile) -> Expression:
    """Return what an assignment in an expression sets; it is set before."""
    made = assigned(node, file)
    file.pending.append(made)
    return made.target


def _update(node: Node, file: CppFile) -> Expression:
    target = expression(node.child_by_field_name("argument"), file)
    changed = NotFollowed(text_of(node)[:60], (target,))
    file.pending.append(Assign(target, changed, file.place(node)))
    return changed


def _unsure(start: int, file: CppFile) -> None:
    """Take assignments as not known that an expression may leave out."""
    file.pending[start:] = [Assign(each.target, NotFollowed(""), each.place) for each in file.pending[start:]]


_READERS: Final[dict[str, Callable[[Any, CppFile], Expression]]] = {
    "string_literal": _string,
    "raw_string_literal": _string,
    "char_literal": _character,
    "concatenated_string": _string,
    "number_literal": _number,
    "user_defined_literal": _suffixed,
    "true": _flag,
    "false": _flag,
    "null": _null,
    "nullptr": _null,
    "this": _this,
    "call_expression": _call,
    "new_expression": _new,
    "compound_literal_expression": _compound,
    "field_expression": _field,
    "pointer_expression": _pointer,
    "binary_expression": _binary,
    "unary_expression": _unary,
    "conditional_expression": _conditional,
    "parenthesized_expression": _inner,
    "condition_clause": _inner,
    "cast_expression": _cast,
    "subscript_expression": _element,
    "lambda_expression": _lambda,
    "initializer_list": _items,
    "assignment_expression": _assignment,
    "update_expression": _update,
}
