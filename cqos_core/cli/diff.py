"""``cqos diff``: what two systems say differently."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any, Final

import click

from cqos_core.analysis.differences import compare
from cqos_core.cli.parameters import color_option, debug_option, form_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading import UNUSABLE, ReadingOptions, prepare, reading_options, usable
from cqos_core.cli.streams import colored, emit, say, width
from cqos_core.files.opening import STDIN
from cqos_core.files.revisions import at_same_paths
from cqos_core.formatters import wording
from cqos_core.formatters.terminal import clean, paint, wrap
from cqos_core.model.difference import ComparedSide
from cqos_core.model.excerpt import exact
from cqos_core.model.remarks import plural
from cqos_core.model.report_form import place_form

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.formatters.terminal import Paint
    from cqos_core.model.difference import Diff, Different, Named
    from cqos_core.model.report import Fact
    from cqos_core.model.system import Place

_SAME, _DIFFERENT = 0, 1
_VERSION: Final = 1


@click.command(
    epilog="Exit codes: 0 no difference that counts; 1 differences; 2 wrong usage, input that cannot be read, or no endpoint "
    "in one of the two; 3 internal error."
)
@click.argument("a", metavar="A")
@click.argument("b", metavar="B")
@click.option("--topic", "topics", metavar="PATTERN", multiple=True, help="Compare these topics only. Can be repeated.")
@click.option("--ignore", "ignored", metavar="PATTERN", multiple=True, help="Leave these topics out. Can be repeated.")
@form_option
@click.option(
    "--fail-on",
    type=click.Choice(["any", "values", "endpoints", "never"]),
    default="any",
    show_default=True,
    help="Which differences make the exit code 1: any, those in values only, or endpoints that only one of them has.",
)
@reading_options
@color_option
@debug_option
@click.pass_context
def diff(
    ctx: click.Context,
    *,
    a: str,
    b: str,
    topics: tuple[str, ...],
    ignored: tuple[str, ...],
    form: str,
    fail_on: str,
    reading: ReadingOptions,
    color: str,
) -> None:
    """List the differences of two systems on the same topics and endpoints.

    A and B are files of any format, or folders, each as one system: two versions of a design, a design and a snapshot, a
    design and a recording. PATH#ref=NAME is a path in a git revision, and .git#ref=NAME the path of the other side in it. C-QoS compares only what both can know. For an observed system, values that discovery does not
    report are no differences, nor are topics outside of the snapshot.

    \b
    Examples:
      cqos diff design.yaml snapshot.txt
      cqos diff old.yaml new.yaml --format json
      cqos diff .git#ref=main design.yaml
      cqos diff design.yaml bag/ --ignore '/rosout' --fail-on values
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    if a == b == STDIN:
        raise click.UsageError("only one of the two can be standard input.", ctx)
    reader = prepare(reading, (a, b))
    with Progress("reading"):
        loaded = [reader.load(at_same_paths(path, [other])) for path, other in ((a, b), (b, a))]
        if not all([usable(each, color, path) for each, path in zip(loaded, (a, b), strict=True)]):  # noqa: C419 - say all
            ctx.exit(UNUSABLE)
        one, other = (reader.whole([system for _, system in each.systems]) for each in loaded)
        found = compare(one, other, reader.context, topics, ignored)
    empty = [path for path, system in ((a, one), (b, other)) if not system.endpoints]
    for path in empty:
        say(f"{path}: there is no endpoint in it, so nothing was compared", severity="error", choice=color)
    sources = {**one.sources, **other.sources}
    if form == "json":
        emit(_as_json(found, a, b, sources))
    elif not empty:
        emit(_as_text(found, a, b, sources, paint(color=colored(color, sys.stdout))))
    ctx.exit(UNUSABLE if empty else _DIFFERENT if _counts(found, fail_on) else _SAME)


def _counts(found: Diff, fail_on: str) -> bool:
    values, endpoints = bool(found.different), bool(found.missing)
    return {"any": values or endpoints, "values": values, "endpoints": endpoints, "never": False}[fail_on]


# Text


def _as_text(found: Diff, a: str, b: str, sources: Mapping[str, bytes], colors: Paint) -> str:
    at = _exact(found, sources)
    lines: list[str] = []
    for topic in sorted(
        {*(each.a.topic for each in found.different), *(each.endpoint.topic for each in found.missing)}
    ):
        lines.append(colors(clean(topic), "title"))
        lines += _values([each for each in found.different if each.a.topic == topic], at)
        for missing in found.missing:
            if missing.endpoint.topic == topic:
                where = _where(missing.endpoint.place, at)
                lines.append(f"  {_named(missing.endpoint)} is only in {missing.only_in.upper()}{where}")
        lines.append("")
    lines += wrap(f"A is {clean(a)}, B is {clean(b)}: {_summary(found)}", width())
    for text in found.not_compared:
        lines += wrap(f"not compared: {clean(text)}", width())
    return "\n".join(lines) + "\n"


def _values(differences: Iterable[Different], at: Mapping[Place, Place]) -> list[str]:
    lines: list[str] = []
    ends = None
    for each in differences:
        if ends != (each.a.id, each.b.id):
            ends = (each.a.id, each.b.id)
            other = "" if each.a.id == each.b.id else f", in B `{clean(each.b.id)}`"
            lines.append(f"  {_named(each.a)}{other}")
        values = " and ".join(
            f"{clean(wording.value(fact))} in {side}{_where(fact.place, at)}"
            for side, fact in (("A", each.value_a), ("B", each.value_b))
        )
        lines.append(f"    {each.policy} is {values}")
    return lines


def _named(end: Named) -> str:
    return f"{end.kind.replace('_', ' ')} `{clean(end.id)}`"


def _where(place: Place | None, at: Mapping[Place, Place]) -> str:
    return "" if place is None else f" ({clean(wording.position(at.get(place, place)))})"


def _summary(found: Diff) -> str:
    count = plural(len(found.different) + len(found.missing), "difference")
    matched = f"{plural(found.matched, 'endpoint')} in both"
    if found.by_topic:
        matched += f", {found.by_topic} of them known by topic only, because their participants have different names"
    return f"{count if found else 'no difference'}; {matched}"


def _exact(found: Diff, sources: Mapping[str, bytes]) -> Mapping[Place, Place]:
    """Exact columns of the places that are shown."""
    facts = (fact.place for each in found.different for fact in (each.value_a, each.value_b))
    places = {place for place in (*facts, *(each.endpoint.place for each in found.missing)) if place is not None}
    return exact(places, sources)


# JSON


def _as_json(found: Diff, a: str, b: str, sources: Mapping[str, bytes]) -> str:
    at = _exact(found, sources)

    def place(place: Place | None) -> dict[str, Any] | None:
        return place_form(place, lambda place: at.get(place, place))

    def end(end: Named) -> dict[str, Any]:
        return {"id": end.id, "participant": end.participant, "place": place(end.place)}

    def value(fact: Fact) -> dict[str, Any]:
        return {"value": fact.value, "origin": fact.origin, "value_place": place(fact.place)}

    document = {
        "version": _VERSION,
        "a": a,
        "b": b,
        "different": [
            {
                "policy": each.policy,
                **_about(each.a),
                ComparedSide.A.value: {**end(each.a), **value(each.value_a)},
                ComparedSide.B.value: {**end(each.b), **value(each.value_b)},
            }
            for each in found.different
        ],
        "missing": [
            {"only_in": each.only_in.value, **_about(each.endpoint), "endpoint": end(each.endpoint)}
            for each in found.missing
        ],
        "matched": found.matched,
        "matched_by_topic": found.by_topic,
        "not_compared": list(found.not_compared),
    }
    return json.dumps(document, indent=2) + "\n"


def _about(end: Named) -> dict[str, Any]:
    return {"topic": end.topic, "protocol": end.protocol, "kind": end.kind}
