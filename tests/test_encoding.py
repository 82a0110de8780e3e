"""From bytes to text, and lines as people count them."""

from __future__ import annotations

import codecs

import pytest

from cqos_core.model import encoding
from cqos_core.model.encoding import Lines, codec, decode, encoding_of


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (b"a: 1", "utf-8"),
        (codecs.BOM_UTF8 + b"a: 1", "utf-8"),
        (codecs.BOM_UTF16_LE + b"a\0", "utf-16-le"),
        (codecs.BOM_UTF32_LE + b"a\0\0\0", "utf-32-le"),
        ("<a/>".encode("utf-16-be"), "utf-16-be"),
        (b"<?xml version='1.0' encoding='windows-1252'?><a/>", "windows-1252"),
        (b"<?xml version='1.0' encoding='UTF-16'?><a/>", "utf-8"),
        (b"<a encoding='latin-1'/>", "utf-8"),
    ],
)
def test_encoding_is_marked_or_visible_or_declared(data, name):
    assert encoding_of(data) == name


@pytest.mark.parametrize(
    ("name", "expected"),
    [("UTF8", "utf-8"), ("ISO-8859-1", "iso8859-1"), ("idna", None), ("hex", None), ("x" * 1000, None)],
)
def test_only_alphabets_are_codecs(name, expected):
    assert codec(name) == expected


def test_alphabets_have_the_names_that_python_gives_them():
    assert all(codecs.lookup(name).name == name for name in encoding._ALPHABETS)


def test_showing_never_fails():
    assert decode(b"<?xml version='1.0' encoding='idna'?>\xff") == "<?xml version='1.0' encoding='idna'?>\ufffd"
    assert decode(b"") == ""


class TestLines:
    lines = Lines("one\r\nzwei\n\nfour")

    @pytest.mark.parametrize(
        ("offset", "position"), [(0, (1, 1)), (4, (1, 5)), (5, (2, 1)), (10, (3, 1)), (14, (4, 4))]
    )
    def test_position_of_a_character(self, offset, position):
        assert self.lines.position(offset) == position

    @pytest.mark.parametrize(("number", "text"), [(0, ""), (1, "one"), (2, "zwei"), (3, ""), (4, "four"), (5, "")])
    def test_text_of_a_line(self, number, text):
        assert self.lines.line(number) == text
