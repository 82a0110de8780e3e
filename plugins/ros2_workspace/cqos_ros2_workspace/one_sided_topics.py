"""Topics with a side outside of the launch, and names that nearly agree with those inside."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

from cqos_core.model.settings import EVERY_OTHER
from cqos_core.model.spelling import typing_errors
from cqos_core.model.system import MESSAGE, PUBLISHER, SUBSCRIBER
from cqos_core.packs import normalise
from cqos_ros2.conventions import CONVENTIONS
from cqos_ros2.importers.workspace_codes import note
from cqos_ros2.names import without_namespace
from cqos_ros2.presets import PRESETS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.model.system import Endpoint, ImportNote
    from cqos_ros2_workspace.naming import Named
    from cqos_ros2_workspace.nodes.endpoint_templates import Filled
    from cqos_ros2_workspace.system_join import Join

    Found = tuple[Filled, Named, Endpoint]

_NAMED: Final = 3
_ELSEWHERE: Final = tuple(each.pattern for each in CONVENTIONS if each.external)


def open_ends(found: Join) -> Iterator[ImportNote]:
    """Yield topics whose partner is not in the launch; first those whose name nearly agrees with another topic."""
    topics: dict[str, dict[str, list[Found]]] = {}
    for node in found.nodes:
        for filled, named, endpoint in node.endpoints:
            if endpoint is not None and endpoint.kind == MESSAGE and endpoint.topic is not None:
                topics.setdefault(endpoint.topic, {}).setdefault(endpoint.role, []).append((filled, named, endpoint))
    opaque = any(node.opaque for node in found.nodes)
    for topic, sides in sorted(topics.items()):
        if len(sides) > 1 or any(fnmatchcase(topic, pattern) for pattern in _ELSEWHERE):
            continue
        role, members = next(iter(sides.items()))
        missing = PUBLISHER if role == SUBSCRIBER else SUBSCRIBER
        near = _near(topic, members, topics, missing, opaque=opaque)
        if near:
            filled, named, endpoint = near[1]
            does = "subscribes to" if role == SUBSCRIBER else "publishes"
            cause = f"the parameter `{filled.parameter}`" if named.rule is None else f"the remap `{named.rule.source}`"
            message = f"`{endpoint.participant}` {does} `{topic}`, as {cause} says, and nothing in the launch {_other(missing)} it"
            yield note("ROS973", message, endpoint.place, f"did you mean `{near[0]}`?")
        elif not all(filled.optional for filled, _, _ in members):
            yield note("ROS977", _open(topic, role, members), members[0][2].place)
    yield from _perhaps_meant(found, topics)


def _perhaps_meant(found: Join, topics: dict[str, dict[str, list[Found]]]) -> Iterator[ImportNote]:
    """Yield pairs of topics with one side each that differ in their namespace only, where a node that is not known may be the partner."""
    unknown = [node.placed.address for node in found.nodes if node.opaque]
    lonely: dict[tuple[str, str | None, str], list[Found]] = {}
    for topic, sides in topics.items() if unknown else ():
        (role, members), *others = sides.items()
        ends = [each for each in members if not each[0].optional]
        if ends and not others and not any(fnmatchcase(topic, pattern) for pattern in _ELSEWHERE):
            lonely.setdefault((without_namespace(topic), ends[0][2].type, role), []).append(ends[0])
    for (name, kind, role), subscribed in sorted(lonely.items(), key=str):
        published = lonely.get((name, kind, PUBLISHER), [])
        if role == SUBSCRIBER and len(subscribed) == len(published) == 1:
            (_, _, here), (_, _, there) = subscribed[0], published[0]
            message = (
                f"`{here.participant}` subscribes to `{here.topic}` and `{there.participant}` publishes `{there.topic}`: the names differ "
                f"only in their namespace, so they never meet; perhaps `{unknown[0]}`, of which nothing is known, publishes `{here.topic}`"
            )
            yield note("ROS984", message, here.place, f"if one topic is meant, remap `{here.topic}` to `{there.topic}`")


def _other(missing: str) -> str:
    return "publishes" if missing == PUBLISHER else "subscribes to"


def _near(
    topic: str, members: Sequence[Found], topics: dict[str, dict[str, list[Found]]], missing: str, *, opaque: bool
) -> tuple[str, Found] | None:
    """Return the topic that a parameter or a remap may mean, where endpoints match on it already."""
    stated = [each for each in members if each[1].rule is not None or each[0].named_at is not None]
    if not stated:
        return None
    types = {endpoint.type for _, _, endpoint in members}
    busy = [
        name
        for name, sides in topics.items()
        if len(sides) > 1 and any(endpoint.type in types for _, _, endpoint in sides.get(missing, ()))
    ]
    alike = [name for name in busy if name.casefold() == topic.casefold()]  # also of names too short for a typing error
    meant = next(iter(alike or typing_errors([topic], busy).get(topic, [])), None)
    if meant is None and missing == PUBLISHER and not opaque:
        same = [name for name in busy if without_namespace(name) == without_namespace(topic)]
        meant = same[0] if len(same) == 1 else None
    if meant is None or meant[-1:].isdigit() or topic[-1:].isdigit():
        return None
    return meant, stated[0]


def _open(topic: str, role: str, members: Sequence[Found]) -> str:
    """Return a line of the table of open ends."""
    endpoints = [endpoint for _, _, endpoint in members]
    names = list(dict.fromkeys(each.participant for each in endpoints))
    shown = ", ".join(names[:_NAMED]) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
    kinds = sorted({each.type for each in endpoints if each.type})
    typed = f" ({kinds[0]})" if len(kinds) == 1 else ""
    policies = list(dict.fromkeys(filter(None, map(_policies, endpoints))))
    asked = f": {'requests' if role == SUBSCRIBER else 'offers'} {'; '.join(policies)}" if policies else ""
    side = "from outside the launch" if role == SUBSCRIBER else "to outside the launch"
    return f"`{topic}`{typed} {side}, {shown}{asked}"


def _policies(endpoint: Endpoint) -> str:
    """Return the policies that decide about partners, as the node file states them."""
    if EVERY_OTHER in endpoint.settings:
        return ""
    values: dict[str, str] = {}
    for ref in endpoint.profiles:
        values |= dict(PRESETS[ref.name].settings) if ref.name in PRESETS else {}
    if not endpoint.profiles:
        values |= dict(PRESETS["default"].settings)
    for settings in (endpoint.settings, endpoint.overlay):
        values |= {name: normalise(each.text) for name, each in settings.items() if not each.unknown}
    said = [values.get(name, "") for name in ("reliability", "durability")]
    if set(said) == {"system_default"}:
        return "the default of the middleware"
    depth = values.get("depth", "0")
    return ", ".join([*filter(None, said), *([f"depth {depth}"] if depth != "0" else [])])
