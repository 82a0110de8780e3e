"""The check: every topic judged as a unit, then what only the whole system can tell, put together as a report."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

from cqos_core.checking.acceptance import with_acceptances, with_severities
from cqos_core.checking.findings import Made, merged, of_participants, one_per_cause
from cqos_core.checking.team import bind_checks, words_asked
from cqos_core.checking.topic import TopicResult, check_topic
from cqos_core.matching.assumptions import assumptions
from cqos_core.matching.bridge_findings import bridge_findings
from cqos_core.matching.judge import ask
from cqos_core.matching.pairing import bridges_of, naming_endpoints
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.codes import CODES
from cqos_core.model.memory import uncollected
from cqos_core.model.remarks import core_finding, plural, suggestion
from cqos_core.model.report import Finding, Report, Severity, Side, Verdict
from cqos_core.model.spelling import KnownNames, typing_errors
from cqos_core.model.system import MESSAGE, PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from cqos_core.matching.pairing import TopicKey
    from cqos_core.matching.pipeline import Context
    from cqos_core.model.system import Endpoint, Participant, System
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved import Resolved, ResolvedSystem


def _partners(
    system: System,
    results: Mapping[TopicKey, TopicResult],
    packs: Mapping[str, RulePack],
    endpoints: Iterable[Resolved],
) -> tuple[list[Finding], int]:
    """Report endpoints without any partner, and topics whose names nearly agree; of a part, only count the first."""
    if not any(result.lonely for result in results.values()):
        return [], 0
    kinds = {each.id: each.kind for each in system.endpoints if each.kind != MESSAGE}
    # Who has no partner of its own protocol may well have one on the wire.
    met = {
        each
        for result in results.values()
        for group in result.groups
        for each in (*group.publishers, *group.subscribers)
    }
    # Of alternatives, one is enough.
    met_for = {e.endpoint.template for e in endpoints if e.endpoint.alternative and e.id in met}
    lonely = {
        key: [
            e
            for e in result.lonely
            if e.id not in met and not (e.endpoint.alternative and e.endpoint.template in met_for)
        ]
        for key, result in results.items()
    }
    lonely = {key: endpoints for key, endpoints in lonely.items() if endpoints}
    unmatched = sum(map(len, lonely.values())) if system.partial else 0
    near, silenced = _near_misses(lonely, packs)
    findings = list(near)
    if system.partial:
        return findings, unmatched
    busy = _Busy(results, packs, [key for key in lonely if key not in silenced])
    reported = {e.endpoint.template for key in silenced for e in lonely[key] if e.endpoint.alternative}
    for key in sorted(results):
        for role, code in ((SUBSCRIBER, "CQ401"), (PUBLISHER, "CQ402")):
            alone = [
                e
                for e in lonely.get(key, ())
                if e.role == role
                and not e.external
                and not (e.endpoint.alternative and e.endpoint.template in reported)
            ]
            if not alone or key in silenced:
                continue
            reported |= {e.endpoint.template for e in alone if e.endpoint.alternative}
            findings.append(_alone(code, role, alone, kinds, busy.meant(key)))
    return findings, unmatched


class _Busy:
    """Topics on which endpoints match, to be suggested for names that nearly agree."""

    def __init__(
        self,
        results: Mapping[TopicKey, TopicResult],
        packs: Mapping[str, RulePack],
        lonely: Sequence[tuple[str, str]],
    ) -> None:
        self._packs = packs
        self._topics: dict[tuple[str, str, str], str] = {}  # by protocol, words of the fold, and folded key
        self._misspelt: dict[tuple[str, str], str] = {}
        matched: dict[str, dict[str, str]] = {}
        for (pack_id, key), result in sorted(results.items()) if lonely else ():
            if not result.groups:
                continue
            topic = result.groups[0].topic
            matched.setdefault(pack_id, {})[key] = topic
            for words, fold in packs[pack_id].meeting.folds:
                self._topics.setdefault((pack_id, words, fold(key)), topic)
        for pack_id, topics in matched.items():
            names = [key for other, key in lonely if other == pack_id]
            for name, near in typing_errors(names, topics).items():
                self._misspelt[pack_id, name] = topics[near[0]]

    def meant(self, key: tuple[str, str]) -> str | None:
        """Say which topic on which others match has nearly the same name."""
        pack_id, name = key
        for words, fold in self._packs[pack_id].meeting.folds:
            topic = self._topics.get((pack_id, words, fold(name)))
            if topic is not None:
                return f"did you mean `{topic}`? the names {words}"
        topic = self._misspelt.get(key)
        return None if topic is None else f"did you mean `{topic}`?"


# The verb of an endpoint: one of them, several, and the missing verb of the other side.
_DOES: Final = {
    SUBSCRIBER: ("subscribes to", "subscribe to", "publishes"),
    PUBLISHER: ("publishes", "publish", "subscribes to"),
    "client": ("calls", "call", "serves"),
    "server": ("serves", "serve", "calls"),
}


def _alone(code: str, role: str, alone: Sequence[Resolved], kinds: Mapping[str, str], meant: str | None) -> Finding:
    """Report endpoints of one topic without partner; those of a service or an action by what was stated."""
    ids = sorted(endpoint.id for endpoint in alone)
    first = next(endpoint for endpoint in alone if endpoint.id == ids[0])
    does = _DOES.get(kinds.get(first.stated_id, "").partition("_")[2])
    who, what = (first.id, first.shown) if does is None else (first.stated_id, first.endpoint.topic)
    one, several, other = does or _DOES[role]
    more = f" and {len(ids) - 1} more" if len(ids) > 1 else ""
    message = f"`{who}`{more} {several if more else one} `{what}`, which nobody in the system {other}"
    place = first.endpoint.place
    return core_finding(code, message, place=place, role=role, members=ids, topic=first.shown, help=meant)


def _near_misses(
    lonely: Mapping[tuple[str, str], Sequence[Resolved]], packs: Mapping[str, RulePack]
) -> tuple[list[Finding], set[tuple[str, str]]]:
    findings: list[Finding] = []
    silenced: set[tuple[str, str]] = set()
    for pack_id, pack in sorted(packs.items()):
        offering = [k for k, v in sorted(lonely.items()) if k[0] == pack_id and v[0].role == PUBLISHER]
        subscribed = [k for k, v in sorted(lonely.items()) if k[0] == pack_id and v[0].role == SUBSCRIBER]
        missing = [key for key in subscribed if not all(each.external for each in lonely[key])]
        for words, fold in pack.meeting.folds:
            folded: dict[str, list[tuple[str, str]]] = {}
            for key in offering:
                folded.setdefault(fold(key[1]), []).append(key)
            matched = _matched(pack, folded, {fold(key[1]) for key in missing})
            for key in missing:
                near = (fold(key[1]), *matched.get(fold(key[1]), ()))
                candidates = [
                    c
                    for each in near
                    for c in folded.get(each, ())
                    if c not in silenced and not _of_one_bridge(lonely[key], lonely[c])
                ]
                if not candidates or key in silenced or (len(candidates) > 1 and not matched):
                    continue
                silenced |= {key, *candidates}
                findings.append(_near_miss(lonely[key], [each for c in candidates for each in lonely[c]], words))
        offered = {key[1]: key for key in offering if key not in silenced}
        # A partner from outside, too, is on a topic of the right name.
        for name, misspelt in typing_errors([key[1] for key in subscribed if key not in silenced], offered).items():
            key = (pack_id, name)
            candidates = [
                c
                for c in (offered[other] for other in misspelt)
                if c not in silenced
                and not _of_one_bridge(lonely[key], lonely[c])
                and _of_one_type(lonely[key], lonely[c])
            ]
            if len(candidates) == 1:
                silenced |= {key, candidates[0]}
                words = f"differ by a typing error; did you mean `{lonely[candidates[0]][0].shown}`?"
                findings.append(_near_miss(lonely[key], lonely[candidates[0]], words))
    return findings, silenced


def _of_one_bridge(missing: Sequence[Resolved], offering: Sequence[Resolved]) -> bool:
    """Whether all of them are ends of one bridge, which renames what it carries."""
    bridges = bridges_of((*missing, *offering))
    return len(bridges) == 1 and None not in bridges


def _of_one_type(missing: Sequence[Resolved], offering: Sequence[Resolved]) -> bool:
    """Whether any of them may have the type of one on the other side."""
    types = [{each.endpoint.type for each in side} for side in (missing, offering)]
    return any(None in side for side in types) or not types[0].isdisjoint(types[1])


def _matched(pack: RulePack, offering: Iterable[str], missing: set[str]) -> Mapping[str, Sequence[str]]:
    """By key of subscribers the other keys of publishers that it would meet, both folded."""
    found: dict[str, list[str]] = {}
    match = pack.meeting.match
    for publisher, subscriber in match(list(offering), missing) if match is not None else ():
        found.setdefault(subscriber, []).append(publisher)
    return found


def _near_miss(missing: Sequence[Resolved], offering: Sequence[Resolved], words: str) -> Finding:
    subscriber = min(missing, key=lambda endpoint: endpoint.id)
    publisher = min(offering, key=lambda endpoint: endpoint.id)
    info = CODES["CQ403"]
    return Finding(
        code="CQ403",
        name=info.name,
        severity=Severity(info.severity),
        message=(
            f"subscriber `{subscriber.id}` on `{subscriber.shown}` and publisher `{publisher.id}` on `{publisher.shown}` "
            f"never meet: the names {words}"
        ),
        topic=subscriber.shown,
        sides=(
            Side(
                SUBSCRIBER,
                tuple(sorted(e.id for e in missing)),
                "subscribed here",
                (),
                subscriber.endpoint.place,
            ),
            Side(
                PUBLISHER,
                tuple(sorted(e.id for e in offering)),
                "published here",
                (),
                publisher.endpoint.place,
            ),
        ),
        because=info.reason,
        help=info.help,
    )


def _collapses(endpoints: Iterable[Resolved]) -> list[Finding]:
    """Report keys that endpoints arrive at from names a person takes for different ones."""
    shown: dict[tuple[str, str], dict[str, list[Resolved]]] = {}
    for endpoint in endpoints:
        if endpoint.key is not None and endpoint.shown != endpoint.key:
            shown.setdefault((endpoint.pack.id, endpoint.key), {}).setdefault(endpoint.shown, []).append(endpoint)
    findings = []
    for (_, key), free in sorted(shown.items()):
        if len(free) > 1:
            names = sorted(free)
            listed = " and ".join(f"`{name}`" for name in names)
            ids = sorted(endpoint.id for alike in free.values() for endpoint in alike)
            message = f"{listed} {'both' if len(names) == 2 else 'all'} stand for topic `{key}`"  # noqa: PLR2004
            first = min(free[names[0]], key=lambda endpoint: endpoint.id).endpoint
            findings.append(
                core_finding("CQ405", message, place=first.place, role=first.role, members=ids, topic=names[0])
            )
    return findings


def participant_findings(endpoints: Iterable[Resolved]) -> list[Finding]:
    """Judge rules over participants, brokers and options, once per distinct values they read."""
    found: dict[tuple[Any, ...], tuple[BoundRule, list[Resolved]]] = {}
    for endpoint in endpoints:
        for bound in endpoint.pack.beyond_topics:
            if bound.rule.creation and endpoint.endpoint.observed:
                continue
            read = tuple([endpoint.profile.values[use.index] for use in bound.bound.uses])
            found.setdefault((id(bound), read), (bound, []))[1].append(endpoint)
    findings = []
    for bound, alike in found.values():
        values = alike[0].profile.values
        spoken = ask(bound, values, values)
        if spoken is not None and not (spoken.unknown and spoken.failed is None):
            findings.append(of_participants(bound, spoken, alike))
    return findings


def _starts(system: System) -> list[Finding]:
    everybody: list[Participant | Endpoint] = [*system.participants.values(), *system.endpoints]
    stating = [each for each in everybody if each.starts_after]
    known = {each.id for each in everybody} if stating else set()
    names = KnownNames(known)
    findings = []
    for stated in stating:
        for name in stated.starts_after:
            if name not in known:
                message = f"`{stated.id}` starts after `{name}`, which is neither a participant nor an endpoint"
                findings.append(core_finding("CQ213", message, place=stated.place, help=suggestion(name, names)))
    return findings


def assemble(
    system: System,
    resolved: ResolvedSystem,
    results: Mapping[TopicKey, TopicResult],
    context: Context,
    problems: Sequence[Finding] = (),
) -> Report:
    """Put the results of all topics together with what only the whole system can tell."""
    packs = {endpoint.pack.id: endpoint.pack for endpoint in resolved.endpoints}
    made = _merged(results)
    groups = sorted(
        [each for result in results.values() for each in result.groups],
        key=lambda each: (each.topic, each.publishers, each.subscribers),
    )
    partners, unmatched = _partners(system, results, packs, resolved.endpoints)
    plain = [
        *_import_findings(system, context),
        *resolved.findings,
        *problems,
        *_starts(system),
        *participant_findings(resolved.endpoints),
        *_collapses(resolved.endpoints),
        *partners,
        *(
            core_finding("CQ603", f"`severities` names rule `{name}`, which no installed pack has")
            for name in system.severities
            if context.find_rule(name) is None
        ),
    ]
    if not groups:
        plain.append(_nothing_compared(system, resolved))
    made += [Made(finding, ("own", index), frozenset()) for index, finding in enumerate(plain)]
    if system.hypothetical:
        made = _only_tried(made, packs)
    made = with_severities(made, system.severities, context.find_rule)
    if system.accept:
        today = context.today or date.today()  # noqa: DTZ011 - a calendar day, where the user is
        made, said = with_acceptances(made, system.accept, context.find_rule, today)
        made += with_severities([Made(f, (), frozenset()) for f in said], system.severities, context.find_rule)
    findings = _with_templates([one.finding for one in one_per_cause(made)], system, resolved)
    assumed = assumptions(resolved.endpoints, groups, findings, packs)
    hypothetical = sum(each.pairs for each in groups) if system.hypothetical else 0
    groups = [] if hypothetical else groups
    return Report(
        verdict=max({each.verdict for each in groups}, key=lambda verdict: verdict.rank, default=Verdict.UNKNOWN),
        groups=tuple(groups),
        findings=tuple(
            sorted(findings, key=lambda f: (f.severity.rank, f.code, f.topic or "", f.message, str(f.place or "")))
        ),
        not_checked=tuple(dict.fromkeys(chain.from_iterable(packs[name].not_checked for name in sorted(packs)))),
        system=system.name,
        sources=tuple(system.sources),
        endpoints=len(resolved.endpoints),
        topics=_topics(results),
        partial=system.partial,
        unmatched=unmatched,
        hypothetical=hypothetical,
        assumed=assumed,
    )


def _only_tried(made: Sequence[Made], packs: Mapping[str, RulePack]) -> list[Made]:
    """Make a warning of what is wrong with a hypothetical pair, not with an end of it: nothing says that they ever match."""
    rules = (bound for pack in packs.values() for bound in (*pack.by_scope.get("endpoint", ()), *pack.beyond_topics))
    own = {bound.rule.code for bound in rules}
    return [
        replace(one, finding=replace(one.finding, severity=Severity.WARNING))
        if one.finding.code not in own and one.finding.verdict and one.finding.severity is Severity.ERROR
        else one
        for one in made
    ]


def _nothing_compared(system: System, resolved: ResolvedSystem) -> Finding:
    """Report that no endpoint has a partner; where all partners are elsewhere, that is expected."""
    count = len(resolved.endpoints)
    message = f"no publisher meets a subscriber among {plural(count, 'endpoint')}, so nothing was compared"
    tried = system.partial or system.hypothetical
    expected = tried or (count and all(endpoint.external for endpoint in resolved.endpoints))
    return core_finding("CQ404", message, severity=Severity.NOTE if expected else None)


def _merged(results: Mapping[TopicKey, TopicResult]) -> list[Made]:
    """Collect the findings of topics; combine those that several topics share."""
    by_key: dict[tuple[Any, ...], list[Made]] = {}
    for key in sorted([key for key, result in results.items() if result.made]):
        for one in results[key].made:
            by_key.setdefault(one.merge_key, []).append(one)
    return [replace(same[0], finding=merged([one.finding for one in same])) for same in by_key.values()]


def _with_templates(findings: list[Finding], system: System, resolved: ResolvedSystem) -> list[Finding]:
    """Say of members that are instances what they are instances of."""
    of: dict[str, str] = {each.id: each.template for each in system.participants.values() if each.template is not None}
    of |= {each.id: each.endpoint.template for each in resolved.endpoints if each.endpoint.template is not None}
    return _once_each([_instances(finding, of) for finding in findings]) if of else findings


_OF_TOPICS: Final = frozenset(("CQ401", "CQ402", "CQ403", "CQ406"))


def _once_each(findings: list[Finding]) -> list[Finding]:
    """Put together what the core says alike of the topics of instances."""
    alike: dict[object, list[Finding]] = {}
    for finding in findings:
        key: object = id(finding)
        if finding.code in _OF_TOPICS and any(side.templates for side in finding.sides):
            sides = tuple((side.role, side.templates, side.place) for side in finding.sides)
            key = (finding.code, finding.severity, finding.accepted, sides)
        alike.setdefault(key, []).append(finding)
    return [merged(same) for same in alike.values()]


def _instances(finding: Finding, of: Mapping[str, str]) -> Finding:
    if not any(member in of for side in finding.sides for member in side.members):
        return finding
    sides = (
        replace(side, templates=tuple(sorted({of.get(member, member) for member in side.members})))
        if any(member in of for member in side.members)
        else side
        for side in finding.sides
    )
    return replace(finding, sides=tuple(sides))


def _topics(results: Mapping[TopicKey, TopicResult]) -> int:
    """How many topics there are: a filter all of whose subscribers are on other topics is none."""
    if not any(result.lonely for result in results.values()):
        return len(results)
    met = {name for result in results.values() for group in result.groups for name in group.subscribers}
    return sum(
        1
        for result in results.values()
        if result.groups or not result.lonely or any(each.id not in met for each in result.lonely)
    )


def _import_findings(system: System, context: Context) -> list[Finding]:
    return [
        Finding(
            code=note.code,
            name=info.name if (info := context.find_rule(note.code)) else "import-note",
            severity=Severity(note.severity),
            message=note.message,
            sides=(
                Side(
                    "endpoint" if note.endpoint else "system",
                    (note.endpoint,) if note.endpoint else (),
                    place=note.place,
                ),
            ),
            help=note.help,
        )
        for note in system.notes
    ]


def check_system(
    system: System, context: Context, step: Callable[[int, int], None] = lambda _done, _all: None
) -> Report:
    """Check one system.

    Args:
        system: what to check.
        context: the packs, and what is assumed where the system says nothing.
        step: called before each topic with how many of how many are judged.
    """
    with uncollected(len(system.endpoints)):
        return check(Pipeline(system, context), step=step)


def check(
    pipeline: Pipeline,
    judged: Callable[
        [TopicKey, Sequence[Resolved], Callable[[], TopicResult]], TopicResult
    ] = lambda _key, _ends, judge: judge(),
    step: Callable[[int, int], None] = lambda _done, _all: None,
) -> Report:
    """Check a system; ``judged`` may know the result of a topic, or calls its last argument to judge it."""
    system = pipeline.system
    teams, problems = bind_checks(system, pipeline.where.find_pack, pipeline.where.default_protocol)
    pipeline.asked = words_asked(teams)
    excused = naming_endpoints(system.accept)
    results: dict[TopicKey, TopicResult] = {}
    for number, (key, endpoints) in enumerate(pipeline.topics.items()):
        step(number, len(pipeline.topics))
        results[key] = judged(key, endpoints, partial(check_topic, endpoints, excused, teams))
    if system.bridges:
        problems += bridge_findings(system, pipeline.hops, pipeline.topics)
    return assemble(system, pipeline.resolver.result, results, pipeline.where, problems)
