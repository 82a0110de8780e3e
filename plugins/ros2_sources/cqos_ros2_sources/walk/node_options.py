"""What decides name, namespace, remaps and parameters of a node beside its code: `NodeOptions` of C++, arguments of `Node` in Python.

Sources: rcl (remap.c: rules of a node come before those of its process), rclcpp (node_options.hpp, resolve_parameter_overrides.cpp:
parameters of the process, then of the arguments, then overrides; the last one wins), rclpy (node.py).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import yaml

from cqos_ros2_sources.programs.names import last_part
from cqos_ros2_sources.programs.program import Assign, Attribute, Call, Name, call_name
from cqos_ros2_sources.programs.statement_search import calls_in, inside, mentions
from cqos_ros2_sources.walk.values import MISSING, PLAIN, Instance, Template
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_sources.programs.program import Expression, Function
    from cqos_ros2_sources.walk.call_tables import Row
    from cqos_ros2_sources.walk.endpoint_calls import Given
    from cqos_ros2_sources.walk.values import NodeRecord

CLASS: Final = "NodeOptions"
NODE_NAME: Final = ("__node", "__name")
_ARGUMENTS, _OVERRIDES, _GLOBAL = "arguments", "parameter_overrides", "use_global_arguments"
_IN_PYTHON: Final = {_ARGUMENTS: "cli_args", _OVERRIDES: _OVERRIDES, _GLOBAL: _GLOBAL}
_BEGINS, _ENDS = "--ros-args", "--"
_REMAP: Final = ("-r", "--remap")
_PARAMETER: Final = ("-p", "--param")
_FILE: Final = "--params-file"
_PAIR: Final = 2


def is_options(value: Any) -> bool:
    """Whether a value is an object of `NodeOptions`."""
    return isinstance(value, Instance) and last_part(value.library) == CLASS


def _of_command_line(written: Expression, function: Function) -> bool:
    """Whether a list in `main` only has words of the command line: what these rename, the process renames alike."""
    if not isinstance(written, Name) or function.last != "main" or len(function.parameters) < _PAIR:
        return False
    words, inner = function.parameters[1].name, [*inside(function.body)]
    made = [each.value for each in inner if isinstance(each, Assign) and each.target == written]
    uses = [each for each in calls_in(function.body) if mentions(each, written.text)]
    own = [each for each in uses if isinstance(each.function, Attribute) and each.function.of == written]
    filled = [each for value in (*made, *own) for each in (value.arguments if isinstance(value, Call) else (value,))]
    known = {id(each) for each in own} | {id(each) for each in uses if call_name(each) == _ARGUMENTS}
    return all(id(each) in known for each in uses) and all(mentions(each, words) for each in filled)


def changed(options: Instance, name: str, given: Given, function: Function) -> Any:
    """Return what a method of `NodeOptions` returns; most return the options again."""
    members = options.members
    if name == _ARGUMENTS and given.arguments and _of_command_line(given.call.arguments[0], function):
        return options
    if name == "append_parameter_override":
        known = members.get(_OVERRIDES, [])
        members[_OVERRIDES] = [*known, [*given.arguments]] if isinstance(known, list) else known
    elif name in _IN_PYTHON and given.arguments:
        members[name] = given.arguments[0]
    elif not given.arguments:
        found = members.get(name, Unknown(f"`{name[:60]}` is not followed", given.call.place))
        if name in _IN_PYTHON:  # it returns a reference
            members[name] = Unknown("what its options state may be changed in place", given.call.place)
        return found
    return options


def place(node: NodeRecord, row: Row, given: Given) -> None:
    """Give a node its name and namespace, and what its options state."""
    name = given.at(row.position("name"))
    node.name = name if isinstance(name, str) else Unknown("its name is not a text that is known")
    stated = [*given.arguments[1:]] if row.values.get("options") else []
    options = next((each for each in stated if is_options(each)), None)
    namespace = given.at(row.position("namespace"))
    if options is None and stated and isinstance(stated[-1], (Unknown, Instance)):
        _open(node, stated[-1])
    elif isinstance(namespace, str):
        node.namespace = namespace
    elif isinstance(namespace, (Unknown, Template)):
        node.namespace = _cause(namespace)
    if options is not None:
        _state(node, {key: options.members.get(key, options.members.get("*", MISSING)) for key in _IN_PYTHON})
    elif not row.values.get("options"):
        _state(
            node, {key: given.keywords.get(word, given.keywords.get("**", MISSING)) for key, word in _IN_PYTHON.items()}
        )


def _cause(value: Any) -> Unknown:
    return (
        value if isinstance(value, Unknown) else Unknown("parameters or values that are not followed decide about it")
    )


def _open(node: NodeRecord, value: Any) -> None:
    """Take the names of a node as not known: its options may rename anything."""
    cause = _cause(value)
    node.name = node.namespace = node.renamed = Unknown(
        f"options of the node may rename it: {cause.cause}", cause.place
    )
    node.changed.add("*")


def _state(node: NodeRecord, stated: dict[str, Any]) -> None:
    """Take what options state."""
    arguments, overrides, everything = (stated[key] for key in (_ARGUMENTS, _OVERRIDES, _GLOBAL))
    if everything is not MISSING and everything is not True:
        node.alone = everything is False
        if not node.alone:
            _open(node, everything)
    if arguments is not MISSING and arguments is not None:
        _read(node, arguments)
    if overrides is not MISSING and overrides is not None:
        for each in overrides if isinstance(overrides, list) else [overrides]:
            if isinstance(each, Instance):
                each = [each.members.get("name"), each.members.get("value")]  # noqa: PLW2901
            known = isinstance(each, list) and len(each) == _PAIR and isinstance(each[0], str)
            _override(node, each[0] if known else "*", each[1] if known else None)


def _override(node: NodeRecord, name: str, value: Any) -> None:
    """Take the value that options give a parameter; what they do not decide is not known."""
    if isinstance(value, PLAIN) and not isinstance(value, Template) and value is not None:
        node.overrides[name] = value
        node.changed.discard(name)
    else:
        node.changed.add(name)


def _read(node: NodeRecord, arguments: Any) -> None:
    """Read the arguments of a node as rcl does."""
    words = arguments if isinstance(arguments, list) else [arguments]
    unknown = next((each for each in words if not isinstance(each, str)), None)
    if unknown is not None:
        _open(node, unknown)
        return
    within = False
    for flag, value in zip(words, [*words[1:], ""], strict=True):
        within = flag == _BEGINS or (within and flag != _ENDS)
        name, sign, text = value.partition(":=")
        prefix, colon, last = name.partition(":")
        own = not colon or prefix in {node.name, "rostopic", "rosservice"}
        if not within or not (own or flag == _FILE):
            continue
        rest = last if colon and prefix == node.name else name
        if flag in _REMAP and sign:
            node.remaps.setdefault(rest, text)
        elif flag in _PARAMETER and sign:
            _override(node, rest, _yaml(text))
        elif flag == _FILE:
            node.changed.add("*")
    node.name = next((text for source, text in node.remaps.items() if source in NODE_NAME), node.name)
    node.namespace = node.remaps.get("__ns", node.namespace)


def _yaml(text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return None
