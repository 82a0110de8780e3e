"""The rules of a pack as a program in another language: SQL, or JavaScript. ``cqos packs ID --as`` prints it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.language.domains import Choice, Duration, Flag
from cqos_fleet.forms import forms_of
from cqos_fleet.writers import javascript, sql, written

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_fleet.forms import RuleForm


class CompiledPack(NamedTuple):
    """The rules of pairs and of endpoints, those without a form for columns apart, each with the part that has none."""

    pairs: Sequence[RuleForm]
    endpoints: Sequence[RuleForm]
    others: Sequence[tuple[BoundRule, str]]


def compiled_pack(pack: RulePack) -> CompiledPack:
    """Return the rules of a pack over pairs and over endpoints in a form for columns."""
    pairs, others = forms_of((*pack.by_scope["meets"], *pack.by_scope.get("pair", ())))
    endpoints, left = forms_of(pack.by_scope.get("endpoint", ()))
    return CompiledPack(pairs, endpoints, (*others, *left))


def as_sql(pack: RulePack) -> str:
    """Return a pack as SQL, with a comment that says what it reads."""
    compiled = compiled_pack(pack)
    return _joined("--", pack, compiled, _sql(pack, compiled))


def as_javascript(pack: RulePack) -> str:
    """Return a pack as JavaScript, with a comment that says what it reads."""
    compiled = compiled_pack(pack)
    return _joined("//", pack, compiled, _javascript(pack, compiled))


def _joined(mark: str, pack: RulePack, compiled: CompiledPack, program: Iterator[str]) -> str:
    head = [f"{mark} {line}".rstrip() for line in (*_head(pack, compiled), *_columns(pack, compiled))]
    return "\n".join([*head, "", *program]) + "\n"


def _head(pack: RulePack, compiled: CompiledPack) -> Iterator[str]:
    yield f"The rules of rule pack `{pack.id}` over pairs and endpoints, compiled by C-QoS."
    yield "Every value is a span: `.least` and `.most` are equal where it is known. A value that is not known has the ends"
    yield "that stand below, a text that is not known has '' and '?'. Durations are nanoseconds."
    yield "Each rule gives two answers: whether it reports, and under `CODE.unknown` whether it cannot be decided."
    yield "A condition of matching that reports keeps a pair apart. A rule of a guarantee counts where that is required."
    yield "Ends match where their topics are equal."
    if pack.topic_matching.match is not None:
        yield "A filter that matches other names needs a row for each topic that it matches."
    yield f"Assumptions, values from peers and sizes of topics are not in here; neither are {len(compiled.others)} rules:"
    for bound, reason in sorted(compiled.others, key=lambda each: each[0].rule.code):
        yield f"  {bound.rule.code} ({bound.scope}): no column form of `{reason}`"


def _columns(pack: RulePack, compiled: CompiledPack) -> Iterator[str]:
    forms = [part for rule in (*compiled.pairs, *compiled.endpoints) for part in (rule.reports, rule.unknown)]
    used = {each._replace(second=False, most=False) for form in forms for each in form.reads()}
    yield "Columns, each with `.least` and `.most`; all are whole numbers of 64 bits, but texts:"
    for each in sorted(used):
        name = each.name(pack.vocabulary).removesuffix(".least")
        yield f"  {name}: {_described(pack, each.policy, each.part)}"


def _described(pack: RulePack, index: int, part: str) -> str:
    domain = pack.policies[index].domain
    if part != "value":
        return _PARTS[part]
    if isinstance(domain, Choice):
        return ", ".join(f"{rank} {name}" for rank, name in enumerate(domain.names))
    if isinstance(domain, Flag):
        return "0 false, 1 true"
    if domain.ordered or domain.candidates():
        kind = "nanoseconds, " if isinstance(domain, Duration) else ""
        return f"{kind}{domain.lowest} to {domain.highest}"
    return "text"


_PARTS: Final = {
    "word": "text, how it was written, '' where nothing states it",
    "here": "1 where it is written at the endpoint itself",
    "unmatched": "1 where the middleware refuses no pair for it",
}


def answers(rules: Sequence[RuleForm]) -> Iterator[tuple[str, RuleForm]]:
    """Yield each rule with the name of its answer; a rule of several severities has one for each."""
    seen: set[str] = set()
    for rule in sorted(rules, key=lambda each: (each.bound.rule.code, each.bound.rule.severity)):
        stated = rule.bound.rule
        name = stated.code
        while name in seen:
            name = f"{stated.code}.{stated.survives if stated.guarantee else stated.severity}{len(seen)}"
        seen.add(name)
        yield name, rule


def _sql(pack: RulePack, compiled: CompiledPack) -> Iterator[str]:
    of_pairs = sql(pack.vocabulary)
    of_endpoints = sql(pack.vocabulary, ("endpoints", "endpoints"))
    ids = "offered.id AS publisher, requested.id AS subscriber"
    joined = "offered JOIN requested ON offered.topic = requested.topic"
    for title, spelling, rules, first, tables in (
        ("pairs", of_pairs, compiled.pairs, ids, joined),
        ("endpoints", of_endpoints, compiled.endpoints, "endpoints.id AS endpoint", "endpoints"),
    ):
        yield f"-- Rules of {title}"
        yield f"SELECT {first}"
        for name, rule in answers(rules):
            yield f"  -- {rule.bound.rule.kind} {rule.bound.rule.condition}"
            yield f'  , {written(rule.reports, spelling)} AS "{name}"'
            yield f'  , {written(rule.unknown, spelling)} AS "{name}.unknown"'
        yield f"FROM {tables};"
        yield ""


def _javascript(pack: RulePack, compiled: CompiledPack) -> Iterator[str]:
    spelling = javascript(pack.vocabulary)
    yield "const least = (...values) => values.reduce((one, other) => (other < one ? other : one));"
    yield "const greatest = (...values) => values.reduce((one, other) => (other > one ? other : one));"
    for title, rules, ends in (
        ("pair", compiled.pairs, "offered, requested"),
        ("endpoint", compiled.endpoints, "offered, requested = offered"),
    ):
        yield ""
        yield f"export function {title}({ends}) {{"
        yield "  return {"
        for name, rule in answers(rules):
            yield f"    // {rule.bound.rule.kind} {rule.bound.rule.condition}"
            yield f"    {json.dumps(name)}: {written(rule.reports, spelling)},"
            yield f"    {json.dumps(name + '.unknown')}: {written(rule.unknown, spelling)},"
        yield "  };"
        yield "}"
