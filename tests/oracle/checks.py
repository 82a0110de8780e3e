"""What runs of the simulator say of the findings about behaviour, and of models where those findings are missing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random
from typing import TYPE_CHECKING, Final

import cqos_core as cqos
from tests.oracle.samples import READINGS, Kept
from tests.oracle.simulator import MOST_STEPS, SECOND, Simulation

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.model.flow import ControlFlow
    from tests.oracle.parts import Log

NEVER: Final = ("BP110", "BP111", "BP112")
RATES: Final = ("BP101", "BP102", "BP103", "BP105", "BP114", "BP115")
_GAPS: Final = ("BP101", "BP103")
UNTAKEN: Final = ("BP106", "BP107", "BP113")
CHECKED: Final = (*NEVER, *RATES, *UNTAKEN, "BP108", "BP109", "BP118")
POSSIBLE: Final = ("BP108",)
"""Codes of what may happen: some run shows it."""
_CALM: Final = 0.25
_MANY: Final = 40
_UNITS: Final = {"s": 1, "m": 60, "h": 3600}


@dataclass(frozen=True)
class Claim:
    """One finding that speaks of every run.

    Attributes:
        nodes: the nodes that it speaks about.
        limit: nanoseconds of the longest gap that it says is exceeded, or of a number of samples at once; 0: its nodes never happen.
        topics: samples on them count too, where they come from outside.
        readings: those in which it holds.
        senders: nodes that send what the others take.
    """

    code: str
    members: tuple[str, ...]
    nodes: frozenset[int]
    limit: int = 0
    topics: frozenset[str] = frozenset()
    readings: tuple[str, ...] = READINGS
    senders: frozenset[int] = frozenset()

    def __str__(self) -> str:
        return f"{self.code} {','.join(self.members)}"

    def times(self, log: Log) -> list[int]:
        """Return when the nodes happened, and when samples came from outside."""
        inside = [time for node in self.nodes for time in log.fired.get(node, ())]
        return sorted([*inside, *(time for topic in self.topics for time in log.outside.get(topic, ()))])


class Oracle:
    """A model with the claims of the analysis about it."""

    def __init__(self, text: bytes) -> None:
        system = cqos.read(text, importer="bpmn")
        self.report = cqos.check(text, importer="bpmn")
        self.flow: ControlFlow = system.flows[0]
        self.ends = {each.id: each for each in system.endpoints}
        self.topics = {each.id: each.topic or "" for each in system.endpoints}
        self.participants = {each.id: each.participant for each in system.endpoints}
        self.external = {each.name for each in system.topics.values() if each.external}
        self.deadlines = {each: self._time(each, "deadline") for each in self.ends}
        self.kept = {each: self._kept(each) for each in self.ends}
        reading = system.options.get("bpmn", {}).get("catch")
        self.readings = READINGS if reading is None else (reading.text,)
        waits = [t.timer.wait or 0 for node in self.flow.nodes for t in node.triggers if t.timer is not None]
        limits = self.deadlines.values()
        self.horizon = 40 * max([*waits, *limits, 10 * SECOND])
        self.claims = [claim for each in self.report.findings if (claim := self._claim(each)) is not None]

    def _text(self, end: str, name: str) -> str:
        stated = self.ends[end].settings.get(name)
        return "" if stated is None else stated.text

    def _time(self, end: str, name: str) -> int:
        text = self._text(end, name)
        return int(float(text) * SECOND) if text.replace(".", "", 1).isdigit() else 0

    def _kept(self, end: str) -> Kept:
        """Return what becomes of samples, with the defaults of ROS 2."""
        text = self._text(end, "depth")
        depth = int(text) if text.isdigit() else 10
        again = self._text(end, "durability") == "transient_local" and self._text(end, "reliability") != "best_effort"
        return Kept(
            again, None if self._text(end, "history") == "keep_all" else depth, self._time(end, "lifespan") or None
        )

    def _claim(self, finding: cqos.Finding) -> Claim | None:
        if finding.code not in CHECKED:
            return None
        claim = self.claim(finding.code, tuple(finding.sides[0].members))
        worlds = [world.partition("=")[2] for world, verdict in finding.worlds.items() if verdict == "incompatible"]
        return replace(claim, readings=tuple(worlds)) if claim is not None and worlds else claim

    def claim(self, code: str, members: tuple[str, ...]) -> Claim | None:
        """Return what a code says of endpoints; None where they are not in the model, or state no limit."""
        if not set(members) <= self.topics.keys():
            return None
        topics = frozenset(self.topics[each] for each in members)
        sending = [each for each, end in self.ends.items() if end.role == "publisher"]
        on_topic = [each for each in sending if self.topics[each] in topics]
        if code in {"BP102", "BP114"}:
            limit = max((self._limit(code, each) for each in members), default=0)
            return Claim(code, members, self._nodes(on_topic), limit, topics) if limit else None
        if code == "BP115":
            if any(self._text(each, "ownership") != "exclusive" for each in (*members, *on_topic)):
                return None
            strongest = max(on_topic, key=lambda each: int(self._text(each, "ownership_strength") or 0), default="")
            limit = self.deadlines.get(strongest, 0)
            return Claim(code, members, self._nodes([strongest]), limit) if limit else None
        if code in RATES:
            nodes, limit = self._own(code, members), max(self._limit(code, each) for each in members)
            return Claim(code, members, nodes, limit) if limit else None
        if code == "BP109":
            if not any("loss_free" in self.ends[each].needs for each in members):
                return None
            depths = [depth for each in on_topic if (depth := self.kept[each].depth) is not None]
            return Claim(code, members, self._nodes(on_topic), min(depths)) if depths else None
        if code == "BP118":
            kept = all(self.kept[each].depth is None for each in (*members, *on_topic))
            buffered = kept and READINGS[2] in self.readings
            senders = self._nodes(on_topic)
            return (
                Claim(code, members, self._nodes(members), 0, frozenset(), READINGS[2:], senders) if buffered else None
            )
        if code == "BP110":
            return Claim(code, members, self._nodes(on_topic))
        return Claim(code, members, self._nodes(members))

    def _own(self, code: str, members: tuple[str, ...]) -> frozenset[int]:
        """Return the nodes that send for some publishers; those of the participant where these assert liveliness."""
        if code != "BP105" or self._text(members[0], "liveliness") == "manual_by_topic":
            return self._nodes(members)
        owners = {self.participants[each] for each in members}
        return self._nodes([e for e, end in self.ends.items() if end.role == "publisher" and end.participant in owners])

    def _limit(self, code: str, end: str) -> int:
        if code == "BP105":
            return self._time(end, "leaseDuration") if self._text(end, "liveliness").startswith("manual") else 0
        need = self.ends[end].needs.get("max_gap")
        if code == "BP114":
            return 0 if need is None else int(float(need.text.rstrip("smh")) * _UNITS[need.text[-1]] * SECOND)
        return self.deadlines[end]

    def _nodes(self, members: Iterable[str]) -> frozenset[int]:
        wanted = set(members)
        return frozenset(at for at, node in enumerate(self.flow.nodes) if wanted & set(node.endpoints))

    def run(self, seed: int, external: Iterable[str] | None = None, *, steps: int = MOST_STEPS) -> Log:
        """Return one run; ``external``: topics that are thrown outside too, those of the model where none are named."""
        random = Random(seed)  # noqa: S311
        calm = random.random() < _CALM
        outside = sorted(self.external if external is None else external)
        return Simulation(
            self.flow,
            self.topics,
            random,
            self.horizon,
            calm=calm,
            external=outside,
            kept=self.kept,
            reading=random.choice(self.readings),
            steps=steps,
        ).run()


def holds(claim: Claim, log: Log) -> bool | None:
    """Return whether a claim is true of a run; None where the run shows nothing about it."""
    if log.reading not in claim.readings:
        return None
    times = claim.times(log)
    if claim.code == "BP112":
        return not (claim.nodes & log.waited) and not times
    if claim.code in NEVER:
        return not times
    if claim.code in UNTAKEN:
        assumed = {"BP106": True, "BP107": log.prompt, "BP113": log.punctual}[claim.code]
        shows = assumed and bool(claim.nodes & log.waited)
        return not times if shows else None
    if claim.code == "BP108":
        return True if _took_earlier(claim, log) else None
    if claim.code == "BP109":
        return None if not times or not log.instant else max(map(times.count, times)) > claim.limit
    if claim.code == "BP118":
        goes_on = any(time > log.end * 3 // 4 for node in claim.senders for time in log.fired.get(node, ()))
        return (len(times) == 1 and goes_on) if times and (goes_on or log.whole) else None
    if not times:
        return None
    gaps = [later - earlier for earlier, later in zip(times, [*times[1:], log.end], strict=True)]
    # A run that ends early, or has its first sample late, can show a long gap. It cannot show that all gaps are short.
    return True if max(gaps) > claim.limit else False if log.whole and times[0] < log.end // 2 else None


def _took_earlier(claim: Claim, log: Log) -> bool:
    """Whether a catch took one sample in two rounds."""
    taken = [sent for node in claim.nodes for _, sent in log.taken.get(node, ())]
    return len(taken) > len(set(taken))


def lacks(claim: Claim, log: Log) -> bool:
    """Whether a run is without a fault; of a deadline, also a run that kept it from some time on, until it ended after many samples."""
    if claim.code not in RATES:
        return holds(claim, log) is False
    if holds(claim, log) is False:
        return True
    times = claim.times(log)
    late = [each for each in times if each >= log.end // 2]
    gaps = [later - earlier for earlier, later in pairwise(late)]
    return len(late) >= _MANY and max(gaps) <= claim.limit < late[-1] - late[0]


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
        left = [claim for claim in left if not lacks(claim, log)]
        shown |= {claim for claim in left if holds(claim, log)}
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
    """Whether a finding names one of the nodes of a fault, or says that no run throws its topic."""
    topics = {oracle.topics[each] for each in fault.members}
    same = {
        fault.code,
        *({"BP110"} if fault.code in NEVER else ("BP101", "BP103", "BP110") if fault.code in _GAPS else ()),
    }
    for finding in oracle.report.findings:
        members = {each for side in finding.sides for each in side.members} if finding.code in same else set()
        if members & set(fault.members):
            return True
        if finding.code == "BP110" and {oracle.topics.get(each) for each in finding.sides[0].members} & topics:
            return True
    return False


def cause(fault: Claim, oracle: Oracle, runs: int) -> str:
    """Say what a fault that is not reported rests on: of what is changed, what makes a run without it."""
    if fault.code == "BP101":
        return "how often samples come"
    outside = set(oracle.topics.values())
    ends = any(holds(fault, oracle.run(number, outside)) is False for number in range(runs))
    return "when samples come" if ends else "something else"


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
