"""``cqos init``: a commented configuration for what lies in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from cqos_core import config
from cqos_core.cli.parameters import debug_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.streams import emit, say
from cqos_core.files.loading import load_paths, protocols_of
from cqos_core.formatters.terminal import wrap
from cqos_core.importers.yaml_form import ACCEPT, SEVERITIES
from cqos_core.model.problems import CqosError
from cqos_core.model.remarks import plural
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.files.loading import Loaded
    from cqos_core.importers.forms import Key
    from cqos_core.packs.pack import RulePack

_WIDTH: Final = 100


@click.command(
    epilog="Exit codes: 0 written; 2 wrong usage, a configuration is there already, or the file cannot be written; "
    "3 internal error."
)
@click.argument("folder", default=".", type=click.Path(exists=True, file_okay=False))
@debug_option
def init(folder: str) -> None:
    """Write a commented cqos.toml for what lies in a folder.

    Looks for designs in FOLDER (the working directory if none is given) and below it. States the protocol that they have in
    common, and lists what else a configuration may state, in comments. An existing configuration is never changed.

    \b
    Examples:
      cqos init
      cqos init robots/beta
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    target = Path(folder) / config.NAME
    there = config.find_config(folder)
    if there is not None and there.absolute().parent == target.absolute().parent:
        raise CqosError(f"{there} is there already; C-QoS does not overwrite it")
    with Progress("reading") as progress:
        loaded = load_paths([folder], step=progress.step)
    seen = sorted(protocols_of(system for _, system in loaded.systems))
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(configuration(_found(loaded, seen), seen, {*load_plugins().packs}))
    except OSError as error:
        raise CqosError(f"cannot write {target}: {error.strerror}") from None
    emit(f"{target} is written: {_found(loaded, seen)}\n")
    if loaded.problems:
        say(
            f"{plural(len(loaded.problems), 'problem')} of files that cannot be read; see `cqos check {folder}`",
            severity="warning",
        )
    if there is not None:
        say(f'{there} no longer counts here; to keep it, write `extends = ["…"]`', severity="note")


def _found(loaded: Loaded, protocols: Sequence[str]) -> str:
    wholes = sum(not system.partial for _, system in loaded.systems)
    parts = len(loaded.systems) - wholes
    counts = [plural(wholes, "whole system"), plural(parts, "file") + " with a part of one"]
    what = " and ".join(count for count, number in zip(counts, (wholes, parts), strict=True) if number)
    of = f", of {', '.join(protocols)}" if protocols else ""
    return f"{what or 'no design'} found{of}"


def configuration(found: str, seen: Sequence[str], installed: set[str]) -> str:
    """Return the text of a configuration that states the one protocol of ``seen``, and lists all else in comments."""
    packs = [pack for name in seen if (pack := load_plugins().pack(name)) is not None]
    rule = next((rule.code for pack in packs for rule in pack.rules), "CQ403")
    stated = "" if len(seen) == 1 else "# "
    blocks = [
        [
            *_comment("Configuration of C-QoS for this folder and those below it. Every key may be left out."),
            f"# When this was written: {found}.",
        ],
        [*_key(config.PROTOCOL), f'{stated}protocol = "{next(iter(seen or sorted(installed)), "")}"'],
        [*_key(config.FAIL_ON), '# fail_on = "warning"'],
        [*_key(config.SHOW), '# show = "notes"'],
        [*_key(config.FORMAT), '# format = "concise"'],
        [*_key(config.EXCLUDE), '# exclude = ["/old/", "*_test.yaml"]'],
        [*_key(config.BASELINE), '# baseline = "known.json"  # cqos check . --write-baseline known.json'],
        [*_key(config.PACKS), '# packs = ["my_pack.yaml"]'],
        [*_key(config.EXTENDS), '# extends = ["../team.toml"]'],
        *(list(_options(pack)) for pack in packs),
        [*_key(SEVERITIES), "[severities]", f'# {rule} = "warning"  # error, warning, note or off'],
        [
            *_key(ACCEPT),
            "# [[accept]]",
            f'# rule = "{rule}"',
            '# topic = "/camera/*"',
            '# because = "a lost frame is replaced by the next one"',
            '# until = "2099-12-31"',
        ],
    ]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _options(pack: RulePack) -> Iterator[str]:
    """Yield a table of the options that have no default, where few values are possible."""
    yield from _comment(f"What is known of the deployment. `cqos packs {pack.id}` lists all options of {pack.title}.")
    yield f"[options.{pack.id}]"
    for policy in pack.policies:
        values = policy.domain.describe().get("values")
        if policy.level == "option" and policy.default is None and values:
            yield from _comment(f"{policy.doc} One of {', '.join(values)}.")
            yield f'# {policy.name} = "{values[0]}"'


def _key(key: Key[Any]) -> Iterator[str]:
    return _comment(key.help)


def _comment(text: str) -> Iterator[str]:
    return (f"# {line}" for line in wrap(text, _WIDTH - 2))
