"""Data of topics and participants for the page: a headline, and pairs, findings and endpoints below it."""

from __future__ import annotations

from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.finding import Severity, Verdict, plural
from cqos_core.model.grouping import grouped
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_pictures.graph import rank
from cqos_pictures.page_text import WORDS, counted, first_names, state, symbol
from cqos_pictures.svg_graph import short

if TYPE_CHECKING:
    from collections.abc import Container, Iterator, Mapping, Sequence

    from cqos_core.model.report import Group, Report
    from cqos_pictures.anchors import Anchors
    from cqos_pictures.findings import FindingLink
    from cqos_pictures.graph import Key, Usage
    from cqos_pictures.picture_parts import PicturedEnd

_MOST_TOPICS: Final = 200
_MOST_OWNERS: Final = 60
_MOST_PAIRS: Final = 20
_MOST_COLUMNS: Final = 12
_MOST_USES: Final = 40
_ARROWS: Final = {PUBLISHER: "▲", SUBSCRIBER: "▼"}
_VERBS: Final = {PUBLISHER: "publishes", SUBSCRIBER: "subscribes"}


def listed(used: Usage, drawn: Container[Key]) -> list[Key]:
    """Return the topics and owners that have an entry on the page, the worst first; owners that are drawn have one."""
    topics = {("topic", name): verdict for name, verdict in used.topics.items()}
    owners = _worst_first(used.owners, used)
    kept = set(sorted(owners, key=lambda each: each not in drawn)[:_MOST_OWNERS])
    return [*_worst_first(topics, used)[:_MOST_TOPICS], *(each for each in owners if each in kept)]


def _worst_first(found: Mapping[Key, Verdict | None], used: Usage) -> list[Key]:
    """Return keys by their verdict; among those of one verdict, first what a finding names."""
    return sorted(found, key=lambda key: (-rank(found[key]), key not in used.wrong, key))


def topic_entries(
    report: Report,
    used: Usage,
    own: Mapping[Key, str],
    anchors: Anchors,
    findings: Mapping[Key, Sequence[FindingLink]],
) -> dict[str, Any]:
    """Return an entry for each listed topic; ``own`` has the anchors of entries, ``findings`` what is about them."""
    groups = grouped((group.topic, group) for group in report.groups)
    paired = {name for group in report.groups for name in (*group.publishers, *group.subscribers)}
    loose = grouped((end.topic, end) for end in used.ends.values() if end.id not in paired)
    topics = [key for key in own if key[0] == "topic"]
    left_out = len(used.topics) - len(topics)
    return {
        "entries": [
            _topic(key, used, own[key], anchors, groups.get(key[1], ()), loose.get(key[1], ()), findings.get(key, ()))
            for key in topics
        ],
        "left_out": [f"{counted(left_out, 'topic')} not shown"] if left_out else [],
    }


def _topic(
    key: Key,
    used: Usage,
    anchor: str,
    anchors: Anchors,
    groups: Sequence[Group],
    loose: Sequence[PicturedEnd],
    findings: Sequence[FindingLink],
) -> dict[str, Any]:
    topic, verdict = key[1], used.topics[key[1]]
    worst = sorted(groups, key=lambda each: -rank(each.verdict))
    publishers = [*dict.fromkeys(name for group in worst for name in group.publishers)]
    subscribers = [*dict.fromkeys(name for group in worst for name in group.subscribers)]
    differ = len({group.verdict for group in groups}) > 1 and min(len(publishers), len(subscribers)) > 1
    pairs = [] if differ else list(islice(_pairs(topic, worst, anchors), _MOST_PAIRS))
    left = 0 if differ else sum(group.pairs for group in groups) - len(pairs)
    roles = Counter(end.role for end in loose)
    sides = ((len(publishers) + roles[PUBLISHER], PUBLISHER), (len(subscribers) + roles[SUBSCRIBER], SUBSCRIBER))
    return {
        **_linked(findings),
        "topic": topic,
        "anchor": anchor,
        "state": state(wrong=key in used.wrong),
        "verdict": WORDS[verdict],
        "symbol": symbol(verdict),
        "sides": ", ".join(plural(count, role) for count, role in sides if count),
        "pairs": pairs,
        "pairs_left": f"{counted(left, 'more pair')} not shown" if left > 0 else "",
        "matrix": [_matrix(topic, worst, publishers, subscribers, anchors)] if differ else [],
        "loose": [
            f"{role} {name} has no partner"
            for role in _ARROWS
            for name in first_names([end.id for end in loose if end.role == role], _MOST_PAIRS)
        ],
    }


def _linked(findings: Sequence[FindingLink]) -> dict[str, Any]:
    """Return the findings about an entry: counted, and as links."""
    counts = Counter(each.severity for each in findings)
    return {
        "counts": [
            {"severity": severity.value, "count": plural(counts[severity], severity.value)}
            for severity in Severity
            if counts[severity]
        ],
        "links": [each._asdict() for each in findings[:_MOST_PAIRS]],
        "has_links": bool(findings),
    }


def _pairs(topic: str, groups: Sequence[Group], anchors: Anchors) -> Iterator[dict[str, str]]:
    for group in groups:
        for publisher in group.publishers:
            for subscriber in group.subscribers:
                yield {
                    "anchor": anchors.give("pair", "", topic, publisher, subscriber),
                    "publisher": publisher,
                    "subscriber": subscriber,
                    "verdict": WORDS[group.verdict],
                    "symbol": symbol(group.verdict),
                    "codes": ", ".join(first_names(group.codes, 4)),
                }


def _matrix(
    topic: str, groups: Sequence[Group], publishers: Sequence[str], subscribers: Sequence[str], anchors: Anchors
) -> dict[str, Any]:
    """Return publishers as rows and subscribers as columns, those of the worst pairs first."""
    rows, columns = publishers[:_MOST_PAIRS], subscribers[:_MOST_COLUMNS]
    wanted, beside = set(rows), set(columns)
    verdicts: dict[tuple[str, str], Verdict] = {}
    for group in groups:
        for publisher in wanted.intersection(group.publishers):
            for subscriber in beside.intersection(group.subscribers):
                verdicts.setdefault((publisher, subscriber), group.verdict)
    sides = (
        (len(publishers) - len(rows), PUBLISHER),
        (len(subscribers) - len(columns), SUBSCRIBER),
    )
    return {
        "columns": [{"name": name, "short": short(name)} for name in columns],
        "rows": [
            {
                "name": name,
                "cells": [_cell(topic, name, other, verdicts.get((name, other)), anchors) for other in columns],
            }
            for name in rows
        ],
        "left_out": [f"{counted(left, role)} not shown" for left, role in sides if left],
    }


def _cell(topic: str, publisher: str, subscriber: str, verdict: Verdict | None, anchors: Anchors) -> dict[str, str]:
    if verdict is None:
        return {"anchor": "", "verdict": "unmatched", "symbol": symbol(None), "says": "no pair"}
    anchor = anchors.give("pair", "", topic, publisher, subscriber)
    return {"anchor": anchor, "verdict": WORDS[verdict], "symbol": symbol(verdict), "says": WORDS[verdict]}


def owner_entries(used: Usage, own: Mapping[Key, str], findings: Mapping[Key, Sequence[FindingLink]]) -> dict[str, Any]:
    """Return an entry for each listed participant and bridge: what it publishes and subscribes to."""
    uses = grouped((owner, topic) for owner, topic in used.roles)
    owners = [key for key in own if key[0] != "topic"]
    left_out = len(used.owners) - len(owners)
    return {
        "entries": [_owner(key, used, own, uses[key], findings.get(key, ())) for key in owners],
        "left_out": [f"{counted(left_out, 'participant')} not shown"] if left_out else [],
    }


def _owner(
    key: Key, used: Usage, own: Mapping[Key, str], topics: Sequence[str], findings: Sequence[FindingLink]
) -> dict[str, Any]:
    kind, name = key
    verdict = used.owners[key]
    uses = [
        (used.verdicts[key, topic, role], topic, role)
        for topic in topics
        for role in _ARROWS
        if role in used.roles[key, topic]
    ]
    uses.sort(key=lambda each: (-rank(each[0]), each[1]))
    roles = Counter(role for _, _, role in uses)
    sides = [f"{_VERBS[role]} {roles[role]}" for role in _ARROWS if roles[role]]
    return {
        **_linked(findings),
        "name": name,
        "anchor": own[key],
        "state": state(wrong=key in used.wrong),
        "verdict": WORDS[verdict],
        "symbol": symbol(verdict),
        "sides": ", ".join([*(["bridge"] if kind == "bridge" else []), *sorted(used.protocols[key]), *sides]),
        "uses": [
            {
                "arrow": _ARROWS[role],
                "verb": _VERBS[role],
                "topic": topic,
                "verdict": WORDS[each],
                "symbol": symbol(each),
                "target": f"#{own['topic', topic]}" if ("topic", topic) in own else "",
            }
            for each, topic, role in uses[:_MOST_USES]
        ],
        "uses_left": f"{counted(len(uses) - _MOST_USES, 'more topic')} not shown" if len(uses) > _MOST_USES else "",
    }
