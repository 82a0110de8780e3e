"""Exact places, and the words that are shown and underlined there."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from cqos_core.bpmn import read
from cqos_core.model.excerpt import Excerpt, exact, span
from cqos_core.model.settings import Place
from cqos_core.model.source import ReadContext, Source

CASES = Path(__file__).parent / "importers" / "cases" / "bpmn"
EXAMPLES = Path(__file__).parents[1] / "examples"
BINDINGS = 'xmlns:bpmn="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos"'


def underlined(place: Place, data: bytes | str) -> str | None:
    """Return the words that `span` underlines."""
    data = data.encode() if isinstance(data, str) else data
    excerpt = span(place, {place.source: data})
    return None if excerpt is None else excerpt.text[excerpt.column - 1 :][: excerpt.width]


def xml_place(line: int, element: str | None = "E", path: str | None = "@qos:depth") -> Place:
    return Place("f.bpmn", line, None, element, path)


def found(place: Place, data: bytes | str) -> tuple[int | None, int | None]:
    data = data.encode() if isinstance(data, str) else data
    place = exact([place], {"f.bpmn": data})[place]
    return place.line, place.column


class TestExactInXml:
    def test_attribute_on_the_fourth_line_of_its_tag(self):
        data = f'<d {BINDINGS}>\n<e id="E"\n  qos:a="1"\n  qos:b="2"\n  qos:depth="3"\n/></d>'
        assert found(xml_place(6), data) == (5, 3)
        assert underlined(xml_place(6), data) == 'qos:depth="3"'

    def test_tag_where_no_attribute_is_named(self):
        data = f'<d {BINDINGS}>\n  <bpmn:endEvent\n id="E"/></d>'
        assert found(xml_place(3, path=None), data) == (2, 3)
        assert underlined(xml_place(3, path=None), data) == "<bpmn:endEvent"

    def test_tag_where_the_attribute_is_missing(self):
        data = f'<d {BINDINGS}>\n<e id="E"><qos:accept/></e></d>'
        assert underlined(xml_place(2, path="qos:accept[1]/@rule"), data) == "<qos:accept"

    @pytest.mark.parametrize(
        "before",
        [
            '<!-- <e id="E" qos:depth="0"/> -->',
            '<![CDATA[<e id="E" qos:depth="0"/>]]>',
            '<?pi <e id="E" qos:depth="0"/> ?>',
            '<e name="> id=&quot;E&quot;"/>',
            '<e name=\' id="E" qos:depth="0"\'/>',
        ],
    )
    def test_what_only_looks_like_the_tag_is_passed_over(self, before):
        data = f'<d {BINDINGS}>{before}\n<e id="E" qos:depth="1"/></d>'
        assert found(xml_place(2), data) == (2, 11)

    def test_greater_than_in_an_attribute_before(self):
        data = f"<d {BINDINGS}>\n<e id='E' name='a > b' qos:depth='1'/></d>"
        assert underlined(xml_place(2), data) == "qos:depth='1'"

    @pytest.mark.parametrize("codec", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
    def test_columns_count_characters(self, codec):
        declared = "ISO-8859-1" if codec == "latin-1" else codec[:6].rstrip("-")
        data = f'<?xml version="1.0" encoding="{declared}"?><d {BINDINGS}>\n<e id="E" name="Höhe" qos:depth="1"/></d>'
        assert found(xml_place(2), data.encode(codec)) == (2, 23)
        assert underlined(xml_place(2), data.encode(codec)) == 'qos:depth="1"'

    def test_a_tab_counts_as_one(self):
        assert found(xml_place(2), f'<d {BINDINGS}>\n\t<e id="E"\tqos:depth="1"/></d>') == (2, 12)

    def test_line_breaks_of_windows(self):
        data = f'<d {BINDINGS}>\r\n<e id="E"\r\n qos:depth="1"/>\r\n</d>'
        assert found(xml_place(3), data) == (3, 2)
        assert span(xml_place(3), {"f.bpmn": data.encode()}) == Excerpt(3, ' qos:depth="1"/>', 2, 13)

    def test_the_line_tells_equal_ids_apart(self):
        data = f'<d {BINDINGS}>\n<e id="E" qos:depth="1"/>\n<e id="E" name="x" qos:depth="2"/></d>'
        assert found(xml_place(2), data) == (2, 11)
        assert found(xml_place(3), data) == (3, 20)

    def test_the_line_tells_elements_without_id_apart(self):
        data = f'<d {BINDINGS}>\n<e qos:depth="1"/>\n<e name="x" qos:depth="2"/></d>'
        assert found(xml_place(3, element=None), data) == (3, 13)

    def test_everything_in_one_line(self):
        event = '<e id="E{}"><qos:policy depth="1"/><qos:policy depth="2"/></e>'
        data = f"<d {BINDINGS}>{event.format(1)}{event.format(2)}</d>"
        second = data.index('depth="2"', data.index("E2")) + 1
        assert found(xml_place(1, "E2", "qos:policy[2]/@depth"), data) == (1, second)

    def test_prefixes_of_the_document_count_not_ours(self):
        data = (CASES / "several_prefixes.bpmn").read_bytes()
        setting = read(Source("f.bpmn", data), ReadContext()).endpoints[0].settings["reliability"]
        assert setting.place is not None
        assert underlined(setting.place, data) == 'q:reliability="best_effort"'

    def test_ids_are_compared_as_a_parser_reads_them(self):
        data = f'<d {BINDINGS}>\n<e id="a&amp;b&#x20;c" qos:depth="1"/></d>'
        assert underlined(xml_place(2, "a&b c"), data) == 'qos:depth="1"'

    def test_beyond_the_lines_that_libxml2_counts(self):
        data = f"<d {BINDINGS}>" + "\n" * 70_000 + '<e id="E" qos:depth="1"/></d>'
        assert found(xml_place(65_535), data) == (70_001, 11)

    def test_what_is_not_found_stays_as_it_is(self):
        place = xml_place(1, "Gone")
        assert exact([place], {"f.bpmn": f"<d {BINDINGS}/>".encode()}) == {place: place}

    @pytest.mark.parametrize(
        "place",
        [
            Place("other.bpmn", 1, None, "E"),
            Place("f.bpmn"),
            Place("f.bpmn", 1, 7, "E"),
            Place("f.bpmn", 1, None, "E"),
        ],
    )
    def test_places_that_need_or_allow_no_search(self, place):
        assert exact([place], {"f.bpmn": b"e: {id: E}"}) == {place: place}

    def test_a_source_is_read_once_for_many_places(self):
        events = "".join(f'<e id="E{n}" qos:depth="1"/>\n' for n in range(20_000))
        data = f"<d {BINDINGS}>\n{events}</d>".encode()
        places = [xml_place(n + 2, f"E{n}") for n in range(20_000)]
        start = time.process_time()
        assert all(place.column for place in exact(places, {"f.bpmn": data}).values())
        assert time.process_time() - start < 10

    @pytest.mark.parametrize("name", ["smart_agriculture.bpmn", "smart_agriculture_incompatible.bpmn"])
    def test_every_setting_of_the_examples(self, name):
        data = (EXAMPLES / name).read_bytes()
        for endpoint in read(Source(name, data), ReadContext()).endpoints:
            for word, setting in endpoint.settings.items():
                assert setting.place is not None
                assert underlined(setting.place, data) == f'qos:{word}="{setting.text}"'

    def test_every_setting_of_fame(self):
        data = (CASES / "fame.bpmn").read_bytes()
        for endpoint in read(Source("fame.bpmn", data), ReadContext()).endpoints:
            for word, setting in endpoint.settings.items():
                assert setting.place is not None
                assert underlined(setting.place, data) == f'{word}="{setting.text}"'

    def test_reference_to_a_signal_that_is_not_there(self):
        data = f"""<bpmn:definitions {BINDINGS}><bpmn:process id="P"><bpmn:endEvent id="E">
            <bpmn:signalEventDefinition/>
            <bpmn:signalEventDefinition signalRef="Gone"/></bpmn:endEvent></bpmn:process></bpmn:definitions>"""
        note = next(n for n in read(Source("f.bpmn", data.encode()), ReadContext()).notes if n.code == "CQ032")
        assert note.place is not None
        assert underlined(note.place, data) == 'signalRef="Gone"'


class TestSpanInXml:
    def test_a_fault_that_the_parser_found_is_one_character(self):
        assert underlined(Place("f.bpmn", 2, 3), "<a>\n<b&</a>") == "&"

    def test_a_fault_behind_the_end_of_the_line(self):
        assert span(Place("f.bpmn", 1, 99), {"f.bpmn": b"<a>"}) == Excerpt(1, "<a>", 4, 1)

    def test_attribute_that_goes_on_in_the_next_line(self):
        data = f'<d {BINDINGS}>\n<e id="E" qos:depth="1\n2"/></d>'
        assert underlined(xml_place(3), data) == 'qos:depth="1'

    def test_a_very_long_line_is_cut_around_the_place(self):
        data = f'<d {BINDINGS}>{"<x/>" * 1000}<e id="E" qos:depth="1"/>{"<x/>" * 1000}</d>'
        excerpt = span(xml_place(1), {"f.bpmn": data.encode()})
        assert excerpt is not None
        assert excerpt.text.startswith("…")
        assert excerpt.text.endswith("…")
        assert len(excerpt.text) < 250
        assert underlined(xml_place(1), data) == 'qos:depth="1"'


class TestSpanInYaml:
    @pytest.mark.parametrize(
        ("line", "column", "words"),
        [
            ("reliability: best_effort", 14, "best_effort"),
            ("reliability: best_effort  # why", 14, "best_effort"),
            ("reliability: best_effort", 1, "reliability"),
            ("name: 'a # b' # c", 7, "'a # b'"),
            ("name: 'it''s'", 7, "'it''s'"),
            (r'name: "a \" b" # c', 7, r'"a \" b"'),
            ("url: http://host:80/x # c", 6, "http://host:80/x"),
            ("note: a, b ] c", 7, "a, b ] c"),
            ("request: {depth: 1, deadline: 2s}", 18, "1"),
            ("request: {depth: 1, deadline: 2s}", 31, "2s"),
            ("request: {depth: 1, deadline: 2s}", 10, "{depth: 1, deadline: 2s}"),
            ("names: [a, 'b]', {c: d}] # e", 8, "[a, 'b]', {c: d}]"),
            ("names: [a,", 8, "[a,"),
            ("size: é  ", 7, "é"),
        ],
    )
    def test_underlines_the_whole_value(self, line, column, words):
        assert underlined(Place("f.yaml", 2, column), f"first: 1\n{line}\n") == words

    def test_without_a_column_the_line_is_underlined(self):
        assert underlined(Place("f.yaml", 2), "a:\n  - b: c\r\n") == "- b: c"

    @pytest.mark.parametrize("place", [Place("f.yaml"), Place("f.yaml", 9), Place("gone.yaml", 1)])
    def test_nothing_to_show(self, place):
        assert span(place, {"f.yaml": b"a: 1"}) is None

    def test_bytes_that_are_no_text_are_shown_all_the_same(self):
        assert underlined(Place("f.yaml", 1, 4), b"a: \xff\n") == "\ufffd"
