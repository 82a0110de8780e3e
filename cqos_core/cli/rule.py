"""``cqos rule``: explain a rule or code."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from cqos_core.cli.console import emit, width
from cqos_core.cli.errors import wrong_usage
from cqos_core.cli.pack_files import packs_here
from cqos_core.cli.parameters import debug_option, nearest, one_format_option, packs_option
from cqos_core.packs.catalogue import describe_code, describe_rule
from cqos_core.packs.rule_docs import as_markdown, as_text, code_page, find, names, rule_page
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from cqos_core.packs.bound_rule import BoundRule
    from cqos_core.packs.pack import RulePack
    from cqos_core.packs.rule_docs import Reported


@click.command(epilog="Exit codes: 0 printed; 2 wrong usage, or no such rule or code; 3 internal error.")
@click.argument("code")
@one_format_option("text", "json", "markdown")
@packs_option
@debug_option
def rule(*, code: str, form: str, pack_files: tuple[str, ...]) -> None:
    """Explain a rule or code: its condition, its reason, and what to do.

    CODE is a code such as ROS101 or CQ203, or the name that stands beside it; case does not matter.

    \b
    Examples:
      cqos rule ROS101
      cqos rule reliability-weaker-than-requested --format json
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    plugins = load_plugins()
    installed = (plugins.pack(pack_id) for pack_id in plugins.packs)
    packs = [*packs_here(pack_files), *(pack for pack in installed if pack is not None)]
    found = find(code, packs)
    if found is None:
        near = nearest(code, names(packs))
        raise wrong_usage(
            "CODE", f"there is no rule or code `{code[:60]}`", f"{near} `cqos packs ID` lists rules".strip()
        )
    emit(_as_json(found) if form == "json" else _page(found, form))


def _page(found: tuple[BoundRule, RulePack] | Reported, form: str) -> str:
    page = rule_page(*found) if isinstance(found, tuple) else code_page(found.info, found.pack)
    return as_markdown(page) if form == "markdown" else as_text(page, width())


def _as_json(found: tuple[BoundRule, RulePack] | Reported) -> str:
    if isinstance(found, tuple):
        pack: RulePack | None = found[1]
        description = describe_rule(found[0])
    else:
        pack, description = found.pack, describe_code(found.info)
    return json.dumps({"version": 1, "pack": pack and pack.id, **description}, indent=2) + "\n"
