"""Guarantees: what a subscriber really gets and what its application needs, in words that no protocol owns.

A need is a policy of level ``need``: it belongs to the subscription, and by default nothing is needed. A pack says what its
pairs give by rules made with `gives`: each is silent until the need is stated, and then required like anything else. So a
need that is certainly unmet makes a pair incompatible, an undecidable one is a warning, and reasons, remedies and groups
are those of every rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from cqos_core.expression import Literal as Constant
from cqos_core.expression import Sentence, as_sentence, in_, requested
from cqos_core.policy import INFINITE, NEED, Count, Duration, Flag, Names, Policy, normalise
from cqos_core.problems import InvalidValueError
from cqos_core.rule import Rule

if TYPE_CHECKING:
    from cqos_core.expression import Operand
    from cqos_core.policy import Domain, Plain

Kind = Literal["holds", "at_least", "at_most"]
Over = Literal["every hop", "sum", "last hop", "not over a bridge"]
FAULTS: Final = ("subscriber_restart", "publisher_restart", "intermediary_restart")
"""What a guarantee may survive beside a broken link, which is always meant."""


@dataclass(frozen=True, slots=True)
class Word:
    """One word of the currency.

    Attributes:
        need: the policy under which a subscription asks for it.
        kind: it holds or not; or the number given must be at least, or at most, the one that is needed.
        over: how it comes about over several hops.
        doc: what it says.
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
        """The value of somebody who does not need it."""
        return INFINITE if self.kind == "at_most" else 0

    def enough(self, given: Operand) -> Sentence:
        """Say that the number that is given is enough for what is needed."""
        asked = requested(self.need)
        return given <= asked if self.kind == "at_most" else given >= asked

    def stronger(self, value: int, other: int) -> bool:
        """Whether giving ``value`` is more than giving ``other``."""
        return value < other if self.kind == "at_most" else value > other


_SOURCE: Final = "C-QoS, guarantees"


def _word(name: str, domain: Domain, kind: Kind, over: Over, doc: str) -> Word:
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
    )
    return Word(need, kind, over, doc)


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


class Faults(Names):
    """A list of faults, in any spelling."""

    def parse(self, text: str) -> tuple[str, ...]:
        """Read ``[subscriber_restart]``; what is named twice counts once."""
        found = dict.fromkeys(map(normalise, super().parse(text)))
        for name in found:
            if name not in FAULTS:
                message = f"`{name}` is no fault"
                raise InvalidValueError(message, self.expected())
        return tuple(found)

    def expected(self) -> str:
        """Give the faults."""
        return f"a list of {', '.join(FAULTS)}"


SURVIVES: Final = Policy(
    "need.survives",
    Faults(),
    "[]",
    f"Which faults what it needs must survive, of {', '.join(FAULTS)}; a broken link is always meant.",
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
NEEDS: Final = (*(word.need for word in _LISTED), SURVIVES, RELAYED)
"""What a pack that gives guarantees adds to its policies."""


def _article(fault: str) -> str:
    return "an" if fault.startswith("i") else "a"


def gives(
    word: str,
    what: Sentence | Operand | None,
    *,
    code: str,
    name: str,
    because: str,
    clause: str = "",
    survives: str = "link",
    doubt: bool = False,
    fixes: tuple[str, ...] = (),
    help: str = "",  # noqa: A002 - the field's name
    aliases: tuple[str, ...] = (),
) -> Rule:
    """Make a rule that says on what a guarantee rests; it speaks only of subscribers that need it.

    Args:
        word: of `WORDS`. Several rules of one word must all hold.
        what: a sentence under which it holds; it may compare with ``requested(WORDS[word].need)``. Or the number that is
            given, which is then compared with what is needed. None: nothing gives it.
        code: permanent, as of every rule.
        name: the bad pattern in kebab case.
        because: why the guarantee is lost where this does not hold; it follows "because".
        clause: where the standard, or the source of the practice, says so.
        survives: ``link``, or the one of `FAULTS` of which this speaks: it then counts for those only who ask for that.
        doubt: where it does not hold, that leaves the need open rather than unmet, because something decides that no rule sees.
        fixes: policies offered as remedies; empty: every endpoint policy of the sentence.
        help: what to do where no remedy can be computed.
        aliases: former codes and names.

    Raises:
        KeyError: there is no such word.
        ValueError: there is no such fault.
    """
    about = WORDS[word]
    asked = requested(about.need)
    silent = ~as_sentence(asked) if about.kind == "holds" else asked == str(about.need.default)
    if survives != "link":
        if survives not in FAULTS:
            raise ValueError(f"`{survives}` is none of link, {', '.join(FAULTS)}")
        silent |= ~in_(Constant(survives), requested(SURVIVES))
    amount = "" if about.kind == "holds" else f" {{requested need.{word}}}"
    after = "" if survives == "link" else f" after {_article(survives)} {survives.replace('_', ' ')}"
    met = what if what is None or isinstance(what, Sentence) else about.enough(what)
    does = "may not" if doubt else "does not"
    return Rule(
        silent if met is None else silent | met,
        "requires",
        code,
        name,
        because,
        clause,
        says=f"{{subscriber}} needs {word}{amount}{after}, which {{publisher}} {does} give: {because}",
        doubt=doubt,
        fixes=fixes,
        help=help,
        aliases=aliases,
        guarantee=word,
        survives=survives,
    )
