"""Verdicts of pairs that are judged again and again, each of two unobserved ends that are alone on their topic and need nothing.

`cqos_core.matching.judge.verdict_alone` is what they mean. What rules about one end say is asked once for each end, and one function
tells which rules over both may report. What it does not tell for certain is left to `verdict_alone`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.language.relation import positions
from cqos_core.matching.judge import (
    apart,
    ask,
    meeting_rules,
    of_end,
    of_one,
    pair_rules,
    read_in_worlds,
    refusing_rules,
    signal_rules,
    undecided_meetings,
    verdict_alone,
    verdict_by,
    worst,
)
from cqos_core.matching.rule_set import PairRules
from cqos_core.model.memory import keep
from cqos_core.model.report import Verdict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.matching.judge import Violation
    from cqos_core.matching.rule_set import EndRules, Ready
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.parts import ProfileParts
    from cqos_core.resolving.qos_profile import ProfileFrame, QosProfile

_MOST_VERDICTS: Final = 1_000


class PairEnd:
    """One end of such pairs.

    Attributes:
        like: its profile, or where it has parts one with the same frame and codes.
        parts: of its profile, where that is not made yet.
        values: those of its profile that are known.
        at_best: the verdict of its pairs by the rules about it alone; None where a rule over its topic may have more to say.
    """

    __slots__ = ("at_best", "like", "parts", "values")

    def __init__(self, like: QosProfile, role: str, parts: ProfileParts | None) -> None:
        """Take its profile, or what that is made of."""
        self.like = like
        self.parts = parts
        self.values: Sequence[Any] = like.known if parts is None else parts.known
        self.at_best = self._at_best(role)

    @property
    def profile(self) -> QosProfile:
        """Its profile; most verdicts need none."""
        return self.like if self.parts is None else self.parts.made()[0]

    def _at_best(self, role: str) -> Verdict | None:
        pack = self.like.pack
        if self._may_report(signal_rules(pack)):
            return None
        if self.like.unread or self.like.refused or any(map(self._may_report, _about(pack, role))):
            return worst(verdict for verdict, _ in of_end(self.profile, role, False, False))
        return Verdict.COMPATIBLE

    def _may_report(self, rules: EndRules) -> bool:
        ready = rules.ready(self.like, self.like, at_once=True)
        assert ready is not None  # noqa: S101 - at once
        reporting, counted, _ = ready
        return bool(reporting(self.values, self.values) & counted)


def _about(pack: RulePack, role: str) -> tuple[EndRules, EndRules]:
    return of_one(pack, role, False), refusing_rules(pack, False)


@lru_cache
def _over_both(pack: RulePack) -> PairRules:
    """Return the conditions of meeting and the rules of pairs."""
    return PairRules(pack, (*meeting_rules(pack).rules, *pair_rules(pack).rules), _ask_pair)


def _ask_pair(bound: BoundRule, publisher: QosProfile, subscriber: QosProfile) -> Violation | None:
    return ask(bound, publisher.values, subscriber.values)


class _Ready(NamedTuple):
    """What tells the verdicts of ends that have as much in common as two others.

    Attributes:
        rules: those over both ends.
        meeting: the bits of the conditions of meeting among them.
        undecided: such conditions that may rest on assumptions, if there are any.
        verdicts: by the rules that report for certain, as bits.
    """

    rules: Ready
    meeting: int
    undecided: Ready | None
    verdicts: dict[int, Verdict]


_READY: Final[dict[tuple[ProfileFrame, ProfileFrame], _Ready]] = {}


def _ready(publisher: QosProfile, subscriber: QosProfile) -> _Ready:
    pack = publisher.pack
    rules = _over_both(pack).ready(publisher, subscriber, at_once=True)
    undecided = undecided_meetings(pack).ready(publisher, subscriber, at_once=True)
    assert rules is not None  # noqa: S101 - at once
    assert undecided is not None  # noqa: S101 - likewise
    counted = undecided[1] & (read_in_worlds(pack, publisher.frame, 0) | read_in_worlds(pack, subscriber.frame, 1))
    meeting = (1 << len(meeting_rules(pack).rules)) - 1
    return _Ready(rules, meeting, (undecided[0], counted, 0) if counted else None, {0: Verdict.COMPATIBLE})


def verdict(publisher: PairEnd, subscriber: PairEnd) -> Verdict:
    """Return the verdict of two ends; of two that never meet it is unknown."""
    key = publisher.like.frame, subscriber.like.frame
    known = _READY.get(key) or keep(_READY, key, _ready(publisher.like, subscriber.like))
    (reporting, counted, exact), meeting, undecided, verdicts = known
    here, there = publisher.at_best, subscriber.at_best
    offered, requested = publisher.values, subscriber.values
    found = reporting(offered, requested) & counted
    may_be_apart = undecided is not None and undecided[0](offered, requested) & undecided[1]
    if here is None or there is None or may_be_apart or found & ~exact:
        ends = publisher.profile, subscriber.profile
        return Verdict.UNKNOWN if apart(*ends) else verdict_alone(*ends)
    if found & meeting:
        return Verdict.UNKNOWN
    both = verdicts.get(found)
    if both is None:
        rules = _over_both(publisher.like.pack).rules
        both = worst(verdict_by(rules[position].rule, unknown=False) for position in positions(found))
        keep(verdicts, found, both, _MOST_VERDICTS)
    return both if here is there is Verdict.COMPATIBLE else worst((here, there, both))
