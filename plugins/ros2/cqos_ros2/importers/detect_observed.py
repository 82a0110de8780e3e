"""Recognises snapshots, recordings and overrides of them from their first bytes, without importing a parser."""

from __future__ import annotations

from typing import Final

from cqos_core.importers.format_detection import claims_yaml, head_text
from cqos_core.model.regular_expressions import re, regular_expression

_COUNT: Final = regular_expression(r"^[ \t]*(?:Publisher|Subscri(?:ption|ber)) count: *\d", re.MULTILINE, " count:")
_ENDPOINT: Final = regular_expression(
    r"^[ \t]*Endpoint type: *(?:PUBLISHER|SUBSCRIPTION|INVALID)\b", re.MULTILINE, "Endpoint type:"
)
_BEFORE: Final = r"(?:\s++|\#[^\n]*+|%[^\n]*+|---)*+"
_BAG: Final = regular_expression(_BEFORE + r"""(?:\{\s*)?(["']?)rosbag2_bagfile_information\1\s*:""")
_KEY: Final = regular_expression(r"""^(?:"[^"\n]*"[ \t]*|'[^'\n]*'[ \t]*|[^\s#:'"%\-][^\n]*?):(?=\s)""", re.MULTILINE)
_ABSOLUTE: Final = regular_expression(r"""["']?/[^*\n]*:?""")
_POLICY: Final = regular_expression(
    r"""[\s{,](["']?)(?:history|depth|reliability|durability|deadline|lifespan|liveliness|liveliness_lease_duration"""
    r"""|avoid_ros_namespace_conventions)\1\s*:"""
)
_FLOW: Final = regular_expression(_BEFORE + r"""\{\s*["']?/[^*\n]*?:\s*\{""")
_PARAMETERS: Final = "ros__parameters"


def claims_topic_info(name: str, head: bytes) -> bool:  # noqa: ARG001 - the signature of all claims
    """Say whether `ros2 topic info` printed this, perhaps among other things."""
    text = head_text(head)
    return _COUNT.search(text) is not None or _ENDPOINT.search(text) is not None


def claims_rosbag2(name: str, head: bytes) -> bool:  # noqa: ARG001
    """Say whether this is the description of a rosbag2 recording, whatever the file is called."""
    text = head_text(head)
    return "rosbag2_bagfile_information" in text and _BAG.match(text) is not None


def claims_rosbag2_overrides(name: str, head: bytes) -> bool:
    """Say whether this is a file for `--qos-profile-overrides-path`: full topic names with policies below them."""
    text = head_text(head)
    if _PARAMETERS in text or claims_yaml(name, head) or _POLICY.search(text) is None:
        return False
    if _FLOW.match(text) is not None:
        return True
    keys = [found[0] for found in _KEY.finditer(text)]
    return bool(keys) and all(map(_ABSOLUTE.fullmatch, keys))
