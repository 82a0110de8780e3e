"""A plugin written for another version, where hooks had more arguments."""

from cqos_core.plugins import hookimpl


@hookimpl
def register_commands(register, settings):
    register(settings)
