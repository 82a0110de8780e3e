"""Makes the tables of the paper and of the public incidents again.

python -m tests.paper_tables              both
python -m tests.paper_tables paper        docs/paper.md: outputs of its commands and prompts, and its figures
python -m tests.paper_tables incidents    check every incident; write the index examples/incidents/incidents.yaml and docs/incidents.md
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

import yaml

from tests import command_process
from tests.test_docs import rewrite

ROOT: Final = Path(__file__).parents[1]
INCIDENTS: Final = ROOT / "examples" / "incidents"
INDEX: Final = INCIDENTS / "incidents.yaml"
GENERATE: Final = ROOT / "docs" / "generate.py"
_ANSWER: Final = re.compile(r"^  verdict: .*\n  codes: .*\n", re.MULTILINE)


def answer(incident: dict[str, Any]) -> tuple[str, list[str]]:
    """Check the files of an incident; return the verdict, and the codes of errors and warnings."""
    options = [*incident.get("arguments", []), "--together", "--no-config", "--format", "json"]
    done = command_process.run_here(["check", *incident["files"], *options], INCIDENTS / incident["id"])
    report = json.loads(done.out)
    return report["verdict"], sorted({each["code"] for each in report["findings"] if each["severity"] != "note"})


def index(text: str) -> str:
    """Return the index of incidents with what C-QoS says of each now; the rest is written by people."""
    head, *entries = re.split(r"^(?=- id: )", text, flags=re.MULTILINE)
    for number, entry in enumerate(entries):
        (incident,) = yaml.safe_load(entry)
        verdict, codes = answer(incident)
        made = f"  verdict: {verdict}\n  codes: [{', '.join(codes)}]\n"
        assert _ANSWER.search(entry), incident["id"]
        entries[number] = _ANSWER.sub(lambda _, made=made: made, entry)
        if entries[number] != entry:
            sys.stderr.write(f"{incident['id']} has another answer: read its `result` and `our_fix` again\n")
    return head + "".join(entries)


def write_incidents() -> None:
    """Write index and page of the incidents."""
    INDEX.write_text(index(INDEX.read_text(encoding="utf-8")), encoding="utf-8")
    subprocess.run([sys.executable, str(GENERATE), "--kept"], check=True)


def write_paper() -> None:
    """Write the outputs and the figures of the page about the paper."""
    rewrite("docs/paper.md")
    subprocess.run([sys.executable, str(GENERATE), "--kept"], check=True)


MAKERS: Final = {"paper": write_paper, "incidents": write_incidents}


if __name__ == "__main__":
    unknown = [name for name in sys.argv[1:] if name not in MAKERS]
    if unknown:
        sys.exit(f"there is no table {unknown[0]!r}; there are {', '.join(MAKERS)}")
    for name in sys.argv[1:] or MAKERS:
        MAKERS[name]()
