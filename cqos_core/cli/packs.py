"""``cqos packs``: list rule packs and plugins, or describe one pack."""

from __future__ import annotations

import click

from cqos_core.cli.console import emit, width
from cqos_core.cli.errors import WrongUsageError, wrong_usage
from cqos_core.cli.outputs import blame_plugin
from cqos_core.cli.pack_files import packs_here
from cqos_core.cli.parameters import (
    Registered,
    Run,
    debug_option,
    form_option,
    nearest,
    packs_option,
    refuse_absent,
)
from cqos_core.formatters.inventory import inventory, inventory_as_text, pack_as_text
from cqos_core.formatters.json_report import versioned
from cqos_core.packs.catalogue import describe_pack
from cqos_core.plugins import load_plugins


@click.command(epilog="Exit codes: 0 printed; 2 wrong usage, or no such rule pack; 3 internal error.")
@click.argument("pack_id", metavar="[ID]", required=False)
@click.option(
    "--as",
    "language",
    type=Registered("translators"),
    help="Print the rules of the pack over pairs and endpoints as a program in another language.",
)
@form_option
@packs_option
@debug_option
@click.pass_context
def packs(
    ctx: click.Context, *, pack_id: str | None, language: str | None, form: str, pack_files: tuple[str, ...]
) -> None:
    """List rule packs, file formats and other plugins.

    With the ID of a rule pack, its policies, presets, options and rules.

    \b
    Examples:
      cqos packs
      cqos packs ros2
      cqos packs ros2 --format json
      cqos packs ros2 --as sql
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    if isinstance(ctx.obj, Run):
        ctx.obj.silent = True  # they are listed
    plugins = load_plugins()
    extra = {pack.id: pack for pack in packs_here(pack_files)}
    if pack_id is None and language is not None:
        raise WrongUsageError(
            "--as needs the ID of a rule pack", "write `cqos packs ID --as …`; `cqos packs` lists the IDs", ctx
        )
    if pack_id is None:
        emit(versioned(inventory(plugins, extra)) if form == "json" else inventory_as_text(plugins, extra, width()))
        return
    pack = extra.get(pack_id) or plugins.pack(pack_id)
    if pack is None:
        reasons = [str(broken) for broken in plugins.broken if broken.name == pack_id]
        if not reasons:
            refuse_absent("packs", pack_id, f"the rule pack `{pack_id}`")
        unknown = f"there is no rule pack `{pack_id}`"
        advice = "" if reasons else nearest(pack_id, (*extra, *plugins.packs))
        raise wrong_usage("ID", reasons[0] if reasons else unknown, advice)
    if language is not None:
        with blame_plugin("translators", language):
            emit(plugins.translators[language].load()(pack))
        return
    emit(versioned(describe_pack(pack)) if form == "json" else pack_as_text(pack, width()))
