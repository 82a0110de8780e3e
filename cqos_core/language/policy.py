"""Policies: one named QoS setting each, with the meaning of its words."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from cqos_core.language.expression import Term
from cqos_core.language.values import INFINITE, Anything, Depends, FromPeers, OneOf, normalise
from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cqos_core.language.domains import Domain
    from cqos_core.language.values import Plain, Value


@dataclass(frozen=True, slots=True)
class PerRole:
    """A word that means different things for publishers and subscribers."""

    publisher: Meaning
    subscriber: Meaning


@dataclass(frozen=True, slots=True)
class ByOption:
    """A word whose meaning depends on a deployment option; ``otherwise`` serves the values not listed."""

    option: str
    meanings: tuple[tuple[str, Meaning], ...]
    otherwise: Meaning | None = None


Meaning: TypeAlias = str | PerRole | ByOption | Anything | FromPeers | OneOf


def parts_of(meaning: Meaning) -> Iterator[Meaning]:
    """Yield a meaning, and all meanings within it that it may turn out to be."""
    yield meaning
    inner: tuple[Meaning | None, ...] = ()
    if isinstance(meaning, PerRole):
        inner = (meaning.publisher, meaning.subscriber)
    elif isinstance(meaning, ByOption):
        inner = (*(each for _, each in meaning.meanings), meaning.otherwise)
    for each in inner:
        yield from () if each is None else parts_of(each)


def by_option(option: str, otherwise: Meaning | None = None, **meanings: Meaning) -> ByOption:
    """Write a `ByOption` like a sentence: ``by_option("rmw", cyclonedds="reliable", zenoh="best_effort")``."""
    return ByOption(option, tuple(meanings.items()), otherwise)


YES: Final = "yes"
UNMATCHED: Final = "unmatched"
NO: Final = "no"
"""The ways in which a middleware treats a policy: enforces it; has it but never refuses a pair for it; ignores it."""

ENDPOINT: Final = "endpoint"
TOPIC: Final = "topic"
BROKER: Final = "broker"
NEED: Final = "need"
"""Level of the requirements of an endpoint's application, which are no settings of the endpoint."""
LEVELS: Final = (ENDPOINT, TOPIC, "participant", BROKER, "option", NEED)
BOTH: Final = ("publisher", "subscriber")
Stronger: TypeAlias = Literal["higher", "lower", ""]
DIRECTIONS: Final[tuple[Stronger, ...]] = ("higher", "lower", "")


@dataclass(frozen=True, eq=False, repr=False)
class Policy(Term):
    """One named QoS setting. In a sentence it stands for the endpoint's own value; comparisons build sentences.

    ``==`` is taken by the language, so policies are distinguished by ``name`` and ``level``.

    Attributes:
        name: canonical snake_case name; with dots where a policy has several fields.
        domain: its kind of value.
        default: text of the default, or per role; None for a fact, which has no value until a system states one.
        doc: one sentence for property panels and docs.
        clause: where the standard defines it.
        level: what it is a setting of: ``endpoint``, ``topic``, ``participant``, ``broker`` or ``option``; or ``need``.
        roles: which endpoints have it.
        aliases: other names it is read by.
        words: values that are no plain ones (``system_default``) and what they mean.
        zero: the word that a zero stands for, or None where zero means zero.
        enforced: per option and its value, how the middleware treats the policy: ``no`` (ignored: takes its default, and
            stating it is a warning) or ``unmatched`` (works, but never stops a match); whatever is not listed is ``yes``.
        promise: a stronger offer is a promise the program must keep, so that remedies on it need code.
        assume: for options: the values taken into account while it is unset; empty means all.
        fallback: for options: the value that stands in for one this pack does not know yet, with a warning.
        entities: what it is set on, in the words of the standard, where that is more than an endpoint.
        changeable: whether it may change while the endpoint lives; None where the standard does not say.
        stronger: which of its values promise or demand more: ``higher``, ``lower``, or empty where neither does. A fix that
            moves the other way weakens the design, and says so.
        derived: a fact that follows from others, as ``doc`` says: a system cannot state it, and no fix sets it.
        follows: names of the policies that a derived one follows from, where a fix may change them.
        together: it follows from several endpoints, also from those on other topics.
        unseen: no tool shows it of running programs, because programs do not set it. Observed endpoints have its default, or the
            value of an overlay.
        raised: an overlay that fills open values also raises it: the larger of both counts.
    """

    name: str
    domain: Domain
    default: str | Mapping[str, str] | None = None
    doc: str = ""
    clause: str = ""
    level: str = ENDPOINT
    roles: tuple[str, ...] = BOTH
    aliases: tuple[str, ...] = ()
    words: Mapping[str, Meaning] = field(default_factory=dict)
    zero: str | None = None
    enforced: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    promise: bool = False
    assume: tuple[str, ...] = ()
    fallback: str | None = None
    entities: tuple[str, ...] = ()
    changeable: bool | None = None
    stronger: Stronger = ""
    derived: bool = False
    follows: tuple[str, ...] = ()
    together: bool = False
    unseen: bool = False
    raised: bool = False

    def __post_init__(self) -> None:
        """Set the fields of a `Term`."""
        # A level that there is not is one of the mistakes that the pack reports.
        scope = _OWN_SCOPE.get(self.level, self.level)
        object.__setattr__(self, "scope", scope)
        object.__setattr__(self, "key", ("term", scope, self.name))

    def __hash__(self) -> int:
        """Hash by name and level."""
        return hash(self.key)

    @cached_property
    def spellings(self) -> frozenset[str]:
        """All normalised names it is read by."""
        return frozenset(normalise(name) for name in (self.name, *self.aliases))

    def default_for(self, role: str) -> str | None:
        """Return the default's text for an endpoint of ``role``, or None for a fact."""
        if self.default is None or isinstance(self.default, str):
            return self.default
        return self.default.get(role)

    def word(self, text: str, value: Plain | None = None) -> str:
        """Return a text as a special word, or its value in one spelling; pass ``value`` if it is known."""
        word = self.domain.word(text)
        if word in self.words:
            return word
        read = self.domain.read(text) if value is None else value
        return word if read is None else normalise(self.domain.format(read))

    def weakens(self, before: Value, after: Value) -> bool:
        """Whether a change promises or demands less than before."""
        if not self.stronger or not isinstance(before, int) or not isinstance(after, int):
            return False
        return after < before if self.stronger == "higher" else after > before

    @property
    def unbounded(self) -> tuple[Value, ...]:
        """The values that bound nothing, of a policy that follows from several endpoints: its default, and no limit."""
        if not self.together:
            return ()
        return (INFINITE, self.domain.parse(self.default)) if isinstance(self.default, str) else (INFINITE,)

    def spelling(self, value: Plain) -> str | None:
        """Return a text that is read back as exactly this value; None where there is no such text."""
        text = self.domain.format(value)
        if self.domain.word(text) in self.words or (value == 0 and self.zero is not None):
            return None
        return text if self.domain.read(text) == value else None

    def expected(self) -> str:
        """Return the allowed texts, for messages: the domain's values and the special words."""
        words = ", ".join(self.words)
        return f"{self.domain.expected()}{f', or {words}' if words else ''}"

    def format(self, value: Value) -> str:
        """Print a value for people; undetermined ones say what they depend on."""
        match value:
            case Anything(cause):
                return f"unknown ({cause})"
            case Depends(on, cases):
                shown = [(self.format(case), name) for name, case in cases]
                if all(text == name for text, name in shown):  # the value is the option itself
                    return f"undetermined ({', '.join(name for _, name in shown)})"
                option = on.rpartition(".")[2]
                return f"undetermined ({', '.join(f'{text} with {option}={name}' for text, name in shown)})"
            case FromPeers():
                return "taken from peers"
        return self.domain.format(value)


_OWN_SCOPE: Final = {
    ENDPOINT: "own",
    "topic": "topic",
    "participant": "participant",
    "broker": "broker",
    "option": "option",
    NEED: "requested",
}
