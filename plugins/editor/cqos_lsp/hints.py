"""Inlay hints: values that an endpoint does not state itself, with their origins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from lsprotocol.types import InlayHint, MarkupContent, MarkupKind

from cqos_core.formatters import phrases
from cqos_lsp.hover import endpoint_page, fact_of, shown_policies
from cqos_lsp.place_index import end_of_line
from cqos_lsp.positions import lines_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_lsp.document_checks import Analysis
    from cqos_lsp.positions import Units

_MOST: Final = 4
"""More values than this are only in the tooltip."""


def hints(analysis: Analysis, source: str, first: int, last: int, units: Units, *, defaults: bool) -> list[InlayHint]:
    """Return the hints of endpoints on some one-based lines of a source; with ``defaults``, also default values."""
    lines = lines_of(analysis.sources[source])
    found = []
    for end in analysis.endpoints:
        place = end.endpoint.place
        if place is None or place.source != source or place.line is None or not first - 1 <= place.line <= last + 1:
            continue
        texts = [] if end.is_copy or end.bridge is not None else [*_values(end, defaults=defaults)]
        at = end_of_line(analysis, place) if texts else None
        if at is not None:
            more = f", … {len(texts) - _MOST} more" if len(texts) > _MOST else ""
            tooltip = MarkupContent(MarkupKind.Markdown, endpoint_page(end, analysis))
            label = ", ".join(texts[:_MOST]) + more
            found.append(InlayHint(units.position(lines, *at), label, tooltip=tooltip, padding_left=True))
    return found


def _values(end: Resolved, *, defaults: bool) -> Iterator[str]:
    """Yield the values that decide about matches and are stated elsewhere, then default values."""
    stated = {index for layer in end.layers if layer.here for index in layer.settings}
    elsewhere = {index for layer in end.layers if not layer.assumed for index in layer.settings}
    unstated = [index for index in shown_policies(end) if index not in stated]
    for index in sorted(unstated, key=lambda each: each not in elsewhere):
        if index in elsewhere or defaults:
            fact = fact_of(end, index)
            text = phrases.origin(fact) if index in elsewhere else ""
            yield f"{fact.policy} {fact.value}" + (f" ({text})" if text else "")
