"""What the BPMN importer makes of a model: endpoints, topics, participants, settings, and what it says about the rest."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cqos_core.api import check
from cqos_core.bpmn import read
from cqos_core.model.codes import CODES
from cqos_core.model.problems import InputError
from cqos_core.model.settings import Place
from cqos_core.model.source import ReadContext, Source
from cqos_core.model.system import Endpoint, ProfileRef, System

CASES = Path(__file__).parent / "cases" / "bpmn"
EXAMPLES = Path(__file__).parents[2] / "examples"
WITH_MESSAGES = ReadContext(options={"bpmn": {"message_flows": "true"}})

HEAD = """<bpmn:definitions xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos"
 xmlns:camunda="http://camunda.org/schema/1.0/bpmn" xmlns:flowable="http://flowable.org/bpmn">"""


def read_file(name: str, context: ReadContext | None = None) -> System:
    path = CASES / name
    return read(Source(name, path.read_bytes()), context or ReadContext())


def read_model(body: str, context: ReadContext | None = None) -> System:
    """Read a model from the content of its root element."""
    source = Source("model.bpmn", f"{HEAD}{body}</bpmn:definitions>".encode())
    return read(source, context or ReadContext())


def read_event(attributes: str, *, definition: str = '<bpmn:signalEventDefinition signalRef="S"/>') -> System:
    """Read a model of one throw event `E` with a signal called `topic`."""
    return read_model(
        f"""<bpmn:signal id="S" name="topic"/><bpmn:process id="P">
        <bpmn:intermediateThrowEvent id="E" {attributes}>{definition}</bpmn:intermediateThrowEvent></bpmn:process>"""
    )


def notes(system: System) -> list[tuple[str, str | None]]:
    return [(note.code, note.place.element if note.place else None) for note in system.notes]


def texts(endpoint: Endpoint) -> dict[str, str]:
    return {name: setting.text for name, setting in endpoint.settings.items()}


def unknown(system: System) -> dict[str, dict[str, str]]:
    """By endpoint, the settings that are not known, with the code of what reports them."""
    found = {e.id: {name: s.reported for name, s in e.settings.items() if s.unknown} for e in system.endpoints}
    return {name: settings for name, settings in found.items() if settings}


def by_id(system: System) -> dict[str, Endpoint]:
    return {endpoint.id: endpoint for endpoint in system.endpoints}


class TestCaseStudy:
    """The example of the paper, with the values of its Table 2."""

    @pytest.fixture
    def system(self) -> System:
        path = EXAMPLES / "smart_agriculture.bpmn"
        return read(Source("smart_agriculture.bpmn", path.read_bytes()), ReadContext())

    def test_throw_events_publish_and_catch_events_subscribe(self, system):
        found = [(e.participant, e.role, e.topic) for e in system.endpoints]
        assert sorted(found) == [
            ("Participant_Drone", "publisher", "Req weather data"),
            ("Participant_Drone", "subscriber", "Resp weather data"),
            ("Participant_Station", "publisher", "Resp weather data"),
            ("Participant_Station", "subscriber", "Req weather data"),
        ]

    def test_participants_are_the_pools(self, system):
        assert {p.id: p.label for p in system.participants.values()} == {
            "Participant_Drone": "Drone",
            "Participant_Station": "Weather station",
        }

    def test_settings_are_the_text_of_the_attributes(self, system):
        response = next(e for e in system.endpoints if e.role == "publisher" and e.topic == "Resp weather data")
        assert texts(response) == {
            "history": "keep_last",
            "depth": "5",
            "reliability": "reliable",
            "durability": "transient_local",
            "deadline": "2",
            "lifespan": "10",
            "liveliness": "automatic",
            "leaseDuration": "10",
        }
        assert response.dialect == "bpmn"

    def test_nothing_needs_to_be_said(self, system):
        assert system.notes == []

    def test_protocol_is_left_open(self, system):
        assert system.protocol is None
        assert {e.protocol for e in system.endpoints} == {None}

    def test_bytes_are_kept_for_excerpts(self, system):
        assert system.sources["smart_agriculture.bpmn"].startswith(b"<?xml")


class TestEvents:
    @pytest.fixture
    def system(self) -> System:
        return read_file("nested_events.bpmn")

    def test_all_kinds_of_events_at_any_depth(self, system):
        assert [(e.id, e.role, e.topic) for e in system.endpoints] == [
            ("Boundary", "subscriber", "stop"),
            ("By_Reference", "subscriber", "stop"),
            ("Timer_Or_Signal", "subscriber", "go"),
            ("Timer_Or_Signal#2", "subscriber", "stop"),
            ("In_Event_Sub_Process", "subscriber", "stop"),
            ("In_Ad_Hoc", "publisher", "go"),
            ("In_Transaction", "publisher", "go"),
        ]

    def test_all_belong_to_the_process_around_them(self, system):
        assert {e.participant for e in system.endpoints} == {"Process_1"}
        assert system.participants["Process_1"].label == "Robot"

    def test_events_among_extensions_are_none(self):
        body = """<bpmn:extensionElements><bpmn:process id="X"><bpmn:endEvent id="Y">
            <bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent></bpmn:process></bpmn:extensionElements>"""
        system = read_event("", definition=f'{body}<bpmn:signalEventDefinition signalRef="S"/>')
        assert [e.id for e in system.endpoints] == ["E"]
        assert [*system.participants] == ["P"]

    def test_one_signal_twice_in_one_event_is_one_endpoint(self):
        twice = '<bpmn:signalEventDefinition signalRef="S"/>' * 2
        assert [e.id for e in read_event("", definition=twice).endpoints] == ["E"]

    def test_event_definition_reference_to_nothing(self):
        system = read_event("", definition="<bpmn:eventDefinitionRef>Gone</bpmn:eventDefinitionRef>")
        assert system.endpoints == []
        assert notes(system) == [("CQ032", "E")]

    def test_event_outside_of_every_process(self):
        system = read_model(
            '<bpmn:signal id="S" name="topic"/>'
            '<bpmn:startEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:startEvent>'
        )
        assert system.endpoints == []
        assert notes(system) == [("CQ046", "E")]

    def test_label_is_the_event_name(self):
        assert read_event('name=" Ask for&#10;weather "').endpoints[0].label == "Ask for weather"

    def test_event_without_id(self):
        system = read_model(
            """<bpmn:signal id="S" name="topic"/><bpmn:process id="P">
            <bpmn:startEvent><bpmn:signalEventDefinition signalRef="S"/></bpmn:startEvent>
            <bpmn:startEvent><bpmn:signalEventDefinition signalRef="S"/></bpmn:startEvent></bpmn:process>"""
        )
        assert [e.id for e in system.endpoints] == ["P/subscriber/topic", "P/subscriber/topic#2"]

    def test_duplicate_ids_are_made_unique_and_reported(self):
        system = read_model(
            """<bpmn:signal id="S" name="topic"/><bpmn:process id="P">
            <bpmn:startEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:startEvent>
            <bpmn:endEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent></bpmn:process>"""
        )
        assert [e.id for e in system.endpoints] == ["E", "E#2"]
        assert notes(system) == [("CQ031", "E")]


class TestTopics:
    @pytest.mark.parametrize(
        ("written", "topic"),
        [
            ("Req weather data", "Req weather data"),
            ("  Req&#10;weather\tdata ", "Req weather data"),
            ("\u200fمزرعة\u200e", "مزرعة"),
            ("\ufeffscan\u200b", "scan"),
            ("&lt;b&gt;scan&lt;/b&gt;", "<b>scan</b>"),
            ("Высота Höhe 高度", "Высота Höhe 高度"),
        ],
    )
    def test_name_of_the_signal_without_invisible_characters(self, written, topic):
        system = read_model(
            f"""<bpmn:signal id="S" name="{written}"/><bpmn:process id="P"><bpmn:endEvent id="E">
            <bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent></bpmn:process>"""
        )
        assert system.endpoints[0].topic == topic
        assert not system.endpoints[0].topic_is_guess

    def test_prefix_of_the_reference_means_nothing(self):
        system = read_event("", definition='<bpmn:signalEventDefinition signalRef=" tns:S "/>')
        assert system.endpoints[0].topic == "topic"

    @pytest.mark.parametrize(
        ("namespaces", "topic"),
        [
            ('xmlns:b="urn:here" targetNamespace="urn:here"', "topic"),
            ('xmlns:b="urn:here"', "topic"),
            ('targetNamespace="urn:here"', "topic"),
            ('xmlns:b="urn:there" targetNamespace="urn:here"', None),
        ],
    )
    def test_prefix_of_another_file_is_no_reference_into_this_one(self, namespaces, topic):
        body = """<bpmn:signal id="S" name="topic"/><bpmn:process id="P">
            <bpmn:endEvent id="E"><bpmn:signalEventDefinition signalRef="b:S"/></bpmn:endEvent></bpmn:process>"""
        data = HEAD.replace(">", f" {namespaces}>") + body + "</bpmn:definitions>"
        system = read(Source("model.bpmn", data.encode()), ReadContext())
        assert system.endpoints[0].topic == topic
        assert [note.code for note in system.notes] == ([] if topic else ["CQ032", "CQ033"])

    @pytest.mark.parametrize(
        ("definition", "code"),
        [
            ("<bpmn:signalEventDefinition/>", "CQ034"),
            ('<bpmn:signalEventDefinition signalRef=""/>', "CQ034"),
            ('<bpmn:signalEventDefinition signalRef="Gone"/>', "CQ032"),
        ],
    )
    def test_own_name_is_taken_as_a_guess(self, definition, code):
        system = read_event('name="scan"', definition=definition)
        endpoint = system.endpoints[0]
        assert (endpoint.topic, endpoint.topic_is_guess) == ("scan", True)
        assert (code, "E") in notes(system)

    def test_guess_for_a_signal_without_a_name(self):
        system = read_model(
            """<bpmn:signal id="S" name=" "/><bpmn:process id="P"><bpmn:endEvent id="E" name="scan">
            <bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent></bpmn:process>"""
        )
        assert (system.endpoints[0].topic, system.endpoints[0].topic_is_guess) == ("scan", True)
        assert notes(system) == [("CQ034", "E")]

    def test_event_without_any_name_has_no_topic(self):
        system = read_event("", definition="<bpmn:signalEventDefinition/>")
        assert system.endpoints[0].topic is None
        assert notes(system) == [("CQ033", "E")]
        assert system.notes[0].severity == "warning"

    def test_signavio_events_without_signals(self):
        system = read_file("signavio.bpmn")
        assert [(e.id, e.topic) for e in system.endpoints] == [("sid-8", "Frost warning"), ("sid-10", None)]
        assert notes(system) == [("CQ034", "sid-8"), ("CQ033", "sid-10")]

    def test_dangling_reference_in_a_shared_definition(self):
        system = read_model(
            """<bpmn:signalEventDefinition id="D" signalRef="Gone"/><bpmn:process id="P"><bpmn:endEvent id="E">
            <bpmn:eventDefinitionRef>D</bpmn:eventDefinitionRef></bpmn:endEvent></bpmn:process>"""
        )
        assert notes(system) == [("CQ032", "E"), ("CQ033", "E")]

    def test_two_signals_of_one_name_are_one_topic(self):
        system = read_model('<bpmn:signal id="S1" name="scan"/><bpmn:signal id="S2" name=" scan"/>')
        assert notes(system) == [("CQ035", "S2")]
        assert "S1" in system.notes[0].message

    def test_signal_id_used_twice_means_the_first(self):
        system = read_event("")
        assert notes(system) == []
        system = read_model(
            """<bpmn:signal id="S" name="one"/><bpmn:signal id="S" name="two"/><bpmn:process id="P">
            <bpmn:endEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent></bpmn:process>"""
        )
        assert system.endpoints[0].topic == "one"
        assert notes(system) == [("CQ031", "S")]

    def test_activiti_expressions_and_instance_scope(self):
        system = read_file("activiti.bpmn20.xml")
        assert [(e.id, e.topic) for e in system.endpoints] == [
            ("start", "alert"),
            ("throwTenant", None),
            ("catchExpression", None),
        ]
        assert notes(system) == [
            ("CQ037", "throwInner"),
            ("CQ036", "throwTenant"),
            ("CQ036", "catchExpression"),
        ]

    def test_zeebe_expressions(self):
        system = read_file("zeebe.bpmn")
        assert [(e.id, e.topic) for e in system.endpoints] == [
            ("Event_Fixed", "go"),
            ("Event_Computed", None),
        ]
        assert notes(system) == [("CQ036", "Event_Computed")]

    def test_computed_event_name_is_no_guess(self):
        system = read_event('name="#{name}"', definition="<bpmn:signalEventDefinition/>")
        assert system.endpoints[0].topic is None
        assert notes(system) == [("CQ036", "E")]

    def test_type_of_the_signal(self):
        system = read_model(
            """<bpmn:itemDefinition id="I" structureRef="agri_msgs/msg/Weather"/>
            <bpmn:signal id="S" name="weather" structureRef="tns:I"/>
            <bpmn:process id="P"><bpmn:endEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>
            </bpmn:process>"""
        )
        assert system.endpoints[0].type == "agri_msgs/msg/Weather"


class TestParticipants:
    def test_pool_without_a_process_has_no_endpoints(self):
        system = read_file("signavio.bpmn")
        assert {p.id: p.label for p in system.participants.values()} == {
            "sid-3": "Greenhouse controller",
            "sid-5": "Supplier",
        }

    def test_process_without_a_pool_takes_part_itself(self):
        system = read_file("camunda7.bpmn")
        assert {p.id: p.label for p in system.participants.values()} == {"Process_1": "Scout robot"}

    def test_pools_that_share_a_process_have_endpoints_each(self):
        system = read_model(
            """<bpmn:signal id="S" name="topic"/>
            <bpmn:collaboration id="C1"><bpmn:participant id="A" name="Left" processRef="tns:P"/></bpmn:collaboration>
            <bpmn:collaboration id="C2"><bpmn:participant id="B" name="Right" processRef="P"/></bpmn:collaboration>
            <bpmn:process id="P"><bpmn:endEvent id="E"><bpmn:extensionElements>
            <qos:accept rule="ROS101" because="tested"/></bpmn:extensionElements>
            <bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent></bpmn:process>"""
        )
        assert [(e.id, e.participant) for e in system.endpoints] == [("E", "A"), ("E@B", "B")]
        assert [a.endpoint for a in system.accept] == ["E", "E@B"]
        assert notes(system) == [("CQ048", "P")]

    CALLS = """<bpmn:signal id="S" name="t"/><bpmn:collaboration><bpmn:participant id="A" processRef="Main"/>
        {pools}</bpmn:collaboration>
        <bpmn:process id="Main"><bpmn:callActivity id="C1" {call}/></bpmn:process>
        <bpmn:process id="Sub"><bpmn:callActivity id="C2" calledElement="SubSub"/></bpmn:process>
        <bpmn:process id="SubSub"><bpmn:endEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>
        <bpmn:callActivity id="C3" calledElement="Sub"/></bpmn:process>{more}"""

    def calls(self, call: str = 'calledElement="Sub"', pools: str = "", more: str = "") -> dict[str, str]:
        system = read_model(self.CALLS.format(pools=pools, call=call, more=more))
        return {e.id: e.participant for e in system.endpoints}

    def test_called_process_runs_in_the_participant_of_its_caller(self):
        assert self.calls() == {"E": "A"}
        assert self.calls('calledElement="b:Sub"') == {"E": "A"}

    def test_called_process_in_zeebe(self):
        inside = """><bpmn:extensionElements><z:calledElement xmlns:z="http://camunda.org/schema/zeebe/1.0" processId="Sub"/>
            </bpmn:extensionElements></bpmn:callActivity><bpmn:task"""
        assert self.calls(inside) == {"E": "A"}

    def test_called_process_with_a_pool_runs_there(self):
        pools = '<bpmn:participant id="B" processRef="SubSub"/>'
        assert self.calls(pools=pools) == {"E": "B"}

    def test_process_that_two_call_runs_in_both(self):
        pools = '<bpmn:participant id="B" processRef="Other"/>'
        more = '<bpmn:process id="Other"><bpmn:callActivity id="C4" calledElement="SubSub"/></bpmn:process>'
        assert self.calls(pools=pools, more=more) == {"E": "A", "E@B": "B"}

    def test_called_process_of_a_process_without_a_pool(self):
        more = """<bpmn:process id="Lone"><bpmn:callActivity id="C4" calledElement="Called"/></bpmn:process>
            <bpmn:process id="Called"><bpmn:endEvent id="F"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>
            </bpmn:process>"""
        assert self.calls(more=more) == {"E": "A", "F": "Lone"}

    def test_processes_that_only_call_each_other_take_part_themselves(self):
        assert self.calls('calledElement="elsewhere"') == {"E": "Sub"}

    def test_too_many_copies_are_refused(self):
        pools = "".join(f'<bpmn:participant id="P{n}" processRef="M{n}"/>' for n in range(400))
        call = '<bpmn:callActivity calledElement="Sub"/>'
        mains = "".join(f'<bpmn:process id="M{n}">{call}</bpmn:process>' for n in range(400))
        events = '<bpmn:endEvent><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>' * 400
        sub = f'<bpmn:process id="Sub">{events}</bpmn:process>'
        with pytest.raises(InputError, match="more than 100000 copies"):
            read_model(f'<bpmn:signal id="S" name="t"/><bpmn:collaboration>{pools}</bpmn:collaboration>{mains}{sub}')

    def test_reference_to_no_process(self):
        system = read_model('<bpmn:collaboration><bpmn:participant id="A" processRef="Gone"/></bpmn:collaboration>')
        assert list(system.participants) == ["A"]
        assert notes(system) == [("CQ032", "A")]

    def test_duplicate_and_missing_ids(self):
        system = read_model(
            """<bpmn:collaboration><bpmn:participant id="A"/><bpmn:participant id="A"/>
            <bpmn:participant name="Tractor"/><bpmn:participant/></bpmn:collaboration>"""
        )
        assert list(system.participants) == ["A", "A#2", "Tractor", "participant"]
        assert notes(system) == [("CQ031", "A")]

    @pytest.mark.parametrize(
        ("attributes", "file", "name"),
        [
            ('name="Farm"', "x.bpmn", "Farm"),
            ("", "models/farm.bpmn", "farm"),
            ("", "C:\\models\\farm.bpmn20.xml", "farm"),
            ("", "<bytes>", "<bytes>"),
        ],
    )
    def test_system_is_named_by_the_model_or_the_file(self, attributes, file, name):
        data = HEAD.replace(">", f" {attributes}>") + "</bpmn:definitions>"
        assert read(Source(file, data.encode()), ReadContext()).name == name

    def test_system_may_be_named_by_the_collaboration(self):
        assert read_model('<bpmn:collaboration id="C" name="Farm"/>').name == "Farm"


class TestQos:
    def test_text_is_kept_as_written(self):
        system = read_event('qos:reliability=" Best Effort" qos:deadline="0.50" qos:depth="nonsense" qos:lifespan=""')
        assert texts(system.endpoints[0]) == {
            "reliability": " Best Effort",
            "deadline": "0.50",
            "depth": "nonsense",
            "lifespan": "",
        }

    def test_what_is_missing_stays_missing(self):
        assert read_event("").endpoints[0].settings == {}

    def test_zero_and_missing_are_not_the_same(self):
        assert texts(read_event('qos:deadline="0"').endpoints[0]) == {"deadline": "0"}

    def test_unknown_attributes_are_kept_for_the_pack_to_judge(self):
        assert texts(read_event('qos:relaibility="reliable"').endpoints[0]) == {"relaibility": "reliable"}

    @pytest.mark.parametrize(
        "stated",
        [
            'reliability="reliable"',
            'reliabilty="reliable"',
            'camunda:reliability="reliable"',
            'xmlns:x="urn:x" x:reliability="reliable"',
        ],
    )
    def test_attributes_of_other_namespaces_are_not_known(self, stated):
        system = read_event(f'{stated} qos:depth="1" id2="a" name="b" isInterrupting="true"')
        assert unknown(system) == {"E": {"reliability": "CQ040"}}
        assert texts(system.endpoints[0])["depth"] == "1"
        assert notes(system) == [("CQ040", "E")]

    def test_what_is_read_wins_over_what_is_not(self):
        system = read_event('reliability="reliable" qos:reliability="best_effort"')
        assert texts(system.endpoints[0]) == {"reliability": "best_effort"}
        assert unknown(system) == {}
        assert notes(system) == [("CQ040", "E")]

    @pytest.mark.parametrize(
        "uri", ["http://qos/", "https://qos", "http://QoS", "http://qos#", " http://qos", "urn:qos", "x:y"]
    )
    def test_another_namespace_under_the_prefix_is_one_cause(self, uri):
        head = f'<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="{uri}">'
        body = """<signal id="S" name="t"/><process id="P">
            <startEvent id="R" qos:reliability="reliable" qos:leaseduration="1"><signalEventDefinition signalRef="S"/></startEvent>
            <endEvent id="W" qos:relaibility="reliable"><signalEventDefinition signalRef="S"/></endEvent>
            <endEvent id="V" qos:profile="sensor_data"><signalEventDefinition signalRef="S"/></endEvent>
            <endEvent id="T" qos:type="a" qos:external="true"><signalEventDefinition signalRef="S"/></endEvent>
            <endEvent id="N"><extensionElements><qos:policy depth="1" type="depth"/><qos:need name="latest" value="1"/>
            </extensionElements><signalEventDefinition signalRef="S"/></endEvent></process></definitions>"""
        system = read(Source("m.bpmn", (head + body).encode()), ReadContext())
        assert unknown(system) == {
            "R": {"reliability": "CQ040", "leaseDuration": "CQ040"},
            "W": {"reliability": "CQ040"},
            "V": {"*": "CQ040"},
            "N": {"depth": "CQ040", "*": "CQ040"},
        }
        assert notes(system) == [("CQ040", "R")]
        assert "`http://qos`" in system.notes[0].message

    @pytest.mark.parametrize(
        ("definitions", "process"), [('qos:protocol="mqtt"', ""), ("", 'qos:domain="1"'), ("", 'qos:protocol="dds"')]
    )
    def test_another_namespace_around_events(self, definitions, process):
        head = (
            f'<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos/" {definitions}>'
        )
        body = f"""<signal id="S" name="t"/><process id="P" {process}>
            <startEvent id="R"><signalEventDefinition signalRef="S"/></startEvent></process></definitions>"""
        system = read(Source("m.bpmn", (head + body).encode()), ReadContext())
        assert unknown(system) == {"R": {"*": "CQ040"}}
        assert [code for code, _ in notes(system)] == ["CQ040"]

    def test_names_of_policies_mean_something_else_on_other_elements(self):
        system = read_model('<bpmn:process id="P"><bpmn:task id="T" deadline="1"/></bpmn:process>')
        assert notes(system) == []

    @pytest.mark.parametrize(
        "inside",
        [
            '<camunda:properties><camunda:property name="reliabilty" value="reliable"/></camunda:properties>',
            '<flowable:properties><flowable:property name="reliability" value="reliable"/></flowable:properties>',
            '<x:policy xmlns:x="urn:x" reliability="reliable"/>',
            '<policy xmlns="" reliability="reliable"/>',
        ],
    )
    def test_extensions_that_nothing_reads(self, inside):
        inside = f"<bpmn:extensionElements>{inside}</bpmn:extensionElements>"
        system = read_event("", definition=f'{inside}<bpmn:signalEventDefinition signalRef="S"/>')
        assert unknown(system) == {"E": {"reliability": "CQ040"}}
        assert notes(system) == [("CQ040", "E")]

    @pytest.mark.parametrize(("written", "read"), [("1e-7", "0.0000001"), ("1.5e+3", "1500"), ("2E2", "200")])
    def test_numbers_as_javascript_writes_them(self, written, read):
        assert texts(read_event(f'qos:deadline="{written}"').endpoints[0]) == {"deadline": read}

    @pytest.mark.parametrize("written", ["1e-999", "1e999", "e3", "1e", "-1e3", "1e3s"])
    def test_other_words_stay_as_they_are(self, written):
        assert texts(read_event(f'qos:deadline="{written}"').endpoints[0]) == {"deadline": written}

    def test_place_names_element_and_attribute(self):
        setting = read_event('qos:reliability="reliable"').endpoints[0].settings["reliability"]
        assert setting.place == Place("model.bpmn", 3, None, "E", "@qos:reliability")

    def test_codes_of_the_original_tool_stay_codes(self):
        system = read_file("cqos_tool.bpmn")
        assert texts(by_id(system)["Event_Edited"])["durability"] == "1"

    def test_eight_zeros_may_be_nobodys_choice(self):
        system = read_file("cqos_tool.bpmn")
        assert notes(system) == [("CQ038", "Event_Untouched")]
        assert {name: sorted(settings) for name, settings in unknown(system).items()} == {
            "Event_Untouched": ["durability", "reliability"]
        }

    def test_seven_zeros_are_a_choice(self):
        zeros = " ".join(
            f'qos:{name}="0"'
            for name in (
                "history",
                "depth",
                "reliability",
                "durability",
                "deadline",
                "lifespan",
                "liveliness",
            )
        )
        assert notes(read_event(zeros)) == []
        assert notes(read_event(f'{zeros} qos:lease_duration="0.0"')) == [("CQ038", "E")]
        assert notes(read_event(f'{zeros} qos:leaseDuration="10"')) == []

    def test_fame_policies_are_merged_and_the_last_one_wins(self):
        system = read_file("fame.bpmn")
        assert texts(by_id(system)["Scout_Throw"]) == {"reliability": "1", "history": "0", "depth": "5"}
        assert texts(by_id(system)["Tractor_Catch"]) == {
            "durability": "1",
            "deadline": "0.5",
            "leaseDuration": "0",
        }
        assert notes(system) == []

    def test_fame_message_type(self):
        assert {e.type for e in read_file("fame.bpmn").endpoints} == {"geometry_msgs/msg/Point"}

    def test_camunda_properties(self):
        endpoint = read_file("camunda7.bpmn").endpoints[0]
        assert texts(endpoint) == {"reliability": "Best Effort", "lease_duration": "10"}
        assert endpoint.type == "sensor_msgs/msg/LaserScan"

    def test_zeebe_properties(self):
        assert texts(by_id(read_file("zeebe.bpmn"))["Event_Fixed"]) == {"durability": "transient_local"}

    def test_any_prefix_will_do(self):
        endpoint = read_file("several_prefixes.bpmn").endpoints[0]
        assert endpoint.topic == "Höhe"
        assert texts(endpoint) == {"reliability": "best_effort", "depth": "3"}


class TestDisagreement:
    """Attributes win over `qos:policy`, that over Camunda properties; what differs is reported."""

    @staticmethod
    def read(attributes: str, policy: str = "", properties: str = "") -> System:
        definition = f"""<bpmn:extensionElements>{policy}<camunda:properties>{properties}</camunda:properties>
            </bpmn:extensionElements><bpmn:signalEventDefinition signalRef="S"/>"""
        return read_event(attributes, definition=definition)

    def test_attribute_wins_over_policy(self):
        system = self.read('qos:leaseDuration="10"', '<qos:policy lease_duration="5"/>')
        assert texts(system.endpoints[0]) == {"leaseDuration": "10"}
        assert notes(system) == [("CQ039", "E")]
        assert "`5` in `qos:policy` and `10` in an attribute; `10` is taken" in system.notes[0].message

    def test_policy_wins_over_property(self):
        system = self.read("", '<qos:policy depth="5"/>', '<camunda:property name="depth" value="1"/>')
        assert texts(system.endpoints[0]) == {"depth": "5"}
        assert notes(system) == [("CQ039", "E")]

    @pytest.mark.parametrize(
        ("attribute", "policy"),
        [("10", "10.0"), ("best_effort", "Best Effort"), ("manual-by-topic", "MANUAL_BY_TOPIC")],
    )
    def test_the_same_in_other_words_is_no_disagreement(self, attribute, policy):
        system = self.read(f'qos:x="{attribute}"', f'<qos:policy x="{policy}"/>')
        assert notes(system) == []

    @pytest.mark.parametrize("text", ["NaN", "sNaN", "inf", "9" * 1000, "1e999999999"])
    def test_odd_numbers_are_compared_as_words(self, text):
        assert notes(self.read('qos:depth="1"', f'<qos:policy depth="{text}"/>')) == [("CQ039", "E")]

    def test_two_spellings_of_one_attribute(self):
        system = self.read('qos:leaseDuration="10" qos:lease_duration="5"')
        assert notes(system) == [("CQ039", "E")]
        assert len(system.endpoints[0].settings) == 1


class TestUnread:
    """QoS that nothing reads is reported, because it looks as if it were checked."""

    def test_on_an_event_without_a_signal(self):
        system = read_event('qos:depth="1"', definition="<bpmn:timerEventDefinition/>")
        assert notes(system) == [("CQ040", "E")]

    def test_in_a_policy_of_an_event_without_a_signal(self):
        policy = '<bpmn:extensionElements><qos:policy depth="1"/></bpmn:extensionElements>'
        assert notes(read_event("", definition=policy)) == [("CQ040", "E")]

    def test_zeros_on_an_event_without_a_signal_are_nothing(self):
        assert notes(read_event('qos:depth="0"', definition="")) == []

    def test_on_the_signal_definition(self):
        system = read_event("", definition='<bpmn:signalEventDefinition signalRef="S" qos:depth="1"/>')
        assert notes(system) == [("CQ040", "E")]
        assert unknown(system) == {"E": {"depth": "CQ040"}}

    def test_in_a_policy_of_the_signal_definition(self):
        policy = '<bpmn:extensionElements><qos:policy depth="1"/></bpmn:extensionElements>'
        inside = f'<bpmn:signalEventDefinition signalRef="S">{policy}</bpmn:signalEventDefinition>'
        assert notes(read_event("", definition=inside)) == [("CQ040", "E")]

    @pytest.mark.parametrize("tag", ["task", "userTask", "subProcess", "exclusiveGateway", "callActivity"])
    def test_on_what_neither_throws_nor_catches(self, tag):
        policy = '<bpmn:extensionElements><qos:policy reliability="reliable"/></bpmn:extensionElements>'
        for stated in (f'<bpmn:{tag} id="T" qos:depth="1"/>', f'<bpmn:{tag} id="T">{policy}</bpmn:{tag}>'):
            assert notes(read_model(f"<bpmn:process>{stated}</bpmn:process>")) == [("CQ040", "T")]
        for silent in (f'<bpmn:{tag} id="T" qos:depth="0"/>', f'<bpmn:{tag} id="T" name="depth"/>'):
            assert notes(read_model(f"<bpmn:process>{silent}</bpmn:process>")) == []

    def test_on_the_signal(self):
        system = read_model('<bpmn:signal id="S" name="topic" qos:reliability="reliable"/>')
        assert notes(system) == [("CQ040", "S")]
        assert system.topics == {}

    @pytest.mark.parametrize("signal", ['qos:reliability="reliable"', 'reliability="reliable"'])
    def test_on_the_signal_of_an_event(self, signal):
        system = read_model(
            f"""<bpmn:signal id="S" name="topic" {signal}/><bpmn:process id="P">
            <bpmn:endEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>
            <bpmn:endEvent id="F" qos:reliability="reliable"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>
            </bpmn:process>"""
        )
        assert unknown(system) == {"E": {"reliability": "CQ040"}}
        assert notes(system) == [("CQ040", "S")]

    def test_unknown_elements_in_our_namespace(self):
        inside = """<bpmn:extensionElements><qos:polcy depth="1"/><qos:option name="a" value="b"/>
            </bpmn:extensionElements><bpmn:signalEventDefinition signalRef="S"/>"""
        system = read_event("", definition=inside)
        assert notes(system) == [("CQ041", "E"), ("CQ041", "E")]
        assert system.notes[0].message.startswith("`qos:polcy` is not known")
        assert system.notes[1].message.startswith("`qos:option` is read on definitions, collaborations")
        assert unknown(system) == {"E": {"*": "CQ041"}}

    def test_imports_are_not_followed(self):
        system = read_model('<bpmn:import importType="x" location="other.bpmn" namespace="y"/>')
        assert [(n.code, n.severity) for n in system.notes] == [("CQ044", "note")]
        assert "other.bpmn" in system.notes[0].message


class TestMessageFlows:
    def test_are_no_topics_by_themselves(self):
        system = read_file("message_flows.bpmn")
        assert system.endpoints == []
        assert [n.code for n in system.notes] == ["CQ045", "CQ040", "CQ040"]
        assert "`bpmn.message_flows=true`" in (system.notes[0].help or "")

    def test_a_model_with_signals_needs_no_hint(self):
        system = read_model(
            """<bpmn:signal id="S" name="t"/><bpmn:collaboration><bpmn:messageFlow id="F"/></bpmn:collaboration>
            <bpmn:process id="P"><bpmn:endEvent id="E"><bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent>
            </bpmn:process>"""
        )
        assert notes(system) == []

    @pytest.fixture
    def system(self) -> System:
        return read_file("message_flows.bpmn", WITH_MESSAGES)

    def test_what_sends_publishes_and_what_receives_subscribes(self, system):
        assert sorted((e.id, e.role, e.topic) for e in system.endpoints) == [
            ("Order_Received", "subscriber", "Order"),
            ("Payment_Received", "subscriber", "Flow_Payment"),
            ("Payment_Received#2", "subscriber", "Lost"),
            ("Send_Invoice", "publisher", "Invoice"),
            ("Send_Order", "publisher", "Order"),
            ("Status_Sent", "publisher", "Status"),
            ("Wait_Status", "subscriber", "Status"),
        ]

    def test_qos_and_type_are_read_as_on_signal_events(self, system):
        order = by_id(system)["Send_Order"]
        assert texts(order) == {"reliability": "reliable"}
        assert order.type == "shop_msgs/msg/Order"

    def test_the_other_side_of_a_black_box_is_external(self, system):
        external = [e.id for e in system.endpoints if e.external]
        assert sorted(external) == ["Payment_Received", "Payment_Received#2", "Send_Invoice"]

    def test_what_leads_nowhere_is_reported(self, system):
        assert notes(system) == [("CQ032", "Flow_Broken"), ("CQ049", "Nameless")]

    def test_computed_message_names_are_no_topics(self):
        system = read_model(
            """<bpmn:message id="M" name="${name}"/><bpmn:process id="P">
            <bpmn:sendTask id="T" messageRef="M"/></bpmn:process>""",
            WITH_MESSAGES,
        )
        assert [(e.id, e.topic) for e in system.endpoints] == [("T", None)]
        assert notes(system) == [("CQ036", "T")]

    @pytest.mark.parametrize("options", [{"mesage_flows": "true"}, {"message_flows": "yes"}])
    def test_unknown_switches_are_refused(self, options):
        with pytest.raises(InputError, match="message_flows") as caught:
            read_model("", ReadContext(options={"bpmn": options}))
        assert [p.code for p in caught.value.problems] == ["CQ047"]


class TestOwnWords:
    @pytest.fixture
    def system(self) -> System:
        return read_file("words.bpmn")

    def test_nothing_is_unknown(self, system):
        assert system.notes == []

    def test_protocols(self, system):
        assert system.protocol == "ros2"
        assert system.participants["Participant_Drone"].protocol is None
        assert system.participants["Participant_Cloud"].protocol == "mqtt"
        assert by_id(system)["Event_Throw"].protocol == "dds"

    def test_options_of_the_system(self, system):
        assert {n: s.text for n, s in system.options["ros2"].items()} == {
            "rmw": "cyclonedds",
            "distro": "jazzy",
        }

    def test_settings_of_participants(self, system):
        drone, cloud = system.participants.values()
        assert {n: s.text for n, s in drone.settings.items()} == {"domain": "7", "rmw": "fastdds"}
        assert {n: s.text for n, s in cloud.settings.items()} == {"broker": "main"}
        assert (drone.external, cloud.external) == (True, False)

    def test_facts_of_topics(self, system):
        topic = system.topics["Weather"]
        assert {n: s.text for n, s in topic.settings.items()} == {
            "latched": "true",
            "period": "6h",
            "type": "agri_msgs/msg/Weather",
        }
        assert topic.external

    def test_words_of_events(self, system):
        catch, throw = system.endpoints
        assert [(p.name, p.place and p.place.path) for p in catch.profiles] == [("sensor_data", "@qos:profile")]
        assert texts(catch) == {"reliability": "reliable"}
        assert {n: s.text for n, s in catch.needs.items()} == {"latest": "true"}
        assert (throw.type, throw.external, texts(throw)) == (
            "agri_msgs/msg/Weather",
            True,
            {"ownership": "exclusive"},
        )

    def test_acceptances(self, system):
        assert [(a.rule, a.topic, a.endpoint, a.until) for a in system.accept] == [
            ("ROS205", None, None, None),
            ("ROS201", "Weather", None, "2027-01-01"),
            ("ROS101", None, "Event_Catch", None),
        ]
        assert system.accept[2].because == "the drone asks again"

    def test_rules_of_the_team(self):
        system = read_model(
            """<bpmn:extensionElements>
            <qos:check name="alarms-arrive" because="each of them counts" policy="reliability" at_least="reliable"
                topic="alarm*" role="publisher" severity="warning"/>
            <qos:check name="short-history" because="old samples mislead" sentence="depth &lt;= 5"/>
            </bpmn:extensionElements>"""
        )
        alarms, short = system.checks
        assert (alarms.name, alarms.because, alarms.severity) == ("alarms-arrive", "each of them counts", "warning")
        assert alarms.where == (("role", "publisher"), ("topic", "alarm*"))
        assert [(each.policy, each.relation, each.values) for each in alarms.require] == [
            ("reliability", "at_least", ("reliable",))
        ]
        assert (short.require, short.sentence, short.where, short.severity) == ((), "depth <= 5", (), "error")
        assert alarms.place is not None
        assert alarms.place.path == "qos:check[1]/@name"
        assert system.notes == []

    @pytest.mark.parametrize(
        ("attributes", "codes", "path"),
        [
            ('name="a" because="b" at_least="reliable"', ["CQ042"], "qos:check[1]/@policy"),
            ('name="a" because="b" policy="reliability"', ["CQ042"], "qos:check[1]/@exactly"),
            ('name="a" policy="reliability" exactly="reliable"', ["CQ042"], "qos:check[1]/@because"),
            ('name="a" because="b" sentence="depth &lt; 5" severity="loud"', ["CQ043"], "qos:check[1]/@severity"),
            ('name="a" because="b" sentence="depth &lt; 5" role="writer"', ["CQ043"], "qos:check[1]/@role"),
        ],
    )
    def test_a_rule_of_the_team_that_says_too_little_is_an_error(self, attributes, codes, path):
        system = read_model(f"<bpmn:extensionElements><qos:check {attributes}/></bpmn:extensionElements>")
        assert system.checks == []
        assert [(note.code, note.severity) for note in system.notes] == [(code, "error") for code in codes]
        assert system.notes[0].place is not None
        assert system.notes[0].place.path == path

    def test_a_rule_of_the_team_is_judged(self):
        text = f"""{HEAD}<bpmn:extensionElements><qos:check name="alarms-arrive" because="each of them counts"
            policy="reliability" at_least="reliable"/></bpmn:extensionElements><bpmn:signal id="S" name="alarm"/>
            <bpmn:process id="P" qos:protocol="ros2"><bpmn:endEvent id="E" qos:reliability="best_effort">
            <bpmn:signalEventDefinition signalRef="S"/></bpmn:endEvent></bpmn:process></bpmn:definitions>"""
        report = check(text.encode())
        (finding,) = [each for each in report.findings if each.source == "checks"]
        assert finding.message.startswith("alarms-arrive: ")
        assert [side.members for side in finding.sides] == [("E",)]

    def test_process_states_what_its_pool_does_not(self):
        system = read_model(
            """<bpmn:collaboration><bpmn:participant id="A" processRef="P"/>
            <bpmn:participant id="B" processRef="P" qos:protocol="mqtt"/></bpmn:collaboration>
            <bpmn:process id="P" qos:protocol="ros2" qos:external="true"/>"""
        )
        assert [(p.protocol, p.external) for p in system.participants.values()] == [
            ("ros2", True),
            ("mqtt", True),
        ]

    def test_every_problem_is_reported_at_once_and_located(self):
        inside = """<bpmn:extensionElements>
            <qos:need name="latest"/>
            <qos:accept rule="ROS101" until="soon"/>
            <qos:accept rule="ROS101" because="tested" until="soon"/>
            </bpmn:extensionElements><bpmn:signalEventDefinition signalRef="S"/>"""
        system = read_event('qos:external="maybe"', definition=inside)
        assert {(note.severity, note.place and note.place.element) for note in system.notes} == {("error", "E")}
        assert [(note.code, note.place and (note.place.line, note.place.path)) for note in system.notes] == [
            ("CQ042", (4, "qos:need[1]/@value")),
            ("CQ043", (3, "@qos:external")),
            ("CQ042", (5, "qos:accept[1]/@because")),
            ("CQ043", (6, "qos:accept[2]/@until")),
        ]
        needs = system.endpoints[0].needs
        assert {name: setting.reported for name, setting in needs.items() if setting.unknown} == {"latest": "CQ042"}

    def test_a_requirement_without_a_name_may_be_any(self):
        inside = '<bpmn:extensionElements><qos:need value="true"/></bpmn:extensionElements>'
        system = read_event("", definition=f'{inside}<bpmn:signalEventDefinition signalRef="S"/>')
        assert [name for name, setting in system.endpoints[0].needs.items() if setting.unknown] == ["*"]

    def test_option_needs_a_protocol_where_the_system_has_none(self):
        option = '<bpmn:extensionElements><qos:option name="rmw" value="x"/></bpmn:extensionElements>'
        system = read_model(option)
        assert [(note.code, note.severity) for note in system.notes] == [("CQ042", "error")]
        assert system.notes[0].message.startswith("`qos:option` has no `protocol`")

    def test_unknown_attribute_of_the_definitions(self):
        data = HEAD.replace(">", ' qos:protocoll="ros2">') + "</bpmn:definitions>"
        assert notes(read(Source("model.bpmn", data.encode()), ReadContext())) == [("CQ041", None)]

    def test_two_signals_of_one_name_disagree_about_their_topic(self):
        system = read_model(
            '<bpmn:signal id="S1" name="t" qos:period="1s"/><bpmn:signal id="S2" name="t" qos:period="2s"/>'
        )
        assert notes(system) == [("CQ035", "S2"), ("CQ039", "S2")]
        assert system.topics["t"].settings["period"].text == "2s"

    def test_facts_of_a_signal_without_a_name_are_lost_aloud(self):
        assert notes(read_model('<bpmn:signal id="S" qos:latched="true"/>')) == [("CQ040", "S")]

    def test_profile_is_a_reference(self):
        profile = read_event('qos:profile=" sensor_data "').endpoints[0].profiles
        assert profile == (ProfileRef("sensor_data", Place("model.bpmn", 3, None, "E", "@qos:profile")),)


def test_every_code_is_complete_and_every_note_has_its_severity():
    for code, info in CODES.items():
        assert (info.code, info.name == info.name.lower(), info.summary.endswith(".")) == (code, True, True)
    for path in CASES.iterdir():
        for note in read(Source(path.name, path.read_bytes()), WITH_MESSAGES).notes:
            assert note.severity == CODES[note.code].severity


def test_the_documented_example_is_read_as_it_stands():
    document = (EXAMPLES.parent / "docs" / "bpmn.md").read_text(encoding="utf-8")
    examples = re.findall(r"```xml\n(<bpmn:definitions.*?)```", document, re.DOTALL)
    assert examples
    for example in examples:
        system = read(Source("example.bpmn", example.encode()), ReadContext())
        assert system.notes == []
        assert system.endpoints
    assert set(re.findall(r"CQ\d\d\d", document)) <= CODES.keys()


def test_names_in_messages_are_short_and_printable():
    system = read_event(f'name="{"x" * 500}&#x9b;31m"', definition="<bpmn:signalEventDefinition/>")
    assert len(system.notes[0].message) < 200
    assert system.notes[0].message.isprintable()
