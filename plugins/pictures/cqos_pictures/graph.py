"""The graph of a system: owners of endpoints, their topics, and the pairs on them; as much of it as a person can read."""

from __future__ import annotations

from collections import Counter
from dataclasses import field
from itertools import product
from typing import TYPE_CHECKING, Final

from cqos_core.model.dataclass import dataclass
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from cqos_core.model.report import Report, Verdict
    from cqos_pictures.picture_parts import Picture, PicturedEnd

MOST_TOPICS: Final = 24
"""Up to so many topics, each is a node; of more, lines between participants count them."""
_MOST_OWNERS: Final = 60
_MOST_LINES: Final = 240

Key = tuple[str, str]
"""Kind and name of a node: ``participant``, ``bridge`` or ``topic``."""


@dataclass(frozen=True, slots=True)
class DrawnNode:
    """A participant, a bridge or a topic; ``verdict`` is the worst of its pairs, None without any."""

    kind: str
    name: str
    detail: str
    verdict: Verdict | None

    @property
    def key(self) -> Key:
        """What lines name it by."""
        return self.kind, self.name


@dataclass(frozen=True, slots=True)
class Line:
    """Samples go from one node to another.

    Attributes:
        topics: where no node between the two is the topic, those of the worst verdict first.
        worst: how many of them have the verdict of the line.
    """

    source: Key
    target: Key
    verdict: Verdict | None
    topics: tuple[str, ...] = ()
    worst: int = 0


@dataclass(frozen=True, slots=True)
class DrawnGraph:
    """What is drawn, and what is left out, in words."""

    nodes: tuple[DrawnNode, ...]
    lines: tuple[Line, ...]
    left_out: tuple[str, ...] = ()


@dataclass(slots=True)
class Usage:
    """What each owner does on each topic.

    Attributes:
        roles: of an owner on a topic; ``ends`` has every endpoint by its id.
        verdicts: the worst, by owner and topic, and by owner, topic and role.
        owners, topics: with the worst verdict of each, in the order of their names.
    """

    ends: Mapping[str, PicturedEnd]
    roles: dict[tuple[Key, str], set[str]] = field(default_factory=dict)
    verdicts: dict[tuple[Key, str, str], Verdict | None] = field(default_factory=dict)
    owners: dict[Key, Verdict | None] = field(default_factory=dict)
    topics: dict[str, Verdict | None] = field(default_factory=dict)
    protocols: dict[Key, set[str]] = field(default_factory=dict)
    counts: Counter[Key] = field(default_factory=Counter)

    def note(self, end: PicturedEnd, topic: str, verdict: Verdict | None) -> None:
        """Count one endpoint on one topic, with the worst verdict of its pairs there."""
        owner = owner_of(end)
        self.roles.setdefault((owner, topic), set()).add(end.role)
        key = (owner, topic, end.role)
        self.verdicts[key] = worse(self.verdicts.get(key), verdict)
        self.owners[owner] = worse(self.owners.get(owner), verdict)
        self.topics[topic] = worse(self.topics.get(topic), verdict)
        self.protocols.setdefault(owner, set()).add(end.protocol)
        self.counts[owner] += 1


def owner_of(end: PicturedEnd) -> Key:
    """Return the node that an endpoint belongs to."""
    return ("bridge" if end.is_bridge else "participant"), end.owner


def worse(one: Verdict | None, other: Verdict | None) -> Verdict | None:
    """Return the worse of two verdicts; None is no verdict."""
    return max((each for each in (one, other) if each is not None), key=lambda each: each.rank, default=None)


def ranked(found: Mapping[str, Verdict | None] | Mapping[Key, Verdict | None]) -> list[tuple[object, Verdict | None]]:
    """Return what was found, the worst first, then by name."""
    return sorted(found.items(), key=lambda each: (-_rank(each[1]), each[0]))


def _rank(verdict: Verdict | None) -> int:
    return -1 if verdict is None else verdict.rank


def usage(report: Report, picture: Picture) -> Usage:
    """Return what each owner does on each topic of a report."""
    found = Usage({each.id: each for each in picture.ends})
    paired = set()
    for group in report.groups:
        for name in (*group.publishers, *group.subscribers):
            if name in found.ends:
                paired.add(name)
                found.note(found.ends[name], group.topic, group.verdict)
    for end in picture.ends:
        if end.id not in paired:
            found.note(end, end.topic, None)
    return found


def graph_of(report: Report, picture: Picture, used: Usage | None = None) -> DrawnGraph:
    """Return the graph of a system, bounded: its worst owners, and topics as nodes if they are few."""
    used = used or usage(report, picture)
    owners = sorted(used.owners, key=lambda each: (-_rank(used.owners[each]), -used.counts[each], each))
    kept = dict.fromkeys(sorted(owners[:_MOST_OWNERS]))
    left_out = [f"{len(owners) - _MOST_OWNERS} participants are not drawn"] if len(owners) > _MOST_OWNERS else []
    nodes = [_node(each, used, picture) for each in kept]
    if len(used.topics) <= MOST_TOPICS:
        nodes += [DrawnNode("topic", name, "", verdict) for name, verdict in sorted(used.topics.items())]
        lines = list(_lines_over_topics(used, kept))
    else:
        lines = sorted(_lines_between(report, used, kept), key=lambda each: (-_rank(each.verdict), -len(each.topics)))
    joined = {end for line in lines[:_MOST_LINES] for end in (line.source, line.target)}
    if left_out:
        alone = [node for node in nodes if node.key not in joined]
        nodes = [node for node in nodes if node.key in joined]
        left_out = [f"{len(owners) - _MOST_OWNERS + len(alone)} participants are not drawn"]
    if len(lines) > _MOST_LINES:
        left_out.append(f"{len(lines) - _MOST_LINES} connections are not drawn")
    lines = sorted(lines[:_MOST_LINES], key=lambda each: (each.source, each.target))
    return DrawnGraph(tuple(nodes), tuple(lines), tuple(left_out))


def _node(owner: Key, used: Usage, picture: Picture) -> DrawnNode:
    kind, name = owner
    count = picture.instances.get(name, 1) if kind == "participant" else 1
    detail = ", ".join(sorted(used.protocols[owner]))
    if kind == "bridge":
        detail = f"bridge, {detail}"
    return DrawnNode(kind, name, f"{detail}, {count} instances" if count > 1 else detail, used.owners[owner])


def _lines_over_topics(used: Usage, kept: Iterable[Key]) -> Iterator[Line]:
    for (owner, topic, role), verdict in sorted(used.verdicts.items(), key=lambda each: each[0]):
        if owner in kept:
            ends = (owner, ("topic", topic))
            yield Line(*(ends if role == PUBLISHER else ends[::-1]), verdict)


def _lines_between(report: Report, used: Usage, kept: Iterable[Key]) -> Iterator[Line]:
    found: dict[tuple[Key, Key], dict[str, Verdict | None]] = {}
    for group in report.groups:
        sources, targets = (
            {owner for name in names if name in used.ends and (owner := owner_of(used.ends[name])) in kept}
            for names in (group.publishers, group.subscribers)
        )
        for pair in product(sources, targets):
            topics = found.setdefault(pair, {})
            topics[group.topic] = worse(topics.get(group.topic), group.verdict)
    for (source, target), topics in found.items():
        # Topics of the worst verdict come first: they name the line.
        names = [str(name) for name, _ in ranked(topics)]
        worst = topics[names[0]]
        yield Line(source, target, worst, tuple(names), sum(each is worst for each in topics.values()))
