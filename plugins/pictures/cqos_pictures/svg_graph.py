"""The graph of a system as data for SVG: boxes, curves and arrowheads in pixels."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, Final

from cqos_core.formatters.terminal import cells, clean
from cqos_pictures.layout import layered
from cqos_pictures.page_text import WORDS, counted, symbol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_pictures.graph import DrawnGraph, DrawnNode, Key, Line

_LETTER: Final = 7.0
_SMALL: Final = 5.9
_WIDEST: Final = 26  # letters of a name in a box
_HEIGHT: Final = {"participant": 38.0, "bridge": 38.0, "topic": 26.0}
_ROOM: Final = {"participant": 54.0, "bridge": 54.0, "topic": 42.0}
_TOUCHED: Final = 40.0  # a finger needs so much
_GAP: Final = 84.0
_NARROW: Final = 52.0  # between columns, if there are many
_MANY: Final = 8
_SCREEN: Final = 1210.0
_SMALLEST: Final = 0.8
_BACK: Final = 8.0  # a line against the direction, so that it is beside the one that goes with it
_MARGIN: Final = 8.0
_TOP: Final = 12.0
_LABELLED: Final = 30  # more lines than this have labels only where something is wrong


def svg_graph(graph: DrawnGraph, targets: Mapping[Key, str]) -> dict[str, Any]:
    """Return the drawing of a graph; ``targets`` has the anchors that nodes link to."""
    numbers = {node.key: number for number, node in enumerate(graph.nodes)}
    edges = {(numbers[line.source], numbers[line.target]): line for line in graph.lines}
    layout = layered([_ROOM[node.kind] for node in graph.nodes], edges)
    widths = [_width(node) for node in graph.nodes]
    columns = [
        max((width for width, layer in zip(widths, layout.layers, strict=True) if layer == column), default=0.0)
        for column in range(max(layout.layers, default=-1) + 1)
    ]
    gap = _GAP if len(columns) <= _MANY else _NARROW
    named = len(edges) <= _LABELLED
    gaps = [gap] * len(columns)
    for (source, target), line in edges.items():  # a label beside two nodes covers neither
        one, other = sorted((layout.layers[source], layout.layers[target]))
        if other - one == 1:
            gaps[one] = max(gaps[one], cells(_label(line, named=named)) * _SMALL + 20)
    lefts = [_MARGIN + sum(columns[:column]) + sum(gaps[:column]) for column in range(len(columns))]
    spots = [
        (lefts[layer] + (columns[layer] - width) / 2, height + _TOP)
        for width, layer, height in zip(widths, layout.layers, layout.heights, strict=True)
    ]
    curves = []
    for (source, target), line in edges.items():
        if source == target:
            continue
        step = 1 if layout.layers[target] >= layout.layers[source] else -1
        between = range(layout.layers[source] + step, layout.layers[target], step)
        points = [
            (lefts[column] + columns[column] / 2, height + _TOP)
            for column, height in zip(between, layout.bends[source, target], strict=False)
        ]
        beside = 0 if step > 0 else _BACK
        (x, y), (end_x, end_y) = spots[source], spots[target]
        start, end = (x + widths[source] if step > 0 else x), (end_x - 5 if step > 0 else end_x + widths[target] + 5)
        curves.append(
            _curve(line, [(start, y + beside), *points, (end, end_y + beside)], (source, target), named=named)
        )
    boxes = [_box(node, number, spots[number], widths[number], targets) for number, node in enumerate(graph.nodes)]
    heights = (*layout.heights, *(height for bends in layout.bends.values() for height in bends))
    width = max((left + width for left, width in zip(lefts, columns, strict=True)), default=0.0) + _MARGIN
    height = max(heights, default=0.0) + max(_ROOM.values()) / 2 + 2 * _TOP
    scale = min(1.0, max(_SMALLEST, _SCREEN / width))
    return {
        "width": _px(width),
        "height": _px(height),
        "shown_width": _px(width * scale),
        "shown_height": _px(height * scale),
        # Lines that matter are drawn last, so that they are on top.
        "lines": sorted(curves, key=lambda each: (each["rank"], each["path"])),
        "nodes": boxes,
        "many": not named,
    }


def _px(value: float) -> str:
    return f"{value:.0f}"


def short(text: str, letters: int = _WIDEST) -> str:
    """Return a name that fits, with its middle left out where it is too long."""
    text = clean(text)
    if cells(text) <= letters:
        return text
    half = (letters - 1) // 2
    return f"{text[:half]}…{text[-half:]}"


def _width(node: DrawnNode) -> float:
    return max(cells(short(node.name)) * _LETTER, cells(short(node.detail, 32)) * _SMALL, 30) + 38


def _box(
    node: DrawnNode, number: int, spot: tuple[float, float], width: float, targets: Mapping[Key, str]
) -> dict[str, Any]:
    x, y = spot
    height = _HEIGHT[node.kind]
    detail = short(node.detail, 32)
    return {
        "number": number,
        "kind": node.kind,
        "verdict": WORDS[node.verdict],
        "target": targets.get(node.key, ""),
        "x": _px(x),
        "y": _px(y - height / 2),
        "touch_y": _px(y - _TOUCHED / 2),
        "touched": _px(_TOUCHED),
        "width": _px(width),
        "height": _px(height),
        "round": "13" if node.kind == "topic" else "5",
        "inner_x": _px(x + 3),
        "inner_y": _px(y - 16),
        "inner_width": _px(width - 6) if node.kind == "bridge" else "",
        "text_x": _px(x + 24),
        "mark_x": _px(x + 12),
        "text_y": _px(y - 3 if detail else y + 4),
        "detail_y": _px(y + 12),
        "mark_y": _px(y + 4),
        "label": short(node.name),
        "detail": detail,
        "mark": symbol(node.verdict),
        "title": f"{node.kind} {node.name}: {WORDS[node.verdict]}",
    }


def _curve(line: Line, points: Sequence[tuple[float, float]], ends: tuple[int, int], *, named: bool) -> dict[str, Any]:
    path = f"M{points[0][0]:.0f} {points[0][1]:.0f}"
    for (x, y), (to_x, to_y) in itertools.pairwise(points):
        half = (x + to_x) / 2
        path += f"C{half:.0f} {y:.0f} {half:.0f} {to_y:.0f} {to_x:.0f} {to_y:.0f}"
    middle = len(points) // 2
    (x, y), (to_x, to_y) = points[middle - 1], points[middle]
    return {
        "path": path,
        "verdict": WORDS[line.verdict],
        "rank": -1 if line.verdict is None else line.verdict.rank,
        "source": ends[0],
        "target": ends[1],
        "title": f"{line.source[1]} → {line.target[1]}: {WORDS[line.verdict]}"
        + (f", on {', '.join(line.topics[:10])}{' …' if len(line.topics) > 10 else ''}" if line.topics else ""),  # noqa: PLR2004
        "label": _label(line, named=named),
        "label_x": _px((x + to_x) / 2),
        "label_y": _px((y + to_y) / 2 - 4),
    }


def _label(line: Line, *, named: bool) -> str:
    wrong = line.verdict is not None and line.verdict.rank > 0
    if not line.topics or not (named or wrong):
        return ""
    return short(line.topics[0], 18) if line.worst == 1 else counted(line.worst, "topic")
