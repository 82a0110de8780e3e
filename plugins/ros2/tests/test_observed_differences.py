"""A design compared with what runs, and with what was recorded."""

from pathlib import Path

import cqos_core as cqos
from cqos_core.files.source_files import read_path
from cqos_core.files.source_reader import read_source

CASES = Path(__file__).parent / "importers" / "cases"
DESIGN = b"""\
cqos: 1
protocol: ros2
participants:
  map_server:
    publishes:
      /map: {type: nav_msgs/msg/OccupancyGrid, depth: 1, durability: transient_local}
  imu_driver:
    publishes:
      /imu: {type: sensor_msgs/msg/Imu, reliability: reliable, depth: 3}
  /planner/global/costmap:
    subscribes:
      /map: {profile: default, liveliness_lease_duration: 5s}
      /imu: sensor_data
"""


def differences_of(found):
    return [(each.a.id, each.policy, each.value_a.value, each.value_b.value) for each in found.different]


def test_a_snapshot():
    found = cqos.diff(DESIGN, CASES / "topic_info" / "jazzy_loop.txt")
    assert differences_of(found) == [
        ("/planner/global/costmap/subscriber/map", "depth", "10", "1"),
        ("/planner/global/costmap/subscriber/map", "durability", "volatile", "transient_local"),
        ("/planner/global/costmap/subscriber/map", "liveliness", "automatic", "manual_by_topic"),
    ]
    (missing,) = found.missing
    assert (missing.only_in, missing.endpoint.participant.partition("@")[0]) == ("b", "/_NODE_NAME_UNKNOWN_")
    assert (found.matched, found.by_topic) == (2, 0)
    assert found.not_compared == ("2 endpoints of A: B was observed and does not mention their topics",)
    assert all(each.value_b.place.line for each in found.different)


def test_a_recording():
    path = str(CASES / "rosbag2" / "v9_jazzy.yaml")
    recorded = read_source(read_path(path), "rosbag2", {"rosbag2": {"as": "recorded"}})
    found = cqos.diff(DESIGN, recorded)
    assert differences_of(found) == [("imu_driver/publisher/imu", "reliability", "reliable", "best_effort")]
    assert (found.matched, found.by_topic) == (2, 2)
    assert "2 endpoints of A: B was observed and reports no subscribers at all" in found.not_compared
