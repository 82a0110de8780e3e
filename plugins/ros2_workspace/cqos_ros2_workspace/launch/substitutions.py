"""What substitutions stand for where a launch runs: texts, as far as the files decide them."""

from __future__ import annotations

import ast
import posixpath
import re
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_workspace.launch.entities import Action, Sub
from cqos_ros2_workspace.launch.launch_result import MadeFile
from cqos_ros2_workspace.launch.python_calls import PACKAGE_PREFIX, PACKAGE_SHARE, join_path
from cqos_ros2_workspace.launch.python_expressions import value_of
from cqos_ros2_workspace.launch.python_names import FileText, Frame, TooMuchError
from cqos_ros2_workspace.launch.values import (
    Either,
    Joined,
    Unknown,
    When,
    either,
    first_unknown,
    join,
    lift,
    shown,
    undecided,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.launch.launch_evaluation import Launch
    from cqos_ros2_workspace.launch.values import Text

TRUE: Final = frozenset(("true", "1"))
FALSE: Final = frozenset(("false", "0"))
_LONGEST_EXPRESSION: Final = 5_000
_HOLE: Final = re.compile(r"not_known_(\d+)_")


def perform(value: Any, here: Launch) -> Text:
    """Return the text of a substitution, or of a list of them, here and now."""
    here.walk.step()
    if isinstance(value, str) or value is None:
        return value or ""
    if isinstance(value, (Unknown, Joined)):
        return value
    if isinstance(value, Either):
        return either((guards, perform(each, here)) for guards, each in value.cases)  # type: ignore[no-any-return]
    if isinstance(value, When):
        return perform(value.value, here)
    if isinstance(value, (list, tuple)):
        return join([perform(each, here) for each in value])
    if isinstance(value, Sub):
        return _KINDS[value.kind](value, here)
    if isinstance(value, (bool, int, float)):
        return str(value)
    if isinstance(value, Action) and value.kind in {"ParameterFile", "ParameterValue"}:
        return perform(value.fields.get("param_file", value.fields.get("value")), here)
    what = f"the content of `{shown(perform(value.path, here))}`" if isinstance(value, FileText) else "an object"
    return Unknown(f"{what} stands where a text is expected", getattr(value, "place", None))


def condition(text: Any, place: Place | None) -> Any:
    """Return whether the text of a condition holds; None for a text that is neither true nor false."""

    def judged(each: Any) -> Any:
        if isinstance(each, Unknown):
            return undecided(each.guard("true"))
        if isinstance(each, Joined):
            return undecided(Unknown("", place, shown(each)).guard("true"))
        word = str(each).strip().lower()
        return True if word in TRUE else False if word in FALSE else None

    return lift(judged, text)


def _as_word(value: Any) -> Any:
    """Return a truth value as the text that substitutions make of it."""
    return lift(lambda each: each if isinstance(each, Unknown) else str(bool(each)).lower(), value)


def _configuration(sub: Sub, here: Launch) -> Text:
    def of(name: Any) -> Any:
        if not isinstance(name, str):
            return first_unknown(name)
        found = here.scope.configuration(name)
        if found is not None:
            return found
        if sub.fields.get("default") is not None:
            return perform(sub.fields["default"], here)
        return Unknown(f"the launch argument `{name}` has no value", sub.place, name)

    return lift(of, perform(sub.fields.get("name", sub.fields.get("variable_name")), here))  # type: ignore[no-any-return]


def _flag(sub: Sub, here: Launch) -> Text:
    """Return what nav2_common's ``LaunchConfigAsBool`` makes of an argument."""
    words = {"1", "true", "t", "yes", "y", "on"}
    return lift(lambda each: str(each.lower() in words) if isinstance(each, str) else each, _configuration(sub, here))  # type: ignore[no-any-return]


def _variable(sub: Sub, here: Launch) -> Text:
    name = perform(sub.fields.get("name"), here)
    default = sub.fields.get("default_value")
    given = None if default is None else perform(default, here)
    return lift(lambda each: here.environment(each, given, sub.place) if isinstance(each, str) else each, name)  # type: ignore[no-any-return]


def _found(start: str, field: str) -> Callable[[Sub, Launch], Text]:
    return lambda sub, here: join([start, perform(sub.fields.get(field), here), ")"])


def _equals(sub: Sub, here: Launch) -> Any:
    left, right = perform(sub.fields.get("left"), here), perform(sub.fields.get("right"), here)
    return lift(_equal, left, right)


def _equal(one: Any, other: Any) -> Any:
    if isinstance(one, str) and isinstance(other, str):
        return _meaning(one) == _meaning(other)
    unknown, known = (one, other) if isinstance(other, str) else (other, one)
    if isinstance(unknown, Unknown) and isinstance(known, str):
        return undecided(unknown.guard(known))
    return undecided(Unknown("", None, f"{shown(one)} == {shown(other)}").guard("true"))


def _meaning(text: str) -> Any:
    """Return a text as ``EqualsSubstitution`` compares it: as a truth value or a number where it is one."""
    word = text.strip().lower()
    if word in {"true", "false"}:
        return word
    try:
        return float(word)
    except ValueError:
        return text


def _of_truths(combine: Callable[[list[Any]], Any]) -> Callable[[Sub, Launch], Text]:
    def made(sub: Sub, here: Launch) -> Text:
        names = [name for name in ("left", "right", "value") if name in sub.fields]
        parts = sub.fields.get("*", [sub.fields[name] for name in names])
        held = [condition(perform(each, here), sub.place) for each in parts]
        return _as_word(lift(lambda *values: combine([*map(bool, values)]), *held))  # type: ignore[no-any-return]

    return made


def _if_else(sub: Sub, here: Launch) -> Text:
    held = condition(perform(sub.fields.get("condition"), here), sub.place)
    names = {True: "if_value", False: "else_value"}
    return lift(lambda each: perform(sub.fields.get(names[bool(each)]), here), held)  # type: ignore[no-any-return]


def _path(sub: Sub, here: Launch) -> Text:
    parts = sub.fields.get("substitutions", sub.fields.get("path", []))
    listed = parts if isinstance(parts, (list, tuple)) else [parts]
    return lift(lambda *texts: join_path(texts), *(perform(each, here) for each in listed))  # type: ignore[no-any-return]


def _strings(sub: Sub, here: Launch) -> Text:
    between = perform(sub.fields.get("delimiter"), here)
    parts = [perform(each, here) for each in sub.fields.get("substitutions", [])]
    return join([each for part in parts for each in (between, part)][1:])


def _not_known(what: str, field: str) -> Callable[[Sub, Launch], Text]:
    def made(sub: Sub, here: Launch) -> Text:
        text = shown(perform(sub.fields.get(field), here)) if field else ""
        return Unknown(what.format(text[:80]), sub.place)

    return made


def _made_file(sub: Sub, here: Launch) -> Text:
    """Return the path of a file that ``RewrittenYaml`` or ``ReplaceString`` of nav2_common makes."""

    def texts(name: str) -> dict[str, Any]:
        stated = sub.fields.get(name) or {}
        return {str(key): perform(value, here) for key, value in stated.items()} if isinstance(stated, dict) else {}

    rewrites, replacements = texts("param_rewrites"), texts("replacements")
    root = perform(sub.fields.get("root_key"), here)
    values = texts("value_rewrites")

    def made(path: Any) -> Any:
        if not isinstance(path, str):
            return path
        file = MadeFile(path, rewrites, root, replacements, values)
        file.cause = "`key_rewrites` is not followed" if sub.fields.get("key_rewrites") else ""
        return file

    return lift(made, perform(sub.fields.get("source_file"), here))  # type: ignore[no-any-return]


def _expression(sub: Sub, here: Launch) -> Text:
    text = perform(sub.fields.get("expression"), here)
    return lift(lambda each: _evaluated(each, sub, here), text)  # type: ignore[no-any-return]


def _evaluated(text: Any, sub: Sub, here: Launch) -> Any:
    """Return the text of a Python expression in a substitution: walked as data, with unknown parts as names."""
    parts = text.parts if isinstance(text, Joined) else (text,)
    holes = [part for part in parts if isinstance(part, Unknown)]
    if len(parts) == 1 and holes:
        return holes[0]
    numbers = iter(range(len(holes)))
    source = "".join(part if isinstance(part, str) else f"not_known_{next(numbers)}_" for part in parts)
    what = f"the expression `{shown(text)[:80]}`"
    if len(source) > _LONGEST_EXPRESSION:
        return Unknown(f"{what} is too long", sub.place)
    try:
        tree = ast.parse(source.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return Unknown(f"{what} is no Python", sub.place)
    frame = Frame(sub.place.source)
    body = _Filled(frame, holes).visit(tree.body)
    try:
        found = value_of(body, frame, here.walk)
    except TooMuchError:
        raise
    except RecursionError:
        return Unknown(f"{what} is nested too deep", sub.place)
    return lift(lambda each: _result(each, what, sub), found)


class _Filled(ast.NodeTransformer):
    """Replaces holes, and texts with holes, by names that people can read, and gives these their values."""

    def __init__(self, frame: Frame, holes: list[Unknown]) -> None:
        self.frame, self.holes = frame, holes

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Rename a hole."""
        found = _HOLE.fullmatch(node.id)
        return self.named(node, [self.holes[int(found[1])]]) if found else node

    def named(self, node: ast.expr, parts: list[Any]) -> ast.expr:
        """Return the name that stands for parts that are not all known."""
        name = "".join(part if isinstance(part, str) else part.name for part in parts)
        self.frame.names[name] = join(parts)
        return ast.copy_location(ast.Name(name, ast.Load()), node)

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        """Replace a text with holes."""
        if not isinstance(node.value, str) or not _HOLE.search(node.value):
            return node
        pieces = _HOLE.split(node.value)
        parts: list[Any] = [self.holes[int(piece)] if number % 2 else piece for number, piece in enumerate(pieces)]
        return self.named(node, parts)


def _result(value: Any, what: str, sub: Sub) -> Any:
    if isinstance(value, (str, bool, int, float)) or value is None:
        return str(value)
    if isinstance(value, Joined):
        return value
    if isinstance(value, Unknown):
        return Unknown(f"{what} is not decided: {value.cause}", sub.place, value.subject)
    return Unknown(f"{what} makes no text", sub.place)


_KINDS: Final[dict[str, Callable[[Sub, Launch], Text]]] = {
    "AllSubstitution": _of_truths(all),
    "AndSubstitution": _of_truths(all),
    "AnonName": lambda sub, here: join(
        [perform(sub.fields.get("name"), here), Unknown("an anonymous name is made at each start", sub.place)]
    ),
    "AnySubstitution": _of_truths(any),
    "Command": _not_known("the output of the command `{}` is not known", "command"),
    "EnvironmentVariable": _variable,
    "EqualsSubstitution": lambda sub, here: _as_word(_equals(sub, here)),
    "ExecutableInPackage": lambda sub, here: join(
        [
            "$(exec-in-pkg ",
            perform(sub.fields.get("executable"), here),
            " ",
            perform(sub.fields.get("package"), here),
            ")",
        ]
    ),
    "FileContent": _not_known("the content of the file `{}` is not read", "path"),
    "FindExecutable": _found("$(find-exec ", "name"),
    "FindPackage": _found(PACKAGE_PREFIX, "package"),
    "FindPackagePrefix": _found(PACKAGE_PREFIX, "package"),
    "FindPackageShare": _found(PACKAGE_SHARE, "package"),
    "IfElseSubstitution": _if_else,
    "LaunchConfigAsBool": _flag,
    "LaunchConfiguration": _configuration,
    "LaunchLogDir": _not_known("the folder of logs is made at each start", ""),
    "LocalSubstitution": _not_known("what `{}` is depends on an event", "expression"),
    "NotEqualsSubstitution": lambda sub, here: _as_word(lift(lambda each: not each, _equals(sub, here))),
    "NotSubstitution": _of_truths(lambda values: not all(values)),
    "OrSubstitution": _of_truths(any),
    "PathJoinSubstitution": _path,
    "PathSubstitution": _path,
    "PythonExpression": _expression,
    "ReplaceString": _made_file,
    "RewrittenYaml": _made_file,
    "StringJoinSubstitution": _strings,
    "TextSubstitution": lambda sub, here: perform(sub.fields.get("text"), here),
    "ThisLaunchFile": lambda _sub, here: here.file,
    "ThisLaunchFileDir": lambda _sub, here: posixpath.dirname(here.file),
}
