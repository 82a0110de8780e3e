"""Draws the figures of docs/paper.md as SVG: the feature model from the ROS 2 pack, the diagrams from the examples and their verdicts."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Final
from xml.sax.saxutils import escape

from lxml import etree

import cqos_core as cqos

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.packs.pack import RulePack

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
COLOURS: Final = {"compatible": "#2e9e4f", "incompatible": "#d43a2f", "unknown": "#d98e04"}
STYLE: Final = "font-family:sans-serif;font-size:12px"
DI: Final = {"bpmndi": "http://www.omg.org/spec/BPMN/20100524/DI"}


def figures(ros2: RulePack) -> Iterator[tuple[str, str]]:
    """Yield every figure: its file name and its text."""
    yield "feature_model.svg", feature_model(ros2)
    yield "smart_agriculture.svg", diagram(EXAMPLES / "smart_agriculture.bpmn", {})
    for name in ("smart_agriculture", "smart_agriculture_incompatible"):
        file = EXAMPLES / f"{name}.bpmn"
        yield f"{name}_checked.svg", diagram(file, verdicts(file))


# Figure 1 -----------------------------------------------------------------------------------------------------------


def features(pack: RulePack) -> dict[str, list[str]]:
    """Return the policies that a pack takes over from DDS, with their values."""
    found = {}
    for policy in pack.policies:
        if policy.level == "endpoint" and policy.default is not None and policy.clause.startswith("DDS"):
            kind = policy.domain
            found[policy.name] = list(getattr(kind, "names", ())) or [f"a {kind.kind}"]
    return found


def feature_model(pack: RulePack) -> str:
    """Draw the policies and their values as a feature model: each policy is mandatory, its values are alternatives."""
    row, parts, top = 24, list[str](), 12
    branches = features(pack)
    height = sum(max(len(values), 1) * row + 10 for values in branches.values()) + 20
    for name, values in branches.items():
        middle = top + (len(values) - 1) * row / 2
        parts += [
            line(150, height / 2, 190, middle),
            f'<circle cx="190" cy="{middle:g}" r="4"/>',
            box(194, middle, 190, name),
        ]
        for number, value in enumerate(values):
            parts += [
                line(384, middle, 430, top + number * row),
                box(430, top + number * row, 150, value, fill="#eef4fb"),
            ]
        top += len(values) * row + 10
    return svg(0, 0, 590, height, [box(10, height / 2, 140, "ROS 2 QoS profile"), *parts])


# Figures 2 and 6 ----------------------------------------------------------------------------------------------------


def verdicts(file: Path) -> dict[str, str]:
    """Return the worst verdict of each event of a diagram."""
    order = list(COLOURS)
    worst: dict[str, str] = {}
    for pair in cqos.check(file).pairs:
        for event in (pair.publisher, pair.subscriber):
            worst[event] = max(worst.get(event, "compatible"), pair.verdict, key=order.index)
    return worst


def diagram(file: Path, colours: Mapping[str, str]) -> str:
    """Draw a BPMN collaboration from its diagram interchange; events get the colour of their verdict."""
    root = etree.parse(file).getroot()
    elements = {element.get("id"): element for element in root.iter(etree.Element) if element.get("id")}
    parts: list[str] = []
    for edge in root.iterfind(".//bpmndi:BPMNEdge", DI):
        points = " ".join(f"{point.get('x')},{point.get('y')}" for point in edge.iterfind("{*}waypoint"))
        parts.append(f'<polyline points="{points}" fill="none" stroke="#555" marker-end="url(#arrow)"/>')
    boxes = [(shape.get("bpmnElement", ""), bounds(shape)) for shape in root.iterfind(".//bpmndi:BPMNShape", DI)]
    for name, (x, y, width, height) in sorted(boxes, key=lambda item: -item[1][2]):
        parts += shape_of(elements[name], x, y, width, height, COLOURS.get(colours.get(name, ""), "#222"))
    right, bottom = (max(each[1][i] + each[1][i + 2] for each in boxes) + 10 for i in (0, 1))
    left, top = (min(each[1][i] for each in boxes) - 10 for i in (0, 1))
    return svg(left, top, right - left, bottom - top, parts)


def bounds(shape: etree._Element) -> tuple[float, float, float, float]:
    """Return place and size of a shape."""
    found = next(shape.iterfind("{*}Bounds"))
    x, y, width, height = (float(found.get(key, "0")) for key in ("x", "y", "width", "height"))
    return x, y, width, height


def shape_of(element: etree._Element, x: float, y: float, width: float, height: float, colour: str) -> list[str]:
    """Draw one element: a pool, an activity, a gateway or an event."""
    kind, name = etree.QName(element).localname, element.get("name", "")
    middle, look = x + width / 2, f'fill="white" stroke="{colour}" stroke-width="{1.5 if colour == "#222" else 3}"'
    if kind == "participant":
        frame = f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" fill="none" stroke="{colour}"/>'
        return [frame, text(x + 10, y + 20, name, anchor="start")]
    if kind.endswith("Gateway"):
        corners = (
            f"{middle:g},{y:g} {x + width:g},{y + height / 2:g} {middle:g},{y + height:g} {x:g},{y + height / 2:g}"
        )
        mark = text(middle, y + height / 2 + 5, "+" if kind.startswith("parallel") else "x")
        return [f'<polygon points="{corners}" {look}/>', mark, *words(middle, y - 22, name)]
    if kind.endswith("Event"):
        rings = [(width / 2, look)] + ([(width / 2 - 4, look)] if kind.startswith("intermediate") else [])
        circles = [f'<circle cx="{middle:g}" cy="{y + height / 2:g}" r="{r:g}" {how}/>' for r, how in rings]
        filled = colour if "Throw" in kind or kind == "endEvent" else "white"
        signal = element.find("{*}signalEventDefinition") is not None
        corners = f"{middle:g},{y + 10:g} {middle + 8:g},{y + 24:g} {middle - 8:g},{y + 24:g}"
        sign = [f'<polygon points="{corners}" fill="{filled}" stroke="{colour}"/>'] if signal else []
        return [*circles, *sign, *words(middle, y + height + 14, name, colour)]
    frame = f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="8" {look}/>'
    return [frame, *words(middle, y + height / 2 - 4, name)]


# Parts of SVG -------------------------------------------------------------------------------------------------------


def svg(x: float, y: float, width: float, height: float, parts: list[str]) -> str:
    """Put parts into a picture."""
    size = f'viewBox="{x:g} {y:g} {width:g} {height:g}" width="{width:g}" height="{height:g}"'
    arrow = (
        '<defs><marker id="arrow" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L10 5L0 10z" fill="#555"/></marker></defs>'
    )
    ground = f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" fill="white"/>'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} style="{STYLE}">'
    return "\n".join([head, arrow, ground, *parts, "</svg>"]) + "\n"


def text(x: float, y: float, content: str, colour: str = "#222", anchor: str = "middle") -> str:
    """Write one line."""
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" fill="{colour}">{escape(content)}</text>'


def words(x: float, y: float, content: str, colour: str = "#222") -> list[str]:
    """Write short lines, one beneath the other."""
    return [text(x, y + 14 * number, each, colour) for number, each in enumerate(textwrap.wrap(content, 14))]


def line(x1: float, y1: float, x2: float, y2: float) -> str:
    """Draw a line."""
    return f'<line x1="{x1:g}" y1="{y1:g}" x2="{x2:g}" y2="{y2:g}" stroke="#555"/>'


def box(x: float, y: float, width: float, content: str, fill: str = "#f6f6f6") -> str:
    """Draw a feature: a box, and its name in it."""
    frame = f'<rect x="{x:g}" y="{y - 10:g}" width="{width:g}" height="20" fill="{fill}" stroke="#555"/>'
    return frame + text(x + width / 2, y + 4, content)
