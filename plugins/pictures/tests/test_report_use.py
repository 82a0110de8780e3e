"""How a person uses the page of `--format html`: what is seen first, what opens, grows and zooms, on a desk and on a phone."""

import itertools
import re

import pytest

from plugins.pictures.tests.conftest import DESK, open_all, page, written
from plugins.pictures.tests.systems import CORRECT, FLEET, grid, large
from tests.modeler.conftest import ROOT

PHONE = {"width": 390, "height": 844}
TOUCH = 40
EXAMPLES = ("mobile_robot.yaml", "smart_agriculture_incompatible.bpmn")


def example(name):
    return page((ROOT / "examples" / name).read_text(encoding="utf-8"), name=name)


@pytest.mark.parametrize(("name", "total"), [(EXAMPLES[0], 7_000), (EXAMPLES[1], 3_000)])
def test_findings_are_on_the_first_screen(shown, name, total):
    opened = shown(example(name))
    for viewport, first, longer in ((DESK, 300, 1), (PHONE, 500, 1.7)):
        opened.set_viewport_size(viewport)
        assert opened.locator(".finding").first.bounding_box()["y"] < first
        assert opened.evaluate("document.documentElement.scrollHeight") < total * longer
    headings = opened.locator("h3").all_text_contents()
    assert headings.index("Findings") == 0 < headings.index("Graph")


def test_a_finding_is_a_line_that_opens_to_all_of_it(shown):
    opened = shown(page(FLEET))
    finding = opened.locator(".finding", has_text="ROS101")
    summary = finding.locator("summary")
    said = " ".join(summary.text_content().split())
    assert said.startswith("error ROS101 publisher robot/publisher/scan offers reliability best_effort")
    assert said.endswith("system.yaml:17")
    assert summary.bounding_box()["height"] < 80
    parts = [finding.get_by_role("heading", name=each, exact=True) for each in ("Values", "Reason", "What to do")]
    assert not any(each.is_visible() for each in parts)
    summary.focus()
    opened.keyboard.press("Enter")
    assert all(each.is_visible() for each in parts)
    heights = [each.bounding_box()["y"] for each in (summary, *parts)]
    assert heights == sorted(heights)
    assert finding.locator("cite").is_visible()
    assert finding.locator(".diff").count() == 2
    # All of them open and close at once.
    opened.get_by_role("button", name="Open all").click()
    assert opened.locator(".finding:not([open])").count() == 0
    opened.get_by_role("button", name="Close all").click()
    assert opened.locator(".finding[open]").count() == 0


ACCEPTED = "\naccept:\n  - {rule: ROS101, because: measured}\n"


@pytest.mark.parametrize(
    ("text", "wrong"),
    [(FLEET, True), (CORRECT, False), (grid("best_effort"), True), (grid("reliable"), False)],
    ids=["errors", "correct", "one topic", "one topic, correct"],
)
def test_only_what_is_wrong_is_chosen_where_something_is(shown, text, wrong):
    opened = shown(page(text))
    chosen = opened.locator("[data-only][aria-pressed=true]")
    assert chosen.text_content() == ("only what is wrong" if wrong else "everything")
    shown_states = {each.get_attribute("data-item") for each in opened.locator("[data-item]:not([data-out])").all()}
    assert ("wrong" in shown_states) == wrong
    assert ("fine" in shown_states) == (not wrong)


def test_an_accepted_finding_is_not_wrong(shown):
    opened = shown(page(grid("best_effort", subscribers=("reliable",)) + ACCEPTED))
    finding = opened.locator(".finding", has_text="ROS101")
    assert finding.get_attribute("data-item") == "fine"
    assert "accepted" in finding.locator("summary").text_content()


def drawing(stage):
    """Return the names of the nodes of a drawing, and the verdicts of its lines."""
    nodes = stage.locator(".node title").all_text_contents()
    return {each.rpartition(":")[0] for each in nodes}, stage.locator(".line").evaluate_all(
        "each => each.map(one => one.classList[1])"
    )


@pytest.mark.parametrize("text", [FLEET, large(20, 100)], ids=["topics are nodes", "topics are on lines"])
def test_the_graph_shows_what_is_wrong_and_grows(shown, text):
    opened = shown(page(text))
    stages = opened.locator(".stage").all()
    choices = opened.locator(".graph label")
    assert [each.is_visible() for each in stages] == [True] + [False] * (len(stages) - 1)
    drawn = [drawing(each) for each in stages]
    names = choices.all_text_contents()
    assert names[0] == "errors"
    assert {*drawn[0][1]} == {"incompatible"}
    for (before, lines), (after, more) in itertools.pairwise(drawn):
        assert before <= after
        assert len(lines) <= len(more)
        assert (before, lines) != (after, more)
    # The last one is all that there is.
    assert names[-1] == "everything"
    owners = {each.strip() for each in opened.locator(".owners .named").all_text_contents()}
    assert owners == {each.split(" ", 1)[1] for each in drawn[-1][0] if not each.startswith("topic ")}
    for number in range(len(stages)):
        choices.nth(number).click()
        assert [each.is_visible() for each in stages] == [at == number for at in range(len(stages))]


def test_of_many_participants_those_are_drawn_that_do_not_connect(shown):
    opened = shown(page(large(300, 600)))
    stage = opened.locator(".stage").first
    joined = stage.locator(".line").evaluate_all(
        "each => each.flatMap(one => [one.dataset.source, one.dataset.target])"
    )
    nodes = stage.locator(".node").evaluate_all("each => each.map(one => one.dataset.node)")
    assert 50 < len(nodes) <= 60
    assert {*nodes} == {*joined}
    assert stage.locator(".node:not([href])").count() == 0


def test_a_correct_design_has_no_choice_of_graphs(shown):
    opened = shown(page(CORRECT))
    assert opened.locator(".stage").count() == 1
    assert opened.locator(".graph label").count() == 0
    assert opened.get_by_text("There is no finding.").is_visible()


@pytest.mark.parametrize(("text", "viewport"), [(large(20, 100), DESK), (FLEET, PHONE)], ids=["desk", "phone"])
def test_the_graph_zooms(shown, text, viewport):
    opened = shown(page(text), viewport=viewport)
    opened.locator(".graph label").last.click()
    stage, svg = opened.locator(".stage:visible"), opened.locator(".stage:visible svg")
    width = lambda: svg.bounding_box()["width"]  # noqa: E731
    first = width()
    opened.get_by_role("button", name="Larger").click()
    assert width() == pytest.approx(first * 1.25, abs=2)
    opened.get_by_role("button", name="Smaller").click()
    assert width() == pytest.approx(first, abs=2)
    stage.focus()
    for key, factor in (("+", 1.25), ("+", 1.25**2), ("-", 1.25)):
        opened.keyboard.press(key)
        assert width() == pytest.approx(first * factor, abs=2)
    assert (
        opened.locator("output").text_content()
        == f"{round(width() / float(svg.evaluate('each => each.viewBox.baseVal.width')) * 100)} %"
    )
    opened.keyboard.press("0")
    frame = stage.bounding_box()
    assert width() <= frame["width"]
    # The wheel alone scrolls the page; with the modifier it zooms, and the point below the pointer stays.
    fitted, spot = width(), svg.locator(".node").first
    box = spot.bounding_box()
    opened.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    opened.mouse.wheel(0, -1)
    assert width() == fitted
    opened.keyboard.down("Control")
    for _ in range(4):
        opened.mouse.wheel(0, -100)
    opened.keyboard.up("Control")
    opened.wait_for_function(
        "([svg, wide]) => svg.getBoundingClientRect().width > wide * 2", arg=[svg.element_handle(), fitted]
    )
    grown = spot.bounding_box()
    assert stage.evaluate("each => each.scrollWidth > each.clientWidth")
    assert grown["x"] <= box["x"] + box["width"] / 2 <= grown["x"] + grown["width"]
    assert opened.evaluate("document.documentElement.scrollWidth") == viewport["width"]


def test_a_drawing_is_whole_on_a_desk(shown):
    opened = shown(example("mobile_robot.yaml"), viewport=DESK)
    assert opened.locator(".graph label").count() == 4
    for choice in opened.locator(".graph label").all():
        choice.click()
        stage = opened.locator(".stage:visible")
        assert stage.evaluate("each => each.scrollWidth <= each.clientWidth && each.scrollHeight <= each.clientHeight")


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        (grid("reliable", "best_effort"), 4),
        (grid("reliable", "reliable"), 0),  # one verdict
        (grid("best_effort"), 0),  # one publisher
        (grid("reliable", "best_effort", subscribers=("reliable",)), 0),  # one subscriber
    ],
)
def test_a_matrix_is_shown_only_where_it_helps(shown, text, cells):
    opened = shown(page(text))
    open_all(opened)
    assert opened.locator(".matrix td").count() == cells
    assert opened.locator("table.matrix").count() == bool(cells)
    assert (opened.locator(".topics .pair").count() == 0) == bool(cells)
    if cells:
        row = opened.locator(".matrix tbody tr", has_text="publishes_1")
        assert [" ".join(each.split()) for each in row.locator("td").all_text_contents()] == [
            "✕incompatible",
            "✓compatible",
        ]


def test_the_publishers_of_a_wide_matrix_stay_in_view(shown):
    opened = shown(page(grid("reliable", "best_effort", subscribers=("reliable", "best_effort") * 8)), viewport=PHONE)
    open_all(opened)
    frame = opened.locator(".scroll:has(> .matrix)")
    assert opened.locator(".matrix thead th").count() == 1 + 12
    assert "4 subscribers not shown" in opened.locator(".topics").text_content()
    frame.evaluate("each => { each.scrollLeft = each.scrollWidth; }")
    name = opened.locator(".matrix tbody th").first.bounding_box()
    assert abs(name["x"] - frame.bounding_box()["x"]) < 3


ANCHOR = re.compile(r'id="((?:finding|topic|participant|bridge|pair|guarantees|system)-[\w-]+)"')


def anchors(text):
    return {*ANCHOR.findall(text)}


OTHER = """\
  other: {protocol: ros2, publishes: {/a_first: {reliability: best_effort}}}
  another: {protocol: ros2, subscribes: {/a_first: {reliability: reliable}}}
"""


def test_anchors_stay_when_something_else_is_edited():
    before = anchors(page(FLEET))
    assert len(before) > 20
    edited = "# a comment\n\n" + FLEET.replace("participants:\n", "participants:\n" + OTHER)
    after = anchors(page(edited))
    assert before < after
    # Another file name, another place, and another severity of other findings change none either.
    assert anchors(page(FLEET, name="other.yaml")) == before
    assert anchors(page(FLEET + "severities: {MQTT103: error}\n", name="other.yaml")) == before


def test_anchors_are_the_same_beside_other_systems(tmp_path):
    alone = anchors(page(FLEET))
    (tmp_path / "a.yaml").write_text(CORRECT, encoding="utf-8")
    together = anchors(written(tmp_path, FLEET, "a.yaml", "--each", name="b.yaml"))
    assert alone < together
    # Two systems of one name and content are told apart.
    doubled = written(tmp_path, FLEET, "b.yaml", "--each", name="a.yaml")
    found = ANCHOR.findall(doubled)
    assert len(found) == len({*found})
    assert alone < {*found}


def test_a_finding_keeps_its_anchor_when_its_values_change():
    before, after = (
        re.findall(r'id="(finding-ROS101-[\w-]+)"', page(text))
        for text in (FLEET, FLEET.replace("/scan: sensor_data", "/scan: {depth: 3, reliability: best_effort}"))
    )
    assert before == after != []


def test_a_link_opens_what_it_leads_to(shown):
    opened = shown(page(FLEET))
    is_open = "anchor => { const at = document.getElementById(anchor).closest('details'); return at.open && !at.closest('[data-out]'); }"
    hidden = opened.locator(".finding[data-out]").first.get_attribute("id")
    pair = opened.locator(".topics .pair").first.get_attribute("id")
    for anchor in (hidden, pair):
        assert not opened.evaluate(is_open, anchor)
        opened.evaluate("anchor => { location.hash = anchor; }", anchor)
        opened.wait_for_function(is_open, arg=anchor)
    assert opened.locator("[data-out]").count() == 0
    # From a topic to a finding about it.
    link = opened.locator(".topics .entry[open] .links a").first
    link.click()
    opened.wait_for_function(is_open, arg=link.get_attribute("href")[1:])
    # The address of an entry opens it when the page is opened.
    address = f"{opened.url.partition('#')[0]}#{hidden}"
    opened.goto("about:blank")
    opened.goto(address)
    assert opened.evaluate(is_open, hidden)


def test_a_phone_needs_no_small_fingers(shown):
    opened = shown(example("mobile_robot.yaml"), viewport=PHONE, has_touch=True)
    for _ in ("as it opens", "all of it"):
        small = opened.evaluate(
            """least => [...document.querySelectorAll("a, button, summary, label, input[type=search]")]
                .filter(each => !each.closest("svg, .skip") && !each.matches(".skip"))
                .map(each => [each.getBoundingClientRect(), each.outerHTML.slice(0, 120)])
                .filter(([box]) => box.width && (box.height < least || box.width < least)).map(([box, what]) => [box.height, what])""",
            TOUCH,
        )
        assert small == []
        assert opened.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
        open_all(opened)
    # Nodes are as large at the size that they are drawn for.
    heights = opened.locator(".stage:visible .node").evaluate_all("all => all.map(each => each.getBBox().height)")
    assert min(heights) >= TOUCH - 2


@pytest.mark.parametrize("text", [FLEET, CORRECT], ids=["errors", "correct"])
def test_headings_are_in_order_and_focus_is_seen(shown, text):
    opened = shown(page(text))
    open_all(opened)
    levels = opened.locator("h1, h2, h3, h4, h5, h6").evaluate_all("each => each.map(one => Number(one.tagName[1]))")
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    opened.locator("body").press("Tab")
    for _ in range(12):
        assert opened.evaluate(
            """() => { const at = document.activeElement, seen = at.matches(".chips input") ? at.nextElementSibling : at;
                       return getComputedStyle(seen).outlineStyle !== "none" || seen.closest("svg") !== null; }"""
        )
        opened.keyboard.press("Tab")
