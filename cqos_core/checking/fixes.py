"""Fixes of one finding: single changes of a value that satisfy its rule, with their effect on the topic's pairs."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_core.language.domains import Duration
from cqos_core.language.policy import BROKER, ENDPOINT, NEED, TOPIC
from cqos_core.language.solutions import restated, solutions
from cqos_core.language.values import FromPeers, Value
from cqos_core.matching.judge import Violation, failed_match_conditions, judge_endpoint, judge_pair, of_end
from cqos_core.matching.topic_groups import member_ids
from cqos_core.model.core_findings import VERBS
from cqos_core.model.finding import Finding, Remedy
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.resolving.setting_edits import edits_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.model.system import Role
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

    Groups: TypeAlias = Sequence[EndpointGroup]

LEVELS: Final = (ENDPOINT, "participant")
"""Levels of policies that belong to an endpoint alone."""
_PARTNERS_ASKED: Final = 20
"""Groups of partners with which each changed endpoint is tried before a change is offered."""
_EFFECT_LIMIT: Final = 500
"""Judgements that counting the effect of one remedy may take."""

_CHANGED: Final = 1_024
"""Changed profiles that are cached: each is needed when a change is tried, when it is offered, and for its effect."""


def remedies(topic: MatchedTopic, violation: Violation, publishers: Groups, subscribers: Groups) -> tuple[Remedy, ...]:
    """Return the changes of one value that make the rule pass; that of the fewest endpoints first."""
    bound, pair = violation.bound, violation.bound.scope == "pair"
    if bound.scope == "signal":
        return ()
    a, b = ((groups or publishers or subscribers)[0].profile.values for groups in (publishers, subscribers))

    def changes(
        role: Role, fixes: tuple[str, ...] = bound.rule.fixes, levels: Collection[str] = LEVELS
    ) -> list[Remedy]:
        """The changes of one side."""
        own, partners = (publishers, subscribers) if role == PUBLISHER else (subscribers, publishers)
        others = topic.subscribers if role == PUBLISHER else topic.publishers
        may = partial(_may, role, own, partners if pair else (), others)
        second, want = pair and role == SUBSCRIBER, bound.rule.kind != "forbids"
        found = solutions(bound.bound, a, b, second=second, want=want, fixes=fixes, pair=pair, may=may, levels=levels)
        return [remedy for each in found for remedy in _remedy(topic, role, own, each.index, each.value)]

    found = _shared(topic, violation, publishers, subscribers)
    # A guarantee may rest on one side alone.
    found += changes(PUBLISHER) if publishers else []
    found += changes(SUBSCRIBER) if subscribers and (pair or not publishers) else []
    if pair and bound.rule.guarantee and not found:
        # Where no setting gives it, only less can be required.
        found = changes(SUBSCRIBER, (f"{NEED}.{bound.rule.guarantee}",), (NEED,))
    # A change for advice or an unknown verdict must not break a pair that connects today.
    pays = bound.rule.severity == "error" and not violation.unknown and not bound.rule.doubt
    return tuple(sorted((each for each in found if pays or not each.breaks), key=_rank))


def _shared(topic: MatchedTopic, violation: Violation, publishers: Groups, subscribers: Groups) -> list[Remedy]:
    """Return the changes of a target that the endpoints share: their broker, or the topic."""
    bound = violation.bound
    first, second = (publishers or subscribers)[0], (subscribers or publishers)[0]
    groups = [*publishers, *subscribers]
    role: Role = PUBLISHER if publishers else SUBSCRIBER
    found = []
    for level in (BROKER, TOPIC):
        broker = first.first.participant.broker
        if level == BROKER and (broker is None or topic.pack.is_fixed(broker)):
            continue  # nothing says which broker it is, or its users cannot change it
        sharing = _sharing(topic, first, level)
        for change in solutions(
            bound.bound,
            *(first.profile.values, second.profile.values),
            second=False,
            want=bound.rule.kind != "forbids",
            fixes=bound.rule.fixes,
            pair=bound.scope == "pair",
            # Others may rest on what a broker promises, so it is never made to promise less.
            may=partial(_all_may, topic, sharing, groups),
            levels=(level,),
        ):
            found += _remedy(topic, role, groups, change.index, change.value, sharing)
    return found


def _sharing(topic: MatchedTopic, one: EndpointGroup, level: str) -> list[EndpointGroup]:
    """Return the groups of a topic for which another value holds too, where it changes for one of them."""
    broker = one.first.participant.broker
    return [
        members
        for members in (*topic.publishers, *topic.subscribers)
        if level == TOPIC or members.first.participant.broker is broker
    ]


def _all_may(topic: MatchedTopic, sharing: Groups, groups: Groups, index: int, value: Plain) -> bool:
    """Whether a change of all that share a value brings no error of theirs, nor of pairs of ``groups``, that was not there."""
    policy = topic.pack.policies[index]
    if any(policy.weakens(members.profile.values[index], value) for members in sharing):
        return False
    after = {id(members): _with(members.profile, index, value) for members in sharing}
    for members in sharing[:_PARTNERS_ASKED]:
        role, then = members.first.endpoint.role, after[id(members)]
        if _new(judge_endpoint(then, role, members.observed), judge_endpoint(members.profile, role, members.observed)):
            return False
    return not any(
        _new(
            judge_pair(after.get(id(p), p.profile), after.get(id(s), s.profile)).violations,
            judge_pair(p.profile, s.profile).violations,
        )
        for p, s in islice(_pairs_of(topic, groups), _PARTNERS_ASKED)
    )


def _pairs_of(topic: MatchedTopic, groups: Iterable[EndpointGroup]) -> Iterator[tuple[EndpointGroup, EndpointGroup]]:
    """Yield the pairs of groups in which any of some takes part, each once."""
    groups = list(groups)
    senders = {id(members) for members in groups if members.first.role == PUBLISHER}
    for members in groups:
        if members.first.role == PUBLISHER:
            yield from ((members, partner) for partner in topic.subscribers)
        else:
            yield from ((partner, members) for partner in topic.publishers if id(partner) not in senders)


def _may(role: Role, groups: Groups, partners: Groups, others: Groups, index: int, value: Plain) -> bool:
    """Whether a change brings no error of its endpoints, nor of their pairs with ``partners``, that was not there before.

    A pair with ``others`` may get a worse verdict, which is counted and shown, but no further error beside its own.
    """
    for members in groups:
        before, after = members.profile, _with(members.profile, index, value)
        if _new(judge_endpoint(after, role, members.observed), judge_endpoint(before, role, members.observed)):
            return False
        if _left_open("endpoint", index, after, after, role):
            return False
        for partner in others[:_PARTNERS_ASKED]:
            then, now = (_violations(profile, partner.profile, role) for profile in (before, after))
            ends = (after, partner.profile) if role == PUBLISHER else (partner.profile, after)
            if _left_open("pair", index, *ends):
                return False
            if _new(now, then) and (partner in partners or _errors(then)):
                return False
    return True


@lru_cache(maxsize=_CHANGED)
def _with(profile: QosProfile, index: int, value: Plain) -> QosProfile:
    return profile.with_values(restated(profile.values, profile.pack.vocabulary, index, value))


def _errors(violations: Iterable[Violation]) -> set[str]:
    return {each.bound.rule.code for each in violations if each.bound.rule.severity == "error" and not each.unknown}


def _new(after: Iterable[Violation], before: Sequence[Violation]) -> set[str]:
    """Return the errors that a change brings or may bring; values that follow from the changed one are unknown."""
    unknown = {each.bound.rule.code for each in before if each.unknown}
    possible = {each.bound.rule.code for each in after if each.bound.rule.severity == "error"}
    return possible - _errors(before) - unknown | (_errors(after) - _errors(before))


def _left_open(scope: str, index: int, a: QosProfile, b: QosProfile, role: str | None = None) -> bool:
    """Return whether a change may violate a rule that forbids, because values that follow from it are unknown."""
    vocabulary = a.pack.vocabulary
    following = vocabulary.following.get(vocabulary.policies[index].name, ())
    return bool(following) and any(
        bound.bound.judge(a.values, b.values).result is None
        for bound in a.pack.by_scope.get(scope, ())
        if bound.rule.kind == "forbids" and bound.rule.severity == "error"
        if scope == "pair" or bound.role in {None, role}
        if any(use.index in following for use in bound.bound.uses)
    )


def _violations(changing: QosProfile, partner: QosProfile, role: str) -> tuple[Violation, ...]:
    publisher, subscriber = (changing, partner) if role == PUBLISHER else (partner, changing)
    return judge_pair(publisher, subscriber).violations


def _rank(remedy: Remedy) -> tuple[Any, ...]:
    return (
        bool(remedy.breaks),
        len(remedy.members),
        remedy.weakens,
        remedy.kind == "needs_code",
        -(remedy.mends or 0),
        remedy.role != PUBLISHER,
        remedy.policy,
    )


def _remedy(
    topic: MatchedTopic, role: Role, groups: Groups, index: int, value: Plain, changing: Groups = ()
) -> list[Remedy]:
    """Return the change of groups, unless nothing can make it; ``changing`` are all that change with them."""
    policy = topic.pack.policies[index]
    first = groups[0].first
    if policy.level == "endpoint" and role not in policy.roles:
        return []
    if not all(takes(members.first, index) for members in groups):
        return []
    weakens = any(policy.weakens(members.profile.values[index], value) for members in groups)
    changing = changing or groups
    if (
        policy.level != BROKER
        and not weakens
        and _reaches_far(changing, index)
        and _required_elsewhere(topic, changing)
    ):
        return []  # more on this topic may be too much for another one, which is not judged here
    improves, breaks = effect(topic, changing, index, value)
    after = {id(members): _with(members.profile, index, value) for members in changing}
    members = member_ids(groups)
    text_value = policy.domain.format(value)
    from cqos_core.behaviour.paths.growth import growth_in_words  # a correct design needs none of it

    return [
        Remedy(
            role=role,
            members=members,
            policy=policy.name,
            value=text_value,
            kind="needs_code" if is_promise(policy, groups[0].profile.values[index], value, role) else "configuration",
            text=remedy_text(role, policy.name, text_value, members, policy.level, _named(first, policy.level)),
            mends=improves,
            breaks=breaks,
            weakens=weakens,
            edits=edits_of((each for members in groups for each in members.endpoints), index, value),
            costs=growth_in_words(topic, changing, {}, after),
        )
    ]


def allowed_change(
    topic: MatchedTopic, role: Role, groups: Groups, others: Groups, index: int, value: Plain
) -> list[Remedy]:
    """Return the change of groups to a value, unless it brings an error or breaks a pair with the ``others``, or nothing can make it."""
    found = _remedy(topic, role, groups, index, value) if _may(role, groups, (), others, index, value) else []
    return [each for each in found if each.breaks == 0]


def takes(endpoint: Resolved, index: int) -> bool:
    """Whether another value of a policy changes anything of an endpoint."""
    if endpoint.origin(index)[0] == "ignored by the middleware":
        return False
    policy = endpoint.pack.policies[index]
    meaning = policy.words.get(policy.domain.word(endpoint.written(index) or ""))
    return not (isinstance(meaning, FromPeers) and meaning.side == "first")  # copied from the first peer


def is_promise(policy: Policy, current: Value, value: Plain, role: str) -> bool:
    """Whether the change makes the program promise more than it did: a shorter period, or a stronger kind."""
    if not policy.promise or role != PUBLISHER:
        return False
    if not isinstance(current, int) or not isinstance(value, int):
        return True
    return value < current if isinstance(policy.domain, Duration) else value > current


def _where(members: Sequence[str]) -> str:
    more = len(members) - 1
    return members[0] if not more else f"{members[0]} and {more} more"


def _named(endpoint: Resolved, level: str) -> str:
    """Return the target of a change if it is not an endpoint."""
    if level == BROKER and endpoint.participant.broker is not None:
        return f"of broker {endpoint.participant.broker.id}"
    if level == TOPIC:
        return f"of topic {endpoint.shown}"
    return ""


def remedy_text(
    role: str, policy: str, value: str, members: Sequence[str], level: str = "endpoint", shared: str = ""
) -> str:
    """The change in words: ``offer reliability `reliable` on robot/scan``; ``shared`` is the target if it is not an endpoint."""
    if shared:
        return f"set {policy} `{value}` {shared}"
    where = _where(members)
    if level == NEED:
        return f"require {policy.removeprefix(f'{NEED}.')} `{value}` on {where}"
    verb = VERBS[role][1] if level == "endpoint" else "set"
    of = "" if level == "endpoint" else " of the participant"
    return f"{verb} {policy} `{value}`{of} on {where}"


def effect(topic: MatchedTopic, groups: Groups, index: int, value: Plain) -> tuple[int | None, int | None]:
    """Return the number of pairs of the topic that a change improves, and the number that it worsens; None if counting would take too long."""
    if len(groups) * max(len(topic.publishers), len(topic.subscribers)) > _EFFECT_LIMIT or _reaches_far(groups, index):
        return None, None
    improves = breaks = 0
    after = {id(members): _with(members.profile, index, value) for members in groups}
    for publisher, subscriber in _pairs_of(topic, groups):
        before = _rank_of(publisher, publisher.profile, subscriber, subscriber.profile)
        then = _rank_of(
            *(publisher, after.get(id(publisher), publisher.profile)),
            *(subscriber, after.get(id(subscriber), subscriber.profile)),
        )
        count = len(publisher.endpoints) * len(subscriber.endpoints)
        improves += count if then < before else 0
        breaks += count if then > before else 0
    return improves, breaks


def _reaches_far(groups: Iterable[EndpointGroup], index: int) -> bool:
    """Return whether values that bound endpoints of other topics follow from a value."""
    return any(
        vocabulary.policies[at].together
        for members in groups
        for vocabulary in [members.profile.pack.vocabulary]
        for at in vocabulary.follows(vocabulary.policies[index].name, members.profile.values)
    )


def _required_elsewhere(topic: MatchedTopic, groups: Groups) -> bool:
    """Whether a participant of changed groups, or of their partners, requires guarantees on another topic."""
    reached = (*groups, *topic.subscribers) if groups[0].first.role == PUBLISHER else groups
    return any(endpoint.participant.requiring - {topic.key} for members in reached for endpoint in members.endpoints)


def _rank_of(publisher: EndpointGroup, offered: QosProfile, subscriber: EndpointGroup, requested: QosProfile) -> int:
    """Verdict of a pair by rank, with what its ends allow at best; a pair that does not meet is worse than any verdict."""
    if failed_match_conditions(offered, requested):
        return 3
    ends = (
        *of_end(offered, PUBLISHER, publisher.observed, publisher.wired),
        *of_end(requested, SUBSCRIBER, subscriber.observed, subscriber.wired),
    )
    return max(judge_pair(offered, requested).verdict.rank, *(verdict.rank for verdict, _ in ends), 0)


def merged_remedies(findings: Sequence[Finding]) -> tuple[Remedy, ...]:
    """Remedies that every one of the findings has, over all their members."""
    by_change: dict[tuple[str, str, str], list[tuple[str | None, Remedy]]] = {}
    for finding in findings:
        for remedy in finding.remedies:
            by_change.setdefault((remedy.role, remedy.policy, remedy.value), []).append((finding.topic, remedy))
    found = []
    for same in by_change.values():
        if len(same) == len(findings):
            members = tuple(sorted({member for _, remedy in same for member in remedy.members}))
            # On one topic a change of the same endpoints is the same change, and has been counted with all its partners.
            each = list({(topic, remedy.members): remedy for topic, remedy in same}.values())
            places = {(topic, member) for topic, remedy in same for member in remedy.members}
            known = len(places) == sum(len(remedy.members) for remedy in each)
            improves, breaks = (_sum(r.mends for r in each), _sum(r.breaks for r in each)) if known else (None, None)
            texts = {remedy.text for _, remedy in same}
            first = same[0][1]
            text = first.text.removesuffix(_where(first.members)) + _where(members) if len(texts) > 1 else first.text
            # One part that cannot be edited leaves the change half done.
            parts = [remedy.edits for _, remedy in same]
            edits = tuple(dict.fromkeys(edit for part in parts for edit in part)) if all(parts) else ()
            weakens = any(remedy.weakens for _, remedy in same)
            costs = tuple(dict.fromkeys(cost for _, remedy in same for cost in remedy.costs))
            merged = replace(same[0][1], members=members, text=text, mends=improves, breaks=breaks)
            found.append(replace(merged, weakens=weakens, edits=edits, costs=costs))
    return tuple(sorted(found, key=_rank))


def _sum(counts: Iterable[int | None]) -> int | None:
    """The sum, unless one of the numbers was not counted."""
    known = list(counts)
    return None if None in known else sum(count for count in known if count is not None)
