"""The ROS 2 pack: policies, rules, presets, dialects, conventions and names, put together as one value."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.model.lazy_tuple import lazy_tuple
from cqos_core.packs import NEEDS, CommonMistake, Implementations, RulePack, Timing, TopicMatching
from cqos_ros2 import interfaces, names
from cqos_ros2.conventions import CONVENTIONS
from cqos_ros2.costs import COSTS
from cqos_ros2.dialects import DIALECTS
from cqos_ros2.evidence import PROOFS
from cqos_ros2.guarantees import GUARANTEES, UNAFFECTED
from cqos_ros2.panel import PANEL
from cqos_ros2.policies import POLICIES
from cqos_ros2.presets import PRESETS
from cqos_ros2.rmw_check import RAW_POLICIES, RAW_RULES
from cqos_ros2.rules import RULES
from cqos_ros2.wire import WIRE

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.model.code_info import CodeInfo
    from cqos_core.packs.log_mismatches import ListTopic, LogMismatch

NOT_CHECKED: Final = (
    "whether access control (SROS 2) lets the endpoints talk to each other",
    "whether discovery works: multicast, ROS_AUTOMATIC_DISCOVERY_RANGE, discovery servers, Zenoh routers",
    "samples sent while endpoints are still discovering each other at start-up",
    "whether executors and callbacks keep up with what arrives",
    "whether different distributions and DDS vendors, which share a wire, agree on every type",
)

TIMING: Final = Timing(
    gap="deadline",
    lease="liveliness_lease_duration",
    asserted_on_topic=("liveliness", ("manual_by_topic",)),
    asserted_by_participant=("liveliness", ("manual_by_node",)),
    lifespan="lifespan",
    kept=("durability", ("transient_local",)),
    certain=("reliability", ("reliable",)),
    unlimited=("history", ("keep_all",)),
    depth="depth",
    period="period",
    latched="latched",
    keyed="keyed",
)


# Few runs need the following two, and each start of a check would pay for their modules.
def _codes() -> tuple[CodeInfo, ...]:
    from cqos_ros2.importers.codes import CODES

    return CODES


def _read_line(line: str) -> Iterable[LogMismatch | ListTopic]:
    from cqos_ros2.logs import read_line

    return read_line(line)


SLIPS: Final = (
    CommonMistake(r"history: keep_last[ :,/_]+(\d+)", r"history: keep_last, depth: \1"),
    CommonMistake(r"liveliness: manual", "liveliness: manual_by_topic"),
    CommonMistake(r"liveliness: manual_by_participant", "liveliness: manual_by_node"),
    CommonMistake(
        r"durability: (?:transient|persistent|latched|retained)|(?:retain|retained|latch|latched): true",
        "durability: transient_local",
    ),
    CommonMistake(r"(?:retain|retained|latch|latched): false", "durability: volatile"),
    CommonMistake(r"(?:qos|reliability): (?:0|at_most_once|fire_and_forget)", "reliability: best_effort"),
    CommonMistake(r"(?:qos|reliability): (?:[12]|at_least_once|exactly_once)", "reliability: reliable"),
    CommonMistake(
        r"(?:rclcpp::)?SensorDataQoS\(\)|QoSPresetProfiles\.SENSOR_DATA(?:\.value)?", "{profile: sensor_data}"
    ),
    CommonMistake(r"(?:rclcpp::)?ParametersQoS\(\)", "{profile: parameters}"),
    CommonMistake(r"(?:rclcpp::)?ServicesQoS\(\)", "{profile: services_default}"),
    CommonMistake(r"(?:rclcpp::)?SystemDefaultsQoS\(\)", "{profile: system_defaults_cpp}"),
    CommonMistake(r"(?:rclcpp::)?ClockQoS\(\)", "{profile: clock}"),
    CommonMistake(r"(?:rclcpp::)?RosoutQoS\(\)", "{profile: rosout}"),
)
"""Words of MQTT, DDS and ROS 1, and the value that has no deprecated spelling."""
_RAW: Final = RulePack(
    id="ros2",
    title="ROS 2",
    summary="Topics, services and actions of ROS 2, Foxy to Rolling, on any of its middlewares.",
    policies=RAW_POLICIES,
    rules=RAW_RULES,
    presets=PRESETS,
    base_preset="default",
    dialects=DIALECTS,
    conventions=CONVENTIONS,
    topic_matching=TopicMatching(
        names.resolve,
        interfaces.expand,
        names.address,
        names.covers,
        before=names.before,
        plain="(?:/[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)*)+",
        longest=names.LONGEST,
        folds=(
            ("differ only in upper and lower case", str.casefold),
            ("differ only in their namespace", names.without_namespace),
        ),
        described="endpoints with one full topic name after namespaces and remappings, on one domain, network and "
        "wire, with one type",
    ),
    wire=WIRE,
    not_checked=NOT_CHECKED,
    unaffected=UNAFFECTED,
    implementations=Implementations("rmw", PROOFS),
    common_mistakes=SLIPS,
    codes=lazy_tuple(_codes),
    read_log=_read_line,
    timing=TIMING,
    source="ROS 2 documentation, rmw, rmw_dds_common, rmw_zenoh, rclcpp, rclpy, REP 2003",
    validated=True,
)

# Binding all rules is most of what loading costs: no pack is made that is not used.
PACK: Final = replace(
    _RAW,
    policies=(*POLICIES, *NEEDS),
    rules=(*RULES, *GUARANTEES),
    variants={("comparison", "rmw"): _RAW},
    costs=COSTS,
    panel=PANEL,
)
