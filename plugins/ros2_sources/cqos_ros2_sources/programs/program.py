"""A program as far as creating calls need it: one form for C++ and Python, made by their readers and walked by `statements`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeAlias, TypeVar

from cqos_ros2_sources.programs.names import fits, last_part, without_arguments

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cqos_core.model.settings import Place

_Found = TypeVar("_Found")
THIS: Final = "this"
SUPER: Final = "super()"
"""The object as one of its base class, in Python."""
"""What a method calls its object, in both languages."""
JOIN: Final = "join"
"""The operator of a text of parts one after the other."""
ADDRESS: Final = "&"
"""The operator of C++ that makes a pointer, where it has one operand."""
STATIC: Final = "static "
"""How the type of a local name of C++ begins that is made once for all calls."""
POINTS: Final = "*"
"""The operator of C++ that copies what a pointer points to, where it has one operand."""
EACH: Final = "#each"
PAIRS: Final = "#pairs"
"""The calls of what a comprehension of Python makes, with a function of each element and what it goes over."""
ENTER: Final = "#enter"
"""The call of what a `with` of Python begins, with its manager."""
LEAVE: Final = "#leave"
"""The call of what a `with` of Python ends, with its manager."""
YIELD: Final = "#yield"
"""The call of what a generator of Python yields, with the value."""
CASE: Final = "case"
"""The operator of a value, one case of a switch, and the words of all of its cases, which differ from each other."""


# Expressions


@dataclass(frozen=True, slots=True)
class Literal:
    """A text, number or flag."""

    value: Any


POINTED: Final = Literal(("*",))
"""What stands as the key of an element that is what a pointer points to: ``*p = value``."""


@dataclass(frozen=True, slots=True)
class Name:
    """A name as written: with ``::`` in C++; in Python with its module where an import says so."""

    text: str


@dataclass(frozen=True, slots=True)
class Attribute:
    """A member of an object."""

    of: Expression
    name: str


@dataclass(frozen=True, slots=True)
class Element:
    """An element of a list, map or text."""

    of: Expression
    key: Expression


@dataclass(frozen=True, slots=True)
class Call:
    """A call of a function or method, or the making of an object.

    Attributes:
        function: a `Name`, an `Attribute` of what it is called on, or any other expression.
        types: template arguments as written.
    """

    function: Expression
    arguments: tuple[Expression, ...]
    keywords: tuple[tuple[str, Expression], ...]
    types: tuple[str, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Operation:
    """An operator with its operands, for instance ``+``, ``==``, ``and`` or ``not``; `JOIN` for a text of parts."""

    operator: str
    operands: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Conditional:
    """One of two values."""

    condition: Expression
    then: Expression
    otherwise: Expression


@dataclass(frozen=True, slots=True)
class Items:
    """A list, tuple, or initializer list.

    Attributes:
        type: what it initializes, where it is written: ``rclcpp::QoS``.
    """

    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Pairs:
    """A dictionary."""

    items: tuple[tuple[Expression, Expression], ...]


@dataclass(frozen=True, slots=True)
class Closure:
    """A lambda.

    Attributes:
        values: names that it holds itself, with what is written for them; other names are those around it.
        all_values: it holds all names itself, apart from ``references``.
    """

    function: Function
    values: tuple[tuple[str, Expression], ...] = ()
    all_values: bool = False
    references: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Reference:
    """A method or function as a value, as in ``&Talker::on_timer``.

    Attributes:
        bound: what `std::bind` hands it; ``_1`` stands for the first argument of the call.
    """

    name: str
    bound: tuple[Expression, ...] = ()


@dataclass(frozen=True, slots=True)
class NotFollowed:
    """An expression that is not followed; its parts are walked, because they may create something."""

    text: str
    parts: tuple[Expression, ...] = ()


Expression: TypeAlias = (
    Literal
    | Name
    | Attribute
    | Element
    | Call
    | Operation
    | Conditional
    | Items
    | Pairs
    | Closure
    | Reference
    | NotFollowed
)


# Statements


@dataclass(frozen=True, slots=True)
class Assign:
    """An assignment or declaration.

    Attributes:
        target: a `Name`, `Attribute` or anything else, which is then not followed.
        declares: it makes a new local name.
        type: that of the name, in C++; with ``&`` or ``*`` at its end where it may change what it is made from.
    """

    target: Expression
    value: Expression
    place: Place
    declares: bool = False
    type: str = ""


@dataclass(frozen=True, slots=True)
class Do:
    """An expression for its effect."""

    expression: Expression
    place: Place


@dataclass(frozen=True, slots=True)
class If:
    """A decision."""

    condition: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Loop:
    """A loop.

    Attributes:
        targets: the names that are given the elements of ``over``.
        over: None where it is no loop over elements.
        copies: the names are given copies.
    """

    targets: tuple[str, ...]
    over: Expression | None
    body: tuple[Statement, ...]
    place: Place
    copies: bool = False


@dataclass(frozen=True, slots=True)
class Return:
    """The end of a function, with its value."""

    value: Expression | None
    place: Place


@dataclass(frozen=True, slots=True)
class Try:
    """Statements, and for each kind of exception those that handle it."""

    body: tuple[Statement, ...]
    handlers: tuple[tuple[Statement, ...], ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Leave:
    """The end of a function or a round of a loop: ``throw``, ``break`` or ``continue``."""

    kind: str


Statement: TypeAlias = Assign | Do | If | Loop | Return | Try | Leave


# Functions, classes, programs


@dataclass(frozen=True, slots=True)
class Variable:
    """A parameter of a function.

    Attributes:
        by_reference: the function may change what it is given.
        kind: ``*`` or ``**`` where it takes the rest of the arguments.
    """

    name: str
    type: str = ""
    default: Expression | None = None
    by_reference: bool = False
    kind: str = ""


@dataclass(eq=False, slots=True)
class Function:
    """A function, method or lambda.

    Attributes:
        name: qualified: ``demo::Talker::on_timer``, ``demo.talker.Talker.on_timer``.
        statements: its body, or what reads it when it is asked for.
        owner: the qualified name of its class; empty where it has none.
        templates: names of its own type parameters.
        initializers: of a constructor: for members and base classes, in their order.
        source: its text; empty where it is not kept.
        macro: it stands for a macro; what it makes stands where the macro is used.
        returns: the type of what it returns, in C++, with ``&`` or ``*`` at its end; empty where it is not written.
        decorators: the names of what wraps it, in Python.
    """

    name: str
    parameters: tuple[Variable, ...]
    statements: tuple[Statement, ...] | Callable[[], tuple[Statement, ...]]
    place: Place
    owner: str = ""
    templates: tuple[str, ...] = ()
    initializers: tuple[tuple[str, tuple[Expression, ...], Place], ...] = ()
    static: bool = False
    source: bytes = b""
    macro: bool = False
    returns: str = ""
    decorators: tuple[str, ...] = ()

    @property
    def body(self) -> tuple[Statement, ...]:
        """Its statements."""
        if not isinstance(self.statements, tuple):
            self.statements = self.statements()
        return self.statements

    def mentions(self, names: Iterable[bytes]) -> bool:
        """Whether one of some names may stand in it: a search in its text is cheaper than reading it."""
        return not self.source or any(each in self.source for each in names)

    @property
    def last(self) -> str:
        """The name without what it is in."""
        return last_part(self.name)


@dataclass(slots=True)
class Class:
    """A class.

    Attributes:
        bases: as written.
        fields: types of members by their names.
        initial: values that the class gives members.
        fixed: members that are constants.
        declared: methods that are declared here and may change the object; their definitions stand elsewhere.
    """

    name: str
    bases: tuple[str, ...]
    place: Place
    fields: dict[str, str] = field(default_factory=dict)
    initial: dict[str, Expression] = field(default_factory=dict)
    fixed: set[str] = field(default_factory=set)
    declared: set[str] = field(default_factory=set)
    templates: tuple[str, ...] = ()


@dataclass(slots=True)
class Program:
    """What the files of a package define.

    Attributes:
        language: ``cpp`` or ``python``.
        classes, functions: by the last part of their names.
        constants: values at the top of files, by the last part of their names, with their files; several where they are set several times.
        aliases: names that stand for others (`using`, `typedef`), by the last part.
        declared: declarations with default arguments.
        registered: classes that are components.
        plugins: classes that pluginlib loads.
        scripts: what a Python file does when it is run, by path.
        imports: the names that each file of Python imports, in their order.
        tops: what stands at the top of each file of Python, as in ``scripts``, with those of other packages.
        gaps: files that could not be read, and why.
        parameter_sets: what generate_parameter_library makes, by namespace.
        includes: what each file of C++ includes, as written.
        namespaces: those of C++, by their whole names.
        scoped: aliases with their whole names, by the last part.
        names_set: names that functions set, by the identity of the function.
        qualities: constants that are qualities of service, with their files; None before something asked for them.
        changing: functions that may change a constant, by its name and file.
        parts: what stands in functions of Python, by the identity of the function, for `python_aliases`.
        holding: whether members of classes have a quality of service, by the identity of the class and their names.
    """

    language: str
    classes: dict[str, list[Class]] = field(default_factory=dict)
    functions: dict[str, list[Function]] = field(default_factory=dict)
    constants: dict[str, list[tuple[str, Expression, str]]] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)
    declared: dict[str, list[Function]] = field(default_factory=dict)
    registered: dict[str, Place] = field(default_factory=dict)
    plugins: dict[str, Place] = field(default_factory=dict)
    scripts: dict[str, Function] = field(default_factory=dict)
    imports: dict[str, tuple[str, ...]] = field(default_factory=dict)
    tops: dict[str, Function] = field(default_factory=dict)
    gaps: list[tuple[str, Place]] = field(default_factory=list)
    parameter_sets: dict[str, Any] = field(default_factory=dict)
    includes: dict[str, list[str]] = field(default_factory=dict)
    namespaces: set[str] = field(default_factory=set)
    scoped: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    _known: dict[tuple[str, str, str], Class | None] = field(default_factory=dict)
    _reached: dict[str, set[str]] = field(default_factory=dict)
    _paths: dict[str, list[str]] = field(default_factory=dict)
    _owned: dict[str, list[Function]] = field(default_factory=dict)
    _assigned: dict[str, bool] = field(default_factory=dict)
    names_set: dict[int, tuple[str, ...]] = field(default_factory=dict)
    qualities: list[tuple[str, str]] | None = None
    holding: dict[tuple[int, str], bool] = field(default_factory=dict)
    changing: dict[tuple[str, str], list[Function]] = field(default_factory=dict)
    parts: dict[int, Any] = field(default_factory=dict)

    def add(self, other: Program) -> None:
        """Take what the files of a package that this one depends on define."""
        _extend(self.classes, other.classes)
        _extend(self.functions, other.functions)
        _extend(self.constants, other.constants)
        _extend(self.includes, other.includes)
        _extend(self.scoped, other.scoped)
        self.imports.update(other.imports)
        self.tops.update(other.scripts)
        self.aliases.update({name: found for name, found in other.aliases.items() if name not in self.aliases})

    def find_class(self, name: str, near: str = "", scope: str = "") -> Class | None:
        """Return the one class that a name means; None where none or several fit.

        Args:
            name: as written.
            near: the file in which it stands: what it includes decides between classes of one name.
            scope: the qualified name of the function or class in which it stands.
        """
        key = name, near, scope
        if key not in self._known:
            plain = without_arguments(name)
            plain = self._scoped(plain, scope) or self.aliases.get(plain, plain)
            found = [each for each in self.classes.get(last_part(plain), []) if fits(each.name, plain)]
            if len(found) > 1 and near:
                seen = self.reached(near)
                found = [each for each in found if each.place.source in seen] or found
            self._known[key] = found[0] if len(found) == 1 else _nearest(found, plain.strip(":"), near, scope)
        return self._known[key]

    def _scoped(self, name: str, scope: str) -> str:
        """Return the plain type that a name stands for in the innermost class or namespace around; empty where it stands for none there."""
        known = self.scoped.get(name, ())
        inner = [each for each in known if f"{scope}::".startswith(each[0].removesuffix(name) or "::")]
        return without_arguments(max(inner, key=lambda each: len(each[0]))[1]) if inner else ""

    def alias(self, name: str) -> str | None:
        """Return what a name stands for; None where it is no alias, or one of several that may be meant."""
        meant = {text for full, text in self.scoped.get(last_part(name), ()) if fits(full, name)}
        if "::" in name and meant:
            return meant.pop() if len(meant) == 1 else None
        return self.aliases.get(name) or self.aliases.get(last_part(name))

    def methods(self, cls: Class, name: str) -> list[Function]:
        """Return the methods of a class by name: where classes have one name, those of files that see this one."""
        found = [
            each
            for each in self.functions.get(name, [])
            if each.owner and (each.owner == cls.name or (self.language == "cpp" and fits(cls.name, each.owner)))
        ]
        found = [each for each in found if each.owner == cls.name] or found
        source = cls.place.source
        return [each for each in found if source in self.reached(each.place.source)] or found

    def reached(self, path: str) -> set[str]:
        """Return a file with all that it includes."""
        if path not in self._reached:
            if not self._paths:
                for each in self.includes:
                    self._paths.setdefault(each.rpartition("/")[2], []).append(each)
            found, waiting = {path}, [path]
            while waiting:
                here = waiting.pop()
                for written in self.includes.get(here, ()):
                    waiting += [each for each in self._included(written, here) if each not in found]
                    found.update(waiting)
            self._reached[path] = found
        return self._reached[path]

    def _included(self, written: str, here: str) -> list[str]:
        plain = written.rpartition("../")[2]
        fitting = [each for each in self._paths.get(plain.rpartition("/")[2], ()) if each.endswith(f"/{plain}")]
        own = f"{here.rpartition('/')[0]}/{plain}"
        return [own] if own in fitting else fitting

    def owned(self, cls: str) -> list[Function]:
        """Return the methods of a class by its qualified name."""
        if not self._owned:
            for functions in self.functions.values():
                for each in functions:
                    self._owned.setdefault(each.owner, []).append(each)
        return self._owned.get(cls, [])

    def assigned(self, name: str) -> bool:
        """Whether a function of C++ assigns a plain name without declaring it: a global that changes, perhaps."""
        from cqos_ros2_sources.programs.statement_search import assignments

        if name not in self._assigned:
            functions = (each for found in self.functions.values() for each in found) if self.language == "cpp" else ()
            self._assigned[name] = any(
                isinstance(each.target, Name) and each.target.text == name
                for function in functions
                if function.mentions((name.encode(),))
                for each in assignments(function)
            )
        return self._assigned[name]

    def find_functions(self, name: str) -> list[Function]:
        """Return the functions that a name may mean."""
        plain = without_arguments(name)
        return [each for each in self.functions.get(last_part(plain), []) if fits(each.name, plain)]


def _extend(mine: dict[str, list[_Found]], theirs: dict[str, list[_Found]]) -> None:
    for name, found in theirs.items():
        mine.setdefault(name, []).extend(found)


def _nearest(found: list[Class], plain: str, near: str, scope: str) -> Class | None:
    """Return the class that a name means in a scope, as C++ looks it up: the innermost first; else the one of its file."""
    parts = scope.replace("::", ".").split(".") if scope else []
    for length in range(len(parts), -1, -1):
        full = ".".join([*parts[:length], plain.replace("::", ".")])
        exact = [each for each in found if each.name.replace("::", ".") == full]
        if exact:
            found = exact
            break
    own = [each for each in found if each.place.source == near]
    return found[0] if len(found) == 1 else own[0] if len(own) == 1 else None


def call_name(call: Call) -> str:
    """Return the name of what is called, as written; empty where it has none."""
    function = call.function
    return function.text if isinstance(function, Name) else function.name if isinstance(function, Attribute) else ""
