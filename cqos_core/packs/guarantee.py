"""Guarantees of subscribers and requirements of their applications, in words that no protocol owns.

A need is a policy of level ``need``: it belongs to the subscription, and by default it requires nothing. A pack states the guarantees
of its pairs by rules made with `gives`. Each reports only if the need is stated, and is then required like any other rule. So a
need that is certainly unmet makes a pair incompatible, and an undecided one is a warning. Reasons, remedies and groups
are those of every rule.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from functools import reduce
from operator import and_
from typing import Any, Final, Literal

from cqos_core.language.domains import Count, Domain, Duration, Flag, Names
from cqos_core.language.expression import Condition, Operand, as_condition, define, in_, offered, overlaps, requested
from cqos_core.language.expression import Literal as Constant
from cqos_core.language.policy import NEED, Policy
from cqos_core.language.values import INFINITE, Plain, normalise
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import InvalidValueError
from cqos_core.packs.rule import Rule

Kind = Literal["holds", "at_least", "at_most"]
Over = Literal["every hop", "sum", "last hop", "not over a bridge"]
FAULTS: Final = ("link_outage", "subscriber_restart", "publisher_restart", "broker_stop", "broker_crash")
"""Faults of a pair. A guarantee without a fault is about ends that stay connected."""
LINK: Final = "link"
"""`Rule.survives` of a rule about connected ends only."""
INTERMEDIARY: Final = "intermediary_restart"
"""The broker between both ends stops or crashes, and comes back."""
_SEVERAL: Final = {LINK: (), INTERMEDIARY: ("broker_stop", "broker_crash")}
_AFTER: Final = {
    LINK: "",
    "link_outage": " over a link outage",
    INTERMEDIARY: " after a restart of the broker or relay between them",
}


@dataclass(frozen=True, slots=True)
class GuaranteeWord:
    """One guarantee, such as ``loss_free``.

    Attributes:
        need: the policy under which a subscription asks for it.
        kind: it holds or not; or the number given must be at least, or at most, the one that is needed.
        over: how it comes about over several hops.
        doc: its meaning.
    """

    need: Policy
    kind: Kind
    over: Over
    doc: str

    @property
    def name(self) -> str:
        """The word as it stands below ``needs:``."""
        return self.need.aliases[0]

    @property
    def nothing(self) -> Plain:
        """The "not required" value."""
        return INFINITE if self.kind == "at_most" else 0

    def joined(self, *, faulty: bool) -> Over:
        """Return how it comes about over several hops; under a fault a bound of the last hop rests on all of them."""
        bound = self.over == "last hop" and self.kind == "at_most"
        return "every hop" if faulty and bound else self.over

    def enough(self, given: Operand) -> Condition:
        """Return the condition that the given number is enough for the need."""
        asked = requested(self.need)
        return given <= asked if self.kind == "at_most" else given >= asked

    def text(self, value: int | None) -> str:
        """Return ``yes``, ``no``, ``unknown``, ``none``, or a number in the spelling of the need."""
        if value is None:
            return "unknown"
        if self.kind == "holds":
            return "yes" if value else "no"
        return "none" if value == self.nothing else self.need.domain.format(value)

    def stronger(self, value: int, other: int) -> bool:
        """Whether giving ``value`` is more than giving ``other``."""
        return value < other if self.kind == "at_most" else value > other


_SOURCE: Final = "C-QoS, guarantees"


def _word(name: str, domain: Domain, kind: Kind, over: Over, doc: str) -> GuaranteeWord:
    nothing = {"holds": "false", "at_least": "0" if isinstance(domain, Count) else "0s", "at_most": "infinite"}[kind]
    words = {"true": "1", "false": "0"} if isinstance(domain, Count) else {}
    need = Policy(
        f"need.{name}",
        domain,
        nothing,
        f"Whether the application needs {name}: {doc}",
        _SOURCE,
        level=NEED,
        roles=("subscriber",),
        aliases=(name,),
        words=words,
        stronger="lower" if kind == "at_most" else "higher",
    )
    return GuaranteeWord(need, kind, over, doc)


_LISTED: Final = (
    _word("latest", Flag(), "holds", "every hop", "the newest value arrives in the end"),
    _word("loss_free", Flag(), "holds", "every hop", "nothing is lost while it is connected"),
    _word("duplicate_free", Flag(), "holds", "every hop", "nothing arrives twice"),
    _word("ordered", Flag(), "holds", "every hop", "what one publisher sends arrives in that order"),
    _word("late_join", Count(), "at_least", "last hop", "so many samples from before it joined"),
    _word("offline", Duration(), "at_least", "last hop", "so long an absence of its own is bridged"),
    _word("max_age", Duration(), "at_most", "sum", "nothing older than this arrives"),
    _word("max_gap", Duration(), "at_most", "last hop", "no longer time passes between two samples"),
    _word(
        "liveness", Duration(), "at_most", "not over a bridge", "within this time the loss of a publisher is noticed"
    ),
)
WORDS: Final = {word.name: word for word in _LISTED}


def faults_of(survives: str) -> tuple[str, ...]:
    """Return the faults that a word of ``survives`` names: none for ``link``, both broker faults for ``intermediary_restart``."""
    return _SEVERAL.get(survives, (survives,) if survives in FAULTS else ())


class Faults(Names):
    """A list of faults, in any spelling."""

    def parse(self, text: str) -> tuple[str, ...]:
        """Read ``[subscriber_restart]``; what is named twice counts once."""
        found: dict[str, None] = {}
        for name in map(normalise, super().parse(text)):
            faults = faults_of(name)
            if not faults:
                message = f"`{name}` is no fault"
                raise InvalidValueError(message, self.expected())
            found |= dict.fromkeys(faults)
        return tuple(found)

    def expected(self) -> str:
        """Give the faults."""
        return f"a list of {', '.join(FAULTS)}"


SURVIVES: Final = Policy(
    "need.survives",
    Faults(),
    "[]",
    f"Which faults what it needs must survive, of {', '.join(FAULTS)}; without any, both ends stay connected.",
    _SOURCE,
    level=NEED,
    roles=("subscriber",),
    aliases=("survives",),
)
RELAYED: Final = Policy(
    "relayed",
    Flag(),
    "false",
    "Whether a bridge publishes here what others publish elsewhere, without telling whether those are alive.",
    _SOURCE,
    level=NEED,
    roles=("publisher",),
)
RESTARTS_IN: Final = Policy(
    "need.restarts_in",
    Faults(),
    {"publisher": "[publisher_restart]", "subscriber": "[subscriber_restart]"},
    "In which faults this end starts again: an end of a bridge does when what stands between publisher and subscriber is restarted.",
    _SOURCE,
    level=NEED,
    derived=True,
)
OUTAGE: Final = Policy(
    "outage",
    Duration(),
    None,
    "The longest time for which a link, an end or a broker is away that has to be survived; without it nothing is claimed about a broken "
    "link.",
    _SOURCE,
    level="option",
)
REPAIR_TIME: Final = Policy(
    "repair_time",
    Duration(),
    None,
    "How long it takes at most until a lost sample has arrived: heartbeats, requests, and packets that are lost again.",
    level="option",
)
REDISCOVERY_TIME: Final = Policy(
    "rediscovery_time",
    Duration(),
    None,
    "How long it takes at most until two ends that can reach each other match, and the later one has what was kept for it.",
    level="option",
)
TAKEN_EVERY: Final = Policy(
    "taken_every",
    Duration(),
    None,
    "How often the program takes samples at the latest, from one time to the next; a fact of the program.",
    _SOURCE,
    roles=("subscriber",),
)
NEEDS: Final = (*(word.need for word in _LISTED), SURVIVES, RELAYED, RESTARTS_IN, OUTAGE)
"""The policies that a pack with guarantees adds to its own; packs with rules over `TAKEN_EVERY`, `REPAIR_TIME` or `REDISCOVERY_TIME` add these."""


@dataclass(frozen=True, slots=True)
class Unaffected:
    """A guarantee that faults leave as it is, because of a clause; with a rule about the fault, none is needed.

    Attributes:
        guarantee: the word.
        faults: of `FAULTS`; over a link outage it holds only where `OUTAGE` is stated.
        because: why a fault changes nothing.
        clause: where the standard says so.
    """

    guarantee: str
    faults: tuple[str, ...]
    because: str
    clause: str


@dataclass(frozen=True, slots=True)
class Proof:
    """A guarantee under a fault that was observed on a running implementation.

    Attributes:
        guarantee: the word.
        fault: of `FAULTS`, or ``link`` for connected ends.
        value: of `RulePack.implementation_option`: ``cyclonedds``.
        product: for people: ``Cyclone DDS``.
        version: which one ran, and how if not as the pair itself: ``11.0.1``, ``11.0.1 as plain DDS``.
    """

    guarantee: str
    fault: str
    value: str
    product: str
    version: str


def gives(
    word: str,
    what: Condition | Operand | None,
    *,
    because: str,
    survives: str = LINK,
    doubt: bool = False,
    **metadata: Any,
) -> Rule:
    """Make a rule that a guarantee depends on; it reports only on subscribers that need the guarantee.

    Args:
        word: of `WORDS`. Several rules of one word must all hold.
        what: a sentence under which it holds; it may compare with ``requested(WORDS[word].need)``. Or the number that is
            given, which is then compared with what is needed. None: nothing gives it.
        because: why the guarantee is lost where this does not hold; it follows "because".
        survives: ``link``, or the fault that this is about: one of `FAULTS`, or ``intermediary_restart`` for both of a broker.
            It then counts only where the need must survive that. Over a ``link_outage`` nothing holds unless `OUTAGE` is stated.
        doubt: where it does not hold, that leaves the need open rather than unmet, because something decides that no rule sees.
        metadata: the code, the name, the clause, fixes, help and aliases, as of every `Rule`.

    Raises:
        KeyError: there is no such word.
        ValueError: there is no such fault.
    """
    about = WORDS[word]
    asked = requested(about.need)
    silent = ~as_condition(asked) if about.kind == "holds" else asked == str(about.need.default)
    faults = faults_of(survives)
    if survives != LINK and not faults:
        raise ValueError(f"`{survives}` is none of {', '.join((*_SEVERAL, *FAULTS))}")
    if faults:
        spared = define(f"need_not_survive_{survives}", reduce(and_, (~_befalls(fault) for fault in faults)))
        silent = define(f"{word}_{spared}", silent | spared)
    amount = "" if about.kind == "holds" else f" {{requested need.{word}}}"
    after = _AFTER.get(survives, f" after a {survives.replace('_', ' ')}")
    met = what if what is None or isinstance(what, Condition) else about.enough(what)
    if "link_outage" in faults and met is not None:
        met &= define("outage_is_stated", OUTAGE < "infinite")
    does = "may not" if doubt else "does not"
    return Rule(
        silent if met is None else silent | met,
        "requires",
        because=because,
        says=f"{{subscriber}} needs {word}{amount}{after}, which {{publisher}} {does} give: {because}",
        doubt=doubt,
        guarantee=word,
        survives=survives,
        **metadata,
    )


def _befalls(fault: str) -> Condition:
    """Return the condition that a fault which must be survived causes this one at a pair."""
    side = {"publisher_restart": offered, "subscriber_restart": requested}.get(fault)
    survives = requested(SURVIVES)
    return in_(Constant(fault), survives) if side is None else overlaps(side(RESTARTS_IN), survives)


def befalling(fault: str, publisher: Collection[str], subscriber: Collection[str]) -> tuple[str, ...]:
    """Return the faults of a pair that a fault of its path brings about, from the `RESTARTS_IN` of both ends."""
    restarts = {"publisher_restart": publisher, "subscriber_restart": subscriber}
    return tuple(each for each in FAULTS if (fault in restarts[each] if each in restarts else fault == each))


NOT_STATED: Final = "CQ218"
"""Code of the rules that `unstated` makes."""


def unstated(rules: Iterable[Rule], unaffected: Iterable[Unaffected]) -> Iterator[Rule]:
    """Yield a rule for every fault that no rule of a guarantee covers, so that it is claimed only with a clause.

    Such a fault leaves the guarantee open, unless the pack states that it is unaffected.
    """
    covered: dict[str, set[str]] = {}
    for rule in rules:
        if rule.guarantee:
            covered.setdefault(rule.guarantee, set()).update(faults_of(rule.survives))
    held = {(each.guarantee, fault) for each in unaffected for fault in each.faults}
    for word, faults in covered.items():
        for fault in FAULTS:
            known = (word, fault) in held
            if fault in faults or (known and fault != "link_outage"):
                continue
            yield gives(
                word,
                define("outage_is_stated", OUTAGE < "infinite") if known else None,
                survives=fault,
                doubt=True,
                code=NOT_STATED,
                name="guarantee-not-stated",
                because="the length of an outage is not stated"
                if known
                else "the rule pack states no clause and no run for it",
                help="state the option `outage`" if known else "",
            )
