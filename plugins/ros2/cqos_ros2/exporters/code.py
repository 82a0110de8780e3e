"""What the exporters of code share: which endpoint becomes what, under which name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING

from cqos_core.model.system import SUBSCRIBER
from cqos_ros2.exporters.values import QOS, NoValueError, Value, effective, is_rmw_default, kind_of, ros_endpoints
from cqos_ros2.policies import LIFESPAN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.files.export import ExportEndpoint
    from cqos_core.model.system import System
    from cqos_core.packs.export import ExportContext
    from cqos_core.resolving.resolved_endpoint import Resolved

_PLAIN = {"message", "service_server", "service_client"}


@dataclass(frozen=True, slots=True)
class Snippet:
    """The QoS of one endpoint.

    Attributes:
        name: a legal identifier, unique in its file.
        about: which endpoint it is, one line.
        values: by the policy's name, all that has to be said; what is left out is as ROS 2 has it by default.
    """

    name: str
    about: str
    values: dict[str, Value]


def snippets(system: System, context: ExportContext, notes: dict[str, None]) -> Iterator[Snippet]:
    """Yield a snippet for each endpoint; note what code cannot express."""
    names: set[str] = set()
    for each in ros_endpoints(system, context, notes):
        if not context.wants(each.id):
            continue
        if each.endpoint.kind not in _PLAIN:
            notes[f"`{each.id}` is {kind_of(each)}, which has a profile for each of its topics and services"] = None
            continue
        part = each.parts[0]
        node = part.pack.topic_matching.address(part.endpoint.participant, part.participant.texts)
        kind = part.endpoint.role if each.whole is not None else each.endpoint.kind.replace("_", " ")
        topic = part.key if each.whole is not None and part.key else each.endpoint.topic or ""
        name = identifier(f"{node}_{kind}_{topic}", names)
        yield Snippet(name, f"{kind} of {topic} in {node} ({each.id})", values_of(each, part, notes))


def identifier(text: str, taken: set[str]) -> str:
    """Return the nearest legal identifier that is not taken; there are letters in every text, those of the kind."""
    name = re.sub(r"[^0-9a-z]+", "_", text.lower()).strip("_")
    name = f"qos_{name}" if name[0].isdigit() else name
    names = (name if number == 1 else f"{name}_{number}" for number in count(1))
    chosen = next(each for each in names if each not in taken)
    taken.add(chosen)
    return chosen


def values_of(each: ExportEndpoint, part: Resolved, notes: dict[str, None]) -> dict[str, Value]:
    """Return the values that code has to say; note those that it cannot."""
    found = {}
    for policy in QOS:
        try:
            value = effective(part, policy)
        except NoValueError as reason:
            notes[f"`{each.id}`: {policy.name} is as by default: {reason}"] = None
            continue
        if is_rmw_default(value):
            continue
        if policy is LIFESPAN and part.endpoint.role == SUBSCRIBER and each.whole is not None:
            notes[f"`{each.id}`: lifespan is left out, it has no effect on a subscription"] = None
            continue
        found[policy.name] = value
    return found


def comment_text(text: str) -> str:
    """Return a text that can stand in a comment of one line: printable, and nothing that would continue the line."""
    plain = text if text.isprintable() else text.encode("unicode_escape").decode("ascii")
    return f"{plain}." if plain.endswith("\\") else plain
