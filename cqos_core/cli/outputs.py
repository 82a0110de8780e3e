"""Outputs of reports: formats, and the files that they are written to."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from cqos_core.cli.console import emit
from cqos_core.cli.errors import wrong_usage
from cqos_core.cli.file_output import write_file
from cqos_core.formatters.multi_system import combined_report
from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import CqosError, add_note, describe, keep_traceback
from cqos_core.plugins import FAULTS, load_plugins

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cqos_core.model.problems import Problem
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style

STDOUT = "-"
DEFAULT_FORMAT = "text"


@dataclass(frozen=True, slots=True)
class OutputTarget:
    """One format, and the file it is written to; ``-`` is standard output."""

    format: str
    path: str = STDOUT

    def write(self, text: str) -> None:
        """Write a rendered report."""
        if self.path == STDOUT:
            emit(text)
        else:
            write_file(self.path, text)


class OutputPairingCommand(click.Command):
    """A command that records the order of ``--format`` and ``--output``, so that they can be paired."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Record the order, then parse."""
        if not ctx.resilient_parsing:
            _, _, order = self.make_parser(ctx).parse_args(list(args))
            ctx.meta[__name__] = [param.name for param in order if param.name in {"formats", "outputs"}]
        return super().parse_args(ctx, args)


def pair_outputs(
    ctx: click.Context,
    formats: Sequence[str],
    outputs: Sequence[str],
    default: str = DEFAULT_FORMAT,
) -> list[OutputTarget]:
    """Pair formats with outputs in the order of the command line, and refuse combinations without a meaning.

    Each output belongs to the format before it; one that stands first, to the format after it. ``default`` is the format
    where none is named.
    """
    left = {"formats": iter(formats), "outputs": iter(outputs)}
    order: list[str] = ctx.meta.get(__name__, [])
    pairs: list[list[str | None]] = []
    for kind in order:
        place = 0 if kind == "formats" else 1
        if not pairs or pairs[-1][place] is not None:
            pairs.append([None, None])
        pairs[-1][place] = next(left[kind])
    unpaired = [output for name, output in pairs if name is None]
    if unpaired and len(pairs) > 1:
        raise wrong_usage(
            "--output", f"`{unpaired[0]}` has no format of its own", "write --format before each --output"
        )
    sinks = [OutputTarget(name or default, output or STDOUT) for name, output in pairs] or [OutputTarget(default)]
    _refuse_clashes(sinks)
    return sinks


def _refuse_clashes(sinks: Sequence[OutputTarget]) -> None:
    seen: dict[str, OutputTarget] = {}
    for sink in sinks:
        other = seen.setdefault(STDOUT if sink.path == STDOUT else os.path.realpath(sink.path), sink)
        if other is not sink:
            where = "standard output" if sink.path == STDOUT else f"`{sink.path}`"
            message = f"{other.format} and {sink.format} would both go to {where}"
            raise wrong_usage("--output", message, "give each a file with --output")


def check_output_paths(option: str, targets: Iterable[str], inputs: Iterable[str]) -> None:
    """Refuse files that cannot be written, or would overwrite an input, before the work is done.

    Raises:
        RefusedError: naming the file and what is wrong with it.
    """
    read = [*inputs]
    for target in targets:
        from cqos_core.files.atomic_writes import is_same_file  # few runs write files

        folder = os.path.dirname(target) or "."  # noqa: PTH120 - any text may be given
        is_input = any(is_same_file(target, each) for each in read)
        for is_wrong, message, advice in (
            (is_input, f"`{target}` is an input and would be overwritten", "name another file"),
            (os.path.isdir(target), f"`{target}` is a folder", "name a file in it"),  # noqa: PTH112
            (not os.path.isdir(folder), f"there is no folder `{folder}` to write `{target}` into", "make the folder"),  # noqa: PTH112
        ):
            if is_wrong:
                raise wrong_usage(option, message, advice)


def render(sink: OutputTarget, reports: Sequence[Report], problems: Sequence[Problem], style: Style) -> str:
    """Return the text for one target: a report of all systems. For programs, unread inputs are findings in it.

    Raises:
        CqosError: the formatter is a plugin's and failed.
    """
    info = load_plugins().formatters[sink.format]
    if info.for_people and not reports:
        return ""
    with blame_plugin("formatters", sink.format):
        rendered: object = info.load()(combined_report(reports, () if info.for_people else problems), style)
        if not isinstance(rendered, str):
            raise TypeError(f"it returned a {type(rendered).__name__}, no text")
    return rendered


@contextmanager
def blame_plugin(kind: str, name: str) -> Iterator[None]:
    """Turn exceptions of a plugin's formatter, exporter or translator into an error that names the plugin.

    Raises:
        CqosError: it is a plugin's and failed.
    """
    plugins, what = load_plugins(), f"{kind.removesuffix('s')} `{name}`"
    try:
        yield
    except FAULTS as error:
        owner = plugins.owner(kind, name)
        if plugins.shipped(kind, name):
            add_note(error, f"{what} ({owner}) was writing")
            raise
        keep_traceback(f"{what} of {owner}", error)
        raise CqosError(f"{what} of {owner} failed: {describe(error)}") from error
