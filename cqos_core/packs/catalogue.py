"""The catalogue: packs, policies, rules and codes described for machines, and the tables that follow from rules."""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING, Any, Final

from cqos_core.language.expression import definitions, unfolded
from cqos_core.packs.property_panel import Panel, describe_panel, headings

if TYPE_CHECKING:
    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Plain
    from cqos_core.language.vocabulary import Use
    from cqos_core.model.codes import CodeInfo
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack

_NO_PANEL: Final = Panel()


def describe_pack(pack: RulePack) -> dict[str, Any]:
    """Describe a pack for machines: enough to draw a property panel for a protocol never seen before."""
    return {
        "id": pack.id,
        "title": pack.title,
        "summary": pack.summary,
        "source": pack.source,
        "meeting": pack.topic_matching.described,
        "policies": [describe_policy(policy, pack.panel) for policy in pack.policies],
        "groups": headings(pack.panel, pack.policies),
        "presets": {name: dict(preset.settings) for name, preset in pack.presets.items()},
        "base_preset": pack.base_preset,
        "rules": [describe_rule(bound) for bound in pack.bound_rules],
        "functions": [{"name": f.name, "doc": f.doc, "column_form": f.column} for f in pack.functions],
        "conventions": [
            {"pattern": c.pattern, "settings": dict(c.settings), "external": c.external, "doc": c.doc}
            for c in pack.conventions
        ],
        "codes": [describe_code(info) for info in pack.codes],
        "not_checked": list(pack.not_checked),
    }


def describe_policy(policy: Policy, panel: Panel = _NO_PANEL) -> dict[str, Any]:
    """Describe a policy for machines: kind, values in order, unit, default per side, docs, and how people see it."""
    return {
        "name": policy.name,
        "level": policy.level,
        **policy.domain.describe(),
        "default": policy.default
        if policy.default is None or isinstance(policy.default, str)
        else dict(policy.default),
        "words": list(policy.words),
        "roles": list(policy.roles),
        "aliases": list(policy.aliases),
        "enforced": {option: dict(by_value) for option, by_value in policy.enforced.items()},
        "fact": policy.default is None,
        "entities": list(policy.entities),
        "changeable": policy.changeable,
        "stronger": policy.stronger,
        "derived": policy.derived,
        "doc": policy.doc,
        "clause": policy.clause,
        **describe_panel(panel, policy),
    }


def describe_rule(bound: BoundRule) -> dict[str, Any]:
    """Describe a rule for machines: its condition in text form, scope, table and texts."""
    rule = bound.rule
    return {
        "code": rule.code,
        "name": rule.name,
        "kind": rule.kind,
        "scope": bound.scope,
        "role": bound.role,
        "sentence": str(unfolded(rule.condition)),
        "condition": str(rule.condition),
        "definitions": {name: node.text() for name, node in definitions(rule.condition).items()},
        "severity": bound.severity,
        "severity_by": {"option": bound.option.name, "severities": bound.severities}
        if "" not in bound.severities
        else None,
        "because": rule.because,
        "clause": rule.clause,
        "help": rule.help,
        "aliases": list(rule.aliases),
        "guarantee": rule.guarantee or None,
        "survives": rule.survives if rule.guarantee else None,
        "table": rule_table(bound),
        "column_form": column_form(bound),
    }


def describe_code(info: CodeInfo) -> dict[str, Any]:
    """Describe a code for machines."""
    return {
        "code": info.code,
        "name": info.name,
        "severity": info.severity,
        "summary": info.summary,
        "reason": info.reason,
        "help": info.help or None,
    }


def column_form(bound: BoundRule) -> bool:
    """Whether every named function of the rule works on columns, for engines other than those of C-QoS."""
    functions = bound.bound.vocabulary.functions
    used = (getattr(node, "name", "") for node in bound.rule.condition.walk())
    return all(functions[name].column for name in used if name in functions)


_TABLE_LIMIT: Final = 64
_SAMPLES: Final = {"duration": ("1s", "2s", "infinite"), "count": ("1", "2")}


def rule_table(bound: BoundRule) -> list[dict[str, str]]:
    """Derive the table of a pair rule: every combination of its values (samples for durations and counts), and the answer.

    Each row maps ``offered NAME`` / ``requested NAME`` to a value, and ``compatible`` to Yes or No, options at their defaults.
    Rules over other scopes, and over values that cannot be enumerated, have no table.
    """
    vocabulary = bound.bound.vocabulary
    compared = [use for use in bound.bound.uses if use.term.scope in {"offered", "requested"}]
    assumed = assumed_options(bound)
    if bound.scope != "pair" or not compared or len(compared) + len(assumed) < len(bound.bound.uses):
        return []
    columns = []
    for use in sorted(compared, key=lambda use: use.second):
        domain = vocabulary.policies[use.index].domain
        values = domain.candidates() or tuple(domain.parse(text) for text in _SAMPLES.get(domain.kind, ()))
        columns.append([(use, value, domain.format(value)) for value in values])
    if not 0 < prod(map(len, columns)) <= _TABLE_LIMIT:
        return []
    rows = []
    for chosen in product(*columns):
        sides: list[list[Any]] = [[0] * vocabulary.size + [None] * vocabulary.size for _ in range(2)]
        for use, value in (*assumed, *((use, value) for use, value, _ in chosen)):
            sides[use.second][use.index] = value
        row = {f"{use.term.scope} {use.term.name}": text for use, _, text in chosen}
        holds = bool(bound.bound.judge(tuple(sides[0]), tuple(sides[1])).result)
        rows.append({**row, "compatible": "Yes" if holds is not (bound.rule.kind == "forbids") else "No"})
    return rows


def assumed_options(bound: BoundRule) -> list[tuple[Use, Plain]]:
    """Return the options that a rule reads, with their defaults."""
    policies = bound.bound.vocabulary.policies
    return [
        (use, policies[use.index].domain.parse(default))
        for use in bound.bound.uses
        if policies[use.index].level == "option" and isinstance(default := policies[use.index].default, str)
    ]
