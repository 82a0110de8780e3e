"""From what a walk found to the entries of a node file: equal endpoints joined, what contradicts itself not known."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.walk.endpoint_calls import default_of
from cqos_ros2_sources.walk.values import MISSING, Duration, Either, Overriding, Qos, Template, flipped
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.packages import Package
    from cqos_ros2_sources.walk.package_walk import Explored
    from cqos_ros2_sources.walk.values import Made, NodeRecord, Tests

DIRECTIONS: Final = ("publishes", "subscribes", "serves", "calls", "action_servers", "action_clients")
_UNITS: Final = ((10**9, "s"), (10**6, "ms"), (10**3, "us"), (1, "ns"))
_LONGEST: Final = 200
_BOTH: Final = 2
"""How many endpoints a decision has: one where it holds, one where it does not."""


@dataclass(slots=True)
class Facts:
    """A node file as data, and what belongs to no node.

    Attributes:
        document: as in YAML.
        gaps: what is not known of the package, its cause, where.
    """

    document: dict[str, Any]
    gaps: list[tuple[str, str, str]] = field(default_factory=list)


def facts(package: Package, explored: Explored) -> Facts:
    """Return the node file of a package."""
    document: dict[str, Any] = {"cqos_nodes": 1, "package": package.name, "from": {"by": "learn"}}
    nodes: dict[str, Any] = {}
    for key in sorted(explored.nodes):
        records = [
            each
            for number, each in enumerate(explored.nodes[key])
            if number == 0 or each.made or each.uses or each.gaps
        ]
        for record in records[1:]:
            if isinstance(record.namespace, Unknown):
                named = record.name if isinstance(record.name, str) else record.cls
                records[0].gaps[f"the node `{named}` inside", record.namespace.cause] = record.place
        for number, record in enumerate(records):
            name = key if number == 0 else f"{key}.{number + 1}"
            nodes[name] = _node(record, package, explored.plugins.get(key, "") if number == 0 else "")
        inside = [
            _inside(package.name, f"{key}.{number + 1}", record)
            for number, record in enumerate(records)
            if number and isinstance(record.namespace, str)
        ]
        if inside:
            nodes[key]["inside"] = inside
    if explored.fragments:
        document["fragments"] = {name: _part(record, package) for name, record in sorted(explored.fragments.items())}
    if nodes or not explored.fragments:
        document["nodes"] = nodes
    gaps = [(what, cause, _at(place, package)) for what, cause, place in explored.gaps]
    return Facts(document, sorted(set(gaps)))


def _inside(package: str, key: str, record: NodeRecord) -> dict[str, Any]:
    found = {"node": f"{package}/{key}", "namespace": "${namespace}"}
    if isinstance(record.name, str):
        found["name"] = record.name
    return found


def _node(record: NodeRecord, package: Package, plugin: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if isinstance(record.name, str) and record.name:
        found["name"] = record.name
    if isinstance(record.namespace, str) and record.namespace.strip("/"):
        found["namespace"] = record.namespace
    if record.remaps:
        found["remaps"] = dict(record.remaps)
    if record.alone:
        found["global_arguments"] = False
    if plugin:
        found["plugin"] = plugin
    if record.lifecycle:
        found["lifecycle"] = True
    return {**found, **_part(record, package)}


def _part(record: NodeRecord, package: Package) -> dict[str, Any]:
    found: dict[str, Any] = {}
    entries: dict[str, dict[str, list[dict[str, Any]]]] = {}
    unknown = 0
    for group in _groups([_placed(each, record) for each in _decided(record.made)]):
        name = group[0].name
        if isinstance(name, (str, Template)):
            written = name if isinstance(name, str) else name.text
        else:
            unknown += 1
            written = f"(unknown {unknown})"
        entries.setdefault(group[0].direction, {}).setdefault(written, []).extend(_entries(group, package))
    parameters = _parameters(record, entries)
    if parameters:
        found["parameters"] = parameters
    for direction in DIRECTIONS:
        if direction in entries:
            found[direction] = {
                name: each[0] if len(each) == 1 else each for name, each in sorted(entries[direction].items())
            }
    if record.uses:
        found["uses"] = sorted(record.uses)
    unread = [
        {"what": what, "cause": cause[:_LONGEST], "at": _at(place, package)}
        for (what, cause), place in record.gaps.items()
    ]
    if unread:
        found["unread"] = sorted(unread, key=lambda each: (each["at"], each["what"]))
    return found


def _parameters(record: NodeRecord, entries: dict[str, Any]) -> dict[str, Any]:
    """Return the parameters that decide about endpoints, with their defaults."""
    used = str(entries)
    found: dict[str, Any] = {}
    for name, default in sorted(record.parameters.items()):
        if f"${{{name}}}" not in used and f"'{name}'" not in used:
            continue
        value = default.text if isinstance(default, Template) else default_of(default)
        found[name] = {} if value is MISSING or isinstance(default, Unknown) else {"default": value}
    return found


def _groups(made: Iterable[Made]) -> list[list[Made]]:
    """Return the calls that make one endpoint together: of one direction and name."""
    found: dict[Any, list[Made]] = {}
    for number, each in enumerate(made):
        known = isinstance(each.name, (str, Template))
        key = (each.direction, each.name, each.type if isinstance(each.type, str) else "") if known else (number,)
        found.setdefault(key, []).append(each)
    return [*found.values()]


def _placed(made: Made, record: NodeRecord) -> Made:
    """Return an endpoint; its name is not known where the namespace is not, or options may rename it."""
    written = made.name.text if isinstance(made.name, Template) else made.name
    relative = isinstance(written, str) and not written.startswith("/")
    cause = record.renamed or (record.namespace if relative and isinstance(record.namespace, Unknown) else None)
    return made if cause is None or isinstance(made.name, Unknown) else replace(made, name=cause)


def _decided(made: Iterable[Made]) -> Iterable[Made]:
    """Yield endpoints; one whose name depends on parameters is one for each name."""
    for each in made:
        if not isinstance(each.name, Either):
            yield each
            continue
        before: Tests | None = ()
        for tests, name in each.name.cases:
            held = None if before is None else (*each.tests, *before, *tests)
            perhaps = each.perhaps or ("" if held is not None else "parameters decide about its name")
            yield replace(each, name=name, tests=held or (), perhaps=perhaps)
            other = flipped(tests)
            before = None if before is None or other is None else (*before, *other)


def _entries(group: list[Made], package: Package) -> list[dict[str, Any]]:
    """Return the entries of one endpoint."""
    distinct: list[Made] = []
    for each in group:
        if not any(
            (each.qos, each.tests, each.perhaps, each.for_each, each.branch, each.overriding)
            == (other.qos, other.tests, other.perhaps, other.for_each, other.branch, other.overriding)
            for other in distinct
        ):
            distinct.append(each)
    distinct = _on_both_ways(distinct)
    certain = [each for each in distinct if not each.tests and not each.perhaps]
    if certain:
        qualities = {str(_quality(each.qos)) for each in distinct}
        return [_entry(_as_all(certain[0], distinct), package, unsure=len(qualities) > 1)]
    decided = [each for each in distinct if not each.perhaps]
    if len(decided) == len(distinct) > 1 and _exclude(decided):
        if (
            len({str(_quality(each.qos)) for each in decided}) == 1
            and len(decided) == _BOTH
            and all(len(each.tests) == 1 for each in decided)
        ):
            return [_entry(_as_all(decided[0], decided), package, always=True)]
        return [_entry(each, package) for each in decided]
    if len(distinct) == 1:
        return [_entry(distinct[0], package)]
    qualities = {str(_quality(each.qos)) for each in distinct}
    perhaps = next((each.perhaps for each in distinct if each.perhaps), "several conditions decide about it")
    return [_entry(_as_all(distinct[0], distinct), package, unsure=len(qualities) > 1, perhaps=perhaps)]


def _as_all(one: Made, made: list[Made]) -> Made:
    """Return one endpoint for several: what `qos_overrides` may set is not known where their options differ."""
    same = all(each.overriding == one.overriding for each in made)
    return (
        one if same else replace(one, overriding=Overriding((), "it is made at several places with different options"))
    )


def _on_both_ways(made: list[Made]) -> list[Made]:
    """Return endpoints; what is made in both branches of a decision is made."""
    for one in made:
        for other in made:
            opposite = one.branch == 1 and other.branch == -1 and one.perhaps == other.perhaps
            if opposite and (one.qos, one.tests, one.for_each) == (other.qos, other.tests, other.for_each):
                rest = [each for each in made if each is not one and each is not other]
                return _on_both_ways([replace(_as_all(one, [other]), perhaps="", branch=0), *rest])
    return made


def _exclude(made: list[Made]) -> bool:
    """Whether of several endpoints at most one is made: each excludes each other one."""
    for one in made:
        for other in made:
            if one is not other and not any(_opposed(first, second) for first in one.tests for second in other.tests):
                return False
    return True


def _opposed(first: Any, second: Any) -> bool:
    if first.subject != second.subject:
        return False
    if first.negated is not second.negated:
        return bool(
            set(second.values if first.negated else first.values)
            <= set(first.values if first.negated else second.values)
        )
    return not first.negated and not set(first.values) & set(second.values)


def _entry(
    made: Made, package: Package, *, unsure: bool = False, perhaps: str = "", always: bool = False
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if isinstance(made.name, Unknown):
        found["unknown"] = made.name.cause[:_LONGEST]
    if isinstance(made.type, str):
        found["type"] = made.type
    quality = _quality(made.qos)
    if unsure:
        quality = {"unknown": "it is made at several places with different qualities of service"}
    if quality:
        found["qos"] = quality
    if perhaps or made.perhaps:
        found["perhaps"] = (perhaps or made.perhaps)[:_LONGEST]
    if made.tests and not always and not found.get("perhaps"):
        found["when"] = _when(made.tests)
    if made.for_each:
        found["for_each"] = dict(made.for_each)
    if made.overriding.policies:
        found["overridable"] = list(made.overriding.policies)
    if made.overriding.unknown:
        found["overridable_unknown"] = made.overriding.unknown[:_LONGEST]
    found["at"] = _at(made.place, package)
    return found


def _when(tests: Tests) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for each in tests:
        values: Any = each.values[0] if len(each.values) == 1 else list(each.values)
        found[each.subject] = {"not": values} if each.negated else values
    return found


def _quality(value: Any) -> Any:
    """Return a quality of service as node files write it."""
    if isinstance(value, Unknown):
        return {"unknown": value.cause[:_LONGEST]}
    if isinstance(value, Either):
        return [{**({"when": _when(tests)} if tests else {}), **_as_map(_quality(each))} for tests, each in value.cases]
    if not isinstance(value, Qos):
        return {"unknown": "it is not followed"}
    settings: dict[str, Any] = {}
    unread: dict[str, str] = {}
    for policy, each in value.settings:
        if isinstance(each, Unknown):
            unread[policy] = each.cause[:_LONGEST]
        else:
            settings[policy] = (
                each.text
                if isinstance(each, Template)
                else duration(each.nanoseconds)
                if isinstance(each, Duration)
                else each
            )
    if settings.get("history") == "keep_last" and value.preset in {"", "default", "sensor_data"}:
        del settings["history"]
    preset = "" if value.preset in {"", "default"} and settings else value.preset
    if unread:
        settings["unread"] = unread
    if not settings:
        return preset
    return {**({"profile": preset} if preset else {}), **settings}


def _as_map(quality: Any) -> dict[str, Any]:
    return quality if isinstance(quality, dict) else {"profile": quality or "default"}


def duration(nanoseconds: int) -> str:
    """Return a duration with its largest whole unit."""
    factor, unit = next((each for each in _UNITS if nanoseconds % each[0] == 0), _UNITS[-1])
    return f"{nanoseconds // factor}{unit}"


def _at(place: Place, package: Package) -> str:
    path = os.path.relpath(place.source, package.folder) if os.path.isabs(place.source) else place.source  # noqa: PTH117
    return f"{path}:{place.line}" if place.line else path
