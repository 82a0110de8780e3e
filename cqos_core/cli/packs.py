"""``cqos packs``: what is installed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from cqos_core.cli.parameters import Run, debug_option, form_option, nearest, packs_option
from cqos_core.cli.reading import packs_here
from cqos_core.cli.streams import emit, width
from cqos_core.formatters.tables import table
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.language.policy import Policy
    from cqos_core.packs.pack import RulePack
    from cqos_core.plugins import Plugins

_KINDS = (
    ("importers", "Importers, for `--from`"),
    ("formatters", "Formatters, for `--format`"),
    ("exporters", "Exporters, for `cqos convert --to`"),
    ("commands", "Commands"),
)


@click.command()
@click.argument("pack_id", metavar="[ID]", required=False)
@form_option
@packs_option
@debug_option
@click.pass_context
def packs(ctx: click.Context, *, pack_id: str | None, form: str, pack_files: tuple[str, ...]) -> None:
    """List rule packs, file formats and other plugins.

    With the ID of a rule pack, its policies, presets, options and rules.

    \b
    Examples:
      cqos packs
      cqos packs ros2
      cqos packs ros2 --format json
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    if isinstance(ctx.obj, Run):
        ctx.obj.silent = True  # they are listed
    plugins = load_plugins()
    extra = {pack.id: pack for pack in packs_here(pack_files)}
    if pack_id is None:
        emit(_dump(_inventory(plugins, extra)) if form == "json" else _inventory_as_text(plugins, extra))
        return
    pack = extra.get(pack_id) or plugins.pack(pack_id)
    if pack is None:
        reasons = [str(broken) for broken in plugins.broken if broken.name == pack_id]
        unknown = f"there is no rule pack `{pack_id}`{nearest(pack_id, (*extra, *plugins.packs))}"
        raise click.BadParameter(reasons[0] if reasons else unknown, param_hint="'ID'")
    emit(_dump({"version": 1, **pack.describe()}) if form == "json" else _pack_as_text(pack))


def _dump(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=2) + "\n"


# Everything installed


def _inventory(plugins: Plugins, extra: dict[str, RulePack]) -> dict[str, Any]:
    # Looking at packs shows which are broken.
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
    return {"version": 1, "packs": listed, **kinds, "broken": broken}


def _inventory_as_text(plugins: Plugins, extra: dict[str, RulePack]) -> str:
    inventory = _inventory(plugins, extra)
    rows = [(each["id"], each["summary"], each["distribution"]) for each in inventory["packs"]]
    blocks = [_section("Rule packs, see `cqos packs ID`", rows)]
    for kind, title in _KINDS:
        rows = [(each["name"], each["summary"] + _settings(each), each["distribution"]) for each in inventory[kind]]
        blocks.append(_section(title, rows))
    blocks.append(
        _section(
            "Broken plugins",
            [(each["name"], _in_one_line(each["reason"]), each["distribution"]) for each in inventory["broken"]],
        )
    )
    return _joined(blocks)


def _in_one_line(reason: str) -> str:
    first, *more = (line.strip() for line in reason.splitlines())
    return f"{first} {'; '.join(more)}"


def _settings(registered: dict[str, Any]) -> str:
    """What may be chosen of an exporter."""
    settings = registered.get("settings", ())
    return f" (--set {', '.join(settings)})" if settings else ""


# One pack


def _pack_as_text(pack: RulePack) -> str:
    tables = (
        ("Policies", [_policy_row(each) for each in pack.policies if each.level != "option"]),
        (
            "Options, for `--option` and `options:`",
            [_policy_row(each) for each in pack.policies if each.level == "option"],
        ),
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
    return _joined([head, f"Who meets: {pack.meeting.described}.", *(_section(*each) for each in tables)])


def _needs(needs: tuple[str, str] | None) -> str:
    return "" if needs is None else f"from {needs[0]} {needs[1]} on"


def _policy_row(policy: Policy) -> tuple[str, str, str]:
    level = "" if policy.level in {"endpoint", "option"} else f" ({policy.level})"
    return policy.name + level, policy.expected(), _default(policy)


def _default(policy: Policy) -> str:
    if policy.default is None:
        return "not set" if policy.level == "option" else "a fact, no default"
    if isinstance(policy.default, str):
        return f"default {policy.default}"
    return ", ".join(f"{role} {text}" for role, text in policy.default.items())


def _section(title: str, rows: Sequence[tuple[str, str, str]]) -> str:
    """Return a titled table, or nothing where there are no rows."""
    if not rows:
        return ""
    lines = table(("", "", ""), rows, width() - 2)[1:]
    return "\n".join([title, *(f"  {line}" for line in lines)])


def _joined(blocks: Sequence[str]) -> str:
    return "\n\n".join(block for block in blocks if block) + "\n"
