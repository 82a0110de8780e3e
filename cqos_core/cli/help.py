"""``--help``, which fits on a screen, and ``--help-all``, which lists all options."""

from __future__ import annotations

import copy
from inspect import cleandoc
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

F = TypeVar("F", bound="Callable[..., Any]")

SCREEN: Final = 24
"""Lines of a usual terminal."""
_USUAL: Final = "usual_options"
_WIDEST: Final = 28  # of the first column
_LISTED: Final = 14  # commands with their summaries


def usual(*names: str) -> Callable[[F], F]:
    """Name the options that the short ``--help`` describes; those that are not installed are left out."""

    def mark(function: F) -> F:
        setattr(function, _USUAL, names)
        return function

    return mark


def _show(text: Callable[[click.Context], str]) -> Callable[[click.Context, click.Parameter, bool], None]:
    def show(ctx: click.Context, _param: click.Parameter, value: bool) -> None:  # noqa: FBT001 - click's signature
        if value and not ctx.resilient_parsing:
            click.echo(text(ctx), color=ctx.color)
            ctx.exit()

    return show


def with_help(command: click.Command) -> click.Command:
    """Return a copy of a command that has ``--help`` and ``--help-all``."""
    command = copy.copy(command)
    command.params = [*command.params, *help_options()]
    return command


def help_options() -> Iterator[click.Option]:
    """Yield the options ``--help`` and ``--help-all``."""
    for names, text, said in (
        (["--help", "-h"], short_help, "Show the usual options."),
        (["--help-all"], click.Context.get_help, "Show all options and the exit codes."),
    ):
        yield click.Option(names, is_flag=True, is_eager=True, expose_value=False, callback=_show(text), help=said)


def short_help(ctx: click.Context) -> str:
    """Return the help of a command, shortened to a screen."""
    whole, rows = ctx.get_help(), [_row(each, ctx) for each in _usual(ctx.command)]
    if whole.count("\n") < SCREEN:
        return whole
    while (text := _short(ctx, rows)).count("\n") >= SCREEN and len(rows) > 1:
        del rows[-2]  # the last one is --help-all
    return text


def _short(ctx: click.Context, rows: list[tuple[str, str]]) -> str:
    """Return usage, summary, examples and some options of a command; of a group, its commands."""
    formatter, command = ctx.make_formatter(), ctx.command
    command.format_usage(ctx, formatter)
    summary, *others = cleandoc(command.help or "").split("\n\n")
    examples = [each for each in others if each.startswith("\b\nExamples:")]
    for text in (summary, *(examples if not isinstance(command, click.Group) else ())):
        formatter.write_paragraph()
        with formatter.indentation():
            formatter.write_text(text)
    if hasattr(command, "summaries"):
        _list_commands(command.summaries(), ctx, formatter)
    else:
        with formatter.section("Options"):
            formatter.write_dl(rows)
    return formatter.getvalue().rstrip("\n")


def _list_commands(summaries: Mapping[str, str], ctx: click.Context, formatter: click.HelpFormatter) -> None:
    """List the commands of a group: the first with their summaries, the others by name."""
    path, rows = ctx.command_path, [*summaries.items()]
    with formatter.section("Commands"):
        formatter.write_dl(rows[:_LISTED])
    formatter.write_paragraph()
    if rows[_LISTED:]:
        formatter.write_text(f"More commands: {', '.join(name for name, _ in rows[_LISTED:])}")
    formatter.write_text(f"`{path} COMMAND --help` describes a command, `{path} --help-all` lists all.")


def _usual(command: click.Command) -> Iterator[click.Option]:
    """Yield the usual options, and the one that describes all."""
    names = (*getattr(command.callback, _USUAL, ()), "--help-all")
    options = {name: each for each in command.params if isinstance(each, click.Option) for name in each.opts}
    yield from (options[name] for name in names if name in options)


def _row(option: click.Option, ctx: click.Context) -> tuple[str, str]:
    """Return an option with its metavar, cut where it is long, and the first sentence of its help."""
    names, _ = option.get_help_record(ctx) or ("", "")
    metavar = option.make_metavar(ctx)
    if len(names) > _WIDEST and metavar.startswith("["):
        kept: list[str] = []
        for choice in metavar.strip("[]").split("|"):
            if len(names) - len(metavar) + len("|".join([*kept, choice, "…"])) > _WIDEST - 2:
                break
            kept.append(choice)
        names = names.replace(metavar, f"[{'|'.join([*kept, '…'])}]")
    return names, (option.help or "").split(". ")[0].rstrip(".")
