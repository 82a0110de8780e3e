"""The group of commands, each imported when it is run, and what becomes of errors."""

from __future__ import annotations

import os
import sys
import traceback
from typing import TYPE_CHECKING

import click

from cqos_core.cli import INTERRUPTED
from cqos_core.cli.parameters import Run, debug_option
from cqos_core.cli.streams import say, say_problems
from cqos_core.plugins import load_plugins
from cqos_core.problems import CqosError, InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

USAGE = 2
INTERNAL = 3
_BROKEN_PIPE = 141  # as shells report a command that wrote to nobody


class Commands(click.Group):
    """The commands that plugins register, ours among them; help lists them without importing any."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Name them, ours first."""
        return list(load_plugins().commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command."""
        info = load_plugins().commands.get(cmd_name)
        if info is None:
            return None
        try:
            return info.load()
        except (Exception, SystemExit) as error:
            if _is_ours(cmd_name):
                raise
            owner = load_plugins().owner("commands", cmd_name)
            reason = f"{type(error).__name__}: {error}"
            raise click.UsageError(f"The command `{cmd_name}` of {owner} cannot be loaded: {reason}", ctx) from error

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that is called, or say which one may have been meant."""
        from difflib import get_close_matches

        known = self.list_commands(ctx)
        if args[0] not in known and not args[0].startswith("-"):
            near = get_close_matches(args[0], known, 1, 0.5)
            meant = f" Did you mean `{near[0]}`?" if near else f" There are {', '.join(known)}."
            raise click.UsageError(f"There is no command `{args[0][:60]}`.{meant}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - click's signature
        """Write the list of commands from what plugins say about them."""
        commands = load_plugins().commands.values()
        ours = [(info.name, info.summary) for info in commands if _is_ours(info.name)]
        theirs = [(info.name, info.summary) for info in commands if not _is_ours(info.name)]
        for title, rows in (("Commands", ours), ("Commands of plugins", theirs)):
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def _is_ours(command: str) -> bool:
    return load_plugins().commands[command].command.startswith("cqos_core.")


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit codes: 0 clean, 1 findings at or above the fail level, 2 wrong usage or input that cannot be "
    "read, 3 internal error.",
)
@click.version_option(None, "-V", "--version", package_name="cqos", prog_name="cqos", message="%(prog)s %(version)s")
@debug_option
def cli() -> None:
    """Check at design time whether publishers and subscribers fit in their quality-of-service settings.

    Reads BPMN diagrams and YAML system files, finds every publisher that meets a subscriber, and says: they fit,
    they do not, or it cannot be known.

    \b
    Examples:
      cqos check system.yaml
      cqos check model.bpmn --option ros2.rmw=cyclonedds
      cqos check designs/ --format sarif --output cqos.sarif
      cqos rule ROS101
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code; every error becomes words on standard error."""
    if "_CQOS_COMPLETE" in os.environ:  # a shell asks what could come next
        cli.main(prog_name="cqos")
    this = Run(debug=os.environ.get("CQOS_DEBUG", "") not in {"", "0"})
    code = _run(sys.argv[1:] if arguments is None else list(arguments), this)
    if not this.silent:
        for broken in load_plugins().broken:
            say(str(broken), severity="warning")
    return code


def _run(arguments: list[str], this: Run) -> int:
    try:
        with cli.make_context("cqos", arguments, obj=this) as ctx:
            cli.invoke(ctx)
    except click.exceptions.Exit as request:
        return request.exit_code
    except click.Abort:
        return INTERRUPTED
    except click.ClickException as error:
        error.show()
        return USAGE
    except CqosError as error:
        _tell(error)
        return USAGE
    except BrokenPipeError:
        _silence()
        return _BROKEN_PIPE
    except Exception as error:  # noqa: BLE001 - nobody shall see a traceback who did not ask for one
        return _internal(error, this)
    return 0


def _tell(error: CqosError) -> None:
    if isinstance(error, InputError):
        say_problems(error.problems)
        return
    first, *more = str(error).splitlines() or [type(error).__name__]
    say(first, severity="error")
    for line in more:
        say(line)


def _silence() -> None:
    """Give Python something to flush at its end that does not fail."""
    sys.stdout = sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - it stays open


def _internal(error: Exception, this: Run) -> int:
    if this.debug:
        traceback.print_exception(error)
    where = "".join(f" while {note}" for note in getattr(error, "__notes__", ()))
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    say(f"internal error{where}: {what}", severity="error")
    if not this.debug:
        say(
            "This is a fault of C-QoS or of a plugin, not of your input. Run the command again with `cqos --debug …` "
            "and report what it prints, with the input if you may share it.",
            severity="help",
        )
    return INTERNAL
