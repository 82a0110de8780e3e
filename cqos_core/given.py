"""What a pair that fits gives its subscriber: derived from the rules on which a pack's guarantees rest.

A number is given where the strongest need that all rules grant is that number, so nothing is stated twice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from cqos_core.guarantee import FAULTS, SURVIVES, WORDS
from cqos_core.judge import ask
from cqos_core.policy import INFINITE, NEED
from cqos_core.solve import turning_points

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.guarantee import Word
    from cqos_core.pack import BoundRule
    from cqos_core.policy import Value
    from cqos_core.resolved import QosProfile
    from cqos_core.rule import Rule

_CACHE: Final = 50_000


@dataclass(frozen=True, slots=True)
class Given:
    """One guarantee of a pair, or of a path.

    Attributes:
        word: which one.
        value: 1 or 0 for what holds or not, else the number; None where it cannot be known.
        survives: the faults it survives beside a broken link.
        lost: the rules that keep it from holding, or from being known.
    """

    word: Word
    value: int | None
    survives: tuple[str, ...] = ()
    lost: tuple[Rule, ...] = ()

    @property
    def nothing(self) -> bool:
        """Whether it is certain that nothing is given."""
        return self.value == self.word.nothing

    @property
    def text(self) -> str:
        """``yes``, ``no``, ``unknown``, or the number in the spelling of its need."""
        if self.value is None:
            return "unknown"
        if self.word.kind == "holds":
            return "yes" if self.value else "no"
        return "none" if self.nothing else self.word.need.domain.format(self.value)


@lru_cache(maxsize=_CACHE)
def give(publisher: QosProfile, subscriber: QosProfile) -> tuple[Given, ...]:
    """Return all guarantees of which the pack says anything, in the order of the words."""
    rules = publisher.pack.guaranteed
    return tuple(
        _give(word, rules[name], publisher, subscriber)
        for name, word in WORDS.items()
        if name in rules and name in publisher.pack.needs
    )


def _give(word: Word, rules: Sequence[BoundRule], publisher: QosProfile, subscriber: QosProfile) -> Given:
    link = [bound for bound in rules if bound.rule.survives == "link"]
    least = _least(word)
    value: int | None = word.nothing  # type: ignore[assignment]
    results = _asked(link, word, least, publisher, subscriber)
    lost = tuple(rule for rule, result in results if result is not True)
    if not lost:
        value = _strongest(word, link, least, publisher, subscriber)
    elif all(result is not False for _, result in results):
        value = None
    faults = [
        fault
        for fault in FAULTS
        if value is not None
        and value != word.nothing
        and _survives(fault, word, [b for b in rules if b.rule.survives == fault], value, publisher, subscriber)
    ]
    return Given(word, value, tuple(faults), lost)


def _least(word: Word) -> int:
    """The weakest need there is."""
    return INFINITE - 1 if word.kind == "at_most" else 1


def _asked(
    rules: Sequence[BoundRule],
    word: Word,
    need: int,
    publisher: QosProfile,
    subscriber: QosProfile,
    faults: tuple[str, ...] = (),
) -> list[tuple[Rule, bool | None]]:
    """Ask the rules as if this were needed; False or None where a rule speaks."""
    pack = publisher.pack
    asking: list[Value] = [*subscriber.values]
    for index, nothing in pack.needs.values():
        asking[index] = nothing
    asking[pack.needs[word.name][0]] = need
    asking[pack.vocabulary.indices[NEED, SURVIVES.name]] = faults
    values = tuple(asking)
    spoken = ((bound.rule, ask(bound, publisher.values, values)) for bound in rules)
    return [(rule, True if said is None else None if rule.doubt else said.outcome.result) for rule, said in spoken]


def _strongest(
    word: Word, rules: Sequence[BoundRule], least: int, publisher: QosProfile, subscriber: QosProfile
) -> int:
    """The strongest need that all rules grant; ``least`` is granted."""
    if word.kind == "holds":
        return 1
    index = publisher.pack.needs[word.name][0]
    found = least
    for bound in rules:
        use = next((use for use in bound.bound.uses if use.index == index), None)
        for value in () if use is None else turning_points(bound.bound, use, publisher.values, subscriber.values):
            granted = isinstance(value, int) and word.need.domain.has(value) and word.stronger(value, found)
            if granted and all(r is True for _, r in _asked(rules, word, value, publisher, subscriber)):  # type: ignore[arg-type]
                found = value  # type: ignore[assignment]
    return found


def _survives(
    fault: str,
    word: Word,
    rules: Sequence[BoundRule],
    value: int,
    publisher: QosProfile,
    subscriber: QosProfile,
) -> bool:
    """Whether the same is given after a fault; of a fault that no rule speaks of nothing is claimed."""
    return bool(rules) and all(
        result is True for _, result in _asked(rules, word, value, publisher, subscriber, (fault,))
    )


def over(hops: Sequence[Sequence[Given]], *, carried: bool) -> list[Given]:
    """Put the guarantees of the hops of a path together; a hop before others never improves what they give.

    Args:
        hops: what each hop gives, from the publisher on. Of a word that a hop says nothing of, nothing is known.
        carried: whether every bridge between them carries liveliness on.
    """
    by_word = {
        name: [next((given for given in hop if given.word is word), Given(word, None)) for hop in hops]
        for name, word in WORDS.items()
    }
    fills = _worst(by_word["latest"][:-1])
    return [
        _over(word, by_word[name], carried=carried, fills=fills)
        for name, word in WORDS.items()
        if any(given.value is not None or given.lost for given in by_word[name])
    ]


def _over(word: Word, hops: Sequence[Given], *, carried: bool, fills: bool | None) -> Given:
    nothing = Given(word, word.nothing, (), tuple(rule for given in hops for rule in given.lost))  # type: ignore[arg-type]
    if len(hops) == 1:
        return hops[0]
    if word.over == "last hop":
        # What is stored for those who come late has to get there first.
        filled = fills if word.name == "late_join" else True
        last = hops[-1]
        if last.nothing or filled is False:
            return nothing
        return replace(last, value=last.value if filled else None, survives=())
    if any(given.nothing for given in hops) or (word.over == "not over a bridge" and not carried):
        return nothing
    values = [given.value for given in hops if given.value is not None]
    if len(values) < len(hops):
        return replace(nothing, value=None)
    survives = tuple(fault for fault in FAULTS if all(fault in given.survives for given in hops))
    value = min(values) if word.over == "every hop" else min(sum(values), INFINITE)
    return Given(word, value, survives)


def _worst(hops: Sequence[Given]) -> bool | None:
    """Whether something holds on every hop."""
    if any(given.value == 0 for given in hops):
        return False
    return None if any(given.value is None for given in hops) else True
