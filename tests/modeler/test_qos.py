"""QoS on the page, in a real browser with the real service: verdicts while a person edits, findings, fixes, other documents."""

import importlib.util
import json
import os
import re

import pytest

from tests.browser import violations
from tests.command_process import run
from tests.effort import EXPLORE
from tests.modeler.conftest import NAME, ROOT, Running
from tests.modeler.drawings import BOUNDARY, CATCH, END, START, THROW, Event, Pool, drawing, many, written

STATES = ("compatible", "incompatible", "error", "unknown", "unmatched")
CATCH_REQUEST, THROW_REQUEST = "Station_CatchReq", "Drone_ThrowReq"


def pair(offered=None, requested=None, more=(), attributes=""):
    """A diagram of one publisher, one subscriber, and further events of the subscriber's pool."""
    first = Event("Out", THROW, "t", offered)
    return drawing(Pool("A", (first,)), Pool("B", (Event("In", CATCH, "t", requested), *more)), attributes=attributes)


@pytest.fixture
def checks(opens):
    """Open a diagram in the shared modeler, and wait for its first verdict."""
    return lambda text, **options: checked(opens(text, **options))


@pytest.fixture
def paper(checks):
    return checks((ROOT / "examples" / NAME).read_text(encoding="utf-8"))


@pytest.fixture
def file(shared):
    """The file of the shared modeler."""
    return shared[1]


def checked(shown):
    shown.page.wait_for_selector(".qos-badge")
    return shown


def marks(shown, state):
    """Ids of the elements that have a state."""
    return sorted(
        shown.page.locator(f".djs-element.qos-{state}").evaluate_all("all => all.map(each => each.dataset.elementId)")
    )


def becomes(shown, **wanted):
    """Wait until states have these elements, and the other states have none."""
    expected = {state: sorted(wanted.get(state, ())) for state in STATES}
    shown.page.wait_for_function(
        """expected => Object.entries(expected).every(([state, ids]) => {
            const found = [...document.querySelectorAll(`.djs-element.qos-${state}`)].map(each => each.dataset.elementId);
            return JSON.stringify(found.sort()) === JSON.stringify(ids);
        })""",
        arg=expected,
    )


PROBLEM, ERROR = ".problem", ".problem:has(.severity-error)"


def lists(shown, *codes, of=PROBLEM):
    """Wait until the list of problems has these codes, in its order."""
    shown.page.wait_for_function(
        """([of, codes]) => {
            const found = [...document.querySelectorAll(`${of} .code`)].map(each => each.textContent);
            return JSON.stringify(found) === JSON.stringify(codes);
        }""",
        arg=[of, codes],
    )


def problems(shown):
    """Codes in the list of problems, as it is now."""
    return shown.page.locator(f"{PROBLEM} .code").all_text_contents()


def panel(shown):
    return shown.page.locator(".panel")


def field(shown, label):
    return panel(shown).locator(".field").get_by_label(label, exact=True)


def reveal(shown, topic, element):
    """Go to an event by the matrix."""
    shown.page.get_by_role("tab", name="Topic matrix").click()
    shown.page.get_by_label("Search for a topic").fill(topic)
    card = shown.page.locator(
        ".topic", has=shown.page.locator(".topic-name", has_text=re.compile(f"^/?{re.escape(topic)}$"))
    )
    card.locator(".link", has_text=element).first.click()
    return shown


EVENTS = (THROW_REQUEST, "Drone_CatchResp", CATCH_REQUEST, "Station_ThrowResp")


def test_the_example_of_the_paper_is_compatible_and_explained(paper):
    becomes(paper, compatible=EVENTS)
    assert "Compatible: 2 of 2 pairs" in paper.page.locator(".status").text_content()
    # The paper's own timing: a deadline of 2 s, and a timer that fires every six hours.
    assert {each[:2] for each in problems(paper)} <= {"BP"}
    badges = paper.page.locator(".qos-badge")
    assert set(badges.all_text_contents()) == {"compatible"}
    assert badges.locator("svg").count() == len(EVENTS)
    # A word about a setting has its source.
    paper.choose(THROW_REQUEST)
    panel(paper).locator('[data-policy="reliability"] .field-label').hover()
    tip = paper.page.locator(".tip")
    tip.wait_for()
    assert "Source: " in tip.inner_text()
    paper.choose("Drone_TakeOff")
    assert tip.count() == 0
    # The timer that a finding names is found.
    paper.choose(THROW_REQUEST)
    card = panel(paper).locator(".card", has_text="Deadline and mean period")
    card.get_by_text("at least 6h").wait_for()
    deadline = panel(paper).locator('[data-policy="deadline"]')
    assert "sends at most one sample in 6h" in deadline.inner_text()
    card.get_by_role("button", name="Every six hours").click()
    assert paper.page.locator(".djs-shape.selected").get_attribute("data-element-id") == "Drone_Start"


def papers_edit(shown):
    """The negative example of the paper: two changes at the subscriber."""
    shown.choose(CATCH_REQUEST)
    field(shown, "Reliability").select_option("reliable")
    field(shown, "Liveliness").select_option("manual_by_topic")


def test_the_edit_of_the_paper_is_red_at_two_events_for_two_reasons_and_fixes_make_it_green(paper, file):
    before = file.read_text()
    papers_edit(paper)
    becomes(paper, incompatible=(THROW_REQUEST, CATCH_REQUEST), compatible=EVENTS[1::2])
    lists(paper, "ROS101", "ROS104", of=ERROR)
    sides = panel(paper).locator(".card").first.locator(".side")
    assert sides.all_inner_texts()[0].split()[:4] == ["Offered", "Reliability", "Best", "effort"]
    assert sides.all_inner_texts()[1].split()[:3] == ["Requested", "Reliability", "Reliable"]
    panel(paper).locator(".card summary", has_text="Liveliness").click()
    panel(paper).get_by_role("button", name="Set Liveliness to Automatic on Weather station").click()
    lists(paper, "ROS101", of=ERROR)
    panel(paper).get_by_role("button", name="Set Reliability to Best effort on Weather station").click()
    becomes(paper, compatible=EVENTS)
    paper.press("Control+z", "Control+z")
    becomes(paper, incompatible=(THROW_REQUEST, CATCH_REQUEST), compatible=EVENTS[1::2])
    paper.press("Control+z", "Control+z")
    becomes(paper, compatible=EVENTS)
    paper.saved(NAME)
    assert file.read_text() == before


def test_a_fix_is_saved_where_it_was_applied_only(paper, file):
    before = file.read_text()
    papers_edit(paper)
    panel(paper).get_by_role("button", name="Set Reliability to Reliable on Drone").click()
    becomes(paper, incompatible=(THROW_REQUEST, CATCH_REQUEST), compatible=EVENTS[1::2])
    paper.saved(NAME)
    after = file.read_text().splitlines()
    changed = [new for old, new in zip(before.splitlines(), after, strict=True) if old != new]
    assert len(changed) == 3
    assert all("qos:reliability" in line or "qos:liveliness" in line for line in changed)
    # The command says of the file what the page says of the drawing.
    done = run(["check", file, "--format", "json", "--no-config"], file.parent)
    report = json.loads(done.out)
    assert (done.code, report["verdict"]) == (1, "incompatible")
    assert [each["code"] for each in report["findings"] if each["severity"] == "error"] == ["ROS104"]
    lists(paper, "ROS104", of=ERROR)
    # The status line tells of the save for some seconds only.
    paper.page.locator(".status", has_text="Incompatible: 1 of 2 pairs").wait_for()


def test_deleted_pasted_and_renamed_events_are_checked(checks):
    shown = checks(pair())
    becomes(shown, compatible=("In", "Out"))
    shown.choose("In").press("Delete")
    becomes(shown, unmatched=("Out",))
    shown.press("Control+z")
    becomes(shown, compatible=("In", "Out"))
    shown.choose("In").press("Control+c", "Control+v")
    box = shown.page.locator('[data-element-id="Pool_B"] .djs-hit').first.bounding_box()
    for far in (60, 50):
        shown.page.mouse.move(box["x"] + box["width"] - far, box["y"] + box["height"] - far)
    shown.page.mouse.click(box["x"] + box["width"] - 50, box["y"] + box["height"] - 50)
    shown.page.wait_for_function("() => document.querySelectorAll('.djs-element.qos-compatible').length === 3")
    shown.press("Control+z")
    becomes(shown, compatible=("In", "Out"))
    shown.choose("In")
    topic = field(shown, "Topic")
    topic.fill("another")
    shown.press("Enter")
    panel(shown).get_by_role("button", name="New topic for this event").click()
    becomes(shown, unmatched=("In", "Out"))
    topic.fill("t")
    shown.press("Enter")
    becomes(shown, compatible=("In", "Out"))
    topic.fill("everywhere")
    shown.press("Enter")
    panel(shown).get_by_role("button", name="Rename it everywhere").click()
    becomes(shown, compatible=("In", "Out"))


def test_events_of_all_kinds_and_in_called_processes_have_partners(checks):
    called = {"Called": (Event("Deep", START, "deep"),)}
    events = (Event("Start", START, "a"), Event("Border", BOUNDARY, "b"), Event("End", END, "c"))
    others = (Event("A", THROW, "a"), Event("B", END, "b"), Event("C", CATCH, "c"), Event("D", THROW, "deep"))
    shown = checks(drawing(Pool("One", events, calls="Called"), Pool("Two", others), called=called))
    becomes(shown, compatible=("Start", "Border", "End", "A", "B", "C", "D"))
    shown.choose("D")
    assert "One: Deep" in panel(shown).locator(".partners").inner_text()
    shown.choose("Border")
    field(shown, "Reliability").select_option("reliable")
    shown.choose("B")
    field(shown, "Reliability").select_option("best_effort")
    becomes(shown, incompatible=("Border", "B"), compatible=("Start", "End", "A", "C", "D"))


def test_a_fix_says_which_other_pairs_it_changes(checks):
    more = (Event("Second", CATCH, "t", {"reliability": "reliable"}),)
    shown = checks(pair({"reliability": "best_effort"}, {"reliability": "best_effort"}, more))
    becomes(shown, incompatible=("Out", "Second"), compatible=("In",))
    shown.choose("Out")
    assert panel(shown).locator(".partners li").count() == 2
    fix = panel(shown).locator(".fix", has_text="Set Reliability to Reliable on A: Out")
    assert (
        "also changes 1 other pair: A: Out with B: In. On this topic it improves 1 pair and worsens no pair."
        in fix.inner_text()
    )
    fix.get_by_role("button").click()
    becomes(shown, compatible=("Out", "In", "Second"))


def test_the_panel_is_that_of_the_protocol(checks):
    mqtt = ' qos:protocol="mqtt"'
    shown = checks(drawing(Pool("A", (Event("Out", THROW, "t"),), mqtt), Pool("B", (Event("In", CATCH, "t"),), mqtt)))
    becomes(shown, compatible=("In", "Out"))
    shown.choose("Out")
    assert field(shown, "Reliability").count() == 0
    panel(shown).locator('[data-policy="retain"]').get_by_label("Yes").check(force=True)
    assert panel(shown).locator('[data-policy="retain"]').get_by_label("Yes").is_checked()
    field(shown, "Protocol").select_option("dds")
    panel(shown).locator('[data-policy="latency_budget"]').wait_for(state="attached")
    strength = panel(shown).locator('[data-policy="durability"] optgroup[label="Weakest to strongest"] option')
    assert strength.all_text_contents() == ["Volatile", "Transient local", "Transient", "Persistent"]
    note = panel(shown).locator(".convert", has_text="DDS does not know retain")
    note.get_by_role("button", name="Remove from this event").click()
    note.wait_for(state="hidden")
    shown.choose("In")
    assert field(shown, "Retain").count() == 0
    assert "of the pool" in panel(shown).locator(".field", has_text="Protocol").inner_text()


def test_values_have_defaults_with_their_origin_and_are_refused_at_the_field(checks):
    shown = checks(pair())
    shown.choose("In")
    depth = panel(shown).locator('[data-policy="depth"]')
    line = depth.locator("input")
    assert line.get_attribute("placeholder") == "10"
    assert "default of ROS 2" in depth.inner_text()
    line.fill("many")
    line.press("Enter")
    assert "Expected: a whole number" in depth.inner_text()
    assert line.get_attribute("aria-invalid") == "true"
    line.fill("0")
    line.press("Enter")
    assert "0 means" in depth.inner_text()
    line.fill("7")
    line.press("Enter")
    assert line.get_attribute("aria-invalid") is None
    depth.get_by_role("button", name="Use the default of Depth").click()
    assert line.input_value() == ""
    field(shown, "Preset").select_option("sensor_data")
    shown.page.wait_for_function(
        "() => document.querySelector('[data-policy=depth] .field-origin').textContent === 'from preset sensor_data'"
    )
    assert line.get_attribute("placeholder") == "5"
    wait = panel(shown).locator('[data-policy="deadline"]')
    wait.locator("input").fill("20")
    wait.locator("select").select_option("ms")
    assert (wait.locator("input").input_value(), wait.locator("select").input_value()) == ("20", "ms")
    wait.locator("select").select_option("infinite")
    shown.page.wait_for_function("() => document.querySelector('[data-policy=deadline] input').disabled")


TYPE = """texts => {
    const found = [];
    for (const { dataset: { policy } } of document.querySelectorAll('.panel .field:has(.duration)')) {
        const [field] = document.querySelectorAll(`.panel [data-policy="${policy}"]`);
        const entry = field.querySelector('input');
        if (!entry.checkVisibility() || entry.disabled) continue;
        const becomes = typed => {
            entry.value = typed;
            for (const kind of ['input', 'change']) entry.dispatchEvent(new Event(kind, { bubbles: true }));
            return [typed, entry.value, field.querySelector('select').value, field.querySelector('.field-error').innerText];
        };
        found.push([policy, texts.map(becomes)]);
    }
    return found;
}"""
"""Gives texts to each field of a duration as typing does; what the field shows then, and its complaint."""


def test_every_duration_takes_its_unit_where_it_is_typed_and_refuses_nonsense(checks, file):
    shown = checks(pair())
    shown.choose("In")
    wait = panel(shown).locator('[data-policy="deadline"]')
    for typed, number, unit, kept in (
        ("10s", "10", "s", "10"),
        ("infinite", "", "infinite", "infinite"),
        ("500 ms", "500", "ms", "500ms"),
        ("Infinity", "", "infinite", "infinite"),
        ("2 min 30 sec", "150", "s", "150"),
    ):
        wait.locator("input").fill(typed)
        wait.locator("input").press("Enter")
        shown.page.wait_for_function(
            """([number, unit]) => {
                const field = document.querySelector('.panel [data-policy="deadline"]');
                const taken = !field.classList.contains('refused');
                return taken && field.querySelector('input').value === number && field.querySelector('select').value === unit;
            }""",
            arg=[number, unit],
        )
        shown.saved(NAME)
        assert f'qos:deadline="{kept}"' in file.read_text(encoding="utf-8")
    # The same of every duration of every pack.
    tried = set()
    for protocol in ("ros2", "dds", "mqtt"):
        shown.choose("In")
        field(shown, "Protocol").select_option(protocol)
        for owner in ("In", "Pool_B"):
            shown.choose(owner, **({} if owner == "In" else {"position": {"x": 12, "y": 40}}))
            panel(shown).locator("details").evaluate_all("all => all.forEach(each => { each.open = true; })")
            for name, (*refused, taken) in shown.page.evaluate(TYPE, ["soon", "10 apples", "-3s", "90s"]):
                for typed, _, _, problem in refused:
                    assert problem.startswith(f"“{typed}” is no duration. Expected: "), (name, typed)
                    assert re.search(r"\d ?m?s", problem), name  # what to write
                assert taken[1:3] == ["90", "s"], name
                assert not taken[3].startswith("“"), name
                tried.add((protocol, owner, name))
    assert len(tried) > 16, sorted(tried)


def test_an_answer_takes_no_field_from_a_person_who_types(opens):
    shown = checked(opens(pair()))
    shown.choose("In")
    calls, held = "**/cqos.v1.SessionService/*", []

    def hold(route):
        held.append(route)

    shown.page.route(calls, hold)
    shown.press("Control+Enter", "ArrowDown", "Enter")
    topic = shown.page.locator(".panel").get_by_role("combobox", name="Topic", exact=True)
    topic.press_sequentially("wea")
    while not held:
        shown.page.wait_for_timeout(50)
    held.pop().continue_()
    shown.page.unroute(calls)
    shown.page.wait_for_selector(".qos-badge-unmatched")
    shown.page.keyboard.type("ther")
    shown.press("Enter")
    deadline = shown.page.locator('.panel [data-policy="deadline"]')
    deadline.locator("input").fill("2")
    deadline.locator("input").press("Enter")
    assert topic.input_value() == "weather"
    assert deadline.locator("select").input_value() == "s"


def test_a_person_who_draws_keeps_the_focus_and_is_warned_once_the_event_is_left(opens):
    shown = opens()
    shown.page.locator(".list-note", has_text="Nothing to check yet").wait_for()
    panel(shown).get_by_role("button", name="Add a subscriber").click()
    panel(shown).locator('[data-policy="reliability"]').wait_for()
    shown.page.keyboard.type("weather")
    shown.press("Enter")
    shown.page.wait_for_function("() => document.querySelector('.panel h2').textContent === 'weather'")
    assert shown.page.locator(".tip").count() == 0
    shown.page.wait_for_selector(".qos-badge-unmatched")
    panel(shown).get_by_text("No event or document shares this topic yet.").wait_for()
    assert (problems(shown), panel(shown).locator(".card").count()) == ([], 0)
    shown.page.locator(".canvas").click(position={"x": 500, "y": 430})
    lists(shown, "CQ401")
    shown.page.locator(".problem-line").click()
    panel(shown).locator(".card", has_text="CQ401").wait_for()


PACK = ROOT / "examples" / "opcua" / "opcua_pack.yaml"


def test_a_pack_in_yaml_appears_in_the_panel(run_modeler, show, tmp_path):
    file = written(tmp_path, "drawn.bpmn", pair(attributes=' qos:protocol="opcua"'))
    shown = checked(show(run_modeler("--pack", PACK, file).address))
    shown.choose("Out")
    field(shown, "Security mode").wait_for()
    mode = panel(shown).locator('[data-policy="security_mode"]')
    assert "default of OPC UA PubSub" in mode.inner_text()
    shown.choose("In")
    panel(shown).locator('[data-policy="security_mode"]').wait_for()
    assert panel(shown).locator('[data-policy="publishing_interval"]').count() == 0
    assert panel(shown).locator('[data-policy="message_receive_timeout"]').count() == 1


FLEET = """cqos: 1
protocol: ros2
participants:
  logger:
    subscribes:
      t: {reliability: reliable}
"""


def test_verdicts_of_the_files_of_a_command_are_grey_while_the_service_is_away_and_come_back(
    run_modeler, show, tmp_path
):
    file = written(tmp_path, "drawn.bpmn", pair({"reliability": "best_effort"}, {"reliability": "best_effort"}))
    running = run_modeler(file, written(tmp_path, "fleet.yaml", FLEET))
    shown = checked(show(running.address))
    becomes(shown, incompatible=("Out",), compatible=("In",))
    shown.page.get_by_role("tab", name="Other documents").click()
    shown.page.get_by_role("button", name="Remove fleet.yaml").click()
    becomes(shown, compatible=("In", "Out"))
    port = re.search(r":(\d+)/", running.page)[1]
    running.stop()
    shown.choose("In")
    field(shown, "Reliability").select_option("reliable")
    shown.choose("Out")
    field(shown, "Reliability").select_option("best_effort")
    shown.notice("does not answer").wait_for()
    assert shown.page.locator(".qos-stale .qos-badge").count() == 2
    again = Running("--port", port, file, folder=tmp_path)
    try:
        becomes(shown, incompatible=("In", "Out"))
        assert shown.notice("does not answer").count() == 0
        assert shown.page.locator(".qos-stale").count() == 0
        shown.leave()  # it would ask a service that has ended
    finally:
        again.stop()
    assert all("Failed to load resource" in each for each in shown.complaints)
    shown.complaints.clear()


def test_requirements_and_exceptions_are_entered_and_kept(checks, file):
    shown = checks(pair({"durability": "volatile"}, {"durability": "volatile"}))
    shown.choose("In")
    panel(shown).locator("summary", has_text="Requirements").click()
    need = panel(shown).locator('[data-policy="need.late_join"] input')
    need.fill("1")
    need.press("Enter")
    becomes(shown, incompatible=("In", "Out"))
    panel(shown).locator(".card .why summary").first.click()
    panel(shown).get_by_role("button", name="Accept with a reason").first.click()
    panel(shown).get_by_label("Reason").fill("a <b>known</b> gap")
    panel(shown).get_by_role("button", name=re.compile("Accept .* here")).click()
    shown.page.locator(".qos-badge", has_text="incompatible, accepted").first.wait_for()
    lists(shown)
    shown.saved(NAME)
    text = file.read_text()
    assert '<qos:need name="late_join" value="1"' in text
    assert 'because="a &#60;b&#62;known&#60;/b&#62; gap"' in text
    panel(shown).locator("summary", has_text="Exceptions").click()
    panel(shown).get_by_role("button", name=re.compile("^Remove ")).click()
    shown.page.locator(".qos-badge", has_text="accepted").first.wait_for(state="detached")
    shown.page.wait_for_function("() => document.querySelectorAll('.problem .code').length === 1")


def test_rules_of_the_team_are_entered_and_kept(checks, file):
    shown = checks(pair())
    panel(shown).locator("summary", has_text="Rules of the team").click()
    rules = panel(shown).locator(".fold", has_text="Rules of the team")
    rules.get_by_role("button", name="Add…").click()
    stated = {"name": "only-best-effort", "because": "we agreed", "policy": "reliability", "exactly": "best_effort"}
    for label, value in stated.items():
        rules.get_by_label(re.compile(f"^{label}")).fill(value)
    rules.get_by_role("button", name="Add", exact=True).click()
    shown.page.locator(".problem", has_text="only-best-effort").first.wait_for()
    shown.saved(NAME)
    assert "<qos:check " in file.read_text()
    rules.get_by_role("button", name="Remove only-best-effort").click()
    shown.page.locator(".problem", has_text="only-best-effort").first.wait_for(state="detached")


def test_documents_beside_the_diagram_are_checked_with_it(checks, tmp_path):
    shown = checks(drawing(Pool("A", (Event("Out", THROW, "t", {"reliability": "best_effort"}),))))
    shown.put_beside(written(tmp_path, "fleet.yaml", FLEET))
    becomes(shown, incompatible=("Out",))
    assert f"Checked together with {NAME}, as one system." in shown.page.locator(".tab-content:visible").inner_text()
    shown.choose("Out")
    assert "fleet.yaml" in panel(shown).locator(".partners").inner_text()
    elsewhere = panel(shown).locator(".fix", has_text="Edit fleet.yaml to apply it")
    assert elsewhere.count() == 1
    card = shown.page.locator(".document")
    assert "logger subscribes to /t" in card.inner_text()
    card.get_by_role("button", name="Remove fleet.yaml").click()
    becomes(shown, unmatched=("Out",))
    shown.put_beside(written(tmp_path, "broken.yaml", "cqos: 1\nparticipants: 5\n"))
    shown.notice("cannot read broken.yaml").wait_for()
    assert shown.page.locator(".qos-stale").count() == 1
    shown.page.get_by_role("button", name="Remove broken.yaml").click()
    becomes(shown, unmatched=("Out",))
    assert shown.page.locator(".qos-stale").count() == 0


def test_a_diagram_beside_becomes_the_diagram_and_discarded_changes_are_gone(checks, tmp_path):
    shown = checks(drawing(Pool("A", (Event("Out", THROW, "t", {"reliability": "best_effort"}),))))
    other = drawing(Pool("B", (Event("In", CATCH, "t", {"reliability": "reliable"}),)))
    shown.put_beside(written(tmp_path, "other.bpmn", other))
    becomes(shown, incompatible=("Out",))
    shown.page.get_by_role("button", name="Show as the diagram").click()
    becomes(shown, incompatible=("In",))
    assert shown.page.title() == "other.bpmn - C-QoS"
    beside = shown.page.locator(".document")
    assert f"{NAME}\n1 endpoint" in beside.inner_text()
    shown.choose("In")
    field(shown, "Reliability").select_option("best_effort")
    becomes(shown, compatible=("In",))
    beside.get_by_role("button", name="Show as the diagram").click()
    dialog = shown.page.get_by_role("dialog", name="Save other.bpmn?")
    dialog.get_by_role("button", name="Cancel").click()
    becomes(shown, compatible=("In",))
    beside.get_by_role("button", name="Show as the diagram").click()
    dialog.get_by_role("button", name="Discard changes").click()
    becomes(shown, incompatible=("Out",))
    assert (shown.page.title(), shown.is_edited) == (f"{NAME} - C-QoS", False)
    beside.get_by_role("button", name="Show as the diagram").click()
    becomes(shown, incompatible=("In",))
    assert not shown.is_edited


def test_settings_of_the_other_end_are_used_in_one_step(checks, file):
    stated = {"reliability": "best_effort", "deadline": "2", "lifespan": "9"}
    shown = checks(pair(stated, {}, (Event("Preset", CATCH, "t", {"profile": "sensor_data"}),)))
    becomes(shown, incompatible=("In", "Out"), compatible=("Preset",))
    shown.choose("Preset")
    offer = panel(shown).locator(".convert", has_text="A: Out has this topic, too, and states 2 settings.")
    panel(shown).locator('[data-policy="reliability"]').wait_for()
    assert offer.count() == 0
    shown.choose("In")
    offer.get_by_role("button", name="Use them here, too").click()
    offer.wait_for(state="detached")
    becomes(shown, compatible=("In", "Out", "Preset"))
    shown.saved(NAME)
    text = file.read_text()
    event = text[text.index('id="In"') :].partition(">")[0]
    assert 'qos:reliability="best_effort"' in event
    assert 'qos:deadline="2"' in event
    assert "lifespan" not in event
    shown.press("Control+z")
    becomes(shown, incompatible=("In", "Out"), compatible=("Preset",))
    offer.wait_for()


def test_a_recording_a_profile_file_and_an_asyncapi_document_bring_partners(checks):
    topics = {"ros2": "/imu/data", "dds": "alarm", "mqtt": "farm/weather"}
    domain = {"dds": ' qos:domain="3"'}
    pools = [
        Pool(name, (Event(f"In_{name}", CATCH, topic),), f' qos:protocol="{name}"{domain.get(name, "")}')
        for name, topic in topics.items()
    ]
    shown = checks(drawing(*pools))
    becomes(shown, unmatched=[f"In_{name}" for name in topics])
    designs = ROOT / "tests" / "decisive" / "designs"
    files = [
        ROOT / "examples" / "robot_directory" / "bag" / "metadata.yaml",
        designs / "press_dds.xml",
        designs / "weather_asyncapi" / "station.yaml",
    ]
    shown.put_beside(*files)
    shown.page.wait_for_function("() => document.querySelectorAll('.document').length === 3")
    shown.page.locator(".qos-unmatched").first.wait_for(state="detached")
    for name, file in zip(topics, files, strict=True):
        shown.choose(f"In_{name}")
        assert file.name in panel(shown).locator(".partners").inner_text()


ZEROS = dict.fromkeys(
    ("history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness", "leaseDuration"), "0"
)
FAME = '<qos:policy reliability="1" type="reliability" value="1"/><qos:policy durability="0"/>'


@pytest.mark.skipif(
    importlib.util.find_spec("ortools") is None and os.environ.get("CI") != "true", reason="OR-tools is not installed"
)
def test_settings_are_suggested_from_requirements_and_written_in_one_step(checks, file):
    needs = '<qos:need name="late_join" value="3"/>'
    out, into = Event("Out", THROW, "t"), Event("In", CATCH, "t", None, needs)
    shown = checks(drawing(Pool("A", (out,)), Pool("B", (into,))))
    becomes(shown, incompatible=("In", "Out"))
    shown.choose("Out")
    suggestion = panel(shown).locator(".suggest")
    suggestion.get_by_role("button", name="Suggest settings").click()
    apply = suggestion.get_by_role("button", name=re.compile("Apply these . settings"))
    apply.wait_for()
    words = suggestion.inner_text()
    assert "Set Durability to Transient local on A: Out" in words
    assert "ROS512: samples from before are replayed only between endpoints" in words
    assert violations(shown.page, ".suggest") == []
    apply.click()
    becomes(shown, compatible=("In", "Out"))
    shown.saved(NAME)
    assert file.read_text().count('qos:durability="transient_local"') == 2
    shown.press("Control+z")
    becomes(shown, incompatible=("In", "Out"))


def test_forms_of_other_tools_become_plain_words_in_one_step(checks, file):
    codes = {**ZEROS, "reliability": "1", "deadline": "2"}
    more = (Event("Fame", CATCH, "t", None, FAME), Event("Zero", CATCH, "t", ZEROS))
    shown = checks(pair(codes, {"reliability": "reliable"}, more))
    offer = panel(shown).locator(".convert")
    offer.get_by_text("The QoS of 3 events has the form of another tool").wait_for()
    offer.get_by_role("button", name="Remove the zeros").click()
    shown.page.wait_for_function("() => document.querySelector('.panel .convert').textContent.includes('2 events')")
    offer.get_by_role("button", name="Write them in plain words").click()
    offer.wait_for(state="hidden")
    shown.saved(NAME)
    text = file.read_text()
    assert "qos:policy" not in text
    assert '="0"' not in text
    assert text.count('qos:reliability="reliable"') == 3
    assert 'qos:durability="transient_local"' in text
    shown.press("Control+z")
    shown.page.wait_for_function("() => document.querySelector('.panel .convert').textContent.includes('2 events')")


def test_properties_of_an_engine_are_shown_fixed_and_offered_as_plain_words(checks, file):
    properties = '<c:properties xmlns:c="http://camunda.org/schema/1.0/bpmn"><c:property name="colour" value="red"/>{}</c:properties>'
    stated = properties.format('<c:property name="reliability" value="0"/>')
    out = Event("Out", THROW, "t", None, stated)
    shown = checks(drawing(Pool("A", (out,)), Pool("B", (Event("In", CATCH, "t", {"reliability": "reliable"}),))))
    becomes(shown, incompatible=("In", "Out"))
    shown.choose("Out")
    offer = panel(shown).locator(".convert", has_text="has the form of another tool")
    offer.wait_for()
    panel(shown).locator(".fix-button").first.click()
    becomes(shown, compatible=("In", "Out"))
    offer.get_by_role("button", name="Write it in plain words").click()
    offer.wait_for(state="hidden")
    becomes(shown, compatible=("In", "Out"))
    shown.saved(NAME)
    text = file.read_text()
    assert 'qos:reliability="reliable"' in text[text.index('id="Out"') :].partition(">")[0]
    assert properties.format("") in text


def test_problems_are_filtered_and_lead_to_the_setting(paper):
    papers_edit(paper)
    lists(paper, "ROS101", "ROS104", of=ERROR)
    paper.page.get_by_role("button", name=re.compile("notes")).click()
    assert len(problems(paper)) > 2
    paper.page.get_by_role("button", name=re.compile("errors")).click()
    assert not {"ROS101", "ROS104"} & set(problems(paper))
    paper.page.get_by_role("button", name=re.compile("errors")).click()
    paper.choose("Drone_TakeOff")
    paper.page.locator(".problem-line", has_text="ROS104").click()
    assert paper.page.locator(".djs-shape.selected").get_attribute("data-element-id") == CATCH_REQUEST
    liveliness = panel(paper).locator('[data-policy="liveliness"]')
    assert liveliness.get_attribute("data-problem") == "error"
    box = liveliness.bounding_box()
    assert 0 < box["y"] < 700
    paper.choose("Drone_TakeOff")
    paper.page.get_by_role("tab", name="Topic matrix").click()
    paper.page.get_by_role("button", name="Weather station: Req weather data: incompatible").click()
    assert paper.page.locator(".djs-shape.selected").get_attribute("data-element-id") == CATCH_REQUEST
    assert panel(paper).locator('[data-policy="reliability"] :focus').count() == 1


def test_words_of_verdicts_give_way_where_they_would_lie_over_each_other(checks):
    near = [Event(f"E{number}", THROW, "t") for number in range(2)]
    shown = checks(drawing(Pool("A", tuple(near)), Pool("B", (Event("In", CATCH, "t"),))))
    word = shown.page.locator(".qos-badge span").first
    word.wait_for()
    assert word.bounding_box()["height"] >= 11
    for _ in range(3):
        shown.page.get_by_role("button", name="Zoom out").click()
    word.wait_for(state="hidden")
    assert shown.page.locator(".qos-badge .glyph").first.bounding_box()["width"] >= 12


@pytest.mark.explored
def test_many_events_are_marked_and_one_edit_changes_two(checks):
    events = 1000 if EXPLORE else 200
    shown = checks(many(events))
    shown.page.wait_for_function(f"() => document.querySelectorAll('.qos-badge').length === {events}")
    assert len(marks(shown, "compatible")) == events
    reveal(shown, "line1", "Throw_1")
    field(shown, "Reliability").select_option("best_effort")
    shown.page.wait_for_timeout(100)
    reveal(shown, "line1", "Catch_1")
    field(shown, "Reliability").select_option("reliable")
    shown.page.wait_for_function("() => document.querySelectorAll('.djs-element.qos-incompatible').length === 2")
    assert marks(shown, "incompatible") == ["Catch_1", "Throw_1"]


def test_a_move_asks_the_service_nothing(checks):
    shown = checks(pair())
    becomes(shown, compatible=("In", "Out"))
    asked = []
    shown.on("request", lambda request: asked.append(request.url))
    shown.choose("In").press("ArrowDown", "ArrowDown")
    shown.page.wait_for_timeout(600)
    assert [each for each in asked if "/cqos.v1." in each] == []
    field(shown, "Depth").fill("3")
    field(shown, "Depth").press("Enter")
    shown.page.wait_for_timeout(600)
    assert [each.rpartition("/")[2] for each in asked if "/cqos.v1." in each] == ["EditSession"]


def test_panel_problems_and_matrix_have_no_findings_of_axe(paper):
    papers_edit(paper)
    paper.page.wait_for_selector(".problem")
    paper.page.evaluate("() => document.querySelectorAll('.panel details').forEach(each => { each.open = true; })")
    paper.page.locator(".problem-line").first.click()
    for tab in ("Problems", "Topic matrix", "Other documents"):
        paper.page.get_by_role("tab", name=tab).click()
        assert violations(paper.page, ".panel, .bottom") == []
