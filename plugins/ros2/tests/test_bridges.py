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


def test_a_topic_without_subscribers_behind_a_bridge_is_only_a_note():
    assert split("") == [("note", ("carrier/subscriber/scan", "carrier/publisher/scan"))]


def test_a_subscriber_in_a_third_domain_is_a_warning():
    found = split("viewer: {domain: 3, subscribes: {/scan: {depth: 5}}}")
    assert ("warning", ("viewer/subscriber/scan", "carrier/publisher/scan")) in found
    assert not any("carrier/subscriber/scan" in ends for severity, ends in found if severity == "warning")


def test_a_bridge_that_connects_both_sides_gives_no_finding():
    assert split("viewer: {domain: 2, subscribes: {/scan: {depth: 5}}}") == []


def test_a_publisher_behind_a_one_way_bridge_is_a_note():
    more = "viewer: {domain: 2, subscribes: {/scan: {depth: 5}}, publishes: {/scan: {depth: 5}}}"
    local = "nearby: {domain: 1, subscribes: {/scan: {depth: 5}}}"
    ((severity, members),) = split(f"{more}\n  {local}")
    assert (severity, "viewer/publisher/scan" in members, "nearby/subscriber/scan" in members) == ("note", True, True)


CHAIN = """
cqos: 1
protocol: ros2
options: {{ros2: {{rmw: cyclonedds, distro: jazzy}}}}
participants:
  lidar: {{domain: 1, publishes: {{/scan: {{depth: 5}}}}}}
  a1: {{domain: 1}}
  a2: {{domain: 2}}
  b2: {{domain: {middle}}}
  b3: {{domain: 3}}
  viewer: {{domain: 3, subscribes: {{/scan: {{depth: 5}}}}}}
  local: {{domain: 2, subscribes: {{/scan: {{depth: 5}}}}}}
bridges:
  a: {{routes: [{{from: {{participant: a1, topic: /scan}}, to: {{participant: a2}}}}]}}
  b: {{routes: [{{from: {{participant: b2, topic: /scan}}, to: {{participant: b3}}}}]}}
"""


def test_over_several_bridges_all_are_connected():
    report = cqos.check(CHAIN.format(middle=2).encode())
    assert [each.code for each in report.findings if each.code == "ROS401"] == []


def test_bridges_in_separate_domains_connect_no_endpoints():
    report = cqos.check(CHAIN.format(middle=4).encode())
    assert "b/subscriber/scan" in {end for each in report.findings if each.code == "ROS401" for end in each.endpoints}


def test_routes_of_one_bridge_in_separate_domains_connect_no_endpoints():
    parted = (
        CHAIN.format(middle=4)
        .replace("  b: {routes: [", "")
        .replace("]}\n{from: {participant: b2", ", {from: {participant: b2")
    )
    found = [each for each in cqos.check(parted.encode()).findings if each.code == "ROS401"]
    assert any({"lidar/publisher/scan", "viewer/subscriber/scan"} <= set(each.endpoints) for each in found)


PARALLEL = CHAIN.replace("b3: {{domain: 3}}", "b3: {{domain: 2}}").format(middle=1)


def once(pair):
    (given,) = [each for each in pair.guarantees if each.word == "duplicate_free"]
    return given.value, [code for code, _ in given.lost]


def test_over_bridges_side_by_side_samples_arrive_twice():
    def explained(text):
        return cqos.explain(text.encode(), publisher="lidar/publisher/scan", subscriber="local/subscriber/scan")

    assert once(explained(CHAIN.format(middle=2))) == ("yes", [])
    pair = explained(PARALLEL)
    assert once(pair) == ("no", ["CQ507"])
    assert [(str(each.severity), each.code) for each in pair.findings] == [("note", "CQ507")]
    needing = PARALLEL.replace(
        "local: {domain: 2, subscribes: {/scan: {depth: 5",
        "local: {domain: 2, subscribes: {/scan: {depth: 5, needs: {duplicate_free: true}",
    )
    assert "CQ507" in {each.code for each in cqos.check(needing.encode()).findings}
    assert [str(each.severity) for each in explained(needing).findings] == ["error"]


def test_what_also_comes_straight_arrives_twice():
    loop = CHAIN.replace("b3: {{domain: 3}}", "b3: {{domain: 1}}").format(middle=2) + "  \n"
    near = loop.replace("bridges:", "  near: {domain: 1, subscribes: {/scan: {depth: 5}}}\nbridges:")
    pair = cqos.explain(near.encode(), publisher="lidar/publisher/scan", subscriber="near/subscriber/scan")
    assert once(pair) == ("no", ["CQ507"])
