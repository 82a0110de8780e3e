"""What the files say about one topic, from any input: systems, snapshots, recordings, logs and workspaces."""

from __future__ import annotations

import sys
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.analysis.explanation import endpoints_of
from cqos_core.checking.checker import check_system
from cqos_core.files.source_files import STDIN, STDIN_NAME, read_path, read_stream
from cqos_core.files.source_reader import with_own
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.log_mismatches import read_mismatches
from cqos_ros2.importers.topic_info import type_hashes
from cqos_ros2.logs import read_line
from cqos_ros2.types import full_type_name
from cqos_ros2_workspace.importer import ARGUMENT, IMPORTER, joined
from cqos_ros2_workspace.launch.launch_evaluation import launch
from cqos_ros2_workspace.launch.launch_output import assumptions
from cqos_ros2_workspace.launch.values import Unknown, shown
from cqos_ros2_workspace.launch.workspace import find_packages
from cqos_ros2_workspace.why.causes import MIDDLEWARE_FILES, Evidence, Switched
from cqos_ros2_workspace.why.definitions import Definitions
from cqos_ros2_workspace.why.interfaces import interfaces_of
from cqos_ros2_workspace.why.security import access

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from cqos_core.cli.input_reader import InputReader
    from cqos_core.model.system import System
    from cqos_core.packs.log_mismatches import Occurrence
    from cqos_core.resolving.resolved_endpoint import Resolved
    from cqos_ros2_workspace.launch.launch_result import Launched
    from cqos_ros2_workspace.system_join import Join
    from cqos_ros2_workspace.why.definitions import Defined


_MOST_ARGUMENTS: Final = 12
"""So many other values of arguments are tried, each by reading the launch once more."""


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
    join = _join(reader)
    ends: dict[str, list[Resolved]] = {
        role: [each for each in side if each.key == full] for role, side in sides.items()
    }
    given = {each.name: each.value for each in reader.options.variables}
    owners = {each.participant.participant.id for side in ends.values() for each in side}
    environment = given if join is None else _environment(join, given, owners)
    # Nothing arrives without a publisher, whatever subscriber a launch argument adds.
    missing = next((role for role, side in ends.items() if not side), None)
    switched, untried = ([], []) if join is None else _switched(reader, join, full, missing)
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
            name: _interfaces(environment[name], None if name in given else join)
            for name in MIDDLEWARE_FILES
            if environment.get(name)
        },
        switched,
        untried,
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


def _switched(reader: InputReader, join: Join, topic: str, missing: str | None) -> tuple[list[Switched], list[str]]:
    """Return the launch arguments that start the missing side of a topic with another value, and programs that were not tried."""
    found: list[Switched] = []
    if missing is None:
        return found, []
    folder, switches = _workspace(reader)
    mine = switches.get(IMPORTER, {})
    seen = _programs(join.launched)
    for name, value in islice(_other_values(join), _MOST_ARGUMENTS):
        arguments = "\n".join(filter(None, (mine.get(ARGUMENT, ""), f"{name}:={value}")))
        try:
            other = joined(folder, {**switches, IMPORTER: {**mine, ARGUMENT: arguments}})
        except InputError:
            continue
        seen |= _programs(other.launched)
        found += [
            Switched(name, value, each.participant or "", each.role)
            for each in other.system.endpoints
            if each.topic == topic and each.role == missing
        ]
    return found, sorted(_programs(_left_open(join, join.launched.arguments)) - seen)


def _programs(launched: Launched) -> set[str]:
    return {f"{shown(each.package)} {shown(each.executable)}" for each in launched.instances}


def _left_open(join: Join, names: Iterable[str]) -> Launched:
    """Return the launch with some arguments left open, so that all alternatives are there."""
    held = {name: each.value for name, each in join.launched.arguments.items() if isinstance(each.value, str)}
    unknown = {name: Unknown(f"`{name}` is left open", None, name) for name in names}
    given: dict[str, Any] = {**held, **unknown}
    return launch(join.workspace, join.launched.entry, given)


def _other_values(join: Join) -> Iterator[tuple[str, str]]:
    """Yield launch arguments, each with a value that it does not have and that the launch compares it with."""
    for name, each in join.launched.arguments.items():
        compared = assumptions(_left_open(join, [name])).get(name, [])
        values = {*compared, *(["false"] if "true" in compared else [])}
        yield from ((name, value) for value in sorted(values) if value != str(each.value).lower())


def _environment(join: Join, given: Mapping[str, str], owners: Collection[str]) -> dict[str, str]:
    """Return the variables that the launch or the caller states; those of nodes on the topic win."""
    own = [node.placed.instance.environment for node in join.nodes if node.placed.address in owners]
    sources = (join.launched.variables, given, *own)
    return {name: value for each in sources for name, value in each.items() if isinstance(value, str)}


def _interfaces(text: str, join: Join | None) -> list[str] | None:
    """Return the interfaces that a configuration names; None where it is not read.

    Args:
        text: XML, or the path of a file.
        join: of the launch file that names it, so that the file is looked up in the workspace; None: the caller names it.
    """
    if join is not None and not text.lstrip().startswith("<"):
        path = join.workspace.find(text.removeprefix("file://"), None)
        data = path if isinstance(path, Unknown) else join.workspace.read(path, None)
        if isinstance(data, Unknown):
            return None
        text = data.decode(errors="replace")
    try:
        return interfaces_of(text)
    except InputError:
        return None


def _workspace(reader: InputReader) -> tuple[str, Mapping[str, Mapping[str, str]]]:
    """Return the folder that is read as a workspace, empty without one, and the switches with which it is read."""
    given = next((each for each in reader.folders.values() if each.importer == IMPORTER), None)
    if given is None:
        return "", reader.switches
    return given.source.name, with_own(reader.switches, given.switches)


def _join(reader: InputReader) -> Join | None:
    """Return the join of the workspace; None without one."""
    folder, switches = _workspace(reader)
    return joined(folder, switches) if folder else None


def _said(log: str | None, topic: str) -> list[Occurrence]:
    if log is None:
        return []
    source = read_path(log) if log != STDIN else read_stream(STDIN_NAME, sys.stdin.buffer)
    found, _ = read_mismatches(source.name, BytesIO(source.data), [read_line])
    return [each for each in found if each.misfit.topic in {topic, topic.lstrip("/")}]
