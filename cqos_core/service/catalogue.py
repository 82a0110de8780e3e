"""Rule packs as messages of the catalogue."""

from __future__ import annotations

from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from cqos.v1 import catalogue_pb2, report_pb2
from cqos_core.packs.catalogue import describe_policy, describe_rule
from cqos_core.plugins import load_plugins
from cqos_core.remote.messages import word_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.parts import Dialect, Preset


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
            name=name, summary=info.summary, distribution=plugins.owner("importers", name), suffixes=info.suffixes
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


def pack_message(pack: RulePack) -> catalogue_pb2.Pack:
    """Describe one pack in full."""
    described = pack.describe()
    return catalogue_pb2.Pack(
        id=pack.id,
        title=pack.title,
        summary=pack.summary,
        source=pack.source,
        meeting=pack.meeting.described,
        policies=[policy_message(policy) for policy in pack.policies],
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
        dialects={name: _dialect(dialect) for name, dialect in pack.dialects.items()},
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
@cache
def versions() -> Mapping[str, str]:
    """Return the versions of C-QoS and of the distributions that rule packs come from."""
    plugins = load_plugins()
    owners = (plugins.owner("packs", name).partition(" ") for name in plugins.packs)
    return {"cqos": version("cqos-core"), **{name: found for name, _, found in owners if found}}


def policy_message(policy: Policy) -> catalogue_pb2.Policy:
    """Describe one policy: what `describe_policy` says, in fields that have one type each."""
    described = describe_policy(policy)
    default = described.pop("default")
    enforced: Mapping[str, Any] = described.pop("enforced")
    message = catalogue_pb2.Policy(
        **_known(catalogue_pb2.Policy, described),
        expected=policy.expected(),
        level_value=_number(catalogue_pb2.PolicyLevel, described["level"]),
        kind_value=_number(catalogue_pb2.ValueKind, described["kind"]),
        role_values=[_number(report_pb2.Role, each) for each in described["roles"]],
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


def _dialect(dialect: Dialect) -> catalogue_pb2.Dialect:
    return catalogue_pb2.Dialect(
        names=dialect.names,
        codes={policy: catalogue_pb2.Codes(by_code=codes) for policy, codes in dialect.codes.items()},
        bare_unit=dialect.bare_unit,
        zero_is_unset=dialect.zero_is_unset,
        ignore=sorted(dialect.ignore),
    )
