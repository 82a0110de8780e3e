"""Follows calls: of functions and methods of the program, and of libraries as the tables have them."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import repeat
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import fits, last_part, refers, without_arguments
from cqos_ros2_sources.programs.program import (
    EACH,
    ENTER,
    LEAVE,
    PAIRS,
    SUPER,
    THIS,
    YIELD,
    Attribute,
    Call,
    Literal,
    Name,
    Return,
    call_name,
)
from cqos_ros2_sources.programs.statement_search import parts
from cqos_ros2_sources.walk.builtin_values import library_value, note_callbacks, on_plain
from cqos_ros2_sources.walk.call_effects import hand_over, open_objects, open_receiver
from cqos_ros2_sources.walk.client_rows import carrier
from cqos_ros2_sources.walk.cpp_copies import copied
from cqos_ros2_sources.walk.emplaced_objects import with_element
from cqos_ros2_sources.walk.endpoint_calls import (
    BELOW,
    PLUGIN,
    Given,
    apply,
    holds,
    library_of,
    note_set,
    parameter,
    topic,
)
from cqos_ros2_sources.walk.expressions import (
    evaluate,
    is_missing,
    kept_method,
    local,
    member,
    shared_preset,
    whole,
    with_arguments,
)
from cqos_ros2_sources.walk.frames import DEEPEST_CALL, MOST_ELEMENTS, Condition, Frame, Walk, lineage
from cqos_ros2_sources.walk.functions import arity, bind, hand_back, method_of, near, split_types
from cqos_ros2_sources.walk.node_options import changed, is_options
from cqos_ros2_sources.walk.objects import base, construct, inherited, plain_node
from cqos_ros2_sources.walk.other_writers import forget_all, kept_for_later
from cqos_ros2_sources.walk.parameter_sets import parameter_set
from cqos_ros2_sources.walk.profiles import change, content, forget, is_profile, profile, undecided
from cqos_ros2_sources.walk.qualities import FIELDS, maker, policy_of, setter
from cqos_ros2_sources.walk.spin_calls import note_call
from cqos_ros2_sources.walk.values import (
    MISSING,
    PLAIN,
    Code,
    Either,
    Instance,
    Profile,
    Qos,
    Resolved,
    Template,
    Undecided,
    Word,
    each_case,
    flat,
    merged,
    same,
    used,
)
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_ros2_sources.programs.program import Expression, Function
    from cqos_ros2_sources.walk.call_tables import Row
    from cqos_ros2_sources.walk.values import Tests

_BINDS: Final = frozenset(("partial", "bind", "bind_front"))
"""Functions that return a function with some arguments."""
NAMED_LATER: Final = "`getattr` is given a name that is not known"
_PLACEHOLDER: Final = re.compile("_([1-9])")
_RESOLVES: Final = frozenset(("resolve_topic_name", "resolve_service_name", "resolve_topic_or_service_name"))
_SETS: Final = frozenset(("set_parameter", "set_parameters", "set_parameters_atomically"))
_OF_NODE: Final = {"get_name": "${node}", "get_namespace": "${namespace}"}


def call(expression: Call, walk: Walk) -> Any:
    """Return what a call returns."""
    function = expression.function
    on = whole(function.of, walk) if isinstance(function, Attribute) else MISSING
    receiver = used(on)
    keywords = {name: evaluate(value, walk) for name, value in expression.keywords}
    if isinstance(keywords.get("**"), dict):
        keywords |= keywords.pop("**")
    arguments = [evaluate(each, walk) for each in expression.arguments]
    types = expression.types
    walk.frame.at = expression.place
    if last_part(call_name(expression)) in _SETS:
        note_set(expression, receiver, walk)
    note_call(expression, receiver, (*arguments, *keywords.values()), walk)
    if isinstance(function, Name):
        name = function.text
        if "<" in name:
            types, name = split_types(name), name[: name.find("<")] + name[name.rfind(">") + 1 :]
        name = walk.frame.types.get(name, name)
        found = _named(name, Given(expression, arguments, keywords, types), walk)
    elif isinstance(function, Attribute):
        given = with_element(function, Given(expression, arguments, keywords, types), walk)
        if isinstance(receiver, (Undecided, Profile)) and function.name in FIELDS and not arguments:
            return _policy(receiver, function.name)
        of_base = function.of == Name(SUPER)
        found = inherited(function.name, given, walk) if of_base else _method(receiver, function, given, walk)
    else:
        value = evaluate(function, walk)
        _note_named_later(value, walk)
        if not isinstance(value, Code):  # `(this->*method)()`
            held = [evaluate(each, walk) for each in parts(function)]
            open_objects(held, "a call that is not followed may change it", expression.place, walk)
        found = (
            invoke(value.function, value.this, arguments, keywords, walk, value=value)
            if isinstance(value, Code)
            else MISSING
        )
    if found is not MISSING:
        kept_for_later((*arguments, *keywords.values()), expression, walk)
        return on if found is receiver else undecided(found, receiver, arguments)
    if isinstance(function, Name):
        forget(local(function.text, walk), f"`{function.text[:60]}` may change it", expression.place)
    elif isinstance(function, Attribute):
        open_receiver(receiver, function.name, expression.place, walk)
    hand_over(expression, arguments, keywords, walk)
    walk.lost[id(expression)] = expression, walk.frame.function
    called = last_part(call_name(expression))
    unknown = Unknown(f"`{called[:60]}` is not followed" if called else "a call that is not followed", expression.place)
    return undecided(unknown, receiver, arguments, keywords)


def _note_named_later(value: Any, walk: Walk) -> None:
    """Note that a method is called whose name `getattr` is given and that is not known."""
    if isinstance(value, Unknown) and value.cause == NAMED_LATER and value.place and walk.current is not None:
        walk.current.gaps.setdefault(("what a method creates that `getattr` finds", NAMED_LATER), value.place)


def _named(name: str, given: Given, walk: Walk) -> Any:
    """Return the result of a call by name."""
    value = used(local(name, walk))
    if isinstance(value, Code):
        return invoke(
            value.function, value.this, given.arguments, given.keywords, walk, value=value, written=given.call.arguments
        )
    _note_named_later(value, walk)
    this = walk.frame.this
    if name in _OF_PYTHON:
        return _OF_PYTHON[name](given, walk)
    bound = used(given.arguments[0]) if last_part(name) in _BINDS and given.arguments else MISSING
    if isinstance(bound, Code):
        return with_arguments(bound, given.arguments[1:], given.keywords)
    if name == "super":
        return base(given, walk)
    if this is not None and walk.program.language == "cpp":
        found = _own_method(this, name, given, walk)
        if found is MISSING and not given.arguments and walk.table.is_same(last_part(name)):
            return this
        if found is not MISSING:
            return found
    made = maker(name, given.arguments, given.keywords, walk)
    if made is not None:
        return made if walk.table.lookup(walk.table.makers, name) is None else profile(made, walk)
    copy = _copy(name, given, walk) if walk.program.language == "python" else MISSING
    if copy is not MISSING:
        return copy
    cls = walk.program.find_class(name, walk.frame.function.place.source, walk.frame.function.name)
    if cls is not None and not {name, cls.name} & walk.table.nodes.keys() and not _has_row(cls.name, walk):
        return construct(cls, given, walk)
    found = _function(name, given, walk)
    return _of_library(name, given, walk) if found is MISSING else found


def _copy(name: str, given: Given, walk: Walk) -> Any:
    """Return a copy of a quality of service, or the one that a name means, in Python; the mark for none where the call is another one."""
    first = given.arguments[0] if given.arguments else None
    if is_profile(first) and any(fits(each, name) for each in walk.table.copies):
        return profile(content(first), walk)
    named = given.arguments[1:2]
    if last_part(name) == "get_from_short_key" and isinstance(first, str):
        return shared_preset(f"{name.rpartition('.')[0]}.{first.upper()}", walk) or MISSING
    if name == "type" and isinstance(first, Instance) and first.cls is not None and not named:
        return Word(first.cls.name)
    if name == "getattr" and named and isinstance(named[0], str):
        found = evaluate(Attribute(given.call.arguments[0], named[0]), walk)
        return found if is_profile(found) or isinstance(found, Code) else MISSING
    if name == "getattr" and named and isinstance(first, Instance) and first.node is not None:
        return Unknown(NAMED_LATER, given.call.place)
    return MISSING


def _enter(given: Given, walk: Walk) -> Any:
    """Return what a `with` of Python names: what the manager says, else what is held for it."""
    manager = given.arguments[0]
    methods = method_of(manager.cls, "__enter__", walk) if isinstance(manager, Instance) else []
    return invoke(methods[0], manager, [], {}, walk) if len(methods) == 1 else manager


def _leave(given: Given, walk: Walk) -> None:
    manager = given.arguments[0]
    methods = method_of(manager.cls, "__exit__", walk) if isinstance(manager, Instance) else []
    if len(methods) == 1:
        invoke(methods[0], manager, [None] * len(methods[0].parameters), {}, walk)


def _yield(given: Given, walk: Walk) -> Any:
    walk.frame.yielded += given.arguments or [None]
    return Unknown("what a generator is sent")


def _comprehended(given: Given, walk: Walk) -> Any:
    """Return the list or dictionary that a comprehension makes; of elements that are not known, not known."""
    made, over = given.arguments
    count = len(made.function.parameters)
    over = [*over] if isinstance(over, dict) else over
    known = isinstance(over, list) and len(over) <= MOST_ELEMENTS
    if not known:
        walk.conditions.append(Condition(perhaps=f"it is made in a loop in line {made.function.place.line}"))
    found = []
    for each in over if known else [undecided(Unknown("an element of a list that is not known"), over)]:
        parts = each if count > 1 and isinstance(each, list) and len(each) == count else [each]
        parts = parts if len(parts) == count else [undecided(Unknown("it is unpacked"), each)] * count
        found.append(invoke(made.function, made.this, parts, {}, walk, value=made))
    if not known:
        walk.conditions.pop()
        return undecided(Unknown("a list of elements that are not known"), found)
    plain = all(isinstance(each, list) and isinstance(each[0], (str, int)) for each in found)
    return (
        found if call_name(given.call) == EACH else dict(found) if plain else undecided(Unknown("a dictionary"), found)
    )


_OF_PYTHON: Final[dict[str, Callable[[Given, Walk], Any]]] = {
    EACH: _comprehended,
    PAIRS: _comprehended,
    ENTER: _enter,
    LEAVE: _leave,
    YIELD: _yield,
}
"""What statements of Python do that call something."""


def _function(name: str, given: Given, walk: Walk) -> Any:
    """Return the result of a function of the program, or of a method that is called by the name of its class; the mark for none where it is none."""
    known, this = near(name, walk), walk.frame.this
    if walk.program.language == "python" and this is not None and given.arguments[:1] == [this]:  # `Base.start(self)`
        rest = Given(given.call, given.arguments[1:], given.keywords, ())
        methods = arity([each for each in known if each.owner and not each.static], rest)
        if len(methods) == 1:
            return invoke(methods[0], this, rest.arguments, rest.keywords, walk)
    functions = arity(known, given)
    if len(functions) == 1 and functions[0].macro:  # it stands for its text: with the object and names around it
        macro = Code(functions[0], this, walk.frame.names)
        return invoke(functions[0], this, given.arguments, {}, walk, value=macro, written=given.call.arguments)
    if len(functions) == 1 and (functions[0].static or not functions[0].owner):
        return invoke(
            functions[0], None, given.arguments, given.keywords, walk, types=given.types, written=given.call.arguments
        )
    if len(functions) > 1 and all(
        len(each.body) == 1 and isinstance(each.body[0], Return) and not each.owner for each in functions
    ):
        values = [invoke(each, None, given.arguments, given.keywords, walk) for each in functions]
        return _returned([(None, each) for each in values], functions[0])
    return MISSING


def _has_row(name: str, walk: Walk) -> bool:
    return any(row.call == name for row in walk.table.calls.get(last_part(name), ()))


def _of_library(name: str, given: Given, walk: Walk) -> Any:
    """Return the result of a call of a library, as the tables have it."""
    carried = carrier(name, given, walk) or parameter_set(name, given, walk)
    if carried is not None:
        return carried
    known = walk.table.node_class(name)
    if known is not None:
        return plain_node(known[0], given, walk)
    found: Any = MISSING
    rows = [row for row in walk.table.rows("calls", name, (), method=False) if row.protocol or holds(row, given)]
    if len({row.call for row in rows}) > 1 and walk.program.language == "cpp" and "::" not in name:
        rows = []  # which library it is of is not known
    for row in rows:
        found = apply(row, given, None, walk)
    if rows:
        note_callbacks(given, walk)
        return found
    for row in walk.table.rows("parameters", name, (), method=False):
        return parameter(row, given, None, walk)
    alias = walk.program.aliases.get(last_part(name))
    if alias is not None and last_part(without_arguments(alias)) != last_part(name) and name not in walk.aliases:
        again = Call(Name(alias), given.call.arguments, given.call.keywords, tuple(given.types), given.call.place)
        walk.aliases.add(name)  # aliases of several classes may name each other
        found = call(again, walk)
        walk.aliases.discard(name)
        return found
    return library_value(name, given, walk)


# Methods


def _own_method(this: Instance, name: str, given: Given, walk: Walk) -> Any:
    """Return the result of a method called by its bare name in C++; the mark for none where it is none."""
    if "::" in name:
        owner = name.rpartition("::")[0]
        cls = next((each for each in lineage(this.cls, walk) if fits(each.name, owner)), None)
        if cls is None:
            base = next((each for each in library_of(this, walk) if fits(each, owner)), None)
            return MISSING if base is None else on_library(this, last_part(name), given, walk)
        functions = arity(method_of(cls, last_part(name), walk), given)
    else:
        value = used(member(this, name, walk)) if this.cls is not None else None
        if isinstance(value, Code):
            return invoke(
                value.function,
                value.this,
                given.arguments,
                given.keywords,
                walk,
                value=value,
                written=given.call.arguments,
            )
        functions = arity(method_of(this.cls, name, walk), given)
        if not functions:
            forget_all(this, name, walk)
        if name in _OF_NODE and not functions and this.node is not None:
            return Template(_OF_NODE[name])
        if is_missing(value) and (not functions or _is_library(functions[0], name, this, walk)):
            return on_library(this, name, given, walk)
    return (
        invoke(
            functions[0], this, given.arguments, given.keywords, walk, types=given.types, written=given.call.arguments
        )
        if len(functions) == 1
        else MISSING
    )


def _is_library(function: Function, name: str, receiver: Instance, walk: Walk) -> bool:
    """Whether a method is of a class that the tables have, though its source is there."""
    known = any(fits(each, function.owner) for each in walk.table.nodes)
    return known and bool(walk.table.rows("calls", name, library_of(receiver, walk), method=True))


def on_library(receiver: Any, name: str, given: Given, walk: Walk) -> Any:
    """Return the result of a method that a library class has; the mark for none where the tables do not have it."""
    if name == "create_sub_node" and isinstance(receiver, Instance) and receiver.node is not None:
        below = Unknown("a part of a part of a node") if BELOW in receiver.members else given.arguments[:1]
        return Instance(
            None, "rclcpp::Node", {BELOW: below[0] if isinstance(below, list) and below else below}, {}, receiver.node
        )
    classes = library_of(receiver, walk) if isinstance(receiver, Instance) else []
    of_plugin = walk.current is not None and walk.current.name == PLUGIN and name == "get_node"
    if of_plugin and any(fits(known, each) for known in walk.table.lists["plugin_nodes"] for each in classes):
        return Instance(None, "rclcpp_lifecycle::LifecycleNode", {"#get_name": Template(PLUGIN)}, {}, walk.current)
    is_node = isinstance(receiver, Instance) and receiver.node is not None
    rows = [] if isinstance(receiver, (Qos, str, Template)) else walk.table.rows("calls", name, classes, method=True)
    if not rows and classes and not is_node and isinstance(receiver, Instance) and receiver.cls is not None:
        classes = []  # made from a class that nothing knows: methods of nodes have names of their own
        rows = [row for row in walk.table.rows("calls", name, (), method=True) if _reads(row, given)]
    rows = [
        row
        for row in rows
        if is_node
        or "node" in row.on
        or not isinstance(receiver, Instance)
        or not receiver.library
        or any(fits(on, each) for on in row.on for each in classes)
    ]
    if (
        rows
        and not is_node
        and isinstance(receiver, Instance)
        and receiver.cls is not None
        and not library_of(receiver, walk)
    ):
        rows = []
    found: Any = MISSING
    for row in rows[:1] if not is_node and len(rows) > 1 else rows:
        found = apply(row, given, receiver, walk)
    if rows:
        if len(rows) > 1 and not is_node:
            _unsure(walk)
        note_callbacks(given, walk)
        return found
    for row in (
        walk.table.rows("parameters", name, classes, method=True)
        if not isinstance(receiver, (Qos, str, Template, Word))
        else ()
    ):
        return parameter(row, given, receiver, walk)
    return MISSING


def _reads(row: Row, given: Given) -> bool:
    """Whether a call gives what a row says that it takes: a topic that is a text."""
    position = row.position("topic")
    return position is None or isinstance(topic(given.at(position)), (str, Template, Either))


def _unsure(walk: Walk) -> None:
    """Make the quality of service of the last endpoint unknown: the class decides at which position it stands."""
    from dataclasses import replace

    node = walk.current
    if node is not None and node.made and not isinstance(node.made[-1].qos, Qos):
        node.made[-1] = replace(node.made[-1], qos=Unknown("the class that it is called on is not known"))


def _method(receiver: Any, function: Attribute, given: Given, walk: Walk) -> Any:
    """Return the result of a method."""
    name = function.name
    if isinstance(receiver, Word):
        value = shared_preset(receiver.name, walk)
        if value is None and walk.program.language == "python":
            return _named(f"{receiver.name}.{name}", given, walk)
        receiver = value or receiver
    if is_profile(receiver) or (isinstance(receiver, Undecided) and name in walk.table.setters):
        return _on_qos(receiver, function, given, walk)
    if is_options(receiver):
        return changed(receiver, name, given, walk.frame.function)
    if isinstance(receiver, Instance) and receiver.library in walk.table.objects and name in walk.table.members:
        receiver.members[walk.table.members[name]] = (
            given.arguments[0] if given.arguments else Unknown("it is not stated")
        )
        return receiver
    found = _on_object(receiver, name, given, walk)
    if found is MISSING:
        found = on_library(receiver, name, given, walk)
    if found is not MISSING:
        return found
    if isinstance(receiver, Code) and name == "operator()":
        return invoke(
            receiver.function,
            receiver.this,
            given.arguments,
            given.keywords,
            walk,
            value=receiver,
            written=given.call.arguments,
        )
    if name in _RESOLVES and given.arguments:
        return Resolved(given.arguments[0])
    if walk.table.is_same(name) and not (name == "str" and given.arguments):
        return receiver
    if name in _OF_NODE and isinstance(receiver, Instance) and receiver.node is not None:
        return receiver.members.get(f"#{name}", Template(_OF_NODE[name]))
    return on_plain(receiver, function, given, walk)


def _on_object(receiver: Any, name: str, given: Given, walk: Walk) -> Any:
    """Return the result of a method that the program has; the mark for none where it has none."""
    if isinstance(receiver, Instance) and receiver.cls is not None:
        functions = arity(method_of(receiver.cls, name, walk), given)
        if not functions:
            forget_all(receiver, name, walk)
        if len(functions) == 1 and not _is_library(functions[0], name, receiver, walk):
            return invoke(
                functions[0],
                receiver,
                given.arguments,
                given.keywords,
                walk,
                types=given.types,
                written=given.call.arguments,
            )
        value = used(member(receiver, name, walk))
        if isinstance(value, Code):
            return invoke(
                value.function,
                value.this,
                given.arguments,
                given.keywords,
                walk,
                value=value,
                written=given.call.arguments,
            )
    return MISSING


def _policy(receiver: Any, name: str) -> Any:
    """Return a policy of a quality of service, or of one of several."""
    found = content(receiver)
    if isinstance(found, Undecided):
        return Unknown(found.cause, found.place)
    return each_case(found, lambda qos: policy_of(qos, name) if isinstance(qos, Qos) else qos)


def _on_qos(receiver: Any, function: Attribute, given: Given, walk: Walk) -> Any:
    """Return what a method of a quality of service returns; one that sets a policy returns the object, as in C++."""
    name = function.name
    if name in walk.table.passes or walk.table.is_same(name):
        return receiver
    if name in walk.table.copies:
        return profile(content(receiver), walk)
    refused = Unknown(f"`{name[:60]}` of a quality of service is not followed", given.call.place)
    if name in walk.table.reads:
        return refused

    def after(value: Any) -> Any:
        if not isinstance(value, Qos):
            return value if isinstance(value, Unknown) else refused
        found = setter(value, name, given.arguments, walk)
        return refused if found is None else found

    change(receiver, after, f"`{name[:60]}` is called on one of several qualities of service", given.call.place)
    return receiver if name in walk.table.setters else refused


# Functions and objects of the program


def invoke(
    function: Function,
    this: Instance | None,
    arguments: Sequence[Any],
    keywords: Mapping[str, Any],
    walk: Walk,
    *,
    types: Sequence[str] = (),
    value: Code | None = None,
    written: Sequence[Expression] = (),
) -> Any:
    """Walk a function; return what it returns. Deep and repeated calls are not followed.

    Args:
        function: what is called.
        this: on which object.
        arguments: values by position.
        keywords: values by name.
        walk: where the walk is.
        types: template arguments.
        value: the lambda that it is, with the names around it.
        written: the arguments as written, for what the function changes by reference.
    """
    from cqos_ros2_sources.walk.statements import run_body

    if value is not None:
        keywords = {**value.named, **keywords}
        written = (*repeat(Literal(None), len(value.given)), *written) if written else ()
        arguments = _with_given(value, arguments)
        if value.library and this is not None:
            return _on_bound(value, this, Given(_written(value, written, walk), arguments, keywords, ()), walk)
    recursive = any(each.function is function for each in walk.frames)
    if len(walk.frames) > DEEPEST_CALL and not recursive:
        walk.cut.append(function)
    walk.executed.add(id(function))
    if len(walk.frames) > DEEPEST_CALL or recursive:
        return Unknown(f"`{function.last}` calls itself, or calls are too deep", function.place)
    arguments = [*map(_handed, arguments, written, repeat(walk)), *arguments[len(written) :]]
    bound = {name: _type(given, walk) for name, given in zip(function.templates, types, strict=False)}
    outer = value.names if value is not None else None
    frame = Frame(
        function,
        this,
        types={**(this.types if this is not None else {}), **bound},
        outer=outer,
        conditions=len(walk.conditions),
    )
    walk.frames.append(frame)
    try:
        frame.names.update(value.own if value is not None else {})
        bind(function, arguments, keywords, frame, walk)
        if function.macro:
            given, outer_types = zip(function.parameters, written, strict=False), walk.frames[-2].types
            meant = {each.name: name.text for each, name in given if isinstance(name, Name)}
            frame.types.update({name: outer_types.get(text, text) for name, text in meant.items()})
        finished = run_body(function, walk)
    finally:
        walk.frames.pop()
    hand_back(function, frame, written, walk)
    wrapped = next((each for each in function.decorators if not walk.table.is_listed("decorators", each)), "")
    if wrapped:
        cause = f"`{wrapped[:60]}` may change it"
        returned = [value for _, value in frame.returned]
        open_objects([this, *arguments, *keywords.values(), *returned], cause, function.place, walk)
    if frame.yielded:
        return undecided(Unknown(f"what `{function.last}` yields", function.place), frame.yielded)
    if not frame.returned:
        return None
    if finished and (len(frame.returned) == 1 or walk.program.language == "python"):
        frame.returned.append(((), None))
    found = _returned(frame.returned, function)
    return found if refers(function.returns) else copied(found, "auto", walk)


def _written(value: Code, written: Sequence[Expression], walk: Walk) -> Call:
    place = walk.frame.at or value.function.place
    return Call(Attribute(Name(THIS), value.library), tuple(written), (), (), place)


def _on_bound(value: Code, this: Instance, given: Given, walk: Walk) -> Any:
    """Return the result of a method of a library that was bound to a node."""
    made = len(this.node.made) if this.node is not None else 0
    found = on_library(this, value.library, given, walk)
    if this.node is not None and len(this.node.made) > made:
        this.node.gaps.pop(kept_method(value.library, value.function.place), None)
    return Unknown(f"what `{value.library}` returns", given.call.place) if found is MISSING else found


def _with_given(code: Code, arguments: Sequence[Any]) -> list[Any]:
    """Return the arguments of a call of a function that has some already."""
    if not any(isinstance(each, Word) and _PLACEHOLDER.fullmatch(last_part(each.name)) for each in code.given):
        return [*code.given, *arguments]
    found = []
    for each in code.given:
        place = _PLACEHOLDER.fullmatch(last_part(each.name)) if isinstance(each, Word) else None
        index = int(place[1]) - 1 if place is not None else 0
        missing = Unknown("an argument that is left out")
        found.append(each if place is None else arguments[index] if index < len(arguments) else missing)
    return found


def _handed(value: Any, written: Expression, walk: Walk) -> Any:
    """Return an argument as it is written: a function may ask whether a pointer is set."""
    found = whole(written, walk) if isinstance(value, Instance) and isinstance(written, (Name, Attribute)) else value
    return found if used(found) is value else value


def _type(written: str, walk: Walk) -> str:
    """Return a template argument as its function means it: a class of the program with its whole name."""
    around = walk.frame.function
    found = walk.frame.types.get(written, written)
    cls = walk.program.find_class(found, around.place.source, around.name) if "<" not in found else None
    return found if cls is None else cls.name


def _returned(found: list[tuple[Tests | None, Any]], function: Function) -> Any:
    """Return the value of a function that returned on several ways: one for each value of the parameters that decide."""
    first = found[0][1]
    if all(same(value, first) for _, value in found):
        return first
    values = tuple(value for _, value in found)
    plain = [value for _, value in found if value is not None]
    if len(plain) == 1 and isinstance(used(plain[0]), Instance):
        joint = found[-1][1]
        for tests, value in reversed(found[:-1]):
            joint = merged(tests, value, joint, f"`{function.last}` may return nothing", function.place)
        return joint
    if (
        found[-1][0] is not None
        and all(isinstance(value, PLAIN) and value is not None for _, value in found)
        and all(tests for tests, _ in found[:-1])
    ):
        return flat((*((tests or (), value) for tests, value in found[:-1]), ((), found[-1][1])))
    unknown = Undecided(f"`{function.last}` returns one of several values", function.place, "", values, exhaustive=True)
    return unknown if any(map(is_profile, values)) else undecided(Unknown(unknown.cause, unknown.place), values)
