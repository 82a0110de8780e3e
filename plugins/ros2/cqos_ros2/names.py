"""From a written name to the full name on which endpoints match, as in rcl.

A relative name stands in the node's namespace, ``~`` is the node itself, and ``{node}`` and ``{ns}`` are replaced. The
first remapping with the same full name replaces it. Designs that name their signals in free text
("Req weather data") get the nearest legal name, and keep their own for messages.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from functools import lru_cache
from typing import Final

from cqos_core.model.regular_expressions import re, regular_expression
from cqos_core.model.wildcards import fits
from cqos_core.packs import NameContext, NameProblem, Naming, normalise
from cqos_ros2.interfaces import WIRE

ILLEGAL: Final[Mapping[str, str]] = {
    "*[!A-Za-z0-9_/]*": "it has other characters than letters, digits, `_` and `/`",
    "*//*": "two slashes follow each other in it",
    "*/": "it ends with a slash",
    "*/[0-9]*": "a part of it starts with a digit",
}
"""What makes a full name illegal, as shell patterns (rmw_validate_full_topic_name)."""

_LEGAL: Final = regular_expression("[A-Za-z0-9_]*+(?:/[A-Za-z_][A-Za-z0-9_]*+)*+")
"""A name that none of these patterns matches."""

LONGEST: Final = 247
HIDDEN: Final = "*/_*"
REPEATED_UNDERSCORE: Final = "*__*"

KEY: Final = "zenoh:"
"""What the key expressions begin with on which bridges of Zenoh meet, so that no topic is taken for one."""

FREE_TEXT: Final = frozenset({"bpmn"})
"""Dialects whose names are written for people."""


def resolve(written: str, context: NameContext) -> Naming:
    """Put a topic, service or action name into the form endpoints meet on."""
    text = written.strip()
    if not text:
        return Naming(None, written)
    wire = WIRE.get(context.kind)
    if "rmw" in context.settings and _is_bridge(context.settings["rmw"]):
        key, shown = text, text.removeprefix(f"{KEY}/")
        return Naming(key, shown) if wire is None else Naming(wire.key.format(key), wire.shown.format(shown))
    node = _node(context.participant, context.settings.get("namespace"), context.dialect in FREE_TEXT)
    expanded = expand(text, node.namespace, node.name)
    legal = is_legal(expanded)
    if legal and wire is None and not context.remap:
        return Naming(expanded, expanded, node.problems or (_remarks(expanded) if "_" in expanded else ()))
    rewritten = node.free_text and not legal
    if rewritten:
        expanded = expand(legal_name(text), node.namespace, node.name)
    full = expanded
    if context.remap:
        full = next((node.full_name(to) for it, to in context.remap.items() if node.full_name(it) == expanded), full)
    own_words = text if rewritten and full == expanded else None
    if wire is None:
        return Naming(full, own_words or full, node.problems or _problems(full, own_words))
    return Naming(
        wire.key.format(full),
        wire.shown.format(own_words or full),
        (node.problems or _problems(full, own_words)) if wire.speaks else (),
    )


def before(context: NameContext) -> str | None:
    """Return the namespace, which `resolve` puts before a name; None where it may do more to one that is legal then."""
    if context.kind in WIRE or context.remap or _is_bridge(context.settings.get("rmw", "")):
        return None
    node = _node(context.participant, context.settings.get("namespace"), context.dialect in FREE_TEXT)
    return None if node.problems else expand("", node.namespace, node.name)


@lru_cache(maxsize=64)
def _is_bridge(rmw: str) -> bool:
    return normalise(rmw) == "zenoh_bridge"


class _Node:
    """What the names of one node are resolved with; `problems` says why ROS 2 starts no node with this namespace."""

    def __init__(self, namespace: str, name: str, stated: str | None, *, free_text: bool) -> None:
        self.free_text = free_text
        self.problems = _of_namespace(stated)
        self.name = legal_name(name)
        self.namespace = "/" + (legal_name(namespace) if namespace and self.free_text else namespace)

    def rewrites(self, text: str) -> bool:
        """Whether ``text`` is free text that ROS 2 would not take as a name."""
        return self.free_text and not is_legal(expand(text, self.namespace, self.name))

    def full_name(self, text: str) -> str:
        """Return the full name of ``text``."""
        return expand(legal_name(text) if self.rewrites(text) else text, self.namespace, self.name)


@lru_cache(maxsize=4096)
def _remembered(participant: str, namespace: str | None, free_text: bool) -> _Node:  # noqa: FBT001 - a cache key
    settings = {} if namespace is None else {"namespace": namespace}
    return _Node(*_placed(participant, settings), namespace, free_text=free_text)


def _node(participant: str, namespace: str | None, free_text: bool) -> _Node:  # noqa: FBT001 - as the above
    of = _remembered if len(participant) + len(namespace or "") <= LONGEST else _remembered.__wrapped__
    return of(participant, namespace, free_text)


def _placed(participant: str, settings: Mapping[str, str]) -> tuple[str, str]:
    """Return a node's namespace, without slashes around it, and its name; it may be named in full (`/robot/driver`)."""
    above, _, name = participant.rstrip("/").rpartition("/")
    return settings.get("namespace", above).strip().strip("/"), name


def address(participant: str, settings: Mapping[str, str]) -> str:
    """Return the full name of a node, as parameter files name it: ``/robot/driver``."""
    namespace, name = _placed(participant, settings)
    return f"/{namespace}/{name}" if namespace else f"/{name}"


NOT_BY_PARAMETERS: Final = {
    "/rosbag2_player": "`ros2 bag play` takes its QoS from `--qos-profile-overrides-path`",
    "/rosbag2_recorder": "`ros2 bag record` takes its QoS from `--qos-profile-overrides-path`",
}
"""Nodes that declare no `qos_overrides`, and what they have instead."""


def covers(pattern: str, node: str) -> bool:
    """Whether a pattern of a parameter file covers the full name of a node (rclcpp, parameter_map).

    ``/*`` stands for one part of the name, ``/**`` for any number of them; ``*`` alone covers every node. A pattern that
    begins with a slash stands in a parameter file, and covers no node that takes its QoS from elsewhere.
    """
    if pattern == "*":
        return True
    if not node.startswith("/") or (pattern.startswith("/") and (node in NOT_BY_PARAMETERS or node.endswith(")"))):
        return False  # sides of bridges are named after their file, in brackets
    parts = node[1:].split("/")
    matched = {0}  # how many parts of the name the pattern can have used so far
    for part in pattern.strip("/").split("/"):
        if part == "**":
            matched = set(range(min(matched), len(parts) + 1))
        else:
            matched = {n + 1 for n in matched if n < len(parts) and part in {"*", parts[n]}}
        if not matched:
            return False
    return len(parts) in matched


def expand(name: str, namespace: str, node: str) -> str:
    """Return the full name (rcl_expand_topic_name); what rcl refuses comes out illegal."""
    inside = namespace.rstrip("/")
    if "{" in name:
        name = name.replace("{node}", node).replace("{namespace}", namespace).replace("{ns}", namespace)
    if name.startswith("/"):
        return name
    if name == "~" or name.startswith("~/"):
        return f"{inside}/{node}{name[1:]}"
    return f"{inside}/{name}"


def without_namespace(key: str) -> str:
    """Return the last part of a name as endpoints meet on it; requests and responses of services stay apart."""
    prefix, _, _ = key.partition("/")
    return f"{prefix}/{key.rpartition('/')[2]}"


def is_legal(full: str) -> bool:
    """Whether ROS 2 accepts a full name."""
    return _LEGAL.fullmatch(full) is not None and len(full) <= LONGEST


def why_illegal(full: str) -> str | None:
    """Say what is wrong with a full name, None for a legal one."""
    if is_legal(full):
        return None
    if len(full) > LONGEST:
        return f"it is longer than {LONGEST} characters"
    return next((why for pattern, why in ILLEGAL.items() if fits(full, pattern)), None)


def _problems(full: str, free_text: str | None) -> tuple[NameProblem, ...]:
    if free_text is not None:
        if _plainly(free_text) == full.rpartition("/")[2]:
            return ()
        message = f"`{free_text}` is no ROS 2 topic name; it is checked as `{full}`"
        return (NameProblem("ROS405", "note", message, f"name it `{full}` if that is what is meant"),)
    why = why_illegal(full)
    if why is not None:
        message = f"`{full}` is no ROS 2 topic name: {why}"
        if "*" in full or "#" in full:
            advice = "a name is no pattern: write an entry for each topic, with its whole name"
            return (NameProblem("ROS405", "error", message, advice),)
        return (NameProblem("ROS405", "error", message, f"for instance `{legal_name(full)}`"),)
    return _remarks(full)


def _of_namespace(stated: str | None) -> tuple[NameProblem, ...]:
    """Say why a namespace is refused (rmw_validate_namespace) although the names in it are legal without its last slash."""
    text = (stated or "").strip()
    if len(text) < len("a/") or not text.endswith("/"):
        return ()
    message = f"`{text}` is no namespace of ROS 2: it ends with a slash, so the node does not start"
    return (NameProblem("ROS405", "error", message, f"write `namespace: {text.rstrip('/')}`"),)


def _remarks(full: str) -> tuple[NameProblem, ...]:
    """Return what is worth saying of a legal name."""
    problems = []
    if HIDDEN.strip("*") in full:
        problems.append(NameProblem("ROS407", "note", f"`{full}` is hidden: a part of it starts with `_`"))
    if REPEATED_UNDERSCORE.strip("*") in full:
        problems.append(NameProblem("ROS408", "note", f"`{full}` has a repeated underscore"))
    return tuple(problems)


def _plainly(text: str) -> str:
    """The usual spelling of a text: lower case, blanks and hyphens as underscores."""
    return re.sub(r"[\s\-]+", "_", text).lower()


def legal_name(text: str) -> str:
    """Return the nearest legal name: ``Req weather data`` becomes ``req_weather_data``.

    Accents go, other scripts are spelled by their code points, whatever else is no letter or digit becomes ``_``.
    A text that is legal already stays as it is.
    """
    slash = "/" if text.startswith("/") else ""
    if is_legal(text if slash else f"/{text}"):
        return text
    parts = (_legal_part(part) for part in text.split("/"))
    name = "/".join(part for part in parts if part) or _spelled(text)
    return slash + name[: LONGEST - 1].rstrip("/")


def _legal_part(part: str) -> str:
    letters = "".join(map(_legal_letter, unicodedata.normalize("NFKD", part.casefold())))
    word = re.sub(r"_+", "_", letters).strip("_")
    return f"topic_{word}" if word[:1].isdigit() else word


def _legal_letter(letter: str) -> str:
    if letter.isascii():
        return letter if letter.isalnum() else "_"
    category = unicodedata.category(letter)
    if category.startswith("M") or category == "Cf":
        return ""  # accents, and marks that are not seen
    return f"_{_spelled(letter)}_" if category.startswith(("L", "N")) else "_"


def _spelled(text: str) -> str:
    return "_".join(f"u{ord(letter):x}" for letter in text)
