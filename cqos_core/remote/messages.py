"""Between the library's values and the messages of ``cqos.v1``: field by field, by name.

A message has a field for every field of its dataclass, so that both ways are derived and nothing is lost: a field that
is added to both travels. What a message has beyond that is derived, and passed over on the way back.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import MISSING, fields
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypeVar

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass

from cqos.v1 import report_pb2, session_pb2, system_pb2
from cqos_core.analysis import differences
from cqos_core.language.policy import Names
from cqos_core.model import problems, report, system
from cqos_core.model.memory import LONGEST_REMEMBERED
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.report import Severity, Verdict
from cqos_core.model.system import Setting

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from google.protobuf.descriptor import Descriptor, EnumDescriptor, EnumValueDescriptor

T = TypeVar("T")
_Convert: TypeAlias = "Callable[[Any], Any]"

_KINDS: Final[Mapping[str, type[Any]]] = {
    name: vars(module)[name]
    for module, names in (
        (report, "Report Group Finding Side Fact Remedy Edit PairReport PolicyComparison Assumption"),
        (report, "Guarantee GuaranteeCell HopReport"),
        (system, "System Profile ProfileRef Scope Topic Endpoint Overlay Participant Broker Bridge Room Route Bound"),
        (system, "TeamRule Acceptance ImportNote Place"),
        (problems, "Problem"),
    )
    for name in names.split()
} | {
    "Diff": differences.Diff,
    "MissingEndpoint": differences.Missing,
    "DifferentValue": differences.Different,
    "ComparedEndpoint": differences.Named,
}
_TYPED: Final[Mapping[str, Callable[[str], Any]]] = {
    "Verdict": Verdict,
    "Severity": Severity,
    "Side": differences.ComparedSide,
}
_STATED: Final = "_stated"


# --- to messages ---


def report_message(value: report.Report) -> report_pb2.Report:
    """Return the message of a report."""
    return _to_message(value, report_pb2.Report)  # type: ignore[no-any-return]


def pair_message(value: report.PairReport) -> report_pb2.PairReport:
    """Return the message of a report on one pair."""
    return _to_message(value, report_pb2.PairReport)  # type: ignore[no-any-return]


def system_message(value: system.System) -> system_pb2.System:
    """Return the message of a system; the bytes of its sources stay behind."""
    return _to_message(value, system_pb2.System)  # type: ignore[no-any-return]


def part_message(value: Any, kind: type[T]) -> T:
    """Return the message that has one part of a system, under the name that it has there; see `part_value`."""
    holder: Any = kind
    (part,) = holder.DESCRIPTOR.fields_by_name
    stated = system_message(system.System(**{part: value})).ListFields()
    return kind(**{field.name: found for field, found in stated if field.name == part})


def to_message(value: Any, kind: type[T]) -> T:
    """Return the message of any other value that has one: an endpoint, a finding, a problem."""
    return _to_message(value, kind)  # type: ignore[no-any-return]


def _to_message(value: Any, kind: Any) -> Any:
    try:
        made = _writer(kind, _as_it_is)(value)
    except UnicodeEncodeError:
        made = _writer(kind, _scrubbed)(value)
    return made


def _as_it_is(value: Any) -> Any:
    return value


def _scrubbed(value: Any) -> Any:
    """Replace halves of characters, which a damaged file may bring and no message can carry."""
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode()
    if isinstance(value, (tuple, list)):
        return [_scrubbed(item) for item in value]
    if isinstance(value, dict):
        return {_scrubbed(name): _scrubbed(item) for name, item in value.items()}
    return value


@cache
def _writer(kind: type[Any], text: _Convert) -> _Convert:
    """Return the function that makes messages of ``kind``; ``text`` is applied to all text."""
    descriptor: Descriptor = kind.DESCRIPTOR
    own = {field.name for field in fields(_KINDS[descriptor.name])}
    steps: list[tuple[str, str, bool, _Convert]] = []
    for field in descriptor.fields:
        name = field.name.removesuffix(_STATED)
        word = re.sub("_values?$", "", field.name)
        if name in own:
            steps.append((name, field.name, field.has_presence, _field_writer(field, text)))
        elif field.enum_type is not None and word in own:
            steps.append((word, field.name, False, _word_writer(field)))
    derived = _DERIVED.get(descriptor.name)

    def write(value: Any) -> Any:
        given = {}
        for attribute, name, has_presence, convert in steps:
            found = getattr(value, attribute)
            if found or (has_presence and found is not None):  # else the message says the same without it
                given[name] = found if convert is _as_it_is else convert(found)
        if derived is not None:
            given.update(derived(value, text))
        return kind(**given)

    return write


def _field_writer(field: FieldDescriptor, text: _Convert) -> _Convert:
    if field.enum_type is not None:
        return _numbers(field.enum_type).__getitem__
    message = field.message_type
    if message is None:
        return text if field.type == FieldDescriptor.TYPE_STRING else _as_it_is
    if message.GetOptions().map_entry:
        return _map_writer(field, text)
    if field.name.endswith(_STATED):
        return lambda settings: _stated(settings, text)
    if message.name == "NameValue":
        if field.is_repeated:
            return lambda found: [_named(pair, text) for pair in (found.items() if isinstance(found, dict) else found)]
        return lambda pair: _named(pair, text)
    nested: Any = GetMessageClass(message)
    write = _writer(nested, text)
    if field.is_repeated:
        return lambda found: [write(each) for each in (found.values() if isinstance(found, dict) else found)]
    return write


def _word_writer(field: FieldDescriptor) -> _Convert:
    """Return what makes numbers of words; 0 of a word that the enum does not have."""
    assert field.enum_type is not None  # noqa: S101 - the caller looked
    numbers = _numbers(field.enum_type)
    if field.is_repeated:
        return lambda words: [numbers.get(word, 0) for word in words]
    return lambda word: numbers.get(word, 0)


def _map_writer(field: FieldDescriptor, text: _Convert) -> _Convert:
    value = _value_of(field)
    if value.enum_type is not None:
        numbers = _numbers(value.enum_type)
        return lambda found: {text(name): numbers[item] for name, item in found.items()}
    if value.message_type is not None and value.message_type.name in _KINDS:
        nested: Any = GetMessageClass(value.message_type)
        write = _writer(nested, text)
        return lambda found: {text(name): write(item) for name, item in found.items()}
    if value.message_type is not None:  # options by pack
        return lambda found: {
            text(name): system_pb2.Options(settings=_texts(settings, text), settings_stated=_stated(settings, text))
            for name, settings in found.items()
        }
    if _is_settings(field):
        return lambda found: _texts(found, text)
    return lambda found: {text(name): text(item) for name, item in found.items()}


def _value_of(field: FieldDescriptor) -> FieldDescriptor:
    """The values of a map."""
    entry = field.message_type
    assert entry is not None  # noqa: S101 - every map has entries
    return entry.fields_by_name["value"]


def _is_settings(field: FieldDescriptor) -> bool:
    around = field.containing_type
    return around is not None and f"{field.name}{_STATED}" in around.fields_by_name


def _texts(settings: Mapping[str, Setting], text: _Convert) -> dict[str, str]:
    return {text(name): text(setting.text) for name, setting in settings.items()}


def _stated(settings: Mapping[str, Setting], text: _Convert) -> list[system_pb2.StatedSetting]:
    """Say where each was stated and what is not known of it, in order; nothing where that says no more than the map."""
    plain = all(each.place is None and not each.unknown and not each.derived for each in settings.values())
    if plain and list(settings) == sorted(settings):
        return []
    write = _writer(report_pb2.Place, text)
    return [
        system_pb2.StatedSetting(
            name=text(name),
            place=None if setting.place is None else write(setting.place),
            reported=text(setting.reported),
            derived=setting.derived,
            **_unknown(setting.unknown, text),
        )
        for name, setting in settings.items()
    ]


def _unknown(unknown: str | system.Cases, text: _Convert) -> dict[str, Any]:
    if isinstance(unknown, str):
        return {"unknown": text(unknown)}
    return {"assumption": text(unknown.assumption), "cases": [_named(case, text) for case in unknown.values]}


def _named(pair: tuple[str, str], text: _Convert) -> report_pb2.NameValue:
    return report_pb2.NameValue(name=text(pair[0]), value=text(pair[1]))


def _counts(value: report.Report, _text: _Convert) -> dict[str, Any]:
    counts = dict.fromkeys(_COUNTED, 0)
    for group in value.groups:
        counts["pairs"] += group.pairs
        counts[group.verdict] += group.pairs
    for finding in value.findings:
        counts["accepted" if finding.accepted is not None else _LOUD[finding.severity]] += 1
    return {"counts": report_pb2.Counts(**counts)}


_COUNTED: Final = tuple(report_pb2.Counts.DESCRIPTOR.fields_by_name)
_LOUD: Final = {severity: f"{severity}s" for severity in Severity}


def _best_place(value: report.Finding, text: _Convert) -> dict[str, Any]:
    place = value.place
    return {} if place is None else {"place": _writer(report_pb2.Place, text)(place)}


def _origin(value: report.Fact, text: _Convert) -> dict[str, Any]:
    """Take the words for where a value comes from apart."""
    kind, _, name = value.origin.partition(" ")
    number = _numbers(report_pb2.OriginKind.DESCRIPTOR).get(kind, 0)
    if kind == "convention":
        name = name.removeprefix("of ")
    return {"origin_kind": number, "origin_name": text(name) if number else "", **_items(value, text)}


def _items(value: report.Fact | report.Remedy, text: _Convert) -> dict[str, Any]:
    """Take a list apart."""
    if not value.value.startswith("["):
        return {}
    with suppress(InvalidValueError):
        return {"items": list(map(text, Names().parse(value.value)))}
    return {}


_DERIVED: Final[Mapping[str, Callable[[Any, _Convert], dict[str, Any]]]] = {
    "Report": _counts,
    "Finding": _best_place,
    "Fact": _origin,
    "Remedy": _items,
    "Group": lambda value, _text: {"pairs": value.pairs},
}


@cache
def _numbers(enum: EnumDescriptor) -> dict[str, int]:
    """The numbers of an enum by the library's words: ``error`` for SEVERITY_ERROR."""
    return {word_of(value): value.number for value in enum.values}


def word_of(value: EnumValueDescriptor) -> str:
    """Return the library's word for a value of an enum: ``error`` for SEVERITY_ERROR, ``pair`` for RULE_SCOPE_PAIR."""
    prefix = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", value.type.name).upper()
    return value.name.removeprefix(f"{prefix}_").lower()


@cache
def _words(enum: EnumDescriptor) -> dict[int, str | None]:
    return {number: None if number == 0 else word for word, number in _numbers(enum).items()}


# --- and back ---


def report_value(message: report_pb2.Report) -> report.Report:
    """Return the report of a message."""
    return from_message(message)  # type: ignore[no-any-return]


def pair_value(message: report_pb2.PairReport) -> report.PairReport:
    """Return the report on one pair of a message."""
    return from_message(message)  # type: ignore[no-any-return]


def system_value(message: system_pb2.System) -> system.System:
    """Return the system of a message, which `system_problems` found nothing wrong with."""
    return from_message(message)  # type: ignore[no-any-return]


def part_value(message: Any) -> Any:
    """Return what a message holds that has one part of a system, under the name that it has there."""
    (part,) = message.DESCRIPTOR.fields_by_name
    return getattr(
        system_value(system_pb2.System(**{field.name: found for field, found in message.ListFields()})), part
    )


def change_message(kind: str, value: Any) -> session_pb2.Change:
    """Return the message of one edit of a session; see `cqos_core.checking.session.Edits`."""
    field = session_pb2.Change.DESCRIPTOR.fields_by_name[kind]
    if field.message_type is not None:
        made: Any = GetMessageClass(field.message_type)
        if field.message_type.name in _KINDS:
            value = to_message(value, made)
        elif kind == _OPTION:
            value = made(**dict(zip(field.message_type.fields_by_name, value, strict=True)))
        else:
            value = part_message(value, made)
    return session_pb2.Change(**{kind: value})


def change_value(change: session_pb2.Change) -> tuple[str, Any]:
    """Return kind and value of the edit of a message."""
    kind = change.WhichOneof("change") or ""
    value: Any = getattr(change, kind)
    if kind == _OPTION:
        return kind, (value.pack, value.name, value.value if value.HasField("value") else None)
    if not isinstance(value, Message):
        return kind, value
    return kind, from_message(value) if value.DESCRIPTOR.name in _KINDS else part_value(value)


_OPTION: Final = "set_option"


def from_message(message: Message) -> Any:
    """Return the value of a message of any kind that has one."""
    kind: Any = type(message)
    return _reader(kind)(message)


@cache
def _reader(kind: type[Any]) -> _Convert:
    descriptor: Descriptor = kind.DESCRIPTOR
    made = _KINDS[descriptor.name]
    steps: dict[FieldDescriptor, tuple[str, _Convert]] = {}
    settings: list[tuple[str, str, bool]] = []
    needed: dict[str, Any] = {}
    for each in fields(made):
        field = descriptor.fields_by_name.get(each.name)
        if field is None:
            continue
        if field.message_type is not None and _is_settings(field):
            settings.append((each.name, f"{each.name}{_STATED}", each.default_factory is MISSING))
            continue
        steps[field] = each.name, _field_reader(field, str(each.type))
        required = each.default is MISSING and each.default_factory is MISSING
        if required or _is_plain(field) or "None" in str(each.type):
            needed[each.name] = _nothing(field, str(each.type))

    def read(message: Any) -> Any:
        given = needed.copy()
        for field, value in message.ListFields():
            step = steps.get(field)
            if step is not None:
                name, convert = step
                found = convert(value)
                if found is not None:
                    given[name] = found
        for name, listed, always in settings:
            texts, stated = getattr(message, name), getattr(message, listed)
            if texts or stated or always:
                given[name] = settings_value(texts, stated)
        return made(**given)

    return read


def _is_plain(field: FieldDescriptor) -> bool:
    """Whether leaving it out means zero, false or no text."""
    return not (field.has_presence or field.is_repeated or field.enum_type is not None)


def _nothing(field: FieldDescriptor, annotation: str) -> Any:
    """What a field has that every value needs and the message leaves out."""
    if "None" in annotation:  # whatever its default is
        return None
    if field.is_repeated:
        return _container(annotation)(())
    if field.enum_type is not None or field.message_type is not None:
        return None
    return field.default_value


def _container(annotation: str) -> Callable[[Any], Any]:
    return tuple if annotation.startswith("tuple") else dict if annotation.startswith(("dict", "Mapping")) else list


def _field_reader(field: FieldDescriptor, annotation: str) -> _Convert:
    if field.enum_type is not None:
        typed = _TYPED.get(annotation.partition(" ")[0], str)
        return {number: word and typed(word) for number, word in _words(field.enum_type).items()}.get
    message = field.message_type
    container = _container(annotation)
    if message is None:
        if field.name == "sources" and container is dict:
            return lambda names: dict.fromkeys(names, b"")
        return container if field.is_repeated else _as_it_is
    if message.GetOptions().map_entry:
        return _map_reader(_value_of(field))
    if message.name == "NameValue":
        if field.is_repeated:
            return lambda pairs: container((pair.name, pair.value) for pair in pairs)
        return lambda pair: (pair.name, pair.value)
    nested: Any = GetMessageClass(message)
    read = _reader(nested)
    if not field.is_repeated:
        return read
    if container is dict:
        key = "id" if "id" in message.fields_by_name else "name"
        return lambda found: {getattr(each, key): read(each) for each in found}
    return lambda found: container(map(read, found))


def _map_reader(value: FieldDescriptor) -> _Convert:
    if value.enum_type is not None:
        words = _words(value.enum_type)
        return lambda found: {name: Verdict(words[found[name]] or Verdict.UNKNOWN) for name in sorted(found)}
    if value.message_type is not None and value.message_type.name in _KINDS:
        return lambda found: {name: from_message(found[name]) for name in sorted(found)}
    if value.message_type is not None:
        return lambda found: {
            name: settings_value(found[name].settings, found[name].settings_stated) for name in sorted(found)
        }
    return lambda found: {name: found[name] for name in sorted(found)}


def settings_value(texts: Mapping[str, str], stated: Any) -> system.Settings:
    """Return settings, in the order in which they were stated."""
    if not stated:
        return {name: _setting(texts[name]) for name in sorted(texts)}
    known = {each.name: each for each in stated}
    lists = {each.name: list_text(each.items) for each in stated if each.items and each.name not in texts}
    if lists:
        texts = {**texts, **lists}
    names = [*(name for name in known if name in texts), *(name for name in sorted(texts) if name not in known)]
    return {name: _stated_value(texts[name], known[name]) if name in known else Setting(texts[name]) for name in names}


def list_text(items: Iterable[str]) -> str:
    """Return a list of names as a setting states it."""
    return Names().format(tuple(items))


def _stated_value(text: str, stated: Any) -> Setting:
    unknown: str | system.Cases = stated.unknown
    if stated.assumption:
        unknown = system.Cases(stated.assumption, tuple((case.name, case.value) for case in stated.cases))
    place = from_message(stated.place) if stated.HasField("place") else None
    return Setting(text, place, unknown, stated.derived, stated.reported)


def _setting(text: str) -> Setting:
    return _remembered_setting(text) if len(text) <= LONGEST_REMEMBERED else Setting(text)


# Few texts make up most systems.
_remembered_setting = lru_cache(maxsize=16_384)(Setting)
