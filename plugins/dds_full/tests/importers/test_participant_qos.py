"""What the QoS of participants in DDS-XML leaves open: beside each other, and by their bases."""

import itertools

import pytest

import cqos_core as cqos

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


@pytest.fixture
def checked(tmp_path):
    """Return what checks files, each with a library, beside a design."""

    def check(*files, design=DESIGN):
        for each in tmp_path.iterdir():
            each.unlink()
        (tmp_path / "d.yaml").write_text(design, encoding="utf-8")
        for number, each in enumerate(files):
            text = f'<dds><qos_library name="L">{each}</qos_library></dds>'
            (tmp_path / f"{number}.xml").write_text(text, encoding="utf-8")
        return cqos.check(*sorted(tmp_path.iterdir()))

    return check


@pytest.mark.parametrize("order", list(itertools.permutations(("P", "Q", "S"))))
@pytest.mark.parametrize("apart", [False, True])
def test_what_may_prevent_a_match_counts_in_every_order_of_profiles(checked, order, apart):
    inner = {"P": qos(MATCH), "Q": qos(DELIVERY), "S": qos("<entity_name><name>n</name></entity_name>")}
    profiles = [profile(name, inner[name]) for name in order]
    found = checked(*(profiles if apart else ["".join(profiles)]))
    assert found.verdict_words == "unknown"
    assert "CQ215" not in [each.code for each in found.findings]


def test_what_may_lose_samples_alone_leaves_the_match(checked):
    assert checked(profile("P", qos(DELIVERY)) + profile("Q", qos(DELIVERY))).verdict_words == "compatible"


WRITER = "<datawriter_qos><ownership_strength><value>1</value></ownership_strength></datawriter_qos>"
MISSING = ' base_name="L::M"'
LISTED = "<base_name><element>L::M</element></base_name>"


@pytest.mark.parametrize(
    "inner",
    [
        profile("P", qos("", MISSING)),
        profile("P", qos("", ' base_name="M"')),
        profile("P", qos(LISTED)),
        profile("P", qos(""), MISSING),
        qos("", f' name="P"{MISSING}'),
        profile("P", qos("", ' base_name="$(ANY)::P"')),
    ],
)
def test_a_base_of_participants_that_no_file_defines_may_prevent_a_match(checked, inner):
    found = checked(inner)
    assert found.verdict_words == "unknown"
    expected = "CQ217" if "$(" in inner else "CQ204"
    assert [each.code for each in found.findings if each.code in {"CQ204", "CQ217"}] == [expected]
    assert checked(inner, design=DESIGN.replace("connext", "fastdds_3_1")).verdict_words != "unknown"


@pytest.mark.parametrize(
    "base", [profile("M", qos("")), profile("M", WRITER), qos("", ' name="M"'), profile("M", qos(DELIVERY))]
)
@pytest.mark.parametrize("apart", [False, True])
def test_one_that_a_file_defines_is_known(checked, base, apart):
    inner = [profile("P", qos("", MISSING)), profile("P", qos(LISTED))]
    if base.startswith("<qos_profile"):
        inner.append(profile("P", qos(""), MISSING))
    for each in inner:
        found = checked(*((each, base) if apart else (each + base,)))
        assert found.verdict_words == "compatible"
        assert "CQ204" not in [each.code for each in found.findings]


@pytest.mark.parametrize("name", ["BuiltinQosLib::Generic.Common", "BuiltinQosLib::Baseline.7.0.0"])
def test_one_that_is_built_into_connext_prevents_no_match(checked, name):
    assert checked(profile("P", qos("", f' base_name="{name}"'))).verdict_words == "compatible"


def test_the_base_of_one_participant_is_about_its_endpoints_only():
    system = """<dds><domain_library name="D"><domain name="d" domain_id="0"><register_type name="S"/>
    <topic name="T" register_type_ref="S"/></domain></domain_library><domain_participant_library name="A">
    <domain_participant name="w" domain_ref="D::d">%s<publisher name="g"><data_writer name="e" topic_ref="T"/></publisher></domain_participant>
    <domain_participant name="r" domain_ref="D::d"><subscriber name="g"><data_reader name="e" topic_ref="T"/></subscriber></domain_participant>
    </domain_participant_library></dds>"""
    verdicts = [cqos.check((system % own).encode()).verdict_words for own in ("", qos("", MISSING))]
    assert verdicts == ["compatible", "unknown"]


def test_several_participants_with_one_base_are_one_finding():
    system = """<dds><domain_participant_library name="A"><domain_participant name="b">%s</domain_participant>
    <domain_participant name="w" base_name="b"/><domain_participant name="r" base_name="b"/></domain_participant_library></dds>"""
    found = cqos.check((system % qos("", MISSING)).encode())
    assert [each.code for each in found.findings].count("CQ204") == 1
