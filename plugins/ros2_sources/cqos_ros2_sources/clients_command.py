"""``cqos learn`` of a folder without packages: a system file of the clients that its programs are."""

from __future__ import annotations

import os
from pathlib import Path

from cqos_core.cli.console import emit
from cqos_core.cli.file_output import replace_files, write_new_file
from cqos_core.cli.progress import Progress
from cqos_core.files.source_files import read_path
from cqos_core.files.yaml_writer import write
from cqos_core.model.finding import plural
from cqos_core.model.problems import InputError, Problem
from cqos_core.packs.export import ExportContext
from cqos_core.plugins import load_plugins
from cqos_ros2_sources.command import no_package, say_gaps
from cqos_ros2_sources.programs.packages import NoParserError
from cqos_ros2_sources.walk.call_tables import protocols, tables
from cqos_ros2_sources.walk.clients import LearnedClients, learn_clients

_ENDING = ".clients.yaml"
_HEAD = "# `cqos learn` wrote this file from the sources"


def learn_folder(path: str, output: str | None, calls: tuple[str, ...], *, check: bool) -> bool:
    """Write or check the system file of each protocol; return whether one differs from the sources.

    Raises:
        InputError: no client was found.
        MissingError: the parser of C++ is not installed.
    """
    differing = found = False
    for protocol in protocols():
        try:
            with Progress(f"learning {path}"):
                learned = learn_clients(path, tables(calls, protocol), protocol)
        except NoParserError:
            from cqos_core.model.optional_features import missing

            message = f"`{path[:120]}` has sources in C++, and their parser is not installed"
            raise missing("ros2_sources", message) from None
        if not learned.system.participants:
            say_gaps(path, learned.gaps)
            continue
        found = True
        differing |= _checked(path, learned) if check else _written(path, output, learned)
    if not found:
        raise InputError([no_package(path)])
    return differing


def _text(learned: LearnedClients) -> str:
    learned.system.sources = {}
    exported = write(learned.system, ExportContext(load_plugins().pack))
    unread = "".join(f"# Not known: {what}: {cause} ({at})\n" for what, cause, at in learned.gaps)
    return f"{_HEAD}, and `cqos learn --diff` compares it with them.\n{unread}{exported.text}"


def _target(path: str, learned: LearnedClients) -> str:
    return os.path.join(path, f"{learned.system.name}{_ENDING}")  # noqa: PTH118 - as people write it


def _written(path: str, output: str | None, learned: LearnedClients) -> bool:
    if output is not None:
        os.makedirs(output, exist_ok=True)  # noqa: PTH103
    target = _target(path if output is None else output, learned)
    text = _text(learned)
    if os.path.exists(target):  # noqa: PTH110
        before = read_path(target).data
        if not before.startswith(_HEAD.encode()):
            message = f"`{target}` was not written by `cqos learn`, so it is left as it is"
            raise InputError([Problem("CQ001", message, None, "name another folder with --output")])
        replace_files({target: text.encode()}, {target: before})
    else:
        write_new_file(target, text)
    clients, endpoints = len(learned.system.participants), len(learned.system.endpoints)
    emit(f"{target}: {plural(clients, 'client')}, {plural(endpoints, 'endpoint')}\n")
    say_gaps(path, learned.gaps)
    return False


def _checked(path: str, learned: LearnedClients) -> bool:
    target = _target(path, learned)
    if not Path(target).is_file():
        emit(f"{target}: there is no such system file; `cqos learn` writes it\n")
        return True
    before, now = _lines(Path(target).read_text(encoding="utf-8", errors="replace")), _lines(_text(learned))
    changed = [f"  - {each}\n" for each in before if each not in now] + [
        f"  + {each}\n" for each in now if each not in before
    ]
    if not changed and before == now:
        emit(f"{target}: as the sources say\n")
        return False
    emit(f"{target}: it differs from the sources\n" + "".join(changed))
    return True


def _lines(text: str) -> list[str]:
    return [each for each in text.splitlines() if not each.startswith("#")]
