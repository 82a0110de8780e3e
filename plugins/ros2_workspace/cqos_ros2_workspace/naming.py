"""Names of endpoints after remaps, as rcl makes them: local rules before those of the process, the first that matches."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from cqos_ros2.names import expand
from cqos_ros2_workspace.launch.values import Joined, Unknown, first_unknown

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.launch.launch_result import Instance
    from cqos_ros2_workspace.launch.values import Text


class Rule(NamedTuple):
    """One remap.

    Attributes:
        source, target: as written; unknown where the launch leaves them open.
        place: of the action that states it.
        owner: a number of the instance that states it.
    """

    source: Text
    target: Text
    place: Place
    owner: int


class Named(NamedTuple):
    """The name of an endpoint.

    Attributes:
        full: the name on which endpoints match; unknown with its cause where the files do not decide it.
        written: the full name before remaps; empty where it is not known.
        rule: the remap that was applied; None where none was.
    """

    full: str | Unknown
    written: str
    rule: Rule | None = None


def rules_of(instance: Instance, owner: int) -> list[Rule]:
    """Return the remaps of an instance in the order in which they are tried."""
    return [Rule(source, target, instance.place, owner) for source, target in instance.remaps]


def applied(name: str | Unknown | Joined, namespace: str, node: str, rules: Sequence[Rule]) -> Named:
    """Return the name of an endpoint of a node."""
    if not isinstance(name, str):
        return Named(first_unknown(name) or Unknown("its name is not known"), "")
    written = expand(name, namespace, node)
    for rule in rules:
        match = source_of(rule, node)
        if match is None:
            continue
        if isinstance(match, Unknown):
            return Named(Unknown(f"a remap may rename it: {match.cause}", match.place or rule.place), written)
        if expand(match, namespace, node) == written:
            target = rule.target
            if not isinstance(target, str):
                cause = first_unknown(target) or Unknown("the remap depends on what the launch leaves open", rule.place)
                return Named(cause, written, rule)
            return Named(expand(_bare(target), namespace, node), written, rule)
    return Named(written, written)


def source_of(rule: Rule, node: str) -> str | Unknown | None:
    """Return what a rule renames in a node; None where it is for another node."""
    if not isinstance(rule.source, str):
        return first_unknown(rule.source) or Unknown("it depends on what the launch leaves open", rule.place)
    source = _bare(rule.source)
    for_node, colon, rest = source.partition(":")
    if colon and not for_node.startswith("/"):
        return rest if for_node == node else None
    return source


def _bare(name: str) -> str:
    return name.removeprefix("rostopic://").removeprefix("rosservice://")


def unmatched(rules: Iterable[Rule], used: Iterable[Rule]) -> list[Rule]:
    """Return the rules that no name was renamed by."""
    taken = set(map(id, used))
    return [rule for rule in rules if id(rule) not in taken and isinstance(rule.source, str)]
