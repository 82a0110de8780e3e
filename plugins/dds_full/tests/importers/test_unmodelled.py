"""Each element of a format is modelled, or sorted by what it can decide: lists of elements, as the owners of the formats publish them."""

from pathlib import Path

import pytest
from lxml import etree

from cqos_core import check
from cqos_dds.importers.policy_forms import (
    FAST_ALSO,
    FAST_QOS,
    FAST_READ_ONLY,
    FAST_TOPIC,
    OMG,
)
from cqos_dds.importers.unmodelled_elements import (
    CYCLONE,
    DDS_XML,
    DDS_XML_PARTICIPANT,
    FAST,
    FAST_PARTICIPANT,
    FAST_SECTIONS,
    OPENDDS,
)

SCHEMA_NAMES = ("connext", "fastdds", "cyclonedds", "opendds", "opendds_ini")
SCHEMAS = Path(__file__).parent / "schemas"
FAST_FORMS = {
    "qos": FAST_QOS | {other: FAST_QOS[name] for other, name in FAST_ALSO.items()} | FAST_READ_ONLY,
    "topic": FAST_TOPIC,
}


def paths(schema):
    lines = (SCHEMAS / f"{schema}.txt").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if not line.startswith("#")]


def is_policy(path, forms):
    """Whether a path is of a field of a policy, or of what stands in one."""
    policy, _, rest = path.partition("/")
    return policy in forms and any(f"{rest}/".startswith(f"{field}/") for field in forms[policy])


def sorting(schema, path):
    """The table that an element of a schema stands in, with its path there, and whether a policy models it."""
    first, _, rest = path.partition("/")
    if schema == "opendds_ini":
        return OPENDDS, path, False
    if schema == "cyclonedds":
        return CYCLONE, path, False
    if schema == "fastdds":
        if first == "participant":
            return FAST_PARTICIPANT, rest, False
        if first in {"data_writer", "data_reader"}:
            above, _, below = rest.partition("/")
            return FAST, rest, above in FAST_FORMS and is_policy(below, FAST_FORMS[above])
        return FAST_SECTIONS, path, False
    if first in {"participant_qos", "participant_factory_qos"}:
        return DDS_XML_PARTICIPANT, rest, False
    return DDS_XML, rest, is_policy(rest, OMG)


def prefixes(path):
    steps = path.split("/")
    return ["/".join(steps[: number + 1]) for number in range(len(steps))]


def judged(table, path):
    """What the table says of an element, or of one that it stands in."""
    return next((found for each in prefixes(path) if (found := table.find(each)) is not None), None)


EVERY = [(schema, path) for schema in SCHEMA_NAMES for path in paths(schema)]


@pytest.mark.parametrize("schema", SCHEMA_NAMES)
def test_each_element_of_the_schema_is_modelled_or_sorted(schema):
    missing = []
    for path in paths(schema):
        table, below, modelled = sorting(schema, path)
        if not modelled and judged(table, below) is None:
            missing.append(path)
    assert missing == []


@pytest.mark.parametrize(
    "table", [DDS_XML, DDS_XML_PARTICIPANT, FAST, FAST_PARTICIPANT, FAST_SECTIONS, CYCLONE], ids=lambda each: ""
)
def test_an_element_that_no_table_names_may_prevent_a_match(table):
    element = etree.fromstring("<nobody_has_this><inner>1</inner></nobody_has_this>")
    assert [(path, effect) for path, _, effect in table.undecided(element, "nobody_has_this")] == [
        ("nobody_has_this", "match")
    ]


def test_no_element_that_may_decide_stands_in_one_that_cannot_matter():
    for table in (DDS_XML, DDS_XML_PARTICIPANT, FAST, FAST_PARTICIPANT, FAST_SECTIONS, CYCLONE):
        for pattern in table.may_decide:
            above = prefixes(pattern.partition("=")[0])[:-1]
            assert not {*above} & {*table.cannot_matter}, pattern


TABLES = {
    "DDS_XML": DDS_XML,
    "DDS_XML_PARTICIPANT": DDS_XML_PARTICIPANT,
    "FAST": FAST,
    "FAST_PARTICIPANT": FAST_PARTICIPANT,
    "FAST_SECTIONS": FAST_SECTIONS,
    "CYCLONE": CYCLONE,
}
LISTS_OF_PROPERTIES = {"property/value", "propertiesPolicy/properties", "rtps/propertiesPolicy/properties"}


def nested(path, text):
    """The outermost element of a path, with a text in the innermost one."""
    steps, inner = path.split("/"), None
    for number in range(len(steps) - 1, -1, -1):
        is_property = "/".join(steps[:number]) in LISTS_OF_PROPERTIES
        element = etree.Element("property" if is_property else steps[number])
        if is_property:
            etree.SubElement(element, "name").text = steps[number]
            etree.SubElement(element, "value").text = text
        elif inner is None:
            element.text = text
        else:
            element.append(inner)
        inner = element
    return inner


@pytest.mark.parametrize(
    ("name", "pattern"), [(name, pattern) for name, table in TABLES.items() for pattern in table.cannot_matter]
)
def test_each_pattern_of_what_cannot_matter_is_reached(name, pattern):
    path, _, text = pattern.replace("*", "x").partition("=")
    outermost = nested(path, text or ("" if "=" in pattern else "7"))
    assert [*TABLES[name].undecided(outermost, path.partition("/")[0])] == []


@pytest.mark.parametrize("pattern", OPENDDS.cannot_matter)
def test_each_key_of_opendds_that_cannot_matter_is_reached(pattern):
    path, _, text = pattern.replace("*", "x").partition("=")
    assert OPENDDS.find(path, text or "7") == "none"


def undecided(table, xml):
    element = etree.fromstring(xml)
    return [(path, effect) for path, _, effect in table.undecided(element, element.tag)]


def rti_property(name):
    return f"<property><value><element><name>{name}</name><value>1</value></element></value></property>"


def fast_property(name):
    return f"<propertiesPolicy><properties><property><name>{name}</name></property></properties></propertiesPolicy>"


MASK = "<transport_builtin><mask>{}</mask></transport_builtin>"
PLUGINS = "<discovery_config><builtin_discovery_plugins>{}</builtin_discovery_plugins></discovery_config>"
DISCOVERY = "<rtps><builtin><discovery_config>{}</discovery_config></builtin></rtps>"
ALLOCATION = "<rtps><allocation><total_readers><{0}>{1}</{0}></total_readers></allocation></rtps>"
MATCHED = "<matched{0}sAllocation><{1}>{2}</{1}></matched{0}sAllocation>"


@pytest.mark.parametrize(
    ("name", "xml", "found"),
    [
        ("DDS_XML_PARTICIPANT", rti_property("dds.transport.UDPv4.builtin.recv_socket_buffer_size"), []),
        ("DDS_XML_PARTICIPANT", rti_property("rti.monitor.library"), []),
        ("DDS_XML_PARTICIPANT", rti_property("dds.other"), [("property/value/dds.other", "match")]),
        ("FAST", fast_property("fastdds.unique_network_flows"), []),
        ("FAST", fast_property("dds.other"), [("propertiesPolicy/properties/dds.other", "match")]),
        ("FAST_PARTICIPANT", f"<rtps>{fast_property('fastdds.statistics')}</rtps>", []),
        ("DDS_XML", "<service><kind>NO_SERVICE_QOS</kind></service>", []),
        ("DDS_XML", "<service><kind>PERSISTENCE_SERVICE_QOS</kind></service>", [("service/kind", "match")]),
        (
            "FAST_PARTICIPANT",
            DISCOVERY.format("<simpleEDP><PUBWRITER_SUBREADER>true</PUBWRITER_SUBREADER></simpleEDP>"),
            [],
        ),
        (
            "FAST_PARTICIPANT",
            DISCOVERY.format("<simpleEDP><PUBWRITER_SUBREADER>false</PUBWRITER_SUBREADER></simpleEDP>"),
            [("rtps/builtin/discovery_config/simpleEDP/PUBWRITER_SUBREADER", "match")],
        ),
        ("DDS_XML_PARTICIPANT", MASK.format("UDPv4 | SHMEM"), []),
        ("DDS_XML_PARTICIPANT", MASK.format("TRANSPORTBUILTIN_MASK_DEFAULT"), []),
        ("DDS_XML_PARTICIPANT", MASK.format("SHMEM"), [("transport_builtin/mask", "discovery")]),
        ("DDS_XML_PARTICIPANT", MASK.format("UDPv4_WAN"), [("transport_builtin/mask", "discovery")]),
        ("DDS_XML_PARTICIPANT", PLUGINS.format("SDP"), []),
        ("DDS_XML_PARTICIPANT", PLUGINS.format("DDS_DISCOVERYCONFIG_BUILTIN_SDP"), []),
        (
            "DDS_XML_PARTICIPANT",
            PLUGINS.format("SDP2"),
            [("discovery_config/builtin_discovery_plugins", "match")],
        ),
        (
            "DDS_XML_PARTICIPANT",
            "<resource_limits><max_gather_destinations>16</max_gather_destinations></resource_limits>",
            [],
        ),
        ("FAST_PARTICIPANT", "<rtps><allocation/></rtps>", []),
        ("FAST_PARTICIPANT", ALLOCATION.format("initial", 8), []),
        ("FAST_PARTICIPANT", ALLOCATION.format("maximum", 0), []),
        (
            "FAST_PARTICIPANT",
            ALLOCATION.format("maximum", 1),
            [("rtps/allocation/total_readers/maximum", "discovery")],
        ),
        ("FAST", MATCHED.format("Subscriber", "initial", 1), []),
        ("FAST", MATCHED.format("Publisher", "increment", 1), []),
        ("FAST", MATCHED.format("Publisher", "maximum", 0), []),
        ("FAST", MATCHED.format("Subscriber", "maximum", 1), [("matchedSubscribersAllocation/maximum", "match")]),
        ("FAST", MATCHED.format("Publisher", "maximum", 1), [("matchedPublishersAllocation/maximum", "match")]),
        ("CYCLONE", "<Discovery><Peers/></Discovery>", []),
        ("CYCLONE", "<Discovery><Peers><Peer Address='a'/></Peers></Discovery>", [("Discovery/Peers", "discovery")]),
        ("CYCLONE", "<Partitioning><IgnoredPartitions/></Partitioning>", []),
        (
            "CYCLONE",
            "<Partitioning><IgnoredPartitions><IgnoredPartition/></IgnoredPartitions></Partitioning>",
            [("Partitioning/IgnoredPartitions", "match")],
        ),
    ],
)
def test_the_most_specific_pattern_decides(name, xml, found):
    assert undecided(TABLES[name], xml) == found


SYSTEM = """cqos: 1
protocol: dds
options: {{dds: {{implementation: {}}}}}
participants:
  a: {{publishes: {{T: {{}}}}}}
  b: {{subscribes: {{T: {{}}}}}}
"""
TAG = b"<CycloneDDS><Domain><Discovery><Tag>a</Tag></Discovery></Domain></CycloneDDS>"
UNKNOWN = b"<dds><qos_library name='L'><qos_profile name='P'><participant_qos><nobody_has_this/></participant_qos></qos_profile></qos_library></dds>"


@pytest.mark.parametrize(
    ("implementation", "xml", "reported"),
    [
        ("cyclonedds", TAG, []),
        ("cyclonedds_0_10", TAG, []),
        ("opendds", TAG, ["implementation cyclonedds or cyclonedds_0_10"]),
        ("connext", UNKNOWN, []),
        ("opendds", UNKNOWN, ["implementation connext or standard"]),
    ],
)
def test_a_file_that_holds_under_several_implementations_covers_endpoints_of_one(implementation, xml, reported):
    report = check(SYSTEM.format(implementation).encode(), xml)
    said = [finding.message.rpartition(", ")[2] for finding in report.findings if finding.code == "CQ214"]
    assert said == reported
