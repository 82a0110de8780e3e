"""Makes the objects of a program: constructors with what stands before their bodies, base classes, and nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import last_part, without_arguments
from cqos_ros2_sources.programs.program import Call, Literal, Name
from cqos_ros2_sources.walk.call_effects import note_nodes, open_to, unread_bases
from cqos_ros2_sources.walk.client_rows import state
from cqos_ros2_sources.walk.cpp_copies import copied
from cqos_ros2_sources.walk.endpoint_calls import Given
from cqos_ros2_sources.walk.expressions import evaluate
from cqos_ros2_sources.walk.frames import DEEPEST_CALL, Frame, bases_of, lineage
from cqos_ros2_sources.walk.functions import arity, bind, hand_back, method_of, split_types
from cqos_ros2_sources.walk.node_options import place
from cqos_ros2_sources.walk.profiles import forget
from cqos_ros2_sources.walk.statements import run_body
from cqos_ros2_sources.walk.values import MISSING, Instance, NodeRecord
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_sources.programs.program import Class, Expression, Function
    from cqos_ros2_sources.walk.frames import Walk


NO_CONSTRUCTOR: Final = "none or several of its constructors fit"


def construct(cls: Class, given: Given, walk: Walk) -> Any:
    """Make an object of a class of the program, with its base classes."""
    instance = Instance(cls, library=library_base(cls, walk), types=dict(zip(cls.templates, given.types, strict=False)))
    walk.instances.append(instance)
    if walk.table.node_class(instance.library) is not None:
        known = walk.table.node_class(instance.library)
        lifecycle = bool(known[1].values.get("lifecycle")) if known else False
        instance.node = NodeRecord(cls.name, Unknown("its name is not known"), "", given.call.place, lifecycle)
        walk.nodes.append(instance.node)
    outer = walk.current
    walk.current = instance.node or outer
    try:
        _construct(cls, instance, given, walk)
    finally:
        walk.current = outer or (instance.node if len(walk.nodes) == 1 else None)
    return instance


def _construct(cls: Class, instance: Instance, given: Given, walk: Walk) -> None:
    last = "__init__" if walk.program.language == "python" else last_part(cls.name)
    own = walk.program.methods(cls, last)
    found = arity(own, given)
    if walk.program.language == "python" and not found:
        base = next(bases_of(cls, walk), None)
        if base is not None:
            _construct(base, instance, given, walk)
        elif instance.node is None:
            _fill(instance, given, walk)
            _hand_to_base(cls, instance, given, walk)
        else:
            _library_node(instance, given, walk)
        return
    if len(found) > 1:
        found = [each for each in found if each.body or each.initializers] if walk.program.language == "cpp" else found
    if len(found) > 1:
        delegating = [each for each in found if any(last_part(name) == last for name, _, _ in each.initializers)]
        found = [each for each in found if each not in delegating] if len(found) - len(delegating) == 1 else found[:0]
    if not own and walk.program.language == "cpp" and last not in cls.declared:
        _fill(instance, given, walk)
        return
    if not found:
        node = instance.node or walk.current
        if node is not None and (instance.node is not None or own):
            node.gaps[f"what `{last_part(cls.name)}` creates", NO_CONSTRUCTOR] = given.call.place
        return
    function = found[0]
    outer_types = {**instance.types}
    frame = Frame(function, instance, types=outer_types, conditions=len(walk.conditions))
    walk.executed.add(id(function))
    if len(walk.frames) > DEEPEST_CALL or any(
        each.function is function and each.this is not None and each.this.cls is cls for each in walk.frames
    ):
        return
    walk.frames.append(frame)
    try:
        bind(function, given.arguments, given.keywords, frame, walk)
        _initializers(cls, instance, function, given, walk)
        run_body(function, walk)
    finally:
        walk.frames.pop()
    hand_back(function, frame, given.call.arguments, walk)


def _fill(instance: Instance, given: Given, walk: Walk) -> None:
    """Give the members of an object without a constructor what it is made with: by their order and names, or of another one."""
    classes = [*lineage(instance.cls, walk)]
    names = [name for each in reversed(classes) for name in each.fields]
    values = list(given.arguments)
    if len(values) == 1 and isinstance(values[0], Instance) and values[0].cls is instance.cls:
        instance.members.update(values[0].members)
    elif len(values) == 1 and isinstance(values[0], dict) and walk.program.language == "cpp":
        instance.members.update(values[0])
    elif values and (len(values) > len(names) or any(isinstance(each, Unknown) and not each.cause for each in values)):
        instance.members.update({name: Unknown("what it is made with is not followed") for name in names})
    else:
        types = {name: text for each in classes for name, text in each.fields.items()}
        given_values = ((name, copied(value, types[name], walk)) for name, value in zip(names, values, strict=False))
        instance.members.update(given_values)
        instance.members.update(given.keywords)


def _initializers(cls: Class, instance: Instance, function: Function, given: Given, walk: Walk) -> None:
    """Walk what stands before the body of a constructor in C++: base classes and members."""
    based: set[str] = set()
    for name, arguments, where in function.initializers:
        last = last_part(without_arguments(name))
        made = Call(Name(name), arguments, (), (), where)
        base = next((each for each in cls.bases if last_part(without_arguments(each)) == last), None)
        if last == last_part(cls.name):
            _construct_again(cls, instance, made, walk)
            return
        if base is not None:
            based.add(base)
            _base_class(cls, base, instance, made, walk)
        elif name in cls.fields:
            typed: Expression = Call(Name(cls.fields[name]), arguments, (), ("{",), where)
            if cls.fields[name].endswith(("*", "&")):
                typed = arguments[0] if arguments else Literal(None)
            instance.members[name] = evaluate(typed, walk)
    if walk.program.language == "cpp":
        for base in cls.bases:
            inner = walk.program.find_class(base, cls.place.source, cls.name) if base not in based else None
            if inner is not None:
                _construct(inner, instance, Given(Call(Name(base), (), (), (), given.call.place), [], {}, ()), walk)


def _construct_again(cls: Class, instance: Instance, made: Call, walk: Walk) -> None:
    _construct(cls, instance, Given(made, [evaluate(each, walk) for each in made.arguments], {}, ()), walk)


def _base_class(cls: Class, base: str, instance: Instance, made: Call, walk: Walk) -> None:
    arguments = [evaluate(each, walk) for each in made.arguments]
    given = Given(made, arguments, {}, ())
    inner = walk.program.find_class(base, cls.place.source, cls.name)
    if inner is not None and not {without_arguments(base), inner.name} & walk.table.nodes.keys():
        instance.types.update(zip(inner.templates, split_types(base), strict=False) if "<" in base else ())
        _construct(inner, instance, given, walk)
    else:
        _library_node(instance, given, walk)
        if walk.table.node_class(without_arguments(base)) is None:
            note_nodes(base, made, arguments, walk)
            forget(arguments, f"`{base[:60]}` may change it", made.place)


def base(given: Given, walk: Walk) -> Any:
    """Walk ``super().__init__(…)`` of Python."""
    this, owner = walk.frame.this, walk.frame.function.owner
    cls = next((each for each in lineage(this.cls, walk) if each.name == owner), None) if this is not None else None
    if this is None or cls is None:
        return Unknown("there is no base class")
    if not isinstance(given.call.function, Name):
        return None
    base = next(bases_of(cls, walk), None)
    if base is not None and not any(walk.table.node_class(name) for name in cls.bases):
        _construct(base, this, given, walk)
    else:
        _library_node(this, given, walk)
        _hand_to_base(cls, this, given, walk)
    return Unknown("the base class")


def _hand_to_base(cls: Class, this: Instance, given: Given, walk: Walk) -> None:
    """Take what the constructor of a base class that was not read may change as not known."""
    for name in unread_bases(cls, walk):
        open_to(name, given.call, (this, *given.arguments, *given.keywords.values()), walk)


def inherited(name: str, given: Given, walk: Walk) -> Any:
    """Walk ``super().name(…)`` of Python; of a library class, what the tables do not have makes nothing."""
    from cqos_ros2_sources.walk.calls import invoke, on_library

    this, owner = walk.frame.this, walk.frame.function.owner
    cls = next((each for each in lineage(this.cls, walk) if each.name == owner), None) if this is not None else None
    if this is None or cls is None:
        return MISSING
    functions = [one for each in bases_of(cls, walk) for one in arity(method_of(each, name, walk), given)]
    if len(functions) == 1:
        return invoke(
            functions[0], this, given.arguments, given.keywords, walk, types=given.types, written=given.call.arguments
        )
    found = on_library(this, name, given, walk)
    if found is MISSING and all(walk.table.node_class(each) for each in cls.bases):
        return Unknown(f"`{name[:60]}` of a library", given.call.place)
    return found


def _library_node(instance: Instance, given: Given, walk: Walk) -> None:
    """Take name and namespace of a node from what its library class is given."""
    node = instance.node
    known = walk.table.node_class(instance.library)
    if node is None or known is None:
        return
    row = known[1]
    node.protocol = row.protocol
    if row.protocol:
        node.parameters.update(row.values.get("defaults", {}))
        state(row, given, node, walk)
        return
    place(node, row, given)


def plain_node(library: str, given: Given, walk: Walk) -> Instance:
    """Make a node that has no class of its own."""
    instance = Instance(None, library=library)
    row = walk.table.nodes[library]
    instance.node = NodeRecord(
        library, Unknown("its name is not known"), "", given.call.place, bool(row.values.get("lifecycle"))
    )
    walk.nodes.append(instance.node)
    walk.instances.append(instance)
    _library_node(instance, given, walk)
    walk.current = instance.node if len(walk.nodes) == 1 else None
    return instance


def library_base(cls: Class, walk: Walk) -> str:
    """Return the library class of nodes that a class is made from; empty where it is made from none."""
    for each in lineage(cls, walk):
        for base in each.bases:
            known = walk.table.node_class(without_arguments(base))
            inner = walk.program.find_class(base, each.place.source, each.name) if known is not None else None
            if known is not None and (inner is None or {without_arguments(base), inner.name} & walk.table.nodes.keys()):
                return known[0]
    return ""
