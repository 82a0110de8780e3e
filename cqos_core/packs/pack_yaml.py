"""Rule packs written as YAML: the same value as a pack in Python. The models below are the form; ``docs/packs.md`` explains it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    create_model,
    model_validator,
)
from pydantic_core import PydanticCustomError

from cqos_core.importers.source_reading import SourceReading, described, did_you_mean, listed
from cqos_core.importers.tree import MappingNode, SequenceNode, flag, is_null, whole_number
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.language.domains import Choice, Count, Domain, Duration, Flag, Names, Text
from cqos_core.language.expression import define
from cqos_core.language.parser import parse, parse_value
from cqos_core.language.policy import ByOption, Derived, PerRole, Policy, Stronger
from cqos_core.language.values import Anything, FromPeers
from cqos_core.language.vocabulary import terms
from cqos_core.model.problems import ConditionError, InputError, PackError, Problem
from cqos_core.model.settings import Place
from cqos_core.model.spelling import nearest
from cqos_core.packs.guarantee import NEEDS, TAKEN_EVERY, Unaffected, gives
from cqos_core.packs.pack import RulePack
from cqos_core.packs.presets import Convention, Dialect, Preset
from cqos_core.packs.property_panel import Panel
from cqos_core.packs.rule import Rule, forbids, matched_if, requires
from cqos_core.packs.timing import Timing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cqos_core.importers.tree import Node
    from cqos_core.language.expression import Node as Part
    from cqos_core.model.source import Source

RoleName: TypeAlias = Literal["publisher", "subscriber"]
Word: TypeAlias = Literal[
    "latest", "loss_free", "duplicate_free", "ordered", "late_join", "offline", "max_age", "max_gap", "liveness"
]
Fault: TypeAlias = Literal["link_outage", "subscriber_restart", "publisher_restart", "broker_stop", "broker_crash"]
Many: TypeAlias = tuple[str, ...]


def _text(value: object) -> str:
    if not isinstance(value, (str, int)):  # a flag is an int to Python
        raise PydanticCustomError("scalar", "")
    return str(value).lower() if isinstance(value, bool) else str(value)


Scalar: TypeAlias = Annotated[str, BeforeValidator(_text)]
"""A text, a number or a flag, as the text that it is."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, coerce_numbers_to_str=True)

    def given(self, *without: str) -> dict[str, Any]:
        """Return what the file states, by name; what it leaves out has the default of the value that is built."""
        stated = self.model_fields_set.difference(without)
        return {name: value for name, value in self if name in stated and value is not None}


# Values that are a text, or a map whose first key says what it means


class FromPeersModel(_Model):
    """``{from_peers: strongest_if_all, alone: reliable}``; ``side: first`` is for what bridges copy."""

    from_peers: Literal["any", "constant", "strongest_if_all", "strongest_if_any", "largest_stated", "smallest_stated"]
    alone: str
    waits: bool = False
    side: Literal["peers", "publishers", "subscribers", "first"] = "peers"


class PerRoleModel(_Model):
    """``{publisher: …, subscriber: …}``."""

    publisher: MeaningModel
    subscriber: MeaningModel


class ByOptionModel(_Model):
    """``{by_option: rmw, cases: {fastdds: …}, otherwise: …}``."""

    by_option: str
    cases: dict[str, MeaningModel] = Field(default_factory=dict)
    otherwise: MeaningModel | None = None


class UnknownModel(_Model):
    """``{unknown: why it is not known}``."""

    unknown: str


def _by_option(model: Any) -> ByOption:  # its meanings are made by then
    return ByOption(model.by_option, tuple(model.cases.items()), model.otherwise)


_FORM: Final = "\0"
"""Begins the names of forms in pydantic's locations; no key in YAML has it."""
_TEXT: Final = Tag(f"{_FORM}text")
_FORMS: Final[dict[str, type[_Model]]] = {
    f"{_FORM}{next(iter(each.model_fields))}": each
    for each in (FromPeersModel, PerRoleModel, ByOptionModel, UnknownModel)
}
_FROM_PEERS, _PER_ROLE, _BY_OPTION, _UNKNOWN = map(Tag, _FORMS)


def _form(value: object) -> str | None:
    """Return the form of a meaning, by the first key of a map; None where it has none of them."""
    if isinstance(value, dict):
        return next((form for form in _FORMS if form[len(_FORM) :] in value), None)
    return _TEXT.tag if isinstance(value, (str, int)) and not isinstance(value, bool) else None


_FromPeers: TypeAlias = Annotated[
    FromPeersModel, AfterValidator(lambda model: FromPeers(peers=model.from_peers, **model.given("from_peers")))
]
_PerRole: TypeAlias = Annotated[PerRoleModel, AfterValidator(lambda model: PerRole(**model.given()))]
_ByOption: TypeAlias = Annotated[ByOptionModel, AfterValidator(_by_option), _BY_OPTION]
_Unknown: TypeAlias = Annotated[UnknownModel, AfterValidator(lambda model: Anything(model.unknown))]
MeaningModel: TypeAlias = Annotated[
    Annotated[str, _TEXT]
    | Annotated[_FromPeers, _FROM_PEERS]
    | Annotated[_PerRole, _PER_ROLE]
    | _ByOption
    | Annotated[_Unknown, _UNKNOWN],
    Discriminator(_form, custom_error_type="meaning", custom_error_message="-"),
]
SeverityModel: TypeAlias = Annotated[
    Annotated[Literal["error", "warning", "note"], _TEXT] | _ByOption,
    Discriminator(lambda value: _BY_OPTION.tag if isinstance(value, dict) else _TEXT.tag),
]
DefaultModel: TypeAlias = Annotated[
    Annotated[Scalar, _TEXT] | Annotated[dict[RoleName, Scalar], _PER_ROLE],
    Discriminator(lambda value: _PER_ROLE.tag if isinstance(value, dict) else _TEXT.tag),
]


# Parts of packs


def _only(pairs: dict[str, Any]) -> tuple[str, Any] | None:
    return next(iter(pairs.items()), None)


def _keys_of(record: Any, **forms: Any) -> dict[str, Any]:
    """Return the keys of a map in a pack file that states a record of packs: its fields, with their types and defaults.

    Args:
        record: a dataclass. A new field of it is a new key of the file.
        forms: types of the keys that a file writes in another way, by name; None for a field that a file cannot state.
    """
    found = {}
    for each in fields(record):
        default = ... if each.default is MISSING else each.default
        value = Field(default) if each.default_factory is MISSING else Field(default_factory=each.default_factory)
        found[each.name] = (forms.get(each.name, each.type), value)
    return {name: key for name, key in found.items() if key[0] is not None}


class _PolicyKind(_Model):
    """The keys of a policy about its kind of value; ``kind`` decides which of the other keys apply."""

    kind: Literal["choice", "duration", "count", "flag", "names", "text"]
    values: Many = ()
    ordered: bool = True
    synonyms: dict[str, str] = Field(default_factory=dict)
    affixes: Many = ()
    minimum: int = 0
    maximum: int = 2**31 - 1
    unlimited: Many = ()
    unit: str = ""

    @model_validator(mode="after")
    def _values_with_choice(self) -> _PolicyKind:
        if (self.kind == "choice") != bool(self.values):
            raise ValueError("a choice lists its `values`, weakest first, and only a choice does")
        return self


class _RuleKind(_Model):
    """Exactly one of ``requires``, ``forbids`` and ``matched_if`` holds a condition, or ``gives`` a word of guarantees."""

    requires: str | None = None
    forbids: str | None = None
    matched_if: str | None = None
    meets: str | None = None  # the former name
    gives: Word | None = None
    what: str | None = None

    @model_validator(mode="after")
    def _one_condition(self) -> _RuleKind:
        kinds = (self.requires, self.forbids, self.matched_if, self.meets, self.gives)
        if sum(each is not None for each in kinds) != 1:
            raise ValueError("a rule has exactly one of `requires`, `forbids`, `matched_if` and `gives`")
        other = {"what", "survives"} if self.gives is None else self.model_fields_set - _OF_GUARANTEES
        if wrong := sorted(self.model_fields_set & other):
            which = "only a rule with `gives` has" if self.gives is None else "a rule with `gives` has no"
            raise ValueError(f"{which} `{wrong[0]}`")
        return self


_OF_GUARANTEES: Final = frozenset(
    ("gives", "what", "survives", "code", "name", "because", "clause", "doubt", "fixes", "help", "aliases")
)
_OF_POLICIES: Final[dict[str, Any]] = {
    **dict.fromkeys(("name", "domain", "entities", "changeable", "unseen", "raised")),
    "derived": Annotated[bool, AfterValidator(lambda derived: Derived() if derived else None)],
    "default": DefaultModel | None,
    "level": Literal["endpoint", "topic", "participant", "broker", "option"],
    "roles": tuple[RoleName, ...],
    "stronger": Stronger,
    "words": dict[str, MeaningModel],
    "enforced": dict[str, dict[str, Literal["yes", "unmatched", "no"]]],
}
_OF_RULES: Final[dict[str, Any]] = {
    **dict.fromkeys(("condition", "kind", "guarantee")),
    "severity": SeverityModel | None,
    "role": RoleName | Literal[""],
    "survives": Fault | None,
}
PolicyModel: Final = create_model("PolicyModel", __base__=_PolicyKind, **_keys_of(Policy, **_OF_POLICIES))
RuleModel: Final = create_model("RuleModel", __base__=_RuleKind, **_keys_of(Rule, **_OF_RULES))
_Settings: TypeAlias = dict[str, Scalar]
_Least: TypeAlias = Annotated[dict[str, str], Field(max_length=1), AfterValidator(_only)]
UnaffectedModel: Final = create_model(
    "UnaffectedModel", __base__=_Model, **_keys_of(Unaffected, guarantee=Word, faults=tuple[Fault, ...])
)
PresetModel: Final = create_model(
    "PresetModel", __base__=_Model, **_keys_of(Preset, settings=_Settings, needs=_Least | None, fixed=None, hosts=None)
)
ConventionModel: Final = create_model("ConventionModel", __base__=_Model, **_keys_of(Convention, settings=_Settings))
DialectModel: Final = create_model("DialectModel", __base__=_Model, **_keys_of(Dialect))
PanelModel: Final = create_model(
    "PanelModel", __base__=_Model, **_keys_of(Panel, roles=dict[str, tuple[RoleName, ...]])
)
_Meant: TypeAlias = Annotated[dict[str, Many], Field(min_length=1, max_length=1), AfterValidator(_only)]
# `{gap: POLICY, kept: {POLICY: [VALUE, …]}, …}`, with the names of `Timing`
_TIMES: Final[dict[str, Any]] = {each.name: _Meant if each.default else str for each in fields(Timing)}
_NO_CONDITIONS: Final[dict[str, Any]] = dict.fromkeys(("replayed", "expires"))
TimingModel: Final = create_model("TimingModel", __base__=_Model, **_keys_of(Timing, **_TIMES | _NO_CONDITIONS))


class PackModel(_Model):
    """A rule pack file."""

    cqos_pack: Literal[1]
    id: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    title: str
    summary: str = ""
    source: str = ""
    policies: dict[str, PolicyModel]
    define: dict[str, str] = Field(default_factory=dict)
    rules: list[RuleModel]
    presets: dict[str, PresetModel] = Field(default_factory=dict)
    base_preset: str | None = None
    dialects: dict[str, DialectModel] = Field(default_factory=dict)
    conventions: list[ConventionModel] = Field(default_factory=list)
    not_checked: Many = ()
    panel: PanelModel = Field(default_factory=PanelModel)
    unaffected: list[UnaffectedModel] = Field(default_factory=list)
    timing: TimingModel = Field(default_factory=TimingModel)


PackModel.model_rebuild()


def read_pack(source: Source) -> RulePack:
    """Read a rule pack file; raise `InputError` with every problem and its line where it is none."""
    problems: list[Problem] = []
    reading = SourceReading(source, problems, [])
    documents = read_tree(reading).documents
    if problems or len(documents) != 1:
        raise InputError(problems or [Problem("CQ009", "a rule pack file holds one document", Place(source.name))])
    try:
        model = PackModel.model_validate(_plain(documents[0]))
    except ValidationError as error:
        raise InputError(list(_mistakes(error.errors(), documents[0], reading))) from None
    return _build(model, documents[0], reading)


def _plain(node: Node) -> Any:
    """The node as Python values: text, whole numbers, flags, None, lists and maps."""
    if isinstance(node, MappingNode):
        return {key: _plain(value) for key, (_, value) in node.entries.items()}
    if isinstance(node, SequenceNode):
        return [_plain(item) for item in node.items]
    if is_null(node):
        return None
    truth = flag(node)
    if truth is not None:
        return truth
    number = whole_number(node)
    return node.text if number is None else number


def _at(location: Sequence[int | str], root: Node) -> Node:
    """The innermost node that a pydantic location names; parts that name types are passed over."""
    node = root
    for part in location:
        if isinstance(node, MappingNode) and isinstance(part, str) and part in node.entries:
            node = node.entries[part][1]
        elif isinstance(node, SequenceNode) and isinstance(part, int) and part < len(node.items):
            node = node.items[part]
    return node


_EXPECTED: Final = {
    "scalar": "a text, a number or a flag",
    "meaning": listed(["a text", *(f"a map with `{form[len(_FORM) :]}`" for form in _FORMS)]),
    "string_type": "a text",
    **dict.fromkeys(("int_type", "int_parsing"), "a whole number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("list_type", "tuple_type", "frozen_set_type"), "a list"),
    **dict.fromkeys(("dict_type", "mapping_type", "model_type"), "a map"),
    **dict.fromkeys(("too_long", "too_short"), "a map with one entry"),
    "string_pattern_mismatch": "lower-case letters, digits and `_` after a letter",
}
"""The expected values, by pydantic's type of error."""


def _mistakes(errors: Sequence[Any], root: Node, reading: SourceReading) -> Iterator[Problem]:
    """Yield the errors of pydantic as problems in the words of other files."""
    unknown = [error["loc"] for error in errors if error["type"] == "extra_forbidden"]
    for error in errors:
        *above, last = error["loc"] or [""]
        beside = [str(each[-1]) for each in unknown if list(each[:-1]) == above]
        if error["type"] != "missing" or not nearest(str(last), beside):  # a misspelt key is reported by itself
            yield _mistake(error, root, reading)


def _called(location: Sequence[int | str]) -> str:
    return f"`{'.'.join(str(part) for part in location)}`" if location else "a rule pack"


def _mistake(error: Any, root: Node, reading: SourceReading) -> Problem:
    kind, context = error["type"], error.get("ctx", {})
    location = [part for part in error["loc"] if not str(part).startswith(_FORM)]
    if location[-1:] == [_KEY]:
        allowed = tuple(re.findall(r"'(\w+)'", context["expected"]))
        return _unknown_key(location[:-1], allowed, root, reading)
    if kind == "extra_forbidden":
        return _unknown_key(location, _keys_at(error["loc"]), root, reading)
    where = reading.place(_at(location, root))
    if kind == "missing":
        message = f"{_called(location[:-1])} lacks the key `{location[-1]}`"
        return Problem("CQ010", message, where, f"add `{location[-1]}: …`")
    choice = kind == "literal_error"
    expected = context["expected"].replace("'", "`") if choice else _EXPECTED.get(kind)
    if expected is None:
        return Problem("CQ011", f"{_called(location)}: {context.get('error', error['msg'])}", where)
    message = f"{_called(location)} must be {expected}, found {described(_at(location, root))}"
    advice = "begin each with a dash: `- …`" if kind == "list_type" else None
    return Problem("CQ011" if choice else "CQ009", message, where, advice)


_KEY: Final = "[key]"
"""The suffix of pydantic for an unknown key."""


def _unknown_key(location: Sequence[int | str], known: Sequence[str], root: Node, reading: SourceReading) -> Problem:
    parent = _at(location[:-1], root)
    key = parent.entries[str(location[-1])][0] if isinstance(parent, MappingNode) else parent
    message = f"`{location[-1]}` is no key here{did_you_mean(str(location[-1]), known)}"
    return Problem("CQ006", message, reading.place(key), f"known: {', '.join(known)}")


def _keys_at(location: Sequence[int | str]) -> tuple[str, ...]:
    """Return the keys that may stand where pydantic found an unknown one."""
    models: dict[str, type[_Model]] = {
        **_FORMS,
        "policies": PolicyModel,
        "rules": RuleModel,
        "presets": PresetModel,
        "dialects": DialectModel,
        "conventions": ConventionModel,
        "unaffected": UnaffectedModel,
        "panel": PanelModel,
        "timing": TimingModel,
    }
    if len(location) == 1:
        return tuple(PackModel.model_fields)
    within = location[-2] if location[-2] in _FORMS else location[0]
    return tuple(models[str(within)].model_fields)


def _build(model: PackModel, root: Node, reading: SourceReading) -> RulePack:
    problems: list[Problem] = []
    rules = []
    defined: dict[str, Part] = {}
    for name, text in model.define.items():
        try:
            defined[name] = define(name, parse_value(text, defined))
        except ConditionError as error:
            problems.append(Problem("CQ011", f"`define.{name}`: {error}", reading.place(_at(("define", name), root))))
    for index, each in enumerate(model.rules):
        try:
            rules.append(_rule(each, defined))
        except (ConditionError, PackError) as error:
            part = _CONDITION if isinstance(error, ConditionError) else ()
            problems.append(Problem("CQ011", str(error), reading.place(_at(("rules", index, *part), root))))
    if problems:
        raise InputError(problems)
    made = {
        "policies": (
            *(_policy(name, each) for name, each in model.policies.items()),
            *_policies_of_guarantees(model, rules),
        ),
        "rules": tuple(rules),
        "presets": {name: Preset(**preset.given()) for name, preset in model.presets.items()},
        "dialects": {name: Dialect(**dialect.given()) for name, dialect in model.dialects.items()},
        "panel": Panel(**model.panel.given()),
        "timing": Timing(**model.timing.given()),
        "conventions": tuple(Convention(**each.given()) for each in model.conventions),
        "unaffected": tuple(Unaffected(**each.given()) for each in model.unaffected),
    }
    try:
        return RulePack(**model.given("cqos_pack", "define", *made), **made)  # type: ignore[arg-type]
    except PackError as error:
        codes = [rule.code for rule in rules]
        raise InputError(
            [Problem("CQ011", message, reading.place(_at(_steps(at, codes), root))) for at, message in error.mistakes]
        ) from None


def _steps(at: tuple[str, ...], codes: list[str]) -> tuple[int | str, ...]:
    """Return the path of a mistake in the file: rules are a list, and the last rule of a code is meant."""
    if at[:1] == ("rules",) and at[1] in codes:
        return ("rules", len(codes) - 1 - codes[::-1].index(at[1]), *(_CONDITION if at[2:] else ()))
    return at


def _policies_of_guarantees(model: PackModel, rules: Sequence[Rule]) -> Iterator[Policy]:
    """Yield the policies that rules about guarantees bring with them."""
    if any(rule.guarantee for rule in rules):
        yield from NEEDS
    named = {term.name for rule in rules for term, _ in terms(rule.condition)}
    if TAKEN_EVERY.name in named - model.policies.keys():
        yield TAKEN_EVERY


_KINDS_OF_RULES: Final = {"requires": requires, "forbids": forbids, "matched_if": matched_if, "meets": matched_if}
_CONDITION: Final = (*_KINDS_OF_RULES, "what")
"""Keys that may hold the condition of a rule."""


def _rule(model: RuleModel, defined: Mapping[str, Part]) -> Rule:
    if model.gives is not None:
        what = None if model.what is None else parse_value(model.what, defined)
        return gives(model.gives, what, **model.given("gives", "what"))
    kind = next(kind for kind in _KINDS_OF_RULES if getattr(model, kind) is not None)
    return _KINDS_OF_RULES[kind](parse(getattr(model, kind), defined), **model.given(*_KINDS_OF_RULES))


_OF_KINDS: Final = ("kind", "values", "ordered", "synonyms", "affixes", "minimum", "maximum", "unlimited", "unit")
_DOMAINS: Final[dict[str, Callable[[PolicyModel], Domain]]] = {
    "choice": lambda model: Choice(
        *model.values, ordered=model.ordered, affixes=model.affixes, synonyms=model.synonyms
    ),
    "duration": lambda model: Duration(bare_unit=model.unit or None),
    "count": lambda model: Count(model.minimum, model.maximum, unlimited=model.unlimited, unit=model.unit),
    "flag": lambda _: Flag(),
    "names": lambda _: Names(),
    "text": lambda _: Text(),
}


def _policy(name: str, model: PolicyModel) -> Policy:
    return Policy(name=name, domain=_DOMAINS[model.kind](model), **model.given(*_OF_KINDS))
