"""Reads XML profiles of Fast DDS: what they set of each policy, in words of DDS, with places.

Nothing here knows of ROS 2. Policies have their names of the DDS standard, with dots where one has several fields;
values are texts as the profile writes them, durations in flow form (DDS 1.4; Fast DDS: XML profiles).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.importers.source_reading import listed, shown
from cqos_core.importers.xml_source import children, elements, local, parse_xml, text_of
from cqos_core.model.settings import Setting
from cqos_core.model.source import ReadContext
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.xml_importer import XmlImporter
from cqos_ros2.importers.unmodelled_elements import FAST_PARTICIPANT

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cqos_core.importers.xml_source import Element
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.source import Source
    from cqos_core.model.system import Role
    from cqos_core.packs.xml_importer import Effect

_ROLES: Final[dict[str, Role]] = {
    "data_writer": PUBLISHER,
    "publisher": PUBLISHER,
    "data_reader": SUBSCRIBER,
    "subscriber": SUBSCRIBER,
}
_INFINITE: Final = "infinite"
_INFINITE_WORDS: Final = frozenset(
    ("DURATION_INFINITY", "DURATION_INFINITE", "DURATION_INFINITE_SEC", "DURATION_INFINITE_NSEC", "INFINITE")
)
_TRUE: Final = frozenset(("true", "True", "TRUE", "1"))
_LARGEST: Final = 2**32
MOST_OF_ONE: Final = "resource_limits.max_samples_per_instance"

_VARIABLE: Final = re.compile(r"\$\{([A-Za-z_]\w*)\}")
_SUFFIX: Final = "_QOS"
_PARTS: Final = {"sec": "sec", "seconds": "sec", "nanosec": "nanosec"}


@dataclass(slots=True)
class FastDdsProfile:
    """One profile of a data writer or data reader.

    Attributes:
        role: whose values it has.
        name: empty where it has none.
        is_default: it is taken where no profile is asked for by name.
        settings: by the names of DDS: ``reliability``, ``liveliness.lease_duration``.
        place: where its start tag ends.
        unread: paths of its elements without a policy of DDS that is known here, each with its first place.
    """

    role: Role
    name: str
    is_default: bool
    settings: Settings
    place: Place
    unread: dict[str, Place] = field(default_factory=dict)


class ParticipantProfile(NamedTuple):
    """The default profile of participants; rmw_fastrtps takes no other.

    Attributes:
        lease: that it states.
        deciding: paths of elements without a policy that may decide, each with its place and what it may decide.
    """

    lease: Setting | None = None
    deciding: Sequence[tuple[str, Place, Effect]] = ()


def read_fastdds_profiles(source: Source) -> tuple[list[FastDdsProfile], ParticipantProfile]:
    """Read all profiles of data writers and data readers in an XML file, in its order, and the default one of participants.

    Raises:
        InputError: it is no XML, holds no profiles, or a value that Fast DDS refuses; with every problem found.
    """
    root = parse_xml(source)
    reader = _Reader(source, ReadContext())
    if local(root) not in {"dds", "profiles"}:
        message = f"this is no file of Fast DDS profiles: its first element is {shown(local(root))}"
        reader.problem("CQ001", message, root, "expected `dds` or `profiles`")
    lists = [root] if local(root) == "profiles" else children(root, "profiles")
    every = [each for profiles in lists for each in elements(profiles)]
    found = [reader.profile(each) for each in every if local(each) in _ROLES]
    defaults = [
        each
        for each in every
        if local(each) == "participant" and (each.get("is_default_profile") or "").strip() in _TRUE
    ]
    leases = [lease for each in defaults if (lease := reader.lease(each)) is not None]
    deciding = [
        (f"participant/{path}", reader.place(element), effect)
        for each in defaults
        for path, element, effect in FAST_PARTICIPANT.undecided(each, "")
    ]
    reader.finish()
    return found, ParticipantProfile(leases[0] if leases else None, deciding)


class _Reader(XmlImporter):
    """Reads the profiles of one file, collecting problems."""

    def profile(self, element: Element) -> FastDdsProfile:
        """Read one profile."""
        place = self.place(element)
        name = element.get("profile_name", "")
        if not name:
            self.problem("CQ010", f"a {local(element)} profile needs a `profile_name`", element)
        default = (element.get("is_default_profile") or "").strip() in _TRUE
        profile = FastDdsProfile(_ROLES[local(element)], name, default, {}, place)
        self.unread = profile.unread
        self.policies(element, "", profile.settings)
        return profile

    def lease(self, participant: Element) -> Setting | None:
        """Return the lease that a profile of participants states."""
        inner = [participant]
        for tag in ("rtps", "builtin", "discovery_config", "leaseDuration"):
            inner = [child for each in inner for child in children(each, tag)]
        if not inner:
            return None
        whole = "".join(inner[-1].itertext()).strip()
        if variable := _VARIABLE.search(whole):
            return Setting(whole, self.place(inner[-1]), unknown=f"variable `{variable[1]}` is not set")
        written = self.duration(inner[-1], "leaseDuration")
        return None if written is None else Setting(written, self.place(inner[-1]))

    def policies(self, above: Element, path: str, settings: Settings) -> None:
        """Read the policies below an element; what is none is remembered."""
        for element in elements(above):
            inner = f"{path}/{local(element)}".lstrip("/")
            field = _FIELDS.get(inner)
            whole = "".join(element.itertext()).strip()
            if inner in _WAYS and (field is None or not self.is_duration(element)):
                self.policies(element, inner, settings)
            elif inner in _MAXIMA and whole == "0":
                continue  # no maximum, which is the default
            elif field is None:
                self.unread.setdefault(inner, self.place(element))
            elif inner not in _WAYS and (variable := _VARIABLE.search(whole)):
                cause = f"variable `{variable[1]}` is not set"
                settings[field.policy] = Setting(whole, self.place(element), unknown=cause)
            else:
                written = self.duration(element, field.policy) if field.take is None else field.take(element)
                if written is not None:
                    settings[field.policy] = Setting(written, self.place(element))
                elif field.take is not None:
                    self.refused(element, field.policy, text_of(element), field.expected)

    def refused(self, element: Element, policy: str, text: str, expected: str) -> None:
        """Report a value with which Fast DDS refuses the file."""
        message = f"`{policy}` cannot be {shown(text) if text else 'empty'}, so Fast DDS refuses the file"
        self.problem("CQ011", message, element, f"expected {expected}")

    def is_duration(self, element: Element) -> bool:
        """Whether an element is a duration itself, rather than what holds one."""
        inner = {local(child) for child in elements(element)}
        return bool(inner & set(_PARTS)) or (not inner and bool(text_of(element)))

    def duration(self, element: Element, policy: str) -> str | None:
        """Read seconds and nanoseconds, each perhaps infinite, or a word for infinite."""
        fields: dict[str, str] = {}
        for part in elements(element):
            if local(part) not in _PARTS:
                self.unread.setdefault(f"{local(element)}/{local(part)}", self.place(part))
            elif text_of(part) in _INFINITE_WORDS:
                fields["sec"] = _INFINITE
            elif _number(text_of(part)) is None:
                self.refused(part, f"{policy}.{local(part)}", text_of(part), "a whole number or DURATION_INFINITY")
            elif fields.get("sec") != _INFINITE:
                fields[_PARTS[local(part)]] = text_of(part)
        word = text_of(element)
        if word in _INFINITE_WORDS or fields.get("sec") == _INFINITE:
            return _INFINITE
        if word:
            self.refused(element, policy, word, "<sec> and <nanosec>, or DURATION_INFINITY")
            return None
        return f"{{sec: {fields.get('sec', '0')}, nanosec: {fields.get('nanosec', '0')}}}" if fields else None


def _number(text: str) -> int | None:
    """The number that a text of digits is."""
    digits = text.isascii() and text.isdigit() and len(text) <= len(str(_LARGEST))
    return int(text) if digits and int(text) < _LARGEST else None


class _Field(NamedTuple):
    """An element that holds a policy.

    Attributes:
        take: returns the value, None where Fast DDS refuses it; a duration without it.
    """

    policy: str
    take: Callable[[Element], str | None] | None = None
    expected: str = ""


def _kind(policy: str, *words: str) -> _Field:
    def take(element: Element) -> str | None:
        word = text_of(element).removesuffix(_SUFFIX).removesuffix(f"_{policy.upper()}")
        return word if word in words else None

    return _Field(policy, take, listed(words))


def _count(element: Element) -> str | None:
    return None if _number(text_of(element)) is None else text_of(element)


def _limit(element: Element) -> str | None:
    """A count, where a negative number is no limit."""
    text = text_of(element)
    return text if _number(text.removeprefix("-")) is not None else None


def _names(element: Element) -> str:
    return f"[{', '.join(text_of(name) for name in elements(element))}]"


# Which element holds which policy, by its path below the profile.
_FIELDS: Final = {
    "topic/historyQos/kind": _kind("history", "KEEP_LAST", "KEEP_ALL"),
    "qos/reliability/kind": _kind("reliability", "BEST_EFFORT", "RELIABLE"),
    "qos/durability/kind": _kind("durability", "VOLATILE", "TRANSIENT_LOCAL", "TRANSIENT", "PERSISTENT"),
    "qos/liveliness/kind": _kind("liveliness", "AUTOMATIC", "MANUAL_BY_PARTICIPANT", "MANUAL_BY_TOPIC"),
    "qos/ownership/kind": _kind("ownership", "SHARED", "EXCLUSIVE"),
    "topic/historyQos/depth": _Field("history.depth", _count, "a whole number"),
    **{
        f"topic/resourceLimitsQos/{name}": _Field(f"resource_limits.{name}", _limit, "a whole number")
        for name in ("max_samples", "max_instances", "max_samples_per_instance", "allocated_samples")
    },
    "qos/ownershipStrength/value": _Field("ownership_strength", _count, "a whole number"),
    "qos/deadline/period": _Field("deadline"),
    "qos/deadline": _Field("deadline"),
    "qos/lifespan/duration": _Field("lifespan"),
    "qos/lifespan": _Field("lifespan"),
    "qos/liveliness/lease_duration": _Field("liveliness.lease_duration"),
    "qos/latencyBudget/duration": _Field("latency_budget"),
    "qos/partition/names": _Field("partition", _names),
}
_MATCHED: Final = frozenset(("matchedSubscribersAllocation", "matchedPublishersAllocation"))
_MAXIMA: Final = frozenset(f"{each}/maximum" for each in _MATCHED)
_WAYS: Final = {path.rpartition("/")[0] for path in _FIELDS} | {"qos", "topic"} | _MATCHED
