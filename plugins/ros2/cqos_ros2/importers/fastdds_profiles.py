"""Reads XML profiles of Fast DDS: what they set of each policy, in words of DDS, with places.

Nothing here knows of ROS 2. Policies have their names of the DDS standard, with dots where one has several fields;
values are texts as the profile writes them, durations in flow form (DDS 1.4; Fast DDS: XML profiles).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from lxml import etree

from cqos_core.importers.reading import collect, listed, shown
from cqos_core.importers.xml_source import parse_xml
from cqos_core.model.excerpt import exact
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Place, Setting

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.source import Source
    from cqos_core.importers.xml_source import Element
    from cqos_core.model.system import Role, Settings

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

# Which element holds which policy: its path below the profile to the policy's name, and what its text may be.
_KINDS: Final = {
    "topic/historyQos/kind": ("history", ("KEEP_LAST", "KEEP_ALL")),
    "qos/reliability/kind": ("reliability", ("BEST_EFFORT", "RELIABLE")),
    "qos/durability/kind": ("durability", ("VOLATILE", "TRANSIENT_LOCAL", "TRANSIENT", "PERSISTENT")),
    "qos/liveliness/kind": ("liveliness", ("AUTOMATIC", "MANUAL_BY_PARTICIPANT", "MANUAL_BY_TOPIC")),
    "qos/ownership/kind": ("ownership", ("SHARED", "EXCLUSIVE")),
}
_COUNTS: Final = {"topic/historyQos/depth": "history.depth", "qos/ownershipStrength/value": "ownership_strength"}
_DURATIONS: Final = {
    "qos/deadline/period": "deadline",
    "qos/deadline": "deadline",
    "qos/lifespan/duration": "lifespan",
    "qos/lifespan": "lifespan",
    "qos/liveliness/lease_duration": "liveliness.lease_duration",
    "qos/latencyBudget/duration": "latency_budget",
}
_NAMES: Final = {"qos/partition/names": "partition"}
_POLICIES: Final = {*_KINDS, *_COUNTS, *_DURATIONS, *_NAMES}
_WAYS: Final = {path.rpartition("/")[0] for path in _POLICIES} | {"qos", "topic"}
_POLICY_AT: Final = {**{path: name for path, (name, _) in _KINDS.items()}, **_COUNTS, **_DURATIONS, **_NAMES}
_VARIABLE: Final = re.compile(r"\$\{([A-Za-z_]\w*)\}")
_SUFFIX: Final = "_QOS"
_FIELDS: Final = {"sec": "sec", "seconds": "sec", "nanosec": "nanosec"}


@dataclass(slots=True)
class FastDdsProfile:
    """One profile of a data writer or data reader.

    Attributes:
        role: whose values it has.
        name: empty where it has none.
        is_default: it is taken where no profile is asked for by name.
        settings: by the names of DDS: ``reliability``, ``liveliness.lease_duration``.
        place: where its start tag ends.
    """

    role: Role
    name: str
    is_default: bool
    settings: Settings
    place: Place


@dataclass(slots=True)
class FastDdsProfiles:
    """What an XML file says about writers and readers.

    Attributes:
        profiles: in the order of the file.
        unread: paths of elements without a policy of DDS that is known here, each with its first place.
    """

    profiles: list[FastDdsProfile] = field(default_factory=list)
    unread: dict[str, Place] = field(default_factory=dict)


def read_fastdds_profiles(source: Source) -> FastDdsProfiles:
    """Read all profiles of data writers and data readers in an XML file.

    Raises:
        InputError: it is no XML, holds no profiles, or a value that Fast DDS refuses; with every problem found.
    """
    root = parse_xml(source)
    reader = _Reader(source)
    if _local(root) not in {"dds", "profiles"}:
        message = f"this is no file of Fast DDS profiles: its first element is {shown(_local(root))}"
        reader.problem("CQ001", message, root, "expected `dds` or `profiles`")
    for profiles in [root] if _local(root) == "profiles" else _children(root, "profiles"):
        for element in _elements(profiles):
            if _local(element) in _ROLES:
                reader.found.profiles.append(reader.profile(element))
    if reader.problems:
        raise InputError(reader.located())
    return reader.found


class _Reader:
    """Reads the profiles of one file, collecting problems."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.found = FastDdsProfiles()
        self.problems: list[Problem] = []

    def located(self) -> list[Problem]:
        """Return the problems with their columns, for which the source is read again."""
        places = [problem.place for problem in self.problems if problem.place is not None]
        known = exact(places, {self.source.name: self.source.data})
        return [replace(each, place=known[each.place] if each.place is not None else None) for each in self.problems]

    def place(self, element: Element) -> Place:
        """Where an element is; its name tells it from others on the line when the column is looked for."""
        line = element.sourceline
        return Place(self.source.name, int(line) if line else 1, path=f"{_written(element)}[1]")

    def problem(self, code: str, message: str, where: Element, advice: str | None = None) -> None:
        """Collect a problem."""
        collect(self.problems, Problem(code, message, self.place(where), advice))

    def profile(self, element: Element) -> FastDdsProfile:
        """Read one profile."""
        place = self.place(element)
        name = element.get("profile_name", "")
        if not name:
            self.problem("CQ010", f"a {_local(element)} profile needs a `profile_name`", element)
        default = (element.get("is_default_profile") or "").strip() in _TRUE
        profile = FastDdsProfile(_ROLES[_local(element)], name, default, {}, place)
        self.policies(element, "", profile.settings)
        return profile

    def policies(self, above: Element, path: str, settings: Settings) -> None:
        """Read the policies below an element; what is none is remembered."""
        for element in _elements(above):
            inner = f"{path}/{_local(element)}".lstrip("/")
            policy = _POLICY_AT.get(inner)
            written = "".join(element.itertext()).strip()
            if policy is not None and inner not in _WAYS and (variable := _VARIABLE.search(written)):
                cause = f"variable `{variable[1]}` is not set"
                settings[policy] = Setting(written, self.place(element), unknown=cause)
            elif inner in _DURATIONS and (inner not in _WAYS or self.is_duration(element)):
                self.duration(element, _DURATIONS[inner], settings)
            elif inner in _WAYS:
                self.policies(element, inner, settings)
            elif inner in _KINDS:
                self.kind(element, *_KINDS[inner], settings)
            elif inner in _COUNTS:
                self.count(element, _COUNTS[inner], settings)
            elif inner in _NAMES:
                names = [_text(name) for name in _elements(element)]
                settings[_NAMES[inner]] = Setting(f"[{', '.join(names)}]", self.place(element))
            else:
                self.found.unread.setdefault(inner, self.place(element))

    def kind(self, element: Element, policy: str, words: tuple[str, ...], settings: Settings) -> None:
        """Read a policy of a few values; older files write them with `_QOS` and the policy's name."""
        text = _text(element)
        word = text.removesuffix(_SUFFIX).removesuffix(f"_{policy.upper()}")
        if word in words:
            settings[policy] = Setting(word, self.place(element))
        else:
            self.refused(element, policy, text, listed(words))

    def count(self, element: Element, policy: str, settings: Settings) -> None:
        """Read a whole number."""
        text = _text(element)
        if _number(text) is None:
            self.refused(element, policy, text, "a whole number")
        else:
            settings[policy] = Setting(text, self.place(element))

    def refused(self, element: Element, policy: str, text: str, expected: str) -> None:
        """Tell a value with which Fast DDS refuses the file."""
        message = f"`{policy}` cannot be {shown(text) if text else 'empty'}, so Fast DDS refuses the file"
        self.problem("CQ011", message, element, f"expected {expected}")

    def is_duration(self, element: Element) -> bool:
        """Whether an element is a duration itself, rather than what holds one."""
        inner = {_local(child) for child in _elements(element)}
        return bool(inner & set(_FIELDS)) or (not inner and bool(_text(element)))

    def duration(self, element: Element, policy: str, settings: Settings) -> None:
        """Read seconds and nanoseconds, each perhaps infinite, or a word for infinite."""
        fields: dict[str, str] = {}
        for part in _elements(element):
            if _local(part) not in _FIELDS:
                self.found.unread.setdefault(f"{_local(element)}/{_local(part)}", self.place(part))
            elif _text(part) in _INFINITE_WORDS:
                fields["sec"] = _INFINITE
            elif _number(_text(part)) is None:
                self.refused(part, f"{policy}.{_local(part)}", _text(part), "a whole number or DURATION_INFINITY")
            elif fields.get("sec") != _INFINITE:
                fields[_FIELDS[_local(part)]] = _text(part)
        word = _text(element)
        if word in _INFINITE_WORDS or fields.get("sec") == _INFINITE:
            settings[policy] = Setting(_INFINITE, self.place(element))
        elif word:
            self.refused(element, policy, word, "<sec> and <nanosec>, or DURATION_INFINITY")
        elif fields:
            text = f"{{sec: {fields.get('sec', '0')}, nanosec: {fields.get('nanosec', '0')}}}"
            settings[policy] = Setting(text, self.place(element))


def _number(text: str) -> int | None:
    """The number that a text of digits is."""
    digits = text.isascii() and text.isdigit() and len(text) <= len(str(_LARGEST))
    return int(text) if digits and int(text) < _LARGEST else None


def _elements(above: Element) -> Iterator[Element]:
    """Yield the elements directly below one."""
    return (child for child in above if isinstance(child.tag, str))


def _children(above: Element, name: str) -> list[Element]:
    return [child for child in _elements(above) if _local(child) == name]


def _local(element: Element) -> str:
    """The name of an element without its namespace."""
    return etree.QName(element).localname


def _written(element: Element) -> str:
    """The name of an element as the file writes it."""
    return f"{element.prefix}:{_local(element)}" if element.prefix else _local(element)


def _text(element: Element) -> str:
    return (element.text or "").strip()
