"""From the bytes of a source to its text: which encoding they have, and lines and columns as people count them."""

from __future__ import annotations

import codecs
from bisect import bisect_right

from cqos_core.model.regular_expressions import regular_expression

_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),  # before UTF-16, whose mark it starts with
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
# Those that documents are written in. Python's other codecs are transformations rather than alphabets, and some
# of them take quadratic time.
_ALPHABETS = frozenset(
    [
        "ascii",
        "utf-8",
        *(f"utf-{width}-{order}" for width in (16, 32) for order in ("le", "be")),
        *(f"iso8859-{part}" for part in (*range(1, 12), *range(13, 17))),
        *(f"cp{page}" for page in (437, 850, 852, 866, 874, *range(1250, 1259))),
        *("big5", "cp932", "cp949", "euc_jp", "euc_kr", "gb18030", "gb2312", "gbk", "koi8-r", "koi8-u"),
        *("mac-roman", "shift_jis"),
    ]
)
_DECLARATION = regular_expression(rb"""\s*<\?xml\s[^>]*?\bencoding\s*=\s*["']([A-Za-z0-9._:-]+)["']""")
_NEW_LINE = regular_expression("\n")
_DECLARATION_LIMIT = 1024


def byte_order_mark(data: bytes) -> tuple[str, int]:
    """Return the encoding that the first bytes mark and the length of the mark, or ``("", 0)``."""
    for mark, encoding in _BOMS:
        if data.startswith(mark):
            return encoding, len(mark)
    return "", 0


def encoding_of(data: bytes) -> str:
    """Return the encoding of a text file or XML document, as it is marked, visible or declared, else ``utf-8``.

    A declared name is returned as written, so it may be an unknown one. A declared UTF-16 that the bytes
    plainly do not have is taken for UTF-8: some programs print every document with the declaration of a string.
    """
    marked, _ = byte_order_mark(data)
    if marked:
        return marked
    if data[:2] == b"<\0":
        return "utf-16-le"
    if data[:2] == b"\0<":
        return "utf-16-be"
    head = data[:_DECLARATION_LIMIT]
    declared = _DECLARATION.match(head) if b"<?xml" in head else None
    if declared is None:
        return "utf-8"
    name = declared[1].decode("ascii")
    return "utf-8" if name.lower().startswith(("utf-16", "utf-32", "ucs-")) else name


def codec(name: str) -> str | None:
    """Return Python's name of the encoding ``name``, or None if documents cannot be written in it."""
    try:
        found = codecs.lookup(name).name
    except LookupError:
        return None
    return found if found in _ALPHABETS else None


def decode(data: bytes) -> str:
    """Return the text of ``data`` for showing it: what cannot be decoded is replaced, nothing is ever raised."""
    _, skip = byte_order_mark(data)
    return data[skip:].decode(codec(encoding_of(data)) or "utf-8", "replace")


class Lines:
    """Finds the lines of a text, which end with a line feed, as XML and YAML parsers count them."""

    __slots__ = ("_starts", "text")

    def __init__(self, text: str) -> None:
        """Index ``text`` once."""
        self.text = text
        self._starts = [0, *(match.end() for match in _NEW_LINE.finditer(text))]

    def position(self, offset: int) -> tuple[int, int]:
        """Return the one-based line and column of a character."""
        line = bisect_right(self._starts, offset)
        return line, offset - self._starts[line - 1] + 1

    def start(self, line: int) -> int | None:
        """Return the offset of the first character of the one-based ``line``, None where there is no such line."""
        return self._starts[line - 1] if 0 < line <= len(self._starts) else None

    def line(self, line: int) -> str:
        """Return the one-based ``line`` without its end; empty where there is no such line."""
        start = self.start(line)
        if start is None:
            return ""
        end = self._starts[line] - 1 if line < len(self._starts) else len(self.text)
        return self.text[start:end].removesuffix("\r")
