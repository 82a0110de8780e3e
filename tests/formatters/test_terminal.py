"""Text that is safe to print and whose width is known."""

import pytest

from cqos_core.formatters.terminal import cells, clean, wrap


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain text", "plain text"),
        ("Größe 天気 שלום 🚜", "Größe 天気 שלום 🚜"),
        ("\x1b[31mred\x1b[0m", "\\x1b[31mred\\x1b[0m"),
        ("\x9b31m", "\\x9b31m"),
        ("a\nb\r\tc\0", "a\\nb\\r\\tc\\x00"),
        ("a\u202eb\u2066c\u200f", "a\\u202eb\\u2066c\\u200f"),
        ("a\u2028b\xa0c", "a\\u2028b\\xa0c"),
        ("\ud800", "\\ud800"),
        ("👩\u200d🚀 \u0645\u06cc\u200c\u062e", "👩\u200d🚀 \u0645\u06cc\u200c\u062e"),
    ],
)
def test_clean(text, expected):
    assert clean(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", 0),
        ("abc", 3),
        ("äöü", 3),
        ("e\u0301", 1),
        ("天気", 4),
        ("🚜", 2),
        ("ｱ", 1),
        ("\uff21", 2),
        ("\u200d", 0),
    ],
)
def test_cells(text, expected):
    assert cells(text) == expected


def test_wrap_counts_cells():
    assert wrap("天気 " * 12, 40) == [" ".join(["天気"] * 8), " ".join(["天気"] * 4)]


def test_wrap_leaves_long_words_whole():
    assert wrap(f"a {'b' * 60} c", 40) == ["a", "b" * 60, "c"]


def test_wrap_fills_lines_to_the_last_cell():
    assert wrap(f"{'a' * 20} {'b' * 19} c", 40) == [f"{'a' * 20} {'b' * 19}", "c"]


def test_wrap_of_nothing_is_an_empty_line():
    assert wrap("", 80) == [""]
