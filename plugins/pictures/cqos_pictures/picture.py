"""The picture of a system: its endpoints by owner, and the pairs whose guarantees are shown."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from cqos_core.analysis.explanation import explain_in_pipeline
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.finding import Verdict
from cqos_core.model.problems import CqosError
from cqos_core.model.system import PUBLISHER
from cqos_pictures.picture_parts import Picture, PicturedEnd, RequirementPath

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.report import Report
    from cqos_core.model.system import System
    from cqos_core.resolving.resolved_endpoint import Resolved

MOST_PATHS: Final = 40


def picture_of(report: Report, system: System, where: CheckContext, runs: Sequence[Mapping[str, Any]] = ()) -> Picture:
    """Return the picture of a system and its report, with at most `MOST_PATHS` explained pairs.

    It includes the ``runs`` of pairs of the system.
    """
    pipeline = Pipeline(system, where)
    picture = ends_of(pipeline)
    wanted = list(_wanted(pipeline, report))
    paths = tuple(path for pair in wanted[:MOST_PATHS] if (path := _path(pipeline, *pair)) is not None)
    ids = {each.id for each in picture.ends}
    own = tuple(run for run in runs if {run["publisher"], run["subscriber"]} <= ids)
    return replace(picture, paths=paths, left_out=max(0, len(wanted) - MOST_PATHS), runs=own)


def ends_of(pipeline: Pipeline) -> Picture:
    """Return the picture of a system without paths."""
    _ = pipeline.topics  # which finds the ends of bridges
    owners: dict[str, set[str]] = {}
    ends = []
    for each in pipeline.endpoints:
        owner = _owner(each)
        owners.setdefault(owner, set()).add(each.participant.participant.id)
        ends.append(PicturedEnd(each.id, owner, each.bridge is not None, each.role, each.shown, each.pack.id))
    instances = {owner: len(members) for owner, members in owners.items() if len(members) > 1}
    return Picture(tuple(ends), instances)


def _owner(end: Resolved) -> str:
    if end.bridge is not None:
        return end.bridge[0]
    participant = end.participant.participant
    return participant.template or participant.id


def _wanted(pipeline: Pipeline, report: Report) -> Iterator[tuple[str, Resolved]]:
    """Yield pairs to explain, as the id of the publisher and the subscriber: those with requirements, else one of each group."""
    requiring = {each.id: each for each in pipeline.endpoints if each.endpoint.needs}
    by_id = {each.id: each for each in pipeline.endpoints}
    worst = sorted(report.groups, key=lambda each: -each.verdict.rank)
    far = {each.id for each in pipeline.endpoints if each.bridge is not None}
    if not requiring:
        seen = set()
        for group in worst:
            key = (group.protocol, group.verdict, group.codes, group.topic)
            if key not in seen and group.verdict is not Verdict.INCOMPATIBLE and group.subscribers[0] in by_id:
                seen.add(key)
                yield group.publishers[0], by_id[group.subscribers[0]]
        return
    done = set()
    for group in worst:
        for name in group.subscribers:
            if name in requiring and (first := group.publishers[0]) not in far:
                done.add(name)
                yield first, requiring[name]
    # What arrives over bridges only has no pair with its source in the report.
    if pipeline.hops:
        from cqos_core.behaviour.paths.delivery_paths import DeliveryPaths

        arrivals = DeliveryPaths(pipeline.hops, pipeline.topics)
        sources = [each for each in pipeline.endpoints if each.role == PUBLISHER and each.bridge is None]
        for source in sources[:MOST_PATHS]:
            for name in arrivals.ways(source):
                if name in requiring and name not in done:
                    yield source.id, requiring[name]


def _path(pipeline: Pipeline, publisher: str, subscriber: Resolved) -> RequirementPath | None:
    needs = {name: setting.text for name, setting in subscriber.endpoint.needs.items()}
    try:
        pair = explain_in_pipeline(pipeline, publisher, subscriber.id)
    except CqosError:  # they match through what belongs to neither
        return None
    return RequirementPath(publisher, subscriber.id, needs, pair)
