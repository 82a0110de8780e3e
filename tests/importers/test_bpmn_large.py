"""A comment behind a diagram changes nothing, however long it is: large diagrams are read as small ones."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from tests.importers.test_bpmn_fuzz import FILES, MUTATIONS, Mutation, mutations

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

URI = "http://www.omg.org/spec/BPMN/20100524/MODEL"
COMMENT = f"<!-- {'long ' * 8_000}-->".encode()


def read(data: bytes) -> cqos.System | None:
    """Read a document, without its bytes; None where it is refused."""
    try:
        return replace(cqos.read(data, importer="bpmn"), sources={})
    except cqos.InputError:
        return None


def assert_same(data: bytes) -> cqos.System | None:
    small, large = read(data), read(data + COMMENT)
    assert small == large
    return large


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
        inside = f"{piece(INSIDE, ODD_INSIDE)}{definition}{piece(['', chr(10)], ODD_INSIDE)}"
        tag = piece(TAGS)
        events.append(f"<P:{tag} {attributes}>{inside}</P:{tag}>{piece(BETWEEN, ODD_BETWEEN)}")
    signals = [f"<P:signal {each}/>" for each in SIGNALS if draw(st.integers(1, oddity)) != oddity]
    signals += [f"<P:signal {each}/>" for each in ODD_SIGNALS if draw(st.integers(1, oddity)) == oddity]
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


@given(diagrams())
def test_any_diagram(data: bytes):
    assert_same(data)


@given(st.sampled_from(FILES), mutations)
def test_damaged_files(path: Path, changes: list[Mutation]):
    data = path.read_bytes()
    for kind, where, with_ in changes:
        data = MUTATIONS[kind](data, where, with_)
    assert_same(data)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_files(path: Path):
    assert_same(path.read_bytes())


HEAD = f'<definitions xmlns="{URI}" xmlns:qos="http://qos"><signal id="S" name="s"/><process id="P">\n'
EVENT = '<endEvent id="E{0}" name="e" qos:depth="{0}" qos:deadline="{0}ms"><signalEventDefinition signalRef="S"/></endEvent>\n'


def model(*inside: str) -> bytes:
    return f"{HEAD}{''.join(inside)}</process></definitions>".encode()


def test_odd_events_stay_in_their_order():
    odd = '<endEvent id="O" qos:depth="&#53;"><signalEventDefinition signalRef="S"/></endEvent>'
    system = assert_same(model(EVENT.format(1), odd, EVENT.format(2)))
    assert system is not None
    assert [endpoint.id for endpoint in system.endpoints] == ["E1", "O", "E2"]
    assert [endpoint.settings["depth"].text for endpoint in system.endpoints] == ["1", "5", "2"]


@pytest.mark.parametrize(
    "odd",
    [
        EVENT.format(1),
        '<signal id="S" name="t"/>',
        '<signal id="T" name="s"/>',
        "<cqos-plain/>",
        "<cqos-plain><cqos-plain/></cqos-plain>",
        f"<extensionElements>{EVENT.format(3)}</extensionElements>",
        f'<task name="{EVENT.format(1)}"/>',
        '<task xmlns:z="http://z"/>',
        "<!-- <a/>\n -->\n\n\n",
    ],
)
def test_what_stands_beside_events(odd: str):
    assert_same(model(EVENT.format(1), odd, EVENT.format(2)))


def test_lines_of_long_documents_are_exact():
    odd = '<endEvent id="O" qos:depth="&#53;"\n ><signalEventDefinition signalRef="S"/></endEvent>\n'
    system = assert_same(
        model("\n" * 70_000, EVENT.format(1), EVENT.format(2), "\n" * 10, odd, "<!-- <a/>\n -->\n\n\n", EVENT.format(3))
    )
    assert system is not None
    lines = {each.id: each.place.line for each in system.endpoints if each.place is not None}
    assert lines == {"E1": 70_002, "E2": 70_003, "O": 70_015, "E3": 70_020}
