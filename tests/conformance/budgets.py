"""Writes docs/conformance-budgets.md: traffic and memory as computed, and as measured on Cyclone DDS and Fast DDS on loopback.

python -m tests.conformance.budgets    measure all cases, and write the page
"""

from __future__ import annotations

import atexit
import shutil
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from itertools import product
from pathlib import Path
from tempfile import mkdtemp
from typing import Final, NamedTuple

from cqos_core.api import context, read
from cqos_core.behaviour.paths.budgets import budgets_of_system
from cqos_core.matching.pipeline import Pipeline
from cqos_live.dds.prove.fast import PROVER, compile_program
from tests.conformance.origin import build_of, origin

ROOT: Final = Path(__file__).resolve().parents[2]
DOCUMENT: Final = ROOT / "docs" / "conformance-budgets.md"
LOOPBACK: Final = 65_536
ALLOWED: Final = 0.1
KINDS: Final = ("best_effort", "reliable")
SIZES: Final = (500, 8_000, 28_000, 60_000)
DESIGN: Final = """
cqos: 1
protocol: dds
options: {{dds: {{implementation: {product}}}}}
topics: {{budget: {{period: 20ms, size: {size}, keyed: false}}}}
participants:
  a: {{publishes: {{budget: {{reliability: {reliability}, depth: {depth}}}}}}}
  b: {{subscribes: {{budget: {{reliability: {reliability}}}}}}}
"""
_NAMESPACES: Final = (("unshare", "--net"), ("unshare", "--map-root-user", "--net"))
"""Of root, which works in a chroot too, and of any other user."""
_SCRIPT: Final = """
ip link set lo up mtu {mtu} multicast on && ip route add 239.0.0.0/8 dev lo || exit 9
{reader} & {writer}
wait
"""


CYCLONE: Final = "cyclonedds"
FAST: Final = "fastdds_2_9"


class Case(NamedTuple):
    """One run: ``history`` measures what a writer keeps, the others what a sample takes on the wire."""

    kind: str
    size: int
    mtu: int = LOOPBACK
    samples: int = 100
    product: str = CYCLONE


CASES: Final = (
    *(Case(kind, size, mtu) for kind, size, mtu in product(KINDS, SIZES, (LOOPBACK, 1_500))),
    Case("history", 100_000, samples=400),
    Case("history", 20_000, samples=2_000),
    *(Case(kind, size, mtu, 100, FAST) for kind, size, mtu in product(KINDS, (*SIZES, 150_000), (LOOPBACK, 1_500))),
)
FEW: Final = (Case("reliable", 8_000, samples=40), Case("best_effort", 60_000, 1_500, 40))


def missing() -> str | None:
    """Say what is needed to measure, where it is not there."""
    if shutil.which("unshare") is None or shutil.which("ip") is None:
        return "unshare and ip (util-linux, iproute2) are needed"
    return None if namespace() else "this user may not make a network namespace"


@cache
def namespace() -> tuple[str, ...]:
    """Return the command that runs another in a network of its own; empty where no command may."""
    for command in _NAMESPACES:
        tried = subprocess.run([*command, "ip", "link", "set", "lo", "up"], capture_output=True, check=False)
        if tried.returncode == 0:
            return command
    return ()


@cache
def fast_program() -> str:
    """Compile the program for Fast DDS, and return where it is."""
    made = Path(mkdtemp()) / "budget_run"
    atexit.register(shutil.rmtree, made.parent)
    compile_program(Path(__file__).with_name("budget_run.cpp").read_bytes(), made)
    return str(made)


def computed(case: Case) -> float:
    """Return what C-QoS computes: bytes of a sample on the wire, or in the history of the writer."""
    reliability = "best_effort" if case.kind == "best_effort" else "reliable"
    text = DESIGN.format(product=case.product, size=case.size, reliability=reliability, depth=case.samples)
    found = budgets_of_system(Pipeline(read(text.encode()), context()))
    if case.kind == "history":
        return (found.histories[0].size or 0) / case.samples
    (stream,) = found.streams
    return (stream.bytes_of_sample(case.mtu) or 0) + stream.answers * len(stream.answering) / stream.per_second


def measured(case: Case) -> float:
    """Return what was measured, in the same unit."""

    def end(role: str) -> str:
        program = fast_program() if case.product == FAST else f"{sys.executable} -m tests.conformance.budget_run"
        return f"{program} {role} {case.kind} {case.size} {case.samples}"

    script = _SCRIPT.format(mtu=case.mtu, reader="true" if case.kind == "history" else end("read"), writer=end("write"))
    command = [*namespace(), "sh", "-c", script]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=90)
    wire, memory = map(float, done.stdout.split())
    return memory if case.kind == "history" else wire


def row(case: Case) -> str:
    """Return the row of the page for one case."""
    expected, found = computed(case), measured(case)
    name = {CYCLONE: "Cyclone DDS", FAST: "Fast DDS"}[case.product]
    return f"| {name} | {case.kind} | {case.size:,} | {case.mtu:,} | {expected:,.0f} | {found:,.0f} | {found / expected - 1:+.1%} |"


def main() -> int:
    """Measure all cases and write the page."""
    lacking = missing() or PROVER.missing()
    if lacking is None and PROVER.implementation() != FAST:
        lacking = f"the pack computes them for {FAST}, and Fast DDS {PROVER.version()} is installed"
    if lacking is not None:
        sys.stderr.write(f"budgets are not measured: {lacking}\n")
        return 0
    made = origin()
    rows = [row(case) for case in CASES]
    DOCUMENT.write_text(
        f"""# Conformance of budgets

Written by `python -m tests.conformance.budgets` from runs on Cyclone DDS {version("cyclonedds")} and Fast DDS {PROVER.version()}: one writer and one
reader on the loopback interface of a network namespace of their own. The bytes are those of IP packets for each sample, as the kernel counts
them, with what the reader sends back. `history` is the memory of a writer that keeps its last samples, divided by their number. [Time and budgets](time-and-budgets.md) says how C-QoS
computes the figures.

Measured on {made["date"]}, {build_of(made)}. Nothing in these runs is random, so they have no seed.

| implementation | kind | size of a sample | MTU | computed | measured | difference |
| -------------- | ---- | ---------------- | --- | -------- | -------- | ---------- |
"""
        + "\n".join(rows)
        + "\n",
        encoding="utf-8",
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
