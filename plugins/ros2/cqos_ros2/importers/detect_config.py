"""Recognises configuration files of ROS 2 tools from a name and the first bytes, without importing a parser."""

from __future__ import annotations

import os.path
from typing import Final

from cqos_core.importers.format_detection import claims_yaml, head_text
from cqos_core.model.regular_expressions import re, regular_expression

_YAML_SUFFIXES: Final = frozenset((".yaml", ".yml", ".json", ""))
_ZENOH_SUFFIXES: Final = _YAML_SUFFIXES | {".json5"}
_BESIDE_COMMENTS: Final = regular_expression(
    r"""("(?:[^"\\\n]|\\.)*+"?|'(?:[^'\\\n]|\\.)*+'?)|//[^\n]*+|/\*(?:[^*]|\*(?!/))*+(?:\*/)?"""
)
_FIRST: Final = regular_expression(r"(?:\s++|#[^\n]*+|%[^\n]*+|---(?=\s))*+(\S)")


def _key(names: str, before: str = r"[^#\n]*\b") -> re.Pattern[str]:
    """Find one of ``names`` as a key; ``before`` is what may stand before it on its line."""
    part = names if names.replace(" ", "_").isidentifier() else None
    return regular_expression(rf"""^{before}["']?(?:{names})["']?[ \t]*:""", re.MULTILINE, part)


_TOP: Final = r"[ \t{]*"
_ZENOH_KEYS: Final = tuple(_key(name, r"""(?:[^#\n]*?[{,\s])?""") for name in ("plugins", "ros2dds"))
_PARAMETERS: Final = _key("ros__parameters")
_OVERRIDES: Final = regular_expression(r"^[^#\n]*\bqos_overrides\b", re.MULTILINE, "qos_overrides")
_MISPLACED: Final = _key(r"qos_overrides(?:\.[^\s:]{1,300})?", r"[^#\n:]*\b")
_VISUALIZATION: Final = _key("Visualization Manager", "")
_GZ_ENTRY: Final = _key("(?:ros|gz|ign)_(?:topic|type)_name|gz_req_type_name")
_SERVICES_OF_ROS1: Final = _key("services_1_to_2|services_2_to_1", _TOP)
_TOPICS: Final = _key("topics", _TOP)
_TOPIC: Final = _key("topic")
_QUEUE: Final = _key("queue_size")
_BRIDGED: Final = _key("topics|services|actions", _TOP)
_NODL: Final = _key("nodl_version", "")
_DOMAINS: Final = _key("from_domain|to_domain")
# What may stand before the first element; possessive, so that the time is linear whatever stands there.
_PROLOG: Final = regular_expression(
    rb"(?:\s++|\xef\xbb\xbf|\xff\xfe|\xfe\xff|<\?(?:[^?]++|\?(?!>))*+\?>|<!--(?:[^-]++|-(?!->))*+-->|<!DOCTYPE[^<>\[]*+(?:\[[^\]]*+\]\s*+)?+>)*+"
)
_ROOT: Final = regular_expression(rb"<(?:[^\s<>/!?:]+:)?(?:dds|profiles)(?=[\s>/])")
_CYCLONE: Final = regular_expression(rb"<(?:[^\s<>/!?:]+:)?(?i:CycloneDDS)(?=[\s>/])")
_OMG: Final = regular_expression(
    rb"<(?:[^\s<>/!?:]+:)?(?:qos_profile|(?:qos|domain|(?:domain_)?participant|application)_library)[\s>/]"
)
_PROFILES: Final = regular_expression(rb"<(?:[^\s<>/!?:]+:)?(?:profiles|data_writer|data_reader)[\s>/]")


def claims_qos_overrides(name: str, head: bytes) -> bool:
    """Say whether these are parameters of ROS 2 nodes with ``qos_overrides`` among them, be it in the wrong place."""
    text = _yaml(name, head)
    if _OVERRIDES.search(text) is None:
        return False
    return _PARAMETERS.search(text) is not None or (_MISPLACED.search(text) is not None and not claims_yaml(name, head))


def claims_rviz(name: str, head: bytes) -> bool:
    """Say whether this is a configuration of RViz."""
    return name.lower().endswith(".rviz") or _VISUALIZATION.search(_yaml(name, head)) is not None


def claims_gz_bridge(name: str, head: bytes) -> bool:
    """Say whether this is a list of topics for ros_gz_bridge, or ros_ign_bridge."""
    text = _yaml(name, head)
    first = _FIRST.match(text) if text else None
    return first is not None and first[1] in "-[" and _GZ_ENTRY.search(text) is not None


def claims_ros1_bridge(name: str, head: bytes) -> bool:
    """Say whether these are the parameters of the parameter bridge of ros1_bridge."""
    text = _yaml(name, head)
    if not text or _is_domain_bridge(text):
        return False
    if _SERVICES_OF_ROS1.search(text):
        return True
    return all(key.search(text) for key in (_TOPICS, _TOPIC, _QUEUE))


def claims_domain_bridge(name: str, head: bytes) -> bool:
    """Say whether this is a configuration of domain_bridge."""
    return _is_domain_bridge(_yaml(name, head))


def _is_domain_bridge(text: str) -> bool:
    return "_domain" in text and _BRIDGED.search(text) is not None and _DOMAINS.search(text) is not None


def claims_zenoh_bridge(name: str, head: bytes) -> bool:
    """Say whether this configures the Zenoh bridge for ROS 2 over DDS, by itself or as a plug-in of a router."""
    suffix = os.path.splitext(name)[1].lower()  # noqa: PTH122 - `pathlib` takes 3 ms to import
    if (not name.startswith("<") and suffix not in _ZENOH_SUFFIXES) or claims_yaml(name, head):
        return False
    text = _BESIDE_COMMENTS.sub(r"\1", head_text(head))
    return all(key.search(text) for key in _ZENOH_KEYS)


def claims_nodl(name: str, head: bytes) -> bool:
    """Say whether this is a NoDL document, by its ending or its obligatory key."""
    return name.lower().endswith(".nodl.yaml") or _NODL.search(_yaml(name, head)) is not None


def claims_ros2_model(name: str, head: bytes) -> bool:  # noqa: ARG001 - the signature of all claims
    """Say whether this is a component model of RosTooling."""
    return name.lower().endswith(".ros2")


def claims_fastdds(name: str, head: bytes) -> bool:  # noqa: ARG001
    """Say whether these are XML profiles of Fast DDS; ``dds`` with libraries is the form of the OMG."""
    text, root = _xml(head)
    if _ROOT.match(text, root) is None or _OMG.search(text, root):
        return False
    return _PROFILES.search(text, root) is not None


def claims_cyclonedds(name: str, head: bytes) -> bool:  # noqa: ARG001
    """Say whether this is a configuration of Cyclone DDS."""
    text, root = _xml(head)
    return _CYCLONE.match(text, root) is not None


def _xml(head: bytes) -> tuple[bytes, int]:
    """Return the text, UTF-16 made readable enough, and where its first element begins."""
    text = head.replace(b"\0", b"")
    found = _PROLOG.match(text)
    return text, found.end() if found else 0


def _yaml(name: str, head: bytes) -> str:
    """Return the text of what may be YAML of a ROS 2 tool: of nothing else, and of no system file of C-QoS."""
    if not name.startswith("<") and os.path.splitext(name)[1].lower() not in _YAML_SUFFIXES:  # noqa: PTH122
        return ""
    if claims_yaml(name, head):
        return ""
    return head_text(head)
