"""Writes a ROS 2 package in Python: one node for each participant, a skeleton with its endpoints, events, timers and order."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final
from xml.sax.saxutils import escape, quoteattr

from cqos_core.model.problems import InvalidValueError
from cqos_core.model.system import PUBLISHER, System
from cqos_core.packs.export import ExportContext, Exported
from cqos_ros2.exporters.code import comment_text, identifier, values_of
from cqos_ros2.exporters.order import followers
from cqos_ros2.exporters.rclpy import imports, profile_arguments
from cqos_ros2.exporters.values import Value, kind_of, ros_endpoints
from cqos_ros2.policies import DEADLINE, RMW

if TYPE_CHECKING:
    from cqos_core.files.export import ExportEndpoint
    from cqos_core.resolving.resolved_endpoint import Resolved

_TYPE: Final = re.compile(r"([A-Za-z]\w*)/(msg|srv|action)/([A-Za-z]\w*)")
_STAND_INS: Final = {
    "message": "std_msgs/msg/String",
    "service_server": "std_srvs/srv/Trigger",
    "service_client": "std_srvs/srv/Trigger",
    "action_server": "example_interfaces/action/Fibonacci",
    "action_client": "example_interfaces/action/Fibonacci",
}
_NAME: Final = re.compile(r"[A-Za-z_]\w*")
_EVENTS: Final = {"deadline": "deadline", "liveliness": "liveliness_lease_duration"}
_VERSION: Final = "0.1.0"


@dataclass(frozen=True, slots=True)
class _Part:
    """One endpoint of a node.

    Attributes:
        id: in the system.
        name: of its attribute and methods.
        kind: ``publisher``, ``subscription``, ``service_server``, …
        period: between two samples in seconds; None where none is stated.
        events: for which the node has callbacks.
    """

    id: str
    name: str
    kind: str
    topic: str
    type: str
    values: Mapping[str, Value]
    period: float | None = None
    events: tuple[str, ...] = ()


@dataclass(slots=True)
class _Node:
    """One node.

    Attributes:
        module: its file, and its executable.
    """

    module: str
    name: str
    namespace: str
    parts: list[_Part] = field(default_factory=list)
    taken: set[str] = field(default_factory=set)


def write(system: System, context: ExportContext) -> Exported:
    """Write the files of a package."""
    notes: dict[str, None] = {}
    nodes: dict[str, _Node] = {}
    modules: set[str] = set()
    package = identifier(system.name or "design", set())
    for each in ros_endpoints(system, context, notes):
        if context.wants(each.id):
            _add(each, system, nodes, modules, notes)
    after = followers(system)
    files = {f"{package}/{node.module}.py": _module(node, after) for node in nodes.values()}
    packages = {part.type.partition("/")[0] for node in nodes.values() for part in node.parts}
    files |= _around(package, list(nodes.values()), packages, system.name)
    files = {name: files[name] for name in sorted(files)}
    text = "".join(f"# ==> {name} <==\n{content}\n" for name, content in files.items())
    count = sum(len(node.parts) for node in nodes.values())
    return Exported(text if count else "", count, tuple(notes), files if count else {})


def _add(
    each: ExportEndpoint, system: System, nodes: dict[str, _Node], modules: set[str], notes: dict[str, None]
) -> None:
    part = each.parts[0]
    endpoint = part.endpoint
    whole = each.whole is not None
    topic = part.key if whole and part.key else endpoint.topic
    if topic is None:
        notes[f"`{each.id}` has no topic, so it is left out"] = None
        return
    address = part.pack.topic_matching.address(endpoint.participant, part.participant.texts)
    if address not in nodes:
        space, _, last = address.rpartition("/")
        name = last if _NAME.fullmatch(last) else identifier(last, set())
        if name != last:
            notes[f"`{last}` is no name of a node, so it is called `{name}`"] = None
        nodes[address] = _Node(identifier(address, modules), name, space)
    node = nodes[address]
    # The parts of services and actions have types of their own.
    type_name = (endpoint if each.endpoint.kind == "message" else each.endpoint).type or ""
    stand_in = _STAND_INS[each.endpoint.kind]
    if _TYPE.fullmatch(type_name) is None:
        notes[f"`{each.id}`, {kind_of(each)}, states no type of ROS 2: {stand_in} stands in its place"] = None
        type_name = stand_in
    kind = each.endpoint.kind
    if kind == "message":
        kind = "publisher" if endpoint.role == PUBLISHER else "subscription"
    values = values_of(each, part, notes) if not kind.startswith("action") else {}
    name = identifier(topic, node.taken)
    period = _period(system, endpoint.topic) if kind == "publisher" else None
    events = tuple(event for event, policy in _EVENTS.items() if policy in values)
    if events and _on_zenoh(part):
        notes[f"`{each.id}`: no callback for {' and '.join(events)}: rmw_zenoh calls none (ROS326)"] = None
        events = ()
    node.parts.append(_Part(each.endpoint.id, name, kind, topic, type_name, values, period, events))


def _on_zenoh(part: Resolved) -> bool:
    index = part.pack.find("option", RMW.name)
    return index is not None and part.profile.values[index] == RMW.domain.parse("zenoh")


def _period(system: System, topic: str | None) -> float | None:
    """Return the period that is stated for a topic, in seconds."""
    stated = system.topics.get(topic or "")
    setting = stated.settings.get("period") if stated is not None else None
    if setting is None or setting.unknown:
        return None
    try:
        nanoseconds = DEADLINE.domain.parse(setting.text)
    except InvalidValueError:
        return None
    return int(nanoseconds) / 1e9 if isinstance(nanoseconds, int) and nanoseconds > 0 else None


# The module of a node


def _module(node: _Node, after: Mapping[str, tuple[str, ...]]) -> str:
    names = {part.id: part for part in node.parts}
    used = {policy for part in node.parts for policy in part.values}
    types = sorted({_module_of(part.type) for part in node.parts})
    lines = [f'"""The node {comment_text(node.name)}: a skeleton from its design."""', "", "import rclpy"]
    lines += [f"import {each}" for each in types]
    if any(part.kind.startswith("action") for part in node.parts):
        lines += ["from rclpy.action import ActionClient, ActionServer"]
    lines += [*imports(used, "from rclpy.node import Node"), ""]
    lines += ["try:", "    from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks"]
    lines += [
        "except ImportError:  # Humble",
        "    from rclpy.qos_event import PublisherEventCallbacks, SubscriptionEventCallbacks",
    ]
    lines += [
        "",
        "",
        f"class {_class(node)}(Node):",
        f'    """{comment_text(node.name)}, with the endpoints of the design."""',
        "",
    ]
    space = f", namespace={node.namespace!r}" if node.namespace else ""
    lines += ["    def __init__(self):", f"        super().__init__({node.name!r}{space})"]
    for part in node.parts:
        lines += _created(part)
    starting = [names[each] for each in after.get("", ()) if each in names and names[each].kind == "publisher"]
    lines += [f"        self.start_{part.name} = self.create_timer(0.0, self.begin_{part.name})" for part in starting]
    for part in node.parts:
        lines += _methods(part, [names[each] for each in after.get(part.id, ()) if each in names])
    for part in starting:
        lines += ["", f"    def begin_{part.name}(self):", '        """Do the first step of the design, once."""']
        lines += [f"        self.start_{part.name}.cancel()", f"        self.publish_{part.name}()"]
    lines += _events()
    lines += ["", "", "def main(args=None):", '    """Run the node."""', "    rclpy.init(args=args)"]
    lines += [f"    rclpy.spin({_class(node)}())", "", "", 'if __name__ == "__main__":', "    main()"]
    return "\n".join(lines) + "\n"


def _class(node: _Node) -> str:
    return "".join(word[:1].upper() + word[1:] for word in node.module.split("_") if word) + "Node"


def _module_of(type_name: str) -> str:
    return ".".join(type_name.split("/")[:2])


def _created(part: _Part) -> list[str]:
    """Return the lines that create an endpoint."""
    kind, topic, type_name = part.kind, repr(part.topic), part.type.replace("/", ".")
    if kind.startswith("action"):
        made = "ActionServer" if kind == "action_server" else "ActionClient"
        last = f", self.on_{part.name}" if kind == "action_server" else ""
        return [f"        self.{part.name} = {made}(self, {type_name}, {topic}{last})"]
    profile = f"QoSProfile({', '.join(profile_arguments(part.values)) or 'depth=10'})"
    if kind.startswith("service"):
        call = (
            f"create_service({type_name}, {topic}, self.on_{part.name}"
            if kind == "service_server"
            else f"create_client({type_name}, {topic}"
        )
        return [f"        self.{part.name} = self.{call}, qos_profile={profile})"]
    events = [f"{event}=self.on_{event}" for event in part.events]
    events.append("incompatible_qos=self.on_incompatible_qos")
    if kind == "publisher":
        lines = [
            f"        self.{part.name} = self.create_publisher({type_name}, {topic}, {profile}, event_callbacks=PublisherEventCallbacks({', '.join(events)}))"
        ]
        if part.period is not None:
            lines.append(f"        self.create_timer({part.period!r}, self.publish_{part.name})")
        return lines
    return [
        f"        self.{part.name} = self.create_subscription({type_name}, {topic}, self.on_{part.name}, {profile}, event_callbacks=SubscriptionEventCallbacks({', '.join(events)}))"
    ]


def _methods(part: _Part, after: list[_Part]) -> list[str]:
    """Return the methods of an endpoint; what follows it in the design is called at its end."""
    calls = [f"        self.publish_{each.name}()" for each in after if each.kind == "publisher"]
    if part.kind == "publisher":
        return [
            "",
            f"    def publish_{part.name}(self):",
            f'        """Publish on {comment_text(part.topic)}."""',
            f"        self.{part.name}.publish({part.type.replace('/', '.')}())",
        ]
    if part.kind == "subscription":
        return [
            "",
            f"    def on_{part.name}(self, message):",
            f'        """Take a message of {comment_text(part.topic)}; then do what follows in the design."""',
            "        self.get_logger().debug(f'{message}')",
            *calls,
        ]
    if part.kind == "service_server":
        return [
            "",
            f"    def on_{part.name}(self, request, response):",
            f'        """Answer a request of {comment_text(part.topic)}."""',
            *calls,
            "        return response",
        ]
    if part.kind == "action_server":
        result = f"        return {part.type.replace('/', '.')}.Result()"
        return [
            "",
            f"    def on_{part.name}(self, goal):",
            f'        """Do a goal of {comment_text(part.topic)}."""',
            *calls,
            "        goal.succeed()",
            result,
        ]
    return []


def _events() -> list[str]:
    lines = []
    for name, text in (
        ("deadline", "a deadline was missed"),
        ("liveliness", "liveliness changed"),
        ("incompatible_qos", "a partner has an incompatible quality of service"),
    ):
        lines += [
            "",
            f"    def on_{name}(self, event):",
            f'        """Report that {text}."""',
            f"        self.get_logger().warning(f'{text}: {{event}}')",
        ]
    return lines


# The files around the modules


def _around(package: str, nodes: list[_Node], packages: set[str], name: str) -> dict[str, str]:
    about = escape(name or package)
    depends = "".join(f"  <exec_depend>{each}</exec_depend>\n" for each in sorted({"rclpy", *packages}))
    manifest = (
        f'<?xml version="1.0"?>\n<package format="3">\n  <name>{package}</name>\n  <version>{_VERSION}</version>\n'
        f'  <description>Nodes of the design {about}</description>\n  <maintainer email="owner@example.com">to be named</maintainer>\n'
        f"  <license>TO BE CHOSEN</license>\n{depends}  <export>\n    <build_type>ament_python</build_type>\n  </export>\n</package>\n"
    )
    scripts = "".join(f'            "{node.module} = {package}.{node.module}:main",\n' for node in nodes)
    setup = (
        "from setuptools import setup\n\nsetup(\n"
        f'    name="{package}",\n    version="{_VERSION}",\n    packages=["{package}"],\n    data_files=[\n'
        f'        ("share/ament_index/resource_index/packages", ["resource/{package}"]),\n        ("share/{package}", ["package.xml"]),\n'
        f'        ("share/{package}/launch", ["launch/{package}.launch.xml"]),\n    ],\n'
        f'    install_requires=["setuptools"],\n    entry_points={{\n        "console_scripts": [\n{scripts}        ],\n    }},\n)\n'
    )
    started = "".join(
        f"  <node pkg={quoteattr(package)} exec={quoteattr(node.module)} name={quoteattr(node.name)}{f' namespace={quoteattr(node.namespace)}' if node.namespace else ''}/>\n"
        for node in nodes
    )
    return {
        "package.xml": manifest,
        "setup.py": setup,
        "setup.cfg": f"[develop]\nscript_dir=$base/lib/{package}\n[install]\ninstall_scripts=$base/lib/{package}\n",
        f"resource/{package}": "",
        f"{package}/__init__.py": "",
        f"launch/{package}.launch.xml": f"<launch>\n{started}</launch>\n",
    }
