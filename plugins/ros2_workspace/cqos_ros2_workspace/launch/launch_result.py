"""The result of reading a launch, as data: all that it would start."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterator

    from typing_extensions import Self

    from cqos_core.model.settings import Place
    from cqos_ros2_workspace.launch.values import Guards, Text, Unknown

InstanceKind: TypeAlias = Literal["node", "lifecycle_node", "container", "component", "process"]


class MadeFile(str):
    """The path of a parameter file that is rewritten before a node reads it; the text is that of the file it is made of.

    Attributes:
        rewrites: values by the key that they replace, anywhere in the file.
        root_key: the namespace that the content is put under.
        replacements: texts and what takes their place.
        value_rewrites: values by the text of the value that they replace, anywhere in the file.
        cause: why the result is not known, beside the file itself; empty: it is.
    """

    __slots__ = ("cause", "replacements", "rewrites", "root_key", "value_rewrites")

    rewrites: dict[str, Any]
    root_key: Any
    replacements: dict[str, Any]
    value_rewrites: dict[str, Any]
    cause: str

    def __new__(
        cls,
        path: str,
        rewrites: dict[str, Any],
        root_key: Any,
        replacements: dict[str, Any],
        value_rewrites: dict[str, Any],
    ) -> Self:
        """Return the path of a file that is made of the one at ``path``."""
        made = super().__new__(cls, path)
        made.value_rewrites = value_rewrites
        made.rewrites, made.root_key, made.replacements = rewrites, root_key, replacements
        return made

    def changes(self) -> tuple[Any, ...]:
        """Return all that is put into the file."""
        return self.rewrites, self.root_key, self.replacements, self.value_rewrites


@dataclass(frozen=True, slots=True)
class ParameterFile:
    """A parameter file that a node is given.

    Attributes:
        substitutions: ``$(…)`` in the file are expanded.
    """

    path: Text
    substitutions: bool
    place: Place


@dataclass(frozen=True, slots=True)
class ParameterValues:
    """Parameters that a launch file states itself, by their full names.

    Attributes:
        rule: they are given as rules `-p`, which hold for every node of the process.
    """

    values: dict[str, Any]
    place: Place
    rule: bool = False


Parameters: TypeAlias = "ParameterFile | ParameterValues | Unknown"


@dataclass(slots=True)
class Instance:
    """A node, container, component or other process that would start.

    Attributes:
        kind: what it is; ``process`` for a command that is no node.
        executable: the class of a component.
        name: None where the launch file states none, so that the node has the name in its code.
        namespace: absolute, or empty where the launch file states none.
        parameters: in the order in which they are applied; a later one wins.
        container: the container that a component is loaded into.
        guards: what has to hold for it to start.
        after: the event that it waits for; empty: it starts at once.
        via: the places of the includes that lead to it, the outermost first.
    """

    kind: InstanceKind
    place: Place
    package: Text = ""
    executable: Text = ""
    name: Text | None = None
    namespace: Text = ""
    remaps: list[tuple[Text, Text]] = field(default_factory=list)
    parameters: list[Parameters] = field(default_factory=list)
    arguments: list[Text] = field(default_factory=list)
    environment: dict[str, Text] = field(default_factory=dict)
    container: Text | None = None
    guards: Guards = ()
    after: str = ""
    via: tuple[Place, ...] = ()

    def values(self) -> Iterator[Any]:
        """Yield all values of it, for what is not known of them."""
        yield from (self.package, self.executable, self.name, self.namespace, self.container)
        yield [*self.remaps]
        yield [*self.arguments]
        yield self.environment
        for each in self.parameters:
            if isinstance(each, ParameterFile):
                yield each.path
                if isinstance(each.path, MadeFile):
                    yield from each.path.changes()
            else:
                yield each.values if isinstance(each, ParameterValues) else each


@dataclass(slots=True)
class Argument:
    """A launch argument that a file declares.

    Attributes:
        source: where its value comes from.
    """

    name: str
    value: Any
    source: Literal["given", "default", "includer", "none"]
    place: Place


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that is not known of the whole launch: an include that cannot be read, an action that is not understood.

    Attributes:
        about: what it is: ``include``, ``action``, ``condition``, ``file``, ``argument``, ``limit``.
        what: the include or action, as a reader knows it.
        package: the package that an include names and the workspace does not have; empty: it is something else.
    """

    about: str
    what: str
    cause: str
    place: Place | None
    guards: Guards = ()
    package: str = ""


@dataclass(slots=True)
class Launched:
    """What an entry point would start.

    Attributes:
        entry: the file.
        root: the folder of the workspace.
        arguments: those that the entry point and its includes declare, by name; the first declaration holds.
        variables: what the launch sets in the environment, by name.
        assumed: variables of the environment that files read and nothing sets, with the default that is taken.
        files: everything that was read.
        emits: whether it emits events that may activate lifecycle nodes.
    """

    entry: str
    root: str
    arguments: dict[str, Argument] = field(default_factory=dict)
    instances: list[Instance] = field(default_factory=list)
    remarks: list[Remark] = field(default_factory=list)
    variables: dict[str, Any] = field(default_factory=dict)
    assumed: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    emits: bool = False
