"""Whatever the input: a system or an `InputError` that says where, and never anything else; claims never fail."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.model.source import ReadContext, Source
from cqos_core.plugins import load_plugins
from cqos_ros2.pack import PACK

CASES = Path(__file__).parent / "cases"
IMPORTERS = (
    "qos_overrides",
    "rviz",
    "gz_bridge",
    "ros1_bridge",
    "domain_bridge",
    "zenoh_bridge",
    "ros2_model",
    "fastdds",
)
YAML = IMPORTERS[:6]
SEEDS = {name: [file.read_bytes() for file in sorted((CASES / name).iterdir())] for name in IMPORTERS}
PIECES = [
    *(
        b"\n",
        b"\r",
        b"\t",
        b" ",
        b"  ",
        b": ",
        b":",
        b"- ",
        b"? ",
        b"#",
        b" #",
        b"&a ",
        b"*a",
        b"<<: ",
        b"!!int ",
        b"{",
        b"}",
    ),
    *(
        b"[",
        b"]",
        b",",
        b"'",
        b'"',
        b"|\n",
        b"---\n",
        b"...\n",
        b"\\",
        b"null",
        b"~",
        b"\x00",
        b"\xff",
        b"\xff\xfe",
        b"-1",
    ),
    *(
        b"<",
        b">",
        b"</qos>",
        b"<kind>",
        b"&lt;",
        b"]]>",
        b"<![CDATA[",
        b"<!--",
        b"<?a?>",
        b"/**",
        b".",
        b"./",
        b"/*",
        b"*/",
    ),
]
KEYS = [
    *(
        "ros__parameters",
        "qos_overrides",
        "/**",
        "/scan",
        "publisher",
        "subscription_a",
        "deadline",
        "reliability",
        "depth",
    ),
    *(
        "Visualization Manager",
        "Displays",
        "Tools",
        "Class",
        "Enabled",
        "Topic",
        "Value",
        "Depth",
        "Update Topic",
        "Name",
    ),
    *(
        "topics",
        "topic",
        "type",
        "queue_size",
        "qos",
        "history",
        "liveliness",
        "services_1_to_2",
        "service",
        "secs",
        "nsecs",
    ),
    *(
        "from_domain",
        "to_domain",
        "mode",
        "reversed",
        "bidirectional",
        "remap",
        "lifespan",
        "ros_topic_name",
        "direction",
    ),
    *("plugins", "ros2dds", "namespace", "domain", "allow", "deny", "publishers", "subscribers", "pub_max_frequencies"),
    *("gz_type_name", "qos_profile", "publisher_queue", "service_name", "name", "History Policy", "wait_for_publisher"),
]
SCALARS = st.sampled_from(
    [
        None,
        True,
        0,
        1,
        -1,
        2**63,
        1.5,
        "",
        "auto",
        "keep_last",
        "Keep Last",
        "reliable",
        "BIDIRECTIONAL",
        "/a",
        "a",
        "<x>/a",
    ]
) | st.text(max_size=4)
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(KEYS) | st.text(max_size=4), inner, max_size=5)
    ),
    max_leaves=25,
)


def check(importer, data):
    info = load_plugins().importers[importer]
    for name in ("f.yaml", "f.json5", "f.xml", "f.ros2", "f.rviz", "<bytes>"):
        assert info.load_claim()(name, data[:65_536]) in {True, False}
    try:
        system = info.load_reader()(Source("f", data), ReadContext())
    except cqos.InputError as error:
        refused = error
    else:
        check_system(system)
        return
    assert refused.problems
    check_places([problem.place for problem in refused.problems])
    str(refused).encode()


def check_places(places):
    assert all(place.source == "f" and (place.line or 0) >= 1 for place in places)


def check_system(system):
    assert {endpoint.participant for endpoint in system.endpoints} <= set(system.participants)
    assert len({endpoint.id for endpoint in system.endpoints}) == len(system.endpoints)
    places = [note.place for note in system.notes] + [overlay.place for overlay in system.overlays]
    ends = [end for each in system.bridges.values() for route in each.routes for end in (route.source, route.target)]
    assert {end.participant for end in ends} <= set(system.participants)
    places += [end.place for end in ends]
    places += [setting.place for endpoint in system.endpoints for setting in endpoint.settings.values()]
    check_places(places)
    assert {note.code for note in system.notes} <= {info.code for info in PACK.codes} | {"CQ005", "CQ040"}
    cqos.check(system)


@st.composite
def mutated(draw, importer):
    data = draw(st.sampled_from(SEEDS[importer]))
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.sampled_from([0, 0, 1, 2, 10, 100])))
        piece = draw(st.sampled_from(PIECES) | st.binary(max_size=3) | st.just(data[start:end] * 2))
        data = data[:start] + piece + data[end:]
    return data


@pytest.mark.parametrize("importer", IMPORTERS)
@given(data=st.data())
def test_mutated_files(importer, data):
    check(importer, data.draw(mutated(importer)))


@pytest.mark.parametrize("importer", IMPORTERS)
@given(data=st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_anything(importer, data):
    check(importer, data)


WRAPPED = {
    "qos_overrides": lambda value: {"n": {"ros__parameters": {"qos_overrides": value}, "m": value}},
    "rviz": lambda value: {"Visualization Manager": {"Displays": [value, {"Topic": value}], "Tools": value}},
    "gz_bridge": lambda value: [value, {"topic_name": "/a", "ros_type_name": "a/B", "direction": value}],
    "ros1_bridge": lambda value: {"topics": [value, {"topic": "/a", "qos": value}], "services_1_to_2": value},
    "domain_bridge": lambda value: {
        "from_domain": 1,
        "to_domain": 2,
        "topics": {"/a": value, "/b": {"type": "a", "qos": value}},
    },
    "zenoh_bridge": lambda value: {"plugins": {"ros2dds": {"allow": value, "namespace": "/a", "nodename": value}}},
}


@pytest.mark.parametrize("importer", YAML)
@given(value=VALUES)
def test_documents_of_every_shape(importer, value):
    check(importer, yaml.safe_dump(WRAPPED[importer](value)).encode())
    check(importer, yaml.safe_dump(value).encode())


ELEMENTS = ("dds", "profiles", "data_writer", "data_reader", "topic", "qos", "historyQos", "depth", "x")
POLICIES = ("reliability", "kind", "deadline", "period", "sec", "lifespan", "duration", "liveliness", "lease_duration")
TAGS = st.sampled_from((*ELEMENTS, *POLICIES, "partition", "names", "name"))
TEXTS = st.sampled_from(["", "1", "-1", "RELIABLE", "DURATION_INFINITY", "x", "&amp;"])
XML = st.recursive(
    TEXTS,
    lambda inner: st.tuples(TAGS, st.lists(inner, max_size=3)).map(
        lambda element: f'<{element[0]} profile_name="/a">{"".join(element[1])}</{element[0]}>'
    ),
    max_leaves=20,
)


@given(XML)
def test_xml_of_every_shape(text):
    check("fastdds", f"<dds><profiles><data_writer profile_name='/a'>{text}</data_writer></profiles></dds>".encode())
    check("fastdds", f"<profiles>{text}</profiles>".encode())
