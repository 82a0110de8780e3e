"""Inputs of importers (the bytes of one file, functions of their caller) and the signatures of importers."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place
    from cqos_core.model.system import System


VARIABLES: Final = "$"
"""The entry among the switches of importers that holds the values of variables."""
OPTIONS: Final = "--option"
"""The entry that holds options of packs which the caller states, as ``ros2.rmw``."""


@dataclass(frozen=True, slots=True)
class Source:
    """One input: its name as the caller wrote it (a path, or ``<bytes>``) and its bytes, never decoded."""

    name: str
    data: bytes


class Opener(Protocol):
    """Opens a file that another one names, relative to the one that names it; raises `InputError` where it cannot.

    A name with a slash at its end is that of a folder: its bytes are the names of what is in it, one a line.
    """

    def __call__(self, name: str, relative_to: str) -> Source:
        """Return the source ``name`` stands for."""


def no_files(name: str, relative_to: str) -> Source:
    """Refuse to open anything: for bytes from memory or the network, where a path means nothing."""
    from cqos_core.model.problems import InputError, Problem
    from cqos_core.model.settings import Place

    message = f"cannot include `{name}`: this input was given as bytes, so there is no folder to look in"
    raise InputError([Problem("CQ007", message, Place(relative_to))])


class ForeignReader(Protocol):
    """Reads a source of any format that is installed, for a file that includes it."""

    def __call__(self, source: Source, protocols: frozenset[str]) -> System | None:
        """Return the system in ``source``, None without an importer; ``protocols`` are those of the including file."""


def no_other_format(source: Source, protocols: frozenset[str]) -> None:
    """Read no other format: for readers that are used by themselves."""


@dataclass(frozen=True, slots=True)
class SourceGroup:
    """Sources of one format that are read together, because its files `share names <ImporterInfo.shares_names>`.

    Attributes:
        sources: all of them.
        known: results of the reader, by the name of the source, so that each is parsed once.
    """

    sources: list[Source] = field(default_factory=list)
    known: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ReadContext:
    """Everything that a reader may use beside its source.

    Attributes:
        open: opens included files.
        read: reads included files of other formats.
        options: importer switches from the command line or configuration, by importer name and switch, for instance
            ``{"bpmn": {"message_flows": "true"}}``; under `VARIABLES` what variables in files stand for.
        group: the sources of this format that are read together, this one among them.
    """

    open: Opener = no_files
    read: ForeignReader = no_other_format
    options: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    group: SourceGroup = field(default_factory=SourceGroup)


class Replacement(NamedTuple):
    """A part of a text, from its first character to the one behind it, and its replacement."""

    start: int
    end: int
    text: str


class Inserter(Protocol):
    """Adds settings to something that a file states; the importer of the format brings it along."""

    def __call__(self, text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
        """Return the replacement that adds settings, by name, at ``place``; None if there is no room for them."""


class Reader(Protocol):
    """Reads one source into a system; raises `InputError` with every problem where it cannot."""

    def __call__(self, source: Source, context: ReadContext) -> System:
        """Return the system in ``source``."""


class Claim(Protocol):
    """Says whether a source looks like this importer's format, from its name and first bytes, without importing a parser."""

    def __call__(self, name: str, head: bytes) -> bool:
        """``head`` holds at most the first 64 KiB."""
