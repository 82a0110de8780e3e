"""Options that several commands share, and their types. A refused value names the allowed ones."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, NamedTuple, TypeVar

import click

from cqos_core.cli.console import COLOR_CHOICES
from cqos_core.cli.errors import WrongUsageError
from cqos_core.model.dataclass import dataclass
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.source import VARIABLES
from cqos_core.plugins import load_plugins

F = TypeVar("F", bound="Callable[..., Any]")

READS_SYSTEMS = "reads_systems"
"""The attribute that marks functions of commands which read systems; these take the options of importers."""


_FEW = 40


def nearest(name: str, known: Iterable[str], *, listed: bool = True) -> str:
    """Return advice for an unknown ``name``: a similar one of ``known``, and the whole list where it is short."""
    from cqos_core.model import spelling

    names = sorted(known)
    near = spelling.nearest(name, names)
    meant = [f"did you mean `{near}`?"] if near else []
    return " ".join([*meant, *([f"known: {', '.join(names) or 'none'}"] if listed and len(names) <= _FEW else [])])


def refuse_absent(kind: str, name: str, what: str) -> None:
    """Refuse a name whose distribution is not installed; ``what`` describes it in the message.

    Raises:
        MissingError: with the line that installs it.
    """
    from cqos_core.model.optional_features import absent, missing

    row = absent(kind).get(name)
    if row is not None:
        raise missing(row.name, f"{what} is not installed")


class Registered(click.ParamType):  # type: ignore[type-arg]  # generic since click 8.5 only
    """The name of something that plugins register."""

    def __init__(self, kind: str, metavar: str = "") -> None:
        """Accept registered names of one kind, such as ``formatters``; help shows ``metavar`` in place of the list."""
        self.kind = kind
        self.name = {"formatters": "format"}.get(kind, kind.removesuffix("s"))
        self.metavar = metavar

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Refuse a name that no plugin registered."""
        known = getattr(load_plugins(), self.kind)
        if value not in known:
            refuse_absent(self.kind, value, f"the {self.name} `{value}`")
            raise WrongUsageError(f"there is no {self.name} `{value}`", nearest(value, known), ctx, param)
        return value

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:  # noqa: ARG002
        """List the names, unless there are too many."""
        return self.metavar or f"[{'|'.join(getattr(load_plugins(), self.kind))}]"


class Assignment(NamedTuple):
    """The parts of ``owner.name=value``."""

    owner: str
    name: str
    value: str

    def __str__(self) -> str:
        return f"{self.owner}.{self.name}={self.value}"


_VARIABLE = regular_expression(r"(?P<name>[A-Za-z_]\w*)=(?P<value>.*)", re.DOTALL)
_ASSIGNMENT = regular_expression(r"(?P<owner>[^.=\s]+)\.(?P<name>[^=\s]+)=(?P<value>.+)", re.DOTALL)


class AssignmentType(click.ParamType):  # type: ignore[type-arg]
    """The type of options such as ``ros2.rmw=cyclonedds``."""

    name = "assignment"

    def __init__(self, form: str, example: str, owner: str = "") -> None:
        """Read ``owner.name=value``; with an ``owner`` given, ``name=value``."""
        self.form, self.example, self.owner = form, example, owner

    def convert(self, value: str | Assignment, param: click.Parameter | None, ctx: click.Context | None) -> Assignment:
        """Split the text into its parts."""
        if isinstance(value, Assignment):
            return value
        match = (_VARIABLE if self.owner else _ASSIGNMENT).fullmatch(value.strip())
        if match is None:
            raise WrongUsageError(
                f"`{value}` is not of the form {self.form}", f"for instance {self.example}", ctx, param
            )
        return Assignment(**{"owner": self.owner, **match.groupdict()})

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:  # noqa: ARG002
        """Show the form."""
        return self.form


@dataclass(slots=True)
class Run:
    """State of one run of the command, in ``ctx.obj``.

    Attributes:
        debug: show tracebacks of internal errors.
        silent: print no warning about broken plugins.
        arguments: the command line.
    """

    debug: bool = False
    silent: bool = False
    arguments: tuple[str, ...] = ()

    def enable_debug(self) -> None:
        """Show tracebacks, also of errors that are reported as messages."""
        if not self.debug:
            import logging

            self.debug = True
            logger = logging.getLogger("cqos_core")
            logger.addHandler(logging.StreamHandler())
            logger.setLevel(logging.DEBUG)


def _debug(ctx: click.Context, _param: click.Parameter, value: bool) -> None:  # noqa: FBT001 - click's signature
    if value and isinstance(run := ctx.find_root().obj, Run):
        run.enable_debug()


debug_option = click.option(
    "--debug",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_debug,
    help="Show the traceback of an internal error (or set CQOS_DEBUG=1).",
)
against_option = click.option(
    "--against",
    "old",
    required=True,
    metavar="PATH",
    help="What to compare with. A path, or .git#ref=NAME for the same paths in a git revision: a branch, a tag or a commit.",
)


def _split(_ctx: click.Context, _param: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(part.strip() for value in values for part in value.split(",") if part.strip())


def show_option(*parts: str, default: Sequence[str] | None = None, codes: bool = False) -> Callable[[F], F]:
    """Return the option ``--show`` of a command whose report has these parts; with ``codes``, it takes rules, too."""
    return click.option(
        "--show",
        type=None if codes else click.Choice(parts),
        metavar=f"[{'|'.join((*parts, 'CODES'))}]" if codes else None,
        multiple=True,
        callback=_split if codes else None,
        default=default,
        show_default=default is not None,
        help="Show these findings, or these parts of the result, in full. Can be repeated.",
    )


def fail_on_option(*kinds: str, default: str | None = None) -> Callable[[F], F]:
    """Return the option ``--fail-on`` of a command with these kinds of results; without a ``default``, others decide."""
    return click.option(
        "--fail-on",
        type=click.Choice(kinds),
        default=default,
        show_default=default is not None,
        help="Exit with 1 on results of this kind, or worse.",
    )


protocol_option = click.option(
    "--protocol",
    metavar="ID",
    help="The protocol of participants that state none, for instance ros2. `cqos packs` lists them.",
)
assumptions_option = click.option(
    "--option",
    "assumptions",
    type=AssignmentType("PACK.NAME=VALUE", "ros2.rmw=cyclonedds"),
    multiple=True,
    help="What to assume about the deployment, for instance ros2.rmw=cyclonedds. Can be repeated; wins over "
    "what files say. `cqos packs ID` lists a pack's options.",
)
variables_option = click.option(
    "--define",
    "variables",
    type=AssignmentType("NAME=VALUE", "ROBOT=beta", VARIABLES),
    multiple=True,
    help="A variable that files refer to, such as $(ROBOT). Can be repeated.",
)
together_option = click.option(
    "--together", is_flag=True, help="Take all files as one system, those of directories too."
)
watch_option = click.option(
    "--watch", is_flag=True, help="Go on until Ctrl-C, and report again whenever something changes."
)
log_option = click.option(
    "--log",
    metavar="FILE",
    help="Read what running programs print about incompatible endpoints. `-` is standard input.",
)
no_config_option = click.option("--no-config", is_flag=True, is_eager=True, help="Use no configuration file.")
CONFIG: Final = "Use this configuration instead of the nearest cqos.toml, or [tool.cqos] of the nearest pyproject.toml."
"""The help of ``--config``."""
fix_option = click.option(
    "--fix",
    is_flag=True,
    help="Apply fixes to the files; `convert` applies them to what it writes. Comments and layout stay, and what was observed is "
    "never changed.",
)
weaken_option = click.option(
    "--weaken", is_flag=True, help="Let --fix also take fixes that ask for less or promise less."
)
diff_option = click.option(
    "--diff", "show_diff", is_flag=True, help="Print what would change in the files, and write nothing."
)
_FORMAT: Final = "How to write the result. `check` and `prove` take several, each with an --output after it."


def formats_option(kind: Any) -> Callable[[F], F]:
    """Return the option ``--format`` of a command that writes several at once."""
    return click.option("--format", "formats", type=kind, multiple=True, help=_FORMAT)


def one_format_option(*names: str) -> Callable[[F], F]:
    """Return the option ``--format`` of a command that writes one; the first is the default."""
    return click.option("--format", "form", type=click.Choice(names), default=names[0], show_default=True, help=_FORMAT)


form_option = one_format_option("text", "json")


def output_option(metavar: str = "FILE", *, several: bool = False) -> Callable[[F], F]:
    """Return the option ``--output``; a command that writes ``several`` formats has one for each."""
    text = "Write the result there, whole or not at all."
    return click.option("--output", "outputs" if several else "output", metavar=metavar, multiple=several, help=text)


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
