"""Rule pack files that the command line or the configuration names."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from cqos_core.files.source_files import read_path
from cqos_core.model.problems import CqosError, InputError, Problem
from cqos_core.plugins import FILES_VARIABLE, load_plugins

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.packs.pack import RulePack


def read_packs(paths: Iterable[str]) -> list[RulePack]:
    """Read rule pack files.

    Raises:
        InputError: with the problems of all files.
    """
    packs: list[RulePack] = []
    problems: list[Problem] = []
    for path in paths:
        # pydantic, which it needs, is slow to import.
        from cqos_core.packs.pack_yaml import read_pack

        try:
            packs.append(read_pack(read_path(path)))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return packs


def install_packs(files: Iterable[str]) -> None:
    """Register rule pack files as installed packs, in this process and its child processes.

    Raises:
        InputError: one of them cannot be used.
        CqosError: another pack has its id.
    """
    paths = [os.path.abspath(path) for path in files]  # noqa: PTH100 - a link keeps its name
    known = {name: load_plugins().owner("packs", name) for name in load_plugins().packs} if paths else {}
    for path, pack in zip(paths, read_packs(paths), strict=True):
        if pack.id in known:
            raise CqosError(
                f"{path}: there is a rule pack `{pack.id}` already, from {known[pack.id]}", "give the pack another id"
            )
        known[pack.id] = path
    if paths:
        os.environ[FILES_VARIABLE] = os.pathsep.join(paths)
        load_plugins.cache_clear()
        load_plugins()


def packs_here(files: Iterable[str]) -> list[RulePack]:
    """Read the rule pack files of the nearest configuration, and ``files``."""
    from cqos_core.config import config_for

    return read_packs((*config_for(".").packs, *files))
