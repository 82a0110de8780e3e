"""Participants: a pool for each process, or the process itself where no pool shows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cqos_core.importers.bpmn.document import PARTICIPANT, PROCESS, identity, split
from cqos_core.importers.bpmn.names import fold, shown
from cqos_core.importers.bpmn.reading import Unique
from cqos_core.importers.bpmn.words import flag, options, qos_children, qos_settings, word
from cqos_core.system import Participant

if TYPE_CHECKING:
    from cqos_core.importers.bpmn.reading import Reading
    from cqos_core.importers.xml_source import Element
    from cqos_core.system import Settings

_OWN_WORDS = ("protocol", "external")


@dataclass(slots=True)
class Participants:
    """Who takes part.

    Attributes:
        of_process: the participants that run a process.
        by_element: the participant that a ``participant`` element stands for.
    """

    of_process: dict[Element, list[Participant]]
    by_element: dict[Element, Participant]


def read_participants(reading: Reading) -> Participants:
    """Add every participant to the system; a process without a pool is one, and so is a pool without a process."""
    document = reading.document
    unique = Unique()
    found = Participants({}, {})
    for element in document.all(PARTICIPANT):
        participant = _add(reading, element, unique)
        found.by_element[element] = participant
        process = _process(reading, element)
        if process is not None:
            found.of_process.setdefault(process, []).append(participant)
    for process in document.all(PROCESS):
        pools = found.of_process.get(process)
        if pools is None:
            found.of_process[process] = [_add(reading, process, unique)]
        else:
            _inherit(reading, process, pools)
    return found


def _add(reading: Reading, element: Element, unique: Unique) -> Participant:
    name = fold(element.get("name"))
    wanted = identity(element) or name or split(str(element.tag))[1]
    participant = Participant(
        unique(wanted),
        protocol=word(element, "protocol"),
        settings=_settings(reading, element),
        external=bool(flag(reading, element, "external")),
        label=name or None,
        place=reading.document.place(element),
    )
    if participant.id != wanted:
        message = f"the id `{shown(wanted)}` is used twice; this one is called `{shown(participant.id)}`"
        reading.note("CQ031", message, reading.document.place(element, "@id"))
    reading.system.participants[participant.id] = participant
    return participant


def _process(reading: Reading, element: Element) -> Element | None:
    """Return the process that a pool shows, None for a black box."""
    reference = element.get("processRef")
    if not reference:
        return None
    process = reading.document.find(PROCESS, reference)
    if process is None:
        message = f"`processRef` names `{shown(reference)}`, which is no process in this file"
        reading.note("CQ032", message, reading.document.place(element, "@processRef"))
    return process


def _settings(reading: Reading, element: Element) -> Settings:
    settings = qos_settings(reading, element, _OWN_WORDS)
    children = qos_children(reading, element, ("option",))
    settings |= {name: setting for _, name, setting in options(reading, children, "")}
    return settings


def _inherit(reading: Reading, process: Element, pools: list[Participant]) -> None:
    """Give the pools of a process what is stated on the process; what is stated on the pool wins."""
    protocol = word(process, "protocol")
    settings = _settings(reading, process)
    external = bool(flag(reading, process, "external"))
    for pool in pools:
        pool.protocol = pool.protocol or protocol
        pool.settings = settings | pool.settings
        pool.external = pool.external or external
    if len(pools) > 1:
        names = ", ".join(f"`{shown(pool.label or pool.id)}`" for pool in pools)
        message = f"{len(pools)} participants share this process, its events count for each of them: {names}"
        reading.note("CQ048", message, reading.document.place(process))
