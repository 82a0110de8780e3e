"""What is surely wrong with a launch, without knowing the nodes: names that stand twice, parameters that reach no node."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.model.settings import Place
from cqos_core.model.spelling import distance
from cqos_ros2_workspace.launch.launch_result import MadeFile, ParameterFile
from cqos_ros2_workspace.launch.parameter_files import covers, sections, tree_of
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_ros2_workspace.launch.launch_result import Instance, Launched
    from cqos_ros2_workspace.launch.workspace import Workspace

_TYPED_WRONG: Final = 1
_SHORTEST: Final = 4


class LaunchFinding(NamedTuple):
    """Something that is wrong with a launch.

    Attributes:
        message: what is wrong, and what happens because of it.
        help: what to change.
        place: where.
        other: a second place that belongs to it.
    """

    name: str
    message: str
    help: str
    place: Place
    other: Place | None = None


def findings(launched: Launched, workspace: Workspace) -> list[LaunchFinding]:
    """Return what is wrong with a launch, in the order of the nodes."""
    return [*_same_names(launched), *_unused_sections(launched, workspace)]


def full_name(instance: Instance) -> str | None:
    """Return the full name of a node; None where it is not known."""
    name, space = instance.name, instance.namespace
    if instance.kind == "process" or not isinstance(name, str) or not isinstance(space, str) or not name:
        return None
    return f"{space.rstrip('/')}/{name}" if space else f"/{name}"


def _same_names(launched: Launched) -> Iterator[LaunchFinding]:
    """Yield nodes of one name that certainly run at the same time."""
    by_name: dict[str, list[Instance]] = {}
    # An action that is not understood may state the default of a launch argument, and so decide what runs.
    understood = not any(each.about == "action" for each in launched.remarks)
    for instance in launched.instances:
        name = full_name(instance)
        if name is None or instance.after.startswith("event"):
            continue
        earlier = next(
            (each for each in by_name.get(name, ()) if _together(each, instance, understood=understood)), None
        )
        by_name.setdefault(name, []).append(instance)
        if earlier is not None:
            message = f"two nodes have the name `{name}`, so parameters, services and logs of one are taken for those of the other"
            advice = "give each a name or a namespace of its own"
            yield LaunchFinding("two-nodes-of-one-name", message, advice, instance.place, earlier.place)


def _together(one: Instance, other: Instance, *, understood: bool) -> bool:
    """Whether two nodes run together for sure: one starts wherever the other does."""
    first, second = set(one.guards), set(other.guards)
    return not (first | second) if not understood else first <= second or second <= first


def _unused_sections(launched: Launched, workspace: Workspace) -> Iterator[LaunchFinding]:
    """Yield sections of parameter files that miss a node by a typing error or a namespace.

    Other sections may be for nodes that start inside a program, which a launch file does not show.
    """
    names = {name for each in launched.instances if (name := full_name(each)) is not None}
    seen: set[tuple[Place, str]] = set()
    for instance in launched.instances:
        name = full_name(instance)
        if name is None or instance.after.startswith("event"):
            continue
        for given in instance.parameters:
            stated = _sections_of(given, launched, workspace) if isinstance(given, ParameterFile) else []
            if any(covers(pattern, name) for pattern, _ in stated):
                continue
            for pattern, place in stated:
                advice = "" if any(covers(pattern, known) for known in names) else _meant(pattern, name)
                if advice and (place, name) not in seen:
                    seen.add((place, name))
                    message = f"the section `{pattern.lstrip('/')}` names no node, so `{name}` gets no parameter of it"
                    yield LaunchFinding("section-names-no-node", message, advice, place, instance.place)


def _meant(pattern: str, name: str) -> str:
    """Return what to write instead of a section that was meant for a node; empty where it was not."""
    own, wanted = pattern.rpartition("/"), name.rpartition("/")
    if own[2] == wanted[2] and own[0] != wanted[0]:
        return f"did you mean `{name}`? a section is for the full name of a node, with its namespace"
    close = own[0] == wanted[0] and min(len(own[2]), len(wanted[2])) >= _SHORTEST
    if close and 0 < distance(own[2], wanted[2], _TYPED_WRONG) <= _TYPED_WRONG and not own[2][-1:].isdigit():
        return f"did you mean `{name.lstrip('/')}`?"
    return ""


def _sections_of(given: ParameterFile, launched: Launched, workspace: Workspace) -> list[tuple[str, Place]]:
    """Return the patterns of the sections of a parameter file with their places; none where it is not known what the node reads."""
    path = given.path
    if not isinstance(path, str):
        return []
    above = ""
    if isinstance(path, MadeFile):
        if path.cause or path.replacements or not isinstance(path.root_key or "", str):
            return []
        above = f"/{path.root_key.strip('/')}" if path.root_key else ""
    real = workspace.find(str(path), given.place)
    data = real if isinstance(real, Unknown) else workspace.read(real, given.place)
    if isinstance(real, Unknown) or isinstance(data, Unknown):
        return []
    launched.files.setdefault(real, data)
    root = tree_of(data, real, given.place)
    if isinstance(root, Unknown):
        return []
    found = [(pattern, place) for pattern, place, _ in sections(root, above, Place(real, 1))]
    return [] if any("$(" in pattern for pattern, _ in found) else found
