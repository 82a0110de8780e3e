"""What is written by mistake, as packs list it, and what programs write: each comes with settings that the pack reads."""

import re

import pytest

from cqos_core import Endpoint, Finding, Participant, ProfileRef, Setting, System, check
from cqos_core.packs import ENDPOINT
from cqos_core.plugins import load_plugins

PACKS = {each.id: each for name in ("ros2", "dds", "mqtt") if (each := load_plugins().pack(name)) is not None}
SLIPS = [
    pytest.param(PACKS[name], slip, id=f"{name} {slip.written}")
    for name in PACKS
    for slip in PACKS[name].common_mistakes
]


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


PROFILES = {
    # Several slips fit, and the first is named.
    ("ros2", "Durability: TRANSIENT"): "durability: transient_local",
    ("ros2", "history: keep_last 7"): "history: keep_last, depth: 7",
    ("ros2", "history: keep_last"): "",
    # A call becomes settings where all of it is understood.
    (
        "ros2",
        "QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)",
    ): "{depth: 10, reliability: best_effort}",
    (
        "ros2",
        "rclcpp::QoS(rclcpp::KeepLast(5)).transient_local()",
    ): "{history: keep_last, depth: 5, durability: transient_local}",
    ("ros2", "QoS(10).deadline(Duration(seconds=2))"): "{depth: 10, deadline: 2s}",
    ("ros2", "QoSProfile(history=KeepLast(depth=3))"): "{history: keep_last, depth: 3}",
    ("ros2", "KEEP_ALL()"): "{history: keep_all}",
    ("ros2", "rclcpp::SensorDataQoS()"): "{profile: sensor_data}",
    (
        "ros2",
        "qos = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)",
    ): "{depth: 1, durability: transient_local}",
    ("ros2", "auto qos = rclcpp::QoS(10);"): "{depth: 10}",
    ("ros2", "create_publisher(String, '/u', 10)"): "{depth: 10}",
    ("ros2", "create_publisher(String, '/u', make_qos)"): "",
    ("ros2", "rclcpp::QoS(rclcpp::QoSInitialization::from_rmw(rmw_qos_profile_default))"): "{profile: default}",
    ("ros2", "QoSProfile(depth=many)"): "",
    ("ros2", "QoSProfile(colour=red)"): "",
    ("ros2", "QoS(10).colour(red)"): "",
    ("ros2", ""): "",
    # The time that belongs to a value is set with it, where it is one time.
    (
        "dds",
        "Policy.Reliability.Reliable(duration(seconds=1))",
    ): "{reliability: reliable, reliability.max_blocking_time: 1s}",
    ("dds", "Policy.Liveliness.Automatic(duration(seconds=1))"): "",
    # Assignments become settings where each is understood.
    ("ros2", "depth = 5 reliability = best_effort"): "{depth: 5, reliability: best_effort}",
    ("ros2", "depth = 5, colour = red"): "",
    ("ros2", "depth = many"): "",
    ("ros2", "depth"): "",
    ("ros2", "a=" * 100 + "a b"): "",  # at once
    # A preset may be named with its module.
    ("ros2", "rclpy.qos.qos_profile_sensor_data"): "{profile: sensor_data}",
    ("ros2", "rclpy.qos.sensor"): "",
    # A value alone is a setting where it is of one policy.
    ("ros2", "reliable"): "{reliability: reliable}",
    ("mqtt", "retain"): "{retain: true}",
}


def refused(pack: str, *ends: Endpoint) -> list[Finding]:
    """What is said of settings and profiles that a pack does not read."""
    system = System(protocol=pack, participants={"p": Participant("p")}, endpoints=list(ends))
    return [each for each in check(system).findings if each.code in {"CQ202", "CQ203", "CQ204"}]


def end(name: str, settings: dict[str, str], *profiles: str) -> Endpoint:
    return Endpoint(
        id=name,
        role="publisher",
        topic="/t",
        participant="p",
        settings={policy: Setting(text) for policy, text in settings.items()},
        profiles=tuple(map(ProfileRef, profiles)),
    )


@pytest.mark.parametrize("pack", PACKS)
def test_what_is_no_profile_becomes_settings_where_all_of_it_is_understood(pack):
    texts = {text: meant for (of, text), meant in PROFILES.items() if of == pack}
    named = r"(?:profile )?`(.*)` is (?:no profile|neither defined nor .*)"
    told = {}
    for finding in refused(pack, *(end(text, {}, text) for text in texts)):
        said = re.fullmatch(named, finding.message)
        assert said is not None, finding.message
        told[said[1]] = str(finding.help).partition("write its settings: `")[2].removesuffix("`")
    assert told == texts


VALUES = {
    # Of a call, what the policy itself is set to.
    ("ros2", "history", "keep_last(10)"): "history: keep_last, depth: 10",
    ("ros2", "history", "keep_last 7"): "history: keep_last, depth: 7",
    ("ros2", "durability", "TRANSIENT"): "durability: transient_local",
    ("ros2", "deadline", "milliseconds(100)"): "100ms",
    ("mqtt", "lifespan", "5s"): "message_expiry: 5s",
    # A value may be a part of a longer text, where that does not deny it.
    ("dds", "reliability", "RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT"): "best_effort",
    ("dds", "reliability", "not_reliable"): "",
    ("dds", "reliability", "unreliable"): "",
    ("dds", "reliability", "Policy.NOT_RELIABLE"): "",
    ("dds", "reliability", "reliabel"): "reliable",
    ("ros2", "depth", "10 messages"): "10",
    ("ros2", "depth", "ten"): "",
    ("mqtt", "qos", "QOS_LEVEL_1"): "",  # a digit in a name may be anything
}


@pytest.mark.parametrize("pack", PACKS)
def test_what_is_no_value_may_be_meant_for_one(pack):
    texts = {(policy, text): meant for (of, policy, text), meant in VALUES.items() if of == pack}
    found = refused(pack, *(end(f"{policy} {text}", {policy: text}) for policy, text in texts))
    told = {each.endpoints[0]: str(each.help).partition("did you mean `")[2].partition("`")[0] for each in found}
    assert told == {f"{policy} {text}": meant for (policy, text), meant in texts.items()}


LISTS = {
    ("ros2", "[reliable, volatile, 1]"): "{reliability: reliable, durability: volatile, depth: 1}",
    ("mqtt", "[1, retain]"): "{qos: 1, retain: true}",
    ("ros2", "[reliable, system_default]"): "",
    ("ros2", "[sensor_data, reliable]"): "{profile: sensor_data, reliability: reliable}",
}


@pytest.mark.parametrize(("pack", "values"), LISTS)
def test_values_alone_become_settings_where_each_is_of_one_policy(pack, values):
    text = f"cqos: 1\nprotocol: {pack}\nparticipants: {{p: {{publishes: {{t: {values}}}}}}}\n"
    found = {str(each.help) for each in check(text.encode()).findings if each.code == "CQ204"} or {""}
    (told,) = {each.partition("write the names of the settings: `")[2].removesuffix("`") for each in found}
    assert told == LISTS[pack, values]
