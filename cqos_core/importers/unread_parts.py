"""The entries of `unread` in a system file: parts of the system that the file does not describe, and that may decide a verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.document_form import Form, Key
from cqos_core.importers.value_types import COUNT, TEXT
from cqos_core.model.system import ImportNote, Part

if TYPE_CHECKING:
    from cqos_core.importers.document_form import Entry

KIND: Final = Key("kind", TEXT, "What kind of part it is, as a noun: `node`, `file`, `section`.", required=True)
PART_NAME: Final = Key("name", TEXT, "Name of the part.")
CAUSE: Final = Key("cause", TEXT, "Why the file does not describe it.")
ENDPOINTS: Final = Key("endpoints", COUNT, "How many endpoints it has at least; 1 if not stated.")
TOTAL: Final = Key("total", COUNT, "How many parts of this kind the system has, those of the file included.")
UNREAD_PART: Final = Form(
    "unread_part", "a part that is not described", (KIND, PART_NAME, CAUSE, ENDPOINTS, TOTAL), short=KIND.name
)


def unread_note(entry: Entry) -> ImportNote:
    """Return the note that one entry becomes; it fills the coverage of reports."""
    kind, name, cause = entry.require(KIND), entry.get(PART_NAME) or "", entry.get(CAUSE) or ""
    stated = entry.get(ENDPOINTS)
    part = Part(kind, name, cause, entry.place, 1 if stated is None else stated)
    said = f"{kind} `{name}`" if name else f"a {kind}"
    return ImportNote(
        "CQ219",
        "note",
        f"{said} is not described here{f': {cause}' if cause else ''}",
        entry.place,
        parts=(part,),
        total=entry.get(TOTAL) or 0,
    )
