"""Measures the language server at a system file of 1,000 endpoints: ``python -m tests.benchmarks.editor [--endpoints 1000] [--rounds 30]``.

A client over standard input and output opens the file, types into it and asks after each change, as an editor does. Printed are the
median and the slowest answer of each request, in milliseconds; the first one of its kind stands apart.
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from plugins.editor.tests.client import Client

if TYPE_CHECKING:
    from collections.abc import Callable

RELIABILITY = ("reliable", "best_effort")


def design(endpoints: int, seed: int = 7) -> str:
    """Return a system of nodes with ten topics each, half of them subscribed."""
    draw = random.Random(seed)  # noqa: S311 - no secret
    lines = ["cqos: 1", "protocol: ros2", "profiles:", "  video: {reliability: best_effort, depth: 5}", "participants:"]
    for node in range(endpoints // 20):
        lines.append(f"  node_{node}:")
        for group in ("publishes", "subscribes"):
            lines.append(f"    {group}:")
            for topic in range(10):
                of = node if group == "publishes" else (node + 1) % (endpoints // 20)
                lines.append(f"      /node_{of}/topic_{topic}: {{reliability: {draw.choice(RELIABILITY)}, depth: 5}}")
    return "\n".join(lines) + "\n"


class Clock:
    """How long each kind of request took, in milliseconds."""

    def __init__(self) -> None:
        self.took: dict[str, list[float]] = {}

    def run(self, name: str, work: Callable[[], object]) -> None:
        """Do work and keep how long it took."""
        began = time.perf_counter()
        work()
        self.took.setdefault(name, []).append((time.perf_counter() - began) * 1000)

    def table(self) -> str:
        """Return a row for each kind: the first, then median and slowest of the others."""
        rows = ["| request | first, ms | median, ms | slowest, ms | of |", "| - | - | - | - | - |"]
        for name, (first, *others) in self.took.items():
            middle, worst = (statistics.median(others), max(others)) if others else (first, first)
            rows.append(f"| {name} | {first:.0f} | {middle:.0f} | {worst:.0f} | {len(others) + 1} |")
        return "\n".join(rows)


def measure(endpoints: int, rounds: int) -> Clock:
    """Type into a file of so many endpoints, and ask after each change."""
    clock, draw = Clock(), random.Random(1)  # noqa: S311 - no secret
    text = design(endpoints)
    with tempfile.TemporaryDirectory() as folder, Client() as editor:
        path = Path(folder) / "design.yaml"
        path.write_text(text, encoding="utf-8")
        clock.run("open, until findings", lambda: editor.open(path))
        lines = text.splitlines(keepends=True)
        stated = [number for number, line in enumerate(lines) if "reliability: " in line and "topic" in line]
        for _ in range(rounds):
            number = draw.choice(stated)
            line = lines[number]
            key, topic, setting = line.index("depth") + 1, line.index("/node") + 3, line.index("reliability: ")

            def ask(what: str, column: int, number: int = number) -> Callable[[], object]:
                return partial(editor.at, path, what, number, column)

            typed = [*lines[:number], f"{line[: key - 1]}d\n", *lines[number + 1 :]]
            document = {"uri": path.as_uri(), "version": next(editor.versions)}
            changes = [{"text": "".join(typed)}]
            editor.tell("textDocument/didChange", {"textDocument": document, "contentChanges": changes})
            clock.run("completion of a key while the check runs", ask("completion", key))
            clock.run("completion of a topic while the check runs", ask("completion", topic))
            changed = "".join([*lines[:number], line.replace("best_effort", "reliable"), *lines[number + 1 :]])
            clock.run("change, until findings", partial(editor.change, path, changed))
            clock.run("completion of a value", ask("completion", setting + len("reliability: ")))
            clock.run("hover", ask("hover", setting + 2))
    return clock


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--endpoints", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=30)
    options = parser.parse_args()
    sys.stdout.write(f"{measure(options.endpoints, options.rounds).table()}\n")


if __name__ == "__main__":
    main()
