"""All benchmarks in one run, as the table of docs/benchmarks.md: python3 dev.py bench [--scale S] [--only WORD …]

Every ratio is of processor time, of two works that are measured in turns in one run. Scale 1 is what the docs show.
"""

from __future__ import annotations

import argparse
import math
import platform
import subprocess
import sys
from datetime import datetime, timezone
from importlib.metadata import version
from typing import TYPE_CHECKING, Final

from tests.benchmarks import library, peers, serving

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tests.benchmarks.library import Row

GROUPS: Final[dict[str, Callable[[float], Iterator[Row]]]] = {
    "pairs": library.pairs,
    "node-rules": peers.node_rules,
    "files": library.files,
    "one-topic": library.one_topic,
    "edits": library.edits,
    "service": serving.service,
    "memory": library.memory,
    "processes": library.processes,
    "growth": library.growth,
}
HEAD: Final = "| measured | beside | cost | ratio | goal | |\n| -------- | ------ | ---- | ----- | ------ | - |"


def line(row: Row) -> str:
    """Write one row of the table."""
    ratio = f"{row.ratio:.0%}" if row.least else f"{row.ratio:,.2f}"
    target = f"≥ {row.target:.0%}" if row.least else f"≤ {row.target:g}"
    if row.target in {0, math.inf}:
        target = ""
    return f"| {row.what} | {row.beside} | {row.took} | {ratio} | {target} | {'' if row.met else 'not reached'} |"


def machine() -> str:
    """Say on what, with what and when."""
    names = ("grpcio", "lxml", "PyYAML")
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False).stdout
    versions = ", ".join(f"{name} {version(name)}" for name in names)
    return f"Commit {commit.strip()}, {datetime.now(tz=timezone.utc).date()}, Python {platform.python_version()}, {versions}, two shared cores."


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="what C-QoS costs, beside what bounds it")
    parser.add_argument("--scale", type=float, default=1.0, help="smaller is faster and tells less")
    parser.add_argument("--only", nargs="+", choices=GROUPS, default=list(GROUPS))
    given = parser.parse_args(arguments)
    print(f"{machine()}\n\n{HEAD}", flush=True)  # noqa: T201 - what it is for
    for name in given.only:
        for row in GROUPS[name](given.scale):
            print(line(row), flush=True)  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
