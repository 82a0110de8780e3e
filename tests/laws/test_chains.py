"""The bounds of chains hold in a simulation of random chains that knows nothing of the analysis."""

from __future__ import annotations

import random
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import pytest
import yaml

from cqos_core.api import context, read
from cqos_core.behaviour.paths.chains import chain_times
from cqos_core.matching.pipeline import Pipeline
from tests.effort import EXPLORE

MS = 1_000_000
RUNS = 1000 if EXPLORE else 20
SAMPLES = 120


@dataclass(frozen=True)
class Step:
    """A step: what it takes, how long a sample is on its way to it, and its period, if it follows a timer."""

    latency: tuple[int, int]
    takes: tuple[int, int]
    period: int | None


def drawn(chance: random.Random) -> list[Step]:
    """Return random steps; the first one follows a timer, and the last one acts at once."""

    def between(most: int) -> tuple[int, int]:
        low = chance.randrange(most)
        return low * MS, (low + chance.randrange(most)) * MS

    count = chance.randint(2, 5)
    return [
        Step(
            between(20),
            between(15),
            chance.randint(5, 100) * MS if number == 0 or (number < count - 1 and chance.random() < 0.6) else None,
        )
        for number in range(count)
    ]


def document(steps: list[Step], limits: dict[str, str]) -> bytes:
    """Return the system file of the steps."""
    participants: dict[str, dict[str, Any]] = {f"s{number}": {} for number in range(len(steps))}
    topics = {}
    for number, step in enumerate(steps[:-1]):
        participants[f"s{number}"]["publishes"] = {f"/t{number}": {"reliability": "reliable"}}
        participants[f"s{number + 1}"]["subscribes"] = {f"/t{number}": {"reliability": "reliable"}}
        topics[f"/t{number}"] = {"period": f"{step.period}ns"} if step.period else {}
    stated = [
        {
            "at": f"s{number}",
            "takes": "{}ns..{}ns".format(*step.takes),
            **({"latency": "{}ns..{}ns".format(*step.latency)} if number else {}),
            **({"waits": "0s"} if number and step.period is None else {}),
        }
        for number, step in enumerate(steps)
    ]
    system = {
        "cqos": 1,
        "protocol": "ros2",
        "options": {"ros2": {"rmw": "cyclonedds"}},
        "topics": topics,
        "participants": participants,
        "chains": {"c": {"steps": stated, **limits}},
    }
    return yaml.safe_dump(system).encode()


def simulated(steps: list[Step], chance: random.Random) -> list[tuple[int, int]]:
    """Return when results come at the last step, each with the moment at which its data was measured."""
    first, period = steps[0], steps[0].period or 0
    start = chance.randrange(period)
    published = []
    for number in range(SAMPLES):
        at = start + number * period
        published.append((at, at - chance.randint(*first.takes)))
    for step in steps[1:]:
        published = passed_on(step, published, chance)
    return published


def passed_on(step: Step, published: list[tuple[int, int]], chance: random.Random) -> list[tuple[int, int]]:
    """Return what a step publishes of what arrives in order."""
    arrived: list[tuple[int, int]] = []
    for at, measured in published:
        arrived.append((max(at + chance.randint(*step.latency), arrived[-1][0] if arrived else 0), measured))
    if not arrived:
        return []
    if step.period is None:
        return sorted((at + chance.randint(*step.takes), measured) for at, measured in arrived)
    out = []
    at = arrived[0][0] + step.takes[1] + chance.randrange(step.period)
    while at <= arrived[-1][0]:
        begun = at - chance.randint(*step.takes)
        newest = max(index for index, (when, _) in enumerate(arrived) if when <= begun)
        out.append((at, arrived[newest][1]))
        at += step.period
    return out


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(RUNS))
def test_bounds_hold_in_every_run(seed):
    chance = random.Random(seed)  # noqa: S311 - no secret
    steps = drawn(chance)
    limits = {"max_age": f"{chance.randint(10, 300)}ms", "max_gap": f"{chance.randint(5, 150)}ms"}
    (times,) = chain_times(Pipeline(read(document(steps, limits)), context()))
    assert not times.faults
    for _ in range(5):
        results = simulated(steps, chance)
        ages = [at - measured for at, measured in results]
        gaps = [later[0] - earlier[0] for earlier, later in pairwise(results)]
        assert all(times.age.low <= age for age in ages)
        assert times.age.high is None or all(age <= times.age.high for age in ages)
        assert times.gap.high is None or all(gap <= times.gap.high for gap in gaps)
        assert times.holds("max_age") is not True or all(age <= times.limits["max_age"] for age in ages)
        assert times.holds("max_age") is not False or all(age > times.limits["max_age"] for age in ages)
        if len(gaps) > 10 and times.holds("max_gap") is False:
            assert max(gaps) > times.limits["max_gap"]


def test_all_three_answers_come_up():
    found = set()
    for seed in range(RUNS):
        chance = random.Random(seed)  # noqa: S311 - no secret
        steps = drawn(chance)
        limits = {"max_age": f"{chance.randint(10, 300)}ms"}
        found |= {each.holds("max_age") for each in chain_times(Pipeline(read(document(steps, limits)), context()))}
    assert found == {True, False, None}
