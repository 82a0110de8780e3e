"""``cqos convert``: write a system, or only its fixes, in another form."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import click

from cqos_core.cli.console import emit, say
from cqos_core.cli.errors import WrongUsageError, say_error, wrong_usage
from cqos_core.cli.exit_codes import UNUSABLE
from cqos_core.cli.file_output import write_file
from cqos_core.cli.help import usual
from cqos_core.cli.input_reader import prepare_reader
from cqos_core.cli.outputs import blame_plugin, check_output_paths
from cqos_core.cli.parameters import (
    Registered,
    color_option,
    debug_option,
    fix_option,
    nearest,
    output_option,
    weaken_option,
)
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, reading_options
from cqos_core.files.folder_writer import write_folder
from cqos_core.model.finding import plural
from cqos_core.packs.export import ExportContext, Exported
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.analysis.system_fixes import FixedSystem
    from cqos_core.cli.input_reader import InputReader
    from cqos_core.model.system import System
    from cqos_core.plugins import ExporterInfo

_MOST_NOTES: Final = 50


@click.command(
    epilog="Exit codes: 0 written, or nothing to fix; 2 wrong usage, input that cannot be read, or nothing of it can be "
    "expressed; 3 internal error."
)
@usual("--to", "--output", "--set", "--fix", "--launch", "--option")
@click.argument("paths", nargs=-1, required=True, metavar="PATH...")
@click.option("--to", "exporter", type=Registered("exporters"), required=True, help="The form to write.")
@output_option()
@click.option(
    "--set",
    "settings",
    metavar="NAME=VALUE",
    multiple=True,
    help="A setting of the form; `cqos packs` lists them. Can be repeated.",
)
@fix_option
@click.option("--change-program", is_flag=True, help="With --fix, take also fixes that need a change of the program.")
@weaken_option
@reading_options
@color_option
@debug_option
@click.pass_context
def convert(
    ctx: click.Context,
    *,
    paths: tuple[str, ...],
    exporter: str,
    output: str | None,
    settings: tuple[str, ...],
    fix: bool,
    change_program: bool,
    weaken: bool,
    reading: ReadingOptions,
    color: str,
) -> None:
    """Write a system in another form: as a design in YAML, as parameters, as code.

    All paths are one system. C-QoS reports on standard error what the form cannot express. With --fix, it first fixes each error by
    the first fix that needs no change of the program and weakens nothing; forms that hold nothing but settings then get only what was changed.

    \b
    Examples:
      cqos convert model.bpmn --to yaml --output system.yaml
      cqos convert bag/metadata.yaml --to yaml
      cqos convert system.yaml --to qos_overrides --fix
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    if change_program and not fix:
        raise WrongUsageError("--change-program has no effect without --fix", "write --fix too")
    if weaken and not fix:
        raise WrongUsageError("--weaken has no effect without --fix", "write --fix too")
    info = load_plugins().exporters[exporter]
    chosen = _settings(info, settings)
    reader = prepare_reader(reading, paths)
    check_output_paths("--output", [] if output is None else [output], paths)
    system, _ = reader.read_system(paths, color)  # half of a system would pass for the whole of it
    read = (*system.sources, *reader.config.sources, *reader.config.packs, *reader.options.pack_files)
    check_output_paths("--output", [] if output is None else [output], read)
    fixed = None
    if fix:
        from cqos_core.analysis.system_fixes import fix_system

        with Progress("fixing"):
            fixed = fix_system(system, reader.context, "first" if change_program else "configuration", weaken=weaken)
    for note in system.notes:  # the report that would hold them is not made here
        if note.severity != "note":
            where = "" if note.place is None else f"{note.place}: "
            say(f"{where}{note.message}", head=f"{note.severity}[{note.code}]", choice=color)
    if fixed is not None and not _say_fixed(fixed, color):
        return
    with Progress("writing"):
        exported = _export(info, system if fixed is None else fixed.system, reader, chosen, fixed)
    more = [f"{len(exported.notes) - _MOST_NOTES} more like these"] if len(exported.notes) > _MOST_NOTES else []
    for text in (*exported.notes[:_MOST_NOTES], *more):
        say(text, severity="note", choice=color)
    if not exported.expressed:
        alone = "" if system.endpoints else "no endpoint is in it, so name the files of the participants beside it"
        say_error(f"nothing of it can be expressed as {info.name}, so nothing is written", alone, color)
        ctx.exit(UNUSABLE)
    if output is None:
        emit(exported.text)
    elif exported.files:
        write_folder(output, exported.files)
    else:
        write_file(output, exported.text)


def _settings(info: ExporterInfo, stated: Iterable[str]) -> dict[str, str]:
    """Return the settings of an exporter: those stated, the others by default."""
    choices = info.choices()
    chosen = {name: values[0] for name, values in choices.items()}
    for text in stated:
        name, equals, value = text.partition("=")
        if name not in choices or not equals:
            advice = nearest(name, choices) if choices else "leave --set out: it has no settings"
            raise wrong_usage("--set", f"{info.name} has no setting `{text}`", advice)
        if value not in choices[name]:
            raise wrong_usage("--set", f"`{name}` is not `{value}`", f"write one of {', '.join(choices[name])}")
        chosen[name] = value
    return chosen


def _export(
    info: ExporterInfo, system: System, reader: InputReader, settings: dict[str, str], fixed: FixedSystem | None
) -> Exported:
    """Run the exporter.

    Raises:
        CqosError: the exporter is a plugin's and failed, or returned what cannot be written.
    """
    where, changed = reader.context, None if fixed is None else fixed.changed
    with blame_plugin("exporters", info.name):
        exported: object = info.load()(
            system, ExportContext(where.find_pack, where.default_protocol, settings, changed, where.find_rule)
        )
        if not isinstance(exported, Exported):
            raise TypeError(f"its writer returned a {type(exported).__name__}, not an Exported")
        if not isinstance(exported.text, str):
            raise TypeError(f"its writer returned a text of type {type(exported.text).__name__}, not str")
    return exported


def _say_fixed(fixed: FixedSystem, color: str) -> bool:
    """Print which errors were fixed and which were not; return whether any was fixed."""
    for error in fixed.left:
        say(f"still there: {error.message} ({error.code})", severity="warning", choice=color)
    for each in fixed.applied:
        say(f"{each.remedy.text} (for {each.code})", head="fixed:", choice=color)
    if not fixed.applied and fixed.left:
        count = plural(len(fixed.left), "error")
        say(f"no such fix is known for {count}, so nothing is written", severity="warning", choice=color)
    elif not fixed.applied:
        say("there is no error to fix, so nothing is written", severity="note", choice=color)
    return bool(fixed.applied)
