"""Findings about links: values that cannot be read, and overload."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.behaviour.paths.budgets import budgets_of_system
from cqos_core.behaviour.paths.link_facts import rate_text
from cqos_core.model.core_findings import core_finding
from cqos_core.model.suggestions import listed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.behaviour.paths.budgets import LinkLoad
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.model.finding import Finding


def budget_findings(pipeline: Pipeline) -> list[Finding]:
    """Return findings about links that are, or may be, overloaded. Verdicts of pairs do not change."""
    found = budgets_of_system(pipeline)
    return [
        *(core_finding("CQ811", each.message, place=each.place, help=each.help) for each in found.faults),
        *(finding for load in found.loads for finding in _of_load(load)),
    ]


def _of_load(load: LinkLoad) -> Iterator[Finding]:
    rate, link = load.facts.rate, load.link
    if rate is None:
        return
    where = f"{'to' if load.inward else 'from'} {listed([f'`{each}`' for each in link.participants], 3)}"
    carries = f"and it carries {rate_text(rate)}"
    topics = listed([f"`{name}`" for name in sorted({each.topic for each in load.streams})], 5)
    if load.certain > rate:
        message = f"link `{link.name}`: samples {where} take at least {rate_text(load.certain)}, {carries}: {topics}"
        yield core_finding("CQ812", message, place=link.settings["rate"].place)
    elif load.likely is not None and load.likely > rate:
        message = (
            f"link `{link.name}`: samples {where} take {rate_text(load.certain)} without headers and "
            f"{rate_text(load.likely)} with headers and a copy for each receiver, {carries}: {topics}"
        )
        yield core_finding("CQ813", message, place=link.settings["rate"].place)
