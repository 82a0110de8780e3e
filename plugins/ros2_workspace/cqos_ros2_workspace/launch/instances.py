"""Nodes, containers and components as a launch starts them: with names, namespaces, remaps, parameters and command lines."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_workspace.launch.entities import Action, Sub
from cqos_ros2_workspace.launch.launch_result import Instance, MadeFile, ParameterFile, ParameterValues
from cqos_ros2_workspace.launch.parameter_files import plain_text
from cqos_ros2_workspace.launch.python_names import FileText
from cqos_ros2_workspace.launch.scope import absolute, inner_namespace, place_of
from cqos_ros2_workspace.launch.substitutions import condition
from cqos_ros2_workspace.launch.values import (
    Either,
    Joined,
    Unknown,
    When,
    both,
    cases,
    either,
    first_unknown,
    lift,
    only_where,
    replaced,
    shown,
    where_held,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.launch.launch_evaluation import Launch
    from cqos_ros2_workspace.launch.launch_result import InstanceKind, Parameters
    from cqos_ros2_workspace.launch.values import Guards, Text

NODES: Final[dict[str, InstanceKind]] = {
    "ComposableLifecycleNode": "component",
    "ComposableNode": "component",
    "ComposableNodeContainer": "container",
    "ExecuteLocal": "process",
    "ExecuteProcess": "process",
    "LifecycleNode": "lifecycle_node",
    "LoadComposableNodes": "component",
    "Node": "node",
}
_SHELL: Final = re.compile(r"[;&|]|\$\(|`")
"""What makes a command line more than one command."""
_RUN: Final = len(("ros2", "run", "PACKAGE", "EXECUTABLE"))
MOST_INSTANCES: Final = 5_000
_MOST_PARAMETERS: Final = 10_000
_TYPES: Final = frozenset(("str", "builtins.str"))


def start(action: Action, run: Launch) -> None:
    """Add what an action starts."""
    kind = NODES[action.kind]
    if len(run.found.instances) >= MOST_INSTANCES:
        run.remark("limit", action.kind, f"more than {MOST_INSTANCES} nodes are not followed", action.place)
    elif kind == "process":
        _process(action, run)
    elif action.kind == "LoadComposableNodes":
        target = action.fields.get("target_container")
        _components(action, _container_name(target, run), run)
    else:
        node = _node(action, kind, run)
        run.found.instances.append(node)
        if kind == "container":
            _components(action, node.name or "", run)


def _container_name(target: Any, run: Launch) -> Text:
    if isinstance(target, Action):
        return run.perform(target.fields.get("name"))  # type: ignore[no-any-return]
    return run.perform(target)  # type: ignore[no-any-return]


def _components(action: Action, container: Text, run: Launch) -> None:
    listed = action.fields.get("composable_node_descriptions")
    for guards, each in _flat(listed):
        if not isinstance(each, Action):
            unknown = first_unknown(each)
            run.remark("action", action.kind, unknown.cause if unknown else "a component is not read", action.place)
            continue
        for more, held in cases(run.decide(each.fields.get("condition"))):
            if held:
                node = _node(each, "component", run)
                node.container = container
                node.guards = (*node.guards, *guards, *more)
                run.found.instances.append(node)


def _flat(value: Any) -> Iterator[tuple[Guards, Any]]:
    """Yield the members of a list that may be nested or have alternatives, each with its guards."""
    if value is None:
        return
    if isinstance(value, (list, tuple)):
        for each in value:
            yield from _flat(each)
    elif isinstance(value, When):
        yield from (((*value.guards, *guards), each) for guards, each in _flat(value.value))
    elif isinstance(value, Either):
        for guards, one in value.cases:
            yield from (((*guards, *inner), each) for inner, each in _flat(one))
    else:
        yield (), value


def _process(action: Action, run: Launch) -> None:
    command = action.fields.get("cmd")
    words = command if isinstance(command, (list, tuple)) else [command]
    instance = _instance(action, "process", run)
    instance.arguments = [only_where(guards, run.perform(word)) for guards, word in _pairs(words)]
    run.found.instances.append(_run_by_ros2(instance, action, run) or instance)


def _run_by_ros2(process: Instance, action: Action, run: Launch) -> Instance | None:
    """Return the node that ``ros2 run PACKAGE EXECUTABLE`` starts; None of any other command line."""
    stated = [word for each in process.arguments for word in (each.split() if isinstance(each, str) else [each])]
    if any(isinstance(each, str) and _SHELL.search(each) for each in stated):
        return None
    if stated[:3] == ["ros2", "run", "--prefix"]:
        del stated[2:4]
    command, options = stated[:_RUN], stated[_RUN:]
    if command[:2] != ["ros2", "run"] or len(command) < _RUN or str(command[2]).startswith("-"):
        return None
    node = replace(process, kind="node", package=command[2], executable=command[3], namespace="/", arguments=[])
    node.environment = {
        name: value
        for source in (run.scope.environment, _variables(action.fields, run))
        for name, value in source.items()
        if value is not None
    }
    _command_line(options, False, node, run)
    return node


def _pairs(words: Any) -> Iterator[tuple[Guards, Any]]:
    """Yield words that may stand under guards; a word that is a list of substitutions stays one word."""
    for word in words:
        yield (word.guards, word.value) if isinstance(word, When) else ((), word)


def _instance(action: Action, kind: InstanceKind, run: Launch) -> Instance:
    return Instance(kind, place_of(action.place), guards=run.scope.guards, after=run.after, via=run.via)


def _node(action: Action, kind: InstanceKind, run: Launch) -> Instance:
    fields = action.fields
    node = _instance(action, kind, run)
    unknown = fields.get("**")
    if isinstance(unknown, Unknown):
        node.parameters.append(unknown)
    # An autostart is a transition that the launch emits.
    starts = fields.get("autostart")
    starts = condition(run.perform(starts), node.place) if starts is not None else False
    run.found.emits = run.found.emits or starts is not False
    executable = fields.get(
        "executable", fields.get("node_executable", fields.get("plugin", fields.get("node_plugin")))
    )
    node.package = run.perform(fields.get("package"))
    node.executable = run.perform(fields.get("plugin") if kind == "component" and "plugin" in fields else executable)
    name = fields.get("name", fields.get("node_name"))
    node.name = None if name is None else run.perform(name)
    own = fields.get("namespace", fields.get("node_namespace"))
    node.namespace = absolute(inner_namespace(run.scope.namespace, run.perform(own)))
    for field in ("arguments", "ros_arguments"):  # they stand first on the command line
        _command_line(fields.get(field), field == "ros_arguments", node, run)
    node.remaps += [*_remaps_around(run), *_remaps(fields.get("remappings"), run, node)]
    node.parameters += [*_parameters_around(run), *parameters(fields.get("parameters"), run, node.place)]
    node.environment = {
        name: value
        for source in (run.scope.environment, _variables(fields, run))
        for name, value in source.items()
        if value is not None
    }
    return node


def _remaps_around(run: Launch) -> Iterator[tuple[Text, Text]]:
    for source, target in run.scope.remaps:
        held = where_held(source, run.scope.guards)
        if held is not None:
            yield held, target


def _parameters_around(run: Launch) -> Iterator[Parameters]:
    guards = run.scope.guards
    for each in run.scope.parameters:
        if isinstance(each, ParameterFile):
            path = where_held(each.path, guards)
            if path is not None:
                yield replace(each, path=path)
        elif isinstance(each, ParameterValues):
            held = {name: (value, where_held(value, guards)) for name, value in each.values.items()}
            there = {name: now for name, (before, now) in held.items() if now is not None or before is None}
            if there or not held:
                yield replace(each, values=there)
        else:
            yield each


def _variables(fields: dict[str, Any], run: Launch) -> dict[str, Any]:
    stated = fields.get("additional_env") or fields.get("env")
    return {str(name): run.perform(value) for name, value in stated.items()} if isinstance(stated, dict) else {}


def _remaps(stated: Any, run: Launch, node: Instance) -> Iterator[tuple[Text, Text]]:
    for guards, rule in _rules(stated):
        if isinstance(rule, (list, tuple)) and len(rule) == 2:  # noqa: PLR2004 - from and to
            source = only_where(guards, run.perform(rule[0]))
            if source is not None:
                yield source, run.perform(rule[1])
        else:
            cause = first_unknown(rule) or Unknown("a remap that is no pair", node.place)
            yield cause, cause


def _rules(stated: Any) -> Iterator[tuple[Guards, Any]]:
    """Yield remap rules; a pair of texts is a rule and no list of rules."""
    for guards, value in cases(stated):
        if value is None:
            continue
        for each in value if isinstance(value, (list, tuple)) else [value]:
            more, rule = (each.guards, each.value) if isinstance(each, When) else ((), each)
            yield from (((*guards, *more, *inner), one) for inner, one in cases(rule))


def parameters(stated: Any, run: Launch, place: Place) -> Iterator[Parameters]:
    """Yield the parameters of a node in order: files, values, and what is not known."""
    for guards, each in _flat(stated):
        if isinstance(each, dict):
            values = {name: only_where(guards, value) for name, value in _dotted(each, run)}
            if both((), guards) is not None:
                yield ParameterValues(values, place)
        elif isinstance(each, Action) and each.kind in {"Parameter", "ParameterValue"}:
            name = run.perform(each.fields.get("name"))
            value = parameter_value(each.fields.get("value"), run)
            yield ParameterValues({name if isinstance(name, str) else "?": value}, each.place or place)
        elif isinstance(each, (str, Sub, Action, Joined)):
            path = run.perform(each)
            held = False
            if isinstance(each, Action):
                held = condition(run.perform(each.fields.get("allow_substs", "false")), place) is True
                inner = each.fields.get("param_file")
                path = run.perform(inner)
            path = only_where(guards, path)
            if path is not None:
                yield ParameterFile(path, held, getattr(each, "place", None) or place)
        else:
            yield first_unknown(each) or Unknown("parameters of another kind", place)


def _dotted(values: dict[Any, Any], run: Launch, above: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield parameters by their full names: nested ones are joined with dots."""
    for key, value in values.items():
        name = f"{above}{shown(run.perform(key))}"
        if isinstance(value, dict) and depth < 20:  # noqa: PLR2004 - deeper than any parameter
            yield from _dotted(value, run, f"{name}.", depth + 1)
        else:
            yield name, parameter_value(value, run)


def parameter_value(value: Any, run: Launch) -> Any:
    """Return the value of a parameter; a text made of substitutions has the type that it has in YAML."""
    if isinstance(value, Either):
        return either((guards, parameter_value(each, run)) for guards, each in value.cases)
    if isinstance(value, Action) and value.kind == "ParameterValue":
        as_text = shown(getattr(value.fields.get("value_type"), "name", value.fields.get("value_type"))) in _TYPES
        inner = value.fields.get("value")
        text = run.perform(inner) if not isinstance(inner, (bool, int, float)) else inner
        return text if as_text else lift(_typed, text)
    if isinstance(value, Sub):
        return lift(_typed, run.perform(value))
    if isinstance(value, (list, tuple)):
        if any(isinstance(each, Sub) for each in value) and all(isinstance(each, (Sub, str)) for each in value):
            return lift(_typed, run.perform(value))
        return [parameter_value(each, run) for each in value[:_MOST_PARAMETERS]]
    if isinstance(value, (str, bool, int, float, Unknown, Joined)) or value is None:
        return value
    if isinstance(value, FileText):
        return Unknown(f"the content of the file `{shown(run.perform(value.path))[:120]}`")
    return first_unknown(value) or Unknown("a value of another kind", getattr(value, "place", None))


def _typed(text: Any) -> Any:
    return plain_text(text) if isinstance(text, str) and not isinstance(text, MadeFile) else text


def _command_line(stated: Any, ros: bool, node: Instance, run: Launch) -> None:  # noqa: FBT001 - which of two fields it is
    """Take in a command line: `-r`, `-p` and `--params-file` after ``--ros-args``, the rest as arguments."""
    for guards, value in cases(stated):
        listed = value if isinstance(value, (list, tuple)) else [] if value is None else [value]
        words = [((*guards, *own), run.perform(word)) for own, word in _pairs(listed)]
        _words(words, ros, node)


def _words(words: Sequence[tuple[Guards, Any]], ros: bool, node: Instance) -> None:  # noqa: FBT001 - as above
    """Take in the words of one alternative of a command line, each with its guards."""
    at = 0
    while at < len(words):
        guards, word = words[at]
        following = words[at + 1][1] if at + 1 < len(words) else None
        at += 1
        if isinstance(word, str) and word in {"--ros-args", "--"}:
            ros = word == "--ros-args"
        elif ros and isinstance(word, str) and word in _ROS_OPTIONS and following is not None:
            _ros_option(_ROS_OPTIONS[word], following, guards, node)
            at += 1
        elif both((), guards) is not None:
            node.arguments.append(only_where(guards, word))


_ROS_OPTIONS: Final = {
    "-r": "remap",
    "--remap": "remap",
    "-p": "param",
    "--param": "param",
    "--params-file": "file",
}


def _ros_option(option: str, value: Any, guards: Guards, node: Instance) -> None:
    if both((), guards) is None:
        return
    if option == "file":
        node.parameters.append(ParameterFile(only_where(guards, value), False, node.place))
        return
    name, equals, rest = value.partition(":=") if isinstance(value, str) else ("", "", "")
    if not equals:
        cause = first_unknown(value) or Unknown(f"`{shown(value)[:60]}` is no rule", node.place)
        if option == "remap":
            node.remaps.append((cause, cause))
        else:
            node.parameters.append(cause)
    elif option == "param":
        node.parameters.append(ParameterValues({name: only_where(guards, plain_text(rest))}, node.place, rule=True))
    elif name in {"__node", "__name"}:
        node.name = replaced(node.name, rest, guards)
    elif name == "__ns":
        node.namespace = replaced(node.namespace, rest, guards)
    else:
        node.remaps.append((only_where(guards, name), rest))
