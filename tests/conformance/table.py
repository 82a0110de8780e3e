"""Writes docs/conformance.md: how the packs agree with Cyclone DDS, and where Cyclone DDS departs from the standard.

python -m tests.conformance.table                write it; the tests compare it
python -m tests.conformance.table 20000 2026     first compare so many random pairs of each pack, and record what comes out
"""

from __future__ import annotations

import json
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tests.conformance.comparison import (
    DDS,
    NEVER_COMPARED,
    ROS2,
    Section,
    one_by_one,
    pairs_of,
    random_pairs,
    section,
    single,
)
from tests.conformance.cyclone import Cyclone

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.conformance.comparison import Judgement, Pair, Settings
    from tests.conformance.cyclone import Answer

DOCUMENT: Final = Path(__file__).resolve().parents[2] / "docs" / "conformance.md"
RECORDED: Final = Path(__file__).with_name("recorded.json")
"""What came out of larger runs, which take minutes."""
PAIRS: Final = 1_000
SEED: Final = 1
SUBJECTS: Final = {"dds": DDS, "ros2": ROS2}
_LISTED: Final = 12

INTRODUCTION: Final = """# Conformance with Cyclone DDS

Written by `python -m tests.conformance.table` from what Eclipse Cyclone DDS {version} does when it is run, compared with
C-QoS {cqos}; the tests fail where this page or a pack differs from it.

A writer and a reader are created with the settings of each pair, on loopback, with a data type that is final. Compared
is whether each can be created, whether they match, and which policy Cyclone DDS names as the reason where they do not.
*Agree* is what the pack says of Cyclone DDS.
"""
OF_DDS: Final = """## The DDS pack

With `implementation: cyclonedds`. *Departures* are pairs on which Cyclone DDS and `implementation: standard` give different
verdicts.
"""
OF_ROS2: Final = """## The ROS 2 pack

With `rmw: cyclonedds`. The endpoints are created as rmw_cyclonedds creates those of a node with these settings.
"""
RANDOM: Final = """## Random pairs

Random pairs combine all of these values. The tests compare {pairs:,} of each pack with seed {seed};
`CQOS_CONFORMANCE_PAIRS=20000 CQOS_CONFORMANCE_SEED=7 pytest tests/conformance` compares more, or others. Larger runs are
recorded by `python -m tests.conformance.table 20000 2026`:
"""
HEADER: Final = ("policies", "pairs", "match", "not created", "agree")

RANDOM_PAIRS: Final = "random pairs"
THE_REST: Final = "policies that are never compared"
ALL_SECTIONS: Final = [
    *(("dds", name) for name in (*DDS.together, *DDS.alone, THE_REST, RANDOM_PAIRS)),
    *(("ros2", name) for name in (*ROS2.together, RANDOM_PAIRS)),
]


@cache
def seen(protocol: str, name: str) -> Section:
    """Return the pairs of one row of the table, all judged."""
    subject = SUBJECTS[protocol]
    if name == RANDOM_PAIRS:
        pairs = random_pairs(PAIRS, SEED, subject)
    elif name == THE_REST:
        pairs = one_by_one(NEVER_COMPARED, subject)
    elif name in subject.together:
        pairs = pairs_of(subject.together[name], subject)
    else:
        pairs = single(subject.alone[name], subject)
    return section(running(), pairs, subject)


@cache
def running() -> Cyclone:
    """Return Cyclone DDS, started once."""
    return Cyclone()


def figures(one: Section) -> dict[str, int]:
    """Count what came out of a section."""
    return {
        "pairs": len(one.pairs),
        "match": one.matching,
        "not created": one.not_created,
        "agree": len(one.pairs) - len(one.disagreements),
    }


def record(number: int, seed: int) -> None:
    """Compare random pairs of each pack, and write down what came out."""
    recorded = {}
    for protocol, subject in SUBJECTS.items():
        one = section(running(), random_pairs(number, seed, subject), subject)
        for text in one.disagreements[:_LISTED]:
            sys.stderr.write(f"{text}\n")
        recorded[protocol] = {
            "seed": seed,
            "Cyclone DDS": version("cyclonedds"),
            "C-QoS": version("cqos-core"),
            **figures(one),
        }
    RECORDED.write_text(json.dumps(recorded, indent=2) + "\n", encoding="utf-8")


def document() -> str:
    """Return the page."""
    of_dds = [(name, seen(protocol, name)) for protocol, name in ALL_SECTIONS if protocol == "dds"]
    of_ros2 = [(name, seen(protocol, name)) for protocol, name in ALL_SECTIONS if protocol == "ros2"]
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    larger = ("pairs", "seed", "Cyclone DDS", "C-QoS", "match", "not created", "agree")
    parts = [
        INTRODUCTION.format(version=version("cyclonedds"), cqos=version("cqos-core")),
        OF_DDS,
        _table((*HEADER, "departures"), [[name, *_counted(one), f"{len(_apart(one)):,}"] for name, one in of_dds]),
        OF_ROS2,
        _table(HEADER, [[name, *_counted(one)] for name, one in of_ros2]),
        RANDOM.format(pairs=PAIRS, seed=SEED),
        _table(
            ("pack", *larger),
            [
                [name, *(str(one[key]) if key == "seed" else _number(one[key]) for key in larger)]
                for name, one in recorded.items()
            ],
        ),
    ]
    for name, one in of_dds:
        apart = _apart(one)
        if apart and name != RANDOM_PAIRS:
            parts += [f"## Departures: {name}", _table(DEPARTURE_HEADER, apart[:_LISTED])]
            parts += [f"And {len(apart) - _LISTED:,} more."] if len(apart) > _LISTED else []
    return "\n".join(f"{part.rstrip()}\n" for part in parts)


def _counted(one: Section) -> list[str]:
    return [_number(number) for number in figures(one).values()]


def _number(value: int | str) -> str:
    return value if isinstance(value, str) else f"{value:,}"


DEPARTURE_HEADER: Final = ("offered", "requested", "standard", "Cyclone DDS")


def _apart(one: Section) -> list[list[str]]:
    """Return the pairs on which Cyclone DDS and the standard give different verdicts."""
    return [
        _departure(*each)
        for each in zip(one.pairs, one.standard or (), one.seen, strict=True)
        if (each[1].created, each[1].matched) != (each[2].created, each[2].matched)
    ]


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
    if sys.argv[1:]:
        record(*map(int, sys.argv[1:3]))
    DOCUMENT.write_text(document(), encoding="utf-8")
