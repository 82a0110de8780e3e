"""A plugin with commands that fail."""

import click

from cqos_core.plugins import CommandInfo, hookimpl

HERE = "failing_command"


@hookimpl
def register_commands(register):
    register(CommandInfo("fail", "Raise.", f"{HERE}:fail"))
    register(CommandInfo("plain", "Is no command.", f"{HERE}:plain"))
    register(CommandInfo("missing", "Is not there.", f"{HERE}:missing"))


@click.command()
def fail():
    raise ZeroDivisionError("by zero")


def plain():
    click.echo("plain")
