"""What the importers of ROS 2 files report, beside what all importers do (``CQ0xx``).

ROS900-ROS929: what was observed (snapshots and recordings); ROS930-ROS959: what is configured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.codes import CodeInfo
from cqos_core.system import ImportNote

if TYPE_CHECKING:
    from cqos_core.system import Place

OBSERVED: Final = (
    CodeInfo(
        "ROS901",
        "topic-without-name",
        "error",
        "A snapshot of a topic does not say which topic it is of.",
        "`ros2 topic info` does not print the name. Put it above, as in `### /chatter`, name the file after it, or give "
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
    ),
    CodeInfo(
        "ROS905",
        "not-understood",
        "warning",
        "Something is stated about an endpoint that C-QoS does not know.",
        "It is skipped. A newer C-QoS may know it.",
    ),
    CodeInfo(
        "ROS906",
        "endpoint-seen-twice",
        "note",
        "Snapshots in one file show an endpoint several times, with different values.",
        "What was seen last holds.",
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
        "warning",
        "A recorded profile lacks policies, and rosbag2 does not open such a recording.",
        "`ros2 bag reindex` writes the description anew. Here the defaults stand in for what is missing.",
    ),
    CodeInfo(
        "ROS913",
        "unplayable-value",
        "warning",
        "A recorded value is `unknown`, with which no publisher can be created, so the player leaves the topic out.",
        "State what it shall offer in a file for `--qos-profile-overrides-path`.",
    ),
    CodeInfo(
        "ROS914",
        "layout-of-another-version",
        "warning",
        "Recorded profiles are written in another way than the version of the file says.",
        "Up to version 8 they are a text with YAML in it, from version 9 on a list; rosbag2 stops with `bad conversion` at the "
        "other one. Converters and files edited by hand often have it.",
    ),
    CodeInfo(
        "ROS915",
        "newer-recording",
        "note",
        "The description of the recording has a newer version than any that C-QoS knows.",
        "It is read like the newest known one.",
    ),
)
CONFIGURED: Final[tuple[CodeInfo, ...]] = ()

CODES: Final = (*OBSERVED, *CONFIGURED)
_BY_CODE: Final = {info.code: info for info in CODES}


def note(code: str, message: str, place: Place | None, *, advice: str | None = None) -> ImportNote:
    """Say something that is no reason to stop, with the severity of its code."""
    return ImportNote(code, _BY_CODE[code].severity, message, place, advice)
