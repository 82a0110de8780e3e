"""The installed packs and plugins, and the content of one pack, as tables and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.formatters.tables import table
from cqos_core.language.policy import ENDPOINT, NEED
from cqos_core.model.grouping import grouped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack
    from cqos_core.plugins import Plugins

_KINDS: Final = (
    ("importers", "Importers, for `--from`"),
    ("formatters", "Formatters, for `--format`"),
    ("exporters", "Exporters, for `cqos convert --to`"),
    ("translators", "Translators, for `cqos packs ID --as`"),
    ("commands", "Commands"),
)


# Everything installed


def inventory(plugins: Plugins, extra: dict[str, RulePack]) -> dict[str, Any]:
    """Return what is installed, by kind; ``extra`` are packs that were read from files."""
    # Loading the packs shows which are broken.
    listed = [
        {"id": name, "summary": info.summary, "distribution": plugins.owner("packs", name)}
        for name, info in plugins.packs.items()
        if plugins.pack(name) is not None and name not in extra
    ]
    listed += [{"id": pack.id, "summary": pack.summary, "distribution": "--pack"} for pack in extra.values()]
    kinds: dict[str, list[dict[str, Any]]] = {
        kind: [
            {"name": name, "summary": info.summary, "distribution": plugins.owner(kind, name)}
            for name, info in getattr(plugins, kind).items()
        ]
        for kind, _ in _KINDS
    }
    for exporter in kinds["exporters"]:
        exporter["settings"] = list(plugins.exporters[exporter["name"]].settings)
    broken = [{"name": each.name, "distribution": each.distribution, "reason": each.reason} for each in plugins.broken]
    return {"packs": listed, **kinds, "broken": broken}


def inventory_as_text(plugins: Plugins, extra: dict[str, RulePack], columns: int) -> str:
    """Return what is installed as tables."""
    found = inventory(plugins, extra)
    rows = [(each["id"], each["summary"], each["distribution"]) for each in found["packs"]]
    blocks = [_section(columns, "Rule packs, see `cqos packs ID`", rows)]
    for kind, title in _KINDS:
        rows = [(each["name"], each["summary"] + _settings(each), each["distribution"]) for each in found[kind]]
        blocks.append(_section(columns, title, rows))
    blocks.append(
        _section(
            columns,
            "Broken plugins",
            [(each["name"], _in_one_line(each["reason"]), each["distribution"]) for each in found["broken"]],
        )
    )
    return _joined(blocks)


def _in_one_line(reason: str) -> str:
    first, *more = (line.strip() for line in reason.splitlines())
    return f"{first} {'; '.join(more)}"


def _settings(registered: dict[str, Any]) -> str:
    """Return the settings of an exporter, in parentheses."""
    settings = registered.get("settings", ())
    return f" (--set {', '.join(settings)})" if settings else ""


# One pack


def pack_as_text(pack: RulePack, columns: int) -> str:
    """Return what a rule pack has: policies, options, presets, rules and codes, as tables."""
    by_level = grouped((each.level if each.level in {"option", NEED} else "", each) for each in pack.policies)
    tables = (
        ("Policies", [_policy_row(each) for each in by_level.get("", ())]),
        ("Options, for `--option` and `options:`", [_policy_row(each) for each in by_level.get("option", ())]),
        ("Requirements, the same in all packs, for `needs:`", [_policy_row(each) for each in by_level.get(NEED, ())]),
        ("Presets", [(name, preset.doc, _needs(preset.needs)) for name, preset in pack.presets.items()]),
        (
            "Rules, see `cqos rule CODE`",
            [
                (each.rule.code, each.rule.name, " or ".join(dict.fromkeys(each.severities.values())))
                for each in pack.bound_rules
            ],
        ),
        (
            "What its importers say, see `cqos rule CODE`",
            [(each.code, each.name, each.severity) for each in pack.codes],
        ),
        ("Functions without a column form", [(each.name, each.doc, "") for each in pack.functions if not each.column]),
        ("Not checked", [(text, "", "") for text in pack.not_checked]),
    )
    head = "\n".join(part for part in (f"{pack.title} ({pack.id})", pack.summary) if part)
    return _joined(
        [head, f"What matches: {pack.topic_matching.described}.", *(_section(columns, *each) for each in tables)]
    )


def _needs(needs: tuple[str, str] | None) -> str:
    return "" if needs is None else f"from {needs[0]} {needs[1]} on"


def _policy_row(policy: Policy) -> tuple[str, str, str]:
    level = "" if policy.level in {ENDPOINT, "option", NEED} else f" ({policy.level})"
    return policy.name.removeprefix("need.") + level, policy.expected(), _default(policy)


def _default(policy: Policy) -> str:
    if policy.default is None:
        return "not set" if policy.level == "option" else "a fact, no default"
    if isinstance(policy.default, str):
        return f"default {_written(policy.default)}"
    return ", ".join(f"{role} {_written(text)}" for role, text in policy.default.items())


def _written(text: str) -> str:
    return text or '""'


def _section(columns: int, title: str, rows: Sequence[tuple[str, str, str]]) -> str:
    """Return a titled table, or nothing where there are no rows."""
    if not rows:
        return ""
    lines = table(("", "", ""), rows, columns - 2)[1:]
    return "\n".join([title, *(f"  {line}" for line in lines)])


def _joined(blocks: Sequence[str]) -> str:
    return "\n\n".join(block for block in blocks if block) + "\n"
