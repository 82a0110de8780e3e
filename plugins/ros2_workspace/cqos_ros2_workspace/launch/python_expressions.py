"""Expressions of Python launch files: their values, as far as the file decides them. Nothing is executed or imported."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import Any, Final

from cqos_ros2_workspace.launch.entities import Action, Sub
from cqos_ros2_workspace.launch.python_calls import attribute, call
from cqos_ros2_workspace.launch.python_names import (
    DEEPEST_EXPRESSION,
    MISSING,
    ConfigurationsValue,
    FileText,
    Frame,
    Function,
    Library,
    PathText,
    Walk,
    written,
)
from cqos_ros2_workspace.launch.values import (
    Either,
    Joined,
    Unknown,
    When,
    cases,
    either,
    first_unknown,
    join,
    lift,
    replaced,
    shown,
    undecided,
    under,
)

_MOST_ITEMS: Final = 10_000
_LONGEST_TEXT: Final = 1_000_000
_BUILTINS: Final = [
    "abs",
    "all",
    "any",
    "bool",
    "bytes",
    "dict",
    "enumerate",
    "filter",
    "float",
    "getattr",
    "hasattr",
    "int",
    "isinstance",
    "len",
    "list",
    "map",
    "max",
    "min",
    "next",
    "open",
    "print",
    "range",
    "repr",
    "reversed",
    "round",
    "set",
    "sorted",
    "str",
    "sum",
    "tuple",
    "type",
    "zip",
]
_COMPARISONS: Final[dict[type[ast.cmpop], Callable[[Any, Any], Any]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda one, other: one in other,
    ast.NotIn: lambda one, other: one not in other,
}
_ARITHMETIC: Final[dict[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.BitOr: operator.or_,
}
_OPAQUE: Final = (Action, Sub, Library, Function, FileText, ConfigurationsValue)


def value_of(node: ast.expr, frame: Frame, walk: Walk) -> Any:
    """Return the value of an expression, unknown with its cause where the file does not decide it."""
    walk.step()
    found = _VALUES.get(type(node))
    if found is None:
        return frame.not_followed(node)
    if walk.depth > DEEPEST_EXPRESSION:
        return frame.unknown("an expression is nested too deep", node)
    walk.depth += 1
    try:
        return under(found(node, frame, walk), tuple(walk.guards))
    finally:
        walk.depth -= 1


def truth(value: Any) -> Any:
    """Return whether a value counts as true, as a truth value that may have alternatives."""
    return lift(_truth, value)


def _truth(value: Any) -> Any:
    if isinstance(value, Unknown):
        return undecided(value.guard("true"))
    if isinstance(value, Joined) and not any(isinstance(part, str) for part in value.parts):
        return undecided(Unknown("", subject=shown(value)).guard("true"))
    return True if isinstance(value, _OPAQUE) else bool(value)


def _constant(node: ast.Constant, frame: Frame, _walk: Walk) -> Any:
    if node.value is Ellipsis or isinstance(node.value, complex):
        return frame.not_followed(node)
    return node.value


def _name(node: ast.Name, frame: Frame, _walk: Walk) -> Any:
    found = frame.find(node.id)
    if found is not MISSING:
        return found
    if node.id == "__file__":
        return frame.path
    if node.id in _BUILTINS:
        return Library(f"builtins.{node.id}")
    return frame.unknown(f"`{node.id}` has no value that the file states", node)


def _items(nodes: list[ast.expr], frame: Frame, walk: Walk) -> list[Any]:
    found: list[Any] = []
    for node in nodes:
        if not isinstance(node, ast.Starred):
            found.append(value_of(node, frame, walk))
            continue
        inner = value_of(node.value, frame, walk)
        if isinstance(inner, (list, tuple)):
            found += inner
        elif isinstance(inner, Either) and all(isinstance(each, (list, tuple)) for _, each in inner.cases):
            found += [When(guards, one) for guards, each in inner.cases for one in each]
        else:
            found.append(frame.not_followed(node, inner))
    return found


def _dictionary(node: ast.Dict, frame: Frame, walk: Walk) -> Any:
    found: dict[Any, Any] = {}
    for key, inner in zip(node.keys, node.values, strict=True):
        value = value_of(inner, frame, walk)
        if key is None:
            if not isinstance(value, dict):
                return frame.not_followed(inner, value)
            found.update(value)
            continue
        name = value_of(key, frame, walk)
        if not isinstance(name, (str, int, float, Sub)):
            return first_unknown(name) or frame.unknown(f"the key `{written(key)}` is not followed", key)
        found[name] = value
    return found


def _formatted(node: ast.JoinedStr, frame: Frame, walk: Walk) -> Any:
    parts: list[Any] = []
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(str(part.value))
        elif isinstance(part, ast.FormattedValue):
            if part.format_spec is not None:
                parts.append(frame.unknown(f"`{written(node)}` formats a value", node))
                continue
            parts.append(lift(lambda each, at=part: _as_text(each, frame, at), value_of(part.value, frame, walk)))
    return join(parts)


def _as_text(value: Any, frame: Frame, node: ast.AST) -> Any:
    if isinstance(value, (Unknown, Joined)):
        return value
    if isinstance(value, (*_OPAQUE, list, dict, tuple)) or callable(value):
        return frame.unknown("a text is made of an object that is none", node)
    return str(value)


def _binary(node: ast.BinOp, frame: Frame, walk: Walk) -> Any:
    # A chain of `+` leans to the left as deep as it is long: it is walked in a loop.
    chain = [node]
    while isinstance(chain[-1].left, ast.BinOp):
        chain.append(chain[-1].left)
    value = value_of(chain[-1].left, frame, walk)
    for each in reversed(chain):
        walk.step()
        right = value_of(each.right, frame, walk)
        value = lift(lambda one, other, at=each: _combine(at, one, other, frame), value, right)
    return value


def _combine(node: ast.BinOp, one: Any, other: Any, frame: Frame) -> Any:
    path = isinstance(node.op, ast.Div) and (
        isinstance(one, (PathText, Joined, Unknown)) or (isinstance(one, Sub) and one.kind.startswith("Path"))
    )
    if path and isinstance(one, Sub):
        return Sub("PathJoinSubstitution", {"substitutions": [one, other]}, one.place)
    if path:
        found = join([one, "/", other])
        return PathText(found) if isinstance(found, str) else found
    texts = (str, Unknown, Joined)
    if isinstance(node.op, ast.Add) and isinstance(one, texts) and isinstance(other, texts):
        return join([one, other])
    if (unknown := first_unknown(one, other)) is not None and not isinstance(one, (list, tuple, dict)):
        return unknown
    if isinstance(one, (list, tuple)) and isinstance(other, Unknown):
        return [*one, other]
    act = _ARITHMETIC.get(type(node.op))
    if act is None or isinstance(one, _OPAQUE) or isinstance(other, _OPAQUE) or _too_large(node, one, other):
        return frame.not_followed(node)
    try:
        return act(one, other)
    except (TypeError, ValueError, ArithmeticError, KeyError):
        return frame.unknown(f"`{written(node)}` fails", node)


def _too_large(node: ast.BinOp, one: Any, other: Any) -> bool:
    """Whether an operation may make a value of any size: a text or number times a number."""
    if isinstance(node.op, ast.Mod) and isinstance(one, str):
        return any(character.isdigit() for character in one)
    if not isinstance(node.op, ast.Mult):
        most = _LONGEST_TEXT if isinstance(one, str) else _MOST_ITEMS
        return isinstance(one, (str, list, tuple)) and isinstance(other, type(one)) and len(one) + len(other) > most
    sizes = [each for each in (one, other) if isinstance(each, int)]
    lengths = [len(each) for each in (one, other) if isinstance(each, (str, list, tuple))]
    return any(abs(each) > 10**15 for each in sizes) or any(
        n * abs(each) > _MOST_ITEMS for n in lengths for each in sizes
    )


def _boolean(node: ast.BoolOp, frame: Frame, walk: Walk) -> Any:
    result = value_of(node.values[0], frame, walk)
    for each in node.values[1:]:
        other = value_of(each, frame, walk)
        stop = isinstance(node.op, ast.Or)

        def chosen(first: Any, second: Any, stop: bool = stop) -> Any:  # noqa: FBT001 - bound for the closure
            return either([(guards, first if held is stop else second) for guards, held in cases(truth(first))])

        result = lift(chosen, result, other)
    return result


def _unary(node: ast.UnaryOp, frame: Frame, walk: Walk) -> Any:
    value = value_of(node.operand, frame, walk)
    if isinstance(node.op, ast.Not):
        return _not(truth(value))
    if isinstance(value, (int, float)):
        return -value if isinstance(node.op, ast.USub) else +value
    return frame.not_followed(node, value)


def _compare(node: ast.Compare, frame: Frame, walk: Walk) -> Any:
    left = value_of(node.left, frame, walk)
    result: Any = True
    for kind, node_right in zip(node.ops, node.comparators, strict=True):
        right = value_of(node_right, frame, walk)
        act = _COMPARISONS[type(kind)]

        def judged(one: Any, other: Any, kind: ast.cmpop = kind, act: Any = act) -> Any:
            return compared(type(kind), act, one, other)

        found = lift(judged, left, right)
        if isinstance(found, Unknown):
            found = undecided(frame.unknown(found.cause, node, written(node)).guard("true"))
        result = lift(lambda one, other: one and other, result, found)
        left = right
    return result


def compared(kind: type[ast.cmpop], act: Callable[[Any, Any], Any], one: Any, other: Any) -> Any:
    """Return whether two values compare so; alternatives for one that is not known and a text."""
    if not (_comparable(one) and _comparable(other)):
        return first_unknown(one, other) or Unknown("two values that are not compared")
    negative = kind in {ast.NotEq, ast.NotIn, ast.IsNot}
    unknown = first_unknown(one, other)
    if unknown is None:
        try:
            return bool(act(one, other))
        except TypeError:
            return Unknown("two values that do not compare")
    if kind in {ast.Is, ast.IsNot} and (one is None or other is None):
        found: Any = undecided(unknown.guard("None"))
        return _not(found) if negative else found
    if kind in {ast.Eq, ast.NotEq} and isinstance(one, Unknown) and isinstance(other, (str, bool, int)):
        found = undecided(one.guard(str(other)))
        return _not(found) if negative else found
    if kind in {ast.In, ast.NotIn} and isinstance(one, Unknown) and _plain(other):
        guards = [one.guard(str(each)) for each in other]
        none_of = tuple(each.negated() for each in guards)
        found = either([*(((each,), True) for each in guards), (none_of, False)])
        return _not(found) if negative else found
    return unknown


def _comparable(value: Any) -> bool:
    """Whether comparing a value takes little time: it is no list of lists."""
    members = value if isinstance(value, (list, tuple, dict)) else ()
    return not any(isinstance(each, (list, tuple, dict)) for each in members)


def _plain(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and all(isinstance(each, (str, int)) for each in value)


def _not(value: Any) -> Any:
    return lift(lambda each: not each, value)


def _conditional(node: ast.IfExp, frame: Frame, walk: Walk) -> Any:
    found = []
    for guards, held in cases(truth(value_of(node.test, frame, walk))):
        walk.guards += guards
        found.append((guards, value_of(node.body if held else node.orelse, frame, walk)))
        del walk.guards[len(walk.guards) - len(guards) :]
    return either(found)


def _subscript(node: ast.Subscript, frame: Frame, walk: Walk) -> Any:
    of = value_of(node.value, frame, walk)
    if isinstance(node.slice, ast.Slice):
        ends = [None if each is None else value_of(each, frame, walk) for each in (node.slice.lower, node.slice.upper)]
        if isinstance(of, (str, list, tuple)) and all(each is None or isinstance(each, int) for each in ends):
            return of[ends[0] : ends[1]]
        return frame.not_followed(node, of, *ends)
    key = value_of(node.slice, frame, walk)
    return lift(lambda one, at: _item(one, at, node, frame, walk), of, key)


def _item(of: Any, key: Any, node: ast.Subscript, frame: Frame, walk: Walk) -> Any:
    if isinstance(of, Library) and of.name == "os.environ" and isinstance(key, str):
        return walk.launch.environment(key, None, frame.place(node))
    if isinstance(of, ConfigurationsValue) and isinstance(key, str):
        return walk.launch.perform(Sub("LaunchConfiguration", {"name": key}, frame.place(node)))
    if (unknown := first_unknown(of, key)) is not None and not (isinstance(of, dict) and not first_unknown(key)):
        return unknown
    try:
        if isinstance(of, (str, list, tuple, dict)):
            found = of[key]
            return either([(found.guards, found.value)]) if isinstance(found, When) else found
    except (KeyError, IndexError, TypeError):
        return frame.unknown(f"`{written(node)}` is not there", node)
    return frame.not_followed(node)


def _attribute(node: ast.Attribute, frame: Frame, walk: Walk) -> Any:
    return lift(lambda of: attribute(of, node, frame), value_of(node.value, frame, walk))


def _call(node: ast.Call, frame: Frame, walk: Walk) -> Any:
    function = value_of(node.func, frame, walk)
    arguments = _items(node.args, frame, walk)
    named: dict[str, Any] = {}
    for keyword in node.keywords:
        value = value_of(keyword.value, frame, walk)
        if keyword.arg is not None:
            named[keyword.arg] = value
        elif isinstance(value, dict):
            named |= {str(name): each for name, each in value.items()}
        else:
            named["**"] = first_unknown(value) or frame.unknown(f"`{written(keyword.value)}` is not followed", node)
    return lift(lambda each: call(each, arguments, named, node, frame, walk), function)


def _comprehension(node: Any, frame: Frame, walk: Walk) -> list[Any] | Unknown:
    """Return the values of a comprehension: of its element, or pairs of key and value."""
    found: list[Any] = []
    inner = type(frame)(frame.path, outer=frame)

    def run(number: int) -> Unknown | None:
        if number == len(node.generators):
            walk.step()
            element = (node.key, node.value) if isinstance(node, ast.DictComp) else (node.elt,)
            values = [value_of(each, inner, walk) for each in element]
            found.append(tuple(values) if len(values) > 1 else values[0])
            return None
        generator = node.generators[number]
        members = value_of(generator.iter, inner, walk)
        if not isinstance(members, (list, tuple, dict, str)):
            return first_unknown(members) or frame.unknown(f"`{written(generator.iter)}` is not followed", node)
        for member in list(members)[:_MOST_ITEMS]:
            bind(generator.target, member, inner, walk)
            tests = [truth(value_of(test, inner, walk)) for test in generator.ifs]
            if any(not isinstance(test, bool) for test in tests):
                return frame.unknown(f"`{written(node)}` depends on what is not known", node)
            if all(tests) and (unknown := run(number + 1)) is not None:
                return unknown
        return None

    return run(0) or found


def _mapping(node: ast.DictComp, frame: Frame, walk: Walk) -> Any:
    pairs = _comprehension(node, frame, walk)
    if isinstance(pairs, Unknown):
        return pairs
    if not all(isinstance(key, (str, int, float, Sub)) for key, _ in pairs):
        return frame.not_followed(node)
    return dict(pairs)


def bind(target: ast.expr, value: Any, frame: Frame, walk: Walk) -> None:
    """Give a value to the names of a target."""
    if isinstance(target, ast.Name):
        walk.step()
        if walk.guards:
            old = frame.names.get(target.id, frame.unknown(f"`{target.id}` may have no value", target))
            value = replaced(old, value, tuple(walk.guards))
        frame.names[target.id] = value
    elif isinstance(target, (ast.Tuple, ast.List)):
        known = isinstance(value, (list, tuple)) and len(value) == len(target.elts)
        missing = frame.not_followed(target, value)
        for number, each in enumerate(target.elts):
            bind(each, value[number] if known else missing, frame, walk)
    elif isinstance(target, ast.Starred):
        bind(target.value, frame.not_followed(target), frame, walk)
    elif isinstance(target, ast.Subscript):
        _set_item(target, value, frame, walk)


def _set_item(target: ast.Subscript, value: Any, frame: Frame, walk: Walk) -> None:
    of = value_of(target.value, frame, walk)
    key = value_of(target.slice, frame, walk)
    if isinstance(of, dict) and isinstance(key, (str, int, bool)):
        missing = frame.unknown(f"`{written(target)}` may have no value", target)
        of[key] = replaced(of.get(key, missing), value, tuple(walk.guards))
    elif isinstance(of, list) and isinstance(key, int) and -len(of) <= key < len(of):
        of[key] = replaced(of[key], value, tuple(walk.guards))
    elif isinstance(of, dict):
        of["?"] = frame.not_followed(target, key)


_VALUES: Final[dict[type[ast.expr], Callable[[Any, Frame, Walk], Any]]] = {
    ast.Attribute: _attribute,
    ast.BinOp: _binary,
    ast.BoolOp: _boolean,
    ast.Call: _call,
    ast.Compare: _compare,
    ast.Constant: _constant,
    ast.Dict: _dictionary,
    ast.DictComp: _mapping,
    ast.GeneratorExp: _comprehension,
    ast.IfExp: _conditional,
    ast.JoinedStr: _formatted,
    ast.Lambda: lambda node, frame, _walk: Function(node, frame),
    ast.List: lambda node, frame, walk: _items(node.elts, frame, walk),
    ast.ListComp: _comprehension,
    ast.Name: _name,
    ast.Set: lambda node, frame, walk: _items(node.elts, frame, walk),
    ast.SetComp: _comprehension,
    ast.Subscript: _subscript,
    ast.Tuple: lambda node, frame, walk: tuple(_items(node.elts, frame, walk)),
    ast.UnaryOp: _unary,
}
