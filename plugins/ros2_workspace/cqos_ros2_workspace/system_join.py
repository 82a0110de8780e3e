"""Joins the nodes of a launch and the facts about them to one system, with places of launch, parameter and node files."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from cqos_core.model.settings import Setting
from cqos_core.model.system import Acceptance, Endpoint, Participant, ProfileRef, System, endpoint_id, numbered
from cqos_ros2.policies import DISTRO
from cqos_ros2_workspace.configured_nodes import add_configured
from cqos_ros2_workspace.distro_consensus import agreed
from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.naming import applied
from cqos_ros2_workspace.node_places import Placing, distribution
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.endpoint_templates import FilledNode
from cqos_ros2_workspace.nodes.reading import distributions
from cqos_ros2_workspace.overriding import overrides_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.system import Role
    from cqos_ros2_workspace.launch.launch_result import Launched
    from cqos_ros2_workspace.launch.workspace import Workspace
    from cqos_ros2_workspace.naming import Named, Rule
    from cqos_ros2_workspace.node_places import Placed
    from cqos_ros2_workspace.nodes.endpoint_templates import Filled
    from cqos_ros2_workspace.nodes.library import Library
    from cqos_ros2_workspace.overriding import Override

_ENVIRONMENT: Final = {"RMW_IMPLEMENTATION": "rmw", "ROS_DOMAIN_ID": "domain"}
_ASSUMED: Final = ("rmw",)
"""Options that a check decides for all their values where nothing states them, so that an open one needs no warning."""
PROTOCOL: Final = "ros2"
UNKNOWN_POLICY: Final = "ROS979"
"""The code of the note by which the join reports a policy that is not known."""


@dataclass(slots=True)
class JoinedNode:
    """One node of the join.

    Attributes:
        endpoints: with the name of each and the endpoint of the system; None where its name is not known.
        used: the remaps that renamed something.
        overrides: its parameters `qos_overrides`.
    """

    placed: Placed
    filled: FilledNode
    endpoints: list[tuple[Filled, Named, Endpoint | None]] = field(default_factory=list)
    used: list[Rule] = field(default_factory=list)
    overrides: list[Override] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether all of its endpoints are known with their names."""
        if self.placed.facts is None or self.filled.gaps:
            return False
        return all(isinstance(named.full, str) for _, named, _ in self.endpoints)

    @property
    def opaque(self) -> bool:
        """Whether nothing is known of its endpoints, so that it may be the partner of any other."""
        unknown = self.placed.facts is None or bool(self.filled.gaps)
        return unknown and not self.endpoints and not self.filled.inside


@dataclass(slots=True)
class Join:
    """What became of a launch.

    Attributes:
        distro: the ROS 2 distribution; empty where it is not stated.
    """

    launched: Launched
    workspace: Workspace
    placing: Placing
    distro: str
    system: System
    nodes: list[JoinedNode] = field(default_factory=list)


def join(launched: Launched, workspace: Workspace, library: Library, given: str = "") -> Join:
    """Return the system that a launch makes, with what is known of each node.

    Args:
        launched: what would start.
        workspace: with the parameter files.
        library: the node files.
        given: the ROS 2 distribution, where the caller states it.
    """
    placing = Placing(launched, workspace, library)
    distro = distribution(launched.variables, given)
    system = System(protocol=PROTOCOL)
    result = Join(launched, workspace, placing, distro, system)
    waiting = list(placing.nodes)
    numbers: dict[str, int] = {}
    while waiting:
        placed = waiting.pop(0)
        joined = JoinedNode(placed, _filled(placed, library, distro))
        add_configured(placed, joined.filled, launched, workspace)
        system.notes += joined.filled.notes
        waiting[:0] = placing.inside(placed, joined.filled)
        _add(joined, system, numbers)
        result.nodes.append(joined)
    anywhere = any(node.opaque for node in result.nodes) or placing.unknown or placing.undecided
    partly = {node.placed.address for node in result.nodes if not node.complete}
    doubtful = {each.type for node in result.nodes for each, _, _ in node.endpoints if each.doubtful}
    for endpoint in system.endpoints:
        topic, own = endpoint.topic or "", endpoint.participant
        if anywhere or endpoint.type in doubtful or any(above in partly and above != own for above in _above(topic)):
            endpoint.external = True  # its partner may be a node that is not known, or an endpoint of it
    _say_once(system)
    if not distro:
        _assume_distribution(result, library)
    for name, data in (*launched.files.items(), *library.sources.items()):
        system.sources.setdefault(name, data)
    return result


def _assume_distribution(found: Join, library: Library) -> None:
    """Note the distributions for which all node files hold that endpoints come from."""
    every = tuple(DISTRO.domain.format(each) for each in DISTRO.domain.candidates())
    held = set(every)
    for node in found.nodes:
        file = node.placed.file
        if file is not None and node.endpoints and library.fit(file, "") is None:
            held &= set(distributions([file])) or held
    if held < set(every):
        found.system.assumed[f"{PROTOCOL}.{DISTRO.name}"] = tuple(each for each in every if each in held)


def _above(topic: str) -> Iterator[str]:
    """Yield the names that a topic may be private to, the nearest first."""
    while topic := topic.rpartition("/")[0]:
        yield topic


def _say_once(system: System) -> None:
    """Let policies that are not known be notes of the join where no verdict in this system depends on them."""
    roles: dict[str | None, set[Role]] = {}
    for endpoint in system.endpoints:
        roles.setdefault(endpoint.topic, set()).add(endpoint.role)
    for endpoint in system.endpoints:
        if len(roles[endpoint.topic]) == 1:
            for policy, setting in endpoint.settings.items():
                if setting.unknown and not setting.reported:
                    endpoint.settings[policy] = replace(setting, reported=UNKNOWN_POLICY)


def _filled(placed: Placed, library: Library, distro: str) -> FilledNode:
    """Return the endpoints of a node: of its distribution, or what all distributions of its file agree on."""
    file = placed.file
    if file is None:
        return FilledNode()
    versions = distributions([file])
    if not versions:
        return placed.filled(library, distro)
    fit = library.fit(file, distro)
    if fit is not None:
        return placed.filled(library, distro or fit.distro)
    if distro and distro not in versions:
        unknown = Unknown(f"its node file is for {' and '.join(versions)}, not for {distro}", placed.place)
        return FilledNode(gaps=[unknown])
    if distro:
        return placed.filled(library, distro)
    return agreed({each: placed.filled(library, each) for each in versions})


def _add(joined: JoinedNode, system: System, numbers: dict[str, int]) -> None:
    """Add the participant and the endpoints of a node."""
    placed = joined.placed
    identity = placed.address
    if identity in system.participants:
        identity = numbered(identity, numbers)
        while identity in system.participants:
            identity = numbered(placed.address, numbers)
    system.participants[identity] = Participant(identity, PROTOCOL, _options(placed), place=placed.place)
    joined.overrides = overrides_of(placed.given())
    for rule, reason in ((placed.facts and placed.facts.get(form.ACCEPT)) or {}).items():
        system.accept.append(Acceptance(rule, reason.value, endpoint=f"{identity}/*", place=reason.place))
    for each in joined.filled.endpoints:
        rules = placed.process.rules if each.own_node else [*placed.own, *placed.rules]
        namespace = placed.process.namespace if each.own_node else placed.namespace
        named = applied(each.name, namespace, placed.name, rules)
        if named.rule is not None:
            joined.used.append(named.rule)
            if each.direction.startswith("action"):
                unknown = Unknown(
                    "whether a remap renames an action depends on the version of rcl_action", named.rule.place
                )
                named = named._replace(full=unknown)
        endpoint = None
        if isinstance(named.full, str):
            endpoint = _endpoint(each, named.full, joined, identity, numbers)
            endpoint.place = _place(each, named, placed)
            system.endpoints.append(endpoint)
        joined.endpoints.append((each, named, endpoint))


def _place(each: Filled, named: Named, placed: Placed) -> Place:
    """Return what decides the name of an endpoint: a remap, a parameter, else the line that starts the node."""
    if named.rule is not None:
        return named.rule.place
    learned = placed.file is not None and placed.file.sources and each.place.source.startswith(placed.file.sources)
    return each.named_at or each.decided_at or (each.place if learned else placed.place)


def _options(placed: Placed) -> Settings:
    """Return the options that the environment of a node states, and whether it is a bridge, which ignores what it publishes."""
    found: Settings = {}
    if placed.facts is not None and placed.facts.get(form.CONFIGURED_BY) == "gz_bridge":
        found["bridge"] = Setting(placed.address, placed.place, derived=True)
    for name, option in _ENVIRONMENT.items():
        value = placed.instance.environment.get(name)
        if isinstance(value, str):
            found[option] = Setting(value, placed.place, derived=True)
        elif value is not None and option not in _ASSUMED:
            found[option] = Setting("", placed.place, f"the launch leaves `{name}` open")
    return found


def _endpoint(each: Filled, full: str, joined: JoinedNode, participant: str, numbers: dict[str, int]) -> Endpoint:
    kind, role = form.KINDS[each.direction]
    identity = endpoint_id(participant, role if kind == "message" else kind, full)
    made = Endpoint(
        id=numbered(identity, numbers),
        role=role,
        topic=full,
        participant=participant,
        settings=dict(each.settings),
        profiles=(ProfileRef(each.preset, each.decided_at or each.place),) if each.preset else (),
        type=each.type or None,
        kind=kind,
        external=each.optional,
        dialect=each.dialect,
        room=each.room,
    )
    if not each.own_node:
        for override in joined.overrides:
            setting = override.setting(each, role, full)
            if setting is not None:
                made.overlay[override.policy] = setting
                override.used = True
    return made
