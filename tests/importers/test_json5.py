"""JSON5 to trees with places: what it allows beyond JSON, and what is wrong with what is none."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import MappingNode, ScalarNode, flow_text
from cqos_core.model.source import Source
from cqos_core.packs.document_importer import only_document


def tree(data):
    """Return the documents in flow form, and the problems."""
    reading = SourceReading(Source("x.json5", data if isinstance(data, bytes) else data.encode()), [], [])
    root = only_document(reading, json5=True)
    return [] if root is None else [flow_text(root)], [str(each) for each in reading.problems]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{a: 1, 'b': \"c\"}", "{a: 1, b: c}"),
        ("{plugins:{ros2dds:{domain:1}}}", "{plugins: {ros2dds: {domain: 1}}}"),
        ("[1, 2,]", "[1, 2]"),
        ("{a: [], b: {},}", "{a: [], b: {}}"),
        ("// c\n{/* d */ a /* e */ : /**/ 1 // f\n}", "{a: 1}"),
        ("[+1, .5, 5., 0x1F, 1e3, true, null]", "[+1, .5, 5., 0x1F, 1e3, true, null]"),
        (
            r"""['it\'s', "a\"b", 'tab\there', '\x41\u0042', 'one \
line']""",
            """["it's", "a\\"b", "tab\\there", AB, one line]""",
        ),
        (r"['\ud83d\ude00']", '["😀"]'),
        ("{$x_1: 1, ünder: 2}", '{$x_1: 1, "ünder": 2}'),
        ("{'1': 'a//b', b: '/* c */'}", '{"1": a//b, b: /* c */}'),
        ("\ufeff{a: 1}", "{a: 1}"),
    ],
)
def test_what_json5_allows(text, expected):
    assert tree(text) == ([expected], [])


def test_places_are_those_of_the_text():
    reading = SourceReading(Source("x.json5", b"{\n  // none\n  a: {\n    'b c': 'd', /* x */ e: 2 },\n}"), [], [])
    root = only_document(reading, json5=True)
    assert isinstance(root, MappingNode)
    key, inner = root.entries["a"]
    assert (key.line, key.column, inner.line, inner.column) == (3, 3, 3, 6)
    assert isinstance(inner, MappingNode)
    places = [(key.line, key.column, value.line, value.column) for key, value in inner.entries.values()]
    assert places == [(4, 5, 4, 12), (4, 25, 4, 28)]
    value = inner.entries["e"][1]
    assert isinstance(value, ScalarNode)
    assert value.plain


@pytest.mark.parametrize(
    ("text", "place", "why"),
    [
        ("", "1:1", "a value is expected here"),
        ("{a: 1 b: 2}", "1:6", "a comma or `}` is expected here"),
        ("{a 1}", "1:4", "a colon is expected between key and value"),
        ("{,}", "1:2", "a key is expected here: a name, or text in quotes"),
        ("{a: 1,,}", "1:7", "one comma too many"),
        ("{1a: 2}", "1:2", "a key is expected here"),
        ("[tru]", "1:2", "a value is expected here"),
        ("[01]", "1:2", "a value is expected here"),
        ("{\n a: 'x\n'}", "2:5", "the text that begins here does not end on its line"),
        ("{a: 'x", "1:5", "the text that begins here does not end on its line"),
        (r"['\1']", "1:3", "an escape of JSON5 is expected after the backslash"),
        (r"['\u12']", "1:3", "an escape of JSON5 is expected after the backslash"),
        (r"['\ud83d']", "1:2", "half a surrogate pair is no character"),
        ("{a: 1} /* b", "1:8", "the comment that begins here does not end"),
        ("{a: 1}}", "1:7", "something follows after the end of the document"),
        ("{a: 1", "1:1", "`{` of line 1, column 1 is not closed"),
        (b"{a: '\xff'}", "1:1", "its bytes are not utf-8"),
    ],
)
def test_malformed_json5_is_a_problem_with_its_place(text, place, why):
    documents, (problem,) = tree(text)
    assert documents == []
    assert problem.startswith(f"x.json5:{place}: this is not JSON5: {why}")


def test_what_holds_for_every_tree_holds_for_this_one():
    assert tree("{a: 1, a: 2}")[1] == [
        "x.json5:1:8: key `a` stands twice in one map, first on line 1, column 2 (keep `a: 1` or `a: 2`)"
    ]
    assert tree("[" * 100)[1] == ["x.json5:1:65: lists and maps are nested deeper than 64 here, which is refused"]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(st.characters(exclude_categories=["Cs"])),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text("abc", min_size=1), inner, max_size=3),
    max_leaves=8,
)


@given(JSON, st.booleans())
def test_json_is_json5(value, ascii_only):
    text = json.dumps(value, ensure_ascii=ascii_only, indent=2)
    reading = SourceReading(Source("x.json", text.encode()), [], [])
    only_document(reading, json5=True)
    assert value is None or reading.problems == []


@given(st.binary(max_size=60) | st.text("{}[]:,'\"\\/*\n\tab1", max_size=40).map(str.encode))
def test_whatever_is_read_is_a_tree_or_a_located_problem(data):
    reading = SourceReading(Source("x.json5", data), [], [])
    assert (only_document(reading, json5=True) is None) == bool(reading.problems)
    assert all(problem.place is not None and problem.place.line for problem in reading.problems)
