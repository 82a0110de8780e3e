"""The analyses of control flow: what they cost, and that every way to a report gives the same findings."""

from __future__ import annotations

import sys
from random import Random
from typing import TYPE_CHECKING, get_args

import pytest

import cqos_core as cqos
from cqos_core.behaviour.analysis import behaviour_of
from cqos_core.behaviour.graph import Wiring
from cqos_core.bpmn import read
from cqos_core.model.flow import (
    WITHIN,
    ControlFlow,
    EventKind,
    FlowEnds,
    FlowNode,
    FlowRunner,
    NodeKind,
    Timer,
    Trigger,
    TriggerKind,
)
from cqos_core.model.problems import InputError
from cqos_core.model.source import ReadContext, Source
from tests.behaviour.model_text import model
from tests.command_process import run_here

if TYPE_CHECKING:
    from types import FrameType


KINDS: tuple[NodeKind, ...] = (
    "task",
    "throw",
    "catch",
    "exclusive",
    "parallel",
    "event_based",
    "inclusive",
    "task",
    "subprocess",
    "boundary",
)
SECOND = 10**9


def random_flow(size: int, seed: int) -> tuple[ControlFlow, Wiring]:
    """Return a random graph of some processes with timers, gateways, sub-processes and loops, and signals among its events."""
    random = Random(seed)  # noqa: S311 - the same models each time
    nodes: list[FlowNode] = []
    flows: list[FlowEnds] = []
    thrown: dict[tuple[str, str], frozenset[object]] = {}
    caught: dict[tuple[str, str], frozenset[object]] = {}
    while len(nodes) < size:
        process = len(nodes)
        nodes.append(FlowNode(f"P{process}", "process", None, participants=(FlowRunner(f"A{process}"),)))
        around, members = process, [len(nodes)]
        nodes.append(_start(random, len(nodes), process, caught))
        for _ in range(random.randint(3, 25)):
            at = len(nodes)
            kind: NodeKind = random.choice(KINDS)
            known = [each for each in members if nodes[each].parent == around]
            if kind == "boundary":
                attached = [each for each in known if nodes[each].kind in {"task", "subprocess"}]
                if not attached:
                    continue
                nodes.append(FlowNode(f"n{at}", "boundary", around, (Trigger("error"),), attached=attached[0]))
            else:
                nodes.append(_node(random, kind, at, around, thrown, caught))
            members.append(at)
            before = random.sample(known, min(len(known), random.choice((1, 1, 1, 2)))) if kind != "boundary" else []
            flows += [FlowEnds(source, at) for source in before]
            if random.random() < 0.15 and known:
                flows.append(FlowEnds(at, random.choice(known)))
            if kind == "subprocess":
                around = at
                nodes.append(FlowNode(f"n{at + 1}", "start", at))
                members.append(at + 1)
            elif random.random() < 0.2:
                around = process
    return ControlFlow("x.bpmn", tuple(nodes), tuple(flows)), Wiring(thrown, caught)


def _start(random: Random, at: int, process: int, caught: dict[tuple[str, str], frozenset[object]]) -> FlowNode:
    chosen = random.randint(0, 2)
    if chosen == 0:
        return FlowNode(f"n{at}", "start", process)
    if chosen == 1:
        return FlowNode(f"n{at}", "start", process, (Trigger("timer", Timer("cycle", 60 * SECOND)),))
    caught["x.bpmn", f"n{at}"] = frozenset({("p", f"t{random.randint(0, at)}")})
    return FlowNode(f"n{at}", "start", process, (Trigger("signal"),), endpoints=(f"n{at}",))


def _node(
    random: Random,
    kind: NodeKind,
    at: int,
    around: int,
    thrown: dict[tuple[str, str], frozenset[object]],
    caught: dict[tuple[str, str], frozenset[object]],
) -> FlowNode:
    if kind in {"throw", "catch"} and random.random() < 0.5:
        (thrown if kind == "throw" else caught)["x.bpmn", f"n{at}"] = frozenset({("p", f"t{random.randint(0, at)}")})
        return FlowNode(f"n{at}", kind, around, (Trigger("signal"),), endpoints=(f"n{at}",))
    if kind == "catch":
        return FlowNode(f"n{at}", kind, around, (Trigger("timer", Timer("duration", SECOND, SECOND, 1)),))
    return FlowNode(f"n{at}", kind, around)


def calls(flow: ControlFlow, signals: Wiring) -> int:
    """Return how many functions are called by all analyses together."""
    number = 0

    def count(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal number
        number += event in {"call", "c_call"}

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        behaviour = behaviour_of([flow], signals)
        assert behaviour.reachable.fired
        assert behaviour.reachable_alone.fired <= behaviour.reachable.fired
        assert len(behaviour.rates.bounds) >= len(flow.nodes)
        assert behaviour.order.since(1, 1) == 0
    finally:
        sys.setprofile(before)
    return number


def test_the_cost_is_linear_in_the_size_of_the_model():
    cost = {size: sum(calls(*random_flow(size, seed)) for seed in range(8)) for size in (10, 100, 1_000)}
    each = {size: cost[size] / size for size in cost}
    assert each[1_000] < 1.5 * each[100] < 3 * each[10], each


def test_what_never_happens_is_counted_as_never():
    for seed in range(30):
        flow, signals = random_flow(200, seed)
        behaviour = behaviour_of([flow], signals)
        for at, bound in enumerate(behaviour.rates.bounds[: len(flow.nodes)]):
            if bound is not None and bound.once == 0 and bound.rate == 0:
                continue
            if bound is not None:
                assert bound.once >= 0, at
                assert bound.rate >= 0, at


TIMED = {"A": "s: start R/PT6H\n p: throw x deadline=2\n s -> p -> e", "B": "c: start x deadline=2 need.max_gap=1h"}


def codes(report: cqos.Report | cqos.PairReport) -> set[str]:
    return {each.code for each in report.findings if each.code.startswith("BP")}


def test_a_session_equals_a_fresh_check():
    drawings = [
        model(TIMED),
        model({**TIMED, "A": TIMED["A"].replace("PT6H", "PT1H")}),
        model({**TIMED, "A": TIMED["A"].replace("R/PT6H", "")}),
        model({**TIMED, "B": "c: start x"}),
        model({"A": "ca: start x\n py: end y\n ca -> py", "B": "cy: start y\n px: end x\n cy -> px"}),
        model({"A": "s: task", "B": "c: start x"}),
    ]
    systems = [read(Source("x.bpmn", each), ReadContext()) for each in drawings]
    session = cqos.Session(systems[0])
    session.report()
    for system in (*systems[1:], *systems):
        for each in session.system.endpoints:
            session.remove(each.id)
        for participant in system.participants.values():
            session.put_participant(participant)
        for each in system.endpoints:
            session.put(each)
        session.set_flows(system.flows)
        fresh = cqos.Session(session.system).report()
        assert session.report() == fresh
        assert codes(fresh) == codes(cqos.check(system))


def test_an_edited_endpoint_stays_the_one_that_is_drawn():
    system = read(Source("x.bpmn", model(TIMED)), ReadContext())
    session = cqos.Session(system)
    assert "BP101" in codes(session.report())
    (end,) = [each for each in session.system.endpoints if each.id == "p"]
    end.settings["deadline"] = cqos.Setting("21601")
    session.put(end)
    assert "BP101" not in codes(session.report())
    end.settings["deadline"] = cqos.Setting("2")
    end.place = None
    session.put(end)
    assert "BP101" in codes(session.report())


def test_files_that_use_one_id_are_kept_apart():
    one = read(Source("one.bpmn", model(TIMED)), ReadContext())
    other = read(
        Source("other.bpmn", model({"A": "s: start R/PT1S\n p: throw y deadline=2\n s -> p -> e"})), ReadContext()
    )
    found = [each for each in cqos.check(one, other).findings if each.code == "BP101"]
    assert [each.topic for each in found] == ["/x"]


def test_explain_has_the_findings_of_its_pair():
    pair = cqos.explain(model(TIMED), publisher="p", subscriber="c")
    assert codes(pair) == {"BP101", "BP102", "BP114"}
    assert pair.verdict == "incompatible"
    assert pair.derived == (
        ("mean_period_at_least of what `A` publishes", "6h: timer `s` fires every 6h"),
        ("mean_period_at_least of what `c` gets", "6h: timer `s` fires every 6h"),
    )


def test_what_is_stated_of_the_period_is_reported_once():
    text = model(TIMED).replace(b'name="x"', b'name="x" qos:period="6h"')
    report = cqos.check(text, importer="bpmn")
    assert "ROS318" not in {each.code for each in report.findings}
    assert "BP101" in codes(report)
    assert "ROS318" in {each.code for each in cqos.check(text.replace(b"R/PT6H", b"${t}"), importer="bpmn").findings}


def test_part_of_a_system_and_an_accepted_finding():
    system = read(Source("x.bpmn", model(TIMED)), ReadContext())
    system.partial = True
    assert not codes(cqos.check(system))
    accept = "<extensionElements><qos:accept rule='BP101' because='tested'/></extensionElements>"
    text = (
        model(TIMED)
        .decode()
        .replace(
            '<intermediateThrowEvent id="p" qos:deadline="2">',
            f'<intermediateThrowEvent id="p" qos:deadline="2">{accept}',
        )
    )
    (found,) = [each for each in cqos.check(text.encode(), importer="bpmn").findings if each.code == "BP101"]
    assert found.accepted == "tested"


@pytest.mark.parametrize(
    "flow",
    [
        ControlFlow("x", (FlowNode("t", "task", None),)),
        ControlFlow("x", (FlowNode("P", "process", None), FlowNode("t", "task", 1))),
        ControlFlow("x", (FlowNode("P", "process", None), FlowNode("t", "call", 0, calls=7))),
        ControlFlow("x", (FlowNode("P", "process", None),), (FlowEnds(0, 1),)),
        ControlFlow("x", (FlowNode("P", "process", None),), (), (FlowEnds(1, 0),)),
    ],
)
def test_a_graph_that_means_nothing_is_refused(flow):
    system = cqos.System(flows=(flow,))
    with pytest.raises(InputError, match="control flow of `x`"):
        cqos.check(system)


def test_a_reading_that_is_not_known_is_reported_and_assumes_all():
    pools = {
        "A": "s: start\n px: throw x\n py: end y\n s -> px -> py",
        "B": "cy: start y\n cx: catch x\n cy -> cx -> e",
    }
    report = cqos.check(model(pools, options=["bpmn.catch=standing"]), importer="bpmn")
    assert {"CQ208", "BP107"} <= {each.code for each in report.findings}


def test_the_command_takes_the_reading_as_an_option(tmp_path):
    pools = {
        "A": "s: start\n px: throw x\n py: end y\n s -> px -> py",
        "B": "cy: start y\n w: catch PT1S\n cx: catch x\n cy -> w -> cx -> e",
    }
    (tmp_path / "x.bpmn").write_bytes(model(pools))
    codes = {}
    for reading in ("at_token", "standing_buffered", "standing"):
        done = run_here(["check", "x.bpmn", "--option", f"bpmn.catch={reading}"], tmp_path)
        codes[reading] = done.code
    assert codes == {"at_token": 1, "standing_buffered": 0, "standing": 2}


def any_flow(seed: int) -> tuple[ControlFlow, Wiring]:
    """Return a graph of any nodes with any flows between them, such as no modeler draws and a client may send."""
    random = Random(seed)  # noqa: S311 - the same graphs each time
    nodes: list[FlowNode] = []
    thrown: dict[tuple[str, str], frozenset[object]] = {}
    caught: dict[tuple[str, str], frozenset[object]] = {}
    for at in range(random.randint(2, 40)):
        kind: NodeKind = "process" if at == 0 else random.choice(get_args(NodeKind))
        around = [position for position, node in enumerate(nodes) if node.kind in WITHIN]
        timer = Timer("duration", random.choice((None, 0, SECOND)), SECOND, random.choice((None, 1)))
        triggers = [Trigger(each, timer if each == "timer" else None) for each in get_args(TriggerKind)]
        topics = frozenset({f"t{random.randint(0, 3)}"})
        (thrown if kind in {"throw", "end", "task"} else caught)["x.bpmn", f"n{at}"] = topics
        nodes.append(
            FlowNode(
                f"n{at}",
                kind,
                None if kind == "process" else random.choice(around),
                tuple(random.sample(triggers, random.randint(0, 2))) if kind in get_args(EventKind) else (),
                interrupting=random.random() < 0.7,
                attached=random.randrange(at) if kind == "boundary" else None,
                by_event=kind == "subprocess" and random.random() < 0.3,
                times=random.choice((1, 2, None)),
                calls=0 if kind == "call" else None,
                endpoints=random.choice(((), (f"n{at}",))),
                participants=(FlowRunner("A", random.choice((1, None))),) if kind == "process" else (),
                has_pool=random.random() < 0.8,
            )
        )
    ends = [FlowEnds(random.randrange(len(nodes)), random.randrange(len(nodes))) for _ in range(len(nodes))]
    messages = [
        FlowEnds(random.randrange(len(nodes)), random.randrange(len(nodes))) for _ in range(random.randint(0, 9))
    ]
    return ControlFlow("x.bpmn", tuple(nodes), tuple(ends), tuple(messages)), Wiring(thrown, caught)


def test_any_graph_is_analysed():
    for seed in range(400):
        flow, wiring = any_flow(seed)
        behaviour = behaviour_of([flow], wiring)
        assert behaviour.reachable_alone.fired <= behaviour.reachable.fired, seed
        assert len(behaviour.rates.bounds) >= len(flow.nodes), seed
        assert behaviour.order.since(0, 0) == 0, seed


def test_a_conversion_to_yaml_says_that_it_has_no_control_flow(tmp_path):
    (tmp_path / "x.bpmn").write_bytes(model(TIMED))
    done = run_here(["convert", "x.bpmn", "--to", "yaml"], tmp_path)
    assert done.code == 0
    assert "control flow is left out, 6 nodes" in done.err
