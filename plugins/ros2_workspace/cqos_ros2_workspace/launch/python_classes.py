"""Classes of Python launch files that are those of the launch libraries with other arguments: `class Flag(DeclareLaunchArgument)`."""

from __future__ import annotations

import ast
import copy
from typing import TYPE_CHECKING, Any

from cqos_ros2_workspace.launch.python_names import Function, Library

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_ros2_workspace.launch.python_names import Frame


def made_by(node: ast.ClassDef, frame: Frame, value: Callable[[ast.expr], Any]) -> Any:
    """Return what calling a class makes; None where its own methods do more than to pass arguments to the class below.

    Args:
        node: its definition.
        frame: where it is defined.
        value: evaluates the class below.
    """
    body = [each for each in node.body if not isinstance(each, ast.Pass) and not _is_text(each)]
    if len(node.bases) != 1 or node.keywords or node.decorator_list or len(body) > 1:
        return None
    base = value(node.bases[0])
    if not isinstance(base, (Library, Function)):
        return None
    return _constructor(body[0], node, frame) if body else base


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _constructor(init: ast.stmt, node: ast.ClassDef, frame: Frame) -> Function | None:
    """Return `__init__` as a function that returns an object of the class below, where it ends with making one."""
    if not isinstance(init, ast.FunctionDef) or init.name != "__init__" or not init.args.args:
        return None
    last = init.body[-1]
    call = last.value if isinstance(last, ast.Expr) else None
    if not isinstance(call, ast.Call) or ast.unparse(call.func) != "super().__init__":
        return None
    made = copy.deepcopy(init)
    made.name, made.args.args = node.name, made.args.args[1:]
    made.args.defaults = made.args.defaults[-len(made.args.args) :] if made.args.args else []
    below = ast.copy_location(ast.Call(node.bases[0], call.args, call.keywords), call)
    made.body[-1] = ast.copy_location(ast.Return(below), last)
    return Function(made, frame)
