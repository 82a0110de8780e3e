"""Writes files for `--qos-profile-overrides-path`: with which QoS `ros2 bag` plays or records the topics of a system."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from cqos_core.files.export import Exported
from cqos_core.files.yaml_text import Block, Raw, document
from cqos_core.model.system import PUBLISHER
from cqos_core.packs import ENDPOINT, INFINITE, is_plain
from cqos_ros2.exporters.values import NoValueError, Value, effective, kind_of, ros_endpoints
from cqos_ros2.importers.rosbag2 import NODES
from cqos_ros2.names import is_legal
from cqos_ros2.policies import (
    AVOID_CONVENTIONS,
    DEADLINE,
    DEPTH,
    DURABILITY,
    HISTORY,
    LEASE,
    LIFESPAN,
    LIVELINESS,
    RELIABILITY,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_core.files.export import ExportContext
    from cqos_core.files.yaml_text import Node
    from cqos_core.model.system import System
    from cqos_core.packs import Policy
    from cqos_core.resolving.resolved import Resolved

PLAYER: Final = "player"
RECORDER: Final = "recorder"
_SECOND: Final = 1_000_000_000
_HEADS: Final = {
    PLAYER: "ros2 bag play BAG --qos-profile-overrides-path FILE: offers what every subscription here asks for,",
    RECORDER: "ros2 bag record TOPICS --qos-profile-overrides-path FILE: requests what every publisher here offers,",
}


@dataclass(slots=True)
class _Topic:
    """The endpoints of one topic; ``wanted``: write it; ``in_bag``: `ros2 bag` is one of them."""

    publishers: list[Resolved] = field(default_factory=list)
    subscriptions: list[Resolved] = field(default_factory=list)
    wanted: bool = False
    in_bag: bool = False


def write(system: System, context: ExportContext) -> Exported:
    """Write one profile for each topic, of a system with a bag for each that is in it.

    The setting ``side`` says whether the player or the recorder takes them.
    """
    side = context.settings.get("side", PLAYER)
    notes: dict[str, None] = {}
    topics = _topics(system, context, notes)
    profiles: dict[str, Node] = {}
    with_bag = any(topic.in_bag for topic in topics.values())
    for name, topic in sorted(topics.items()):
        if not topic.wanted:
            continue
        if with_bag and not topic.in_bag:
            if context.changed is not None:
                notes[f"`{name}` is not in the bag, so there is nothing to override"] = None
            continue
        parts = topic.publishers if side == RECORDER else [*topic.publishers, *topic.subscriptions]
        if not parts:
            notes[f"`{name}` has no publisher here, so it is not known what a recorder may request"] = None
            continue
        profiles[name] = Block(_profile(name, parts, side, notes))
    head = [_HEADS[side], "and keeps as many samples as any of them."]
    return Exported(document(Block(profiles), head) if profiles else "", len(profiles), tuple(notes))


def _topics(system: System, context: ExportContext, notes: dict[str, None]) -> dict[str, _Topic]:
    found: dict[str, _Topic] = {}
    for each in ros_endpoints(system, context, notes):
        part, wanted = each.whole, context.wants(each.id)
        if part is None:
            if wanted:
                notes[f"`{each.id}` is {kind_of(each)}: overrides are of topics only"] = None
            continue
        if part.key is None or not is_legal(part.key):
            if wanted:
                notes[f"`{each.id}`: topic `{part.shown}` has no legal name"] = None
            continue
        topic = found.setdefault(part.key, _Topic())
        (topic.publishers if part.endpoint.role == PUBLISHER else topic.subscriptions).append(part)
        topic.wanted |= wanted
        topic.in_bag |= part.endpoint.participant == NODES[context.settings.get("side", PLAYER)]
    return found


def _profile(name: str, parts: Sequence[Resolved], side: str, notes: dict[str, None]) -> dict[str, Node]:
    strongest = side == PLAYER
    found: dict[str, Node] = dict(_history(parts))
    for policy in (RELIABILITY, DURABILITY, LIVELINESS):
        word = _kind(policy, parts, strongest=strongest)
        if policy is not LIVELINESS or word != policy.default:
            found[policy.name] = Raw(word)
    for policy in (DEADLINE, LEASE):
        number = _limit(policy, parts, shortest=strongest)
        if number < INFINITE:
            found[policy.name] = _duration(number)
    if strongest:
        lifespan = _limit(LIFESPAN, [part for part in parts if part.endpoint.role == PUBLISHER], shortest=False)
        if lifespan < INFINITE:
            found[LIFESPAN.name] = _duration(lifespan)
    avoiding = {value.number for part in parts if (value := _said(part, AVOID_CONVENTIONS)) is not None} or {0}
    if avoiding == {1}:
        found[AVOID_CONVENTIONS.name] = Raw("true")
    elif len(avoiding) > 1:
        notes[f"`{name}`: its endpoints differ in {AVOID_CONVENTIONS.name}, which is left out"] = None
    return found


def _history(parts: Iterable[Resolved]) -> dict[str, Node]:
    """Keep what the one keeps that keeps most; a depth is needed, whatever the history."""
    histories = {value.word for part in parts if (value := _said(part, HISTORY)) is not None}
    depths = [value.number for part in parts if (value := _said(part, DEPTH)) is not None]
    history = "keep_all" if "keep_all" in histories else "keep_last"
    depth = max(depths, default=0) or int(str(DEPTH.default))
    return {HISTORY.name: Raw(history), DEPTH.name: Raw(str(depth))}


def _kind(policy: Policy, parts: Iterable[Resolved], *, strongest: bool) -> str:
    """The strongest or weakest value of an enumeration; one that is not known may be that."""
    names = [policy.domain.format(rank) for rank in policy.domain.candidates()]
    extreme = names[-1] if strongest else names[0]
    words = [_word(part, policy, names) or extreme for part in parts]
    return (max if strongest else min)(words, key=names.index)


def _word(part: Resolved, policy: Policy, names: Sequence[str]) -> str | None:
    """The value of an enumeration: as stated, or what the stated word means under the options; None if it is open."""
    said = _said(part, policy)
    if said is not None and said.word in names:
        return said.word
    value = part.profile.values[part.pack.vocabulary.indices[ENDPOINT, policy.name]]
    return policy.domain.format(value) if said is not None and is_plain(value) else None


def _limit(policy: Policy, parts: Iterable[Resolved], *, shortest: bool) -> int:
    """The shortest or longest duration; one that is not specified, or not known, is infinite."""
    numbers = [
        INFINITE if value is None or value.number in {0, INFINITE - 1} else value.number
        for value in (_said(part, policy) for part in parts)
    ]
    return (min if shortest else max)(numbers, default=INFINITE)


def _said(part: Resolved, policy: Policy) -> Value | None:
    """The value of a policy; None where it is not known."""
    try:
        return effective(part, policy)
    except NoValueError:
        return None


def _duration(nanoseconds: int) -> dict[str, Node]:
    seconds, rest = divmod(nanoseconds, _SECOND)
    return {"sec": Raw(str(seconds)), "nsec": Raw(str(rest))}
