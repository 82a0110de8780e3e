"""What the QoS of participants in DDS-XML leaves open: beside each other, and by their bases."""

import itertools

import pytest

import cqos_core as cqos
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import Source

DESIGN = """cqos: 1
protocol: dds
options: {dds: {implementation: connext}}
participants: {w: {publishes: {T: {}}}, r: {subscribes: {T: {}}}}
"""
MATCH = "<property><value><element><name>q.z</name><value>1</value></element></value></property>"
DELIVERY = (
    "<discovery_config><remote_participant_purge_kind>NO_PURGE</remote_participant_purge_kind></discovery_config>"
)


def qos(inner, attributes=""):
    return f"<domain_participant_qos{attributes}>{inner}</domain_participant_qos>"


def profile(name, inner, attributes=""):
    return f'<qos_profile name="{name}"{attributes}>{inner}</qos_profile>'


def checked(*files, design=DESIGN):
    texts = {
        f"{number}.xml": f'<dds><qos_library name="L">{each}</qos_library></dds>' for number, each in enumerate(files)
    }
    sources = [Source("d.yaml", design.encode()), *(Source(name, text.encode()) for name, text in texts.items())]
    return cqos.check(merge([read_source(each) for each in sources]))


@pytest.mark.parametrize("order", list(itertools.permutations(("P", "Q", "S"))))
@pytest.mark.parametrize("apart", [False, True])
def test_what_may_prevent_a_match_counts_in_every_order_of_profiles(order, apart):
    inner = {"P": qos(MATCH), "Q": qos(DELIVERY), "S": qos("<entity_name><name>n</name></entity_name>")}
    profiles = [profile(name, inner[name]) for name in order]
    found = checked(*(profiles if apart else ["".join(profiles)]))
    assert found.verdict_words == "unknown"
    assert "CQ215" not in [each.code for each in found.findings]


def test_what_may_lose_samples_alone_leaves_the_match():
    assert checked(profile("P", qos(DELIVERY)) + profile("Q", qos(DELIVERY))).verdict_words == "compatible"
