"""Reads a node file: from bytes to facts by executable and by fragment, or every problem with its place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

from cqos_core.importers.source_reading import SourceReading, did_you_mean, listed, shown
from cqos_core.model.problems import InputError
from cqos_core.packs import normalise
from cqos_core.packs.document_importer import only_document
from cqos_ros2.policies import DISTRO
from cqos_ros2.presets import PRESETS
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.corrections import corrected

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.importers.document_form import Entry, Member
    from cqos_core.model.settings import Place
    from cqos_core.model.source import Source

T = TypeVar("T")
ENDING: Final = ".node.yaml"
POLICIES: Final = (
    "history",
    "depth",
    "reliability",
    "durability",
    "deadline",
    "lifespan",
    "liveliness",
    "liveliness_lease_duration",
)
_DISTROS: Final = tuple(DISTRO.domain.format(each) for each in DISTRO.domain.candidates())


@dataclass(frozen=True, slots=True)
class NodeFile:
    """What one node file states.

    Attributes:
        name: the path of the file.
        versions: of the package that was read, by distribution; empty: the facts hold for every distribution.
        profiles: the alternatives of each profile, by its name.
        nodes: facts by executable.
        fragments: facts by name of a fragment or class of a plugin.
        sources: the folder with the sources that it was learned from; empty: its own lines are the places of what it states.
    """

    name: str
    package: str
    versions: dict[str, str] = field(default_factory=dict)
    profiles: dict[str, Entry] = field(default_factory=dict)
    nodes: dict[str, Entry] = field(default_factory=dict)
    fragments: dict[str, Entry] = field(default_factory=dict)
    sources: str = ""


def read_node_file(source: Source) -> NodeFile:
    """Return what a node file states.

    Raises:
        InputError: it is no node file; with every problem.
    """
    reading = SourceReading(source, [], [])
    root = only_document(reading)
    entry = None if root is None else form.DOCUMENT.read(root, reading, "node file")
    if entry is None or reading.problems:
        raise InputError(reading.problems)
    found = NodeFile(
        source.name,
        entry.require(form.PACKAGE),
        _values(entry.get(form.VERSIONS)),
        _values(entry.get(form.PROFILES)),
        corrected(entry, form.NODES, reading),
        corrected(entry, form.FRAGMENTS, reading),
    )
    _check(found, entry, reading)
    if reading.problems:
        raise InputError(reading.problems)
    return found


def _values(members: dict[str, Member[T]] | None) -> dict[str, T]:
    return {name: each.value for name, each in (members or {}).items()}


def _check(found: NodeFile, entry: Entry, reading: SourceReading) -> None:
    """Report names that stand for nothing: distributions, profiles, policies."""
    for name, member in (entry.get(form.VERSIONS) or {}).items():
        _distribution(name, member.place, reading)
    for name, profile in found.profiles.items():
        _qos(profile, found, reading, name)
    for part in (*found.nodes.values(), *found.fragments.values()):
        for key in (form.PLUGINS, form.USES, form.INSIDE, form.UNREAD):
            for each in part.get(key) or ():
                _condition(each, reading)
        for endpoint in endpoints(part):
            _condition(endpoint.entry, reading)
            for each in endpoint.entry.get(form.QOS) or ():
                _qos(each, found, reading)


class Written(NamedTuple):
    """An endpoint as a node file writes it.

    Attributes:
        direction: ``publishes``, ``subscribes``, ``serves``, …
        name: as in the code, with holes.
    """

    direction: str
    name: str
    place: Place
    entry: Entry


def endpoints(part: Entry) -> Iterator[Written]:
    """Yield the endpoints of a node or a fragment."""
    for direction, key in form.DIRECTIONS.items():
        for name, member in (part.get(key) or {}).items():
            for each in member.value:
                yield Written(direction, name, member.place, each)


def _qos(entry: Entry, found: NodeFile, reading: SourceReading, own: str = "") -> None:
    _condition(entry, reading)
    name = entry.get(form.PROFILE)
    known = [*(each for each in found.profiles if each != own), *PRESETS]
    if name is not None and name not in known:
        message = f"there is no profile {shown(name)}{did_you_mean(name, known)}"
        reading.problem("CQ011", message, entry.place, f"there are {listed(sorted(known), 'and')}")
    for policy, setting in entry.settings.items():
        if policy not in POLICIES:
            message = f"there is no policy {shown(policy)}{did_you_mean(policy, POLICIES)}"
            reading.problem("CQ006", message, setting.place or entry.place, f"allowed: {', '.join(POLICIES)}")


def _condition(entry: Entry, reading: SourceReading) -> None:
    for test in entry.get(form.WHEN) or ():
        if test.subject == form.DISTRO:
            for each in test.values:
                _distribution(each, test.place, reading)


def _distribution(name: str, place: Place, reading: SourceReading) -> None:
    if normalise(name) not in _DISTROS:
        message = f"there is no ROS 2 distribution {shown(name)}{did_you_mean(name, _DISTROS)}"
        reading.problem("CQ011", message, place, f"allowed: {', '.join(_DISTROS)}")


def distributions(files: Iterable[NodeFile]) -> tuple[str, ...]:
    """Return the distributions that any of some files is for, in their order."""
    named = {name for each in files for name in each.versions}
    return tuple(each for each in _DISTROS if each in named)
