"""Rows of tables about clients of brokers: the connection that a call states, and the endpoints that it makes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_ros2_sources.walk.call_tables import NOT
from cqos_ros2_sources.walk.expressions import assign
from cqos_ros2_sources.walk.values import MISSING, Instance, Made, NodeRecord, Qos, Template
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_ros2_sources.walk.call_tables import Position, Row
    from cqos_ros2_sources.walk.endpoint_calls import Given
    from cqos_ros2_sources.walk.frames import Walk


def connect(row: Row, given: Given, record: NodeRecord | None, walk: Walk) -> Any:
    """Record what a row says that a call states of a client, or makes; return what the call returns."""
    place = given.call.place
    counts = row.values.get("arguments")
    if counts is not None and len(given.arguments) not in counts:
        return Unknown("a call with another number of arguments")
    walk.made_at.add((place.source, place.line or 0))
    made = Instance(None, library=row.call)
    if row.values.get("new"):
        record = made.node = NodeRecord(row.call, "", "", place, protocol=row.protocol)
        walk.nodes.append(record)
        walk.instances.append(made)
        into = given.expression(row.position("into"))
        if into is not None:
            assign(into, made, walk)
    if record is None:
        walk.homeless.append(place)
        return made
    state(row, given, record, walk)
    if "makes" in row.values:
        settings = dict(_stated("settings", row, given, walk))
        for name, qos in _topics(given.at(row.position("topic"))):
            own = {**settings, "qos": qos} if qos is not MISSING else settings
            record.made.append(Made(row.text("makes"), name, "", Qos("", tuple(own.items())), place))
    return made


def state(row: Row, given: Given, record: NodeRecord, walk: Walk) -> None:
    """Take what a call states of the connection of a client; what two calls state differently is not known."""
    for name, value in _stated("client", row, given, walk):
        known = record.settings.get(name, value)
        same = type(known) is type(value) and known == value
        record.settings[name] = value if same else Unknown("several calls state it differently")


def _stated(key: str, row: Row, given: Given, walk: Walk) -> Iterator[tuple[str, Any]]:
    """Yield the settings that a call states, with the defaults of the library for those that it leaves out."""
    defaults, kinds = row.values.get("defaults", {}), row.values.get("values", {})
    stated = row.values.get(key, {})
    values = {name: _value(row.positions(written), given, kinds.get(name)) for name, written in stated.items()}
    groups = {name.partition(".")[0] for name, value in values.items() if value is not MISSING and value is not None}
    for name, written in stated.items():
        value = values[name]
        if "." in name and name.partition(".")[0] not in groups:
            continue
        if value is MISSING or value is None:
            value = defaults.get(name, MISSING)
        elif isinstance(value, int) and (name in walk.table.lists["flags"]):
            value = bool(value) is not str(written).startswith(NOT)
        if value is not MISSING:
            yield name, value if _plain(value) else Unknown("its value is not followed")
    if key == "settings":
        yield from row.values.get("fixed", {}).items()


def _value(positions: list[Position], given: Given, kind: str | None) -> Any:
    """Return the first argument that a row names and that is of the kind that it asks for."""
    values = [given.at(position) for position in positions]
    return next((each for each in values if isinstance(each, Unknown) or _fits(each, kind)), MISSING)


def _plain(value: Any) -> bool:
    return isinstance(value, (str, int, float, bool, Unknown))


def _fits(value: Any, kind: str | None) -> bool:
    """Whether an argument is of the kind that a row asks for; without one, any that is given is."""
    if value is MISSING or kind is None:
        return value is not MISSING
    return isinstance(value, bool) if kind == "flag" else isinstance(value, str)


def _topics(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the topics that an argument names, each with its quality of service where it stands beside it."""
    if isinstance(value, list) and len(value) == 2 and isinstance(value[0], str) and isinstance(value[1], int):  # noqa: PLR2004 - a topic and its quality of service
        yield value[0], value[1]
    elif isinstance(value, list):
        for each in value:
            yield from _topics(each)
    elif isinstance(value, (str, Unknown)):
        yield value, MISSING
    else:
        cause = (
            "parts of it are decided while it runs" if isinstance(value, Template) else "it is no text that is known"
        )
        yield Unknown("the call does not name it" if value is MISSING else cause), MISSING


# Structures that carry values


def carrier(name: str, given: Given, walk: Walk) -> Instance | None:
    """Return the object of a structure or class that only carries values; None where a name means none."""
    places = walk.table.lookup(walk.table.objects, name)
    if places is None:
        return None
    made = Instance(None, library=name)
    walk.instances.append(made)
    for member, index in places.items():
        if index < len(given.arguments):
            made.members[member] = given.arguments[index]
    made.members.update(given.keywords)
    one = given.arguments[0] if len(given.arguments) == 1 else None
    if isinstance(one, Instance) and one.library == name:
        made.members.update(one.members)
    elif len(given.arguments) == 1 and isinstance(given.arguments[0], dict):
        _fill(made, given.arguments[0], walk)
    elif given.arguments and not places:
        made.members["*"] = Unknown("its fields are stated by position")
    return made


def _fill(made: Instance, values: dict[Any, Any], walk: Walk) -> None:
    for path, value in values.items():
        at = made
        *outer, last = str(path).split(".")
        for name in outer:
            at = inner(at, name, walk)
        if isinstance(value, dict):
            _fill(inner(at, last, walk), value, walk)
        else:
            at.members[last] = value


def inner(made: Instance, name: str, walk: Walk) -> Instance:
    """Return the structure in a member of a structure; it is made where it is not there."""
    found = made.members.get(name)
    if not isinstance(found, Instance):
        found = made.members[name] = Instance(None, library="#")
        walk.instances.append(found)
    return found
