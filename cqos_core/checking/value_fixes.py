"""Fixes that set one value of some endpoints, judged by their effect on the pairs of the topic."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.checking.fixes import allowed_change
from cqos_core.language.policy import ENDPOINT
from cqos_core.matching.topic_groups import group
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.matching.topic_groups import MatchedTopic, TopicKey
    from cqos_core.model.finding import Finding, Remedy
    from cqos_core.resolving.resolved_endpoint import Resolved


def with_judged_fixes(findings: Sequence[Finding], topics: Mapping[TopicKey, Sequence[Resolved]]) -> list[Finding]:
    """Return findings whose fixes bring no error and break no pair; others are left out."""
    drafts = [fix for finding in findings for fix in finding.remedies]
    wanted = {member for fix in drafts for member in fix.members}
    found: dict[tuple[str, str], list[TopicKey]] = {}
    for key, ends in topics.items() if wanted else ():
        for each in ends:
            if each.id in wanted:
                found.setdefault((each.id, each.role), []).append(key)
    grouped: dict[TopicKey, MatchedTopic] = {}
    judged = {}
    for fix in drafts:
        keys = {key for member in fix.members for key in found.get((member, fix.role), ())}
        for key in keys - grouped.keys():
            grouped[key] = group(topics[key])
        judged[id(fix)] = _judged(fix, grouped[keys.pop()]) if len(keys) == 1 else []
    return [
        replace(each, remedies=tuple(fix for one in each.remedies for fix in judged[id(one)]))
        if each.remedies
        else each
        for each in findings
    ]


def _judged(fix: Remedy, topic: MatchedTopic) -> list[Remedy]:
    own, others = topic.publishers, topic.subscribers
    if fix.role != PUBLISHER:
        own, others = others, own
    picked = [(each, [end for end in each.endpoints if end.id in fix.members]) for each in own]
    groups = [each.only(ends) for each, ends in picked if ends]
    index = topic.pack.vocabulary.indices[ENDPOINT, fix.policy]
    value = topic.pack.policies[index].domain.parse(fix.value)
    return allowed_change(topic, fix.role, groups, others, index, value)
