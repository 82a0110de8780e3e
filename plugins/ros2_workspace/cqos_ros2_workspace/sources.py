"""The commands that check sources which no launch file starts: they read the sources, and write a launch file for the nodes."""

from __future__ import annotations

import os
import posixpath
import re
import shlex
from typing import TYPE_CHECKING, Final

from cqos_core.model.finding import plural
from cqos_core.model.folder_suggestion import FolderSuggestion
from cqos_core.model.problems import MissingError
from cqos_ros2_workspace.path_context import MANIFEST, all_below, as_written, content

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_ros2_workspace.launch.workspace import Workspace

SOURCES: Final = (".cpp", ".cc", ".cxx", ".hpp", ".hh", ".h", ".py")
_NAME: Final = re.compile(r"[\w.:-]+")
ROS: Final = re.compile(rb"\b(?:rclcpp|rclpy|rclcpp_lifecycle|rclcpp_components)\b")
CLIENTS: Final = re.compile(
    rb"\b(?:paho|aiomqtt|asyncio_mqtt|gmqtt|PubSubClient|AsyncMqttClient|esp_mqtt_client|mqtt_async|MQTTClient\w*|mosquittopp|mosquitto_\w+)\b"
)
_MAIN_PYTHON: Final = re.compile(rb"^def[ \t]+main[ \t]*\(", re.MULTILINE)
_MAIN_CPP: Final = re.compile(rb"\bint[ \t]+main[ \t]*\(")
MOST_SOURCES: Final = 200
_MOST_NODES: Final = 30
_MOST_LEARNED: Final = 10
_NEW: Final = "nodes.launch.yaml"


def of_sources(path: str, folder: str | None) -> FolderSuggestion | None:
    """Return the commands that read sources and check what their programs do."""
    from cqos_ros2_workspace.executables import executables_of
    from cqos_ros2_workspace.launch.workspace import find_packages

    if folder is None:
        single = os.path.isfile(path)  # noqa: PTH113
        return _loose(posixpath.dirname(path) or ".", [path]) if single else _loose(path, all_below(path))
    workspace = find_packages(folder)
    nodes = []
    packages = [name for name in workspace.packages if _has_sources(workspace, name)]
    for name in packages:
        found = executables_of(name, workspace)
        every = {**found.components, **found.scripts, **found.files, **found.sources}
        nodes += [(name, each) for each in every if not found.files.get(each, ".py").endswith((".yaml", ".sh"))]
    if not packages:
        return None
    single = os.path.isfile(path)  # noqa: PTH113
    what = "these are sources of ROS 2 nodes" if single else f"sources of {plural(len(packages), 'package')}"
    message = f"{what}, and no launch file says which nodes run, so they are not checked"
    if not nodes:
        nodes = _learned(packages, workspace)
    learn = f"cqos learn {shlex.quote(folder)}"
    inside = tuple(as_written(workspace.packages[name], folder) for name in packages)
    return FolderSuggestion(folder, message, commands=(learn, *new_launch(folder, nodes)), inside=inside)


def _learned(packages: Sequence[str], workspace: Workspace) -> list[tuple[str, str]]:
    """Return the nodes that sources define, where nothing says which programs they become."""
    from cqos_ros2_workspace.nodes.library import new_reader

    found: list[tuple[str, str]] = []
    try:
        read = new_reader()
    except MissingError:
        return found  # the command `cqos learn`, which comes first, says what to install
    for name in packages[:_MOST_LEARNED]:
        try:
            found += [(name, each) for each in read(name, workspace).document.get("nodes", ())]
        except MissingError:
            continue
    return found


def _has_sources(workspace: Workspace, package: str) -> bool:
    paths = [each for every in workspace.files_of(package).values() for each in every if each.endswith(SOURCES)]
    return any(ROS.search(content(each)) for each in paths[:MOST_SOURCES])


def _loose(folder: str, sources: Sequence[str]) -> FolderSuggestion:
    """Return the commands that make a folder of sources a package, and check what its programs do."""
    package, shown = plain(posixpath.basename(os.path.realpath(folder))).lower(), shlex.quote(folder)
    message = "sources of ROS 2 nodes outside of any package, and C-QoS reads the sources of packages"
    scripts, programs = {}, {}
    for path in [each for each in sources if each.endswith(SOURCES)][:MOST_SOURCES]:
        inner, data = posixpath.relpath(path, folder), content(path)
        name, ending = posixpath.splitext(inner)
        if not _NAME.fullmatch(inner.replace("/", ".")) or not ROS.search(data):
            continue
        if ending == ".py" and _MAIN_PYTHON.search(data):
            scripts[posixpath.basename(name)] = name.replace("/", ".")
        elif ending != ".py" and _MAIN_CPP.search(data):
            programs[posixpath.basename(name)] = inner
    commands = [new_manifest(package, folder)]
    # Files that are there stay as they are.
    if scripts and not os.path.exists(posixpath.join(folder, "setup.cfg")):  # noqa: PTH110 - text
        entries = "".join(f"  {name} = {module}:main\\n" for name, module in scripts.items())
        target = shlex.quote(posixpath.join(folder, "setup.cfg"))
        commands.append(f"printf '[options.entry_points]\\nconsole_scripts =\\n{entries}' > {target}")
    if programs and not os.path.exists(posixpath.join(folder, "CMakeLists.txt")):  # noqa: PTH110 - text
        added = " ".join(f"add_executable({name} {path})" for name, path in programs.items())
        commands.append(f"echo '{added}' > {shlex.quote(posixpath.join(folder, 'CMakeLists.txt'))}")
    nodes = [(package, name) for name in (*scripts, *programs)]
    return FolderSuggestion(folder, message, commands=(*commands, f"cqos learn {shown}", *new_launch(folder, nodes)))


def of_clients(folder: str, what: str) -> FolderSuggestion:
    """Return the commands that learn clients of brokers from sources, and check them."""
    output = shlex.quote(posixpath.join(folder, "systems"))
    message = f"{what}; `cqos learn` writes a system file from them"
    return FolderSuggestion(
        folder, message, commands=(f"cqos learn {shlex.quote(folder)} --output {output}", f"cqos check {output}")
    )


def new_launch(folder: str, nodes: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Return the commands that write a launch file which starts nodes, and check it."""
    named = [each for each in nodes if all(map(_NAME.fullmatch, each))][:_MOST_NODES]
    if not named:
        return (f"cqos check {shlex.quote(folder)} --launch FILE",)
    classes = [each for each in named if "::" in each[1]]
    entries = [f"{{node: {{pkg: {package}, exec: {name}}}}}" for package, name in named if "::" not in name]
    if classes:
        loaded = ", ".join(
            f'{{pkg: {package}, plugin: "{name}", name: {name.rpartition("::")[2].lower()}}}'
            for package, name in classes
        )
        container = 'pkg: rclcpp_components, exec: component_container, name: container, namespace: ""'
        entries.append(f"{{node_container: {{{container}, composable_node: [{loaded}]}}}}")
    file = shlex.quote(posixpath.join(folder, _NEW))
    text = f"launch: [{', '.join(entries)}]"
    return f"echo {shlex.quote(text)} > {file}", check_command(folder, posixpath.join(folder, _NEW))


def new_manifest(package: str, folder: str) -> str:
    """Return the command that makes a folder a package."""
    text = f"<package><name>{package}</name></package>"
    return f"echo {shlex.quote(text)} > {shlex.quote(posixpath.join(folder, MANIFEST))}"


def plain(name: str) -> str:
    """Return a name with only letters, digits and underscores."""
    return re.sub(r"\W+", "_", name).strip("_") or "nodes"


def check_command(folder: str, launch: str) -> str:
    """Return the command that checks what a launch file starts."""
    return shlex.join(["cqos", "check", folder, "--launch", launch])
