"""``cqos learn``: node files from sources."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from cqos_core.cli.console import emit, say
from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.file_output import replace_files, write_new_file
from cqos_core.cli.help import usual
from cqos_core.cli.parameters import debug_option, diff_option, output_option
from cqos_core.cli.progress import Progress
from cqos_core.importers.source_reading import did_you_mean
from cqos_core.model.finding import plural
from cqos_core.model.problems import InputError, Problem

if TYPE_CHECKING:
    from cqos_ros2_sources.node_files.node_file_maker import Learned
    from cqos_ros2_sources.programs.packages import Parsed
    from cqos_ros2_workspace.launch.workspace import Workspace


class Kept(NamedTuple):
    """A node file that is there.

    Attributes:
        document: what it states; None where it is missing.
        corrections: the lines that state its corrections.
        data: all of it.
    """

    path: str
    document: dict[str, Any] | None = None
    corrections: str = ""
    data: bytes = b""


_MOST_GAPS: Final = 20


@click.command(
    epilog="Exit codes: 0 written, or the same as the sources; 1 --diff found a difference; 2 wrong usage, no package, or "
    "the parser of C++ is not installed; 3 internal error."
)
@usual("--package", "--output", "--diff", "--node", "--calls")
@click.argument("path")
@click.option("--package", "packages", metavar="NAME", multiple=True, help="Only this package. Can be repeated.")
@output_option("DIR")
@diff_option
@click.option(
    "--node",
    "nodes",
    metavar="NODE=EXECUTABLE",
    multiple=True,
    help="A node of what ran, and its program. Can be repeated.",
)
@click.option("--calls", metavar="FILE", multiple=True, help="A table of further calls to follow. Can be repeated.")
@debug_option
@click.pass_context
def learn(
    ctx: click.Context,
    *,
    path: str,
    packages: tuple[str, ...],
    output: str | None,
    show_diff: bool,
    nodes: tuple[str, ...],
    calls: tuple[str, ...],
) -> None:
    """Write node files from the sources of ROS 2 packages, or a system file from those of MQTT clients.

    PATH is a package or a folder with packages; in any other folder, the programs are read as clients of brokers. It may also be a
    file: NoDL, a node design of Autoware, or what `cqos snapshot` or `ros2 topic info --verbose` wrote. Then each node becomes a
    node file of its own, and none is replaced. C-QoS
    reads C++ and Python as text and executes nothing. What the sources do not decide is written down as not known, with
    its cause. Without --output, each node file goes into its package.

    \b
    Examples:
      cqos learn src/my_robot
      cqos learn ~/ws/src --package my_driver --output nodes
      cqos learn src/my_robot --diff
      cqos learn firmware --output systems
      cqos learn running.yaml --package my_driver --node /robot/driver=driver_node
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    from cqos_ros2_sources.programs.packages import Parsed

    if os.path.isfile(path):  # noqa: PTH113 - Path.is_file raises where a path is too long
        _convert(path, packages, nodes, output, unfit={"--diff": show_diff, "--calls": calls})
        return
    if nodes:
        raise WrongUsageError("--node is for a file of what ran", "write its path", ctx)
    if not packages and _without_packages(path):
        from cqos_ros2_sources.clients_command import learn_folder

        if learn_folder(path, output, calls, check=show_diff):
            ctx.exit(1)
        return
    workspace, chosen = _packages(path, packages)
    differing = 0
    parsed = Parsed()
    for name in chosen:
        kept = _there(name, workspace, output)
        learned = _learned(name, workspace, calls, kept.document, parsed)
        if show_diff:
            differing += _check(learned, kept)
        else:
            _write(learned, output, kept)
    if differing:
        ctx.exit(1)


def _convert(
    path: str, packages: tuple[str, ...], nodes: tuple[str, ...], output: str | None, unfit: dict[str, Any]
) -> None:
    from cqos_ros2_sources.node_files.foreign_node_files import convert

    for option in (name for name, given in unfit.items() if given):
        raise WrongUsageError(f"{option} is for sources, and `{path}` is another file", f"leave {option} out")
    if len(packages) > 1:
        raise WrongUsageError("the nodes of a file are of one package", "write --package once")
    convert(path, next(iter(packages), None), nodes, output)


def _without_packages(path: str) -> bool:
    """Whether a path is a folder in which no package is."""
    from cqos_ros2_workspace.launch.workspace import find_packages

    return os.path.isdir(path) and not find_packages(path).packages  # noqa: PTH112 - Path.is_dir raises where a path is too long


def _packages(path: str, wanted: tuple[str, ...]) -> tuple[Workspace, list[str]]:
    """Return the workspace and the packages that a path names.

    Raises:
        InputError: there is no such folder or package.
    """
    from cqos_ros2_workspace.launch.workspace import find_packages, root_of

    if not os.path.isdir(path):  # noqa: PTH112 - Path.is_dir raises where a path is too long
        raise InputError(
            [Problem("CQ001", f"there is no folder `{path[:120]}`", None, "name a package or a folder with packages")]
        )
    inner = find_packages(path)
    workspace = inner
    if len(inner.packages) == 1 and os.path.realpath(path) in inner.packages.values():
        workspace = find_packages(root_of(os.path.join(path, "package.xml")))  # noqa: PTH118
        workspace = workspace if inner.packages.items() <= workspace.packages.items() else inner
    if not inner.packages:
        raise InputError([no_package(path)])
    for name in wanted:
        if name not in inner.packages:
            message = f"there is no package `{name[:80]}`{did_you_mean(name, inner.packages)}"
            raise InputError(
                [Problem("CQ001", message, None, f"{plural(len(inner.packages), 'package')} in `{path[:120]}`")]
            )
    return workspace, sorted(wanted or inner.packages)


def no_package(path: str) -> Problem:
    """Return the problem of a folder without packages."""
    advice = "a package is a folder with a package.xml"
    return Problem("CQ001", f"there is no package in `{path[:120]}`", None, advice)


def _learned(
    name: str, workspace: Workspace, calls: tuple[str, ...], kept: dict[str, Any] | None, parsed: Parsed
) -> Learned:
    from cqos_ros2_sources.node_files.node_file_maker import learn as learn_package
    from cqos_ros2_sources.programs.packages import NoParserError

    try:
        with Progress(f"learning {name}"):
            return learn_package(name, workspace, calls, kept, parsed)
    except NoParserError:
        from cqos_core.model.optional_features import missing

        message = f"`{name}` has sources in C++, and their parser is not installed"
        raise missing("ros2_sources", message) from None


def _there(name: str, workspace: Workspace, output: str | None) -> Kept:
    """Return the path of the node file of a package, and its content where it is there and can be read."""
    import yaml

    from cqos_ros2_workspace.launch.values import Unknown

    folder = output if output is not None else workspace.packages[name]
    path = os.path.join(folder, f"{name}.node.yaml")  # noqa: PTH118
    if output is None:
        found = workspace.files_of(name).get(f"{name}.node.yaml", [])
        path = min(found) if found else path
    inside = os.path.relpath(path)
    path = path if inside.startswith(os.pardir) else inside
    if not os.path.isfile(path):  # noqa: PTH113
        return Kept(path)
    from pathlib import Path

    from cqos_core.model.source import Source
    from cqos_ros2_workspace.nodes.reading import read_node_file

    data = workspace.read(path, None) if output is None else Path(path).read_bytes()
    if isinstance(data, Unknown):
        raise InputError([Problem("CQ001", f"{path}: {data.cause}", None, "name another folder with --output")])
    read_node_file(Source(path, data))
    document = yaml.safe_load(data)
    return Kept(path, document, _corrections(data), data)


def _corrections(data: bytes) -> str:
    """Return the lines of a node file that state corrections, with the comments in and above them."""
    import yaml

    from cqos_core.model.encoding import decode
    from cqos_ros2_sources.node_files.node_file_maker import HEAD

    text = decode(data)
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    if not isinstance(root, yaml.MappingNode):
        return ""
    keys = {key.value: key.start_mark.line for key, _ in root.value}
    if "corrections" not in keys:
        return ""
    if root.flow_style:
        return yaml.safe_dump({"corrections": yaml.safe_load(text)["corrections"]}, sort_keys=False)
    lines, begin = text.splitlines(keepends=True), keys["corrections"]
    end = min((line for line in keys.values() if line > begin), default=len(lines))
    head = len(HEAD.splitlines()) if text.startswith(HEAD) else 0
    while begin > head and lines[begin - 1].startswith("#"):
        begin -= 1
    return "".join(lines[begin:end])


def _check(learned: Learned, kept: Kept) -> int:
    """Print what differs between a node file and the sources; return whether anything does."""
    from cqos_ros2_sources.node_files.node_file_diff import differences, left_over

    path, document, *_ = kept
    if document is None:
        if learned.empty:
            return 0
        emit(f"{path}: there is no such node file; `cqos learn` writes it\n")
        return 1
    found = [*differences(document, learned.document), *left_over(document.get("corrections"), learned.document)]
    if not found:
        emit(f"{path}: as the sources say\n")
        return 0
    emit(f"{path}: {plural(len(found), 'difference')} from the sources\n" + "".join(f"  {each}\n" for each in found))
    return 1


def _write(learned: Learned, output: str | None, kept: Kept) -> None:
    """Write a node file, and say what is in it and what is not known.

    Raises:
        InputError: its corrections do not fit the sources; the file is left as it is.
    """
    path, before, corrections, data = kept
    if learned.empty:
        emit(f"{learned.package}: no nodes\n")
    elif before is not None and (before.get("from") or {}).get("by") != "learn":
        say(
            f"{path} was not written by `cqos learn`, so it is left as it is; --output names another folder",
            severity="warning",
        )
    else:
        text = learned.text + corrections
        if before is not None and corrections:
            _refuse_misfits(path, text, before["corrections"], learned)
        if output is not None:
            os.makedirs(output, exist_ok=True)  # noqa: PTH103
        if before is None:
            write_new_file(path, text)
        else:
            replace_files({path: text.encode()}, {path: data})
        emit(f"{path}: {_counted(learned)}\n")
    say_gaps(learned.package, learned.gaps)


def _refuse_misfits(path: str, text: str, corrections: dict[str, Any] | None, learned: Learned) -> None:
    """Refuse corrections of what the sources do not have, and those that refer to lines that are no longer there."""
    from cqos_core.model.source import Source
    from cqos_ros2_sources.node_files.node_file_diff import left_over
    from cqos_ros2_workspace.nodes.reading import read_node_file

    advice = "remove the correction or change its name; the file is left as it is"
    found = [Problem("CQ011", f"{path}: {each}", None, advice) for each in left_over(corrections, learned.document)]
    if found:
        raise InputError(found)
    try:
        read_node_file(Source(path, text.encode()))
    except InputError as error:
        advice = "write the correction without it; the file is left as it is"
        raise InputError(
            [Problem(each.code, f"{path}: in `corrections`, {each.message}", None, advice) for each in error.problems]
        ) from None


def say_gaps(name: str, gaps: list[tuple[str, str, str]]) -> None:
    """Say what is not known, and why; the first of many."""
    for what, cause, at in gaps[:_MOST_GAPS]:
        say(f"{name}: {what} is not known: {cause} ({at})", severity="note")
    if len(gaps) > _MOST_GAPS:
        say(f"{name}: {len(gaps) - _MOST_GAPS} more like these", severity="note")


def _counted(learned: Learned) -> str:
    from cqos_ros2_sources.node_files.node_file_maker import counts

    found = counts(learned.document)
    text = f"{plural(found.nodes, 'node')}, {plural(found.endpoints, 'endpoint')}"
    return f"{text}; {found.names} with their names, {found.qualities} with their quality of service"
