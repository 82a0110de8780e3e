"""Signals and signal events leave the tree while a diagram is parsed: the system is the one of a tree that holds them all."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from typing import TYPE_CHECKING

from hypothesis import given
from hypothesis import strategies as st

from cqos_core.bpmn import read
from cqos_core.model.endpoint_rows import RowEndpoint, kinds_of, rows_of
from cqos_core.model.problems import InputError
from cqos_core.model.settings import Setting
from cqos_core.model.source import ReadContext, Source
from cqos_core.model.system import Endpoint, System

if TYPE_CHECKING:
    from collections.abc import Sequence

URI = "http://www.omg.org/spec/BPMN/20100524/MODEL"


def read_as(data: bytes, **switches: str) -> System | list[str]:
    """Read a document; return the codes of the problems of one that cannot be read."""
    try:
        return replace(read(Source("x.bpmn", data), ReadContext(options={"bpmn": switches})), sources={})
    except InputError as error:
        return [problem.code for problem in error.problems]


EMPTY = "<!-- extensions -->"
"""Where an element has room for extensions: empty ones state nothing, and keep it in the tree."""


def in_the_tree(data: bytes) -> bytes:
    prefix = b"bpmn:" if b"<bpmn:" in data else b""
    return data.replace(EMPTY.encode(), b"<%bextensionElements/>" % prefix)


ZEROS = ["history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness", "leaseDuration"]
ATTRIBUTES = (
    *('qos:reliability="reliable"', 'qos:depth="5"', 'qos:deadline="17ms"', 'qos:lifespan="0.5"', 'qos:durability="0"'),
    *('qos:lease_duration="2s"', 'isInterrupting="false"', 'attachedToRef="T"', '\n qos:history="x"', 'qos:x="9"'),
    *('qos:external="true"', 'qos:type="a/B"', 'qos:protocol="ros2"', 'qos:profile="sensor_data"', 'f:x="1"'),
)
ODD_ATTRIBUTES = (
    *('qos:deadline="1e-7"', 'qos:leaseDuration="3s"', 'qos:external="2"', 'q:depth="5"', 'reliability="reliable"'),
    *("qos:depth='5'", 'qos:depth="&lt;5"', 'xmlns:z="http://z"', 'nowhere:depth="1"', 'qos:depth = "1"', 'id="E0"'),
    " ".join(f'qos:{name}="0"' for name in ZEROS),
)
SIGNALS = (
    'id="S1" name="one"',
    'id="S2" name="two"',
    'name="three" id="S3"',
    'id="S5" name="a  b"',
    'id="S8" name="é"',
)
ODD_SIGNALS = (
    *('id="S4" name=""', 'id="S6" name="${computed}"', 'id="S7" name="one"', 'id="S1" name="again"', 'id="S11"'),
    *(
        'id="S9" name="far" qos:external="true"',
        'id="S10" name="typed" structureRef="I"',
        'id="S9" name="x" qos:depth="1"',
    ),
    *('id="S12" name="inside" f:scope="processInstance"', 'id="S13" name="&amp;"'),
)
BETWEEN = (
    *('<P:sequenceFlow sourceRef="E0" targetRef="E1"/>', '<P:sequenceFlow sourceRef="E2" targetRef="T"/>'),
    *("", "\n", "  ", "<!-- a comment -->"),
    "<!-- <P:signal id='S1' name='one'/> -->",
    "<?tool data?>",
)
ODD_BETWEEN = (
    *(
        "<P:task id='T' qos:depth='1'/>",
        "<P:userTask id='U'/>",
        "<P:signal id='S3' name='inner'/>",
        "&#10;",
        "text",
        "<![CDATA[ x ]]>",
        "<!-- ",
        "<P:task>",
    ),
    "<P:extensionElements>",
)
INSIDE = ("", "\n", "<P:incoming>F1</P:incoming>", "<P:outgoing>F1</P:outgoing>\n")
ODD_INSIDE = (
    *("<P:documentation>why</P:documentation>", "<!-- a -->", "<P:timerEventDefinition/>", "text"),
    '<P:signalEventDefinition signalRef="S2"/>',
    "<P:extensionElements><qos:need name='latest' value='true'/></P:extensionElements>",
    "<P:extensionElements><qos:accept rule='ROS101' because='so'/></P:extensionElements>",
)
DEFINITIONS = (
    '<P:signalEventDefinition id="D" signalRef="{}"/>',
    '<P:signalEventDefinition signalRef="{}" id="D"></P:signalEventDefinition>',
)
ODD_DEFINITIONS = ('<P:signalEventDefinition signalRef="{}" qos:depth="1"/>', "<P:signalEventDefinition/>")
POOLS = ("", '<P:collaboration id="C"><P:participant id="p" processRef="A"/></P:collaboration>')
ODD_POOLS = (
    '<P:collaboration id="C"><P:participant id="p" processRef="A"/><P:participant id="q" processRef="A"/></P:collaboration>',
    '<P:collaboration id="C"><P:participant id="p" processRef="A" q:depth="1"/></P:collaboration>',
)
AROUND = ('<P:process id="B">{}</P:process>', '<P:process id="B"><P:subProcess>{}</P:subProcess></P:process>')
ODD_AROUND = (
    "{}",
    "<P:process id='B'><P:extensionElements>{}</P:extensionElements></P:process>",
    "<P:task name='{}'/>",
)
TAGS = ("startEvent", "endEvent", "intermediateThrowEvent", "intermediateCatchEvent", "boundaryEvent")


@st.composite
def diagrams(draw: st.DrawFn) -> bytes:
    """Draw a diagram of plain events and signals, with something odd now and then; what comes out may be no XML."""
    oddity = draw(st.sampled_from([4, 20, 60]))

    def piece(plain: Sequence[str], odd: Sequence[str] = ()) -> str:
        return draw(st.sampled_from(odd if odd and draw(st.integers(1, oddity)) == oddity else plain))

    events = []
    for number in range(draw(st.integers(1, 6))):
        identity = piece([f'id="E{number}"'], ['id="E1"', 'id="S1"', "", 'id="é"', 'id="A/publisher/one"', 'id=""'])
        others = list(dict.fromkeys(piece(ATTRIBUTES, ODD_ATTRIBUTES) for _ in range(draw(st.integers(0, 3)))))
        named = piece([f'name="n{number}"', 'name=""', ""])
        attributes = " ".join(draw(st.permutations([each for each in (identity, named, *others) if each])))
        signal = piece(
            ["S1", "S2", "S3", "S5", "S8"], ["S4", "S6", "S7", "S9", "S10", "S12", "S13", "x:S1", "lost", ""]
        )
        definition = piece(DEFINITIONS, ODD_DEFINITIONS).format(signal)
        inside = f"{EMPTY}{piece(INSIDE, ODD_INSIDE)}{definition}{piece(['', chr(10)], ODD_INSIDE)}"
        tag = piece(TAGS)
        events.append(f"<P:{tag} {attributes}>{inside}</P:{tag}>{piece(BETWEEN, ODD_BETWEEN)}")
    signals = [each for each in SIGNALS if draw(st.integers(1, oddity)) != oddity]
    signals += [each for each in ODD_SIGNALS if draw(st.integers(1, oddity)) == oddity]
    signals = [f"<P:signal {each}>{EMPTY}</P:signal>" for each in draw(st.permutations(signals))]
    half = len(events) // 2
    parts = [
        "".join(signals),
        f'<P:process id="A">{"".join(events[:half])}</P:process>',
        piece(AROUND, ODD_AROUND).replace("{}", "".join(events[half:])),
        piece(POOLS, ODD_POOLS),
    ]
    prefix = piece(["", "bpmn:"])
    bound = (
        f'xmlns{":bpmn" if prefix else ""}="{URI}" xmlns:qos="http://qos" xmlns:f="http://f" xmlns:q="http://www.qos"'
    )
    text = piece(["\n", "\r\n"]).join(draw(st.permutations(parts)))
    return f"<?xml version='1.0'?><P:definitions {bound}>{text}</P:definitions>".replace("P:", prefix).encode()


@given(diagrams(), st.sampled_from(["false", "true"]), st.booleans())
def test_any_diagram(data: bytes, message_flows: str, is_long: bool):
    if is_long:
        data = data.replace(b"process id", b"process" + b"\n" * 33_000 + b"id")
    found = read_as(data, message_flows=message_flows)
    assert found == read_as(in_the_tree(data), message_flows=message_flows)


HEAD = f'<definitions xmlns="{URI}" xmlns:qos="http://qos"><signal id="S" name="s"/><process id="P">\n'
EVENT = '<endEvent id="E{0}" name="e" qos:depth="{0}" qos:deadline="{0}ms"><signalEventDefinition signalRef="S"/></endEvent>\n'


def model(*inside: str) -> bytes:
    return f"{HEAD}{''.join(inside)}</process></definitions>".encode()


def system_of(*inside: str) -> System:
    return read(Source("x.bpmn", model(*inside)), ReadContext())


def rows(system: System) -> list[str]:
    """The ids of the endpoints that are rows."""
    return [each[1] for each in rows_of(system.endpoints) if isinstance(each, tuple)]


def test_what_differs_in_texts_alone_is_read_once():
    system = system_of(*(EVENT.format(number) for number in range(1, 10)))
    assert len(rows(system)) == 9
    assert len([*kinds_of(system.endpoints)]) == 1
    assert [each.settings["deadline"].text for each in system.endpoints[:2]] == ["1ms", "2ms"]


def test_odd_events_stay_in_their_order():
    odd = '<endEvent id="O"><extensionElements/><signalEventDefinition signalRef="S"/></endEvent>'
    system = system_of(EVENT.format(1), odd, EVENT.format(2))
    assert rows(system) == ["E1", "E2"]
    assert [endpoint.id for endpoint in system.endpoints] == ["E1", "O", "E2"]


def test_events_that_need_a_note_stay_in_the_tree():
    lost = EVENT.format(2).replace('signalRef="S"', 'signalRef="lost"')
    system = system_of(EVENT.format(1), lost)
    assert rows(system) == ["E1"]
    assert [note.code for note in system.notes] == ["CQ032", "CQ034"]


def test_an_id_that_is_used_twice_gets_a_number():
    system = system_of(EVENT.format(1), EVENT.format(1))
    assert [endpoint.id for endpoint in system.endpoints] == ["E1", "E1#2"]
    (note,) = system.notes
    assert (note.code, str(note.place)) == ("CQ031", "x.bpmn:3 (E1)")


def test_what_extensions_hold_is_none_of_the_model():
    system = system_of(f"<extensionElements>{EVENT.format(1)}</extensionElements>", EVENT.format(2))
    assert [endpoint.id for endpoint in system.endpoints] == ["E2"]


def test_of_signals_with_one_id_the_first_is_meant_wherever_it_stands():
    inside = '<signal id="T" name="inner"/>', EVENT.format(1).replace('"S"', '"T"')
    data = model(*inside).replace(b"</definitions>", b'<signal id="T" name="outer"/></definitions>')
    system = read(Source("x.bpmn", data), ReadContext())
    assert [each.topic for each in system.endpoints] == ["inner"]
    assert [(note.code, note.place and note.place.line) for note in system.notes] == [("CQ031", 3)]


def test_characters_that_are_escaped_are_meant_in_rows_and_in_the_tree():
    odd = EVENT.format(2).replace("><signal", "><extensionElements/><signal")
    data = model(EVENT.format(1), odd).replace(b'name="s"', b'name="a &amp; &lt;b&#62;"').replace(b"ms", b"&#x6d;s")
    system = read(Source("x.bpmn", data.replace(b'name="e"', b'name="&#38;amp;"')), ReadContext())
    assert rows(system) == ["E1"]
    assert {each.topic for each in system.endpoints} == {"a & <b>"}
    assert [(each.label, each.settings["deadline"].text) for each in system.endpoints] == [
        ("&amp;", "1ms"),
        ("&amp;", "2ms"),
    ]


class TestRowEndpoint:
    def endpoint(self) -> RowEndpoint:
        (endpoint,) = system_of("\n", EVENT.format(1)).endpoints
        assert isinstance(endpoint, RowEndpoint)
        return endpoint

    def test_is_an_endpoint_for_every_purpose(self):
        endpoint = self.endpoint()
        plain = replace(endpoint)
        for made in (pickle.loads(pickle.dumps(self.endpoint())), copy.deepcopy(self.endpoint())):  # noqa: S301 - our own
            assert type(made) is Endpoint
            assert made == endpoint
            assert endpoint == made
        assert plain == endpoint
        assert repr(endpoint).startswith("Endpoint(id='E1'")
        assert endpoint != "E1"
        assert not hasattr(endpoint, "colour")

    def test_says_what_it_states_now(self):
        endpoint = self.endpoint()
        assert endpoint.setting_texts() == replace(self.endpoint()).setting_texts()
        assert endpoint.place is not None
        assert endpoint.place.line == 3
        assert endpoint.room is not None
        endpoint.settings["depth"] = Setting("8")
        assert endpoint.setting_texts() != self.endpoint().setting_texts()
        other = self.endpoint()
        other.overlay["depth"] = Setting("8")
        assert other.setting_texts() != self.endpoint().setting_texts()


def test_lines_of_long_documents_are_exact():
    odd = '<endEvent id="O"\n ><extensionElements/><signalEventDefinition signalRef="S"/></endEvent>\n'
    system = system_of(
        "\n" * 70_000, EVENT.format(1), EVENT.format(2), "\n" * 10, odd, "<!-- <a/>\n -->\n\n\n", EVENT.format(3)
    )
    lines = {each.id: each.place.line for each in system.endpoints if each.place is not None}
    assert lines == {"E1": 70_002, "E2": 70_003, "O": 70_015, "E3": 70_020}
