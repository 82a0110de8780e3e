"""Reads component models of RosTooling (``.ros2``): packages with their nodes, what these publish, subscribe and serve.

The language looks like YAML and is structured by indentation, but it is its own: ``type:"pkg/msg/Type"`` needs no blank
after the colon, parameters have types that are no YAML, and policies may follow ``qos:`` on one line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from cqos_core.importers.source_reading import SourceReading, did_you_mean, shown
from cqos_core.model.encoding import decode
from cqos_core.model.regular_expressions import re
from cqos_core.model.settings import Place, Setting, Settings
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, ProfileRef, Role
from cqos_ros2.importers.configuration import RosFile

_GROUPS: Final[dict[str, tuple[Role, str]]] = {
    "publishers": (PUBLISHER, "message"),
    "subscribers": (SUBSCRIBER, "message"),
    "serviceservers": (SUBSCRIBER, "service_server"),
    "serviceclients": (PUBLISHER, "service_client"),
    "actionservers": (SUBSCRIBER, "action_server"),
    "actionclients": (PUBLISHER, "action_client"),
}
_PARAMETERS: Final = "parameters"
_OF_PACKAGE: Final = ("artifacts", "fromgitrepo", "dependencies")
_OF_NODE: Final = ("node", *_GROUPS, _PARAMETERS, "lifecycle")
_OF_INTERFACE: Final = ("type", "ns", "qos", "active_in")
_PROFILE: Final = "profile"
_POLICIES: Final = (
    "history",
    "depth",
    "reliability",
    "durability",
    "deadline",
    "lifespan",
    "liveliness",
    "lease_duration",
)
_OF_QOS: Final = (_PROFILE, *_POLICIES)
_DEEPEST: Final = 32
_OLD_FORM: Final = re.compile(r"\s*(?:PackageSet|(?:Catkin|Ament)?Package|Artifact)\b[^:\n]*\{")
_KEY: Final = re.compile(r"""[ \t]*+(?P<key>"[^"]*+"|'[^']*+'|[^\s"'#:\[\]{}][^"'#:\[\]{}]*+)[ \t]*+:""")
_QUOTED: Final = re.compile(r"""("[^"]*+"|'[^']*+')[ \t]*+(?:\#.*+)?+""")
_INLINE: Final = re.compile(
    r"""[\s,{]*+(?P<key>\w++)[ \t]*+:[ \t]*+(?P<value>"[^"]*+"|'[^']*+'|[^\s,{}"']++)[\s,}]*+"""
)
_NAMESPACE: Final = re.compile(r"(Global|Relative|Private)Namespace[ \t]*(?:\[([^\]]*)\])?")
_ABOVE: Final = {"Global": "/", "Relative": "", "Private": "~/"}
_LIVELINESS: Final = {"manual": "manual_by_topic"}


@dataclass(slots=True, eq=False)
class _Part:
    """A key with its value and what stands below it."""

    key: str
    value: str
    place: Place
    value_place: Place
    parts: list[_Part] = field(default_factory=list)


# From lines to parts ---------------------------------------------------------------------------------------


def _parts(reading: SourceReading) -> list[_Part]:
    """Return the packages: what stands at the left margin, with all that is indented below."""
    text = decode(reading.source.data)
    if _OLD_FORM.match(text):
        message = "this is a model in the older form of RosTooling, with braces"
        place = Place(reading.source.name, 1, 1)
        reading.problem("CQ001", message, place, "save it with RosTooling 2 or newer, which writes it with indentation")
        return []
    top: list[_Part] = []
    open_parts: list[tuple[int, list[_Part]]] = [(-1, top)]
    for number, line in _lines(text):
        indent, part = _part(number, line, reading)
        if part is None:
            continue
        while open_parts[-1][0] >= indent:
            open_parts.pop()
        if len(open_parts) > _DEEPEST:
            reading.problem("CQ002", "this is nested deeper than any model needs", part.place)
            break
        open_parts[-1][1].append(part)
        open_parts.append((indent, part.parts))
    return top


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines that state something, without parameters, whose values are no concern of ours."""
    skipped_below: int | None = None
    brackets = 0
    comment = False
    for number, line in enumerate(text.split("\n"), 1):
        stripped = line.strip()
        comment = comment or stripped.startswith("/*")
        if comment or not stripped or stripped.startswith("#") or stripped in {"---", "..."}:
            comment = comment and "*/" not in stripped
            continue
        indent = _indent(line)
        if skipped_below is not None and (indent > skipped_below or brackets > 0):
            brackets += line.count("[") - line.count("]")
            continue
        skipped_below, brackets = None, 0
        if stripped.partition(":")[0].lower() == _PARAMETERS:
            skipped_below = indent
        yield number, line.rstrip("\r")


def _indent(line: str) -> int:
    return len(line.expandtabs()) - len(line.expandtabs().lstrip())


def _part(number: int, line: str, reading: SourceReading) -> tuple[int, _Part | None]:
    """Read one line; report one that is no key."""
    name = reading.source.name
    place = Place(name, number, len(line) - len(line.lstrip()) + 1)
    found = _KEY.match(line)
    value = _value(line[found.end() :].lstrip()) if found is not None else None
    if found is None or value is None:
        quotes = any(line.count(quote) % 2 for quote in "\"'")
        fault = "the quotes are never closed" if quotes else "this is neither `key:` nor `key: value`"
        reading.problem("CQ001", f"{fault}: {shown(line.strip())}", place, "the file may be cut off here")
        return _indent(line), None
    column = len(line) - len(line[found.end() :].lstrip()) + 1
    value_place = Place(name, number, column) if value else place
    return _indent(line), _Part(_bare(found["key"].strip()), value, place, value_place)


def _value(text: str) -> str | None:
    """Return what stands after a colon, without a comment; None where quotes are not closed at its end."""
    if text[:1] not in {'"', "'"}:
        return text.partition("#")[0].rstrip()
    quoted = _QUOTED.fullmatch(text)
    return quoted[1] if quoted is not None else None


def _bare(text: str) -> str:
    return text[1:-1] if text[:1] in {'"', "'"} else text


# From parts to endpoints -----------------------------------------------------------------------------------


class _Model(RosFile):
    """Reads a component model, unless it is one of the older form with braces."""

    def run(self) -> None:
        """Read every package."""
        packages = _parts(self)
        for package in packages:
            self.package(package)
        if not packages and not self.problems:
            self.problem("CQ001", "there is no package in this model", Place(self.source.name, 1, 1))

    def unknown(self, part: _Part, known: tuple[str, ...], what: str) -> None:
        """Report a part that is not known."""
        self.note("ROS955", f"{what} has no {shown(part.key)}{did_you_mean(part.key, known)}", part.place)

    def package(self, package: _Part) -> None:
        """Read the artifacts of a package."""
        for part in package.parts:
            if part.key.lower() == "artifacts":
                for artifact in part.parts:
                    self.artifact(artifact)
            elif part.key.lower() not in _OF_PACKAGE:
                self.unknown(part, _OF_PACKAGE, "a package")

    def artifact(self, artifact: _Part) -> None:
        """Read the node of an artifact."""
        node = next((part for part in artifact.parts if part.key == "node"), None)
        name = _bare(node.value) if node is not None else ""
        if node is None or not name:
            if artifact.parts:
                message = f"artifact {shown(artifact.key)} names no node"
                self.problem("CQ010", message, artifact.place, "state `node: NAME`")
            return
        self.participant(name, node.place)
        for part in artifact.parts:
            group = part.key.lower()
            if group in _GROUPS:
                for interface in part.parts:
                    self.interface(name, interface, *_GROUPS[group])
            elif group not in _OF_NODE:
                self.unknown(part, _OF_NODE, "a node")

    def interface(self, node: str, interface: _Part, role: Role, kind: str) -> None:
        """Add the endpoint of one interface."""
        by_key = {part.key.lower(): part for part in interface.parts}
        for part in interface.parts:
            if part.key.lower() not in _OF_INTERFACE:
                self.unknown(part, _OF_INTERFACE, "an interface")
        type_part, namespace, qos = (by_key.get(key) for key in ("type", "ns", "qos"))
        settings, profiles = self.qos(qos) if qos is not None else ({}, ())
        topic = _topic(interface.key, namespace.value if namespace is not None else "")
        type_name = _bare(type_part.value) if type_part is not None else ""
        self.system.endpoints.append(
            self.endpoint(
                node, role, topic, interface.place, settings, type_name=type_name, kind=kind, profiles=profiles
            )
        )

    def qos(self, qos: _Part) -> tuple[Settings, tuple[ProfileRef, ...]]:
        """Read the policies below ``qos:``, or beside it; some tools write ``qos_`` before their names."""
        settings: Settings = {}
        profiles: tuple[ProfileRef, ...] = ()
        for part in (*self.beside(qos), *qos.parts):
            word = part.key.lower().removeprefix("qos_").removeprefix("history_")
            text = _bare(part.value)
            if word == _PROFILE:
                profiles = (ProfileRef(text, part.value_place),) if text else ()
            elif word not in _POLICIES:
                self.unknown(part, _OF_QOS, "`qos`")
            elif text:
                text = _LIVELINESS.get(text, text) if word == "liveliness" else text
                settings[word] = Setting(text, part.value_place)
        return settings, profiles

    def beside(self, qos: _Part) -> Iterator[_Part]:
        """Yield the policies that stand on the line of ``qos:``."""
        at = 0
        while at < len(qos.value):
            found = _INLINE.match(qos.value, at)
            if found is None:
                message = f"{shown(qos.value[at:])} is no policy with a value"
                self.problem("CQ001", message, qos.value_place, "write each policy on a line of its own below")
                return
            at = found.end()
            place = qos.value_place
            column = (place.column or 1) + found.start("value")
            yield _Part(found["key"], found["value"], place, Place(place.source, place.line, column))


def _topic(name: str, namespace: str) -> str:
    """Put a name where its namespace says: relative to the node's, global, or below the node."""
    found = _NAMESPACE.match(namespace)
    if found is None or name.startswith(("/", "~")):
        return name
    parts = [_bare(part.strip()).strip("/") for part in (found[2] or "").split(",")]
    return _ABOVE[found[1]] + "/".join(part for part in (*parts, name) if part)


read = _Model.load
