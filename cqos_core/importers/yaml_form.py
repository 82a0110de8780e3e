"""The system form: every key of a C-QoS system file, with its type of value and its purpose.

Only structure stands here. Which settings there are is known to the rule packs, so settings are taken by any name; ``hints``
name the parts of the JSON schema in which packs suggest theirs (see `cqos_core.files.schema`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.importers.document_form import (
    OTHERS,
    WRITTEN,
    Entry,
    Form,
    Key,
    ListOf,
    MapOf,
    Member,
    OneOrMore,
    SettingsMap,
)
from cqos_core.importers.team_rules import ACCEPTANCE, CHECK
from cqos_core.importers.tree import MappingNode, ScalarNode, is_null, part_text, whole_number
from cqos_core.importers.unread_parts import UNREAD_PART
from cqos_core.importers.value_types import EXPRESSION, FLAG, FLAT_SETTING, SETTING, TEXT, TEXTS, Scalar, one_of
from cqos_core.importers.variables import InstancesType
from cqos_core.importers.yaml_chains import CHAINS, LINKS

if TYPE_CHECKING:
    from cqos_core.importers.tree import Node

VERSION: Final = 1

# Keys that stand in several forms

_PACKS: Final = ("packs",)
PROTOCOL: Final = Key(
    "protocol", TEXT, "Id of the rule pack that judges here, for instance `ros2`, `dds` or `mqtt`.", hints=_PACKS
)
PROFILE: Final = Key(
    "profile",
    TEXTS,
    "Profiles or presets to take values from; of several, a later one wins over an earlier one.",
    hints=("endpoint_presets",),
)
BROKER_PROFILE: Final = replace(PROFILE, hints=("broker_presets",))
BASE_PROFILE: Final = replace(PROFILE, hints=(*PROFILE.hints, *BROKER_PROFILE.hints))
EXTERNAL: Final = Key("external", FLAG, "Has partners outside of this system, so a missing partner is no finding.")
STARTS_AFTER: Final = Key("starts_after", TEXTS, "Ids of endpoints or participants that are up before this one.")
LABEL: Final = Key("label", TEXT, "Name for people, used in messages.")
OBSERVED: Final = Key(
    "observed",
    FLAG,
    "Reported by a running system or a recording: what is not stated is unknown, not a default.",
)

# Endpoints

ID: Final = Key("id", TEXT, "Id of the endpoint, unique in the system; without it `participant/role/topic`.")
TYPE: Final = Key("type", TEXT, "Name of the data type.")
NEEDS: Final = Key(
    "needs",
    SettingsMap("a map of needs", advice="write each with a value: `needs: {{{found}: true}}`", listed="true"),
    "What the application requires, in words that no protocol owns: `latest`, `loss_free`, `late_join`, `max_age` …",
    hints=("need_settings",),
)
_NEEDS_ELSEWHERE: Final = {
    NEEDS.name: "write it at the subscriber that needs it: `subscribes: {TOPIC: {needs: {value}}}`"
}
_TOPIC_ABOVE: Final = {"topic": f"the topic is the name above it: `{WRITTEN}: {OTHERS}`"}
_ENDPOINT_SETTINGS: Final = ("endpoint_settings",)
ENDPOINT: Final = Form(
    "endpoint",
    "an endpoint",
    (PROFILE, ID, TYPE, NEEDS, PROTOCOL, EXTERNAL, STARTS_AFTER, LABEL, OBSERVED),
    short=PROFILE.name,
    others=SETTING,
    never=_TOPIC_ABOVE,
    hints=(*_ENDPOINT_SETTINGS, *PROFILE.hints),
)
_DIRECTIONS: Final = ("publishes", "subscribes", "serves", "calls", "action_servers", "action_clients")
_ENDPOINTS: Final = MapOf(
    OneOrMore(ENDPOINT),
    "a map from topics to endpoints",
    empty=True,
    beside=frozenset(_DIRECTIONS),
)
PUBLISHED: Final = Form(
    "published",
    "a publisher",
    tuple(key for key in ENDPOINT.keys.values() if key is not NEEDS),
    short=PROFILE.name,
    others=SETTING,
    never=_NEEDS_ELSEWHERE | _TOPIC_ABOVE,
    hints=ENDPOINT.hints,
)

PUBLISHES: Final = Key(
    "publishes",
    MapOf(
        OneOrMore(PUBLISHED),
        "a map from topics to endpoints",
        empty=True,
        beside=frozenset(_DIRECTIONS),
    ),
    "Topics it publishes: topic to profile, to settings, or to a list of those.",
)
SUBSCRIBES: Final = Key(
    "subscribes", _ENDPOINTS, "Topics it subscribes to: topic to profile, to settings, or to a list of those."
)
SERVES: Final = Key("serves", _ENDPOINTS, "Services it offers.")
CALLS: Final = Key("calls", _ENDPOINTS, "Services it calls.")
ACTION_SERVERS: Final = Key("action_servers", _ENDPOINTS, "Actions it offers.")
ACTION_CLIENTS: Final = Key("action_clients", _ENDPOINTS, "Actions it calls.")


def _group(name: str, key: Key[dict[str, Member[list[Entry]]]]) -> Form:
    never = {other: "write it at the participant" for other in _DIRECTIONS if other != key.name}
    # A group without endpoints is a slip: `publishers:` for `publishes:`.
    required = replace(key, required=True, help=f"{key.help} Without groups, write `{key.name}:` at the participant.")
    expected = f"a group that {key.name}"
    bare = f"{key.name}: {{{{{{name}}: {{0}}}}}}"
    return Form(name, expected, (required, PROFILE), others=SETTING, never=never, hints=_ENDPOINT_SETTINGS, bare=bare)


PUBLISHERS: Final = Key(
    "publishers",
    MapOf(_group("publisher_group", PUBLISHES), "a map of named publishers", empty=True, instead=PUBLISHES.name),
    "Named groups (DDS publishers): settings that hold for all endpoints in `publishes` below them.",
)
SUBSCRIBERS: Final = Key(
    "subscribers",
    MapOf(_group("subscriber_group", SUBSCRIBES), "a map of named subscribers", empty=True, instead=SUBSCRIBES.name),
    "Named groups (DDS subscribers): settings that hold for all endpoints in `subscribes` below them.",
)

# Participants

REMAP: Final = Key("remap", MapOf(TEXT, "a map from topic names to topic names"), "Topic renames, from: to.")
_PARTICIPANT_SETTINGS: Final = ("participant_settings", "option_settings")
CLIENT: Final = Key(
    "client",
    SettingsMap("a map of connection settings"),
    "Settings of its connection.",
    hints=_PARTICIPANT_SETTINGS,
)
PARTICIPANT_OPTIONS: Final = Key(
    "options",
    SettingsMap("a map of options", FLAT_SETTING),
    "Options for this participant only, without the name of the pack.",
    hints=("option_settings",),
)
_OF_THE_FILE: Final = (
    *("system", "observed", "part", "include", "profiles", "topics", "instances", "participants"),
    *("brokers", "bridges", "chains", "links", "checks", "accept", "severities", "unread"),
)


_END_WORDS: Final = {"publisher": "publishes", "subscription": "subscribes", "subscriber": "subscribes"}


def _by_direction(topics: MappingNode) -> str:
    """Say how settings are written that stand below each topic by the kind of its endpoints."""
    found: dict[str, MappingNode] = {}
    for key, ends in topics.entries.values():
        for word, (_, settings) in ends.entries.items() if isinstance(ends, MappingNode) else ():
            below = found.setdefault(_END_WORDS[word], MappingNode(None, None))
            below.entries[key.text] = (key, settings)
    return f"write topics below what is done with them: `{', '.join(f'{name}: {part_text(below)}' for name, below in found.items())}`"


_PARAMETERS: Final = (
    "write parameters into a file of their own, as the program reads it, and check both: `cqos check SYSTEM PARAMETERS`; "
    f"settings of endpoints are written below `{PUBLISHES.name}` and `{SUBSCRIBES.name}`"
)


_LAUNCH: Final = (
    "a launch file is a file of its own, which C-QoS reads: `cqos check SYSTEM LAUNCH_FILE`; here write what is published and "
    f"subscribed, `{PUBLISHES.name}: {{TOPIC: }}`, and renames as `remap: {{FROM: TO}}`"
)
_OF_A_LAUNCH_FILE: Final = frozenset(("pkg", "exec", "executable", "composable_node", "plugin"))


def _guess_in_participant(name: str, value: Node, around: MappingNode) -> str:
    """Say what was meant by a map under a name that no participant has as a key: its topics, or an endpoint's settings."""
    del around
    if not isinstance(value, MappingNode):
        return ""
    if "parameters" in name.lower():
        return _PARAMETERS
    if not _OF_A_LAUNCH_FILE.isdisjoint((name, *value.entries)):
        return _LAUNCH
    if "/" not in name and any("/" in inner for inner in value.entries):
        ends = {
            _END_WORDS.get(word, "") for _, inner in value.entries.values() for word in getattr(inner, "entries", ())
        }
        if ends and "" not in ends:
            return _by_direction(value)
        return f"write topics below `{PUBLISHES.name}` or `{SUBSCRIBES.name}`: `{PUBLISHES.name}: {WRITTEN}`"
    if "qos" in name.lower() and value.is_flat():
        return f"write it at each endpoint: `{PUBLISHES.name}: {{TOPIC: {WRITTEN}}}` or `{SUBSCRIBES.name}: {{TOPIC: {WRITTEN}}}`"
    if "/" not in name and all(isinstance(inner, ScalarNode) for _, inner in value.entries.values()):
        return (
            f"if `{name}` is a topic, write `{PUBLISHES.name}: {{{name}: {WRITTEN}}}` or `{SUBSCRIBES.name}: {{{name}: {WRITTEN}}}`; if these are "
            f"settings of the participant, write them without `{name}` around them: `{part_text(value)[1:-1]}`"
        )
    return f"if `{name}` is a topic, write `{PUBLISHES.name}: {{{name}: {WRITTEN}}}` or `{SUBSCRIBES.name}: {{{name}: {WRITTEN}}}`"


_WRITING: Final = frozenset(
    [
        "writer",
        "writers",
        "data_writers",
        "datawriters",
        "output",
        "outputs",
        "out",
        "produces",
        "emits",
        "send",
        "write",
        "talks",
        "publication",
        "publications",
    ]
)
_READING: Final = frozenset(
    [
        "reader",
        "readers",
        "data_readers",
        "datareaders",
        "input",
        "inputs",
        "in",
        "consumes",
        "receive",
        "read",
        "listen",
        "listens_to",
        "subscription",
        "subscriptions",
    ]
)
PARTICIPANT: Final = Form(
    "participant",
    "a participant",
    (
        PROTOCOL,
        PUBLISHES,
        SUBSCRIBES,
        PUBLISHERS,
        SUBSCRIBERS,
        SERVES,
        CALLS,
        ACTION_SERVERS,
        ACTION_CLIENTS,
        REMAP,
        EXTERNAL,
        STARTS_AFTER,
        CLIENT,
        LABEL,
        PARTICIPANT_OPTIONS,
    ),
    others=FLAT_SETTING,
    never={
        PROFILE.name: "write it at each endpoint, `TOPIC: {profile: {value}}`, or at a group of endpoints",
        **dict.fromkeys(("sends", "writes"), f"write `{PUBLISHES.name}`"),
        **dict.fromkeys(("receives", "reads", "listens"), f"write `{SUBSCRIBES.name}`"),
        **_NEEDS_ELSEWHERE,
    },
    hints=_PARTICIPANT_SETTINGS,
    bare=f"{{name}}: {{{{{PUBLISHES.name}: {{{{TOPIC: }}}}}}}}",
    elsewhere={
        **{name: f"write it at the left edge of the file: `{name}: {WRITTEN}`" for name in _OF_THE_FILE},
        **dict.fromkeys(_WRITING, f"write `{PUBLISHES.name}: {WRITTEN}`"),
        **dict.fromkeys(_READING, f"write `{SUBSCRIBES.name}: {WRITTEN}`"),
        **dict.fromkeys(
            ("services", "actions"),
            "write services that it offers below `serves`, those that it uses below `calls`; actions below `action_servers` or "
            "`action_clients`",
        ),
        "topics": f"write endpoints by what is done with the topic, `{PUBLISHES.name}: {WRITTEN}` or `{SUBSCRIBES.name}: {WRITTEN}`; "
        f"`topics` at the left edge of the file states facts about topics",
    },
    guess=_guess_in_participant,
)

# Topics, profiles, brokers, bridges

TOPIC: Final = Form(
    "topic",
    "a topic",
    (EXTERNAL, PROTOCOL),
    short=TYPE.name,
    others=SETTING,
    never={PROFILE.name: "write it at each endpoint of the topic", **_NEEDS_ELSEWHERE},
    hints=("topic_settings",),
)
PROFILE_FORM: Final = Form(
    "profile", "a profile", (BASE_PROFILE,), others=SETTING, hints=(*_ENDPOINT_SETTINGS, "broker_settings")
)
BROKER: Final = Form("broker", "a broker", (PROTOCOL, BROKER_PROFILE), others=SETTING, hints=("broker_settings",))
TOPIC_NAME: Final = Key("topic", TEXT, "The topic; a `*` in it stands for the same on both sides.")
PARTICIPANT_ID: Final = Key(
    "participant", TEXT, "Id of the participant that is this side of the bridge.", required=True
)
_SIDE: Final = (PARTICIPANT_ID, TOPIC_NAME, PROFILE, ID, TYPE, EXTERNAL, LABEL)
ROUTE_SIDE: Final = Form("route_side", "a side of a route", _SIDE, others=SETTING, hints=_ENDPOINT_SETTINGS)
FROM: Final = Key(
    "from", ROUTE_SIDE, "What the bridge subscribes to, with the settings of its subscription.", required=True
)
TO: Final = Key("to", ROUTE_SIDE, "What it publishes that as, with the settings of its publication.", required=True)
ONLY: Final[Key[list[str]]] = Key(
    "only",
    ListOf(EXPRESSION, "a list of regular expressions"),
    "Of the topics that the `*` of `from` matches, those are carried whose whole name one of these regular expressions matches.",
)
BUT: Final[Key[list[str]]] = Key(
    "but",
    ListOf(EXPRESSION, "a list of regular expressions"),
    "Those that are not carried, by regular expressions too.",
)
KIND: Final = Key(
    "kind",
    one_of("service", "action"),
    "What it carries in place of topics: what the bridge serves on the side of `from`, it calls on that of `to`.",
)
ROUTE: Final = Form("route", "a route", (FROM, TO, KIND, ONLY, BUT))
ROUTES: Final = Key("routes", ListOf(ROUTE, "a list of routes"), "What is carried from where to where.", required=True)
CARRIES: Final[Key[list[str]]] = Key(
    "carries",
    ListOf(one_of("liveliness"), "a list of what it carries"),
    "What it carries on beside samples: `liveliness`, where it stops publishing when the source is gone.",
)
_IN_ROUTES: Final = "write it in `routes`: `routes: [{from: {…}, to: {…}}]`"
BRIDGE: Final = Form("bridge", "a bridge", (ROUTES, CARRIES), never=dict.fromkeys((FROM.name, TO.name), _IN_ROUTES))

# The document

CQOS: Final = Key(
    "cqos",
    Scalar(str(VERSION), {"const": VERSION}, whole_number),
    f"Version of this form, always {VERSION}.",
    required=True,
)
SYSTEM: Final = Key("system", TEXT, "Name of the system, for the report.")
DEFAULT_PROTOCOL: Final = Key(
    "protocol", TEXT, "Protocol of the participants in this file that state none.", hints=_PACKS
)
ALL_OBSERVED: Final = Key("observed", FLAG, "The whole file is a snapshot of a running system or a recording.")
PART: Final = Key("part", FLAG, "The file is a part of a system: partners of its endpoints are in other files.")
OPTIONS: Final = Key(
    "options",
    MapOf(
        SettingsMap("a map of options", advice="options are by rule pack: `options: {{PACK: {{{name}: {found}}}}}`"),
        "a map from packs to options",
    ),
    "What is assumed about the deployment, by rule pack: `{ros2: {rmw: cyclonedds}}`.",
    hints=("pack_options",),
)
PROFILES: Final = Key("profiles", MapOf(PROFILE_FORM, "a map of profiles", empty=True), "Named bundles of settings.")
TOPICS: Final = Key(
    "topics",
    MapOf(TOPIC, "a map of topics", empty=True),
    "What is known of topics as such: type, period, size …; a bare text is the type.",
)
INSTANCES: Final = Key(
    "instances",
    MapOf(InstancesType(), "a map from variables to instances"),
    "Variables: `${name}` in a text multiplies what mentions it, once for each of the listed names.",
)
PARTICIPANTS: Final = Key(
    "participants",
    MapOf(
        PARTICIPANT,
        "a map of participants",
        empty=True,
        beside=frozenset((*_OF_THE_FILE, "options", "protocol", "cqos")),
    ),
    "Who takes part, by id.",
)
BROKERS: Final = Key(
    "brokers",
    MapOf(BROKER, "a map of brokers", empty=True),
    "Intermediaries that participants connect to, by id.",
)
BRIDGES: Final = Key(
    "bridges",
    MapOf(BRIDGE, "a map of bridges", empty=True),
    "What subscribes on one side and publishes on the other.",
)
INCLUDE: Final = Key("include", TEXTS, "Further files, relative to this one.")
CHECKS: Final = Key("checks", ListOf(CHECK, "a list of checks"), "The team's own rules.")
ACCEPT: Final = Key("accept", ListOf(ACCEPTANCE, "a list of accepted findings"), "Known exceptions, with a reason.")
SEVERITIES: Final = Key(
    "severities",
    MapOf(one_of("error", "warning", "note", "off"), "a map from rules to severities"),
    "Severity by code or name of a rule; `off` silences it.",
)
UNREAD: Final = Key(
    "unread",
    ListOf(UNREAD_PART, "a list of parts that are not described"),
    "Parts of the system that the file does not describe and that may decide a verdict.",
)


def _guess_in_document(name: str, value: Node, around: MappingNode) -> str:
    """Say what was meant by a key that no system file has: a participant, a topic, or an option."""
    if isinstance(value, MappingNode) and any(
        word in value.entries for word in (*_DIRECTIONS, "publishers", "subscribers")
    ):
        return f"write participants below `participants`, indented: `participants: {{{name}: {WRITTEN}}}`"
    if isinstance(value, MappingNode):
        if any("parameters" in word.lower() for word in (name, *value.entries)):
            return _PARAMETERS
        if "/" in name:
            return (
                f"write a topic below `publishes` or `subscribes` of a participant: `publishes: {{{name}: {WRITTEN}}}`"
            )
        if value.is_flat():
            return (
                f"settings that endpoints share are a profile, `profiles: {{{name}: {WRITTEN}}}`, which each takes by `profile: {name}`; "
                f"a participant stands below `participants`: `participants: {{{name}: {WRITTEN}}}`"
            )
        return (
            f"write a participant below `participants`: `participants: {{{name}: {WRITTEN}}}`; allowed here: {_ALLOWED}"
        )
    if is_null(value):
        return ""
    _, protocol = around.entries.get(DEFAULT_PROTOCOL.name, (None, None))
    pack = protocol.text if isinstance(protocol, ScalarNode) and protocol.text else "PACK"
    return (
        f"an option of the deployment is written `options: {{{pack}: {{{name}: {WRITTEN}}}}}`; a setting of participants at each, "
        f"`participants: {{NAME: {{{name}: {WRITTEN}}}}}`; a setting of endpoints at each or in a profile, `profiles: {{NAME: {{{name}: {WRITTEN}}}}}`; "
        f"a setting of a broker at it, `brokers: {{NAME: {{{name}: {WRITTEN}}}}}`; "
        f"allowed here: {_ALLOWED}"
    )


_ALLOWED: Final = ", ".join(("cqos", "protocol", "options", *_OF_THE_FILE))
_AT_A_PARTICIPANT: Final = (
    *_DIRECTIONS,
    "publishers",
    "subscribers",
    "remap",
    "external",
    "starts_after",
    "client",
    "label",
)
_AT_AN_ENDPOINT: Final = ("profile", "needs", "type", "id")
DOCUMENT: Final = Form(
    "document",
    "a system file",
    (
        *(CQOS, SYSTEM, DEFAULT_PROTOCOL, ALL_OBSERVED, PART, OPTIONS, INCLUDE, PROFILES, TOPICS, INSTANCES),
        *(PARTICIPANTS, BROKERS, BRIDGES, CHAINS, LINKS, CHECKS, ACCEPT, SEVERITIES, UNREAD),
    ),
    elsewhere={
        **{
            name: f"write it at a participant: `participants: {{NAME: {{{name}: {WRITTEN}}}}}`"
            for name in _AT_A_PARTICIPANT
        },
        **{
            name: f"write it at an endpoint: `participants: {{NAME: {{subscribes: {{TOPIC: {{{name}: {WRITTEN}}}}}}}}}`"
            for name in _AT_AN_ENDPOINT
        },
        **dict.fromkeys(("nodes", "apps", "components", "devices", "applications"), "write `participants: {value}`"),
        "name": "write `system: {value}`",
        "launch": _LAUNCH,
    },
    guess=_guess_in_document,
)
