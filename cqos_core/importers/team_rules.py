"""The team's own rules and known exceptions: the entries of `checks` and `accept`, in system files and configuration."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias, cast, get_args

from cqos_core.importers.document_form import Entry, Form, Key, named
from cqos_core.importers.source_reading import SourceReading, described, did_you_mean, shown
from cqos_core.importers.tree import MappingNode, Node, SequenceNode, flow_text, is_null
from cqos_core.importers.value_types import DATE, TEXT, Schema, ValueType, one_of, whatever_is_below
from cqos_core.model.system import Acceptance, Bound, TeamRule

Relation: TypeAlias = Literal["exactly", "at_least", "at_most", "one_of", "not"]
_Severity: TypeAlias = Literal["error", "warning", "note"]

RELATIONS: Final[tuple[Relation, ...]] = get_args(Relation)
_SEVERAL: Final = ("one_of", "not")


class _Bounds(ValueType[tuple[Bound, ...]]):
    """The bounds of a check: policy to value, or to a map of relations and values."""

    def __init__(self) -> None:
        super().__init__("a map from policies to what is required of them")

    def read(self, node: Node, reading: SourceReading, name: str) -> tuple[Bound, ...] | None:
        """Take every bound; refused ones are left out."""
        if not isinstance(node, MappingNode):
            self.refuse(node, reading, name)
            return None
        if not node.entries:
            reading.problem("CQ010", f"{shown(name)} requires nothing", node, "name a policy and a value")
        bounds: list[Bound] = []
        for key, value in node.entries.values():
            if is_null(value) or (isinstance(value, MappingNode) and not value.entries):
                reading.problem("CQ010", f"nothing is required of {shown(key.text)}", key, "write a value after it")
            elif isinstance(value, MappingNode):
                bounds += self._related(key.text, value, reading)
            else:
                bounds.append(Bound(key.text, "exactly", (flow_text(value),), reading.place(value)))
        return tuple(bounds)

    def _related(self, policy: str, node: MappingNode, reading: SourceReading) -> list[Bound]:
        bounds = []
        for key, value in node.entries.values():
            relation = next((each for each in RELATIONS if each == key.text), None)
            if relation is None:
                hint = did_you_mean(key.text, RELATIONS)
                message = f"{shown(policy)} cannot be required {shown(key.text)}{hint}"
                reading.problem("CQ006", message, key, f"allowed: {', '.join(RELATIONS)}; a bare value means exactly")
            elif is_null(value):
                reading.problem("CQ010", f"{shown(key.text)} has no value", key)
            elif relation == "one_of" and not _lists_values(value):
                reading.problem("CQ009", f"`one_of` must be a list of values, found {described(value)}", value)
            else:
                several = isinstance(value, SequenceNode) and relation in _SEVERAL
                values = value.items if several and isinstance(value, SequenceNode) else [value]
                bounds.append(Bound(policy, relation, tuple(map(flow_text, values)), reading.place(value)))
        return bounds

    def schema(self, shared: dict[str, Schema]) -> Schema:
        """A map whose values are values or maps of relations."""
        below = whatever_is_below(shared)
        value: Schema = {"type": ["string", "number", "boolean", "array", "object"], **below}
        several: Schema = {"type": "array", "items": value, "minItems": 1}
        relations = {name: several if name == "one_of" else value for name in RELATIONS}
        bare: Schema = {"type": ["string", "number", "boolean", "array"], **below}
        related: Schema = {
            "type": "object",
            "properties": relations,
            "additionalProperties": False,
            "minProperties": 1,
        }
        return {**named({"anyOf": [bare, related]}), "minProperties": 1}


BECAUSE: Final = Key("because", TEXT, "The reason, for later readers.", required=True)


def _lists_values(node: Node) -> bool:
    return isinstance(node, SequenceNode) and bool(node.items) and not any(map(is_null, node.items))


SEVERITY: Final = Key(
    "severity", one_of("error", "warning", "note"), "Severity of its findings; `error` if not stated."
)
WHERE_KEYS: Final = (
    Key("role", one_of("publisher", "subscriber"), "Which side."),
    Key("topic", TEXT, "Pattern of the topic's name, with `*` and `?`."),
    Key("participant", TEXT, "Pattern of the participant's id."),
    Key("protocol", TEXT, "Pattern of the protocol's id."),
    Key("type", TEXT, "Pattern of the data type's name."),
    Key("id", TEXT, "Pattern of the endpoint's id."),
)
WHERE: Final = Key("where", Form("where", "`where`", WHERE_KEYS), "Which endpoints the check looks at; all without it.")
REQUIRE: Final = Key(
    "require",
    _Bounds(),
    "Policy to value (exactly), or to a map of `at_least`, `at_most`, `one_of`, `not`, `exactly`.",
    hints=("endpoint_settings",),
)
CONDITION: Final = Key(
    "condition",
    TEXT,
    "A whole condition in the language of rules, for what `require` cannot say.",
    former="sentence",
)
NAME: Final = Key("name", TEXT, "Name of the check, in kebab case; say the good pattern.", required=True)
CHECK: Final = Form(
    "check",
    "a check",
    (NAME, WHERE, REQUIRE, CONDITION, BECAUSE, SEVERITY),
    one_of=(REQUIRE.name, CONDITION.name),
)

RULE: Final = Key("rule", TEXT, "Code or name of the rule whose findings are accepted.", required=True)
ACCEPT_TOPIC: Final = Key("topic", TEXT, "Topic of the findings that are accepted.")
ACCEPT_ENDPOINT: Final = Key("endpoint", TEXT, "Id of an endpoint of the findings that are accepted.")
UNTIL: Final = Key("until", DATE, "Day after which it no longer holds.")
ACCEPTANCE: Final = Form(
    "acceptance",
    "an accepted finding",
    (RULE, ACCEPT_TOPIC, ACCEPT_ENDPOINT, UNTIL, BECAUSE),
    bare="{{rule: {}, because: …}}",
)


def team_rule(entry: Entry) -> TeamRule:
    """Return the check that ``entry`` states."""
    where = entry.get(WHERE)
    patterns = [(key.name, where.get(key)) for key in WHERE_KEYS] if where is not None else []
    return TeamRule(
        name=entry.require(NAME),
        where=tuple((name, pattern) for name, pattern in patterns if pattern is not None),
        require=entry.get(REQUIRE) or (),
        because=entry.require(BECAUSE),
        sentence=entry.get(CONDITION),
        severity=cast("_Severity", entry.get(SEVERITY) or "error"),
        place=entry.place,
    )


def acceptance(entry: Entry) -> Acceptance:
    """Return the exception that ``entry`` states."""
    return Acceptance(
        rule=entry.require(RULE),
        because=entry.require(BECAUSE),
        topic=entry.get(ACCEPT_TOPIC),
        endpoint=entry.get(ACCEPT_ENDPOINT),
        until=entry.get(UNTIL),
        place=entry.place,
    )
