"""`qos_overrides`: which nodes and endpoints they cover, and what they change in a check."""

import pytest

from cqos_core import check
from cqos_core.files.source_reader import read_source
from cqos_core.files.system_merge import merge
from cqos_core.model.source import Source
from cqos_ros2.importers.detect_config import claims_qos_overrides
from cqos_ros2.names import address, covers
from cqos_ros2.pack import PACK
from tests.growth.linear import assert_linear

DESIGN = """\
cqos: 1
protocol: ros2
participants:
  lidar_driver: {namespace: /robot, publishes: {/scan: [{id: front}, {id: rear}]}}
  planner: {subscribes: {/scan: {reliability: best_effort}}}
"""


def checked(parameters, design=DESIGN, **options):
    sources = (Source("d.yaml", design.encode()), Source("p.yaml", parameters.encode()))
    return check(merge([read_source(source) for source in sources]), options={"ros2": options})


def over(node, overrides, kind="publisher"):
    return f"{node}:\n  ros__parameters:\n    qos_overrides: {{/scan: {{{kind}: {overrides}}}}}\n"


def codes(report):
    return [finding.code for finding in report.findings if finding.severity != "note"]


class TestNames:
    @pytest.mark.parametrize(
        ("pattern", "covered", "others"),
        [
            ("/**", ["/a", "/a/b", "/a/b/c"], []),
            ("/*", ["/a"], ["/a/b"]),
            ("/**/b", ["/b", "/a/b", "/a/x/b"], ["/a", "/b/a", "/ab"]),
            ("/*/b", ["/a/b"], ["/b", "/a/x/b"]),
            ("/a/**", ["/a", "/a/b", "/a/b/c"], ["/b", "/b/a"]),
            ("/a/**/c", ["/a/c", "/a/b/c", "/a/b/b/c"], ["/a", "/c", "/a/b"]),
            ("/a/b", ["/a/b"], ["/b", "a/b", "/a/bb", "/a.b"]),
            ("/a*", [], ["/a", "/ab"]),
            ("*", ["/a", "a", "/a/b"], []),
            ("/**/a/**/a/**/a/**", ["/a/a/a", "/x/a/a/y/a"], ["/a/a"]),
        ],
    )
    def test_patterns_cover_what_ros_2_says(self, pattern, covered, others):
        assert [node for node in covered if not covers(pattern, node)] == []
        assert [node for node in others if covers(pattern, node)] == []

    def test_the_cost_of_a_hostile_pattern_grows_with_the_name(self):
        assert_linear(lambda size: covers("/**/a" * 100 + "/b", "/a" * size), 500)
        assert not covers("/**/a" * 500 + "/b", "/a" * 500)

    @pytest.mark.parametrize(
        ("participant", "settings", "expected"),
        [
            ("driver", {}, "/driver"),
            ("driver", {"namespace": "/"}, "/driver"),
            ("driver", {"namespace": "/robot/front/"}, "/robot/front/driver"),
            ("driver", {"namespace": "robot"}, "/robot/driver"),
            ("/robot/driver", {}, "/robot/driver"),
            ("/robot/driver", {"namespace": "/other"}, "/other/driver"),
        ],
    )
    def test_a_node_is_addressed_by_its_full_name(self, participant, settings, expected):
        assert address(participant, settings) == expected
        assert PACK.topic_matching.address(participant, settings) == expected


class TestEffect:
    @pytest.mark.parametrize(
        "node", ["/**", "/**/lidar_driver", "/robot/lidar_driver", "/robot/*", "'/*/*'", "robot/lidar_driver"]
    )
    def test_an_override_wins_over_what_the_node_states_itself(self, node):
        report = checked(
            over(node, "{reliability: best_effort}"), DESIGN.replace("reliability: best_effort", "depth: 1")
        )
        assert report.verdict == "incompatible"
        (finding,) = [finding for finding in report.findings if finding.code == "ROS101"]
        (offered,) = [fact for side in finding.sides for fact in side.facts if fact.origin == "qos_overrides"]
        assert (offered.place.source, offered.place.line, offered.place.column) == ("p.yaml", 3, 54)

    @pytest.mark.parametrize("node", ["lidar_driver", "/*", "/other/lidar_driver", "/robot"])
    def test_an_override_for_another_node_is_reported(self, node):
        report = checked(over(node, "{reliability: best_effort}"))
        assert report.verdict == "compatible"
        assert codes(report) == ["CQ214"]

    def test_an_override_for_another_topic_or_role_is_reported(self):
        report = checked(over("/**", "{depth: 1}").replace("/scan", "/scam"))
        assert codes(report) == ["CQ214"]
        report = checked(over("lidar_driver", "{depth: 1}", "subscription"))
        assert codes(report) == ["CQ214"]

    def test_a_topic_is_no_pattern(self):
        assert codes(checked(over("/**", "{depth: 1}").replace("/scan", "'/*'"))) == ["CQ214"]

    def test_an_id_names_one_endpoint_and_wins_over_those_without(self):
        parameters = (
            "/**:\n  ros__parameters:\n    qos_overrides:\n      /scan:\n"
            "        publisher_rear: {reliability: reliable}\n        publisher: {reliability: best_effort}\n"
        )
        report = checked(parameters, DESIGN.replace("best_effort", "reliable"))
        (finding,) = [finding for finding in report.findings if finding.code == "ROS101"]
        assert finding.sides[1].members == ("front",)

    def test_the_resolved_topic_counts_not_the_one_written(self):
        design = DESIGN.replace("namespace: /robot", "namespace: /robot, remap: {/scan: /front/scan}")
        assert "CQ214" in codes(checked(over("/**/lidar_driver", "{depth: 1}"), design))
        parameters = over("/**/lidar_driver", "{depth: 1}").replace("/scan", "/front/scan")
        assert "CQ214" not in codes(checked(parameters, design))

    def test_what_is_written_later_wins(self):
        first, second = (
            over("/**", "{reliability: best_effort}"),
            over("/robot/lidar_driver", "{reliability: reliable}"),
        )
        design = DESIGN.replace("best_effort", "reliable")
        assert checked(first + second, design).verdict == "compatible"
        assert checked(second + first, design).verdict == "incompatible"

    def test_durations_are_nanoseconds(self):
        report = checked(
            over("/**", "{deadline: 2000000000}"), DESIGN.replace("reliability: best_effort", "deadline: 1s")
        )
        (finding,) = [finding for finding in report.findings if finding.code == "ROS103"]
        assert "deadline 2s" in finding.message

    def test_what_was_observed_stays_as_it_was(self):
        design = DESIGN.replace("protocol: ros2", "protocol: ros2\nobserved: true").replace(
            "[{id: front}, {id: rear}]", "{reliability: reliable}"
        )
        report = checked(over("/**", "{reliability: best_effort}"), design.replace("best_effort", "reliable"))
        assert not {"ROS101", "CQ214"} & set(codes(report))

    @pytest.mark.parametrize("node", ["rosbag2_player", "/rosbag2_player", "/**", "/*", "/**/rosbag2_player"])
    def test_a_tool_that_declares_no_parameters_is_not_overridden(self, node):
        design = DESIGN.replace("lidar_driver: {namespace: /robot, ", "rosbag2_player: {").replace(
            "[{id: front}, {id: rear}]", "default"
        )
        report = checked(over(node, "{reliability: best_effort}"), design.replace("best_effort", "reliable"))
        assert report.verdict == "compatible"
        reported = {"ROS930", "CQ214"} & set(codes(report))
        assert reported == ({"CQ214"} if "*" in node else {"ROS930"})
        if reported == {"ROS930"}:
            (finding,) = [finding for finding in report.findings if finding.code == "ROS930"]
            assert "the node `/rosbag2_player` declares no such parameters" in finding.message

    def test_a_node_of_that_name_elsewhere_is_overridden(self):
        design = DESIGN.replace("lidar_driver:", "rosbag2_player:").replace("best_effort", "reliable")
        assert checked(over("/robot/rosbag2_player", "{reliability: best_effort}"), design).verdict == "incompatible"


@pytest.mark.parametrize(
    "text",
    [
        "qos_overrides: {/scan: {publisher: {reliability: best_effort}}}",
        "lidar:\n  qos_overrides:\n    /scan: {publisher: {reliability: best_effort}}",
        "lidar:\n  qos_overrides./scan.publisher.reliability: best_effort",
    ],
)
def test_overrides_outside_of_parameters_are_recognised_and_reported(text):
    source = Source("p.yaml", text.encode())
    assert claims_qos_overrides(source.name, source.data)
    system = read_source(source)
    assert (system.overlays, [note.code for note in system.notes]) == ([], ["ROS933"])


def test_parameters_that_stand_twice_are_joined_and_the_last_value_counts():
    node = "/driver: {ros__parameters: {qos_overrides: {/scan: {publisher: {WHAT}}}}}\n"
    text = node.replace("WHAT", "depth: 1, reliability: reliable") + node.replace("WHAT", "reliability: best_effort")
    (overlay,) = read_source(Source("p.yaml", text.encode())).overlays
    assert {name: setting.text for name, setting in overlay.settings.items()} == {
        "depth": "1",
        "reliability": "best_effort",
    }
