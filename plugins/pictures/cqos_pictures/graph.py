"""The graph of a system: participants, bridges, topics and pairs, bounded to a readable size."""

from __future__ import annotations

from dataclasses import field
from itertools import product, zip_longest
from typing import TYPE_CHECKING, Final

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator, Mapping, Sequence

    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_pictures.picture_parts import Picture, PicturedEnd

MOST_TOPICS: Final = 24
"""The most topics that are nodes; with more, lines connect participants directly."""
_MOST_OWNERS: Final = 60
_MOST_LINES: Final = 240

Key = tuple[str, str]
"""Kind and name of a node: ``participant``, ``bridge`` or ``topic``."""
_Loud = tuple[int, Severity]
"""The number of a finding in its report, with its severity."""
_NONE: Final = frozenset[_Loud]()
_LOUD: Final[Mapping[Verdict | None, Severity]] = {
    Verdict.INCOMPATIBLE: Severity.ERROR,
    Verdict.UNKNOWN: Severity.WARNING,
}


@dataclass(frozen=True, slots=True)
class DrawnNode:
    """A participant, a bridge or a topic; ``verdict`` is the worst of its pairs, None without any."""

    kind: str
    name: str
    detail: str
    verdict: Verdict | None

    @property
    def key(self) -> Key:
        """Its key in lines."""
        return self.kind, self.name


@dataclass(frozen=True, slots=True)
class Line:
    """Samples from one node to another.

    Attributes:
        topics: the topics between two participants, those of the worst verdict first.
        worst: how many of them have the verdict of the line.
    """

    source: Key
    target: Key
    verdict: Verdict | None
    topics: tuple[str, ...] = ()
    worst: int = 0


@dataclass(frozen=True, slots=True)
class DrawnGraph:
    """Nodes and lines of a drawing, and notes on what is left out."""

    nodes: tuple[DrawnNode, ...]
    lines: tuple[Line, ...]
    left_out: tuple[str, ...] = ()


@dataclass(slots=True)
class Usage:
    """The use of topics by owners (participants and bridges).

    Attributes:
        roles: of an owner on a topic; ``ends`` has every endpoint by its id.
        verdicts: the worst, by owner and topic, and by owner, topic and role.
        owners, topics: with the worst verdict of each, in the order of their names.
        wrong: owners and topics with a verdict other than compatible, and those that an error or a warning names; the
            severity is that of the worst.
        sends, takes: the errors and warnings that name an owner or a topic where samples leave it, and where they arrive.
    """

    ends: Mapping[str, PicturedEnd]
    roles: dict[tuple[Key, str], set[str]] = field(default_factory=dict)
    verdicts: dict[tuple[Key, str, str], Verdict | None] = field(default_factory=dict)
    owners: dict[Key, Verdict | None] = field(default_factory=dict)
    topics: dict[str, Verdict | None] = field(default_factory=dict)
    protocols: dict[Key, set[str]] = field(default_factory=dict)
    wrong: dict[Key, Severity] = field(default_factory=dict)
    sends: dict[Key, set[_Loud]] = field(default_factory=dict)
    takes: dict[Key, set[_Loud]] = field(default_factory=dict)

    def note(self, end: PicturedEnd, topic: str, verdict: Verdict | None) -> None:
        """Add one endpoint on one topic, with the worst verdict of its pairs there."""
        owner = owner_of(end)
        self.roles.setdefault((owner, topic), set()).add(end.role)
        key = (owner, topic, end.role)
        self.verdicts[key] = worse(self.verdicts.get(key), verdict)
        self.owners[owner] = worse(self.owners.get(owner), verdict)
        self.topics[topic] = worse(self.topics.get(topic), verdict)
        self.protocols.setdefault(owner, set()).add(end.protocol)

    def note_finding(self, finding: Finding, loud: _Loud) -> None:
        """Record the lines of the endpoints of a finding."""
        for end in self._ends_of(finding):
            way = (owner_of(end), ("topic", end.topic))
            source, target = way if end.role == PUBLISHER else way[::-1]
            self.sends.setdefault(source, set()).add(loud)
            self.takes.setdefault(target, set()).add(loud)

    def named(self, finding: Finding) -> list[Key]:
        """Return the owners and topics that a finding is about, each once."""
        ends = self._ends_of(finding)
        members = [member for side in finding.sides for member in side.members]
        owners = [owner_of(end) for end in ends]
        owners += [(kind, member) for member in members for kind in ("participant", "bridge")]
        topics = [finding.topic, *finding.more_topics, *(end.topic for end in ends)]
        found = [key for key in owners if key in self.owners]
        found += [("topic", topic) for topic in topics if topic in self.topics]
        return [*dict.fromkeys(found)]

    def _ends_of(self, finding: Finding) -> list[PicturedEnd]:
        return [self.ends[member] for side in finding.sides for member in side.members if member in self.ends]


def owner_of(end: PicturedEnd) -> Key:
    """Return the node that an endpoint belongs to."""
    return ("bridge" if end.is_bridge else "participant"), end.owner


def worse(one: Verdict | None, other: Verdict | None) -> Verdict | None:
    """Return the worse of two verdicts; None is no verdict."""
    return max((each for each in (one, other) if each is not None), key=lambda each: each.rank, default=None)


def ranked(found: Mapping[str, Verdict | None] | Mapping[Key, Verdict | None]) -> list[tuple[object, Verdict | None]]:
    """Return items by verdict, the worst first, then by name."""
    return sorted(found.items(), key=lambda each: (-rank(each[1]), each[0]))


def rank(verdict: Verdict | None) -> int:
    """Return how bad a verdict is; None is less than all."""
    return -1 if verdict is None else verdict.rank


def usage(report: Report, picture: Picture) -> Usage:
    """Return the use of topics by owners in a report."""
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
    judged = (*found.owners.items(), *((("topic", name), verdict) for name, verdict in found.topics.items()))
    named = [(key, _LOUD[verdict]) for key, verdict in judged if verdict in _LOUD]
    for number, finding in enumerate(report.findings):
        if is_wrong(finding):
            found.note_finding(finding, (number, finding.severity))
            named += [(key, finding.severity) for key in found.named(finding)]
    found.wrong |= sorted(named, key=lambda each: -each[1].rank)
    return found


def is_wrong(finding: Finding) -> bool:
    """Whether a finding is an error or a warning that nobody accepted."""
    return finding.accepted is None and finding.severity is not Severity.NOTE


def graph_of(report: Report, picture: Picture, used: Usage | None = None) -> DrawnGraph:
    """Return the graph of a system, bounded: its worst owners, and topics as nodes if they are few."""
    used = used or usage(report, picture)
    owners = list(dict.fromkeys((*_partners(report, used), *sorted(used.owners))))
    kept = dict.fromkeys(sorted(owners[:_MOST_OWNERS]))
    left_out = [f"{len(owners) - _MOST_OWNERS} participants are not drawn"] if len(owners) > _MOST_OWNERS else []
    nodes = [_node(each, used, picture) for each in kept]
    if len(used.topics) <= MOST_TOPICS:
        nodes += [DrawnNode("topic", name, "", verdict) for name, verdict in sorted(used.topics.items())]
        lines = list(_lines_over_topics(used, kept))
    else:
        lines = sorted(_lines_between(report, used, kept), key=lambda each: (-rank(each.verdict), -len(each.topics)))
    joined = {end for line in lines[:_MOST_LINES] for end in (line.source, line.target)}
    if left_out:
        alone = [node for node in nodes if node.key not in joined]
        nodes = [node for node in nodes if node.key in joined]
        left_out = [f"{len(owners) - _MOST_OWNERS + len(alone)} participants are not drawn"]
    if len(lines) > _MOST_LINES:
        left_out.append(f"{len(lines) - _MOST_LINES} connections are not drawn")
    lines = sorted(lines[:_MOST_LINES], key=lambda each: (each.source, each.target))
    return DrawnGraph(tuple(nodes), tuple(lines), tuple(left_out))


def _partners(report: Report, used: Usage) -> Iterator[Key]:
    """Yield owners by their worst pairs; both ends of a pair follow each other."""
    for group in sorted(report.groups, key=lambda each: -rank(each.verdict)):
        for pair in zip_longest(group.publishers, group.subscribers):
            yield from (owner_of(used.ends[name]) for name in pair if name in used.ends)


def stages(graph: DrawnGraph, used: Usage) -> list[tuple[str, DrawnGraph]]:
    """Return growing parts of the graph, each with its name: errors, warnings, neighbours, everything."""
    loud = _wrong_part(graph, used, {Severity.ERROR})
    wrong = _wrong_part(graph, used, {*_LOUD.values()})
    core = {node.key for node in wrong.nodes}
    beside = [line for line in graph.lines if line.source in core or line.target in core]
    near = _part(graph, core | _ends(beside), beside)
    grown = [("errors", loud), ("warnings", wrong), ("neighbours", near)]
    # Empty stages, and stages equal to the one before or to the whole graph, are no choice.
    parts = [_part(graph, (), ()), *(part for _, part in grown)]
    kept = [each for each, before in zip(grown, parts, strict=False) if each[1] not in (before, graph)]
    return [*kept, ("everything", graph)] if graph.nodes else []


def _wrong_part(graph: DrawnGraph, used: Usage, severities: set[Severity]) -> DrawnGraph:
    """Return the nodes and lines with verdicts or findings of some severities."""
    lines = []
    for line in graph.lines:
        found = {each[1] for each in used.sends.get(line.source, _NONE) & used.takes.get(line.target, _NONE)}
        if _LOUD.get(line.verdict) in severities or found & severities:
            lines.append(line)
    named = {key for key, severity in used.wrong.items() if severity in severities}
    return _part(graph, named | _ends(lines), lines)


def _part(graph: DrawnGraph, keys: Container[Key], lines: Sequence[Line]) -> DrawnGraph:
    return DrawnGraph(tuple(node for node in graph.nodes if node.key in keys), tuple(lines), graph.left_out)


def _ends(lines: Iterable[Line]) -> set[Key]:
    return {end for line in lines for end in (line.source, line.target)}


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
