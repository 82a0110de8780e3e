"""What names stand for while a Python launch file is walked: library objects, functions of the file, frames, limits."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.settings import Place
from cqos_ros2_workspace.launch.values import Guard, Unknown, first_unknown

if TYPE_CHECKING:
    from cqos_ros2_workspace.launch.launch_evaluation import Launch

MOST_STEPS: Final = 200_000
"""How many expressions and statements of Python are walked for one entry point."""
DEEPEST_CALL: Final = 12
DEEPEST_EXPRESSION: Final = 40
MISSING: Final = object()


class TooMuchError(Exception):
    """The walk takes more steps than it may."""


@dataclass(frozen=True, slots=True)
class Library:
    """An object of a library, by its dotted name: ``launch_ros.actions.Node``."""

    name: str

    @property
    def last(self) -> str:
        """The name without its module."""
        return self.name.rpartition(".")[2]


@dataclass(frozen=True, slots=True, eq=False)
class ModuleValue:
    """A module of the workspace, by the names that its file defines."""

    frame: Frame


class PathText(str):
    """A text that is a `pathlib.Path`."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class FileText:
    """The content of a file, which is read only where something asks for a part of it."""

    path: Any


class ContextValue:
    """The launch context that an ``OpaqueFunction`` is given."""


class ConfigurationsValue:
    """The launch configurations of a context."""


@dataclass(frozen=True, slots=True, eq=False)
class Function:
    """A function of a file that is walked.

    Attributes:
        node: its definition.
        frame: where it is defined.
        bound: arguments that stand before those of a call, of `functools.partial`.
    """

    node: ast.FunctionDef | ast.Lambda
    frame: Frame
    bound: tuple[Any, ...] = ()
    named: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Method:
    """A method of a value, before it is called."""

    of: Any
    name: str


@dataclass(slots=True)
class Walk:
    """One walk: its limits, the guards that hold where it is, and the launch that it belongs to.

    Attributes:
        call: calls a function of a file; the statements provide it.
    """

    launch: Launch
    call: Callable[[Walk, Function, Sequence[Any], dict[str, Any]], Any]
    guards: list[Guard] = field(default_factory=list)
    steps: int = 0
    calls: int = 0
    depth: int = 0

    def step(self) -> None:
        """Count one step.

        Raises:
            TooMuchError: there were too many.
        """
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise TooMuchError


@dataclass(slots=True, eq=False)
class Frame:
    """The names of a module or of a call.

    Attributes:
        path: of the file.
        names: with their values.
        outer: where names that are not here are looked up.
    """

    path: str
    names: dict[str, Any] = field(default_factory=dict)
    outer: Frame | None = None

    def find(self, name: str) -> Any:
        """Return the value of a name, `MISSING` where it has none."""
        frame: Frame | None = self
        while frame is not None:
            if name in frame.names:
                return frame.names[name]
            frame = frame.outer
        return MISSING

    def place(self, node: ast.AST) -> Place:
        """Return where a part of the file stands."""
        return Place(self.path, getattr(node, "lineno", None), getattr(node, "col_offset", -1) + 1 or None)

    def unknown(self, cause: str, node: ast.AST, subject: str = "") -> Unknown:
        """Return a value that is not known, for a cause that stands at a part of the file."""
        return Unknown(cause, self.place(node), subject)

    def not_followed(self, node: ast.AST, *values: Any) -> Unknown:
        """Return the first unknown part of ``values``; where all are known, that C-QoS does not follow a part of the file."""
        return first_unknown(*values) or self.unknown(f"`{written(node)}` is not followed", node)


def written(node: ast.AST, limit: int = 60) -> str:
    """Return a part of the file as text on one line, cut where it is long."""
    text = " ".join(ast.unparse(node).split()) if isinstance(node, (ast.expr, ast.stmt)) else ""
    return text if len(text) <= limit else f"{text[:limit]}…"
