"""Measures repairs of random systems, and suggestions for them: ``python -m plugins.planning.tests.measure``. docs/benchmarks.md has its figures."""

from __future__ import annotations

import random
import sys
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cqos_core as cqos
from cqos_planning.search import find_repair
from cqos_planning.suggestion import find_suggestion
from plugins.planning.tests.systems import NAME, NEEDS, SETTINGS, WHERE, again, open_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cqos_core.analysis.plan import RepairPlan

EXAMPLES: Final = Path(__file__).resolve().parents[3] / "examples"
SIZES: Final = (10, 50, 100, 200, 500)
PER_TOPIC: Final = 10
PER_PARTICIPANT: Final = 5


def text_of(protocol: str, size: int, seed: int = 1) -> bytes:
    """Return a random system with ``size`` endpoints, ten on each topic, half of them with settings from four profiles."""
    chance = random.Random(f"{protocol} {size} {seed}")  # noqa: S311 - the same systems every time
    policies = {name: values for name, values in SETTINGS[protocol].items() if "filter" not in name}

    def settings(number: int) -> str:
        chosen = chance.sample([*policies], number)
        return ", ".join(f"{name}: {chance.choice(policies[name])}" for name in chosen)

    lines = ["cqos: 1", f"protocol: {protocol}", "profiles:"]
    lines += [f"  p{number}: {{{settings(2)}}}" for number in range(4)]
    lines.append("participants:")
    by: dict[int, dict[str, list[str]]] = {}
    for number in range(size):
        topic, place = divmod(number, PER_TOPIC)
        kind = "publishes" if place < PER_TOPIC // 2 else "subscribes"
        stated = f"{{profile: p{chance.randrange(4)}}}" if chance.random() < 0.5 else f"{{{settings(2)}}}"
        if protocol == "mqtt" and kind == "subscribes" and chance.random() < 0.3:
            stated = f"{stated[:-1]}, needs: {{{chance.choice(NEEDS[protocol])}}}}}"
        owner = place * 100 + topic // PER_PARTICIPANT
        by.setdefault(owner, {}).setdefault(kind, []).append(f"      t{topic}: {stated}")
    for owner, kinds in by.items():
        lines.append(f"  node{owner}:")
        for kind, listed in kinds.items():
            lines += [f"    {kind}:", *listed]
    return ("\n".join(lines) + "\n").encode()


def repairs(protocol: str, size: int) -> str:
    """Return one row of the table of repairs."""
    text = text_of(protocol, size)
    plan, took = timed(lambda: find_repair({NAME: text}, again, WHERE))
    bad = sum(each.pairs for each in plan.before.groups if each.verdict.value == "incompatible")
    left = sum(each.pairs for each in plan.after.groups if each.verdict.value == "incompatible")
    return f"| {protocol} | {size} | {bad} | {left} | {len(plan.changes)} | {'yes' if plan.proven else 'no'} | {took:.2f} s |"


def suggestions(protocol: str, size: int) -> str:
    """Return one row of the table of suggestions."""
    text = open_text(protocol, size, 0)
    plan, took = timed(lambda: find_suggestion({NAME: text}, again, WHERE))
    words = text.count(b"true") + text.count(b"late_join") + text.count(b"offline") + text.count(b"max_gap")
    loud = sum(each.severity.value != "note" for each in plan.after.findings)
    return f"| {protocol} | {size} | {words} | {len(plan.changes)} | {loud} | {'yes' if plan.proven else 'no'} | {took:.2f} s |"


def examples() -> Iterator[str]:
    """Yield one row for each shipped example in which something has to change."""
    for path in sorted(each for each in EXAMPLES.iterdir() if each.suffix in {".yaml", ".bpmn"}):
        try:
            plan, took = timed(partial(cqos.repair, [path]))
        except cqos.InputError:  # a part of a system, or a pack
            continue
        if plan.changes or plan.conflicts:
            pairs = plan.before.pair_count
            yield f"| `{path.name}` | {pairs} | {len(plan.changes)} | {len(plan.conflicts)} | {took:.2f} s |"


def timed(make: Callable[[], RepairPlan]) -> tuple[RepairPlan, float]:
    """Return a plan, and the seconds of processor time that it took."""
    began = time.process_time()
    return make(), time.process_time() - began


def rows() -> Iterator[str]:
    """Yield one row for each system: all repairs, then all suggestions."""
    find_repair({NAME: text_of("ros2", 10)}, again, WHERE)  # loads the solver
    for row in (repairs, suggestions):
        for protocol in sys.argv[1:] or ("ros2", "dds", "mqtt"):
            for size in SIZES:
                yield row(protocol, size)
    yield from examples()


if __name__ == "__main__":
    for row in rows():
        print(row, flush=True)  # noqa: T201 - a command of developers
