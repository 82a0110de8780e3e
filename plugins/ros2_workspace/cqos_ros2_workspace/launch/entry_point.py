"""What the command line says about a launch: its file, its workspace, its arguments."""

from __future__ import annotations

import os
from pathlib import Path

from cqos_core.importers.source_reading import did_you_mean, listed, shown
from cqos_core.model.problems import InputError, Problem
from cqos_ros2_workspace.launch.workspace import Workspace, find_packages, root_of

_MOST_NAMES = 20


def argument(text: str) -> tuple[str, str]:
    """Return name and value of ``NAME:=VALUE``.

    Raises:
        InputError: it has another form.
    """
    name, assigned, value = text.partition(":=")
    if not assigned or not name.strip():
        message = f"{shown(text)} is no launch argument"
        raise InputError([Problem("CQ047", message, None, "write NAME:=VALUE, for instance use_sim_time:=true")])
    return name.strip(), value


def entry_point(file: str, folder: str | None = None) -> tuple[Workspace, str]:
    """Return the workspace and the path of the launch file that ``file`` names: a path, or ``PACKAGE:FILE``.

    Args:
        file: as the caller wrote it.
        folder: of the workspace; None: the one that the file is in, or the working directory.

    Raises:
        InputError: there is no such file, package or folder.
    """
    if folder is not None and not os.path.isdir(folder):  # noqa: PTH112 - Path.is_dir raises where a path is too long
        raise _refused(f"there is no folder {shown(folder)}", "name the folder that has the packages")
    package, colon, name = file.partition(":")
    path = str(Path(folder, file)) if folder is not None and not os.path.exists(file) else file  # noqa: PTH110
    if os.path.isfile(path):  # noqa: PTH113
        real = os.path.realpath(path)
        return find_packages(folder or root_of(real)), real
    if not colon or "/" in package:
        raise _refused(f"there is no file {shown(file)}", "name a launch file, or PACKAGE:FILE")
    return _in_package(package, name, find_packages(folder or "."))


def _in_package(package: str, name: str, workspace: Workspace) -> tuple[Workspace, str]:
    if package not in workspace.packages:
        meant = did_you_mean(package, workspace.packages)
        where = f"{len(workspace.packages)} packages are in {workspace.root}"
        raise _refused(f"there is no package {shown(package)}{meant}", f"{where}; name the folder that has it")
    found = workspace.launch_files(package, name)
    if len(found) == 1:
        return workspace, found[0]
    known = workspace.all_launch_files(package)
    if found:
        advice = (
            f"write the folder too: {listed([os.path.relpath(each, workspace.packages[package]) for each in found])}"
        )
        raise _refused(f"the package `{package}` has {len(found)} files {shown(name)}", advice)
    advice = f"it has {listed(known[:_MOST_NAMES], 'and')}" if known else "it has no launch files"
    raise _refused(f"the package `{package}` has no launch file {shown(name)}{did_you_mean(name, known)}", advice)


def _refused(message: str, advice: str) -> InputError:
    return InputError([Problem("CQ001", message, None, advice)])
