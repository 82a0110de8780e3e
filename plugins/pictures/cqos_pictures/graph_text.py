"""``convert --to dot`` and ``--to mermaid``: the graph of a system with the verdicts of its pairs, as text for other programs."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.checking.checker import check_system
from cqos_core.formatters.terminal import clean
from cqos_core.matching.pipeline import CheckContext, Pipeline
from cqos_core.model.finding import Verdict
from cqos_core.packs.export import Exported
from cqos_pictures.graph import graph_of
from cqos_pictures.picture import ends_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cqos_core.model.system import System
    from cqos_core.packs.export import ExportContext
    from cqos_pictures.graph import DrawnGraph, Line

_COLORS: Final[Mapping[Verdict | None, str]] = {
    Verdict.COMPATIBLE: "#17704a",
    Verdict.INCOMPATIBLE: "#b3261e",
    Verdict.UNKNOWN: "#855100",
    None: "#5b6675",
}
_DOT_STYLES: Final = {Verdict.INCOMPATIBLE: " style=dashed penwidth=2", Verdict.UNKNOWN: " style=dotted"}
_DOT_SHAPES: Final = {"topic": "ellipse", "bridge": "box peripheries=2", "participant": "box"}
_MERMAID_SHAPES: Final = {"topic": ("([", "])"), "bridge": ("[[", "]]"), "participant": ("[", "]")}
_ARROWS: Final[Mapping[Verdict | None, str]] = {Verdict.INCOMPATIBLE: "==x", Verdict.UNKNOWN: "-.->"}
_SPECIAL: Final = re.compile(r"[^\w /.,:-]", re.ASCII)


def write_dot(system: System, context: ExportContext) -> Exported:
    """Return the graph of a system in the language of Graphviz."""
    return _exported(system, context, _dot)


def write_mermaid(system: System, context: ExportContext) -> Exported:
    """Return the graph of a system as a flowchart of Mermaid, which forges and wikis draw in Markdown."""
    return _exported(system, context, _mermaid)


def _exported(system: System, context: ExportContext, write: Callable[[DrawnGraph, str], Iterator[str]]) -> Exported:
    where = CheckContext(context.find_pack, default_protocol=context.default_protocol)
    picture = ends_of(Pipeline(system, where))
    graph = graph_of(check_system(system, where), picture)
    notes = tuple(f"{each}; those with the worst verdicts are" for each in graph.left_out)
    return Exported("\n".join(write(graph, system.name)) + "\n", len(picture.ends), notes)


def _dot(graph: DrawnGraph, name: str) -> Iterator[str]:
    names = {node.key: f"n{number}" for number, node in enumerate(graph.nodes)}
    yield f'digraph "{_quoted(name or "system")}" {{'
    yield "  rankdir=LR"
    yield '  node [fontname="sans-serif"]'
    for node in graph.nodes:
        label = _quoted(node.name) + (f"\\n{_quoted(node.detail)}" if node.detail else "")
        yield f'  {names[node.key]} [label="{label}" shape={_DOT_SHAPES[node.kind]} color="{_COLORS[node.verdict]}"]'
    for line in graph.lines:
        says = f' label="{_quoted(_about(line))}"' if _about(line) else ""
        style = (
            f'color="{_COLORS[line.verdict]}"{_DOT_STYLES.get(line.verdict, "")}' if line.verdict else "style=dotted"
        )
        yield f"  {names[line.source]} -> {names[line.target]} [{style}{says}]"
    yield "}"


def _quoted(text: str) -> str:
    return clean(text).replace("\\", "\\\\").replace('"', '\\"')


def _mermaid(graph: DrawnGraph, _name: str) -> Iterator[str]:
    names = {node.key: f"n{number}" for number, node in enumerate(graph.nodes)}
    yield "flowchart LR"
    for node in graph.nodes:
        before, behind = _MERMAID_SHAPES[node.kind]
        label = _entities(node.name) + (f"<br/>{_entities(node.detail)}" if node.detail else "")
        yield f'  {names[node.key]}{before}"{label}"{behind}:::{node.verdict or "unmatched"}'
    for line in graph.lines:
        says = f'|"{_entities(_about(line))}"|' if _about(line) else ""
        yield f"  {names[line.source]} {_ARROWS.get(line.verdict, '-->')}{says} {names[line.target]}"
    for verdict, color in _COLORS.items():
        yield f"  classDef {verdict or 'unmatched'} stroke:{color}"


def _entities(text: str) -> str:
    """Return text for Mermaid, with special characters as numbered entities."""
    return _SPECIAL.sub(lambda found: f"#{ord(found[0])};", clean(text))


def _about(line: Line) -> str:
    """Return the label of a line: its topics, unless they are nodes, and its verdict, unless it is compatible."""
    topics = "" if not line.topics else line.topics[0] if line.worst == 1 else f"{line.worst} topics"
    wrong = str(line.verdict) if line.verdict in {Verdict.INCOMPATIBLE, Verdict.UNKNOWN} else ""
    return f"{topics}: {wrong}" if topics and wrong else topics or wrong
