"""The network interfaces that a middleware uses, by its XML: Cyclone DDS (`CYCLONEDDS_URI`) and Fast DDS (a profiles file)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.files.source_files import read_path
from cqos_core.importers.xml_source import local, parse_xml, text_of
from cqos_core.model.source import Source

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.xml_source import Element

LOOPBACK: Final = frozenset(("lo", "lo0", "127.0.0.1", "::1", "localhost"))
_MOST_TAGS: Final = 20_000
_CYCLONE: Final = ("NetworkInterface", "NetworkInterfaceAddress")
_FAST: Final = ("interfaceWhiteList", "interfaces")


def interfaces_of(text: str) -> list[str]:
    """Return the interfaces that a configuration names, where it is XML or the path of an XML file; none: it names none.

    Raises:
        InputError: it is no XML, or the file cannot be read.
    """
    text = text.strip()
    source = Source("CYCLONEDDS_URI", text.encode()) if text.startswith("<") else read_path(_path(text))
    return list(dict.fromkeys(filter(None, _named(parse_xml(source, _MOST_TAGS)))))


def _path(text: str) -> str:
    return text.removeprefix("file://")


def _named(root: Element) -> Iterator[str]:
    for each in root.iter("*"):
        name = local(each)
        if name in _CYCLONE:
            stated = [each.get("name"), each.get("address"), (text_of(each) or "").strip()]
            yield from (word.strip() for value in stated if value for word in value.split(","))
        elif name in _FAST:
            yield from (
                (text_of(inner) or inner.get("name") or "").strip() for inner in each if isinstance(inner.tag, str)
            )
