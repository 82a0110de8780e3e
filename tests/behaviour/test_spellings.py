"""Cases of behaviour that need a spelling of BPMN of their own: referred definitions, scopes of signals, message flows."""

from __future__ import annotations

import pytest

import cqos_core as cqos
from cqos_core.bpmn import read
from cqos_core.model.source import ReadContext, Source
from tests.behaviour.test_cases import reported

DEFINITIONS = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos" qos:protocol="ros2"
 xmlns:activiti="http://activiti.org/bpmn"><signal id="X" name="x"/>{top}
<collaboration id="C"><participant id="A" processRef="PA"/><participant id="B" processRef="PB"/>{flows}</collaboration>
<process id="PA">{a}</process><process id="PB">{b}</process></definitions>"""
SIGNAL = '<signalEventDefinition signalRef="X"/>'
TIMER = '<timerEventDefinition id="T"><timeCycle>R/PT6H</timeCycle></timerEventDefinition>'
CATCHING = f'<startEvent id="c">{SIGNAL}</startEvent>'


def findings(*, a: str, b: str = CATCHING, top: str = "", flows: str = "", messages: bool = False) -> list[str]:
    text = DEFINITIONS.format(a=a, b=b, top=top, flows=flows)
    options = {"bpmn": {"message_flows": "true"}} if messages else {}
    return reported(cqos.check(read(Source("x.bpmn", text.encode()), ReadContext(options=options))))


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        ("<eventDefinitionRef>T</eventDefinitionRef>", ["BP101 warning p"]),
        ("<eventDefinitionRef>T</eventDefinitionRef><eventDefinitionRef>M</eventDefinitionRef>", []),
        ("<eventDefinitionRef>T</eventDefinitionRef><eventDefinitionRef>T2</eventDefinitionRef>", ["BP101 warning p"]),
        ("<eventDefinitionRef>gone</eventDefinitionRef>", []),
    ],
    ids=["a timer", "a timer or a message", "two timers", "nothing that is there"],
)
def test_event_definitions_that_are_referred_to(start, expected):
    """Several definitions of an event add up: any of them is enough (spec. 4, trap 3)."""
    top = f'{TIMER}<messageEventDefinition id="M"/>{TIMER.replace(chr(34) + "T" + chr(34), chr(34) + "T2" + chr(34))}'
    throw = f'<intermediateThrowEvent id="p" qos:deadline="10799">{SIGNAL}</intermediateThrowEvent>'
    a = f'<startEvent id="s">{start}</startEvent>{throw}<sequenceFlow sourceRef="s" targetRef="p"/>'
    assert findings(a=a, top=top) == expected


def test_of_definitions_that_are_all_needed_the_slowest_counts():
    both = "<eventDefinitionRef>T</eventDefinitionRef><eventDefinitionRef>M</eventDefinitionRef>"
    a = (
        f'<startEvent id="s" parallelMultiple="true">{both}</startEvent>'
        f'<endEvent id="p" qos:deadline="2">{SIGNAL}</endEvent><sequenceFlow sourceRef="s" targetRef="p"/>'
    )
    assert findings(a=a, top=f'{TIMER}<messageEventDefinition id="M"/>') == ["BP101 warning p"]


def test_a_signal_of_one_instance_has_no_rate_for_others():
    """Signals with the scope `processInstance` never leave: a process that waits for one is not dead, and it limits no other."""
    waits = f'<intermediateCatchEvent id="w">{SIGNAL.replace("X", "I")}</intermediateCatchEvent>'
    sends = f'<endEvent id="p" qos:deadline="2">{SIGNAL}</endEvent>'
    flows = '<sequenceFlow sourceRef="s" targetRef="w"/><sequenceFlow sourceRef="w" targetRef="p"/>'
    signal = '<signal id="I" name="inside" {}/>'
    start = '<startEvent id="s"/>'
    scoped = signal.format('activiti:scope="processInstance"')
    assert findings(a=start + waits + sends + flows, top=scoped) == ["BP103 warning p"]
    assert "BP110 warning p" in findings(a=start + waits + sends + flows, top=signal.format(""))


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("p", ["BP101 warning p", "BP102 warning c"]),
        ("A", []),
    ],
    ids=["from a task", "from a black box"],
)
def test_message_flows_carry_rates_as_signals_do(source, expected):
    sends = '<sendTask id="p" qos:deadline="2"/>' if source == "p" else '<task id="p"/>'
    a = f'<startEvent id="s">{TIMER}</startEvent>{sends}<sequenceFlow sourceRef="s" targetRef="p"/>'
    b = (
        '<startEvent id="c" qos:deadline="2"><messageEventDefinition/></startEvent><task id="t"/>'
        '<sequenceFlow sourceRef="c" targetRef="t"/>'
    )
    flow = f'<messageFlow id="F" name="f" sourceRef="{source}" targetRef="c"/>'
    assert findings(a=a, b=b, flows=flow, messages=True) == expected
