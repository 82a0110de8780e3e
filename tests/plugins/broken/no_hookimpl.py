"""A plugin that forgets to mark its hook."""

from cqos_core.plugins import FormatterInfo


def register_formatters(register):
    register(FormatterInfo("unmarked", "nobody calls this", "no_hookimpl:render"))
