"""The parts of an input that an importer recognised and did not read, from its notes."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from cqos_core.model.code_info import CodeInfo
from cqos_core.model.system import Part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from cqos_core.model.system import ImportNote
    from cqos_core.packs.rule import Rule


def unread_parts(notes: Iterable[ImportNote], find_rule: Callable[[str], Rule | CodeInfo | None]) -> Iterator[Part]:
    """Yield the parts that notes list, and one for each note without a list whose code is about a part that was left out."""
    for note in notes:
        if note.parts:
            yield from note.parts
        elif isinstance(info := find_rule(note.code), CodeInfo) and info.leaves_out:
            yield Part(info.leaves_out, cause=note.message, place=note.place, endpoints=info.missing)


def totals_of(notes: Iterable[ImportNote]) -> Counter[str]:
    """Return how many parts of a kind the inputs have, read or not, where notes say so."""
    totals: Counter[str] = Counter()
    for note in notes:
        totals.update({part.kind: note.total for part in note.parts[:1] if note.total})
    return totals
