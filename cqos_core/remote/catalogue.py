"""Rule packs as messages of the catalogue."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from cqos.v1 import catalogue_pb2, report_pb2
from cqos_core.packs.catalogue import describe_pack, describe_policy, describe_rule
from cqos_core.packs.moddle import drawing_settings, moddle
from cqos_core.packs.presets import Dialect
from cqos_core.plugins import load_plugins
from cqos_core.remote.messages import word_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.language.policy import Policy
    from cqos_core.packs.drawing_notation import DrawnForm, DrawnOwner
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.presets import Preset
    from cqos_core.packs.property_panel import Panel, SettingSpelling


def packs_message(revision: int) -> catalogue_pb2.ListPacksResponse:
    """List everything installed."""
    plugins = load_plugins()
    packs = [
        catalogue_pb2.PackSummary(
            id=name, title=pack.title, summary=pack.summary, distribution=plugins.owner("packs", name)
        )
        for name in sorted(plugins.packs)
        if (pack := plugins.pack(name)) is not None
    ]
    importers = [
        catalogue_pb2.Format(
            name=name,
            summary=info.summary,
            distribution=plugins.owner("importers", name),
            suffixes=info.suffixes,
            drawn=_drawn_form(info.load_drawn()),
        )
        for name, info in sorted(plugins.importers.items())
    ]
    exporters = [
        catalogue_pb2.Format(
            name=name,
            summary=exporter.summary,
            distribution=plugins.owner("exporters", name),
            suffixes=[exporter.suffix],
            settings=[
                catalogue_pb2.FormatSetting(name=setting, values=values)
                for setting, values in exporter.choices().items()
            ],
        )
        for name, exporter in sorted(plugins.exporters.items())
    ]
    return catalogue_pb2.ListPacksResponse(
        revision=revision, version=version("cqos-core"), packs=packs, importers=importers, exporters=exporters
    )


def _drawn_form(form: DrawnForm | None) -> catalogue_pb2.DrawnForm | None:
    if form is None:
        return None
    plugins = load_plugins()
    packs = [pack for name in sorted(plugins.packs) if (pack := plugins.pack(name)) is not None]
    return catalogue_pb2.DrawnForm(
        namespace=form.namespace,
        prefix=form.prefix,
        dialect=form.dialect,
        owners=[_drawn_owner(each) for each in form.owners],
        moddle=json.dumps(moddle(form, packs)),
    )


def _drawn_owner(owner: DrawnOwner) -> catalogue_pb2.DrawnOwner:
    words = [
        catalogue_pb2.DrawnWord(
            name=word.name,
            element=word.element,
            meaning=_number(catalogue_pb2.DrawnMeaning, word.meaning),
            attributes=[catalogue_pb2.DrawnAttribute(**asdict(each)) for each in word.attributes],
            doc=word.doc,
            foreign=word.foreign,
            values=word.values,
        )
        for word in owner.words
    ]
    return catalogue_pb2.DrawnOwner(
        kind=_number(catalogue_pb2.DrawnOwnerKind, owner.kind),
        types=owner.types,
        levels=[_number(catalogue_pb2.PolicyLevel, each) for each in owner.levels],
        words=words,
    )


def pack_message(pack: RulePack) -> catalogue_pb2.Pack:
    """Describe one pack in full."""
    described = describe_pack(pack)
    forms = [form for info in load_plugins().importers.values() if (form := info.load_drawn()) is not None]
    dialects = dict(pack.dialects) | {each.dialect: pack.dialects.get(each.dialect, Dialect()) for each in forms}
    writes = {each.dialect: list(drawing_settings(pack, each)) for each in forms}
    return catalogue_pb2.Pack(
        id=pack.id,
        title=pack.title,
        summary=pack.summary,
        source=pack.source,
        meeting=pack.topic_matching.described,
        policies=[policy_message(policy, pack.panel) for policy in pack.policies],
        presets=[_preset(name, preset) for name, preset in pack.presets.items()],
        base_preset=pack.base_preset,
        rules=[_rule(describe_rule(bound)) for bound in pack.bound_rules],
        functions=[catalogue_pb2.Function(**_known(catalogue_pb2.Function, each)) for each in described["functions"]],
        conventions=[
            catalogue_pb2.Convention(**_known(catalogue_pb2.Convention, each)) for each in described["conventions"]
        ],
        codes=[
            catalogue_pb2.Code(**{**_known(catalogue_pb2.Code, each), "severity": _severity(each["severity"])})
            for each in described["codes"]
        ],
        not_checked=pack.not_checked,
        dialects={name: _dialect(each, writes.get(name, ())) for name, each in dialects.items()},
        groups=described["groups"],
    )


def rule_message(code: str, revision: int) -> catalogue_pb2.GetRuleResponse | None:
    """Describe one rule, of any pack; None if no pack has it."""
    plugins = load_plugins()
    for name in sorted(plugins.packs):
        pack = plugins.pack(name)
        rule = None if pack is None else pack.rule(code)
        # Rules of several packs may have one name.
        if pack is not None and rule is not None and rule.name != code.lower():
            bound = next(each for each in pack.bound_rules if each.rule.code == rule.code)
            return catalogue_pb2.GetRuleResponse(revision=revision, pack=pack.id, rule=_rule(describe_rule(bound)))
    return None


@cache
def versions() -> Mapping[str, str]:
    """Return the versions of C-QoS and of the distributions that rule packs come from."""
    plugins = load_plugins()
    owners = (plugins.owner("packs", name).partition(" ") for name in plugins.packs)
    return {"cqos": version("cqos-core"), **{name: found for name, _, found in owners if found}}


def policy_message(policy: Policy, panel: Panel) -> catalogue_pb2.Policy:
    """Describe one policy: what `describe_policy` says, in fields that have one type each."""
    described = describe_policy(policy, panel)
    default = described.pop("default")
    enforced: Mapping[str, Any] = described.pop("enforced")
    values = described.pop("value_docs")
    message = catalogue_pb2.Policy(
        **_known(catalogue_pb2.Policy, described),
        expected=policy.expected(),
        level_value=_number(catalogue_pb2.PolicyLevel, described["level"]),
        kind_value=_number(catalogue_pb2.ValueKind, described["kind"]),
        role_values=[_number(report_pb2.Role, each) for each in described["roles"]],
        value_docs=[catalogue_pb2.ValueDoc(**each) for each in values],
        enforced={option: catalogue_pb2.Treatment(by_value=by_value) for option, by_value in enforced.items()},
    )
    if isinstance(default, str):
        message.default_value = default
    elif default is not None:
        message.default_by_role.update(default)
    return message


def _preset(name: str, preset: Preset) -> catalogue_pb2.Preset:
    needs = None if preset.needs is None else catalogue_pb2.NeededOption(option=preset.needs[0], value=preset.needs[1])
    return catalogue_pb2.Preset(
        name=name, settings=preset.settings, doc=preset.doc, needs=needs, aliases=preset.aliases
    )


def _rule(described: dict[str, Any]) -> catalogue_pb2.Rule:
    rows = [
        catalogue_pb2.TableRow(
            values={name: value for name, value in row.items() if name != "compatible"},
            compatible=row["compatible"] == "Yes",
        )
        for row in described.pop("table")
    ]
    by = described.pop("severity_by")
    return catalogue_pb2.Rule(
        **{
            **_known(catalogue_pb2.Rule, described),
            "kind_value": _number(catalogue_pb2.RuleKind, described["kind"]),
            "scope_value": _number(catalogue_pb2.RuleScope, described["scope"]),
            "role_value": _number(report_pb2.Role, described.get("role") or ""),
            "guarantee_value": _number(report_pb2.GuaranteeWord, described.get("guarantee") or ""),
            "survives_value": _number(report_pb2.Fault, described.get("survives") or ""),
            "severity": _severity(described["severity"]),
            "table": rows,
            "severity_by": _severity_by(by),
        }
    )


def _severity_by(described: Mapping[str, Any] | None) -> catalogue_pb2.SeverityByOption | None:
    if described is None:
        return None
    by_value = {value: _severity(name) for value, name in described["severities"].items()}
    return catalogue_pb2.SeverityByOption(option=described["option"], by_value=by_value)


def _number(enum: Any, word: str) -> Any:
    """The number of a word; 0 for one that the enum has not."""
    return next((value.number for value in enum.DESCRIPTOR.values if word_of(value) == word), 0)


def _known(kind: Any, described: Mapping[str, Any]) -> dict[str, Any]:
    """What the message has fields for: a description that has learnt more is no reason to fail, but for a test."""
    fields = kind.DESCRIPTOR.fields_by_name
    return {name: value for name, value in described.items() if name in fields and value is not None}


def _severity(name: str) -> report_pb2.Severity.ValueType:
    return report_pb2.Severity.Value(f"SEVERITY_{name.upper()}")


def _dialect(dialect: Dialect, writes: Iterable[SettingSpelling]) -> catalogue_pb2.Dialect:
    return catalogue_pb2.Dialect(
        names=dialect.names,
        codes={policy: catalogue_pb2.Codes(by_code=codes) for policy, codes in dialect.codes.items()},
        bare_unit=dialect.bare_unit,
        zero_is_unset=dialect.zero_is_unset,
        ignore=sorted(dialect.ignore),
        writes=[
            catalogue_pb2.WrittenSetting(
                policy=each.policy.name,
                level=_number(catalogue_pb2.PolicyLevel, each.policy.level),
                name=each.name,
                words=each.words,
                spellings=each.spellings,
                roles=[_number(report_pb2.Role, role) for role in each.roles],
            )
            for each in writes
        ],
    )
