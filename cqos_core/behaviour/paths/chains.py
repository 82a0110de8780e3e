"""Computes the age of data in chains, from certain bounds of periods, latencies, waits and tasks.

A sum of certain bounds is certain, whatever the phases of the steps are. A bound without a fact stays open.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.behaviour.paths.delivery_paths import DeliveryPaths
from cqos_core.behaviour.paths.time_ranges import ANY_TIME, DURATION, NO_TIME, TimeRange, covering_range, read_range
from cqos_core.language.values import INFINITE, is_plain
from cqos_core.matching.hops import Hop
from cqos_core.matching.pair_guarantees import guarantees_of, over_hops
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.suggestions import suggestion
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.behaviour.paths.delivery_paths import Pair, Way
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.model.chains import Chain, ChainStep
    from cqos_core.model.settings import Place, Setting
    from cqos_core.resolving.resolved_endpoint import Resolved

_PERIOD: Final = "period"


@dataclass(frozen=True, slots=True)
class ChainFault:
    """A mistake in a chain: a wrong name or value, or a step that no data reaches.

    Attributes:
        apart: no publisher of one step reaches the next, as far as is known.
        broken: that is certain.
        reported: a finding about a pair on the way says so already.
    """

    message: str
    place: Place | None = None
    help: str | None = None
    apart: bool = False
    broken: bool = False
    reported: bool = False


@dataclass(frozen=True, slots=True)
class StepTimes:
    """The certain time bounds of one step.

    Attributes:
        at: the step, as the chain names it.
        topic: the topic on which data arrives; empty for the first step.
        bridges: the bridges over which it arrives.
        latency, waits, takes: from the step before to here, from arrival to the start of the task, the task.
        gap: from one arrival's sending to the next; `low` is what the longest gap certainly is.
        age: of the data after this step.
        missing: the times without an upper bound.
        gap_missing: why the gap has no upper bound.
        assumed: assumptions behind the bounds.
    """

    at: str
    topic: str = ""
    bridges: tuple[str, ...] = ()
    latency: TimeRange = NO_TIME
    waits: TimeRange = NO_TIME
    takes: TimeRange = NO_TIME
    gap: TimeRange = ANY_TIME
    age: TimeRange = NO_TIME
    missing: tuple[str, ...] = ()
    gap_missing: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ChainTimes:
    """The certain time bounds of a chain.

    Attributes:
        steps: the steps that were followed.
        age: of the data after the last step.
        gap: between two samples after the last step; the longest gap is at least `low`.
        limits: the stated requirements ``max_age`` and ``max_gap``, in nanoseconds.
        faults: mistakes that exclude a result.
    """

    chain: Chain
    steps: tuple[StepTimes, ...] = ()
    age: TimeRange = ANY_TIME
    gap: TimeRange = ANY_TIME
    limits: Mapping[str, int] | None = None
    faults: tuple[ChainFault, ...] = ()

    def holds(self, limit: str) -> bool | None:
        """Whether ``max_age`` or ``max_gap`` certainly holds; False if it certainly does not, None if open."""
        if self.faults:
            return False if any(each.broken for each in self.faults) else None
        return self.known(limit).within((self.limits or {})[limit])

    def known(self, limit: str) -> TimeRange:
        """Return the range to compare with ``max_age`` or ``max_gap``."""
        return self.age if limit == "max_age" else self.gap

    def missing(self, limit: str) -> tuple[str, ...]:
        """Return why ``max_age`` or ``max_gap`` has no upper bound."""
        if limit == "max_gap":
            return (*self.steps[-1].missing, *self.steps[-1].gap_missing)
        last = self.steps[-1]
        return tuple(
            reason for step in self.steps for reason in step.missing + (step.gap_missing if step is not last else ())
        )


def chain_times(pipeline: Pipeline) -> list[ChainTimes]:
    """Return the time bounds of all chains of a system, by name."""
    chains = pipeline.system.chains
    if not chains:
        return []
    follower = _Follower(pipeline)
    return [follower.follow(chains[name]) for name in sorted(chains)]


class _Arrival(NamedTuple):
    """The bounds along one path, and why one is missing."""

    way: Way
    passes: bool | None
    age: int | None
    gap: TimeRange
    lost: tuple[str, ...]
    promised: str


class _Follower:
    """Follows chains through one system."""

    def __init__(self, pipeline: Pipeline) -> None:
        self.system = pipeline.system
        self.arrivals = DeliveryPaths(pipeline.hops, pipeline.topics)
        self.of = grouped(
            (name, each) for each in pipeline.endpoints for name in {each.endpoint.participant, each.id, each.stated_id}
        )

    def follow(self, chain: Chain) -> ChainTimes:
        """Add up the times of the steps."""
        faults = [*_unreadable(chain)]
        if len(chain.steps) < 2:  # noqa: PLR2004 - a source and a use
            message = f"chain `{chain.name}` has {len(chain.steps)} step, and a path has at least two"
            faults.append(ChainFault(message, chain.place))
        known = {*self.system.participants, *self.of}
        for step in chain.steps:
            if step.at not in known:
                message = f"chain `{chain.name}` names `{step.at}`, which is neither a participant nor an endpoint"
                faults.append(ChainFault(message, step.place, suggestion(step.at, self.system.participants)))
        if faults:
            return ChainTimes(chain, faults=tuple(faults))
        limits = {name: DURATION.parse(setting.text) for name, setting in chain.settings.items() if not setting.unknown}
        steps = [_first(chain.steps[0])]
        for before, step in zip(chain.steps, chain.steps[1:], strict=False):
            found = self.step(chain, before, step, last=step is chain.steps[-1])
            if isinstance(found, ChainFault):
                return ChainTimes(chain, tuple(steps), limits=limits, faults=(found,))
            age = steps[-1].age.plus(found.latency).plus(found.waits).plus(found.takes)
            steps.append(replace(found, age=age))
        last = steps[-1]
        varying = last.latency.spread.plus(last.waits.spread).plus(last.takes.spread)
        gap = TimeRange(last.gap.low, last.gap.plus(varying).high)
        return ChainTimes(chain, tuple(steps), last.age, gap, limits)

    def step(self, chain: Chain, before: ChainStep, step: ChainStep, *, last: bool) -> StepTimes | ChainFault:
        """Return the time bounds of one step without its age, or the mistake."""
        ways = [*self.ways(before, step)]
        if not ways:
            return self.apart(chain, before, step)
        topics = sorted({_topic(way) for way in ways})
        if len(topics) > 1:
            listed = ", ".join(f"`{each}`" for each in topics)
            message = f"chain `{chain.name}`: data gets from `{before.at}` to `{step.at}` on several topics: {listed}"
            return ChainFault(message, step.place, f"state `topic` of step `{step.at}`")
        arriving = [arrival for way in ways if (arrival := self.arrival(way)).passes is not False]
        if not arriving:
            message = f"chain `{chain.name}`: no pair from `{before.at}` to `{step.at}` is compatible"
            return ChainFault(message, step.place, broken=True, reported=True)
        return _step_times(step, topics[0], arriving, last=last)

    def ways(self, before: ChainStep, step: ChainStep) -> Iterator[Way]:
        """Yield the paths from one step to the next."""
        wanted = {each.id for each in self.ends(step.at, SUBSCRIBER)}
        for publisher in self.ends(before.at, PUBLISHER):
            for name, ways in self.arrivals.ways(publisher).items():
                for way in ways if name in wanted else ():
                    first, _ = way[0]  # type: ignore[misc]
                    _, arrived = way[-1]  # type: ignore[misc]
                    names = {end.shown for end in (first, arrived)} | {end.endpoint.topic for end in (first, arrived)}
                    if step.topic is None or step.topic in names:
                        yield way

    def ends(self, name: str, role: str) -> list[Resolved]:
        """Return the endpoints of a role at a step; if the step names an endpoint of the other role, those of its participant."""
        named = self.of.get(name, [])
        own = [each for each in named if each.role == role]
        if own or not named or name in self.system.participants:
            return own
        return [each for each in self.of[named[0].endpoint.participant] if each.role == role]

    def apart(self, chain: Chain, before: ChainStep, step: ChainStep) -> ChainFault:
        """Return the mistake that no data gets from one step to the next; in a part of a system it is uncertain."""
        on = f" on topic `{step.topic}`" if step.topic else ""
        message = f"chain `{chain.name}`: nothing that `{before.at}` publishes reaches `{step.at}`{on}"
        names = (before.at, step.at)
        outside = any(self.system.participants[name].external for name in names if name in self.system.participants)
        unjudged = any(each.id in names or each.participant in names for each in self.system.endpoints) and not all(
            name in self.of for name in names
        )
        certain = not (self.system.partial or outside or unjudged)
        advice = "connect the two, or name the steps between them"
        return ChainFault(message, step.place, advice, apart=True, broken=certain)

    def arrival(self, way: Way) -> _Arrival:
        """Return the bounds along a path."""
        pairs: list[Pair] = [each for each in way if not isinstance(each, Hop)]
        carried = all(each.carries_liveliness for each in way if isinstance(each, Hop))
        given = [guarantees_of(*(self.arrivals.profile(end) for end in pair)) for pair in pairs]
        by_word = {each.word.name: each for each in over_hops(given, carried=carried)}
        passing = [self.arrivals.passes(pair) for pair in pairs]
        age, gap = (by_word.get(word) for word in ("max_age", "max_gap"))
        bound = gap.value if gap is not None and gap.value is not None and not gap.nothing else None
        period = self.period(pairs[-1][0])
        exact = period is not None and bound is not None and bound >= period
        # A publisher without lifespan may keep samples for any time.
        living = all(publisher.pack.timing.lifespan for publisher, _ in pairs)
        return _Arrival(
            way,
            False if False in passing else None if None in passing else True,
            age.value if age is not None and age.value is not None and not age.nothing and living else None,
            TimeRange(period or 0, bound),
            tuple(rule.because for rule in gap.lost) if gap is not None and bound is None else (),
            "" if exact or bound is None else f"`{pairs[-1][0].id}` keeps the gap that its settings promise",
        )

    def period(self, publisher: Resolved) -> int | None:
        """Return the stated period of a topic, in nanoseconds."""
        index = publisher.pack.find("topic", _PERIOD)
        value = None if index is None else self.arrivals.profile(publisher).values[index]
        return value if isinstance(value, int) and is_plain(value) and 0 < value < INFINITE else None


def _unreadable(chain: Chain) -> Iterator[ChainFault]:
    """Yield a fault for each value that cannot be read."""
    for step in chain.steps:
        for name, setting in step.settings.items():
            if isinstance(fault := _range_of(setting), InvalidValueError):
                message = f"chain `{chain.name}`: `{name}` of step `{step.at}` cannot be read: {fault.message}"
                yield ChainFault(message, setting.place, fault.advice())
    for name, setting in chain.settings.items():
        if not setting.unknown:
            try:
                DURATION.parse(setting.text)
            except InvalidValueError as error:
                message = f"chain `{chain.name}`: `{name}` cannot be read: {error.message}"
                yield ChainFault(message, setting.place, error.advice())


def _range_of(setting: Setting | None) -> TimeRange | InvalidValueError:
    if setting is None or setting.unknown:
        return ANY_TIME
    try:
        return read_range(setting.text)
    except InvalidValueError as error:
        return error


def _stated(step: ChainStep, name: str) -> TimeRange | None:
    """Return a stated range of a step; None if it is not stated."""
    found = _range_of(step.settings[name]) if name in step.settings else None
    return None if isinstance(found, InvalidValueError) else found


def _topic(way: Way) -> str:
    """Return the topic of a path; both topics if it ends on another one."""
    first, last = way[0][0].shown, way[-1][1].shown  # type: ignore[index]
    return first if first == last else f"{first} … {last}"


def _first(step: ChainStep) -> StepTimes:
    takes = _stated(step, "takes") or NO_TIME
    missing = _without_bound(step, {"takes": takes})
    return StepTimes(step.at, takes=takes, age=takes, missing=missing)


def _step_times(step: ChainStep, topic: str, arriving: Sequence[_Arrival], *, last: bool) -> StepTimes:
    """Combine the paths to one step."""
    doubtful = any(each.passes is None for each in arriving)
    gap = covering_range([each.gap for each in arriving])
    gap = TimeRange(gap.low if len(arriving) == 1 else 0, None if doubtful else gap.high)
    latency = _stated(step, "latency")
    assumed: list[str] = []
    if latency is None:
        latency = covering_range([TimeRange(0, each.age) for each in arriving])
        if latency.high is not None:
            assumed.append(f"the clocks at both ends of `{topic}` agree")
    waits, takes = _stated(step, "waits"), _stated(step, "takes") or (NO_TIME if last else ANY_TIME)
    derived = waits is None and not last
    if waits is None:
        waits = NO_TIME if last else TimeRange(0, gap.high)
    if derived or last:
        assumed += dict.fromkeys(each.promised for each in arriving if each.promised)
    if derived:
        assumed.append(f"`{step.at}` uses the newest sample of `{topic}`")
    missing = _without_bound(step, {"latency": latency, "takes": takes} | ({} if derived else {"waits": waits}))
    open_gap = tuple(_why_open(step, topic, gap, arriving, doubtful=doubtful)) if derived or last else ()
    bridges = tuple(each.bridge.id for each in arriving[0].way if isinstance(each, Hop))
    return StepTimes(
        at=step.at,
        topic=topic,
        bridges=bridges,
        latency=latency,
        waits=waits,
        takes=takes,
        gap=gap,
        age=ANY_TIME,
        missing=missing,
        gap_missing=open_gap,
        assumed=tuple(assumed),
    )


def _why_open(
    step: ChainStep, topic: str, gap: TimeRange, arriving: Sequence[_Arrival], *, doubtful: bool
) -> Iterator[str]:
    """Yield why the gap between two samples has no upper bound."""
    if gap.high is None:
        reasons = [*dict.fromkeys(reason for each in arriving for reason in each.lost)]
        why = "whether its pairs are compatible is unknown" if doubtful else "; ".join(reasons)
        yield f"nothing bounds the gap between two samples of `{topic}` at `{step.at}`" + (f": {why}" if why else "")


def _without_bound(step: ChainStep, times: Mapping[str, TimeRange]) -> tuple[str, ...]:
    return tuple(
        f"no upper bound of `{name}` is stated for step `{step.at}`"
        for name, time in times.items()
        if time.high is None
    )
