"""Bridges: what they offer and request in a check with the nodes around them."""

import pytest

from cqos_core import check
from cqos_core.importers.source import Source
from cqos_core.loading import merge, read_source

GZ = """\
- ros_topic_name: /scan
  gz_topic_name: /lidar
  ros_type_name: sensor_msgs/msg/LaserScan
  gz_type_name: gz.msgs.LaserScan
  direction: GZ_TO_ROS
"""
ROS1 = "topics:\n- {topic: /tf_static, type: tf2_msgs/msg/TFMessage, queue_size: 100}\n"
DOMAINS = "from_domain: 1\nto_domain: 2\ntopics:\n  /chatter: {type: std_msgs/msg/String}\n"


def checked(bridge, participants):
    design = f"cqos: 1\nprotocol: ros2\nparticipants:\n{participants}"
    sources = (Source("d.yaml", design.encode()), Source("b.yaml", bridge.encode()))
    return check(merge([read_source(source) for source in sources]))


def errors(report):
    return [(finding.code, finding.topic) for finding in report.findings if finding.severity == "error"]


class TestGazebo:
    reader = "  slam: {subscribes: {/scan: {reliability: reliable}}}\n"

    def test_without_a_profile_it_offers_the_default(self):
        assert checked(GZ, self.reader).verdict == "compatible"

    def test_with_a_profile_it_offers_that(self):
        report = checked(GZ + "  qos_profile: SENSOR_DATA\n", self.reader)
        assert errors(report) == [("ROS101", "/scan")]

    def test_best_available_needs_iron(self):
        report = checked(
            GZ + "  qos_profile: BEST_AVAILABLE\n", self.reader.replace("slam: {", "slam: {distro: humble, ")
        )
        assert report.verdict == "compatible"

    def test_to_gazebo_it_requests(self):
        bridge = GZ.replace("GZ_TO_ROS", "ROS_TO_GZ")
        report = checked(bridge, "  driver: {publishes: {/scan: {reliability: best_effort}}}\n")
        assert errors(report) == [("ROS101", "/scan")]


class TestRos1:
    def test_static_transforms_do_not_come_through_it(self):
        report = checked(ROS1, "  listener: {subscribes: {/tf_static: tf_static_listener}}\n")
        assert ("ROS102", "/tf_static") in errors(report)

    def test_they_do_with_qos(self):
        bridge = ROS1.replace("100}", "100, qos: {history: keep_last, depth: 1, durability: transient_local}}")
        report = checked(bridge, "  listener: {subscribes: {/tf_static: tf_static_listener}}\n")
        assert errors(report) == []


class TestDomains:
    talker = "  talker: {domain: 1, publishes: {/chatter: {reliability: QOS}}}\n"
    listener = "  listener: {domain: 2, subscribes: {/chatter: {reliability: QOS}}}\n"

    @pytest.mark.parametrize("offered", ["reliable", "best_effort"])
    def test_it_requests_what_its_publishers_offer(self, offered):
        report = checked(DOMAINS, self.talker.replace("QOS", offered))
        assert report.verdict == "compatible"

    def test_publishers_that_differ_leave_it_open(self):
        other = self.talker.replace("talker", "other").replace("QOS", "best_effort")
        report = checked(DOMAINS, self.talker.replace("QOS", "reliable") + other)
        assert report.verdict == "unknown"

    @pytest.mark.parametrize(("requested", "verdict"), [("best_effort", "compatible"), ("reliable", "unknown")])
    def test_what_it_offers_on_the_other_side_is_not_known(self, requested, verdict):
        report = checked(DOMAINS, self.listener.replace("QOS", requested))
        assert report.verdict == verdict
        if verdict == "unknown":
            (finding,) = [finding for finding in report.findings if finding.code == "ROS101"]
            assert "the bridge takes it from the publishers on its other side" in finding.message

    def test_what_is_stated_is_taken_on_both_sides(self):
        bridge = DOMAINS.replace("String}", "String, qos: {reliability: reliable}}")
        report = checked(bridge, self.talker.replace("QOS", "best_effort") + self.listener.replace("QOS", "reliable"))
        assert errors(report) == [("ROS101", "/chatter")]
        (finding,) = [finding for finding in report.findings if finding.code == "ROS101"]
        assert finding.sides[0].members == ("domain_bridge_1/subscriber//chatter",)

    def test_a_deadline_that_is_copied_is_the_longest_there_is(self):
        bridge = DOMAINS.replace("String}", "String, qos: {deadline: auto}}")
        participants = "  a: {domain: 1, publishes: {/chatter: {deadline: 1s}}}\n  b: {domain: 1, publishes: {/chatter: {deadline: 2s}}}\n"
        assert checked(bridge, participants.splitlines()[0] + "\n").verdict == "compatible"
        assert checked(bridge, participants).verdict == "compatible"
