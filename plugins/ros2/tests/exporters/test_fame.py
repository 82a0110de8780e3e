"""What is written for FaMe modeler, as the reference on BPMN dialects describes its form."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.api import context
from cqos_core.files.source_reader import read_source
from cqos_core.model.source import Source
from cqos_core.packs.export import ExportContext
from cqos_core.plugins import load_plugins
from tests.command_process import run_here

EXAMPLES = Path(__file__).parents[4] / "examples"
HEAD = """<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos">
<bpmn:signal id="S" name="Laser scan"/><bpmn:process id="P" name="p">
"""
TAIL = '<bpmn:startEvent id="C"><bpmn:signalEventDefinition signalRef="S"/></bpmn:startEvent></bpmn:process></bpmn:definitions>'


PAYLOAD = "FaMe reads an event without `ros:payload` as a catch: add the payload of `T` there"


def model(attributes="", inside=""):
    return f'{HEAD}<bpmn:endEvent id="T"{attributes}>{inside}<bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>{TAIL}'


def read(text):
    return read_source(Source("model.bpmn", text.encode()), importer="bpmn")


def fame(system):
    return load_plugins().exporters["fame"].load()(system, ExportContext(context().find_pack, "ros2"))


def thrown(text):
    found = fame(read(text)).text
    return found[found.index("<bpmn:endEvent") : found.index("<bpmn:signalEventDefinition")]


def groups(system):
    return [(g.verdict, g.publishers, g.subscribers) for g in cqos.check(system, protocol="ros2").groups]


def test_the_paper_s_example_keeps_its_verdicts():
    system = cqos.read(EXAMPLES / "smart_agriculture.bpmn")
    found = fame(system)
    assert found.expressed == 4
    assert groups(read(found.text)) == groups(system)


def test_all_eight_policies_are_integers_and_the_topic_is_the_name():
    assert thrown(model(' qos:reliability="best_effort" qos:deadline="0.5"')) == (
        '<bpmn:endEvent id="T" name="laser_scan"><bpmn:extensionElements><qos:policy history="0" depth="10" reliability="0" '
        'durability="1" deadline="0.5" lifespan="0" liveliness="0" leaseDuration="0"/></bpmn:extensionElements>'
    )


def test_the_signal_has_the_name_of_the_event():
    assert '<bpmn:signal id="S" name="laser_scan"/>' in fame(read(model())).text


def test_the_message_type_stands_beside_the_policy():
    assert '<ros:message type="sensor_msgs/msg/LaserScan"/>' in thrown(model(' qos:type="sensor_msgs/msg/LaserScan"'))


def test_what_fame_wrote_stays_beside_the_policy():
    inside = (
        '<bpmn:documentation>d</bpmn:documentation><bpmn:extensionElements xmlns:ros="http://ros">'
        '<ros:payload><ros:parameter name="x" value="1"/></ros:payload><ros:message type="a/msg/B"/><qos:policy depth="3"/>'
        "</bpmn:extensionElements>"
    )
    written = thrown(model(inside=inside))
    assert written.count("qos:policy") == written.count("<ros:message") == 1
    assert 'depth="3"' in written
    assert '<ros:payload><ros:parameter name="x" value="1"/></ros:payload>' in written


def test_the_command_writes_topic_message_and_payload(tmp_path):
    payload = '<ros:payload><ros:parameter name="{&quot;data&quot;" value="${weather}}"/></ros:payload>'
    inside = f'<bpmn:extensionElements xmlns:ros="http://ros">{payload}</bpmn:extensionElements>'
    (tmp_path / "model.bpmn").write_text(model(' qos:reliability="reliable" qos:type="std_msgs/msg/String"', inside))
    done = run_here(["convert", "model.bpmn", "--to", "fame", "--no-config"], tmp_path)
    assert (done.code, "payload" in done.err) == (0, False)
    event = done.out[done.out.index("<bpmn:endEvent") : done.out.index("</bpmn:extensionElements>")]
    assert 'name="laser_scan"' in event
    assert '<ros:message type="std_msgs/msg/String"/>' in event
    assert payload in event
    assert 'reliability="1"' in event


def test_values_without_a_code_are_left_out_with_a_note():
    found = fame(read(model(' qos:liveliness="best_available"')))
    assert "liveliness=" not in found.text[: found.text.index("startEvent")]
    assert found.notes == ("`T`: liveliness is left out: FaMe has no code for best_available", PAYLOAD)


@pytest.mark.parametrize("attributes", [' qos:protocol="mqtt"'])
def test_events_of_other_protocols_stay(attributes):
    found = fame(read(model(attributes)))
    assert found.notes == ("1 endpoint of other protocols left out",)
    assert f'<bpmn:endEvent id="T"{attributes}>' in found.text


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "history": st.sampled_from(["keep_last", "keep_all"]),
            "depth": st.integers(1, 99).map(str),
            "reliability": st.sampled_from(["best_effort", "reliable"]),
            "durability": st.sampled_from(["volatile", "transient_local"]),
            "deadline": st.sampled_from(["0.001", "1", "2.5", "infinite"]),
            "lifespan": st.sampled_from(["1", "infinite"]),
            "liveliness": st.sampled_from(["automatic", "manual_by_topic"]),
            "leaseDuration": st.sampled_from(["0.25", "10"]),
        },
    )
)
def test_read_back_it_gives_the_same_verdicts(stated):
    system = read(model("".join(f' qos:{name}="{value}"' for name, value in stated.items())))
    found = fame(system)
    assert found.notes == (PAYLOAD,)
    assert groups(read(found.text)) == groups(system)
    assert fame(read(found.text)).text.count("<qos:policy") == 2
