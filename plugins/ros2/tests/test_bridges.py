"""Bridges between ROS domains: that their own ends are apart is what they are for."""

import cqos_core as cqos

BRIDGED = """
cqos: 1
protocol: ros2
options: {{ros2: {{rmw: cyclonedds, distro: jazzy}}}}
participants:
  lidar: {{domain: 1, publishes: {{/scan: {{depth: 5}}}}}}
  near: {{domain: 1}}
  far: {{domain: 2}}
  {more}
bridges:
  carrier:
    routes:
      - {{from: {{participant: near, topic: /scan}}, to: {{participant: far}}}}
"""


def split(more):
    report = cqos.check(BRIDGED.format(more=more).encode())
    return [(str(each.severity), each.endpoints) for each in report.findings if each.code == "ROS401"]


def test_a_topic_that_nobody_wants_behind_a_bridge_is_no_split():
    assert split("") == [("note", ("carrier/subscriber//scan", "carrier/publisher//scan"))]


def test_who_waits_in_a_third_domain_is_told():
    told = split("viewer: {domain: 3, subscribes: {/scan: {depth: 5}}}")
    assert ("warning", ("viewer/subscriber//scan", "carrier/publisher//scan")) in told
    assert not any("carrier/subscriber//scan" in ends for severity, ends in told if severity == "warning")


def test_where_the_bridge_connects_both_sides_nothing_is_told_aloud():
    told = split("viewer: {domain: 2, subscribes: {/scan: {depth: 5}}}")
    assert [severity for severity, _ in told] == ["note"]
