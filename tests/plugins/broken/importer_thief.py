"""A plugin that takes the name of an importer that we ship."""

from cqos_core.plugins import FormatterInfo, ImporterInfo, hookimpl


@hookimpl
def register_formatters(register):
    register(FormatterInfo("innocent", "goes the way of the rest of its plugin", "importer_thief:render"))


@hookimpl
def register_importers(register):
    register(ImporterInfo("bpmn", "not ours", (".bpmn",), "importer_thief:claims", "importer_thief:read"))
