"""A synthetic fleet, and what an audit of it costs beside bare group-bys of the same file.

    python -m tests.benchmarks.fleet write FILE.parquet [ENDPOINTS [SEED]]
    python -m tests.benchmarks.fleet measure FILE.parquet

Endpoints per topic and topics per family of settings follow power laws. On a tenth of the topics publishers offer best_effort, and subscribers
request reliable; on all others all pairs are compatible.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import duckdb

from cqos_bulk.fleet import WantedAudit, run_audit
from cqos_core.matching.pipeline import context

if TYPE_CHECKING:
    from collections.abc import Callable

FLEET = """
COPY (
    WITH drawn AS (
        SELECT i, floor({topics} * pow((hash(i, {seed}) % 1000000007) / 1000000007.0, 3.33))::BIGINT AS t FROM range({endpoints}) r(i)
    ), placed AS (
        SELECT i, t, floor(2000 * pow((hash(t, {seed}, 'family') % 1000003) / 1000003.0, 2))::BIGINT AS family,
            hash(t, {seed}, 'broken') % 1000 < {broken} AS broken, hash(i, {seed}, 'role') % 2 = 0 AS offers FROM drawn
    )
    SELECT 'e' || i AS id, CASE WHEN offers THEN 'publisher' ELSE 'subscriber' END AS role, 'ros2' AS protocol,
        'node_' || (i // 7) AS participant, '/area_' || ('a' || t % 997) || '/topic_t' || t AS topic,
        CASE WHEN broken AND offers THEN 'best_effort' WHEN broken OR offers THEN 'reliable' WHEN family % 3 = 0 THEN 'best_effort' ELSE '' END AS reliability,
        CASE WHEN family % 5 = 0 THEN 'volatile' ELSE '' END AS durability,
        'keep_last' AS history, CAST(1 + family % 50 AS VARCHAR) AS depth,
        CASE WHEN family % 2 = 0 THEN (10 + family) * (CASE WHEN offers THEN 1 ELSE 2 END) || 'ms' ELSE '' END AS deadline,
        CASE WHEN offers AND family % 7 = 0 THEN (100 + family) || 's' ELSE '' END AS lifespan,
        CASE WHEN family % 11 = 0 THEN 'automatic' ELSE '' END AS liveliness,
        CASE WHEN family % 11 = 0 THEN (1 + family) * (CASE WHEN offers THEN 1 ELSE 3 END) || 's' ELSE '' END AS liveliness_lease_duration
    FROM placed
) TO '{path}' (FORMAT parquet)
"""
POLICIES = "reliability, durability, history, depth, deadline, lifespan, liveliness, liveliness_lease_duration"


def write(path: Path, endpoints: int, seed: int = 19, broken: int = 100) -> None:
    """Write a fleet; ``broken`` of 1,000 topics are."""
    duckdb.sql(FLEET.format(path=path, endpoints=endpoints, topics=max(endpoints // 5, 1), seed=seed, broken=broken))


def cost(work: Callable[[], object]) -> tuple[float, float]:
    """Return the seconds of the processor and of the clock that some work takes."""
    before, begin = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    work()
    after = resource.getrusage(resource.RUSAGE_SELF)
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime), time.perf_counter() - begin


def measure(path: Path) -> None:
    """Print what an audit costs, and the bare group-bys, in seconds of the processor."""
    with tempfile.TemporaryDirectory() as folder:
        # Packs and engines are loaded before anything is measured.
        small = Path(folder, "small.parquet")
        write(small, 1_000)
        run_audit(WantedAudit(str(small)), context())
        fleet = duckdb.read_parquet(str(path))
        bare = {
            title: cost(lambda listed=listed: fleet.aggregate(f"{listed}, count(*)").count("*").fetchall())[0]  # type: ignore[misc]
            for title, listed in (
                ("topic", "topic"),
                ("all policies", POLICIES),
                ("topic and all policies", f"topic, role, {POLICIES}"),
            )
        }
        marks: list[tuple[str, float]] = []

        def step(what: str, _: int = 0) -> None:
            used = resource.getrusage(resource.RUSAGE_SELF)
            marks.append((what, used.ru_utime + used.ru_stime))

        step("texts")
        wanted = WantedAudit(str(path), output=Path(folder, "findings.parquet"), memory="3GB")
        result = []
        whole, clock = cost(lambda: result.append(run_audit(wanted, context(), step)))
        step("end")
    begin = dict(marks)
    candidates = begin["comparing names"] - begin["texts"]
    exact = begin["judging the rest"] - begin["counting pairs"]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    say = print
    say(", ".join(f"group by {title} {seconds:.2f} s" for title, seconds in bare.items()))
    say(f"candidates, from the file {candidates:.2f} s, {candidates / bare['topic']:.1f} x group by topic (goal 4)")
    say(f"exact counts of candidates {exact:.2f} s, {exact / bare['all policies']:.1f} x all policies (goal 6)")
    both = candidates + exact
    say(
        f"candidates and exact counts {both:.2f} s, {both / bare['topic and all policies']:.1f} x topic and all policies"
    )
    say(
        f"the whole {whole:.2f} s, {whole / bare['topic']:.1f} x group by topic; clock {clock:.1f} s, peak {peak:.2f} GiB"
    )
    for (what, start), (_, end) in pairwise(marks):
        say(f"  {what}: {end - start:.2f} s")
    for cause in result[0].causes:
        say(f"  {cause.code}: {cause.topics} topics, {cause.pairs} pairs")
    say(dict(result[0].totals))


if __name__ == "__main__":
    if sys.argv[1] == "write":
        write(Path(sys.argv[2]), *map(int, sys.argv[3:]))
    else:
        measure(Path(sys.argv[2]))
