"""What the files say about one topic, from any input: systems, snapshots, recordings, logs and workspaces."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cqos_core.analysis.explanation import endpoints_of
from cqos_core.checking.checker import check_system
from cqos_core.files.opening import read_path
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.logs import misfits
from cqos_ros2.importers.topic_info import type_hashes
from cqos_ros2.launch.workspace import find_packages
from cqos_ros2.logs import read_line
from cqos_ros2.types import full_type_name
from cqos_ros2.why.causes import MIDDLEWARE_FILES, Evidence, Switched
from cqos_ros2.why.definitions import Definitions
from cqos_ros2.why.interfaces import interfaces_of
from cqos_ros2.why.security import access
from cqos_ros2.workspace.importer import ARGUMENT, IMPORTER, LAUNCH, joined

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from cqos_core.cli.reading import InputReader
    from cqos_core.model.system import System
    from cqos_core.packs.logs import Occurrence
    from cqos_core.resolving.resolved import Resolved
    from cqos_ros2.launch.values import Unknown
    from cqos_ros2.why.definitions import Defined
    from cqos_ros2.workspace.joining import Join


_FLIPPED: Final = {"true": "false", "false": "true"}
_MOST_ARGUMENTS: Final = 8
"""So many arguments are tried with the other value, each by reading the launch once more."""


def evidence(
    topic: str, system: System, reader: InputReader, paths: Sequence[str], log: str | None, keystore: str | None = None
) -> Evidence:
    """Return what was read about a topic.

    Raises:
        InputError: the log or a file of the keystore cannot be read.
    """
    full = topic if topic.startswith("/") else f"/{topic}"
    resolved = [each for each in endpoints_of(system, reader.context) if each.pack.id == "ros2"]
    sides = {role: [each for each in resolved if each.role == role] for role in (PUBLISHER, SUBSCRIBER)}
    join = _join(reader, paths)
    given = {each.name: each.value for each in reader.options.variables}
    environment = given
    if join is not None:
        stated = {name: value for name, value in join.launched.variables.items() if isinstance(value, str)}
        environment = {**stated, **given}
    ends: dict[str, list[Resolved]] = {
        role: [each for each in side if each.key == full] for role, side in sides.items()
    }
    missing = [role for role, side in ends.items() if not side]
    return Evidence(
        full,
        system,
        check_system(system, reader.context),
        ends,
        {role: list(dict.fromkeys(each.key for each in side if each.key)) for role, side in sides.items()},
        environment,
        _said(log, full),
        join,
        None if keystore is None else access(Path(keystore), full),
        {
            name: _interfaces(environment[name], given=name in given)
            for name in MIDDLEWARE_FILES
            if environment.get(name)
        },
        [] if join is None else list(_switched(reader, paths, join, full, missing)),
        _hashes(system, ends),
        _defined(paths, {full_type_name(each.endpoint.type or "") for side in ends.values() for each in side}),
    )


def _hashes(system: System, ends: Mapping[str, Sequence[Resolved]]) -> dict[str, str]:
    """Return the hashes of types that `ros2 topic info` printed for endpoints."""
    printed: dict[str, dict[int, str]] = {}
    found = {}
    for each in (end for side in ends.values() for end in side if end.endpoint.dialect == "topic_info"):
        place = each.endpoint.place
        if place is not None and place.source in system.sources:
            if place.source not in printed:
                printed[place.source] = type_hashes(Source(place.source, system.sources[place.source]))
            if digest := printed[place.source].get(place.line or 0):
                found[each.id] = digest
    return found


def _defined(paths: Sequence[str], types: Collection[str]) -> dict[str, Defined | Unknown]:
    """Return what the message files of the workspace among paths say of types."""
    folder = next((each for each in paths if Path(each).is_dir()), None)
    if folder is None:
        return {}
    definitions = Definitions(find_packages(folder))
    return {each: definitions.find(each) for each in types if each}


def _switched(
    reader: InputReader, paths: Sequence[str], join: Join, topic: str, missing: Collection[str]
) -> Iterator[Switched]:
    """Yield the launch arguments whose other value starts a missing side of a topic."""
    folder = next(each for each in paths if Path(each).is_dir())
    flags = {name: str(each.value).lower() for name, each in join.launched.arguments.items()}
    tried = [(name, _FLIPPED[value]) for name, value in flags.items() if value in _FLIPPED]
    for name, value in tried[:_MOST_ARGUMENTS] if missing else ():
        mine = reader.switches.get(IMPORTER, {})
        arguments = "\n".join(filter(None, (mine.get(ARGUMENT, ""), f"{name}:={value}")))
        try:
            other = joined(folder, {**reader.switches, IMPORTER: {**mine, ARGUMENT: arguments}})
        except InputError:
            continue
        for each in other.system.endpoints:
            if each.topic == topic and each.role in missing:
                yield Switched(name, value, each.participant or "", each.role)


def _interfaces(text: str, *, given: bool) -> list[str] | None:
    """Return the interfaces that a configuration names; None where it is not read, as a file that only a launch file names."""
    if not given and not text.lstrip().startswith("<"):
        return None
    try:
        return interfaces_of(text)
    except InputError:
        return None


def _join(reader: InputReader, paths: Sequence[str]) -> Join | None:
    """Return the join of the workspace among paths; None without one."""
    folder = next((each for each in paths if Path(each).is_dir()), None)
    asked = LAUNCH in reader.switches.get(IMPORTER, {})
    return joined(folder, reader.switches) if asked and folder is not None else None


def _said(log: str | None, topic: str) -> list[Occurrence]:
    if log is None:
        return []
    found, _ = misfits(log, BytesIO(read_path(log).data), [read_line])
    return [each for each in found if each.misfit.topic in {topic, topic.lstrip("/")}]
