"""The page in a real browser, with the real service: what a person does with a diagram and its file."""

import difflib
import re

import pytest

import cqos_core
from tests.browser import FLAGS, chromium, violations
from tests.modeler.conftest import NAME, ROOT, Shown, Tab
from tests.modeler.drawings import THROW, Event, Pool, drawing

PAPER = ROOT / "examples" / NAME
REQUEST = "Drone_ThrowReq"


def differences(before, after):
    """The lines that differ, with their sign."""
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm="")
    return [line for line in lines if line[:1] in "+-" and not line.startswith(("+++", "---"))]


def test_the_example_of_the_paper_is_saved_as_it_was_and_a_changed_name_is_the_only_difference(opened, example):
    before = example.read_bytes()
    assert opened.page.title() == "smart_agriculture.bpmn - C-QoS"
    assert opened.page.locator('.djs-shape[data-element-id="Participant_Station"]').count() == 1
    assert "#" not in opened.page.url
    opened.saved(example.name)
    assert example.read_bytes() == before
    opened.choose("Drone_TakeOff").press("e", "Control+a")
    opened.page.keyboard.type('Fly <b>"up"</b> & away')
    opened.page.mouse.click(500, 470)
    assert opened.is_edited
    opened.saved(example.name)
    assert not opened.is_edited
    assert differences(before.decode(), example.read_text()) == [
        '-    <bpmn:scriptTask id="Drone_TakeOff" name="Take off">',
        '+    <bpmn:scriptTask id="Drone_TakeOff" name="Fly &#60;b&#62;&#34;up&#34;&#60;/b&#62; &#38; away">',
        "+        <bpmndi:BPMNLabel />",  # bpmn-js notes that the label has no place of its own
    ]


LABEL = '        <bpmndi:BPMNLabel>\n          <dc:Bounds x="297" y="225" width="87" height="14" />\n        </bpmndi:BPMNLabel>\n'
LABELS = {
    "as tall as its text": LABEL,
    "taller": LABEL.replace('"14"', '"60"'),
    "none": "",
}
"""What a file may state of the label of REQUEST, whose size on the page depends on its fonts."""


@pytest.mark.parametrize("label", LABELS.values(), ids=LABELS)
def test_a_moved_shape_changes_its_place_only_and_undo_gives_the_same_bytes(opens, shared, label):
    before, example = PAPER.read_text(encoding="utf-8").replace(LABEL, label), shared[1]
    opened = opens(before)
    opened.choose(REQUEST).press("ArrowDown", "ArrowDown")
    opened.saved(example.name)
    changed = differences(before, example.read_text())
    assert changed
    assert [
        line for line in changed if not re.match(r"[+-]\s*<(dc:Bounds |di:waypoint |.?bpmndi:BPMNLabel>)", line)
    ] == []
    opened.press("Control+z", "Control+z")
    opened.saved(example.name)
    assert example.read_text() == before


def test_an_element_is_drawn_with_the_palette_and_saved_where_it_belongs(opened, example):
    before = example.read_text()
    opened.page.locator('.djs-palette [data-action="create.end-event"]').click()
    opened.page.mouse.move(600, 330)
    opened.page.mouse.move(640, 339, steps=5)
    opened.page.mouse.click(640, 339)
    opened.press("Escape")
    opened.saved(example.name)
    changed = differences(before, example.read_text())
    assert all(line.startswith("+") for line in changed)
    assert [line for line in changed if "<bpmn:endEvent id=" in line]
    assert "<bpmn:documentation>The smart agriculture case study" in example.read_text()


def test_a_new_diagram_has_no_problems_and_keyboard_alone_draws_a_pair(opens, shared):
    drawn = opens()
    drawn.page.locator(".list-note", has_text="Nothing to check yet").wait_for()
    assert drawn.page.locator(".problem").count() == 0
    assert drawn.page.locator(".status").text_content() == "No pairs yet"
    drawn.page.locator(".canvas svg").first.focus()
    drawn.press("n", "Enter")  # the first choice publishes
    drawn.page.wait_for_selector('.djs-shape[data-element-id^="Event_"]')
    drawn.press("n", "ArrowDown", "Enter")  # and behind it, a subscriber
    drawn.page.wait_for_function("() => document.querySelectorAll('.djs-shape[data-element-id^=Event_]').length >= 2")
    drawn.press("k").saved(NAME)
    text = shared[1].read_text()
    assert text.count("<bpmn:signalEventDefinition") == 2
    assert text.count("<bpmn:sequenceFlow ") == 1
    assert drawn.page.locator(".djs-shape.selected").count() == 1


def test_keyboard_alone_finds_and_fixes_the_incompatibility_of_the_paper(opens, shared):
    shown = opens((ROOT / "examples" / "smart_agriculture_incompatible.bpmn").read_text(encoding="utf-8"))
    shown.page.locator(".qos-badge-incompatible").first.wait_for()

    def until(key, reached):
        for _ in range(60):
            if shown.page.evaluate(reached):
                return
            shown.press(key)
        raise AssertionError(f"{key} does not lead there")

    until("Tab", "document.activeElement.matches('.canvas svg')")
    until("j", f"document.querySelector('.djs-shape.selected')?.dataset.elementId === '{REQUEST}'")
    for left in (1, 0):
        until("Tab", "document.activeElement.matches('.card[open] .fix-button')")
        shown.press("Enter")
        shown.page.wait_for_function(
            "left => document.querySelectorAll('.problem .severity-error').length === left", arg=left
        )
    shown.page.wait_for_function("() => document.querySelectorAll('.qos-badge-compatible').length === 4")
    shown.saved(NAME)
    assert cqos_core.check(shared[1]).verdict.value == "compatible"


def test_undo_and_redo_show_what_can_be_done_and_the_page_asks_before_changes_are_lost(opened):
    undo, redo = (opened.page.get_by_role("button", name=name) for name in ("Undo", "Redo"))
    assert undo.is_disabled()
    opened.choose(REQUEST).press("Delete")
    assert opened.page.locator(f'[data-element-id="{REQUEST}"]').count() == 0
    undo.click()
    assert opened.page.locator(f'.djs-shape[data-element-id="{REQUEST}"]').count() == 1
    assert not opened.is_edited
    redo.click()
    assert opened.page.locator(f'[data-element-id="{REQUEST}"]').count() == 0
    opened.page.get_by_role("button", name="New", exact=True).click()
    dialog = opened.page.get_by_role("dialog")
    assert "Save smart_agriculture.bpmn?" in dialog.text_content()
    dialog.get_by_role("button", name="Cancel").click()
    assert opened.page.title().startswith("• smart_agriculture.bpmn")
    asked = []

    def stay(dialog):
        asked.append(dialog.type)
        dialog.dismiss()

    opened.on("dialog", stay)
    with opened.page.expect_event("dialog"):
        opened.page.close(run_before_unload=True)
    assert asked == ["beforeunload"]


def test_unsaved_work_comes_back_after_a_reload(opened, example):
    before = example.read_text()
    opened.on("dialog", lambda dialog: dialog.accept())
    opened.choose(REQUEST).press("Delete").kept()
    opened.page.reload()
    opened.ready()
    opened.notice("were recovered").wait_for()
    assert opened.is_edited
    assert opened.page.locator(f'[data-element-id="{REQUEST}"]').count() == 0
    assert example.read_text() == before
    opened.saved(example.name)
    assert f'id="{REQUEST}"' not in example.read_text()
    opened.page.reload()
    opened.ready()
    assert opened.notice("were recovered").count() == 0


def test_work_of_a_tab_that_is_gone_is_offered(opened):
    address = opened.own
    opened.choose(REQUEST).press("Delete").kept()
    opened.page.close()
    second = opened.context.new_page()
    opened.watch(second)
    opened.page = second
    second.goto(address)
    opened.ready()
    opened.notice("were kept").get_by_role("button", name="Recover").click()
    second.wait_for_function("() => document.title.startsWith('•')")
    assert second.locator(f'[data-element-id="{REQUEST}"]').count() == 0


def test_a_file_that_changed_on_disk_is_not_overwritten(opened, example):
    opened.expected = "412"
    theirs = example.read_text().replace('name="Drone"', 'name="Their drone"')
    opened.choose(REQUEST).press("ArrowDown")
    example.write_text(theirs)
    opened.notice("changed on disk").wait_for()
    opened.press("Control+s")
    opened.page.wait_for_timeout(300)
    assert example.read_text() == theirs
    opened.notice("changed on disk").get_by_role("button", name="Open the version on disk").click()
    opened.page.get_by_role("button", name="Discard my changes").click()
    opened.page.wait_for_selector("text=Their drone")
    assert not opened.is_edited


HOSTILE = '"><img src=x onerror="document.title=1"><script>document.title=2</script>'


def test_names_are_text_everywhere(opens):
    escaped = HOSTILE.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
    text = PAPER.read_text(encoding="utf-8")
    for name in ("Drone", "Take off", "Req weather data"):
        text = text.replace(f'name="{name}"', f'name="{escaped}"')
    opened = opens(text)
    opened.choose("Drone_TakeOff").choose(REQUEST)
    opened.choose("Participant_Drone", position={"x": 12, "y": 12})
    opened.page.get_by_role("tab", name="Topic matrix").click()
    assert HOSTILE in opened.page.locator(".topic-name").first.text_content()  # drawn only while its tab is open
    opened.page.get_by_role("tab", name="Problems").click()
    assert opened.page.title() == "smart_agriculture.bpmn - C-QoS"
    assert opened.page.locator("img[src=x]").count() == 0


def test_another_namespace_of_the_prefix_is_reported_and_corrected_by_a_save(opens, shared):
    right = PAPER.read_text(encoding="utf-8")
    opened = opens(right.replace('xmlns:qos="http://qos"', 'xmlns:qos="http://elsewhere"'))
    opened.notice("was bound to http://elsewhere").wait_for()
    assert opened.is_edited
    opened.saved(NAME)
    assert shared[1].read_text() == right


def test_references_with_prefixes_are_found_and_kept(opens, shared):
    text = PAPER.read_text(encoding="utf-8").replace("<bpmn:definitions ", '<bpmn:definitions xmlns:tns="http://t" ')
    text = re.sub(r'((?:signal|process|source|target)Ref="|<bpmn:(?:incoming|outgoing)>)', r"\1tns:", text)
    opened = opens(text)
    opened.page.wait_for_function("() => document.querySelectorAll('.qos-badge-compatible').length === 4")
    opened.choose("Drone_TakeOff").press("e", "Control+a")
    opened.page.keyboard.type("Fly")
    opened.press("Enter").saved(NAME)
    changed = differences(text, shared[1].read_text(encoding="utf-8"))
    assert [line.strip("+- ") for line in changed] == [
        '<bpmn:scriptTask id="Drone_TakeOff" name="Take off">',
        '<bpmn:scriptTask id="Drone_TakeOff" name="Fly">',
        "<bpmndi:BPMNLabel />",
    ]


FORMS = ROOT / "tests" / "importers" / "cases" / "bpmn"
CODES = """expected => {
    const codes = [...document.querySelectorAll('.problem .code')].map(each => each.textContent).sort();
    return codes.join() === expected;
}"""


def test_the_page_finds_in_files_of_other_tools_what_the_library_finds(opens):
    opened = opens()
    for name in ("fame.bpmn", "cqos_tool.bpmn", "activiti.bpmn20.xml", "nested_events.bpmn"):
        was_edited = opened.is_edited  # its elements were placed
        opened.page.evaluate(DROP, [name, (FORMS / name).read_text(encoding="utf-8")])
        if was_edited:
            opened.page.get_by_role("button", name="Discard changes").click()
        opened.page.wait_for_function(f"() => document.title.includes('{name}')")
        notes = opened.page.locator('.filter[data-severity="note"][aria-pressed="false"]')
        opened.page.locator(".filter").first.wait_for()
        if notes.count():
            notes.click()
        report = cqos_core.check(FORMS / name)
        # The marker of each event says that it has no partner.
        codes = sorted(each.code for each in report.findings if report.groups or each.code != "CQ404")
        opened.page.wait_for_function(CODES, arg=",".join(codes))
        if name == "fame.bpmn":
            opened.notice("2 warnings: unresolved reference <Flow_1>").wait_for()


def test_a_file_that_is_no_diagram_is_reported(opens):
    opened = opens('<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"><process></definitions>')
    opened.notice(f"{NAME} cannot be opened").wait_for()
    assert opened.page.title() == "diagram.bpmn - C-QoS"


def test_a_file_without_a_drawing_is_laid_out(opens, shared):
    paper = re.sub(
        r"\s*<bpmndi:BPMNDiagram.*</bpmndi:BPMNDiagram>", "", PAPER.read_text(encoding="utf-8"), flags=re.DOTALL
    )
    opened = opens(paper)
    opened.notice("has no drawing").wait_for()
    opened.page.wait_for_function("() => document.querySelectorAll('.qos-badge-compatible').length === 4")
    assert opened.page.locator(".djs-shape .djs-visual").count() > 20
    opened.saved(NAME)
    changed = differences(paper, shared[1].read_text(encoding="utf-8"))
    assert all(line.startswith("+") for line in changed)
    assert len([line for line in changed if "<bpmndi:BPMNEdge " in line]) == 17


MODEL = (
    '<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos" id="D" targetNamespace="t">\n'
    '<signal id="S" name="alarm"/><!-- two processes, no drawing -->\n'
)
SIGNAL = '<signalEventDefinition signalRef="S"/>'
SENDER = f"""<process id="P" name="Sender">
<startEvent id="Go"/><task id="A" name="Measure"/><subProcess id="Sub"><startEvent id="Begin"/><task id="In"/><subProcess id="Deep"><endEvent id="Out">{SIGNAL}</endEvent></subProcess>
<sequenceFlow id="F1" sourceRef="In" targetRef="Deep"/><sequenceFlow id="F2" sourceRef="Deep" targetRef="In"/><sequenceFlow id="F0" sourceRef="Begin" targetRef="In"/></subProcess>
<boundaryEvent id="Edge" attachedToRef="Sub">{SIGNAL}</boundaryEvent><task id="Self"/>
<sequenceFlow id="F3" sourceRef="A" targetRef="Sub"/><sequenceFlow id="F4" sourceRef="Edge" targetRef="A"/>
<sequenceFlow id="F6" sourceRef="Go" targetRef="A"/><sequenceFlow id="F5" sourceRef="Self" targetRef="Self"/>
</process>
"""
RECEIVER = f'<process id="Q" name="Receiver"><startEvent id="Caught">{SIGNAL}</startEvent></process>\n'
NODES = {"Go", "Begin", "A", "Sub", "In", "Deep", "Out", "Edge", "Self"}


def test_processes_that_cannot_be_drawn_are_named_kept_and_drawn_as_pools(opens, shared):
    model = f"{MODEL}{SENDER}{RECEIVER}</definitions>\n"
    opened = opens(model)
    notice = opened.notice("The drawing leaves out the process “Receiver”")
    notice.wait_for()

    def drawn():
        kinds = "all => all.map(each => each.dataset.elementId).filter(each => !each.endsWith('_label'))"
        return set(opened.page.locator(".djs-shape").evaluate_all(kinds))

    assert drawn() == NODES
    assert opened.page.locator(".djs-connection").count() == 7
    opened.page.wait_for_function("() => document.querySelectorAll('.qos-badge-compatible').length === 2")
    opened.choose("Out")
    opened.page.locator(".panel", has_text="Caught (not drawn)").wait_for()
    opened.saved(NAME)
    kept = shared[1].read_text(encoding="utf-8")
    assert [line[:13] for line in differences(model, kept) if line.startswith("-")] == [
        "-<definitions"
    ]  # further prefixes
    assert RECEIVER in kept

    notice.get_by_role("button", name="Draw each process as a pool").click()
    opened.page.wait_for_selector('.djs-shape[data-element-id="Caught"]')
    assert notice.count() == 0
    assert opened.is_edited
    assert drawn() == NODES | {"Caught", "Participant_P", "Participant_Q"}
    opened.page.wait_for_function("() => document.querySelectorAll('.qos-badge-compatible').length === 3")
    opened.saved(NAME)
    pooled = shared[1].read_text(encoding="utf-8")
    assert RECEIVER in pooled
    assert SENDER in pooled
    assert [line for line in differences(kept, pooled) if line.startswith("-") and "bpmndi" not in line] == []


DROP = """([name, text]) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([text], name));
    dispatchEvent(new DragEvent('drop', { dataTransfer, cancelable: true }));
}"""


def test_files_are_chosen_and_dropped_and_offered_again(opens):
    opened = opens()
    opened.page.evaluate("() => { delete window.showOpenFilePicker; }")  # no test can answer the dialog of the system
    with opened.page.expect_file_chooser() as waiting:
        opened.page.get_by_role("button", name="Open", exact=True).click()
    waiting.value.set_files(PAPER)
    opened.page.wait_for_function("() => document.title.startsWith('smart_agriculture.bpmn')")
    opened.page.wait_for_selector(f'.djs-shape[data-element-id="{REQUEST}"]')
    other = PAPER.read_text(encoding="utf-8").replace('name="Drone"', 'name="Dropped drone"')
    opened.page.evaluate(DROP, ["dropped.bpmn", other])
    opened.page.wait_for_function("() => document.title.startsWith('dropped.bpmn')")
    opened.page.evaluate(DROP, ["fleet.yaml", "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {t: {}}}}\n"])
    opened.page.locator(".document", has_text="fleet.yaml").wait_for()
    opened.page.get_by_role("button", name="Recent files").click()
    opened.page.get_by_role("menuitem", name="smart_agriculture.bpmn").last.click()
    opened.page.wait_for_function("() => document.title.startsWith('smart_agriculture.bpmn')")


PICKED = """async ([name, text]) => {
    const folder = await navigator.storage.getDirectory();
    const handle = await folder.getFileHandle(name, { create: true });
    window.put = async text => {
        const stream = await handle.createWritable();
        await stream.write(text);
        await stream.close();
    };
    window.got = async () => (await handle.getFile()).text();
    window.showOpenFilePicker = async () => [handle];
    await window.put(text);
}"""
"""Puts a file of the browser in place of what a person would choose in the dialog of the system."""


def test_a_file_that_the_browser_may_write_is_saved_in_place_and_never_overwritten(opens):
    opened = opens()
    text = PAPER.read_text(encoding="utf-8")
    opened.page.evaluate(PICKED, ["picked.bpmn", text])
    opened.page.get_by_role("button", name="Open", exact=True).click()
    opened.page.wait_for_function("() => document.title.startsWith('picked.bpmn')")
    opened.choose(REQUEST).press("Delete")
    opened.saved("picked.bpmn")
    mine = opened.page.evaluate("got()")
    assert f'id="{REQUEST}"' not in mine
    assert "The smart agriculture case study" in mine
    opened.page.evaluate("text => put(text)", text)
    opened.choose("Drone_TakeOff").press("Delete", "Control+s")
    opened.notice("changed on disk").wait_for()
    assert opened.page.evaluate("got()") == text
    opened.page.get_by_role("button", name="Recent files").click()
    opened.page.get_by_role("menuitem", name="picked.bpmn").wait_for()


def test_a_file_that_was_opened_beside_the_diagram_is_saved_in_place_once_it_is_the_diagram(opens, shared):
    opened = opens(PAPER.read_text(encoding="utf-8"))
    text = PAPER.read_text(encoding="utf-8").replace('name="Drone"', 'name="Picked drone"')
    opened.page.evaluate(PICKED, ["picked.bpmn", text])
    opened.page.get_by_role("tab", name="Other documents").click()
    opened.page.get_by_role("button", name="Open beside the diagram").click()
    opened.page.get_by_role("button", name="Show as the diagram").click()
    opened.page.wait_for_function("() => document.title.startsWith('picked.bpmn')")
    opened.choose(REQUEST).press("Delete")
    opened.saved("picked.bpmn")
    mine = opened.page.evaluate("got()")
    assert "Picked drone" in mine
    assert f'id="{REQUEST}"' not in mine
    opened.page.get_by_role("button", name="Show as the diagram").click()
    opened.page.wait_for_function(f"() => document.title.startsWith('{NAME}')")
    opened.choose(REQUEST).press("Delete")
    opened.saved(NAME)
    assert f'id="{REQUEST}"' not in shared[1].read_text(encoding="utf-8")
    assert opened.page.evaluate("got()") == mine


def test_the_drawing_is_exported_with_its_verdicts_and_without_variables_of_the_page(opened):
    opened.page.locator(".qos-badge").first.wait_for()
    opened.page.get_by_role("button", name="More ways to save").click()
    with opened.page.expect_download() as waiting:
        opened.page.get_by_role("menuitem", name="Export as SVG").click()
    text = waiting.value.path().read_text(encoding="utf-8")
    assert waiting.value.suggested_filename == "smart_agriculture.svg"
    assert "Req weather data" in " ".join(re.sub("<[^>]*>", " ", text).split())
    assert "var(" not in text
    assert len(re.findall(r'<text[^>]*class="verdict"[^>]*>compatible</text>', text)) == 4


SIZES = {"laptop": {"width": 1280, "height": 720}, "enlarged": {"width": 640, "height": 360}}


def test_every_state_can_be_reached_and_the_mark_of_bpmn_io_is_in_sight(opened):
    whole = """
        () => {
            const mark = document.querySelector('.bjs-powered-by');
            mark.scrollIntoView({ block: 'nearest' });
            const { left, top, right, bottom } = mark.getBoundingClientRect();
            const points = [[left + 2, top + 2], [right - 2, top + 2], [left + 2, bottom - 2], [right - 2, bottom - 2]];
            const seen = points.every(([x, y]) => mark.contains(document.elementFromPoint(x, y)));
            return seen && right - left > 50 && bottom - top > 20 && getComputedStyle(mark).opacity === '1';
        }
    """
    for size in SIZES.values():
        opened.page.set_viewport_size(size)
        for theme in ("dark", "light"):
            opened.page.emulate_media(color_scheme=theme)
            assert opened.page.evaluate(whole)
        opened.choose(REQUEST)
        assert opened.page.evaluate(whole)
        # Nothing is cut off at the right: at 200 % the page scrolls downwards only.
        assert opened.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        opened.press("Escape")


PALETTE = """() => {
    const palette = document.querySelector('.djs-palette');
    const entries = [...palette.querySelectorAll('.entry')].map(each => each.getBoundingClientRect());
    const edge = palette.getBoundingClientRect();
    return {
        columns: new Set(entries.map(({ left }) => Math.round(left))).size,
        hidden: entries.filter(({ left, right }) => left < edge.left || right > edge.left + palette.clientWidth + 1).length,
        scrolls: palette.scrollHeight > palette.clientHeight,
        bar: palette.offsetWidth - palette.clientWidth > 5,
    };
}"""
"""How the entries of the palette stand."""


def test_the_palette_is_whole_beside_scroll_bars_that_take_room(browser, shared, example):
    """As on most systems: playwright hides them otherwise."""
    shows = {"args": list(FLAGS), "ignore_default_args": ["--hide-scrollbars"]}
    other = browser.browser_type.launch(executable_path=chromium(), **shows)
    tab = Tab(other)
    for height, scrolls in ((720, False), (1080, False), (600, True)):
        shown = Shown(tab, shared[0].address, viewport={"width": 1280, "height": height})
        found = shown.page.evaluate(PALETTE)
        assert (found["hidden"], found["scrolls"], found["bar"]) == (0, scrolls, scrolls)
        assert found["columns"] == (1 if height == 1080 else 2)
        shown.choose(REQUEST).page.wait_for_selector(".panel .field")
        assert shown.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert shown.page.locator(".panel").evaluate("each => each.scrollWidth <= each.clientWidth")
        shown.close()
        assert shown.complaints == []
    other.close()


OUTSIDE = """selector => {
    const canvas = document.querySelector('.canvas').getBoundingClientRect();
    return [...document.querySelectorAll(selector)].filter(each => {
        const { left, top, right, bottom } = each.getBoundingClientRect();
        return left < canvas.left || top < canvas.top || right > canvas.right || bottom > canvas.bottom;
    }).length;
}"""
"""How many elements are not whole in the canvas."""
SHAPES = ".djs-shape > .djs-visual"


def test_the_view_is_zoomed_and_a_fitted_diagram_stays_so_in_another_window(opened):
    def zoom():
        return int(opened.page.locator(".bar .zoom").text_content().split()[0])

    fitted = zoom()
    assert opened.page.evaluate(OUTSIDE, SHAPES) == 0
    opened.page.set_viewport_size(SIZES["enlarged"])
    opened.page.wait_for_function(f"() => parseInt(document.querySelector('.bar .zoom').textContent) < {fitted}")
    assert opened.page.evaluate(OUTSIDE, SHAPES) == 0
    opened.page.set_viewport_size(SIZES["laptop"])
    opened.page.wait_for_function(f"() => parseInt(document.querySelector('.bar .zoom').textContent) === {fitted}")
    opened.page.get_by_role("button", name="Zoom in").click()
    opened.press("Control++")
    seen = zoom()
    assert seen == pytest.approx(fitted * 1.25**2, abs=1)
    assert opened.page.evaluate(OUTSIDE, SHAPES) > 0
    opened.page.set_viewport_size(SIZES["enlarged"])
    opened.page.wait_for_timeout(200)
    assert zoom() == seen
    opened.press("Control+-", "Control+-", "Control+0")
    assert zoom() == 100
    opened.press("Control+9")
    assert opened.page.evaluate(OUTSIDE, SHAPES) == 0


def test_the_entries_beside_a_shape_at_the_lower_edge_are_whole(opens):
    events = tuple(Event(f"E{number}", THROW, "t") for number in range(41))
    opened = opens(drawing(Pool("A", events)), viewport=SIZES["enlarged"])
    opened.choose("E40")
    opened.page.wait_for_function(f"() => ({OUTSIDE})('.djs-context-pad.open .entry') === 0")


def test_axe_finds_nothing(opened):
    opened.choose(REQUEST)
    opened.page.set_viewport_size(SIZES["enlarged"])
    assert violations(opened.page) == []
    opened.page.set_viewport_size(SIZES["laptop"])
    assert violations(opened.page) == []
    opened.page.get_by_role("button", name="Keyboard help").click()
    assert violations(opened.page, "dialog") == []
    opened.page.get_by_role("button", name="Close", exact=True).click()
    opened.page.get_by_role("button", name="Recent files").click()
    assert violations(opened.page, "[role=menu]") == []
    opened.press("Escape").choose(REQUEST).press("Delete")
    opened.page.get_by_role("button", name="New", exact=True).click()
    opened.page.get_by_role("dialog", name="Save").wait_for()
    assert violations(opened.page, "dialog") == []
