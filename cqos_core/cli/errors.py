"""Error messages of the command: ``error: WHAT``, then ``help: WRITE THIS``."""

from __future__ import annotations

import click

from cqos_core.cli.console import say, say_problems
from cqos_core.cli.help import short_help
from cqos_core.model.problems import CqosError, InputError, describe


class WrongUsageError(click.BadParameter):
    """Wrong usage of an option, an argument or of several together; ``help`` says what to write instead."""

    def __init__(
        self,
        what: str,
        help: str = "",  # noqa: A002 - as of a problem
        ctx: click.Context | None = None,
        param: click.Parameter | None = None,
        *,
        of: str = "",
    ) -> None:
        """Describe the mistake; ``of`` names the option or argument if click does not know it."""
        super().__init__(what, ctx, param, of or None)
        self.help = help


def wrong_usage(option: str, what: str, help: str = "") -> WrongUsageError:  # noqa: A002 - as of a problem
    """Return the error for an option or argument with a wrong value."""
    return WrongUsageError(what, help, of=option)


def say_error(what: str, help: str = "", choice: str = "auto") -> None:  # noqa: A002 - as of a problem
    """Print an error and its help lines on standard error."""
    say_lines(what, "error", choice)
    for line in help.splitlines():
        say(line, severity="help", choice=choice)


def say_lines(text: str, severity: str, choice: str = "auto") -> None:
    """Print a message of several lines on standard error."""
    for number, line in enumerate(text.splitlines()):
        say(line, severity="" if number else severity, choice=choice)


def say_usage_error(error: click.ClickException, where: click.Context | None = None) -> None:
    """Print a usage error. Without help of its own, it shows the usage of the command.

    ``where`` is the context, for errors that lack it.
    """
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        click.echo(short_help(error.ctx), err=True)  # the help is all that was asked for
        return
    what, help = _message_and_help(error)  # noqa: A001 - as of a problem
    ctx = error.ctx if isinstance(error, click.UsageError) and error.ctx is not None else where
    say_error(what, help or ("" if ctx is None else _usage(ctx)))


def say_cqos_error(error: CqosError, choice: str = "auto") -> None:
    """Print an error of C-QoS; problems of inputs with their places."""
    if isinstance(error, InputError):
        say_problems(error.problems, choice)
    else:
        say_error(error.what or describe(error), error.help, choice)


def _message_and_help(error: click.ClickException) -> tuple[str, str]:
    """Return message and help of an error of click, in the words of C-QoS."""
    advice = getattr(error, "help", "")
    if isinstance(error, click.NoSuchOption):
        return f"there is no option `{error.option_name}`", "" if error.ctx is None else _option(error, error.ctx)
    if isinstance(error, click.MissingParameter):
        return f"{_name(error)} is missing", advice
    if isinstance(error, click.BadParameter):
        name = _name(error)
        return f"{name}: {error.message.rstrip('.')}" if name else error.message.rstrip("."), advice
    text = error.format_message().rstrip(".")
    return text[:1].lower() + text[1:] if text[1:2].islower() else text, advice


def _option(error: click.NoSuchOption, ctx: click.Context) -> str:
    """Return advice for an unknown option."""
    from cqos_core.model.spelling import nearest

    names = [name.lstrip("-") for each in ctx.command.params if isinstance(each, click.Option) for name in each.opts]
    near = nearest(error.option_name.lstrip("-"), names)
    return f"did you mean `--{near}`?" if near else f"`{ctx.command_path} --help-all` lists the options"


def _name(error: click.BadParameter) -> str:
    """Return the option or argument of an error, as the user writes it."""
    if error.param_hint is not None:
        return error.param_hint if isinstance(error.param_hint, str) else "/".join(error.param_hint)
    if isinstance(error.param, click.Option):
        return max(error.param.opts, key=len)
    if isinstance(error.param, click.Argument):
        return error.param.make_metavar(error.ctx or click.Context(click.Command(None))).strip("[]")
    return ""


def _usage(ctx: click.Context) -> str:
    words = [ctx.command_path, *_required(ctx)]
    return f"write `{' '.join(words)}`; `{ctx.command_path} --help` describes it"


def _required(ctx: click.Context) -> list[str]:
    """Return the arguments and required options of a command."""
    arguments = [each.make_metavar(ctx) for each in ctx.command.params if isinstance(each, click.Argument)]
    options = [
        f"{max(each.opts, key=len)} {(each.metavar or each.type.name).upper()}"
        for each in ctx.command.params
        if isinstance(each, click.Option) and each.required
    ]
    return [*(["COMMAND"] if isinstance(ctx.command, click.Group) else []), *arguments, *options]
