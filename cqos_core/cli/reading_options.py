"""The options about reading that all commands share which read systems."""

from __future__ import annotations

import copy
import functools
from dataclasses import field, fields
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import click
from click.core import ParameterSource

from cqos_core.cli.parameters import (
    CONFIG,
    READS_SYSTEMS,
    Assignment,
    AssignmentType,
    Registered,
    assumptions_option,
    no_config_option,
    packs_option,
    protocol_option,
    variables_option,
)
from cqos_core.files.source_files import STDIN_NAME
from cqos_core.model.dataclass import dataclass
from cqos_core.model.source import VARIABLES
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.plugins import ImporterOption


P = ParamSpec("P")

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """Values of the options about reading; each field is the parameter of an option below."""

    importer: str | None
    protocol: str | None
    pack_files: tuple[str, ...]
    assumptions: tuple[Assignment, ...]
    switches: tuple[Assignment, ...]
    variables: tuple[Assignment, ...]
    stdin_name: str
    excluded: tuple[str, ...]
    config_file: str | None
    no_config: bool
    of_importers: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


_OPTIONS = (
    click.option(
        "--from",
        "importer",
        type=Registered("importers", "FORMAT"),
        help="Read every file as this format; without it, each file's format is detected. `cqos packs` lists the formats.",
    ),
    protocol_option,
    packs_option,
    assumptions_option,
    click.option(
        "--switch",
        "switches",
        type=AssignmentType("IMPORTER.NAME=VALUE", "bpmn.message_flows=true"),
        multiple=True,
        help="A switch of an importer, for instance bpmn.message_flows=true. Can be repeated.",
    ),
    variables_option,
    click.option(
        "--stdin-name",
        metavar="NAME",
        default=STDIN_NAME,
        help="What to call standard input (the path `-`) in messages. A path lets it include files of that folder.",
    ),
    click.option(
        "--exclude",
        "excluded",
        metavar="PATTERN",
        multiple=True,
        help="What a search of folders passes over, as in .gitignore and relative to the working directory. Can be "
        "repeated. Hidden, generated and ignored files are passed over anyway.",
    ),
    click.option("--config", "config_file", metavar="FILE", help=CONFIG),
    no_config_option,
)


def reading_options(command: Callable[..., R]) -> Callable[..., R]:
    """Add the options about reading to a command, which gets them as one parameter ``reading``."""
    names = [each.name for each in fields(ReadingOptions) if each.name != "of_importers"]

    @functools.wraps(command)
    def folded(*args: Any, **kwargs: Any) -> R:
        own: dict[str, dict[str, str]] = {}
        for importer, option in _declared():
            if values := kwargs.pop(_parameter(option), ()):
                own.setdefault(importer, {})[option.switch] = "\n".join(values)
        given = {name: kwargs.pop(name) for name in names}
        return command(*args, reading=ReadingOptions(**given, of_importers=own), **kwargs)

    setattr(folded, READS_SYSTEMS, True)
    return functools.reduce(lambda inner, option: option(inner), reversed(_OPTIONS), folded)


def with_importer_options(command: click.Command) -> click.Command:
    """Return a command that reads systems with the options that importers declare; the given one stays as it is."""
    known = [each.name for each in command.params]
    if getattr(command.callback, READS_SYSTEMS, False):
        command = copy.copy(command)
        command.params = [*command.params]
        at = known.index(_LAST) + 1
        command.params[at:at] = [
            click.Option(
                [each.option, _parameter(each)], metavar=each.metavar, multiple=True, help=each.help, show_default=False
            )
            for _, each in _declared()
            if _parameter(each) not in known
        ]
    return command


def options_given(ctx: click.Context) -> list[str]:
    """Return the options about reading that the command line of a run has, as another command takes them."""
    names = {each.name for each in fields(ReadingOptions)} | {_parameter(option) for _, option in _declared()}
    words: list[str] = []
    for param in ctx.command.params:
        if param.name in names and ctx.get_parameter_source(param.name) is ParameterSource.COMMANDLINE:
            value = ctx.params[param.name]
            for each in value if isinstance(value, list | tuple) and not isinstance(value, Assignment) else [value]:
                words += [param.opts[0]] if each is True else [param.opts[0], _as_given(each)]
    return words


def _as_given(value: str | Assignment) -> str:
    return f"{value.name}={value.value}" if isinstance(value, Assignment) and value.owner == VARIABLES else str(value)


_LAST = "no_config"


def _declared() -> list[tuple[str, ImporterOption]]:
    return [(info.name, each) for info in load_plugins().importers.values() for each in info.options]


def _parameter(option: ImporterOption) -> str:
    return option.option.lstrip("-").replace("-", "_")
