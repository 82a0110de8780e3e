"""``cqos learn FILE``: node files from those of other tools, and drafts from recorded systems."""

from __future__ import annotations

import os
import posixpath
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cqos_core as cqos
from cqos_core.cli.console import emit
from cqos_core.cli.file_output import write_new_file
from cqos_core.files.source_files import read_path
from cqos_core.importers.source_reading import did_you_mean, listed
from cqos_core.model.finding import plural
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.system import MESSAGE, PUBLISHER, SUBSCRIBER
from cqos_ros2.conventions import LIFECYCLE, PARAMETERS
from cqos_ros2_sources.node_files.node_file_maker import counts, written
from cqos_ros2_workspace.launch.workspace import find_packages, root_of
from cqos_ros2_workspace.nodes.foreign import DESIGN, design_document, nodl_document
from cqos_ros2_workspace.nodes.reading import ENDING, POLICIES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.model.system import Endpoint, Participant, System

_NODL: Final = re.compile(rb"^nodl_version\s*:", re.MULTILINE)
_CONVERTED: Final = "# `cqos learn` wrote this file once, from a file of another form; from now on it is yours.\n"
_DRAFT: Final = (
    "# `cqos learn` wrote this draft from one run; from now on it is yours.\n"
    "# Names, types and values are those of that run: a launch may remap names, and parameters may set values.\n"
    "# So no entry counts while it has `perhaps`. Compare each with the source of the node, and remove `perhaps`.\n"
)
_PERHAPS: Final = "seen in one run; another launch may give it another name or other values"
_FURTHER: Final = {"what": "further endpoints", "cause": "one run does not show all that a node may create"}
_DIRECTIONS: Final = {
    (MESSAGE, PUBLISHER): "publishes",
    (MESSAGE, SUBSCRIBER): "subscribes",
    "service_server": "serves",
    "service_client": "calls",
    "action_server": "action_servers",
    "action_client": "action_clients",
}
_OF_EVERY_NODE: Final = frozenset((*PARAMETERS, *LIFECYCLE, "rosout", "parameter_events", "transition_event"))
_UNREPORTED: Final = "unknown"
_NO_LETTER: Final = re.compile(r"[^A-Za-z0-9_.-]+")
"""What a class or executable may have in its name, and a file shall not."""


def convert(path: str, package: str | None, nodes: Sequence[str], output: str | None) -> None:
    """Write the node files that a file of another form gives, one for each node; none that is there is replaced.

    Args:
        path: the file: NoDL, a node design of Autoware, or any recording of what ran.
        package: the ROS 2 package of the nodes; without it, that of the file.
        nodes: the nodes to write of a recording, as ``NAME`` or ``NAME=EXECUTABLE``.
        output: the folder to write to; without it, the current one.

    Raises:
        InputError: the file is not of this form, something that is needed is not stated, or a file is there already.
    """
    data = read_path(path).data
    stated = DESIGN in data or _NODL.search(data) is not None
    if stated and nodes:
        message = f"`{path[:120]}` states its nodes itself"
        raise InputError([Problem("CQ001", message, None, "leave --node out; it is for what ran")])
    if stated:
        head, documents = _CONVERTED, [_of_nodl(path, data, package)]
    else:
        head, documents = _DRAFT, [*_of_snapshot(path, package, nodes)]
    folder = Path("." if output is None else output)
    texts: dict[Path, tuple[str, dict[str, Any]]] = {}
    for each in documents:
        target = folder / (_NO_LETTER.sub("_", next(iter(each["nodes"]))) + ENDING)
        if target in texts:
            advice = "write them one at a time, each with another --output"
            raise InputError([Problem("CQ001", f"two nodes would be written to `{target}`", None, advice)])
        texts[target] = written(each, head), each
    there = [target for target in texts if target.exists()]
    if there:
        advice = "remove it, or name another folder with --output"
        raise InputError([Problem("CQ001", f"`{each}` is there already", None, advice) for each in there])
    folder.mkdir(parents=True, exist_ok=True)
    for target, (text, document) in texts.items():
        write_new_file(str(target), text)
        endpoints = plural(counts(document).endpoints, "endpoint")
        emit(f"{target}: {endpoints}{'' if stated else ', to be confirmed'}\n")


def _of_nodl(path: str, data: bytes, package: str | None) -> dict[str, Any]:
    """Return the node file of a NoDL document or of a node design of Autoware."""
    if DESIGN in data:
        document = design_document(path, data)
    else:
        document = nodl_document(path, data, package or _package_around(path))
    if document is None:
        message = f"`{path[:120]}` is neither NoDL of version 2 nor a node design of Autoware that states a node"
        raise InputError(
            [Problem("CQ001", message, None, "write `nodl_version: 2`, or the package and the program of the node")]
        )
    document["package"] = package or document["package"]
    return {"cqos_nodes": document["cqos_nodes"], "from": {"by": "hand"}, **document}


def _package_around(path: str) -> str:
    """Return the name of the package that a file is in."""
    inside = os.path.realpath(path)
    for name, folder in find_packages(root_of(inside)).packages.items():
        if inside.startswith(folder + os.sep):
            return name
    raise InputError([Problem("CQ001", f"`{path[:120]}` is in no package", None, "name one with --package")])


def _of_learn(problem: Problem) -> Problem:
    """Return what is wrong with a file, with what `cqos learn` takes instead where nothing reads it."""
    advice = "for sources, name the folder of their package; a file is NoDL, a node design of Autoware, or a recording of what ran"
    return Problem(problem.code, problem.message, problem.place, advice) if problem.code == "CQ003" else problem


def _of_snapshot(path: str, package: str | None, nodes: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield the draft of a node file for each node of a recording that is asked for."""
    try:
        system = cqos.read(path)
    except InputError as error:
        raise InputError([_of_learn(each) for each in error.problems]) from None
    there = {
        name: participant
        for name, participant in system.participants.items()
        if any(each.participant == name for each in _observed(system))
    }
    if not there:
        message = f"`{path[:120]}` has no node of ROS 2 that was observed"
        advice = "write one with `cqos snapshot`, or `ros2 topic info --verbose`"
        raise InputError([Problem("CQ001", message, None, advice)])
    if not nodes or package is None:
        message = "it does not say to which package and executable a node belongs"
        advice = f"state --package NAME and --node NODE=EXECUTABLE; its nodes: {listed(sorted(there), 'and')}"
        raise InputError([Problem("CQ001", f"`{path[:120]}`: {message}", None, advice)])
    for stated in nodes:
        name, _, executable = stated.partition("=")
        found = _found(name, there, path)
        space, last = _names(there[found])
        node: dict[str, Any] = {"name": last, "unread": [_FURTHER]}
        for each in _observed(system):
            if each.participant == found and each.topic is not None:
                key = _DIRECTIONS.get((each.kind, each.role)) or _DIRECTIONS.get(each.kind)
                if key is not None and posixpath.basename(each.topic) not in _OF_EVERY_NODE:
                    entries = node.setdefault(key, {}).setdefault(_in_code(each.topic, space, last), [])
                    entries += [] if (entry := _entry(each)) in entries else [entry]
        yield {
            "cqos_nodes": 1,
            "package": package,
            "from": {"by": "observed"},
            "nodes": {executable or last: node},
        }


def _found(name: str, there: Mapping[str, Participant], path: str) -> str:
    """Return the one node that a full name, or its last part, stands for."""
    found = [each for each in there if each.strip("/") == name.strip("/")]
    found = found or [each for each in there if _names(there[each])[1] == name]
    if len(found) == 1:
        return found[0]
    what = "several nodes" if found else "no node"
    message = f"`{path[:120]}` has {what} `{name[:80]}`{'' if found else did_you_mean(name, there)}"
    raise InputError([Problem("CQ001", message, None, f"its nodes: {listed(sorted(there), 'and')}")])


def _observed(system: System) -> list[Endpoint]:
    """Return the endpoints of nodes of ROS 2 that were observed and whose topics are known."""
    return [
        each
        for each in system.endpoints
        if each.observed
        and not each.topic_is_guess
        and (each.protocol or system.participants[each.participant].protocol or system.protocol or "ros2") == "ros2"
    ]


def _names(node: Participant) -> tuple[str, str]:
    """Return the namespace and the name of a node."""
    space, _, last = node.id.rpartition("/")
    stated = node.settings.get("namespace")
    return (stated.text if stated is not None else space).rstrip("/"), last


def _in_code(topic: str, space: str, node: str) -> str:
    """Return the name that the code would have without remaps: private, relative, or as it was seen."""
    for prefix, short in ((f"{space}/{node}/", "~/"), (f"{space}/", "")):
        if topic.startswith(prefix):
            return short + topic.removeprefix(prefix)
    return topic


def _entry(endpoint: Endpoint) -> dict[str, Any]:
    """Return what was seen of an endpoint."""
    stated = {name: setting.text.lower() for name, setting in endpoint.settings.items() if name in POLICIES}
    qos: dict[str, Any] = {name: text for name, text in stated.items() if text != _UNREPORTED}
    unread = [name for name in POLICIES if name not in qos]
    if unread:
        qos["unread"] = dict.fromkeys(unread, "discovery does not report it")
    place = endpoint.place
    return {
        **({} if endpoint.type is None else {"type": endpoint.type}),
        "qos": qos,
        "perhaps": _PERHAPS,
        **({} if place is None else {"at": f"{posixpath.basename(place.source)}:{place.line or 1}"}),
    }
