"""Reads the output of ``ros2 topic info --verbose``, from Foxy to Rolling: a snapshot of publishers and subscribers.

A file may hold many snapshots, with other terminal output around them. The command does not print the name of the
topic. It comes from the line above (see `topic_headings`), else from a switch, else from the file's name. A snapshot without
a name is a topic by itself. Policies that are not printed stay unknown.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from cqos_core.importers.source_reading import listed, read_switches, shown
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place, Setting
from cqos_core.model.source import ReadContext
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Part, Participant, endpoint_id
from cqos_ros2.importers.configuration import RosFile
from cqos_ros2.importers.topic_headings import full_name, heading, named_by_file, unnamed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.settings import Settings
    from cqos_core.model.source import Source
    from cqos_core.model.system import Role

_LINE: Final = re.compile(r"[ \t]*(?P<key>[A-Z][A-Za-z0-9 ()]{0,40}?)[ \t]*:[ \t]*(?P<value>[^\r\n]*)")
_POLICIES: Final = {
    "Reliability": "reliability",
    "History (Depth)": "history",
    "Durability": "durability",
    "Lifespan": "lifespan",
    "Deadline": "deadline",
    "Liveliness": "liveliness",
    "Liveliness lease duration": "liveliness_lease_duration",
}
_ALWAYS: Final = tuple(key for key in _POLICIES if key != "History (Depth)")  # Foxy and Galactic print no history
_HEX: Final = frozenset("0123456789abcdef")
_SHOWN: Final = 8
"""So many digits of a hash are shown."""
_FIELDS: Final = ("Node namespace", "Topic type", "Topic type hash", "Endpoint type", "GID", "QoS profile")
_SIDES: Final[dict[str, Role]] = {
    "Publisher count": PUBLISHER,
    "Subscription count": SUBSCRIBER,
    "Subscriber count": SUBSCRIBER,
}
_ROLES: Final[dict[str, Role]] = {"PUBLISHER": PUBLISHER, "SUBSCRIPTION": SUBSCRIBER}
_NO_NODE: Final = {"_CREATED_BY_BARE_DDS_APP_": "a DDS application", "_NODE_NAME_UNKNOWN_": "a node without a name"}
_UNNAMED: Final = "_NODE_NAME_UNKNOWN_"
_DEPTH: Final = re.compile(r"(?P<history>\S.*?)\s*\((?P<depth>\d+)\)")


def _topic(context: ReadContext) -> str | None:
    """Return the topic that the switch names."""
    switch = read_switches("topic_info", context, {"topic": ()}).get("topic")
    chosen = None if switch is None else full_name(switch)
    if switch is not None and chosen is None:
        message = f"the switch `topic_info.topic` is {shown(switch)}, which is no name of a topic"
        raise InputError([Problem("CQ047", message)])
    return chosen


@dataclass(slots=True)
class _Block:
    """What is printed about one endpoint.

    Attributes:
        side: of the count that stands above it.
        fields, policies: values by the words before them.
    """

    place: Place
    side: Role | None
    fields: Settings = field(default_factory=dict)
    policies: Settings = field(default_factory=dict)

    def text(self, key: str) -> str:
        """The value of a field, or an empty text."""
        return self.fields[key].text if key in self.fields else ""

    @property
    def digest(self) -> str:
        """The hash of the type (REP 2016); empty where none is printed."""
        digest = self.text("Topic type hash").removeprefix("RIHS01_")
        return digest if digest.strip("0") and set(digest) <= _HEX else ""


@dataclass(slots=True)
class _Snapshot:
    """What is printed about one topic.

    Attributes:
        place: where it begins.
        topic: its name, and where it stands.
        whole: it has a first line, so its other lines must follow.
        counts: stated number of endpoints of each side.
    """

    place: Place
    topic: Setting | None
    whole: bool = False
    guessed: bool = False
    counts: dict[Role, tuple[int, Place]] = field(default_factory=dict)
    blocks: list[_Block] = field(default_factory=list)


class _Scanner:
    """Finds snapshots line by line."""

    def __init__(self, reading: RosFile) -> None:
        self.reading = reading
        self.lines = Lines(decode(reading.source.data))
        self.snapshots: list[_Snapshot] = []
        self.snapshot: _Snapshot | None = None
        self.block: _Block | None = None
        self.side: Role | None = None
        self.topic: Setting | None = None
        self.in_list = False

    def run(self) -> list[_Snapshot]:
        """Return all snapshots in which something is counted or shown."""
        for number, line in enumerate(self.lines.text.split("\n"), 1):
            if line.strip():
                self.line(number, line)
            elif self.block is not None and self.block.policies:
                self.block = None
        return [each for each in self.snapshots if each.counts or each.blocks]

    def line(self, number: int, line: str) -> None:
        """Take in a line that is not blank."""
        found = _LINE.match(line)
        if found is not None and self.known(found["key"], found["value"].strip(), self.place(number, found, "value")):
            self.in_list = False
            return
        self.between(number, line)
        if found is not None and self.block is not None and self.block.policies:
            message = f"{shown(found['key'])} is no policy that `ros2 topic info` is known to print"
            self.reading.note("ROS905", message, self.place(number, found, "key"))

    def place(self, number: int, found: re.Match[str], group: str) -> Place:
        """Return where a part of a line stands."""
        return Place(self.reading.source.name, number, found.start(group) + 1)

    def known(self, key: str, text: str, place: Place) -> bool:
        """Take in a line that the command prints; False for any other."""
        value = Setting(text, place)
        if key == "Type":
            self.begin(place, whole=True)
        elif key in _SIDES and text.isdecimal():
            self.count(_SIDES[key], int(text[:9]), place)
        elif key == "Node name":
            snapshot = self.snapshot or self.begin(place)
            self.block = _Block(place, self.side, {key: value})
            snapshot.blocks.append(self.block)
        elif self.block is not None and key in _FIELDS:
            self.block.fields.setdefault(key, value)
        elif self.block is not None and key in _POLICIES:
            self.block.policies.setdefault(key, value)
        else:
            return False
        return True

    def begin(self, place: Place, *, whole: bool = False) -> _Snapshot:
        """Begin a snapshot of the topic that was named last."""
        self.snapshot = _Snapshot(place, self.topic, whole)
        self.snapshots.append(self.snapshot)
        self.block = self.side = self.topic = None
        return self.snapshot

    def count(self, side: Role, number: int, place: Place) -> None:
        """Take in the stated number of endpoints; they follow."""
        snapshot = self.snapshot
        if snapshot is None or side in snapshot.counts:
            snapshot = self.begin(place, whole=True)
        snapshot.counts[side] = (number, place)
        self.side, self.block = side, None

    def between(self, number: int, line: str) -> None:
        """Take in a line that is none of the command's: it may name the topic that comes next."""
        said = heading(line)
        if said is None:
            self.in_list = False
            return
        self.snapshot = self.block = None
        # Of topics that are listed one beneath the other, none is the one that comes next.
        listed_here = said.bare and self.in_list
        self.in_list = said.bare
        place = Place(self.reading.source.name, number, said.column)
        self.topic = None if said.name is None or listed_here else Setting(said.name, place)


def _name(snapshots: list[_Snapshot], switch: str | None, reading: RosFile) -> None:
    """Give a snapshot that has no topic the one of the switch, or of the file's name, if there is one only; else its own."""
    nameless = [snapshot for snapshot in snapshots if snapshot.topic is None]
    if switch is not None and len(nameless) == 1:
        nameless.pop().topic = Setting(switch)
    guess = named_by_file(reading.source.name)
    if guess is not None and nameless and len(snapshots) == 1:
        only = nameless.pop()
        only.topic, only.guessed = Setting(guess, only.place), True
        reading.note("ROS902", f"the snapshot is taken to be of `{guess}`, after the name of the file", only.place)
    for snapshot in nameless:
        advice = "to match it with other files, put its name above, as in `### /chatter`"
        if len(nameless) == 1:
            advice += ", or give `--switch topic_info.topic=/chatter`"
        message = "nothing says which topic this snapshot is of, so only its own endpoints are matched with each other"
        snapshot.topic, snapshot.guessed = Setting(unnamed(reading.source.name, snapshot.place.line or 1)), True
        reading.note("ROS901", message, snapshot.place, advice)


class _Writer(RosFile):
    """Reads a file of snapshots: makes their participants and endpoints."""

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, context)
        self.switch = _topic(context)
        self.seen: dict[tuple[object, ...], tuple[Endpoint, str]] = {}
        self.nameless = 0

    def run(self) -> None:
        """Add what all snapshots show to the system."""
        snapshots = _Scanner(self).run()
        if not snapshots:
            message = "nothing here is printed by `ros2 topic info --verbose`"
            self.problem("CQ001", message, Place(self.source.name, 1, 1))
        _name(snapshots, self.switch, self)
        for snapshot in snapshots:
            self.compare_counts(snapshot, Counter(self.observed(block, snapshot) for block in snapshot.blocks))
            self.compare_hashes(snapshot)
        by_id = Counter(endpoint.id for endpoint, _ in self.seen.values())
        numbers: Counter[str] = Counter()
        for endpoint, gid in self.seen.values():
            name = endpoint.id
            if by_id[name] > 1:
                numbers[name] += 1
                endpoint.id = f"{name}#{gid or numbers[name]}"
            self.system.endpoints.append(endpoint)

    def observed(self, block: _Block, snapshot: _Snapshot) -> Role | None:
        """Make an endpoint and its participant; return its role."""
        role = self.role(block)
        if role is None or snapshot.topic is None:
            return role
        if missing := [key for key in _ALWAYS if key not in block.policies]:
            self.note("ROS904", f"this endpoint lacks {listed(missing, 'and')}: the output is cut off", block.place)
        gid = _short(block.text("GID"))
        participant = self.owner(block, gid)
        topic = snapshot.topic.text
        endpoint = Endpoint(
            id=endpoint_id(participant, role, topic),
            role=role,
            topic=topic,
            participant=participant,
            settings=dict(_settings(block)),
            type=block.text("Topic type") or None,
            dialect="topic_info",
            observed=True,
            topic_is_guess=snapshot.guessed,
            place=block.place,
        )
        self.remember(endpoint, gid)
        return role

    def role(self, block: _Block) -> Role | None:
        """Return the role that a block states, else that of the count above it."""
        stated = block.fields.get("Endpoint type")
        if stated is None and block.side is not None:
            return block.side
        role = _ROLES.get(stated.text) if stated is not None else None
        if role is None:
            word = f"is {shown(stated.text)}" if stated is not None else "is missing: the output is cut off"
            message = f"`Endpoint type` {word}, it must be {listed(_ROLES)}"
            self.problem("CQ011", message, stated.place if stated and stated.place else block.place)
        return role

    def owner(self, block: _Block, gid: str) -> str:
        """Return the participant of a block: the node, else one named after the GID of the endpoint."""
        name = block.text("Node name") or _UNNAMED
        namespace = block.text("Node namespace")
        if name in _NO_NODE:
            if not gid:
                self.nameless += 1
            identifier = f"{name}@{gid or self.nameless}"
            label = f"{_NO_NODE[name]} ({gid or self.nameless})"
        else:
            identifier = label = name if namespace in _NO_NODE else f"{namespace.rstrip('/')}/{name}"
        self.system.participants.setdefault(identifier, Participant(identifier, label=label, place=block.place))
        return identifier

    def remember(self, endpoint: Endpoint, gid: str) -> None:
        """Keep an endpoint; one with the same GID is the same one, seen earlier."""
        key = (endpoint.id, gid or len(self.seen))
        earlier = self.seen.get(key)
        if earlier is not None and _said(earlier[0]) != _said(endpoint):
            message = f"`{endpoint.id}` has other values than at {earlier[0].place}; what was seen last holds"
            self.note("ROS906", message, endpoint.place or Place(self.source.name))
        self.seen[key] = (endpoint, gid)

    def compare_counts(self, snapshot: _Snapshot, roles: Counter[Role | None]) -> None:
        """Say where the snapshot counts other endpoints than it shows, or ends too early."""
        topic = snapshot.topic.text if snapshot.topic is not None else "this topic"
        for role, (count, place) in snapshot.counts.items():
            if count != roles[role]:
                message = f"{count} {role}s of `{topic}` are counted, {roles[role]} shown"
                advice = None if snapshot.blocks else "take the snapshot with `--verbose`"
                hidden = count - roles[role]
                unread = [Part("endpoint", f"{role} of {topic}", "it is counted and not shown", place, hidden)]
                self.note("ROS903", message, place, advice, unread if hidden > 0 else ())
        if snapshot.whole and SUBSCRIBER not in snapshot.counts:
            message = f"the snapshot of `{topic}` ends before its subscriptions: the output is cut off"
            self.note("ROS904", message, snapshot.place)

    def compare_hashes(self, snapshot: _Snapshot) -> None:
        """Report endpoints of one type with different definitions of it (REP 2016)."""
        found: dict[str, dict[str, _Block]] = {}
        for block in snapshot.blocks:
            if digest := block.digest:
                found.setdefault(block.text("Topic type"), {}).setdefault(digest, block)
        topic = snapshot.topic.text if snapshot.topic is not None else "this topic"
        for name, by_hash in found.items():
            if len(by_hash) > 1:
                sides = [f"`{each.text('Node name')}` with {digest[:_SHOWN]}…" for digest, each in by_hash.items()]
                message = f"endpoints of `{topic}` have different definitions of {name}: {listed(sides, 'and')}"
                last = [*by_hash.values()][-1]
                self.note("ROS907", message, last.place, "build both sides with the same message files")


def type_hashes(source: Source) -> dict[int, str]:
    """Return the hash of its type for each endpoint that a file shows, by the line of its place."""
    snapshots = _Scanner(RosFile(source, ReadContext())).run()
    return {block.place.line or 0: block.digest for each in snapshots for block in each.blocks if block.digest}


def _settings(block: _Block) -> Iterator[tuple[str, Setting]]:
    """Yield the settings that a block states; a depth is printed beside keep_last only."""
    for key, value in block.policies.items():
        found = _DEPTH.fullmatch(value.text) if key == "History (Depth)" else None
        if found is None:
            yield _POLICIES[key], value
            continue
        yield "history", Setting(found["history"], value.place)
        if "KEEP_LAST" in found["history"] and (place := value.place) is not None:
            column = (place.column or 1) + found.start("depth")
            yield "depth", Setting(found["depth"], replace(place, column=column))
    # The command looks for a topic by the name that ROS gives it on the wire.
    yield "avoid_ros_namespace_conventions", Setting("false", block.place)


def _said(endpoint: Endpoint) -> tuple[object, ...]:
    return endpoint.type, {name: setting.text for name, setting in endpoint.settings.items()}


def _short(gid: str) -> str:
    """Return a GID without the zeros that only fill it up."""
    return re.sub(r"(?:\.00)+$", "", gid)


read = _Writer.load
