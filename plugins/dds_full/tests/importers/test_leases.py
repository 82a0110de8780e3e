"""The lease of participants in XML files of Fast DDS, RTI Connext and Cyclone DDS."""

import pytest

import cqos_core as cqos
from cqos_core import InputError
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import Source

FAST = (
    '<dds xmlns="http://www.eprosima.com"><profiles>{}<data_writer profile_name="w"><qos><ownershipStrength><value>1</value>'
    "</ownershipStrength></qos></data_writer></profiles></dds>"
)
CONNEXT = '<dds><qos_library name="L">{}</qos_library></dds>'
CYCLONE = '<CycloneDDS xmlns="https://cdds.io/config">{}</CycloneDDS>'


def fast(name, seconds, more=""):
    return (
        f'<participant profile_name="{name}" {more}><rtps><builtin><discovery_config><leaseDuration><sec>{seconds}</sec>'
        "</leaseDuration></discovery_config></builtin></rtps></participant>"
    )


def connext(name, seconds, more=""):
    return (
        f'<qos_profile name="{name}" {more}><participant_qos><discovery_config><participant_liveliness_lease_duration>'
        f"<sec>{seconds}</sec></participant_liveliness_lease_duration></discovery_config></participant_qos></qos_profile>"
    )


def domain(lease, more=""):
    return f"<Domain {more}><Discovery><LeaseDuration>{lease}</LeaseDuration></Discovery></Domain>"


def needing(text, needs="30s", implementation="fastdds_3_1", more=""):
    """Check a writer whose reader has to notice within 30 s that it is gone."""
    design = (
        f"cqos: 1\nprotocol: dds\noptions: {{dds: {{implementation: {implementation}, extensibility: final}}}}\nparticipants:\n"
        f"  a: {{{more}publishes: {{T: {{}}}}}}\n  b: {{subscribes: {{T: {{needs: {{liveness: {needs}}}}}}}}}\n"
    )
    sources = [Source("d.yaml", design.encode()), *([Source("p.xml", text.encode())] if text else [])]
    return cqos.check(merge([read_source(each) for each in sources]))


def verdict(*args, **more):
    return str(needing(*args, **more).verdict)


DEFAULT = 'is_default_profile="true"'


def test_without_a_file_the_lease_is_that_of_the_implementation():
    assert verdict("") == "compatible"
    assert verdict("", needs="19s") == "incompatible"


@pytest.mark.parametrize(
    ("seconds", "expected"), [(30, "compatible"), (31, "incompatible"), ("DURATION_INFINITY", "incompatible")]
)
def test_the_default_profile_of_fast_dds_decides(seconds, expected):
    assert verdict(FAST.format(fast("p", seconds, DEFAULT))) == expected


def test_a_participant_that_states_its_lease_keeps_it():
    assert verdict(FAST.format(fast("p", 300, DEFAULT)), more="participant_lease: 20s, ") == "compatible"


def test_a_participant_of_another_implementation_does_not_read_the_file():
    text = FAST.format(fast("p", 300, DEFAULT))
    assert verdict(text, more="implementation: cyclonedds, ") == "compatible"
    assert verdict(text, more="implementation: fastdds_2_9, ") == "incompatible"


def test_a_profile_that_participants_may_use_leaves_the_lease_unknown():
    report = needing(FAST.format(fast("p", 300)))
    assert str(report.verdict) == "unknown"
    (finding,) = [each for each in report.findings if each.severity != "note"]
    assert (finding.code, "the participant profile `p` sets the lease to 5min" in finding.message) == ("DDS537", True)
    assert verdict(FAST.format(fast("p", 300) + fast("q", 300, DEFAULT))) == "incompatible"


def test_it_is_no_finding_where_nobody_needs_it():
    design = b"cqos: 1\nprotocol: dds\nparticipants: {a: {publishes: {T: {}}}, b: {subscribes: {T: {}}}}\n"
    text = FAST.format(fast("p", 300)).encode()
    report = cqos.check(merge([read_source(Source("d.yaml", design)), read_source(Source("p.xml", text))]))
    assert str(report.verdict) == "compatible"
    assert {str(each.severity) for each in report.findings} == {"note"}


@pytest.mark.parametrize(("seconds", "expected"), [(30, "compatible"), (31, "incompatible")])
@pytest.mark.parametrize("implementation", ["connext", "standard"])
def test_the_default_profile_of_connext_decides(seconds, expected, implementation):
    text = CONNEXT.format(connext("P", seconds, 'is_default_qos="true"'))
    assert verdict(text, implementation=implementation) == expected


def test_a_base_of_the_default_profile_of_connext_decides():
    text = CONNEXT.format(connext("P", 30) + '<qos_profile name="Q" base_name="P" is_default_qos="true"/>')
    assert verdict(text, implementation="connext") == "compatible"
    assert verdict(CONNEXT.format(connext("P", 30)), implementation="connext") == "unknown"


def test_participants_of_a_file_have_their_own_lease():
    text = (
        '<dds><domain_library name="D"><domain name="d" domain_id="0"><register_type name="S"/>'
        '<topic name="T" register_type_ref="S"/></domain></domain_library>'
        '<domain_participant_library name="PL"><domain_participant name="A" domain_ref="D::d"><publisher name="p">'
        '<data_writer name="w" topic_ref="T"/></publisher><participant_qos><discovery_config>'
        "<participant_liveliness_lease_duration><sec>7</sec></participant_liveliness_lease_duration></discovery_config>"
        "</participant_qos></domain_participant></domain_participant_library></dds>"
    )
    system = read_source(Source("p.xml", text.encode()))
    assert system.participants["PL::A"].settings["participant_lease"].text == "7s"


@pytest.mark.parametrize(
    ("inner", "expected"),
    [
        (domain("30 s"), "compatible"),
        (domain("30s", 'Id="any"'), "compatible"),
        (domain("31 s"), "incompatible"),
        (domain("0.4 min"), "compatible"),
        (domain("inf"), "incompatible"),
        (domain("300 s", 'Id="5"'), "unknown"),
        (domain("30 s") + domain("300 s", 'Id="5"'), "unknown"),
        ("<Domain><General/></Domain>", "compatible"),
    ],
)
def test_the_configuration_of_cyclone_dds_decides(inner, expected):
    assert verdict(CYCLONE.format(inner), implementation="cyclonedds") == expected


def test_it_decides_nothing_on_another_implementation():
    assert verdict(CYCLONE.format(domain("300 s"))) == "compatible"


@pytest.mark.parametrize("text", [FAST.format(fast("p", "x", DEFAULT)), CYCLONE.format(domain("soon"))])
def test_a_lease_that_is_none_is_refused(text):
    with pytest.raises(InputError) as refused:
        read_source(Source("p.xml", text.encode()))
    assert [each.code for each in refused.value.problems] == ["CQ011"]
