"""What is written by mistake, as packs list it, and what programs write: each comes with settings that the pack reads."""

import re

import pytest

from cqos_core.language.policy import ENDPOINT
from cqos_core.plugins import load_plugins
from cqos_core.resolving.slips import (
    meant_instead,
    preset_within,
    settings_of_assignments,
    settings_of_call,
    settings_of_values,
    value_within,
)

PACKS = {each.id: each for name in ("ros2", "dds", "mqtt") if (each := load_plugins().pack(name)) is not None}
SLIPS = [pytest.param(PACKS[name], slip, id=f"{name} {slip.written}") for name in PACKS for slip in PACKS[name].slips]


@pytest.mark.parametrize(("pack", "slip"), SLIPS)
def test_what_is_to_be_written_is_read_by_the_pack(pack, slip):
    write = re.sub(r"\\\d", "1", slip.write).strip("{}")
    for entry in write.split(", "):
        name, _, value = entry.partition(": ")
        if name == "profile":
            assert value in pack.presets
            continue
        index = pack.find(ENDPOINT, name)
        assert index is not None, entry
        policy = pack.policies[index]
        text = f"{value}s" if policy.domain.kind == "duration" else value
        assert policy.domain.read(text) is not None, entry


def test_of_several_slips_the_first_that_fits_is_named():
    assert meant_instead(PACKS["ros2"], "Durability: TRANSIENT") == "durability: transient_local"
    assert meant_instead(PACKS["ros2"], "history: keep_last 7") == "history: keep_last, depth: 7"
    assert meant_instead(PACKS["ros2"], "history: keep_last") == ""
    assert meant_instead(PACKS["mqtt"], "lifespan: 5s") == "message_expiry: 5s"


CALLS = {
    "QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)": "{depth: 10, reliability: best_effort}",
    "rclcpp::QoS(rclcpp::KeepLast(5)).transient_local()": "{history: keep_last, depth: 5, durability: transient_local}",
    "QoS(10).deadline(Duration(seconds=2))": "{depth: 10, deadline: 2s}",
    "QoSProfile(history=KeepLast(depth=3))": "{history: keep_last, depth: 3}",
    "KEEP_ALL()": "{history: keep_all}",
    "rclcpp::SensorDataQoS()": "",  # a slip: the pack names the preset
    "qos = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)": "{depth: 1, durability: transient_local}",
    "auto qos = rclcpp::QoS(10);": "{depth: 10}",
    "create_publisher(String, '/u', 10)": "{depth: 10}",
    "create_publisher(String, '/u', make_qos)": "",
    "rclcpp::QoS(rclcpp::QoSInitialization::from_rmw(rmw_qos_profile_default))": "{profile: default}",
    "QoSProfile(depth=many)": "",
    "QoSProfile(colour=red)": "",
    "QoS(10).colour(red)": "",
    "best_effort": "",
    "": "",
}


@pytest.mark.parametrize("text", CALLS)
def test_a_call_becomes_settings_where_all_of_it_is_understood(text):
    assert settings_of_call(PACKS["ros2"], text) == CALLS[text]


def test_a_call_for_one_policy_sets_that_policy():
    assert settings_of_call(PACKS["ros2"], "keep_last(10)", of="history") == "{history: keep_last, depth: 10}"
    assert settings_of_call(PACKS["ros2"], "milliseconds(100)", of="deadline") == ""


def test_a_call_of_dds_sets_the_time_that_belongs_to_its_value():
    call = "Policy.Reliability.Reliable(duration(seconds=1))"
    assert settings_of_call(PACKS["dds"], call) == "{reliability: reliable, reliability.max_blocking_time: 1s}"
    assert (
        settings_of_call(PACKS["dds"], "Policy.Liveliness.Automatic(duration(seconds=1))") == ""
    )  # two times belong to it


def test_assignments_become_settings_where_each_is_understood():
    assert settings_of_assignments(PACKS["ros2"], "depth = 5 reliability = best_effort") == (
        "{depth: 5, reliability: best_effort}"
    )
    assert settings_of_assignments(PACKS["ros2"], "depth = 5, colour = red") == ""
    assert settings_of_assignments(PACKS["ros2"], "depth = many") == ""
    assert settings_of_assignments(PACKS["ros2"], "depth") == ""
    assert settings_of_assignments(PACKS["ros2"], "a=" * 100 + "a b") == ""  # at once


def test_a_preset_may_be_named_with_its_module():
    assert preset_within(PACKS["ros2"], "rclpy.qos.qos_profile_sensor_data") == "{profile: sensor_data}"
    assert preset_within(PACKS["ros2"], "rclpy.qos.sensor") == ""


WITHIN = {
    ("dds", "reliability", "RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT"): "best_effort",
    ("dds", "reliability", "not_reliable"): "",
    ("dds", "reliability", "best_effort_or_reliable"): "",
    ("dds", "reliability", "unreliable"): "",
    ("ros2", "depth", "10 messages"): "10",
    ("ros2", "depth", "ten"): "",
    ("mqtt", "qos", "QOS_LEVEL_1"): "",  # a digit in a name may be anything
}


@pytest.mark.parametrize(("pack", "name", "text"), WITHIN)
def test_a_value_may_be_a_part_of_a_longer_text(pack, name, text):
    policy = PACKS[pack].policies[PACKS[pack].find(ENDPOINT, name)]
    assert value_within(policy, text) == WITHIN[pack, name, text]


def test_values_alone_become_settings_where_each_is_of_one_policy():
    assert settings_of_values(PACKS["ros2"], ["reliable", "volatile", "1"]) == (
        "{reliability: reliable, durability: volatile, depth: 1}"
    )
    assert settings_of_values(PACKS["mqtt"], ["1", "retain"]) == "{qos: 1, retain: true}"
    assert settings_of_values(PACKS["ros2"], ["reliable", "system_default"]) == ""
    assert settings_of_values(PACKS["ros2"], ["sensor_data"]) == ""
    assert (
        settings_of_values(PACKS["ros2"], ["sensor_data", "reliable"])
        == "{profile: sensor_data, reliability: reliable}"
    )
