"""Effects of calls that are not followed on their arguments: a later call of them, or a change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import last_part, without_arguments
from cqos_ros2_sources.programs.program import Attribute, Call, Element, Name, Reference, call_name
from cqos_ros2_sources.walk.expressions import assign, evaluate, replace_value
from cqos_ros2_sources.walk.frames import DEEPEST_CALL, Condition, TooMuchError, lineage
from cqos_ros2_sources.walk.other_writers import STARTS, forget_members, kept_for_later
from cqos_ros2_sources.walk.profiles import content, forget, is_profile, reached, undecided
from cqos_ros2_sources.walk.trial_snapshot import Start, make_members, prepare
from cqos_ros2_sources.walk.values import Code, Either, Instance, NodeRecord, Profile, Template, Undecided, same
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.model.settings import Place
    from cqos_ros2_sources.programs.program import Class, Expression, Variable
    from cqos_ros2_sources.walk.frames import Walk

_CHANGING: Final = (str, int, float, Template, Profile, list, Either)
_HANDED: Final = "it is handed the node, and its definition was not read"
_PARTS_WITHOUT_ENDPOINTS: Final = frozenset(
    f"get_node_{part}_interface"
    for part in ("base", "clock", "graph", "logging", "parameters", "timers", "time_source")
)
"""Parts of a node with which nothing creates an endpoint; with those for waitables, an action."""


def note_nodes(name: str, expression: Call, values: Sequence[Any], walk: Walk) -> None:
    """Note that something which was not read is handed a node: it may create endpoints there."""
    if walk.table.is_listed("without_endpoints", name):
        return
    written = expression.arguments
    for index, value in enumerate(values):
        node = _node_of(value, walk)
        bound = 0 < index < len(written) and isinstance(written[index - 1], Reference)
        given = written[index] if index < len(written) else None
        part = call_name(given) if isinstance(given, Call) else ""
        if node is not None and not bound and last_part(part) not in _PARTS_WITHOUT_ENDPOINTS:
            node.gaps.setdefault(
                (f"what `{without_arguments(name)[:80]}` creates", _HANDED), walk.place(expression.place)
            )


def _node_of(value: Any, walk: Walk) -> NodeRecord | None:
    """Return the node that a value is, or that its methods create something on; None for any other."""
    if not isinstance(value, Instance):
        return None
    node = value.node
    if node is None and value.library and walk.table.hands_on(value.library):
        node = value.members.get("#node")
    return node if isinstance(node, NodeRecord) and not node.protocol else None


def hand_over(expression: Call, arguments: Sequence[Any], keywords: Mapping[str, Any], walk: Walk) -> None:
    """Note callbacks that a library is handed, and values that it may change."""
    name = call_name(expression)
    kept_for_later((*arguments, *keywords.values()), expression, walk)
    note_nodes(name, expression, (*arguments, *keywords.values()), walk)
    later = name in walk.table.lists["at_run_time"]
    for each in (*arguments, *keywords.values()):
        if isinstance(each, Code):
            if later:
                walk.executed.add(id(each.function))
                walk.at_run_time.add(each.function.last)
            else:
                walk.callbacks.append(each)
    if name == "setattr":
        _set_by_name(expression, arguments, walk)
        return
    values = (*arguments, *keywords.values())
    if last_part(name) in walk.table.lists["changing"]:
        holders = [each for each in values if not isinstance(each, Code)]
        open_objects(holders, f"`{name[:60]}` may change it", expression.place, walk)
        for written in expression.arguments:
            _change(written, expression, walk)
    if not walk.table.is_listed("harmless", name):
        if walk.program.language == "cpp":
            _open(expression, name, arguments, walk)
        else:
            _open_lists(expression, name, arguments, walk)
    open_to(name, expression, values, walk)


def open_to(name: str, expression: Call, values: Sequence[Any], walk: Walk) -> None:
    """Take qualities of service as not known that code which was not read may change: those it is handed, alone or in objects, and those that functions change which it may call."""
    cause, place, last = f"`{name[:60]}` may change it", expression.place, last_part(name)
    of_quality = any(name.startswith(f"{each}.") for each in walk.table.makers)  # `QoSProfile.depth.fset(qos, 7)`
    calling, harmless = walk.table.is_listed("calling", name), walk.table.is_listed("harmless", name) and not of_quality
    if walk.table.is_listed("anything", name):
        prepare(walk)
        forget(reached(*walk.instances), cause, place)
    codes = [each for each in values if isinstance(each, Code)]
    if calling or (
        codes and not harmless and not last.startswith(STARTS) and name not in walk.table.lists["at_run_time"]
    ):
        handed = undecided(Unknown("what it is handed"), *values)
        for each in codes:
            forget(_changed_by(each, handed, walk), cause, place)
    if calling:
        open_objects(() if codes else values, cause, place, walk)
    elif not harmless and walk.program.language == "python":
        forget(values, cause, place)
        if not walk.table.is_listed("without_endpoints", name):
            open_objects([each for each in values if not isinstance(each, Code)], cause, place, walk)


def open_receiver(receiver: Any, name: str, place: Place, walk: Walk) -> None:
    """Take the qualities of service as not known that an object holds whose method was not read."""
    if not isinstance(receiver, Instance) or isinstance(receiver, Profile) or walk.table.is_listed("harmless", name):
        return
    of_library = receiver.cls is None and receiver.node is None
    cause = f"`{name[:60]}` may change it"
    unread = walk.program.language == "python" and unread_bases(receiver.cls, walk)
    if of_library or (unread and not _is_of_node(receiver.cls, name, walk)):
        open_objects([receiver], cause, place, walk)


def _is_of_node(cls: Class | None, name: str, walk: Walk) -> bool:
    """Whether a method is one of a node, which stands before all bases that were not read, so that these do not replace it."""
    if not walk.table.is_listed("of_node", name):
        return False
    for each in lineage(cls, walk):
        unread = unread_bases(each, walk)
        before = next((base for base in each.bases if base in unread or walk.table.node_class(base) is not None), "")
        if before in unread:
            return False
    return True


def unread_bases(cls: Class | None, walk: Walk) -> list[str]:
    """Return the classes that a class of Python is made from and that were not read, apart from those of nodes."""
    names = [(name, each) for each in lineage(cls, walk) for name in each.bases]
    return [
        name
        for name, each in names
        if not walk.table.is_listed("bases", name)
        and walk.table.node_class(name) is None
        and walk.program.find_class(name, each.place.source, each.name) is None
    ]


def open_objects(values: Sequence[Any], cause: str, place: Place, walk: Walk) -> None:
    """Take the qualities of service as not known that values are or hold, in lists and objects."""
    for each in values:
        if isinstance(each, Instance) and each.cls is not None:
            prepare(walk) if walk.program.language == "python" else make_members(each, walk)
    forget(reached(*values), cause, place)


def _changed_by(code: Code, handed: Any, walk: Walk) -> list[Profile]:
    """Return the qualities of service that a function changes where it is called; the walk of it leaves nothing else behind."""
    from cqos_ros2_sources.walk.calls import invoke

    prepare(walk)
    start, kept, thrown, steps = Start(walk), walk.snapshot(), walk.thrown, walk.steps
    frames = len(walk.frames)
    sets = [(each, {*each}) for each in (walk.executed, walk.made_at, walk.awaited, walk.at_run_time)]
    lost, cut, before = dict(walk.lost), [*walk.cut], [(each, content(each)) for each in reached(*walk.instances)]
    walk.conditions.append(Condition(perhaps=f"it is made in a function in line {code.function.place.line}"))
    walk.thrown = None
    walk.tried += 1
    depth, too_much = len(walk.conditions), len(walk.frames) > DEEPEST_CALL
    try:
        invoke(code.function, code.this, [handed for _ in code.function.parameters], {}, walk, value=code)
    except TooMuchError:
        too_much = True
    found = [each for each, old in before if too_much or not same(old, content(each))]
    walk.tried -= 1
    del walk.conditions[depth - 1 :], walk.frames[frames:]
    spent = walk.steps
    start.restore(walk)
    walk.restore(kept)
    walk.steps = spent if walk.tried else steps  # one in another counts: else they take no end
    for each, old in sets:
        each.intersection_update(old)
    walk.lost, walk.cut, walk.thrown = lost, cut, thrown
    return found


def _open(expression: Call, name: str, arguments: Sequence[Any], walk: Walk) -> None:
    """Take what a function of C++ may change as not known."""
    known = [*walk.program.find_functions(name), *walk.program.functions.get(name, [])]
    for index, (written, value) in enumerate(zip(expression.arguments, arguments, strict=True)):
        if known and not any(_changes(each) for one in known for each in one.parameters[index : index + 1]):
            continue
        if not (isinstance(written, Name) and written.text.isupper()):
            forget(value, f"`{name[:60]}` may change it", expression.place)
        if not isinstance(written, (Name, Attribute)) or (isinstance(written, Name) and written.text.isupper()):
            continue
        cause = f"`{name[:60]}` may change it"
        if isinstance(value, _CHANGING):
            assign(written, Unknown(cause, expression.place), walk)
        elif isinstance(value, Instance) and value.cls is not None and value.node is None:
            open_objects([value], cause, expression.place, walk)
            forget_members(value, cause, walk)
        elif isinstance(value, Instance) and walk.table.lookup(walk.table.objects, value.library) is not None:
            value.members.clear()
            value.members["*"] = Unknown(cause, expression.place)


def _changes(variable: Variable) -> bool:
    """Whether a function may change what it is given for a parameter."""
    return variable.by_reference or variable.type.endswith("*")


def _open_lists(expression: Call, name: str, arguments: Sequence[Any], walk: Walk) -> None:
    """Take lists and dictionaries as not known that a function of Python may change."""
    for written, value in zip(expression.arguments, arguments, strict=False):
        if isinstance(written, (Name, Attribute)) and isinstance(value, (list, dict)):
            replace_value(written, value, Unknown(f"`{name[:60]}` may change it", expression.place), walk)


def _set_by_name(expression: Call, arguments: Sequence[Any], walk: Walk) -> None:
    """Follow `setattr` of Python."""
    if len(arguments) > 2 and (isinstance(arguments[0], (Instance, Either, Undecided))):  # noqa: PLR2004 - object, name, value
        if isinstance(arguments[1], str):
            assign(Attribute(expression.arguments[0], arguments[1]), arguments[2], walk)
        elif is_profile(arguments[0]) or not isinstance(arguments[0], Instance):
            forget(arguments[0], "`setattr` may set it", expression.place)
        else:
            forget_members(arguments[0], "`setattr` may set it", walk)


def _change(written: Expression, by: Call, walk: Walk) -> None:
    """Take what a call is handed, or an iterator of it, as not known."""
    if isinstance(written, Call) and isinstance(written.function, Attribute):
        written = written.function.of
    value = evaluate(written, walk) if isinstance(written, (Name, Attribute, Element)) else None
    cause = f"`{call_name(by)[:60]}` may change it"
    forget(value, cause, by.place)
    if isinstance(written, (Name, Attribute)) and isinstance(value, _CHANGING):
        assign(written, Unknown(cause, by.place), walk)
