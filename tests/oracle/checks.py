"""What runs of the simulator say of the findings about behaviour, and of models where those findings are missing."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from random import Random
from typing import TYPE_CHECKING, Final

import cqos_core as cqos
from tests.oracle.simulator import SECOND, Log, Simulation

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.model.flow import ControlFlow

NEVER: Final = ("BP110", "BP111", "BP112")
RATES: Final = ("BP101", "BP102", "BP103")
CHECKED: Final = (*NEVER, *RATES)
_CALM: Final = 0.25
_MANY: Final = 100


@dataclass(frozen=True)
class Claim:
    """One finding that speaks of every run.

    Attributes:
        nodes: the nodes that it speaks about.
        limit: nanoseconds of the longest gap that it says is exceeded; 0: its nodes never happen.
    """

    code: str
    members: tuple[str, ...]
    nodes: frozenset[int]
    limit: int = 0

    def __str__(self) -> str:
        return f"{self.code} {','.join(self.members)}"


class Oracle:
    """A model with the claims of the analysis about it."""

    def __init__(self, text: bytes) -> None:
        system = cqos.read(text, importer="bpmn")
        self.report = cqos.check(text, importer="bpmn")
        self.flow: ControlFlow = system.flows[0]
        self.topics = {each.id: each.topic or "" for each in system.endpoints}
        self.participants = {each.id: each.participant for each in system.endpoints}
        self.external = {each.name for each in system.topics.values() if each.external}
        self.deadlines = {each.id: _seconds(each.settings) for each in system.endpoints}
        waits = [t.timer.wait or 0 for node in self.flow.nodes for t in node.triggers if t.timer is not None]
        limits = self.deadlines.values()
        self.horizon = 40 * max([*waits, *limits, 10 * SECOND])
        self.claims = [claim for each in self.report.findings if (claim := self._claim(each)) is not None]

    def _claim(self, finding: cqos.Finding) -> Claim | None:
        if finding.code not in CHECKED:
            return None
        members = finding.sides[0].members
        return self.claim(finding.code, tuple(members))

    def claim(self, code: str, members: tuple[str, ...]) -> Claim | None:
        """Return what a code says of endpoints; None where they are not in the model."""
        if not set(members) <= self.topics.keys():
            return None
        if code in {"BP111", "BP112", "BP101", "BP103"}:
            nodes = self._nodes(members)
        else:
            topics = {self.topics[each] for each in members}
            nodes = self._nodes([each for each, topic in self.topics.items() if topic in topics], throws=True)
        limit = max((self.deadlines[each] for each in members), default=0) if code in RATES else 0
        if code in RATES and not limit:
            return None
        return Claim(code, members, nodes, limit)

    def _nodes(self, members: object, *, throws: bool = False) -> frozenset[int]:
        wanted = set(members)  # type: ignore[call-overload]
        return frozenset(
            position
            for position, node in enumerate(self.flow.nodes)
            if wanted & set(node.endpoints) and (not throws or node.kind in {"throw", "end"})
        )

    def run(self, seed: int, external: Iterable[str] | None = None) -> Log:
        """Return one run; ``external``: topics that are thrown outside too, those of the model where none are named."""
        random = Random(seed)  # noqa: S311
        calm = random.random() < _CALM
        outside = sorted(self.external if external is None else external)
        return Simulation(self.flow, self.topics, random, self.horizon, calm=calm, external=outside).run()


def _seconds(settings: object) -> int:
    text = getattr(dict(settings).get("deadline"), "text", "0")  # type: ignore[call-overload]
    return int(float(text) * SECOND) if text.replace(".", "", 1).isdigit() else 0


def holds(claim: Claim, log: Log) -> bool | None:
    """Return whether a claim is true of a run; None where the run shows nothing about it."""
    times = sorted(time for node in claim.nodes for time in log.fired.get(node, ()))
    if claim.code == "BP112":
        return not (claim.nodes & log.waited) and not times
    if claim.code in NEVER:
        return not times
    if not times or not log.whole:
        return None
    gaps = [later - earlier for earlier, later in zip(times, [*times[1:], log.end], strict=True)]
    return max(gaps) > claim.limit


def lacks(claim: Claim, log: Log) -> bool:
    """Whether a run is without a fault; of a deadline, also a run that ended after many samples in time."""
    if holds(claim, log) is not None or claim.code in NEVER:
        return holds(claim, log) is False
    times = sorted(time for node in claim.nodes for time in log.fired.get(node, ()))
    gaps = [later - earlier for earlier, later in pairwise(times)]
    return len(times) >= _MANY and max(gaps) <= claim.limit < times[-1] - times[0]


def faults(oracle: Oracle, runs: int, *, also: int = 0) -> tuple[list[str], list[Claim]]:
    """Run a model; return the claims that a run contradicts, and the faults that all runs have.

    Faults are: a throw never fires, no token is ever at a catch, the throws of a participant miss a deadline.
    What is not reported is tried in ``also`` more runs, as a run without it may be rare.
    """
    left, shown = possible_faults(oracle), set()
    wrong: dict[str, None] = {}
    for number in range(runs + also):
        if number == runs and all(is_reported(each, oracle) for each in left if each in shown):
            break
        log = oracle.run(number)
        wrong |= dict.fromkeys(f"{claim}: run {number}" for claim in oracle.claims if holds(claim, log) is False)
        answers = {claim: holds(claim, log) for claim in left}
        left = [claim for claim in left if answers[claim] is not False]
        shown |= {claim for claim in left if answers[claim]}
    return list(wrong), [claim for claim in left if claim in shown]


def possible_faults(oracle: Oracle) -> list[Claim]:
    """Return what may go wrong: each throw, each catch that is no start, and the throws of each participant on each topic."""
    found: list[Claim | None] = []
    writers: dict[tuple[str, str], list[str]] = {}
    for node in oracle.flow.nodes:
        for end in node.endpoints if node.kind != "process" else ():
            if node.kind in {"throw", "end"}:
                found.append(oracle.claim("BP111", (end,)))
                writers.setdefault((oracle.participants[end], oracle.topics[end]), []).append(end)
            elif node.kind != "start":
                found.append(oracle.claim("BP112", (end,)))
    found += [
        oracle.claim("BP101", tuple(ends)) for ends in writers.values() if all(oracle.deadlines[each] for each in ends)
    ]
    return [claim for claim in found if claim is not None]


def is_reported(fault: Claim, oracle: Oracle) -> bool:
    """Whether a finding speaks of a fault: of one of its nodes, or of its topic."""
    topics = {oracle.topics[each] for each in fault.members}
    same = {"BP111": {"BP110", "BP111"}, "BP112": {"BP112"}, "BP101": {"BP101", "BP103"}}[fault.code]
    for finding in oracle.report.findings:
        members = {each for side in finding.sides for each in side.members} if finding.code in same else set()
        if members & set(fault.members):
            return True
        if finding.code == "BP110" and {oracle.topics.get(each) for each in members} & topics:
            return True
    return False


def follows(fault: Claim, oracle: Oracle, runs: int) -> bool:
    """Whether a fault goes away where the topics that no run throws (BP110, CQ401) come from outside."""
    silent = {
        oracle.topics[each]
        for finding in oracle.report.findings
        if finding.code in {"BP110", "CQ401"}
        for side in finding.sides
        for each in side.members
        if each in oracle.topics
    }
    outside = {*oracle.external, *silent}
    return bool(silent) and any(holds(fault, oracle.run(number, outside)) is False for number in range(runs))
