"""What the importers of ROS 2 files report, beside what all importers do (``CQ0xx``).

ROS900-ROS929: what was observed (snapshots and recordings); ROS930-ROS969: what is configured; ROS970-ROS989: workspaces.
"""

from __future__ import annotations

from typing import Final

from cqos_core.model.code_info import CodeInfo
from cqos_ros2.importers.workspace_codes import CODES as WORKSPACE

OBSERVED: Final = (
    CodeInfo(
        "ROS901",
        "topic-without-name",
        "note",
        "A snapshot of a topic does not say which topic it is of.",
        "`ros2 topic info` does not print the name. The snapshot's endpoints are matched with each other, but not with those "
        "of other files. Put the name above, as in `### /chatter`, name the file after it, or give "
        "`--switch topic_info.topic=/chatter`.",
    ),
    CodeInfo(
        "ROS902",
        "topic-guessed-from-file-name",
        "note",
        "The file's name is taken for the name of the topic, which a snapshot does not hold.",
        "If it is another topic, give `--switch topic_info.topic=NAME`.",
    ),
    CodeInfo(
        "ROS903",
        "counts-disagree",
        "note",
        "A snapshot counts other endpoints than it shows.",
        "Endpoints may come and go while it is taken; without `--verbose` none is shown at all.",
    ),
    CodeInfo(
        "ROS904",
        "cut-off",
        "warning",
        "A snapshot or the description of a recording is not whole.",
        "What is missing is not known, so endpoints may be missing from the check.",
        leaves_out="file",
        missing=1,
    ),
    CodeInfo(
        "ROS905",
        "not-understood",
        "warning",
        "Something is stated about an endpoint that C-QoS does not know.",
        "It is skipped. A newer C-QoS may know it.",
        leaves_out="setting",
    ),
    CodeInfo(
        "ROS906",
        "endpoint-seen-twice",
        "note",
        "Snapshots in one file show an endpoint several times, with different values.",
        "What was seen last holds.",
    ),
    CodeInfo(
        "ROS907",
        "type-hashes-differ",
        "warning",
        "Endpoints of one topic have different definitions of one message type.",
        "They connect over DDS and cannot read each other's samples. Over Zenoh they do not meet, since the hash is a part of the key.",
    ),
    CodeInfo(
        "ROS910",
        "qos-not-recorded",
        "note",
        "A recording does not say what the publishers of some topics offered.",
        "The player then offers the default profile: reliable, volatile, depth 10.",
    ),
    CodeInfo(
        "ROS911",
        "mixed-recorded-qos",
        "note",
        "The recorded publishers of a topic offered different QoS, so the player offers the default profile.",
        "State what it shall offer in a file for `--qos-profile-overrides-path`.",
    ),
    CodeInfo(
        "ROS912",
        "incomplete-recorded-qos",
        "error",
        "The description of a recording lacks its version, or profiles of a topic, or policies of a profile: rosbag2 does not open it.",
        "`ros2 bag reindex` writes the description anew. Here the defaults stand in for what is missing.",
    ),
    CodeInfo(
        "ROS913",
        "layout-of-another-version",
        "error",
        "Recorded profiles are written in another way than the version of the file says.",
        "Up to version 8 they are a text with YAML in it, from version 9 on a list; rosbag2 stops with `bad conversion` at the "
        "other one. Converters and files edited by hand often have it.",
    ),
    CodeInfo(
        "ROS914",
        "newer-recording",
        "note",
        "The description of the recording has a newer version than any that C-QoS knows.",
        "It is read like the newest known one.",
        leaves_out="file",
    ),
    CodeInfo(
        "ROS915",
        "recorded-value-refused",
        "error",
        "A recorded profile has a value of another kind than rosbag2 reads there, and rosbag2 does not open the recording.",
        "Beside a history that is a number the other policies are numbers too. Durations have whole numbers `sec` and `nsec`.",
    ),
    CodeInfo(
        "ROS916",
        "recorded-value-unknown",
        "warning",
        "A recorded profile has a word that rosbag2 takes for `unknown`. Unless it is the history, no publisher can be created with it.",
        "Beside a history that is a word the other policies are words too, spelt as rmw does.",
    ),
)
CONFIGURED: Final = (
    CodeInfo(
        "ROS930",
        "override-is-no-parameter",
        "warning",
        "A `qos_overrides` parameter has a name that no node declares.",
        "It is silently without effect. The name is `qos_overrides.<full topic>.<publisher|subscription>[_<id>].<policy>`.",
    ),
    CodeInfo(
        "ROS931",
        "override-value-refused",
        "error",
        "A `qos_overrides` parameter has a value that the node refuses.",
        "The node ends with an error when it creates the endpoint. Policies are words in lower case, durations whole "
        "nanoseconds.",
    ),
    CodeInfo(
        "ROS932",
        "override-needs-opt-in",
        "note",
        "A policy is overridden that nodes do not let be overridden by default.",
        "By default a node that allows overrides at all allows those of history, depth and reliability. Others take effect "
        "only if its `QosOverridingOptions` name them.",
    ),
    CodeInfo(
        "ROS933",
        "override-outside-parameters",
        "error",
        "`qos_overrides` stands outside of `ros__parameters`.",
        "ROS 2 refuses such a file. Parameters stand below a node's name and `ros__parameters`.",
    ),
    CodeInfo(
        "ROS940",
        "displays-not-enabled",
        "note",
        "An RViz configuration has displays that are not enabled.",
        "They subscribe to nothing until they are enabled, so they are not checked.",
    ),
    CodeInfo(
        "ROS941",
        "rviz-of-ros-1",
        "warning",
        "An RViz configuration has displays of ROS 1.",
        "RViz 2 does not load them. Their classes begin with `rviz_default_plugins/` in ROS 2.",
    ),
    CodeInfo(
        "ROS942",
        "rviz-value-not-known",
        "warning",
        "An RViz configuration has a QoS value that RViz does not know.",
        "RViz silently takes its default instead: keep last 5, reliable, volatile.",
    ),
    CodeInfo(
        "ROS943",
        "topic-filled-in-at-launch",
        "note",
        "A topic has a placeholder that a launch file fills in.",
        "Its name is not known here, so it is not checked.",
        leaves_out="display",
        missing=1,
    ),
    CodeInfo(
        "ROS944",
        "qos-not-in-configuration",
        "note",
        "A display of another plugin names a topic, but its QoS is not in the configuration.",
        "What it requests is in the plugin's source, so it is not checked.",
        leaves_out="display",
        missing=1,
    ),
    CodeInfo(
        "ROS950",
        "bridge-refuses",
        "error",
        "A bridge does not start with this configuration, or leaves an entry out.",
        "What is meant to be bridged is not.",
    ),
    CodeInfo(
        "ROS951",
        "bridge-ignores",
        "warning",
        "A bridge ignores something that its configuration states.",
        "What it does instead is in the message.",
    ),
    CodeInfo(
        "ROS952",
        "bridge-thins-out",
        "note",
        "A bridge carries fewer samples of some topics than are published.",
        "What it leaves out is not judged.",
    ),
    CodeInfo(
        "ROS955",
        "model-part-not-read",
        "warning",
        "A component model has a part that C-QoS does not know.",
        "It is passed over. If it is misspelt, RosTooling does not read it either.",
        leaves_out="element",
        missing=1,
    ),
    CodeInfo(
        "ROS956",
        "nodl-part-not-read",
        "warning",
        "A NoDL document has a part that C-QoS does not read.",
        "The tools of NoDL refuse it, or it stands in another document. What it would have stated is not known.",
        leaves_out="element",
        missing=1,
    ),
    CodeInfo(
        "ROS960",
        "fastdds-elements-not-read",
        "note",
        "Fast DDS profiles have elements that ROS 2 has no policy for.",
        "Most of them decide no match. Those that may are named by the coverage: static discovery, discovery servers, initial peers.",
    ),
    CodeInfo(
        "ROS961",
        "fastdds-profile-never-used",
        "warning",
        "A Fast DDS profile has a name that ROS 2 never looks up.",
        "ROS 2 asks for profiles by the full name of the topic, with its leading slash, then for the default profile.",
    ),
    CodeInfo(
        "ROS962",
        "fastdds-profiles-decide-little",
        "note",
        "Fast DDS profiles decide only what a node leaves to the middleware.",
        "They are read by rmw_fastrtps only, from the file in `FASTRTPS_DEFAULT_PROFILES_FILE`. Whatever a node sets to "
        "something else than system_default wins over them. Only a depth may grow. That holds also with `RMW_FASTRTPS_USE_QOS_FROM_XML=1`, which adds but the "
        "memory policy and the publication mode.",
    ),
    CodeInfo(
        "ROS963",
        "fastdds-splits-topic",
        "note",
        "A Fast DDS profile has a setting that can keep endpoints of one topic apart and is not judged.",
        "Whether the endpoints that it covers match is unknown. Partitions of the default profile and ownership are judged.",
    ),
    CodeInfo(
        "ROS964",
        "fastdds-depth-above-limit",
        "note",
        "A Fast DDS profile asks for a depth above its `max_samples_per_instance`.",
        "By the standard the two do not fit. Fast DDS creates the endpoint, logs a warning, and keeps no more samples of one instance.",
    ),
    CodeInfo(
        "ROS965",
        "cyclonedds-part-not-read",
        "note",
        "A configuration of Cyclone DDS has parts that C-QoS does not read.",
        "C-QoS reads the lease of participants. Parts that may keep nodes apart are named by the coverage: tags, peers, ports.",
    ),
)

CODES: Final = (*OBSERVED, *CONFIGURED, *WORKSPACE)
