"""How what lies at a path is checked as a workspace: by its launch file, or by the commands that lead to one. Nothing is executed."""

from __future__ import annotations

import os
import posixpath
import re
import shlex
from typing import TYPE_CHECKING, Final

from cqos_core.files.opening import read_path
from cqos_core.model.entrance import Entrance
from cqos_core.model.problems import InputError
from cqos_core.model.remarks import plural

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cqos_ros2.launch.includes import Includes
    from cqos_ros2.launch.workspace import Workspace

_MANIFEST: Final = "package.xml"
_MARKS: Final = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")
_LAUNCH_NAME: Final = re.compile(r".*(?:\.launch|(?:\.launch|_launch)\.(?:py|xml|ya?ml))", re.IGNORECASE)
_LAUNCH_FOLDER: Final = re.compile(r"(?:.*/)?launch(?:es)?/(?:.*/)?[^/]+\.(?:py|xml|ya?ml)", re.IGNORECASE)
_PYTHON: Final = re.compile(rb"^(?:async[ \t]+)?def[ \t]+generate_launch_description\b", re.MULTILINE)
_XML: Final = re.compile(rb"<launch[\s>/]")
_ROS1: Final = re.compile(rb"<node\b[^>]*\stype[ \t]*=")
_ROS2: Final = re.compile(
    rb"<(?:node|composable_node|node_container)\b[^>]*\s(?:exec|plugin)[ \t]*=|find-pkg-share|<let\b|\$\(var "
)
_YAML: Final = re.compile(rb"^launch[ \t]*:", re.MULTILINE)
_NAME: Final = re.compile(r"[\w.:-]+")
_NODES: Final = re.compile(rb"^[\"']?cqos_nodes[\"']?[ \t]*:", re.MULTILINE)
_TEST: Final = re.compile(rb"^[ \t]*(?:import|from)[ \t]+launch_testing\b", re.MULTILINE)
_TESTS: Final = frozenset(("test", "tests", "testing"))
_SOURCES: Final = (".cpp", ".cc", ".cxx", ".hpp", ".hh", ".h", ".py")
_ROBOTS: Final = (".urdf", ".xacro", ".sdf")
_OF_PACKAGES: Final = (_MANIFEST, "CMakeLists.txt", "setup.py", "setup.cfg")
_PARAMETERS: Final = re.compile(rb"^[ \t]*[\"']?ros__parameters[\"']?[ \t]*:", re.MULTILINE)
_ENDINGS: Final = (*_SOURCES, *_ROBOTS, ".xml", ".yaml", ".yml", ".launch", ".txt", ".cfg")
_STORAGE: Final = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")
_ROS: Final = re.compile(rb"\b(?:rclcpp|rclpy|rclcpp_lifecycle|rclcpp_components)\b")
_MAIN_PYTHON: Final = re.compile(rb"^def[ \t]+main[ \t]*\(", re.MULTILINE)
_MAIN_CPP: Final = re.compile(rb"\bint[ \t]+main[ \t]*\(")
_CLIENTS: Final = re.compile(
    rb"\b(?:paho|aiomqtt|asyncio_mqtt|gmqtt|PubSubClient|AsyncMqttClient|esp_mqtt_client|mqtt_async|MQTTClient\w*|mosquittopp|mosquitto_\w+)\b"
)
_LARGEST: Final = 2 * 1024 * 1024
_MOST_SOURCES: Final = 200
_MOST_DESCRIBED: Final = 5
_MOST_SHOWN: Final = 8
_MOST_NODES: Final = 30
_MOST_LEARNED: Final = 10
_MOST_INCLUDES: Final = 4
_NEW: Final = "nodes.launch.yaml"


def find(path: str, files: Sequence[str] | None) -> list[Entrance]:
    """Return the entrances at a path; see `cqos_core.model.entrance.EntranceFinder`."""
    if files is None:
        return [each for each in (_of_file(path),) if each is not None]
    kept = _not_ignored(files)
    launches = [each for each in kept if _may_be_launch(each) and _is_launch(each, _content(each))]
    manifests = [each for each in kept if posixpath.basename(each) == _MANIFEST]
    if not launches and not manifests and (installed := _installed(path)):
        return _of_workspaces(installed, *_listing(installed))
    if launches or manifests:
        return _of_workspaces(path, launches, manifests)
    found = _without_package(path, kept)
    return [] if found is None else [found]


# Files


def _of_file(path: str) -> Entrance | None:
    lower = path.lower()
    if lower.endswith(_STORAGE):
        return _of_storage(posixpath.dirname(path) or ".", path)
    if not lower.endswith(_ENDINGS) or not os.path.isfile(path):  # noqa: PTH113
        return None
    data = _content(path)
    if _is_launch(path, data):
        return _of_launch_file(path)
    if _NODES.search(data) and lower.endswith((".yaml", ".yml")):
        return _of_node_file(path, "this")
    if lower.endswith(_SOURCES) and _ROS.search(data):
        return _of_sources(path, _package_around(path))
    if lower.endswith(_SOURCES) and _CLIENTS.search(data):
        return _of_clients(posixpath.dirname(path) or ".", "this is the source of a client of a broker")
    if posixpath.basename(path) in _OF_PACKAGES or lower.endswith(_ROBOTS) or _PARAMETERS.search(data):
        return _of_package_file(path)
    return None


def _of_launch_file(path: str) -> Entrance:
    folder = _workspace_around(path)
    if folder is None:
        folder = posixpath.dirname(path) or "."
        message = (
            "this is a launch file, and no workspace is around it: no folder above it has `src`, `install` or a package.xml, "
            "so packages that it names are not found"
        )
        return Entrance(folder, message, commands=(_check(folder, path),))
    return Entrance(folder, "", path, f"{path} is a launch file")


def _of_node_file(path: str, shown: str) -> Entrance:
    from cqos_core.model.source import Source
    from cqos_ros2.nodes.reading import read_node_file

    try:
        known = read_node_file(Source(path, _content(path)))
    except InputError as error:
        first = error.problems[0]
        line = "" if first.place is None or first.place.line is None else f", line {first.place.line}"
        message = f"{shown} is a node file that cannot be used{line}: {first.message}"
        return Entrance("", message, commands=(f"cqos learn {shlex.quote(_package_around(path) or '.')}",))
    message = (
        f"{shown} is a node file: it states the endpoints of nodes of the package `{known.package}`, and a check reads it where "
        "a launch file starts these nodes"
    )
    nodes = [(known.package, each) for each in known.nodes]
    folder = _workspace_around(path)
    if folder is not None and _package_around(path) is not None:
        ways = [each for each in find(folder, _all_below(folder)) if each.choices]
        if ways:
            likely = ways[0]
            return Entrance("", message, commands=(_check(likely.folder, likely.choices[0]),))
        return Entrance("", message, commands=_new_launch(folder, nodes))
    new = f"check_{_plain(known.package)}"
    commands = (
        f"mkdir -p {new} && cp {shlex.quote(path)} {new}",
        _new_manifest(known.package, new),
        *_new_launch(new, nodes),
    )
    return Entrance("", message, commands=commands)


def _of_package_file(path: str) -> Entrance | None:
    """Return the command that checks the workspace of a file that no importer reads alone."""
    folder = _workspace_around(path)
    if folder is None or _package_around(path) is None:
        return None
    ways = find(folder, _all_below(folder))
    if not ways:
        return None
    likely = ways[0]
    message = (
        "this file has no quality of service of its own, and a check reads it where a launch file starts its nodes"
    )
    commands = (_check(likely.folder, likely.choices[0]),) if likely.choices else likely.commands
    return Entrance("", message, commands=commands)


def _of_storage(folder: str, path: str = "") -> Entrance:
    what = f"{'this' if path else posixpath.basename(path) or 'this folder'} is the storage of a rosbag2 recording"
    shown = shlex.quote(folder)
    if os.path.isfile(posixpath.join(folder, "metadata.yaml")):  # noqa: PTH113
        message = f"{what}; its quality of service stands in `metadata.yaml` beside it"
        return Entrance("", message, commands=(f"cqos check {shown}",))
    message = f"{what} without `metadata.yaml`, in which its quality of service stands; `ros2 bag reindex` writes it"
    return Entrance("", message, commands=(f"ros2 bag reindex {shown}", f"cqos check {shown}"))


# Folders


def _of_workspaces(path: str, launches: Sequence[str], manifests: Sequence[str]) -> list[Entrance]:
    """Return an entrance for each workspace in a folder, or that the folder is in."""
    package = None if any(posixpath.dirname(each) == path.rstrip("/") for each in manifests) else _package_around(path)
    groups: dict[str, tuple[list[str], list[str]]] = {}
    if package is not None:
        groups[_as_written(_root(path), path)] = ([*launches], [*manifests])
    else:
        folders = _workspaces(path, [posixpath.dirname(each) for each in manifests], launches)
        for folder in folders:
            groups[folder] = ([], [])
        for number, each_kind in enumerate((launches, manifests)):
            for each in each_kind:
                groups[next(folder for folder in folders if _below(folder, each))][number].append(each)
    with_launch = [folder for folder, (own, _) in groups.items() if own]
    found: list[tuple[Entrance, int]] = []
    for folder, (own, packages) in groups.items():
        if own:
            inside = [posixpath.dirname(each) for each in packages]
            found.append(_of_launches(folder, own, inside, alone=len(with_launch) == 1))
        else:
            sources = _of_sources(folder, folder)
            found += [(sources, -1)] if sources is not None else []
    # What starts most is the most likely.
    return [entrance for entrance, _ in sorted(found, key=lambda each: -each[1])]


def _workspaces(path: str, packages: Iterable[str], launches: Iterable[str]) -> list[str]:
    """Return the folders of workspaces below a path, the deepest first: those with `src`, repositories, folders of packages."""
    with_src: set[str] = set()
    others: set[str] = set()
    for package in packages:
        inside = posixpath.relpath(package, path).split("/")
        if "src" in inside:
            with_src.add(posixpath.join(path, *inside[: inside.index("src")]).rstrip("/"))
        elif inside[-2:-1] == ["share"]:  # installed, each package in a folder of its own or all in one
            own = inside[-3:-2] == inside[-1:]
            others.add(posixpath.join(path, *inside[: -3 if own else -2]).rstrip("/"))
        else:
            repository = next(
                (each for each in _between(path, package) if os.path.exists(posixpath.join(each, ".git"))),  # noqa: PTH110
                None,
            )
            others.add(repository or (package if package == path else posixpath.dirname(package)))
    for launch in launches:
        if not any(_below(each, launch) for each in with_src | others):
            others.add(posixpath.dirname(launch))
    every = with_src | others
    kept = with_src | {each for each in others if not any(_below(other, each) for other in every if other != each)}
    return sorted(kept, key=lambda each: (-each.count("/"), each))


def _of_launches(folder: str, launches: Sequence[str], packages: Sequence[str], *, alone: bool) -> tuple[Entrance, int]:
    """Return the entrance to a workspace, and how much its first choice starts.

    The entrance is its launch file, or the choice among those that no other includes.
    """
    from cqos_ros2.launch.includes import includes_of, started_by
    from cqos_ros2.launch.workspace import find_packages

    real = {os.path.realpath(each): each for each in launches}
    workspace = find_packages(folder)
    tests = [each for each in real if _is_test(real[each], folder)]
    counted = [each for each in real if each not in tests] or [*real]
    includes = includes_of(counted, workspace)
    names = {each: _value(each, real[each], workspace) for each in real}
    roots = includes.roots()
    first = roots[0]
    others = len(counted) - 1
    reason = ""
    if alone and len(roots) == 1 and {first} | includes.reached(first) >= {*counted}:
        every = f"includes all {others} others" if others > 1 else "includes the other one"
        reason = f"of the launch files of {folder}, {names[first]} {every}"
        if not others:
            reason = f"{names[first]} is the only launch file of {folder}"
        if len(counted) < len(real):
            reason += f" (without {plural(len(real) - len(counted), 'launch file')} of tests)"
    weights = {each: (len(includes.reached(each)), started_by(each, workspace)) for each in roots}
    roots.sort(key=lambda each: (not _brings_up(names[each]), -sum(weights[each]), names[each]))
    details = [_described(names[each], includes, weights[each][1], names, each) for each in roots[:_MOST_DESCRIBED]]
    details += _others([names[each] for each in roots[_MOST_DESCRIBED:]], "further ones that no other includes")
    details += _others([names[each] for each in counted if each not in roots], "included by others")
    details += _others([names[each] for each in tests if each not in counted], "of tests")
    what = plural(len(counted), "launch file")
    value = names[first] if reason else ""
    choices = tuple(names[each] for each in roots)
    entrance = Entrance(folder, what, value, reason, choices, (*details,), inside=(*packages,))
    return entrance, sum(weights[roots[0]])


def _described(name: str, includes: Includes, nodes: int, names: dict[str, str], path: str) -> str:
    direct = [_last(names.get(each, each)) for each in includes.direct.get(path, {}) if each != path]
    what = f"starts {plural(nodes, 'node')}" if nodes else "starts no node that C-QoS follows"
    if direct:
        what += f", includes {_list(direct, _MOST_INCLUDES)}"
    return f"{name}: {what}"


def _others(names: Sequence[str], what: str) -> list[str]:
    return [f"{what}: {_list([_last(each) for each in names])}"] if names else []


def _list(names: Sequence[str], most: int = _MOST_SHOWN) -> str:
    known = [*dict.fromkeys(names)]
    more = len(known) - most
    return ", ".join(known[:most]) + (f" and {more} more" if more > 0 else "")


def _last(name: str) -> str:
    return posixpath.basename(name.rpartition(":")[2])


def _brings_up(name: str) -> bool:
    return "bringup" in name.lower()


def _value(real: str, written: str, workspace: Workspace) -> str:
    """Return how ``--launch`` names a file: by its package, if the name is the only one there."""
    packages = [name for name, folder in workspace.packages.items() if real.startswith(f"{folder}/")]
    if packages and workspace.launch_files(packages[0], posixpath.basename(real)) == [real]:
        return f"{packages[0]}:{posixpath.basename(real)}"
    return written


# Sources without a launch file


def _of_sources(path: str, folder: str | None) -> Entrance | None:
    """Return the commands that read sources and check what their programs do."""
    from cqos_ros2.launch.workspace import find_packages
    from cqos_ros2.learn.packages import executables_of

    if folder is None:
        single = os.path.isfile(path)  # noqa: PTH113
        return _loose(posixpath.dirname(path) or ".", [path]) if single else _loose(path, _all_below(path))
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
    inside = tuple(_as_written(workspace.packages[name], folder) for name in packages)
    return Entrance(folder, message, commands=(learn, *_new_launch(folder, nodes)), inside=inside)


def _learned(packages: Sequence[str], workspace: Workspace) -> list[tuple[str, str]]:
    """Return the nodes that sources define, where nothing says which programs they become."""
    from cqos_ros2.learn.learning import learn
    from cqos_ros2.learn.packages import NoParserError

    found = []
    for name in packages[:_MOST_LEARNED]:
        try:
            found += [(name, each) for each in learn(name, workspace).document.get("nodes", ())]
        except NoParserError:
            continue  # the command `cqos learn`, which comes first, says what to install
    return found


def _has_sources(workspace: Workspace, package: str) -> bool:
    paths = [each for every in workspace.files_of(package).values() for each in every if each.endswith(_SOURCES)]
    return any(_ROS.search(_content(each)) for each in paths[:_MOST_SOURCES])


def _new_launch(folder: str, nodes: Sequence[tuple[str, str]]) -> tuple[str, ...]:
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
    return f"echo {shlex.quote(text)} > {file}", _check(folder, posixpath.join(folder, _NEW))


def _without_package(path: str, files: Sequence[str]) -> Entrance | None:
    """Return what to do with sources or storages of recordings that lie in no package below the path."""
    storages = [each for each in files if each.lower().endswith(_STORAGE)]
    bare = [folder for each in storages if not os.path.isfile(f"{(folder := posixpath.dirname(each))}/metadata.yaml")]  # noqa: PTH113
    if bare:
        return _of_storage(bare[0])
    node_files = [each for each in files if each.endswith(".node.yaml") and _NODES.search(_content(each))]
    if node_files:
        return _of_node_file(node_files[0], node_files[0])
    sources = [each for each in files if each.lower().endswith(_SOURCES)][:_MOST_SOURCES]
    texts = [_content(each) for each in sources]
    if any(map(_ROS.search, texts)):
        return _of_sources(path, _package_around(path))
    if any(map(_CLIENTS.search, texts)):
        return _of_clients(path, "these are sources of clients of a broker")
    return None


def _loose(folder: str, sources: Sequence[str]) -> Entrance:
    """Return the commands that make a folder of sources a package, and check what its programs do."""
    package, shown = _plain(posixpath.basename(os.path.realpath(folder))).lower(), shlex.quote(folder)
    message = "sources of ROS 2 nodes outside of any package, and C-QoS reads the sources of packages"
    scripts, programs = {}, {}
    for path in [each for each in sources if each.endswith(_SOURCES)][:_MOST_SOURCES]:
        inner, data = posixpath.relpath(path, folder), _content(path)
        name, ending = posixpath.splitext(inner)
        if not _NAME.fullmatch(inner.replace("/", ".")) or not _ROS.search(data):
            continue
        if ending == ".py" and _MAIN_PYTHON.search(data):
            scripts[posixpath.basename(name)] = name.replace("/", ".")
        elif ending != ".py" and _MAIN_CPP.search(data):
            programs[posixpath.basename(name)] = inner
    commands = [_new_manifest(package, folder)]
    if scripts:
        entries = "".join(f"  {name} = {module}:main\\n" for name, module in scripts.items())
        target = shlex.quote(posixpath.join(folder, "setup.cfg"))
        commands.append(f"printf '[options.entry_points]\\nconsole_scripts =\\n{entries}' > {target}")
    if programs:
        added = " ".join(f"add_executable({name} {path})" for name, path in programs.items())
        commands.append(f"echo '{added}' > {shlex.quote(posixpath.join(folder, 'CMakeLists.txt'))}")
    nodes = [(package, name) for name in (*scripts, *programs)]
    return Entrance(folder, message, commands=(*commands, f"cqos learn {shown}", *_new_launch(folder, nodes)))


def _plain(name: str) -> str:
    """Return a name with only letters, digits and underscores."""
    return re.sub(r"\W+", "_", name).strip("_") or "nodes"


def _new_manifest(package: str, folder: str) -> str:
    text = f"<package><name>{package}</name></package>"
    return f"echo {shlex.quote(text)} > {shlex.quote(posixpath.join(folder, _MANIFEST))}"


def _of_clients(folder: str, what: str) -> Entrance:
    output = shlex.quote(posixpath.join(folder, "systems"))
    message = f"{what}; `cqos learn` writes a system file from them"
    return Entrance(
        folder, message, commands=(f"cqos learn {shlex.quote(folder)} --output {output}", f"cqos check {output}")
    )


# Paths


def _check(folder: str, launch: str) -> str:
    return shlex.join(["cqos", "check", folder, "--launch", launch])


def _package_around(path: str) -> str | None:
    """Return the package that a path is in, as the path is written."""
    real = os.path.realpath(path)
    for each in (real, *_parents(real)):
        if os.path.isfile(posixpath.join(each, _MANIFEST)):  # noqa: PTH113
            return _as_written(each, path)
    return None


def _root(path: str) -> str:
    from cqos_ros2.launch.workspace import root_of

    return root_of(posixpath.join(path, _MANIFEST) if os.path.isdir(path) else path)  # noqa: PTH112


def _workspace_around(path: str) -> str | None:
    """Return the folder of the workspace that a file is in: around its package, else one above that has packages in `src` or `install`."""
    from cqos_ros2.launch.workspace import find_packages

    if _package_around(path) is not None:
        return _as_written(_root(path), path)
    for each in _parents(os.path.realpath(path)):
        for name in ("src", "install"):
            inner = posixpath.join(each, name)
            if len(each) > 1 and os.path.isdir(inner) and find_packages(inner).packages:  # noqa: PTH112
                return _as_written(each if name == "src" else inner, path)
    return None


def _as_written(folder: str, path: str) -> str:
    """Return an absolute folder as a person writes it who wrote the path."""
    return folder if os.path.isabs(path) else os.path.relpath(folder, os.path.realpath("."))  # noqa: PTH117


def _parents(path: str) -> list[str]:
    parents = []
    while path not in {"", "/"} and posixpath.dirname(path) != path:
        path = posixpath.dirname(path)
        parents.append(path)
    return parents


def _between(top: str, path: str) -> list[str]:
    """Return the folders from a path up to the folder ``top`` that it is in."""
    return [path, *(each for each in _parents(path) if _below(top, each))]


def _below(folder: str, path: str) -> bool:
    return folder in {path, "."} or path.startswith(f"{folder.rstrip('/')}/")


def _not_ignored(files: Sequence[str]) -> list[str]:
    """Return files outside of folders that colcon passes over."""
    marked = tuple(f"{posixpath.dirname(each)}/" for each in files if posixpath.basename(each) in _MARKS)
    return [each for each in files if not each.startswith(marked)] if marked else [*files]


def _installed(path: str) -> str:
    """Return the folder `install` of a built workspace whose sources are not there; empty if there is none."""
    from cqos_ros2.launch.workspace import find_packages

    inner = posixpath.join(path, "install")
    return inner if os.path.isdir(inner) and find_packages(inner).packages else ""  # noqa: PTH112


def _listing(folder: str) -> tuple[list[str], list[str]]:
    every = _all_below(folder)
    launches = [each for each in every if _may_be_launch(each) and _is_launch(each, _content(each))]
    return launches, [each for each in every if posixpath.basename(each) == _MANIFEST]


def _all_below(folder: str) -> list[str]:
    """Return the files of the packages of a folder, and of the folder itself."""
    from cqos_core.files.ignoring import GENERATED
    from cqos_core.files.walking import Skipped, walk

    skipped: list[Skipped] = []
    found = []
    for inner, folders, names in walk(folder, skipped):
        folders[:] = sorted(each for each in folders if not each.startswith(".") and each not in GENERATED)
        found += [posixpath.join(inner, each) for each in sorted(names)]
    return _not_ignored(found)


def _may_be_launch(path: str) -> bool:
    return bool(_LAUNCH_NAME.fullmatch(path) or _LAUNCH_FOLDER.fullmatch(path))


def _is_launch(path: str, data: bytes) -> bool:
    """Whether a file is a launch file of ROS 2, by what stands in it."""
    lower = path.lower()
    if lower.endswith(".py"):
        return _PYTHON.search(data) is not None
    if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return _XML.search(data) is not None and (_ROS1.search(data) is None or _ROS2.search(data) is not None)
    return lower.endswith((".yaml", ".yml", ".launch")) and _YAML.search(data) is not None


def _is_test(path: str, folder: str) -> bool:
    inside = posixpath.relpath(path, folder).split("/")
    named = bool(_TESTS & {*inside[:-1]}) or inside[-1].startswith("test_")
    return named or _TEST.search(_content(path)) is not None


def _content(path: str) -> bytes:
    """Return what a file begins with; nothing where it cannot be read."""
    try:
        return read_path(path, _LARGEST).data if os.path.isfile(path) else b""  # noqa: PTH113
    except InputError:
        return b""
