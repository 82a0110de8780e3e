"""A plugin with formatters that fail."""

from cqos_core.plugins import FormatterInfo, hookimpl

HERE = "failing_formatter"


@hookimpl
def register_formatters(register):
    register(FormatterInfo("fails", "raises", f"{HERE}:fails", for_people=True))
    register(FormatterInfo("number", "returns no text", f"{HERE}:number"))
    register(FormatterInfo("missing", "is not there", f"{HERE}:missing"))


def fails(report, style):
    return style.paper_size


def number(report, style):
    return len(report.findings)
