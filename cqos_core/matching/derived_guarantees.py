"""What a pair that fits gives its subscriber: derived from the rules on which a pack's guarantees rest.

A number is given where the strongest need that all rules grant is that number, so nothing is stated twice.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.compiled import Common, Question, compiled
from cqos_core.language.policy import BROKER, NEED
from cqos_core.language.solve import turning_points
from cqos_core.language.values import INFINITE, Depends, is_plain
from cqos_core.matching.judge import ask
from cqos_core.model.dataclass import dataclass
from cqos_core.model.memory import keep
from cqos_core.packs.guarantee import FAULTS, INTERMEDIARY, LINK, RESTARTS_IN, SURVIVES, WORDS, befalling, faults_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from cqos_core.language.compiled import Reporting
    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Value, Values
    from cqos_core.language.vocabulary import Use
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.guarantee import Word
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule import Rule
    from cqos_core.resolving.resolved import ProfileFrame, QosProfile

_CACHE: Final = 50_000
NOT_NAMED: Final = "an implementation that is not stated"


@dataclass(frozen=True, slots=True)
class Cell:
    """What is given of one guarantee under one fault.

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
class DerivedGuarantees:
    """One guarantee of a pair, or of a path; compared by identity.

    Attributes:
        word: which one.
        value: what is given while both ends are connected: 1 or 0 for what holds or not, else the number; None where it
            cannot be known.
        lost: the rules that keep it from holding, or from being known.
        cells: the same for connected ends (``link``) and under each fault.
    """

    word: Word
    value: int | None
    lost: tuple[Rule, ...] = ()
    cells: Mapping[str, Cell] = field(default_factory=dict)

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
        """Return what is given under a fault, or while connected (``link``)."""
        if fault == LINK:
            return self.value
        return self.cells[fault].value if fault in self.cells else None

    @property
    def text(self) -> str:
        """``yes``, ``no``, ``unknown``, or the number in the spelling of its need."""
        return self.word.text(self.value)


def faults_between(publisher: QosProfile, subscriber: QosProfile) -> tuple[str, ...]:
    """Return the faults that can befall a pair: of a broker only where the pack has brokers, or a guarantee changes by them."""
    pack = publisher.pack
    given = () if any(policy.level == BROKER for policy in pack.policies) else give(publisher, subscriber)
    return tuple(
        fault
        for fault in FAULTS
        if not given or fault not in faults_of(INTERMEDIARY) or any(each.under(fault) != each.value for each in given)
    )


def derive(publisher: QosProfile, subscriber: QosProfile) -> tuple[tuple[str, str], ...]:
    """Return the values of a pair that no end states, by name; one that is not known as all that it may be."""
    found = []
    for derivation, values in publisher.pack.derived:
        possible = [
            text for text, bound in values if bound.judge(publisher.values, subscriber.values).result is not False
        ]
        found.append((derivation.name, " or ".join(possible)))
    return tuple(found)


@lru_cache(maxsize=_CACHE)
def give(publisher: QosProfile, subscriber: QosProfile) -> tuple[DerivedGuarantees, ...]:
    """Return all guarantees with a rule in the pack, in the order of the words."""
    pack, found = publisher.pack, []
    for name, word in WORDS.items():
        if name not in pack.guaranteed or name not in pack.needs:
            continue
        # Pairs have values of their own, and most words read few of them.
        first, second = _read(pack, name)
        key = (
            pack,
            subscriber.pack,
            name,
            *[publisher.values[at] for at in first],
            *[subscriber.values[at] for at in second],
        )
        given = _GIVEN.get(key)
        if given is None:
            given = _give(word, publisher, subscriber)
            keep(_GIVEN, key, given)
        found.append(given)
    return tuple(found)


_GIVEN: Final[dict[tuple[Any, ...], DerivedGuarantees]] = {}


@lru_cache(maxsize=_CACHE)
def _read(pack: RulePack, word: str) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return where a guarantee looks at the values of a publisher, and of a subscriber whatever that needs."""
    restarts, survives = (pack.vocabulary.indices[NEED, policy.name] for policy in (RESTARTS_IN, SURVIVES))
    both = (restarts, *([] if (at := _implementation(pack)) is None else [at]))
    first, second = (
        {*both, *(at for rule in pack.guaranteed[word] for at in rule.bound.sides[side])} for side in (0, 1)
    )
    asked = {survives, *(index for index, _ in pack.needs.values())}
    return tuple(sorted(first)), tuple(sorted(second - asked))


def _give(word: Word, publisher: QosProfile, subscriber: QosProfile) -> DerivedGuarantees:
    index = publisher.pack.vocabulary.indices[NEED, RESTARTS_IN.name]
    restarts = _names(publisher.values[index]), _names(subscriber.values[index])
    rules = publisher.pack.guaranteed[word.name]
    asked = _AskedWord(word, publisher, subscriber)

    def under(*faults: str) -> Cell:
        befall, counting = _counting(publisher.pack, word.name, faults, restarts)
        cell = asked.granted([rules[at] for at in counting], faults)
        if cell.value is None or cell.value == word.nothing:
            return cell
        return Cell(cell.value, cell.lost, *_evidence(word, befall or (LINK,), publisher, subscriber))

    cells = {LINK: under(), **{fault: under(fault) for fault in FAULTS}}
    return DerivedGuarantees(word, cells[LINK].value, cells[LINK].lost, cells)


@lru_cache(maxsize=_CACHE)
def _counting(
    pack: RulePack, word: str, faults: tuple[str, ...], restarts: tuple[tuple[str, ...], tuple[str, ...]]
) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Return which faults befall a pair, and the positions of the rules of a guarantee that count then."""
    befall = tuple(each for fault in faults for each in befalling(fault, *restarts))
    named = [each.rule.survives for each in pack.guaranteed[word]]
    counting = (at for at, each in enumerate(named) if each == LINK or set(befall) & set(faults_of(each)))
    return befall, tuple(counting)


def _names(value: Value) -> tuple[str, ...]:
    return value if isinstance(value, tuple) else ()


def _evidence(
    word: Word, faults: tuple[str, ...], publisher: QosProfile, subscriber: QosProfile
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Where a cell was seen on running middleware, and the implementations of the pair on which it was not."""
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
    """One word of a pair, and what each rule answers; a rule that reads no fault is asked once for all faults."""

    def __init__(self, word: Word, publisher: QosProfile, subscriber: QosProfile) -> None:
        """Begin with a subscriber that needs nothing."""
        pack = subscriber.pack
        self.word = word
        self.offered = publisher.values
        self._functions = _functions(publisher.pack, publisher.frame, subscriber.frame)
        self.need = pack.needs[word.name][0]
        self.survives = pack.vocabulary.indices[NEED, SURVIVES.name]
        self._nothing: list[Value] = [*subscriber.values]
        for index, nothing in pack.needs.values():
            self._nothing[index] = nothing
        self._answers: dict[tuple[int, int, tuple[str, ...]], bool | None] = {}
        self._candidates: dict[tuple[int, tuple[str, ...]], tuple[Value, ...]] = {}

    def granted(self, rules: Sequence[BoundRule], faults: tuple[str, ...]) -> Cell:
        """Return the strongest need that all rules grant under these faults."""
        # The weakest need there is.
        least = INFINITE - 1 if self.word.kind == "at_most" else 1
        results = [(bound.rule, self.answer(bound, least, faults)) for bound in rules]
        lost = tuple(rule for rule, result in results if result is not True)
        if not lost:
            found = self.strongest(rules, least, faults)
            # A bound that no rule gives as a number is not known.
            return Cell(None if self.word.kind == "at_most" and found == least else found)
        refused = any(result is False for _, result in results)
        return Cell(self.word.nothing if refused else None, lost)  # type: ignore[arg-type]

    def answer(self, bound: BoundRule, need: int, faults: tuple[str, ...]) -> bool | None:
        """Ask a rule as if this were needed; False or None where it speaks."""
        key = (id(bound), need, self._read_by(bound, faults))
        if key not in self._answers:
            self._answers[key] = self._functions.answer(bound, self.offered, self._asking(need, faults))
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
        """Return needs at which a rule may turn, also those of values that depend on an assumption."""
        key = (id(bound), self._read_by(bound, faults))
        if key not in self._candidates:
            use = next((use for use in bound.bound.uses if use.index == self.need), None)
            found = () if use is None else tuple(_candidates(bound, use, self.offered, self._asking(least, faults)))
            self._candidates[key] = found
        return self._candidates[key]

    def _read_by(self, bound: BoundRule, faults: tuple[str, ...]) -> tuple[str, ...]:
        return faults if self.survives in bound.bound.sides[1] else ()

    def _asking(self, need: int, faults: tuple[str, ...]) -> tuple[Value, ...]:
        """Return the values of a subscriber that needs this one word under these faults."""
        asking = self._nothing.copy()
        asking[self.need], asking[self.survives] = need, faults
        return tuple(asking)


class _Functions:
    """Rules asked of two profiles: each is compiled for what many profiles have in common once it was asked often."""

    def __init__(self, publisher: ProfileFrame, subscriber: ProfileFrame, asked: Collection[int]) -> None:
        """Begin without any; ``asked``: the positions of needs, which differ from question to question."""
        first, second = (frozenset((*frame.open, *frame.options)) for frame in (publisher, subscriber))
        self._at = first, second.difference(asked)
        self._uses = Counter[int]()
        self._made: dict[int, tuple[BoundRule, Reporting]] = {}

    def answer(self, bound: BoundRule, offered: Values, asking: Values) -> bool | None:
        """Ask a rule; False or None where it speaks."""
        # The rule is kept with what is remembered of it, so that no other one gets its identity.
        made = self._made.get(id(bound))
        if made is not None and (says := _SAYS[made[1](offered, asking)]) is not _OPEN:
            return None if says is False and bound.rule.doubt else says
        # Values that differ in what it does not read have one answer.
        first, second = bound.bound.sides
        key = (id(bound), *[offered[at] for at in first], *[asking[at] for at in second])
        known = _ANSWERED.get(key)
        if known is None:
            self._uses[id(bound)] += 1
            if self._uses[id(bound)] == _WORTH_A_FUNCTION:
                self._made[id(bound)] = bound, _made(bound, Common(offered, asking, self._at))
            said = ask(bound, offered, asking)
            result = True if said is None else None if bound.rule.doubt else said.outcome.result
            known = bound, result
            keep(_ANSWERED, key, known)
        return known[1]


@lru_cache(maxsize=64)
def _functions(pack: RulePack, publisher: ProfileFrame, subscriber: ProfileFrame) -> _Functions:
    survives = pack.vocabulary.indices[NEED, SURVIVES.name]
    return _Functions(publisher, subscriber, (survives, *(index for index, _ in pack.needs.values())))


def _made(bound: BoundRule, common: Common) -> Reporting:
    """Compile whether a rule may be other than true, other than false, false for certain, and true for certain."""
    ways = ((False, True), (True, True), (False, False), (True, False))
    return compiled([Question(bound.bound, answer, undecided, common) for answer, undecided in ways]).reporting


_ANSWERED: Final[dict[tuple[Any, ...], tuple[BoundRule, bool | None]]] = {}
_WORTH_A_FUNCTION: Final = 12
_OPEN: Final = "open"
_SAYS: Final[list[Any]] = [
    True if not bits & 0b1 else False if not bits & 0b10 else None if not bits & 0b1100 else _OPEN for bits in range(16)
]
"""By what a function may report, what a rule answers."""


def _candidates(bound: BoundRule, use: Use, offered: Values, asking: Values) -> Iterator[Value]:
    yield from turning_points(bound.bound, use, offered, asking)
    for other in bound.bound.uses:
        value = (asking if other.second else offered)[other.index]
        if isinstance(value, Depends):
            yield from (case for _, case in value.cases)


def over(hops: Sequence[Sequence[DerivedGuarantees]], *, carried: bool) -> list[DerivedGuarantees]:
    """Put the guarantees of the hops of a path together, per fault; a hop never improves what the others give.

    Args:
        hops: what each hop gives, from the publisher on. Of a word that a hop says nothing of, nothing is known.
        carried: whether every bridge between them carries liveliness on.
    """
    by_word = {
        name: [next((given for given in hop if given.word is word), DerivedGuarantees(word, None)) for hop in hops]
        for name, word in WORDS.items()
    }
    return [
        _over(word, by_word[name], by_word["latest"], carried=carried)
        for name, word in WORDS.items()
        if any(given.value is not None or given.lost for given in by_word[name])
    ]


def _over(
    word: Word, hops: Sequence[DerivedGuarantees], latest: Sequence[DerivedGuarantees], *, carried: bool
) -> DerivedGuarantees:
    if len(hops) == 1:
        return hops[0]
    lost = tuple(rule for given in hops for rule in given.lost)

    def under(fault: str) -> int | None:
        before = [given.under(fault) for given in latest[:-1]]
        return _joined(word, [given.under(fault) for given in hops], before, fault, carried=carried)

    connected = under(LINK)
    lost = lost if connected in {None, word.nothing} else ()
    cells = {LINK: Cell(connected, lost), **{fault: Cell(under(fault)) for fault in FAULTS}}
    return DerivedGuarantees(word, connected, lost, cells)


def _weakest(word: Word, values: Sequence[int | None]) -> int | None:
    if word.nothing in values:
        return word.nothing  # type: ignore[return-value]
    known = [value for value in values if value is not None]
    if len(known) < len(values):
        return None
    return max(known) if word.kind == "at_most" else min(known)


def _joined(
    word: Word, hops: Sequence[int | None], latest: Sequence[int | None], fault: str, *, carried: bool
) -> int | None:
    over = word.joined(faulty=fault != LINK)
    if over == "last hop":
        # What is stored for those who come late has to get there first.
        filled = _weakest(WORDS["latest"], latest) if word.name == "late_join" else 1
        return word.nothing if hops[-1] == word.nothing or filled == 0 else hops[-1] if filled else None  # type: ignore[return-value]
    if over == "not over a bridge" and not carried:
        return word.nothing  # type: ignore[return-value]
    together = _weakest(word, hops)
    if over == "every hop" or together is None or together == word.nothing:
        return together
    return min(sum(value for value in hops if value is not None), INFINITE)
