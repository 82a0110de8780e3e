"""What was checked before changes nothing: memories of the process are for speed only."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

import cqos_core as cqos
from tests.benchmarks import inputs
from tests.goldens import designs

if TYPE_CHECKING:
    from collections.abc import Iterable

ROOT: Final = Path(__file__).parents[2]
SYSTEMS: Final = [designs.text(number).decode() for number in range(24)]
FURTHER_DOWN: Final = [f"# a comment\n\n{text}" for text in SYSTEMS]
PAIRS: Final = [
    *((*inputs.pair(number),) for number in range(1001, 1031)),
    *((requested, offered) for offered, requested in map(inputs.pair, range(1001, 1016))),
    *(({"depth": value}, {}) for value in (1, True, "1", "true", "0", 0)),
    *(({"profile": name}, {"reliability": "reliable"}) for name in ("sensor_data", "best_available", "none")),
]


def of_systems(texts: Iterable[str]) -> list[Any]:
    """Report on systems, one after another."""
    return [cqos.check(text.encode(), importer="yaml").to_dict() for text in texts]


def of_pairs(pairs: Iterable[Any]) -> list[str]:
    """Report on pairs of ROS 2, one after another."""
    return [repr(cqos.check_pair("ros2", *each)) for each in pairs]


NEW = (
    "import json, sys; from tests.laws import test_memory; json.dump(test_memory.{}(json.load(sys.stdin)), sys.stdout)"
)


def in_new_process(what: str, stated: list[Any]) -> list[Any]:
    """Report in a process that has checked nothing, on the last one first."""
    given = json.dumps(stated[::-1])
    run = subprocess.run(
        [sys.executable, "-c", NEW.format(what)], input=given, cwd=ROOT, capture_output=True, text=True, check=True
    )
    found: list[Any] = json.loads(run.stdout)
    return found[::-1]


def test_a_report_depends_on_no_check_before_nor_on_places_in_it() -> None:
    of_systems(SYSTEMS)
    found = json.loads(json.dumps(of_systems(FURTHER_DOWN)))
    assert found == in_new_process("of_systems", FURTHER_DOWN)


def test_a_report_on_a_pair_depends_on_no_pair_before() -> None:
    of_pairs(PAIRS)
    assert of_pairs(PAIRS) == in_new_process("of_pairs", PAIRS)


@pytest.mark.xfail(strict=True, reason="what rules say of profiles is kept with these, also of those with long texts")
def test_what_is_longer_than_people_write_is_not_remembered() -> None:
    def check_long(number: int) -> None:
        long = f"{number}{'x' * 20_000}"
        depth = cqos.Setting(f"{'0' * 20_000}{number + 1}")
        end = cqos.Endpoint(
            id="e",
            role="publisher",
            topic=f"/{long}",
            participant="a",
            settings={"depth": depth, "liveliness": cqos.Setting(long)},
        )
        owner = cqos.Participant("a", settings={"namespace": cqos.Setting(f"/{long}")})
        cqos.check(cqos.System("long", "ros2", participants={"a": owner}, endpoints=[end])).to_dict()
        cqos.check_pair("ros2", {"liveliness": long}, {"lifespan": long}).findings  # noqa: B018 - made when read

    for number in range(3):
        check_long(number)
    gc.collect()
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        for number in range(10, 20):
            check_long(number)
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 200_000, after - before  # of 800,000 letters
