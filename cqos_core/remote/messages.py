"""Between the library's values and the messages of ``cqos.v1``: field by field, by name.

A message has a field for every field of its dataclass, so that both ways are derived and nothing is lost: a field that
is added to both travels. What a message has beyond that is derived, and passed over on the way back.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import MISSING, fields, replace
from functools import cache, lru_cache, partial
from typing import Any, Final, TypeAlias, TypeVar

from google.protobuf.descriptor import Descriptor, EnumDescriptor, EnumValueDescriptor, FieldDescriptor
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass

from cqos.v1 import report_pb2, session_pb2, system_pb2
from cqos_core.language.domains import Names
from cqos_core.model import chains, coverage, finding, flow, problems, report, settings, system, system_diff
from cqos_core.model.caches import LONGEST_REMEMBERED
from cqos_core.model.finding import Fact, Remedy, Severity, Verdict
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.settings import Cases, Setting, Settings
from cqos_core.remote import description
from cqos_core.remote.endpoint_rows import endpoints_of

T = TypeVar("T")
_Convert: TypeAlias = "Callable[[Any], Any]"

_KINDS: Final[Mapping[str, type[Any]]] = {
    name: vars(module)[name]
    for module, names in (
        (report, "Report Group PairReport PolicyComparison Assumption Guarantee GuaranteeCell HopReport"),
        (finding, "Finding Side Fact Remedy Edit"),
        (system, "System Profile ProfileRef Scope Topic Endpoint Overlay Participant Broker Bridge Room Route Bound"),
        (system, "TeamRule Acceptance ImportNote Part"),
        (settings, "Place"),
        (coverage, "Coverage"),
        (flow, "ControlFlow FlowNode Trigger Timer"),
        (chains, "Chain ChainStep"),
        (problems, "Problem"),
        (description, "DescribedEndpoint DescribedParticipant"),
    )
    for name in names.split()
} | {
    "Diff": system_diff.Diff,
    "Link": chains.StatedLink,
    "MissingEndpoint": system_diff.Missing,
    "DifferentValue": system_diff.Different,
    "ComparedEndpoint": system_diff.Named,
}
_TYPED: Final[Mapping[str, Callable[[str], Any]]] = {
    "Verdict": Verdict,
    "Severity": Severity,
    "Side": system_diff.ComparedSide,
}
_TUPLES: Final[Mapping[str, Callable[..., Any]]] = {"FlowRunner": flow.FlowRunner, "FlowEnds": flow.FlowEnds}
_STATED: Final = "_stated"
_ENDPOINTS: Final = system_pb2.System.DESCRIPTOR.fields_by_name["endpoints"]
_class_of: Final[Callable[[Descriptor], Any]] = GetMessageClass
EVERYTHING: Final[frozenset[str]] = frozenset()
"""The paths of all fields of a message."""


# --- to messages ---


def to_message(value: Any, kind: type[T], paths: frozenset[str] = EVERYTHING) -> T:
    """Return the message of a value that has one: a report, an endpoint, a problem.

    Args:
        value: what to write.
        kind: class of the message.
        paths: the fields to write, ``findings.code`` for one of each finding; the value computes no other. All if empty.
    """
    message: Any = kind
    write = _masked_writer if paths else _writer
    try:
        made: T = write(message, _as_it_is, paths)(value)
    except UnicodeEncodeError:
        made = write(message, _scrubbed, paths)(value)
    return made


def report_message(
    found: report.Report, paths: frozenset[str] = EVERYTHING, least_severe: Severity = Severity.NOTE
) -> report_pb2.Report:
    """Return the message of a report, with findings of some severities only; its counts are those of the whole."""
    if least_severe is Severity.NOTE:
        return to_message(found, report_pb2.Report, paths)
    heard = tuple(each for each in found.findings if each.severity.rank <= least_severe.rank)
    message = to_message(replace(found, findings=heard), report_pb2.Report, paths)
    if message.HasField("counts"):
        message.counts.CopyFrom(_counts(found, _as_it_is)["counts"])
    return message


system_message: Final[Callable[[system.System], system_pb2.System]] = partial(to_message, kind=system_pb2.System)
"""Return the message of a system; the bytes of its sources stay behind."""


def part_message(value: Any, kind: type[T]) -> T:
    """Return the message that has one part of a system, under the name that it has there; see `part_value`."""
    holder: Any = kind
    (part,) = holder.DESCRIPTOR.fields_by_name
    stated = system_message(system.System(**{part: value})).ListFields()
    return kind(**{field.name: found for field, found in stated if field.name == part})


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


def unknown_paths(kind: type[Message], paths: Iterable[str]) -> Iterator[tuple[str, str, Iterable[str]]]:
    """Yield each path that names no field of ``kind``, with the part that is wrong and the fields that there are."""
    for path in paths:
        found: Any = kind.DESCRIPTOR
        for part in path.split("."):
            known = {} if found is None else found.fields_by_name
            if part not in known:
                yield path, part, known
                break
            found = known[part].message_type


def below(paths: frozenset[str], name: str) -> frozenset[str] | None:
    """Return the paths within field ``name``; None where no path leads to it."""
    if not paths or name in paths:
        return EVERYTHING
    return frozenset(path[len(name) + 1 :] for path in paths if path.startswith(f"{name}.")) or None


def _make_writer(kind: type[Any], text: _Convert, paths: frozenset[str] = EVERYTHING) -> _Convert:
    """Return the function that makes messages of ``kind``; ``text`` is applied to all text."""
    descriptor: Descriptor = kind.DESCRIPTOR
    own = {field.name for field in fields(_KINDS[descriptor.name])}
    steps: list[tuple[str, str, bool, _Convert]] = []
    wanted = {field.name: deeper for field in descriptor.fields if (deeper := below(paths, field.name)) is not None}
    for field in descriptor.fields:
        if field.name not in wanted:
            continue
        name = field.name.removesuffix(_STATED)
        word = re.sub("_values?$", "", field.name)
        if name in own:
            steps.append((name, field.name, field.has_presence, _field_writer(field, text, wanted[field.name])))
        elif field.enum_type is not None and word in own:
            steps.append((word, field.name, False, _word_writer(field, field.enum_type)))
    names, derive = _DERIVED.get(descriptor.name, ((), None))
    derived = derive if any(name in wanted for name in names) else None

    def write(value: Any) -> Any:
        given = {}
        for attribute, name, has_presence, convert in steps:
            found = getattr(value, attribute)
            if found or (has_presence and found is not None):  # else the message says the same without it
                given[name] = found if convert is _as_it_is else convert(found)
        if derived is not None:
            made = derived(value, text)
            given |= made if not paths else {name: made[name] for name in made if name in wanted}
        return kind(**given)

    # Pairs whose values differ mostly have the same guarantees, which are most of an answer.
    alike = descriptor.name in _ALIKE and not paths and text is _as_it_is
    return lru_cache(_MOST_ALIKE)(write) if alike else write


_ALIKE: Final = frozenset(("Guarantee", "GuaranteeCell"))
_MOST_ALIKE: Final = 2_000
_writer: Final = cache(_make_writer)
# Any caller may ask for other fields.
_masked_writer: Final = lru_cache(maxsize=64)(_make_writer)


def _field_writer(field: FieldDescriptor, text: _Convert, paths: frozenset[str]) -> _Convert:
    if field.name.endswith(_STATED):
        return lambda settings: _stated(settings, text)
    message = field.message_type
    if message is not None and message.GetOptions().map_entry:
        item = _setting_text(text) if _is_settings(field) else _item_writer(message.fields_by_name["value"], text)
        return lambda found: {text(name): item(each) for name, each in found.items()}
    item = _item_writer(field, text, paths)
    if not field.is_repeated or message is None:
        return item
    if message.name == "NameValue":
        return lambda found: [item(pair) for pair in (found.items() if isinstance(found, dict) else found)]
    return lambda found: [item(each) for each in (found.values() if isinstance(found, dict) else found)]


def _item_writer(field: FieldDescriptor, text: _Convert, paths: frozenset[str] = EVERYTHING) -> _Convert:
    """Return what makes one item of a field; texts may be a list of them."""
    if field.enum_type is not None:
        return _numbers(field.enum_type).__getitem__
    message = field.message_type
    if message is None:
        return text if field.type == FieldDescriptor.TYPE_STRING else _as_it_is
    if message.name == "NameValue":
        return lambda pair: _named(pair, text)
    if message.name in _TUPLES:
        made = _class_of(message)
        return lambda pair: made(**{name: each for name, each in pair._asdict().items() if each is not None})
    if message.name == "Options":
        written = _setting_text(text)
        return lambda settings: system_pb2.Options(
            settings={text(name): written(each) for name, each in settings.items()},
            settings_stated=_stated(settings, text),
        )
    return (_masked_writer if paths else _writer)(_class_of(message), text, paths)


def _word_writer(field: FieldDescriptor, enum: EnumDescriptor) -> _Convert:
    """Return what makes numbers of words; 0 of a word that the enum does not have."""
    numbers = _numbers(enum)
    if field.is_repeated:
        return lambda words: [numbers.get(word, 0) for word in words]
    return lambda word: numbers.get(word, 0)


def _is_settings(field: FieldDescriptor) -> bool:
    around = field.containing_type
    return around is not None and f"{field.name}{_STATED}" in around.fields_by_name


def _setting_text(text: _Convert) -> _Convert:
    return lambda setting: text(setting.text)


def _stated(settings: Mapping[str, Setting], text: _Convert) -> list[system_pb2.StatedSetting]:
    """Say where each was stated and what is not known of it, in order; nothing where that says no more than the map."""
    plain = all(each.place is None and not each.unknown and not each.derived for each in settings.values())
    if plain and list(settings) == sorted(settings):
        return []
    write = _writer(report_pb2.Place, text)
    return [
        system_pb2.StatedSetting(
            name=text(name),
            place=None if each.place is None else write(each.place),
            reported=text(each.reported),
            derived=each.derived,
            unknown=text(each.unknown) if isinstance(each.unknown, str) else "",
            assumption="" if isinstance(each.unknown, str) else text(each.unknown.assumption),
            cases=[] if isinstance(each.unknown, str) else [_named(case, text) for case in each.unknown.values],
        )
        for name, each in settings.items()
    ]


def _named(pair: tuple[str, str], text: _Convert) -> report_pb2.NameValue:
    return report_pb2.NameValue(name=text(pair[0]), value=text(pair[1]))


def _counts(value: report.Report, _text: _Convert) -> dict[str, Any]:
    counts = dict.fromkeys(_COUNTED, 0)
    for group in value.groups:
        counts["pairs"] += group.pairs
        counts[group.verdict] += group.pairs
    for each in value.findings:
        counts["accepted" if each.accepted is not None else _LOUD[each.severity]] += 1
    return {"counts": report_pb2.Counts(**counts)}


_COUNTED: Final = tuple(report_pb2.Counts.DESCRIPTOR.fields_by_name)
_LOUD: Final = {severity: f"{severity}s" for severity in Severity}


def _origin(value: Fact, text: _Convert) -> dict[str, Any]:
    """Take the words for where a value comes from apart."""
    kind, _, name = value.origin.partition(" ")
    number = _numbers(report_pb2.OriginKind.DESCRIPTOR).get(kind, 0)
    if kind == "convention":
        name = name.removeprefix("of ")
    return {"origin_kind": number, "origin_name": text(name) if number else "", **_items(value, text)}


def _items(value: Fact | Remedy, text: _Convert) -> dict[str, Any]:
    """Take a list apart."""
    if not value.value.startswith("["):
        return {}
    with suppress(InvalidValueError):
        return {"items": list(map(text, Names().parse(value.value)))}
    return {}


_DERIVED: Final[Mapping[str, tuple[tuple[str, ...], Callable[[Any, _Convert], dict[str, Any]]]]] = {
    "Report": (("counts",), _counts),
    "Finding": (
        ("place",),
        lambda value, text: {"place": value.place and _writer(report_pb2.Place, text)(value.place)},
    ),
    "Fact": (("origin_kind", "origin_name", "items"), _origin),
    "Remedy": (("items",), _items),
    "Group": (("pairs",), lambda value, _text: {"pairs": value.pairs}),
    "Coverage": (("percent",), lambda value, _text: {"percent": value.percent}),
}
"""Fields that a message has beyond those of its value, and what makes them."""


@cache
def _numbers(enum: EnumDescriptor) -> dict[str, int]:
    """The numbers of an enum by the library's words: ``error`` for SEVERITY_ERROR."""
    return {word_of(value): value.number for value in enum.values}


def word_of(value: EnumValueDescriptor) -> str:
    """Return the library's word for a value of an enum: ``error`` for SEVERITY_ERROR, ``pair`` for RULE_SCOPE_PAIR."""
    prefix = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", value.type.name).upper()
    return value.name.removeprefix(f"{prefix}_").lower()


# --- and back ---


def part_value(message: Any) -> Any:
    """Return what a message holds that has one part of a system, under the name that it has there."""
    (part,) = message.DESCRIPTOR.fields_by_name
    return getattr(
        system_value(system_pb2.System(**{field.name: found for field, found in message.ListFields()})), part
    )


def change_message(kind: str, value: Any) -> session_pb2.Change:
    """Return the message of one edit of a session; see `cqos_core.checking.system_editor.SystemEditor`."""
    field = session_pb2.Change.DESCRIPTOR.fields_by_name[kind]
    if field.message_type is not None:
        made = _class_of(field.message_type)
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


report_value: Final[Callable[[report_pb2.Report], report.Report]] = from_message
"""Return the report of a message."""
pair_value: Final[Callable[[report_pb2.PairReport], report.PairReport]] = from_message
"""Return the report on one pair of a message."""
system_value: Final[Callable[[system_pb2.System], system.System]] = from_message
"""Return the system of a message, which `system_problems` found nothing wrong with."""


@cache
def _reader(kind: type[Any]) -> _Convert:
    descriptor: Descriptor = kind.DESCRIPTOR
    made = _KINDS[descriptor.name]
    steps: dict[FieldDescriptor, tuple[str, _Convert | None]] = {}
    settings: list[str] = []
    needed: dict[str, Any] = {}
    for each in fields(made):
        field = descriptor.fields_by_name.get(each.name)
        if field is None:
            continue
        if field.message_type is not None and _is_settings(field):
            steps[field] = steps[descriptor.fields_by_name[f"{each.name}{_STATED}"]] = each.name, None
            settings += [each.name] if each.default_factory is MISSING else ()
            continue
        steps[field] = each.name, _field_reader(field, str(each.type))
        required = each.default is MISSING and each.default_factory is MISSING
        # Leaving these out means zero, false or no text.
        plain = not (field.has_presence or field.is_repeated or field.enum_type is not None)
        if required or plain or "None" in str(each.type):
            needed[each.name] = _nothing(field, str(each.type))

    def read(message: Any) -> Any:
        given = needed.copy()
        stated = {*settings}
        for field, value in message.ListFields():
            step = steps.get(field)
            if step is None:
                continue
            name, convert = step
            if convert is None:
                stated.add(name)
                continue
            found = value if convert is _as_it_is else convert(value)
            if found is not None:
                given[name] = found
        for name in stated:
            given[name] = settings_value(getattr(message, name), getattr(message, f"{name}{_STATED}"))
        return made(**given)

    return read


def _nothing(field: FieldDescriptor, annotation: str) -> Any:
    """What a field has that every value needs and the message leaves out."""
    if field.is_repeated and "None" not in annotation:
        return _container(annotation)(())
    known = "None" in annotation or field.enum_type is not None or field.message_type is not None
    return None if known else field.default_value


def _container(annotation: str) -> Callable[[Any], Any]:
    return tuple if annotation.startswith("tuple") else dict if annotation.startswith(("dict", "Mapping")) else list


def _field_reader(field: FieldDescriptor, annotation: str) -> _Convert:
    message, container = field.message_type, _container(annotation)
    if message is not None and message.GetOptions().map_entry:
        item = _item_reader(message.fields_by_name["value"], "Verdict")
        return lambda found: {
            name: Verdict.UNKNOWN if (value := item(found[name])) is None else value for name in sorted(found)
        }
    item = _item_reader(field, annotation)
    if not field.is_repeated:
        return item
    if field is _ENDPOINTS:
        return lambda found: endpoints_of(found, item)
    if field.name == "sources" and container is dict:
        return lambda names: dict.fromkeys(names, b"")
    if message is None:
        return container
    if container is dict and message.name != "NameValue":
        key = "id" if "id" in message.fields_by_name else "name"
        return lambda found: {getattr(each, key): item(each) for each in found}
    return lambda found: container(map(item, found))


def _item_reader(field: FieldDescriptor, annotation: str) -> _Convert:
    """Return what makes a value of one item of a field; None of a word that is not known."""
    message = field.message_type
    if field.enum_type is not None:
        typed = _TYPED.get(annotation.partition(" ")[0], str)
        words = {number: typed(word) if number else None for word, number in _numbers(field.enum_type).items()}
        return words.get
    if message is None:
        return _as_it_is
    if message.name == "NameValue":
        return lambda pair: (pair.name, pair.value)
    if message.name in _TUPLES:
        names = [(each.name, each.has_presence) for each in message.fields]
        made = _TUPLES[message.name]
        return lambda pair: made(
            *(getattr(pair, name) if not optional or pair.HasField(name) else None for name, optional in names)
        )
    if message.name == "Options":
        return lambda options: settings_value(options.settings, options.settings_stated)
    return _reader(_class_of(message))


def settings_value(texts: Mapping[str, str], stated: Any) -> Settings:
    """Return settings, in the order in which they were stated."""
    if not stated:
        return {
            name: _remembered_setting(text) if len(text := texts[name]) <= LONGEST_REMEMBERED else Setting(text)
            for name in sorted(texts)
        }
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
    unknown: str | Cases = stated.unknown
    if stated.assumption:
        unknown = Cases(stated.assumption, tuple((case.name, case.value) for case in stated.cases))
    place = from_message(stated.place) if stated.HasField("place") else None
    return Setting(text, place, unknown, stated.derived, stated.reported)


# Few texts make up most systems.
_remembered_setting = lru_cache(maxsize=16_384)(Setting)
