"""Where a walk is: names of the function, conditions that hold, limits; and snapshots of all values, for branches."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_ros2_sources.programs.names import without_arguments
from cqos_ros2_sources.programs.program import Call, Literal
from cqos_ros2_sources.walk.values import MISSING, Code, Instance, NodeRecord, Profile, merged, used
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.program import Class, Expression, Function, Program
    from cqos_ros2_sources.walk.call_tables import Table
    from cqos_ros2_sources.walk.values import Tests

MOST_STEPS: Final = 60_000
"""How many expressions and statements are walked for one program or component."""
DEEPEST_CALL: Final = 10
MOST_ENDPOINTS: Final = 2_000
MOST_ELEMENTS: Final = 50
"""How many elements of a list are followed one by one."""
MOST_ROUNDS: Final = 600
"""How many statements of a loop are followed, in all of its rounds."""
_MOST_BASES: Final = 12
ABSENT: Final = object()


class TooMuchError(Exception):
    """The walk takes more steps than it may."""


class Way(NamedTuple):
    """One way out of a function."""

    tests: Tests | None
    values: list[dict[str, Any]] | None
    place: Place


@dataclass(slots=True)
class Frame:
    """The names of one call.

    Attributes:
        this: the object whose method it is.
        types: what type parameters stand for.
        outer: names around a lambda.
        returned: what it returned on each way, with the tests that hold there; None where these are not known.
        conditions: how many conditions hold around it.
        left: all values where `break` or `continue` leaves a round of the innermost loop.
        aliases: names that are references or pointers to others, with what is written for these; whether it is a pointer.
        declared: types of names, as written.
        at: where the last call stands whose function is walked.
        yielded: what it yields, in Python.
        ways: where it returned: the tests as in `returned`, all values, the place; values are None where they are as at the end.
    """

    function: Function
    this: Instance | None
    names: dict[str, Any] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    outer: dict[str, Any] | None = None
    returned: list[tuple[Tests | None, Any]] = field(default_factory=list)
    conditions: int = 0
    left: list[list[dict[str, Any]]] = field(default_factory=list)
    declared: dict[str, str] = field(default_factory=dict)
    at: Place | None = None
    yielded: list[Any] = field(default_factory=list)
    ways: list[Way] = field(default_factory=list)
    aliases: dict[str, tuple[Expression, bool]] = field(default_factory=dict)

    @property
    def abstract(self) -> set[str]:
        """The type parameters that stand for nothing that is known."""
        own = self.this.cls.templates if self.this is not None and self.this.cls is not None else ()
        return {each for each in (*self.function.templates, *own) if self.types.get(each, each) == each}


@dataclass(slots=True)
class Condition:
    """What is decided where the walk is.

    Attributes:
        tests: of parameters.
        perhaps: why it is not known whether the walk comes here; empty where it is.
        branch: 1 where the decision holds, -1 where it does not; 0 where it is none of two.
        each: a variable with the parameter that lists its values.
    """

    tests: Tests = ()
    perhaps: str = ""
    branch: int = 0
    each: tuple[str, str] | None = None


@dataclass(slots=True)
class Walk:
    """One walk of a program or component.

    Attributes:
        nodes: in the order in which they are made.
        current: the node that a helper without a node of its own belongs to.
        made_at: places of calls that were understood as making something.
        executed: functions that were walked.
        lost: calls that were not followed, by identity, each with the function in which it stands.
        cut: functions that were called too deep.
        callbacks: functions that are handed to something that calls them later.
        modules: names that the files of Python have which are run.
        constants: objects that stand at the top of files, presets and default arguments of Python.
        strays: what functions make for a node that is not known, by class or function.
        aliases: names that are followed right now.
        lineages: classes with those that they are made from, by the identity of the class.
        in_callback: it is in what is called later, perhaps often.
        starting: the walk is before the first callback can come.
        later: identities of functions that callbacks call; `searched` callbacks were searched for them.
        thrown: within `try`, all values where something is thrown, with how many calls were open there; else None.
        tried: how many functions are tried right now, whose walk leaves nothing behind.
        awaited: identities of functions that were not walked when a value was asked for that they set.
    """

    program: Program
    table: Table
    frames: list[Frame] = field(default_factory=list)
    nodes: list[NodeRecord] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    conditions: list[Condition] = field(default_factory=list)
    current: NodeRecord | None = None
    made_at: set[tuple[str, int]] = field(default_factory=set)
    executed: set[int] = field(default_factory=set)
    lost: dict[int, tuple[Call, Function]] = field(default_factory=dict)
    cut: list[Function] = field(default_factory=list)
    callbacks: list[Code] = field(default_factory=list)
    starting: bool = True
    in_callback: bool = False
    aliases: set[str] = field(default_factory=set)
    homeless: list[Place] = field(default_factory=list)
    later: set[int] = field(default_factory=set)
    searched: int = 0
    thrown: list[tuple[int, list[dict[str, Any]]]] | None = None
    tried: int = 0
    awaited: set[int] = field(default_factory=set)
    setters: dict[tuple[str, bool], dict[str, list[Function]]] = field(default_factory=dict)
    at_run_time: set[str] = field(default_factory=set)
    steps: int = 0
    modules: dict[str, dict[str, Any]] = field(default_factory=dict)
    constants: dict[Any, Any] = field(default_factory=dict)
    strays: dict[str, NodeRecord] = field(default_factory=dict)
    lineages: dict[int, list[Class]] = field(default_factory=dict)

    def step(self) -> None:
        """Count one step.

        Raises:
            TooMuchError: there were too many.
        """
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise TooMuchError

    @property
    def frame(self) -> Frame:
        """The innermost call."""
        return self.frames[-1]

    def place(self, written: Place) -> Place:
        """Return where a call stands; in a macro, where it is used."""
        for inner, outer in zip(reversed(self.frames), reversed(self.frames[:-1]), strict=False):
            if not inner.function.macro or outer.at is None:
                break
            written = outer.at
        return written

    def stray(self) -> NodeRecord:
        """Return what takes the endpoints of the function that the walk is in, whose node is not known."""
        functions = [each.function for each in reversed(self.frames)]
        named = next((each for each in functions if each.name != "lambda" and not each.macro), functions[0])
        name = (named.owner or named.name).strip(":")
        return self.strays.setdefault(name, NodeRecord(name, "", "", named.place))

    def tests(self) -> Tests:
        """Return the values of parameters with which the walk comes here."""
        return tuple(dict.fromkeys(test for each in self.conditions for test in each.tests))

    def tests_here(self) -> Tests | None:
        """Return the values of parameters with which the innermost call comes here; None where more decides it."""
        inner = self.conditions[self.frame.conditions :]
        return (
            None if any(each.perhaps or each.each for each in inner) else tuple(t for each in inner for t in each.tests)
        )

    def perhaps(self) -> str:
        """Return why it is not known whether the walk comes here."""
        return next((each.perhaps for each in self.conditions if each.perhaps), "")

    def branch(self) -> int:
        """Return which branch of one decision the walk is in; 0 where several are not known."""
        found = [each for each in self.conditions if each.perhaps]
        return found[0].branch if len(found) == 1 else 0

    def snapshot(self) -> list[dict[str, Any]]:
        """Return all values as they are."""
        names = [dict(each.names) for each in self.frames]
        return [*names, *(dict(each.members) for each in self.instances)]

    def restore(self, kept: list[dict[str, Any]]) -> None:
        """Set all values back; objects that were made since stay, and those that were there before as declared begin again."""
        count = len(self.frames)
        for frame, names in zip(self.frames, kept, strict=False):
            frame.names.clear()
            frame.names.update(names)
        begin = [each.begins for each in self.instances[len(kept) - count :]]
        for instance, members in zip(self.instances, (*kept[count:], *begin), strict=False):
            if members is not None:
                instance.members.clear()
                instance.members.update(members)

    def merge(self, other: list[dict[str, Any]], tests: Tests | None, cause: str, place: Place) -> None:
        """Join all values with those of the branch that was walked before, which is taken where ``tests`` hold."""
        count = len(self.frames)
        spaces: list[tuple[dict[str, Any], Instance | None]] = [
            *((each.names, None) for each in self.frames),
            *((each.members, each) for each in self.instances),
        ]
        begin = (each.begins for each in self.instances[len(other) - count :])
        for (space, owner), then in zip(spaces, (*other, *begin), strict=False):
            if then is None:
                continue
            for name in {**then, **space}:
                one, two = then.get(name, ABSENT), space.get(name, ABSENT)
                if one is two:
                    continue
                if owner is not None:
                    known = used(two if one is ABSENT else one)
                    one, two = (self._begin(owner, name, known) if each is ABSENT else each for each in (one, two))
                if ABSENT in (one, two):
                    known = two if one is ABSENT else one
                    made = isinstance(used(known), Instance) and not isinstance(known, Profile)
                    kept = made or self._needs_value(name, owner)
                    space[name] = known if kept else Unknown(cause, place)
                else:
                    space[name] = merged(tests, one, two, cause, place)

    def _begin(self, owner: Instance, name: str, known: Any) -> Any:
        """Return the value that its class gives a member, which a branch made to be ``known``; the mark for none where it gives none."""
        from cqos_ros2_sources.walk.expressions import initial_value

        if owner.declared.get(name) is not None:
            return owner.declared[name]
        if isinstance(known, (Instance, Code)) and not isinstance(known, Profile):
            if self._begins_empty(owner, name):
                return None
            if isinstance(known, Instance):
                return ABSENT
        value = initial_value(owner, name, self)
        return ABSENT if value is MISSING else value

    def _begins_empty(self, owner: Instance, name: str) -> bool:
        """Whether a member that may point to an object points to none at first."""
        classes = lineage(owner.cls, self)
        initial = next((each.initial[name] for each in classes if name in each.initial), None)
        if isinstance(initial, Call) and "{" in initial.types:  # `{}` or `{nullptr}`
            initial = initial.arguments[0] if initial.arguments else Literal(None)
        if initial is not None:
            return initial == Literal(None)
        return self.program.language == "cpp" and bool(classes)

    def _needs_value(self, name: str, owner: Instance | None) -> bool:
        """Whether a program ends where it uses a name before it has a value, as in Python."""
        classes = lineage(owner.cls, self) if owner is not None else ()
        return self.program.language == "python" and not any(name in each.initial for each in classes)


def lineage(cls: Class | None, walk: Walk) -> list[Class]:
    """Return a class and those that it is made from, in the program."""
    if cls is None:
        return []
    if id(cls) not in walk.lineages:
        waiting, found = [cls], walk.lineages.setdefault(id(cls), [])
        while waiting and len(found) <= _MOST_BASES:
            each = waiting.pop(0)
            if all(each is not known for known in found):
                found.append(each)
                waiting += bases_of(each, walk)
    return walk.lineages[id(cls)]


def bases_of(cls: Class, walk: Walk) -> Iterator[Class]:
    """Yield the classes that a class is made from, in the program."""
    for base in cls.bases:
        found = walk.program.find_class(base, cls.place.source, cls.name)
        if found is not None and (found.name == base or without_arguments(base) not in walk.table.nodes):
            yield found
