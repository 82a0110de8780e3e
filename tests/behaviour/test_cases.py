"""The cases of behaviour: every example and every silent twin of the findings BP101 to BP118."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

import cqos_core as cqos
from cqos_core.bpmn import read
from cqos_core.model.source import ReadContext, Source
from tests.behaviour.model_text import model

CASES = Path(__file__).with_name("cases")


def cases() -> list[Any]:
    """Return all cases of all files, and their silent twins: the same model with a text replaced."""
    found = []
    for file in sorted(CASES.glob("*.yml")):
        for case in yaml.safe_load(file.read_text(encoding="utf-8")):
            twins = case.pop("twins", {})
            found.append(pytest.param(case, id=f"{file.stem}: {case['name']}"))
            for name, changes in twins.items():
                rest = {key: value for key, value in case.items() if key not in {"says", "worlds", "pairs"}}
                twin = {**rest, "expect": changes.pop("expect", []), "verdict": changes.pop("verdict", "compatible")}
                for old, new in changes.pop("replace", {}).items():
                    texts = {pool: text.replace(old, new) for pool, text in twin["model"].items()}
                    assert texts != twin["model"], f"{name}: nothing to replace: {old}"
                    twin["model"] = texts
                pools = {**twin["model"], **changes.pop("model", {})}
                twin |= {**changes, "model": {pool: text for pool, text in pools.items() if text is not None}}
                found.append(pytest.param(twin, id=f"{file.stem}: {case['name']}: {name}"))
    return found


def reported(report: cqos.Report) -> list[str]:
    """Return the findings about behaviour as `BP101 warning p`."""
    return sorted(
        f"{each.code} {each.severity} {','.join(each.sides[0].members)}"
        for each in report.findings
        if each.code.startswith("BP")
    )


@pytest.mark.parametrize("case", cases())
def test_case(case):
    text = model(
        case["model"],
        protocol=case.get("protocol", "ros2"),
        external=case.get("external", ()),
        options=case.get("options", ()),
    )
    report = cqos.check(text, importer="bpmn")
    assert reported(report) == sorted(case.get("expect", []))
    assert report.verdict == case.get("verdict", "compatible")
    for code, words in case.get("says", {}).items():
        assert any(words in str((each.message, each.notes)) for each in report.findings if each.code == code), [
            each.message for each in report.findings if each.code == code
        ]
    assert report.pair_count == case.get("pairs", report.pair_count)
    worlds = {name.partition("=")[2]: str(v) for each in report.findings for name, v in each.worlds.items()}
    assert worlds == case.get("worlds", worlds)


def test_a_flow_that_leads_to_nothing_may_lead_to_any_node_of_its_process():
    text = model(
        {
            "A": "s: start\n p: end x deadline=2\n q: end y\n s -> t -> u\n u -> q\n u2 -> p -> u2",
            "B": "c: start x\n d: start y",
        }
    )
    assert "BP111 error p" in reported(cqos.check(text, importer="bpmn"))
    assert reported(cqos.check(text.replace(b' targetRef="u"', b""), importer="bpmn")) == []
    assert reported(cqos.check(text.replace(b' targetRef="u"', b' targetRef="gone"'), importer="bpmn")) == []
    also = text.replace(
        b"</definitions>", b'<process id="E"><task id="o"/><sequenceFlow sourceRef="o"/></process></definitions>'
    )
    assert "BP111 error p" in reported(cqos.check(also, importer="bpmn"))
    both = also.replace(b' targetRef="u"', b"").replace(
        b'<process id="E">', b'<process id="E"><sequenceFlow targetRef="o"/>'
    )
    assert reported(cqos.check(both, importer="bpmn")) == []


MESSAGES = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos" qos:protocol="ros2">
<message id="M" name="m"/><collaboration id="C"><participant id="A" processRef="PA"/><participant id="B" processRef="PB"/>{flow}</collaboration>
<process id="PA"><startEvent id="s"><messageEventDefinition messageRef="M"/></startEvent>
<sendTask id="p" messageRef="M"/><sequenceFlow sourceRef="s" targetRef="p"/></process>
<process id="PB"><task id="t"/><sendTask id="q" messageRef="M"/></process></definitions>"""


def test_a_message_that_no_flow_brings_may_come_from_elsewhere():
    def findings(flow: str, text: str = MESSAGES) -> list[str]:
        source = Source("x.bpmn", text.format(flow=flow).encode())
        return reported(cqos.check(read(source, ReadContext(options={"bpmn": {"message_flows": "true"}}))))

    alone = MESSAGES.replace('<sendTask id="q" messageRef="M"/>', "")
    assert findings("", alone) == []
    assert findings('<messageFlow id="F" sourceRef="p" targetRef="s"/>', alone) == ["BP110 error p"]
    assert findings('<messageFlow id="F" sourceRef="B" targetRef="s"/>', alone) == []
