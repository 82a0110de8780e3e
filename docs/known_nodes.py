"""The page of node files that come with C-QoS: what each was read from, and how far it goes. docs/generate.py writes it."""  # noqa: INP001 - a script

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import yaml

from cqos_ros2_workspace.nodes.form import DIRECTIONS
from cqos_ros2_workspace.nodes.library import SHIPPED

if TYPE_CHECKING:
    from collections.abc import Iterator

HEAD = """# Node files that come with C-QoS

People wrote these files from the sources of the stated versions, entry by entry; none is the output of `cqos learn`. Use this list to audit them.
`by` says how the facts came about. `with a line` counts endpoints whose `at:` names the line of the source, not only its file. `by distribution`
counts entries that hold for one distribution only, and `left open` what the file states as not known.
[Node files](node-files.md) explains the form.

| package | source | versions | by | nodes and fragments | endpoints | with a line | by distribution | left open |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
"""


def known_nodes_page() -> str:
    """Return the page."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it was built
    rows = [row(yaml.load(path.read_bytes(), loader)) for path in sorted(SHIPPED.glob("*.node.yaml"))]  # noqa: S506
    total = [sum(int(each[column]) for each in rows) for column in range(4, 9)]
    rows.append((f"{len(rows)} packages", "", "", "", *map(str, total)))
    return HEAD + "".join(f"| {' | '.join(each)} |\n" for each in rows)


def row(document: dict[str, Any]) -> tuple[str, ...]:
    """Return the cells of one file."""
    parts = [*(document.get("nodes") or {}).values(), *(document.get("fragments") or {}).values()]
    ends = [each for part in parts if part for each in endpoints(part)]
    lines = sum(re.search(r":\d+$", str(each.get("at", ""))) is not None for each in ends)
    left = sum(len(part.get("unread") or ()) for part in parts if part)
    versions = ", ".join(f"{distro} {version}" for distro, version in (document.get("versions") or {}).items())
    source = document["from"]
    counts = (len(parts), len(ends), lines, sum("distro" in (each.get("when") or {}) for each in ends), left)
    return (document["package"], source["repository"], versions or "any", source["by"], *map(str, counts))


def endpoints(part: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the endpoints of a node or fragment."""
    for direction in DIRECTIONS:
        for entry in (part.get(direction) or {}).values():
            yield from entry if isinstance(entry, list) else [entry]
