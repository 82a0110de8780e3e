"""The page of public incidents, from their index in examples/incidents; generate.py writes it, and `dev.py tables` both."""

from __future__ import annotations

from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import yaml

if TYPE_CHECKING:
    from pathlib import Path

TITLES = {"ros2": "ROS 2", "dds": "DDS", "mqtt": "MQTT"}
FIXES = {
    "first": "our first fix",
    "second": "our second fix",
    "other": "another way",
    "none": "not known, or no repair of the design",
}
RESULTS = {"found": "found", "partly": "in part", "missed": "missed"}
INTRODUCTION = """# Public incidents

This page compares C-QoS with {total} public threads in which quality of service kept data away. The list was written, and committed, before
C-QoS read any of them. Each incident is rebuilt as files in our own words, in the folder `examples/incidents`. `python3 dev.py tables
incidents` checks them all and writes the answers into `incidents.yaml` and this page. These are of C-QoS {version}; a test holds them.

{summary}

**Found** means that an error or a warning names the cause. A defect of a program whose design is right counts as missed. Files state what a
thread says; where it does not name a value, the default stands. Where people expected something that no policy states, such as all earlier
samples, the rebuilt system states it as a requirement.

**The fix** compares what closed the thread with what C-QoS offers. Where reliability differs, C-QoS first offers the stronger publisher,
since the other fix asks for less. Most threads were closed the other way, by a best effort subscription, because the driver belonged
to others.

The threads were found by searches for incompatible QoS, lost messages and silent topics, so this is no random sample. The authors of C-QoS
rebuilt them.

To measure another tool, read `incidents.yaml`: `files` and `arguments` are the input, `happened` the cause to find.
"""


def incidents(path: Path) -> list[dict[str, Any]]:
    """Return the incidents of the index."""
    found: list[dict[str, Any]] = yaml.safe_load(path.read_text(encoding="utf-8"))["incidents"]
    return found


def incidents_page(found: list[dict[str, Any]]) -> str:
    """Return the page as Markdown."""
    parts = [INTRODUCTION.format(total=len(found), version=version("cqos-core"), summary=_summary(found)).rstrip()]
    for protocol, title in TITLES.items():
        mine = [each for each in found if each["protocol"] == protocol]
        lines = ["| incident | what happened | C-QoS | closed by |", "| --- | --- | --- | --- |"]
        parts += [f"## {title}", "\n".join([*lines, *map(_row, mine)])]
    return "\n\n".join([*parts, "## Misses", _misses(found)]) + "\n"


def _summary(found: list[dict[str, Any]]) -> str:
    lines = ["| | incidents | found | in part | missed |", "| --- | --- | --- | --- | --- |"]
    for protocol, title in (*TITLES.items(), ("", "all")):
        mine = [each["result"] for each in found if protocol in {"", each["protocol"]}]
        lines.append(f"| {title} | {len(mine)} | {' | '.join(str(mine.count(each)) for each in RESULTS)} |")
    later = [f"`{each['id']}`" for each in found if each.get("at_first")]
    lines.append(f"\nThe first run missed {len(later)} of the incidents that C-QoS now finds: {', '.join(later)}.")
    closed = [each["our_fix"] for each in found if each["result"] == "found"]
    counts = ", ".join(f"{closed.count(key)} by {text}" for key, text in list(FIXES.items())[:3])
    lines.append(f"The threads with a found incident were closed as follows: {counts}.")
    return "\n".join(lines)


def _row(each: dict[str, Any]) -> str:
    said = ", ".join(each["codes"]) or "nothing"
    fix = f" ({FIXES[each['our_fix']]})" if each["our_fix"] != "none" else ""
    closed = {None: "open", "unknown": "not known"}.get(each["closed_by"], each["closed_by"])
    return (
        f"| [{each['id']}]({each['thread']}) | {each['happened']} | {RESULTS[each['result']]}: {said} | {closed}{fix} |"
    )


def _misses(found: list[dict[str, Any]]) -> str:
    rows = [f"- `{each['id']}`: {each['why']}" for each in found if each["result"] != "found"]
    more = [f"- `{each['id']}`: {each['why']}" for each in found if each["result"] == "found" and "why" in each]
    return "\n".join([*rows, "", "What C-QoS finds, with a remark:", "", *more])
