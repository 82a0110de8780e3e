"""Reads files of Python by their syntax tree: what they define, and the statements of functions. Nothing is imported."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from cqos_core.model.settings import Place
from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.programs.program import (
    EACH,
    ENTER,
    JOIN,
    LEAVE,
    PAIRS,
    SUPER,
    THIS,
    YIELD,
    Assign,
    Attribute,
    Call,
    Class,
    Closure,
    Conditional,
    Do,
    Element,
    Expression,
    Function,
    If,
    Items,
    Leave,
    Literal,
    Loop,
    Name,
    NotFollowed,
    Operation,
    Pairs,
    Program,
    Return,
    Statement,
    Try,
    Variable,
    call_name,
)

DEEPEST: Final = 100
_TRIES: Final = (ast.Try, *((ast.TryStar,) if hasattr(ast, "TryStar") else ()))
_OPERATORS: Final = {
    ast.Add: "+", ast.Mod: "%", ast.Eq: "==", ast.NotEq: "!=", ast.And: "and", ast.Or: "or", ast.Not: "not", ast.Mult: "*", ast.Sub: "-", ast.Div: "/", ast.Is: "==", ast.IsNot: "!=", ast.In: "in", ast.NotIn: "not in",
}  # fmt: skip


@dataclass(slots=True)
class PythonFile:
    """One file that is read.

    Attributes:
        path: as shown.
        module: its dotted name.
        imported: what names of the file mean elsewhere.
        shared: names that inner functions set (`nonlocal`).
        pending: assignments in expressions that were read; they come before the statement.
    """

    path: str
    module: str
    imported: dict[str, str] = field(default_factory=dict)
    this: str = ""
    depth: int = 0
    shared: set[str] = field(default_factory=set)
    pending: list[Assign] = field(default_factory=list)

    def place(self, node: Any) -> Place:
        """Return where a part of the file stands."""
        return Place(self.path, node.lineno, node.col_offset + 1)


def read_module(text: bytes, path: str, module: str, program: Program) -> None:
    """Add what a file defines to a program; a file that imports `rospy` and not `rclpy` is for ROS 1 and is left out.

    Raises:
        SyntaxError, ValueError, RecursionError, MemoryError: it is no Python that can be read.
    """
    tree = ast.parse(text, filename=path)
    file = PythonFile(path, module)
    for each in tree.body:
        _imports(each, file)
    first_version = _uses("rospy", file)
    for node in ast.walk(tree):
        _imports(node, file)
        file.shared.update(node.names if isinstance(node, ast.Nonlocal) else ())
        for name in node.names if isinstance(node, ast.Global) else ():
            program.constants.setdefault(name, []).append(
                (f"{module}.{name}", NotFollowed("set by `global`"), file.path)
            )
    if first_version and not _uses("rclpy", file):
        return
    program.imports[path] = tuple(dict.fromkeys(file.imported.values()))
    run: list[Statement] = []
    _definitions(tree.body, module, "", file, program, run)
    program.scripts[path] = Function(f"{module}.__main__", (), tuple(run), Place(path, 1))


def _uses(library: str, file: PythonFile) -> bool:
    return any(each.partition(".")[0] == library for each in file.imported.values())


def _imports(node: ast.AST, file: PythonFile) -> None:
    if isinstance(node, ast.Import):
        for each in node.names:
            name = each.asname or each.name.partition(".")[0]
            file.imported[name] = each.name if each.asname else name
    elif isinstance(node, ast.ImportFrom):
        base = node.module or ""
        if node.level:
            above = file.module.split(".")[: -node.level]
            base = ".".join([*above, *([node.module] if node.module else [])])
        for each in node.names:
            file.imported[each.asname or each.name] = f"{base}.{each.name}"


def _definitions(
    body: Iterable[ast.stmt], scope: str, owner: str, file: PythonFile, program: Program, run: list[Statement]
) -> None:
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            made = _function(node, scope, owner, file)
            program.functions.setdefault(made.last, []).append(made)
        elif isinstance(node, ast.ClassDef):
            _class(node, scope, file, program)
        else:
            for each in _statement(node, file):
                run.append(each)
                if isinstance(each, Assign) and isinstance(each.target, Name) and not owner:
                    name = f"{scope}.{each.target.text}"
                    program.constants.setdefault(last_part(name), []).append((name, each.value, file.path))


def _class(node: ast.ClassDef, scope: str, file: PythonFile, program: Program) -> None:
    name = f"{scope}.{node.name}"
    bases = tuple(text for each in node.bases if (text := _dotted(each, file)))
    made = Class(name, bases, file.place(node))
    program.classes.setdefault(node.name, []).append(made)
    run: list[Statement] = []
    for one in node.body:
        if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name):
            made.fields[one.target.id] = ""
    _definitions(node.body, name, name, file, program, run)
    for each in run:
        if isinstance(each, Assign) and isinstance(each.target, Name):
            made.initial[each.target.text] = each.value
        elif isinstance(each, Assign) and isinstance(each.target, Attribute) and isinstance(each.target.of, Name):
            made.initial[each.target.of.text] = NotFollowed("what the body of the class changes")


def _dotted(node: ast.expr, file: PythonFile) -> str:
    found = _expression(node, file)
    return found.text if isinstance(found, Name) else ""


def _function(node: ast.FunctionDef | ast.AsyncFunctionDef, scope: str, owner: str, file: PythonFile) -> Function:
    kinds = {each.id for each in node.decorator_list if isinstance(each, ast.Name)}
    static = "staticmethod" in kinds
    parameters = _parameters(node.args, file)
    decorators = tuple(_decorator(each, file) for each in node.decorator_list)
    outer = file.this
    if owner and not static:
        file.this, parameters = (parameters[0].name if parameters else ""), parameters[1:]
    statements = _block(node.body, file)
    file.this = outer
    return Function(
        f"{scope}.{node.name}",
        parameters,
        statements,
        file.place(node),
        owner=owner,
        static=static or "classmethod" in kinds,
        decorators=decorators,
    )


def _decorator(node: ast.expr, file: PythonFile) -> str:
    """Return the name of a decorator, without the arguments that it is given."""
    if isinstance(node, ast.Call):
        return _decorator(node.func, file)
    return _dotted(node, file) or " ".join(ast.unparse(node).split())[:60]


def _parameters(node: ast.arguments, file: PythonFile) -> tuple[Variable, ...]:
    plain = [*node.posonlyargs, *node.args]
    defaults: list[ast.expr | None] = [*[None] * (len(plain) - len(node.defaults)), *node.defaults]
    found = [Variable(each.arg, "", _optional(default, file)) for each, default in zip(plain, defaults, strict=True)]
    if node.vararg is not None:
        found.append(Variable(node.vararg.arg, kind="*"))
    found += [
        Variable(each.arg, "", _optional(default, file))
        for each, default in zip(node.kwonlyargs, node.kw_defaults, strict=True)
    ]
    if node.kwarg is not None:
        found.append(Variable(node.kwarg.arg, kind="**"))
    return tuple(found)


def _optional(node: ast.expr | None, file: PythonFile) -> Expression | None:
    return None if node is None else _expression(node, file)


# Statements


def _block(body: Iterable[ast.stmt], file: PythonFile) -> tuple[Statement, ...]:
    return tuple(found for each in body for found in _statement(each, file))


def _statement(node: ast.stmt, file: PythonFile) -> Iterator[Statement]:
    """Yield a statement, behind the assignments in its expressions."""
    start = len(file.pending)
    found = [*_read(node, file)]
    before = file.pending[start:]
    del file.pending[start:]
    yield from before
    yield from found


def _read(node: ast.stmt, file: PythonFile) -> Iterator[Statement]:
    place = file.place(node)
    if isinstance(node, ast.Assign):
        value = _expression(node.value, file)
        for target in node.targets:
            yield from _assign(target, value, place, file)
            if not isinstance(target, (ast.Tuple, ast.List)):
                value = _target(target, file)  # one object for all targets
    elif isinstance(node, ast.AnnAssign):
        if node.value is not None:
            yield Assign(_expression(node.target, file), _expression(node.value, file), place)
    elif isinstance(node, ast.AugAssign):
        changed = _target(node.target, file)
        yield Assign(
            changed, Operation(_OPERATORS.get(type(node.op), "?"), (changed, _expression(node.value, file))), place
        )
    elif isinstance(node, ast.Expr):
        yield Do(_expression(node.value, file), place)
    elif isinstance(node, ast.Return):
        yield Return(_optional(node.value, file), place)
    elif isinstance(node, (ast.Raise, ast.Break, ast.Continue)):
        yield from _raised(node, file)
        yield Leave("throw" if isinstance(node, ast.Raise) else "break" if isinstance(node, ast.Break) else "continue")
    else:
        yield from _compound(node, file)


def _raised(node: ast.stmt, file: PythonFile) -> Iterator[Statement]:
    if isinstance(node, ast.Raise) and node.exc is not None:
        yield Do(_expression(node.exc, file), file.place(node))


def _inner_function(node: ast.FunctionDef | ast.AsyncFunctionDef, file: PythonFile) -> Statement:
    """Return what gives a name an inner function, with what wraps it."""
    place = file.place(node)
    made: Expression = Closure(Function(node.name, _parameters(node.args, file), _block(node.body, file), place))
    for each in reversed(node.decorator_list):
        made = Call(_expression(each, file), (made,), (), (), place)
    return Assign(Name(node.name), made, place, declares=True)


def _inner_class(node: ast.ClassDef, file: PythonFile) -> Statement:
    """Return what gives a name an inner class: it is not followed, and may change what it mentions."""
    own = {each.arg for each in ast.walk(node) if isinstance(each, ast.arg)}
    mentioned = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)} - own
    names = tuple(_name(ast.Name(each), file) for each in sorted(mentioned))
    made = Call(Name(f"class {node.name}"), names, (), (), file.place(node))
    return Assign(Name(node.name), made, file.place(node), declares=True)


def _compound(node: ast.stmt, file: PythonFile) -> Iterator[Statement]:
    place = file.place(node)
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        yield _inner_function(node, file)
    elif isinstance(node, ast.ClassDef):
        yield _inner_class(node, file)
    elif isinstance(node, ast.Assert):
        yield Do(_expression(node.test, file), place)
    elif isinstance(node, ast.Delete):
        members = [each for each in node.targets if isinstance(each, ast.Attribute)]
        yield from (Assign(_target(each, file), NotFollowed("del"), place) for each in members)
    else:
        yield from _block_of(node, file)


def _block_of(node: ast.stmt, file: PythonFile) -> Iterator[Statement]:
    place = file.place(node)
    if isinstance(node, ast.If):
        yield If(_expression(node.test, file), _block(node.body, file), _block(node.orelse, file), place)
    elif isinstance(node, (ast.For, ast.AsyncFor)):
        names = tuple(each.id for each in ast.walk(node.target) if isinstance(each, ast.Name))
        yield Loop(names, _expression(node.iter, file), _block(node.body, file), place)
        yield from _otherwise(node, file)
    elif isinstance(node, ast.While):
        test = Do(_expression(node.test, file), place)
        yield Loop((), None, (*_block(node.body, file), test), place)
        yield from _otherwise(node, file)
    elif isinstance(node, _TRIES):
        handlers = tuple(_block(each.body, file) for each in node.handlers)
        yield Try(_block([*node.body, *node.orelse], file), handlers, place)
        yield from _block(node.finalbody, file)
    elif isinstance(node, ast.Match):
        yield from _cases(node, file)
    elif isinstance(node, (ast.With, ast.AsyncWith)):
        yield from _with(node, file)


def _otherwise(node: ast.For | ast.AsyncFor | ast.While, file: PythonFile) -> Iterator[Statement]:
    """Yield what a loop does where no `break` ends it."""
    if node.orelse:
        yield If(NotFollowed("else"), _block(node.orelse, file), (), file.place(node))


def _cases(node: ast.Match, file: PythonFile) -> Iterator[Statement]:
    """Yield the cases of a `match` as decisions one after the other."""
    subject = _expression(node.subject, file)
    if not isinstance(subject, Name):
        yield Assign(Name(_unpacked(node)), subject, file.place(node), declares=True)
        subject = Name(_unpacked(node))
    rest: tuple[Statement, ...] = ()
    for each in reversed(node.cases):
        body, pattern = _block(each.body, file), each.pattern
        if isinstance(pattern, ast.MatchAs) and pattern.pattern is None and each.guard is None:
            named = (Assign(Name(pattern.name), subject, file.place(pattern)),) if pattern.name else ()
            rest = (*named, *body)
            continue
        test: Expression = NotFollowed("case")
        if isinstance(pattern, ast.MatchValue) and each.guard is None:
            test = Operation("==", (subject, _expression(pattern.value, file)))
        elif each.guard is not None:
            test = NotFollowed("case", (_expression(each.guard, file),))
        names = [getattr(part, "name", None) for part in ast.walk(pattern)]
        bound = tuple(
            Assign(Name(name), NotFollowed("case", (subject,)), file.place(pattern)) for name in names if name
        )
        rest = (If(test, (*bound, *body), rest, file.place(pattern)),)
    yield from rest


def _with(node: ast.With | ast.AsyncWith, file: PythonFile) -> Iterator[Statement]:
    place, left = file.place(node), []
    for each in node.items:
        manager = Name(f"{_unpacked(each.context_expr)} manager")
        yield Assign(manager, _expression(each.context_expr, file), place, declares=True)
        entered = Call(Name(ENTER), (manager,), (), (), place)
        if each.optional_vars is not None:
            yield from _assign(each.optional_vars, entered, place, file)
        else:
            yield Do(entered, place)
        left.append(Do(Call(Name(LEAVE), (manager,), (), (), place), place))
    yield from _block(node.body, file)
    yield from reversed(left)


def _unpacked(node: ast.expr | ast.Match) -> str:
    """Return a name for a value that a statement uses several times: none of the program's."""
    return f"#{node.lineno}:{node.col_offset}"


def _assign(target: ast.expr, value: Expression, place: Place, file: PythonFile) -> Iterator[Statement]:
    if not isinstance(target, (ast.Tuple, ast.List)):
        shared = isinstance(target, ast.Name) and target.id in file.shared
        yield Assign(_target(target, file), NotFollowed("nonlocal") if shared else value, place)
        return
    starred = any(isinstance(each, ast.Starred) for each in target.elts)
    paired = isinstance(value, Items) and len(value.items) == len(target.elts) and not starred
    if isinstance(value, Items) and paired and not _crossed(value.items):
        for each, one in zip(target.elts, value.items, strict=True):
            yield from _assign(each, one, place, file)
        return
    if not isinstance(value, (Name, Attribute, Element)):
        yield Assign(Name(_unpacked(target)), value, place, declares=True)
        value = Name(_unpacked(target))
    for index, each in enumerate(target.elts):
        plain = each.value if isinstance(each, ast.Starred) else each
        given = NotFollowed("an unpacked value", (value,)) if starred else Element(value, Literal(index))
        yield from _assign(plain, given, place, file)


def _crossed(items: tuple[Expression, ...]) -> bool:
    """Whether values may mean what one of several targets before them sets: ``a, b = b, a``."""
    return any(isinstance(each, (Name, Attribute, Element)) for each in items[1:])


def _target(node: ast.expr, file: PythonFile) -> Expression:
    if isinstance(node, ast.Attribute):
        return Attribute(_expression(node.value, file), node.attr)
    return Name(node.id) if isinstance(node, ast.Name) and node.id != file.this else _expression(node, file)


# Expressions


def _expression(node: ast.expr, file: PythonFile) -> Expression:
    if file.depth > DEEPEST:
        return NotFollowed("a deep expression")
    file.depth += 1
    try:
        reader = _READERS.get(type(node))
        if reader is not None:
            return reader(node, file)
        parts = tuple(_expression(each, file) for each in ast.iter_child_nodes(node) if isinstance(each, ast.expr))
        return NotFollowed(" ".join(ast.unparse(node).split())[:60], parts)
    finally:
        file.depth -= 1


def _name(node: ast.Name, file: PythonFile) -> Expression:
    if node.id == file.this and file.this:
        return Name(THIS)
    return Name(file.imported.get(node.id, node.id))


def _attribute(node: ast.Attribute, file: PythonFile) -> Expression:
    of = _expression(node.value, file)
    root: ast.expr = node.value
    while isinstance(root, ast.Attribute):
        root = root.value
    if isinstance(of, Name) and isinstance(root, ast.Name) and root.id in file.imported and root.id != file.this:
        return Name(f"{of.text}.{node.attr}")
    return Attribute(of, node.attr)


def _call(node: ast.Call, file: PythonFile) -> Expression:
    place = file.place(node)
    function = _expression(node.func, file)
    arguments = tuple(
        NotFollowed("*", (_expression(each.value, file),)) if isinstance(each, ast.Starred) else _expression(each, file)
        for each in node.args
    )
    keywords = tuple((each.arg or "**", _expression(each.value, file)) for each in node.keywords)
    if last_part(call_name(Call(function, (), (), (), place))) == "__init__":
        if isinstance(function, Attribute) and function.of == Name(SUPER):
            return Call(Name("super"), arguments, keywords, (), place)
        if arguments[:1] == (Name(THIS),):
            return Call(Name("super"), arguments[1:], keywords, (), place)
    if function == Name("super"):
        return Name(SUPER)
    return Call(function, arguments, keywords, (), place)


def _constant(node: ast.Constant, file: PythonFile) -> Expression:
    del file
    plain = node.value is None or isinstance(node.value, (str, int, float, bool))
    return Literal(node.value) if plain else NotFollowed(repr(node.value)[:60])


def _text(node: ast.JoinedStr, file: PythonFile) -> Expression:
    found: list[Expression] = []
    for each in node.values:
        if isinstance(each, ast.FormattedValue):
            plain = each.conversion == -1 and each.format_spec is None
            inner = _expression(each.value, file)
            found.append(inner if plain else NotFollowed("a formatted value", (inner,)))
        else:
            found.append(_expression(each, file))
    return Operation(JOIN, tuple(found))


def _compared(node: ast.Compare, file: PythonFile) -> Expression:
    if len(node.ops) > 1:
        parts = tuple(_expression(each, file) for each in (node.left, *node.comparators))
        return NotFollowed(" ".join(ast.unparse(node).split())[:60], parts)
    sides = (_expression(node.left, file), _expression(node.comparators[0], file))
    return Operation(_OPERATORS.get(type(node.ops[0]), "?"), sides)


def _binary(node: ast.BinOp, file: PythonFile) -> Expression:
    return Operation(_OPERATORS.get(type(node.op), "?"), (_expression(node.left, file), _expression(node.right, file)))


def _boolean(node: ast.BoolOp, file: PythonFile) -> Expression:
    found = _expression(node.values[0], file)
    for each in node.values[1:]:
        found = Operation(_OPERATORS[type(node.op)], (found, _expression(each, file)))
    return found


def _unary(node: ast.UnaryOp, file: PythonFile) -> Expression:
    inner = _expression(node.operand, file)
    if isinstance(node.op, ast.USub) and isinstance(inner, Literal) and isinstance(inner.value, (int, float)):
        return Literal(-inner.value)
    return Operation(_OPERATORS.get(type(node.op), "?"), (inner,))


def _conditional(node: ast.IfExp, file: PythonFile) -> Expression:
    return Conditional(_expression(node.test, file), _expression(node.body, file), _expression(node.orelse, file))


def _items(node: Any, file: PythonFile) -> Expression:
    return Items(tuple(_expression(each, file) for each in node.elts))


def _pairs(node: ast.Dict, file: PythonFile) -> Expression:
    if any(each is None for each in node.keys):
        parts = tuple(_expression(each, file) for each in (*node.keys, *node.values) if each is not None)
        return NotFollowed("a dictionary of others", parts)
    keys = [each for each in node.keys if each is not None]
    return Pairs(tuple((_expression(k, file), _expression(v, file)) for k, v in zip(keys, node.values, strict=True)))


def _element(node: ast.Subscript, file: PythonFile) -> Expression:
    return Element(_expression(node.value, file), _expression(node.slice, file))


def _lambda(node: ast.Lambda, file: PythonFile) -> Expression:
    place = file.place(node)
    body = (Return(_expression(node.body, file), place),)
    return Closure(Function("lambda", _parameters(node.args, file), body, place))


def _named(node: ast.NamedExpr, file: PythonFile) -> Expression:
    value = _expression(node.value, file)
    same = isinstance(value, (Name, Attribute))  # another name of one object
    given = value if same else NotFollowed(" ".join(ast.unparse(node).split())[:60], (value,))
    file.pending.append(Assign(Name(node.target.id), given, file.place(node)))
    return value if same else Name(node.target.id)


def _comprehension(node: Any, file: PythonFile) -> Expression:
    """Return what makes a list or dictionary of another one: a call of a lambda with each of its elements."""
    parts = (node.key, node.value) if isinstance(node, ast.DictComp) else (node.elt,)
    made = tuple(_expression(each, file) for each in parts)
    place = file.place(node)
    for each in reversed(node.generators):
        if each.ifs:
            made = (
                NotFollowed("a comprehension with conditions", (*(_expression(one, file) for one in each.ifs), *made)),
            )
        targets = tuple(Variable(one.id) for one in ast.walk(each.target) if isinstance(one, ast.Name))
        body = (Return(made[0] if len(made) == 1 else Items(made), place),)
        kind = PAIRS if len(made) > 1 else EACH
        call = Call(
            Name(kind), (Closure(Function("lambda", targets, body, place)), _expression(each.iter, file)), (), (), place
        )
        made = (NotFollowed("a comprehension of several loops", (call,)),)
    return call


def _yielded(node: ast.Yield | ast.YieldFrom, file: PythonFile) -> Expression:
    return Call(Name(YIELD), () if node.value is None else (_expression(node.value, file),), (), (), file.place(node))


_READERS: Final[dict[type[ast.expr], Callable[[Any, PythonFile], Expression]]] = {
    ast.Name: _name,
    ast.Attribute: _attribute,
    ast.Call: _call,
    ast.Constant: _constant,
    ast.JoinedStr: _text,
    ast.Compare: _compared,
    ast.BinOp: _binary,
    ast.BoolOp: _boolean,
    ast.UnaryOp: _unary,
    ast.IfExp: _conditional,
    ast.List: _items,
    ast.Tuple: _items,
    ast.Set: _items,
    ast.Dict: _pairs,
    ast.Subscript: _element,
    ast.Lambda: _lambda,
    ast.NamedExpr: _named,
    ast.ListComp: _comprehension,
    ast.SetComp: _comprehension,
    ast.GeneratorExp: _comprehension,
    ast.DictComp: _comprehension,
    ast.Yield: _yielded,
    ast.YieldFrom: _yielded,
}
