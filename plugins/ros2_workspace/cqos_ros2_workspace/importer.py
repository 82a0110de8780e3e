"""Reads a workspace with `--launch`: what the launch file starts, as one system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.files.source_files import open_file
from cqos_core.importers.source_reading import did_you_mean, listed
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place
from cqos_core.model.source import OPTIONS, VARIABLES, no_files
from cqos_core.packs import normalise
from cqos_ros2_workspace.caller_paths import opened, spell
from cqos_ros2_workspace.findings import notes
from cqos_ros2_workspace.launch.entry_point import argument, entry_point
from cqos_ros2_workspace.launch.launch_evaluation import launch
from cqos_ros2_workspace.nodes.library import Library
from cqos_ros2_workspace.system_join import join

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.source import Opener, ReadContext, Source
    from cqos_core.model.system import System
    from cqos_ros2_workspace.launch.launch_result import Launched, Remark
    from cqos_ros2_workspace.launch.workspace import Workspace
    from cqos_ros2_workspace.system_join import Join

IMPORTER: Final = "workspace"
LAUNCH: Final = "launch"
ARGUMENT: Final = "launch_arg"
_UNREAD: Final = ("action", "file")
"""What remarks about a launch file are about that cannot be read."""
_MOST_PROBLEMS: Final = 20


def read(source: Source, context: ReadContext) -> System:
    """Return the system that the launch files start together.

    Raises:
        InputError: a launch file or an argument is not there, or a launch file or a node file of the workspace cannot be read.
    """
    # A workspace is a folder on disk, also for callers that open no files.
    found = joined(source.name, context.options, open_file if context.open is no_files else context.open)
    system = found.system
    system.notes += notes(found)
    spell(system, found.workspace.root, source.name)
    return system


def joined(folder: str, options: Mapping[str, Mapping[str, str]], opener: Opener = open_file) -> Join:
    """Return the join of the launch files that the switches of importers name.

    ``opener`` opens the files of the workspace.

    Raises:
        InputError: as `read`.
    """
    switches = options.get(IMPORTER, {})
    files = [each for each in switches.get(LAUNCH, "").split("\n") if each]
    given = dict(argument(each) for each in switches.get(ARGUMENT, "").split("\n") if each)
    if not files:
        message = "a workspace needs a launch file"
        raise InputError([Problem("CQ047", message, Place(folder), "name one with --launch FILE")])
    workspace, launched = _launched(files, folder, given, options.get(VARIABLES, {}), opener)
    unused = [name for name in given if name not in launched.arguments]
    if unused and launched.arguments:
        message = f"the launch declares no argument `{unused[0]}`{did_you_mean(unused[0], launched.arguments)}"
        raise InputError([Problem("CQ047", message, None, f"it declares {listed(sorted(launched.arguments), 'and')}")])
    library = Library(workspace)
    stated = options.get(OPTIONS, {})
    found = join(launched, workspace, library, normalise(stated.get("ros2.distro", "")))
    if library.problems:
        raise InputError(library.problems)
    found.system.name = " + ".join(files)
    return found


def _launched(
    files: list[str], folder: str, given: Mapping[str, str], variables: Mapping[str, str], opener: Opener
) -> tuple[Workspace, Launched]:
    """Return the workspace, and what all launch files start."""
    read = []
    for each in files:
        workspace, path = entry_point(each, folder)
        workspace.open = opened(workspace.root, folder, opener)
        found = launch(workspace, path, dict(given), dict(variables))
        own = [one for one in found.remarks if one.about in _UNREAD and one.what == workspace.short(path)]
        if own and not found.instances:
            raise InputError(_problems(own, path))
        read.append(found)
    whole = read[0]
    for found in read[1:]:
        whole.instances += found.instances
        whole.remarks += found.remarks
        whole.emits = whole.emits or found.emits
        whole.arguments = {**found.arguments, **whole.arguments}
        whole.variables = {**found.variables, **whole.variables}
        whole.assumed = {**found.assumed, **whole.assumed}
        whole.files = {**found.files, **whole.files}
    return workspace, whole


def _problems(remarks: list[Remark], path: str) -> list[Problem]:
    """Return the first remarks about a launch file that starts nothing as problems, and how many more there are."""
    found = [Problem("CQ047", one.cause, one.place or Place(path)) for one in remarks[:_MOST_PROBLEMS]]
    more = len(remarks) - len(found)
    return [*found, Problem("CQ047", f"{more} more parts of this file are not read", Place(path))] if more else found
