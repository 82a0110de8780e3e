"""Inputs of any kind as one system: paths, bytes, and systems that programs put together, which are checked for faults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import fields, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Final, TypeAlias, TypeVar

from cqos_core.files.loading import GivenSource, load_paths, read_together
from cqos_core.files.merging import merge
from cqos_core.files.opening import open_file, read_path
from cqos_core.model.flow import positions_missing
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place, Setting
from cqos_core.model.source import Source, no_files
from cqos_core.model.spelling import KnownNames
from cqos_core.model.suggestions import suggestion
from cqos_core.model.system import (
    PUBLISHER,
    SUBSCRIBER,
    Acceptance,
    Bridge,
    Broker,
    Endpoint,
    ImportNote,
    Overlay,
    Participant,
    Profile,
    ProfileRef,
    Route,
    System,
    TeamRule,
    Topic,
)

T = TypeVar("T")
Input: TypeAlias = "str | PathLike[str] | bytes | System"
_NO_INPUT: Final = "an input is a path, bytes or a System, found {}; pass several one by one: `*inputs`"


def read(*inputs: Input, importer: str | None = None, protocol: str | None = None) -> System:
    """Read paths, directories, bytes or ready systems into one system; the format is detected.

    ``protocol`` is meant where an input states none. Systems are copied, the caller's stay as they are.

    Raises:
        InputError: with every problem of every input.
    """
    found: dict[int, list[System]] = {}
    given: dict[int, GivenSource] = {}
    problems: dict[int, Sequence[Problem]] = {}
    for position, each in enumerate(inputs):
        if isinstance(each, System):
            if wrong := faults(each):
                problems[position] = wrong
                continue
            found[position] = [replace(copied(each), protocol=each.protocol or protocol)]
            continue
        if not isinstance(each, (bytes, str, PathLike)):
            raise TypeError(_NO_INPUT.format(type(each).__name__))
        try:
            if not isinstance(each, bytes) and Path(each).is_dir():
                loaded = load_paths([fspath(each)], importer, protocol=protocol)
                problems[position] = loaded.problems
                found[position] = [system for _, system in loaded.systems]
            else:
                opener = no_files if isinstance(each, bytes) else open_file
                given[position] = GivenSource(source_of(inputs, position), opener)
        except InputError as error:
            problems[position] = error.problems
    others = [system for systems in found.values() for system in systems]
    results = read_together([*given.values()], importer, protocol=protocol, others=others)
    for position, result in zip(given, results, strict=True):
        if isinstance(result, System):
            found[position] = [result]
        else:
            problems[position] = result.problems
    all_problems = [problem for position in sorted(problems) for problem in problems[position]]
    if all_problems or not any(found.values()):
        raise InputError(all_problems or [Problem("CQ003", "there is nothing to read")])
    return merge([system for position in sorted(found) for system in found[position]])


def source_of(inputs: Sequence[Input], position: int) -> Source:
    """Open a file, or give bytes a name that no others have."""
    data = inputs[position]
    if not isinstance(data, bytes):
        return read_path(fspath(data))  # type: ignore[arg-type]
    number = sum(isinstance(other, bytes) for other in inputs[: position + 1])
    return Source("<bytes>" if number == 1 else f"<bytes {number}>", data)


def faults(system: System) -> list[Problem]:
    """Say what is wrong with a system that a program put together, such as importers never make it."""
    known = KnownNames(system.participants)
    found = [problem for endpoint in system.endpoints for problem in faults_of(endpoint, system.participants, known)]
    for name, each in system.participants.items():
        if each.id != name:
            found.append(Problem("CQ011", f"participant `{each.id}` is kept under another id, `{name}`", each.place))
        found += _no_settings(f"participant `{name}`", each.settings, each.place)
    wrong = ((flow.source, positions_missing(flow)) for flow in system.flows)
    found += [Problem("CQ011", f"control flow of `{name}`: {text}") for name, text in wrong if text is not None]
    return found


def faults_of(
    endpoint: Endpoint, participants: Mapping[str, Participant], known: KnownNames | None = None
) -> Iterator[Problem]:
    """Say what is wrong with an endpoint: its participant is missing, it has no role, or what it states is no setting."""
    name, where = f"endpoint `{endpoint.id}`", endpoint.place
    if endpoint.participant not in participants:
        message = f"{name} belongs to participant `{endpoint.participant}`, which is not there"
        yield Problem("CQ011", message, where, suggestion(endpoint.participant, known or KnownNames(participants)))
    if endpoint.role not in {PUBLISHER, SUBSCRIBER}:
        yield Problem("CQ011", f"{name} has the role `{endpoint.role}`", where, f"allowed: {PUBLISHER}, {SUBSCRIBER}")
    for settings in (endpoint.settings, endpoint.overlay, endpoint.needs):
        yield from _no_settings(name, settings, where)


def _no_settings(name: str, settings: Mapping[str, object], where: Place | None) -> Iterator[Problem]:
    for setting, value in settings.items():
        if not isinstance(value, Setting):
            message = f"`{setting}` of {name} is {value!r}, which is no `Setting`"
            yield Problem("CQ009", message, where, "settings hold their text: `Setting('reliable')`")


_CHANGING: Final[dict[type, tuple[str, ...]]] = {
    System: tuple(each.name for each in fields(System)),
    Endpoint: ("settings", "overlay", "needs"),
    Participant: ("settings", "remap", "groups"),
    Profile: ("settings",),
    Topic: ("settings",),
    Broker: ("settings",),
    Overlay: ("settings",),
    Bridge: ("routes",),
    Route: ("source", "target"),
}
_FIXED: Final = frozenset({Setting, Place, ProfileRef, TeamRule, Acceptance, ImportNote, str, bytes, bool, type(None)})


def copied(value: T) -> T:
    """Return an equal system, or part of one, that shares nothing which can change."""
    kind = type(value)
    if kind in _FIXED:
        return value
    if kind is dict:
        return {name: copied(each) for name, each in value.items()}  # type: ignore[attr-defined, return-value]
    if kind is list or kind is tuple:
        return kind([copied(each) for each in value])  # type: ignore[attr-defined, call-arg]
    parts = _CHANGING.get(Endpoint if isinstance(value, Endpoint) else kind)
    if parts is None:
        return deepcopy(value)
    return replace(value, **{name: copied(getattr(value, name)) for name in parts})  # type: ignore[type-var]
