"""Random system files from a seed, written as YAML text, so that they stay the same while the code is moved about.

The vocabularies are written here, not taken from the packs: a policy that is added to a pack changes no golden.
"""

from __future__ import annotations

import json
import random
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

Table: TypeAlias = Mapping[str, tuple[Any, ...]]


@dataclass(frozen=True)
class Vocabulary:
    """What random systems of one protocol are made of."""

    protocol: str
    topics: tuple[str, ...]
    filters: tuple[str, ...]
    values: Table
    presets: tuple[str, ...]
    participant: Table
    options: Table
    topic: Table
    rules: tuple[str, ...]


NEEDS: Final = {
    "latest": (True,),
    "loss_free": (True,),
    "duplicate_free": (True,),
    "ordered": (True,),
    "late_join": (1, 5, True),
    "offline": ("1min", "1h"),
    "max_age": ("500ms", "10s"),
    "max_gap": ("500ms", "10s"),
    "liveness": ("2s", "1min"),
}
ROBOTS: Final = Vocabulary(
    "ros2",
    ("/scan", "/Scan", "map", "/tf_static", "a/odom", "/camera/image"),
    (),
    {
        "reliability": ("best_effort", "reliable", "reliable", "system_default", "best_available", "relaible"),
        "durability": ("volatile", "transient_local", "system_default", "best_available", "unknown"),
        "deadline": ("500ms", "1s", "infinite", "best_available", "7"),
        "lifespan": ("1s", "infinite"),
        "liveliness": ("automatic", "manual_by_topic", "system_default"),
        "liveliness_lease_duration": ("500ms", "1s", "infinite"),
        "history": ("keep_last", "keep_all"),
        "depth": (0, 1, 10, 100),
        "avoid_ros_namespace_conventions": (True, False),
        "type": ("a/msg/B", "a/msg/C"),
        "depht": (5,),
    },
    ("sensor_data", "system_default", "best_available", "services_default", "nonsense"),
    {
        "rmw": ("cyclonedds", "fastdds", "zenoh", "micro_ros"),
        "domain": (0, 1),
        "distro": ("humble", "jazzy"),
        "namespace": ("/a", "/"),
    },
    {
        "rmw": ("cyclonedds", "fastdds", "connext", "zenoh"),
        "distro": ("foxy", "jazzy"),
        "round_trip_time": ("10ms",),
        "outage": ("5s",),
    },
    {"period": ("100ms", "10s"), "latched": (True, False), "keyed": (True, False), "size": (100, 100_000)},
    ("ROS101", "ROS102", "ROS201", "ROS305"),
)
DATA: Final = Vocabulary(
    "dds",
    ("Track", "track", "Pose", "Alarm/Fire", "Video"),
    (),
    {
        "reliability": ("best_effort", "reliable"),
        "durability": ("volatile", "transient_local", "transient", "persistent"),
        "deadline": ("500ms", "1s", "infinite"),
        "latency_budget": ("0s", "10ms"),
        "liveliness": ("automatic", "manual_by_participant", "manual_by_topic"),
        "liveliness.lease_duration": ("500ms", "1s", "infinite"),
        "ownership": ("shared", "exclusive"),
        "ownership_strength": (1, 5),
        "destination_order": ("by_reception_timestamp", "by_source_timestamp"),
        "presentation.access_scope": ("instance", "topic", "group"),
        "presentation.coherent_access": (True, False),
        "data_representation": (["xcdr1"], ["xcdr2", "xcdr1"]),
        "partition": (["a"], ["a*", "b"], []),
        "type": ("Track", "Pose"),
        "type_consistency": ("disallow_type_coercion", "allow_type_coercion"),
        "history": ("keep_last", "keep_all"),
        "history.depth": (1, 10, 500),
        "resource_limits.max_samples": (1, 100),
        "lifespan": ("1s", "infinite"),
        "time_based_filter": ("100ms", "2s"),
        "reliabilty": ("reliable",),
    },
    ("BuiltinQosLib::Generic.BestEffort", "BuiltinQosLib::Generic.StrictReliable"),
    {"implementation": ("cyclonedds", "fastdds_2_9", "connext"), "domain": (0, 1)},
    {
        "implementation": ("standard", "cyclonedds", "fastdds_3_1", "opendds", "rustdds"),
        "durability_service_runs": (True, False),
        "round_trip_time": ("10ms",),
        "outage": ("5s",),
    },
    {"period": ("100ms", "10s"), "keyed": (True, False), "latched": (True,), "size": (100, 100_000)},
    ("DDS101", "DDS102", "DDS201", "DDS305"),
)
MESSAGES: Final = Vocabulary(
    "mqtt",
    ("bed/1/moisture", "bed/2/moisture", "Bed/1/moisture", "valve/set", "a/b/c"),
    ("bed/+/moisture", "bed/#", "#", "$share/log/bed/+/moisture", "bed/1/moisture", "valve/set", "valve/+/set"),
    {
        "qos": (0, 1, 2),
        "retain": (True, False),
        "message_expiry_interval": ("10s", "1h"),
        "no_local": (True, False),
        "retain_as_published": (True, False),
        "retain_handling": ("send", "do_not_send"),
        "taken_every": ("1s", "10s"),
        "qso": (1,),
    },
    ("node_red_in", "mqtt_client"),
    {
        "clean_start": (True, False),
        "session_expiry_interval": ("0s", "600s", "1h"),
        "keep_alive": ("10s", "60s"),
        "receive_maximum": (1, 20),
        "client_id": ("one", "two"),
        "maximum_packet_size": (100, 10_000),
    },
    {"protocol_version": ("3.1.1", "5.0"), "implied_needs": ("note", "warning"), "outage": ("5s",)},
    {"period": ("100ms", "1min"), "command": (True,), "burst": (1, 50)},
    ("MQTT101", "MQTT201", "MQTT305", "MQTT404"),
)
VOCABULARIES: Final = (ROBOTS, ROBOTS, DATA, MESSAGES)
BROKER: Final = {
    "maximum_qos": (1, 2),
    "retain_available": (True, False),
    "max_queued_messages": (10, 1000),
    "persistence": (True, False),
    "wildcard_subscription_available": (True, False),
}


def text(number: int) -> bytes:
    """Return random system file ``number``, always the same."""
    return json.dumps(_Design(random.Random(number)).document, indent=1).encode()  # noqa: S311 - no secret


def protocol(number: int) -> str:
    """Return the protocol of random system file ``number``."""
    return random.Random(number).choice(VOCABULARIES).protocol  # noqa: S311 - no secret


class _Design:
    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        words = chance.choice(VOCABULARIES)
        self.document: dict[str, Any] = {"cqos": 1, "system": "random", "protocol": words.protocol}
        self._maybe("options", 0.6, {words.protocol: self._some(words.options, 2)})
        profiles = {f"p{n}": self._some(words.values, 3) for n in range(chance.randrange(3))}
        self._maybe("profiles", 1, profiles)
        topics = {topic: self._some(words.topic, 2) for topic in words.topics if chance.random() < 0.3}
        self._maybe("topics", 1, topics)
        if words is MESSAGES and chance.random() < 0.7:
            preset = chance.choice(("mosquitto", "hivemq_ce", "emqx", "aws_iot_core"))
            self.document["brokers"] = {"main": {"profile": preset, **self._some(BROKER, 2)}}
        owners = {f"n{n}": self._participant(words, [*profiles, *words.presets]) for n in range(chance.randint(2, 5))}
        self.document["participants"] = owners
        if chance.random() < 0.2:
            self._bridge(words)
        if chance.random() < 0.15:
            accepted = {"rule": chance.choice(words.rules), "because": "it is known"}
            self.document["accept"] = [accepted]
        if chance.random() < 0.15:
            self.document["severities"] = {chance.choice(words.rules): chance.choice(("off", "note", "error"))}
        if chance.random() < 0.15:
            stated = self._some(words.values, 2, least=1)
            self.document["checks"] = [{"name": "team", "because": "the team wants it", "require": stated}]

    def _maybe(self, key: str, likely: float, content: dict[str, Any]) -> None:
        if content and self.chance.random() < likely:
            self.document[key] = content

    def _some(self, table: Table, most: int, least: int = 0) -> dict[str, Any]:
        names = self.chance.sample(sorted(table), self.chance.randint(least, min(most, len(table))))
        return {name: self.chance.choice(table[name]) for name in names}

    def _participant(self, words: Vocabulary, profiles: list[str]) -> dict[str, Any]:
        made: dict[str, Any] = {}
        own = self._some(words.participant, 2) if self.chance.random() < 0.4 else {}
        made |= {"client": own} if own and words is MESSAGES else own
        for key, names in (("publishes", words.topics), ("subscribes", words.topics + words.filters)):
            chosen = self.chance.sample(names, self.chance.randrange(4))
            if chosen:
                made[key] = {topic: self._endpoint(words, profiles, needing=key == "subscribes") for topic in chosen}
        return made

    def _endpoint(self, words: Vocabulary, profiles: list[str], *, needing: bool) -> dict[str, Any]:
        stated = self._some(words.values, 4)
        if self.chance.random() < 0.3:
            stated["profile"] = self.chance.choice(profiles)
        if needing and self.chance.random() < 0.4:
            stated["needs"] = self._some(NEEDS, 3, least=1)
        return stated

    def _bridge(self, words: Vocabulary) -> None:
        owners = list(self.document["participants"])
        start, end = self.chance.choice(owners), self.chance.choice(owners)
        topic = self.chance.choice(words.topics)
        other = self.chance.choice(words.topics)
        self.document["bridges"] = {
            "b": {
                "routes": [
                    {
                        "from": {"participant": start, "topic": topic, **self._some(words.values, 2)},
                        "to": {"participant": end, "topic": other, **self._some(words.values, 2)},
                    }
                ]
            }
        }
