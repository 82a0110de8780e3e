"""A save changes what was edited; before it rewrites a whole file, the page asks."""

import pytest

from tests.modeler.conftest import NAME, ROOT
from tests.modeler.test_page import differences

PAPER = (ROOT / "examples" / NAME).read_text(encoding="utf-8")
TASK = "Drone_TakeOff"


def renamed(shown, element, name):
    """Type a name into a shape, and wait until the model has it."""
    shown.choose(element).press("e")
    shown.page.wait_for_selector(".djs-direct-editing-content")
    shown.press("Control+a")
    shown.page.keyboard.insert_text(name)
    shown.press("Enter")
    shown.page.wait_for_selector(".djs-direct-editing-content", state="detached")
    return shown


def changed(before, after):
    """The lines that differ, without what bpmn-js notes of a label that it placed."""
    return [each for each in differences(before, after) if "<bpmndi:BPMNLabel />" not in each]


def test_a_file_in_another_encoding_keeps_it(opens, shared):
    before = PAPER.replace('encoding="UTF-8"', 'encoding="ISO-8859-1"').replace("Take off", "Täke off")
    assert "ISO-8859-1" in before
    shown = opens()
    shared[1].write_bytes(before.encode("latin-1"))
    shown.page.reload()
    shown.page.wait_for_selector(f'[data-element-id="{TASK}"]')
    renamed(shown, TASK, "Läuft für 5 €").saved(NAME)
    assert changed(before, shared[1].read_bytes().decode("latin-1")) == [
        f'-    <bpmn:scriptTask id="{TASK}" name="Täke off">',
        f'+    <bpmn:scriptTask id="{TASK}" name="Läuft für 5 &#8364;">',
    ]


def test_a_file_with_two_prefixes_for_one_namespace_is_not_rewritten(opens, shared):
    space = "http://www.omg.org/spec/BPMN/20100524/MODEL"
    before = (
        PAPER.replace("<bpmn:", "<").replace("</bpmn:", "</").replace("<definitions ", f'<definitions xmlns="{space}" ')
    )
    renamed(opens(before), TASK, "Fly").saved(NAME)
    assert changed(before, shared[1].read_text(encoding="utf-8")) == [
        f'-    <scriptTask id="{TASK}" name="Take off">',
        f'+    <scriptTask id="{TASK}" name="Fly">',
    ]


def test_a_gateway_without_the_mark_that_bpmn_js_sets_is_not_rewritten(opens, shared):
    before = PAPER.replace(' isMarkerVisible="true"', "")
    assert before != PAPER
    renamed(opens(before), TASK, "Fly").saved(NAME)
    assert len(changed(before, shared[1].read_text(encoding="utf-8"))) == 2


def shape(element, x, y, width=100, more=""):
    bounds = f'<dc:Bounds x="{x}" y="{y}" width="{width}" height="80"/>'
    return f'<bpmndi:BPMNShape id="{element}_di" bpmnElement="{element}"{more}>{bounds}<bpmndi:BPMNLabel/></bpmndi:BPMNShape>\n'


def edge(element, y, *columns):
    points = "".join(f'<di:waypoint x="{x}" y="{y}"/>' for x in columns)
    return f'<bpmndi:BPMNEdge id="{element}_di" bpmnElement="{element}">{points}</bpmndi:BPMNEdge>\n'


COLLAPSED = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
    'xmlns:bpmndi="http://www.omg.org/spec/BPMN/20100524/DI" xmlns:dc="http://www.omg.org/spec/DD/20100524/DC" '
    'xmlns:di="http://www.omg.org/spec/DD/20100524/DI" id="D" targetNamespace="t">\n<process id="P">\n'
    '<task id="Before" name="Before"/>\n<subProcess id="Sub" name="Sub">\n<task id="One" name="One"/>\n'
    '<task id="Two" name="Two"/>\n<sequenceFlow id="Inside" sourceRef="One" targetRef="Two"/>\n</subProcess>\n'
    '<task id="After" name="After"/>\n<sequenceFlow id="Into" sourceRef="Before" targetRef="Sub"/>\n'
    '<sequenceFlow id="Out" sourceRef="Sub" targetRef="After"/>\n</process>\n'
    '<bpmndi:BPMNDiagram id="Diagram"><bpmndi:BPMNPlane id="Plane" bpmnElement="P">\n'
    + shape("Before", 100, 100)
    + shape("Sub", 300, 100, more=' isExpanded="false"')
    + shape("After", 500, 100)
    + "%s"
    + edge("Into", 140, 200, 300)
    + edge("Out", 140, 400, 500)
    + "</bpmndi:BPMNPlane></bpmndi:BPMNDiagram>\n</definitions>\n"
)
INSIDE = shape("One", 310, 110) + shape("Two", 510, 110) + edge("Inside", 150, 410, 510)


@pytest.mark.parametrize("inside", [INSIDE, ""], ids=["drawn", "not drawn"])
def test_a_collapsed_sub_process_and_its_flows_stay_as_they_are(opens, shared, inside):
    before = COLLAPSED % inside
    shown = opens(before)
    renamed(shown, "After", "Later").saved(NAME)
    expected = ['-<task id="After" name="After"/>', '+<task id="After" name="Later"/>']
    assert changed(before, shared[1].read_text(encoding="utf-8")) == expected
    # Also after the page was loaded again with a draft.
    renamed(shown, "Before", "Sooner").kept()
    shown.on("dialog", lambda dialog: dialog.accept())
    shown.page.reload()
    shown.ready().notice("were recovered").wait_for()
    shown.saved(NAME)
    more = ['-<task id="Before" name="Before"/>', '+<task id="Before" name="Sooner"/>']
    assert changed(before, shared[1].read_text(encoding="utf-8")) == more + expected


def test_what_is_drawn_in_an_empty_sub_process_is_added(opens, shared):
    before = COLLAPSED % ""
    shown = opens(before)
    shown.choose("Sub").page.locator(".bjs-drilldown").click()
    shown.page.wait_for_selector(".bjs-breadcrumbs-shown")
    shown.page.locator('.djs-palette [data-action="create.end-event"]').click()
    shown.page.mouse.move(600, 250)
    shown.page.mouse.move(640, 260, steps=5)
    shown.page.mouse.click(640, 260)
    shown.press("Escape").saved(NAME)
    lines = differences(before, shared[1].read_text(encoding="utf-8"))
    assert [each for each in lines if "<endEvent" in each]
    assert [each for each in lines if each.startswith("-")] == []


DECLARED = PAPER.replace("<bpmn:definitions", "<!DOCTYPE bpmn:definitions>\n<!-- ours -->\n<bpmn:definitions", 1)


def test_the_page_asks_before_it_rewrites_a_whole_file(opens, shared):
    shown = opens(DECLARED)
    shown.page.evaluate("() => { delete window.showSaveFilePicker; }")  # no test can answer the dialog of the system
    renamed(shown, TASK, "Fly")
    dialog = shown.page.get_by_role("dialog", name=f"Rewrite all of {NAME}?")

    def answered(answer):
        shown.press("Control+s")
        dialog.get_by_text("the file has a document type (DOCTYPE). Comments would be lost").wait_for()
        assert shown.is_edited
        assert shared[1].read_text(encoding="utf-8") == DECLARED
        dialog.get_by_role("button", name=answer).click()
        dialog.wait_for(state="detached")

    answered("Cancel")
    with shown.page.expect_download() as waiting:
        answered("Save a copy")
    assert 'name="Fly"' in waiting.value.path().read_text(encoding="utf-8")
    answered("Rewrite the file")
    shown.page.wait_for_function("() => !document.title.startsWith('•')")
    text = shared[1].read_text(encoding="utf-8")
    assert 'name="Fly"' in text
    assert "<!--" not in text


def test_the_page_asks_before_a_file_becomes_utf_8(opens, shared):
    before = PAPER.replace('encoding="UTF-8"', 'encoding="Shift_JIS"')
    shown = opens(before)
    renamed(shown, TASK, "飛ぶ").press("Control+s")
    dialog = shown.page.get_by_role("dialog", name=f"Rewrite all of {NAME}?")
    dialog.get_by_text("the encoding Shift_JIS, which the page cannot write").wait_for()
    dialog.get_by_role("button", name="Rewrite the file").click()
    shown.page.wait_for_function("() => !document.title.startsWith('•')")
    lines = changed(before, shared[1].read_text(encoding="utf-8"))
    assert [each for each in lines if each.startswith("+")] == [
        '+<?xml version="1.0" encoding="UTF-8"?>',
        f'+    <bpmn:scriptTask id="{TASK}" name="飛ぶ">',
    ]
