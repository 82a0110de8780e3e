"""What a comment says changes nothing: neither what is read, nor where it stands, nor what is wrong with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from random import Random
from textwrap import indent
from typing import Any, Final

import pytest

import cqos_core as cqos
from tests.benchmarks import inputs
from tests.effort import EXPLORE

ROOT: Final = Path(__file__).parents[2]
FILES: Final = sorted({*ROOT.glob("examples/**/*.yaml"), *ROOT.glob("tests/**/*.yaml")})
PLAIN: Final = b"# a comment\n"
OTHER: Final = "# a comment with a letter that no name here has: é\n".encode()
DOCUMENTS: Final = 40_000 if EXPLORE else 600
LINES: Final = (
    *("{i}{k}: {v}\n", "{i}{k}:\n", "{i}{k}: {{{k}: {v}, {k}2: {v}}}\n", "{i}# c\n", "\n", "{i}{k}: [{v}, {v}]\n"),
    *(
        "{i}{k}:  {v}  # c\n",
        '{i}{k}: "{v}"\n',
        "{i}{k}: {{ }}\n",
        "{i}{k}: {{a: {{b: {v}}}, c: [{v}]}}\n",
        "{i}- {v}\n",
    ),
)
VALUES: Final = (
    "x",
    "1s",
    "a b",
    "/t",
    "null",
    "Null",
    "a-b",
    "a (b)",
    ".",
    "'q'",
    "a - b",
    "",
    "a:b",
    "-",
    "~",
    "a: b",
    "a #b",
)
PARTS: Final = (
    *(
        " ",
        "  ",
        "\n",
        "a",
        "b1",
        "/x",
        ":",
        ": ",
        "{",
        "}",
        "[",
        "]",
        ",",
        ", ",
        "#",
        " #",
        "'",
        '"',
        "-",
        "- ",
        ".",
        "...",
    ),
    *(
        "null",
        "~",
        "(",
        ")",
        "\t",
        "?",
        "|",
        "&a",
        "*a",
        "!",
        "%",
        "<<",
        "@",
        "`",
        "\r",
        "é",
        "\x7f",
        "---",
        "!!str ",
        "${x}",
    ),
)


def outcome(data: bytes) -> Any:
    """What is read, without the bytes; or what is wrong."""
    try:
        return replace(cqos.read(data, importer="yaml"), sources={})
    except cqos.InputError as error:
        return [str(each) for each in error.problems]


def assert_same(data: bytes) -> Any:
    found = outcome(PLAIN + data)
    assert found == outcome(OTHER + data), data
    return found


@pytest.mark.parametrize("part", range(4))
def test_files_of_the_project(part):
    for file in FILES[part::4]:
        assert_same(file.read_bytes())


@pytest.mark.explored
def test_random_settings():
    """Of a profile, which may state anything."""
    random = Random(7)  # noqa: S311 - no secrets
    read = 0
    for number in range(DOCUMENTS):
        most = len(VALUES) if number % 3 else 11
        lines = [
            random.choice(LINES).format(
                i=" " * random.choice((0, 0, 1, 2, 2, 4)), k=random.choice("abcdefgh"), v=random.choice(VALUES[:most])
            )
            for _ in range(random.randrange(1, 6))
        ]
        text = "".join(lines)
        if number % 4 == 0:
            at = random.randrange(len(text))
            text = text[:at] + random.choice(PARTS) + text[at + random.randrange(2) :]
        stated = f"cqos: 1\nprotocol: ros2\nprofiles:\n  p:\n{indent(text, '    ')}"
        read += isinstance(assert_same(stated.encode()), cqos.System)
    assert read > DOCUMENTS / 20


ODD: Final = {
    "a variable": "t: {depth: ${x}}",
    "a key twice": "t: {depth: 1}\nu:\nt: {depth: 2}",
    "a key twice in brackets": "t: {depth: 1, depth: 2}",
    "nothing": "t: {depth: null}\nu: ~",
    "nothing, quoted": "t: {depth: 'null'}\nu: 'null'",
    "a list below its key": "t:\n- {depth: 1}\n- {depth: 2}",
    "an odd letter": "t: {depth: %}",
    "brackets": "t: [x, ]y]",
    "comments between": "t: {depth: 1} # one\n\n# two\n\nu: {depth: 2}\n# three\nv: {depth: 3}",
    "a name alone": "t",
}


@pytest.mark.parametrize("text", ODD.values(), ids=ODD)
@pytest.mark.parametrize("before", ["", "s: {depth: 7, reliability: reliable}\n"])
def test_topics(text, before):
    topics = indent(before + text, "      ")
    assert_same(f"cqos: 1\nprotocol: ros2\nparticipants:\n  a:\n    publishes:\n{topics}\n".encode())


def test_a_large_file():
    assert_same(b"".join(inputs.system_file(1_200)))


def test_a_long_line():
    wide = b"cqos: 1\nprofiles: {p: {" + b", ".join(b"k%d: v w" % each for each in range(20_000)) + b"}}\n"
    assert len(assert_same(wide).profiles["p"].settings) == 20_000
    assert isinstance(assert_same(wide.replace(b"k7: v", b"k7: %")), list)
