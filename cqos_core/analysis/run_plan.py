"""From a pair of a system to a plan for a prover."""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Final

from cqos_core.analysis.explanation import explain_pair, settled_pair
from cqos_core.analysis.system_fixes import with_setting
from cqos_core.files.export import export_input
from cqos_core.language.policy import ENDPOINT, NEED
from cqos_core.language.values import Depends, is_plain
from cqos_core.matching.pipeline import with_options
from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import Topic as StatedTopic
from cqos_core.packs.export import ExportContext
from cqos_core.packs.guarantee import FAULTS, OUTAGE, SURVIVES
from cqos_core.packs.prover import End, Fault, NotRunnableError, Plan
from cqos_core.resolving.wire_copies import certain_texts, wire_copy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.language.values import Value
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.model.report import PairReport
    from cqos_core.model.system import System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.prover import Event, Outcome, Prover
    from cqos_core.resolving.resolved_endpoint import Resolved

_SECOND: Final = 1_000_000_000
_SAMPLES: Final = 20
_FEWEST: Final = 3
_TIME: Final = 2 * _SECOND
"""So long are samples sent without a fault, so that there are fewer where the topic has a long period."""
_PERIOD: Final = 20_000_000
"""Of topics that state none."""
_PERIODS: Final = (5_000_000, _SECOND)
"""The shortest and the longest period at which samples are sent."""
_SENT_DURING: Final = ("link_outage", "subscriber_restart")
_MOST_DURING: Final = 500
_MOST_EARLY: Final = 100
_FAULT: Final = 1.0  # seconds of a fault whose length is not stated
_LONGEST_OUTAGE: Final = 30 * _SECOND
"""Nanoseconds; a run with a longer stated outage has a short one instead."""
HERE: Final = Place("the command line", path="cqos prove")


@dataclass(frozen=True, slots=True)
class Trial:
    """A pair that is ready to run.

    Attributes:
        system: with the assumptions under which the pack judges as the implementation behaves.
        topic, protocol: where the two meet, as messages name it.
        report: what C-QoS says of the pair under these assumptions.
        on: the name of the prover.
        survives: the faults that the needs of the subscriber name, as far as the prover injects them.
    """

    system: System
    publisher: str
    subscriber: str
    topic: str
    protocol: str
    report: PairReport
    plan: Plan
    prover: Prover
    on: str
    survives: tuple[Fault, ...] = ()

    def run(self, report: Callable[[Event], None] = lambda _event: None) -> Outcome:
        """Run the pair."""
        return self.prover.prove(self.plan, report)


def named(system: System, where: CheckContext) -> System:
    """Return a system whose endpoints have the ids that reports give them, so that fixes find them."""
    endpoints = export_input(system, ExportContext(where.find_pack, where.default_protocol)).endpoints
    return replace(system, endpoints=[replace(each.endpoint, id=each.id) for each in endpoints])


def prepare(
    system: System, publisher: str, subscriber: str, where: CheckContext, on: str = "", fault: Fault | None = None
) -> Trial:
    """Choose a prover for a pair and plan its run.

    Args:
        system: whose endpoints the two are.
        publisher: its id.
        subscriber: its id.
        where: the packs.
        on: the name of the prover; without it the one that the options of the pair name, or the pack's first.
        fault: what goes wrong in the middle of the run.

    Raises:
        CqosError: there is no such endpoint, or the two never meet.
        NotRunnableError: no prover runs this pair.
    """
    topic, _ = settled_pair(system, publisher, subscriber, where)
    pack, ends = _on_the_wire(system, publisher, subscriber, where)
    name, prover = _choose(pack, ends, on)
    period, stated = _period(topic)
    assumed = _with_facts(_assuming(system, pack, ends, name, prover), topic, subscriber, fault, where)
    if period != stated:
        assumed = _with_period(assumed, {ends[0].endpoint.topic, ends[1].endpoint.topic, topic.shown}, period)
    report = explain_pair(assumed, publisher, subscriber, where)
    if report.hops:
        hops = "; ".join(f"`{hop.publisher}` and `{hop.subscriber}`" for hop in report.hops)
        raise NotRunnableError(f"the two meet over bridges only; name the ends of one hop: {hops}")
    pack, ends = _on_the_wire(assumed, publisher, subscriber, where)
    broker = _texts(ends[0], "broker") or _texts(ends[1], "broker")
    offering, requesting = (
        End(each.id, _texts(each, ENDPOINT), _texts(each, "participant", "option")) for each in ends
    )
    early, seconds = _early(topic), period / _SECOND
    during = 0 if fault is None or fault.kind not in _SENT_DURING else min(ceil(fault.seconds / seconds), _MOST_DURING)
    plan = Plan(
        pack.id,
        ends[0].key or topic.key,
        offering,
        requesting,
        filter=(ends[1].endpoint.topic or "") if ends[1].wire_origin is None else "",
        facts={**_texts(ends[1], "topic"), **_texts(ends[0], "topic")},
        broker=broker,
        samples=early + max(_FEWEST, min(_SAMPLES, _TIME // period)) + during,
        early=early,
        during=during,
        period=seconds,
        fault=fault,
        needs=_needs(topic),
    )
    survives = tuple(each for each in _needed_faults(topic) if each.kind in prover.faults)
    return Trial(assumed, publisher, subscriber, topic.shown, topic.pack.id, report, plan, prover, name, survives)


def _on_the_wire(
    system: System, publisher: str, subscriber: str, where: CheckContext
) -> tuple[RulePack, tuple[Resolved, Resolved]]:
    """Return the pack that has provers for a pair, and the two as it sees them."""
    topic, resolver = settled_pair(system, publisher, subscriber, where)
    ends = _as_settled(topic.publishers[0]), _as_settled(topic.subscribers[0])
    pack = topic.pack
    if pack.implementations.provers:
        return pack, ends
    wire = pack.wire
    below = None if wire is None else where.find_pack(wire.protocol)
    if wire is None or below is None or not below.implementations.provers:
        lacking = "" if wire is None else f"; install the rule pack `{wire.protocol}`, which runs them"
        raise NotRunnableError(f"{pack.title} has no implementation on which pairs can be run{lacking}")
    names = [wire.topic(end.key or "", certain_texts(end)) for end in ends]
    if None in names:
        raise NotRunnableError(
            f"with these options, `{topic.shown}` of {pack.title} is not carried by {below.title}, which runs pairs"
        )
    carried = tuple(wire_copy(resolver, end, wire, name or "", below) for end, name in zip(ends, names, strict=True))
    return below, (carried[0], carried[1])


def _as_settled(members: EndpointGroup) -> Resolved:
    return replace(members.first, profile=members.profile)


def _choose(pack: RulePack, ends: Sequence[Resolved], on: str) -> tuple[str, Prover]:
    if on and on not in pack.implementations.provers:
        raise NotRunnableError(
            f"{pack.title} has no `{on}` to run pairs on; it has {', '.join(pack.implementations.provers)}"
        )
    if on:
        return on, _load(pack, on)
    for name in pack.implementations.provers:
        prover = _load(pack, name)
        if all(_fits(end, prover.assumes) for end in ends):
            return name, prover
    stated = {
        f"{option} {certain_texts(end).get(option, 'unknown')}"
        for name in pack.implementations.provers
        for end in ends
        for option in _load(pack, name).assumes
    }
    raise NotRunnableError(
        f"no pair can be run with {' and '.join(sorted(stated))}; `--on` {' or '.join(pack.implementations.provers)} runs it there"
    )


def _load(pack: RulePack, name: str) -> Prover:
    prover: Prover = resolve_name(pack.implementations.provers[name])
    return prover


def _fits(end: Resolved, assumes: Mapping[str, str]) -> bool:
    """Whether the options of an end are, or may be, those of an implementation."""
    stated = ((end.pack.find("option", option), text) for option, text in assumes.items())
    return all(
        _may_be(end.profile.values[index], end.pack.policies[index].domain.parse(text))
        for index, text in stated
        if index is not None and end.written(index) is not None
    )


def _may_be(value: Value, wanted: Value) -> bool:
    if isinstance(value, Depends):
        return any(_may_be(case, wanted) for _, case in value.cases)
    return value == wanted if is_plain(value) else True


def _assuming(system: System, pack: RulePack, ends: Sequence[Resolved], name: str, prover: Prover) -> System:
    """State the options of an implementation at the participants of both ends, in place of what they state."""
    participants = dict(system.participants)
    for end in ends:
        own = end if end.wire_origin is None else end.wire_origin.endpoint
        owner = participants.get(own.endpoint.participant)
        options = dict(prover.assumes)
        if own.pack is not pack:
            wire = own.pack.wire.options if own.pack.wire is not None else {}
            options = {option: name for option, below in wire.items() if below in prover.assumes}
        if owner is not None:  # ends of bridges have no participant that states anything
            indices = {own.pack.find("option", option) for option in options}
            kept = {n: s for n, s in owner.settings.items() if own.pack.find("option", n) not in indices}
            stated = {option: Setting(text, HERE) for option, text in options.items()}
            participants[owner.id] = replace(owner, settings={**kept, **stated})
    return replace(system, participants=participants)


def _with_facts(
    system: System, topic: MatchedTopic, subscriber: str, fault: Fault | None, where: CheckContext
) -> System:
    """State what the fault makes true, so that guarantees are checked with it."""
    if fault is None:
        return system
    text = f"{fault.seconds * 1000:g}ms"
    pack = (
        topic.subscribers[0].first.wire_origin.endpoint.pack if topic.subscribers[0].first.wire_origin else topic.pack
    )
    if fault.kind == "slow_reader" and pack.find(ENDPOINT, "taken_every") is not None:
        return with_setting(system, (subscriber,), "taken_every", Setting(text, HERE))
    if fault.kind in FAULTS and pack.find("option", "outage") is not None:
        return with_options(system, {pack.id: {"outage": text}}, where, HERE)
    return system


def _period(topic: MatchedTopic) -> tuple[int, int]:
    """Return the period of a run and that of the topic, in nanoseconds; equal where the topic states none."""
    index = topic.pack.find("topic", "period")
    stated = None if index is None else topic.publishers[0].profile.values[index]
    if not isinstance(stated, int):
        return _PERIOD, _PERIOD
    return min(max(stated, _PERIODS[0]), _PERIODS[1]), stated


def _with_period(system: System, names: Iterable[str | None], period: int) -> System:
    """State the period of a run in place of the topic's, which takes too long or is too short."""
    known = {name: system.topics.get(name, StatedTopic(name)) for name in names if name is not None}
    stated = {"period": Setting(f"{period}ns", HERE)}
    changed = {name: replace(topic, settings={**topic.settings, **stated}) for name, topic in known.items()}
    return replace(system, topics={**system.topics, **changed})


def _needed_faults(topic: MatchedTopic) -> list[Fault]:
    """Return the faults that the subscriber's needs must survive; each lasts as long as the stated outage, if a run can wait for it."""
    pack, values = topic.pack, topic.subscribers[0].profile.values
    index = pack.find(NEED, SURVIVES.name)
    kinds = () if index is None else values[index]
    outage = pack.find("option", OUTAGE.name)
    stated = None if outage is None else values[outage]
    seconds = stated / _SECOND if isinstance(stated, int) and 0 < stated <= _LONGEST_OUTAGE else _FAULT
    return [Fault(str(kind), seconds) for kind in (kinds if isinstance(kinds, tuple) else ())]


def _needs(topic: MatchedTopic) -> dict[str, int]:
    """Return the values of the subscriber's needs that are stated and known."""
    values = topic.subscribers[0].profile.values
    needed = {word: (values[index], nothing) for word, (index, nothing) in topic.pack.needs.items()}
    return {word: value for word, (value, nothing) in needed.items() if isinstance(value, int) and value != nothing}


def _early(topic: MatchedTopic) -> int:
    """Return how many samples are sent before the subscriber starts: as many as it needs of them."""
    index, nothing = topic.pack.needs.get("late_join", (0, None))
    needed = topic.subscribers[0].profile.values[index]
    return min(needed, _MOST_EARLY) if nothing is not None and isinstance(needed, int) else 0


def _texts(end: Resolved, *levels: str) -> dict[str, str]:
    """Return the values of some levels that are known."""
    return {
        policy.name: policy.domain.format(value)
        for policy, value in zip(end.pack.policies, end.profile.values, strict=False)
        if policy.level in levels
        and is_plain(value)
        and (policy.level != ENDPOINT or end.endpoint.role in policy.roles)
    }
