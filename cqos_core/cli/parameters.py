"""Parameters that several commands share, and kinds of values that say what is allowed where they refuse."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

import click

from cqos_core.cli.streams import COLOR_CHOICES
from cqos_core.model.dataclass import dataclass
from cqos_core.model.regular import regular_expression
from cqos_core.plugins import load_plugins

READS_SYSTEMS = "reads_systems"
"""The attribute of functions of commands that read systems, and so take the options that importers declare."""


_FEW = 40


def nearest(name: str, known: Iterable[str], *, listed: bool = True) -> str:
    """End a sentence about an unknown ``name``: with the one of ``known`` that is near, and all where they are few."""
    from cqos_core.model import spelling

    names = sorted(known)
    near = spelling.nearest(name, names)
    all_of_them = f"nown: {', '.join(names) or 'none'}." if listed and len(names) <= _FEW else ""
    if near:
        return f"; did you mean `{near}`?" + (f" K{all_of_them}" if all_of_them else "")
    return f"; k{all_of_them}" if all_of_them else "."


def refuse_absent(kind: str, name: str, what: str) -> None:
    """Refuse a name of a kind that plugins register, where what brings it is not installed; ``what`` is it in words.

    Raises:
        MissingError: with the line that installs it.
    """
    from cqos_core.model.features import absent, missing

    row = absent(kind).get(name)
    if row is not None:
        raise missing(row.name, f"{what} is not installed")


def refused(option: str, message: str) -> click.BadParameter:
    """Return the error of an option or argument whose value is of no use."""
    return click.BadParameter(message, param_hint=f"'{option}'")


class Registered(click.ParamType):  # type: ignore[type-arg]  # generic since click 8.5 only
    """The name of something that plugins register."""

    def __init__(self, kind: str, metavar: str = "") -> None:
        """Take names of one kind, ``formatters``, and show ``metavar`` in place of all of them."""
        self.kind = kind
        self.name = {"formatters": "format"}.get(kind, kind.removesuffix("s"))
        self.metavar = metavar

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Refuse a name that no plugin registered."""
        known = getattr(load_plugins(), self.kind)
        if value not in known:
            refuse_absent(self.kind, value, f"the {self.name} `{value}`")
            self.fail(f"there is no {self.name} `{value}`{nearest(value, known)}", param, ctx)
        return value

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:  # noqa: ARG002
        """List the names, unless there are too many."""
        return self.metavar or f"[{'|'.join(getattr(load_plugins(), self.kind))}]"


class Assignment(NamedTuple):
    """``owner.name=value``, taken apart."""

    owner: str
    name: str
    value: str

    def __str__(self) -> str:
        return f"{self.owner}.{self.name}={self.value}"


_VARIABLE = regular_expression(r"(?P<name>[A-Za-z_]\w*)=(?P<value>.*)", re.DOTALL)
_ASSIGNMENT = regular_expression(r"(?P<owner>[^.=\s]+)\.(?P<name>[^=\s]+)=(?P<value>.+)", re.DOTALL)


class AssignmentType(click.ParamType):  # type: ignore[type-arg]
    """``ros2.rmw=cyclonedds``: what it is of, its name, and the value it takes."""

    name = "assignment"

    def __init__(self, form: str, example: str, owner: str = "") -> None:
        """Read ``owner.name=value``; with an ``owner`` given, ``name=value``."""
        self.form, self.example, self.owner = form, example, owner

    def convert(self, value: str | Assignment, param: click.Parameter | None, ctx: click.Context | None) -> Assignment:
        """Take the text apart."""
        if isinstance(value, Assignment):
            return value
        match = (_VARIABLE if self.owner else _ASSIGNMENT).fullmatch(value.strip())
        if match is None:
            self.fail(f"`{value}` is not of the form {self.form}, for instance {self.example}.", param, ctx)
        return Assignment(**{"owner": self.owner, **match.groupdict()})

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:  # noqa: ARG002
        """Show the form."""
        return self.form


@dataclass(slots=True)
class Run:
    """One run of the command; click hands it on as ``ctx.obj``.

    Attributes:
        debug: show tracebacks of internal errors.
        silent: do not speak of broken plugins.
        arguments: the command line.
    """

    debug: bool = False
    silent: bool = False
    arguments: tuple[str, ...] = ()

    def debug_from_now_on(self) -> None:
        """Show tracebacks, also of errors that become mere words."""
        if not self.debug:
            import logging

            self.debug = True
            logger = logging.getLogger("cqos_core")
            logger.addHandler(logging.StreamHandler())
            logger.setLevel(logging.DEBUG)


def _debug(ctx: click.Context, _param: click.Parameter, value: bool) -> None:  # noqa: FBT001 - click's signature
    if value and isinstance(run := ctx.find_root().obj, Run):
        run.debug_from_now_on()


debug_option = click.option(
    "--debug",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_debug,
    help="Show the traceback of an internal error (or set CQOS_DEBUG=1).",
)
form_option = click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="For people or for programs.",
)
packs_option = click.option(
    "--pack",
    "pack_files",
    metavar="FILE",
    multiple=True,
    help="A rule pack written as a YAML file, beside the installed ones. Can be repeated.",
)
color_option = click.option(
    "--color",
    type=click.Choice(COLOR_CHOICES),
    default="auto",
    show_default=True,
    help="Colours in text; `auto` asks the terminal and the variables NO_COLOR and FORCE_COLOR.",
)
