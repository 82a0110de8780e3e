"""XML from strangers ends in a clear error, quickly and in bounded memory."""

import time
import tracemalloc

import pytest

import cqos_core as cqos
from cqos_core import InputError
from cqos_core.model.source import ReadContext, Source
from cqos_dds.importers import dds_xml, fastdds_xml

READERS = {"dds_xml": dds_xml.read, "fastdds_xml": fastdds_xml.read}
LAUGHS = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 30))
GOOD = (
    '<dds><qos_library name="L"><qos_profile name="P"><datawriter_qos><history><depth>2</depth></history></datawriter_qos>'
    "</qos_profile></qos_library></dds>"
)
MONSTERS: dict[str, tuple[str | bytes, str]] = {
    "an entity": ('<!DOCTYPE dds [<!ENTITY x SYSTEM "file:///etc/passwd">]><dds>&x;</dds>', "declares entities"),
    "a billion laughs": (f'<!DOCTYPE dds [<!ENTITY l0 "ha">{LAUGHS}]><dds>&l29;</dds>', "declares entities"),
    "an entity of parameters": ('<!DOCTYPE dds [<!ENTITY % x SYSTEM "http://h/x">%x;]><dds/>', "declares entities"),
    "an entity that is not declared": ("<dds>&who;</dds>", "not well-formed"),
    "too deep": ("<dds>" + "<a>" * 5000, "deeper than"),
    "too long a name": (f"<dds {'a' * 11_000_000}='1'/>", "refused"),
    "cut off": (GOOD[:100], "ends too early"),
    "nothing": ("", "empty"),
    "nothing but blanks": (" \n ", "empty"),
    "no XML": ("reliability: reliable", "this is not XML"),
    "a page": ("<!DOCTYPE html><html></html>", "HTML page"),
    "a prefix that is not declared": ("<a:dds/>", "which is not declared"),
    "another encoding than it says": (
        '<?xml version="1.0" encoding="utf-8"?><dds>é</dds>'.encode("latin-1"),
        "are not utf-8",
    ),
    "an unknown encoding": ('<?xml version="1.0" encoding="klingon"?><dds/>', "is not known"),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("name", MONSTERS)
def test_what_no_real_file_has_is_refused_at_once(reader, name):
    text, expected = MONSTERS[name]
    data = text if isinstance(text, bytes) else text.encode()
    began = time.process_time()
    with pytest.raises(InputError) as refused:
        READERS[reader](Source("x.xml", data), ReadContext())
    assert time.process_time() - began < 2
    (problem,) = refused.value.problems
    assert expected in problem.message.lower() or expected in problem.message
    assert problem.place.source == "x.xml"
    assert len(problem.message) < 400


def test_a_document_type_that_names_a_file_is_not_looked_at(tmp_path):
    grammar = tmp_path / "dds.dtd"
    grammar.write_text('<!ENTITY x "y">')
    system = cqos.read(f'<!DOCTYPE dds SYSTEM "{grammar.as_uri()}">{GOOD}'.encode())
    assert "L::P" in system.profiles


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
def test_every_encoding_that_is_declared_can_be_read(encoding):
    declared = encoding if encoding == "latin-1" else encoding.removesuffix("-sig").removesuffix("-le")
    text = f'<?xml version="1.0" encoding="{declared}"?>' + GOOD.replace('"P"', '"Größe"')
    data = text.encode(encoding)
    system = cqos.read(b"\xff\xfe" + data if encoding == "utf-16-le" else data, importer="dds_xml")
    assert "L::Größe" in system.profiles


@pytest.mark.parametrize("length", range(1, len(GOOD), 17))
def test_wherever_it_is_cut_off_one_error_says_so(length):
    with pytest.raises(InputError) as refused:
        dds_xml.read(Source("x.xml", GOOD[:length].encode()), ReadContext())
    assert len(refused.value.problems) == 1


@pytest.mark.parametrize(
    "text",
    [
        '<dds><qos_library name="L"><qos_profile name="P">' + "<x/>" * 40_000 + "</qos_profile></qos_library></dds>",
        '<dds><qos_library name="L">'
        + "".join(f'<qos_profile name="P{n}" base_name="P{n + 1}"/>' for n in range(4000))
        + "</qos_library></dds>",
        '<dds><qos_library name="L"><qos_profile name="P">'
        + "".join(f'<datawriter_qos topic_filter="A{n}*"/>' for n in range(900))
        + "</qos_profile></qos_library></dds>",
        "<dds><domain_participant_library name='L'>"
        + "".join(f"<domain_participant name='P{n}' base_name='P{n + 1}'/>" for n in range(60))
        + "</domain_participant_library></dds>",
        "<dds><types>" + "<module name='m'>" * 200 + "</module>" * 200 + "</types></dds>",
    ],
    ids=["elements", "bases", "filters", "participants", "modules"],
)
def test_large_files_take_time_and_memory_in_proportion(text):
    tracemalloc.start()
    began = time.process_time()
    system = dds_xml.read(Source("x.xml", text.encode()), ReadContext())
    took = time.process_time() - began
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert system.sources
    assert took < 10
    assert peak < 200 * len(text) + 10_000_000


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            '<dds><qos_library name="L"><qos_profile name="P">'
            + "".join(f'<datawriter_qos topic_filter="A{n}"/>' for n in range(1001))
            + "</qos_profile></qos_library></dds>",
            "more than 1000 `datawriter_qos`",
        ),
        (
            '<dds><domain_participant_library name="L">'
            + "".join(f'<domain_participant name="P{n}" base_name="P{n + 1}"/>' for n in range(70))
            + "</domain_participant_library></dds>",
            "more than 64 bases",
        ),
    ],
    ids=["filters", "bases"],
)
def test_what_would_multiply_is_refused(text, expected):
    with pytest.raises(InputError) as refused:
        dds_xml.read(Source("x.xml", text.encode()), ReadContext())
    assert [problem.code for problem in refused.value.problems] == ["CQ002"]
    assert expected in refused.value.problems[0].message


def test_elements_of_thousands_of_names_are_not_all_listed():
    names = "".join(f"<extension_{n}/>" for n in range(3000))
    text = f'<dds><qos_library name="L"><qos_profile name="P"><datawriter_qos>{names}</datawriter_qos></qos_profile></qos_library></dds>'
    (note,) = dds_xml.read(Source("x.xml", text.encode()), ReadContext()).notes
    assert len(note.message) < 2000
    assert note.message.endswith("and 975 more")


def test_a_file_of_a_million_tags_is_refused_before_it_is_parsed():
    data = b"<dds>" + b"<x/>" * 1_000_000 + b"</dds>"
    began = time.process_time()
    with pytest.raises(InputError) as refused:
        dds_xml.read(Source("x.xml", data), ReadContext())
    assert time.process_time() - began < 0.5
    assert refused.value.problems[0].code == "CQ002"


def test_lines_are_counted_beyond_what_two_bytes_hold():
    text = GOOD.replace("<history>", "\n" * 70_000 + "<history>").replace(">2<", ">many<")
    with pytest.raises(InputError) as refused:
        dds_xml.read(Source("x.xml", text.encode()), ReadContext())
    assert refused.value.problems[0].place.line == 70_001
