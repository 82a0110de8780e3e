"""The closed language of sentences: its nodes, how Python builds them, their text form, and reading that text.

A sentence is a value. It is built with operators (``offered(RELIABILITY) >= requested(RELIABILITY)``) or read
from text (`parse`), it prints as valid Python syntax, and ``parse(str(sentence)) == sentence``. Text is parsed
with `ast` and translated node by node; it is never evaluated.

What a sentence means is said in `cqos_core.language.evaluate`, how one side of it is solved in `cqos_core.language.solve`.
"""

from __future__ import annotations

import ast
import keyword
import re
from copy import copy
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, TypeVar

from cqos_core.model.problems import SentenceError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

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
"""Where a term's value is looked up; ``own`` is written as the bare policy name."""

MAXIMUM_TEXT: Final = 10_000
_MAXIMUM_DEPTH: Final = 60
_LONGEST_EXCERPT: Final = 60
_LINE_END: Final = re.compile(r"\r\n|\r|\n")


class Node:
    """Anything in a sentence. Nodes are immutable; ``key`` identifies their structure, ``label`` is the name of a definition."""

    __slots__ = ("key", "label")
    key: tuple[Any, ...]
    label: str

    def __hash__(self) -> int:
        """Equal structure, equal hash."""
        return hash(self.key)

    def __bool__(self) -> bool:
        """Refuse to be a truth value: ``and``, ``or``, ``not`` and chained comparisons would lose half the sentence."""
        message = "a sentence has no truth value of its own: use & | ~ with parentheses, and no chained comparison"
        raise SentenceError(message)

    def __repr__(self) -> str:
        """Show the text form."""
        return f"<{type(self).__name__} {self}>"

    def __str__(self) -> str:
        """Return the name that `define` gave, or the text form."""
        return label_of(self) or self.text()

    def text(self) -> str:
        """Return the text form, with the names of definitions within it."""
        raise NotImplementedError

    def children(self) -> tuple[Node, ...]:
        """Direct parts, in reading order."""
        return ()

    def walk(self) -> Iterator[Node]:
        """This node and everything below it."""
        yield self
        for child in self.children():
            yield from child.walk()


def label_of(node: Node) -> str:
    """Return the name that `define` gave a node, or nothing."""
    return getattr(node, "label", "")


Part = TypeVar("Part", bound=Node)


class Sentence(Node):
    """A node that is true, false or unknown. ``==`` compares structure."""

    __slots__ = ()

    def __and__(self, other: Sentence | Operand) -> Sentence:
        """Both hold."""
        return And(self, as_sentence(other))

    def __or__(self, other: Sentence | Operand) -> Sentence:
        """At least one holds."""
        return Or(self, as_sentence(other))

    def __invert__(self) -> Sentence:
        """It does not hold."""
        return Not(self)

    def __eq__(self, other: object) -> bool:
        """Compare by structure."""
        return isinstance(other, Sentence) and self.key == other.key

    __hash__ = Node.__hash__


class Operand(Node):
    """A node that has a value of some policy's kind. Comparison operators build sentences."""

    __slots__ = ()

    def __lt__(self, other: Operand | str | int) -> Sentence:
        """Build ``self < other``."""
        return Compare("<", self, as_operand(other))

    def __le__(self, other: Operand | str | int) -> Sentence:
        """Build ``self <= other``."""
        return Compare("<=", self, as_operand(other))

    def __gt__(self, other: Operand | str | int) -> Sentence:
        """Build ``self > other``."""
        return Compare(">", self, as_operand(other))

    def __ge__(self, other: Operand | str | int) -> Sentence:
        """Build ``self >= other``."""
        return Compare(">=", self, as_operand(other))

    def __eq__(self, other: object) -> Sentence:  # type: ignore[override]
        """Build ``self == other``; compare ``key`` to tell operands apart."""
        return Compare("==", self, as_operand(other))

    def __ne__(self, other: object) -> Sentence:  # type: ignore[override]
        """Build ``self != other``."""
        return Compare("!=", self, as_operand(other))

    def __and__(self, other: Sentence | Operand) -> Sentence:
        """Use a flag as a sentence."""
        return as_sentence(self) & other

    def __or__(self, other: Sentence | Operand) -> Sentence:
        """Use a flag as a sentence."""
        return as_sentence(self) | other

    def __invert__(self) -> Sentence:
        """Use a flag as a sentence and negate it."""
        return Not(as_sentence(self))

    def __add__(self, other: Operand | int | str) -> Operand:
        """Build ``self + other``."""
        return Arithmetic("+", self, as_operand(other))

    def __radd__(self, other: int | str) -> Operand:
        """Build ``other + self``."""
        return Arithmetic("+", as_operand(other), self)

    def __mul__(self, other: Operand | int | str) -> Operand:
        """Build ``self * other``."""
        return Arithmetic("*", self, as_operand(other))

    def __rmul__(self, other: int | str) -> Operand:
        """Build ``other * self``."""
        return Arithmetic("*", as_operand(other), self)

    __hash__ = Node.__hash__


class Literal(Operand):
    """A constant: text is read by the kind of the policy it is compared with, numbers stand for themselves."""

    __slots__ = ("value",)

    def __init__(self, value: str | int) -> None:
        """Hold ``value``."""
        self.value = value
        self.key = ("literal", type(value).__name__, value)

    def text(self) -> str:
        """Double-quoted text, or the number, ``True`` or ``False``."""
        if isinstance(self.value, str):
            return _quote(self.value)
        return str(self.value)


class Term(Operand):
    """The value of a policy in a scope."""

    __slots__ = ("name", "scope")

    def __init__(self, scope: str, name: str) -> None:
        """Name a policy (dots allowed) in one of `SCOPES`."""
        self.scope = scope
        self.name = name
        self.key = ("term", scope, name)

    def text(self) -> str:
        """``offered(reliability)``, or the bare name for ``own``."""
        return self.name if self.scope == "own" else f"{self.scope}({self.name})"


class Arithmetic(Operand):
    """``left + right`` or ``left * right``; infinite stays infinite."""

    __slots__ = ("left", "op", "right")

    def __init__(self, op: str, left: Operand, right: Operand) -> None:
        """``op`` is ``+`` or ``*``."""
        self.op = op
        self.left = left
        self.right = right
        self.key = (op, left.key, right.key)

    def children(self) -> tuple[Node, ...]:
        """Both operands."""
        return (self.left, self.right)

    def text(self) -> str:
        """Text form with as few parentheses as Python's precedence allows, left-associative."""
        left, right = str(self.left), str(self.right)
        if self.op == "*":
            left = f"({left})" if _is_sum(self.left) else left
            right = f"({right})" if isinstance(self.right, Arithmetic) and not label_of(self.right) else right
        elif _is_sum(self.right):
            right = f"({right})"
        return f"{left} {self.op} {right}"


class Apply(Operand):
    """A function with a value: ``min max ceil first count total``."""

    __slots__ = ("args", "name")

    def __init__(self, name: str, *args: Node) -> None:
        """Apply ``name``; see `OPERAND_FUNCTIONS` for how many arguments it takes."""
        _refuse_number(name, len(args))
        self.name = name
        self.args = args
        self.key = ("apply", name, *(arg.key for arg in args))

    def children(self) -> tuple[Node, ...]:
        """The arguments."""
        return self.args

    def text(self) -> str:
        """``name(a, b)``."""
        return f"{self.name}({', '.join(map(str, self.args))})"


class Compare(Sentence):
    """``left <op> right`` with one of ``< <= == != >= >``."""

    __slots__ = ("left", "op", "right")

    def __init__(self, op: str, left: Operand, right: Operand) -> None:
        """Compare two operands."""
        self.op = op
        self.left = left
        self.right = right
        self.key = ("compare", op, left.key, right.key)

    def children(self) -> tuple[Node, ...]:
        """Both operands."""
        return (self.left, self.right)

    def text(self) -> str:
        """``left <op> right``."""
        return f"{self.left} {self.op} {self.right}"


class And(Sentence):
    """Both parts hold."""

    __slots__ = ("left", "right")

    def __init__(self, left: Sentence, right: Sentence) -> None:
        """Join two sentences."""
        self.left = left
        self.right = right
        self.key = ("and", left.key, right.key)

    def children(self) -> tuple[Node, ...]:
        """Both parts."""
        return (self.left, self.right)

    def text(self) -> str:
        """``left & right``, parts in parentheses where Python needs them."""
        left = str(self.left) if isinstance(self.left, And) else _part(self.left)
        return f"{left} & {_part(self.right)}"


class Or(Sentence):
    """At least one part holds."""

    __slots__ = ("left", "right")

    def __init__(self, left: Sentence, right: Sentence) -> None:
        """Join two sentences."""
        self.left = left
        self.right = right
        self.key = ("or", left.key, right.key)

    def children(self) -> tuple[Node, ...]:
        """Both parts."""
        return (self.left, self.right)

    def text(self) -> str:
        """``left | right``, parts in parentheses where Python needs them."""
        left = str(self.left) if isinstance(self.left, Or) else _part(self.left)
        return f"{left} | {_part(self.right)}"


class Not(Sentence):
    """The part does not hold."""

    __slots__ = ("part",)

    def __init__(self, part: Sentence) -> None:
        """Negate ``part``."""
        self.part = part
        self.key = ("not", part.key)

    def children(self) -> tuple[Node, ...]:
        """The negated sentence."""
        return (self.part,)

    def text(self) -> str:
        """``~part``."""
        sum_of_flags = (
            isinstance(self.part, Holds)
            and isinstance(self.part.operand, Arithmetic)
            and not label_of(self.part.operand)
        )
        return f"~({self.part})" if sum_of_flags else f"~{_part(self.part)}"


class Holds(Sentence):
    """A flag used as a sentence: ``topic(latched)``."""

    __slots__ = ("operand",)

    def __init__(self, operand: Operand) -> None:
        """Read a flag as true or false."""
        self.operand = operand
        self.key = ("holds", operand.key)

    def children(self) -> tuple[Node, ...]:
        """The flag."""
        return (self.operand,)

    def text(self) -> str:
        """The operand itself."""
        return str(self.operand)


class Test(Sentence):
    """A function that is true or false: ``in_ overlaps matches stated all_equal any_of``, or one that a pack declares."""

    __slots__ = ("args", "name")
    __test__ = False

    def __init__(self, name: str, *args: Node) -> None:
        """Apply ``name``; see `SENTENCE_FUNCTIONS` for how many arguments it takes."""
        _refuse_number(name, len(args))
        self.name = name
        self.args = args
        self.key = ("test", name, *(arg.key for arg in args))

    def children(self) -> tuple[Node, ...]:
        """The arguments."""
        return self.args

    def text(self) -> str:
        """``name(a, b)``."""
        return f"{self.name}({', '.join(map(str, self.args))})"


@dataclass(frozen=True, slots=True)
class Signature:
    """How many arguments a function of the language takes, and which of them are sentences."""

    least: int
    most: int | None
    sentences: bool | tuple[bool, ...] = False

    def wants_sentence(self, index: int) -> bool:
        """Whether argument ``index`` is a sentence rather than a value."""
        if isinstance(self.sentences, bool):
            return self.sentences
        return index < len(self.sentences) and self.sentences[index]


OPERAND_FUNCTIONS: Final = {
    "min": Signature(2, None),
    "max": Signature(2, None),
    "ceil": Signature(2, 2),
    "first": Signature(1, 1),
    "count": Signature(1, 1, sentences=True),
    "total": Signature(1, 2, sentences=(False, True)),
}
SENTENCE_FUNCTIONS: Final = {
    "in_": Signature(2, None),
    "overlaps": Signature(2, 2),
    "matches": Signature(2, 2),
    "stated": Signature(1, 2),
    "stated_here": Signature(1, 1),
    "all_equal": Signature(1, 1),
    "any_of": Signature(1, 1, sentences=True),
}
AGGREGATES: Final = frozenset({"count", "total", "all_equal", "any_of"})
"""Functions over all publishers or all subscribers of a signal, by the scope of the terms inside."""


def _signature(name: str) -> Signature:
    """The signature of a function; those that packs declare take any number of values."""
    return OPERAND_FUNCTIONS.get(name) or SENTENCE_FUNCTIONS.get(name) or Signature(0, None)


def _refuse_number(name: str, arguments: int) -> None:
    signature = _signature(name)
    if arguments < signature.least or (signature.most is not None and arguments > signature.most):
        raise SentenceError(f"`{name}` does not take {arguments} arguments")


def _quote(text: str) -> str:
    escaped = text.encode("unicode_escape").decode("ascii").replace('"', '\\"')
    return f'"{escaped}"'


def _is_sum(node: Operand) -> bool:
    return isinstance(node, Arithmetic) and node.op == "+" and not label_of(node)


def _part(sentence: Sentence) -> str:
    bare = bool(label_of(sentence)) or isinstance(sentence, (Holds, Test, Not))
    return str(sentence) if bare else f"({sentence})"


def as_operand(value: object) -> Operand:
    """Turn text, a number or a flag into a literal; leave operands alone."""
    if isinstance(value, Operand):
        return value
    if isinstance(value, (str, int)):
        return Literal(value)
    message = f"{value!r} cannot stand in a sentence: use a policy, text, a whole number, True or False"
    raise SentenceError(message)


def as_sentence(value: object) -> Sentence:
    """Read a flag operand as a sentence; leave sentences alone."""
    if isinstance(value, Sentence):
        return value
    if not isinstance(value, Operand) or isinstance(value, Literal):
        raise SentenceError(f"`{value}` is no sentence: compare it with something")
    return Holds(value)


_DEFINED: Final = re.compile(r"[a-z][a-z0-9_]*")


def define(name: str, part: Part) -> Part:
    """Name a part of conditions: they print the name, and its definition once. It means what ``part`` means."""
    if not _DEFINED.fullmatch(name) or keyword.iskeyword(name):
        raise SentenceError(f"`{name}` names no definition: use snake_case, and no word of Python")
    defined = Term(part.scope, part.name) if isinstance(part, Term) else copy(part)  # a policy cannot change
    defined.label = name
    return defined  # type: ignore[return-value]


def definitions(*conditions: Node) -> dict[str, Node]:
    """Return the definitions that conditions use, by name, each before those that it uses itself."""
    found: dict[str, Node] = {}
    for condition in conditions:
        for node in condition.walk():
            if label_of(node):
                found.setdefault(node.label, node)
    return found


def unfolded(node: Part) -> Part:
    """Return a condition without names of definitions, so that its text needs none."""
    if not node.children() and not label_of(node):
        return node
    bare = copy(node)
    bare.label = ""
    for name in type(node).__slots__:
        value = getattr(node, name)
        if isinstance(value, Node):
            setattr(bare, name, unfolded(value))
        elif isinstance(value, tuple):
            setattr(bare, name, tuple(map(unfolded, value)))
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


def in_(operand: Operand, *values: Operand | str | int) -> Sentence:
    """The value is one of ``values``, or an element of the list that the only argument is."""
    return Test("in_", operand, *map(as_operand, values))


def overlaps(left: Operand, right: Operand) -> Sentence:
    """Two lists of names share an element."""
    return Test("overlaps", left, right)


def matches(text: Operand, pattern: str | Operand) -> Sentence:
    """A text matches a shell pattern (``*``, ``?``, ``[abc]``), case-sensitively."""
    return Test("matches", text, as_operand(pattern))


def stated(term: Operand, word: str | None = None) -> Sentence:
    """The value was written down by somebody (explicit, profile or overlay, no preset and no default), as ``word`` if given."""
    return Test("stated", term) if word is None else Test("stated", term, Literal(word))


def stated_here(term: Operand) -> Sentence:
    """The value was written at the endpoint itself, in no profile."""
    return Test("stated_here", term)


def all_equal(term: Operand) -> Sentence:
    """All endpoints of the term's side have this value alike."""
    return Test("all_equal", term)


def any_of(sentence: Sentence | Operand) -> Sentence:
    """The sentence holds for at least one endpoint of the side it speaks of."""
    return Test("any_of", as_sentence(sentence))


def count(sentence: Sentence | Operand) -> Operand:
    """For how many endpoints of the side it speaks of the sentence holds."""
    return Apply("count", as_sentence(sentence))


def total(operand: Operand, where: Sentence | Operand | None = None) -> Operand:
    """The sum of a value over the endpoints of its side, those only for which ``where`` holds."""
    return Apply("total", operand) if where is None else Apply("total", operand, as_sentence(where))


def call(name: str, *args: Operand | str | int) -> Sentence:
    """A function that the pack declares (`cqos_core.packs.pack.Function`)."""
    return Test(name, *map(as_operand, args))


_COMPARISONS: Final = {ast.Lt: "<", ast.LtE: "<=", ast.Eq: "==", ast.NotEq: "!=", ast.GtE: ">=", ast.Gt: ">"}


class _Reader:
    """Translates Python's syntax tree into nodes."""

    def __init__(self, text: str, definitions: Mapping[str, Node]) -> None:
        self.text = text
        self.definitions = definitions
        self.depth = 0

    def fail(self, message: str, node: ast.expr) -> SentenceError:
        return SentenceError(message, self.text, self.offset(node.lineno, node.col_offset))

    def foreign(self, node: ast.expr) -> SentenceError:
        start = self.offset(node.lineno, node.col_offset)
        written = self.text[start : self.offset(node.end_lineno, node.end_col_offset)]
        shown = written if len(written) <= _LONGEST_EXCERPT else f"{written[:_LONGEST_EXCERPT]}…"
        return self.fail(_hint(node) or f"`{shown}` is not part of the language of sentences", node)

    def offset(self, line: int | None, column: int | None) -> int:
        """The offset of a place that the syntax tree gives as a line and a number of UTF-8 bytes."""
        start = _line_start(self.text, line)
        return start + len(self.text[start:].encode(errors="replace")[: column or 0].decode(errors="ignore"))

    def sentence(self, node: ast.expr) -> Sentence:
        read = self.node(node)
        if isinstance(read, Literal):
            message = f"`{read}` is no sentence: compare it with something"
            raise self.fail(message, node)
        return as_sentence(read)

    def operand(self, node: ast.expr) -> Operand:
        read = self.node(node)
        if not isinstance(read, Operand):
            message = f"`{read}` is a sentence where a value is expected"
            raise self.fail(message, node)
        return read

    def node(self, node: ast.expr) -> Node:
        self.depth += 1
        if self.depth > _MAXIMUM_DEPTH:
            message = f"the sentence is nested deeper than {_MAXIMUM_DEPTH} levels"
            raise self.fail(message, node)
        try:
            return self._node(node)
        finally:
            self.depth -= 1

    def _node(self, node: ast.expr) -> Node:
        match node:
            case ast.Constant(value=bool() | int() | str() as value):
                return Literal(value)
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() as value)) if not isinstance(value, bool):
                return Literal(-value)
            case ast.Name(id=name) if name in self.definitions:
                return self.definitions[name]
            case ast.Name() | ast.Attribute():
                return Term("own", self.name(node))
            case ast.UnaryOp(op=ast.Invert(), operand=inner):
                return Not(self.sentence(inner))
            case ast.BinOp(left=left, op=ast.BitAnd(), right=right):
                return And(self.sentence(left), self.sentence(right))
            case ast.BinOp(left=left, op=ast.BitOr(), right=right):
                return Or(self.sentence(left), self.sentence(right))
            case ast.BinOp(left=left, op=ast.Add() | ast.Mult() as op, right=right):
                sign = "+" if isinstance(op, ast.Add) else "*"
                return Arithmetic(sign, self.operand(left), self.operand(right))
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
                return Compare(_COMPARISONS[type(op)], self.operand(left), self.operand(right))
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                return self.call(name, args, node)
        raise self.foreign(node)

    def name(self, node: ast.expr) -> str:
        parts: list[str] = []
        inner = node
        while isinstance(inner, ast.Attribute) and len(parts) < _MAXIMUM_DEPTH:
            parts.append(inner.attr)
            inner = inner.value
        if not isinstance(inner, ast.Name):
            message = "expected a policy name"
            raise self.fail(message, node)
        return ".".join([inner.id, *reversed(parts)])

    def call(self, name: str, args: list[ast.expr], node: ast.expr) -> Node:
        if name in SCOPES:
            if len(args) != 1 or not isinstance(args[0], (ast.Name, ast.Attribute)):
                message = f"`{name}` takes one policy name"
                raise self.fail(message, node)
            return Term(name, self.name(args[0]))
        signature = _signature(name)
        try:
            _refuse_number(name, len(args))
        except SentenceError as error:
            raise self.fail(str(error), node) from None
        read = [
            self.sentence(arg) if signature.wants_sentence(index) else self.operand(arg)
            for index, arg in enumerate(args)
        ]
        return Apply(name, *read) if name in OPERAND_FUNCTIONS else Test(name, *read)


def _hint(node: ast.expr) -> str | None:
    """What to write instead of something that people try."""
    match node:
        case ast.BoolOp():
            return "use & and | instead of `and` and `or`, each side in parentheses"
        case ast.UnaryOp(op=ast.Not()):
            return "use ~(…) instead of `not`"
        case ast.Compare(ops=[_, _, *_]):
            return "write two comparisons joined by & instead of a chained one"
        case ast.Constant(value=float()):
            return 'write whole numbers, and durations as text with a unit, for instance "1.5s"'
    return None


def _line_start(text: str, line: int | None) -> int:
    """The offset at which a line begins, after the blanks that `parse` takes away."""
    blanks = len(text) - len(text.lstrip())
    starts = [blanks, *(end.end() for end in _LINE_END.finditer(text, blanks))]
    return starts[min(line or 1, len(starts)) - 1]


def parse(text: str, definitions: Mapping[str, Node] = MappingProxyType({})) -> Sentence:
    """Read the text form of a sentence, which may use ``definitions`` by name.

    Raises:
        SentenceError: with the offset of the fault; the text is at most 10,000 characters and 60 levels deep.
    """
    return _Reader(text, definitions).sentence(_tree(text))


def parse_value(text: str, definitions: Mapping[str, Node] = MappingProxyType({})) -> Sentence | Operand:
    """Read the text form of a sentence, or of a value such as ``offered(deadline)``.

    Raises:
        SentenceError: as `parse` does.
    """
    read = _Reader(text, definitions).node(_tree(text))
    return read if isinstance(read, Operand) else as_sentence(read)


def _tree(text: str) -> ast.expr:
    if len(text) > MAXIMUM_TEXT:
        message = f"a sentence has at most {MAXIMUM_TEXT:,} characters, this one has {len(text):,}"
        raise SentenceError(message)
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except SyntaxError as error:
        offset = _line_start(text, error.lineno) + max((error.offset or 1) - 1, 0)
        raise SentenceError(f"not valid syntax: {error.msg}", text, min(offset, len(text))) from None
    except (ValueError, RecursionError, MemoryError) as error:
        message = f"not valid syntax: {str(error) or 'nested too deeply'}"
        raise SentenceError(message, text[:80]) from None
    return tree.body
