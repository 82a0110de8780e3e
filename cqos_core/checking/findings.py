"""Makes findings of rules that report: words, values of both sides with their origins, fixes and causes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from cqos_core.language.binder import parts
from cqos_core.language.domains import Choice
from cqos_core.language.values import START_ORDER, Anything, Depends, Value, is_plain
from cqos_core.matching.judge import verdict_of
from cqos_core.matching.topic_groups import member_ids
from cqos_core.model.core_findings import VERBS
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Fact, Finding, Severity, Side, Verdict
from cqos_core.model.lazy_tuple import lazy_tuple
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.resolving.finding_facts import bare_fact, fact

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.language.bound_condition import BoundCondition
    from cqos_core.language.values import Values
    from cqos_core.language.vocabulary import Use
    from cqos_core.matching.judge import Violation
    from cqos_core.matching.rule_hits import Hit
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.model.finding import Remedy
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.resolving.qos_profile import QosProfile
    from cqos_core.resolving.resolved_endpoint import Resolved

_F = TypeVar("_F")
_T = TypeVar("_T")
SCOPES: Final[dict[str, str]] = {PUBLISHER: "offered", SUBSCRIBER: "requested"}
LABELS: Final[dict[str, str]] = {PUBLISHER: "offered here", SUBSCRIBER: "requested here"}


@dataclass(frozen=True, slots=True)
class FindingDraft:
    """A finding before it is merged with others and accepted.

    Attributes:
        cause: the facts without which a rule over pairs is undecided; empty for any other finding.
        guarantee: the word of a guarantee that they leave open.
    """

    finding: Finding
    merge_key: tuple[Any, ...]
    tags: frozenset[int]
    cause: tuple[str, ...] = ()
    guarantee: str = ""


def _is_news(resolved: Resolved, group: EndpointGroup, index: int, *, meeting: bool) -> bool:
    """Whether a value helps to understand a finding: of options and topics, only a stated one.

    Where endpoints do not meet, it may be the default of one side that keeps them apart.
    """
    if resolved.pack.policies[index].level == "endpoint" or resolved.written(index) is not None:
        return True
    return meeting and is_plain(group.value(index))


def _side(role: str, groups: Sequence[EndpointGroup], uses: Iterable[Use], *, meeting: bool, for_words: bool) -> Side:
    """The side's members sorted, with the facts and the place of the first one; words need no places and origins."""
    members = member_ids(groups)
    leader, group = next(
        (endpoint, group) for group in groups for endpoint in group.endpoints if endpoint.id == members[0]
    )
    indices = dict.fromkeys([use.index for use in uses if _is_news(leader, group, use.index, meeting=meeting)])
    if for_words:
        return Side(role, members, "", tuple([bare_fact(leader, group.value(index), index) for index in indices]))
    facts = tuple([fact(leader, group.profile, index) for index in indices])
    return Side(role, members, LABELS.get(role, "set here"), facts, leader.endpoint.place)


def subject(side: Side) -> str:
    """``publisher `a``` or ``publisher `a` (and 3 more)``: one of them, so that the verb of any sentence agrees."""
    more = len(side.members) - 1
    return f"{side.role} `{side.members[0]}`" + (f" (and {more} more)" if more else "")


def _values(facts: Iterable[Fact]) -> str:
    listed = [f"{each.policy} {each.value}" for each in facts]
    return listed[0] if len(listed) == 1 else f"{', '.join(listed[:-1])} and {listed[-1]}" if listed else ""


class _Words(dict[str, str]):
    """Replacements of a headline template; an unknown one stays visible."""

    def __missing__(self, key: str) -> str:
        return "{" + key + "}"


def _template_words(sides: Sequence[Side], topic: str) -> _Words:
    words = _Words(topic=topic)
    for side in sides:
        words[side.role] = subject(side)
        words.setdefault("endpoint", subject(side))
        scope = SCOPES.get(side.role, side.role)
        for each in side.facts:
            words[f"{scope} {each.policy}"] = each.value
            words.setdefault(each.policy, each.value)
    return words


def headline(violation: Violation, sides: Sequence[Side], topic: str, because: Sequence[str] = ()) -> str:
    """Return one sentence that makes sense alone: the rule's own, or derived from the values of both sides."""
    rule = violation.bound.rule
    stated = [side for side in sides if side.role in VERBS]
    if violation.unknown and rule.guarantee:
        names = _assumptions(label for label, _ in violation.outcome.worlds)
        return _guarantees_open(stated, [rule.guarantee], names, because)
    if violation.unknown:
        policies = " and ".join(dict.fromkeys(each.policy for side in stated for each in _compared(violation, side)))
        subjects = " and ".join(subject(side) for side in reversed(stated))
        fit = f"whether {subjects} fit in {policies}"
        if len(stated) == 1:
            fit = f"whether {policies} of {subjects} will do"
        if tuple(because) == (START_ORDER,):
            return f"depends on start order: {fit}"
        names = _assumptions(label for label, _ in violation.outcome.worlds)
        return f"{fit} is not known: {_why_unknown(names, because)}"
    if rule.says:
        return _fill(rule.says, _template_words(sides, topic))
    if violation.bound.scope == "pair":
        # The offer comes first, for any primary side.
        clauses = [
            f"{subject(side)} {VERBS[side.role][0]} {_values(_compared(violation, side))}"
            for side in reversed(stated)
            if side.facts
        ]
        text = ", ".join(clauses)
        return text if rule.kind == "requires" else f"{text}: {rule.because}"
    if violation.bound.scope == "signal" and not any(side.facts for side in stated):
        return f"on topic `{topic}`, {rule.because}"
    clauses = [f"{subject(side)} has {_values(side.facts)}" for side in sides if side.facts]
    return f"{', '.join(clauses) or f'topic `{topic}`'}: {rule.because}"


def _compared(violation: Violation, side: Side) -> Sequence[Fact]:
    """The values of a side that a rule compares; options only steer it, so they count where there is nothing else."""
    policies = (violation.bound.bound.vocabulary.policies[use.index] for use in violation.bound.bound.uses)
    options = {policy.name for policy in policies if policy.level == "option"}
    return [each for each in side.facts if each.policy not in options] or side.facts


def _fill(template: str, words: Mapping[str, str]) -> str:
    import re

    return re.sub(r"\{([^{}]+)\}", lambda match: words.get(match[1], match[0]), template)


def causes(violation: Violation, publisher: QosProfile | None, subscriber: QosProfile | None) -> tuple[str, ...]:
    """Return the causes of an undecided rule: assumptions by name, and the reasons why values are unknown."""
    if violation.failed is not None:
        return (violation.failed,)
    found: dict[str, None] = {}
    ends = [end for end in (publisher, subscriber) if end is not None]
    for use in _open_uses(violation.bound.bound, ends[0].values, ends[-1].values) if ends else ():
        profile = subscriber if use.second else publisher
        if profile is not None:
            _cause(profile.values[use.index], found)
    return tuple(sorted(found))


def _open_uses(bound: BoundCondition, a: Values, b: Values) -> Iterator[Use]:
    """Yield the values that an undecided condition reads, without those of its decided parts."""
    undecided = () if bound.aggregate_uses else [part for part in parts(bound) if part.judge(a, b).result is None]
    if not undecided:
        yield from bound.uses
    for part in undecided:
        yield from _open_uses(part, a, b)


def _cause(value: Value, found: dict[str, None]) -> None:
    if isinstance(value, Anything):
        found[value.cause] = None
    elif isinstance(value, Depends):
        found[value.on] = None
        for _, case in value.cases:
            _cause(case, found)


def _guarantees_open(sides: Sequence[Side], words: Sequence[str], names: Sequence[str], because: Sequence[str]) -> str:
    """Say which guarantees cannot be decided, and why; the requesting side comes first."""
    subscriber, publisher = (subject(side) for side in sides)
    listed = words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
    return f"whether {subscriber} gets what it needs from {publisher}, {listed}, is not known: {_why_unknown(names, because)}"


def _why_unknown(names: Sequence[str], because: Sequence[str]) -> str:
    return f"it depends on {' and '.join(names)}" if names else "; ".join(because)


def _worlds(violation: Violation) -> dict[str, Verdict]:
    """The verdict under each assumption."""
    verdicts = {True: Verdict.COMPATIBLE, False: Verdict.INCOMPATIBLE, None: Verdict.UNKNOWN}
    return {label: verdicts[result] for label, result in violation.outcome.worlds}


def _assumptions(labels: Iterable[str]) -> list[str]:
    """Names of the assumptions in labels such as ``ros2.rmw=fastdds, start order=publishers first``."""
    return list(dict.fromkeys(part.partition("=")[0] for label in labels for part in label.split(", ")))


def _next_step(worlds: Mapping[str, Verdict]) -> str | None:
    """Return the settings to state so that the answer is known."""
    steps = [
        "state `starts_after:` where the order of start is certain"
        if name == START_ORDER
        else f"set `--option {name}=…`, or `options:` in the system file"
        for name in _assumptions(worlds)
        if name == START_ORDER or " " not in name  # else it follows from facts, and the rule says which
    ]
    return "; ".join(steps) or None


def _order_notes(violation: Violation) -> tuple[str, ...]:
    """The order of the values compared, for ordered choices whose names are no numbers."""
    if violation.bound.scope != "pair":
        return ()
    vocabulary = violation.bound.bound.vocabulary
    notes: dict[str, None] = {}
    for use in violation.bound.bound.uses:
        policy = vocabulary.policies[use.index]
        domain = policy.domain
        names = domain.names if isinstance(domain, Choice) and domain.ordered else ()
        if len(names) > 1 and not names[0].isdigit():
            notes[f"order of {policy.name}: {domain.expected()}"] = None
    return tuple(notes)


def sides_of(
    violation: Violation,
    publishers: Iterable[EndpointGroup],
    subscribers: Iterable[EndpointGroup],
    *,
    for_words: bool = False,
) -> list[Side]:
    """Both sides of a finding, the requesting one first, each with the values that the rule reads of it.

    ``for_words``: without places, labels and origins, which take longer to find than all that a message says.
    """
    groups = {SUBSCRIBER: list(subscribers), PUBLISHER: list(publishers)}
    pair = violation.bound.scope == "pair"
    return [
        _side(
            role,
            members,
            [use for use in violation.bound.bound.uses if not pair or use.second is (role == SUBSCRIBER)],
            meeting=violation.bound.rule.kind == "meets",
            for_words=for_words,
        )
        for role, members in groups.items()
        if members
    ]


def shown_groups(hit: Hit[EndpointGroup]) -> tuple[list[EndpointGroup], list[EndpointGroup]]:
    """Return the groups that show a hit: only an example if its values differ."""
    if not hit.more:
        return [*hit.publishers], [*hit.subscribers]
    one = {role: [members.only([members.first])] for role, members in hit.example.items()}
    return one.get(PUBLISHER, []), one.get(SUBSCRIBER, [])


def _sides(hit: Hit[EndpointGroup]) -> list[Side]:
    found = sides_of(hit.violation, hit.publishers, hit.subscribers)
    # No single change fixes further combinations of values.
    return [replace(side, facts=()) for side in found] if hit.more else found


def draft_finding(topic: MatchedTopic, hit: Hit[EndpointGroup]) -> FindingDraft:
    """Turn a hit of a rule on a topic into a finding."""
    violation = hit.violation
    bound = violation.bound
    publishers, subscribers = shown_groups(hit)
    example = sides_of(violation, publishers, subscribers, for_words=True)
    rule = bound.rule
    because: tuple[str, ...] = ()
    if violation.unknown:
        first, second = (
            (each or other)[0].profile for each, other in ((publishers, subscribers), (subscribers, publishers))
        )
        because = causes(violation, first, second)
    worlds = _worlds(violation)
    notes = because if not worlds else ()
    message = headline(violation, example, topic.shown, because)
    if hit.more:
        message = f"{_further(hit)}, for instance: {message}"
    finding = Finding(
        code="CQ701" if violation.failed else rule.code,
        name="rule-failed" if violation.failed else rule.name,
        severity=Severity.ERROR if violation.failed else _severity(violation),
        message=f"rule {rule.code} could not be judged: {violation.failed}" if violation.failed else message,
        source=topic.pack.id,
        topic=topic.shown,
        verdict=_verdict(violation),
        sides=lazy_tuple(_sides, hit),
        remedies=() if violation.failed or hit.more else lazy_tuple(_remedies, (topic, hit)),
        notes=(*notes, *_order_notes(violation)),
        because=rule.because,
        clause=rule.clause,
        help=_next_step(worlds) or rule.help or None,
        pairs=hit.pairs,
        worlds=worlds,
    )
    cause = because if bound.scope == "pair" and not hit.more else ()
    word = (rule.guarantee or "") if cause and not violation.failed else ""
    return FindingDraft(finding, _merge_key(hit, finding, because), hit.tags, cause, word)


def _further(hit: Hit[EndpointGroup]) -> str:
    """Return the number of combinations that are merged here, in words."""
    what = "combination of values" if hit.more == 1 else "combinations of values"
    if hit.violation.unknown:
        return f"{hit.more} further {what} {'is' if hit.more == 1 else 'are'} not known to fit"
    return f"{hit.more} further {what} {'breaks' if hit.more == 1 else 'break'} the rule"


def _severity(violation: Violation) -> Severity:
    rule = violation.bound.rule
    if rule.kind != "forbids" and (violation.unknown or rule.doubt):
        return max(Severity.WARNING, Severity(violation.bound.severity), key=lambda severity: severity.rank)
    return Severity(violation.bound.severity)


def _verdict(violation: Violation) -> Verdict | None:
    if violation.bound.scope != "pair":
        return Verdict.INCOMPATIBLE if violation.refuses else None
    verdict = verdict_of(violation)
    return None if verdict is Verdict.COMPATIBLE else verdict


def _merge_key(hit: Hit[EndpointGroup], finding: Finding, because: tuple[str, ...]) -> tuple[Any, ...]:
    """Return the merge key: findings with equal keys are one finding, such as one unknown cause over many topics."""
    rule = hit.violation.bound.rule
    if hit.more:
        return ("own", object())
    if because:
        # An unknown value may lead to other verdicts elsewhere, and then it is another finding.
        return ("cause", rule.code, because, tuple(finding.worlds.items()), hit.tags)
    endpoints = [e for members in (*hit.publishers, *hit.subscribers) for e in members.endpoints]
    if any(each.representative.template is not None for each in endpoints):
        templates = frozenset(each.representative.template or each.id for each in endpoints)
        values = tuple((s.role, f.policy, f.value) for s in finding.sides for f in s.facts)
        return ("template", rule.code, templates, values, hit.tags)
    if any(endpoint.visiting for endpoint in endpoints):
        # For a subscriber of many topics, equal findings on all of them are reported once.
        values = tuple((s.role, f.policy, f.value) for s in finding.sides for f in s.facts)
        wanting = frozenset(e.id for members in hit.subscribers for e in members.endpoints)
        return ("meeting", rule.code, wanting, values, hit.tags)
    if hit.violation.bound.scope == "endpoint" and any(e.stated_id != e.id for e in endpoints):
        # A mistake in a service is stated once, though the service has several topics.
        stated = frozenset(e.stated_id for e in endpoints)
        return (
            "stated",
            rule.code,
            stated,
            tuple((f.policy, f.value) for s in finding.sides for f in s.facts),
            hit.tags,
        )
    # A new object equals nothing else; an id would be used again once the hit is gone.
    return ("own", object())


def merged(findings: Sequence[Finding]) -> Finding:
    """Put findings with one merge key together: members, pairs and topics add up."""
    if len(findings) == 1:
        return findings[0]
    first = min(findings, key=lambda finding: (finding.topic or "", finding.endpoints))
    roles = dict.fromkeys(side.role for finding in findings for side in finding.sides)
    sides = []
    for role in roles:
        same = [side for finding in (first, *findings) for side in finding.sides if side.role == role]
        members = tuple(sorted({member for side in same for member in side.members}))
        facts = tuple(
            each
            for each in same[0].facts
            if all((each.policy, each.value) in {(f.policy, f.value) for f in side.facts} for side in same)
        )
        sides.append(replace(same[0], members=members, facts=facts))
    topics = sorted(
        {finding.topic for finding in findings if finding.topic is not None and finding.topic != first.topic}
    )
    return replace(
        first,
        sides=tuple(sides),
        remedies=lazy_tuple(lambda: _merged_remedies(findings)),
        pairs=sum(finding.pairs for finding in findings),
        more_topics=tuple(topics),
        notes=tuple(dict.fromkeys(note for finding in (first, *findings) for note in finding.notes)),
    )


class Memo(Protocol):
    """Calls a function on findings; may return an earlier result of the same findings."""

    def __call__(self, make: Callable[[Sequence[_F]], _T], of: Sequence[_F]) -> _T:
        """Return ``make(of)``."""


def without_memo(make: Callable[[Sequence[_F]], _T], of: Sequence[_F]) -> _T:
    """Call ``make`` each time."""
    return make(of)


def one_per_cause(made: Sequence[FindingDraft], again: Memo = without_memo) -> list[FindingDraft]:
    """Merge the findings of a pair that one missing fact leaves open: guarantees with each other, or with another finding of that fact.

    A cause of the same words is the same fact only for the same endpoints of one protocol.
    """
    alike: dict[tuple[Any, ...], list[list[FindingDraft]]] = {}
    kept: list[list[FindingDraft]] = []
    # Findings of the most endpoints come first; those about some of these endpoints join them.
    for one in sorted([one for one in made if one.cause], key=_by_endpoints):
        known = alike.setdefault(_cause_of(one), [])
        ends = set(one.finding.endpoints)
        host = next((each for each in known if one.guarantee and ends <= set(each[0].finding.endpoints)), None)
        if host is None:
            known.append([one])
            kept.append(known[-1])
        else:
            host.append(one)
    joined = [each[0] if len(each) == 1 else again(_together, each) for each in kept]
    return [*[one for one in made if not one.cause], *joined]


def _by_endpoints(one: FindingDraft) -> tuple[bool, int, str]:
    return bool(one.guarantee), -len(one.finding.endpoints), one.finding.code


def _cause_of(one: FindingDraft) -> tuple[Any, ...]:
    """Return a key that is equal for findings of one missing fact."""
    finding = one.finding
    whose = (finding.source, finding.topic, finding.more_topics)
    return (*whose, one.cause, tuple(finding.worlds), finding.severity, finding.accepted)


def _together(made: Sequence[FindingDraft]) -> FindingDraft:
    """Put findings of several rules that one missing fact leaves undecided together, under the code of the first."""
    first, findings = made[0].finding, [one.finding for one in made]
    worlds = {
        label: max((finding.worlds[label] for finding in findings), key=lambda verdict: verdict.rank)
        for label in first.worlds
    }
    words = list(dict.fromkeys(one.guarantee for one in made))
    return replace(
        made[0],
        finding=replace(
            first,
            message=_guarantees_open(first.sides, words, _assumptions(worlds), made[0].cause)
            if made[0].guarantee
            else first.message,
            remedies=lazy_tuple(lambda: _merged_remedies(findings)),
            more_codes=tuple(sorted({finding.code for finding in findings} - {first.code})),
            notes=tuple(dict.fromkeys(note for finding in findings for note in finding.notes)),
            worlds=worlds,
        ),
    )


def participant_finding(bound: BoundRule, violation: Violation, endpoints: Sequence[Resolved]) -> Finding:
    """Turn the report of a rule over participants, brokers or options into a finding; ``endpoints`` are those it holds for."""
    rule, first = bound.rule, min(endpoints, key=lambda endpoint: endpoint.participant.participant.id)
    members = tuple(sorted({endpoint.participant.participant.id for endpoint in endpoints}))
    facts = tuple(fact(first, first.profile, use.index) for use in bound.bound.uses)
    side = Side("participant", members, "set here", facts, first.participant.participant.place)
    says = _fill(rule.says, _template_words([side], "")) if rule.says else ""
    return Finding(
        code="CQ701" if violation.failed else rule.code,
        name="rule-failed" if violation.failed else rule.name,
        severity=Severity.ERROR if violation.failed else _severity(violation),
        message=f"rule {rule.code} could not be judged: {violation.failed}"
        if violation.failed
        else says or f"{subject(side)} has {_values(facts)}: {rule.because}",
        source=first.pack.id,
        verdict=_verdict(violation),
        sides=(side,),
        because=rule.because,
        clause=rule.clause,
        help=rule.help or None,
    )


def _remedies(of: tuple[MatchedTopic, Hit[EndpointGroup]]) -> tuple[Remedy, ...]:
    from cqos_core.checking.fixes import remedies

    topic, hit = of
    return remedies(topic, hit.violation, list(hit.publishers), list(hit.subscribers))


def _merged_remedies(findings: Sequence[Finding]) -> tuple[Remedy, ...]:
    from cqos_core.checking.fixes import merged_remedies

    return merged_remedies(findings)
