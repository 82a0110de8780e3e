"""The project of a file: the nearest configuration, its rule packs, and problems of either."""

from __future__ import annotations

import os
import re
from dataclasses import field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cqos_core.config import NAME, SHARED_NAME, Config, find_config, load_config
from cqos_core.files.source_files import read_path
from cqos_core.matching.pipeline import CheckContext, context
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.source import Source
from cqos_core.packs.pack_yaml import read_pack
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.packs.pack import RulePack

_PACK: Final = re.compile(rb"^\s*[\"']?cqos_pack[\"']?\s*:", re.MULTILINE)


def is_configuration(path: str) -> bool:
    """Whether a file is the configuration of a project, by its name."""
    return Path(path).name in {NAME, SHARED_NAME}


def is_pack(data: bytes) -> bool:
    """Whether a text is a rule pack file."""
    return _PACK.search(data) is not None


@dataclass(frozen=True, slots=True)
class Project:
    """A configuration with its rule packs.

    Attributes:
        packs: the packs of its rule pack files.
        problems: of the configuration and of its packs.
    """

    config: Config
    where: CheckContext
    packs: tuple[RulePack, ...] = ()
    problems: tuple[Problem, ...] = ()

    @property
    def all_packs(self) -> tuple[RulePack, ...]:
        """The installed packs; packs of the configuration replace those with the same id."""
        names = {*load_plugins().packs, *(pack.id for pack in self.packs)}
        return tuple(pack for name in sorted(names) if (pack := self.where.find_pack(name)) is not None)


@dataclass(slots=True, eq=False)
class Projects:
    """Reads configurations and rule packs; one that cannot be read now keeps its former content."""

    _known: dict[str, Project] = field(default_factory=dict)
    _configs: dict[str, Config] = field(default_factory=dict)
    _packs: dict[str, RulePack] = field(default_factory=dict)

    def forget(self) -> None:
        """Read everything again."""
        self._known.clear()

    def of(self, path: str, texts: Mapping[str, bytes]) -> Project:
        """Return the project of a file."""
        found = path if is_configuration(path) else find_config(os.path.dirname(path))  # noqa: PTH120
        name = os.path.abspath(found) if found is not None else ""  # noqa: PTH100 - a link keeps its name
        if name not in self._known:
            self._known[name] = self._read(name, texts)
        return self._known[name]

    def _read(self, name: str, texts: Mapping[str, bytes]) -> Project:
        problems: list[Problem] = []
        try:
            self._configs[name] = load_config(name, texts) if name else Config()
        except InputError as error:
            problems += error.problems
        config = self._configs.get(name, Config())
        packs = []
        for path in dict.fromkeys(map(os.path.abspath, config.packs)):
            try:
                self._packs[path] = read_pack(_source(path, texts))
            except InputError as error:
                problems += error.problems
            if path in self._packs:
                packs.append(self._packs[path])
        return Project(config, context(packs, config.protocol), tuple(packs), tuple(problems))


def _source(path: str, texts: Mapping[str, bytes]) -> Source:
    data = texts.get(os.path.realpath(path))
    return read_path(path) if data is None else Source(path, data)


@lru_cache(maxsize=16)
def pack_problems(path: str, data: bytes) -> tuple[Problem, ...]:
    """Return the problems of a rule pack file."""
    try:
        read_pack(Source(path, data))
    except InputError as error:
        return error.problems
    return ()
