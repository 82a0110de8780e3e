"""Calls of the tables: those that make an endpoint, declare a parameter or use a part of a library, and on which node."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from cqos_ros2_sources.programs.names import last_part, without_arguments
from cqos_ros2_sources.programs.program import Do, Items, NotFollowed, call_name
from cqos_ros2_sources.programs.statement_search import calls_in
from cqos_ros2_sources.walk.client_rows import connect
from cqos_ros2_sources.walk.expressions import assign, evaluate
from cqos_ros2_sources.walk.frames import MOST_ENDPOINTS, Condition, TooMuchError, lineage
from cqos_ros2_sources.walk.override_options import stated
from cqos_ros2_sources.walk.qualities import as_qos, number_of
from cqos_ros2_sources.walk.values import (
    MISSING,
    Either,
    Instance,
    Made,
    NodeRecord,
    Overriding,
    Qos,
    Resolved,
    Template,
    Test,
    Word,
    each_case,
    joined,
)
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_ros2_sources.programs.program import Call
    from cqos_ros2_sources.walk.call_tables import Position, Row
    from cqos_ros2_sources.walk.frames import Walk

_TYPE: Final = re.compile(r"([A-Za-z]\w*)(?:::|\.|/)(msg|srv|action)(?:::|\.|/)(?:\w+\.)?([A-Za-z]\w*)")
REST: Final = "*"
REST_BY_NAME: Final = "**"
_RAW: Final = "raw"
"""The transport of a message as it is."""
_OPTIONS_BESIDE: Final = "whether it takes the options depends on the version of the library"
OWN_WORDS: Final = ("node", "namespace", "above", "plugin")
"""What `${…}` means in node files beside parameters."""
PLUGIN: Final = "${plugin}"
"""How node files write the name of a plugin."""
BELOW: Final = "#below"
"""The member of a part of a node that has its namespace."""
_SIMPLE: Final = (str, int, float, bool, list)


class Given:
    """The arguments of a call, with their values."""

    def __init__(self, call: Call, arguments: Sequence[Any], keywords: Mapping[str, Any], types: Sequence[str]) -> None:
        """Keep what is given."""
        self.call, self.arguments, self.keywords, self.types = call, arguments, keywords, types

    def at(self, position: Position | None) -> Any:
        """Return the value of an argument; the mark for none where the call leaves it out."""
        if position is None:
            return MISSING
        if position.keyword and position.keyword in self.keywords:
            return self.keywords[position.keyword]
        before = self.call.arguments[: (position.index or 0) + 1] if position.index is not None else ()
        missing = position.index is None or len(self.arguments) <= position.index
        rest = any(isinstance(each, NotFollowed) and each.text == REST for each in before)
        if rest or (REST_BY_NAME in self.keywords and missing):
            return Unknown("it may be among the rest of the arguments")
        if position.index is not None and position.index < len(self.arguments):
            return (
                self.arguments[position.index]
                if not position.path
                else _inside(self.arguments[position.index], position)
            )
        return MISSING

    def expression(self, position: Position | None) -> Any:
        """Return an argument as written; None where the call leaves it out."""
        if position is None or position.index is None or position.index >= len(self.call.arguments):
            return None
        return self.call.arguments[position.index]


def _inside(value: Any, position: Position) -> Any:
    """Return a member of an argument that is a structure; the mark for none where it is not set."""
    if not isinstance(value, Instance):
        return value if isinstance(value, Unknown) else Unknown("its fields are not followed")
    for path in position.path:
        found: Any = value
        for name in path:
            unknown = found.members.get("*", MISSING) if isinstance(found, Instance) else MISSING
            found = found.members.get(name, unknown) if isinstance(found, Instance) else MISSING
        if found is not MISSING:
            return found
    return MISSING


def node_for(row: Row, given: Given, receiver: Any, walk: Walk) -> NodeRecord | None:
    """Return the node that a call belongs to: what it is called on or given, else the one that the walk is in."""
    for asked in (given.at(row.position("node")), receiver):
        found = asked.node or asked.members.get("#node") if isinstance(asked, Instance) else None
        if isinstance(found, NodeRecord) and found.protocol == row.protocol:
            return found
    if walk.current is not None and walk.current.protocol == row.protocol:
        return walk.current
    alike = [each for each in walk.nodes if each.protocol == row.protocol]
    return alike[0] if len(alike) == 1 and row.protocol else None


def holds(row: Row, given: Given) -> bool:
    """Whether a call has as many arguments as a row asks for, and the one that it needs."""
    counts, needed = row.values.get("arguments"), row.position("given")
    enough = counts is None or len(given.arguments) in counts
    return enough and (needed is None or given.at(needed) not in {MISSING, None})


def apply(row: Row, given: Given, receiver: Any, walk: Walk) -> Any:
    """Record what a row says that a call makes; return what the call returns."""
    if row.protocol:
        return connect(row, given, node_for(row, given, receiver, walk), walk)
    place = walk.place(given.call.place)
    walk.made_at |= {(each.source, each.line or 0) for each in (place, given.call.place)}
    node = node_for(row, given, receiver, walk)
    if any(each in walk.frame.abstract for each in given.types):
        return Instance(
            None, library=row.call
        )  # a wrapper by itself: it is no endpoint before something states its type
    types = {str(number): walk.frame.types.get(each, each) for number, each in enumerate(given.types)}
    made = Instance(None, library=row.call, types=types)
    if "makes" in row.values and "topic_is" not in row.values and not given.arguments and not given.keywords:
        return made  # a later call says what it makes
    if node is None:
        walk.homeless.append(place)
        node = walk.stray()
    else:
        made.members["#node"] = node
    _use(row, given, node)
    if "makes" not in row.values:
        return made
    name = row.values.get("topic_is", MISSING)
    if name is MISSING:
        name = topic(given.at(row.position("topic")))
    name = _below_part(name, row, given, receiver)
    if "below" in row.values:
        name = joined([name, "/", row.text("below")])
    if "unknown_topic" in row.values and not isinstance(name, Unknown):
        name = Unknown(row.text("unknown_topic"), place)
    qos = quality(row, given, walk)
    overriding = stated(row, given, walk)
    type_found = type_of(row, given, receiver, walk)
    for decided, full, kind in _transported(row, given, name, type_found, node):
        walk.conditions.append(decided)
        record(node, walk, Made(row.text("makes"), full, kind, qos, place, overriding=overriding))
        walk.conditions.pop()
    options = given.at(row.position("options")) is not MISSING
    beside_it = Overriding((), _OPTIONS_BESIDE) if options else Overriding(())
    for beside, type_name in row.values.get("beside", {}).items():
        record(node, walk, Made(row.text("makes"), _beside(name, beside), type_name, qos, place, overriding=beside_it))
    return made


def _below_part(name: Any, row: Row, given: Given, receiver: Any) -> Any:
    """Return a name as a part of a node (`create_sub_node`) has it: below its namespace, where the name is relative."""
    asked = [each for each in (receiver, given.at(row.position("node"))) if isinstance(each, Instance)]
    below = next((each.members[BELOW] for each in asked if BELOW in each.members), MISSING)
    text = name.text if isinstance(name, Template) else name
    if below is MISSING or not isinstance(text, str) or text.startswith(("/", "~")):
        return name
    if not row.on or text.startswith("${"):
        return Unknown("what namespace a part of a node gives it is not known", given.call.place)
    return joined([below, "/", name])


def _use(row: Row, given: Given, node: NodeRecord) -> None:
    """Note the fragment that a row says that a call uses, with what is not known of it."""
    if "uses" not in row.values:
        return
    node.uses.setdefault(row.text("uses"), given.call.place)
    if "unread" in row.values:
        node.gaps[row.text("uses"), row.text("unread")] = given.call.place
    for key, what in (("qos", "a quality of service"), ("options", "options")):
        if given.at(row.position(key)) is not MISSING:
            node.gaps[row.text("uses"), f"the call states {what} of its own"] = given.call.place


def _transported(
    row: Row, given: Given, name: Any, type_found: Any, node: NodeRecord
) -> Iterator[tuple[Condition, Any, Any]]:
    """Yield the topics that a subscription over a transport may have: `raw` is the topic itself, any other stands below it."""
    if "transport" not in row.values:
        yield Condition(), name, type_found
        return
    asked = given.at(row.position("transport"))
    if asked is MISSING:  # some overloads take it in the place of the object whose method they call
        asked = next((each for each in given.arguments[3:] if isinstance(each, (str, Template, Unknown))), asked)
    if asked is MISSING or asked is None:
        parameter = row.text("transport_parameter")
        declare(node, parameter, _RAW)
        asked = Template(f"${{{parameter}}}")
    other = Unknown("the transport decides about it")
    if asked == _RAW:
        yield Condition(), name, type_found
    elif isinstance(asked, str):
        yield Condition(), _below(name, asked), other
    elif isinstance(asked, Template) and asked.parameter:
        yield Condition((Test(asked.parameter, (_RAW,)),)), name, type_found
        yield Condition((Test(asked.parameter, (_RAW,), negated=True),)), _below(name, asked), other
    else:
        yield Condition(), Unknown("the transport decides about the topic", given.call.place), other


def _below(name: Any, transport: str | Template) -> Any:
    return joined([name, "/", transport]) if isinstance(name, (str, Template)) else name


def record(node: NodeRecord, walk: Walk, made: Made) -> None:
    """Add an endpoint to a node, under the conditions that hold.

    Raises:
        TooMuchError: the node has too many.
    """
    if len(node.made) >= MOST_ENDPOINTS:
        raise TooMuchError
    each = tuple(each.each for each in walk.conditions if each.each is not None)
    used = tuple(pair for pair in each if isinstance(made.name, Template) and f"${{{pair[0]}}}" in made.name.text)
    perhaps = walk.perhaps() or ("it is made for each of several values" if len(used) < len(each) else "")
    branch = 0 if each else walk.branch()
    node.made.append(replace(made, tests=walk.tests(), perhaps=perhaps, for_each=used, branch=branch))


def topic(value: Any) -> Any:
    """Return the name of a topic, or why it is not known."""
    if isinstance(value, (str, Template, Unknown)):
        return value
    if isinstance(value, Either):
        return each_case(value, topic)
    if isinstance(value, Resolved):
        return topic(value.name)
    if value is MISSING:
        return Unknown("the call does not name it")
    return Unknown(
        f"it is `{value.name[:60]}`, whose value is not known"
        if isinstance(value, Word)
        else "its name is not a text that is known"
    )


def _beside(name: Any, last: str) -> Any:
    text = name.text if isinstance(name, Template) else name if isinstance(name, str) else ""
    if text and "}" not in text.rpartition("/")[2]:
        whole = f"{text.rpartition('/')[0]}/{last}" if "/" in text else last
        return Template(whole) if isinstance(name, Template) else whole
    return Unknown("it stands beside a topic that is not known", None)


def quality(row: Row, given: Given, walk: Walk) -> Any:
    """Return the quality of service of an endpoint, or why it is not known."""
    if row.values.get("makes", "").startswith("action"):
        return Qos("")
    stated = given.at(row.position("qos"))
    if stated is not MISSING and stated is not None:
        found = as_qos(stated, walk)
        if isinstance(found, Either):
            cases = tuple((tests, as_qos(each, walk)) for tests, each in found.cases)
            return (
                Either(cases)
                if all(isinstance(each, Qos) for _, each in cases)
                else Unknown("one of several qualities of service")
            )
        known = isinstance(found, (Qos, Unknown))
        return found if known else Unknown("its quality of service is not known", given.call.place)
    if "unknown_qos" in row.values:
        return Unknown(row.text("unknown_qos"), given.call.place)
    if "qos_is" in row.values:
        return Qos("default", tuple(row.values["qos_is"].items()))
    default = row.text("default_qos")
    return Qos(default) if default else Unknown("the call states no quality of service", given.call.place)


def type_of(row: Row, given: Given, receiver: Any, walk: Walk) -> Any:
    """Return the type of an endpoint as ROS 2 writes it, or why it is not known."""
    position = row.position("type")
    if position is None:
        return Unknown("the call does not say it")
    if position.template is not None:
        if position.template >= len(given.types):
            return Unknown("its template argument is left out")
        return type_name(given.types[position.template], walk)
    if position.of_object is not None:
        stated = receiver.types.get(str(position.of_object)) if isinstance(receiver, Instance) else None
        return Unknown("the object does not say it") if stated is None else type_name(stated, walk)
    if position.keyword and position.text == position.keyword and "/" in position.text:
        return position.text
    value = given.at(position)
    if isinstance(value, Word):
        return type_name(value.name, walk)
    return (
        type_name(value, walk)
        if isinstance(value, str)
        else value
        if isinstance(value, Unknown)
        else Unknown("its type is not known")
    )


def type_name(written: str, walk: Walk) -> Any:
    """Return a type as ROS 2 writes it: ``sensor_msgs/msg/LaserScan``."""
    text = written.strip()
    for _ in range(4):
        text = walk.frame.types.get(text, text)
        plain = without_arguments(text).strip(":")
        found = _TYPE.fullmatch(plain)
        if found is not None:
            return f"{found[1]}/{found[2]}/{found[3]}"
        alias = walk.program.alias(plain)
        if alias is None:
            break
        text = alias
    return Unknown(f"`{written[:60]}` is not a known type")


# Parameters


def parameter(row: Row, given: Given, receiver: Any, walk: Walk) -> Any:
    """Follow a call that declares or reads a parameter; return its value."""
    node = node_for(row, given, receiver, walk)
    if "several" in row.values:
        return _several(given.at(row.position("several")), given.at(row.position("prefix")), node)
    name = given.at(row.position("name"))
    name = row.values.get("name_is", name) if name is MISSING else name
    if isinstance(name, Template):
        name = name.text
    if isinstance(name, Word) and node is not None and "default" in row.values:
        node.constants.add(name.name)
    if name in OWN_WORDS:
        value: Any = Unknown(f"the parameter `{name}` has the name of a variable of node files")
    elif not isinstance(name, str) or not name or node is None or BELOW in getattr(receiver, "members", ()):
        value = Unknown("the name of a parameter is not known")
    elif name in node.overrides and name not in node.changed:
        value = node.overrides[name]
    elif node.changed & {name, "*"}:
        value = Unknown(f"the program sets the parameter `{name[:60]}` itself", given.call.place)
    else:
        default = given.at(row.position("default"))
        default = row.values.get("default_is", default) if default is MISSING else default
        declare(node, name, number_of(default, walk) if isinstance(default, Word) else default)
        value = Template(f"${{{name}}}")
    into = given.expression(row.position("into"))
    if into is not None:
        assign(into, value, walk)
        return Unknown("whether a parameter is set")
    return value


def note_set(call: Call, receiver: Any, walk: Walk) -> None:
    """Note the parameters that a call sets before callbacks come: their values are not those of their defaults or of a launch file."""
    on = walk.frame.this if receiver is MISSING else receiver
    node = on.node if isinstance(on, Instance) else walk.current if isinstance(on, Unknown) else None
    if node is None or walk.in_callback:
        return
    made = [each.arguments for each in calls_in((Do(call, call.place),)) if last_part(call_name(each)) == "Parameter"]
    made += [each.items for each in call.arguments[:1] if isinstance(each, Items) and not made]  # `{name, value}`
    names = [evaluate(each[0], walk) for each in made if each]
    own = {each.name for each in names if isinstance(each, Word)} & node.constants
    known = {each if isinstance(each, str) else "*" for each in names if getattr(each, "name", "") not in own}
    node.changed |= known if names else {"*"}


def declare(node: NodeRecord, name: str, default: Any) -> None:
    """Note a parameter and its default, which is not known where two calls state different ones."""
    if isinstance(default, (Word, Instance)):
        default = (
            Unknown("its default is not known") if not isinstance(default, Word) or not _is_type(default) else MISSING
        )
    if default is None:
        default = MISSING
    known = node.parameters.get(name, MISSING)
    if default is MISSING or known is MISSING:
        node.parameters[name] = known if default is MISSING else default
    elif type(known) is not type(default) or known != default:
        node.parameters[name] = Unknown("its default differs from place to place")


def _is_type(word: Word) -> bool:
    return "PARAMETER_" in word.name or "Parameter.Type" in word.name


def _several(rows: Any, prefix: Any, node: NodeRecord | None) -> Any:
    if node is None or not isinstance(rows, list) or prefix not in {"", MISSING, None}:
        return Unknown("parameters that are not known")
    for row in rows:
        if isinstance(row, list) and row and isinstance(row[0], str):
            declare(node, row[0], row[1] if len(row) > 1 else MISSING)
    return Unknown("several parameters")


def default_of(value: Any) -> Any:
    """Return a default that a node file can write; the mark for none where it cannot."""
    if isinstance(value, _SIMPLE) and not (
        isinstance(value, list) and not all(isinstance(each, (str, int, float, bool)) for each in value)
    ):
        return value
    return MISSING


def library_of(instance: Instance, walk: Walk) -> list[str]:
    """Return the library classes that an object is of."""
    found = [instance.library] if instance.library else []
    for cls in lineage(instance.cls, walk):
        found += [
            without_arguments(base)
            for base in cls.bases
            if walk.program.find_class(base, cls.place.source, cls.name) is None
            or walk.table.node_class(without_arguments(base))
        ]
    return found
