"""What other publishers of a topic take from the guarantees of a pair in ROS 2: a pair does not show them."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import as_condition, gives, offered, topic
from cqos_ros2.policies import OWNERSHIP, SOLE_PUBLISHER

# A weaker exclusive publisher reached a subscription with 0 of 20 samples; seen by running Cyclone DDS as plain DDS.
OTHER_PUBLISHERS: Final = tuple(
    gives(
        word,
        (offered(OWNERSHIP) == "shared") | as_condition(topic(SOLE_PUBLISHER)),
        doubt=True,
        code=code,
        name=f"{name}-by-ownership",
        because="a subscription drops the samples of all exclusive publishers but the owner, and which other publishers send the "
        "instance is not seen in one pair",
        clause="DDS 1.4, 2.2.3.9",
        help="state `sole_publisher: true` of a topic whose instances have one publisher each",
    )
    for code, word, name in (
        ("ROS572", "loss_free", "loss"),
        ("ROS573", "latest", "latest-lost"),
        ("ROS574", "late_join", "late-join-lost"),
        ("ROS575", "offline", "offline-lost"),
        ("ROS576", "max_gap", "gap"),
    )
)
