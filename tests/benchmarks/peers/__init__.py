"""Other programs that do a part of the same work, run beside C-QoS."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cqos_core as cqos
from tests.benchmarks import inputs
from tests.benchmarks.library import Row, best, numbered

if TYPE_CHECKING:
    from collections.abc import Iterator

HERE: Final = Path(__file__).parent
PACKAGE: Final = "node-rules@9"
RANKS: Final = {
    "best_effort": 0,
    "reliable": 1,
    "volatile": 0,
    "transient_local": 1,
    "automatic": 0,
    "manual_by_topic": 1,
}


def node_rules(scale: float) -> Iterator[Row]:
    """Measure the paper's single rule on the rule engine that the paper's tool uses, beside `check_pair` for the same pairs."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if not npm or not node:
        return
    folder = HERE.parents[2] / "build" / "peers"
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "node_modules" / "node-rules").is_dir():
        subprocess.run(
            [npm, "install", "--no-save", "--ignore-scripts", "--silent", PACKAGE], cwd=folder, check=True, timeout=300
        )
    script = shutil.copy(HERE / "node_rules.mjs", folder)
    pairs = [*inputs.known_pairs(), *map(inputs.pair, range(1500))][: max(50, int(3000 * scale))]
    facts = {"pairs": [{"pub": numbered(o), "sub": numbered(r)} for o, r in pairs], "ranks": RANKS}
    done = subprocess.run(
        [node, script], cwd=folder, input=json.dumps(facts), capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)

    def ours() -> int:
        verdicts = (
            cqos.check_pair("ros2", offered=offered, requested=requested).verdict for offered, requested in pairs
        )
        return sum(verdict is cqos.Verdict.COMPATIBLE for verdict in verdicts)

    compatible = ours()
    if compatible != found["compatible"]:
        raise AssertionError(f"node-rules finds {found['compatible']} pairs compatible, check_pair {compatible}")
    (seconds,) = best(ours)
    theirs = found["microseconds"] / 1e6
    each = f"{seconds / len(pairs) * 1e6:,.1f} µs"
    yield Row(
        "`check_pair` of the same pairs, seen before",
        f"node-rules 9, the paper's rule ({theirs / len(pairs) * 1e6:,.1f} µs)",
        each,
        seconds / theirs,
        1,
    )
