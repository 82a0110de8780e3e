"""What is wrong with a system that a caller sends, field by field, before it is read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import date
from typing import Any, Final, NamedTuple, TypeAlias

from cqos.v1 import report_pb2, system_pb2
from cqos_core.model.flow import positions_missing
from cqos_core.model.re2_patterns import PatternError, name_matcher
from cqos_core.model.system import NAMED
from cqos_core.remote.messages import from_message

_BOTH_ROLES: Final = (report_pb2.ROLE_PUBLISHER, report_pb2.ROLE_SUBSCRIBER)
_SEVERITIES: Final = (report_pb2.SEVERITY_ERROR, report_pb2.SEVERITY_WARNING, report_pb2.SEVERITY_NOTE)
_LEVELS: Final = ("error", "warning", "note", "off")
_BOUNDS: Final = ("exactly", "at_least", "at_most", "one_of", "not")


class FieldProblem(NamedTuple):
    """What is wrong with one field of a request."""

    field: str
    description: str


_Rows: TypeAlias = "Iterable[tuple[str, object, str]]"
"""What may be wrong with an entry: the rest of the path, whether it is, and what to say then."""


def _wrong(path: str, rows: _Rows) -> Iterator[FieldProblem]:
    return (FieldProblem(path + rest, text) for rest, is_wrong, text in rows if is_wrong)


def system_problems(message: system_pb2.System, path: str = "system") -> Iterator[FieldProblem]:
    """Yield what no importer would have let pass, each with the path of its field."""
    known = {each.id for each in message.participants}
    for field, found in message.ListFields():
        name = field.name
        if name == "endpoints":
            for index, endpoint in enumerate(found):
                yield from endpoint_problems(endpoint, known, f"{path}.endpoints[{index}]")
        elif name in NAMED:
            for index, entry in enumerate(found):
                yield from named_problems(entry, f"{path}.{name}[{index}]")
            yield from _wrong(f"{path}.{name}", _repeated(found, NAMED[name]))
    yield from part_problems(message, path)


def _repeated(entries: Iterable[Any], key: str) -> _Rows:
    seen: set[str] = set()
    for index, entry in enumerate(entries):
        name = getattr(entry, key)
        yield f"[{index}].{key}", name in seen, f"`{name}` is there already"
        seen.add(name)


def named_problems(message: Any, path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with a participant, profile, topic, broker, bridge, chain or link."""
    key = _NEEDED.get(type(message))
    if key is not None:
        said = f"{'an id' if key == 'id' else 'a name'} is needed"
        yield from _wrong(path, [(f".{key}", not getattr(message, key), said)])
    for index, route in enumerate(getattr(message, "routes", ())):
        yield from _wrong(f"{path}.routes[{index}]", _route(route))


# A topic may be without a name, which is reported.
_NEEDED: Final[Mapping[type[Any], str]] = {
    system_pb2.Participant: "id",
    system_pb2.Profile: "name",
    system_pb2.Bridge: "id",
    system_pb2.Chain: "name",
    system_pb2.Link: "name",
}


def endpoint_problems(message: system_pb2.Endpoint, participants: set[str], path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with an endpoint, whose participant must be one of ``participants``."""
    owner = message.participant
    if message.id and owner and owner in participants and message.role in _BOTH_ROLES:
        return iter(())
    needed = "a role is needed: ROLE_PUBLISHER or ROLE_SUBSCRIBER"
    lost = f"`{owner}` is none of the participants" if owner else "an id is needed"
    rows: _Rows = (
        (".id", not message.id, "an id is needed"),
        (".role", message.role not in _BOTH_ROLES, _unknown_number(message.role) if message.role else needed),
        (".participant", not owner or owner not in participants, lost),
    )
    return _wrong(path, rows)


def _route(message: system_pb2.Route) -> _Rows:
    """What may be wrong with a route; that a participant is not there is a finding of the check."""
    for end, role, does in (
        ("source", report_pb2.ROLE_SUBSCRIBER, "subscribes to"),
        ("target", report_pb2.ROLE_PUBLISHER, "publishes"),
    ):
        side = getattr(message, end)
        needed = f"{report_pb2.Role.Name(role)} is needed: a bridge {does} it"
        yield f".{end}.role", side.role != role, needed
        yield f".{end}.participant", not side.participant, "an id is needed"
    for field in ("only", "but"):
        for index, text in enumerate(getattr(message, field)):
            try:
                name_matcher(text)
            except PatternError as error:
                yield f".{field}[{index}]", True, f"it is no regular expression: {error}"


def _unknown_number(number: int) -> str:
    return f"{number} is no role: 1 is ROLE_PUBLISHER, 2 is ROLE_SUBSCRIBER"


def part_problems(message: Any, path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with what has no name in a system, or in a message that holds such a part alone."""
    for field, found in message.ListFields():
        rows = _OF_PARTS.get(field.name)
        if rows is not None:
            for key, each in found.items() if isinstance(found, Mapping) else enumerate(found):
                yield from _wrong(f"{path}.{field.name}[{key}]", rows(each))


def _check(rule: system_pb2.TeamRule) -> _Rows:
    for place, bound in enumerate(rule.require):
        unknown = f"`{bound.relation}` is none of {', '.join(_BOUNDS)}"
        yield f".require[{place}].relation", bound.relation not in _BOUNDS, unknown
        yield f".require[{place}].values", not bound.values, "a value is needed"


def _flow(each: system_pb2.ControlFlow) -> _Rows:
    wrong = positions_missing(from_message(each))
    return (("", wrong is not None, wrong or ""),)


def _accept(each: system_pb2.Acceptance) -> _Rows:
    is_wrong = each.HasField("until") and not _is_date(each.until)
    return (
        (".because", not each.because, "a reason is needed"),
        (".until", is_wrong, f"`{each.until}` is no date such as 2027-01-31"),
    )


def _is_date(text: str) -> bool:
    try:
        date.fromisoformat(text)
    except ValueError:
        return False
    return True


_OF_PARTS: Final[Mapping[str, Callable[[Any], _Rows]]] = {
    "flows": _flow,
    "overlays": lambda each: [(".role", each.role not in (0, *_BOTH_ROLES), _unknown_number(each.role))],
    "checks": _check,
    "accept": _accept,
    "severities": lambda level: [("", level not in _LEVELS, f"`{level}` is none of {', '.join(_LEVELS)}")],
    "notes": lambda note: [(".severity", note.severity not in _SEVERITIES, "a severity is needed")],
}
