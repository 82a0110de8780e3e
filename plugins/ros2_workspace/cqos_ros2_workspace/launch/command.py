"""``cqos launch``: what a launch file would start, without ROS 2."""

from __future__ import annotations

import json

import click

from cqos_core.cli.console import emit
from cqos_core.cli.errors import WrongUsageError, wrong_usage
from cqos_core.cli.help import usual
from cqos_core.cli.parameters import Assignment, debug_option, form_option, nearest, variables_option
from cqos_core.cli.progress import Progress


@click.command(
    epilog="Exit codes: 0 read, also where something is not known; 1 nothing starts, and something could not be read; "
    "2 wrong usage, or the file cannot be found; 3 internal error."
)
@usual("--launch-arg", "--define", "--format")
@click.argument("named", nargs=-1, required=True, metavar="[DIR] FILE")
@click.option(
    "--launch-arg",
    "arguments",
    metavar="NAME:=VALUE",
    multiple=True,
    help="The value of a launch argument. Can be repeated.",
)
@variables_option
@form_option
@debug_option
@click.pass_context
def launch(
    ctx: click.Context,
    *,
    named: tuple[str, ...],
    arguments: tuple[str, ...],
    variables: tuple[Assignment, ...],
    form: str,
) -> None:
    """Print what a ROS 2 launch file would start.

    FILE is a path or PACKAGE:FILE. DIR is the folder whose packages are looked up; without it, `src` or the repository above
    FILE, or the working directory. C-QoS reads launch files in Python, XML and YAML as text, with what they include, and executes nothing.

    \b
    Examples:
      cqos launch src/my_robot_bringup/launch/robot.launch.py
      cqos launch ~/ws/src nav2_bringup:bringup_launch.py
      cqos launch robot.launch.xml --launch-arg sim:=true --format json
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    from cqos_ros2_workspace.launch.entry_point import argument, entry_point
    from cqos_ros2_workspace.launch.launch_evaluation import launch as read_launch
    from cqos_ros2_workspace.launch.launch_output import as_data, as_text

    if len(named) > 2:  # noqa: PLR2004 - DIR and FILE
        raise WrongUsageError(f"{len(named)} paths are named, and one folder and one launch file are read", ctx=ctx)
    given = dict(map(argument, arguments))
    with Progress("reading"):
        packages, path = entry_point(named[-1], named[0] if named[1:] else None)
        found = read_launch(packages, path, given, {each.name: each.value for each in variables})
    unused = [name for name in given if name not in found.arguments]
    if unused and found.arguments:
        message = f"the launch declares no argument `{unused[0]}`"
        raise wrong_usage("--launch-arg", message, nearest(unused[0], found.arguments))
    if form == "json":
        emit(json.dumps(as_data(found, packages), indent=2, ensure_ascii=False) + "\n")
    else:
        emit(as_text(found, packages))
    if found.remarks and not found.instances:
        ctx.exit(1)
