"""How different files write the settings of ROS 2: attribute names, integer codes, units."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Dialect

# The integers that the original BPMN tool and FaMe store; they are neither those of rmw nor those of DDS.
BPMN_CODES: Final = {
    "history": {"0": "keep_last", "1": "keep_all"},
    "reliability": {"0": "best_effort", "1": "reliable"},
    "durability": {"0": "transient_local", "1": "volatile"},
    "liveliness": {"0": "automatic", "1": "manual_by_topic"},
}

# The enumerations of rmw/types.h. They do not stand in order of strength. A depth of 0 is not discovered, and
# the marker is the duration that stands for best_available.
MARKER: Final = {
    "{sec: 9223372036, nsec: 854775806}": "best_available",
    "9223372036854775806": "best_available",
}
RMW_CODES: Final = {
    "history": {"0": "system_default", "1": "keep_last", "2": "keep_all", "3": "unknown"},
    "depth": {"0": "unknown"},
    "reliability": {
        "0": "system_default",
        "1": "reliable",
        "2": "best_effort",
        "3": "unknown",
        "4": "best_available",
    },
    "durability": {
        "0": "system_default",
        "1": "transient_local",
        "2": "volatile",
        "3": "unknown",
        "4": "best_available",
    },
    "liveliness": {
        "0": "system_default",
        "1": "automatic",
        "2": "manual_by_node",
        "3": "manual_by_topic",
        "4": "unknown",
        "5": "best_available",
    },
    "deadline": MARKER,
    "liveliness_lease_duration": MARKER,
}

DIALECTS: Final = {
    # System files of C-QoS: everything in words, durations with a unit.
    "yaml": Dialect(),
    # Attributes of BPMN events: durations in seconds, and a zero is what the editor writes for nothing.
    "bpmn": Dialect(
        codes=BPMN_CODES,
        bare_unit="s",
        zero_is_unset=True,
        writes={"liveliness_lease_duration": "leaseDuration", "name": "", "client_library_settings": "", "bridge": ""},
        words=("system_default", "best_available"),
    ),
    # What `ros2 topic info --verbose` prints: words, and durations with their unit.
    "topic_info": Dialect(codes={"depth": {"0": "unknown"}}),
    # Recordings: words or the integers of rmw, durations as {sec, nsec}.
    "rosbag": Dialect(codes=RMW_CODES),
    # Node parameters `qos_overrides.…`: durations in nanoseconds.
    "parameters": Dialect(codes={"deadline": MARKER, "liveliness_lease_duration": MARKER}, bare_unit="ns"),
}
