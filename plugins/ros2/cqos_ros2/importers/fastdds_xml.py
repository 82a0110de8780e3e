"""Reads XML profiles of Fast DDS as what they are to ROS 2: values for what a node leaves to the middleware.

rmw_fastrtps begins with the profile named like the topic, else with the default profile, else with Fast DDS's own
defaults. Then it sets every policy that the node does not leave at system_default or unspecified; but a depth it only raises, so
the larger of both holds (qos.cpp, `fill_entity_qos_from_profile`, Foxy to Rolling). A profile replaces the one before it as a whole. The variable RMW_FASTRTPS_USE_QOS_FROM_XML does not change that: it only takes the memory policy and
the publication mode from the profile too (rmw_fastrtps: README, publisher.cpp, qos.cpp).
"""

from __future__ import annotations

import glob
from fnmatch import fnmatchcase
from typing import Final

from cqos_core.importers.source_reading import listed, shown
from cqos_core.model.settings import Place, Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Overlay, Role
from cqos_ros2.importers.configuration import RosFile
from cqos_ros2.importers.fastdds_profiles import MOST_OF_ONE, FastDdsProfile, read_fastdds_profiles
from cqos_ros2.importers.unmodelled_elements import lay_over_nodes
from cqos_ros2.policies import DEADLINE, PARTICIPANT_LEASE
from cqos_ros2.types import has_wildcard

# Policies of DDS to those of ROS 2, and what Fast DDS has where a profile says nothing; durability and reliability
# differ by side.
_POLICIES: Final = {
    "history": "history",
    "history.depth": "depth",
    "reliability": "reliability",
    "durability": "durability",
    "deadline": "deadline",
    "lifespan": "lifespan",
    "liveliness": "liveliness",
    "liveliness.lease_duration": "liveliness_lease_duration",
    "ownership": "ownership",
    "latency_budget": "latency_budget",
}
_DEFAULTS: Final = {
    "history": "keep_last",
    "depth": "1",
    "deadline": "infinite",
    "lifespan": "infinite",
    "liveliness": "automatic",
    "liveliness_lease_duration": "infinite",
    "ownership": "shared",
    "latency_budget": "0s",
}
_SIDES: Final[dict[Role, dict[str, str]]] = {
    PUBLISHER: {"reliability": "reliable", "durability": "transient_local"},
    SUBSCRIBER: {"reliability": "best_effort", "durability": "volatile"},
}
_LEFT_OPEN: Final = ("system_default", "unspecified", "default")
_PARTITION: Final = "partition"
# What decides no match, by the start of its path (Fast DDS 2.14, XML profiles and EDP::valid_matching; but Cyclone DDS drops a reader
# that expects inline QoS, and at a maximum of matched ends Fast DDS refuses further ones). rmw_fastrtps sets data
# representation and user data itself; what concerns addresses belongs to discovery, which no rule judges.
_NO_EFFECT: Final = tuple(
    f"{path}/"
    for path in (
        *("topic/kind", "topic/name", "topic/dataType", "qos/liveliness/announcement_period", "qos/publishMode"),
        *(
            "qos/durabilityService",
            "qos/destinationOrder",
            "qos/presentation",
            "qos/timeBasedFilter",
            "qos/data_sharing",
        ),
        *("qos/userData", "qos/topicData", "qos/groupData", "qos/representation", "qos/typeConsistency"),
        *("qos/disable_heartbeat_piggyback", "qos/disableHeartbeatPiggyback", "times", "historyMemoryPolicy"),
        *(
            "propertiesPolicy",
            "userDefinedID",
            "entityID",
        ),
        *(
            f"matched{ends}sAllocation/{each}"
            for ends in ("Subscriber", "Publisher")
            for each in ("initial", "increment")
        ),
        *(
            "throughputController",
            "unicastLocatorList",
            "multicastLocatorList",
            "remoteLocatorList",
        ),
        *("external_unicast_locators", "ignore_non_matching_locators"),
    )
)
_ONLY_WITH: Final = ("rmw", "fastdds")
# The topics of services: what a server and a client read and write.
_SERVICES: Final[dict[str, dict[Role, str]]] = {
    "service": {SUBSCRIBER: "rq/*Request", PUBLISHER: "rr/*Reply"},
    "client": {PUBLISHER: "rq/*Request", SUBSCRIBER: "rr/*Reply"},
}
_FULL: Final = ("/", "rq/", "rr/")
_ANY: Final = "*"


class _Profiles(RosFile):
    """Reads profiles as overlays that hold with Fast DDS."""

    def run(self) -> None:
        """Make an overlay of every profile that is looked up."""
        found, participant = read_fastdds_profiles(self.source)
        parts = lay_over_nodes(self.system, participant.deciding, "fastdds")
        if (lease := participant.lease) is not None:
            setting = lease if lease.unknown else Setting(_shown(lease.text), lease.place, derived=True)
            name = "Fast DDS default profile of participants"
            laid = Overlay(name, {PARTICIPANT_LEASE.name: setting}, protocol="ros2", when=_ONLY_WITH, place=lease.place)
            self.system.overlays.append(laid)
        for profile in found:
            _report_unused(profile, self)
            _set_partition(profile, self)
            _report_limit(profile, self)
        ordered = [(_topic(profile), profile) for profile in found]
        # A later one wins: the default, then those of services as such, then those of single topics.
        ordered.sort(key=lambda pair: (pair[0] != _ANY, _ANY not in pair[0]))
        for topic, profile in ordered:
            below = [before for pattern, before in ordered if before is not profile and _under(topic, profile, pattern)]
            settings = _replacing(profile, below)
            if topic and settings:
                self.system.overlays.append(_overlay(profile, topic, settings))
        if self.system.overlays:
            place = Place(self.source.name, 1, 1)
            message = (
                "these profiles take effect with Fast DDS only, and only where a node leaves a policy to the middleware"
            )
            self.note("ROS962", message, place, "state `--option ros2.rmw=fastdds` if it is in use")
        limits = (each.place for profile in found for name, each in profile.settings.items() if "limits" in name)
        unread = {path: place for profile in reversed(found) for path, place in profile.unread.items()}
        if limited := next(filter(None, limits), None):
            unread["topic/resourceLimitsQos"] = limited
        unread |= {path: place for path, place, _ in participant.deciding}
        if unread:
            paths = sorted(unread)
            message = f"elements that ROS 2 has no policy for: {listed(map(shown, paths), 'and')}"
            self.note("ROS960", message, min(unread.values(), key=lambda place: place.line or 0), unread=parts)


def _topic(profile: FastDdsProfile) -> str:
    """Return the pattern of a profile's topics, or an empty text."""
    if profile.is_default:
        return _ANY
    if profile.name in _SERVICES:
        return _SERVICES[profile.name][profile.role]
    return glob.escape(profile.name) if profile.name.startswith(_FULL) else ""


def _under(topic: str, profile: FastDdsProfile, pattern: str) -> bool:
    """Whether a profile takes the place of another one, whose topics are those of ``pattern``."""
    return topic != _ANY and (pattern in {_ANY, topic} or fnmatchcase(profile.name, pattern))


def _report_unused(profile: FastDdsProfile, reading: RosFile) -> None:
    """Report a profile that is never used."""
    if not _topic(profile):
        message = f"ROS 2 never looks up the profile {shown(profile.name)}, which is no full topic name"
        reading.note("ROS961", message, profile.place, f"name it `/{profile.name}` if it is for that topic")


def _set_partition(profile: FastDdsProfile, reading: RosFile) -> None:
    """Make the partition of a profile what is known of it; report what may keep endpoints apart and is not known.

    Publisher and subscriber of DDS have the partitions, and rmw_fastrtps makes one of each for a context, from the default profile
    (participant.cpp). Before Galactic it took a partition from the profile of the topic; later it did not (rmw_fastrtps #542).
    """
    partition = profile.settings.get(_PARTITION)
    open_ended = next((path for path in profile.unread if not f"{path}/".startswith(_NO_EFFECT)), None)
    if open_ended is not None:
        place = profile.unread[open_ended]
        cause = f"the profile {shown(profile.name)} sets `{open_ended}`, which may prevent a match and is not judged"
        advice = "leave it out, or see that both sides of the topic match"
    elif partition is None or partition.text == "[]":
        profile.settings.pop(_PARTITION, None)
        return
    elif profile.is_default:
        place, advice = partition.place or profile.place, "name the partitions without wildcards"
        if not has_wildcard(partition.text[1:]):
            return
        cause = f"how the partitions {partition.text} are compared differs between versions"
    else:
        place, advice = partition.place or profile.place, "set partitions in the default profile only"
        cause = (
            f"the profile {shown(profile.name)} sets `partition`, which most versions of rmw_fastrtps take "
            "from the default profile only"
        )
    profile.settings[_PARTITION] = Setting("", place, unknown=cause)
    reading.note("ROS963", cause, place, advice)


def _report_limit(profile: FastDdsProfile, reading: RosFile) -> None:
    """Report a queue that is longer than what a profile lets Fast DDS keep of one instance; a limit of 0 is none."""
    depth, most = (profile.settings.get(name) for name in ("history.depth", MOST_OF_ONE))
    if depth is None or most is None or depth.unknown or most.unknown or not 0 < int(most.text) < int(depth.text):
        return
    message = (
        f"the profile {shown(profile.name)} asks for a depth of {depth.text}, and `max_samples_per_instance` is {most.text}: "
        "Fast DDS logs a warning and keeps no more of an instance"
    )
    reading.note("ROS964", message, depth.place or profile.place, f"set `max_samples_per_instance` to {depth.text}")


def _replacing(profile: FastDdsProfile, below: list[FastDdsProfile]) -> Settings:
    """Return what a profile sets, and Fast DDS's default for what it does not set but one that it replaces does."""
    defaults = {**_DEFAULTS, **_SIDES[profile.role]}
    settings = {
        _POLICIES[name]: Setting(defaults[_POLICIES[name]], profile.place, derived=True)
        for other in below
        if other.role == profile.role
        for name in other.settings
        if name in _POLICIES
    }
    own = {_POLICIES[name]: setting for name, setting in profile.settings.items() if name in _POLICIES}
    if _PARTITION in profile.settings:
        settings[_PARTITION] = profile.settings[_PARTITION]
    return settings | {
        name: setting if setting.unknown else Setting(_shown(setting.text), setting.place, derived=True)
        for name, setting in own.items()
    }


def _shown(text: str) -> str:
    """Write a value as people of ROS 2 do."""
    return DEADLINE.domain.format(DEADLINE.domain.parse(text)) if text.startswith("{") else text.lower()


def _overlay(profile: FastDdsProfile, topic: str, settings: Settings) -> Overlay:
    named = "default profile" if profile.is_default else f"profile `{profile.name}`"
    return Overlay(
        f"Fast DDS {named}",
        settings,
        profile.role,
        topic,
        protocol="ros2",
        when=_ONLY_WITH,
        fills=_LEFT_OPEN,
        place=profile.place,
    )


read = _Profiles.load
