"""Findings of instances stay the same findings when there are more instances."""

import pytest

from cqos_core import check
from cqos_core.analysis.baseline import read_baseline, write_baseline
from cqos_core.formatters.fingerprint import fingerprint
from cqos_core.model.finding import Finding
from cqos_core.model.report import Report

FLEET = """
cqos: 1
protocol: ros2
options: {ros2: {rmw: cyclonedds}}
instances: {drone: [%s]}
participants:
  "drone_${drone}":
    publishes: {position: {reliability: best_effort}, "pose_${drone}": {reliability: best_effort}}
    subscribes: {orders: {}}
  tower:
    subscribes: {position: {reliability: reliable}, "pose_${drone}": {reliability: reliable}}
"""


def fleet(*drones: str) -> Report:
    return check((FLEET % ", ".join(drones)).encode(), importer="yaml")


def loud(report: Report) -> list[Finding]:
    return [finding for finding in report.findings if finding.severity != "note"]


@pytest.mark.parametrize("more", [["d1", "d2", "d3"], ["d0", "d1", "d2"], ["d1"]])
def test_instances_of_one_template_are_one_fingerprint(more: list[str]):
    before, after = loud(fleet("d1", "d2")), loud(fleet(*more))
    assert [finding.code for finding in before] == ["ROS101", "ROS101", "CQ401"]
    assert {fingerprint(finding) for finding in after} == {fingerprint(finding) for finding in before}


def test_different_templates_are_different_findings():
    assert len({fingerprint(finding) for finding in fleet("d1", "d2").findings}) == len(fleet("d1", "d2").findings)


def test_a_baseline_knows_further_instances():
    known = read_baseline("known.json", write_baseline("known.json", [(None, fleet("d1", "d2"))]).encode())
    assert not known.mark(fleet("d0", "d1", "d2")).fails()
    assert known.gone() == 0


def test_a_baseline_does_not_know_who_is_no_instance():
    known = read_baseline("known.json", write_baseline("known.json", [(None, fleet("d1", "d2"))]).encode())
    another = FLEET.replace("  tower:", "  visitor: {publishes: {position: {reliability: best_effort}}}\n  tower:")
    report = known.mark(check((another % "d1, d2").encode(), importer="yaml"))
    assert [finding.topic for finding in loud(report) if finding.accepted is None] == ["/position"]
