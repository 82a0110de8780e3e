"""The start of a launch as text for people and as JSON for programs."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.finding import plural
from cqos_core.model.grouping import grouped
from cqos_ros2_workspace.launch.findings import findings
from cqos_ros2_workspace.launch.launch_result import MadeFile, ParameterFile, ParameterValues
from cqos_ros2_workspace.launch.values import Either, Guard, Joined, Unknown, shown, unknown_parts

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.launch.launch_result import Instance, Launched, Parameters
    from cqos_ros2_workspace.launch.values import Guards
    from cqos_ros2_workspace.launch.workspace import Workspace

_LONGEST: Final = 160
_MOST_VALUES: Final = 50
_MOST_DEPTH: Final = 12


def assumptions(launched: Launched) -> dict[str, list[str]]:
    """Return what the launch leaves open: each subject with the values that conditions compare it with."""
    found: dict[str, dict[str, None]] = {}
    for guard in _guards(launched):
        found.setdefault(guard.subject, {})[guard.value] = None
    return {subject: list(values) for subject, values in found.items()}


def _guards(launched: Launched) -> Iterator[Guard]:
    for instance in launched.instances:
        yield from instance.guards
        for value in instance.values():
            yield from _guards_in(value)
    for remark in launched.remarks:
        yield from remark.guards


def _guards_in(value: Any) -> Iterator[Guard]:
    waiting, seen = [value], set()
    while waiting:
        each = waiting.pop()
        if isinstance(each, Either):
            for guards, inner in each.cases:
                yield from guards
                waiting.append(inner)
        elif isinstance(each, (list, tuple, dict)) and id(each) not in seen:
            seen.add(id(each))
            waiting += each.values() if isinstance(each, dict) else each


# Text


def as_text(launched: Launched, workspace: Workspace) -> str:
    """Return the launch as text."""
    blocks = [_head(launched, workspace), _findings(launched, workspace), *_instances(launched, workspace)]
    blocks += [_not_known(launched, workspace), _not_read(launched, workspace), _open(launched)]
    return "\n\n".join(block for block in blocks if block) + "\n"


def total(launched: Launched) -> str:
    """Return how many of each kind start, and of how many all is known."""
    kinds = {"node": 0, "component": 0, "container": 0, "process": 0}
    unknown = 0
    for instance in launched.instances:
        kinds["node" if instance.kind == "lifecycle_node" else instance.kind] += 1
        unknown += any(unknown_parts([*instance.values()]))
    counted = [plural(count, kind) for kind, count in kinds.items() if count and kind != "process"]
    if kinds["process"]:
        counted.append(f"{kinds['process']} other {'process' if kinds['process'] == 1 else 'processes'}")
    more = f"; something of {unknown} is not known" if unknown else ""
    return f"{', '.join(counted) or 'nothing'} would start{more}"


def _head(launched: Launched, workspace: Workspace) -> str:
    lines = [
        f"{workspace.short(launched.entry)} in {_near(launched.root)} ({plural(len(workspace.packages), 'package')})"
    ]
    lines.append(f"{total(launched)}.")
    given = [each for each in launched.arguments.values() if each.source in {"given", "none"}]
    lines += [f"  {each.name}:={_cut(shown(each.value))}" for each in given if each.source == "given"]
    for name, value in launched.variables.items():
        lines.append(f"  sets {name}={_cut(shown(value))}")
    return "\n".join(lines)


def _near(folder: str) -> str:
    """Return a folder relative to the working directory where it is below it."""
    return os.path.relpath(folder) if os.path.commonpath([folder, os.getcwd()]) == os.getcwd() else folder  # noqa: PTH109


def _findings(launched: Launched, workspace: Workspace) -> str:
    lines = []
    for each in findings(launched, workspace):
        also = f" (see {_at(each.other, workspace).rstrip(': ')})" if each.other else ""
        lines += [f"  {_at(each.place, workspace)}{each.message}{also}", f"      {each.help}"]
    return "\n".join(["Findings:", *lines]) if lines else ""


def _instances(launched: Launched, workspace: Workspace) -> Iterator[str]:
    """Yield one block for each file, in the order in which files start something."""
    by_file = grouped((instance.place.source, instance) for instance in launched.instances)
    for source, instances in by_file.items():
        lines = [workspace.short(source)]
        for instance in instances:
            lines += [f"  {line}" for line in _instance(instance)]
        yield "\n".join(lines)


def _instance(instance: Instance) -> Iterator[str]:
    yield f"{instance.place.line or 1}: {title(instance)}"
    if instance.container is not None:
        yield f"    in the container {shown(instance.container)}"
    if instance.guards:
        yield f"    only if {' and '.join(map(str, instance.guards))}"
    if instance.after:
        yield f"    after {instance.after}"
    for source, target in instance.remaps:
        yield f"    {shown(source)} → {shown(target)}"
    for each in instance.parameters:
        yield f"    parameters {_cut(_parameters(each))}"
    if instance.kind != "process" and instance.arguments:
        yield f"    arguments {_cut(' '.join(map(shown, instance.arguments)))}"


def program(process: Instance) -> str:
    """Return the command line of a process that is no node, cut where it is long."""
    return _cut(" ".join(map(shown, process.arguments)))


def full_name(node: Instance, unnamed: str = "") -> str:
    """Return the full name of a node; of one without a name the package and executable stand for it, or what is given."""
    unnamed = unnamed or f"({shown(node.package)}/{shown(node.executable)})"
    name = unnamed if node.name is None else shown(node.name)
    return f"{shown(node.namespace).rstrip('/')}/{name.lstrip('/')}"


def title(instance: Instance) -> str:
    """Return a node as a reader knows it: its full name, kind and program."""
    if instance.kind == "process":
        return f"runs {program(instance)}"
    kind = instance.kind.replace("_", " ")
    return f"{full_name(instance, '(its own name)')}  {kind} {shown(instance.package)} {shown(instance.executable)}"


def _parameters(each: Parameters) -> str:
    if isinstance(each, ParameterValues):
        return shown(each.values)
    if isinstance(each, Unknown):
        return f"? ({each.cause})"
    text = shown(each.path)
    path = each.path
    if isinstance(path, MadeFile):
        changes = [f"below {shown(path.root_key)}"] if path.root_key else []
        changes += [f"{name}: {shown(value)}" for name, value in path.rewrites.items()]
        text += f" (rewritten{': ' if changes else ''}{', '.join(changes)})"
    return text


def _not_known(launched: Launched, workspace: Workspace) -> str:
    """Return what is not known of nodes, each cause once with the first place."""
    causes: dict[tuple[str, str], list[Instance]] = {}
    for instance in launched.instances:
        for part in {(each.cause, _at(each.place, workspace)) for each in unknown_parts([*instance.values()])}:
            causes.setdefault(part, []).append(instance)
    lines = []
    for (cause, where), instances in causes.items():
        names = ", ".join(dict.fromkeys(shown(each.name or each.executable) or "a process" for each in instances[:3]))
        more = f" and {len(instances) - 3} more" if len(instances) > 3 else ""  # noqa: PLR2004 - as many are named
        lines.append(f"  {where}{cause} ({names}{more})")
    return "\n".join(["Not known of nodes:", *lines]) if lines else ""


def _not_read(launched: Launched, workspace: Workspace) -> str:
    """Return includes and actions that are not read, and packages that are not there."""
    lines = []
    missing = [remark.package for remark in launched.remarks if remark.package]
    if missing:
        names = ", ".join(sorted(set(missing)))
        lines.append(f"  {plural(len(missing), 'include')} of packages that are not in the workspace: {names}")
    for remark in launched.remarks:
        if remark.package:
            continue
        what = f"{remark.what}: " if remark.what else ""
        guards = f", only if {' and '.join(map(str, remark.guards))}" if remark.guards else ""
        lines.append(f"  {_at(remark.place, workspace)}{remark.about} {_cut(what + remark.cause)}{guards}")
    lines += [f"  {_at(each.place, workspace)}{each.cause}; {advice}" for each, advice in workspace.passed_over()]
    return "\n".join(["Not read:", *lines]) if lines else ""


def _open(launched: Launched) -> str:
    lines = []
    for subject, values in assumptions(launched).items():
        known = [f"`{value}`" if value else "empty" for value in values]
        lines.append(f"  {subject}: compared with {', '.join(known)}")
    for name, default in launched.assumed.items():
        lines.append(f"  environment {name}: taken as `{default}`, its default in the file")
    left = [each.name for each in launched.arguments.values() if each.source == "none"]
    lines += [f"  {name}: has no value and no default" for name in left if name not in assumptions(launched)]
    advice = "Not decided (decide with --launch-arg NAME:=VALUE, the environment with --define NAME=VALUE):"
    return "\n".join([advice, *lines]) if lines else ""


def _at(place: Place | None, workspace: Workspace) -> str:
    if place is None:
        return ""
    return f"{workspace.short(place.source)}{f':{place.line}' if place.line else ''}: "


def _cut(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}…"


# JSON


def as_data(launched: Launched, workspace: Workspace) -> dict[str, Any]:
    """Return the launch as data: known values as they are, others as objects with one key that names their kind."""
    return {
        "version": 1,
        "entry": workspace.short(launched.entry),
        "workspace": launched.root,
        "total": total(launched),
        "arguments": [
            {"name": each.name, "value": data_of(each.value), "source": each.source, "place": place_data(each.place)}
            for each in launched.arguments.values()
        ],
        "environment": {name: data_of(value) for name, value in launched.variables.items()},
        "assumed_environment": dict(launched.assumed),
        "undecided": assumptions(launched),
        "instances": [_instance_data(each) for each in launched.instances],
        "findings": [
            {
                "name": each.name,
                "message": each.message,
                "help": each.help,
                "place": place_data(each.place),
                "other": place_data(each.other),
            }
            for each in findings(launched, workspace)
        ],
        "not_read": [
            {
                "about": each.about,
                "missing_package": each.package,
                "what": each.what,
                "cause": each.cause,
                "place": place_data(each.place),
                "when": _guard_data(each.guards),
            }
            for each in launched.remarks
        ],
        "files": [workspace.short(path) for path in launched.files],
    }


def _instance_data(each: Instance) -> dict[str, Any]:
    return {
        "kind": each.kind,
        "package": data_of(each.package),
        "executable": data_of(each.executable),
        "name": data_of(each.name),
        "namespace": data_of(each.namespace),
        "remaps": [{"from": data_of(source), "to": data_of(target)} for source, target in each.remaps],
        "parameters": [_parameter_data(one) for one in each.parameters],
        "arguments": [data_of(word) for word in each.arguments],
        "environment": {name: data_of(value) for name, value in each.environment.items()},
        "container": data_of(each.container),
        "after": each.after,
        "when": _guard_data(each.guards),
        "place": place_data(each.place),
        "included_at": [place_data(place) for place in each.via],
    }


def _parameter_data(each: Parameters) -> dict[str, Any]:
    if isinstance(each, ParameterFile):
        found: dict[str, Any] = {"file": data_of(each.path), "substitutions": each.substitutions}
        if isinstance(each.path, MadeFile):
            found |= {"rewrites": data_of(each.path.rewrites), "root_key": data_of(each.path.root_key)}
        return {**found, "place": place_data(each.place)}
    if isinstance(each, ParameterValues):
        return {"values": data_of(each.values), "place": place_data(each.place)}
    return {"unknown": data_of(each)}


def data_of(value: Any, depth: int = _MOST_DEPTH) -> Any:
    """Return a value as JSON has it."""
    if depth < 0:
        return {"unknown": "nested too deep"}
    if isinstance(value, Unknown):
        return {"unknown": value.cause, "place": place_data(value.place)}
    if isinstance(value, Joined):
        return {"joined": [data_of(part) for part in value.parts]}
    if isinstance(value, Either):
        inner = [{"when": _guard_data(guards), "value": data_of(each, depth - 1)} for guards, each in value.cases]
        return {"either": inner}
    if isinstance(value, dict):
        return {str(name): data_of(each, depth - 1) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [data_of(each, depth - 1) for each in value[:_MOST_VALUES]]
    return value if isinstance(value, (str, bool, int, float)) or value is None else shown(value)


def _guard_data(guards: Guards) -> list[dict[str, Any]]:
    return [guard._asdict() for guard in guards]


def place_data(place: Place | None) -> dict[str, Any] | None:
    """Return a place as JSON has it."""
    return None if place is None else {"source": place.source, "line": place.line, "column": place.column}
