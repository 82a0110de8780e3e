"""Rules over a whole topic: all endpoints that match on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_core.language.bound_condition import Signal
from cqos_core.language.relation import positions
from cqos_core.matching.judge import Violation, ask, signals_on, speaking_of
from cqos_core.matching.rule_hits import Hit
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.language.values import Values
    from cqos_core.matching.topic_groups import GroupKey, TopicShape
    from cqos_core.packs.bound_rule import BoundRule


def signal_hits(shape: TopicShape, met_by: Sequence[int]) -> Iterator[Hit[int]]:
    """Yield the hits of the rules over topics; ``met_by`` has per publisher group the subscriber groups that it matches, as bits."""
    rules = _may_report(shape)
    for publishers, subscribers in _parts(shape, met_by) if rules else ():
        for bound in rules:
            within = {use.second for use in bound.bound.aggregate_uses}
            for violation, role, targets in _signal_rule(shape, bound, publishers, subscribers):
                hit = Hit[int](violation)
                if targets:
                    hit.tags = shape.side(role)[targets[0]].tags
                    hit.side(role).update(dict.fromkeys(targets))
                if within != {True} and not hit.publishers:
                    hit.publishers = dict.fromkeys(publishers)
                if within != {False} and not hit.subscribers:
                    hit.subscribers = dict.fromkeys(subscribers)
                yield hit


def _may_report(shape: TopicShape) -> Sequence[BoundRule]:
    """Return the rules over topics that may report; of several groups on one side, which may differ, all."""
    signals = shape.pack.by_scope.get("signal", ())
    if max(len(shape.publishers), len(shape.subscribers)) > 1:
        return signals
    found = 0
    for role in (PUBLISHER, SUBSCRIBER):
        for alike in shape.side(role):
            found |= signals_on(alike.profile, role, alike.observed)
    return [signals[position] for position in positions(found)]


def _parts(shape: TopicShape, met_by: Sequence[int]) -> list[tuple[list[int], list[int]]]:
    """Split a topic into parts that do not meet each other (domains, partitions), each a signal of its own."""
    if not shape.publishers:
        return [([], list(range(len(shape.subscribers))))]
    parts: dict[int, tuple[list[int], int]] = {}  # by the publisher that was the last to join one
    owners: dict[int, int] = {}  # by subscriber, its part when it joined
    joined = list(range(len(met_by)))  # by part, what it became
    covered = 0
    for publisher, met in enumerate(met_by):
        touched, old = set(), met & covered
        while old:
            part = owners[(old & -old).bit_length() - 1]
            while joined[part] != part:
                joined[part] = part = joined[joined[part]]
            touched.add(part)
            old &= ~parts[part][1]
        together, reached = [publisher], met
        for part in sorted(touched):
            joined[part] = publisher
            others, mask = parts.pop(part)
            others += together
            together, reached = others, reached | mask
        parts[publisher] = (together, reached)
        owners.update(dict.fromkeys(positions(met & ~covered), publisher))
        covered |= met
    return [(publishers, list(positions(mask))) for publishers, mask in parts.values()]


def _signal_rule(
    shape: TopicShape, bound: BoundRule, publishers: Sequence[int], subscribers: Sequence[int]
) -> Iterator[tuple[Violation, str, Sequence[int]]]:
    """Judge a rule over a whole topic; one about single endpoints comes with the groups concerned."""
    read = bound.bound.aggregated
    signal = Signal(_distinct(shape.publishers, publishers, read), _distinct(shape.subscribers, subscribers, read))
    role = speaking_of(bound)
    at = role or (PUBLISHER if publishers else SUBSCRIBER)
    groups, speaking = shape.side(at), publishers if at == PUBLISHER else subscribers
    for alike in _sorted(groups, speaking, bound.bound.own) if role is not None else [speaking[:1]]:
        values = groups[alike[0]].profile.values
        violation = ask(bound, values, values, signal)
        if violation is not None and not (violation.unknown and violation.failed is None):
            yield violation, at, alike if role is not None else ()


def _sorted(groups: Sequence[GroupKey], chosen: Iterable[int], indices: Sequence[int]) -> list[list[int]]:
    """Sort groups by their values at ``indices``, and by the acceptances that name them."""
    found: dict[Any, list[int]] = {}
    for position in chosen:
        values = groups[position].profile.values
        found.setdefault((tuple([values[index] for index in indices]), groups[position].tags), []).append(position)
    return list(found.values())


def _distinct(
    groups: Sequence[GroupKey], chosen: Iterable[int], indices: Sequence[int]
) -> tuple[tuple[Values, int], ...]:
    """Return one value tuple per combination of values at ``indices``, with its number of endpoints."""
    return tuple(
        (groups[alike[0]].profile.values, sum(groups[position].size for position in alike))
        for alike in _sorted(groups, chosen, indices)
    )
