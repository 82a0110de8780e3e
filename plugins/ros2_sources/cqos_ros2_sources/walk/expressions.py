"""Evaluates expressions: to a value, or to an unknown value with its cause. `calls` follows the calls in them."""

from __future__ import annotations

import re
from dataclasses import replace as replaced
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.settings import Place
from cqos_ros2_sources.programs.names import fits, inner_type, last_part, points, refers, without_arguments
from cqos_ros2_sources.programs.program import (
    ADDRESS,
    POINTED,
    POINTS,
    THIS,
    Attribute,
    Call,
    Closure,
    Conditional,
    Element,
    Function,
    Items,
    Literal,
    Name,
    NotFollowed,
    Operation,
    Pairs,
    Reference,
)
from cqos_ros2_sources.walk.cpp_copies import copied, is_quality, type_of_name
from cqos_ros2_sources.walk.frames import Frame, lineage
from cqos_ros2_sources.walk.operators import element, operation, truth
from cqos_ros2_sources.walk.other_writers import changed_in, set_elsewhere
from cqos_ros2_sources.walk.profiles import (
    change,
    content,
    forget,
    held,
    is_profile,
    once,
    profile,
    reached,
    replace,
    undecided,
)
from cqos_ros2_sources.walk.qualities import FIELDS, changed, policy_of, preset
from cqos_ros2_sources.walk.spin_calls import note_value
from cqos_ros2_sources.walk.values import (
    MISSING,
    NO_POSITION,
    PLAIN,
    Code,
    Condition,
    Either,
    Instance,
    Profile,
    Qos,
    Template,
    Undecided,
    Word,
    each_case,
    joined,
    merged,
    same,
    used,
)
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from cqos_ros2_sources.programs.program import Class, Expression
    from cqos_ros2_sources.walk.frames import Walk

_MISSING: Final = object()
_PAIR: Final = ("first", "second")
_GETTERS: Final = frozenset(("property", "cached_property"))
PARTS: Final = re.compile("[<>,]")
"""What stands between the parts of a type."""


def evaluate(expression: Expression, walk: Walk) -> Any:
    """Return the value of an expression where it is used."""
    return used(whole(expression, walk))


def whole(expression: Expression, walk: Walk) -> Any:
    """Return the value of an expression, with what decides whether an object is there."""
    walk.step()
    if isinstance(expression, Literal):
        text = expression.value
        return Unknown("a text with `${`") if isinstance(text, str) and "${" in text else text
    if isinstance(expression, Name):
        return _name(expression.text, walk)
    if isinstance(expression, Call):
        from cqos_ros2_sources.walk.calls import call

        return call(expression, walk)
    if isinstance(expression, Attribute):
        return _attribute(expression, walk)
    if isinstance(expression, Operation):
        return _operation(expression, walk)
    if isinstance(expression, Conditional):
        return _conditional(expression, walk)
    return _composed(expression, walk)


def _composed(expression: Expression, walk: Walk) -> Any:
    if isinstance(expression, Items):
        items = [copied(evaluate(each, walk), "auto", walk, written=each) for each in expression.items]
        if walk.program.language == "cpp":
            from cqos_ros2_sources.walk.emplaced_objects import note_braces

            note_braces(items, walk)
        return items
    if isinstance(expression, Pairs):
        pairs = [(evaluate(key, walk), evaluate(value, walk)) for key, value in expression.items]
        plain = all(isinstance(key, (str, int)) for key, _ in pairs)
        return dict(pairs) if plain else undecided(Unknown("a dictionary"), *(value for _, value in pairs))
    if isinstance(expression, Closure):
        return _closure(expression, walk)
    if isinstance(expression, Reference):
        return _reference(expression, walk)
    if isinstance(expression, Element):
        of = evaluate(expression.of, walk)
        key = evaluate(expression.key, walk)
        if isinstance(of, Instance) and isinstance(key, int) and walk.program.language == "cpp":  # `auto & [a, b] = it`
            fields = [name for each in lineage(of.cls, walk) for name in each.fields]
            return member(of, fields[key], walk) if key < len(fields) else undecided(element(of, key), *reached(of))
        if isinstance(of, Word) and isinstance(key, str):  # an enumeration of Python
            return shared_preset(f"{of.name}.{key}", walk) or of
        return undecided(element(of, key), *(reached(of) if isinstance(of, Instance) else (of,)))
    if isinstance(expression, NotFollowed):
        values = [evaluate(each, walk) for each in expression.parts]
        unknown = Unknown(f"`{expression.text}` is not followed" if expression.text else "it is not followed")
        return undecided(unknown, *values)
    return Unknown("it is not followed")


def _closure(expression: Closure, walk: Walk) -> Code:
    frame = walk.frame
    around = frame.outer or {}
    held = {**around, **frame.names} if expression.all_values else {}
    held = {name: copied(value, "auto", walk) for name, value in held.items() if name not in expression.references}
    own = {**{name: value for name, value in around.items() if name not in frame.names}, **held}
    own.update({name: copied(whole(value, walk), "auto", walk, written=value) for name, value in expression.values})
    return Code(expression.function, frame.this, frame.names, own)


def _reference(expression: Reference, walk: Walk) -> Any:
    from cqos_ros2_sources.walk.functions import method_of

    name, this = expression.name, walk.frame.this
    found = method_of(this.cls, last_part(name), walk) if this is not None and this.cls is not None else []
    found = found or walk.program.find_functions(name)
    value = Code(found[0], this) if len(found) == 1 else Unknown(f"`{name[:60]}` is not one function")
    value = known if not found and isinstance(known := used(local(name, walk)), Code) else value
    note_value(name, value, walk)
    given = [copied(whole(each, walk), "auto", walk, written=each) for each in expression.bound]
    if given and isinstance(value, Code):
        object_first = value.function.owner and not value.function.static
        return with_arguments(value, given[1:] if object_first else given, {})
    forget(given, f"`{name[:60]}` may change it")
    return value


def with_arguments(code: Code, given: Sequence[Any], named: Mapping[str, Any]) -> Code:
    """Return a function with arguments that it is called with."""
    return replaced(code, given=(*code.given, *given), named={**code.named, **named})


# Names and members


def _name(text: str, walk: Walk) -> Any:
    if text == THIS:
        return walk.frame.this if walk.frame.this is not None else Unknown("there is no object")
    found = local(text, walk)
    if found is not _MISSING:
        return found
    this = walk.frame.this
    if walk.program.language == "cpp" and this is not None and this.cls is not None:
        found = member(this, text, walk)
        if found is not _MISSING:
            return found
    return _constant(text, walk)


def local(text: str, walk: Walk) -> Any:
    """Return the value of a local name; a mark that is no value for any other."""
    frame = walk.frame
    if text in frame.names:
        return frame.names[text]
    if frame.outer is not None and text in frame.outer:
        return frame.outer[text]
    for module, names in walk.modules.items():
        if text in names and frame.function.name.startswith(f"{module}."):
            return names[text]
    return _MISSING


def is_missing(value: Any) -> bool:
    """Whether `local` or `member` found nothing."""
    return value is _MISSING


def member(instance: Instance, name: str, walk: Walk) -> Any:
    """Return the value of a member; a mark that is no value where the class has none."""
    value = instance.members.get(name, _MISSING)
    if value is not _MISSING and not isinstance(value, PLAIN):
        return value
    other = "" if walk.starting else set_elsewhere(instance, name, walk)
    if value is not _MISSING:
        return Unknown(other) if other else value
    for cls in lineage(instance.cls, walk):
        if name in cls.initial:
            if other:
                return Unknown(other)
            instance.members[name] = value = _initial_once(cls, name, instance, walk)
            return value
        if name in cls.fields:
            made = None if other else _declared_once(instance, cls, name, walk)
            if made is not None:
                instance.members[name] = made
                return made
            return Unknown(other or f"`{name}` has no value before it is used")
    return _MISSING


def _declared_once(instance: Instance, cls: Class, name: str, walk: Walk) -> Any:
    """Return what a member is without a value: one object in all branches, as long as the walk keeps it."""
    return once(instance.declared, name, lambda: _declared_member(cls, name, walk), walk)


def _declared_member(cls: Class, name: str, walk: Walk) -> Any:
    """Return what a member is without a value in its class: a constant that is defined outside, or an object of a library; else None."""
    stated = [value for full, value, _ in walk.program.constants.get(name, []) if full == f"{cls.name}::{name}"]
    if len(stated) == 1:
        return evaluate(stated[0], walk)
    written = cls.fields[name]
    if written.endswith(("*", "&")) or inner_type(written) != written:
        return None
    plain = without_arguments(written)
    plain = without_arguments(walk.program.aliases.get(last_part(plain), plain))
    known = walk.table.is_class(plain) or walk.table.lookup(walk.table.objects, plain) is not None
    own = walk.program.language == "cpp" and walk.program.find_class(written, cls.place.source, cls.name) is not None
    if not own and not known:
        return None
    return evaluate(Call(Name(written), (), (), (), cls.place), walk)


def initial_value(instance: Instance, name: str, walk: Walk) -> Any:
    """Return the value that its class gives a member; the mark for none where it gives none."""
    cls = next((each for each in lineage(instance.cls, walk) if name in each.initial), None)
    return MISSING if cls is None else _initial_once(cls, name, instance, walk)


def _initial_once(cls: Class, name: str, instance: Instance, walk: Walk) -> Any:
    """Return the value that a class gives a member: a quality of service is one object of the object, in Python of the class."""
    of_class = walk.program.language == "python"
    kept: dict[Any, Any] = walk.constants if of_class else instance.declared
    key = id(cls.initial[name]) if of_class else name
    made = once(kept, key, lambda: _initial(cls, name, instance, walk), walk)
    if not isinstance(made, Profile):
        del kept[key]
    return made


def _initial(cls: Class, name: str, instance: Instance, walk: Walk) -> Any:
    function = next(iter(walk.program.functions.get(last_part(cls.name), [])), None) or walk.frame.function
    walk.frames.append(Frame(function, instance, types=instance.types))
    try:
        return evaluate(cls.initial[name], walk)
    finally:
        walk.frames.pop()


def _constant(text: str, walk: Walk) -> Any:
    """Return the value of a constant of the program, else the name itself."""
    program, last = walk.program, last_part(text)
    of, around = text.rpartition("::")[0] or text.rpartition(".")[0], walk.frame.function
    of = walk.frame.types.get(of, of)
    cls = program.find_class(of, around.place.source, around.name) if last != text else None
    if cls is not None and last in cls.initial:
        return _initial_once(cls, last, Instance(cls), walk)
    stated = []
    for name, value, file in program.constants.get(last, []):
        # A function inside another one has no module in its name.
        fitting = (
            file == around.place.source or around.name.startswith(f"{name.rpartition('.')[0]}.")
            if program.language == "python" and text == last
            else fits(name, text)
        )
        if fitting:
            stated.append((file, value))
    if not stated:
        if last == "npos":
            return NO_POSITION
        found = shared_preset(text, walk) or _function(text, walk) or Word(text)
        note_value(text, found, walk)
        return found
    here = walk.frame.function.place.source
    own = [each for each in stated if each[0] == here] or stated
    if walk.program.assigned(last):
        return Unknown(f"`{text[:60]}` is set several times")
    walk.step()
    if len(own) == 1:
        (file, value), first = own[0], id(own[0][1])
        made = once(walk.constants, first, lambda: _stated(value, file, last, walk), walk)
        if not isinstance(made, Instance):
            del walk.constants[first]
        full = next(name for name, written, _ in program.constants[last] if written is value)
        by = changed_in(full, file, walk) if is_profile(made) else None
        if by is not None:
            forget(made, f"`{by.last}` may change `{text[:60]}`", by.place)
        return made
    values = [_stated(value, file, last, walk) for file, value in own]
    if all(same(content(each), content(values[0])) for each in values):
        return values[0]
    return undecided(Unknown(f"`{text[:60]}` has several values"), values)


def made_once(written: Expression, make: Callable[[], Any], walk: Walk) -> Any:
    """Return what is made of an expression: a quality of service is one object, however often the walk comes there."""
    made = once(walk.constants, id(written), make, walk)
    if not isinstance(made, Profile):
        del walk.constants[id(written)]
    return made


def shared_preset(name: str, walk: Walk) -> Any:
    """Return the preset that a name of a library means: in Python, one object for all that use it; None where it means none."""
    found = preset(name, walk)
    if found is None or walk.program.language == "cpp":
        return None if found is None else profile(found, walk)
    return once(walk.constants, found.preset, lambda: profile(found, walk), walk)


def _stated(value: Expression, file: str, name: str, walk: Walk) -> Any:
    """Return the value of a constant; names in it mean those of its own file first."""
    if _mentions(value, name):
        return Unknown("it is made from itself")
    if walk.program.language != "cpp" or file == walk.frame.function.place.source:
        return evaluate(value, walk)
    walk.frames.append(Frame(Function("", (), (), Place(file)), None))
    try:
        return evaluate(value, walk)
    finally:
        walk.frames.pop()


def _function(text: str, walk: Walk) -> Code | None:
    """Return the function that a name means as a value."""
    from cqos_ros2_sources.walk.functions import near

    found = near(text, walk)
    return Code(found[0], None) if len(found) == 1 and not found[0].owner else None


def _mentions(expression: Expression, name: str) -> bool:
    return isinstance(expression, Name) and last_part(expression.text) == name


def _attribute(expression: Attribute, walk: Walk) -> Any:
    found = each_case(evaluate(expression.of, walk), lambda of: _member_of(of, expression, walk))
    note_value(expression.name, found, walk)
    other = elsewhere(expression.of, expression.name, walk) if isinstance(found, PLAIN) else ""
    return Unknown(other) if other else found


def elsewhere(of: Expression | None, name: str, walk: Walk) -> str:
    """Return why a member of a structure that is a member may have another value than the walk saw; empty where it cannot."""
    this = walk.frame.this
    root = of.text if isinstance(of, Name) else of.name if isinstance(of, Attribute) and of.of == Name(THIS) else ""
    if not root or this is None or walk.starting or not is_missing(local(root, walk)):
        return ""
    return set_elsewhere(this, f"{root}.{name}", walk)


def _bound(of: Instance, name: str, walk: Walk) -> Code | None:
    """Return a method of a library that the tables have, bound to a node as Python does; None where it is none.

    What it creates is not known until a call of it is followed.
    """
    from cqos_ros2_sources.walk.endpoint_calls import library_of

    if walk.program.language != "python" or of.node is None:
        return None
    calls, parameters = (
        walk.table.rows(kind, name, library_of(of, walk), method=True) for kind in ("calls", "parameters")
    )
    place = walk.frame.at or walk.frame.function.place
    if any("makes" in row.values for row in calls):
        of.node.gaps.setdefault(kept_method(name, place), place)
    return Code(Function(name, (), (), place), of, library=name) if calls or parameters else None


def kept_method(name: str, place: Place) -> tuple[str, str]:
    """Return how a node names what a method creates that it keeps as a value."""
    return f"what `{name}` creates, kept in or after line {place.line}", "C-QoS found nothing that calls it"


def _member_of(of: Any, expression: Attribute, walk: Walk) -> Any:
    if is_profile(of):
        return _of_profile(of, expression.name, walk)
    if isinstance(of, Instance) and expression.name == "__dict__":
        forget(reached(of), "`__dict__` may change it")
    if isinstance(of, Instance) and of.cls is not None and expression.name == "__class__":
        return Word(of.cls.name)
    if isinstance(of, Instance):
        return _member_of_object(of, expression, walk)
    if isinstance(of, Word):
        return (
            _constant(f"{of.name}.{expression.name}", walk)
            if walk.program.language == "python"
            else Word(f"{of.name}.{expression.name}")
        )
    if isinstance(of, list) and len(of) == len(_PAIR) and expression.name in _PAIR:
        return of[_PAIR.index(expression.name)]
    if walk.table.is_same(expression.name):
        return of
    if isinstance(of, Undecided) and expression.name in FIELDS:
        return Unknown(of.cause, of.place)
    return of if isinstance(of, Unknown) else Unknown(f"`{expression.name}` is not known")


def _member_of_object(of: Instance, expression: Attribute, walk: Walk) -> Any:
    """Return a member, what a property returns, or a method as a value."""
    found = member(of, expression.name, walk) if of.cls is not None else of.members.get(expression.name, _MISSING)
    if found is not _MISSING:
        return found
    from cqos_ros2_sources.walk.functions import method_of

    methods = method_of(of.cls, expression.name, walk) if of.cls is not None else []
    getters = [each for each in methods if {*map(last_part, each.decorators)} & _GETTERS]
    if len(getters) == 1:
        from cqos_ros2_sources.walk.calls import invoke

        return invoke(getters[0], of, [], {}, walk)
    if len(methods) == 1:
        return Code(methods[0], of)
    return _bound(of, expression.name, walk) or Unknown(f"`{expression.name}` is not known")


def _of_profile(of: Any, name: str, walk: Walk) -> Any:
    """Return a policy of a quality of service."""
    if walk.table.is_same(name):
        return of
    if name == "__dict__":
        forget(of, "`__dict__` may change it")
    found = each_case(content(of), lambda qos: policy_of(qos, name) if isinstance(qos, Qos) else _unknown(qos, name))
    return found if name in FIELDS else undecided(found, of)  # a method of it may change it


def _unknown(value: Any, name: str) -> Unknown:
    return value if isinstance(value, Unknown) else Unknown(f"`{name[:60]}` is not known")


def assign(target: Expression, value: Any, walk: Walk) -> None:
    """Give a name or member a value; what cannot be followed is left alone."""
    if walk.program.language == "cpp" and _set_in_place(target, value, walk):
        return
    if isinstance(target, Name):
        _assign_name(target, value, walk)
    elif isinstance(target, Attribute):
        _assign_attribute(target, value, walk)
    elif isinstance(target, Element):
        _assign_element(target, value, walk)


def _assign_name(target: Name, value: Any, walk: Walk) -> None:
    frame = walk.frame
    if target.text in frame.names:
        frame.names[target.text] = value
        if target.text in frame.aliases:
            other, pointer = frame.aliases[target.text]
            if pointer and is_profile(value):  # it points to another one
                del frame.aliases[target.text]
            else:
                assign(other, Unknown("it is set over a pointer") if pointer else value, walk)
    elif frame.outer is not None and target.text in frame.outer and walk.program.language == "cpp":
        frame.outer[target.text] = value
    elif walk.program.language == "cpp" and frame.this is not None and _declares(frame.this, target.text, walk):
        frame.this.members[target.text] = value
    else:
        frame.names[target.text] = value


def _assign_attribute(target: Attribute, value: Any, walk: Walk) -> None:
    of = _carrier(target.of, walk) or evaluate(target.of, walk)
    if isinstance(used(value), Code) and (not isinstance(of, Instance) or of.cls is None):
        walk.callbacks.append(used(value))  # a library calls what its structure holds
    if is_profile(of) or isinstance(of, Undecided):
        cause = f"`{target.name[:60]}` of one of several qualities of service is set"
        change(of, lambda qos: changed(qos, target.name, value), cause)
    elif isinstance(of, Either):
        replace_value(target.of, of, each_case(of, lambda qos: changed(qos, target.name, value)), walk)
    elif isinstance(of, Instance):
        _assign_member(of, target, value, walk)
    elif isinstance(of, Word):
        forget(value, f"`{of.name[:60]}` may change it")
        walk.frame.names[f"{of.name}.{target.name}"] = value
    elif isinstance(target.of, Attribute):  # `profile.deadline.sec = 1`
        whole_of, policy = evaluate(target.of.of, walk), target.of.name
        if is_profile(whole_of):
            parts = Unknown("its parts are set one by one")
            change(whole_of, lambda qos: changed(qos, policy, parts), parts.cause)


def _assign_member(of: Instance, target: Attribute, value: Any, walk: Walk) -> None:
    setters = _setters(of, target.name, walk)
    if len(setters) == 1:
        from cqos_ros2_sources.walk.calls import invoke

        invoke(setters[0], of, [value], {}, walk)
        return
    now = of.members.get(target.name)
    if walk.program.language == "cpp" and is_profile(now) and not points(type_of_name(target, walk)):
        replace(now, value)
    else:
        of.members[target.name] = value


def _setters(of: Instance, name: str, walk: Walk) -> list[Function]:
    """Return the methods of Python that an assignment to a member calls."""
    from cqos_ros2_sources.walk.functions import method_of

    known = method_of(of.cls, name, walk) if of.cls is not None and walk.program.language == "python" else ()
    return [each for each in known if f"{name}.setter" in each.decorators]


def _assign_element(target: Element, value: Any, walk: Walk) -> None:
    if target.key == POINTED:
        alias = walk.frame.aliases.get(target.of.text) if isinstance(target.of, Name) else None
        assign(target.of, value, walk) if alias is None else assign(alias[0], Unknown("it is set over a pointer"), walk)
        return
    parts = value if not _may_hold(target.of, walk) else [evaluate(target.of, walk), value]
    unknown = undecided(Unknown("its elements are set one by one"), parts)
    if walk.program.language == "cpp":
        assign(target.of, unknown, walk)
    else:
        replace_value(target.of, evaluate(target.of, walk), unknown, walk)


def _set_in_place(target: Expression, value: Any, walk: Walk) -> bool:
    """Give a quality of service of C++ other policies where a name, member or element has one: what refers to it sees that."""
    if isinstance(target, Attribute) or not _may_hold(target, walk):
        return False
    found = evaluate(target.of if isinstance(target, Element) and target.key == POINTED else target, walk)
    if isinstance(found, Undecided) and not is_profile(found):
        forget(found, "an element of a list is set")
    if not is_profile(found) or (isinstance(target, Name) and points(type_of_name(target, walk))):
        return False
    replace(found, value)
    return True


def _may_hold(target: Expression, walk: Walk) -> bool:
    """Whether what is written may mean a quality of service, as far as the name at its beginning tells; nothing is walked for it."""
    inside = False
    while not isinstance(target, Name):
        if isinstance(target, Call) and isinstance(target.function, Name):
            found = walk.program.functions.get(last_part(target.function.text), ())
            return any(refers(each.returns) and is_quality(each.returns, walk) for each in found)
        inside = inside or isinstance(target, Attribute)
        target = target.function if isinstance(target, Call) else getattr(target, "of", Name(""))
    frame = walk.frame
    value = local(target.text, walk)
    if is_missing(value) and frame.this is not None:
        value = frame.this if target.text == THIS else frame.this.members.get(target.text)
        classes = lineage(frame.this.cls, walk) if value is None else ()
        written = next((each.fields[target.text] for each in classes if target.text in each.fields), "")
        if any(is_quality(part, walk) for part in PARTS.split(written)) or (inside and written):
            return True
    value = used(value)
    return any(True for _ in held(value)) or (inside and isinstance(value, Instance))


def _carrier(target: Expression, walk: Walk) -> Instance | None:
    """Return the structure in a structure that `a.b.c = 1` sets a member of; None where it is none."""
    if not isinstance(target, Attribute) or not walk.table.objects:
        return None
    of = _carrier(target.of, walk) or evaluate(target.of, walk)
    if isinstance(of, Instance) and (of.library in walk.table.objects or of.library == "#"):
        from cqos_ros2_sources.walk.client_rows import inner

        return inner(of, target.name, walk)
    return None


def _declares(instance: Instance, name: str, walk: Walk) -> bool:
    return name in instance.members or any(name in cls.fields for cls in lineage(instance.cls, walk))


def replace_value(target: Expression, old: Any, new: Any, walk: Walk) -> None:
    """Give a changed value to what holds it; in Python, to everything that holds the same object."""
    assign(target, new, walk)
    if walk.program.language == "python" and not isinstance(old, str):
        for space in (*(each.names for each in walk.frames), *(each.members for each in walk.instances)):
            for name, value in space.items():
                if value is old:
                    space[name] = new


# Operators


def _operation(expression: Operation, walk: Walk) -> Any:
    values = [whole(each, walk) for each in expression.operands]
    if expression.operator in {ADDRESS, POINTS} and len(values) == 1:
        return values[0]
    root = expression.operands[0]
    if expression.operator == ">>" and not isinstance(values[0], int):  # from a stream
        assign(expression.operands[1], Unknown("a stream sets it"), walk)
    if expression.operator != "<<" or not isinstance(values[0], (str, Template)):
        found = operation(expression.operator, values)
        either = expression.operator == "or" and any(map(is_profile, values))  # `qos or QoSProfile(depth=1)`
        decided = truth(values[0]) if either else None
        if isinstance(decided, bool):
            return values[0] if decided else values[1]
        return undecided(Unknown("one of several values") if either else found, values)
    written = joined(values)  # to a stream of text
    while isinstance(root, Operation) and root.operator == "<<":
        root = root.operands[0]
    assign(root, written, walk)
    return written


def _conditional(expression: Conditional, walk: Walk) -> Any:
    decided = truth(whole(expression.condition, walk))
    if decided is True or decided is False:
        return whole(expression.then if decided else expression.otherwise, walk)
    then, otherwise = whole(expression.then, walk), whole(expression.otherwise, walk)
    tests = decided.tests if isinstance(decided, Condition) else None
    cause = decided.cause if isinstance(decided, Unknown) else "it depends on a condition"
    return merged(tests, then, otherwise, cause, walk.frame.function.place)
