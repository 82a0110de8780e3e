"""One pair, policy by policy, and lists of endpoints: as text and as JSON."""

from __future__ import annotations

import json
import textwrap
from typing import TYPE_CHECKING, Final

from cqos_core.formatters import phrases
from cqos_core.formatters.causes import causes
from cqos_core.formatters.full import render_full
from cqos_core.formatters.json_report import render_json, versioned
from cqos_core.formatters.places import Places
from cqos_core.formatters.tables import table
from cqos_core.formatters.terminal import clean, hanging, paint
from cqos_core.formatters.text import Page
from cqos_core.model.finding import Severity, Verdict, plural
from cqos_core.model.grouping import grouped
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_core.packs.guarantee import LINK

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

    from cqos_core.formatters.terminal import Paint
    from cqos_core.model.finding import Fact
    from cqos_core.model.report import Guarantee, GuaranteeCell, PairReport, PolicyComparison, Report
    from cqos_core.model.style import Style
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.resolved_endpoint import Resolved


SECTIONS: Final = ("policies", "guarantees", "findings")
"""Parts of `pair_as_text` beside the answer: all policies, the guarantees, all findings with reasons."""
_ANSWER: Final = 12
"""The most lines of policies and findings in an answer; one finding is always shown."""
_NARROWEST: Final = 40
_VERDICTS: Final = frozenset({"compatible", "incompatible", "unknown"})
_HEADER = ("policy", "offered", "requested", "verdict", "rules")
_VERDICT = _HEADER.index("verdict")


# Text


def pair_as_text(
    pair: PairReport, report: Report, ends: tuple[Resolved, Resolved], style: Style, shown: Collection[str] = ()
) -> str:
    """Return an explained pair as text: its verdict, the compared policies, and what to change.

    ``shown`` are the `SECTIONS` to print instead of the answer, or ``all``.
    """
    colors = paint(color=style.color)
    lines = [*_about_pair(pair, ends, colors), ""]
    if not shown:
        lines += _answer(pair, report, ends, style)
        return "\n".join(lines) + "\n"
    if pair.hops:
        lines += [*_way(pair), ""]
    if not set(shown).isdisjoint({"policies", "all"}):
        lines += [*_policies(pair.policies, ends, style), ""] if not pair.hops else []
        lines += [*(f"{name} {value}" for name, value in pair.derived), ""] if pair.derived else []
    if pair.guarantees and not set(shown).isdisjoint({"guarantees", "all"}):
        lines += [*_gets(pair, style.width), ""]
    if not set(shown).isdisjoint({"findings", "all"}):
        return "\n".join(lines) + "\n" + render_full(report, style)
    return "\n".join(lines[:-1]) + "\n"


def _about_pair(pair: PairReport, ends: tuple[Resolved, Resolved], colors: Paint) -> list[str]:
    publisher, subscriber = ends
    where = f"over {plural(len(pair.hops) - 1, 'bridge')}" if pair.hops else ""
    where = where or f"on {publisher.pack.title} topic `{clean(publisher.shown)}`"
    return [
        f"publisher {_named(publisher)}",
        f"subscriber {_named(subscriber)}",
        f"{where}: {colors(pair.verdict, pair.verdict)}",
    ]


def _policies(
    comparisons: Iterable[PolicyComparison], ends: tuple[Resolved, Resolved], style: Style, *, origins: bool = True
) -> list[str]:
    """Return a table of policies, with or without the ``origins`` of values."""
    colors = paint(color=style.color)

    def color(piece: str, column: int) -> str:
        return colors(piece, piece.strip()) if column == _VERDICT and piece.strip() in _VERDICTS else piece

    say = phrases.value if origins else _bare
    rows = [row for each in comparisons if (row := _row(each, ends[0].pack, say)) is not None]
    return table(_HEADER, rows, style.width, color)


def _bare(fact: Fact) -> str:
    return fact.value or '""'


def _answer(pair: PairReport, report: Report, ends: tuple[Resolved, Resolved], style: Style) -> list[str]:
    """Return the short answer: compared policies, findings with fixes, and the options for the rest. It fits on a screen."""
    compared = [each for each in pair.policies if each.verdict is not None]
    codes = {code for each in compared for code in each.rules}
    lines = _way(pair) if pair.hops else [*_compared(compared, ends, style)]
    lines += [""] if lines else []
    found = causes([each for each in report.findings if each.severity is not Severity.NOTE], style)
    page = Page(style, Places([finding for cause in found for finding in cause.findings], style.sources))
    said = 0
    for cause in found:
        own = page.answer(cause, codes)
        if said and len(lines) + len(own) > _ANSWER:
            if cause.first.severity is not Severity.ERROR:
                break
            own = own[:2]  # an error always has its headline
        said += 1
        lines += own
    lines += [""] if said else []
    rest = len(report.findings) - said
    hidden = (
        (0 if pair.hops else len(pair.policies) - len(compared), "more policy", "more policies", "policies"),
        (len(pair.guarantees), "guarantee under faults", "guarantees under faults", "guarantees"),
        (rest, "more finding", "more findings", "findings"),
    )
    more = [f"{count} {one if count == 1 else many} (--show {word})" for count, one, many, word in hidden if count > 0]
    lines += [*phrases.assumed(report), *hanging(style.width, f"more: {', '.join([*more, 'all (--show all)'])}", 0)]
    return lines


def _way(pair: PairReport) -> list[str]:
    """Return the path from publisher to subscriber, a line for each pair and each bridge."""
    lines = []
    for number, hop in enumerate(pair.hops, 1):
        ends = f"{clean(hop.publisher)} to {clean(hop.subscriber)}"
        lines.append(f"{number}. {ends} on {hop.protocol} topic `{clean(hop.topic)}`: {hop.verdict}")
        if hop.bridge is not None:
            lines.append(f"   then over bridge {clean(hop.bridge)}")
    return lines


def _gets(pair: PairReport, columns: int) -> list[str]:
    """Return tables of guarantees, by fault, and by hop if there are several."""
    faults = [
        (each.word, *(cell.value for cell in each.cells), ", ".join(dict.fromkeys(code for code, _ in _losses(each))))
        for each in pair.guarantees
    ]
    shown = [cell.fault for each in pair.guarantees[:1] for cell in each.cells]
    lines = table(("guarantee", *map(_column, shown), "lost by"), faults, columns)
    if pair.hops:
        by_hop = [{each.word: each.value for each in hop.guarantees} for hop in pair.hops]
        header = ("guarantee", *(f"hop {number}" for number in range(1, len(by_hop) + 1)), "in the end")
        rows = [(each.word, *(hop.get(each.word, "unknown") for hop in by_hop), each.value) for each in pair.guarantees]
        lines = [*table(header, rows, columns), "", *lines]
    return [*lines, *_seen(pair, columns)]


def _losses(guarantee: Guarantee) -> Iterable[tuple[str, str]]:
    return (*guarantee.lost, *(reason for cell in guarantee.cells for reason in cell.lost))


def _column(fault: str) -> str:
    return "connected" if fault == LINK else fault.replace("_", " ")


def _seen(pair: PairReport, columns: int) -> list[str]:
    """Return lines on the proofs of guarantees on running middleware, grouped by origin."""
    cells = [(each.word, cell) for each in pair.guarantees for cell in each.cells if cell.proven or cell.derived]
    lines = []
    for origin, own in sorted(grouped((_origin(cell), (word, cell)) for word, cell in cells).items(), reverse=True):
        by_word = grouped((word, _column(cell.fault)) for word, cell in own)
        listed = "; ".join(f"{word}: {', '.join(faults)}" for word, faults in by_word.items())
        lines += ["", *textwrap.wrap(f"{origin}: {listed}", max(columns, _NARROWEST), subsequent_indent="  ")]
    return lines


def _origin(cell: GuaranteeCell) -> str:
    if not cell.proven:
        return "by clause of the standard alone"
    derived = f"; derived for {', '.join(cell.derived)}" if cell.derived else ""
    return f"proven on {', '.join(cell.proven)}{derived}"


def _named(endpoint: Resolved) -> str:
    label = endpoint.endpoint.label
    return f"`{clean(endpoint.id)}`" + (f" ({clean(label)})" if label and label != endpoint.id else "")


def _compared(comparisons: Sequence[PolicyComparison], ends: tuple[Resolved, Resolved], style: Style) -> Iterator[str]:
    """Yield the incompatible and unknown policies with values, and the names of the others; all with values if all are compatible."""
    doubtful = [each for each in comparisons if each.verdict is not Verdict.COMPATIBLE]
    fitting = [each.policy for each in comparisons if each.verdict is Verdict.COMPATIBLE]
    if doubtful:
        yield from _policies(doubtful, ends, style)
    if doubtful and fitting:
        yield from hanging(style.width, f"compatible: {', '.join(fitting)}", 0)
    elif fitting:
        yield from _policies(comparisons, ends, style, origins=False)


def _row(
    comparison: PolicyComparison, pack: RulePack, say: Callable[[Fact], str] = phrases.value
) -> tuple[str, ...] | None:
    """Return the table row of a policy; None for a derived policy without a value that no rule compares."""
    policy = next(each for each in pack.policies if each.name == comparison.policy)
    facts = ((PUBLISHER, comparison.offered), (SUBSCRIBER, comparison.requested))
    if policy.derived and comparison.verdict is None and all(f is None or f.origin == "default" for _, f in facts):
        return None
    offered, requested = ("" if f is None or role not in policy.roles else say(f) for role, f in facts)
    verdict = "-" if comparison.verdict is None else comparison.verdict.value
    return comparison.policy, offered, requested, verdict, ", ".join(comparison.rules)


def endpoints_as_text(endpoints: Sequence[Resolved], columns: int, *, color: bool) -> str:
    """Return a list of endpoints by topic; endpoints that match are grouped."""
    colors = paint(color=color)
    if not endpoints:
        return "there are no endpoints\n"
    blocks = (
        [
            colors(f"{clean(topic)} ({pack})", "title"),
            *table(("", "", ""), [(f"  {each.role}", each.id, _about(each)) for each in members], columns)[1:],
        ]
        for (pack, topic), members in _by_topic(endpoints).items()
    )
    return "\n\n".join(map("\n".join, blocks)) + "\n"


def _about(endpoint: Resolved) -> str:
    """Return the labels of an endpoint and its participant, for ids that a modeler generated."""
    label, participant = endpoint.endpoint.label or "", endpoint.participant.participant
    owner = participant.label or participant.id
    return ", ".join(part for part in (label, "" if endpoint.id.startswith(owner) else f"of {owner}") if part)


def _by_topic(endpoints: Sequence[Resolved]) -> dict[tuple[str, str], list[Resolved]]:
    ordered = sorted(endpoints, key=lambda each: (each.pack.id, each.shown, each.role, each.id))
    matching = grouped(((each.pack.id, each.key or each.shown), each) for each in ordered)
    return {(members[0].pack.id, members[0].shown): members for members in matching.values()}


# JSON


def pair_as_json(pair: PairReport, report: Report, ends: tuple[Resolved, Resolved], style: Style) -> str:
    """Return an explained pair as JSON."""
    publisher, subscriber = ends
    return versioned(
        {
            "topic": publisher.shown,
            "protocol": publisher.pack.id,
            "publisher": publisher.id,
            "subscriber": subscriber.id,
            **pair.to_dict(),
            # As they are in the JSON report.
            "findings": json.loads(render_json(report, style))["findings"],
        }
    )


def endpoints_as_json(endpoints: Sequence[Resolved]) -> str:
    """Return endpoints by topic as JSON."""
    topics = [
        {
            "topic": topic,
            "protocol": pack,
            "publishers": [each.id for each in members if each.role == PUBLISHER],
            "subscribers": [each.id for each in members if each.role == SUBSCRIBER],
        }
        for (pack, topic), members in _by_topic(endpoints).items()
    ]
    return versioned({"topics": topics})
