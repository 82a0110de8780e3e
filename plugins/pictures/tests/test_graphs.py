"""Graphs: their places, and `convert --to dot` and `--to mermaid`."""

import itertools
import json
import re
import shutil
import subprocess

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_pictures.layout import layered
from plugins.pictures.tests.systems import FLEET, HOSTILE, hostile, large
from tests.browser import missing
from tests.command_process import run
from tests.modeler.conftest import ROOT

nodes = st.integers(1, 12)


@st.composite
def graphs(draw):
    count = draw(nodes)
    ends = st.integers(0, count - 1)
    return [draw(st.sampled_from([20.0, 30.0, 54.0])) for _ in range(count)], draw(
        st.lists(st.tuples(ends, ends), max_size=24)
    )


@given(graphs())
def test_nodes_of_a_layer_never_overlap_and_lines_pass_every_layer_between(graph):
    rooms, edges = graph
    placed = layered(rooms, edges)
    assert placed == layered(rooms, edges)
    assert all(0 <= layer < len(rooms) for layer in placed.layers)
    by_layer: dict[int, list[int]] = {}
    for node, layer in enumerate(placed.layers):
        by_layer.setdefault(layer, []).append(node)
    for row in by_layer.values():
        row.sort(key=lambda node: placed.heights[node])
        for one, other in itertools.pairwise(row):
            assert placed.heights[other] - placed.heights[one] >= (rooms[one] + rooms[other]) / 2 - 0.01
    for source, target in edges:
        if source != target:
            between = abs(placed.layers[source] - placed.layers[target]) - 1
            assert between >= 0
            assert len(placed.bends[source, target]) == between


def test_without_cycles_lines_go_to_the_right():
    placed = layered([40.0] * 5, [(0, 1), (1, 2), (0, 2), (3, 2), (2, 4)])
    assert placed.layers == [0, 1, 2, 1, 3]


def converted(tmp_path, text, form):
    (tmp_path / "system.yaml").write_text(text, encoding="utf-8")
    done = run(["convert", "system.yaml", "--to", form], tmp_path)
    assert done.code == 0, done.err
    return done.out


_DOT_LINE = re.compile(
    r"""  (?:rankdir=LR|node \[fontname="sans-serif"\]|n\d+(?: -> n\d+)? \[(?:\w+=(?:"(?:[^"\\]|\\.)*"|\w+) ?)+\])"""
)


@pytest.mark.parametrize("text", [FLEET, hostile(), large(20, 100)], ids=["fleet", "hostile", "large"])
def test_dot_is_read_by_graphviz(tmp_path, text):
    written = converted(tmp_path, text, "dot")
    first, *lines, last = written.splitlines()
    assert first.startswith('digraph "')
    assert last == "}"
    assert [line for line in lines if not _DOT_LINE.fullmatch(line)] == []
    if (dot := shutil.which("dot")) is None:
        missing("Graphviz")
    done = subprocess.run([dot, "-Tjson"], input=written, capture_output=True, text=True, check=True)
    drawn = json.loads(done.stdout)
    names = {each["label"].split("\\n")[0] for each in drawn["objects"]}
    if text == FLEET:
        assert names == {
            "robot",
            "planner",
            "base",
            "cloud",
            "uplink",
            "/battery",
            "/scan",
            "/pose",
            "/cmd_vel",
            "fleet/r1/battery",
        }
        assert len(drawn["edges"]) == 10
    if text == hostile():
        assert len(names & {name.replace("\\", "\\\\") for name in HOSTILE}) >= 2


_MERMAID_LINE = re.compile(
    r"""  (?:n\d+(?:\[\[|\(\[|\[)"[\w /.,:#;<>-]*"(?:\]\]|\]\)|\]):::\w+"""
    r"""|n\d+ (?:-->|==x|-\.->)(?:\|"[\w /.,:#;-]*"\|)? n\d+|classDef \w+ stroke:#[0-9a-f]{6})""",
    re.ASCII,
)


@pytest.mark.parametrize("text", [FLEET, hostile(), large(20, 100)], ids=["fleet", "hostile", "large"])
def test_mermaid_holds_no_name_that_acts(tmp_path, text):
    first, *lines = converted(tmp_path, text, "mermaid").splitlines()
    assert first == "flowchart LR"
    assert [line for line in lines if not _MERMAID_LINE.fullmatch(line)] == []
    assert [line for line in lines if "<" in line.replace("<br/>", "")] == []


MERMAID = ROOT / "modeler" / "node_modules" / "@mermaid-js" / "tiny" / "dist" / "mermaid.tiny.js"
DRAW = """async text => {
    mermaid.initialize({ startOnLoad: false, maxTextSize: 1e6, maxEdges: 1000 });
    const { diagramType } = await mermaid.parse(text);
    const { svg } = await mermaid.render("drawn", text);
    const drawn = new DOMParser().parseFromString(svg, "text/html");
    const labels = [...drawn.querySelectorAll("g.node")].map(each => each.textContent.trim());
    return [diagramType, labels, drawn.querySelectorAll("path.flowchart-link").length, drawn.querySelectorAll("script, img").length];
}"""


def test_mermaid_draws_it(tmp_path, shown):
    """By the smaller build that the project Mermaid publishes beside the large one."""
    if not MERMAID.is_file():
        missing("Mermaid")
    page = shown("<!doctype html><title>Mermaid</title>")
    page.add_script_tag(content=MERMAID.read_text(encoding="utf-8"))
    for text in (FLEET, hostile()):
        written = converted(tmp_path, text, "mermaid")
        kind, labels, lines, acting = page.evaluate(DRAW, written)
        assert (kind, acting) == ("flowchart-v2", 0)
        assert len(labels) == len(re.findall(r":::", written))
        assert lines == len(re.findall(r"-->|==x|-\.->", written))
        if text == FLEET:
            assert {"robotros2", "/scan", "uplinkmqtt, ros2"} <= {label.replace("bridge, ", "") for label in labels}


def test_many_topics_are_counted_on_lines_between_participants(tmp_path):
    few, many = converted(tmp_path, FLEET, "mermaid"), converted(tmp_path, large(20, 100), "mermaid")
    assert "([" in few
    assert "([" not in many
    assert re.search(r'\|"\d+ topics: incompatible"\|', many) or "incompatible" in many
