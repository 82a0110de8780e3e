"""The control flow of a BPMN model as a graph: nodes, timers, loops, calls, and what they throw and catch."""

from __future__ import annotations

import copy
import pickle
from fractions import Fraction

import pytest

import cqos_core as cqos
from cqos_core.files.system_merge import merge
from cqos_core.model.flow import ControlFlow, FlowNode, Timer, Trigger
from tests.importers.test_bpmn import read_model

SIGNAL = '<bpmn:signal id="S" name="t"/>'
THROW = '<bpmn:signalEventDefinition signalRef="S"/>'
FLOWS = '<bpmn:sequenceFlow sourceRef="a" targetRef="b"/>'


def flow_of(body: str, pools: str = "") -> ControlFlow:
    """Read the one process of a model, with a flow from `a` to `b`."""
    pools = pools and f"<bpmn:collaboration>{pools}</bpmn:collaboration>"
    system = read_model(f'{SIGNAL}{pools}<bpmn:process id="P">{body}{FLOWS}</bpmn:process>')
    (flow,) = system.flows
    return flow


def nodes_of(body: str, pools: str = "") -> dict[str, FlowNode]:
    return {node.id: node for node in flow_of(body, pools).nodes}


def timer_of(text: str) -> Timer | None:
    timer = f'<bpmn:startEvent id="a"><bpmn:timerEventDefinition>{text}</bpmn:timerEventDefinition></bpmn:startEvent>'
    (trigger,) = nodes_of(f'{timer}<bpmn:endEvent id="b"/>')["a"].triggers
    return trigger.timer


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("PT6H", 21_600),
        ("P1DT2H3M4.5S", Fraction(187_569, 2)),
        ("PT0,5S", Fraction(1, 2)),
        ("P1W", 7 * 86_400),
        ("P1M", 28 * 86_400),
        ("P1Y", 365 * 86_400),
        ("PT0S", 0),
        *[(each, None) for each in ("P", "PT", "P1DT", "6h", "-PT1S", "PT-1S", "${wait}", "= wait", "0 0 * * *")],
    ],
)
def test_durations(text, seconds):
    timer = timer_of(f"<bpmn:timeDuration>{text}</bpmn:timeDuration>")
    assert timer is not None
    assert timer.wait == (None if seconds is None else seconds * 10**9)


@pytest.mark.parametrize(
    ("text", "wait", "count"),
    [
        ("R/PT6H", 21_600, None),
        ("R3/PT1S", 1, 4),
        ("R1/PT1S", 1, 2),
        ("R0/PT1S", 1, None),
        ("R-1/PT1S", 1, None),
        ("R/2026-01-01T00:00:00+02:00/PT1S", 1, None),
        ("R5/PT1S/2026-01-01", 1, 6),
        *[(each, None, None) for each in ("PT1S", "R/", "R/x", "R/PT1S/PT2S", "R/a/PT1S/b", "0 0/5 * * * ?", "")],
    ],
)
def test_cycles(text, wait, count):
    timer = timer_of(f"<bpmn:timeCycle> {text}\n</bpmn:timeCycle>")
    assert timer == Timer("cycle", None if wait is None else wait * 10**9, None, count, text)


def test_other_timers():
    assert timer_of("<bpmn:timeDuration>PT1S</bpmn:timeDuration>") == Timer("duration", 10**9, 10**9, 1, "PT1S")
    assert timer_of("<bpmn:timeDate>2026-01-01</bpmn:timeDate>") == Timer("date", count=1, text="2026-01-01")
    nothing = timer_of("")
    several = timer_of("<bpmn:timeDate>2026-01-01</bpmn:timeDate><bpmn:timeDuration>PT1S</bpmn:timeDuration>")
    assert nothing == several == Timer("cycle")


def test_a_diagram_without_sequence_flows_draws_no_control_flow():
    pool = '<bpmn:collaboration><bpmn:participant id="A" processRef="P"/></bpmn:collaboration>'
    process = '<bpmn:process id="P"><bpmn:startEvent id="a"/></bpmn:process>'
    assert read_model(pool + process).flows == ()
    # Other files may call it.
    assert [each.flows for each in read_model(process).flows] == [()]


def test_nodes_flows_and_endpoints():
    flow = flow_of(
        f"""<bpmn:startEvent id="a"/><bpmn:subProcess id="b"><bpmn:endEvent id="c">{THROW}</bpmn:endEvent>
        </bpmn:subProcess><bpmn:boundaryEvent id="d" attachedToRef="b" cancelActivity="false">{THROW}</bpmn:boundaryEvent>
        <bpmn:eventBasedGateway id="e"/><bpmn:receiveTask id="f" instantiate="true"/>
        <bpmn:subProcess id="g" triggeredByEvent="true"/><bpmn:task id="h" isForCompensation="true"/>"""
    )
    found = [(each.id, each.kind, each.parent, each.endpoints) for each in sorted(flow.nodes, key=lambda each: each.id)]
    assert found == [
        ("P", "process", None, ()),
        ("a", "start", 0, ()),
        ("b", "subprocess", 0, ()),
        ("c", "end", 2, ("c",)),
        ("d", "boundary", 0, ("d",)),
        ("e", "event_based", 0, ()),
        ("f", "event_start", 0, ()),
        ("g", "subprocess", 0, ()),
        ("h", "task", 0, ()),
    ]
    by_id = {node.id: node for node in flow.nodes}
    assert flow.flows == ((1, 2),)
    assert (by_id["d"].attached, by_id["d"].interrupting, by_id["c"].triggers) == (2, False, (Trigger("signal"),))
    assert (by_id["g"].by_event, by_id["h"].compensates) == (True, True)


def test_what_a_flow_or_an_id_does_not_tell_is_unknown():
    flow = flow_of('<bpmn:startEvent id="a"/>')
    assert [(each.id, each.kind) for each in flow.nodes] == [("P", "process"), ("a", "start"), ("b", "unknown")]
    flow = flow_of('<bpmn:startEvent id="a"/><bpmn:task id="b"/><bpmn:task id="b"/>')
    assert [flow.nodes[end].kind for end in flow.flows[0]] == ["start", "unknown"]


@pytest.mark.parametrize(
    ("loop", "times", "least"),
    [
        ("", 1, 1),
        ("<bpmn:standardLoopCharacteristics loopMaximum='3'/>", 3, 1),
        ("<bpmn:standardLoopCharacteristics testBefore='true'/>", None, 0),
        (
            "<bpmn:multiInstanceLoopCharacteristics><bpmn:loopCardinality>10</bpmn:loopCardinality></bpmn:multiInstanceLoopCharacteristics>",
            10,
            10,
        ),
        (
            "<bpmn:multiInstanceLoopCharacteristics><bpmn:loopCardinality>${n}</bpmn:loopCardinality></bpmn:multiInstanceLoopCharacteristics>",
            None,
            0,
        ),
        ("<bpmn:multiInstanceLoopCharacteristics isSequential='true'/>", None, 0),
        (
            "<bpmn:multiInstanceLoopCharacteristics xmlns:c='http://c' c:collection='all'><bpmn:loopCardinality>2</bpmn:loopCardinality></bpmn:multiInstanceLoopCharacteristics>",
            None,
            0,
        ),
    ],
)
def test_loops(loop, times, least):
    node = nodes_of(f'<bpmn:startEvent id="a"/><bpmn:subProcess id="b">{loop}</bpmn:subProcess>')["b"]
    assert (node.times, node.least_times) == (times, least)


@pytest.mark.parametrize(
    ("mark", "several"),
    [
        ("", 1),
        ('<bpmn:participantMultiplicity maximum="3"/>', 3),
        ("<bpmn:participantMultiplicity/>", None),
        ('<bpmn:participantMultiplicity maximum="0"/>', None),
    ],
)
def test_participants_of_a_process(mark, several):
    pools = f'<bpmn:participant id="A" processRef="P">{mark}</bpmn:participant>'
    assert nodes_of('<bpmn:startEvent id="a"/>', pools)["P"].participants == (("A", several),)


def test_calls():
    body = """<bpmn:callActivity id="a" calledElement="Q"/><bpmn:callActivity id="b"/>
        <bpmn:callActivity id="c" calledElement="${q}"/><bpmn:callActivity id="d" calledElement="elsewhere"/>"""
    system = read_model(
        f'<bpmn:process id="P">{body}{FLOWS}</bpmn:process><bpmn:process id="Q"><bpmn:task id="t"/></bpmn:process>'
    )
    (flow,) = system.flows
    found = {node.id: (node.calls, node.called) for node in flow.nodes if node.kind == "call"}
    at = next(position for position, node in enumerate(flow.nodes) if node.id == "Q")
    assert found == {"a": (at, "Q"), "b": (None, ""), "c": (None, None), "d": (None, "elsewhere")}
    called = flow.nodes[at]
    assert (called.has_pool, called.participants) == (False, (("P", 1),))


def test_event_definitions_at_root_level_and_of_several_kinds():
    body = f"""<bpmn:startEvent id="a" parallelMultiple="true">{THROW}<bpmn:eventDefinitionRef>D</bpmn:eventDefinitionRef>
        <bpmn:eventDefinitionRef>gone</bpmn:eventDefinitionRef><bpmn:compensateEventDefinition/></bpmn:startEvent>"""
    definition = '<bpmn:linkEventDefinition id="D" name="L"/>'
    (flow,) = read_model(f'{SIGNAL}{definition}<bpmn:process id="P">{body}{FLOWS}</bpmn:process>').flows
    node = next(node for node in flow.nodes if node.id == "a")
    assert node.all_triggers
    assert node.triggers == (
        Trigger("signal"),
        Trigger("link", link="L"),
        Trigger("unknown"),
        Trigger("compensation"),
    )


def test_control_flow_is_copied_pickled_and_merged():
    texts = [
        f'{SIGNAL}<bpmn:process id="{name}"><bpmn:startEvent id="a"/><bpmn:endEvent id="b">{THROW}</bpmn:endEvent>{FLOWS}</bpmn:process>'
        for name in "PQ"
    ]
    one, other = map(read_model, texts)
    assert copy.deepcopy(one) == one == pickle.loads(pickle.dumps(one))  # noqa: S301 - our own
    assert [flow.nodes[0].id for flow in merge([one, other]).flows] == ["P", "Q"]
    assert cqos.read("examples/smart_agriculture.bpmn").flows[0].source == "examples/smart_agriculture.bpmn"


MESSAGE = "<bpmn:messageEventDefinition/>"
SENDER = (
    f'<bpmn:process id="Q"><bpmn:sendTask id="c"/><bpmn:endEvent id="d">{MESSAGE}</bpmn:endEvent>'
    '<bpmn:sequenceFlow sourceRef="c" targetRef="d"/></bpmn:process>'
)
POOLS = '<bpmn:participant id="A" processRef="P"/><bpmn:participant id="B" processRef="Q"/><bpmn:participant id="E"/>'


@pytest.mark.parametrize(
    ("flows", "read"),
    [
        ("c>b", ["c>b"]),
        ("c>b d>b", ["c>b", "d>b"]),
        ("c>b d>E", ["c>b"]),
        ("c>i b>a", ["c>i"]),
        ("", []),
        ("E>b", []),
        ("c>b E>b", []),
        ("c>b B>b", []),
        ("c>b gone>b", []),
        ("c>b d>A", []),
        ("c>i d>u", []),
        ("c>b d>u", ["c>b"]),
        ("c>a", []),
    ],
)
def test_message_flows_to_an_event_are_read_if_only_nodes_send_there(flows, read):
    pools = "".join(
        f'<bpmn:messageFlow sourceRef="{a}" targetRef="{b}"/>' for a, b in (each.split(">") for each in flows.split())
    )
    inside = f'<bpmn:subProcess id="u"><bpmn:intermediateCatchEvent id="i">{MESSAGE}</bpmn:intermediateCatchEvent></bpmn:subProcess>'
    waits = f'<bpmn:task id="a"/><bpmn:intermediateCatchEvent id="b">{MESSAGE}</bpmn:intermediateCatchEvent>{inside}'
    process = f'<bpmn:process id="P">{waits}{FLOWS}</bpmn:process>{SENDER}'
    (flow,) = read_model(f"<bpmn:collaboration>{POOLS}{pools}</bpmn:collaboration>{process}").flows
    names = [each.id for each in flow.nodes]
    assert [f"{names[source]}>{names[target]}" for source, target in flow.messages] == read
