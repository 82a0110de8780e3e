"""Configurations of OpenDDS: the lease of participants, and what is named as not read."""

import pytest

from cqos_core import check

SYSTEM = """cqos: 1
protocol: dds
options: {dds: {implementation: opendds}}
participants:
  a: {publishes: {T: {}}}
  b: {subscribes: {T: {needs: {liveness: 30s}}}}
"""


def report(tmp_path, ini, system=SYSTEM):
    (tmp_path / "s.yaml").write_text(system, encoding="utf-8")
    (tmp_path / "dds.ini").write_text(ini, encoding="utf-8")
    return check(tmp_path / "s.yaml", tmp_path / "dds.ini")


LEASE = "[rtps_discovery/{}]\nLeaseDuration={}\n"


@pytest.mark.parametrize(
    ("ini", "words"),
    [
        (LEASE.format("a", 30), "compatible"),
        (LEASE.format("a", 31), "incompatible"),
        (LEASE.format("a", 30) + LEASE.format("b", 40), "unknown"),
        ("[common]\nDCPSDebugLevel=1\n", "incompatible"),  # 300 s by default
    ],
)
def test_the_lease_is_read(tmp_path, ini, words):
    assert report(tmp_path, ini).verdict_words == words


@pytest.mark.parametrize(
    ("ini", "words"),
    [
        ("[common]\nDCPSSecurity=1\n", "unknown"),
        ("[common]\nDCPSSecurity=0\n", "compatible"),
        ("[rtps_discovery/a]\nUserTag=7\n", "unknown"),
        ("[rtps_discovery/a]\nSpdpUserTag=7\n", "unknown"),
        ("[rtps_discovery/a]\nSpdpUserTag=0\n", "compatible"),
        ("[common]\nDCPSNobodyHasThis=1\n", "unknown"),
        ("[common]\nDCPSGlobalTransportConfig=$file\n", "compatible"),
        ("[rtps_discovery/a]\nSpdpSendAddrs=h:1\n", "compatible as far as read"),
    ],
)
def test_what_may_prevent_a_match_leaves_pairs_of_opendds_unknown(tmp_path, ini, words):
    found = report(tmp_path, LEASE.format("l", 30) + ini)
    assert found.verdict_words == words
    assert ("CQ217" in {finding.code for finding in found.findings}) is (words == "unknown")
    assert "CQ214" not in {finding.code for finding in found.findings}


def test_it_leaves_pairs_of_others_as_they_are(tmp_path):
    others = SYSTEM.replace("opendds", "fastdds").replace("{needs: {liveness: 30s}}", "{}")
    found = report(tmp_path, "[common]\nDCPSSecurity=1\n", others)
    assert found.verdict == "compatible"


@pytest.mark.parametrize(
    ("ini", "parts"),
    [
        ("[endpoint/w] # a writer\ndomain=3\ntype=writer\n", ["w"]),
        ("[common]\nDCPSDefaultDiscovery=DEFAULT_STATIC\n", ["common/DCPSDefaultDiscovery"]),
        ("[common]\nDCPSDefaultDiscovery=DEFAULT_RTPS\n", []),
        ("[rtps_discovery/a]\nSpdpSendAddrs=h:1\nTTL=3\n#PB=2\n", ["rtps_discovery/SpdpSendAddrs"]),
        ("[common]\nDCPSNobodyHasThis=1\n", ["common/DCPSNobodyHasThis"]),
    ],
)
def test_what_may_decide_is_named(tmp_path, ini, parts):
    assert [part.name for part in report(tmp_path, ini).coverage.unread] == parts
