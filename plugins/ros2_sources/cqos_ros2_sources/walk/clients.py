"""Clients of brokers in programs: their connections and endpoints as rows of tables say, and the system that they make."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.files.folder_walk import SkippedFolder, shortened, walk
from cqos_core.files.ignore_patterns import GENERATED_FOLDERS
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, System, endpoint_id, numbered
from cqos_ros2_sources.programs.packages import Package, read_cpp, read_python
from cqos_ros2_sources.programs.program import Program
from cqos_ros2_sources.unread.unreached_code import made_alone, missed
from cqos_ros2_sources.walk.calls import invoke
from cqos_ros2_sources.walk.frames import Frame
from cqos_ros2_sources.walk.package_walk import Exploration, Explored
from cqos_ros2_sources.walk.statements import run
from cqos_ros2_sources.walk.values import Code, NodeRecord
from cqos_ros2_workspace.launch.values import Unknown
from cqos_ros2_workspace.launch.workspace import Workspace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.settings import Settings
    from cqos_ros2_sources.programs.program import Function
    from cqos_ros2_sources.walk.call_tables import Table
    from cqos_ros2_sources.walk.frames import Walk

MOST_FILES: Final = 2_000
_ROLES: Final = {"publishes": PUBLISHER, "subscribes": SUBSCRIBER}
_LONGEST: Final = 200


@dataclass(frozen=True, slots=True)
class LearnedClients:
    """What was learned of the clients in a folder.

    Attributes:
        gaps: what is not known, its cause, where.
    """

    system: System
    gaps: list[tuple[str, str, str]] = field(default_factory=list)


def learn_clients(folder: str, tables: dict[str, Table], protocol: str) -> LearnedClients:
    """Return the clients of one protocol that the programs in a folder are.

    Raises:
        NoParserError: there are sources in C++, and the parser of C++ is not installed.
    """
    workspace = Workspace(os.path.realpath(folder))
    found = LearnedClients(System(name=Path(workspace.root).name, protocol=protocol, partial=True))
    names: dict[str, int] = {}
    for language, table in tables.items():
        skipped: list[SkippedFolder] = []
        paths = [path for path in _sources(workspace.root, skipped) if path.endswith(table.lists["files"])][:MOST_FILES]
        for each in skipped:
            gap = ("what a folder holds", each.cause, shortened(os.path.relpath(each.path, workspace.root)))
            if gap not in found.gaps:
                found.gaps.append(gap)
        for key, program, own, starts in _programs(language, paths, workspace, table, found):
            package = Package(key, workspace.root, {language: program}, own=own)
            exploration = Exploration(package, program, table, Explored())
            walk = exploration.walk(key, lambda walk, starts=starts: _start(walk, starts))  # type: ignore[misc]
            walk = _rest(exploration, walk, own)
            for record in walk.nodes:
                if record.protocol == protocol and (record.made or record.settings):
                    _participant(numbered(key, names), record, found, workspace.root)
            for what, cause, place in exploration.result.gaps:
                found.gaps.append((what, cause, _at(place, workspace.root)))
    return found


def _sources(root: str, skipped: list[SkippedFolder]) -> Iterator[str]:
    for folder, inner, names in walk(root, skipped):
        inner[:] = sorted(each for each in inner if not each.startswith(".") and each not in GENERATED_FOLDERS)
        for name in sorted(names):
            path = os.path.join(folder, name)  # noqa: PTH118
            if not os.path.islink(path):  # noqa: PTH114
                yield path


def _programs(
    language: str, paths: list[str], workspace: Workspace, table: Table, found: LearnedClients
) -> Iterator[tuple[str, Program, set[str], list[Function]]]:
    """Yield each program: its name, what its files define, its own files, and where it begins."""
    telling = [last.encode() for last, rows in table.calls.items() if any(row.protocol for row in rows)]
    telling += [
        name.rpartition(":")[2].rpartition(".")[2].encode() for name, row in table.nodes.items() if row.protocol
    ]
    texts = {path: workspace.read(path, Place(path)) for path in paths}
    if not any(isinstance(text, bytes) and any(each in text for each in telling) for text in texts.values()):
        return
    parts: dict[str, Program] = {}
    for path in paths:
        part = parts[path] = Program(language)
        if language == "cpp":
            read_cpp([path], workspace, part)
        else:
            read_python([path], "", workspace, part, os.path.relpath(path, workspace.root))
        found.gaps.extend(("what a file creates", cause, _at(place, workspace.root)) for cause, place in part.gaps)
    begins = {path: _begins(path, part, table) for path, part in parts.items()}
    for path, starts in begins.items():
        if not starts:
            continue
        program = Program(language)
        for other, part in parts.items():
            if other == path or language == "python" or not begins[other]:
                program.add(part)
        key = Path(path).stem
        yield (Path(path).parent.name if key == "main" else key), program, {path}, starts


def _begins(path: str, part: Program, table: Table) -> list[Function]:
    if part.language == "python":
        return [each for each in part.scripts.values() if each.place.source == path]
    return [
        function
        for name in table.lists["starts"]
        for function in part.functions.get(name, [])
        if not function.owner or "::" not in function.name
    ]


def _start(walk: Walk, starts: list[Function]) -> None:
    for function in starts:
        if walk.program.language == "python":
            frame = Frame(function, None, names={"__name__": "__main__"})
            walk.modules[function.name.rpartition(".")[0]] = frame.names
            walk.frames.append(frame)
            run(function.body, walk)
            walk.frames.pop()
        elif id(function) not in walk.executed:
            invoke(function, None, [Unknown("the command line") for _ in function.parameters], {}, walk)
    _handled(walk)


def _handled(walk: Walk) -> None:
    """Walk what clients call when something happens; they are its first argument."""
    for client in [*walk.instances]:
        for name in walk.table.lists["handlers"] if client.node is not None else ():
            code = client.members.get(name)
            if isinstance(code, Code) and id(code.function) not in walk.executed:
                rest = [Unknown("what a handler is given") for _ in code.function.parameters[1:]]
                invoke(code.function, code.this, [client, *rest], {}, walk, value=code)


def _rest(exploration: Exploration, walk: Walk, own: set[str]) -> Walk:
    """Walk the functions of a file that nothing called and that make endpoints: a framework may call them."""
    from cqos_ros2_sources.walk.frames import TooMuchError

    functions = {id(function): function for function, place in missed(exploration) if place.source in own}
    try:
        for function in functions.values():
            if id(function) in walk.executed:
                continue
            this = None
            if function.owner:
                same = [each for each in walk.instances if each.cls is not None and each.cls.name == function.owner]
                this = same[0] if len(same) == 1 else made_alone(function.owner, walk)
            if id(function) not in walk.executed:
                invoke(function, this, [Unknown("what it is given") for _ in function.parameters], {}, walk)
            _handled(walk)
    except (TooMuchError, RecursionError):
        cause = "it takes more steps than C-QoS follows"
        exploration.result.gaps.append(("all that comes later", cause, Place(next(iter(own), ""))))
    known = {(each[2].source, each[2].line) for each in exploration.result.gaps}
    for place in walk.homeless:
        if (place.source, place.line) not in known:
            exploration.result.gaps.append(("what it creates", "its client is not known", place))
    exploration.made_at |= walk.made_at
    for function, place in missed(exploration):
        if place.source in own:
            cause = "what it is called on is not followed"
            exploration.result.gaps.append((f"what `{function.last}` creates", cause, place))
    return walk


# The system


def _participant(name: str, record: NodeRecord, found: LearnedClients, root: str) -> None:
    place = _shown(record.place, root)
    system = found.system
    settings: Settings = {}
    groups: dict[str, dict[str, Any]] = {}
    for key, value in sorted({**record.parameters, **record.settings}.items()):
        group, _, inner = key.rpartition(".")
        if group:
            groups.setdefault(group, {})[inner] = value
        else:
            settings[key] = setting(value)
    for group, values in groups.items():
        cause = next((each.cause for each in values.values() if isinstance(each, Unknown)), "")
        stated = ", ".join(f"{key}: {setting(value).text}" for key, value in values.items())
        settings[group] = Setting("", unknown=cause[:_LONGEST]) if cause else Setting(f"{{{stated}}}")
    system.participants[name] = Participant(name, settings=settings, place=place)
    numbers: dict[str, int] = {}
    seen: list[tuple[Any, ...]] = []
    for made in record.made:
        values = {key: setting(value) for key, value in made.qos.settings}
        said = (made.direction, made.name, [(key, each.text, each.unknown) for key, each in values.items()])
        if said in seen:
            continue
        seen.append(said)
        at = _shown(made.place, root)
        if not isinstance(made.name, str):
            cause = made.name.cause if isinstance(made.name, Unknown) else "it is no text that is known"
            found.gaps.append((f"what `{name}` {made.direction}", cause, str(at)))
            continue
        role = _ROLES[made.direction]
        identity = numbered(endpoint_id(name, role, made.name), numbers)
        system.endpoints.append(
            Endpoint(id=identity, role=role, topic=made.name, participant=name, settings=values, place=at)
        )


def setting(value: Any) -> Setting:
    """Return a value as a setting of a system file."""
    if isinstance(value, Unknown):
        return Setting("", unknown=value.cause[:_LONGEST])
    if isinstance(value, bool):
        return Setting("true" if value else "false")
    if isinstance(value, (str, int, float)):
        return Setting(str(value))
    return Setting("", unknown="its value is not followed")


def _shown(place: Place, root: str) -> Place:
    return Place(os.path.relpath(place.source, root), place.line, place.column)


def _at(place: Place, root: str) -> str:
    return str(_shown(place, root))
