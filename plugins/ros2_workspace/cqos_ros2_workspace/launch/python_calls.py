"""Attributes and calls in Python launch files: objects of the launch libraries as data, and a few functions of Python."""

from __future__ import annotations

import posixpath
import re
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_workspace.launch.entities import POSITIONAL, SUBSTITUTIONS, Action, Sub
from cqos_ros2_workspace.launch.python_names import (
    ConfigurationsValue,
    ContextValue,
    FileText,
    Function,
    Library,
    Method,
    ModuleValue,
    PathText,
    written,
)
from cqos_ros2_workspace.launch.values import Joined, Unknown, When, first_unknown, join, lift

if TYPE_CHECKING:
    import ast
    from collections.abc import Callable, Sequence

    from cqos_ros2_workspace.launch.python_names import Frame, Walk

PACKAGE_SHARE: Final = "$(find-pkg-share "
PACKAGE_PREFIX: Final = "$(find-pkg-prefix "
LARGEST: Final = 10_000
_LONGEST: Final = 1_000_000
_PLAIN_FIELDS: Final = re.compile(r"(?:[^{}]|\{\w*\}|\{\{|\}\})*")
_TEXT_METHODS: Final = frozenset(
    [
        "capitalize",
        "count",
        "endswith",
        "find",
        "isdigit",
        "join",
        "lower",
        "lstrip",
        "removeprefix",
        "removesuffix",
        "replace",
        "rpartition",
        "partition",
        "rsplit",
        "rstrip",
        "split",
        "splitlines",
        "startswith",
        "strip",
        "title",
        "upper",
    ]
)
_LAUNCH: Final = ("launch", "launch_ros", "launch_xml", "launch_yaml", "launch_testing", "nav2_common", "ros2launch")
_SHARE: Final = ["get_package_share_directory", "get_package_share_path", "get_package_share_direcotry"]
_PREFIX: Final = ["get_package_prefix", "get_package_prefix_path"]


def attribute(of: Any, node: ast.Attribute, frame: Frame) -> Any:
    """Return an attribute of a value."""
    name = node.attr
    if isinstance(of, (Unknown, Joined)):
        return of if isinstance(of, Unknown) else Method(of, name)
    if isinstance(of, Library):
        return Library(f"{of.name}.{name}")
    if isinstance(of, ModuleValue):
        cause = frame.unknown(f"the module has no `{name}`", node)
        return of.frame.names.get(name, cause)
    if isinstance(of, PathText) and name in {"parent", "name", "stem", "suffix"}:
        return _path_part(of, name)
    if isinstance(of, ContextValue) and name == "launch_configurations":
        return ConfigurationsValue()
    if isinstance(of, Action) and name in of.fields:
        return of.fields[name]
    if isinstance(of, (str, list, dict, Sub, Action, FileText, ContextValue, ConfigurationsValue)):
        return Method(of, name)
    return frame.not_followed(node)


def _path_part(path: PathText, name: str) -> str:
    folder, last = _folder(path), posixpath.basename(path)
    stem, suffix = posixpath.splitext(last)
    return {"parent": PathText(folder), "name": last, "stem": stem, "suffix": suffix}[name]


def call(function: Any, arguments: list[Any], named: dict[str, Any], node: ast.Call, frame: Frame, walk: Walk) -> Any:
    """Return what a call returns."""
    if isinstance(function, Library):
        return _library(function, arguments, named, node, frame, walk)
    if isinstance(function, Method):
        return _method(function, arguments, named, node, frame, walk)
    if isinstance(function, Function):
        return walk.call(walk, function, arguments, named)
    cause = f"what `{written(node.func)}` returns is not known"
    return function if isinstance(function, Unknown) else frame.unknown(cause, node)


def _library(
    function: Library, arguments: list[Any], named: dict[str, Any], node: ast.Call, frame: Frame, walk: Walk
) -> Any:
    last, top = function.last, function.name.partition(".")[0]
    if top in _LAUNCH and last in POSITIONAL:
        return Action(last, _fields(POSITIONAL[last], arguments, named), frame.place(node))
    if top in _LAUNCH and last in SUBSTITUTIONS:
        return Sub(last, _fields(SUBSTITUTIONS[last], arguments, named), frame.place(node))
    if last in _SHARE or last in _PREFIX:
        return _package(last, arguments, node, frame)
    if last == "perform_substitutions" and len(arguments) == 2:  # noqa: PLR2004 - the context and the text
        return walk.launch.perform(arguments[1])
    known = _FUNCTIONS.get(function.name)
    if known is not None:
        return known(arguments, named, node, frame, walk)
    if top == "builtins":
        return _builtin(last, arguments, node, frame)
    return frame.unknown(f"`{written(node.func)}` of `{top}` is not known", node)


def _fields(positions: Sequence[str], arguments: list[Any], named: dict[str, Any]) -> dict[str, Any]:
    """Return arguments by their names; ``*`` takes all that are left."""
    fields: dict[str, Any] = {}
    for number, value in enumerate(arguments):
        if positions[:1] == ("*",):
            fields.setdefault("*", []).append(value)
        else:
            fields[positions[number] if number < len(positions) else f"#{number}"] = value
    return {**fields, **named}


def _package(last: str, arguments: list[Any], node: ast.Call, frame: Frame) -> Any:
    start = PACKAGE_SHARE if last in _SHARE else PACKAGE_PREFIX
    if not arguments or isinstance(arguments[0], (Sub, Action, list, dict)):
        return frame.unknown(f"`{written(node)}` names no package", node)
    found = join([start, arguments[0], ")"])
    return PathText(found) if isinstance(found, str) and last.endswith("path") else found


# Functions of Python's library


def _folder(path: str) -> str:
    """Return the folder of a path; that of a package's share is not known by name."""
    return f"{path}/.." if path.startswith("$(") and "/" not in path.partition(")")[2] else posixpath.dirname(path)


def _joined_path(arguments: list[Any], _named: Any, node: ast.Call, frame: Frame, _walk: Walk) -> Any:
    return lift(lambda *parts: join_path(parts) if _texts(parts) else frame.not_followed(node, *parts), *arguments)


def join_path(parts: Sequence[Any]) -> Any:
    """Join texts as parts of a path; an absolute part begins anew."""
    if not first_unknown(parts):
        return posixpath.join(*parts) if parts else ""
    found: list[Any] = []
    for part in parts:
        if isinstance(part, str) and part.startswith("/"):
            found = []
        found += ["/", part] if found and not str(found[-1]).endswith("/") else [part]
    return join(found)


def _texts(values: Sequence[Any]) -> bool:
    return all(isinstance(each, (str, Unknown, Joined)) for each in values)


def _of_text(function: Callable[[str], Any]) -> Callable[..., Any]:
    def applied(arguments: list[Any], _named: Any, node: ast.Call, frame: Frame, _walk: Walk) -> Any:
        if not arguments:
            return frame.not_followed(node)
        return lift(
            lambda each: function(each) if isinstance(each, str) else frame.not_followed(node, each), arguments[0]
        )

    return applied


def _path(arguments: list[Any], named: Any, node: ast.Call, frame: Frame, walk: Walk) -> Any:
    return lift(
        lambda each: PathText(each) if isinstance(each, str) else each,
        _joined_path(arguments, named, node, frame, walk),
    )


def _environment(arguments: list[Any], named: dict[str, Any], node: ast.Call, frame: Frame, walk: Walk) -> Any:
    if not arguments or not isinstance(arguments[0], str):
        return frame.not_followed(node, *arguments)
    default = arguments[1] if len(arguments) > 1 else named.get("default")
    return walk.launch.environment(arguments[0], default, frame.place(node))


def _opened(arguments: list[Any], _named: Any, node: ast.Call, frame: Frame, _walk: Walk) -> Any:
    return FileText(arguments[0]) if arguments else frame.unknown(f"`{written(node)}` names no file", node)


def _loaded(arguments: list[Any], _named: Any, node: ast.Call, frame: Frame, walk: Walk) -> Any:
    """Return what a YAML file of the workspace holds."""
    from cqos_ros2_workspace.launch.parameter_files import plain_yaml

    if not arguments or not isinstance(arguments[0], FileText):
        return frame.not_followed(node, *arguments)
    data = walk.launch.read(arguments[0].path, frame.place(node))
    return data if isinstance(data, Unknown) else plain_yaml(data, str(arguments[0].path), frame.place(node))


def _partial(arguments: list[Any], named: dict[str, Any], node: ast.Call, frame: Frame, _walk: Walk) -> Any:
    if arguments and isinstance(arguments[0], Function):
        of = arguments[0]
        return Function(of.node, of.frame, (*of.bound, *arguments[1:]), (*of.named, *named.items()))
    return frame.not_followed(node, *arguments)


_FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "os.path.join": _joined_path,
    "os.makedirs": lambda *_: None,
    "os.path.dirname": _of_text(_folder),
    "os.path.basename": _of_text(posixpath.basename),
    "os.path.abspath": _of_text(lambda path: path),
    "os.path.realpath": _of_text(lambda path: path),
    "os.path.normpath": _of_text(posixpath.normpath),
    "os.path.expanduser": _of_text(lambda path: path),
    "os.environ.get": _environment,
    "os.getenv": _environment,
    "os.remove": lambda *_: None,
    "pathlib.Path": _path,
    "pathlib.PurePath": _path,
    "builtins.open": _opened,
    "yaml.safe_load": _loaded,
    "yaml.load": _loaded,
    "functools.partial": _partial,
    "copy.copy": lambda arguments, *_: _copied(arguments[0]) if arguments else None,
    "copy.deepcopy": lambda arguments, *_: _copied(arguments[0]) if arguments else None,
}


def _copied(value: Any) -> Any:
    if isinstance(value, dict):
        return dict(value)
    return list(value) if isinstance(value, list) else value


def _builtin(name: str, arguments: list[Any], node: ast.Call, frame: Frame) -> Any:
    if name in {"print", "setattr"}:
        return None
    if name == "isinstance" and arguments:
        return frame.unknown(f"`{written(node)}` is not followed", node, written(node))
    if name in {"list", "tuple", "dict", "set"} and not arguments:
        return {} if name == "dict" else () if name == "tuple" else []
    return lift(lambda *values: _applied(name, values, node, frame), *arguments)


def _applied(name: str, values: tuple[Any, ...], node: ast.Call, frame: Frame) -> Any:
    one = values[0] if values else None
    if name == "str" and isinstance(one, (str, Joined)):
        return str(one) if isinstance(one, str) else one
    if name == "bool":
        from cqos_ros2_workspace.launch.python_expressions import truth

        return truth(one)
    if isinstance(one, (list, tuple, dict, str)) and name in _COLLECTIONS:
        try:
            return _COLLECTIONS[name](*values)
        except (TypeError, ValueError):
            return frame.not_followed(node, *values)
    if (unknown := first_unknown(*values)) is not None:
        return unknown
    plain = all(isinstance(each, (str, int, float)) or each is None for each in values)
    if name in _SCALARS and plain and len(str(one)) < LARGEST:
        try:
            return _SCALARS[name](*values)
        except (TypeError, ValueError, OverflowError):
            pass
    return frame.not_followed(node, *values)


def _range(*ends: int) -> list[int]:
    found = range(*ends)
    if len(found) > LARGEST:
        raise ValueError
    return list(found)


def _scalars(values: Any) -> Any:
    if not all(isinstance(each, (str, int, float)) for each in values):
        raise TypeError
    return values


def _mapping(values: Any) -> dict[Any, Any]:
    pairs = list(values.items()) if isinstance(values, dict) else [(key, value) for key, value in values]
    _scalars([key for key, _ in pairs])
    return dict(pairs)


_SCALARS: Final[dict[str, Callable[..., Any]]] = {
    "str": str,
    "int": int,
    "float": float,
    "abs": abs,
    "round": round,
    "range": _range,
    "max": max,
    "min": min,
    "repr": repr,
}
_COLLECTIONS: Final[dict[str, Callable[..., Any]]] = {
    "len": len,
    "list": list,
    "tuple": tuple,
    "set": lambda values: list(dict.fromkeys(_scalars(values))),
    "dict": _mapping,
    "sorted": lambda values: sorted(_scalars(values)),
    "reversed": lambda values: list(reversed(values)),
    "enumerate": lambda values, start=0: [(start + number, each) for number, each in enumerate(values)],
    "zip": lambda *values: list(zip(*values, strict=False)),
    "sum": lambda values: sum(_scalars(values)),
    "max": lambda values: max(_scalars(values)),
    "min": lambda values: min(_scalars(values)),
}


# Methods


def _method(
    method: Method, arguments: list[Any], named: dict[str, Any], node: ast.Call, frame: Frame, walk: Walk
) -> Any:
    of, name = method.of, method.name
    if (isinstance(of, Sub) and name == "perform") or (isinstance(of, ContextValue) and arguments):
        return walk.launch.perform(of if isinstance(of, Sub) else arguments[0])
    if isinstance(of, ConfigurationsValue) and name == "get" and arguments:
        return walk.launch.scope.configurations.get(arguments[0], arguments[1] if len(arguments) > 1 else None)
    if isinstance(of, Action) and name == "evaluate":
        return walk.launch.decide(of)
    if isinstance(of, Action) and name in {"add_action", "add_entity"} and arguments:
        return _append(of.fields.setdefault("entities", []), arguments[:1], walk)
    if isinstance(of, FileText):
        return of if name in {"read", "__enter__"} else frame.not_followed(node)
    if isinstance(of, list):
        return _of_list(of, name, arguments, node, frame, walk)
    if isinstance(of, dict):
        return _of_dict(of, name, arguments, node, frame, walk)
    if isinstance(of, PathText):
        return _of_path(of, name, arguments, node, frame)
    if isinstance(of, str):
        return lift(lambda *values: _of_text_method(of, name, values, named, node, frame), *arguments)
    return frame.not_followed(node, of, *arguments)


def _append(members: list[Any], values: Sequence[Any], walk: Walk) -> None:
    guards = tuple(walk.guards)
    if len(members) + len(values) <= LARGEST:
        members += [When(guards, each) if guards else each for each in values]


_SET_METHODS: Final[dict[str, Callable[[list[Any], Any], list[Any]]]] = {
    "difference": lambda one, other: [each for each in _scalars(one) if each not in _scalars(other)],
    "intersection": lambda one, other: [each for each in _scalars(one) if each in _scalars(other)],
    "union": lambda one, other: list(dict.fromkeys([*_scalars(one), *_scalars(other)])),
}


def _of_list(of: list[Any], name: str, arguments: list[Any], node: ast.Call, frame: Frame, walk: Walk) -> Any:
    if name == "append" and arguments:
        return _append(of, arguments[:1], walk)
    if name == "extend" and arguments:
        more = arguments[0]
        return _append(of, more if isinstance(more, (list, tuple)) else [frame.not_followed(node, *arguments)], walk)
    if name == "insert" and len(arguments) > 1 and isinstance(arguments[0], int):
        of.insert(arguments[0], When(tuple(walk.guards), arguments[1]) if walk.guards else arguments[1])
        return None
    if name == "copy":
        return list(of)
    if (
        name in _SET_METHODS
        and arguments
        and isinstance(arguments[0], (list, tuple))
        and not first_unknown(of, arguments)
    ):
        return _SET_METHODS[name](of, arguments[0])
    if name in {"remove", "pop", "clear", "sort", "reverse"}:
        _append(of, [frame.not_followed(node)], walk)
    return frame.not_followed(node, *arguments)


def _of_dict(of: dict[Any, Any], name: str, arguments: list[Any], node: ast.Call, frame: Frame, walk: Walk) -> Any:
    if name in {"items", "keys", "values", "copy"}:
        return {"items": list(of.items()), "keys": list(of), "values": list(of.values()), "copy": dict(of)}[name]
    if name == "get" and arguments and isinstance(arguments[0], (str, int)):
        return of.get(arguments[0], arguments[1] if len(arguments) > 1 else None)
    if name == "update" and not walk.guards and arguments and isinstance(arguments[0], dict):
        of.update(arguments[0])
        return None
    if name in {"update", "pop", "clear", "setdefault", "popitem"}:
        of["?"] = frame.not_followed(node, *arguments)
    return frame.not_followed(node, *arguments)


def _of_path(of: PathText, name: str, arguments: list[Any], node: ast.Call, frame: Frame) -> Any:
    if name in {"resolve", "absolute", "expanduser", "as_posix"}:
        return of
    if name == "joinpath" and all(isinstance(each, str) for each in arguments):
        return PathText(posixpath.join(of, *arguments))
    if name in {"read_text", "open"}:
        return FileText(str(of))
    if name == "with_suffix" and arguments and isinstance(arguments[0], str):
        return PathText(posixpath.splitext(of)[0] + arguments[0])
    return frame.not_followed(node)


def _of_text_method(
    of: str, name: str, values: tuple[Any, ...], named: dict[str, Any], node: ast.Call, frame: Frame
) -> Any:
    if name == "join" and values and isinstance(values[0], (list, tuple)) and _texts(values[0]):
        return join([part for each in values[0] for part in (of, each)][1:])
    if name == "format":
        return _formatted(of, values, named, node, frame)
    if name == "perform":
        return of
    plain = all(isinstance(each, (str, int)) or each is None for each in values)
    small = len(of) * (1 + sum(len(each) for each in values if isinstance(each, str))) < _LONGEST
    if name in _TEXT_METHODS and plain and small and not named and not first_unknown(values):
        try:
            found = getattr(of, name)(*values)
        except (TypeError, ValueError):
            return frame.not_followed(node, *values)
        return list(found) if isinstance(found, tuple) else found
    return frame.not_followed(node, *values)


def _formatted(of: str, values: tuple[Any, ...], named: dict[str, Any], node: ast.Call, frame: Frame) -> Any:
    given = [*values, *named.values()]
    if not _PLAIN_FIELDS.fullmatch(of) or not all(isinstance(each, (str, int, float)) for each in given):
        return frame.not_followed(node, *given)
    try:
        return of.format(*values, **named)
    except (IndexError, KeyError, ValueError):
        return frame.unknown(f"`{written(node)}` fails", node)
