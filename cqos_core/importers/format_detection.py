"""Recognises formats from a name and the first bytes, without importing a parser."""

from __future__ import annotations

from cqos_core.model.regular_expressions import re, regular_expression

_BPMN_SUFFIXES = (".bpmn", ".bpmn2", ".bpmn20.xml")
_ROOT = regular_expression(rb"<(?:[^\s<>/!?:]+:)?definitions(?=[\s>/])([^>]*)")


def claims_bpmn(name: str, head: bytes) -> bool:
    """Say whether this is, or is meant to be, a BPMN file: by its ending, or by its first element.

    Drafts of BPMN and `definitions` without a namespace are claimed as well, so that the importer can report
    their mistakes.
    """
    if name.lower().endswith(_BPMN_SUFFIXES):
        return True
    text = head.replace(b"\0", b"")  # UTF-16 becomes readable enough
    root = _ROOT.search(text) if text.lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n").startswith(b"<") else None
    return root is not None and (b"/BPMN/" in text or b"xmlns" not in root[1])


_WIDE = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def head_text(head: bytes) -> str:
    """Return the text of the first bytes of a file, as far as they can be decoded: a shell of Windows writes UTF-16."""
    return head.decode(_WIDE.get(head[:2], "utf-8"), "ignore").lstrip("\ufeff")


_EXCEPTION = regular_expression(rb"#[ \t]*cqos:[ \t]*[a-zA-Z]")


def may_have_exceptions(data: bytes) -> bool:
    """Say whether a system file may have comments such as ``# cqos: ignore[ROS101] reason``."""
    return _EXCEPTION.search(data.replace(b"\0", b"")) is not None


SMALLEST_SYSTEM = "participants: {NAME: {publishes: {TOPIC: }}, OTHER: {subscribes: {TOPIC: }}}"
"""The smallest system file, for messages."""
_YAML_SUFFIXES = (".yaml", ".yml", ".json")
_VERSION_KEY = regular_expression(r"""^(?:cqos|"cqos"|'cqos')[ \t]*:""", re.MULTILINE)
_FLOW_VERSION_KEY = regular_expression(
    r"""[{,]\s*(?:cqos|"cqos"|'cqos'|[\u201c\u201d\u201e\u00ab\u00bb]cqos[\u201c\u201d\u00ab\u00bb])\s*:"""
)
_FLOW = regular_expression(r"(?:\s++|#[^\n]*+|%[^\n]*+|---)*+\{")
_PARTICIPANTS = regular_expression(r"^participants[ \t]*:", re.MULTILINE)
_FLOW_PARTICIPANTS = regular_expression(r"""[{,]\s*(?:participants|"participants"|'participants')\s*:""")
_DO = regular_expression(r"""(?:^[ \t]+|[{,]\s*)(["']?)(?:publishes|subscribes)\1[ \t]*:""", re.MULTILINE)


def claims_yaml(name: str, head: bytes) -> bool:
    """Say whether this is a C-QoS system file: it has the key `cqos` at top level, whatever the file is called.

    A YAML or JSON file with participants that publish or subscribe is claimed without the key, so that the importer can
    report the missing key.
    """
    text = head_text(head)
    if _VERSION_KEY.search(text):
        return True
    flow = _FLOW.match(text) is not None
    if flow and _FLOW_VERSION_KEY.search(text):
        return True
    if not name.lower().endswith(_YAML_SUFFIXES):
        return False
    participants = (_FLOW_PARTICIPANTS if flow else _PARTICIPANTS).search(text)
    return participants is not None and _DO.search(text, participants.end()) is not None
