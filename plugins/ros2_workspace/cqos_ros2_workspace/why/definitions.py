"""Hashes of message types from message files, as rosidl_generator_type_description of ROS 2 computes them (RIHS01, REP 2016)."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from cqos_core.model.encoding import decode
from cqos_ros2_workspace.launch.values import Unknown

if TYPE_CHECKING:
    from cqos_ros2_workspace.launch.workspace import Workspace

_NUMBERS: Final = {
    "int8": 2,
    "uint8": 3,
    "char": 3,
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
    "wstring": 18,
}
"""Numbers of type_description_interfaces/msg/FieldType."""
_NESTED: Final = 1
_BOUNDED_TEXT: Final = 4
"""What a bound adds to the number of a text; the next three are what arrays add."""
_ARRAY, _BOUNDED, _UNBOUNDED = 48, 96, 144
_FIELD: Final = re.compile(
    r"(?P<base>[A-Za-z][A-Za-z0-9_/]*)(?:<=(?P<most>\d{1,9}))?(?:\[(?P<bounded><=)?(?P<size>\d{0,9})(?P<array>\]))?"
    r"\s+(?P<name>[A-Za-z][A-Za-z0-9_]*)\s*(?P<constant>=)?"
)
_EMPTY: Final = "uint8 structure_needs_at_least_one_member"
_DEEPEST: Final = 50
_XYZ: Final = "float64 x\nfloat64 y\nfloat64 z"
_WELL_KNOWN: Final = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/msg/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/msg/Point": _XYZ,
    "geometry_msgs/msg/Vector3": _XYZ,
    "geometry_msgs/msg/Quaternion": f"{_XYZ}\nfloat64 w",
    "geometry_msgs/msg/Pose": "Point position\nQuaternion orientation",
    "geometry_msgs/msg/Transform": "Vector3 translation\nQuaternion rotation",
    "geometry_msgs/msg/Twist": "Vector3 linear\nVector3 angular",
}
"""Types of ROS 2 itself that messages of workspaces are made of, the same from Iron to Rolling."""


class Defined(NamedTuple):
    """The hash of a type, and the message file that it follows from."""

    digest: str
    path: str


@dataclass(slots=True)
class Definitions:
    """Computes hashes from the message files of a workspace."""

    workspace: Workspace
    _known: dict[str, dict[str, Any] | Unknown] = field(default_factory=dict)

    def find(self, name: str) -> Defined | Unknown:
        """Return the hash of a type such as ``bot_msgs/msg/Battery``; unknown where a message file is missing or not understood."""
        path = self._path(name)
        if path is None:
            return Unknown(f"the workspace has no message file of `{name[:80]}`")
        parts: dict[str, dict[str, Any]] = {}
        missing = self._collect(name, parts, 0)
        if missing is not None:
            return missing
        own = parts.pop(name)
        whole = {"type_description": own, "referenced_type_descriptions": [parts[each] for each in sorted(parts)]}
        return Defined(sha256(json.dumps(whole).encode()).hexdigest(), self.workspace.short(path))

    def _path(self, name: str) -> str | None:
        package, _, last = name.partition("/msg/")
        if package not in self.workspace.packages or not last:
            return None
        found = self.workspace.files_of(package).get(f"{last}.msg", [])
        return min(found, default=None)

    def _collect(self, name: str, parts: dict[str, dict[str, Any]], depth: int) -> Unknown | None:
        """Add the description of a type, and of those that it is made of; return what is not known."""
        if name in parts:
            return None
        found = self._described(name) if depth < _DEEPEST else Unknown("messages are nested too deep")
        if isinstance(found, Unknown):
            return found
        parts[name] = found
        inner = (each["type"]["nested_type_name"] for each in found["fields"])
        missing = (self._collect(each, parts, depth + 1) for each in inner if each)
        return next((each for each in missing if each is not None), None)

    def _described(self, name: str) -> dict[str, Any] | Unknown:
        if name not in self._known:
            path = self._path(name)
            data = _WELL_KNOWN.get(name, "").encode() if path is None else self.workspace.read(path, None)
            if path is None and not data:
                data = Unknown(f"the workspace has no message file of `{name[:80]}`")
            self._known[name] = data if isinstance(data, Unknown) else described(name, decode(data))
        return self._known[name]


def described(name: str, text: str) -> dict[str, Any] | Unknown:
    """Return the description of a type, as type_description_interfaces has it, from the text of its message file."""
    lines = [line for each in text.splitlines() if (line := each.partition("#")[0].strip())]
    fields = []
    for line in lines:
        found = _FIELD.match(line)
        if found is None:
            return Unknown(f"the message file of `{name[:80]}` has a line that is not understood: `{line[:60]}`")
        if not found["constant"]:
            fields.append(_field(found, name.partition("/")[0]))
    if not fields and (only := _FIELD.match(_EMPTY)):
        fields.append(_field(only, ""))
    return {"type_name": name, "fields": fields}


def _field(found: re.Match[str], package: str) -> dict[str, Any]:
    base, number = found["base"], _NUMBERS.get(found["base"], _NESTED)
    number += _BOUNDED_TEXT if found["most"] else 0
    if found["array"]:
        number += _BOUNDED if found["bounded"] else _ARRAY if found["size"] else _UNBOUNDED
    nested = "" if base in _NUMBERS else "/msg/".join(base.split("/", 1) if "/" in base else (package, base))
    kind = {
        "type_id": number,
        "capacity": int(found["size"] or 0),
        "string_capacity": int(found["most"] or 0),
        "nested_type_name": nested,
    }
    return {"name": found["name"], "type": kind}
