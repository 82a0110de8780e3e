"""What a model with words that are not read comes to: never compatible by ignorance, and decided where that is possible."""

import pytest

import cqos_core as cqos

ZEROS = " ".join(
    f'qos:{name}="0"'
    for name in ("history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness", "leaseDuration")
)
MODEL = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="{uri}">
<signal id="S" name="t"/>
<process id="A"><endEvent id="W" {offered}>{inside}<signalEventDefinition signalRef="S"/></endEvent></process>
<process id="B"><startEvent id="R" {requested}>{inside}<signalEventDefinition signalRef="S"/></startEvent></process>
</definitions>"""


def checked(offered="", requested="", *, uri="http://qos", inside=""):
    text = MODEL.format(uri=uri, offered=offered, requested=requested, inside=inside)
    return cqos.check(text.encode(), importer="bpmn")


def loud(report):
    return {finding.code: finding.severity.value for finding in report.findings if finding.severity.value != "note"}


@pytest.mark.parametrize("uri", ["http://qos/", "https://qos", "http://QoS", "http://qos#", "http://other"])
def test_qos_in_another_namespace_is_unknown(uri):
    report = checked('qos:reliability="best_effort"', 'qos:reliability="reliable"', uri=uri)
    assert (report.verdict, loud(report)) == ("unknown", {"CQ040": "warning"})


def test_qos_without_a_prefix_is_unknown():
    report = checked('reliability="best_effort"', 'reliability="reliable"')
    assert (report.verdict, loud(report)) == ("unknown", {"CQ040": "warning"})


def test_what_is_read_decides_beside_what_is_not():
    report = checked('qos:reliability="best_effort" deadline="1"', 'qos:reliability="reliable"')
    assert report.verdict == "incompatible"


@pytest.mark.parametrize(
    ("offered", "requested", "verdict"),
    [
        (ZEROS, ZEROS, "compatible"),
        (ZEROS, "", "unknown"),
        ("", ZEROS, "unknown"),
        ('qos:reliability="reliable" qos:durability="transient_local"', ZEROS, "compatible"),
        (ZEROS, 'qos:reliability="best_effort"', "compatible"),
        (ZEROS, 'qos:reliability="reliable" qos:liveliness="manual_by_topic"', "incompatible"),
    ],
)
def test_eight_zeros_are_one_assumption_for_all_events(offered, requested, verdict):
    report = checked(offered, requested)
    assert report.verdict == verdict
    assert not {"ROS312", "CQ217"} & {finding.code for finding in report.findings}
    if verdict == "unknown":
        assert any("what eight zeros mean" in finding.message for finding in report.findings)


def test_a_requirement_that_is_half_typed_leaves_its_pair_unknown():
    half = "<extensionElements><qos:need name='latest'/></extensionElements>"
    text = MODEL.format(uri="http://qos", offered="", requested="", inside="")
    text = text.replace('id="R" >', f'id="R">{half}')
    report = cqos.check(text.encode(), importer="bpmn")
    assert (report.verdict, loud(report)) == ("unknown", {"CQ042": "error"})


def test_an_exception_that_is_half_typed_excuses_nothing_and_the_rest_is_judged():
    half = '<extensionElements><qos:accept rule="ROS101"/></extensionElements>'
    report = checked('qos:reliability="best_effort"', 'qos:reliability="reliable"', inside=half)
    assert report.verdict == "incompatible"
    assert loud(report) == {"ROS101": "error", "CQ042": "error"}
