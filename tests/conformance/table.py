"""Writes docs/conformance.md: how the DDS pack agrees with Cyclone DDS, and where Cyclone DDS departs from the standard.

python -m tests.conformance.table    write it; the tests compare it
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tests.conformance.comparison import ALONE, TOGETHER, Section, pairs_of, random_pairs, section, single
from tests.conformance.cyclone import Cyclone

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.conformance.comparison import Judgement, Pair, Settings
    from tests.conformance.cyclone import Answer

DOCUMENT: Final = Path(__file__).resolve().parents[2] / "docs" / "conformance.md"
PAIRS: Final = 2_000
SEED: Final = 1
_LISTED: Final = 12

INTRODUCTION: Final = """# Conformance with Cyclone DDS

Written by `python -m tests.conformance.table` from what Eclipse Cyclone DDS {version} does when it is run; the tests fail
where this page or the pack differs from it.

A writer and a reader are created with the settings of each pair, on loopback, with a data type that is final. Compared
is whether each can be created, whether they match, and which policy Cyclone DDS names as the reason where they do not.
*Agree* is what the pack says with `implementation: cyclonedds`. *Departures* are pairs of which Cyclone DDS and
`implementation: standard` say different things.
"""
RANDOM: Final = """Random pairs combine all of these. The tests run {pairs:,} with a fixed seed;
`CQOS_CONFORMANCE_PAIRS=20000 pytest tests/conformance` runs more, and `CQOS_CONFORMANCE_SEED` others.
"""


RANDOM_PAIRS: Final = "random pairs"
SECTIONS: Final = (*TOGETHER, *ALONE, RANDOM_PAIRS)


@cache
def seen(name: str) -> Section:
    """Return the pairs of one row of the table, all judged."""
    if name == RANDOM_PAIRS:
        return section(running(), random_pairs(PAIRS, SEED))
    return section(running(), pairs_of(TOGETHER[name]) if name in TOGETHER else single(ALONE[name]))


@cache
def running() -> Cyclone:
    """Return Cyclone DDS, started once."""
    return Cyclone()


def document() -> str:
    """Return the page."""
    rows = []
    departures: list[str] = []
    for name in SECTIONS:
        one = seen(name)
        apart = [
            _departure(*each)
            for each in zip(one.pairs, one.standard, one.seen, strict=True)
            if (each[1].created, each[1].matched) != (each[2].created, each[2].matched)
        ]
        numbers = (
            len(one.pairs),
            sum(each.matched is True for each in one.seen),
            sum(each.matched is None for each in one.seen),
            len(one.pairs) - len(one.disagreements),
            len(apart),
        )
        rows.append([name, *(f"{number:,}" for number in numbers)])
        if apart and name != RANDOM_PAIRS:
            departures += [f"## Departures: {name}", _table(DEPARTURE_HEADER, apart[:_LISTED])]
            departures += [f"And {len(apart) - _LISTED:,} more."] if len(apart) > _LISTED else []
    parts = [
        INTRODUCTION.format(version=version("cyclonedds")),
        _table(("policies", "pairs", "match", "not created", "agree", "departures"), rows),
        RANDOM.format(pairs=PAIRS),
        *departures,
    ]
    return "\n".join(f"{part.rstrip()}\n" for part in parts)


DEPARTURE_HEADER: Final = ("offered", "requested", "standard", "Cyclone DDS")


def _departure(pair: Pair, standard: Judgement, seen: Answer) -> list[str]:
    return [_settings(pair[0]), _settings(pair[1]), _said(standard), _said(seen)]


def _settings(settings: Settings) -> str:
    return ", ".join(f"`{name}: {text}`" for name, text in settings.items()) or "defaults"


def _said(judgement: Judgement | Answer) -> str:
    if judgement.matched is None:
        sides = [name for name, created in zip(("writer", "reader"), judgement.created, strict=True) if not created]
        return f"no {' and no '.join(sides)}"
    return "match" if judgement.matched else f"no match: {judgement.named or 'partition'}"


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["-" * len(name) for name in header], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    DOCUMENT.write_text(document(), encoding="utf-8")
