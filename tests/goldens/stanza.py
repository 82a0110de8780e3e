"""Writes what C-QoS says of a system as lines that a reviewer reads: all that decides, and no English sentence.

Verdicts, codes, severities, members, places, values with their origins, and edits of fixes are here. Messages, reasons and help are
not: they may change without a golden changing.
"""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final, TypeAlias

from cqos_core import InputError, Place, Report, Severity, Verdict
from tests.goldens.folding import folded, listed, plain, variable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core import (
        Assumption,
        Changes,
        Counts,
        Edit,
        Endpoint,
        Fact,
        Finding,
        Group,
        Guarantee,
        PairReport,
        PolicyComparison,
        Remedy,
        Side,
        System,
    )

Lines: TypeAlias = "list[str]"
WIDTH: Final = 140
_UNCHOSEN: Final = {"preset default", "default"}
"""Origins of values that nobody chose."""


class Writer:
    """Writes what is said of one system.

    Attributes:
        source: the file that is meant where a place names none.
    """

    def __init__(self, source: str = "") -> None:
        self.source = source
        self._given: dict[str, str] = {}

    def report(self, report: Report) -> Lines:
        """Return a whole report."""
        found = [f"{report.verdict}: {self._counts(report)}", *_assumed(report.assumed)]
        sources = [each for each in report.sources if each != self.source]
        found += [f"read: {listed(sources)}"] if sources else []
        found += folded(map(self._group, report.groups))
        return wrapped([*found, *folded(map(self._finding, report.findings))])

    def changes(self, changes: Changes) -> Lines:
        """Return what an edit changed."""
        found = [f"now {_counted(changes.counts)}" if changes else "nothing changed"]
        for sign, groups in (("-", changes.removed_groups), ("+", changes.added_groups)):
            found += folded([[f"{sign} {line}" for line in each] for each in sorted(map(self._group, groups))])
        for sign, findings in (("-", changes.removed), ("+", changes.added)):
            found += folded([[f"{sign} {line}" for line in each] for each in sorted(map(self._finding, findings))])
        return wrapped(found)

    def endpoints(self, system: System) -> Lines:
        """Return the endpoints that were read, with what they state."""
        return wrapped(folded(map(self._endpoint, system.endpoints)))

    def finding(self, finding: Finding) -> Lines:
        """Return one finding."""
        return wrapped(self._finding(finding))

    def problems(self, error: InputError) -> Lines:
        """Return why an input was refused."""
        blocks = [[f"refused {each.code}{self._at(each.place)}"] for each in error.problems]
        return wrapped(folded(blocks))

    def pair(self, pair: PairReport, name: str) -> Lines:
        """Return an explained pair."""
        found = [f"pair {name}: {pair.verdict}", *(f"  {each}" for each in _assumed(pair.assumed))]
        stated = [each for each in pair.policies if not _by_default(each)]
        found += [f"  {each.policy}: {self._comparison(each)}" for each in stated]
        rest = ", ".join(f"{each.policy}={_default(each)}" for each in pair.policies if _by_default(each))
        found += [f"  default: {rest}"] if rest else []
        found += [f"  {name} = {value.partition(': ')[0]}" for name, value in pair.derived]
        given = [*_guarantees(pair.guarantees)]
        first = self._given.setdefault("\n".join(given), name)
        found += [f"  {each}" for each in given] if first == name else [f"  gets what {first} gets"]
        for hop in pair.hops:
            over = f" over {hop.bridge}" if hop.bridge else ""
            found.append(f"  hop {hop.protocol} {hop.topic}: {hop.publisher} -> {hop.subscriber} {hop.verdict}{over}")
            found += [f"    {each}" for each in _guarantees(hop.guarantees)]
        found += [f"  {self._finding(each)[0]}" for each in pair.findings]
        return wrapped(found)

    def _counts(self, report: Report) -> str:
        pairs = {verdict: sum(each.pairs for each in report.groups if each.verdict is verdict) for verdict in Verdict}
        accepted = sum(each.accepted is not None for each in report.findings)
        more = {"unmatched": report.unmatched, "hypothetical": report.hypothetical, "accepted": accepted}
        severities = {severity: report.count(severity) for severity in Severity}
        found = _parts(report.endpoints, report.topics, pairs, severities, more)
        return f"{found}, part of a system" if report.partial else found

    def _endpoint(self, endpoint: Endpoint) -> Lines:
        label = f" labelled {variable(endpoint.label)}" if endpoint.label is not None else ""
        like = f" (of {variable(endpoint.template)})" if endpoint.template is not None else ""
        topic = "no topic" if endpoint.topic is None else variable(endpoint.topic)
        ends = f"{variable(endpoint.id)} of {variable(endpoint.participant)}{label}{like}"
        profiles = [f"{each.name}{self._at(each.place)}" for each in endpoint.profiles]
        found = [
            f"{endpoint.role} {ends} on {topic}{self._at(endpoint.place)}",
            *(f"  like {each}" for each in profiles),
        ]
        for word, settings in (("", endpoint.settings), ("need ", endpoint.needs), ("overlay ", endpoint.overlay)):
            found += [f"  {word}{name} = {each.text}{self._at(each.place)}" for name, each in settings.items()]
        return found

    def _group(self, group: Group) -> Lines:
        codes = f" {' '.join(group.codes)}" if group.codes else ""
        internal = f" ({group.internal} internal)" if group.internal else ""
        return [
            f"{group.protocol} {variable(group.topic)}: {group.verdict}{codes}{internal}",
            f"  {listed(group.publishers)} -> {listed(group.subscribers)}",
        ]

    def _finding(self, finding: Finding) -> Lines:
        verdict = f" {finding.verdict}" if finding.verdict else ""
        topic = f" {variable(finding.topic)}" if finding.topic is not None else ""
        topics = f", {listed(finding.more_topics)}" if finding.more_topics else ""
        pairs = f" ({finding.pairs} pairs)" if finding.pairs > 1 else ""
        accepted = " accepted" if finding.accepted is not None else ""
        codes = f" {' '.join((finding.code, *finding.more_codes))}"
        found = [f"{finding.severity}{codes}{verdict}{topic}{topics}{pairs}{accepted}{self._at(finding.place)}"]
        found += [f"  with {world}: {verdict}" for world, verdict in sorted(finding.worlds.items())]
        found += [f"  {line}" for side in finding.sides for line in self._side(side)]
        return found + [f"  {line}" for remedy in finding.remedies for line in self._remedy(remedy)]

    def _side(self, side: Side) -> Lines:
        like = f" (of {listed(side.templates)})" if side.templates else ""
        found = [f"{side.role} {listed(side.members)}{like}{self._at(side.place)}"]
        return found + [f"  {each.policy} = {self._fact(each, side.place)}" for each in side.facts]

    def _fact(self, fact: Fact, where: Place | None = None) -> str:
        return f"{fact.value} ({fact.origin}{self._at(fact.place) if fact.place != where else ''})"

    def _remedy(self, remedy: Remedy) -> Lines:
        counts = {"mends": remedy.mends, "breaks": remedy.breaks}
        said = [f"{word} {'?' if count is None else count}" for word, count in counts.items() if count != 0]
        said += ["needs code"] if remedy.kind != "configuration" else []
        said += ["weakens"] if remedy.weakens else []
        said += ["costs"] if remedy.costs else []
        more = f" ({', '.join(said)})" if said else ""
        found = [f"fix {remedy.role} {listed(remedy.members)}: {remedy.policy} = {remedy.value}{more}"]
        return found + folded([f"  edit{self._edit(each)}"] for each in remedy.edits)

    def _edit(self, edit: Edit) -> str:
        change = f"+ {edit.new}" if edit.old is None else f"{edit.old} -> {edit.new}"
        return f"{self._at(edit.place)} {edit.attribute}: {change}"

    def _comparison(self, compared: PolicyComparison) -> str:
        ends = [self._fact(each) if each is not None else "-" for each in (compared.offered, compared.requested)]
        verdict = f" {compared.verdict}" if compared.verdict else ""
        rules = f" {' '.join(compared.rules)}" if compared.rules else ""
        return f"{' | '.join(ends)}{verdict}{rules}"

    def _at(self, place: Place | None) -> str:
        if place is None:
            return ""
        source = f"{place.source}:" if place.source != self.source else ""
        where = ":".join(str(each) for each in (place.line, place.column) if each is not None)
        element = f"#{place.element}" if place.element is not None else ""
        path = f" in {place.path}" if place.path is not None else ""
        return f" at {source}{variable(where + element) or ('start' if not source else '')}{path}"


def spoken(settings: Mapping[str, object]) -> str:
    """Return settings in one line."""
    return ", ".join(f"{name}={value}" for name, value in settings.items()) or "nothing"


def wrapped(lines: Iterable[str]) -> Lines:
    """Return lines of which none is much longer than others; what goes on stands further right."""
    found: Lines = []
    for line in map(plain, lines):
        indent = " " * (len(line) - len(line.lstrip()) + 6)
        found += textwrap.wrap(line, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return found


def _parts(
    endpoints: int,
    topics: int,
    pairs: Mapping[Verdict, int],
    severities: Mapping[Severity, int],
    more: Mapping[str, int],
) -> str:
    found = [f"{endpoints} endpoints", f"{topics} topics", f"{sum(pairs.values())} pairs"]
    kinds = [f"{pairs[verdict]} {verdict}" for verdict in Verdict if pairs.get(verdict)]
    found[-1] += f" ({', '.join(kinds)})" if kinds else ""
    found += [f"{severities[severity]} {severity}s" for severity in Severity if severities.get(severity)]
    return ", ".join([*found, *(f"{count} {word}" for word, count in more.items() if count)])


def _counted(counts: Counts) -> str:
    found = _parts(counts.endpoints, counts.topics, counts.pairs, counts.findings, {"unmatched": counts.unmatched})
    return f"{counts.verdict}: {found}"


def _assumed(assumptions: Iterable[Assumption]) -> Lines:
    return [f"assumed {each.option}: {', '.join(each.values) or '-'}" for each in assumptions]


def _by_default(compared: PolicyComparison) -> bool:
    """Whether nobody chose either value, and nothing speaks against them."""
    facts = [each for each in (compared.offered, compared.requested) if each is not None]
    return all(each.origin in _UNCHOSEN for each in facts) and compared.verdict in {None, Verdict.COMPATIBLE}


def _default(compared: PolicyComparison) -> str:
    return "|".join(dict.fromkeys(each.value if each else "-" for each in (compared.offered, compared.requested)))


def _guarantees(guarantees: Sequence[Guarantee]) -> Iterator[str]:
    """Yield what is given of each guarantee; under a fault, the rules that take or leave more of it than without."""
    for each in guarantees:
        codes = [*dict.fromkeys(code for code, _ in each.lost)]
        faults: dict[str, list[str]] = {}
        for cell in each.cells:
            lost = [*dict.fromkeys(code for code, _ in cell.lost)]
            more = [f"+{code}" for code in lost if code not in codes] + [
                f"-{code}" for code in codes if code not in lost
            ]
            faults.setdefault(" ".join((cell.value, *more)), []).append(cell.fault)
        survives = f"; survives {', '.join(each.survives)}" if each.survives else ""
        found = "".join(f"; {', '.join(names)}: {given}" for given, names in faults.items())
        yield f"gets {each.word}: {' '.join((each.value, *codes))}{survives}{found}"
