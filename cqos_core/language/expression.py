"""The closed language of conditions: its nodes, how Python builds them, and their text form.

A condition is a value. It is built with operators (``offered(RELIABILITY) >= requested(RELIABILITY)``) or read
from text (`cqos_core.language.parser`), it prints as valid Python syntax, and ``parse(str(condition)) == condition``.

There are four kinds of nodes: constants (`Literal`), values of policies (`Term`), and operations on other nodes: an `Apply` has a
value, a `Test` is true, false or unknown. Operators are applied like functions, under their sign. So all that is done with
conditions (printing, reading, judging, solving) is a table by the name of what is applied.
"""

from __future__ import annotations

import keyword
from collections.abc import Callable, Iterator
from copy import copy
from typing import Any, Final, TypeVar

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import ConditionError

SCOPES: Final = (
    "own",
    "offered",
    "requested",
    "topic",
    "publisher",
    "subscriber",
    "participant",
    "broker",
    "option",
)
"""The scopes in which a term's value is looked up; ``own`` is written as the bare policy name."""


@dataclass(frozen=True, slots=True)
class Signature:
    """The number of arguments of a function, and the positions of those that are conditions instead of values."""

    least: int
    most: int | None
    conditions: tuple[int, ...] = ()


HOLDS: Final = ""
"""The name of a test of a flag, which is written as the flag itself."""
COMPARISONS: Final = ("<", "<=", "==", "!=", ">=", ">")
VALUE_FUNCTIONS: Final = {
    "min": Signature(2, None),
    "max": Signature(2, None),
    "ceil": Signature(2, 2),
    "first": Signature(1, 1),
    "count": Signature(1, 1, (0,)),
    "total": Signature(1, 2, (1,)),
}
CONDITION_FUNCTIONS: Final = {
    "in_": Signature(2, None),
    "overlaps": Signature(2, 2),
    "matches": Signature(2, 2),
    "stated": Signature(1, 2),
    "stated_here": Signature(1, 1),
    "all_equal": Signature(1, 1),
    "any_of": Signature(1, 1, (0,)),
}
AGGREGATES: Final = frozenset({"count", "total", "all_equal", "any_of"})
"""Functions over all publishers or all subscribers of a signal, by the scope of the terms inside."""
_BINDING: Final = {HOLDS: 0, **dict.fromkeys(COMPARISONS, 1), "|": 1, "&": 1, "+": 2, "*": 3, "~": 4}
"""The precedence of operators. Comparisons within ``&`` and ``|`` always stand in parentheses, as Python needs them."""
_SIGNATURES: Final = {
    **VALUE_FUNCTIONS,
    **CONDITION_FUNCTIONS,
    **dict.fromkeys(("|", "&", "~"), Signature(1, 2, (0, 1))),
}


def signature(name: str) -> Signature:
    """Return the signature of a function or operator; functions that packs declare take any number of values."""
    return _SIGNATURES.get(name) or Signature(0, None)


def refuse_number(name: str, arguments: int) -> None:
    """Refuse a number of arguments that a function does not take."""
    takes = signature(name)
    if arguments < takes.least or (takes.most is not None and arguments > takes.most):
        raise ConditionError(f"`{name}` does not take {arguments} arguments")


class Node:
    """Anything in a condition. Nodes are immutable.

    Attributes:
        name: of the operation or the policy.
        args: direct parts, in reading order.
        key: identifies the structure.
        label: the name that `define` gave, or nothing.
    """

    __match_args__ = ("name", "args")
    name: str
    args: tuple[Node, ...] = ()
    key: tuple[Any, ...]
    label: str = ""

    def __init__(self, name: str, *args: Node) -> None:
        """Apply ``name``; `signature` says to how many arguments."""
        refuse_number(name, len(args))
        self.name = name
        self.args = args
        self.key = (type(self).__name__, name, *(arg.key for arg in args))

    def __hash__(self) -> int:
        """Equal structure, equal hash."""
        return hash(self.key)

    def __bool__(self) -> bool:
        """Refuse to be a truth value: ``and``, ``or``, ``not`` and chained comparisons would lose half the condition."""
        message = "a condition has no truth value of its own: use & | ~ with parentheses, and no chained comparison"
        raise ConditionError(message)

    def __and__(self, other: Condition | Operand) -> Condition:
        """Both hold; a flag is read as a condition."""
        return Test("&", as_condition(self), as_condition(other))

    def __or__(self, other: Condition | Operand) -> Condition:
        """At least one holds; a flag is read as a condition."""
        return Test("|", as_condition(self), as_condition(other))

    def __invert__(self) -> Condition:
        """It does not hold; a flag is read as a condition."""
        return Test("~", as_condition(self))

    def __repr__(self) -> str:
        """Show the text form."""
        return f"<{type(self).__name__} {self}>"

    def __str__(self) -> str:
        """Return the name that `define` gave, or the text form."""
        return self.label or self.text()

    def text(self) -> str:
        """Return the text form, with the names of definitions within it."""
        if self.name not in _BINDING:
            return f"{self.name}({', '.join(map(str, self.args))})"
        parts = [_part(self.name, at, part) for at, part in enumerate(self.args)]
        return f"~{parts[0]}" if self.name == "~" else f" {self.name} ".join(parts)

    def walk(self) -> Iterator[Node]:
        """This node and everything below it."""
        yield self
        for arg in self.args:
            yield from arg.walk()


def _operator(node: Node) -> str:
    """The operator that a node is written with, if any."""
    if node.label or not node.args or node.name not in _BINDING:
        return ""
    return node.name or _operator(node.args[0])


def _part(op: str, at: int, part: Node) -> str:
    """A part of an operation, in parentheses where it needs them; the same operation may stand at its left without."""
    inner = _operator(part)
    looser = _BINDING[inner] < _BINDING[op]
    alike = _BINDING[inner] == _BINDING[op] and (at > 0 or inner != op)
    return f"({part})" if inner and (looser or alike) else str(part)


Part = TypeVar("Part", bound=Node)


class Condition(Node):
    """A node that is true, false or unknown. ``==`` compares structure."""

    def __eq__(self, other: object) -> bool:
        """Compare by structure."""
        return isinstance(other, Condition) and self.key == other.key

    __hash__ = Node.__hash__


def _comparison(op: str) -> Callable[[Operand, Any], Condition]:
    return lambda left, right: Test(op, left, as_operand(right))


class Operand(Node):
    """A node that has a value of some policy's kind. Comparison operators build conditions; ``key`` tells operands apart."""

    __lt__ = _comparison("<")
    __le__ = _comparison("<=")
    __gt__ = _comparison(">")
    __ge__ = _comparison(">=")
    __eq__ = _comparison("==")  # type: ignore[assignment]
    __ne__ = _comparison("!=")  # type: ignore[assignment]
    __hash__ = Node.__hash__

    def __add__(self, other: Operand | int | str) -> Operand:
        """Build ``self + other``; infinite stays infinite."""
        return Apply("+", self, as_operand(other))

    def __radd__(self, other: int | str) -> Operand:
        """Build ``other + self``."""
        return Apply("+", as_operand(other), self)

    def __mul__(self, other: Operand | int | str) -> Operand:
        """Build ``self * other``; infinite stays infinite."""
        return Apply("*", self, as_operand(other))

    def __rmul__(self, other: int | str) -> Operand:
        """Build ``other * self``."""
        return Apply("*", as_operand(other), self)


class Literal(Operand):
    """A constant: text is read by the kind of the policy it is compared with, numbers stand for themselves."""

    __match_args__ = ("value",)
    name = "constant"

    def __init__(self, value: str | int) -> None:
        """Hold ``value``."""
        self.value = value
        self.key = ("literal", type(value).__name__, value)

    def text(self) -> str:
        """Double-quoted text, or the number, ``True`` or ``False``."""
        if not isinstance(self.value, str):
            return str(self.value)
        escaped = self.value.encode("unicode_escape").decode("ascii").replace('"', '\\"')
        return f'"{escaped}"'


class Term(Operand):
    """The value of a policy in a scope."""

    __match_args__ = ("scope", "name")

    def __init__(self, scope: str, name: str) -> None:
        """Name a policy (dots allowed) in one of `SCOPES`."""
        self.scope = scope
        self.name = name
        self.key = ("term", scope, name)

    def text(self) -> str:
        """``offered(reliability)``, or the bare name for ``own``."""
        return self.name if self.scope == "own" else f"{self.scope}({self.name})"


class Apply(Operand):
    """An operator or function with a value: ``+ * min max ceil first count total``."""


class Test(Condition):
    """A node that is true or false: a comparison, ``& | ~``, a flag, ``in_ overlaps matches stated all_equal any_of``, or what a pack declares."""

    __test__ = False


def as_operand(value: object) -> Operand:
    """Turn text, a number or a flag into a literal; leave operands alone."""
    if isinstance(value, Operand):
        return value
    if isinstance(value, (str, int)):
        return Literal(value)
    message = f"{value!r} cannot stand in a condition: use a policy, text, a whole number, True or False"
    raise ConditionError(message)


def as_condition(value: object) -> Condition:
    """Read a flag operand as a condition; leave conditions alone."""
    if isinstance(value, Condition):
        return value
    if not isinstance(value, Operand) or isinstance(value, Literal):
        raise ConditionError(f"`{value}` is no condition: compare it with something")
    return Test(HOLDS, value)


def define(name: str, part: Part) -> Part:
    """Name a part of conditions: they print the name, and its definition once. It means what ``part`` means."""
    if (
        not (name.isidentifier() and name.isascii() and name == name.lower())
        or name[0] == "_"
        or keyword.iskeyword(name)
    ):
        raise ConditionError(f"`{name}` names no definition: use snake_case, and no word of Python")
    defined = Term(part.scope, part.name) if isinstance(part, Term) else copy(part)  # a policy cannot change
    defined.label = name
    return defined  # type: ignore[return-value]


def definitions(*conditions: Node) -> dict[str, Node]:
    """Return the definitions that conditions use, by name, each before those that it uses itself."""
    return {node.label: node for condition in conditions for node in condition.walk() if node.label}


def unfolded(node: Part) -> Part:
    """Return a condition without names of definitions, so that its text needs none."""
    if not node.args and not node.label:
        return node
    bare = copy(node)
    bare.label, bare.args = "", tuple(map(unfolded, node.args))
    return bare


def _scoped(scope: str) -> Callable[[Term | str], Term]:
    def make(policy: Term | str) -> Term:
        return Term(scope, policy if isinstance(policy, str) else policy.name)

    make.__name__ = scope
    make.__doc__ = f"The value of ``policy`` in scope ``{scope}``."
    return make


own = _scoped("own")
offered = _scoped("offered")
requested = _scoped("requested")
topic = _scoped("topic")
publisher = _scoped("publisher")
subscriber = _scoped("subscriber")
participant = _scoped("participant")
broker = _scoped("broker")
option = _scoped("option")


def least(*operands: Operand | int | str) -> Operand:
    """``min(…)`` of the language."""
    return Apply("min", *map(as_operand, operands))


def greatest(*operands: Operand | int | str) -> Operand:
    """``max(…)`` of the language."""
    return Apply("max", *map(as_operand, operands))


def ceil(dividend: Operand, divisor: Operand | int) -> Operand:
    """The quotient of two values of one kind, rounded up; unknown for a divisor of zero."""
    return Apply("ceil", dividend, as_operand(divisor))


def first(names: Operand) -> Operand:
    """The first element of a list of names; unknown for an empty list."""
    return Apply("first", names)


def in_(operand: Operand, *values: Operand | str | int) -> Condition:
    """The value is one of ``values``, or an element of the list that the only argument is."""
    return Test("in_", operand, *map(as_operand, values))


def overlaps(left: Operand, right: Operand) -> Condition:
    """Two lists of names share an element."""
    return Test("overlaps", left, right)


def matches(text: Operand, pattern: str | Operand) -> Condition:
    """A text matches a shell pattern (``*``, ``?``, ``[abc]``), case-sensitively."""
    return Test("matches", text, as_operand(pattern))


def stated(term: Operand, word: str | None = None) -> Condition:
    """The value was written down (explicit, profile or overlay, no preset and no default), as ``word`` if given."""
    return Test("stated", term) if word is None else Test("stated", term, Literal(word))


def stated_here(term: Operand) -> Condition:
    """The value was written at the endpoint itself, in no profile."""
    return Test("stated_here", term)


def all_equal(term: Operand) -> Condition:
    """All endpoints of the term's side have this value alike."""
    return Test("all_equal", term)


def any_of(condition: Condition | Operand) -> Condition:
    """The condition holds for at least one endpoint of its side."""
    return Test("any_of", as_condition(condition))


def count(condition: Condition | Operand) -> Operand:
    """The number of endpoints of its side for which the condition holds."""
    return Apply("count", as_condition(condition))


def total(operand: Operand, where: Condition | Operand | None = None) -> Operand:
    """The sum of a value over the endpoints of its side, those only for which ``where`` holds."""
    return Apply("total", operand) if where is None else Apply("total", operand, as_condition(where))


def call(name: str, *args: Operand | str | int) -> Condition:
    """A function that the pack declares (`cqos_core.packs.Function`)."""
    return Test(name, *map(as_operand, args))
