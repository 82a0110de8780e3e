"""Pictures of systems and reports: the HTML page, graphs as DOT and Mermaid. This module only has the hooks."""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import ExporterInfo, FormatterInfo, hookimpl


@hookimpl
def register_exporters(register: Callable[[ExporterInfo], None]) -> None:
    """Register DOT and Mermaid."""
    where, graph = "cqos_pictures.graph_text", "the graph of the system with verdicts, for"
    register(ExporterInfo("dot", f"{graph} Graphviz", ".dot", f"{where}:write_dot"))
    register(ExporterInfo("mermaid", f"{graph} Mermaid in Markdown", ".mmd", f"{where}:write_mermaid"))


@hookimpl
def register_formatters(register: Callable[[FormatterInfo], None]) -> None:
    """Register the HTML page."""
    summary = "one HTML file with findings, graph, topics and guarantees"
    register(FormatterInfo("html", summary, "cqos_pictures.page:render_html", gives_way=True))
