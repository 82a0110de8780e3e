"""Values of programs: texts with the values of parameters in them, qualities of service, objects, and what is not known."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.program import Class, Function

_MOST_CASES: Final = 32
NO_POSITION: Final = 2**64 - 1
"""What C++ calls `npos`."""
MISSING: Final = object()
"""A parameter without a default."""


@dataclass(frozen=True, slots=True)
class Template:
    """A text with the values of parameters in it, as node files write it: ``${scan_topic}``."""

    text: str

    @property
    def parameter(self) -> str:
        """The parameter whose value it is; empty where it is more or less than one."""
        depth = 0
        for at, sign in enumerate(self.text):
            depth += self.text.startswith("${", at) - (sign == "}")
            if depth == 0:
                return self.text[2:-1] if at == len(self.text) - 1 and at else ""
        return ""


@dataclass(frozen=True, slots=True)
class Counted:
    """How many elements the list of a parameter has; with a name, the place of one of them in a loop over all."""

    of: Template
    name: str = ""


@dataclass(frozen=True, slots=True)
class Test:
    """Whether a parameter has one of some values, or none of them."""

    subject: str
    values: tuple[str, ...]
    negated: bool = False


Tests: TypeAlias = tuple[Test, ...]


@dataclass(frozen=True, slots=True)
class Condition:
    """A truth value that parameters decide: all tests hold."""

    tests: Tests


@dataclass(frozen=True, slots=True)
class Either:
    """One of a few values: the first whose tests hold."""

    cases: tuple[tuple[Tests, Any], ...]


@dataclass(frozen=True, slots=True)
class Word:
    """A name that stands for itself: of an enumeration, a type, a library."""

    name: str


@dataclass(frozen=True, slots=True)
class Resolved:
    """A name after remaps: it names the topic, and a text made from it is not known."""

    name: Any


@dataclass(frozen=True, slots=True)
class Duration:
    """A duration in nanoseconds."""

    nanoseconds: int


@dataclass(frozen=True, slots=True)
class Qos:
    """A quality of service.

    Attributes:
        preset: what it begins with; empty: it only states some policies.
        settings: policies over it; a value may be a text, a number, a duration, a template, or not known.
    """

    preset: str
    settings: tuple[tuple[str, Any], ...] = ()

    def having(self, settings: dict[str, Any]) -> Qos:
        """Return it with further policies."""
        return Qos(self.preset, tuple({**dict(self.settings), **settings}.items()))


@dataclass(frozen=True, slots=True)
class Overriding:
    """What opens policies of an endpoint to `qos_overrides`.

    Attributes:
        unknown: why it is not known which; empty where it is.
    """

    policies: tuple[str, ...]
    unknown: str = ""


@dataclass(eq=False, slots=True)
class Instance:
    """An object.

    Attributes:
        cls: its class in the program; None where a library has it.
        library: the name of its class in a library; of its library base where the program has the class.
        members: values of its members.
        types: type parameters of its class.
        node: the node that it is, or None.
        declared: objects that its class declares as members, as soon as something asked for one.
        begins: the first members of such an object; None for any other.
    """

    cls: Class | None
    library: str = ""
    members: dict[str, Any] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    node: NodeRecord | None = None
    declared: dict[str, Any] = field(default_factory=dict)
    begins: dict[str, Any] | None = None

    def alike(self, other: Instance) -> bool:
        """Whether both are objects of one class of a library, made alike."""
        mine = (self.cls, self.node, self.library, self.types, self.members)
        return mine == (None, None, other.library, other.types, other.members) and other.cls is None is other.node


@dataclass(eq=False, slots=True)
class Profile(Instance):
    """A quality of service as an object: names, members and lists share it. `profiles` reads and changes it."""


@dataclass(frozen=True, slots=True)
class Undecided(Unknown):
    """A value that is not known and may be one of some objects: what changes it may change each of them.

    Attributes:
        exhaustive: it is one of them.
    """

    among: tuple[Any, ...] = ()
    exhaustive: bool = False


@dataclass(frozen=True, slots=True)
class Perhaps:
    """An object that is only made on some ways: where it is used, it is there.

    Attributes:
        there: whether it counts as true.
    """

    of: Any
    there: Condition | Unknown


@dataclass(frozen=True, slots=True, eq=False)
class Code:
    """A function as a value.

    Attributes:
        this: the object that it is a method of, or in which it was written.
        names: what names stand for where it was written.
        own: what names stand for that it holds itself.
        given, named: arguments that it is called with, before those of the call; a word such as ``_1`` of C++ is one of the call.
        library: the method of a library class that it stands for, called on ``this``; empty for a function of the program.
    """

    function: Function
    this: Instance | None
    names: dict[str, Any] = field(default_factory=dict)
    own: dict[str, Any] = field(default_factory=dict)
    given: tuple[Any, ...] = ()
    named: dict[str, Any] = field(default_factory=dict)
    library: str = ""


@dataclass(frozen=True, slots=True)
class Made:
    """One call that makes an endpoint.

    Attributes:
        direction: as in node files: ``publishes``, …
        name, type, qos: what was found of them.
        tests: the values of parameters with which it is made.
        perhaps: why it may not be made; empty where it is.
        branch: 1 or -1 in the branches of that one decision.
        for_each: variables of its name with the parameter that lists their values.
        overriding: what `qos_overrides` may set.
    """

    direction: str
    name: Any
    type: Any
    qos: Any
    place: Place
    tests: Tests = ()
    perhaps: str = ""
    for_each: tuple[tuple[str, str], ...] = ()
    overriding: Overriding = Overriding(())
    branch: int = 0


@dataclass(slots=True)
class NodeRecord:
    """What is found of a node.

    Attributes:
        cls: its class, as the code names it.
        parameters: defaults of declared parameters.
        uses: fragments, each with what is not known of it.
        gaps: what is not known, its cause, where.
        changed: parameters that the program sets itself; ``*`` where it may be any.
        overrides: values that its options give parameters, whatever a launch file says.
        remaps: what its options rename, before what a launch file does.
        alone: it takes no arguments of its process.
        renamed: why any of its names may be another one; None where none is.
        constants: names of constants of libraries that name parameters which the node declares, each once.
        protocol: of a client of brokers.
        settings: what such a client states of its connection.
    """

    cls: str
    name: Any
    namespace: Any
    place: Place
    lifecycle: bool = False
    parameters: dict[str, Any] = field(default_factory=dict)
    made: list[Made] = field(default_factory=list)
    uses: dict[str, Place] = field(default_factory=dict)
    gaps: dict[tuple[str, str], Place] = field(default_factory=dict)
    changed: set[str] = field(default_factory=set)
    overrides: dict[str, Any] = field(default_factory=dict)
    remaps: dict[str, str] = field(default_factory=dict)
    alone: bool = False
    renamed: Unknown | None = None
    constants: set[str] = field(default_factory=set)
    protocol: str = ""
    settings: dict[str, Any] = field(default_factory=dict)


PLAIN: Final = (str, int, float, bool, Template, Profile, Qos, Overriding, list, dict, Either, type(None))
"""Values that an assignment replaces or changes; an object stays what it is."""


_SHARED: Final = (Profile, Undecided)


def joined(values: list[Any]) -> Any:
    """Return the text of several values one after the other; one for each case where a value is one of a few."""
    for number, each in enumerate(values):
        if isinstance(each, Either):
            return each_case(each, lambda one, at=number: joined([*values[:at], one, *values[at + 1 :]]))  # type: ignore[misc]
    text, holes = "", False
    for each in values:
        if isinstance(each, Template):
            holes = True
            text += each.text
        elif isinstance(each, str):
            if "${" in each:
                return Unknown("a text with `${`")
            text += each
        elif isinstance(each, int) and not isinstance(each, bool):
            text += str(each)
        else:
            return each if isinstance(each, Unknown) else Unknown("a text of parts that are not known")
    return Template(text) if holes else text


def each_case(value: Any, function: Callable[[Any], Any]) -> Any:
    """Apply a function to a value, or to each of its alternatives."""
    if isinstance(value, Either):
        return flat(tuple((tests, each_case(each, function)) for tests, each in value.cases))
    return function(value)


def flat(cases: tuple[tuple[Tests, Any], ...]) -> Any:
    """Return one of a few values, where a value may itself be one of a few; not known where they are too many."""
    found: list[tuple[Tests, Any]] = []
    for tests, each in cases:
        for inner, value in each.cases if isinstance(each, Either) else (((), each),):
            here = tuple(dict.fromkeys((*tests, *inner)))
            if not any({*earlier} <= {*here} for earlier, _ in found):  # else an earlier one is taken
                found.append((here, value))
    if len(found) == 1 and not found[0][0]:
        return found[0][1]
    return Either(tuple(found)) if len(found) <= _MOST_CASES else Unknown("one of many values")


def same(one: Any, other: Any) -> bool:
    """Whether two values are one and the same, of one type."""
    return one is other or (type(one) is type(other) and bool(one == other))


def used(value: Any) -> Any:
    """Return a value where a program uses it: an object is there."""
    return value.of if isinstance(value, Perhaps) else value


def merged(tests: Tests | None, then: Any, otherwise: Any, cause: str, place: Place) -> Any:
    """Return the value after a decision.

    Args:
        tests: what decides; None where that is not known.
        then: the value where they hold.
        otherwise: the value where they do not.
        cause: why it is not known.
        place: of the decision.
    """
    if same(then, otherwise):
        return then
    objects = (Instance, Code, Perhaps)
    if isinstance(then, _SHARED) or isinstance(otherwise, _SHARED):
        if tests is None or isinstance(then, Undecided) or isinstance(otherwise, Undecided):
            return Undecided(cause, place, "", (then, otherwise), exhaustive=True)
        return flat(((tests, then), ((), otherwise)))
    for holds, one, other in ((tests, then, otherwise), (flipped(tests or ()), otherwise, then)):
        if isinstance(one, objects) and other is None:  # made in one branch
            there = one.there if isinstance(one, Perhaps) else Condition(())
            if isinstance(there, Condition):
                there = Unknown(cause, place) if holds is None else Condition((*holds, *there.tests))
            return Perhaps(used(one), there)
    if isinstance(then, Perhaps) or isinstance(otherwise, Perhaps):
        joint = merged(tests, used(then), used(otherwise), cause, place)
        return Perhaps(joint, Unknown(cause, place)) if isinstance(joint, objects) else joint
    if isinstance(then, Instance) and isinstance(otherwise, Instance) and then.alike(otherwise):
        return then
    if tests is None or isinstance(then, Instance) or isinstance(otherwise, Instance):
        from cqos_ros2_sources.walk.profiles import undecided

        return undecided(Unknown(cause, place), then, otherwise)
    rest = otherwise.cases if isinstance(otherwise, Either) else (((), otherwise),)
    inner = then.cases if isinstance(then, Either) else (((), then),)
    return Either((*(((*tests, *each), value) for each, value in inner), *rest))


def flipped(tests: Tests) -> Tests | None:
    """Return the tests that hold where these do not; None where no list of tests says so."""
    if len(tests) != 1:
        return None
    return (Test(tests[0].subject, tests[0].values, not tests[0].negated),)
