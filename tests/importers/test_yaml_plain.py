"""Sources in the plain form give the tree that the events of libyaml give, to the last column; all others are left to these."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any, Final

import pytest
import yaml

import cqos_core as cqos
from cqos_core.importers import yaml_tree
from cqos_core.importers.reading import Reading
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, SequenceNode
from cqos_core.importers.yaml_plain import plain_tree
from cqos_core.importers.yaml_tree import Tree, _Composer, _RefusedError
from cqos_core.model.source import Source
from tests.benchmarks import inputs
from tests.effort import EXPLORE

ROOT: Final = Path(__file__).parents[2]
FILES: Final = sorted(
    {*ROOT.glob("examples/**/*.yaml"), *ROOT.glob("tests/**/*.yaml"), *ROOT.glob("plugins/*/tests/**/*.y*ml")}
)
DOCUMENTS: Final = 60_000 if EXPLORE else 1_500
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


def shown(node: Node) -> Any:
    """All that a tree has."""
    if isinstance(node, ScalarNode):
        return node.text, node.line, node.column, node.plain
    if isinstance(node, SequenceNode):
        return node.line, node.column, [shown(each) for each in node.items]
    entries = [(name, shown(key), shown(value)) for name, (key, value) in node.entries.items()]
    return node.line, node.column, node.end, node.repeated, entries


def of_events(data: bytes) -> Tree | None:
    """What libyaml reads; None where anything is wrong."""
    reading = Reading(Source("x.yaml", data), [], [])
    composer = _Composer(reading)
    try:
        composer.compose(yaml.CSafeLoader(data).get_event)
    except (yaml.YAMLError, _RefusedError):
        return None
    return None if reading.problems else composer.tree


def is_plain_and_same(data: bytes) -> bool:
    """Whether a source is in the plain form, and then gives the same tree."""
    root = plain_tree(data)
    if root is None:
        return False
    tree = of_events(data)
    assert tree is not None, data
    assert (len(tree.documents), tree.templates, tree.glued) == (1, [], []), data
    assert shown(root) == shown(tree.documents[0]), data
    return True


def test_files_of_the_project():
    assert sum([is_plain_and_same(file.read_bytes()) for file in FILES]) > 100


@pytest.mark.explored
def test_random_documents():
    random = Random(7)  # noqa: S311 - no secrets
    plain = 0
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
        plain += is_plain_and_same((text.rstrip("\n") if number % 5 == 0 else text).encode())
    assert plain > DOCUMENTS / 20


@pytest.mark.parametrize(
    "text",
    [
        "a: b\n---\nc: d\n",
        "a: ${x}\n",
        "a: b\na: c\n",
        "a:\n- b\n",
        "a: {b: 1, b: 2}\n",
        "a: {b: %}\n",
        "a: [b, ]c]\n",
        "a\n",
        "",
        "# c\n",
    ],
)
def test_what_is_left_to_the_events(text):
    assert plain_tree(text.encode()) is None


def test_a_system_is_the_same_either_way(monkeypatch):
    data = b"".join(inputs.system_file(400))
    assert isinstance(plain_tree(data), MappingNode)
    found = cqos.read(data)
    monkeypatch.setattr(yaml_tree, "plain_tree", lambda _: None)
    assert cqos.read(data) == found


def test_a_long_line_is_read():
    wide = b"a: {" + b", ".join(b"k%d: v w" % each for each in range(100_000)) + b"}\n"
    assert plain_tree(wide) is not None
    assert plain_tree(wide[:-2] + b"%}\n") is None
