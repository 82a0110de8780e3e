"""What is wrong with a system that a caller sends, field by field, before it is read."""

from __future__ import annotations

from datetime import date
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos.v1 import report_pb2, system_pb2
from cqos_core.model.pattern import PatternError, pattern
from cqos_core.model.system import NAMED

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

_BOTH_ROLES: Final = (report_pb2.ROLE_PUBLISHER, report_pb2.ROLE_SUBSCRIBER)
_SEVERITIES: Final = (report_pb2.SEVERITY_ERROR, report_pb2.SEVERITY_WARNING, report_pb2.SEVERITY_NOTE)
_LEVELS: Final = ("error", "warning", "note", "off")
_BOUNDS: Final = ("exactly", "at_least", "at_most", "one_of", "not")


class FieldProblem(NamedTuple):
    """What is wrong with one field of a request."""

    field: str
    description: str


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
            yield from _repeated(found, NAMED[name], f"{path}.{name}")
    yield from part_problems(message, path)


def named_problems(message: Any, path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with a participant, profile, topic, broker or bridge."""
    key = _NEEDED.get(type(message))
    if key is not None and not getattr(message, key):
        yield FieldProblem(f"{path}.{key}", f"{'an id' if key == 'id' else 'a name'} is needed")
    if isinstance(message, system_pb2.Bridge):
        for index, route in enumerate(message.routes):
            yield from _route_problems(route, f"{path}.routes[{index}]")


# A topic may be without a name, which is reported.
_NEEDED: Final[Mapping[type[Any], str]] = {
    system_pb2.Participant: "id",
    system_pb2.Profile: "name",
    system_pb2.Bridge: "id",
}


def _repeated(entries: Any, key: str, path: str) -> Iterator[FieldProblem]:
    seen: set[str] = set()
    for index, entry in enumerate(entries):
        name = getattr(entry, key)
        if name in seen:
            yield FieldProblem(f"{path}[{index}].{key}", f"`{name}` is there already")
        seen.add(name)


def endpoint_problems(message: system_pb2.Endpoint, participants: set[str], path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with an endpoint, whose participant must be one of ``participants``."""
    if not message.id:
        yield FieldProblem(f"{path}.id", "an id is needed")
    if message.role not in _BOTH_ROLES:
        needed = "a role is needed: ROLE_PUBLISHER or ROLE_SUBSCRIBER"
        yield FieldProblem(f"{path}.role", _unknown_number(message.role) if message.role else needed)
    if not message.participant or message.participant not in participants:
        said = f"`{message.participant}` is none of the participants" if message.participant else "an id is needed"
        yield FieldProblem(f"{path}.participant", said)


def _route_problems(message: system_pb2.Route, path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with a route; that a participant is not there is a finding of the check."""
    for end, role in (("source", report_pb2.ROLE_SUBSCRIBER), ("target", report_pb2.ROLE_PUBLISHER)):
        side = getattr(message, end)
        if side.role != role:
            yield FieldProblem(
                f"{path}.{end}.role", f"{report_pb2.Role.Name(role)} is needed: a bridge {_DOES[role]} it"
            )
        if not side.participant:
            yield FieldProblem(f"{path}.{end}.participant", "an id is needed")
    for field in ("only", "but"):
        for index, text in enumerate(getattr(message, field)):
            try:
                pattern(text)
            except PatternError as error:
                yield FieldProblem(f"{path}.{field}[{index}]", f"it is no regular expression: {error}")


_DOES: Final = {report_pb2.ROLE_SUBSCRIBER: "subscribes to", report_pb2.ROLE_PUBLISHER: "publishes"}


def _unknown_number(number: int) -> str:
    return f"{number} is no role: 1 is ROLE_PUBLISHER, 2 is ROLE_SUBSCRIBER"


def part_problems(message: Any, path: str) -> Iterator[FieldProblem]:
    """Yield what is wrong with what has no name in a system, or in a message that holds such a part alone."""
    for field, found in message.ListFields():
        find = _OF_PARTS.get(field.name)
        if find is not None:
            yield from find(found, f"{path}.{field.name}")


def _overlay_problems(overlays: Sequence[system_pb2.Overlay], path: str) -> Iterator[FieldProblem]:
    for index, overlay in enumerate(overlays):
        if overlay.role and overlay.role not in _BOTH_ROLES:
            yield FieldProblem(f"{path}[{index}].role", _unknown_number(overlay.role))


def _check_problems(checks: Sequence[system_pb2.TeamRule], path: str) -> Iterator[FieldProblem]:
    for index, rule in enumerate(checks):
        for place, bound in enumerate(rule.require):
            where = f"{path}[{index}].require[{place}]"
            if bound.relation not in _BOUNDS:
                yield FieldProblem(f"{where}.relation", f"`{bound.relation}` is none of {', '.join(_BOUNDS)}")
            if not bound.values:
                yield FieldProblem(f"{where}.values", "a value is needed")


def _accept_problems(accept: Sequence[system_pb2.Acceptance], path: str) -> Iterator[FieldProblem]:
    for index, accepted in enumerate(accept):
        if not accepted.because:
            yield FieldProblem(f"{path}[{index}].because", "a reason is needed")
        if accepted.HasField("until") and not _is_date(accepted.until):
            yield FieldProblem(f"{path}[{index}].until", f"`{accepted.until}` is no date such as 2027-01-31")


def _is_date(text: str) -> bool:
    try:
        date.fromisoformat(text)
    except ValueError:
        return False
    return True


def _severity_problems(severities: Mapping[str, str], path: str) -> Iterator[FieldProblem]:
    for name, level in severities.items():
        if level not in _LEVELS:
            yield FieldProblem(f"{path}[{name}]", f"`{level}` is none of {', '.join(_LEVELS)}")


def _note_problems(notes: Sequence[system_pb2.ImportNote], path: str) -> Iterator[FieldProblem]:
    for index, note in enumerate(notes):
        if note.severity not in _SEVERITIES:
            yield FieldProblem(f"{path}[{index}].severity", "a severity is needed")


_OF_PARTS: Final[Mapping[str, Callable[[Any, str], Iterator[FieldProblem]]]] = {
    "overlays": _overlay_problems,
    "checks": _check_problems,
    "accept": _accept_problems,
    "severities": _severity_problems,
    "notes": _note_problems,
}
