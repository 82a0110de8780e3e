"""Reads `metadata.yaml` of a rosbag2 recording as rosbag2 does: as what plays it, records anew, or was recorded.

The version says where the profiles are: nowhere, in a text with YAML in it, or in a list. Within a profile the history says
whether its values are the integer codes of rmw or words (rosbag2_storage, yaml.hpp and qos.cpp). Before Jazzy, rosbag2 reads
neither lists nor words.

As the player (if nothing else is asked for), every topic has one publisher with what `ros2 bag play` offers: what the
recorded publishers offered where they agree, else the default profile. As the recorder, every topic has one subscription
with what `ros2 bag record` requests. As what was recorded, every topic has the publishers that were there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import PurePath
from typing import Final

from cqos_core.importers.source_reading import described, listed, read_switches, shown
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, SequenceNode, flow_text, is_null, whole_number
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.problems import InputError, InvalidValueError
from cqos_core.model.settings import Place, Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, Role, endpoint_id
from cqos_core.packs import Policy, normalise
from cqos_ros2.dialects import RMW_CODES
from cqos_ros2.importers.configuration import RosFile, as_flag
from cqos_ros2.importers.nested_yaml import read_embedded
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
    RECORDED_FORM,
    RELIABILITY,
)

PLAYER: Final = "rosbag2_player"
RECORDER: Final = "rosbag2_recorder"
RECORDED: Final = "rosbag2_recorded"
_FORMS: Final = ("codes", "words", "list")
NODES: Final = {"player": PLAYER, "recorder": RECORDER, "recorded": RECORDED}
SWITCHES: Final = {"as": tuple(NODES)}

_ROOT: Final = "rosbag2_bagfile_information"
_PROFILES: Final = "offered_qos_profiles"
_AS_TEXT, _AS_LIST, _NEWEST = 4, 9, 9
"""The first version with profiles, which are a text with YAML in it; the first with a list; the newest known one."""
_CANNOT_READ: Final = "rosbag2 cannot read this"
_WORDS: Final = {
    HISTORY.name: ("system_default", "keep_last", "keep_all", "unknown"),
    RELIABILITY.name: ("system_default", "reliable", "best_effort", "best_available", "unknown"),
    DURABILITY.name: ("system_default", "transient_local", "volatile", "best_available", "unknown"),
    LIVELINESS.name: ("system_default", "automatic", "manual_by_topic", "best_available", "unknown"),
}
"""What rosbag2 reads by name; any other word is `unknown` to it (rmw, qos_string_conversions.c)."""
_DURATIONS: Final = (DEADLINE.name, LIFESPAN.name, LEASE.name)
_INTEGER: Final = re.compile(r"[-+]?\d{1,18}", re.ASCII)
_COUNT: Final = re.compile(r"\d{1,20}", re.ASCII)

_OFFERED: Final = (RELIABILITY, DURABILITY, DEADLINE, LIFESPAN, LIVELINESS, LEASE, AVOID_CONVENTIONS)
_COMPARED: Final = (RELIABILITY, DURABILITY, DEADLINE, LIVELINESS, LEASE)
_POLICIES: Final = {policy.name: policy for policy in (HISTORY, DEPTH, *_OFFERED)}
_REQUIRED: Final = tuple(policy.name for policy in (HISTORY, *_OFFERED))
_DEFAULT_HISTORY: Final = {HISTORY.name: "keep_last", DEPTH.name: "10"}
_FEW: Final = 3


class _Recording(RosFile):
    """Reads the description of a recording.

    ``refused`` tells that rosbag2 does not open it.
    """

    refused = False

    def refuse_bag(self, code: str, message: str, where: Place) -> None:
        """Report why rosbag2 does not open the recording."""
        self.refused = True
        self.note(code, message, where)

    def run(self) -> None:
        """Read the topics, as what they are taken for."""
        wanted = read_switches("rosbag2", self.context, SWITCHES).get("as", "player")
        bag = _read_bag(self)
        if bag is None or self.problems:
            raise InputError(self.problems)
        self.system.name = PurePath(self.source.name).parent.name
        if wanted == "player" and not self.refused:
            _say_unknown(bag.topics, self)
        node = NODES[wanted]
        self.system.participants[node] = Participant(node, place=bag.place)
        if wanted == "player":
            if self.refused:
                return  # it plays nothing
            settings = self.system.participants[node].settings
            for topic in sorted(bag.topics, key=lambda each: _FORMS.index(each.form)):
                # One text with words keeps the player from opening the recording, so the last of them counts for all.
                settings[RECORDED_FORM.name] = Setting(topic.form, topic.place, derived=True)
        made = {"player": _played, "recorder": _requested, "recorded": _published}[wanted]
        for topic in bag.topics:
            for endpoint in made(topic, self):
                endpoint.id = self.numbered(endpoint.id)
                self.system.endpoints.append(endpoint)


@dataclass(frozen=True, slots=True)
class _Topic:
    """One recorded topic; ``profiles`` is what its publishers offered, empty where that is not known.

    ``form`` is how they are written, a value of the policy of that name.
    """

    name: str
    place: Place
    type: str | None
    messages: int
    profiles: tuple[Settings, ...]
    form: str


@dataclass(frozen=True, slots=True)
class _Bag:
    """What a description says, and where."""

    place: Place
    topics: tuple[_Topic, ...]


# What the file says


def _read_bag(reading: _Recording) -> _Bag | None:
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
    version = _version(information.get("version"), found, reading)
    topics = information.get("topics_with_message_count")
    if topics is None:
        if isinstance(found, MappingNode):
            reading.problem("CQ010", f"`{_ROOT}` needs `topics_with_message_count`", found)
        return None
    if not isinstance(topics, SequenceNode):
        reading.problem("CQ009", f"`topics_with_message_count` must be a list, found {described(topics)}", topics)
        return None
    read = [topic for item in topics.items if (topic := _topic(item, version, reading)) is not None]
    _check_whole(information.get("message_count"), read, reading)
    return _Bag(reading.place(found), tuple(read))


def _map(node: Node, reading: _Recording, name: str) -> dict[str, Node]:
    """Return the entries of a map, by key; report anything else and return none."""
    if isinstance(node, MappingNode):
        return {key: value for key, (_, value) in node.entries.items() if not is_null(value)}
    reading.problem("CQ009", f"{shown(name)} must be a map, found {described(node)}", node)
    return {}


def _version(node: Node | None, information: Node, reading: _Recording) -> int | None:
    """Return the version; report if none is stated, and return None."""
    number = whole_number(node) if isinstance(node, ScalarNode) else None
    if node is None or number is None:
        if node is not None:
            reading.problem("CQ011", f"`version` must be a whole number, found {described(node)}", node)
        elif isinstance(information, MappingNode):
            reading.refuse_bag(
                "ROS912", f"the description has no `version`: {_CANNOT_READ}", reading.place(information)
            )
        return None
    if number > _NEWEST:
        message = f"version {number} is newer than version {_NEWEST}, like which it is read"
        reading.note("ROS914", message, reading.place(node))
    return number


def _topic(item: Node, version: int | None, reading: _Recording) -> _Topic | None:
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
    profiles, form = _recorded(metadata, name, version, reading)
    return _Topic(
        name.text,
        reading.place(name),
        kind.text if isinstance(kind, ScalarNode) and kind.text else None,
        (whole_number(count) if isinstance(count, ScalarNode) else None) or 0,
        profiles,
        form,
    )


def _recorded(
    metadata: Node, topic: ScalarNode, version: int | None, reading: _Recording
) -> tuple[tuple[Settings, ...], str]:
    """Return what each recorded publisher of a topic offered, and how that is written."""
    _, node = metadata.entries.get(_PROFILES, (None, None)) if isinstance(metadata, MappingNode) else (None, None)
    if version is not None and version < _AS_TEXT:
        return (), "codes"  # rosbag2 looks for none
    if node is None or is_null(node):
        message = f"topic {shown(topic.text)} has no `{_PROFILES}`: {_CANNOT_READ}"
        reading.refuse_bag("ROS912", message, reading.place(topic))
        return (), "codes"
    as_list = not isinstance(node, ScalarNode)
    if version is not None and as_list is not (version >= _AS_LIST) and not isinstance(node, MappingNode):
        stated, wanted = ("a list", "a text with YAML in it") if as_list else ("a text", "a list")
        message = f"`{_PROFILES}` is {stated}, in version {version} it must be {wanted}: {_CANNOT_READ}"
        reading.refuse_bag("ROS913", message, reading.place(node))
    if isinstance(node, ScalarNode):
        if not node.text:
            return (), "codes"
        found = read_embedded(node, reading, _PROFILES)
        if found is None and reading.problems:
            return (), "codes"
    else:
        found = node
    if not isinstance(found, SequenceNode):
        what = "nothing" if found is None else described(found)
        reading.problem("CQ009", f"`{_PROFILES}` must be a list of profiles, found {what}", found or node)
        return (), "codes"
    profiles, forms = [], set()
    for item in found.items:
        if not isinstance(item, MappingNode):
            reading.problem("CQ009", f"a recorded profile must be a map, found {described(item)}", item)
            continue
        coded = _is_coded(item)
        forms.add("codes" if coded else "words")
        profiles.append(dict(_settings(item, reading, coded=coded)))
    return tuple(profiles), "list" if as_list else max(forms, default="codes")


def _is_coded(profile: MappingNode) -> bool:
    """Whether the values of a profile are codes: rosbag2 looks at its history."""
    _, history = profile.entries.get(HISTORY.name, (None, None))
    return isinstance(history, ScalarNode) and history.text in RMW_CODES[HISTORY.name]


def _settings(profile: MappingNode, reading: _Recording, *, coded: bool) -> Iterator[tuple[str, Setting]]:
    """Yield what a recorded profile states, as rosbag2 reads it."""
    for name, (key, value) in profile.entries.items():
        if name not in _POLICIES:
            reading.note("ROS905", f"{shown(name)} is no policy that rosbag2 is known to record", reading.place(key))
        elif not is_null(value):
            text = flow_text(value)
            if expected := _expected(name, value, coded=coded):
                beside = " beside a history that is one" if coded and name in _WORDS else ""
                message = f"{shown(name)} must be {expected}{beside}, found {described(value)}: {_CANNOT_READ}"
                reading.refuse_bag("ROS915", message, reading.place(value))
            elif name in _WORDS and not coded and text not in _WORDS[name]:
                message = f"rosbag2 takes {shown(name)} {described(value)} for `unknown`"
                advice = f"it reads {listed(f'`{word}`' for word in _WORDS[name][:-1])}"
                reading.note("ROS916", message, reading.place(value), advice)
                text = "unknown"
            # What was recorded is never edited.
            yield name, Setting(text, reading.place(value), derived=True)
    missing = [name for name in _REQUIRED if name not in profile.entries or is_null(profile.entries[name][1])]
    _, history = profile.entries.get(HISTORY.name, (None, None))
    if isinstance(history, ScalarNode) and history.text in {"keep_last", "1"} and DEPTH.name not in profile.entries:
        missing.append(DEPTH.name)
    if missing:
        names = listed((f"`{name}`" for name in missing), "and")
        reading.refuse_bag("ROS912", f"the recorded profile lacks {names}: {_CANNOT_READ}", reading.place(profile))


def _expected(name: str, value: Node, *, coded: bool) -> str:
    """Return what the value of a policy must be for rosbag2 to read it, empty where it is that."""
    if name in _DURATIONS:
        parts = (
            [value.entries.get(part, (None, None))[1] for part in ("sec", "nsec")]
            if isinstance(value, MappingNode)
            else []
        )
        right = bool(parts) and all(isinstance(part, ScalarNode) and _COUNT.fullmatch(part.text) for part in parts)
        return "" if right else "a map with whole numbers `sec` and `nsec`"
    if not isinstance(value, ScalarNode):
        return "one value"
    if name == AVOID_CONVENTIONS.name:
        return "" if as_flag(value) is not None else "true or false"
    if name == DEPTH.name or (coded and name in _WORDS):
        return "" if _INTEGER.fullmatch(value.text) else "a number"
    return ""


def _check_whole(total: Node | None, topics: list[_Topic], reading: _Recording) -> None:
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


def _say_unknown(topics: Sequence[_Topic], reading: _Recording) -> None:
    """Report the topics whose offered QoS is unknown."""
    unknown = [topic for topic in topics if not topic.profiles]
    if unknown:
        names = [f"`{topic.name}`" for topic in unknown[:_FEW]]
        if len(unknown) > _FEW:
            names.append(f"{len(unknown) - _FEW} more")
        message = f"what the publishers of {listed(names, 'and')} offered was not recorded"
        reading.note("ROS910", message, unknown[0].place)


def _played(topic: _Topic, reading: _Recording) -> Iterator[Endpoint]:
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
        settings |= {policy.name: first[policy.name] for policy in _OFFERED if policy.name in first}
        if "unknown" in (_value(policy, first) for policy in _COMPARED):
            # No endpoint can be created with it; rules report that only of settings that go to rclcpp as they are.
            stated = {**_DEFAULT_HISTORY, RAW_SETTINGS.name: "true"}
            settings |= {name: Setting(text, topic.place, derived=True) for name, text in stated.items()}
    yield _endpoint(topic, PLAYER, PUBLISHER, settings)


def _requested(topic: _Topic, reading: _Recording) -> Iterator[Endpoint]:  # noqa: ARG001 - the signature of all three
    """Yield the subscription of `ros2 bag record` (rosbag2, `Rosbag2QoS::adapt_request_to_offers`)."""
    settings = {
        policy.name: Setting(FROM_PUBLISHERS, topic.place, derived=True) for policy in (RELIABILITY, DURABILITY)
    }
    yield _endpoint(topic, RECORDER, SUBSCRIBER, settings)


def _published(topic: _Topic, reading: _Recording) -> Iterator[Endpoint]:  # noqa: ARG001
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
