"""The parameters of a node: files and values of a launch, put together as rcl and launch_ros do.

rcl keeps one section for each pattern of node names, in the order of their first appearance on the command line. A later section wins
(rcl_yaml_param_parser: find_node; rclcpp: parameter_map_from). So `/**` of a later file wins over the section with the
node's name, unless an earlier file has `/**` before that. A component gets its parameters in a request: the later of a list wins
(launch_ros: to_parameters_list).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode
from cqos_core.model.settings import Place
from cqos_ros2_workspace.launch.launch_result import MadeFile, ParameterFile, ParameterValues
from cqos_ros2_workspace.launch.parameter_files import DEEPEST, EVERY, SECTION, covers, plain, sections, tree_of
from cqos_ros2_workspace.launch.values import Unknown, first_unknown
from cqos_ros2_workspace.nodes.endpoint_templates import Parameter

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.importers.tree import Node
    from cqos_ros2_workspace.launch.launch_result import Instance, Launched, Parameters
    from cqos_ros2_workspace.launch.workspace import Workspace

_MOST: Final = 20_000
_Stated = list[tuple[str, dict[str, Parameter]]]
"""The sections of a parameter file: parameters by pattern of node names."""
_KEPT: Final = 200


@dataclass(slots=True)
class Sections:
    """Parameters by pattern of node names, in the order of the patterns.

    Attributes:
        unknown: why further parameters may be given that are not known; None where all are known.
    """

    found: dict[str, dict[str, Parameter]] = field(default_factory=dict)
    unknown: Unknown | None = None

    def add(self, pattern: str, values: dict[str, Parameter]) -> None:
        """Put values into the section of a pattern."""
        self.found.setdefault(pattern if pattern.startswith("/") else f"/{pattern}", {}).update(values)

    def of(self, full_name: str) -> dict[str, Parameter]:
        """Return the parameters of a node."""
        values: dict[str, Parameter] = {}
        for pattern, section in self.found.items():
            if covers(pattern, full_name):
                values.update(section)
        return values


class ParameterReader:
    """Reads the parameter files of one launch, each once."""

    def __init__(self, launched: Launched, workspace: Workspace) -> None:
        """Read files of ``workspace``; what is read goes to the files of ``launched``."""
        self._launched = launched
        self._workspace = workspace
        self._known: dict[object, _Stated | Unknown] = {}

    def of_process(self, instance: Instance) -> Sections:
        """Return the parameters on the command line of a process."""
        sections = Sections()
        own = _own_pattern(instance)
        for each, read in self._read(instance.parameters, sections):
            if isinstance(each, ParameterValues):
                sections.add(EVERY if each.rule else own, _given(each))
            for pattern, values in read:
                sections.add(pattern, values)
        return sections

    def of_component(self, parameters: Sequence[Parameters], full_name: str) -> Sections:
        """Return the parameters of the request that loads a component."""
        sections = Sections()
        for each, read in self._read(parameters, sections):
            if isinstance(each, ParameterValues):
                sections.add(full_name, _given(each))
            for wanted in (EVERY, full_name):
                for pattern, values in read:
                    if pattern.strip("/") == wanted.strip("/"):
                        sections.add(full_name, values)
        return sections

    def _read(self, parameters: Sequence[Parameters], sections: Sections) -> Iterator[tuple[Parameters, _Stated]]:
        """Yield parameters with what their file states; those that are not known go to ``sections``."""
        for each in parameters:
            read = self.file(each) if isinstance(each, ParameterFile) else each
            if isinstance(read, Unknown):
                sections.unknown = sections.unknown or read
            else:
                yield each, read if isinstance(read, list) else []

    def file(self, given: ParameterFile) -> _Stated | Unknown:
        """Return the sections of a file, or why they are not known."""
        path = given.path
        key: object = path
        if isinstance(path, MadeFile):
            key = (str(path), repr(path.changes()), path.cause)
        elif not isinstance(path, str):
            return first_unknown(path) or Unknown(
                "the parameter file depends on what the launch leaves open", given.place
            )
        if key not in self._known and len(self._known) < _KEPT:
            self._known[key] = self._file(path, given)
        return self._known[key] if key in self._known else Unknown("there are too many parameter files", given.place)

    def _file(self, path: str, given: ParameterFile) -> _Stated | Unknown:
        real = self._workspace.find(str(path), given.place)
        data = real if isinstance(real, Unknown) else self._workspace.read(real, given.place)
        if isinstance(real, Unknown) or isinstance(data, Unknown):
            return data  # type: ignore[return-value] # why it is not found, or not read
        self._launched.files.setdefault(real, data)
        if isinstance(path, MadeFile):
            unknown = (
                Unknown(path.cause, given.place) if path.cause else first_unknown([path.root_key, path.replacements])
            )
            if unknown is not None:
                return unknown
            for old, new in path.replacements.items():
                data = data.replace(old.encode(), str(new).encode(errors="replace"))
        root = tree_of(data, real, given.place)
        if isinstance(root, Unknown):
            return root
        if not isinstance(root, MappingNode):
            return Unknown("the parameter file is no map of nodes", Place(real, 1))
        rewrites, values = (path.rewrites, path.value_rewrites) if isinstance(path, MadeFile) else ({}, {})
        rewriting = _Rewriting(rewrites, values, given.place)
        read = _Read(real, given.substitutions, rewriting.put_in)
        stated = sections(rewriting.rewritten(root), "", Place(real, 1))
        found = [(pattern, dict(_leaves(node, "", read))) for pattern, _, node in stated]
        return _made(found, path, rewriting) if isinstance(path, MadeFile) else found


def _own_pattern(instance: Instance) -> str:
    """Return the section that launch_ros writes values of a launch file to (Node: _create_params_file_from_dict)."""
    name, space = instance.name, instance.namespace
    if isinstance(name, str) and name and isinstance(space, str) and space:
        return f"{space.rstrip('/')}/{name}"
    return EVERY


def _given(each: ParameterValues) -> dict[str, Parameter]:
    return {name: Parameter(value, each.place) for name, value in each.values.items()}


class _Read(NamedTuple):
    """A parameter file that is read: its path, whether `$(…)` in it is expanded, and values that are put in by identity of their nodes."""

    source: str
    substitutions: bool
    put_in: dict[int, Parameter]


def _leaves(node: Node, above: str, read: _Read, depth: int = 0) -> Iterator[tuple[str, Parameter]]:
    """Yield parameters by their full names; nested ones are joined with dots."""
    if not isinstance(node, MappingNode) or depth > DEEPEST:
        return
    for count, (name, (key, value)) in enumerate(node.entries.items()):
        if count > _MOST:
            return
        if isinstance(value, MappingNode):
            yield from _leaves(value, f"{above}{name}.", read, depth + 1)
            continue
        if id(value) in read.put_in:
            yield f"{above}{name}", read.put_in[id(value)]
            continue
        place = Place(read.source, key.line, key.column)
        known = plain(value)
        if read.substitutions and isinstance(known, str) and "$(" in known:
            known = Unknown("a substitution in a parameter file is not followed", place)
        yield f"{above}{name}", Parameter(known, place)


class _Rewriting:
    """Replaces values by key, by the whole path of keys, or by their text, as ``RewrittenYaml`` of nav2_common does.

    Attributes:
        put_in: the values that were put in, by the identity of their nodes.
        used: the rewrites that took effect.
    """

    def __init__(self, rewrites: dict[str, Any], values: dict[str, Any], place: Place) -> None:
        """Put in ``rewrites`` by key and ``values`` by the text of the old value, which are stated at ``place``."""
        self.rewrites = rewrites
        self.values = values
        self.place = place
        self.put_in: dict[int, Parameter] = {}
        self.used: set[str] = set()
        self._kept: list[Node] = []

    def rewritten(self, node: Node, above: str = "", depth: int = 0) -> Node:
        """Return a node with values replaced; without rewrites, the node itself."""
        if self.values and isinstance(node, (ScalarNode, SequenceNode)):
            return self._replaced(node)
        if not isinstance(node, MappingNode) or not (self.rewrites or self.values) or depth > DEEPEST:
            return node
        made = MappingNode(node.line, node.column, end=node.end)
        for name, (key, value) in node.entries.items():
            path = f"{above}{name}"
            which = next((each for each in (path, name) if each in self.rewrites), None)
            if which is None:
                made.entries[name] = (key, self.rewritten(value, f"{path}.", depth + 1))
            else:
                self.used.add(which)
                made.entries[name] = (key, self._value(self.rewrites[which], key))
        return made

    def _replaced(self, node: ScalarNode | SequenceNode) -> Node:
        """Return a value, or a list of values, with those replaced whose text is rewritten."""
        old = plain(node)
        new = [self._new(each) for each in old] if isinstance(old, list) else self._new(old)
        return node if new == old else self._put(new, node)

    def _new(self, value: Any) -> Any:
        return _converted(self.values.get(str(value), value))

    def _value(self, value: Any, key: ScalarNode) -> ScalarNode:
        return self._put(self._new(_converted(value)), key)

    def _put(self, value: Any, at: ScalarNode | SequenceNode) -> ScalarNode:
        node = ScalarNode("", at.line, at.column, plain=False)
        self.put_in[id(node)] = Parameter(value, self.place)
        self._kept.append(node)
        return node


def _converted(value: Any) -> Any:
    """Return the flag that a text is, else the value (RewrittenYaml: convert)."""
    return {"true": True, "false": False}.get(value.lower(), value) if isinstance(value, str) else value


def _made(found: _Stated, path: MadeFile, rewriting: _Rewriting) -> _Stated:
    """Return the sections as ``RewrittenYaml`` writes them: keys sorted, below the root key."""
    above = f"/{path.root_key.strip('/')}" if isinstance(path.root_key, str) and path.root_key.strip("/") else ""
    made = [(f"{above}{pattern}", values) for pattern, values in sorted(found, key=lambda each: each[0])]
    for name, value in path.rewrites.items():
        node, section, parameter = name.partition(f".{SECTION}.")
        if section and name not in rewriting.used:
            unknown = Unknown("a parameter that RewrittenYaml adds, which not every version does", rewriting.place)
            kept = value if isinstance(value, Unknown) else unknown
            made.append((f"{above}/{node.replace('.', '/')}", {parameter: Parameter(kept, rewriting.place)}))
    return made
