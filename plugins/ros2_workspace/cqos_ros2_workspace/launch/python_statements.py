"""Statements of Python launch files, walked in order; a branch that nothing decides is walked under its guards."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

from cqos_ros2_workspace.launch.entities import POSITIONAL, SUBSTITUTIONS
from cqos_ros2_workspace.launch.python_classes import made_by
from cqos_ros2_workspace.launch.python_expressions import bind, truth, value_of
from cqos_ros2_workspace.launch.python_names import (
    DEEPEST_CALL,
    DEEPEST_EXPRESSION,
    Frame,
    Function,
    Library,
    ModuleValue,
    Walk,
    written,
)
from cqos_ros2_workspace.launch.values import Either, Unknown, When, either, first_unknown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_ros2_workspace.launch.values import Guards

_MOST_ROUNDS: Final = 1_000
_DEEPEST_BLOCK: Final = 30
_LIBRARIES: Final = frozenset(("launch", "launch_ros", "nav2_common"))
"""Packages whose objects are known here, also where the workspace has their sources."""
_ADDING: Final = frozenset(("append", "extend", "insert", "add_action", "add_entity"))
Flow: TypeAlias = Literal["", "return", "break", "continue"]


class _Returns(list["tuple[Guards, Any]"]):
    """What a call returned so far, each under the guards of its return."""


def run_module(path: str, tree: ast.Module, walk: Walk) -> Frame:
    """Walk the body of a module and return its names."""
    frame = Frame(path)
    _run(tree.body, frame, walk, _Returns())
    return frame


def call_function(walk: Walk, function: Function, arguments: Sequence[Any], named: dict[str, Any]) -> Any:
    """Return what a function of a file returns."""
    node, outer = function.node, function.frame
    given, named = [*function.bound, *arguments], {**dict(function.named), **named}
    name = getattr(node, "name", "lambda")
    if walk.calls >= DEEPEST_CALL:
        return outer.unknown(f"`{name}` calls itself or others too deep", node)
    frame = Frame(outer.path, outer=outer)
    refused = _bind_arguments(node, given, named, frame, walk)
    if refused is not None:
        return refused
    depth, walk.depth = walk.depth, 0
    walk.calls += 1
    try:
        if isinstance(node, ast.Lambda):
            return value_of(node.body, frame, walk)
        returns = _Returns()
        guards = len(walk.guards)
        ended = _run(node.body, frame, walk, returns)
        outside = tuple(walk.guards[:guards])
        found = [(tuple(g for g in each if g not in outside), value) for each, value in returns]
        if not ended:
            found.append((tuple(walk.guards[guards:]), None))
        del walk.guards[guards:]
        return either(found)
    finally:
        walk.calls -= 1
        walk.depth = depth


def _bind_arguments(
    node: ast.FunctionDef | ast.Lambda, given: list[Any], named: dict[str, Any], frame: Frame, walk: Walk
) -> Unknown | None:
    """Give a call's arguments to the names of a function; return why that is not possible."""
    spec = node.args
    positional = [each.arg for each in (*spec.posonlyargs, *spec.args)]
    names = frame.names
    defaults = zip(reversed(positional), reversed(spec.defaults), strict=False)
    for name, default in (*defaults, *zip((each.arg for each in spec.kwonlyargs), spec.kw_defaults, strict=True)):
        if default is not None:
            names[name] = value_of(default, frame.outer or frame, walk)
    names |= dict(zip(positional, given, strict=False))
    known = {*positional, *(each.arg for each in spec.kwonlyargs)}
    names |= {name: value for name, value in named.items() if name in known}
    if spec.vararg is not None:
        names[spec.vararg.arg] = tuple(given[len(positional) :])
    if spec.kwarg is not None:
        names[spec.kwarg.arg] = {name: value for name, value in named.items() if name not in known}
    missing = [name for name in known if name not in names]
    if missing:
        what = f"`{getattr(node, 'name', 'lambda')}` is called without `{missing[0]}`"
        return first_unknown(named.get("**")) or frame.unknown(what, node)
    return None


def _run(body: Sequence[ast.stmt], frame: Frame, walk: Walk, returns: _Returns) -> Flow:
    """Walk statements until one leaves the block; return how it is left."""
    for statement in body:
        walk.step()
        walk.depth += 1
        try:
            flow = _statement(statement, frame, walk, returns)
        finally:
            walk.depth -= 1
        if flow:
            return flow
    return ""


def _statement(node: ast.stmt, frame: Frame, walk: Walk, returns: _Returns) -> Flow:  # noqa: C901, PLR0912 - one kind each
    if walk.depth > _DEEPEST_BLOCK + DEEPEST_EXPRESSION:
        _forget([node], frame, walk)
    elif isinstance(node, ast.Assign):
        value = value_of(node.value, frame, walk)
        for target in node.targets:
            bind(target, value, frame, walk)
    elif isinstance(node, ast.AnnAssign):
        if node.value is not None:
            bind(node.target, value_of(node.value, frame, walk), frame, walk)
    elif isinstance(node, ast.AugAssign):
        _augment(node, frame, walk)
    elif isinstance(node, ast.Expr):
        value_of(node.value, frame, walk)
    elif isinstance(node, ast.If):
        return _branch(node, frame, walk, returns)
    elif isinstance(node, ast.For):
        return _loop(node, frame, walk, returns)
    elif isinstance(node, ast.With):
        for item in node.items:
            if item.optional_vars is not None:
                bind(item.optional_vars, value_of(item.context_expr, frame, walk), frame, walk)
        return _run(node.body, frame, walk, returns)
    elif isinstance(node, ast.Try):
        return _try(node, frame, walk, returns)
    elif isinstance(node, ast.Return):
        value = None if node.value is None else value_of(node.value, frame, walk)
        returns.append((tuple(walk.guards), value))
        return "return"
    elif isinstance(node, ast.Raise):
        return "return"
    elif isinstance(node, (ast.Break, ast.Continue)):
        return "break" if isinstance(node, ast.Break) else "continue"
    elif isinstance(node, (ast.Import, ast.ImportFrom)):
        _import(node, frame, walk)
    elif isinstance(node, ast.FunctionDef):
        frame.names[node.name] = Function(node, frame)
    elif isinstance(node, ast.ClassDef) and (made := made_by(node, frame, lambda each: value_of(each, frame, walk))):
        frame.names[node.name] = made
    elif not isinstance(node, (ast.Pass, ast.Assert, ast.Global, ast.Nonlocal)):
        _forget([node], frame, walk)
    return ""


def _augment(node: ast.AugAssign, frame: Frame, walk: Walk) -> None:
    target = node.target
    if isinstance(target, ast.Name) and isinstance(frame.find(target.id), list) and isinstance(node.op, ast.Add):
        more = value_of(node.value, frame, walk)
        guards = tuple(walk.guards)
        members = more if isinstance(more, (list, tuple)) else [first_unknown(more) or frame.unknown("a list", node)]
        frame.find(target.id).extend([When(guards, each) if guards else each for each in members])
        return
    read = ast.copy_location(ast.BinOp(_loaded(target), node.op, node.value), node)
    bind(target, value_of(read, frame, walk), frame, walk)


def _loaded(target: ast.expr) -> ast.expr:
    """Return a target as the expression that reads it."""
    if isinstance(target, ast.Name):
        return ast.copy_location(ast.Name(target.id, ast.Load()), target)
    if isinstance(target, ast.Subscript):
        return ast.copy_location(ast.Subscript(target.value, target.slice, ast.Load()), target)
    return target


def _branch(node: ast.If, frame: Frame, walk: Walk, returns: _Returns) -> Flow:
    if _is_main(node.test):
        return ""
    held = truth(value_of(node.test, frame, walk))
    if isinstance(held, bool):
        return _run(node.body if held else node.orelse, frame, walk, returns)
    if not isinstance(held, Either):
        _forget([node], frame, walk)
        return ""
    stays: list[Guards] = []
    flows: set[Flow] = set()
    for guards, each in held.cases:
        start = len(walk.guards)
        walk.guards += guards
        flow = _run(node.body if each else node.orelse, frame, walk, returns)
        del walk.guards[start:]
        flows.add(flow)
        if not flow:
            stays.append(guards)
    if len(flows) == 1 and "" not in flows:
        return flows.pop()
    if len(flows) > 1:
        # What follows is only reached where no branch that leaves was taken.
        here = Unknown("", frame.place(node), f"{written(node.test)} ({frame.path.rpartition('/')[2]}:{node.lineno})")
        walk.guards += stays[0] if len(stays) == 1 else (here.guard("true").negated(),)
    return ""


def _is_main(test: ast.expr) -> bool:
    return isinstance(test, ast.Compare) and isinstance(test.left, ast.Name) and test.left.id == "__name__"


def _loop(node: ast.For, frame: Frame, walk: Walk, returns: _Returns) -> Flow:
    members = value_of(node.iter, frame, walk)
    if isinstance(members, dict):
        members = list(members)
    if not isinstance(members, (list, tuple)) or len(members) > _MOST_ROUNDS:
        _forget([node], frame, walk, first_unknown(members))
        return ""
    start = len(walk.guards)
    for member in members:
        guards: Guards = member.guards if isinstance(member, When) else ()
        walk.guards += guards
        bind(node.target, member.value if isinstance(member, When) else member, frame, walk)
        flow = _run(node.body, frame, walk, returns)
        del walk.guards[start:]
        if flow == "return":
            return flow
        if flow == "break":
            return ""
    return _run(node.orelse, frame, walk, returns)


def _try(node: ast.Try, frame: Frame, walk: Walk, returns: _Returns) -> Flow:
    flow = _run([*node.body, *node.orelse], frame, walk, returns)
    assigned = _assigned(node.body)
    for handler in node.handlers:
        for name in _assigned(handler.body) - assigned:
            frame.names.setdefault(name, frame.unknown(f"`{name}` is set where an error occurs", handler))
    return _run(node.finalbody, frame, walk, returns) or flow


def _import(node: ast.Import | ast.ImportFrom, frame: Frame, walk: Walk) -> None:
    if isinstance(node, ast.Import):
        for alias in node.names:
            name = alias.asname or alias.name.partition(".")[0]
            library = Library(alias.name if alias.asname else name)
            frame.names[name] = library if "." in alias.name else _module(alias.name, node, frame, walk) or library
        return
    name = node.module or ""
    module = _module(name, node, frame, walk)
    for alias in node.names:
        if alias.name == "*":
            _import_all(name, module, frame)
        elif isinstance(module, ModuleValue):
            missing = frame.unknown(f"`{name}` has no `{alias.name}`", node)
            frame.names[alias.asname or alias.name] = module.frame.names.get(alias.name, missing)
        else:
            frame.names[alias.asname or alias.name] = module or Library(f"{name}.{alias.name}")


def _import_all(name: str, module: ModuleValue | Unknown | None, frame: Frame) -> None:
    """Bind what `from name import *` brings."""
    if isinstance(module, ModuleValue):
        frame.names.update((each, value) for each, value in module.frame.names.items() if not each.startswith("_"))
    elif name.partition(".")[0] in _LIBRARIES:
        # The tables do not say which module of launch has a class, so names that are bound already stay.
        for each in (*POSITIONAL, *SUBSTITUTIONS):
            frame.names.setdefault(each, Library(f"{name}.{each}"))


def _module(name: str, node: ast.stmt, frame: Frame, walk: Walk) -> ModuleValue | Unknown | None:
    """Return a module of the workspace; None for one that it does not have."""
    path = None if name.partition(".")[0] in _LIBRARIES else walk.launch.workspace.module(name, frame.path)
    if path is None:
        return None
    if walk.calls >= DEEPEST_CALL:
        return frame.unknown(f"`{name}` imports others too deep", node)
    tree = parsed(path, walk.launch.read(path, frame.place(node)))
    if isinstance(tree, Unknown):
        return tree
    walk.calls += 1
    found = run_module(path, tree, walk)
    walk.calls -= 1
    return ModuleValue(found)


def parsed(path: str, data: bytes | Unknown) -> ast.Module | Unknown:
    """Return the syntax tree of a file; unknown with the cause where it is no Python."""
    from cqos_core.model.settings import Place

    if isinstance(data, Unknown):
        return data
    try:
        return ast.parse(data, path)
    except SyntaxError as error:
        return Unknown(f"this is not Python: {error.msg}", Place(path, error.lineno, error.offset))
    except (ValueError, RecursionError, MemoryError) as error:
        return Unknown(f"this is not Python: {str(error) or 'it is nested too deep'}", Place(path, 1, 1))


def _assigned(body: Sequence[ast.stmt]) -> set[str]:
    found = set()
    for statement in body:
        for each in ast.walk(statement):
            if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store):
                found.add(each.id)
            elif isinstance(each, (ast.FunctionDef, ast.ClassDef, ast.AsyncFunctionDef)):
                found.add(each.name)
    return found


def _forget(body: Sequence[ast.stmt], frame: Frame, walk: Walk, cause: Unknown | None = None) -> None:
    """Make unknown what statements that are not followed may change: the names they set, and the lists they add to."""
    why = cause or frame.unknown(f"`{written(body[0], 40)}` is not followed", body[0])
    for name in _assigned(body):
        frame.names[name] = why
    for statement in body:
        for each in ast.walk(statement):
            if isinstance(each, ast.Attribute) and each.attr in _ADDING and isinstance(each.value, ast.Name):
                members = frame.find(each.value.id)
                members = members.fields.setdefault("entities", []) if hasattr(members, "fields") else members
                if isinstance(members, list):
                    members.append(When(tuple(walk.guards), why))
