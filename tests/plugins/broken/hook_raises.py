"""A plugin that registers one thing, and then fails: the half it registered must not stay."""

from cqos_core.plugins import FormatterInfo, hookimpl


@hookimpl
def register_formatters(register):
    register(FormatterInfo("half", "registered before the failure", "hook_raises:render"))
    raise LookupError("no such table")
