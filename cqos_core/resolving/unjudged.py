"""Findings about input that no rule pack judges: endpoints without a pack, needs, and invalid topic names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from cqos_core.model.codes import CODES
from cqos_core.model.core_findings import core_finding
from cqos_core.model.finding import Finding, Severity, Side, plural
from cqos_core.model.suggestions import listed, suggestion
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from cqos_core.model.system import Endpoint, System
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.topic_matching import NameProblem
    from cqos_core.resolving.resolved_endpoint import Resolved, ResolvedSystem


_WrongNames = Mapping[tuple["NameProblem", str, str], Sequence["Endpoint"]]


def unjudged_findings(resolved: ResolvedSystem, names: _WrongNames, known: Collection[str]) -> Iterator[Finding]:
    """Yield the findings about input that no rule pack judges.

    Args:
        resolved: the endpoints with and without packs.
        names: what is wrong with names, by the name and the pack, with all endpoints that use it.
        known: packs to suggest.
    """
    yield from _packless(resolved.packless, known)
    yield from _wrong_names(names, resolved.packs)
    yield from _needs_without_pack(resolved.system, resolved.endpoints)


def _wrong_names(problems: _WrongNames, packs: Mapping[str, RulePack]) -> Iterator[Finding]:
    for (problem, shown, pack_id), endpoints in problems.items():
        rule = packs[pack_id].rule(problem.code)
        core = CODES.get(problem.code)
        first = min(endpoints, key=lambda endpoint: endpoint.id)
        yield Finding(
            code=problem.code,
            name=rule.name if rule else core.name if core else problem.code.lower(),
            severity=Severity(problem.severity),
            message=problem.message,
            source=pack_id,
            topic=shown,
            sides=(Side(first.role, tuple(sorted(endpoint.id for endpoint in endpoints)), place=first.place),),
            because=rule.because if rule else "",
            clause=rule.clause if rule else "",
            help=problem.help or None,
        )


def _packless(left_out: Mapping[str, Sequence[Endpoint]], known: Collection[str]) -> Iterator[Finding]:
    for protocol, endpoints in left_out.items():
        ids = sorted(endpoint.id for endpoint in endpoints)
        message = (
            f"no installed pack judges protocol `{protocol}`: {plural(len(ids), 'endpoint')} left out"
            if protocol
            else f"no protocol is stated for {plural(len(ids), 'endpoint')}, so nothing judges them"
        )
        help_text = (
            f"{suggestion(protocol, known)}; `cqos packs` lists them"
            if protocol
            else f"state `protocol:` in the file, or give --protocol ID; known: {listed(sorted(known)) or 'none'}"
        )
        place = min(endpoints, key=lambda endpoint: endpoint.id).place
        yield core_finding("CQ201", message, place=place, role="endpoint", members=ids, help=help_text)


def _needs_without_pack(system: System, endpoints: Iterable[Resolved]) -> Iterator[Finding]:
    packs = {each.stated_id: each.pack for each in endpoints}
    needing = sorted(
        (
            each
            for each in system.endpoints
            if each.needs and each.role != PUBLISHER and each.id in packs and not packs[each.id].needs
        ),
        key=lambda each: each.id,
    )
    if needing:
        message = (
            f"no installed pack judges `needs`: those of {plural(len(needing), 'endpoint')} were read but not compared"
        )
        place = next(iter(needing[0].needs.values())).place
        ids = [endpoint.id for endpoint in needing]
        yield core_finding("CQ211", message, place=place, role="subscriber", members=ids)
