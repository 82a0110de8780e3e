"""What is wrong with a launch, and what is not known of it, as notes of its system."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import listed
from cqos_core.model.finding import plural
from cqos_core.model.grouping import grouped
from cqos_core.model.settings import EVERY_OTHER, Place
from cqos_core.model.spelling import nearest
from cqos_core.model.system import MESSAGE, Part
from cqos_ros2.importers.workspace_codes import note
from cqos_ros2.names import expand
from cqos_ros2_workspace.activation import activation
from cqos_ros2_workspace.distro_consensus import OPEN
from cqos_ros2_workspace.launch.findings import findings as launch_findings
from cqos_ros2_workspace.launch.launch_output import assumptions, full_name, program
from cqos_ros2_workspace.middleware import unread_configurations
from cqos_ros2_workspace.naming import source_of, unmatched
from cqos_ros2_workspace.node_places import started
from cqos_ros2_workspace.nodes.endpoint_templates import MISSPELT, VERBS
from cqos_ros2_workspace.nodes.library import LEARNED
from cqos_ros2_workspace.nodes.version_fit import ANOTHER
from cqos_ros2_workspace.one_sided_topics import open_ends
from cqos_ros2_workspace.system_join import UNKNOWN_POLICY
from cqos_ros2_workspace.unread_nodes import NODE, number_of_nodes, unread_nodes

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from cqos_core.model.system import ImportNote
    from cqos_ros2_workspace.system_join import Join, JoinedNode

_LAUNCH_CODES = {"two-nodes-of-one-name": "ROS970", "section-names-no-node": "ROS971"}
_NAMED = 5
_NOT_KNOWN = frozenset(("ROS978", "ROS979", "ROS980"))


def notes(found: Join) -> list[ImportNote]:
    """Return all that the join reports; the first note about what is not known lists the nodes that are not."""
    made = [*_all_notes(found)]
    unread = unread_nodes(found)
    at = next((at for at, each in enumerate(made) if unread and each.code in _NOT_KNOWN), None)
    if at is not None:
        total = number_of_nodes(found) if unread[0].kind == NODE else 0
        made[at] = replace(made[at], parts=(*unread, *made[at].parts), total=total)
    return made


def _all_notes(found: Join) -> list[ImportNote]:
    return [
        *_of_launch(found),
        *_remaps(found),
        *_overrides(found),
        *_lifecycle(found),
        *_plugins(found),
        *open_ends(found),
        *_unknown_nodes(found),
        *_not_known_of_nodes(found),
        *_processes(found),
        *_not_decided(found),
        *unread_configurations(found),
    ]


def _of_launch(found: Join) -> Iterator[ImportNote]:
    for each in launch_findings(found.launched, found.workspace):
        also = f" (the other in line {each.other.line})" if each.other else ""
        yield note(_LAUNCH_CODES[each.name], f"{each.message}{also}", each.place, each.help)


# Remaps


def _remaps(found: Join) -> Iterator[ImportNote]:
    """Yield remaps that rename nothing in any node of their process."""
    by_owner = grouped(
        (owner, node)
        for node in found.nodes
        for owner in {rule.owner for rule in (*node.placed.rules, *node.placed.process.rules)}
    )
    # A rule that renames something in one node is often given to all nodes.
    shared = {(str(rule.source), str(rule.target)) for node in found.nodes for rule in node.used}
    used = [rule for node in found.nodes for rule in node.used]
    for nodes in by_owner.values():
        if not all(node.complete for node in nodes):
            continue
        rules = {id(rule): rule for node in nodes if not node.placed.depth for rule in node.placed.rules}
        names = {named.written for node in nodes for _, named, _ in node.endpoints if named.written}
        placed = nodes[0].placed
        for rule in unmatched(rules.values(), used):
            source = source_of(rule, placed.name)
            if (str(rule.source), str(rule.target)) in shared or not isinstance(source, str) or not source:
                continue
            wanted = expand(source, placed.namespace, placed.name)
            if wanted in _UNSEEN:
                continue
            meant = _meant(wanted, names)
            what = f"`{placed.address}` has no topic or service `{wanted}`"
            message = f"the remap `{rule.source}` → `{rule.target}` renames nothing: {what}"
            advice = f"did you mean `{meant}`?" if meant else f"it has {_few(names)}"
            yield note("ROS972", message, rule.place, advice)


_UNSEEN = frozenset(("/tf", "/tf_static", "/rosout", "/parameter_events", "/clock", "/diagnostics"))
"""Names that every node may have without its node file saying so, and that launch files rename for all nodes."""


def _meant(wanted: str, names: Iterable[str]) -> str | None:
    known = sorted(names)
    last = wanted.rpartition("/")[2]
    same = [each for each in known if each.rpartition("/")[2] == last]
    return same[0] if len(same) == 1 else nearest(wanted, known)


def _few(names: Collection[str]) -> str:
    return _few_texts([f"`{each}`" for each in sorted(names)]) if names else "none"


# Overrides


def _overrides(found: Join) -> Iterator[ImportNote]:
    seen: set[tuple[object, ...]] = set()
    for node in found.nodes:
        for override in node.overrides:
            key = (override.name, override.place)
            if override.used or key in seen or override.role is None:
                continue
            why = _refused(override.topic, override.role, override.policy, override.identity, node)
            if why is None:
                continue
            seen.add(key)
            message = f"`{override.name}` has no effect on `{node.placed.address}`: {why[0]}"
            yield note("ROS974", message, override.place or node.placed.place, why[1])


def _refused(topic: str, role: str, policy: str, identity: str, node: JoinedNode) -> tuple[str, str] | None:
    """Return why no endpoint takes an override, and what to do; None where that is not known."""
    plain, _, key = policy.partition(".")
    if key:
        return f"`{plain}` is one value, and no map", f"write a number of nanoseconds, or a word, under `{plain}`"
    there = [
        (each, named.full)
        for each, named, endpoint in node.endpoints
        if endpoint is not None and endpoint.kind == MESSAGE and isinstance(named.full, str)
    ]
    same = [each for each, full in there if full == topic]
    directions = {"publisher": "publishes", "subscriber": "subscribes"}
    mine = [each for each in same if each.direction == directions[role]]
    if identity and mine:
        return None
    if mine:
        allowed = sorted({each for one in mine for each in one.overridable})
        if allowed:
            return f"the {role} lets only {listed(allowed, 'and')} be overridden", "override one of these"
        return f"the code of the {role} allows no overrides", "change the QoS in the code, or on the other side"
    if not node.complete:
        return None
    if same:
        other = "subscription" if role == "publisher" else "publisher"
        return f"it has no {role} on `{topic}`", f"write `qos_overrides.{topic}.{other}.{policy}`"
    written = next((str(n.full) for _, n, _ in node.endpoints if n.written == topic and isinstance(n.full, str)), None)
    meant = written or _meant(topic, {str(full) for _, full in there})
    if meant:
        return f"it has no topic `{topic}`", f"did you mean `{meant}`? overrides name the topic after remaps"
    return f"it has no topic `{topic}`", f"it has {_few([str(full) for _, full in there])}"


# Lifecycle


def _lifecycle(found: Join) -> Iterator[ImportNote]:
    activates = activation(found)
    running = {node.placed.address: node for node in found.nodes}
    silent = bool(found.placing.unknown or found.placing.undecided or _missing_includes(found))
    for manager, names in activates.managers:
        for address, name in names.items():
            if address in running or silent:
                continue
            meant = _meant(address, [each for each in running if each not in activates.managed])
            message = f"`{manager.placed.address}` activates `{name}`, and the launch starts no node `{address}`"
            advice = f"did you mean `{meant.lstrip('/')}`?" if meant else "start the node, or leave it out of the list"
            listed_at = manager.filled.activates
            place = listed_at.place if listed_at is not None else None
            yield note("ROS975", message, place or manager.placed.place, advice)
        waiting = sorted(names.keys() & running)
        if waiting and manager.filled.at_start is False:
            message = f"`{manager.placed.address}` activates {_few(waiting)} only when a program asks for it"
            advice = f"set `autostart: true` of `{manager.placed.address}`, unless a program or a person starts them"
            yield replace(note("ROS976", message, manager.placed.place, advice), severity="note")
    managers = " and ".join(f"`{each.placed.address}`" for each, _ in activates.managers)
    for node in filter(activates.leaves_out, found.nodes):
        who = "no lifecycle manager" if managers else "nothing in the launch"
        message = f"{who} activates `{node.placed.address}`, so it publishes nothing"
        advice = f"name it in `node_names` of {managers}" if managers else _ACTIVATE.format(node.placed.name)
        yield note("ROS976", message, node.placed.place, advice)


_ACTIVATE: Final = (
    "start a `lifecycle_manager` of `nav2_lifecycle_manager` with `node_names: [{}]` and `autostart: true`, or name the launch "
    "file that does with a further --launch"
)


def _missing_includes(found: Join) -> bool:
    return any(each.about == "include" for each in found.launched.remarks)


# Plugins


def _plugins(found: Join) -> Iterator[ImportNote]:
    misspelt = {gap: node for node in found.nodes for gap in node.filled.gaps if gap.subject == MISSPELT}
    for gap, node in misspelt.items():
        name, _, advice = gap.cause.partition(", ")
        yield note("ROS981", f"`{node.placed.address}` loads {name}, which no plugin has", gap.place, advice)


# What is not known


def _unknown_nodes(found: Join) -> Iterator[ImportNote]:
    opaque = [node for node in found.nodes if node.placed.facts is None and not node.endpoints]
    if opaque:
        names = [f"`{each.placed.address}` ({each.placed.cause})" for each in opaque]
        message = f"nothing is known of the endpoints of {plural(len(opaque), 'node')}: {_few_texts(names)}"
        yield note("ROS978", message, opaque[0].placed.place)
    for instance, unknown in found.placing.unknown:
        yield note("ROS979", f"a node is not known: {unknown.cause}", unknown.place or instance.place)
    if found.placing.later:
        names = [f"`{full_name(each)}`" for each in found.placing.later]
        message = f"{plural(len(names), 'node')} {'starts' if len(names) == 1 else 'start'} on an event of the launch: {_few_texts(names)}"
        yield note("ROS979", message, found.placing.later[0].place)


def _not_known_of_nodes(found: Join) -> Iterator[ImportNote]:
    causes: dict[tuple[str, object], list[JoinedNode]] = {}
    differing = []
    others: dict[str, Place | None] = {}
    for node in found.nodes:
        for gap in node.filled.gaps:
            if gap.subject == OPEN:
                differing.append(node)
            elif gap.subject == MISSPELT:
                continue  # a finding of its own
            elif gap.subject == ANOTHER:
                others.setdefault(gap.cause, gap.place)
            else:
                causes.setdefault((gap.cause, gap.place), []).append(node)
        for part in _open_names(node):
            causes.setdefault(part, []).append(node)
    if differing:
        names = list(dict.fromkeys(f"`{each.placed.address}`" for each in differing))
        message = f"{plural(len(differing), 'endpoint')} of {_few_texts(names)} depend on the ROS 2 distribution, which is not stated"
        yield note("ROS979", message, differing[0].placed.place, "state it, for instance `--option ros2.distro=jazzy`")
    if others:
        message = (
            f"where the sources in the workspace say nothing, facts of other versions stand: {_few_texts([*others])}"
        )
        yield note("ROS979", message, next(iter(others.values())))
    for (cause, place), nodes in _once(causes).items():
        names = list(dict.fromkeys(f"`{each.placed.address}`" for each in nodes))
        at = place if place is not None else nodes[0].placed.place
        yield note("ROS979", f"{_few_texts(names)}: {cause}", at)  # type: ignore[arg-type]
    values = grouped((part, node) for node in found.nodes for part in _open_values(node))
    for (cause, place), nodes in _once(values).items():
        names = list(dict.fromkeys(f"`{each.placed.address}`" for each in nodes))
        at = place if place is not None else nodes[0].placed.place
        yield note("ROS979", f"{_few_texts(names)}: {cause}", at)  # type: ignore[arg-type]


def _open_names(node: JoinedNode) -> Iterator[tuple[str, object]]:
    """Yield what the node does under names that are not known, each with its place."""
    for each, named, _ in node.endpoints:
        if not isinstance(named.full, str):
            yield f"{VERBS[each.direction]} a name that is not known: {named.full.cause}", named.full.place


def _open_values(node: JoinedNode) -> Iterator[tuple[str, object]]:
    """Yield policies of endpoints that are not known, each with its place; not those that a verdict depends on."""
    for each, named, endpoint in node.endpoints:
        does = VERBS[each.direction]
        for policy, setting in (endpoint.settings if endpoint is not None else {}).items():
            if setting.reported == UNKNOWN_POLICY:
                what = "its quality of service" if policy == EVERY_OTHER else f"`{policy}`"
                yield f"{does} `{named.full}`, and {what} is not known: {setting.unknown}", setting.place


def _once(causes: dict[tuple[str, object], list[JoinedNode]]) -> dict[tuple[str, object], list[JoinedNode]]:
    """Return causes with those joined that differ only in their lines of node files that were not written."""
    first: dict[str, object] = {}
    joined: dict[tuple[str, object], list[JoinedNode]] = {}
    for (cause, place), nodes in causes.items():
        learned = isinstance(place, Place) and place.source.startswith(LEARNED)
        at = first.setdefault(cause, place) if learned else place
        joined.setdefault((cause, at), []).extend(nodes)
    return joined


def _few_texts(texts: list[str]) -> str:
    shown = texts[:_NAMED]
    if len(texts) > _NAMED:
        shown.append(f"{len(texts) - _NAMED} more")
    return listed(shown, "and")


def _processes(found: Join) -> Iterator[ImportNote]:
    others = [each for each in found.launched.instances if started(each) is None]
    if others:
        message = f"endpoints of {plural(len(others), 'process')} are not known: {_few_texts([f'`{program(each)}`' for each in others])}"
        unread = [Part("process", program(each), "it is no node", each.place) for each in others]
        yield note("ROS983", message, others[0].place, unread=unread)


def _not_decided(found: Join) -> Iterator[ImportNote]:
    guards = assumptions(found.launched)
    for subject, values in guards.items():
        nodes = [each for each in found.placing.undecided if any(guard.subject == subject for guard in each.guards)]
        if nodes:
            compared = listed([f"`{each}`" for each in values], "and")
            message = f"{plural(len(nodes), 'node')} {'depends' if len(nodes) == 1 else 'depend'} on `{subject}`, which is not decided (compared with {compared})"
            yield note("ROS980", message, nodes[0].place)
    missing = sorted({each.package for each in found.launched.remarks if each.package})
    if missing:
        message = f"the launch includes files of packages that are not in the workspace: {_few_texts(missing)}"
        unread = [
            Part("include", each.what, f"package `{each.package}` is not in the workspace", each.place)
            for each in found.launched.remarks
            if each.package
        ]
        place = found.launched.remarks[0].place
        yield note("ROS980", message, place, "check with a workspace that has them", unread)
    for unknown, advice in found.workspace.passed_over():
        unread = [Part("folder", "", unknown.cause, unknown.place)]
        yield note("ROS980", unknown.cause, unknown.place, advice, unread)
    for remark in found.launched.remarks:
        if not remark.package:
            what = f" {remark.what}" if remark.what else ""
            is_file = remark.place is not None and remark.what == found.workspace.short(remark.place.source)
            unread = [Part(remark.about, "" if is_file else remark.what, remark.cause, remark.place)]
            yield note("ROS980", f"{remark.about}{what}: {remark.cause}", remark.place, unread=unread)
