"""Evaluates expressions: to a value, or to what is not known with its cause. What an expression calls is followed by `calling`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2.launch.values import Unknown
from cqos_ros2.learn.program import (
    THIS,
    Attribute,
    Call,
    Closure,
    Conditional,
    Element,
    Items,
    Literal,
    Name,
    NotFollowed,
    Operation,
    Pairs,
    Parts,
    Reference,
    assignments,
    calls_in,
    inner_type,
    last_part,
    without_arguments,
)
from cqos_ros2.learn.qualities import OF_PRESET
from cqos_ros2.learn.values import (
    Code,
    Condition,
    Either,
    Instance,
    Qos,
    Template,
    Test,
    Word,
    each_case,
    flipped,
    joined,
    merged,
    same,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_ros2.learn.frames import Walk
    from cqos_ros2.learn.program import Class, Expression, Function

_MISSING: Final = object()
_DEEPEST: Final = 12
_PLAIN: Final = (str, int, float, bool, Template, Qos, list, dict, Either, type(None))


def evaluate(expression: Expression, walk: Walk) -> Any:
    """Return the value of an expression."""
    walk.step()
    if isinstance(expression, Literal):
        text = expression.value
        return Unknown("a text with `${`") if isinstance(text, str) and "${" in text else text
    if isinstance(expression, Name):
        return _name(expression.text, walk)
    if isinstance(expression, Call):
        from cqos_ros2.learn.calling import call

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
        return [evaluate(each, walk) for each in expression.items]
    if isinstance(expression, Pairs):
        pairs = [(evaluate(key, walk), evaluate(value, walk)) for key, value in expression.items]
        return dict(pairs) if all(isinstance(key, (str, int)) for key, _ in pairs) else Unknown("a dictionary")
    if isinstance(expression, Parts):
        return joined([evaluate(each, walk) for each in expression.parts])
    if isinstance(expression, Closure):
        return Code(expression.function, walk.frame.this, walk.frame.names)
    if isinstance(expression, Reference):
        return _reference(expression.name, walk)
    if isinstance(expression, Element):
        of, key = evaluate(expression.of, walk), evaluate(expression.key, walk)
        if isinstance(of, list) and isinstance(key, int) and -len(of) <= key < len(of):
            return of[key]
        if isinstance(of, dict) and isinstance(key, (str, int)) and key in of:
            return of[key]
        return of if isinstance(of, Word) else Unknown("an element of a list that is not known")
    if isinstance(expression, NotFollowed):
        for each in expression.parts:
            evaluate(each, walk)
        return Unknown(f"`{expression.text}` is not followed" if expression.text else "it is not followed")
    return Unknown("it is not followed")


def _reference(name: str, walk: Walk) -> Any:
    from cqos_ros2.learn.functions import method_of

    this = walk.frame.this
    found = method_of(this.cls, last_part(name), walk) if this is not None and this.cls is not None else []
    found = found or walk.program.find_functions(name)
    return Code(found[0], this) if len(found) == 1 else Unknown(f"`{name[:60]}` is not one function")


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
    elsewhere = "" if walk.starting else _set_elsewhere(instance, name, walk)
    if name in instance.members:
        value = instance.members[name]
        return Unknown(elsewhere) if elsewhere and isinstance(value, _PLAIN) else value
    for cls in lineage(instance.cls, walk):
        if name in cls.initial:
            if elsewhere:
                return Unknown(elsewhere)
            instance.members[name] = value = _initial(cls, name, instance, walk)
            return value
        if name in cls.fields:
            made = None if elsewhere else _declared_member(cls, name, walk)
            if made is not None:
                instance.members[name] = made
                return made
            return Unknown(elsewhere or f"`{name}` has no value before it is used")
    return _MISSING


def _declared_member(cls: Class, name: str, walk: Walk) -> Any:
    """Return what a member is without a value in its class: a constant that is defined outside, or an object of a library; else None."""
    stated = [value for full, value in walk.program.constants.get(name, []) if full == f"{cls.name}::{name}"]
    if len(stated) == 1:
        return evaluate(stated[0], walk)
    written = cls.fields[name]
    plain = without_arguments(written)
    plain = without_arguments(walk.program.aliases.get(last_part(plain), plain))
    if inner_type(written) != written or not walk.table.is_class(plain):
        return None
    return evaluate(Call(Name(written), (), (), (), cls.place), walk)


def _initial(cls: Class, name: str, instance: Instance, walk: Walk) -> Any:
    from cqos_ros2.learn.frames import Frame

    function = next(iter(walk.program.functions.get(last_part(cls.name), [])), None) or walk.frame.function
    walk.frames.append(Frame(function, instance, types=instance.types))
    try:
        return evaluate(cls.initial[name], walk)
    finally:
        walk.frames.pop()


def lineage(cls: Class | None, walk: Walk) -> Iterator[Class]:
    """Yield a class and those that it is made from, in the program."""
    waiting = [cls]
    seen: set[int] = set()
    while waiting:
        each = waiting.pop(0)
        if each is None or id(each) in seen or len(seen) > _DEEPEST:
            continue
        seen.add(id(each))
        yield each
        waiting += [walk.program.find_class(base) for base in each.bases]


def _constant(text: str, walk: Walk) -> Any:
    """Return the value of a constant of the program, else the name itself."""
    program, last = walk.program, last_part(text)
    cls = program.find_class(text.rpartition("::")[0] or text.rpartition(".")[0]) if last != text else None
    if cls is not None and last in cls.initial:
        return _initial(cls, last, Instance(cls), walk)
    module = walk.frame.function.name
    found = []
    for name, value in program.constants.get(last, []):
        own = (
            module.startswith(f"{name.rpartition('.')[0]}.")
            if program.language == "python" and text == last
            else _fits(name, text)
        )
        if own:
            found.append(value)
    if not found:
        from cqos_ros2.learn.qualities import preset

        return preset(text, walk) or _function(text, walk) or Word(text)
    if walk.program.assigned(last):
        return Unknown(f"`{text[:60]}` is set several times")
    walk.step()
    if id(found[0]) in walk.constants:
        return walk.constants[id(found[0])]
    values = [
        evaluate(each, walk) if not _mentions(each, last) else Unknown("it is made from itself") for each in found
    ]
    if len(values) == 1 and isinstance(values[0], Instance):
        walk.constants[id(found[0])] = values[0]
    return values[0] if all(same(each, values[0]) for each in values) else Unknown(f"`{text[:60]}` has several values")


def _function(text: str, walk: Walk) -> Code | None:
    """Return the function that a name means as a value."""
    from cqos_ros2.learn.functions import near

    found = near(text, walk)
    return Code(found[0], None) if len(found) == 1 and not found[0].owner else None


def _fits(name: str, text: str) -> bool:
    from cqos_ros2.learn.program import fits

    return fits(name, text)


def _mentions(expression: Expression, name: str) -> bool:
    return isinstance(expression, Name) and last_part(expression.text) == name


def _set_elsewhere(instance: Instance, name: str, walk: Walk) -> str:
    """Return why a member may have another value than the walk saw; empty where it cannot."""
    for cls in lineage(instance.cls, walk):
        if cls.name not in walk.setters:
            walk.setters[cls.name] = _setters(cls, walk)
        for function in walk.setters[cls.name].get(name, ()):
            if id(function) not in walk.executed:
                return f"`{name}` is also set in `{function.last}`"
    return ""


def _setters(cls: Class, walk: Walk) -> dict[str, list[Function]]:
    found: dict[str, list[Function]] = {}
    skipped = {last_part(cls.name), "__init__", *walk.table.lists["lifecycle"], *walk.at_run_time}
    for function in walk.program.owned(cls.name):
        if function.last in skipped or function.last.startswith(("~", "on_")):
            continue
        for each in assignments(function):
            target = each.target
            own = isinstance(target, Attribute) and target.of == Name(THIS)
            name = target.text if isinstance(target, Name) else target.name if own else ""  # type: ignore[union-attr]
            if name:
                found.setdefault(name, []).append(function)
        for name in _handed_out(function, walk) if walk.program.language == "cpp" else ():
            found.setdefault(name, []).append(function)
    return found


def _handed_out(function: Function, walk: Walk) -> Iterator[str]:
    """Yield the plain names that a function of C++ hands to calls that may change them."""
    for each in calls_in(function.body):
        name = each.function.text if isinstance(each.function, Name) else getattr(each.function, "name", "")
        known = walk.program.functions.get(last_part(name), [])
        into = {row.values["into"] for row in walk.table.parameters.get(last_part(name), []) if "into" in row.values}
        for index, given in enumerate(each.arguments):
            if not isinstance(given, Name) or given.text.isupper():
                continue
            changed = any(variable.by_reference for one in known for variable in one.parameters[index : index + 1])
            if index in into or changed or not (known or walk.table.is_harmless(name) or last_part(name)[:1].isupper()):
                yield given.text


def _attribute(expression: Attribute, walk: Walk) -> Any:
    of = evaluate(expression.of, walk)
    if isinstance(of, Instance):
        found = member(of, expression.name, walk) if of.cls is not None else of.members.get(expression.name, _MISSING)
        if found is not _MISSING:
            return found
        from cqos_ros2.learn.functions import method_of

        methods = method_of(of.cls, expression.name, walk) if of.cls is not None else []
        return Code(methods[0], of) if len(methods) == 1 else Unknown(f"`{expression.name}` is not known")
    if isinstance(of, Word):
        return (
            _constant(f"{of.name}.{expression.name}", walk)
            if walk.program.language == "python"
            else Word(f"{of.name}.{expression.name}")
        )
    if isinstance(of, Qos):
        return dict(of.settings).get(expression.name, OF_PRESET)
    if walk.table.is_same(expression.name):
        return of
    return of if isinstance(of, Unknown) else Unknown(f"`{expression.name}` is not known")


def assign(target: Expression, value: Any, walk: Walk) -> None:
    """Give a name or member a value; what cannot be followed is left alone."""
    if isinstance(target, Name):
        frame = walk.frame
        if target.text in frame.names:
            frame.names[target.text] = value
        elif frame.outer is not None and target.text in frame.outer and walk.program.language == "cpp":
            frame.outer[target.text] = value
        elif walk.program.language == "cpp" and frame.this is not None and _declares(frame.this, target.text, walk):
            _set_member(frame.this, target.text, value, walk)
        else:
            frame.names[target.text] = value
    elif isinstance(target, Attribute):
        of = _carrier(target.of, walk) or evaluate(target.of, walk)
        if isinstance(of, (Qos, Either)):
            from cqos_ros2.learn.qualities import changed

            _replace(target.of, of, each_case(of, lambda qos: changed(qos, target.name, value)), walk)
        elif isinstance(of, Instance):
            _set_member(of, target.name, value, walk)
    elif isinstance(target, Element):
        assign(target.of, Unknown("its elements are set one by one"), walk)


def _set_member(instance: Instance, name: str, value: Any, walk: Walk) -> None:
    """Give a member a value; one that a callback changes has another value from call to call."""
    known = instance.members.get(name, _MISSING)
    changes = walk.in_callback and isinstance(known, _PLAIN) and not same(known, value) and known is not None
    instance.members[name] = Unknown(f"`{name}` changes while it runs") if changes else value


def _carrier(target: Expression, walk: Walk) -> Instance | None:
    """Return the structure in a structure that `a.b.c = 1` sets a member of; None where it is none."""
    if not isinstance(target, Attribute) or not walk.table.objects:
        return None
    of = _carrier(target.of, walk) or evaluate(target.of, walk)
    if isinstance(of, Instance) and (of.library in walk.table.objects or of.library == "#"):
        from cqos_ros2.learn.connecting import inner

        return inner(of, target.name, walk)
    return None


def _declares(instance: Instance, name: str, walk: Walk) -> bool:
    return name in instance.members or any(name in cls.fields for cls in lineage(instance.cls, walk))


def _replace(target: Expression, old: Any, new: Any, walk: Walk) -> None:
    """Give a changed value to what holds it; in Python, to everything that holds the same object."""
    assign(target, new, walk)
    if walk.program.language == "python":
        for space in (*(each.names for each in walk.frames), *(each.members for each in walk.instances)):
            for name, value in space.items():
                if value is old:
                    space[name] = new


# Operators


def _operation(expression: Operation, walk: Walk) -> Any:
    values = [evaluate(each, walk) for each in expression.operands]
    sign = expression.operator
    if sign == "+" and all(isinstance(each, (str, Template, Either)) for each in values):
        return joined(values)
    if sign in {"==", "!="}:
        return _equal(values, negated=sign == "!=")
    if sign == "not":
        decided = truth(values[0])
        if isinstance(decided, Condition):
            negated = flipped(decided.tests)
            return Unknown("the opposite of several conditions") if negated is None else Condition(negated)
        return not decided if isinstance(decided, bool) else decided
    if sign in {"and", "or"}:
        return _both(truth(values[0]), truth(values[1]), sign)
    if sign == "*" and all(isinstance(each, (int, float)) and not isinstance(each, bool) for each in values):
        return values[0] * values[1]
    unknown = next((each for each in values if isinstance(each, Unknown)), None)
    return unknown or Unknown(f"`{sign}` is not followed")


def _equal(values: list[Any], *, negated: bool) -> Any:
    one, other = values
    if isinstance(other, Template):
        one, other = other, one
    if isinstance(one, Template) and one.parameter and isinstance(other, (str, int, bool)):
        text = str(other).lower() if isinstance(other, bool) else str(other)
        return Condition((Test(one.parameter, (text,), negated),))
    if other is None and isinstance(one, (Instance, Code, str, list, Qos)):
        return negated
    if (one is None or isinstance(one, (str, int))) and (other is None or isinstance(other, (str, int))):
        return (one == other) is not negated
    return next((each for each in values if isinstance(each, Unknown)), None) or Unknown("two values are compared")


def _both(one: Any, other: Any, sign: str) -> Any:
    stop = sign == "or"
    for first, second in ((one, other), (other, one)):
        if first is stop:
            return stop
        if first is (not stop):
            return second
    if sign == "and" and isinstance(one, Condition) and isinstance(other, Condition):
        return Condition((*one.tests, *other.tests))
    return next((each for each in (one, other) if isinstance(each, Unknown)), None) or Unknown(
        "one of several conditions"
    )


def truth(value: Any) -> Any:
    """Return whether a value counts as true: a flag, a condition over parameters, or not known."""
    if isinstance(value, (bool, Condition, Unknown)):
        return value
    if value is None:
        return False
    if isinstance(value, (Instance, Code)):
        return True
    if isinstance(value, Template):
        return (
            Condition((Test(value.parameter, ("true",)),)) if value.parameter else Unknown("a text is taken for a flag")
        )
    if isinstance(value, Either) and all(isinstance(each, bool) for _, each in value.cases):
        held = [tests for tests, each in value.cases if each]
        if len(held) == 1 and value.cases[0][1] is True:
            return Condition(held[0])
    if isinstance(value, (str, int, float, list, dict)):
        return bool(value)
    return Unknown("a condition that is not followed")


def _conditional(expression: Conditional, walk: Walk) -> Any:
    decided = truth(evaluate(expression.condition, walk))
    if decided is True or decided is False:
        return evaluate(expression.then if decided else expression.otherwise, walk)
    then, otherwise = evaluate(expression.then, walk), evaluate(expression.otherwise, walk)
    tests = decided.tests if isinstance(decided, Condition) else None
    cause = decided.cause if isinstance(decided, Unknown) else "it depends on a condition"
    return merged(tests, then, otherwise, cause, walk.frame.function.place)
