"""Participants: a pool for each process, the participants that call it, or the process itself where nothing shows it."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Final

from cqos_core.bpmn.document import BPMN, CALL_ACTIVITY, COLLABORATION, PARTICIPANT, PROCESS, identity, split
from cqos_core.bpmn.form import MODEL
from cqos_core.bpmn.form import PARTICIPANT as FORM
from cqos_core.bpmn.names import fold, shown, whole_number
from cqos_core.bpmn.qos_namespace import (
    extension_children,
    flag,
    options,
    qos_attributes,
    qos_children,
    qos_settings,
    word,
)
from cqos_core.bpmn.reading import Unique
from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import EVERY_OTHER, Setting
from cqos_core.model.system import Participant, Room

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence

    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.foreign_attributes import Unknown
    from cqos_core.bpmn.reading import DiagramReading
    from cqos_core.model.settings import Settings

_MULTIPLICITY: Final = f"{BPMN}participantMultiplicity"


@dataclass(slots=True)
class Pools:
    """The participants of a model, and the processes that they run.

    Attributes:
        of_process: the participants that run a process.
        by_element: the participant that a ``participant`` element stands for.
        own: the processes that run without being called.
        several: by id of a participant whose pool is marked as multi-instance, how many instances it has; None if not stated.
    """

    of_process: dict[Element, list[Participant]]
    by_element: dict[Element, Participant]
    own: set[Element] = field(default_factory=set)
    several: dict[str, int | None] = field(default_factory=dict)


def read_participants(reading: DiagramReading) -> Pools:
    """Add every participant to the system; a process without a pool is one, and so is a pool without a process."""
    document = reading.document
    unique = Unique()
    found = Pools({}, {})
    around = [
        any_policy
        for element in (document.root, *document.all(COLLABORATION))
        for any_policy in _any_policy(reading, element, MODEL.elements)
    ]
    for element in document.all(PARTICIPANT):
        participant = _add(reading, element, unique)
        found.by_element[element] = participant
        for mark in element.having(_MULTIPLICITY):
            found.several[participant.id] = whole_number(mark.get("maximum"))
        process = _process(reading, element)
        if process is not None:
            found.of_process.setdefault(process, []).append(participant)
    calls = _calls(reading, found.of_process)
    called = {process for others in calls.values() for process in others}
    alone = [process for process in document.all(PROCESS) if process not in found.of_process and process not in called]
    for process in alone:
        found.of_process[process] = [_add(reading, process, unique)]
    found.own.update(found.of_process)
    stated = {process: found.of_process[process][0] for process in alone}
    _hand_on(reading, found.of_process, calls, list(found.of_process))
    for process in document.all(PROCESS):
        runners = found.of_process.get(process)
        if runners is None:  # it and others call each other, and nothing else calls them
            found.of_process[process] = [_add(reading, process, unique)]
            stated[process] = found.of_process[process][0]
            found.own.add(process)
            _hand_on(reading, found.of_process, calls, [process])
        elif process not in alone:
            inherited = _inherit(reading, process, runners)
            if process in called:
                stated[process] = inherited
    reading.system.processes = {name: each for process, each in stated.items() if (name := identity(process))}
    _lose(reading, found, stated, around)
    return found


def _lose(reading: DiagramReading, found: Pools, stated: dict[Element, Participant], around: list[Unknown]) -> None:
    """Add what nothing reads to participants: ``around`` all of them, on their processes and on their pools."""
    for each in reading.system.participants.values():
        each.lost = (*around,)
    for process, runners in found.of_process.items():
        lost = (*_any_policy(reading, process, FORM.elements),)
        for runner in {id(each): each for each in (*runners, stated.get(process, runners[0]))}.values():
            runner.lost += lost
    for pool, runner in found.by_element.items():
        runner.lost += (*_any_policy(reading, pool, FORM.elements),)


def _any_policy(reading: DiagramReading, element: Element, words: Iterable[str]) -> list[Unknown]:
    """Return what nothing reads on ``element``: a profile, a protocol or an option may set any policy of an endpoint."""
    lost = [*reading.lost.children(extension_children(element), words), *reading.lost.settings(element, ours=True)]
    if element is reading.document.root and qos_attributes(element).keys() - {"protocol"}:
        cause = "an attribute of `definitions` is not read"
        lost.append((EVERY_OTHER, Setting("", reading.document.place(element), unknown=cause, reported="CQ041")))
    return [(EVERY_OTHER, setting) for _, setting in lost[:1]]


def _calls(reading: DiagramReading, shown_by_pools: Container[Element]) -> dict[Element, list[Element]]:
    """Return which processes each process calls, as far as no pool shows them: they run in the caller's participants."""
    document = reading.document
    calls: dict[Element, list[Element]] = {}
    for activity in document.all(CALL_ACTIVITY):
        caller, called = document.process_of(activity), document.called_by(activity)
        if caller is not None and called is not None and called is not caller and called not in shown_by_pools:
            calls.setdefault(caller, []).append(called)
    return calls


def _hand_on(
    reading: DiagramReading,
    of_process: dict[Element, list[Participant]],
    calls: dict[Element, list[Element]],
    callers: list[Element],
) -> None:
    """Let the participants of ``callers`` run what those call, and what that calls in turn."""
    for caller in callers:
        reached = {caller}
        waiting = [caller]
        while waiting:
            for process in calls.get(waiting.pop(), ()):
                if process in reached:
                    continue
                reached.add(process)
                waiting.append(process)
                of_process.setdefault(process, []).extend(of_process[caller])
                reading.count_copies(len(of_process[caller]), process)


def _add(reading: DiagramReading, element: Element, unique: Unique) -> Participant:
    wanted = identity(element) or fold(element.get("name")) or split(element.tag)[1]
    participant = _stated(reading, element, unique(wanted))
    if participant.id != wanted:
        message = f"the id `{shown(wanted)}` is used twice; this one is called `{shown(participant.id)}`"
        reading.note("CQ031", message, reading.document.place(element, "@id"))
    reading.system.participants[participant.id] = participant
    return participant


def _stated(reading: DiagramReading, element: Element, name: str) -> Participant:
    """Return what is stated on a pool or a process, as a participant of some name."""
    return Participant(
        name,
        protocol=word(element, "protocol"),
        settings=_settings(reading, element),
        external=bool(flag(reading, element, "external")),
        label=fold(element.get("name")) or None,
        place=(place := reading.document.place(element)),
        room=Room(place) if identity(element) is not None else None,
    )


def _process(reading: DiagramReading, element: Element) -> Element | None:
    """Return the process that a pool shows, None for a black box."""
    reference = element.get("processRef")
    if not reference:
        return None
    process = reading.document.find(PROCESS, reference, element)
    if process is None:
        message = f"`processRef` names `{shown(reference)}`, which is no process in this file"
        reading.note("CQ032", message, reading.document.place(element, "@processRef"))
    return process


def _settings(reading: DiagramReading, element: Element) -> Settings:
    settings = qos_settings(reading, element, FORM.attributes)
    children = qos_children(reading, element, FORM.elements)
    settings |= {name: setting for _, name, setting in options(reading, children, "")}
    return settings


def _inherit(reading: DiagramReading, process: Element, pools: list[Participant]) -> Participant:
    """Give the pools of a process what is stated on the process; what is stated on the pool wins."""
    stated = _stated(reading, process, identity(process) or "")
    for pool in pools:
        inherit(pool, stated)
    if len(pools) > 1:
        reading.note("CQ048", shared_by(pools), reading.document.place(process))
    return stated


def inherit(pool: Participant, process: Participant) -> None:
    """Give a pool what is stated on a process that it runs; what is stated on the pool wins."""
    pool.protocol = pool.protocol or process.protocol
    pool.settings = process.settings | pool.settings
    pool.external = pool.external or process.external
    pool.lost = tuple(dict.fromkeys((*process.lost, *pool.lost)))


def shared_by(pools: Sequence[Participant]) -> str:
    """Say that several participants run one process."""
    names = ", ".join(f"`{shown(pool.label or pool.id)}`" for pool in pools)
    return f"{len(pools)} participants share this process, its events count for each of them: {names}"
