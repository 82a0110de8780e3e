"""The form of a node file, `*.node.yaml`: every key with its shape and what it is for. The reader and the JSON schema follow from it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.importers.document_form import Form, Key, ListOf, MapOf, OneOrMore
from cqos_core.importers.source_reading import listed
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode, whole_number
from cqos_core.importers.value_types import FLAG, SCALARS, SETTING, TEXT, TEXTS, Scalar, ValueType, one_of
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_ros2_workspace.launch.parameter_files import plain

if TYPE_CHECKING:
    from cqos_core.importers.source_reading import SourceReading
    from cqos_core.importers.tree import Node
    from cqos_core.importers.value_types import Schema
    from cqos_core.model.settings import Place
    from cqos_core.model.system import Role

VERSION: Final = 1
DISTRO: Final = "distro"
"""The subject of a condition that stands for the ROS 2 distribution; all others are parameters."""
OVERRIDABLE_POLICIES: Final = (
    "history",
    "depth",
    "reliability",
    "durability",
    "deadline",
    "lifespan",
    "liveliness",
    "liveliness_lease_duration",
    "avoid_ros_namespace_conventions",
)


class Test(NamedTuple):
    """One part of a condition: whether a parameter, or the distribution, has one of some values.

    Attributes:
        negated: it must have none of them.
    """

    subject: str
    values: tuple[str, ...]
    negated: bool
    place: Place


class Given(NamedTuple):
    """A value as Python has it: text, number, flag, list or map."""

    value: Any


class _Conditions(ValueType["tuple[Test, ...]"]):
    """A map from parameters to the values that they must have."""

    def __init__(self) -> None:
        super().__init__("a map from parameters to values")

    def read(self, node: Node, reading: SourceReading, name: str) -> tuple[Test, ...] | None:
        """Take every part."""
        if not isinstance(node, MappingNode):
            self.refuse(node, reading, name, "write `when: {PARAMETER: VALUE}`")
            return None
        found = []
        for subject, (key, value) in node.entries.items():
            negated = isinstance(value, MappingNode) and set(value.entries) == {"not"}
            wanted = value.entries["not"][1] if negated and isinstance(value, MappingNode) else value
            items = wanted.items if isinstance(wanted, SequenceNode) else [wanted]
            texts = tuple(each.text for each in items if isinstance(each, ScalarNode))
            if len(texts) != len(items) or not texts:
                self.refuse(value, reading, subject, "write a value, a list of values, or `{not: VALUE}`")
            else:
                found.append(Test(subject, texts, negated, reading.place(key)))
        return tuple(found)

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A map of values, lists of values or ``{not: …}``."""
        scalar: Schema = {"type": [*SCALARS]}
        values: Schema = {"anyOf": [scalar, {"type": "array", "items": scalar, "minItems": 1}]}
        negated: Schema = {
            "type": "object",
            "properties": {"not": values},
            "required": ["not"],
            "additionalProperties": False,
        }
        shared["node_condition"] = {
            "description": "A value, a list of values, or `not` with those that it must not have.",
            "anyOf": [*values["anyOf"], negated],
        }
        return {"type": "object", "additionalProperties": {"$ref": "#/$defs/node_condition"}}


class _Any(ValueType[Given]):
    """Any value that a parameter may have."""

    def __init__(self) -> None:
        super().__init__("the value of a parameter")

    def read(self, node: Node, reading: SourceReading, name: str) -> Given | None:
        """Take the value."""
        del reading, name
        return Given(plain(node))

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A text, number, flag or list."""
        del shared
        return {"type": [*SCALARS, "array"]}


def _version(node: ScalarNode) -> int | None:
    number = whole_number(node)
    return number if number == VERSION else None


_CONDITION: Final = _Conditions()
_NUMBER: Final = Scalar(str(VERSION), {"const": VERSION}, _version)

# Endpoints

WHEN: Final = Key("when", _CONDITION, "Values of parameters, and `distro`, with which this holds; without it, always.")
AT: Final = Key(
    "at", TEXT, "The file of the source that says so, relative to the repository or package, and its line: FILE:LINE."
)
PROFILE: Final = Key(
    "profile", TEXT, "A profile of this file or a preset of ROS 2; policies beside it win over its own."
)
UNKNOWN: Final = Key("unknown", TEXT, "Why it is not known.")
UNREAD_POLICIES: Final = Key(
    "unread", MapOf(TEXT, "a map from policies to causes"), "Policies that are not known, each with its cause."
)
QOS_FORM: Final = Form(
    "node_qos", "a quality of service", (PROFILE, WHEN, UNKNOWN, UNREAD_POLICIES), short=PROFILE.name, others=SETTING
)
QOS: Final = Key(
    "qos",
    OneOrMore(QOS_FORM),
    "A profile, policies, or a list with a condition each; the first that holds counts. Without it, the default profile.",
)
TYPE: Final = Key("type", TEXT, "Name of the type of message, service or action.")
FOR_EACH: Final = Key(
    "for_each",
    MapOf(TEXTS, "a map from variables to lists"),
    "One endpoint for each value of a variable: a list, or `${PARAMETER}` with a list or a text of words.",
)
OVERRIDABLE: Final = Key(
    "overridable",
    ListOf(one_of(*OVERRIDABLE_POLICIES), "a list of policies"),
    "Policies that parameters `qos_overrides` may set; none where the node does not opt in.",
)
OVERRIDABLE_UNKNOWN: Final = Key(
    "overridable_unknown",
    TEXT,
    "Why it is not known which policies `qos_overrides` may set; then what it sets is not known.",
)
OPTIONAL: Final = Key("optional", FLAG, "A missing partner is normal: people, tools or other robots may be there.")
OWN_NODE: Final = Key(
    "own_node", FLAG, "It belongs to a hidden node of the process, with the namespace and remaps of the process."
)
PERHAPS: Final = Key(
    "perhaps", TEXT, "Why it is not known whether the node creates it; then the endpoint does not count."
)
CONFIRMED: Final = Key("confirmed", FLAG, "A person confirmed it: `cqos learn` leaves it as it is.")
ENDPOINT: Final = Form(
    "node_endpoint",
    "an endpoint of a node",
    (TYPE, QOS, WHEN, FOR_EACH, OVERRIDABLE, OVERRIDABLE_UNKNOWN, OPTIONAL, UNKNOWN, PERHAPS, CONFIRMED, AT),
)
_ENDPOINTS: Final = MapOf(OneOrMore(ENDPOINT), "a map from names to endpoints", empty=True)
DIRECTIONS: Final = {
    name: Key(name, _ENDPOINTS, help_text)
    for name, help_text in (
        (
            "publishes",
            "Topics it publishes, by the name in its code; `${PARAMETER}` stands for the value of a parameter.",
        ),
        ("subscribes", "Topics it subscribes to."),
        ("serves", "Services it offers."),
        ("calls", "Services it calls."),
        ("action_servers", "Actions it offers."),
        ("action_clients", "Actions it calls."),
    )
}
KINDS: Final[dict[str, tuple[str, Role]]] = {
    "publishes": ("message", PUBLISHER),
    "subscribes": ("message", SUBSCRIBER),
    "serves": ("service_server", SUBSCRIBER),
    "calls": ("service_client", PUBLISHER),
    "action_servers": ("action_server", SUBSCRIBER),
    "action_clients": ("action_client", PUBLISHER),
}
"""Kind and role of the endpoints of each direction."""
BY_KIND: Final = {kind: direction for direction, kind in KINDS.items()}

# What nodes are made of

DEFAULT: Final = Key("default", _Any(), "The value where none is given; without it, the parameter is then not set.")
PARAMETER: Final = Form("node_parameter", "a parameter", (DEFAULT, WHEN), short=None)
PARAMETERS: Final = Key(
    "parameters",
    MapOf(OneOrMore(PARAMETER), "a map from parameters to what is known of them", empty=True),
    "Parameters that decide about endpoints.",
)
FRAGMENT: Final = Key("fragment", TEXT, "Name of a fragment of any node file.", required=True)
USES: Final = Key(
    "uses",
    ListOf(
        Form("node_use", "a use of a fragment", (FRAGMENT, WHEN, OWN_NODE), short=FRAGMENT.name), "a list of fragments"
    ),
    "Parts that it creates and that other nodes have too.",
)
NAMES: Final = Key("names", TEXT, "`${PARAMETER}` with the names of the plugins.", required=True)
CLASS: Final = Key("class", TEXT, "The parameter with the class of the plugin `${plugin}`.", required=True)
CLASSES: Final = Key(
    "classes",
    MapOf(TEXT, "a map from plugins to classes"),
    "Classes by name of a plugin, where the parameter has none.",
)
PLUGINS: Final = Key(
    "plugins",
    ListOf(Form("node_plugins", "a list of plugins", (NAMES, CLASS, CLASSES, WHEN)), "a list of plugin slots"),
    "Plugins that parameters name; each class is a fragment.",
)
NODE: Final = Key("node", TEXT, "The node, as PACKAGE/EXECUTABLE.", required=True)
NAME: Final = Key("name", TEXT, "Its name in the code.")
NAMESPACE: Final = Key(
    "namespace", TEXT, "Its namespace where the launch gives it none; `${namespace}` is that of the node around it."
)
INSIDE: Final = Key(
    "inside",
    ListOf(Form("node_inside", "a node inside", (NODE, NAME, NAMESPACE, WHEN)), "a list of nodes"),
    "Further nodes that it creates in its process.",
)
REMAPS: Final = Key(
    "remaps",
    MapOf(TEXT, "a map from names to names"),
    "What its code renames, `__node` and `__ns` among them: this comes before what a launch file renames.",
)
GLOBAL_ARGUMENTS: Final = Key(
    "global_arguments",
    FLAG,
    "`false` where it takes no name, namespace, remaps and parameters that its process is given.",
)
WHAT: Final = Key("what", TEXT, "What is not known.", required=True)
CAUSE: Final = Key("cause", TEXT, "Why.", required=True)
UNREAD: Final = Key(
    "unread",
    ListOf(Form("node_unread", "something not known", (WHAT, CAUSE, AT, WHEN)), "a list of what is not known"),
    "Endpoints that are not known: the report names them, and no partner is called missing.",
)
LIFECYCLE: Final = Key("lifecycle", FLAG, "It is a lifecycle node: its endpoints work when it is active.")
_PARTS: Final[tuple[Key[Any], ...]] = (LIFECYCLE, PARAMETERS, *DIRECTIONS.values(), USES, PLUGINS, UNREAD)
FRAGMENT_FORM: Final = Form("node_fragment", "a fragment", _PARTS)
PLUGIN: Final = Key("plugin", TEXT, "The class as a component.")
CONFIGURED_BY: Final = Key(
    "configured_by",
    one_of("rviz", "gz_bridge", "ros2_control", "ros2_control_spawner"),
    "The endpoints stand in a file of this format, which the launch names; with `ros2_control`, those of the controllers that spawners load.",
)
ACTIVATED: Final = Key("names", TEXT, "`${PARAMETER}` with the names of the nodes.", required=True)
ACTIVATES: Final = Key(
    "activates",
    Form("node_activation", "what it activates", (ACTIVATED, WHEN), short=ACTIVATED.name),
    "`${PARAMETER}` with the names of the lifecycle nodes that it activates; with `when`, it does so at the start only then.",
)
ACCEPT: Final = Key(
    "accept",
    MapOf(TEXT, "a map from rules to reasons"),
    "Rules whose findings about its endpoints are known: its code decides, and its users cannot change it.",
)
NODE_FORM: Final = Form(
    "node_facts",
    "what is known of a node",
    (NAME, NAMESPACE, REMAPS, GLOBAL_ARGUMENTS, PLUGIN, CONFIGURED_BY, ACTIVATES, ACCEPT, *_PARTS, INSIDE),
)
FRAGMENTS: Final = Key(
    "fragments",
    MapOf(FRAGMENT_FORM, "a map from names to fragments", empty=True),
    "Plugins by class, and parts that several nodes have.",
)
NODES: Final = Key("nodes", MapOf(NODE_FORM, "a map from executables to nodes", empty=True), "Nodes by executable.")

# The file

FORMAT: Final = Key("cqos_nodes", _NUMBER, f"Version of the form: {VERSION}.", required=True)
PACKAGE: Final = Key("package", TEXT, "Name of the ROS 2 package.", required=True)
REPOSITORY: Final = Key("repository", TEXT, "Where the source is.")
BY: Final = Key("by", one_of("hand", "learn", "observed"), "How the facts came about.")
FROM: Final = Key("from", Form("node_source", "a source", (REPOSITORY, BY)), "Where the facts come from.")
VERSIONS: Final = Key(
    "versions",
    MapOf(TEXT, "a map from distributions to versions"),
    "The version of the package that was read, by ROS 2 distribution. In others nothing is known. Without it, the facts hold everywhere.",
)
CORRECTIONS: Final = Key(
    "corrections",
    Form("node_corrections", "corrections", (FRAGMENTS, NODES)),
    "What a person knows better than `cqos learn`, which leaves it as it is: what is stated here replaces the same key above.",
)
PROFILES: Final = Key("profiles", MapOf(QOS_FORM, "a map from names to profiles"), "Profiles by name.")
DOCUMENT: Final = Form(
    "node_file",
    "a node file",
    (FORMAT, PACKAGE, FROM, VERSIONS, PROFILES, FRAGMENTS, NODES, CORRECTIONS),
    one_of=(NODES.name, FRAGMENTS.name),
)


def node_schema() -> Schema:
    """Return the JSON schema (draft 2020-12) of node files."""
    shared: dict[str, Schema] = {}
    document = DOCUMENT.definition(shared)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"C-QoS node file, version {VERSION}",
        "description": f"What is known of the nodes of a package: {listed(('endpoints', 'parameters', 'plugins'), 'and')}.",
        **document,
        "$defs": shared,
    }
