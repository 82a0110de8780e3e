"""Budgets of topics, participants, links and histories, as text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cqos_core.behaviour.paths.link_facts import rate_text
from cqos_core.formatters.tables import table
from cqos_core.formatters.terminal import clean

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.behaviour.paths.budgets import Budgets, LinkLoad, Stream


def budgets_as_text(found: Budgets, columns: int) -> Iterator[str]:
    """Yield text lines with the budgets of topics, links and histories."""
    if not (found.streams or found.histories):
        yield "no topic states `period` and `size`, so there are no budgets"
        return
    if found.streams:
        header = ("publisher", "topic", "samples", "on the wire", "packets of a sample")
        yield from table(header, [_stream_row(each) for each in found.streams], columns)
        names = sorted({each.participant for each in found.streams}.union(*(each.receivers for each in found.streams)))
        totals = [(clean(name), rate_text(found.sent(name)), rate_text(found.received(name))) for name in names]
        yield ""
        yield from table(("participant", "publishes", "receives"), totals, columns)
    for load in found.loads:
        yield ""
        yield from _load_lines(load)
    if found.histories:
        rows = [
            (clean(each.endpoint), clean(each.topic), _number(each.samples), _number(each.size))
            for each in found.histories
        ]
        yield ""
        yield from table(("history of", "topic", "samples at most", "bytes at most"), rows, columns)


def _number(count: int | None) -> str:
    return "no limit" if count is None else f"{count:,}"


def _stream_row(stream: Stream) -> tuple[str, ...]:
    wire, packets = stream.wire(), stream.packets(None)
    more = "" if stream.single else " for each instance"
    return (
        clean(stream.publisher),
        clean(stream.topic),
        rate_text(stream.payload) + more,
        "not known" if wire is None else rate_text(wire) + more,
        "not known" if packets is None else str(packets),
    )


def _load_lines(load: LinkLoad) -> Iterator[str]:
    link, facts = load.link, load.facts
    carries = "" if facts.rate is None else f", and it carries {rate_text(facts.rate)}"
    likely = "not known with headers" if load.likely is None else f"{rate_text(load.likely)} with headers and copies"
    direction = f"{'to' if load.inward else 'from'} {', '.join(map(clean, link.participants))}"
    yield f"link {clean(link.name)} {direction}: {rate_text(load.certain)}, {likely}{carries}"
    for topic, part in load.lost:
        yield f"  {clean(topic)} loses {part:.2%} of its samples"
    for topic, seconds in load.catching_up:
        yield f"  a late joiner of {clean(topic)} has caught up after {seconds:.3g}s at the least"


def budgets_as_json(found: Budgets) -> dict[str, Any]:
    """Return all budgets as data: rates in bytes a second."""
    return {
        "topics": [
            {
                "publisher": each.publisher,
                "topic": each.topic,
                "samples": each.payload,
                "wire": each.wire(),
                "packets": each.packets(None),
                "one_instance": each.single,
            }
            for each in found.streams
        ],
        "links": [
            {
                "name": each.link.name,
                "direction": "in" if each.inward else "out",
                "samples": each.certain,
                "wire": each.likely,
                "rate": each.facts.rate,
                "lost": dict(each.lost),
                "catching_up": dict(each.catching_up),
            }
            for each in found.loads
        ],
        "histories": [
            {"endpoint": each.endpoint, "topic": each.topic, "samples": each.samples, "bytes": each.size}
            for each in found.histories
        ],
    }
