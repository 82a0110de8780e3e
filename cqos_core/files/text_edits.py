"""Applies edits to one text: values are replaced in place, and the inserter of the format adds settings."""

from __future__ import annotations

from contextlib import suppress
from html import escape, unescape
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.files.yaml_edits import is_json, replace_within, scalar
from cqos_core.language.domains import flow
from cqos_core.model.encoding import Lines, codec, decode, encoding_of
from cqos_core.model.excerpt import exact, span
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import InvalidValueError
from cqos_core.model.regular_expressions import re
from cqos_core.model.source import Replacement

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from cqos_core.model.finding import Edit
    from cqos_core.model.source import Inserter, Source


class EditedText(NamedTuple):
    """The bytes after edits, and the edits that could not be applied, each with the reason."""

    data: bytes
    left: tuple[tuple[Edit, str], ...] = ()


def edited_text(source: Source, edits: Iterable[Edit], inserter: Callable[[], Inserter | None]) -> EditedText:
    """Apply edits to one source; layout and comments stay.

    Args:
        source: the file.
        edits: all of this source.
        inserter: returns the function that adds settings in this format; None if the format has none.
    """
    data = source.data
    text = decode(data)
    encoding = codec(encoding_of(data)) or "utf-8"
    made, left = replacements(source, edits, inserter)
    for change in sorted(made, reverse=True):
        text = text[: change.start] + change.text + text[change.end :]
    mark = data[: len(data) - len(decode(data).encode(encoding, "replace"))]
    try:
        return EditedText(mark + text.encode(encoding), tuple(left))
    except UnicodeEncodeError:
        reason = f"the file is written in {encoding}, which has no such character"
        return EditedText(data, tuple((edit, reason) for edit in dict.fromkeys(edits)))


def replacements(
    source: Source, edits: Iterable[Edit], inserter: Callable[[], Inserter | None]
) -> tuple[list[Replacement], list[tuple[Edit, str]]]:
    """Return the replacements for edits of one source, in order, and the edits that cannot be applied."""
    data = source.data
    text = decode(data)
    left: list[tuple[Edit, str]] = []
    changes: dict[Replacement, list[Edit]] = {}
    wanted = dict.fromkeys(edits)
    added = grouped((edit.place, edit) for edit in wanted if edit.old is None)
    for edit in (each for each in wanted if each.old is not None):
        found = _replaced(text, edit, data)
        if found is None:
            left.append((edit, f"`{edit.old}` does not stand there"))
        else:
            changes.setdefault(found, []).append(edit)
    insert = inserter() if added else None
    for place, group in added.items():
        stated = {edit.attribute: edit.new for edit in group}
        found = insert(text, place, stated) if insert is not None and len(stated) == len(group) else None
        if found is None:
            left += ((edit, f"its format has no place for `{edit.attribute}`") for edit in group)
        else:
            changes.setdefault(found, []).extend(group)
    made, clashing = _apart(changes)
    left += ((edit, "another edit changes the same text") for edit in clashing)
    return made, left


def _apart(changes: dict[Replacement, list[Edit]]) -> tuple[list[Replacement], list[Edit]]:
    """Return the changes that overlap no earlier one, and the edits of the others."""
    made: list[Replacement] = []
    clashing: list[Edit] = []
    for change in sorted(changes):
        if made and change.start < max(made[-1].end, made[-1].start + 1):
            clashing += changes[change]
        else:
            made.append(change)
    return made, clashing


_ATTRIBUTE: Final = re.compile(r"""[^\s=/<>"']++\s*+=\s*+(?P<value>"[^"]*+"|'[^']*+')""")
_LEAF: Final = re.compile(r"""<[^\s<>/!?=]++(?:[^<>"']++|"[^"]*+"|'[^']*+')*+(?<!/)>\s*+(?P<value>[^<]*?)\s*<""")


def _replaced(text: str, edit: Edit, data: bytes) -> Replacement | None:
    """Return the replacement of a value at its exact place; None if the place has another text."""
    place = exact([edit.place], {edit.place.source: data})[edit.place]
    lines = Lines(text)
    start = lines.start(place.line) if place.line is not None else None
    if start is None or edit.old is None:
        return None
    if place.column is None:
        return _on_line(lines.line(place.line or 0), start, edit)
    offset = start + place.column - 1
    if text[:200].lstrip().startswith("<"):
        return _in_xml(text, offset, edit)
    shown = span(place, {edit.place.source: data})
    written = text[offset : offset + shown.width] if shown is not None else ""
    if not written or not _means(written, edit.old):
        return replace_within(text, place, edit.attribute, edit.old, edit.new)
    return Replacement(offset, offset + len(written), scalar(edit.new, like=written, in_json=is_json(text)))


def _means(written: str, old: str) -> bool:
    with suppress(InvalidValueError):
        read = flow(written)
        return bool(old in (written, read) or (written[:1] in "[{" and read == flow(old)))
    return written == old


def _on_line(line: str, start: int, edit: Edit) -> Replacement | None:
    """Return the replacement of a word, if its line has it once."""
    found = [*re.finditer(rf"(?<![\w.]){re.escape(edit.old or '')}(?![\w.])", line)]
    return Replacement(start + found[0].start(), start + found[0].end(), edit.new) if len(found) == 1 else None


def _in_xml(text: str, offset: int, edit: Edit) -> Replacement | None:
    """Return the replacement of an attribute value, or of the text of an element without children."""
    if found := _ATTRIBUTE.match(text, offset):
        start, end = found.start("value") + 1, found.end("value") - 1
        new = escape(edit.new)
    elif found := _LEAF.match(text, offset):
        start, end = found.span("value")
        new = escape(edit.new, quote=False)
    else:
        return None
    return Replacement(start, end, new) if unescape(text[start:end]).strip() == (edit.old or "").strip() else None
