"""Differences between a node file and the sources as they are now, one on each line; line numbers of sources do not count."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cqos_ros2_sources.node_files.node_entries import DIRECTIONS
from cqos_ros2_workspace.nodes.endpoint_templates import VERBS

PARTS = {"nodes": "node", "fragments": "class"}
"""What people call the parts of a node file."""
_ABSENT = object()


def differences(file: dict[str, Any], sources: dict[str, Any]) -> list[str]:
    """Return what differs between a node file and the sources, one sentence each; a line that moved is no difference."""
    found: list[str] = []
    for part, kind in PARTS.items():
        one, other = file.get(part) or {}, sources.get(part) or {}
        for name in sorted({*one, *other}):
            if name not in other:
                found.append(f"{kind} `{name}`: the sources do not have it")
            elif name not in one:
                found.append(f"{kind} `{name}`: the file does not have it")
            else:
                found += [f"{kind} `{name}`: {each}" for each in _part(one[name] or {}, other[name] or {})]
    return found


def left_over(corrections: dict[str, Any] | None, sources: dict[str, Any]) -> list[str]:
    """Return the corrections of what the sources do not have, one sentence each."""
    found: list[str] = []
    for part, kind in PARTS.items():
        known = sources.get(part) or {}
        for name, correction in ((corrections or {}).get(part) or {}).items():
            if name not in known:
                found.append(f"{kind} `{name}`: it is corrected, and the sources do not have it")
                continue
            found += [
                f"{kind} `{name}`: that it {VERBS[direction]} `{topic}` is corrected, and the sources do not have it"
                for direction in DIRECTIONS
                for topic in (correction or {}).get(direction) or ()
                if topic not in (known[name].get(direction) or {})
            ]
    return found


def _part(file: dict[str, Any], sources: dict[str, Any]) -> Iterator[str]:
    for direction in DIRECTIONS:
        one, other = file.get(direction) or {}, sources.get(direction) or {}
        for topic in sorted({*one, *other}):
            where = _place(other.get(topic))
            what = f"{VERBS[direction]} `{topic}`"
            if topic not in other:
                yield f"it {what} in the file, not in the sources"
            elif topic not in one:
                yield f"it {what} in the sources, not in the file{where}"
            else:
                for key, before, now in _changes(_plain(one[topic]), _plain(other[topic]), ""):
                    yield f"{what}: {key} is {before} in the file, {now} in the sources{where}"
    rest = {key for key in (*file, *sources) if key not in DIRECTIONS}
    for key in sorted(rest):
        for inner, before, now in _changes(_plain(file.get(key, _ABSENT)), _plain(sources.get(key, _ABSENT)), key):
            yield f"{inner} is {before} in the file, {now} in the sources"


def _changes(one: Any, other: Any, path: str) -> Iterator[tuple[str, str, str]]:
    if isinstance(one, dict) and isinstance(other, dict):
        for key in [*one, *(each for each in other if each not in one)]:
            yield from _changes(one.get(key, _ABSENT), other.get(key, _ABSENT), f"{path}.{key}".strip("."))
    elif one != other:
        yield path or "it", _shown(one), _shown(other)


def _shown(value: Any) -> str:
    if value is _ABSENT:
        return "not stated"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_shown(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_shown, value)) + "]"
    return f"`{str(value)[:80]}`"


def _plain(value: Any) -> Any:
    """Return a part without places, which move when lines are added."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items() if key != "at"}
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return value


def _place(entry: Any) -> str:
    first = entry[0] if isinstance(entry, list) and entry else entry
    at = first.get("at", "") if isinstance(first, dict) else ""
    return f" ({at})" if at else ""
