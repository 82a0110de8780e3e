"""Finds lines about incompatible endpoints in the output of programs; packs know their wording."""

from __future__ import annotations

import io
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, BinaryIO, Final, cast

from cqos_core.model.dataclass import dataclass
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from cqos_core.model.system import Role

_LONGEST: Final = 64 * 1024
"""Characters of a line that are read: no program writes its messages so far to the right."""
_ESCAPES: Final = regular_expression(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)?|[@-Z\\^_])")


@dataclass(frozen=True, slots=True)
class LogMismatch:
    """A line of output by which a participant discovered an endpoint that is incompatible with its own.

    Attributes:
        protocol: id of the pack that read the line.
        role: of the participant's own endpoint; the discovered one has the other role.
        topic: as it is printed, None where the line names none.
        participant: the writer of the line, as its protocol addresses it; None where the line does not tell.
        named: the policy that the line names, as it is printed.
        policies: the policies of the pack that may be meant; empty for an unknown name.
    """

    protocol: str
    role: Role
    topic: str | None = None
    participant: str | None = None
    named: str | None = None
    policies: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ListTopic:
    """The topic that the next lines of a list are about: that of each `LogMismatch` whose topic is `SAME`."""

    topic: str


SAME: Final = ""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """Equal mismatches in one or more lines: their number, and the place of the first line."""

    misfit: LogMismatch
    count: int
    place: Place


def read_mismatches(
    name: str, stream: BinaryIO, readers: Sequence[Callable[[str], Iterable[LogMismatch | ListTopic]]]
) -> tuple[list[Occurrence], int]:
    """Read the output of programs; return the mismatches of endpoints, and the number of lines.

    Args:
        name: of the source, for places.
        stream: any bytes; bytes that are no text are skipped.
        readers: of the installed packs.

    Raises:
        OSError: the stream cannot be read on.
    """
    found: dict[LogMismatch, Occurrence] = {}
    number = 0
    about: list[str | None] = [None] * len(readers)
    for number, line in enumerate(_lines(stream), 1):
        text = _ESCAPES.sub("", line)
        said = ((which, each) for which, read in enumerate(readers) for each in read(text))
        for which, one in said:
            if isinstance(one, ListTopic):
                about[which] = one.topic
                continue
            each = replace(one, topic=about[which]) if one.topic == SAME else one
            known = found.get(each)
            count, place = (1, Place(name, number)) if known is None else (known.count + 1, known.place)
            found[each] = Occurrence(each, count, place)
    return list(found.values()), number


def _lines(stream: BinaryIO) -> Iterator[str]:
    """Yield every line, or its beginning, whatever the bytes are."""
    buffered = io.BufferedReader(cast("io.RawIOBase", stream))
    # A shell of Windows writes what is sent to a file in UTF-16.
    marked = buffered.peek(2)[:2] in {BOM_UTF16_LE, BOM_UTF16_BE}
    text = io.TextIOWrapper(buffered, "utf-16" if marked else "utf-8", "replace", newline=None)
    try:
        while line := text.readline(_LONGEST):
            yield line
            while not line.endswith("\n") and (line := text.readline(_LONGEST)):
                pass
    finally:
        text.detach()
        buffered.detach()
