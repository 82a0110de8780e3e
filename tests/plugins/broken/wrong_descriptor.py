"""A plugin that registers something as something else."""

from cqos_core.plugins import FormatterInfo, hookimpl


@hookimpl
def register_importers(register):
    register(FormatterInfo("table", "no importer", "wrong_descriptor:render"))
