"""The group of all commands. Each is imported when it runs, and errors become messages."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

import click

from cqos_core.cli.console import width
from cqos_core.cli.errors import WrongUsageError, say_cqos_error, say_error, say_lines, say_usage_error
from cqos_core.cli.exit_codes import BROKEN_PIPE, INTERNAL, INTERRUPTED, UNUSABLE
from cqos_core.cli.help import help_options, with_help
from cqos_core.cli.parameters import READS_SYSTEMS, Run, debug_option
from cqos_core.model.problems import CqosError, MissingError, describe, keep_traceback
from cqos_core.plugins import FAULTS, load_plugins

_COMPLETING = "_CQOS_COMPLETE"
_WIDEST_HELP = 120  # wider lines are hard to read


class Commands(click.Group):
    """The commands that plugins register, ours among them. Help lists them without importing any."""

    prefix = ""
    """The first word that all names of the group begin with, and a space; empty for the top group."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names, ours first. Commands of several words appear as their first word."""
        names = (name.removeprefix(self.prefix) for name in load_plugins().commands if name.startswith(self.prefix))
        return list(dict.fromkeys(name.partition(" ")[0] for name in names))

    def summaries(self) -> dict[str, str]:
        """Return the summary of each command. A group has that of its first command."""
        found: dict[str, str] = {}
        for info in load_plugins().commands.values():
            if info.name.startswith(self.prefix):
                found.setdefault(info.name.removeprefix(self.prefix).partition(" ")[0], info.summary)
        return found

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command."""
        plugins = load_plugins()
        cmd_name = self.prefix + cmd_name
        info = plugins.commands.get(cmd_name)
        if info is None:
            group = _group_of(cmd_name)
            return group and with_help(group)
        try:
            command = info.load()
            if not isinstance(command, click.Command):
                raise TypeError(f"`{info.command}` is no click command")
        except FAULTS as error:
            if plugins.shipped("commands", cmd_name):
                raise
            what = f"the command `{cmd_name}` of {plugins.owner('commands', cmd_name)}"
            keep_traceback(what, error)
            advice = "`cqos packs` lists the commands that can be loaded"
            raise WrongUsageError(f"{what} cannot be loaded: {describe(error)}", advice, ctx) from error
        if getattr(command.callback, READS_SYSTEMS, False):
            from cqos_core.cli.reading_options import with_importer_options

            command = with_importer_options(command)
        command = with_help(command)
        if _COMPLETING in os.environ:
            from cqos_core.cli.completion import with_completion

            return with_completion(command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command, or refuse the name and propose a similar one."""
        known = self.list_commands(ctx)
        if args[0] not in known and not args[0].startswith("-"):
            from cqos_core.model.spelling import nearest

            _refuse_absent(self.prefix, args)
            near = nearest(args[0], known)
            advice = f"did you mean `{near}`?" if near else f"known: {', '.join(known)}"
            raise WrongUsageError(f"there is no command `{args[0][:60]}`", advice, ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - click's signature
        """Write the list of commands with the summaries that plugins register."""
        plugins = load_plugins()
        for title, shipped in (("Commands", True), ("Commands of plugins", False)):
            rows = [
                (info.name.removeprefix(self.prefix), info.summary)
                for info in plugins.commands.values()
                if info.name.startswith(self.prefix) and plugins.shipped("commands", info.name) is shipped
            ]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def _refuse_absent(prefix: str, arguments: Sequence[str]) -> None:
    """Refuse a command whose distribution is not installed.

    Raises:
        MissingError: with the line that installs it; for the first word of several commands, with each.
    """
    from cqos_core.model.optional_features import absent, advice

    there = absent("commands")
    for words in (prefix + " ".join(arguments[:2]), prefix + arguments[0]):
        meant = {name: row.name for name, row in there.items() if f"{name} ".startswith(f"{words} ")}
        if meant:
            lines = dict.fromkeys(map(advice, meant.values()))
            names = [f"`cqos {name}`" for name in meant]
            verb = "is" if len(names) == 1 else "are"
            raise MissingError(f"{' and '.join(names)} {verb} not installed", "\n".join(lines))


def _group_of(word: str) -> Commands | None:
    """Return the commands whose names begin with a word, if there are any."""
    summaries = [info.summary for name, info in load_plugins().commands.items() if name.startswith(f"{word} ")]
    if not summaries:
        return None
    found = Commands(word, help="\n\n".join(summaries))
    found.prefix = f"{word} "
    return found


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": _WIDEST_HELP},
    epilog="Exit codes: 0 clean, 1 findings at or above the fail level, 2 wrong usage or input that cannot be "
    "read, 3 internal error.",
)
@click.version_option(
    None, "-V", "--version", package_name="cqos-core", prog_name="cqos", message="%(prog)s %(version)s"
)
@debug_option
def cli() -> None:
    """Check quality-of-service settings of publishers and subscribers at design time.

    Reads system files, BPMN diagrams, ROS 2 workspaces and more, matches publishers with subscribers, and reports each pair as
    compatible, incompatible or unknown.

    \b
    Examples:
      cqos check system.yaml
      cqos check model.bpmn --option ros2.rmw=cyclonedds
      cqos check designs/ --format sarif --output cqos.sarif
      cqos rule ROS101
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped


cli.params += help_options()


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command, and return its exit code. Errors are printed on standard error."""
    if _COMPLETING in os.environ:  # a shell asks what could come next
        cli.main(prog_name="cqos")
    given = sys.argv[1:] if arguments is None else list(arguments)
    this = Run(arguments=tuple(given))
    if os.environ.get("CQOS_DEBUG", "") not in {"", "0"}:
        this.enable_debug()
    code = _run(given, this)
    if not this.silent:
        for broken in load_plugins().broken:
            say_lines(str(broken), "warning")
    return code


def _run(arguments: list[str], this: Run) -> int:
    try:
        with cli.make_context("cqos", arguments, obj=this, terminal_width=min(width(), _WIDEST_HELP)) as ctx:
            cli.invoke(ctx)
    except click.exceptions.Exit as request:
        return request.exit_code
    except click.Abort:
        return INTERRUPTED
    except click.ClickException as error:
        if not (isinstance(error, click.NoSuchOption) and _report_absent_option(error)):
            knows = isinstance(error, click.UsageError) and error.ctx is not None
            say_usage_error(error, None if knows else _context_of(arguments))
        return UNUSABLE
    except CqosError as error:
        say_cqos_error(error)
        return UNUSABLE
    except BrokenPipeError:
        _silence()
        return BROKEN_PIPE
    except Exception as error:  # noqa: BLE001 - a traceback is shown on request only
        return _internal(error, this)
    return 0


def _context_of(arguments: Sequence[str]) -> click.Context:
    """Return the click context of the command in ``arguments``: some errors of click lack it."""
    command: click.Command = cli
    ctx = click.Context(command, info_name="cqos")
    for word in arguments:
        found = command.get_command(ctx, word) if isinstance(command, Commands) else None
        if found is None:
            break
        ctx, command = click.Context(found, parent=ctx, info_name=word), found
    return ctx


def _report_absent_option(error: click.NoSuchOption) -> bool:
    """Print how to install an option of commands that read systems; return whether it is one that is not installed."""
    if error.ctx is None or not getattr(error.ctx.command.callback, READS_SYSTEMS, False):
        return False
    from cqos_core.model.optional_features import absent, missing

    row = absent("options").get(error.option_name)
    if row is not None:
        say_cqos_error(missing(row.name, f"the option `{error.option_name}` is not installed"))
    return row is not None


def _silence() -> None:
    """Replace the standard streams, so that their flush at the end of Python cannot fail."""
    sys.stdout = sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - it stays open


def _internal(error: Exception, this: Run) -> int:
    if this.debug:
        import traceback

        traceback.print_exception(error)
    where = "".join(f" while {note}" for note in getattr(error, "__notes__", ()))
    culprit = load_plugins().culprit(error)
    whose = "C-QoS" if culprit is None else f"the plugin `{culprit.plugin}` of {culprit.distribution}"
    advice = (
        f"this is a fault of {whose}, not of your input; run the command again with `cqos --debug …` and report "
        f"what it prints{' to its authors' if culprit else ''}, with the input if you may share it"
    )
    say_error(
        f"internal error{where}{f' in {whose}' if culprit else ''}: {describe(error)}", "" if this.debug else advice
    )
    return INTERNAL
