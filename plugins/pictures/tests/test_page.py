"""`--format html`, made by the command and opened in Chromium: what the page says, and that it can be read.

`test_report_use.py` tries how a person uses it.
"""

import json
import os
import re
from html.parser import HTMLParser

import pytest

from plugins.pictures.tests.conftest import DESK, open_all, page, written
from plugins.pictures.tests.systems import FLEET, HOSTILE, hostile, large
from tests.browser import violations
from tests.command_process import run
from tests.modeler.conftest import ROOT


class Tags(HTMLParser):
    """The start tags of a page, and its text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.texts = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.texts.append(data)


@pytest.mark.parametrize("text", [FLEET, hostile(), large(20, 60)], ids=["fleet", "hostile", "large"])
def test_axe_finds_nothing(shown, text):
    opened = shown(page(text))
    open_all(opened)
    assert violations(opened) == []


def test_a_page_names_everything_a_reader_needs(shown):
    opened = shown(page(FLEET))
    assert opened.title() == "robot-to-cloud: incompatible"
    topic = opened.locator(".topics .entry", has_text="/scan")
    assert "incompatible" in topic.locator("summary").text_content()
    assert "1 publisher, 1 subscriber 1 error" in topic.locator("summary").text_content()
    assert "robot/publisher/scan → planner/subscriber/scan ROS101" in topic.locator(".pair").text_content()
    owner = opened.locator(".owners .entry", has_text="planner")
    assert "▼✕ /scan, subscribes, incompatible" in owner.locator(".uses").text_content()
    assert opened.locator(".path li .what").all_text_contents() == [
        "robot/publisher/battery",
        "/battery",
        "uplink",
        "fleet/r1/battery",
        "cloud/subscriber/fleet/r1/battery",
    ]
    table = opened.locator(".given").first
    assert table.locator("tr.needed th").text_content().startswith("loss_free")
    assert {"in the end", "broker crash"} <= {*table.locator("thead th").all_text_contents()}
    finding = opened.locator(".finding", has_text="ROS101")
    assert finding.locator("mark").all_text_contents() == ["reliable", "/scan"]
    assert "reliability: best_effort" in finding.locator(".diff .came").last.text_content()
    # Each link within the page leads to one place.
    links = opened.locator("a[href^='#']").evaluate_all("each => each.map(one => one.getAttribute('href').slice(1))")
    places = opened.locator("[id]").evaluate_all("each => each.map(one => one.id)")
    assert len(places) == len({*places})
    assert {*links} <= {*places}
    assert opened.locator(".node:not([href])").count() == 0


def test_search_filter_and_theme(shown):
    opened = shown(page(FLEET))
    topics = opened.locator(".topics .entry:not([data-out])")
    assert topics.count() == 3
    assert opened.locator(".topics .more").text_content().startswith("2 not shown.")
    opened.get_by_label("Find topics").fill("fleet battery")
    assert topics.count() == 1
    assert re.fullmatch(r"\d+ of \d+ shown", opened.locator(".found").text_content())
    opened.locator(".topics .more button").click()
    assert topics.count() == 5
    assert opened.locator("[data-out]").count() == 0
    assert not opened.locator(".more").first.is_visible()
    opened.get_by_role("button", name="only what is wrong").click()
    assert topics.count() == 3
    before = opened.evaluate("getComputedStyle(document.body).backgroundColor")
    opened.get_by_role("button", name="Change between light and dark").click()
    assert opened.evaluate("getComputedStyle(document.body).backgroundColor") != before
    opened.locator(".stage:visible .node.topic").first.focus()
    assert opened.locator(".dim").count() > 0


def test_without_javascript_all_of_it_can_be_read(shown):
    text = page(FLEET)
    plain = shown(text, java_script_enabled=False)
    assert not any(each.is_visible() for each in plain.locator(".tools, .zoom, .more, .keys, button").all())
    for each in (
        "Findings",
        "Graph",
        "Topics",
        "Participants and bridges",
        "Requirements and guarantees",
        "Not checked",
    ):
        assert plain.get_by_role("heading", name=each, exact=True).is_visible()
    # Nothing is filtered out, and a click opens what is closed.
    entries = plain.locator(".entry")
    assert entries.count() == 18
    assert not any(each.is_visible() for each in plain.locator(".entry .opened").all())
    for each in entries.all():
        each.locator("summary").first.evaluate("each => each.click()")
    assert all(each.is_visible() for each in plain.locator(".entry .opened").all())
    # The graph grows: choices need no script.
    assert plain.locator(".stage").count() == 4
    for number, name in enumerate(("errors", "+ warnings", "+ neighbours", "everything")):
        plain.locator(".graph").get_by_text(name, exact=True).click()
        assert [each.is_visible() for each in plain.locator(".stage").all()] == [at == number for at in range(4)]
    plain.emulate_media(media="print")
    assert plain.locator(".reasons").first.is_visible()


def test_no_page_is_wider_than_its_window(shown):
    long = "a/name/that/does/not/end/" * 6
    text = large(20, 100).replace("topic_017", f"{long}topic").replace("node_03", f"node_{'03_' * 40}")
    opened = shown(page(text), viewport={"width": 320, "height": 900})
    assert opened.evaluate("document.documentElement.scrollWidth") == 320
    open_all(opened)
    for width in (320, 390, 1280, 320):
        opened.set_viewport_size({"width": width, "height": 900})
        assert opened.evaluate("document.documentElement.scrollWidth") == width


def test_pairs_that_get_the_same_have_one_table():
    text = (
        "cqos: 1\nprotocol: ros2\nparticipants:\n  a: {publishes: {s: {}, t: {}}}\n  b: {subscribes: {s: {}, t: {}}}\n"
    )
    made = page(text)
    assert made.count('class="entry requirement') == 1
    assert re.search(r'The same for <code id="[\w-]+">a/publisher/t → b/subscriber/t</code>', made)


def test_an_empty_part_promises_no_table():
    text = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {s: {}}}}\n"
    made = page(text)
    assert "No pair is connected, so nothing is guaranteed." in made
    assert "These are the guarantees" not in made


def test_printed_it_is_light_and_has_no_tools(shown):
    opened = shown(page(FLEET), color_scheme="dark")
    opened.emulate_media(media="print")
    assert opened.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert not opened.locator(".tools").is_visible()
    assert len(opened.pdf()) > 10_000


def test_hostile_names_stay_names():
    text = page(hostile())
    read = Tags(text)
    names = [tag for tag, _ in read.tags]
    assert (names.count("script"), names.count("style"), names.count("img")) == (1, 1, 0)
    assert not [name for _, attributes in read.tags for name in attributes if name.startswith("on") or name == "style"]
    shown = "".join(read.texts)
    for name in HOSTILE[:3]:
        assert name in shown
    assert text.count("prefers-color-scheme: dark") == 2  # once in the style, once in the script


def test_nothing_comes_from_elsewhere():
    text = page(FLEET)
    addresses = [
        value
        for tag, attributes in Tags(text).tags
        for name, value in attributes.items()
        if name in {"src", "href", "action", "data"} and tag != "a" and not value.startswith("#")
    ]
    assert addresses == ["data:,"]
    assert "url(" not in re.sub(r"url\(#", "", text)
    [policy] = [each["content"] for tag, each in Tags(text).tags if each.get("http-equiv") == "Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy


def test_a_page_is_the_same_each_time(tmp_path):
    assert written(tmp_path, FLEET) == written(tmp_path, FLEET)


def test_of_ten_thousand_endpoints_a_page_says_what_it_leaves_out():
    once = page(large(2000, 3700))
    assert "<dd>10," in once
    assert len(once) < 2_000_000
    assert "3,500 topics not shown" in once
    assert re.search(r"1,[89]\d\d participants not shown", once)
    assert "participants are not drawn" in once
    assert re.search(r"[\d,]+ more findings are not listed here", once) or once.count('class="entry finding') < 200


def test_several_systems_have_an_overview(tmp_path, shown):
    fine = "cqos: 1\nsystem: fine\nprotocol: ros2\nparticipants: {a: {publishes: {t: {}}}, b: {subscribes: {t: {}}}}\n"
    for name, text in (("a.yaml", fine), ("b.yaml", FLEET)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    done = run(["check", ".", "--format", "html"], tmp_path)
    opened = shown(done.out)
    rows = opened.locator("section", has_text="All systems").first.locator("tbody tr")
    assert [" ".join(each.split()) for each in rows.all_text_contents()] == [
        "robot-to-cloud✕ incompatible",
        "fine✓ compatible",
    ]
    assert [each.is_visible() for each in opened.locator("article.system").all()] == [True, False]
    opened.get_by_role("button", name="everything", exact=True).click()
    assert [each.is_visible() for each in opened.locator("article.system").all()] == [True, True]
    # The graph of a system that was filtered out at first has a size, too.
    second = opened.locator("article.system").last
    second.get_by_role("button", name="Larger").click()
    assert second.locator("output").text_content() == "125 %"
    ids = opened.evaluate("[...document.querySelectorAll('[id]')].map(each => each.id)")
    assert len(ids) == len({*ids})


RUN = {
    "publisher": "robot/publisher/scan",
    "subscriber": "planner/subscriber/scan",
    "topic": "/scan",
    "protocol": "ros2",
    "verdict": "incompatible",
    "codes": ["ROS101"],
    "fixes": [],
    "plan": {"fault": {"kind": "link_outage", "seconds": 2.0}},
    "on": "Cyclone DDS 11.0.1",
    "matched": False,
    "refused": ["reliability"],
    "not_created": {},
    "sent": [0, 1],
    "arrived": [],
    "agrees": True,
    "disagreements": [],
    "events": [{"at": 0.5, "who": "publisher", "what": "incompatible", "number": None, "text": "reliability"}],
}


def test_recorded_runs_are_shown(tmp_path):
    (tmp_path / "runs.json").write_text(json.dumps({"version": 1, "runs": [RUN, {**RUN, "publisher": "other"}]}))
    text = written(tmp_path, FLEET, "--proofs", "runs.json")
    assert text.count("On Cyclone DDS 11.0.1 with link outage of 2 s: not connected, 0 of 2 samples arrived") == 1
    assert "publisher   incompatible: reliability" in text


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"runs": [1]}', '{"runs": [{}]}', json.dumps({"runs": [{**RUN, "events": [{"a": 1}]}]})]
)
def test_other_files_are_no_runs(tmp_path, text):
    (tmp_path / "runs.json").write_text(text)
    (tmp_path / "system.yaml").write_text(FLEET)
    done = run(["check", "system.yaml", "--format", "html", "--proofs", "runs.json"], tmp_path)
    assert done.code == 2
    assert "runs.json holds no runs of `cqos prove --format json`" in done.err


SCREENS = {
    "report": (FLEET, "body", "light"),
    "report-finding": (FLEET, ".finding", "light"),
    "report-guarantees-dark": (FLEET, ".requirement", "dark"),
    "report-large": (large(20, 100), ".graph", "light"),
}


@pytest.mark.parametrize("name", SCREENS)
def test_the_screens_of_the_docs(tmp_path, shown, name):
    """`CQOS_SCREENSHOTS=1` writes them there: pixels depend on the fonts of a machine."""
    text, where, theme = SCREENS[name]
    opened = shown(page(text), color_scheme=theme, viewport=DESK)
    for each in opened.locator(f"{where} > summary").all()[:1]:
        each.click()
    opened.locator(where).first.evaluate("each => each.scrollIntoView({ block: 'start' })")
    folder = ROOT / "docs" / "img" if os.environ.get("CQOS_SCREENSHOTS") else tmp_path
    file = folder / f"{name}.png"
    opened.screenshot(path=file)
    assert file.stat().st_size > 10_000
