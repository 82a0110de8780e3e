"""From paths to systems, as the command line and the configuration ask."""

from __future__ import annotations

import os
import sys
from dataclasses import field, replace
from typing import TYPE_CHECKING

import click

from cqos_core.cli.console import say, say_problems
from cqos_core.cli.errors import WrongUsageError, say_error, wrong_usage
from cqos_core.cli.exit_codes import UNUSABLE
from cqos_core.cli.input_choices import choice_problems, command_problems, input_notes, lacking_problems
from cqos_core.cli.pack_files import read_packs
from cqos_core.cli.parameters import (
    Assignment,
    nearest,
    refuse_absent,
)
from cqos_core.cli.progress import Progress
from cqos_core.files.ignore_patterns import read_ignore_patterns
from cqos_core.files.path_loader import load_paths
from cqos_core.files.source_files import STDIN, STDIN_NAME, read_stream
from cqos_core.matching.pipeline import context, with_options
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InvalidValueError, Problem
from cqos_core.model.settings import Place
from cqos_core.model.source import OPTIONS, VARIABLES
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.cli.reading_options import ReadingOptions
    from cqos_core.config import Config
    from cqos_core.files.path_loader import Loaded
    from cqos_core.files.source_reader import GivenSource
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.source import Source
    from cqos_core.model.system import System


@dataclass(frozen=True, slots=True)
class InputReader:
    """Reads paths under the options of the command line and of the configuration.

    Attributes:
        config: the configuration of the project, or an empty one.
        context: the rule packs, with those of --pack.
        folders: sources that were read as one folder, by path.
    """

    options: ReadingOptions
    config: Config
    context: CheckContext
    switches: Mapping[str, Mapping[str, str]]
    _nearest: dict[str, InputReader] = field(default_factory=dict)
    _origins: dict[str, str] = field(default_factory=dict)
    folders: dict[str, GivenSource] = field(default_factory=dict)

    @property
    def protocol(self) -> str | None:
        """The protocol of systems that state none."""
        return self.options.protocol or self.config.protocol

    def load(self, paths: Sequence[str], step: Callable[[int, int], None] = lambda _done, _all: None) -> Loaded:
        """Read ``paths``, also of git revisions (``designs#ref=main``); problems of files are in the result.

        Raises:
            CqosError: a revision cannot be read.
        """
        if any("#ref=" in path for path in paths):
            from cqos_core.files.revisions import RevisionLoader

            return RevisionLoader(lambda real: self._load(real, step), self._origins)(paths)
        return self._load(paths, step)

    def _load(self, paths: Sequence[str], step: Callable[[int, int], None]) -> Loaded:
        stdin = self._stdin() if STDIN in paths else None
        self._refuse_without_folder(paths)
        loaded = load_paths(
            paths,
            self.options.importer,
            self._switches_with_options(),
            stdin,
            protocol=lambda path: self.nearest(path).protocol,
            excluded=(
                *self.config.exclude,
                *([read_ignore_patterns(excluded, ".")] if (excluded := self.options.excluded) else ()),
            ),
            step=step,
            entering=True,
        )
        self._refuse_without_effect(loaded)
        self.folders.update(loaded.folders)
        return loaded

    def _switches_with_options(self) -> Mapping[str, Mapping[str, str]]:
        """Return the switches with options: those of the command line win over those of the configuration."""
        stated = {
            f"{pack}.{name}": setting.text
            for pack, settings in self.config.options.items()
            for name, setting in settings.items()
        }
        return {**self.switches, OPTIONS: {**stated, **self.switches.get(OPTIONS, {})}} if stated else self.switches

    def _refuse_without_folder(self, paths: Sequence[str]) -> None:
        """Refuse the option of an importer that reads folders, if no folder is named."""
        for name, own in self.options.of_importers.items():
            info = load_plugins().importers[name]
            first = info.folder_option
            if first is not None and first.switch in own and not any(map(os.path.isdir, paths)):
                from cqos_core.cli.input_choices import command_with_folder

                command = command_with_folder(info, own[first.switch].split("\n")[0], paths)
                message = f"{first.option} needs a folder among the paths, whose files are looked up"
                raise WrongUsageError(message, f"write `{command}`")

    def _refuse_without_effect(self, loaded: Loaded) -> None:
        """Refuse options of an importer that reads folders, if it read none."""
        detected = [*loaded.detected.open, *(item for same in loaded.detected.taken.values() for item in same)]
        for name, own in self.options.of_importers.items():
            info = load_plugins().importers[name]
            first = info.folder_option
            if first is not None and first.switch not in own and info not in [item.importer for item in detected]:
                other = next(each.option for each in info.options if each.switch in own)
                raise WrongUsageError(
                    f"{other} has no effect without {first.option}", f"write {first.option} {first.metavar} too"
                )

    def read_system(self, paths: Sequence[str], color: str, *, partly: bool = False) -> tuple[System, Loaded]:
        """Read ``paths`` as one system; if there is none, print why and end the command.

        With ``partly``, files that cannot be read are left out.
        """
        with Progress("reading") as progress:
            loaded = self.load(paths, progress.step)
        if not is_usable(loaded, color, named=paths, partly=partly):
            click.get_current_context().exit(UNUSABLE)
        return self.merged([system for _, system in loaded.systems]), loaded

    def reread(self, files: Sequence[str], texts: Mapping[str, bytes]) -> System:
        """Read files again as one system, with the contents of ``texts`` in place of their own.

        Raises:
            InputError: with what is wrong with all of them.
        """
        from cqos_core.files.source_reader import read_texts

        switches = self._switches_with_options()
        return self.merged_for_check(
            read_texts(files, texts, self.options.importer, switches, self.protocol, self.folders)
        )

    def nearest(self, path: str) -> InputReader:
        """Return a reader with the configuration nearest to ``path``; this reader if the command line chose one.

        Raises:
            InputError: that configuration cannot be used.
        """
        if path == STDIN or self.options.no_config or self.options.config_file is not None:
            return self
        # Of a revision, the configuration is the one that is there now.
        start = next((start for start in self._origins if path.startswith(start)), "")
        folder = _folder_of(os.path.join(self._origins[start], path[len(start) :]) if start else path)  # noqa: PTH118
        if folder not in self._nearest:
            from cqos_core.config import config_for

            config = config_for(folder)
            same = config.path == self.config.path
            other = self if same else _reader(self.options, config, self.switches)
            self._nearest[folder] = other if same else replace(other, folders=self.folders)
        return self._nearest[folder]

    def _stdin(self) -> Source:
        if sys.stdin is None:
            raise WrongUsageError("`-` reads standard input, which is closed", "write the path of a file")
        return read_stream(self.options.stdin_name, sys.stdin.buffer)

    def merged_for_check(self, systems: Sequence[System]) -> System:
        """Return ``systems`` as one; if it has profiles only, with trial endpoints that use them."""
        whole = self.merged(systems)
        if whole.endpoints:
            return whole
        from cqos_core.checking.hypothetical_pairs import with_profiles_tried

        return with_profiles_tried(whole, self.protocol)

    def merged(self, systems: Sequence[System]) -> System:
        """Return ``systems`` as one. They win over the configuration, and the command line wins over them."""
        if len(systems) == 1:
            merged = systems[0]
        else:
            from cqos_core.files.system_merge import merge

            merged = merge(systems)
        # The configuration is no source of the system: it is not what was checked.
        system = replace(self.config.apply_to(merged), sources=merged.sources)
        for pack_id, name, value in self.options.assumptions:
            place = Place("the command line", path=f"--option {pack_id}.{name}")
            system = with_options(system, {pack_id: {name: value}}, self.context, place)
        return system


def is_usable(loaded: Loaded, color: str, path: str = "", *, named: Sequence[str] = (), partly: bool = False) -> bool:
    """Print problems of what was read from ``path``, and return whether a command can go on with it.

    ``named`` are all paths of the command.
    """
    problems = [*loaded.problems, *path_problems(loaded, named)]
    say_problems(problems, color)
    if not loaded.systems and not problems:
        where = f"{path}: " if path else ""
        advice = "name a file that C-QoS reads; `cqos packs` lists the formats"
        say_error(f"{where}no file there is a design that C-QoS reads", advice, color)
    for note in input_notes(loaded, named):
        say(note, severity="note", choice=color)
    return bool(loaded.systems) and not loaded.detected.open and (partly or not problems)


def path_problems(loaded: Loaded, paths: Sequence[str]) -> list[Problem]:
    """Return problems of paths that need a choice, or another command first."""
    problems = choice_problems(loaded, paths)
    problems = problems or ([] if loaded.systems or loaded.problems else command_problems(loaded))
    return [*lacking_problems(loaded), *problems]


def prepare_reader(options: ReadingOptions, paths: Sequence[str]) -> InputReader:
    """Return a reader after checking the options about reading, before any input is read.

    Raises:
        RefusedError: the command line names something that is not there.
        InputError: the configuration or a rule pack file cannot be used.
    """
    return _reader(options, _config(options, paths), _switches(options))


def _reader(options: ReadingOptions, config: Config, switches: Mapping[str, Mapping[str, str]]) -> InputReader:
    packs = read_packs((*config.packs, *options.pack_files))
    protocol = options.protocol or config.protocol
    where = context(packs, protocol)
    known = {*load_plugins().packs, *(pack.id for pack in packs)}
    if protocol is not None and protocol not in known:
        refuse_absent("packs", protocol, f"the rule pack `{protocol}`")
        source = "--protocol" if options.protocol else f"protocol of {config.path}"
        raise wrong_usage(source, f"there is no rule pack `{protocol}`", nearest(protocol, known))
    for assumption in options.assumptions:
        _check_assumption(assumption, where, known)
    return InputReader(options, config, where, switches)


def _config(options: ReadingOptions, paths: Sequence[str]) -> Config:
    """Find and read the configuration."""
    # It comes with the forms of the YAML importer, which `--help` does not need.
    from cqos_core.config import Config, config_for, load_config

    if options.no_config and options.config_file is not None:
        raise WrongUsageError("--config and --no-config exclude each other", "write one of them")
    if options.no_config:
        return Config()
    if options.config_file is not None:
        return load_config(options.config_file)
    named = "." if options.stdin_name == STDIN_NAME else options.stdin_name
    first = next(iter(paths), ".")
    return config_for(_folder_of(named if first == STDIN else first))


def _folder_of(path: str) -> str:
    """Return the folder at a path or around it, even if the path does not exist."""
    folder = os.path.abspath(path)  # noqa: PTH100 - `resolve` would leave the folder for that of a link's target
    while not os.path.isdir(folder):  # noqa: PTH112 - Path.is_dir raises where a path is too long
        folder = os.path.dirname(folder)  # noqa: PTH120
    return folder


def _switches(options: ReadingOptions) -> dict[str, dict[str, str]]:
    switches: dict[str, dict[str, str]] = {}
    for switch in options.switches:
        importers = load_plugins().importers
        if switch.owner not in importers:
            raise wrong_usage("--switch", f"there is no importer `{switch.owner}`", nearest(switch.owner, importers))
        switches.setdefault(switch.owner, {})[switch.name] = switch.value
    for importer, own in options.of_importers.items():
        switches.setdefault(importer, {}).update(own)
    if options.assumptions:
        switches[OPTIONS] = {f"{each.owner}.{each.name}": each.value for each in options.assumptions}
    if options.variables:
        switches[VARIABLES] = {each.name: each.value for each in options.variables}
    return switches


def _check_assumption(assumption: Assignment, where: CheckContext, known: Iterable[str]) -> None:
    """Refuse an option or value that no pack knows. In files, the same is a finding."""
    from cqos_core.behaviour.catch_option import OPTION, OWNER, READINGS

    if assumption.owner == OWNER:
        if assumption.name != OPTION or assumption.value not in READINGS:
            raise wrong_usage(
                "--option", f"`{assumption}` is no option", f"write {OWNER}.{OPTION}={'|'.join(READINGS)}"
            )
        return
    pack = where.find_pack(assumption.owner)
    if pack is None:
        refuse_absent("packs", assumption.owner, f"the rule pack `{assumption.owner}`")
        raise wrong_usage("--option", f"there is no rule pack `{assumption.owner}`", nearest(assumption.owner, known))
    index = pack.find("option", assumption.name)
    if index is None:
        names = [policy.name for policy in pack.policies if policy.level == "option"]
        raise wrong_usage(
            "--option", f"{pack.title} has no option `{assumption.name}`", nearest(assumption.name, names)
        )
    policy = pack.policies[index]
    try:
        policy.domain.parse(assumption.value)
    except InvalidValueError as error:
        # A value newer than the pack has a stand-in, and the report says so.
        if policy.fallback is None:
            message = f"{assumption.owner}.{policy.name}: {error.message}"
            raise wrong_usage("--option", message, error.advice()) from None
