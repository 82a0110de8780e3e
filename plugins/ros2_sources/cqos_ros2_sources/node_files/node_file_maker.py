"""``cqos learn`` as functions: from a workspace to node files, each as text, and to what is not known."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import yaml

from cqos_core.model.source import Source
from cqos_ros2_sources.node_files.learned_cache import keep, kept, key_of
from cqos_ros2_sources.node_files.node_entries import DIRECTIONS, facts
from cqos_ros2_sources.programs.packages import Parsed, read_package
from cqos_ros2_sources.walk.call_tables import tables
from cqos_ros2_sources.walk.package_walk import explore
from cqos_ros2_workspace.nodes.reading import read_node_file

if TYPE_CHECKING:
    from cqos_ros2_sources.walk.call_tables import Table
    from cqos_ros2_workspace.launch.workspace import Workspace

HEAD: Final = "# `cqos learn` wrote this file from the sources, and `cqos learn --diff` compares it with them.\n# It leaves `corrections` and entries with `confirmed: true` as they are.\n"


@dataclass(frozen=True, slots=True)
class Learned:
    """What was learned of a package.

    Attributes:
        document: the node file as data.
        text: the node file.
        gaps: what belongs to no node: what, cause, where.
        files: the sources that it names.
    """

    package: str
    document: dict[str, Any]
    text: str
    gaps: list[tuple[str, str, str]] = field(default_factory=list)
    files: tuple[str, ...] = ()

    @property
    def empty(self) -> bool:
        """Whether no node was found."""
        return not self.document.get("nodes") and not self.document.get("fragments")


def learn(
    package: str,
    workspace: Workspace,
    calls: tuple[str, ...] = (),
    before: dict[str, Any] | None = None,
    parsed: Parsed | None = None,
) -> Learned:
    """Return what the sources of a package say about its nodes.

    Args:
        package: its name.
        workspace: with its sources, and with those of packages that it depends on.
        calls: paths of further tables of calls.
        before: the node file that there is; what a person confirmed or corrected in it stays.
        parsed: sources that were parsed for other packages.

    Raises:
        InputError: a table of calls cannot be read.
        NoParserError: it has sources in C++, and the parser of C++ is not installed.
    """
    folder = workspace.packages[package]
    parsed = Parsed() if parsed is None else parsed
    key = key_of(package, workspace, calls, parsed)
    found = kept(package, folder, key)
    if found is None:
        found = _learn(package, workspace, tables(calls), parsed)
        keep(package, folder, key, found)
    document = found["document"] if before is None else with_confirmed(found["document"], before)
    text = found["text"] if before is None else written(document)
    files = tuple(path for path in found["files"] if f"{os.path.relpath(path, folder)}:" in text)
    return Learned(package, document, text, [(what, cause, at) for what, cause, at in found["gaps"]], files)


def _learn(package: str, workspace: Workspace, known: dict[str, Table], parsed: Parsed) -> dict[str, Any]:
    read = read_package(package, workspace, known, parsed)
    found = facts(read, explore(read, known))
    plain = json.loads(json.dumps(found.document))
    return {"document": plain, "text": written(plain), "gaps": found.gaps, "files": sorted(read.own)}


def written(document: dict[str, Any], head: str = HEAD) -> str:
    """Return a node file as text, apart from corrections; it is read back, so that no file is written that C-QoS refuses."""
    text = head + yaml.dump(document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=160)
    if document.get("nodes") or document.get("fragments"):
        read_node_file(Source("learned.node.yaml", text.encode()))
    return text


class _Dumper(yaml.SafeDumper):
    """Writes short maps on one line, and nothing by reference."""

    def ignore_aliases(self, data: Any) -> bool:
        """Write every value out."""
        del data
        return True

    def represent_mapping(self, tag: str, mapping: Any, flow_style: bool | None = None) -> Any:  # noqa: FBT001 - as PyYAML has it
        """Write a map without maps and lists in it on one line."""
        flat = {"at", "default", "what", "profile", "by", "when", "node"} & set(mapping) and "publishes" not in mapping
        return super().represent_mapping(tag, mapping, flow_style=bool(flat) or flow_style)


def with_confirmed(document: dict[str, Any], kept: dict[str, Any]) -> dict[str, Any]:
    """Return a learned node file in which the confirmed entries of another one stand as they are."""
    for part in ("nodes", "fragments"):
        for name, facts_of in (kept.get(part) or {}).items():
            for direction in DIRECTIONS:
                for topic, entry in ((facts_of or {}).get(direction) or {}).items():
                    confirmed = any(
                        isinstance(each, dict) and each.get("confirmed")
                        for each in (entry if isinstance(entry, list) else [entry])
                    )
                    if confirmed:
                        entries = document.setdefault(part, {}).setdefault(name, {}).setdefault(direction, {})
                        _drop_unknown(entries, entry)
                        entries[topic] = entry
    for key in ("versions", "profiles"):
        if key in kept:
            document[key] = kept[key]
    return document


def _drop_unknown(entries: dict[str, Any], entry: Any) -> None:
    """Drop the one endpoint without a name that a person has named: of the same type, in the same file."""
    named = entry if isinstance(entry, dict) else {}
    file = str(named.get("at", "")).partition(":")[0]
    alike = [
        key
        for key, each in entries.items()
        if isinstance(each, dict)
        and "unknown" in each
        and each.get("type") == named.get("type")
        and str(each.get("at", "")).partition(":")[0] == file
    ]
    if file and len(alike) == 1:
        del entries[alike[0]]


class Counts(NamedTuple):
    """How much of a node file is known."""

    nodes: int
    endpoints: int
    names: int
    qualities: int


def counts(document: dict[str, Any]) -> Counts:
    """Return how many nodes, fragments and endpoints a node file has, and of how many endpoints it knows names and policies."""
    parts = [*(document.get("nodes") or {}).values(), *(document.get("fragments") or {}).values()]
    entries = [
        each
        for part in parts
        for direction in DIRECTIONS
        for found in (part.get(direction) or {}).values()
        for each in (found if isinstance(found, list) else [found])
    ]
    names = sum("unknown" not in each for each in entries)
    qualities = sum(
        "unknown" not in str(each.get("qos", "")) and "unread" not in str(each.get("qos", "")) for each in entries
    )
    return Counts(len(parts), len(entries), names, qualities)
