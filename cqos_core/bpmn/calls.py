"""Processes that call activities of other files run: they take part as the participants of their callers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.bpmn.foreign_attributes import laid_under
from cqos_core.bpmn.participants import inherit, shared_by
from cqos_core.bpmn.reading import MOST_COPIES
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.system import ImportNote

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.model.flow import ControlFlow, FlowNode, FlowRunner
    from cqos_core.model.system import Endpoint, Participant, System


class _Process:
    """A process of one file.

    Attributes:
        system: of its file.
        at, node: its position in the control flow, and its node.
        stated: what is stated on it; None where a pool shows it, so that calls change nothing.
        calls: the processes that it calls.
        runners: the participants that run it, by their ids, as far as they are known.
    """

    def __init__(self, system: System, at: int, node: FlowNode) -> None:
        self.system, self.at, self.node = system, at, node
        self.stated = system.processes.get(node.id)
        self.calls: list[_Process] = []
        self.runners: dict[str, tuple[FlowRunner, Participant]] = {}

    def run_alone(self) -> None:
        """Let the participants run it that its own file shows, and what it calls, and what that calls in turn."""
        self.runners = {
            each.participant: (each, self.system.participants[each.participant]) for each in self.node.participants
        }
        reached, waiting = {self}, [self]
        while waiting:
            for process in waiting.pop().calls:
                if process not in reached and process.stated is not None:
                    reached.add(process)
                    waiting.append(process)
                    process.runners |= self.runners

    def is_joined(self) -> bool:
        """Sort the participants: those of its own file, then others, in any order of files. Say whether there are others."""
        shown = [each.participant for each in self.node.participants]
        own = [each for each in shown if each in self.runners]
        self.runners = {name: self.runners[name] for name in dict.fromkeys((*own, *sorted(self.runners)))}
        return [*self.runners] != shown


def run_by_callers(systems: Sequence[System]) -> list[System]:
    """Return ``systems``, in which participants run the processes of other files that they call and that no pool shows.

    Such a process is no participant of its own then. What is stated on it holds for its callers as far as they do not
    state it, as where its callers are in the same file.

    Raises:
        InputError: this would make too many endpoints.
    """
    # What was put together before stays as it is.
    processes = _processes([each for each in systems if len(each.flows) == 1])
    called = {process for caller in processes for process in caller.calls if process is not caller}
    for process in processes:
        if process.stated is None or process not in called:
            process.run_alone()
    # The others call each other, and nothing else calls them.
    for process in sorted(processes, key=lambda each: (not each.node.has_pool, each.node.id)):
        if not process.runners:
            process.run_alone()
    joined = [process for process in processes if process.is_joined()]
    heirs = {id(each): replace(each) for process in joined for _, each in process.runners.values()}
    for process in joined:
        for _, each in process.runners.values():
            if process.stated is not None:
                inherit(heirs[id(each)], process.stated)
    for system in systems:
        for each in system.participants.values():
            if id(each) in heirs:
                heirs[id(each)].protocol = heirs[id(each)].protocol or system.protocol
    return [_joined(each, [p for p in joined if p.system is each], heirs) for each in systems] if joined else [*systems]


def calling_together(systems: Sequence[System]) -> list[list[int]]:
    """Return the positions of ``systems`` in groups: a system and another that has a process which it calls, and no third has."""
    group = [*range(len(systems))]
    if any(each.processes for each in systems):
        at = {id(each): number for number, each in enumerate(systems)}
        processes = _processes([each for each in systems if len(each.flows) == 1])
        homes: dict[str, set[int]] = {}
        for process in processes:
            homes.setdefault(process.node.id, set()).add(at[id(process.system)])
        for process in processes:
            for called in process.calls:
                first, second = group[at[id(process.system)]], group[at[id(called.system)]]
                if called.system is not process.system and len(homes[called.node.id]) == 1:
                    group = [min(first, second) if each in {first, second} else each for each in group]
    return [[at for at, each in enumerate(group) if each == first] for first in dict.fromkeys(group)]


def _processes(systems: Sequence[System]) -> list[_Process]:
    """Return the processes of all files, with their calls."""
    by_name: dict[str, list[_Process]] = {}
    calling: list[tuple[_Process, list[_Process], FlowNode]] = []
    found: list[_Process] = []
    for system in systems:
        here: list[_Process] = []
        for at, node in enumerate(system.flows[0].nodes):
            here.append(_Process(system, at, node) if node.parent is None else here[node.parent])
            if node.parent is None:
                by_name.setdefault(node.id, []).append(here[at])
        calling += [(here[at], here, node) for at, node in enumerate(system.flows[0].nodes) if node.kind == "call"]
        found += dict.fromkeys(here)
    for caller, here, node in calling:
        caller.calls += [here[node.calls]] if node.calls is not None else by_name.get(node.called or "", ())
    return found


def _joined(system: System, joined: Sequence[_Process], heirs: dict[int, Participant]) -> System:
    """Return the system of one file, in which the participants of each process throw and catch for themselves."""
    copies, flows = _copies(system, joined) if joined else ({}, system.flows)
    runners = {name: heirs[id(each)] for process in joined for name, (_, each) in process.runners.items()}
    alone = {each.participant for process in joined for each in process.node.participants} - runners.keys()
    own = {name: heirs.get(id(each), each) for name, each in system.participants.items() if name not in alone}
    participants = runners | own
    endpoints = [copy for each in system.endpoints for copy in copies.get(each.id, [each])]
    return replace(
        system,
        flows=flows,
        participants=participants,
        endpoints=[
            replace(each, settings=laid_under(each.settings, lost))
            if (lost := participants[each.participant].lost)
            else each
            for each in endpoints
        ],
        accept=[
            accepted
            for each in system.accept
            for accepted in (
                [replace(each, endpoint=copy.id) for copy in copies[each.endpoint]]
                if each.endpoint in copies
                else [each]
            )
        ],
        notes=[
            *(each for each in system.notes if not _says_less(each, joined)),
            *(note for process in joined for note in _notes(process, runners)),
        ],
    )


def _says_less(note: ImportNote, joined: Sequence[_Process]) -> bool:
    """Whether a note names only those participants of a process that its own file shows."""
    return note.code == "CQ048" and any(each.stated is not None and each.stated.place == note.place for each in joined)


def _notes(process: _Process, participants: dict[str, Participant]) -> Iterator[ImportNote]:
    system = process.system
    place = None if process.stated is None else process.stated.place
    runners = [participants[name] for name in process.runners]
    if len(runners) > 1:
        yield ImportNote("CQ048", "note", shared_by(runners), place)
    other = next((each.protocol for each in runners if each.protocol != system.protocol), system.protocol)
    if other != system.protocol:
        stated = f"as {system.protocol} and as {other}; that of its caller holds"
        yield ImportNote(
            "CQ060", "warning", f"protocol of process `{process.node.id}` is stated differently, {stated}", place
        )


def _copies(
    system: System, joined: Sequence[_Process]
) -> tuple[dict[str | None, list[Endpoint]], tuple[ControlFlow, ...]]:
    """Return what takes the place of endpoints of some processes, by their ids, and the control flow with those."""
    ends = {each.id: each for each in system.endpoints}
    copies: dict[str | None, list[Endpoint]] = {}
    processes = {each.at: each for each in joined}
    nodes: list[FlowNode] = []
    around: list[int] = []
    number = 0
    for at, node in enumerate(system.flows[0].nodes):
        around.append(at if node.parent is None else around[node.parent])
        process = processes.get(around[at])
        if process is None:
            nodes.append(node)
        elif node.parent is None:
            nodes.append(
                replace(node, participants=tuple(each for each, _ in process.runners.values()), has_pool=False)
            )
        else:
            first = process.node.participants[0].participant
            for name in node.endpoints:
                number += len(process.runners) - 1
                if number > MOST_COPIES:
                    message = f"processes that several participants run would make more than {MOST_COPIES} copies"
                    raise InputError([Problem("CQ016", message, ends[name].place)])
                copies[name] = [
                    replace(ends[name], id=f"{name}@{runner}" if several else name, participant=runner)
                    for several, runner in enumerate(process.runners if ends[name].participant == first else ())
                ]
            nodes.append(replace(node, endpoints=tuple(each.id for name in node.endpoints for each in copies[name])))
    return copies, (replace(system.flows[0], nodes=tuple(nodes)),)
