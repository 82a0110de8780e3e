"""The located tree: scalars of YAML 1.2, flow text that is read back, bounds, JSON, and the parser without libyaml."""

import json

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import (
    MappingNode,
    ScalarNode,
    SequenceNode,
    flag,
    flow_text,
    kind_of,
    whole_number,
)
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.source import Source
from tests.growth.linear import assert_linear


def tree(data, name="f.yaml"):
    reading = SourceReading(Source(name, data if isinstance(data, bytes) else data.encode()), [], [])
    return read_tree(reading), [str(problem) for problem in reading.problems]


def root(data, name="f.yaml"):
    found, problems = tree(data, name)
    assert problems == []
    (node,) = found.documents
    return node


def plain(node):
    """The tree as Python values: texts for texts, and a pair for what a plain scalar stands for."""
    if isinstance(node, SequenceNode):
        return [plain(item) for item in node.items]
    if isinstance(node, MappingNode):
        return {name: plain(value) for name, (_, value) in node.entries.items()}
    kind = kind_of(node)
    return node.text if kind == "text" else None if kind == "null" else (kind, node.text)


class TestScalars:
    @pytest.mark.parametrize(
        ("written", "kind"),
        [
            *((word, "null") for word in ("~", "null", "Null", "NULL")),
            *((word, "flag") for word in ("true", "True", "TRUE", "false", "False", "FALSE")),
            *((word, "number") for word in ("0", "-7", "+7", "007", "0o17", "0x1F", "1.5", ".5", "1.", "1e3", "-.inf")),
            *((word, "number") for word in (".nan", ".NaN", ".INF", "+.inf", "1E-3")),
            *((word, "text") for word in ("yes", "no", "on", "off", "y", "n", "nULL", "tRue", "1:30", "190:20:30")),
            *((word, "text") for word in ("2027-01-01", "1_000", "0b1", "0O17", "-0x1", ".", "+", "e3", "=")),
            *((word, "text") for word in ('"1"', "'true'", "!!str 1", "! null", '""')),
        ],
    )
    def test_core_schema(self, written, kind):
        node = root(f"[{written}]").items[0]
        assert kind_of(node) == kind

    @pytest.mark.parametrize(("written", "value"), [("0o17", 15), ("0x1F", 31), ("-7", -7), ("007", 7), ("+1", 1)])
    def test_whole_numbers(self, written, value):
        assert whole_number(root(written)) == value

    @pytest.mark.parametrize("written", ["1.0", '"1"', "one", "1_0", "9" * 5000])
    def test_what_is_no_whole_number(self, written):
        assert whole_number(root(written)) is None

    @pytest.mark.parametrize(("written", "value"), [("true", True), ("FALSE", False), ("yes", None), ('"true"', None)])
    def test_flags(self, written, value):
        assert flag(root(written)) is value

    def test_places_count_characters_from_one(self):
        mapping = root('a: "😀"\nünï: [x,\n  y]\n')
        (key, value) = mapping.entries["ünï"]
        assert (key.line, key.column, value.line, value.column) == (2, 1, 2, 6)
        assert [(item.line, item.column) for item in value.items] == [(2, 7), (3, 3)]

    def test_empty_documents_are_left_out(self):
        assert tree("# nothing\n---\n---\n~\n...\n")[0].documents == []


texts = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), max_size=12) | st.sampled_from(
    [
        "",
        "null",
        "true",
        "1",
        "-1",
        "a: b",
        "a #b",
        "a, b",
        "- x",
        "? y",
        "<<",
        "*",
        "&a",
        "!t",
        "#",
        "x ",
        "'",
        '"',
        "\\",
        "~",
    ]
)
scalars = st.builds(lambda text: ScalarNode(text, 1, 1, plain=False), texts) | st.builds(
    lambda text: ScalarNode(text, 1, 1, plain=True),
    st.sampled_from(["1", "-2.5", "true", "null", "~", "", ".inf", "0o7"]),
)


def collections(children):
    def mapping(entries):
        node = MappingNode(1, 1)
        node.entries = {text: (ScalarNode(text, 1, 1, plain=False), value) for text, value in entries.items()}
        return node

    long = st.text("k", min_size=900, max_size=1100)
    keys = texts.filter(bool) | long
    return st.lists(children, max_size=4).map(lambda items: SequenceNode(1, 1, items)) | st.dictionaries(
        keys, children, max_size=4
    ).map(mapping)


class TestFlowText:
    @given(st.recursive(scalars, collections, max_leaves=12).filter(lambda node: not isinstance(node, ScalarNode)))
    def test_is_one_line_that_is_read_back_as_the_same_value(self, node):
        text = flow_text(node)
        assert len(text.splitlines()) == 1
        assert plain(root(text)) == plain(node)
        assert plain(root(f"key: {text}\n").entries["key"][1]) == plain(node)

    @pytest.mark.parametrize(
        "text",
        [
            "[a, b]",
            "[]",
            "{}",
            "{sec: 2, nsec: 0}",
            '[1, "1", "a, b", null]',
            '{a b: [/x/y, "#", "é"]}',
            "[-1, ~, .inf]",
        ],
    )
    def test_keeps_what_is_already_in_that_form(self, text):
        assert flow_text(root(text)) == text

    def test_a_scalar_alone_is_bare(self):
        assert flow_text(root('"a: b # c"')) == "a: b # c"


class TestAliases:
    def test_repeat_and_merge(self):
        found = root("a: &a {x: 1, y: 2}\nb: *a\nc: {<<: *a, y: 3}\nd: {<<: [{y: 4}, *a], z: 5}")
        assert plain(found) == {
            "a": {"x": ("number", "1"), "y": ("number", "2")},
            "b": {"x": ("number", "1"), "y": ("number", "2")},
            "c": {"y": ("number", "3"), "x": ("number", "1")},
            "d": {"z": ("number", "5"), "y": ("number", "4"), "x": ("number", "1")},
        }

    def test_an_anchor_can_be_used_again(self):
        assert plain(root("[&a x, *a, &a y, *a]")) == ["x", "x", "y", "y"]

    def test_anchors_end_with_their_document(self):
        assert "anchor `&a`" in tree("a: &a x\n---\nb: *a\n")[1][0]

    def test_a_quoted_merge_key_is_a_key(self):
        assert plain(root('{"<<": x}')) == {"<<": "x"}

    def test_several_merge_keys_are_refused(self):
        assert "`<<: [*first, *second]`" in tree("a: &a {}\nb: {<<: *a, <<: *a}")[1][0]

    @pytest.mark.parametrize("text", ["a: &a {b: *a}", "a: &a [[*a]]", "a: &a {<<: *a}"])
    def test_recursion_is_refused(self, text):
        assert "which it repeats" in tree(text)[1][0]

    def test_what_aliases_repeat_is_bounded_in_values_and_in_characters(self):
        laughs = "a0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 40))
        shouts = f"a: &a {'x' * 100_000}\nb: [{', '.join(['*a'] * 200)}]"
        merges = "a: &a {x: 1}\n" + "".join(f"b{n}: &b{n} {{<<: [*a, *a], c: [{'*a, ' * 9}]}}\n" for n in range(9))
        for bomb in (laughs, shouts):
            assert "aliases repeat more" in tree(bomb)[1][0]
        assert tree(merges)[1] == []

    def test_depth_by_aliases_is_bounded(self):
        chain = "a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}]\n" for n in range(1, 100))
        assert "aliases nest lists and maps deeper than 64" in tree(chain)[1][0]
        tree("a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}]\n" for n in range(1, 60)))


class TestBounds:
    @pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "? ", '{"a":', "[["])
    def test_endless_nesting_is_refused_in_linear_time(self, opening):
        def refused(size: int) -> None:
            (problem,) = tree(opening * size)[1]
            assert "deeper than 64" in problem

        assert_linear(refused, 250_000)

    def test_as_deep_as_allowed(self):
        assert tree("[" * 64 + "]" * 64)[1] == []
        assert "deeper" in tree("[" * 65 + "]" * 65)[1][0]

    @pytest.mark.parametrize(
        "data",
        [
            b"a" * 5_000_000,
            b"a: " + b"'" * 5_000_000,
            b"# " * 3_000_000,
            b"\n" * 5_000_000,
        ],
        ids=["word", "quotes", "comment", "lines"],
    )
    def test_large_nonsense_ends(self, data):
        tree(data)


class TestJson:
    @pytest.mark.parametrize(
        "text",
        [
            '{"a": "\\ud83d\\ude80\\u00e9\\n\\/"}',
            '\t{"a":\t1}\t\n',
            '{"a"\n:\n1}',
            '{"' + "k" * 3000 + '": [1, -2.5e3, true, false, null, {}, [], "x"]}',
            '{"\x7f": "\x80"}',
            ' {"a": {"b": [[1, 2], {"c": "d"}]}}',
        ],
    )
    def test_json_that_yaml_refuses_is_read(self, text):
        def numbers(pairs):
            return dict(pairs)

        expected = json.loads(
            text,
            object_pairs_hook=numbers,
            parse_int=lambda number: ("number", number),
            parse_float=lambda number: ("number", number),
        )
        assert plain(root(text)) == replaced_flags(expected)

    @given(
        st.recursive(
            st.none() | st.text(max_size=8),
            lambda inner: (
                st.lists(inner, max_size=3) | st.dictionaries(st.text(min_size=1, max_size=8), inner, max_size=3)
            ),
            max_leaves=10,
        ),
        st.sampled_from(["\t", "  ", None]),
        st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    )
    def test_any_json_is_read(self, value, indent, encoding):
        text = json.dumps({"root": value}, indent=indent)
        assert plain(root(text.encode(encoding))) == {"root": value}

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ('{"a": 1,}\t\t@', ":1:8: this is not JSON: a comma stands before `}`"),
            ('{"a": \t@}', ":1:8: this is not JSON: a value is expected here"),
            ('{"a"\n1}', ":2:1: this is not JSON: a colon is expected between key and value"),
            ('{"a": ["x"\n\n2]}', ":1:11: this is not JSON: a comma or `]` is expected here"),
            ('{"a": 1}}', ":1:9: this is not JSON: something follows after the end of the document"),
            ('{"a": "\\ud83d"}', ":1:7: this is not JSON: half a surrogate pair is no character"),
            ('{"a": "x\n"}\t@', ":1:9: this is not JSON: invalid control character"),
            ('{"a": 1.2.3}@', ":1:7: this is not JSON: a value is expected here"),
            ('{"a"', ":1:5: this is not JSON: a colon is expected"),
            ('{"a": "b', ":1:7: this is not JSON: unterminated string"),
            ("{", ":1:2: this is not JSON: a key in double quotes"),
        ],
    )
    def test_faults_in_json_files_are_explained_as_json(self, text, message):
        found, (problem,) = tree(text, "f.json")
        assert message in problem
        assert found.documents == []

    def test_bytes_that_are_no_text(self):
        assert "its bytes are not utf-8" in tree(b'{"a": "\xff"}', "f.json")[1][0]

    def test_faults_in_yaml_files_are_explained_as_yaml(self):
        assert "this is not YAML" in tree('{"a": 1')[1][0]

    def test_problems_are_reported_once(self):
        assert tree('{"a": 1, "a": 2, "b": "\\ud83d\\ude80"}')[1] == [
            "f.yaml:1:10: key `a` stands twice in one map, first on line 1, column 2 (keep `a: 1` or `a: 2`)"
        ]

    def test_problems_before_a_fault_are_kept(self):
        assert [problem.split(" (")[0] for problem in tree('{"a": 1, "a": 2}\n---\n{"b": 1')[1]] == [
            "f.yaml:1:10: key `a` stands twice in one map, first on line 1, column 2",
            "f.yaml:3:1: this is not YAML: `{` of line 3, column 1, is not closed",
        ]

    def test_deep_json_is_refused(self):
        assert "deeper than 64" in tree("\t" + '{"a":' * 1_000_000, "f.json")[1][0]


def replaced_flags(value):
    if isinstance(value, bool):
        return ("flag", str(value).lower())
    if isinstance(value, dict):
        return {name: replaced_flags(item) for name, item in value.items()}
    return [replaced_flags(item) for item in value] if isinstance(value, list) else value


class TestWithoutLibyaml:
    """PyYAML can be installed without the C parser; then the pure one reads the same, only slower."""

    @pytest.fixture(autouse=True)
    def _pure(self, monkeypatch):
        monkeypatch.delattr(yaml, "CSafeLoader")

    def test_the_same_tree(self):
        text = "a: &x [1, 'b', {c: !!str d}]\ne: *x\n? f\n: |\n  g\n  h\n"
        assert plain(root(text)) == {
            "a": [("number", "1"), "b", {"c": "d"}],
            "e": [("number", "1"), "b", {"c": "d"}],
            "f": "g\nh\n",
        }

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("a: *", "f.yaml:1:4: this is not YAML: * begins the name of an anchor"),
            ("a: @x", "f.yaml:1:4: this is not YAML: no value begins with @"),
            ("a:\n\tb: c", "f.yaml:2:1: this is not YAML: a tab in the indentation"),
            ("a: [1, 2", "f.yaml:1:4: this is not YAML: the list or map that begins on line 1"),
            ("a: \x01", "f.yaml:1:4: the control character U+0001"),
            (b"a: \xff", "f.yaml:1:4: the bytes here are no text"),
            ("[" * 100_000, "deeper than 64"),
        ],
    )
    def test_the_same_faults(self, text, message):
        assert message in tree(text)[1][0]
