"""Groups findings by cause for text formats. Formats for programs list each finding."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.formatters import phrases
from cqos_core.formatters.terminal import clean
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Verdict
from cqos_core.model.grouping import grouped
from cqos_core.model.regular_expressions import regular_expression

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from cqos_core.formatters.places import Places
    from cqos_core.model.finding import Finding, Side
    from cqos_core.model.settings import Place
    from cqos_core.model.style import Style

_NAMED: Final = 3
"""More places than this are only counted."""
_ENDS: Final = frozenset({"publisher", "subscriber"})
_STATED: Final = ("explicit", "overlay", "profile ")
_CAUSE: Final = {"CQ205": ", which ", "CQ217": " is not known: "}
"""The words before the shared cause in messages of these codes."""
_OPTION: Final = regular_expression(r"option \S+ is not set$")


@dataclass(frozen=True, slots=True)
class Cause:
    """Findings of one cause, in the order of the report, the worst first."""

    findings: tuple[Finding, ...]

    @property
    def first(self) -> Finding:
        """The finding that stands for all."""
        return self.findings[0]

    @property
    def more(self) -> tuple[Finding, ...]:
        """The other findings."""
        return self.findings[1:]

    @property
    def helps(self) -> list[str]:
        """The help of all findings, one sentence each."""
        return list(dict.fromkeys(sentence for finding in self.findings for sentence in phrases.helps(finding)))


def causes(findings: Sequence[Finding], style: Style) -> list[Cause]:
    """Group findings by cause. If the caller asked for certain rules or for all findings, each is a group.

    Two findings have one cause if the same change fixes both, if both name the same timer or event, if both lack the same
    fact, or if the same lines of the files cause both.
    """
    if style.codes or style.apart:
        return [Cause((finding,)) for finding in findings]
    parents = [*range(len(findings))]

    def root(number: int) -> int:
        while parents[number] != number:
            parents[number] = parents[parents[number]]
            number = parents[number]
        return number

    keys = [(key, number) for number, finding in enumerate(findings) for key in _keys(finding)]
    for numbers in [*grouped(keys).values(), *_one_fix(findings)]:
        for number in numbers[1:]:
            first, second = sorted((root(numbers[0]), root(number)))
            parents[second] = first
    found = grouped((root(number), finding) for number, finding in enumerate(findings))
    return [Cause(tuple(found[number])) for number in sorted(found)]


def same_cause(cause: Cause, places: Places) -> str:
    """Return a line on the other findings of a cause: ``3 more by this cause: BP101 :117; BP102 :105, :35``."""
    place = cause.first.place
    by_code = grouped((finding.code, finding) for finding in cause.more)
    texts = [f"{code} {places_of(own, places, '' if place is None else place.source)}" for code, own in by_code.items()]
    return clean(f"{len(cause.more)} more by this cause: {'; '.join(text.rstrip() for text in texts)}")


def places_of(findings: Iterable[Finding], places: Places, source: str = "", below: str = "") -> str:
    """Return the places of a few findings; a line without file is in the file before it, or in ``source``.

    Paths are shown without the folder ``below``.
    """
    found: dict[str, None] = {}
    for finding in findings:
        place = None if finding.place is None else places.exact(finding.place)
        if place is None or place.line is None:
            found |= {side.name: None for side in finding.sides[:1] if side.name}
        else:
            name = "" if place.source == source else place.source.removeprefix(below)
            found[f"{name}:{place.line}"] = None
            source = place.source
    more = [f"and {len(found) - _NAMED} more"] if len(found) > _NAMED else []
    return clean(", ".join([*[*found][:_NAMED], *more]))


def _one_fix(findings: Sequence[Finding]) -> Iterator[list[int]]:
    """Yield the numbers of findings that have the same first fix."""
    # Fixes are computed when they are read, which is slow: only findings about the same endpoints can share one.
    about = grouped(
        ((finding.accepted, side.members), number)
        for number, finding in enumerate(findings)
        for side in finding.sides
        if side.role in _ENDS
    )
    alike = sorted({number for numbers in about.values() if len(numbers) > 1 for number in numbers})
    first = ((number, finding, finding.remedies[:1]) for number, finding in ((each, findings[each]) for each in alike))
    yield from grouped(
        ((finding.accepted, fix.role, fix.members, fix.policy, fix.value), number)
        for number, finding, fixes in first
        for fix in fixes
        if not fix.weakens  # a requirement that is given up says nothing about what keeps it from being met
    ).values()


def _keys(finding: Finding) -> Iterator[Hashable]:
    """Yield the keys of a finding; findings with a common key have one cause."""
    accepted = finding.accepted
    for side in finding.sides[1:]:
        if side.members and side.role not in _ENDS:  # a timer or an event, by which the ends are judged
            yield accepted, side.role, side.members
    places = [place for side in finding.sides for place in _places(side)]
    stated = any(fact.origin.startswith(_STATED) for side in finding.sides for fact in side.facts)
    if places and all(place is not None and (place.line or place.element or place.path) for place in places):
        # Without a stated value, one line may have several mistakes.
        yield accepted, finding.code, frozenset(places), "" if stated else finding.message
    if finding.pairs and finding.because and finding.verdict is not Verdict.UNKNOWN:
        yield accepted, finding.topic, finding.because, tuple(side.members for side in finding.sides)
    if finding.worlds:
        facts = {part.partition("=")[0] for world in finding.worlds for part in world.split(", ")}
        shared = all("." in fact and " " not in fact for fact in facts)  # an option; any other fact is of these ends
        yield accepted, frozenset(facts), () if shared else tuple(side.members for side in finding.sides)
    if unset := _OPTION.search(finding.message):
        yield accepted, unset[0]
    _, named, cause = finding.message.partition(_CAUSE.get(finding.code, "\n"))
    if named:
        yield accepted, finding.code, cause


def _places(side: Side) -> list[Place | None]:
    """Return the places of the stated values of a side; if there are none, the place of the side."""
    stated = [fact.place for fact in side.facts if fact.origin.startswith(_STATED)]
    return stated or [side.place]
