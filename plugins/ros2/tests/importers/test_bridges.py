"""Bridges: what they offer and request in a check with the nodes around them."""

import pytest

from cqos_core import check, explain
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import Source

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

    @pytest.mark.parametrize(("offered", "found"), [("reliable", []), ("best_effort", [("ROS101", "/chatter")])])
    def test_it_offers_on_the_other_side_what_its_publishers_do(self, offered, found):
        report = checked(DOMAINS, self.talker.replace("QOS", offered) + self.listener.replace("QOS", "reliable"))
        assert errors(report) == found

    @pytest.mark.parametrize(("requested", "verdict"), [("best_effort", "compatible"), ("reliable", "unknown")])
    def test_of_publishers_that_differ_it_may_find_either_first(self, requested, verdict):
        other = self.talker.replace("talker", "other").replace("QOS", "best_effort")
        both = self.talker.replace("QOS", "reliable") + other
        groups = checked(DOMAINS, both + self.listener.replace("QOS", requested)).groups
        assert {group.publishers: group.verdict for group in groups}["domain_bridge_2/publisher/chatter",] == verdict

    def test_where_it_starts_after_all_of_them_it_offers_what_all_do(self):
        other = self.talker.replace("talker", "other").replace("QOS", "best_effort")
        late = "  domain_bridge_1: {domain: 1, starts_after: [talker, other]}\n"
        participants = self.talker.replace("QOS", "reliable") + other + late + self.listener.replace("QOS", "reliable")
        assert errors(checked(DOMAINS, participants)) == [("ROS101", "/chatter")]

    @pytest.mark.parametrize(("requested", "verdict"), [("best_effort", "compatible"), ("reliable", "unknown")])
    def test_without_its_publishers_what_it_offers_is_not_known(self, requested, verdict):
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
        assert finding.sides[0].members == ("domain_bridge_1/subscriber/chatter",)

    def test_a_deadline_that_is_copied_is_the_longest_there_is(self):
        bridge = DOMAINS.replace("String}", "String, qos: {deadline: auto}}")
        participants = "  a: {domain: 1, publishes: {/chatter: {deadline: 1s}}}\n  b: {domain: 1, publishes: {/chatter: {deadline: 2s}}}\n"
        assert checked(bridge, participants.splitlines()[0] + "\n").verdict == "compatible"
        # A bridge that starts between the two requests 1 s, which `b` does not offer.
        assert checked(bridge, participants).verdict == "unknown"
        late = "  domain_bridge_1: {domain: 1, starts_after: [a, b]}\n"
        assert checked(bridge, participants + late).verdict == "compatible"
        wanted = "  c: {domain: 2, subscribes: {/chatter: {deadline: 1500ms}}}\n"
        assert errors(checked(bridge, participants.splitlines()[0] + "\n" + wanted)) == []
        assert errors(checked(bridge, participants.splitlines()[1] + "\n" + wanted)) == [("ROS103", "/chatter")]

    def test_what_is_needed_behind_it_is_needed_before_it(self):
        needing = self.listener.replace("{reliability: QOS}", "{reliability: best_effort, needs: {latest: true}}")
        report = checked(DOMAINS, self.talker.replace("QOS", "best_effort") + needing)
        (finding,) = [finding for finding in report.findings if finding.code == "ROS501"]
        assert finding.sides[0].members == ("domain_bridge_1/subscriber/chatter", "listener/subscriber/chatter")

    def test_the_way_over_it_is_explained_hop_by_hop(self):
        sources = [
            f"cqos: 1\nprotocol: ros2\nparticipants:\n{self.talker}{self.listener}".replace("QOS", "reliable"),
            DOMAINS,
        ]
        talker, listener = "talker/publisher/chatter", "listener/subscriber/chatter"
        report = explain(*[each.encode() for each in sources], publisher=talker, subscriber=listener)
        assert [(hop.publisher, hop.subscriber, hop.bridge) for hop in report.hops] == [
            (talker, "domain_bridge_1/subscriber/chatter", "domain_bridge"),
            ("domain_bridge_2/publisher/chatter", listener, None),
        ]

    def test_both_ways_it_takes_back_nothing_of_its_own(self):
        bridge = DOMAINS.replace("String}", "String, bidirectional: true}")
        talkers = self.talker.replace("QOS", "best_effort") + self.talker.replace(
            "talker: {domain: 1", "other: {domain: 2"
        ).replace("QOS", "reliable")
        report = checked(bridge, talkers)
        assert (report.verdict, [str(each) for each in report.findings if each.severity != "note"]) == (
            "compatible",
            [],
        )

    def test_two_bridges_one_back_are_a_loop(self):
        back = "name: back\nfrom_domain: 2\nto_domain: 1\ntopics:\n  /chatter: {type: std_msgs/msg/String}\n"
        sources = [read_source(Source(name, text.encode())) for name, text in (("a.yaml", DOMAINS), ("b.yaml", back))]
        assert "CQ503" in {finding.code for finding in check(merge(sources)).findings}

    def test_the_tilde_stands_for_its_name(self):
        system = read_source(Source("b.yaml", DOMAINS.replace("String}", "String, remap: ~/talk}").encode()))
        (route,) = system.bridges["domain_bridge"].routes
        assert (route.source.topic, route.target.topic) == ("/chatter", "/domain_bridge/talk")

    def test_its_command_line_may_say_that_it_does_not_wait(self):
        switches = {"domain_bridge": {"wait_for_publisher": "false"}}
        system = read_source(Source("b.yaml", DOMAINS.encode()), switches=switches)
        (route,) = system.bridges["domain_bridge"].routes
        assert route.source.settings == route.target.settings == {}

    def test_a_lease_is_taken_for_a_lifespan(self):
        bridge = DOMAINS.replace("String}", "String, qos: {liveliness_lease_duration: 2000000000}}")
        wanted = "  c: {domain: 2, subscribes: {/chatter: {liveliness_lease_duration: 3s}}}\n"
        report = checked(bridge, self.talker.replace("QOS", "reliable") + wanted)
        assert errors(report) == [("ROS105", "/chatter")]
        assert "ROS951" in {finding.code for finding in report.findings}
