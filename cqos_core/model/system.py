"""Systems of participants, endpoints, topics and bridges, as importers make them; settings are still text.

Everything here is a plain value. Importers fill it, `Resolver` reads it, no other part changes it. Every stated thing keeps its
`Place`, so that a finding can point at the line.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Final, Literal

from cqos_core.model.dataclass import dataclass
from cqos_core.model.settings import Immutable, Place, Setting, Settings, SettingTexts
from cqos_core.model.wildcards import fits

if TYPE_CHECKING:
    from cqos_core.model.chains import Chain, StatedLink
    from cqos_core.model.flow import ControlFlow

__all__ = [
    "EVERYBODY",
    "MESSAGE",
    "NAMED",
    "PUBLISHER",
    "SUBSCRIBER",
    "Acceptance",
    "Bound",
    "Bridge",
    "Broker",
    "Endpoint",
    "ImportNote",
    "Overlay",
    "Participant",
    "Profile",
    "ProfileRef",
    "Role",
    "Room",
    "Route",
    "Scope",
    "System",
    "TeamRule",
    "Topic",
    "endpoint_id",
    "numbered",
]

Role = Literal["publisher", "subscriber"]
PUBLISHER: Role = "publisher"
SUBSCRIBER: Role = "subscriber"
MESSAGE: Final = "message"
"""The kind of an endpoint that is one of a topic, and no end of a service or an action."""


@dataclass(frozen=True, slots=True)
class Room(Immutable):
    """A place in a file where further settings can be added by the inserter of its format.

    Attributes:
        place: what the inserter is given.
        policies: names of those that may be set there; empty: all.
        restated: the inserter also replaces what is stated there already, and is given values in the words of system files.
    """

    place: Place
    policies: tuple[str, ...] = ()
    restated: bool = False

    def takes(self, policy: str) -> bool:
        """Whether a policy may be set there."""
        return not self.policies or policy in self.policies


@dataclass(frozen=True, slots=True)
class Scope(Immutable):
    """The endpoints that take a named profile, and the part that they take.

    Attributes:
        role: endpoints of this role only; None: of both.
        topic: shell pattern over the name of the topic.
        but: patterns of topics whose endpoints take another profile instead.
        part: which part of an endpoint's settings it is for, in the words of its format (``publisher_qos``). Whatever
            is named for another part, anywhere below a name that is taken for one, is passed over.
    """

    role: Role | None = None
    topic: str = "*"
    but: tuple[str, ...] = ()
    part: str | None = None

    @property
    def by_topic(self) -> bool:
        """Whether the name of the topic matters."""
        return self.topic != "*" or bool(self.but)

    def covers(self, role: str, topic: str, part: str | None = None) -> bool:
        """Whether an endpoint takes the profile, when it looks for values of ``part``, or of all its parts."""
        return (
            self.role in {None, role}
            and (part is None or self.part in {None, part})
            and (self.topic == "*" or fits(topic, self.topic))
            and not any(fits(topic, pattern) for pattern in self.but)
        )


EVERYBODY: Final = Scope()


@dataclass(frozen=True, slots=True)
class ProfileRef(Immutable):
    """A reference to a profile or preset by name, with its place and scope."""

    name: str
    place: Place | None = None
    scope: Scope = EVERYBODY


@dataclass(slots=True)
class Profile:
    """A named bundle of settings stated in the input; `base` profiles come first, nearer values win.

    Attributes:
        protocol: that of the file, where files of several protocols are one system; None: that of the system.
    """

    name: str
    settings: Settings
    base: tuple[ProfileRef, ...] = ()
    place: Place | None = None
    room: Room | None = None
    protocol: str | None = None


@dataclass(slots=True)
class Topic:
    """Facts that a file states about a topic.

    Attributes:
        name: as written.
        settings: topic facts as text: ``type``, ``keyed``, ``period``, ``size`` and what else a pack declares for topics.
        external: participants outside this system publish or subscribe here, so a missing partner is no finding.
        protocol: limits the entry to one protocol; None means any.
    """

    name: str
    settings: Settings = field(default_factory=dict)
    external: bool = False
    protocol: str | None = None
    place: Place | None = None


def endpoint_id(participant: str, part: str, topic: str) -> str:
    """Return ``participant/part/topic``, the id of an endpoint that states none; ``part`` is a role or a kind."""
    return f"{participant}/{part}/{topic.removeprefix('/')}"


def numbered(name: str, numbers: dict[str, int]) -> str:
    """Return ``name`` the first time, then ``name#2``, ``name#3``; ``numbers`` counts."""
    number = numbers[name] = numbers.get(name, 0) + 1
    return name if number == 1 else f"{name}#{number}"


@dataclass(slots=True, kw_only=True)
class Endpoint:
    """One publisher or subscriber.

    Attributes:
        id: unique in its source: the given one, the BPMN element id, or ``participant/role/topic[#n]``.
        role: ``publisher`` or ``subscriber``.
        topic: the topic name or filter as written; None where the input names none (reported, never paired).
        participant: id of its participant in ``System.participants``.
        settings: explicit settings.
        profiles: profiles and presets used, base first; explicit settings win over all of them.
        overlay: settings laid over everything else, stated beside the endpoint; see also `Overlay`.
        needs: the requirements of the application, in the words of `cqos_core.packs.guarantee`.
        type: data type name as written, or None when unstated.
        kind: ``message``, or what a pack derives topics from: ``service_server``, ``action_client``, …
        dialect: which of the pack's dialects reads the settings: ``yaml``, ``bpmn``, …
        observed: reported by a running system or a recording rather than stated by people.
        external: a missing partner is no finding.
        topic_is_guess: the topic's name is a guess (an event name, say), worth saying when nothing meets it.
        starts_after: ids of endpoints or participants that are up before this one.
        template: the id before ``instances:`` were multiplied out; findings stay grouped by it.
        alternative: one endpoint of its template is there, so one without a partner is no finding while another has one.
        protocol: overrides the participant's.
        label: a person's name for the endpoint (the BPMN event's name), for messages.
        room: where its file has room for further settings.
    """

    id: str
    role: Role
    topic: str | None
    participant: str
    settings: Settings = field(default_factory=dict)
    profiles: tuple[ProfileRef, ...] = ()
    overlay: Settings = field(default_factory=dict)
    needs: Settings = field(default_factory=dict)
    type: str | None = None
    kind: str = "message"
    dialect: str = "yaml"
    observed: bool = False
    external: bool = False
    topic_is_guess: bool = False
    starts_after: tuple[str, ...] = ()
    template: str | None = None
    alternative: bool = False
    protocol: str | None = None
    label: str | None = None
    place: Place | None = None
    room: Room | None = None

    def setting_texts(self) -> SettingTexts:
        """Return its settings and its overlay without places; equal for endpoints that state the same."""
        return (
            tuple([(name, each.text, each.unknown, each.derived) for name, each in self.settings.items()]),
            tuple([(name, each.text, each.unknown) for name, each in self.overlay.items()]),
        )


@dataclass(frozen=True, slots=True)
class Overlay:
    """Settings from another file that are laid over everything an endpoint states itself.

    Attributes:
        name: what messages call it: ``qos_overrides``, ``Fast DDS profile scan_writer``.
        settings: what it sets.
        role: which endpoints it covers; None for both.
        topic: shell pattern over the resolved topic name.
        participant: pattern over the participant's address or id, as the pack reads it (see `cqos_core.packs.TopicMatching`).
        entity: id of the one endpoint among several of its kind that it covers; None: all of them.
        protocol: pack id.
        when: option and value under which it holds, for instance ``("rmw", "fastdds")``; None: always.
        fills: words that it gives a meaning to. It then takes the place only of values that are stated as one of them
            (``system_default``), or as a zero that stands for one, or of smaller ones of a policy that may be raised; empty: of
            every value.
        dialect: which of the pack's dialects reads the settings.
        advice: what to write where it covers no endpoint; empty: the general advice.
    """

    name: str
    settings: Settings
    role: Role | None = None
    topic: str = "*"
    participant: str = "*"
    entity: str | None = None
    protocol: str | None = None
    when: tuple[str, str] | None = None
    fills: tuple[str, ...] = ()
    dialect: str = "yaml"
    place: Place | None = None
    room: Room | None = None
    advice: str = ""


@dataclass(slots=True)
class Participant:
    """A ROS node, DDS participant, MQTT client or BPMN pool.

    Attributes:
        id: unique in the system.
        protocol: pack id, or None for the system's.
        settings: connection fields and options that a pack declares (``rmw``, ``domain``), by the name they were written with.
        remap: topic renames, from → to, as written.
        starts_after: ids of participants that are up before this one.
        room: as that of endpoints.
        groups: words under which it groups endpoints (``publishers``), of those in `RulePack.groups`, each with its place.
        lost: settings of its endpoints that stand where nothing reads them, as not known, by policy or under `EVERY_OTHER`.
    """

    id: str
    protocol: str | None = None
    settings: Settings = field(default_factory=dict)
    remap: dict[str, str] = field(default_factory=dict)
    external: bool = False
    starts_after: tuple[str, ...] = ()
    template: str | None = None
    label: str | None = None
    place: Place | None = None
    room: Room | None = None
    groups: dict[str, Place] = field(default_factory=dict)
    lost: tuple[tuple[str, Setting], ...] = field(default=(), compare=False)


@dataclass(slots=True)
class Broker:
    """An intermediary that participants connect to, with its capabilities as text settings.

    Attributes:
        addresses: how files that are read together with its own may name it, as ``host:port``; ``localhost`` stands for every
            name of the same machine, ``*`` for any host.
    """

    id: str
    protocol: str | None = None
    settings: Settings = field(default_factory=dict)
    profiles: tuple[ProfileRef, ...] = ()
    place: Place | None = None
    addresses: tuple[str, ...] = ()
    room: Room | None = None


@dataclass(frozen=True, slots=True)
class Route:
    """One route of a bridge: a subscription, and the publication that it becomes.

    Both ends are endpoints of participants of the system, whose ids may be empty. Where the topic of ``source`` has a
    ``*``, there is such a way for every topic that matches, and the ``*`` in the topic of ``target`` stands for the same.
    With servers as ``source`` and clients as ``target`` it carries calls, and replies back. A target without a topic has that of the source.

    Attributes:
        only: regular expressions; one has to match the whole name that a ``*`` of the source stands in for; none:
            every name is carried.
        but: those of names that are not carried.
    """

    source: Endpoint
    target: Endpoint
    place: Place | None = None
    only: tuple[str, ...] = ()
    but: tuple[str, ...] = ()


@dataclass(slots=True)
class Bridge:
    """Subscribes on one side and publishes on the other, perhaps in another protocol.

    Attributes:
        id, routes: unique in the system; what it carries.
        carries: what else it carries on beside samples: ``liveliness``, where it ends its publications with their source;
            ``own``, where what it publishes on one side comes back to it there.
    """

    id: str
    routes: tuple[Route, ...] = ()
    carries: tuple[str, ...] = ()
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Bound:
    """A demand of a team rule on one policy: ``exactly``, ``at_least``, ``at_most``, ``one_of`` or ``not``."""

    policy: str
    relation: Literal["exactly", "at_least", "at_most", "one_of", "not"]
    values: tuple[str, ...]
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class TeamRule:
    """One entry of ``checks:``: where it applies, what it requires, and why.

    ``where`` maps ``role``, ``topic``, ``participant``, ``protocol``, ``type`` or ``id`` to a shell pattern.
    ``sentence`` is the text form of a full sentence, for what bounds cannot say.
    """

    name: str
    where: tuple[tuple[str, str], ...]
    require: tuple[Bound, ...]
    because: str
    sentence: str | None = None
    severity: Literal["error", "warning", "note"] = "error"
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Acceptance:
    """One entry of ``accept:``: a known exception. ``until`` is an ISO date after which it no longer holds."""

    rule: str
    because: str
    topic: str | None = None
    endpoint: str | None = None
    until: str | None = None
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Part:
    """A part of an input that was recognised and not read, although it may decide a verdict.

    Attributes:
        kind: a noun: ``node``, ``include``, ``section``.
        name: its name, or a description.
        cause: why it was not read.
        place: where it stands.
        endpoints: how many endpoints it has at least that are not in the system; 0 where it decides about those that are.
    """

    kind: str
    name: str = ""
    cause: str = ""
    place: Place | None = None
    endpoints: int = 1


@dataclass(frozen=True, slots=True)
class ImportNote:
    """A remark of an importer that is no reason to stop: a skipped part, a guess, a trap.

    Attributes:
        parts: those of the input that it says are not read although they may decide. A note needs none whose code is about such a
            part (`CodeInfo.leaves_out`): it stands for one.
        total: how many parts of the kind of the first one the input has, read or not, where that is known.
    """

    code: str
    severity: Literal["error", "warning", "note"]
    message: str
    place: Place | None = None
    help: str | None = None
    endpoint: str | None = None
    parts: tuple[Part, ...] = ()
    total: int = 0


@dataclass(slots=True)
class System:
    """Everything one check looks at.

    Attributes:
        name: for the report.
        protocol: default protocol of participants, or None.
        options: option settings by pack id: ``{"ros2": {"rmw": Setting("cyclonedds")}}``.
        severities: rule code or name to ``error``, ``warning``, ``note`` or ``off``.
        sources: the files read, in order, with their bytes, from which formatters cut excerpts.
        flows: the control flow of each file that draws any; made when it is first read.
        processes: the processes of `flows` that no pool shows, by name, as participants: those that call them, in any file, run them.
        partial: it is a part of a system, so an endpoint without partner is no reason for a warning.
        hypothetical: its endpoints were made to try profiles that none uses, so its pairs set no verdict.
        assumed: values of options that an importer took because nothing states the option, by its name with the pack.
    """

    name: str = ""
    protocol: str | None = None
    options: dict[str, Settings] = field(default_factory=dict)
    profiles: dict[str, Profile] = field(default_factory=dict)
    topics: dict[str, Topic] = field(default_factory=dict)
    participants: dict[str, Participant] = field(default_factory=dict)
    endpoints: list[Endpoint] = field(default_factory=list)
    overlays: list[Overlay] = field(default_factory=list)
    brokers: dict[str, Broker] = field(default_factory=dict)
    bridges: dict[str, Bridge] = field(default_factory=dict)
    checks: list[TeamRule] = field(default_factory=list)
    accept: list[Acceptance] = field(default_factory=list)
    severities: dict[str, str] = field(default_factory=dict)
    notes: list[ImportNote] = field(default_factory=list)
    sources: dict[str, bytes] = field(default_factory=dict)
    flows: tuple[ControlFlow, ...] = ()
    processes: dict[str, Participant] = field(default_factory=dict, compare=False)
    chains: dict[str, Chain] = field(default_factory=dict)
    links: dict[str, StatedLink] = field(default_factory=dict)
    partial: bool = False
    hypothetical: bool = False
    assumed: dict[str, tuple[str, ...]] = field(default_factory=dict, compare=False)


NAMED: Final = {
    "participants": "id",
    "profiles": "name",
    "topics": "name",
    "brokers": "id",
    "bridges": "id",
    "chains": "name",
    "links": "name",
}
"""The entries of a system that have a name, and the attribute with the name."""
