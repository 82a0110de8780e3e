"""Measures what C-QoS costs beside the bare work it has to do anyway, and prints the table of docs/benchmarks.md.

python tests/benchmarks/ratios.py [SCALE]      SCALE 1 is what the docs show; smaller is faster and says less

Both sides of a ratio are measured in turns within one run, the best of several, so that another machine, or a busy one,
gives much the same ratios.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml
from lxml import etree

import cqos_core as cqos
from cqos_core.checking.checker import check_system
from cqos_core.checking.session import Session
from cqos_core.matching.judge import judge_pair
from cqos_core.matching.pipeline import context
from cqos_core.model.system import Endpoint, Participant, Setting, System
from cqos_core.resolving.resolve import resolve

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

BPMN = Path(__file__).parents[2] / "examples" / "smart_agriculture.bpmn"
ROUNDS = 3


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table: what is measured, beside what, both in seconds."""

    what: str
    beside: str
    seconds: float
    base: float

    @property
    def ratio(self) -> float:
        """How often the base fits into it."""
        return self.seconds / self.base


def best(*works: Callable[[], Any], rounds: int = ROUNDS) -> list[float]:
    """Return the shortest time of each work, taken in turns."""
    times = [float("inf")] * len(works)
    for _ in range(rounds):
        for index, work in enumerate(works):
            begin = time.perf_counter()
            work()
            times[index] = min(times[index], time.perf_counter() - begin)
    return times


def yaml_system(endpoints: int) -> bytes:
    """A system file of many participants with ten topics each."""
    lines = ["cqos: 1", "protocol: ros2", "participants:"]
    for number in range(endpoints // 10):
        lines += [f"  node{number}:", "    publishes:"]
        lines += [
            f"      /node{number}/topic{topic}: {{reliability: reliable, deadline: 1s, depth: {topic + 1}}}"
            for topic in range(5)
        ]
        lines += ["    subscribes:"]
        lines += [f"      /node{number}/topic{topic}: {{reliability: best_effort, deadline: 2s}}" for topic in range(5)]
    return "\n".join(lines).encode()


def one_topic(size: int, *, different: bool = False) -> System:
    """A system of as many publishers as subscribers, all on one topic."""
    system = System(protocol="ros2", options={"ros2": {"rmw": Setting("cyclonedds")}})
    for role in ("publisher", "subscriber"):
        for number in range(size):
            name = f"{role}{number}"
            system.participants[name] = Participant(name)
            settings = {"reliability": Setting("best_effort" if role == "publisher" else "reliable")}
            if different:
                settings["deadline"] = Setting(f"{number + 1}ms")
            system.endpoints.append(Endpoint(id=name, role=role, topic="/scan", participant=name, settings=settings))
    return system


def many_topics(size: int) -> System:
    """A system of as many topics, a publisher and a subscriber on each."""
    return cqos.read(yaml_system(size * 2), importer="yaml")


def bpmn_diagram(copies: int) -> bytes:
    """The example diagram, its collaboration's processes many times over."""
    text = BPMN.read_text(encoding="utf-8")
    begin, end = text.index("<bpmn:process"), text.rindex("</bpmn:process>") + len("</bpmn:process>")
    part = text[begin:end]
    more = "".join(part.replace('id="', f'id="c{number}_') for number in range(copies))
    return (text[:end] + more + text[end:]).encode()


def rows(scale: float) -> Iterator[Row]:
    """Measure everything."""
    where = context()
    document = yaml_system(max(100, int(10_000 * scale)))
    system = cqos.read(document, importer="yaml")
    read, composed, checked = best(
        lambda: cqos.read(document, importer="yaml"),
        lambda: yaml.compose(document, Loader=yaml.CSafeLoader),
        lambda: check_system(system, where),
    )
    size = len(system.endpoints)
    yield Row(f"reading a system file of {size:,} endpoints", "PyYAML's C composer alone", read, composed)
    yield Row(f"checking it ({size // 2:,} topics)", "reading it", checked, read)

    diagram = bpmn_diagram(max(2, int(200 * scale)))
    drawn, parsed = best(lambda: cqos.read(diagram, importer="bpmn"), lambda: etree.fromstring(diagram))
    yield Row(f"reading a BPMN file of {len(diagram) / 1e6:.1f} MB", "lxml alone", drawn, parsed)

    small, large = max(10, int(500 * scale)), max(100, int(5_000 * scale))
    few, many = one_topic(small), one_topic(large)
    (first, second) = best(lambda: check_system(many, where), lambda: check_system(few, where))
    times = large // small
    yield Row(
        f"one topic, {large:,} to {large:,} endpoints, all pairs failing",
        f"the same with {small:,} to {small:,}: {times} times the endpoints, {times * times} times the pairs",
        *(first, second),
    )

    ends = resolve(one_topic(max(10, int(300 * scale)), different=True), where.find_pack).endpoints
    offers = [each.profile for each in ends if each.role == "publisher"]
    requests = [each.profile for each in ends if each.role == "subscriber"]

    def every_pair() -> None:
        for offer in offers:
            for request in requests:
                judge_pair(offer, request)

    def cold() -> None:
        judge_pair.cache_clear()
        every_pair()

    fresh, known = best(cold, every_pair, rounds=2)
    pairs = len(offers) * len(requests)
    yield Row(f"judging {pairs:,} different pairs", "the same again, from the cache", fresh, known)

    open_system = many_topics(max(50, int(5_000 * scale)))
    session = Session(open_system)
    session.report()
    edited = open_system.endpoints[0]
    texts = iter(range(1, 10_000))

    def edit() -> None:
        session.put(replace(edited, settings={"depth": Setting(str(next(texts)))}))
        session.report()

    (edit_time, whole) = best(edit, lambda: check_system(open_system, where))
    topics = len(open_system.endpoints) // 2
    yield Row(f"one edit in a session of {topics:,} topics", "checking the whole system", edit_time, whole)


def table(measured: list[Row]) -> str:
    """Write the measurements as a table."""
    lines = ["| measured | beside | time | ratio |", "| --- | --- | --- | --- |"]
    lines += (f"| {row.what} | {row.beside} | {row.seconds * 1000:,.1f} ms | {row.ratio:.2f} |" for row in measured)
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(list(rows(float(sys.argv[1]) if len(sys.argv) > 1 else 1.0))))  # noqa: T201 - what it is for
