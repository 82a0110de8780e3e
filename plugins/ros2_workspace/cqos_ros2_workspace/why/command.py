"""``cqos why``: why nothing arrives on a topic."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import click

from cqos_core.cli.console import colored, emit
from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.help import usual
from cqos_core.cli.input_reader import prepare_reader
from cqos_core.cli.parameters import color_option, debug_option, form_option, log_option
from cqos_core.cli.progress import Progress
from cqos_core.cli.reading_options import ReadingOptions, reading_options
from cqos_core.files.source_files import STDIN
from cqos_core.formatters.terminal import clean, paint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_ros2_workspace.why.causes import Answer, Cause

_MARKS = {"found": ("found", "error"), "excluded": ("no", "quiet"), "not known": ("?", "warning")}


@click.command(
    epilog="Exit codes: 0 no cause found; 1 a cause found; 2 wrong usage or input that cannot be read; 3 internal error."
)
@usual("--launch", "--launch-arg", "--log", "--keystore", "--option", "--format")
@click.argument("paths", nargs=-1, required=True, metavar="PATH...")
@click.argument("topic")
@log_option
@click.option("--keystore", metavar="DIR", help="Also read governance.xml and permissions.xml of a keystore of SROS 2.")
@reading_options
@form_option
@color_option
@debug_option
@click.pass_context
def why(
    ctx: click.Context,
    *,
    paths: tuple[str, ...],
    topic: str,
    log: str | None,
    keystore: str | None,
    reading: ReadingOptions,
    form: str,
    color: str,
) -> None:
    """Find the cause of a silent topic of ROS 2.

    C-QoS walks one list of causes. It marks each as found, excluded or not known by what the paths say, and ends with what to do. A path is
    a system file, a snapshot, a recording, or a workspace with --launch.

    \b
    Examples:
      cqos why src /scan --launch bot_bringup:sim.launch.py
      cqos why topic_info.txt /map --log ~/.ros/log/launch.log
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    from cqos_ros2_workspace.why.causes import CAUSES
    from cqos_ros2_workspace.why.topic_facts import evidence

    if log == STDIN and (STDIN in paths or sys.stdin is None):
        raise WrongUsageError("standard input is read for a path, or closed", "write the path of the log", ctx)
    reader = prepare_reader(reading, paths)
    system, _ = reader.read_system(paths, color)
    with Progress("looking for causes"):
        seen = evidence(topic, system, reader, paths, log, keystore)
        found = [(cause, cause.look(seen)) for cause in CAUSES]
    if form == "json":
        causes = [{"cause": cause.name, **answer._asdict()} for cause, answer in found]
        emit(json.dumps({"version": 1, "topic": seen.topic, "causes": causes}, indent=2, ensure_ascii=False) + "\n")
    else:
        emit(_text(seen.topic, found, color=colored(color, sys.stdout)))
    ctx.exit(1 if any(answer.state == "found" for _, answer in found) else 0)


def _text(topic: str, found: Sequence[tuple[Cause, Answer]], *, color: bool) -> str:
    pen = paint(color=color)
    width = max(len(cause.name) for cause, _ in found)
    lines = [f"why does nothing arrive on {clean(topic)}?", ""]
    for cause, answer in found:
        mark, role = _MARKS[answer.state]
        lines.append(f"  {pen(f'{mark:>5}', role)}  {cause.name:<{width}}  {clean(answer.text)}")
    first = next((answer for _, answer in found if answer.state == "found" and answer.do), None)
    ask = next((answer for _, answer in found if answer.state == "not known" and answer.do), None)
    best = first or ask
    if best is not None:
        lines += ["", f"{'Do' if first else 'Ask'}: {clean(best.do)}"]
    return "\n".join(lines) + "\n"
