"""A plugin that names a module where an object is wanted."""

from cqos_core.plugins import CommandInfo, hookimpl


@hookimpl
def register_commands(register):
    register(CommandInfo("bad", "Is in a module, but who is it?", "bad_path.command"))
