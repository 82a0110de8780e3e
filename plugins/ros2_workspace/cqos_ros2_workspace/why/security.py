"""SROS 2: whether the access control of a keystore lets programs publish a topic and subscribe to it (DDS Security 1.1, 9.4.1).

Signatures are not checked. Which program uses which enclave shows only on the robot, so each enclave is named.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.files.folder_walk import SkippedFolder, walk
from cqos_core.files.source_files import read_path
from cqos_core.importers.xml_source import children, elements, local, parse_xml, text_of
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.importers.xml_source import Element

NAMES: Final = ("governance.xml", "permissions.xml")
_MOST_TAGS: Final = 100_000
_MOST_FILES: Final = 1_000
_MAY: Final = ("publish", "subscribe")


class Access(NamedTuple):
    """What access control says of one topic.

    Attributes:
        guarded: whether writing and reading need permission, by direction; empty where no governance states it.
        refused: enclaves without permission, by direction.
        enclaves: all that were read.
    """

    guarded: dict[str, bool]
    refused: dict[str, list[str]]
    enclaves: list[str]


def access(keystore: Path, topic: str) -> Access:
    """Return what the files of a keystore say of a topic of ROS 2.

    Raises:
        InputError: a file is no XML.
    """
    name = f"rt{topic}"
    guarded: dict[str, bool] = {}
    refused: dict[str, list[str]] = {each: [] for each in _MAY}
    enclaves = []
    for path in sorted(_files(keystore)):
        root = parse_xml(read_path(str(path)), _MOST_TAGS)
        if path.name == NAMES[0]:
            guarded = {**_guarded(root, name), **guarded}
            continue
        enclave = f"/{path.parent.relative_to(keystore).as_posix().removeprefix('enclaves/').strip('./')}"
        enclaves.append(enclave)
        for direction in _MAY:
            if not any(_may(grant, direction, name) for grant in _found(root, "grant")):
                refused[direction].append(enclave)
    return Access(guarded, refused, enclaves)


def _files(keystore: Path) -> Iterator[Path]:
    skipped: list[SkippedFolder] = []
    found = (
        path
        for folder, _, names in walk(str(keystore), skipped)
        for path in (Path(folder, name) for name in names if name in NAMES)
        if not path.is_symlink()
    )
    for number, path in enumerate(found):
        if number >= _MOST_FILES:
            return
        yield path
    for each in skipped:
        raise InputError([Problem("CQ001", f"the folder cannot be searched: {each.cause}", Place(each.path))])


def _found(root: Element, name: str) -> list[Element]:
    return [each for each in root.iter("*") if local(each) == name]


def _guarded(root: Element, name: str) -> dict[str, bool]:
    """Return whether the first rule of the governance for a topic asks for permission."""
    for rule in _found(root, "topic_rule"):
        texts = {local(each): (text_of(each) or "").strip() for each in elements(rule)}
        if fnmatchcase(name, texts.get("topic_expression", "")):
            return {
                "publish": texts.get("enable_write_access_control", "").lower() in {"true", "1"},
                "subscribe": texts.get("enable_read_access_control", "").lower() in {"true", "1"},
            }
    return {}


def _may(grant: Element, direction: str, name: str) -> bool:
    """Return whether a grant allows a direction: its first rule about the topic decides, else its default."""
    default = False
    for rule in elements(grant):
        kind = local(rule)
        if kind == "default":
            default = (text_of(rule) or "").strip() == "ALLOW"
        elif kind in {"allow_rule", "deny_rule"} and _about(children(rule, direction), name):
            return kind == "allow_rule"
    return default


def _about(parts: Sequence[Element], name: str) -> bool:
    expressions = (each for part in parts for topics in children(part, "topics") for each in children(topics, "topic"))
    return any(fnmatchcase(name, (text_of(each) or "").strip()) for each in expressions)
