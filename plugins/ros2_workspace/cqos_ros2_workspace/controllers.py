"""The controllers of ros2_control: nodes that a spawner makes a controller manager load (spawner.py of controller_manager 2.54 and 4.46)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_ros2.names import expand
from cqos_ros2_workspace.launch.values import Unknown, first_unknown
from cqos_ros2_workspace.nodes.endpoint_templates import Inside, as_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_ros2_workspace.launch.launch_result import Instance, Launched
    from cqos_ros2_workspace.node_places import Placed
    from cqos_ros2_workspace.nodes.endpoint_templates import FilledNode

_PACKAGE: Final = "controller_manager"
_SPAWNERS: Final = frozenset(("spawner", "spawner.py"))
_MANAGER: Final = ("-c", "--controller-manager")
_TYPE: Final = ("-t", "--controller-type")
_NAMESPACE: Final = ("-n", "--namespace")  # until Iron
_FLAGS: Final = frozenset(
    ("--load-only", "--stopped", "--inactive", "-u", "--unload-on-kill", "--activate-as-group", "--switch-asap")
)
_VALUES: Final = frozenset(
    (*_MANAGER, *_TYPE, *_NAMESPACE, "--controller-manager-timeout", "--switch-timeout", "--service-call-timeout")
)  # fmt: skip


class _Spawned(NamedTuple):
    """What one spawner loads.

    Attributes:
        manager: full name of the controller manager.
        type: of all its controllers; empty: their parameters say it.
    """

    names: list[str]
    manager: str
    type: str


def add_controllers(placed: Placed, result: FilledNode, launched: Launched) -> None:
    """Add the controllers that spawners of the launch load into a controller manager, as nodes inside of it."""
    given = placed.given()
    unknown = placed.unknown_parameters()
    loaded = False
    for instance in launched.instances:
        spawned = _spawned(instance)
        if spawned is None:
            continue
        if isinstance(spawned, Unknown):
            result.gaps.append(spawned)
        elif spawned.manager == placed.address:
            loaded = True
            for name in spawned.names:
                stated = given.get(f"{name}.type")
                kind = spawned.type or (as_text(stated.value) if stated is not None else "")
                if isinstance(kind, str) and kind:
                    result.inside.append(Inside(kind.replace("::", "/"), name, placed.namespace))
                else:
                    cause = kind if isinstance(kind, Unknown) else unknown or Unknown(f"no parameter `{name}.type`")
                    result.gaps.append(Unknown(f"the controller `{name}`: {cause.cause}", instance.place))
    if not loaded:
        result.gaps.append(Unknown("its controllers: no spawner of the launch loads them", placed.place))


def add_manager(placed: Placed, result: FilledNode, launched: Launched) -> None:
    """Note that a spawner loads its controllers elsewhere, where the launch starts no such controller manager."""
    spawned = _spawned(placed.instance)
    if isinstance(spawned, _Spawned) and spawned.manager not in set(_managers(launched)):
        result.gaps.append(
            Unknown(f"the controllers that it loads: the launch starts no node `{spawned.manager}`", placed.place)
        )


def _managers(launched: Launched) -> Iterator[str]:
    for each in launched.instances:
        if each.package == _PACKAGE and each.executable == "ros2_control_node":
            yield expand(str(each.name or _PACKAGE), str(each.namespace) or "/", "")


def _spawned(instance: Instance) -> _Spawned | Unknown | None:
    """Return what a spawner loads, or why that is not known; None for other nodes."""
    if instance.package != _PACKAGE or instance.executable not in _SPAWNERS:
        return None
    words = [*instance.arguments]
    unknown = first_unknown([*words, instance.namespace])
    if unknown is not None or instance.guards or not all(isinstance(each, str) for each in words):
        cause = unknown.cause if unknown is not None else "it depends on what the launch leaves open"
        return Unknown(f"the controllers that a spawner loads: {cause}", instance.place)
    return _read([word for text in words for word in str(text).split() or [""]], instance)


def _read(words: list[str], instance: Instance) -> _Spawned | Unknown:
    names: list[str] = []
    manager, kind, namespace, at = _PACKAGE, "", str(instance.namespace), 0
    while at < len(words):
        word, _, value = words[at].partition("=")
        if word in _VALUES:
            if not value:
                at += 1
                value = words[at] if at < len(words) else ""
            manager = value if word in _MANAGER else manager
            kind = value if word in _TYPE else kind
            namespace = f"/{value.strip('/')}" if word in _NAMESPACE and value else namespace
        elif word.startswith("-") and word not in _FLAGS:
            return Unknown(
                f"the controllers that a spawner loads: its option `{word[:80]}` is not read", instance.place
            )
        elif not word.startswith("-"):
            names.append(word)
        at += 1
    return _Spawned(names, expand(manager, namespace or "/", ""), kind)
