"""A plugin that misspells a hook."""

from cqos_core.plugins import hookimpl


@hookimpl
def register_importer(register):
    register(None)
