"""Recognises XML files of DDS from the first bytes, without importing a parser."""

from __future__ import annotations

from typing import Final

from cqos_core.model.regular_expressions import regular_expression

# What may stand before the first element; possessive, so that the time is linear whatever stands there.
_PROLOG: Final = regular_expression(
    rb"(?:\s++|\xef\xbb\xbf|\xff\xfe|\xfe\xff|<\?(?:[^?]++|\?(?!>))*+\?>|<!--(?:[^-]++|-(?!->))*+-->|<!DOCTYPE[^<>\[]*+(?:\[[^\]]*+\]\s*+)?+>)*+"
)
_ELEMENT: Final = rb"<(?:[^\s<>/!?:=]++:)?"
_ROOT: Final = regular_expression(_ELEMENT + rb"(dds|profiles)(?=[\s>/])")
_LIBRARY: Final = regular_expression(
    _ELEMENT
    + rb"(?:qos_library|qos_profile|domain_library|(?:domain_)?participant_library|application_library|\w{1,40}_service)(?=[\s>/])"
)
_FAST: Final = regular_expression(
    _ELEMENT
    + rb"(?:profiles(?=[\s>/])|(?:data_writer|data_reader|publisher|subscriber|participant)\s[^<>]*profile_name)"
)
_CYCLONE: Final = regular_expression(_ELEMENT + rb"[Cc][Yy][Cc][Ll][Oo][Nn][Ee][Dd][Dd][Ss](?=[\s>/])")
_OPENDDS: Final = regular_expression(
    rb"(?m)^[ \t]*\[(?:rtps_discovery|repository|domain|endpoint|datawriterqos|datareaderqos|transport|transport_template|DomainRange)/"
    rb"[^\]\n]{1,200}\]|^[ \t]*DCPS\w{1,60}[ \t]*="
)
_OPENDDS_NAMES: Final = (".ini", ".conf")
_TYPES: Final = regular_expression(_ELEMENT + rb"types[\s>/]")


def claims_dds_xml(name: str, head: bytes) -> bool:  # noqa: ARG001 - the signature of all claims
    """Say whether this is DDS-XML: libraries of QoS, domains, participants or applications."""
    if b"<" not in head:
        return False
    text, root = _read(head)
    if _LIBRARY.match(text, root):
        return True
    found = _ROOT.match(text, root)
    if found is None or found[1] != b"dds":
        return False
    # Types may fill all that is looked at, before any library.
    has_types = _TYPES.search(text, root) is not None
    return _LIBRARY.search(text, root) is not None or (has_types and _FAST.search(text, root) is None)


def claims_fastdds_xml(name: str, head: bytes) -> bool:
    """Say whether these are XML profiles of Fast DDS."""
    if b"<" not in head:
        return False
    text, root = _read(head)
    return (
        _ROOT.match(text, root) is not None and _FAST.search(text, root) is not None and not claims_dds_xml(name, head)
    )


def claims_cyclonedds_xml(name: str, head: bytes) -> bool:  # noqa: ARG001 - the signature of all claims
    """Say whether this is a configuration of Cyclone DDS."""
    if b"<" not in head:
        return False
    text, root = _read(head)
    return _CYCLONE.match(text, root) is not None


def claims_opendds_ini(name: str, head: bytes) -> bool:
    """Say whether this is a configuration of OpenDDS."""
    return name.lower().endswith(_OPENDDS_NAMES) and b"[" in head and _OPENDDS.search(head) is not None


def _read(head: bytes) -> tuple[bytes, int]:
    """Return the text, UTF-16 made readable enough, and where its first element begins."""
    text = head.replace(b"\0", b"")
    found = _PROLOG.match(text)
    return text, found.end() if found else 0
