"""Log lines about incompatible endpoints with their explanations, as text and JSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from cqos_core.formatters import phrases
from cqos_core.formatters.full import render_full
from cqos_core.formatters.json_report import render_json, versioned
from cqos_core.formatters.terminal import clean, hanging, paint, wrap
from cqos_core.model.finding import plural
from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.analysis.runtime_logs import LogExplanation
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style
    from cqos_core.model.system import System


_MOST_PAIRS: Final = 10


# Text


def mismatches_as_text(
    explained: Sequence[LogExplanation], log: str, lines: int, system: System | None, report: Report, style: Style
) -> str:
    """Return the log lines as text, topic by topic, with the pairs and rules that explain them."""
    colors = paint(color=style.color)
    if not explained:
        return f"{clean(log)}: in {plural(lines, 'line')} no program says that an endpoint does not fit\n"
    topics = grouped((each.occurrence.misfit.topic or "a topic that is not named", each) for each in explained)
    text = []
    for topic, members in topics.items():
        text.append(colors(clean(topic), "title"))
        for each in members:
            text += _lines(each, style.width, alone=system is None)
        text.append("")
    if system is None:
        advice = "Of several policies that do not fit, only the last is named. To see all of them, and what to change, "
        text += wrap(f"{advice}give the files of the system too: cqos explain --log {clean(log)} PATH...", style.width)
        return "\n".join(text) + "\n"
    return "\n".join(text) + "\n" + (render_full(report, style) if report.groups else "")


def _lines(each: LogExplanation, width: int, *, alone: bool) -> list[str]:
    misfit, place = each.occurrence.misfit, phrases.position(each.occurrence.place)
    times = "" if each.occurrence.count == 1 else f", {each.occurrence.count} times"
    owner = f" of {misfit.participant}" if misfit.participant else ""
    other, does = ("subscriber", "requests") if misfit.role == "publisher" else ("publisher", "offers")
    named = f": {misfit.named}" if misfit.named else ""
    said = f"{place}{times}: a {misfit.role}{owner} discovered a {other} that {does} what does not fit{named}"
    about = [f"{rule.code} {rule.name}: {rule.because} ({rule.clause})" for rule in each.rules if alone]
    for pair in each.pairs[:_MOST_PAIRS]:
        codes = ", ".join(_codes(each, pair.publisher, pair.subscriber))
        about.append(f"{pair.publisher} and {pair.subscriber}: {pair.verdict}, {codes}")
    if len(each.pairs) > _MOST_PAIRS:
        about.append(f"and {len(each.pairs) - _MOST_PAIRS} more pairs")
    if each.remark:
        about.append(each.remark)
    return [*hanging(width, said, 2), *(line for text in about for line in hanging(width, text, 4))]


def _codes(each: LogExplanation, publisher: str, subscriber: str) -> list[str]:
    return [finding.code for finding in each.findings if {publisher, subscriber} <= {*finding.endpoints}]


# JSON


def mismatches_as_json(explained: Sequence[LogExplanation], log: str, lines: int, report: Report, style: Style) -> str:
    """Return the log lines and their explanations as JSON."""
    return versioned(
        {
            "log": log,
            "lines": lines,
            "misfits": [_misfit(each) for each in explained],
            # As they are in the JSON report.
            "findings": json.loads(render_json(report, style))["findings"],
        }
    )


def _misfit(each: LogExplanation) -> dict[str, Any]:
    misfit, place = each.occurrence.misfit, each.occurrence.place
    return {
        "protocol": misfit.protocol,
        "topic": misfit.topic,
        "participant": misfit.participant,
        "role": misfit.role,
        "named": misfit.named,
        "policies": list(misfit.policies),
        "count": each.occurrence.count,
        "place": {"source": place.source, "line": place.line},
        "rules": [rule.code for rule in each.rules],
        "pairs": [
            {
                "topic": pair.topic,
                "publisher": pair.publisher,
                "subscriber": pair.subscriber,
                "verdict": pair.verdict.value,
                "rules": _codes(each, pair.publisher, pair.subscriber),
            }
            for pair in each.pairs
        ],
        "remark": each.remark or None,
    }
