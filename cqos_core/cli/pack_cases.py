"""``cqos test-pack``: run the case files of a rule pack."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cqos_core.cli.console import emit
from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.pack_files import read_packs
from cqos_core.cli.parameters import debug_option
from cqos_core.model.problems import CqosError
from cqos_core.model.suggestions import listed
from cqos_core.plugins import load_plugins
from cqos_core.testing import load_cases, run_case

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.packs.pack import RulePack
    from cqos_core.testing import Case

_FOLDER = "cases"


@click.command(
    name="test-pack",
    epilog="Exit codes: 0 every case gives what it expects; 1 one does not; 2 wrong usage, or a file that cannot be read; "
    "3 internal error.",
)
@click.argument("pack")
@click.argument("cases", nargs=-1, type=click.Path(exists=True))
@debug_option
def test_pack(*, pack: str, cases: tuple[str, ...]) -> None:
    """Run the case files of a rule pack.

    PACK is a rule pack in YAML, or the id of an installed one. CASES are case files and folders with them; if none is named,
    the folder `cases` beside PACK. Rules without a case on both sides of their boundary are listed.

    \b
    Examples:
      cqos test-pack fieldlink.yaml
      cqos test-pack dds plugins/dds_full/tests/cases/DDS101.yml
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    judged, given = _pack(pack)
    folders = cases or (str(Path(pack).parent / _FOLDER),)
    if not cases and not Path(folders[0]).is_dir():
        raise WrongUsageError(f"there is no folder `{folders[0]}`", f"name the case files of pack `{pack}`")
    found = [case for folder in folders for case in load_cases(folder, judged.id)]
    failed = list(_failures(found, given))
    lines = [*failed, *_one_sided(judged, found)]
    counted = f"{len(found)} case{'' if len(found) == 1 else 's'}"
    lines.append(f"{counted}: {f'{len(failed)} not as expected' if failed else 'all as expected'}")
    emit("\n".join(lines) + "\n")
    click.get_current_context().exit(1 if failed else 0)


def _pack(name: str) -> tuple[RulePack, Sequence[RulePack]]:
    """Return the pack to test, and the packs that checks need beside the installed ones."""
    plugins = load_plugins()
    if name in plugins.packs and not Path(name).is_file():
        installed = plugins.pack(name)
        if installed is None:
            raise WrongUsageError(f"rule pack `{name}` is installed and cannot be loaded", "`cqos packs` says why")
        return replace(installed, validated=False), ()
    (pack,) = packs = read_packs((name,))
    return pack, packs


def _failures(cases: Iterable[Case], packs: Sequence[RulePack]) -> Iterator[str]:
    for case in cases:
        try:
            run_case(case, packs)
        except AssertionError as error:
            yield str(error)
        except CqosError as error:
            yield f"{case} ({case.source})\n  cannot be run: {error}"


def _one_sided(pack: RulePack, cases: Sequence[Case]) -> Iterator[str]:
    """Yield the rules without a case in which they report, and those without a case in which they are silent."""
    silent = {case.rule for case in cases if case.content["expect"] == "ok"}
    reported = {case.rule for case in cases if case.content["expect"] != "ok"}
    for what, tried in (("reports", reported), ("is silent", silent)):
        if missing := [rule.code for rule in pack.rules if rule.code not in tried]:
            yield f"no case where it {what}: {listed(missing)}"
