"""QoS written into the BPMN document that states it: nothing else changes, and it means the same."""

from dataclasses import replace
from difflib import ndiff
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

import cqos_core as cqos
from cqos_core.api import context
from cqos_core.files.source_reader import read_source
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.packs.export import ExportContext
from cqos_core.plugins import load_plugins
from tests.command_process import run_here

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
FILES = sorted([*(ROOT / "tests/importers/cases/bpmn").iterdir(), *EXAMPLES.glob("*.bpmn")])
WHERE = replace(context(), default_protocol="ros2")
HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos"
    xmlns:camunda="http://camunda.org/schema/1.0/bpmn">
  <bpmn:signal id="S" name="scan"/>
  <bpmn:process id="P" name="p">
"""
TAIL = "  </bpmn:process>\n</bpmn:definitions>\n"
CAUGHT = '    <bpmn:startEvent id="C"><bpmn:signalEventDefinition signalRef="S"/></bpmn:startEvent>\n'


def system_of(text):
    data = text if isinstance(text, bytes) else text.encode()
    return read_source(Source("model.bpmn", data), importer="bpmn")


def convert(system, to="bpmn"):
    return load_plugins().exporters[to].load()(system, ExportContext(WHERE.find_pack, "ros2"))


def judgement(system):
    report = cqos.check(system, protocol="ros2")
    return report.verdict, [(g.topic, g.verdict, g.publishers, g.subscribers) for g in report.groups]


def event(attributes="", inside=""):
    return (
        f'{HEAD}    <bpmn:endEvent id="T"{attributes}>{inside}<bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>\n'
        f"{CAUGHT}{TAIL}"
    )


def written(text):
    """Return the throwing event after conversion, in one line."""
    found = convert(system_of(text)).text
    return found[found.index("<bpmn:endEvent") : found.index("<bpmn:signalEventDefinition")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_converted_model_means_the_same_and_is_not_converted_twice(path):
    try:
        system = system_of(path.read_bytes())
    except InputError:
        pytest.skip("no model")
    found = convert(system)
    if not found.expressed:
        assert not system.endpoints or found.notes
        return
    again = system_of(found.text)
    assert judgement(again) == judgement(system)
    assert convert(again).text == found.text


def test_a_model_in_words_stays_as_it_is():
    text = (EXAMPLES / "smart_agriculture.bpmn").read_text(encoding="utf-8")
    assert convert(system_of(text)).text == text


def test_only_fixed_attributes_differ(tmp_path):
    text = (EXAMPLES / "smart_agriculture_incompatible.bpmn").read_text(encoding="utf-8")
    (tmp_path / "model.bpmn").write_text(text, encoding="utf-8")
    done = run_here(["convert", "model.bpmn", "--to", "bpmn", "--fix", "--change-program"], tmp_path)
    assert done.code == 0
    found = done.out
    added = [line for line in ndiff(text.splitlines(), found.splitlines()) if line.startswith("+ ")]
    assert [line.split()[1:] for line in added] == [
        ['qos:reliability="reliable"', 'qos:durability="volatile"'],
        ['qos:liveliness="manual_by_topic"', 'qos:leaseDuration="10">'],
    ]
    assert cqos.check(system_of(found), protocol="ros2").verdict == "compatible"


def test_codes_become_words_and_zero_is_not_stated():
    attributes = ' qos:history="0" qos:depth="0" qos:reliability="1" qos:durability="0" qos:deadline="2"'
    assert written(event(attributes)) == (
        '<bpmn:endEvent id="T" qos:history="keep_last" qos:reliability="reliable" qos:durability="transient_local" '
        'qos:deadline="2">'
    )


def test_eight_zeros_may_mean_two_things_so_they_stay():
    names = ("history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness", "leaseDuration")
    text = event("".join(f' qos:{name}="0"' for name in names))
    found = convert(system_of(text))
    assert (found.text, found.notes) == (text, ("`T` stays as it is: it is open what eight zeros mean",))


def test_policies_of_fame_become_attributes():
    inside = '<bpmn:extensionElements><qos:policy reliability="0" type="x" value="0"/><qos:policy reliability="1"/></bpmn:extensionElements>'
    assert written(event(inside=inside)) == '<bpmn:endEvent id="T" qos:reliability="reliable">'


def test_properties_of_engines_become_attributes_and_others_stay():
    inside = (
        "<bpmn:extensionElements><camunda:properties>"
        '<camunda:property name="reliability" value="1"/><camunda:property name="colour" value="red"/>'
        "</camunda:properties></bpmn:extensionElements>"
    )
    assert written(event(inside=inside)) == (
        '<bpmn:endEvent id="T" qos:reliability="reliable"><bpmn:extensionElements><camunda:properties>'
        '<camunda:property name="colour" value="red"/></camunda:properties></bpmn:extensionElements>'
    )


def test_values_that_are_invalid_stay_and_are_noted():
    found = convert(system_of(event(' qos:reliability="reliabel" qos:deadline="1"')))
    assert 'qos:reliability="reliabel"' in found.text
    assert found.notes == ("`T`: reliability stays as it is, because its value is not known",)


@pytest.mark.parametrize("encoding", ["utf-16", "iso-8859-1", "windows-1252"])
def test_a_model_in_another_encoding_is_written_in_utf_8(encoding):
    text = event(' name="Übertragung" qos:reliability="1"').replace("UTF-8", encoding)
    found = convert(system_of(text.encode(encoding))).text
    assert found.startswith('<?xml version="1.0" encoding="UTF-8"?>')
    assert 'name="Übertragung" qos:reliability="reliable"' in found


def test_line_ends_quotes_comments_and_prefixes_stay():
    text = event(" q:reliability = '1' name='a \"b\" &amp; &lt;c>'", "<!-- <bpmn:endEvent id='T'> -->")
    text = text.replace("xmlns:qos", "xmlns:q").replace("\n", "\r\n")
    assert convert(system_of(text)).text == text.replace("q:reliability = '1'", "q:reliability = 'reliable'")


def test_a_namespace_is_bound_in_a_document_without_it():
    inside = '<bpmn:extensionElements><camunda:properties><camunda:property name="reliability" value="1"/></camunda:properties></bpmn:extensionElements>'
    text = event(inside=inside).replace(' xmlns:qos="http://qos"', ' xmlns:qos="http://another"')
    found = convert(system_of(text)).text
    assert 'xmlns:qos0="http://qos"' in found
    assert 'qos0:reliability="reliable"' in found
    assert judgement(system_of(found)) == judgement(system_of(text))


def test_what_is_no_model_is_not_written():
    found = convert(cqos.read(EXAMPLES / "mobile_robot.yaml"))
    assert (found.text, found.expressed, found.notes) == ("", 0, ("one BPMN document is needed, not none",))


def test_the_form_of_fame_has_the_topic_as_name_with_message_and_payload():
    text = (EXAMPLES / "smart_agriculture.bpmn").read_text(encoding="utf-8")
    text = text.replace('id="Drone_ThrowReq" name="', 'id="Drone_ThrowReq" qos:type="std_msgs/msg/String" name="Ask: ')
    found = convert(system_of(text), "fame")
    (event,) = etree.fromstring(found.text.encode()).xpath("//*[@id='Drone_ThrowReq']")
    signals = {each.get("id"): each.get("name") for each in event.getroottree().iter("{*}signal")}
    (definition,) = event.iter("{*}signalEventDefinition")
    assert event.get("name") == signals[definition.get("signalRef")]
    policies = {name: value for each in event.iter("{http://qos}policy") for name, value in each.attrib.items()}
    assert policies["reliability"] == "0"
    assert {"history", "depth", "durability", "deadline", "lifespan", "liveliness", "leaseDuration"} < policies.keys()
    assert [each.get("type") or each.text for each in event.iter("{http://ros}message")] == ["std_msgs/msg/String"]
    (verdict, groups), (expected, before) = judgement(system_of(found.text)), judgement(system_of(text))
    assert (verdict, [each[1:] for each in groups]) == (expected, [each[1:] for each in before])


VALUES = st.sampled_from(
    [
        "0",
        "1",
        "2",
        "0.5",
        "1e-3",
        "5",
        "keep last",
        "KEEP_ALL",
        "best-effort",
        "reliable",
        "Volatile",
        "10s",
        "infinite",
        "",
        "x",
    ]
)
NAMES = st.sampled_from(
    ["history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness", "lease_duration"]
)


@given(st.lists(st.dictionaries(NAMES, VALUES, max_size=8), min_size=3, max_size=3))
def test_random_models_mean_the_same_in_words_and_in_the_form_of_fame(stated):
    attributes, policies, properties = stated
    inside = "<bpmn:extensionElements><qos:policy" + "".join(f' {n}="{v}"' for n, v in policies.items()) + "/>"
    inside += "<camunda:properties>"
    inside += "".join(f'<camunda:property name="{n}" value="{v}"/>' for n, v in properties.items())
    inside += "</camunda:properties></bpmn:extensionElements>"
    system = system_of(event("".join(f' qos:{n}="{v}"' for n, v in attributes.items()), inside))
    found = convert(system).text
    assert judgement(system_of(found)) == judgement(system)
    assert convert(system_of(found)).text == found
    etree.fromstring(convert(system, "fame").text.encode())
