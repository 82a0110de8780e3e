"""Reads `metadata.yaml` of a rosbag2 recording, of every version: as what plays it, records anew, or was recorded.

As the player (if nothing else is asked for), every topic has one publisher with what `ros2 bag play` offers: what the
recorded publishers offered where they agree, else the default profile. As the recorder, every topic has one subscription
with what `ros2 bag record` requests. As what was recorded, every topic has the publishers that were there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import PurePath
from typing import Final

from cqos_core.importers.reading import described, listed, read_switches, shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, SequenceNode, flow_text, is_null, whole_number
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.problems import InputError, InvalidValueError
from cqos_core.model.system import (
    PUBLISHER,
    SUBSCRIBER,
    Endpoint,
    Participant,
    Place,
    Role,
    Setting,
    Settings,
    endpoint_id,
)
from cqos_core.packs import Policy, normalise
from cqos_ros2.dialects import RMW_CODES
from cqos_ros2.importers.configuration import RosFile
from cqos_ros2.importers.embedded import read_embedded
from cqos_ros2.policies import (
    AVOID_CONVENTIONS,
    DEADLINE,
    DEPTH,
    DURABILITY,
    FROM_PUBLISHERS,
    HISTORY,
    LEASE,
    LIFESPAN,
    LIVELINESS,
    RAW_SETTINGS,
    RELIABILITY,
)

PLAYER: Final = "rosbag2_player"
RECORDER: Final = "rosbag2_recorder"
RECORDED: Final = "rosbag2_recorded"
NODES: Final = {"player": PLAYER, "recorder": RECORDER, "recorded": RECORDED}
SWITCHES: Final = {"as": tuple(NODES)}

_ROOT: Final = "rosbag2_bagfile_information"
_PROFILES: Final = "offered_qos_profiles"
_AS_TEXT, _AS_LIST, _NEWEST = 4, 9, 9
"""The first version with profiles, which are a text with YAML in it; the first with a list; the newest known one."""

_OFFERED: Final = (RELIABILITY, DURABILITY, DEADLINE, LIFESPAN, LIVELINESS, LEASE, AVOID_CONVENTIONS)
_COMPARED: Final = (RELIABILITY, DURABILITY, DEADLINE, LIVELINESS, LEASE)
_POLICIES: Final = {policy.name: policy for policy in (HISTORY, DEPTH, *_OFFERED)}
_REQUIRED: Final = tuple(policy.name for policy in (HISTORY, *_OFFERED))
_DEFAULT_HISTORY: Final = {HISTORY.name: "keep_last", DEPTH.name: "10"}
_FEW: Final = 3


class _Recording(RosFile):
    """Reads the description of a recording."""

    def run(self) -> None:
        """Read the topics, as what they are taken for."""
        wanted = read_switches("rosbag2", self.context, SWITCHES).get("as", "player")
        bag = _read_bag(self)
        if bag is None or self.problems:
            raise InputError(self.problems)
        self.system.name = PurePath(self.source.name).parent.name
        if wanted == "player":
            _say_unknown(bag.topics, self)
        node = NODES[wanted]
        self.system.participants[node] = Participant(node, place=bag.place)
        made = {"player": _played, "recorder": _requested, "recorded": _published}[wanted]
        for topic in bag.topics:
            for endpoint in made(topic, self):
                endpoint.id = self.numbered(endpoint.id)
                self.system.endpoints.append(endpoint)


@dataclass(frozen=True, slots=True)
class _Topic:
    """One recorded topic; ``profiles`` is what its publishers offered, empty where that is not known."""

    name: str
    place: Place
    type: str | None
    messages: int
    profiles: tuple[Settings, ...]


@dataclass(frozen=True, slots=True)
class _Bag:
    """What a description says, and where."""

    place: Place
    topics: tuple[_Topic, ...]


# What the file says


def _read_bag(reading: RosFile) -> _Bag | None:
    """Read the document; report an unreadable one and return None."""
    documents = read_tree(reading).documents
    if reading.problems:
        return None
    root = documents[0] if documents else ScalarNode("", 1, 1, plain=True)
    entries = _map(root, reading, "the file")
    found = entries.get(_ROOT)
    if found is None:
        if isinstance(root, MappingNode):
            reading.problem("CQ010", f"a recording's description needs `{_ROOT}`", root)
        return None
    information = _map(found, reading, _ROOT)
    version = _version(information.get("version"), reading)
    topics = information.get("topics_with_message_count")
    if topics is None:
        if isinstance(found, MappingNode):
            reading.problem("CQ010", f"`{_ROOT}` needs `topics_with_message_count`", found)
        return None
    if not isinstance(topics, SequenceNode):
        reading.problem("CQ009", f"`topics_with_message_count` must be a list, found {described(topics)}", topics)
        return None
    _check_layout(topics, version, reading)
    read = [topic for item in topics.items if (topic := _topic(item, reading)) is not None]
    _check_whole(information.get("message_count"), read, reading)
    return _Bag(reading.place(found), tuple(read))


def _map(node: Node, reading: RosFile, name: str) -> dict[str, Node]:
    """Return the entries of a map, by key; report anything else and return none."""
    if isinstance(node, MappingNode):
        return {key: value for key, (_, value) in node.entries.items() if not is_null(value)}
    reading.problem("CQ009", f"{shown(name)} must be a map, found {described(node)}", node)
    return {}


def _version(node: Node | None, reading: RosFile) -> int | None:
    """Return the version, None where none is stated."""
    number = whole_number(node) if isinstance(node, ScalarNode) else None
    if node is None or number is None:
        if node is not None:
            reading.problem("CQ011", f"`version` must be a whole number, found {described(node)}", node)
        return None
    if number > _NEWEST:
        message = f"version {number} is newer than version {_NEWEST}, like which it is read"
        reading.note("ROS914", message, reading.place(node))
    return number


def _check_layout(topics: SequenceNode, version: int | None, reading: RosFile) -> None:
    """Report profiles in the layout of another version: rosbag2 decides by the version alone."""
    if version is None or version < _AS_TEXT:
        return
    wrong = ScalarNode if version >= _AS_LIST else SequenceNode
    for profiles in filter(None, map(_profiles_of, topics.items)):
        if isinstance(profiles, wrong):
            found, wanted = ("a text", "a list") if wrong is ScalarNode else ("a list", "a text with YAML in it")
            message = f"`{_PROFILES}` is {found}, in version {version} it must be {wanted}: rosbag2 cannot read this"
            reading.note("ROS913", message, reading.place(profiles))
            return


def _profiles_of(item: Node) -> Node | None:
    """Return what an item of the list of topics states as its profiles."""
    for key in ("topic_metadata", _PROFILES):
        entry = item.entries.get(key) if isinstance(item, MappingNode) else None
        if entry is None:
            return None
        item = entry[1]
    return item


def _topic(item: Node, reading: RosFile) -> _Topic | None:
    """Read one item of the list of topics; report a missing name and return None."""
    stated = _map(item, reading, "topics_with_message_count")
    metadata = stated.get("topic_metadata")
    if metadata is None:
        if isinstance(item, MappingNode):
            reading.problem("CQ010", "a recorded topic needs `topic_metadata`", item)
        return None
    described_by = _map(metadata, reading, "topic_metadata")
    name, kind = described_by.get("name"), described_by.get("type")
    if not isinstance(name, ScalarNode) or not name.text:
        if isinstance(metadata, MappingNode):
            reading.problem("CQ010", "`topic_metadata` needs a `name`", name or metadata)
        return None
    count = stated.get("message_count")
    return _Topic(
        name.text,
        reading.place(name),
        kind.text if isinstance(kind, ScalarNode) and kind.text else None,
        (whole_number(count) if isinstance(count, ScalarNode) else None) or 0,
        tuple(_profiles(described_by.get(_PROFILES), reading)),
    )


def _profiles(node: Node | None, reading: RosFile) -> Iterator[Settings]:
    """Yield what each recorded publisher offered."""
    if isinstance(node, ScalarNode):
        node = read_embedded(node, reading, _PROFILES) if node.text.strip() else None
    if node is None:
        return
    if not isinstance(node, SequenceNode):
        reading.problem("CQ009", f"`{_PROFILES}` must be a list of profiles, found {described(node)}", node)
        return
    for item in node.items:
        if not isinstance(item, MappingNode):
            reading.problem("CQ009", f"a recorded profile must be a map, found {described(item)}", item)
            continue
        yield dict(_settings(item, reading))
        if missing := [f"`{name}`" for name in _REQUIRED if name not in item.entries]:
            message = f"the recorded profile lacks {listed(missing, 'and')}: rosbag2 cannot read this"
            reading.note("ROS912", message, reading.place(item))


def _settings(profile: MappingNode, reading: RosFile) -> Iterator[tuple[str, Setting]]:
    """Yield what a recorded profile states."""
    for name, (key, value) in profile.entries.items():
        if name not in _POLICIES:
            reading.note("ROS905", f"{shown(name)} is no policy that rosbag2 is known to record", reading.place(key))
        elif not is_null(value):
            # What was recorded is never edited.
            yield name, Setting(flow_text(value), reading.place(value), derived=True)


def _check_whole(total: Node | None, topics: list[_Topic], reading: RosFile) -> None:
    """Say if topics are missing at the end: the number of all messages stands before them."""
    number = whole_number(total) if isinstance(total, ScalarNode) else None
    counted = sum(topic.messages for topic in topics)
    if total is not None and number is not None and counted < number:
        message = f"the recording has {number} messages, its topics only {counted}: some of them are missing"
        reading.note("ROS904", message, reading.place(total))


# What it stands for


def _endpoint(topic: _Topic, node: str, role: Role, settings: Settings, *, observed: bool = False) -> Endpoint:
    return Endpoint(
        id=endpoint_id(node, role, topic.name),
        role=role,
        topic=topic.name,
        participant=node,
        settings=settings,
        type=topic.type,
        dialect="rosbag",
        observed=observed,
        external=node == RECORDER,  # it subscribes to what is published, and to nothing else
        place=topic.place,
    )


def _say_unknown(topics: Sequence[_Topic], reading: RosFile) -> None:
    """Report the topics whose offered QoS is unknown."""
    unknown = [topic for topic in topics if not topic.profiles]
    if unknown:
        names = [f"`{topic.name}`" for topic in unknown[:_FEW]]
        if len(unknown) > _FEW:
            names.append(f"{len(unknown) - _FEW} more")
        message = f"what the publishers of {listed(names, 'and')} offered was not recorded"
        reading.note("ROS910", message, unknown[0].place)


def _played(topic: _Topic, reading: RosFile) -> Iterator[Endpoint]:
    """Yield the publisher of `ros2 bag play` (rosbag2, `Rosbag2QoS::adapt_offer_to_recorded_offers`)."""
    settings: Settings = {}
    differing = [policy.name for policy in _COMPARED if len({_value(policy, each) for each in topic.profiles}) > 1]
    if differing:
        names = listed((f"`{name}`" for name in differing), "and")
        message = (
            f"the recorded publishers of `{topic.name}` differ in {names}, so the player offers the default profile"
        )
        reading.note("ROS911", message, topic.place)
    elif topic.profiles:
        first = topic.profiles[0]
        settings = {policy.name: first[policy.name] for policy in _OFFERED if policy.name in first}
        if "unknown" in (_value(policy, first) for policy in _COMPARED):
            # No endpoint can be created with it; rules report that only of settings that go to rclcpp as they are.
            stated = {**_DEFAULT_HISTORY, RAW_SETTINGS.name: "true"}
            settings |= {name: Setting(text, topic.place, derived=True) for name, text in stated.items()}
    yield _endpoint(topic, PLAYER, PUBLISHER, settings)


def _requested(topic: _Topic, reading: RosFile) -> Iterator[Endpoint]:  # noqa: ARG001 - the signature of all three
    """Yield the subscription of `ros2 bag record` (rosbag2, `Rosbag2QoS::adapt_request_to_offers`)."""
    settings = {
        policy.name: Setting(FROM_PUBLISHERS, topic.place, derived=True) for policy in (RELIABILITY, DURABILITY)
    }
    yield _endpoint(topic, RECORDER, SUBSCRIBER, settings)


def _published(topic: _Topic, reading: RosFile) -> Iterator[Endpoint]:  # noqa: ARG001
    """Yield the recorded publishers; messages without a known publisher came from at least one."""
    for profile in topic.profiles:
        kept = {name: setting for name, setting in profile.items() if name != DEPTH.name or _keeps_last(profile)}
        yield _endpoint(topic, RECORDED, PUBLISHER, kept, observed=True)
    if topic.messages and not topic.profiles:
        yield _endpoint(topic, RECORDED, PUBLISHER, {}, observed=True)


def _keeps_last(profile: Settings) -> bool:
    """Whether a depth means anything in a profile."""
    return _value(HISTORY, profile) == HISTORY.domain.parse("keep_last")


def _value(policy: Policy, profile: Settings) -> object:
    """Return what a profile says about a policy so that equal values are equal; words without a value stay words."""
    setting = profile.get(policy.name)
    return None if setting is None else _parsed(policy.name, setting.text)


@lru_cache(maxsize=1000)
def _parsed(name: str, text: str) -> object:
    domain = _POLICIES[name].domain
    text = RMW_CODES.get(name, {}).get(text.strip(), text)
    try:
        return domain.parse(text)
    except InvalidValueError:
        return normalise(domain.word(text))


read = _Recording.load
