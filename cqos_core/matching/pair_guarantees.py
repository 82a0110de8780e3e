"""Guarantees of a compatible pair, derived from the rules of its pack.

A number is given where the strongest need that all rules grant is that number, so nothing is stated twice.
"""

from __future__ import annotations

from dataclasses import field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.condition_compiler import CommonValues
from cqos_core.language.policy import BROKER, NEED
from cqos_core.language.repeated_conditions import (
    WORTH_A_FUNCTION,
    RepeatedConditions,
    all_known,
    compile_answers,
    turning_values,
)
from cqos_core.language.values import INFINITE, Depends, is_plain
from cqos_core.model.caches import keep, number_of
from cqos_core.model.dataclass import dataclass
from cqos_core.packs.guarantee import FAULTS, INTERMEDIARY, LINK, RESTARTS_IN, SURVIVES, WORDS, befalling, faults_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.language.condition_compiler import Reporting
    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value, Values
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.guarantee import GuaranteeWord
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule import Rule
    from cqos_core.resolving.qos_profile import ProfileFrame, QosProfile

_CACHE: Final = 50_000
NOT_NAMED: Final = "an implementation that is not stated"


@dataclass(frozen=True, slots=True)
class FaultGuarantee:
    """One guarantee under one fault.

    Attributes:
        value: 1 or 0 for what holds or not, else the number; None where it cannot be known.
        lost: the rules that keep it from holding, or from being known.
        proven: where it was seen on running middleware, if something is given.
        derived: implementations of the pair on which it was not seen, if something is given.
    """

    value: int | None
    lost: tuple[Rule, ...] = ()
    proven: tuple[str, ...] = ()
    derived: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class PairGuarantee:
    """One guarantee of a pair, or of a path; compared by identity.

    Attributes:
        word: which one.
        value: what is given while both ends are connected: 1 or 0 for what holds or not, else the number; None where it
            cannot be known.
        lost: the rules that keep it from holding, or from being known.
        cells: the same for connected ends (``link``) and under each fault.
    """

    word: GuaranteeWord
    value: int | None
    lost: tuple[Rule, ...] = ()
    cells: Mapping[str, FaultGuarantee] = field(default_factory=dict)

    @property
    def nothing(self) -> bool:
        """Whether it is certain that nothing is given."""
        return self.value == self.word.nothing

    @property
    def survives(self) -> tuple[str, ...]:
        """The faults under which as much is given as without."""
        if self.value is None or self.nothing:
            return ()
        return tuple(fault for fault in FAULTS if self.under(fault) == self.value)

    def under(self, fault: str) -> int | None:
        """Return the value under a fault, or while connected (``link``)."""
        if fault == LINK:
            return self.value
        return self.cells[fault].value if fault in self.cells else None

    @property
    def text(self) -> str:
        """``yes``, ``no``, ``unknown``, or the number in the spelling of its need."""
        return self.word.text(self.value)


def faults_between(publisher: QosProfile, subscriber: QosProfile) -> tuple[str, ...]:
    """Return the possible faults of a pair; faults of a broker only if the pack has brokers or a guarantee depends on them."""
    given = () if _has_brokers(publisher.pack) else guarantees_of(publisher, subscriber)
    return tuple(
        fault
        for fault in FAULTS
        if not given or fault not in faults_of(INTERMEDIARY) or any(each.under(fault) != each.value for each in given)
    )


@lru_cache
def _has_brokers(pack: RulePack) -> bool:
    return any(policy.level == BROKER for policy in pack.policies)


def derived_values(publisher: QosProfile, subscriber: QosProfile) -> tuple[tuple[str, str], ...]:
    """Return the derived values of a pair, by name; an unknown one as all its possible values."""
    found = []
    for derivation, values in publisher.pack.derived:
        possible = [
            text for text, bound in values if bound.judge(publisher.values, subscriber.values).result is not False
        ]
        found.append((derivation.name, " or ".join(possible)))
    return tuple(found)


@lru_cache(maxsize=_CACHE)
def guarantees_of(publisher: QosProfile, subscriber: QosProfile) -> tuple[PairGuarantee, ...]:
    """Return all guarantees with a rule in the pack, in the order of the words."""
    pack, found = publisher.pack, []
    offered, requested = publisher.known, subscriber.known
    for name in WORDS:
        if name not in pack.guaranteed or name not in pack.needs:
            continue
        # Pairs have values of their own, and most words read few of them.
        first, second = _read(pack, name)
        key = (
            pack,
            subscriber.pack,
            name,
            _open_at(publisher.frame, first),
            _open_at(subscriber.frame, second),
            *[offered[at] for at in first],
            *[requested[at] for at in second],
        )
        given = _GIVEN.get(key)
        if given is None:
            both = tuple([end.values[at] for end in (publisher, subscriber) for at in _both(pack)])
            given = _alike(name, pack, publisher.frame, subscriber.frame, both).given(publisher, subscriber)
            keep(_GIVEN, key, given)
        found.append(given)
    return tuple(found)


_GIVEN: Final[dict[tuple[Any, ...], PairGuarantee]] = {}


@lru_cache(maxsize=_CACHE)
def _open_at(frame: ProfileFrame, places: tuple[int, ...]) -> int:
    """Return a number that stands for the unknown values there, which take long to hash."""
    return number_of(tuple([(at, frame.open[at]) for at in places if at in frame.open]))


@lru_cache(maxsize=_CACHE)
def _read(pack: RulePack, word: str) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the positions that a guarantee reads of a publisher, and of a subscriber without its needs."""
    first, second = (
        {*_both(pack), *(at for rule in pack.guaranteed[word] for at in rule.bound.sides[side])} for side in (0, 1)
    )
    return tuple(sorted(first)), tuple(sorted(second.difference(_asked(pack))))


@lru_cache
def _both(pack: RulePack) -> tuple[int, ...]:
    """Return the positions that every guarantee reads on both sides."""
    restarts, implementation = pack.vocabulary.indices[NEED, RESTARTS_IN.name], _implementation(pack)
    return (restarts,) if implementation is None else (restarts, implementation)


@lru_cache
def _asked(pack: RulePack) -> frozenset[int]:
    """Return the positions of needs, which differ between questions."""
    survives = pack.vocabulary.indices[NEED, SURVIVES.name]
    return frozenset((survives, *(index for index, _ in pack.needs.values())))


class _ByAnswers:
    """One guarantee of pairs with much in common: equal answers of all rules give the same."""

    def __init__(self, word: GuaranteeWord, at: tuple[frozenset[int], frozenset[int]]) -> None:
        """Take the guarantee, and the positions of values that the profiles share."""
        self._word = word
        self._at = at
        self._left = WORTH_A_FUNCTION
        self._function: Reporting | None = None
        self._given: dict[tuple[int], PairGuarantee | None] = {}

    def given(self, publisher: QosProfile, subscriber: QosProfile) -> PairGuarantee:
        """Return the guarantee; one function asks all rules after several pairs."""
        if self._function is None:
            self._left -= 1
            if not self._left:
                self._function = self._of_all(publisher, subscriber)
            return _give(self._word, publisher, subscriber)
        answers = self._function(publisher.values, subscriber.values)
        known = self._given.get((answers,))
        if known is not None:
            return known
        given = _give(self._word, publisher, subscriber)
        # Numbers follow from values, not from answers alone.
        settled = self._word.kind == "holds" or all(each.lost for each in given.cells.values())
        if settled and all_known(answers):
            keep(self._given, (answers,), given)
        return given

    def _of_all(self, publisher: QosProfile, subscriber: QosProfile) -> Reporting:
        asked = _AskedWord(self._word, publisher, subscriber)
        found = {}
        for faults in ((), *((each,) for each in FAULTS)):
            common = CommonValues(publisher.values, asked.asking(asked.least, faults), self._at)
            for bound in asked.counting(faults)[1]:
                found[id(bound), asked.read_by(bound, faults)] = bound.bound, common
        return compile_answers(found.values())


@lru_cache(maxsize=256)
def _alike(word: str, pack: RulePack, publisher: ProfileFrame, subscriber: ProfileFrame, _values: Values) -> _ByAnswers:
    first, second = (frozenset((*frame.open, *frame.options)) for frame in (publisher, subscriber))
    return _ByAnswers(WORDS[word], (first, second | _asked(pack)))


@lru_cache(maxsize=64)
def _one_by_one(pack: RulePack, publisher: ProfileFrame, subscriber: ProfileFrame) -> RepeatedConditions:
    first, second = (frozenset((*frame.open, *frame.options)) for frame in (publisher, subscriber))
    return RepeatedConditions((first, second - _asked(pack)))


def _give(word: GuaranteeWord, publisher: QosProfile, subscriber: QosProfile) -> PairGuarantee:
    asked = _AskedWord(word, publisher, subscriber)

    def under(*faults: str) -> FaultGuarantee:
        befall, rules = asked.counting(faults)
        cell = asked.granted(rules, faults)
        if cell.value is None or cell.value == word.nothing:
            return cell
        return FaultGuarantee(cell.value, cell.lost, *_evidence(word, befall or (LINK,), publisher, subscriber))

    cells = {LINK: under(), **{fault: under(fault) for fault in FAULTS}}
    return PairGuarantee(word, cells[LINK].value, cells[LINK].lost, cells)


@lru_cache(maxsize=_CACHE)
def _counting(
    pack: RulePack, word: str, faults: tuple[str, ...], restarts: tuple[tuple[str, ...], ...]
) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Return which faults befall a pair, and the positions of the rules of a guarantee that count then."""
    befall = tuple(each for fault in faults for each in befalling(fault, *restarts))
    named = [each.rule.survives for each in pack.guaranteed[word]]
    counting = (at for at, each in enumerate(named) if each == LINK or set(befall) & set(faults_of(each)))
    return befall, tuple(counting)


def _evidence(
    word: GuaranteeWord, faults: tuple[str, ...], publisher: QosProfile, subscriber: QosProfile
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return where a guarantee was observed on running middleware, and the implementations of the pair where it was not."""
    pack = publisher.pack
    index = _implementation(pack)
    if index is None:
        return (), ()
    of_pair = tuple(
        name for end in (publisher, subscriber) for name in _alternatives(pack.policies[index], end.values[index])
    )
    return _evidence_on(pack, word.name, faults, of_pair)


def _implementation(pack: RulePack) -> int | None:
    """Return where the implementation stands on which an end runs."""
    found = (pack.find(level, pack.implementation_option) for level in ("option", "broker"))
    return next((at for at in found if at is not None), None)


@lru_cache(maxsize=_CACHE)
def _evidence_on(
    pack: RulePack, word: str, faults: tuple[str, ...], implementations: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    by_fault = [{each for each in pack.proofs if (each.guarantee, each.fault) == (word, fault)} for fault in faults]
    seen = set.intersection(*({each.value for each in proofs} for proofs in by_fault))
    proofs = [each for each in pack.proofs if each in by_fault[0] and each.value in seen]
    proven = dict.fromkeys(f"{each.product} {each.version}" for each in proofs)
    return tuple(proven), tuple(name for name in dict.fromkeys(implementations) if name not in seen)


def _alternatives(policy: Policy, value: Value) -> tuple[str, ...]:
    if isinstance(value, Depends):
        return tuple(name for _, case in value.cases for name in _alternatives(policy, case))
    return (policy.format(value) if is_plain(value) else NOT_NAMED,)


class _AskedWord:
    """One guarantee of a pair, with the answer of each rule; a rule that reads no fault is asked once for all faults."""

    def __init__(self, word: GuaranteeWord, publisher: QosProfile, subscriber: QosProfile) -> None:
        """Begin with a subscriber without needs."""
        pack = subscriber.pack
        self.word = word
        # The weakest need there is.
        self.least = INFINITE - 1 if word.kind == "at_most" else 1
        restarts = pack.vocabulary.indices[NEED, RESTARTS_IN.name]
        named = (end.values[restarts] for end in (publisher, subscriber))
        self._restarts = tuple([each if isinstance(each, tuple) else () for each in named])
        self._rules = publisher.pack.guaranteed[word.name]
        self._pack = publisher.pack
        self.offered = publisher.values
        self._one_by_one = _one_by_one(publisher.pack, publisher.frame, subscriber.frame)
        self.need = pack.needs[word.name][0]
        self.survives = pack.vocabulary.indices[NEED, SURVIVES.name]
        self._nothing: list[Value] = [*subscriber.values]
        for index, nothing in pack.needs.values():
            self._nothing[index] = nothing
        self._answers: dict[tuple[int, int, tuple[str, ...]], bool | None] = {}
        self._candidates: dict[tuple[int, tuple[str, ...]], tuple[Value, ...]] = {}

    def counting(self, faults: tuple[str, ...]) -> tuple[tuple[str, ...], list[BoundRule]]:
        """Return which faults befall the pair, and the rules that count then."""
        befall, counting = _counting(self._pack, self.word.name, faults, self._restarts)
        return befall, [self._rules[at] for at in counting]

    def granted(self, rules: Sequence[BoundRule], faults: tuple[str, ...]) -> FaultGuarantee:
        """Return the strongest need that all rules grant under these faults."""
        results = [(bound.rule, self.answer(bound, self.least, faults)) for bound in rules]
        lost = tuple(rule for rule, result in results if result is not True)
        if not lost:
            found = self.strongest(rules, self.least, faults)
            # A bound that no rule gives as a number is not known.
            return FaultGuarantee(None if self.word.kind == "at_most" and found == self.least else found)
        refused = any(result is False for _, result in results)
        return FaultGuarantee(self.word.nothing if refused else None, lost)  # type: ignore[arg-type]

    def answer(self, bound: BoundRule, need: int, faults: tuple[str, ...]) -> bool | None:
        """Ask a rule as if this were needed; False or None if it reports."""
        key = (id(bound), need, self.read_by(bound, faults))
        if key not in self._answers:
            result = self._one_by_one.of(bound.bound, self.offered, self.asking(need, faults))
            self._answers[key] = None if bound.rule.doubt and result is False else result
        return self._answers[key]

    def strongest(self, rules: Sequence[BoundRule], least: int, faults: tuple[str, ...]) -> int:
        """Return the strongest need that all rules grant; ``least`` is granted."""
        word, found = self.word, least
        if word.kind == "holds":
            return 1
        for value in (value for bound in rules for value in self.candidates(bound, least, faults)):
            if not isinstance(value, int) or not word.need.domain.has(value) or not word.stronger(value, found):
                continue
            if all(self.answer(bound, value, faults) is True for bound in rules):
                found = value
        return found

    def candidates(self, bound: BoundRule, least: int, faults: tuple[str, ...]) -> tuple[Value, ...]:
        """Return needs at which the answer of a rule may change, under any assumption."""
        key = (id(bound), self.read_by(bound, faults))
        if key not in self._candidates:
            use = next((use for use in bound.bound.uses if use.index == self.need), None)
            sides = self.offered, self.asking(least, faults)
            self._candidates[key] = () if use is None else tuple(turning_values(bound.bound, use, *sides))
        return self._candidates[key]

    def read_by(self, bound: BoundRule, faults: tuple[str, ...]) -> tuple[str, ...]:
        """Return the faults that a rule reads."""
        return faults if self.survives in bound.bound.sides[1] else ()

    def asking(self, need: int, faults: tuple[str, ...]) -> tuple[Value, ...]:
        """Return the values of a subscriber that needs this one word under these faults."""
        asking = self._nothing.copy()
        asking[self.need], asking[self.survives] = need, faults
        return tuple(asking)


def over_hops(hops: Sequence[Sequence[PairGuarantee]], *, carried: bool) -> list[PairGuarantee]:
    """Put the guarantees of the hops of a path together, per fault; a hop never improves what the others give.

    Args:
        hops: the guarantees of each hop, from the publisher on. A guarantee that a hop lacks is unknown.
        carried: whether every bridge between them carries liveliness on.
    """
    by_word = {
        name: [next((given for given in hop if given.word is word), PairGuarantee(word, None)) for hop in hops]
        for name, word in WORDS.items()
    }
    return [
        _over(word, by_word[name], by_word["latest"], carried=carried)
        for name, word in WORDS.items()
        if any(given.value is not None or given.lost for given in by_word[name])
    ]


def _over(
    word: GuaranteeWord, hops: Sequence[PairGuarantee], latest: Sequence[PairGuarantee], *, carried: bool
) -> PairGuarantee:
    if len(hops) == 1:
        return hops[0]
    lost = tuple(rule for given in hops for rule in given.lost)

    def under(fault: str) -> int | None:
        before = [given.under(fault) for given in latest[:-1]]
        return _joined(word, [given.under(fault) for given in hops], before, fault, carried=carried)

    connected = under(LINK)
    lost = lost if connected in {None, word.nothing} else ()
    cells = {LINK: FaultGuarantee(connected, lost), **{fault: FaultGuarantee(under(fault)) for fault in FAULTS}}
    return PairGuarantee(word, connected, lost, cells)


def _weakest(word: GuaranteeWord, values: Sequence[int | None]) -> int | None:
    if word.nothing in values:
        return word.nothing  # type: ignore[return-value]
    known = [value for value in values if value is not None]
    if len(known) < len(values):
        return None
    return max(known) if word.kind == "at_most" else min(known)


def _joined(
    word: GuaranteeWord, hops: Sequence[int | None], latest: Sequence[int | None], fault: str, *, carried: bool
) -> int | None:
    over = word.joined(faulty=fault != LINK)
    if over == "last hop":
        # Samples that are kept for late joiners have to arrive there first.
        filled = _weakest(WORDS["latest"], latest) if word.name == "late_join" else 1
        return word.nothing if hops[-1] == word.nothing or filled == 0 else hops[-1] if filled else None  # type: ignore[return-value]
    if over == "not over a bridge" and not carried:
        return word.nothing  # type: ignore[return-value]
    together = _weakest(word, hops)
    if over == "every hop" or together is None or together == word.nothing:
        return together
    return min(sum(value for value in hops if value is not None), INFINITE)
