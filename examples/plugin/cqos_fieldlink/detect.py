"""Recognises link lists. C-QoS calls it for every file, so it imports nothing and looks at the first bytes only."""

from __future__ import annotations

MARK = b"fieldlink links;"


def claims(name: str, head: bytes) -> bool:  # noqa: ARG001 - many kinds of file end in .csv, so the name says nothing
    """Return whether this is a link list, by its first line."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(MARK)
