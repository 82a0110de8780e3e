"""A synthetic fleet, and what an audit of it costs beside bare group-bys of the same file.

    python -m tests.benchmarks.fleet write FILE.parquet [ENDPOINTS [SEED]]
    python -m tests.benchmarks.fleet broker FILE.parquet [CLIENTS [SEED [FAULTS]]]
    python -m tests.benchmarks.fleet measure FILE.parquet
    python -m tests.benchmarks.fleet audit FILE.parquet

Endpoints per topic and topics per family of settings follow power laws. On a tenth of the topics publishers offer best_effort, and subscribers
request reliable; on all others all pairs are compatible.

The second form is the client list of a broker. A device publishes its telemetry and its retained state, has a Will there, and subscribes to
its commands. Services publish to all commands; some subscribe with wildcards, a group of them shared. Of 1,000 devices 50 have a fault:
the id of another, an unretained Will, a command topic with a typing error, or a telemetry whose topic ends with a slash.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import duckdb

from cqos_core.api import context
from cqos_fleet.fleet import WantedAudit, run_audit

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_fleet.fleet_report import FleetResult

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
BROKER = """
COPY (
    WITH devices AS (
        SELECT i, 'devices/' || i || '/' AS own, hash(i, {seed}) % 1000 < {faults} AS broken, hash(i, {seed}, 'fault') % 4 AS fault,
            hash(i, {seed}, 'model') % 40 AS model FROM range({clients}) r(i)
    ), clients AS (
        SELECT *, CASE WHEN broken AND fault = 0 THEN 'device-' || (i // 2 * 2) ELSE 'device-' || i END AS client_id,
            own || 'state' AS "will.topic", NOT (broken AND fault = 1) AS retained,
            CASE WHEN model % 4 = 0 THEN '3.1.1' ELSE '5.0' END AS protocol_version,
            CASE WHEN model % 4 = 0 THEN '' ELSE (60 * (1 + model % 5)) || 's' END AS session_expiry_interval,
            CASE WHEN model % 4 = 0 THEN 'false' ELSE '' END AS clean_start, (30 + model % 3 * 30) || 's' AS keep_alive FROM devices
    ), ends AS (
        SELECT i, 0 AS part, 'publisher' AS role, own || CASE WHEN broken AND fault = 3 THEN 'telemetry/' ELSE 'telemetry' END AS topic,
            CAST(model % 2 AS VARCHAR) AS qos, '' AS retain FROM clients
        UNION ALL SELECT i, 1, 'publisher', own || 'state', '1', 'true' FROM clients
        UNION ALL SELECT i, 2, 'subscriber', own || CASE WHEN broken AND fault = 2 THEN 'comands' ELSE 'commands' END, '1', '' FROM clients
    )
    SELECT role, 'mqtt' AS protocol, 'd' || i AS participant, topic, qos, retain, client_id, 'user-' || i AS username, "will.topic", '1' AS "will.qos",
        CAST(retained AS VARCHAR) AS "will.retain", protocol_version, session_expiry_interval, clean_start, keep_alive FROM ends JOIN clients USING (i)
    UNION ALL SELECT 'publisher', 'mqtt', 'commander_' || i % 20, own || 'commands', '1', '', 'commander-' || i % 20, 'services', '', '', '',
        '5.0', '3600s', '', '60s' FROM devices
    UNION ALL SELECT 'subscriber', 'mqtt', 'service_' || i, topic, '1', '', 'service-' || i, 'services', '', '', '', '5.0', '3600s', '', '60s'
        FROM range(20) r(i), (VALUES ('$share/ingest/devices/+/telemetry'), ('devices/+/state')) t(topic)
    UNION ALL SELECT 'subscriber', 'mqtt', 'monitor', '#', '0', '', 'monitor', 'services', '', '', '', '5.0', '', '', '60s'
) TO '{path}' (FORMAT parquet)
"""
POLICIES = "reliability, durability, history, depth, deadline, lifespan, liveliness, liveliness_lease_duration"


def write(path: Path, endpoints: int, seed: int = 19, broken: int = 100) -> None:
    """Write a fleet; ``broken`` of 1,000 topics are."""
    duckdb.sql(FLEET.format(path=path, endpoints=endpoints, topics=max(endpoints // 5, 1), seed=seed, broken=broken))


def write_broker(path: Path, clients: int, seed: int = 19, faults: int = 50) -> None:
    """Write the client list of a broker; ``faults`` of 1,000 devices have one."""
    duckdb.sql(BROKER.format(path=path, clients=clients, seed=seed, faults=faults))


def cost(work: Callable[[], object]) -> tuple[float, float]:
    """Return the seconds of the processor and of the clock that some work takes."""
    before, begin = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
    work()
    after = resource.getrusage(resource.RUSAGE_SELF)
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime), time.perf_counter() - begin


class Audit(NamedTuple):
    """What an audit cost: seconds of the processor by stage, those of the whole and of the clock, and what it found."""

    stages: dict[str, float]
    whole: float
    clock: float
    result: FleetResult


def audited(path: Path) -> Audit:
    """Audit a table; packs and engines are loaded before that."""
    with tempfile.TemporaryDirectory() as folder:
        small, marks, found = Path(folder, "small.parquet"), list[tuple[str, float]](), []
        write(small, 1_000)
        run_audit(WantedAudit(str(small)), context())

        def step(what: str, _: int = 0) -> None:
            used = resource.getrusage(resource.RUSAGE_SELF)
            marks.append((what, used.ru_utime + used.ru_stime))

        step("texts")
        wanted = WantedAudit(str(path), output=Path(folder, "findings.parquet"), memory="3GB")
        whole, clock = cost(lambda: found.append(run_audit(wanted, context(), step)))
        step("end")
    return Audit({what: end - start for (what, start), (_, end) in pairwise(marks)}, whole, clock, found[0])


def measure(path: Path) -> None:
    """Print what an audit of topics in columns costs, and the bare group-bys, in seconds of the processor."""
    fleet = duckdb.read_parquet(str(path))
    bare = {
        title: cost(lambda listed=listed: fleet.aggregate(f"{listed}, count(*)").count("*").fetchall())[0]  # type: ignore[misc]
        for title, listed in (
            ("topic", "topic"),
            ("all policies", POLICIES),
            ("topic and all policies", f"topic, role, {POLICIES}"),
        )
    }
    done = audited(path)
    candidates = done.stages["texts"] + done.stages["reading profiles"] + done.stages["finding candidates"]
    exact = done.stages["counting pairs"]
    say = print
    say(", ".join(f"group by {title} {seconds:.2f} s" for title, seconds in bare.items()))
    say(f"candidates, from the file {candidates:.2f} s, {candidates / bare['topic']:.1f} x group by topic (goal 4)")
    say(f"exact counts of candidates {exact:.2f} s, {exact / bare['all policies']:.1f} x all policies (goal 6)")
    both = candidates + exact
    say(
        f"candidates and exact counts {both:.2f} s, {both / bare['topic and all policies']:.1f} x topic and all policies"
    )
    say(f"the whole {done.whole / bare['topic']:.1f} x group by topic")
    show(done)


def show(done: Audit) -> None:
    """Print what an audit cost, and what it found."""
    say, peak = print, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    say(f"the whole {done.whole:.2f} s; clock {done.clock:.1f} s, peak {peak:.2f} GiB")
    for what, seconds in done.stages.items():
        say(f"  {what}: {seconds:.2f} s")
    for cause in done.result.causes:
        say(f"  {cause.code}: {cause.topics} topics, {cause.pairs} pairs, {cause.endpoints} endpoints")
    say(dict(done.result.totals))


if __name__ == "__main__":
    command, file, *numbers = sys.argv[1], Path(sys.argv[2]), *map(int, sys.argv[3:])
    if command in {"write", "broker"}:
        (write if command == "write" else write_broker)(file, *numbers)
    elif command == "audit":
        show(audited(file))
    else:
        measure(file)
