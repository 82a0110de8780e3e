"""The vocabulary of conditions: the policies of a pack by number, its functions, and the scopes of terms."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Final

from cqos_core.language.expression import AGGREGATES, SCOPES, Condition, Node, Term
from cqos_core.language.policy import ENDPOINT, NEED, Policy
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import ConditionError, PackError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cqos_core.language.values import Value, Values


@dataclass(frozen=True, slots=True)
class Function:
    """A named function of a pack, for what the language cannot say.

    Attributes:
        call: takes plain values, returns True, False or None for unknown.
        doc: one sentence.
        column: whether it also works on columns, for other engines; C-QoS itself has no column form for functions.
        many: where ``call`` compares a value of the publisher, its first argument, with one of the subscriber, its second, and
            never answers None: the same for many at once. It takes the distinct first values, the distinct second ones, each
            with a set of bits, and the further arguments. It returns per first value the bits of all second ones for which
            ``call`` is True. Without it every combination is asked about.
    """

    name: str
    call: Callable[..., bool | None]
    doc: str = ""
    column: bool = False
    many: Callable[..., Sequence[int]] | None = None


_LEVELS: Final = {
    "own": (ENDPOINT,),
    "offered": (ENDPOINT, NEED),
    "requested": (ENDPOINT, NEED),
    "topic": ("topic",),
    "publisher": ("participant", "option"),
    "subscriber": ("participant", "option"),
    "participant": ("participant", "option"),
    "broker": ("broker",),
    "option": ("option",),
}
SECOND_SCOPES: Final = frozenset({"requested", "subscriber"})
"""The scopes that read the second tuple."""


class Vocabulary:
    """The policies of a pack, each with its index in a values tuple, and the functions its conditions may use."""

    def __init__(self, policies: Iterable[Policy], functions: Iterable[Function] = ()) -> None:
        """Number the policies in the order given."""
        self.policies = tuple(policies)
        self.functions = {function.name: function for function in functions}
        self.size = len(self.policies)
        self.indices = {(policy.level, policy.name): index for index, policy in enumerate(self.policies)}
        self.following = grouped((name, index) for index, policy in enumerate(self.policies) for name in policy.follows)
        if len(self.indices) != self.size:
            raise PackError("a policy is declared twice: " + ", ".join(p.name for p in self.policies))

    @cached_property
    def _unbounded(self) -> Mapping[int, tuple[Value, ...]]:
        return {at: self.policies[at].unbounded for found in self.following.values() for at in found}

    def follows(self, name: str, values: Values) -> list[int]:
        """Return where values follow from a policy, unless they bound nothing."""
        return [at for at in self.following.get(name, ()) if values[at] not in self._unbounded[at]]

    def find(self, term: Term) -> int:
        """Return the index of a term's policy.

        Raises:
            ConditionError: naming the known policies.
        """
        for level in _LEVELS[term.scope]:
            if (level, term.name) in self.indices:
                return self.indices[level, term.name]
        levels = [level for level in _LEVELS[term.scope] if level != NEED]
        known = ", ".join(name for level, name in self.indices if level in levels) or "none"
        quotes = f'; a value stands in quotes: "{term.name}"' if self._is_value(term.name) else ""
        raise ConditionError(f"`{term}` names no policy at {' or '.join(levels)} level; known: {known}{quotes}")

    def _is_value(self, text: str) -> bool:
        domains = (each.domain for each in self.policies if each.domain.ordered or each.domain.kind == "choice")
        return any(domain.read(text) is not None for domain in domains)


@dataclass(frozen=True, slots=True)
class Use:
    """A term of a bound condition: which tuple it reads, at which index."""

    second: bool
    index: int
    term: Term


def terms(condition: Condition) -> Iterator[tuple[Term, bool]]:
    """Yield every term of a condition, and whether it stands inside an aggregate."""

    def visit(node: Node, *, within: bool) -> Iterator[tuple[Term, bool]]:
        if isinstance(node, Term):
            yield node, within
        for arg in node.args:
            yield from visit(arg, within=within or node.name in AGGREGATES)

    yield from visit(condition, within=False)


_SCOPES: Final = (
    (ENDPOINT, {"own", "offered", "requested", "publisher", "subscriber"}),
    ("participant", {"participant"}),
    ("broker", {"broker"}),
    ("signal", {"topic"}),
)


def scope_of(condition: Condition) -> str:
    """Return the scope of a rule, which follows from its terms: pair, endpoint, participant, broker, signal or system."""
    if any(within for _, within in terms(condition)):
        return "signal"
    scopes = {term.scope for term, _ in terms(condition)}
    if scopes & {"offered", "publisher"} and scopes & SECOND_SCOPES:
        return "pair"
    return next((scope for scope, named in _SCOPES if scopes & named), "system")


def role_of(condition: Condition) -> str | None:
    """The role an endpoint or signal rule is about when its terms say so (``offered`` → publisher), else None."""
    outside = {term.scope for term, within in terms(condition) if not within}
    if outside & {"offered", "publisher"}:
        return "publisher"
    return "subscriber" if outside & SECOND_SCOPES else None


assert set(_LEVELS) == set(SCOPES)  # noqa: S101 - the two tables are read side by side
