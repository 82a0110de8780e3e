"""XML and YAML launch files as actions; both languages have the same tags."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, SequenceNode
from cqos_core.model.problems import InputError
from cqos_core.model.settings import Place
from cqos_core.model.source import Source
from cqos_core.packs.document_importer import only_document
from cqos_ros2_workspace.launch.entities import Action
from cqos_ros2_workspace.launch.substitution_text import parse_text
from cqos_ros2_workspace.launch.values import Unknown

_MOST_TAGS: Final = 20_000
_DEEPEST: Final = 40


@dataclass(slots=True)
class Tag:
    """One element of XML, or one entry of YAML."""

    name: str
    place: Place
    attributes: dict[str, str] = field(default_factory=dict)
    children: list[Tag] = field(default_factory=list)

    def text(self, name: str) -> Any:
        """Return an attribute with its substitutions, None where it is not stated."""
        value = self.attributes.get(name)
        return None if value is None else parse_text(value, self.place)

    def named(self, name: str) -> list[Tag]:
        """Return the children of a name."""
        return [child for child in self.children if child.name == name]


def read_xml(path: str, data: bytes) -> list[Any]:
    """Return the actions of an XML launch file; one unknown part with the cause where it is none."""
    from cqos_core.importers.xml_source import elements, local, parse_xml

    try:
        root = parse_xml(Source(path, data), _MOST_TAGS)
    except InputError as error:
        return [Unknown(problem.message, problem.place or Place(path)) for problem in error.problems]
    if local(root) != "launch":
        return [Unknown(f"this is no launch file: its root is `{local(root)[:40]}`, not `launch`", Place(path, 1))]

    def tag(element: Any, depth: int) -> Tag:
        found = Tag(
            local(element), Place(path, element.sourceline), {str(k): str(v) for k, v in element.attrib.items()}
        )
        below = [*elements(element)]
        found.children = [tag(child, depth + 1) for child in below] if depth < _DEEPEST else []
        if below and not found.children:
            found.children = [Tag("nested too deep", found.place)]
        return found

    return actions(tag(root, 0).children)


def read_yaml(path: str, data: bytes) -> list[Any]:
    """Return the actions of a YAML launch file; one unknown part with the cause where it is none."""
    reading = SourceReading(Source(path, data), [], [])
    try:
        root = only_document(reading, repeated="last")
    except InputError as error:
        return [Unknown(problem.message, problem.place or Place(path)) for problem in error.problems]
    if reading.problems:
        return [Unknown(problem.message, problem.place or Place(path)) for problem in reading.problems]
    _, entities = root.entries.get("launch", (None, None)) if isinstance(root, MappingNode) else (None, None)
    if not isinstance(entities, SequenceNode):
        return [Unknown("this is no launch file: it has no list `launch`", Place(path, 1))]
    return actions(_entries(entities, path))


def _entries(nodes: SequenceNode, path: str) -> list[Tag]:
    found = []
    for item in nodes.items:
        if isinstance(item, MappingNode):
            found += [_entry(key, value, path) for key, value in item.entries.values()]
    return found


def _entry(key: ScalarNode, value: Node, path: str) -> Tag:
    tag = Tag(key.text, Place(path, key.line, key.column))
    if isinstance(value, SequenceNode):
        tag.children = _entries(value, path)
        return tag
    if isinstance(value, ScalarNode):
        tag.attributes["value"] = value.text
        return tag
    for name, (inner, each) in value.entries.items():
        if isinstance(each, ScalarNode):
            tag.attributes[name] = each.text
        elif name == "children" and isinstance(each, SequenceNode):
            tag.children += _entries(each, path)
        elif isinstance(each, SequenceNode) and all(isinstance(item, ScalarNode) for item in each.items):
            texts = [item.text for item in each.items if isinstance(item, ScalarNode)]
            tag.attributes[name] = f"[{', '.join(texts)}]"
        elif isinstance(each, SequenceNode):
            tag.children += [_entry(inner, item, path) for item in each.items]
        else:
            tag.children.append(_entry(inner, each, path))
    return tag


def actions(tags: list[Tag]) -> list[Any]:
    """Return the actions of tags."""
    return [action(tag) for tag in tags]


def action(tag: Tag) -> Any:
    """Return the action of a tag, an unknown part for one that no library of ROS 2 has."""
    make = _TAGS.get(tag.name.replace("_", "-"))
    if make is None:
        return Unknown(f"there is no tag `{tag.name[:40]}` that C-QoS knows", tag.place)
    kind, fields = make(tag)
    made = Action(kind, {name: value for name, value in fields.items() if value is not None}, tag.place)
    for name, condition in (("if", "IfCondition"), ("unless", "UnlessCondition")):
        if name in tag.attributes:
            made.fields["condition"] = Action(condition, {"predicate": tag.text(name)}, tag.place)
    return made


_Made = tuple[str, dict[str, Any]]


def _plain(kind: str, **attributes: str) -> Callable[[Tag], _Made]:
    """Return what makes an action whose arguments are attributes, by the name of the argument."""
    return lambda tag: (kind, {name: tag.text(attribute) for name, attribute in attributes.items()})


def _nested(kind: str, **attributes: str) -> Callable[[Tag], _Made]:
    def made(tag: Tag) -> _Made:
        fields = {name: tag.text(attribute) for name, attribute in attributes.items()}
        return kind, {**fields, "actions": actions([child for child in tag.children if child.name != "keep"])}

    return made


def _group(tag: Tag) -> _Made:
    kind, fields = _nested("GroupAction", scoped="scoped", forwarding="forwarding")(tag)
    kept = {child.attributes.get("name", ""): child.text("value") for child in tag.named("keep")}
    return kind, {**fields, "launch_configurations": kept}


def _include(tag: Tag) -> _Made:
    given = [(child.text("name"), child.text("value")) for child in tag.children if child.name in {"arg", "let"}]
    source = Action("AnyLaunchDescriptionSource", {"location": tag.text("file")}, tag.place)
    return "IncludeLaunchDescription", {"source": source, "launch_arguments": given}


def _remaps(tag: Tag) -> list[Any]:
    return [(child.text("from"), child.text("to")) for child in tag.named("remap")]


def _parameters(tag: Tag) -> list[Any]:
    found: list[Any] = []
    for child in tag.named("param"):
        if "from" in child.attributes:
            fields = {"param_file": child.text("from"), "allow_substs": child.text("allow_substs") or "false"}
            found.append(Action("ParameterFile", fields, child.place))
        else:
            found.append(_parameter(child))
    return found


def _parameter(tag: Tag) -> dict[str, Any]:
    inner = tag.named("param")
    if inner:
        value: Any = {name: each for child in inner for name, each in _parameter(child).items()}
    else:
        value = _value(tag)
    return {tag.attributes.get("name", ""): value}


def _value(tag: Tag) -> Action:
    """Return the value of a parameter, which has the type that its text has in YAML unless one is stated."""
    return Action("ParameterValue", {"value": tag.text("value"), "value_type": tag.attributes.get("type")}, tag.place)


def _node(kind: str) -> Callable[[Tag], _Made]:
    def made(tag: Tag) -> _Made:
        fields = {
            "package": tag.text("pkg"),
            "executable": tag.text("exec"),
            "plugin": tag.text("plugin"),
            "name": tag.text("name") or tag.text("node-name"),
            "namespace": tag.text("namespace"),
            "target_container": tag.text("target"),
            "remappings": _remaps(tag),
            "parameters": _parameters(tag),
            "arguments": _words(tag, "args"),
            "ros_arguments": _words(tag, "ros_args"),
            "autostart": tag.text("autostart"),
            "additional_env": {child.attributes.get("name", ""): child.text("value") for child in tag.named("env")},
        }
        inside = [action(child) for child in tag.children if child.name.replace("_", "-") in _COMPONENTS]
        return kind, {**fields, "composable_node_descriptions": inside or None}

    return made


def _words(tag: Tag, name: str) -> list[Any] | None:
    """Return a command line in words; a part that is not known stays within its word."""
    text = tag.text(name)
    if text is None:
        return None
    words: list[list[Any]] = [[]]
    for part in text:
        if not isinstance(part, str):
            words[-1].append(part)
            continue
        for number, each in enumerate(part.split(" ")):
            if number:
                words.append([])
            if each:
                words[-1].append(each)
    return [word for word in words if word]


_COMPONENTS: Final = frozenset(("composable-node", "composable-lifecycle-node"))
_TAGS: Final[dict[str, Callable[[Tag], _Made]]] = {
    "append-env": _plain("AppendEnvironmentVariable", name="name", value="value"),
    "arg": _plain("DeclareLaunchArgument", name="name", default_value="default"),
    "composable-lifecycle-node": _node("ComposableLifecycleNode"),
    "composable-node": _node("ComposableNode"),
    "executable": _plain("ExecuteProcess", cmd="cmd", name="name"),
    "group": _group,
    "include": _include,
    "let": _plain("SetLaunchConfiguration", name="name", value="value"),
    "lifecycle-node": _node("LifecycleNode"),
    "lifecycle-transition": lambda _tag: ("LifecycleTransition", {}),
    "load-composable-node": _node("LoadComposableNodes"),
    "log": lambda _tag: ("LogInfo", {}),
    "node": _node("Node"),
    "node-container": _node("ComposableNodeContainer"),
    "push-ros-namespace": _plain("PushRosNamespace", namespace="namespace"),
    "reset": lambda _tag: ("ResetLaunchConfigurations", {}),
    "reset-env": lambda _tag: ("ResetEnvironment", {}),
    "ros-timer": _nested("ROSTimer", period="period"),
    "set-env": _plain("SetEnvironmentVariable", name="name", value="value"),
    "set-parameter": lambda tag: ("SetParameter", {"name": tag.text("name"), "value": _value(tag)}),
    "set-parameters-from-file": _plain("SetParametersFromFile", filename="filename"),
    "set-remap": _plain("SetRemap", src="from", dst="to"),
    "set-ros-log-dir": lambda _tag: ("SetROSLogDir", {}),
    "set-use-sim-time": lambda tag: ("SetUseSimTime", {"value": _value(tag)}),
    "shutdown": lambda _tag: ("Shutdown", {}),
    "timer": _nested("TimerAction", period="period"),
    "unset-env": _plain("UnsetEnvironmentVariable", name="name"),
    "unset": _plain("UnsetLaunchConfiguration", name="name"),
}
