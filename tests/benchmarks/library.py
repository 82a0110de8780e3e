"""Rows of the library and the command, in processor time within one run. See `__main__` for the table."""

from __future__ import annotations

import itertools
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cqos_core as cqos
from tests.benchmarks import inputs

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cqos_core.model.system import Role

ROOT: Final = Path(__file__).parents[2]
ROUNDS: Final = 3
GIB: Final = 1 << 30


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.

    Attributes:
        what: the work.
        beside: what bounds it.
        took: what the work costs, with its unit.
        ratio: of the work to what stands beside it, or a share of it where `least` is set.
        target: the ratio that is wanted.
        least: whether the ratio is a share, which should be at least the target.
    """

    what: str
    beside: str
    took: str
    ratio: float
    target: float
    least: bool = False

    @property
    def met(self) -> bool:
        """Whether the target is met."""
        return self.ratio >= self.target if self.least else self.ratio <= self.target


def once(work: Callable[[], Any]) -> float:
    """Return the processor time of a work that may be done only once, as it is known afterwards."""
    began = time.process_time()
    work()
    return time.process_time() - began


def best(*works: Callable[[], Any], rounds: int = ROUNDS) -> list[float]:
    """Return the least processor time of each work, taken in turns, in seconds."""
    times = [float("inf")] * len(works)
    for _ in range(rounds):
        for index, work in enumerate(works):
            times[index] = min(times[index], once(work))
    return times


# --- pairs ---

_RANKS: Final = {
    "best_effort": 0,
    "reliable": 1,
    "volatile": 0,
    "transient_local": 1,
    "automatic": 0,
    "manual_by_topic": 1,
}


def plain(offered: dict[str, Any], requested: dict[str, Any]) -> list[str]:
    """Compare five policies as a program would that does nothing else."""
    reasons = [
        policy
        for policy in ("reliability", "durability", "liveliness")
        if _RANKS[offered[policy]] < _RANKS[requested[policy]]
    ]
    reasons += [policy for policy in ("deadline", "lease_duration") if offered[policy] > requested[policy]]
    return reasons


def numbered(settings: dict[str, str]) -> dict[str, Any]:
    """The same settings with durations as seconds."""
    whole = {"durability": "volatile", "liveliness": "automatic", **settings}
    return whole | {name: in_seconds(whole[name]) for name in ("deadline", "lease_duration")}


def in_seconds(text: str) -> float:
    """Read a duration in `s` or `ms`."""
    return float(text[:-2]) / 1000 if text.endswith("ms") else float(text[:-1])


def pairs(_scale: float) -> Iterator[Row]:
    """Measure single pairs, as a caller asks for them who reads the verdict.

    All of them at any scale: the first 150 of the 1,500 combinations have 67 of their 88 profiles, so a part of them would
    measure new profiles rather than new combinations.
    """
    known = inputs.known_pairs()
    ready = [(numbered(offered), numbered(requested)) for offered, requested in known]

    def ask(asked: Sequence[tuple[dict[str, str], dict[str, str]]]) -> None:
        for offered, requested in asked:
            _ = cqos.check_pair("ros2", offered=offered, requested=requested).verdict

    ask([({}, {})])
    (floor,) = best(lambda: [plain(offered, requested) for offered, requested in ready])
    beside = "a plain comparison of five policies"

    def row(what: str, seconds: float, target: float) -> Row:
        return Row(what, beside, f"{seconds / len(known) * 1e6:,.1f} µs", seconds / floor, target)

    yield row("`check_pair`, new combination of known values", once(lambda: ask(known)), 60)
    yield row("`check_pair`, seen before", min(once(lambda: ask(known)) for _ in range(ROUNDS)), 12)
    new = [inputs.pair(number) for number in range(5000, 5000 + len(known))]
    yield row("`check_pair`, values never seen", once(lambda: ask(new)), 120)
    judge = getattr(cqos, "PairJudge", None)
    if judge is None:
        yield Row("`PairJudge`, not seen before", beside, "not there yet", float("inf"), 4)
    else:
        verdict = judge("ros2").verdict
        yield row(
            "`PairJudge`, not seen before",
            once(lambda: [verdict(offered, requested) for offered, requested in known]),
            4,
        )


# --- files ---


def cold(work: str, form: str, size: int, rounds: int = ROUNDS) -> tuple[float, int]:
    """Return processor time and memory of one work in fresh processes, the least of several."""
    command = [sys.executable, "-m", "tests.benchmarks.cold", work, form, str(size)]
    found = [
        json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout) for _ in range(rounds)
    ]
    return min(each["seconds"] for each in found), min(each["bytes"] for each in found)


def files(scale: float) -> Iterator[Row]:
    """Measure reading and checking of files with diverse values and mistakes, each in a process that saw nothing before."""
    kinds = (
        ("diagram", "BPMN of {:,} signal events", 200_000, "lxml parse and bare walk"),
        ("system_file", "system file of {:,} endpoints", 10_000, "PyYAML's C events"),
    )
    for form, name, whole, beside in kinds:
        size = max(200, int(whole * scale))
        floor, _ = cold("base", form, size)
        for work, target in (("read", math.inf), ("check", 5)):
            seconds, _ = cold(work, form, size, rounds=2)
            yield Row(f"{name.format(size)}: {work}", beside, f"{seconds:,.2f} s", seconds / floor, target)


def memory(scale: float) -> Iterator[Row]:
    """Measure the memory of a large diagram and a large system file, read and checked."""
    size = max(1000, int(1_000_000 * scale))
    for form in ("diagram", "system_file"):
        seconds, peak = cold("check", form, size, rounds=1)
        what = f"{form.replace('_', ' ')} of {size:,} endpoints, read and checked"
        yield Row(what, "1 GiB of memory", f"{peak / GIB:.2f} GiB, {seconds:,.1f} s", peak / GIB, 2)


def one_topic(scale: float) -> Iterator[Row]:
    """Measure a crowded topic on which no pair matches: ten times the endpoints are a hundred times the pairs."""

    def crowd(size: int) -> cqos.System:
        system = cqos.System(protocol="ros2", options={"ros2": {"rmw": cqos.Setting("cyclonedds")}})
        ends: tuple[tuple[Role, str], ...] = (("publisher", "best_effort"), ("subscriber", "reliable"))
        for role, reliability in ends:
            for number in range(size):
                name = f"{role}{number}"
                system.participants[name] = cqos.Participant(name)
                settings = {"reliability": cqos.Setting(reliability), "deadline": cqos.Setting(f"{number + 1}ms")}
                system.endpoints.append(
                    cqos.Endpoint(id=name, role=role, topic="/scan", participant=name, settings=settings)
                )
        return system

    small = max(20, int(500 * scale))
    few, many = crowd(small), crowd(small * 10)
    less, more = best(lambda: cqos.check(few), lambda: cqos.check(many))
    what = f"one topic, {small * 10:,} to {small * 10:,} endpoints that all differ, all pairs failing"
    yield Row(what, f"the same with {small:,} to {small:,}", f"{more:,.2f} s", more / less, 15)


# --- sessions ---


def edits(scale: float) -> Iterator[Row]:
    """Measure one edit and its changes, in small and large systems."""
    for whole, target in ((1_000, 1), (10_000, 2), (100_000, 10)):
        size = max(200, int(whole * scale))
        session = cqos.Session(cqos.read(b"".join(inputs.system_file(size)), importer="yaml"))
        session.report()
        changes = getattr(session, "changes", session.report)
        changes()
        times = []
        for number, endpoint in enumerate(itertools.islice(session.system.endpoints, 0, 40, 2)):
            changed = replace(endpoint, settings={**endpoint.settings, "depth": cqos.Setting(str(2 + number % 5))})
            began = time.process_time()
            session.put(changed)
            changes()
            times.append(time.process_time() - began)
        cost = statistics.median(times)
        yield Row(f"edit and changes at {size:,} endpoints", "1 ms", f"{cost * 1e3:,.2f} ms", cost / 1e-3, target)


# --- the command ---


def processes(_scale: float) -> Iterator[Row]:
    """Measure the whole process of the command on a small file."""
    example = str(ROOT / "examples" / "smart_agriculture.yaml")
    check = [sys.executable, "-c", "import sys; from cqos_core.cli import main; sys.exit(main())", "check", example]
    bare = [sys.executable, "-c", "import click, yaml, pluggy"]
    with tempfile.TemporaryDirectory() as cache:
        # Both read bytecode, as installed packages do; the first run writes it and is not the least.
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": cache}
        rounds = [[_process(command, environment) for command in (check, bare)] for _ in range(9)]
    took = dict(zip(("check", "bare"), map(min, zip(*rounds, strict=True)), strict=True))
    milliseconds = f"{took['check'] * 1e3:,.0f} ms"
    ratio = took["check"] / took["bare"]
    yield Row("`cqos check` of a small file, whole process", "imports of click, yaml, pluggy", milliseconds, ratio, 3)


def _process(command: Sequence[str], environment: Mapping[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


# --- growth ---


def growth(scale: float) -> Iterator[Row]:
    """Measure how the cost of each model of `tests/growth` grows with its bytes in and out.

    A slope between two short times is noise, so each model grows until its largest size takes a second (at scale 1), or
    until it is as large as it may be.
    """
    from tests.growth.models import LARGEST, MODELS
    from tests.growth.test_growth import exponent, measured

    enough = max(0.3, scale)
    for model, smallest in MODELS.items():
        size = smallest
        while size * 8 < LARGEST.get(model, math.inf) and measured(model, size, (4,))[0][1] < enough:
            size *= 2
        rounds = [measured(model, size + number, (1, 2, 4)) for number in range(1, 4)]
        least = [min(points, key=lambda point: point[1]) for points in zip(*rounds, strict=True)]
        name = f"growth: {model.__name__.replace('_', ' ')}"
        yield Row(name, "bytes in and out, exponent", f"{least[-1][1]:.2f} s", exponent(least), 1.2)
