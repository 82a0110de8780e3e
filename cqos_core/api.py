"""What callers use: `check`, `check_pair`, `explain`, `read`, `Session`. Re-exported by `cqos_core`."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from datetime import timedelta
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core.checker import Context, check_system
from cqos_core.codes import find_code
from cqos_core.explanation import explain_pair
from cqos_core.files import open_file, read_path
from cqos_core.importers.source import Source, no_files
from cqos_core.loading import Given, load_paths, read_together
from cqos_core.merging import merge
from cqos_core.plugins import Plugins, load_plugins
from cqos_core.policy import INFINITE, Names
from cqos_core.problems import CqosError, InputError, Problem
from cqos_core.remarks import suggestion
from cqos_core.report import Edit
from cqos_core.routes import MOST_ENDPOINTS
from cqos_core.spelling import Known
from cqos_core.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, Place, Setting, System
from cqos_core.system import Topic as StatedTopic
from cqos_core.trial import tried_out

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.applying import Edited
    from cqos_core.codes import CodeInfo
    from cqos_core.differences import Diff
    from cqos_core.pack import RulePack
    from cqos_core.report import Finding, PairReport, Remedy, Report
    from cqos_core.rule import Rule

Input: TypeAlias = "str | PathLike[str] | bytes | System"
SettingValue: TypeAlias = "str | int | bool | timedelta | Sequence[str]"


def context(extra_packs: Iterable[RulePack] = (), default_protocol: str | None = None) -> Context:
    """Return a check context over the installed packs and ``extra_packs``, which win over installed ones of their id."""
    extra = {pack.id: pack for pack in extra_packs}
    plugins = load_plugins()

    def find_pack(pack_id: str) -> RulePack | None:
        return extra.get(pack_id) or plugins.pack(pack_id)

    def find_rule(code: str) -> Rule | CodeInfo | None:
        own = find_code(code)
        if own is not None:
            return own
        for pack in (*extra.values(), *(found for name in plugins.packs if (found := plugins.pack(name)))):
            rule = pack.rule(code) or pack.code(code)
            if rule is not None:
                return rule
        return None

    known = frozenset({*plugins.packs, *extra})
    return Context(find_pack, find_rule, default_protocol, known, most_endpoints=_most_endpoints())


MOST_ENDPOINTS_VARIABLE: Final = "CQOS_MAX_ENDPOINTS"
"""The environment variable with the number of endpoints that a system may have after bridges added theirs."""


def _most_endpoints() -> int:
    given = os.environ.get(MOST_ENDPOINTS_VARIABLE, "")
    if not given:
        return MOST_ENDPOINTS
    if not re.fullmatch("[1-9][0-9]{0,11}", given):
        raise CqosError(f"{MOST_ENDPOINTS_VARIABLE} is `{given[:40]}`, expected a number of endpoints from 1")
    return int(given)


def read(*inputs: Input, importer: str | None = None, protocol: str | None = None) -> System:
    """Read paths, directories, bytes or ready systems into one system; the format is detected.

    ``protocol`` is meant where an input states none. Systems are copied, the caller's stay as they are.

    Raises:
        InputError: with every problem of every input.
    """
    found: dict[int, list[System]] = {}
    given: dict[int, Given] = {}
    problems: dict[int, Sequence[Problem]] = {}
    for position, each in enumerate(inputs):
        if isinstance(each, System):
            if wrong := faults(each):
                problems[position] = wrong
                continue
            found[position] = [replace(deepcopy(each), protocol=each.protocol or protocol)]
            continue
        try:
            if not isinstance(each, bytes) and Path(each).is_dir():
                loaded = load_paths([fspath(each)], importer, protocol=protocol)
                problems[position] = loaded.problems
                found[position] = [system for _, system in loaded.systems]
            else:
                opener = no_files if isinstance(each, bytes) else open_file
                given[position] = Given(_source(inputs, position), opener)
        except InputError as error:
            problems[position] = error.problems
    others = [system for systems in found.values() for system in systems]
    results = read_together([*given.values()], importer, protocol=protocol, others=others)
    for position, result in zip(given, results, strict=True):
        if isinstance(result, System):
            found[position] = [result]
        else:
            problems[position] = result.problems
    told = [problem for position in sorted(problems) for problem in problems[position]]
    if told or not any(found.values()):
        raise InputError(told or [Problem("CQ003", "there is nothing to read")])
    return merge([system for position in sorted(found) for system in found[position]])


def faults(system: System) -> list[Problem]:
    """Say what is wrong with a system that a program put together, such as importers never make it."""
    known = Known(system.participants)
    found = [problem for endpoint in system.endpoints for problem in faults_of(endpoint, system.participants, known)]
    for name, each in system.participants.items():
        if each.id != name:
            found.append(Problem("CQ011", f"participant `{each.id}` is kept under another id, `{name}`", each.place))
        found += _no_settings(f"participant `{name}`", each.settings, each.place)
    return found


def faults_of(
    endpoint: Endpoint, participants: Mapping[str, Participant], known: Known | None = None
) -> Iterator[Problem]:
    """Say what is wrong with an endpoint: its participant is missing, it has no role, or what it states is no setting."""
    name, where = f"endpoint `{endpoint.id}`", endpoint.place
    if endpoint.participant not in participants:
        message = f"{name} belongs to participant `{endpoint.participant}`, which is not there"
        yield Problem("CQ011", message, where, suggestion(endpoint.participant, known or Known(participants)))
    if endpoint.role not in {PUBLISHER, SUBSCRIBER}:
        yield Problem("CQ011", f"{name} has the role `{endpoint.role}`", where, f"allowed: {PUBLISHER}, {SUBSCRIBER}")
    for settings in (endpoint.settings, endpoint.overlay, endpoint.needs):
        yield from _no_settings(name, settings, where)


def _no_settings(name: str, settings: Mapping[str, object], where: Place | None) -> Iterator[Problem]:
    for setting, value in settings.items():
        if not isinstance(value, Setting):
            message = f"`{setting}` of {name} is {value!r}, which is no `Setting`"
            yield Problem("CQ009", message, where, "settings hold their text: `Setting('reliable')`")


def _source(inputs: Sequence[Input], position: int) -> Source:
    """Open a file, or give bytes a name that no others have."""
    data = inputs[position]
    if not isinstance(data, bytes):
        return read_path(fspath(data))  # type: ignore[arg-type]
    number = sum(isinstance(other, bytes) for other in inputs[: position + 1])
    return Source("<bytes>" if number == 1 else f"<bytes {number}>", data)


def check(
    *inputs: Input,
    importer: str | None = None,
    protocol: str | None = None,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
) -> Report:
    """Check a system, given as paths, bytes, or `System` values that are taken together.

    Args:
        inputs: what to read; the format of each is detected.
        importer: read all of them with this importer.
        protocol: pack id for participants that state none.
        options: by pack id, laid over those of the input: ``{"ros2": {"rmw": "cyclonedds"}}``.
        packs: further rule packs beside the installed ones.

    Raises:
        InputError: an input cannot be read; every problem is listed.
        CqosError: an option is of a rule pack that there is not.
    """
    packs = list(packs)
    where = context(packs, protocol)
    assumed = _by_pack(options or {}, where, packs)
    system = tried_out(read(*inputs, importer=importer, protocol=protocol), protocol)
    system = with_options(system, assumed, where)
    return exact_places(check_system(system, where), system.sources)


def apply(inputs: Input | Sequence[Input], fixes: Iterable[Remedy | Edit], *, importer: str | None = None) -> Edited:
    """Apply fixes of a report to the texts that it was made of; layout and comments stay.

    >>> report = check("system.yaml")
    >>> edited = apply("system.yaml", [report.findings[0].remedies[0]])
    >>> print(edited.diff())
    >>> edited.write()

    Args:
        inputs: what was checked: one input or several.
        fixes: remedies of the report, or single edits of them.
        importer: read all inputs with this importer.

    Returns:
        The new texts by name of their source, and edits that could not be applied, each with the reason. Nothing is
        written until `Edited.write` is called, and nothing is checked again.

    Raises:
        InputError: an input cannot be read.
    """
    from cqos_core.applying import apply_edits, opened_sources

    each = [inputs] if isinstance(inputs, (str, bytes, PathLike, System)) else list(inputs)
    edits = [edit for fix in fixes for edit in ((fix,) if isinstance(fix, Edit) else fix.edits)]
    sources = opened_sources([read(*each, importer=importer)], edits)
    for position, one in enumerate(each):
        if isinstance(one, bytes):
            source = _source(each, position)
            sources[source.name] = source.data
    return apply_edits(sources, edits, importer)


def diff(
    a: Input,
    b: Input,
    *,
    protocol: str | None = None,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
    topics: Sequence[str] = (),
    ignored: Sequence[str] = (),
) -> Diff:
    """Compare two systems: what they say differently about the same topics and endpoints, as far as both know it.

    Args:
        a: a path, bytes or a `System`.
        b: what to compare it with.
        protocol: pack id for participants that state none.
        options: by pack id, laid over those of both.
        packs: further rule packs beside the installed ones.
        topics: shell patterns of the topics to compare; all if there are none.
        ignored: shell patterns of the topics not to compare.

    Raises:
        InputError: an input cannot be read.
    """
    from cqos_core.differences import compare

    packs = list(packs)
    where = context(packs, protocol)
    assumed = _by_pack(options or {}, where, packs)
    one, other = (with_options(read(each, protocol=protocol), assumed, where) for each in (a, b))
    return compare(one, other, where, topics, ignored)


def _by_pack(
    options: Mapping[str, Mapping[str, SettingValue]], where: Context, packs: Sequence[RulePack]
) -> Mapping[str, Mapping[str, SettingValue]]:
    """Return options as they are given, where they are given by pack and each pack is there."""
    for pack_id, settings in options.items():
        if not isinstance(settings, Mapping):
            raise TypeError(f"options are by rule pack, as in {{'PACK': {{{pack_id!r}: {settings!r}}}}}")
        _pack_is_there(pack_id, where, packs)
    return options


def _pack_is_there(pack_id: str, where: Context, packs: Sequence[RulePack]) -> None:
    if where.find_pack(pack_id) is None:
        known = {*load_plugins().packs, *(pack.id for pack in packs)}
        raise CqosError(f"there is no rule pack `{pack_id}`; {suggestion(pack_id, known)}")


def with_options(
    system: System, options: Mapping[str, Mapping[str, SettingValue]], where: Context, place: Place | None = None
) -> System:
    """Return ``system`` with options laid over its own, in whatever spelling it states them."""
    joined = {pack_id: dict(settings) for pack_id, settings in system.options.items()}
    for pack_id, settings in options.items():
        pack, stated = where.find_pack(pack_id), joined.setdefault(pack_id, {})
        for name, value in settings.items():
            for other in [
                other for other in stated if pack and pack.find("option", other) == pack.find("option", name)
            ]:
                del stated[other]
            stated[name] = Setting(as_text(value), place or Place("options"))
    return replace(system, options=joined)


def exact_places(report: Report, sources: Mapping[str, bytes]) -> Report:
    """Return ``report`` with exact columns in its places, found by rescanning the sources of what is printed."""
    from cqos_core.excerpt import exact

    places = {place for finding in report.findings for place in _places(finding)}
    known = {place: found for place, found in exact(places, sources).items() if found != place}
    if not known:
        return report

    def at(place: Place | None) -> Place | None:
        return None if place is None else known.get(place, place)

    def pinned(finding: Finding) -> Finding:
        sides = tuple(
            replace(
                side,
                place=at(side.place),
                facts=tuple(replace(each, place=at(each.place)) for each in side.facts),
            )
            for side in finding.sides
        )
        remedies = tuple(
            replace(
                remedy, edits=tuple(replace(edit, place=known.get(edit.place, edit.place)) for edit in remedy.edits)
            )
            for remedy in finding.remedies
        )
        return replace(finding, sides=sides, remedies=remedies)

    findings = (pinned(each) if any(place in known for place in _places(each)) else each for each in report.findings)
    return replace(report, findings=tuple(findings))


def _places(finding: Finding) -> Iterator[Place]:
    for side in finding.sides:
        for place in (side.place, *(each.place for each in side.facts)):
            if place is not None:
                yield place
    for remedy in finding.remedies:
        for edit in remedy.edits:
            yield edit.place


def as_text(value: SettingValue) -> str:
    """Write a Python value in the spelling of the YAML form.

    Raises:
        TypeError: for a type that has no such spelling.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, timedelta):
        return f"{(value.days * 86_400 + value.seconds) * 10**9 + value.microseconds * 1_000}ns"
    if isinstance(value, int):
        return "infinite" if value == INFINITE else str(value)
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return Names().format(tuple(value))
    raise TypeError(f"{value!r} is no setting: give text, int, bool, timedelta, INFINITE or a list of names")


def pair_system(
    protocol: str,
    offered: Mapping[str, SettingValue],
    requested: Mapping[str, SettingValue],
    options: Mapping[str, SettingValue],
    topic: Mapping[str, SettingValue],
    needs: Mapping[str, SettingValue] = MappingProxyType({}),
) -> System:
    """Make the system of one publisher and one subscriber on one topic; ``profile`` among the settings names a preset."""
    from cqos_core.system import ProfileRef

    facts = dict(topic)
    name = as_text(facts.pop("name", "topic"))
    system = System(protocol=protocol, options={protocol: {n: Setting(as_text(v)) for n, v in options.items()}})
    system.topics[name] = StatedTopic(name, {n: Setting(as_text(v)) for n, v in facts.items()}, external=True)
    for role, stated in ((PUBLISHER, offered), (SUBSCRIBER, requested)):
        settings = dict(stated)
        profile = settings.pop("profile", None)
        system.participants[role] = Participant(role)
        system.endpoints.append(
            Endpoint(
                id=role,
                role=role,
                topic=name,
                participant=role,
                settings={n: Setting(as_text(v)) for n, v in settings.items()},
                profiles=() if profile is None else (ProfileRef(as_text(profile)),),
                needs={n: Setting(as_text(v)) for n, v in needs.items()} if role == SUBSCRIBER else {},
            )
        )
    return system


def _are_maps(given: Mapping[str, object]) -> None:
    """Refuse what is no map of settings, and say how a preset is named."""
    for name, stated in given.items():
        if stated is None or isinstance(stated, Mapping):
            continue
        message = f"`{name}` must map names of settings to values, found {stated!r}"
        if isinstance(stated, str) and name in {"offered", "requested"}:
            message += f"; a preset is named by {name}={{'profile': {stated!r}}}"
        raise TypeError(message)


def check_pair(
    protocol: str,
    offered: Mapping[str, SettingValue] | None = None,
    requested: Mapping[str, SettingValue] | None = None,
    options: Mapping[str, SettingValue] | None = None,
    topic: Mapping[str, SettingValue] | None = None,
    packs: Iterable[RulePack] = (),
    needs: Mapping[str, SettingValue] | None = None,
) -> PairReport:
    """Judge one offer against one request.

    Args:
        protocol: pack id, for instance ``ros2``.
        offered: the publisher's settings by policy name or alias; text in YAML spelling, or int, bool, timedelta,
            `INFINITE`; ``profile`` names a preset. What is not stated takes the protocol's defaults.
        requested: the subscriber's settings, likewise.
        options: assumptions about the deployment: ``{"rmw": "cyclonedds"}``.
        topic: facts about the topic: ``name``, ``period``, ``latched`` and what else the pack knows.
        packs: further rule packs beside the installed ones.
        needs: what the subscriber's application needs: ``{"latest": True, "max_age": "10s"}``.

    Returns:
        The verdict, set by pair rules alone; findings of pair and endpoint rules; and each policy compared.

    Raises:
        CqosError: no installed pack has this id.
    """
    _are_maps({"offered": offered, "requested": requested, "options": options, "topic": topic, "needs": needs})
    system = pair_system(protocol, offered or {}, requested or {}, options or {}, topic or {}, needs or {})
    packs = list(packs)
    where = context(packs)
    _pack_is_there(protocol, where, packs)
    return explain_pair(system, PUBLISHER, SUBSCRIBER, where)


def explain(
    *inputs: Input,
    publisher: str,
    subscriber: str,
    options: Mapping[str, Mapping[str, SettingValue]] | None = None,
    packs: Iterable[RulePack] = (),
    protocol: str | None = None,
) -> PairReport:
    """Explain one pair of a system: every policy, both values with origin and place, and the rules over it.

    Raises:
        InputError: an input cannot be read.
        CqosError: there is no such endpoint, or the two are on different topics.
    """
    packs = list(packs)
    where = context(packs, protocol)
    assumed = _by_pack(options or {}, where, packs)
    system = with_options(tried_out(read(*inputs, protocol=protocol), protocol), assumed, where)
    return explain_pair(system, publisher, subscriber, where)


__all__ = [
    "INFINITE",
    "Context",
    "Plugins",
    "apply",
    "as_text",
    "check",
    "check_pair",
    "context",
    "diff",
    "exact_places",
    "explain",
    "explain_pair",
    "faults",
    "faults_of",
    "read",
    "with_options",
]
