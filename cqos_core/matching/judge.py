"""Judges distinct profiles: returns the rules that report on a pair or an endpoint. Pure; results are cached per process."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.bound_condition import NO_SIGNAL, RuleAnswer, Signal
from cqos_core.language.condition_compiler import CommonValues, Question, compile_conditions
from cqos_core.language.policy import NEED
from cqos_core.language.relation import positions
from cqos_core.language.values import Anything, Depends
from cqos_core.matching.rule_set import EVERY, RuleQuestion, RuleSet
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Verdict
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.resolving.reader import depends

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.language.condition_compiler import CompiledConditions
    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value, Values
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule import Rule
    from cqos_core.resolving.qos_profile import ProfileFrame, QosProfile

_CACHE: Final = 200_000
_FRAMES: Final = 16_384
_ABSENT: Final = Anything("its role does not have it")


@dataclass(frozen=True, slots=True)
class Violation:
    """A rule that reports: `outcome.result` is False or None for ``requires``, True for ``forbids``.

    ``failed`` is the error of a rule whose own function raised one; such a rule is unknown.
    """

    bound: BoundRule
    outcome: RuleAnswer
    failed: str | None = None

    @property
    def unknown(self) -> bool:
        """Whether the rule reports because it cannot be decided."""
        return self.outcome.result is None

    @property
    def refuses(self) -> bool:
        """Whether an endpoint that a pack's rule reports certainly takes part in no pair."""
        return self.bound.rule.severity == "error" and not self.unknown


@dataclass(frozen=True, slots=True)
class PairJudgement:
    """The verdict of one pair of profiles, and the rules that report, by code."""

    verdict: Verdict
    violations: tuple[Violation, ...] = ()


FITS: Final = PairJudgement(Verdict.COMPATIBLE)


def ask(bound: BoundRule, a: Values, b: Values, signal: Signal = NO_SIGNAL) -> Violation | None:
    """Ask one rule; None where it has nothing to say."""
    answer = _answer(bound, a, b, signal)
    speaks = answer.outcome.result is True if bound.rule.kind == "forbids" else answer.outcome.result is not True
    return answer if speaks or answer.failed is not None else None


def ask_end(bound: BoundRule, profile: QosProfile, role: str) -> Violation | None:
    """Ask one rule of one endpoint; it has nothing to say where that rests on policies that the role does not have."""
    values = values_of_role(bound, profile, role)
    violation = ask(bound, values, values)
    silent = bound.absent[role] and violation is not None and violation.unknown and violation.failed is None
    return None if silent else violation


def values_of_role(bound: BoundRule, profile: QosProfile, role: str) -> Values:
    """The values of an endpoint, without those of policies that its role does not have."""
    absent = bound.absent[role]
    return (
        tuple(_ABSENT if at in absent else value for at, value in enumerate(profile.values))
        if absent
        else profile.values
    )


def _answer(bound: BoundRule, a: Values, b: Values, signal: Signal = NO_SIGNAL) -> Violation:
    try:
        return Violation(bound, bound.bound.judge(a, b, signal))
    except MemoryError:  # which says nothing of the rule, and must not be remembered as if it did
        raise
    except Exception as error:  # noqa: BLE001 - a pack's own function may raise anything; the rest must be judged
        return Violation(bound, RuleAnswer(None), f"{type(error).__name__}: {error}")


def verdict_by(rule: Rule, *, unknown: bool) -> Verdict:
    """Return the verdict that a reporting rule gives a pair: advice gives none, an error never ``compatible``."""
    if rule.kind == "meets":
        return Verdict.UNKNOWN if unknown else Verdict.COMPATIBLE
    if rule.kind != "requires":
        error = rule.severity == "error" and not unknown
        return Verdict.INCOMPATIBLE if error else Verdict.COMPATIBLE
    return Verdict.UNKNOWN if unknown or rule.doubt else Verdict.INCOMPATIBLE


def verdict_of(violation: Violation) -> Verdict:
    """Return the verdict that a violation gives its pair."""
    return verdict_by(violation.bound.rule, unknown=violation.unknown)


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """The worst of several verdicts."""
    return max(verdicts, key=lambda verdict: verdict.rank, default=Verdict.COMPATIBLE)


@lru_cache
def over_both(pack: RulePack) -> RuleSet:
    """Return the rules over both ends: the matching conditions, then the rules of pairs without those on which guarantees rest."""
    meeting = [RuleQuestion(each, _ask_meeting, undecided=True) for each in pack.by_scope["meets"]]
    pairs = [each for each in pack.by_scope.get("pair", ()) if not each.rule.guarantee]
    return RuleSet(
        {"meets": meeting, "pair": [RuleQuestion(each, _ask_pair, each.rule.kind == "requires") for each in pairs]}
    )


def _ask_pair(bound: BoundRule, publisher: QosProfile, subscriber: QosProfile) -> Violation | None:
    return ask(bound, publisher.values, subscriber.values)


def _ask_meeting(bound: BoundRule, publisher: QosProfile, subscriber: QosProfile) -> Violation | None:
    """Ask a matching condition; it does not report if it depends on facts that are not stated."""
    violation = _ask_pair(bound, publisher, subscriber)
    silent = violation is not None and violation.unknown and violation.failed is None and not violation.outcome.worlds
    return None if silent else violation


@lru_cache(maxsize=_CACHE)
def failed_match_conditions(publisher: QosProfile, subscriber: QosProfile) -> tuple[BoundRule, ...]:
    """Return the matching conditions that keep two profiles of one topic from matching; none: they match.

    An undecided condition keeps no endpoints apart.
    """
    violations = _between(publisher, subscriber, "meets")
    return tuple([each.bound for each in violations if each.outcome.result is False])


def undecided_meeting(bound: BoundRule, publisher: QosProfile, subscriber: QosProfile) -> Violation | None:
    """Ask a matching condition; return its violation if it keeps two profiles from matching under some assumptions only.

    One that rests on facts that are not stated keeps no pair apart.
    """
    violation = _ask_meeting(bound, publisher, subscriber)
    return violation if violation is not None and violation.outcome.worlds else None


@lru_cache(maxsize=_CACHE)
def judge_pair(publisher: QosProfile, subscriber: QosProfile) -> PairJudgement:
    """Judge two profiles that meet, by the rules of pairs alone."""
    violations = list(_between(publisher, subscriber, "pair"))
    if subscriber.needs and Verdict.INCOMPATIBLE not in map(verdict_of, violations):
        for bound in publisher.pack.by_scope.get("pair", ()):
            if bound.rule.guarantee in subscriber.needs:
                each = _ask_pair(bound, publisher, subscriber)
                violations += () if each is None else (each,)
    return PairJudgement(worst(map(verdict_of, violations)), tuple(violations)) if violations else FITS


def _between(publisher: QosProfile, subscriber: QosProfile, part: str) -> Iterator[Violation]:
    """Yield the violations of a part of the rules over both ends."""
    rules = over_both(publisher.pack)
    return _violations(rules, rules.bits[part], publisher, subscriber)


@lru_cache(maxsize=_FRAMES)
def read_in_worlds(pack: RulePack, frame: ProfileFrame, side: int) -> int:
    """Return as bits the matching conditions that read values of a side, 0 or 1, which depend on assumptions."""
    depending = {at for at, value in frame.open.items() if isinstance(value, Depends)}
    rules = enumerate(pack.by_scope["meets"])
    return sum(1 << position for position, each in rules if not depending.isdisjoint(each.bound.sides[side]))


def _violations(rules: RuleSet, among: int, first: QosProfile, second: QosProfile) -> Iterator[Violation]:
    """Yield the violations of some rules of a set."""
    certain, asked = rules.reporting(first, second, among)
    return _say(rules, certain, asked, first, second)


def _say(rules: RuleSet, certain: int, asked: int, first: QosProfile, second: QosProfile) -> Iterator[Violation]:
    """Yield what rules say that report for certain, and those that were asked."""
    for position in positions(certain | asked):
        bound = rules.rules[position]
        if certain >> position & 1:
            yield Violation(bound, _CERTAIN[bound.rule.kind == "forbids"])
        elif isinstance(each := rules.ask(position, first, second), Violation):
            yield each


_CERTAIN: Final = (RuleAnswer(result=False), RuleAnswer(result=True))


_ENDS: Final = frozenset({"offered", "requested", "publisher", "subscriber"})


def speaking_of(bound: BoundRule) -> str | None:
    """Return the role of the endpoints that a rule over topics judges one by one; None where it judges the whole."""
    if all(use.term.scope not in _ENDS for use in bound.bound.uses):
        return None
    return PUBLISHER if bound.role == PUBLISHER else SUBSCRIBER


def passed_over(bound: BoundRule, publisher: QosProfile, subscriber: QosProfile) -> bool:
    """Return whether a rule does not apply: its policy is not matched on by either middleware, or its guarantee is not needed."""
    if bound.rule.guarantee:
        return bound.rule.guarantee not in subscriber.needs
    unmatched = publisher.unmatched or subscriber.unmatched
    if not unmatched or bound.rule.kind != "requires":
        return False
    return any(use.index in publisher.unmatched or use.index in subscriber.unmatched for use in bound.bound.uses)


@lru_cache(maxsize=_CACHE)
def _reporting(profile: QosProfile, role: str, observed: bool) -> tuple[int, int]:  # noqa: FBT001 - a cache key
    """Return as bits which rules report on an endpoint by itself, for certain and when asked; of topics none."""
    rules = about_one(profile.pack, role, observed)
    return rules.reporting(profile, profile, ~rules.bits["signal"])


def _violations_of_one(profile: QosProfile, role: str, observed: bool, among: int) -> Iterator[Violation]:  # noqa: FBT001 - likewise
    """Yield what some of these rules say."""
    certain, asked = _reporting(profile, role, observed)
    return _say(about_one(profile.pack, role, observed), certain & among, asked & among, profile, profile)


@lru_cache(maxsize=_CACHE)
def judge_endpoint(profile: QosProfile, role: str, observed: bool) -> tuple[Violation, ...]:  # noqa: FBT001 - a cache key
    """Judge one endpoint by itself; rules about creating one are not asked of observed endpoints."""
    return tuple(_violations_of_one(profile, role, observed, about_one(profile.pack, role, observed).bits["endpoint"]))


@lru_cache
def about_one(pack: RulePack, role: str, observed: bool) -> RuleSet:  # noqa: FBT001 - as the above
    """Return the rules about one end: about the endpoint itself, errors about its surroundings, and rules over topics.

    The latter have something to say as far as one endpoint alone on its side can tell.
    """

    def by_itself(bound: BoundRule, profile: QosProfile, _: QosProfile) -> Violation | None:
        return ask_end(bound, profile, role)

    own = [
        RuleQuestion(each, by_itself, each.rule.kind == "requires", frozenset(each.absent[role]))
        for each in _of_endpoint(pack, role, observed)
    ]
    around = [RuleQuestion(each, _ask_refusing, undecided=False) for each in _refusing_around(pack, observed)]
    topics = [RuleQuestion(each, _ask_topic, undecided=False) for each in pack.by_scope.get("signal", ())]
    return RuleSet({"endpoint": own, "surroundings": around, "signal": topics}, one=True)


def signals_on(profile: QosProfile, role: str, observed: bool) -> int:  # noqa: FBT001 - as the above
    """Return as bits, in the order of the pack, the rules over topics that may report where an end is on one."""
    rules = about_one(profile.pack, role, observed)
    reporting = rules.that_report(profile, profile, rules.bits["signal"])
    return reporting >> len(rules.rules) - len(profile.pack.by_scope.get("signal", ()))


def _of_endpoint(pack: RulePack, role: str, observed: bool) -> Iterator[BoundRule]:  # noqa: FBT001 - as the above
    """Yield the rules about an endpoint by itself."""
    for bound in pack.by_scope.get("endpoint", ()):
        if bound.role in {None, role} and not (observed and bound.rule.creation):
            yield bound


def _refusing_around(pack: RulePack, observed: bool) -> Iterator[BoundRule]:  # noqa: FBT001 - as the above
    """Yield the errors about the participant of an endpoint, its broker and its options."""
    for bound in pack.participant_rules:
        if bound.rule.severity == "error" and not (observed and bound.rule.creation):
            yield bound


def _ask_refusing(bound: BoundRule, profile: QosProfile, _: QosProfile) -> Violation | None:
    """Ask a rule about the surroundings of an endpoint; undecided, it refuses none."""
    violation = ask(bound, profile.values, profile.values)
    return violation if violation is not None and violation.refuses else None


def _ask_topic(bound: BoundRule, profile: QosProfile, _: QosProfile) -> Violation | None:
    """Ask a rule over topics; the answer of one over all endpoints of a side is unknown."""
    if bound.bound.aggregate_uses:
        return Violation(bound, RuleAnswer(None))
    return ask(bound, profile.values, profile.values)


@lru_cache(maxsize=_CACHE)
def refusals(profile: QosProfile, role: str, observed: bool) -> tuple[str, ...]:  # noqa: FBT001 - a cache key
    """Return the codes of the errors for which an endpoint certainly does not exist, is disconnected, or is refused."""
    violations = _violations_of_one(profile, role, observed, EVERY)
    return tuple(dict.fromkeys([*profile.refused, *(each.bound.rule.code for each in violations if each.refuses)]))


@lru_cache(maxsize=_CACHE)
def refusing_worlds(profile: QosProfile, role: str, observed: bool) -> frozenset[str]:  # noqa: FBT001 - a cache key
    """Return the assumptions, such as ``ros2.rmw=fastdds``, under which an endpoint does not exist or is refused."""
    return frozenset(
        world
        for bound in assuming(profile.pack, profile.frame, role, observed)
        for values in (values_of_role(bound, profile, role),)
        for world, result in _answer(bound, values, values).outcome.worlds
        if result is (bound.rule.kind == "forbids")
    )


@lru_cache(maxsize=_CACHE)
def refusing_values(pack: RulePack, bound: BoundRule, role: str, at: int, read: tuple[Value, ...]) -> frozenset[str]:
    """Return the values of the option at an index, which nothing states, under which a rule refuses an endpoint.

    ``read`` are the values of the endpoint that the rule reads.
    """
    option, absent = pack.policies[at], bound.absent[role]
    values: list[Value] = [_ABSENT] * (2 * pack.vocabulary.size)
    for index, value in zip(bound.bound.own, read, strict=True):
        if index not in absent:
            values[index] = value
    values[at] = _any_of(pack, option)
    both = tuple(values)
    worlds = _answer(bound, both, both).outcome.worlds
    return frozenset(world.partition("=")[2] for world, result in worlds if result is (bound.rule.kind == "forbids"))


@lru_cache
def _any_of(pack: RulePack, option: Policy) -> Value:
    """Return the value of an option that may be any of its candidates."""
    return depends(pack, option, map(option.domain.format, option.domain.candidates()))


@lru_cache(maxsize=_FRAMES)
def errors_that_read(pack: RulePack, role: str, observed: bool, at: int) -> tuple[BoundRule, ...]:  # noqa: FBT001 - as the above
    """Return the errors about an endpoint and its surroundings that read the policy at an index."""
    rules = (*_of_endpoint(pack, role, observed), *_refusing_around(pack, observed))
    return tuple(each for each in rules if each.rule.severity == "error" and at in each.bound.own)


_WORTH_A_FUNCTION: Final = 50


class UnsetErrors:
    """The errors about ends of one frame that read an option which nothing states.

    Attributes:
        errors: those.
    """

    def __init__(self, pack: RulePack, frame: ProfileFrame, role: str, observed: bool, at: int) -> None:  # noqa: FBT001 - as the above
        """Take the frame and the index of the option."""
        self.errors = errors_that_read(pack, role, observed, at)
        self._common = {**frame.options, **frame.open, at: _any_of(pack, pack.policies[at])}
        self._size = 2 * pack.vocabulary.size
        self._asked = 0

    def that_may_refuse(self, known: Sequence[Any]) -> Sequence[BoundRule]:
        """Return the errors that may refuse an end of these known values; `refusing_values` tells under which of the option.

        All of them until a function is worth it, which passes most over.
        """
        if self._asked < _WORTH_A_FUNCTION:
            self._asked += 1
            return self.errors
        bits = self._function.reporting(known, known)
        return [self.errors[position] for position in positions(bits)] if bits else ()

    @cached_property
    def _function(self) -> CompiledConditions:
        values = tuple([self._common.get(index) for index in range(self._size)])
        alike = CommonValues(values, values, (frozenset(self._common),) * 2)
        errors = [(each.bound, each.rule.kind == "forbids") for each in self.errors]
        return compile_conditions([Question(*each, undecided=True, common=alike) for each in errors], alone=True)


unset_errors: Final = lru_cache(maxsize=_FRAMES)(UnsetErrors)


@lru_cache(maxsize=_CACHE)
def assuming(pack: RulePack, frame: ProfileFrame, role: str, observed: bool) -> tuple[BoundRule, ...]:  # noqa: FBT001 - as the above
    """Return the errors about an endpoint and its surroundings that read values which depend on assumptions."""
    depending = {at for at, value in frame.open.items() if isinstance(value, Depends)}
    rules = (*_of_endpoint(pack, role, observed), *_refusing_around(pack, observed))
    return tuple(each for each in rules if each.rule.severity == "error" and not depending.isdisjoint(each.bound.own))


def is_silent(profile: QosProfile, role: str, observed: bool) -> bool:  # noqa: FBT001 - as everything that `GroupKey` has
    """Return whether no rule about one endpoint reports on it, and no error about its surroundings."""
    return not any(_reporting(profile, role, observed))


@lru_cache(maxsize=_CACHE)
def of_end(
    profile: QosProfile,
    role: str,
    observed: bool,  # noqa: FBT001 - as everything that `GroupKey` has
    wired: bool,  # noqa: FBT001 - likewise
) -> tuple[tuple[Verdict, tuple[str, ...]], ...]:
    """Return the best verdict of every pair of an endpoint, and the codes of the findings that decide it."""
    alone = wired or is_silent(profile, role, observed)
    refused = profile.refused if alone else refusals(profile, role, observed)
    undecided = () if alone else undecided_of(profile, role, observed)
    codes = tuple(each.bound.rule.code for each in undecided if each.bound.rule.severity == "error")
    found = ((Verdict.INCOMPATIBLE, refused), (Verdict.UNKNOWN, (*profile.unread, *codes)))
    return tuple(each for each in found if each[1])


@lru_cache(maxsize=_CACHE)
def undecided_of(profile: QosProfile, role: str, observed: bool) -> tuple[Violation, ...]:  # noqa: FBT001 - a cache key
    """Return the requirements on one endpoint that cannot be decided under any assumption; of its creation none is.

    Where one holds under some assumptions, the report names these as assumed.
    """
    return tuple(
        each
        for each in judge_endpoint(profile, role, observed)
        if each.unknown
        and each.failed is None
        and not any(holds for _, holds in each.outcome.worlds)
        and each.bound.rule.kind == "requires"
        and not each.bound.rule.creation
        and not already_reported(each, profile, profile)
    )


def already_reported(violation: Violation, publisher: QosProfile, subscriber: QosProfile) -> bool:
    """Whether all that keeps a rule from being decided is reported as a finding of its own."""
    values = [(subscriber if use.second else publisher).values[use.index] for use in violation.bound.bound.uses]
    causes = [value for value in values if isinstance(value, Anything)]
    # An assumption that breaks the rule by itself is no part of them.
    worlds = violation.outcome.worlds if any(isinstance(value, Depends) for value in values) else (("", None),)
    harmless = bool(worlds) and all(result is not False for _, result in worlds)
    return violation.unknown and harmless and bool(causes) and all(each.reported for each in causes)


def needs_misread(violation: Violation, subscriber: QosProfile) -> bool:
    """Whether a rule is about a requirement that was not understood, which is a finding of its own."""
    policies = subscriber.pack.policies
    return any(
        use.second and policies[use.index].level == NEED and isinstance(value, Anything) and value.reported
        for use in violation.bound.bound.uses
        for value in (subscriber.values[use.index],)
    )
