"""Every key and value of a tree has the text, the place and the quotes that PyYAML's own composer gives it, maps of texts too."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any, Final

import pytest
import yaml

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import MappingNode, Node, ScalarNode, TextMap, walk
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.source import Source
from tests.effort import EXPLORE

ROOT: Final = Path(__file__).parents[2]
FILES: Final = sorted(
    {*ROOT.glob("examples/**/*.yaml"), *ROOT.glob("tests/**/*.yaml"), *ROOT.glob("plugins/*/tests/**/*.y*ml")}
)
DOCUMENTS: Final = 60_000 if EXPLORE else 1_500
LINES: Final = (
    *("{i}{k}: {v}\n", "{i}{k}:\n", "{i}{k}: {{{k}: {v}, {k}2: {v}}}\n", "{i}# c\n", "\n", "{i}{k}: [{v}, {v}]\n"),
    *("{i}{k}:  {v}  # c\n", '{i}"{k}": "{v}"\n', "{i}{k}: {{ }}\n", "{i}{k}: {{a: {{b: {v}}}, c: [{v}]}}\n"),
    *("{i}- {v}\n", "{i}{k}: {{{k}: {v},\n   {k}2:\n {v}}}\n", "{i}- {k}: {v}\n{i}  z: {v}\n", "{i}? {k}\n{i}: {v}\n"),
    *("{i}{k}: {v}\n{i}  {v}\n", "{i}{k}: |\n{i}  {v}\n"),
)
WORDS: Final = ("x", "1s", "a b", "/t", "null", "Null", "a-b", "a (b)", ".", "'q'", "a - b")
OTHERS: Final = ("", "a:b", "-", "~", "a: b", "a #b", "!!str 1", "&a x", "ä", "(", "${x}", "\\", "%")


def of_tree(node: Node) -> Any:
    """All that a node has."""
    if isinstance(node, ScalarNode):
        return node.text, node.line, node.column, node.plain
    if isinstance(node, MappingNode):
        entries = [(of_tree(key), of_tree(value)) for key, value in node.entries.values()]
        return node.line, node.column, node.end, entries
    return node.line, node.column, [of_tree(each) for each in node.items]


def of_composer(node: yaml.Node) -> Any:
    """The same of a node of PyYAML."""
    line, column = node.start_mark.line + 1, node.start_mark.column + 1
    if isinstance(node, yaml.ScalarNode):
        return node.value, line, column, not node.style
    if isinstance(node, yaml.MappingNode):
        entries = [(of_composer(key), of_composer(value)) for key, value in node.value]
        return line, column, node.end_mark.line + 1, entries
    return line, column, [of_composer(each) for each in node.value]


def maps_of_texts(data: bytes) -> int:
    """Compare a source with what PyYAML makes of it, unless its own rules refuse it; return how many maps of texts it has."""
    if any(mark in data for mark in (b"!!", b"<<", b": *", b"- *")) or data.count(b"&a") > 1:
        return (
            0  # tags, merges and aliases, which a tree has in place no longer; and what only PyYAML's composer refuses
        )
    reading = SourceReading(Source("x.yaml", data), [], [])
    tree = read_tree(reading)
    if reading.problems:
        return 0
    found = sum(isinstance(node, TextMap) for node in walk(tree.documents))
    whole = yaml.compose_all(data, Loader=yaml.CSafeLoader)
    stated = [of_composer(node) for node in whole if not (isinstance(node, yaml.ScalarNode) and node.value == "")]
    assert [of_tree(root) for root in tree.documents] == [each for each in stated if each[0] not in {"null", "Null"}]
    return found


def texts(data: bytes) -> list[Any]:
    """All that a tree has, but for empty values."""
    nodes = walk(read_tree(SourceReading(Source("x.yaml", data), [], [])).documents)
    return [
        of_tree(node) for node in nodes if isinstance(node, TextMap) or (isinstance(node, ScalarNode) and node.text)
    ]


@pytest.mark.skipif(not hasattr(yaml, "CSafeLoader"), reason="PyYAML is installed without libyaml")
def test_files_of_the_project():
    assert sum([maps_of_texts(file.read_bytes()) for file in FILES]) > 500


def test_the_parser_without_libyaml_finds_the_same_texts(monkeypatch):
    """Where an empty value stands, the two parsers say otherwise."""
    sources = [file.read_bytes() for file in FILES[::10]]
    found = [*map(texts, sources)]
    monkeypatch.delattr(yaml, "CSafeLoader", raising=False)
    assert [*map(texts, sources)] == found


@pytest.mark.explored
@pytest.mark.skipif(not hasattr(yaml, "CSafeLoader"), reason="PyYAML is installed without libyaml")
def test_random_documents():
    random = Random(7)  # noqa: S311 - no secrets
    found = 0
    for number in range(DOCUMENTS):
        values = WORDS if number % 3 else (*WORDS, *OTHERS)
        lines = [
            random.choice(LINES).format(
                i=" " * random.choice((0, 0, 1, 2, 2, 4)), k=random.choice("abcdefgh"), v=random.choice(values)
            )
            for _ in range(random.randrange(1, 6))
        ]
        text = "".join(lines)
        found += maps_of_texts((text.rstrip("\n") if number % 5 == 0 else text).encode())
    assert found > DOCUMENTS / 10
