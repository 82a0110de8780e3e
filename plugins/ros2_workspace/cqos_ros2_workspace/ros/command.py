"""`ros2 qos check|explain`: commands of C-QoS as an extension of ros2cli.

ros2cli finds `QosCommand` through the entry-point group `ros2cli.command` and calls `add_arguments` and `main`. It needs no base
class, so nothing here imports ROS.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, Final

from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Sequence

    import click

_VERBS: Final = ("check", "explain")


class QosCommand:
    """Check the QoS of publishers and subscribers before a robot runs."""

    NAME = "qos"  # ros2cli sets it to the name of the entry point

    def add_arguments(self, parser: argparse.ArgumentParser, cli_name: str) -> None:
        """Add the verbs, each with the options of the command of `cqos` that has its name."""
        self._parser = parser
        verbs = parser.add_subparsers(
            title="Commands", dest="verb", metavar=f"Call `{cli_name} <command> -h` for more detailed usage."
        )
        for name in _VERBS:
            info = load_plugins().commands[name]
            _add_options(verbs.add_parser(name, help=info.summary, description=info.summary), info.load())

    def main(self, *, parser: argparse.ArgumentParser, args: argparse.Namespace) -> int:  # noqa: ARG002 - as ros2cli calls it
        """Run `cqos` with the same arguments; return its exit code."""
        if args.verb is None:
            self._parser.print_help()
            return 0
        from cqos_core.cli import main

        return main([args.verb, *getattr(args, "forwarded", ()), "--", *args.arguments])


class _Forward(argparse.Action):
    """Keep an option as it was written, in its order: an --output belongs to the --format before it."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,  # noqa: ARG002 - as argparse calls it
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        texts = [values] if isinstance(values, str) else [str(value) for value in values or ()]
        namespace.forwarded = [*getattr(namespace, "forwarded", ()), str(option_string), *texts]


def _add_options(parser: argparse.ArgumentParser, command: click.Command) -> None:
    """Offer the parameters of a command of `cqos`; it checks their values itself."""
    import click

    for parameter in command.params:
        if not isinstance(parameter, click.Option):
            continue
        names = [*parameter.opts, *parameter.secondary_opts]
        count = 0 if parameter.is_flag or parameter.count else parameter.nargs
        parser.add_argument(
            *names,
            action=_Forward,
            nargs=count if count != 1 else None,
            dest="forwarded",
            default=argparse.SUPPRESS,
            metavar=None if count == 0 else parameter.make_metavar(click.Context(command)),
            help=(parameter.help or "").replace("%", "%%"),
        )
    parser.add_argument("arguments", nargs="*", metavar="PATH", help="files, folders or names, as `cqos` takes them")
