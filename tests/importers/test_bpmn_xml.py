"""The XML around a BPMN model: encodings and prefixes that are accepted, and errors that say what is wrong and where."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from cqos_core.bpmn import read
from cqos_core.importers.format_detection import claims_bpmn
from cqos_core.importers.xml_source import parse_xml
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.source import ReadContext, Source
from tests.growth.linear import assert_linear

if TYPE_CHECKING:
    from cqos_core.model.system import System

URI = "http://www.omg.org/spec/BPMN/20100524/MODEL"
BODY = """<signal id="S" name="Höhe"/>
<process id="P">
  <endEvent id="E"><signalEventDefinition signalRef="S"/></endEvent>
</process>"""
MODEL = f'<definitions xmlns="{URI}">\n{BODY}\n</definitions>'
BILLION_LAUGHS = """<?xml version="1.0"?>
<!DOCTYPE definitions [
 <!ENTITY a "haha">
 <!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
 <!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">
]>
"""


def read_bytes(data: bytes) -> System:
    return read(Source("model.bpmn", data), ReadContext())


def problem_of(data: bytes | str) -> Problem:
    """Return the one problem of an unreadable file; it always has code, line and column."""
    with pytest.raises(InputError) as caught:
        read_bytes(data.encode() if isinstance(data, str) else data)
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert problem.place.source == "model.bpmn"
    assert problem.place.line is not None
    return problem


def where(problem: Problem) -> tuple[int | None, int | None]:
    assert problem.place is not None
    return problem.place.line, problem.place.column


def topic_of(data: bytes) -> str | None:
    return read_bytes(data).endpoints[0].topic


class TestEncodings:
    @pytest.mark.parametrize(
        ("declared", "codec"),
        [
            ("UTF-8", "utf-8"),
            ("utf8", "utf-8"),
            ("UTF-8", "utf-8-sig"),
            ("UTF-16", "utf-16"),
            ("UTF-16", "utf-16-le"),
            ("UTF-16BE", "utf-16-be"),
            ("ISO-8859-1", "latin-1"),
            ("windows-1252", "cp1252"),
            ("ISO-8859-15", "iso8859-15"),
            ("GB18030", "gb18030"),
        ],
    )
    def test_as_declared(self, declared, codec):
        assert topic_of(f'<?xml version="1.0" encoding="{declared}"?>\n{MODEL}'.encode(codec)) == "Höhe"

    @pytest.mark.parametrize("codec", ["utf-8", "utf-8-sig", "utf-16"])
    def test_without_a_declaration(self, codec):
        assert topic_of(MODEL.encode(codec)) == "Höhe"

    def test_byte_order_mark_is_believed_before_the_declaration(self):
        assert topic_of(f'<?xml version="1.0" encoding="ISO-8859-1"?>{MODEL}'.encode("utf-8-sig")) == "Höhe"

    def test_utf_16_that_is_none_is_taken_for_utf_8(self):
        assert topic_of(f'<?xml version="1.0" encoding="utf-16"?>{MODEL}'.encode()) == "Höhe"

    def test_wrong_declaration_is_located(self):
        problem = problem_of(f'<?xml version="1.0" encoding="UTF-8"?>\n{MODEL}'.encode("cp1252"))
        assert (problem.code, *where(problem)) == ("CQ001", 3, 23)
        assert "`f6` are not UTF-8" in problem.message
        assert 'encoding="windows-1252"' in (problem.help or "")

    def test_utf_8_declared_as_ascii(self):
        problem = problem_of(f'<?xml version="1.0" encoding="US-ASCII"?>\n{MODEL}')
        assert (problem.code, *where(problem)) == ("CQ001", 3, 23)
        assert 'encoding="UTF-8"' in (problem.help or "")

    @pytest.mark.parametrize("name", ["klingon", "punycode", "utf-7", "unicode_escape", "hex"])
    def test_unknown_encodings_are_refused(self, name):
        problem = problem_of(f'<?xml version="1.0" encoding="{name}"?>{MODEL}')
        assert problem.code == "CQ001"
        assert f"`{name}`" in problem.message


class TestVariants:
    @pytest.mark.parametrize(
        "model",
        [
            MODEL.replace("\n", "\r\n"),
            f'<?xml version="1.0" standalone="yes"?>{MODEL}<!-- the end -->',
            f"<!-- a comment -->\n<?modeler 1?>\n{MODEL}",
            f"<!DOCTYPE definitions>\n{MODEL}",
            f"<!-- <!DOCTYPE x [ --><!DOCTYPE definitions SYSTEM 'http://127.0.0.1:1/[bpmn]>.dtd'>\n{MODEL}",
            MODEL.replace(
                "<definitions",
                '<definitions xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
                'xsi:schemaLocation="http://127.0.0.1:1/never http://127.0.0.1:1/fetched.xsd"',
            ),
            MODEL.replace("<", "<sem:").replace("<sem:/", "</sem:").replace("xmlns=", "xmlns:sem="),
        ],
        ids=["crlf", "standalone", "comments", "doctype", "doctype-with-file", "schema-location", "prefix"],
    )
    def test_are_all_the_same(self, model):
        assert topic_of(model.encode()) == "Höhe"

    def test_lines_are_counted_behind_a_doctype_and_line_breaks_of_windows(self):
        model = f"<!DOCTYPE definitions\n  SYSTEM 'x'>\n{MODEL}".replace("\n", "\r\n")
        place = read_bytes(model.encode()).endpoints[0].place
        assert place is not None
        assert place.line == 6

    def test_vendors_may_write_what_they_like(self):
        vendor = '<x:y xmlns:x="http://vendor"><x:z a="b">text</x:z></x:y>'
        model = MODEL.replace('<endEvent id="E">', f'<endEvent id="E"><extensionElements>{vendor}</extensionElements>')
        assert read_bytes(model.encode()).notes == []


class TestNotBpmn:
    @pytest.mark.parametrize(
        ("model", "found"),
        [
            ("<definitions/>", "`definitions` in no namespace"),
            (
                MODEL.replace(URI, "http://schema.omg.org/spec/BPMN/2.0"),
                "http://schema.omg.org/spec/BPMN/2.0",
            ),
            (MODEL.replace(URI, "https://www.omg.org/spec/DMN/20191111/MODEL/"), "DMN"),
            ("<svg xmlns='http://www.w3.org/2000/svg'/>", "`svg`"),
        ],
    )
    def test_the_problem_names_what_was_found(self, model, found):
        problem = problem_of(model)
        assert problem.code == "CQ030"
        assert problem.message.startswith("this is not BPMN 2.0 (20100524)")
        assert found in problem.message


class TestNotReadable:
    @pytest.mark.parametrize(
        ("data", "said", "line", "column"),
        [
            (b"", "the file is empty", 1, 1),
            (b"\xef\xbb\xbf \n", "the file is empty", 1, 1),
            (b"cqos: 1\nsystem: x\n", "not XML: it starts with `cqos: 1`", 1, 1),
            (b"PK\x03\x04\x14\x00", "", 1, 1),
            (MODEL.encode()[:120], "Couldn't find end of Start Tag endE line 4", 4, 8),
            (
                MODEL.encode()[:125].rpartition(b"<")[0],
                "the file ends too early: <process> from line 3",
                4,
                3,
            ),
            (b"<!DOCTYPE html>\n<html><body>Log in</body></html>", "this is an HTML page", 1, 1),
            (b"\n<!-- saved --><HTML lang='en'>", "this is an HTML page", 1, 1),
            (b"<a>\n<b></a>", "Opening and ending tag mismatch", 2, 8),
            (b"<a>\n <q:b/></a>", "`q:b` uses the prefix `q`, which is not declared", 2, 6),
            (b"<a>\n <b q:x='1'/></a>", "`q:x` uses the prefix `q`, which is not declared", 2, 12),
            (b"<a>\n&nbsp;</a>", "Entity 'nbsp' not defined", 2, 7),
            (b"<a>\n\x00</a>", "", 2, 1),
            (b"\n<?xml version='1.0'?><a/>", "XML declaration allowed only at the start", 2, 6),
            (b"<a/>\n<b/>", "", 2, 1),
            (b"<!-- never closed", "", 1, 18),
            (b"<!DOCTYPE never closed", "", 1, None),
        ],
    )
    def test_one_error_with_its_place(self, data, said, line, column):
        problem = problem_of(data)
        assert problem.code == "CQ001"
        assert said in problem.message
        assert where(problem)[0] == line
        if column is not None:
            assert where(problem)[1] == column

    @pytest.mark.parametrize("codec", ["utf-8", "utf-16"])
    @pytest.mark.parametrize("length", [30, 75, 120, 150])
    def test_a_file_that_was_cut_off_is_recognised(self, length, codec):
        assert "cut off" in (problem_of(MODEL[:length].encode(codec)).help or "")

    @pytest.mark.parametrize(
        "data",
        [
            b"\x1b[31m red",
            b"<" + b"p" * 1000 + b":b/>",
            b"<a>&" + b"x" * 1000 + b";</a>",
            b"<" + b"a" * 1000 + b">",
        ],
    )
    def test_messages_are_short_and_printable(self, data):
        message = str(problem_of(data))
        assert message.isprintable()
        assert len(message) < 600

    def test_only_the_first_of_many_faults_is_reported(self):
        assert len(str(problem_of("<a>" + "<q:b/>" * 1000 + "</a>"))) < 300


class TestNamespaceNames:
    """The standard allows any name; libxml2 refuses those that are no URI."""

    @pytest.mark.parametrize(
        "name",
        ["http://my model", "my model", " http://x", "http://[x", "{x}", "50%", "a|b", "urn:ä b", "::", "a:b:c d"],
    )
    def test_need_not_be_uris(self, name):
        data = f'<a xmlns:q="{name}"\n xmlns:r="http://r#1"><q:b/><r:c/><!-- xmlns:q="a b" --></a>'
        root = parse_xml(Source("f.xml", data.encode()))
        assert root[1].tag == "{http://r#1}c"
        assert root[0].sourceline == 2

    @pytest.mark.parametrize("rest", ["x", "<b/>", "<q:c>", "</a>", "<!--"])
    def test_other_faults_stay_faults(self, rest):
        with pytest.raises(InputError):
            parse_xml(Source("f.xml", f'<a xmlns:q="my model"/>{rest}'.encode()))


class TestHostile:
    @pytest.mark.parametrize(
        "document_type",
        [
            BILLION_LAUGHS,
            '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>',
            '<!DOCTYPE a [<!ENTITY % p SYSTEM "http://127.0.0.1:1/p.dtd"> %p;]>',
            '<!DOCTYPE a SYSTEM "x" [<!ENTITY x "y">]>',
            "<!DOCTYPE a [<!ATTLIST definitions name CDATA 'given'>]>",
            "<!DOCTYPE a>\n<!DOCTYPE a [<!ENTITY x 'y'>]>",
        ],
        ids=["laughs", "file", "parameter", "system", "default", "second"],
    )
    def test_declarations_are_refused(self, document_type):
        problem = problem_of(f"{document_type}{MODEL}".replace("Höhe", "&x;"))
        assert problem.code == "CQ002"
        assert "DOCTYPE" in problem.message

    def test_declarations_are_refused_in_every_encoding(self):
        laughs = BILLION_LAUGHS.replace('version="1.0"', 'version="1.0" encoding="UTF-16"')
        problem = problem_of((laughs + MODEL).encode("utf-16"))
        assert (problem.code, *where(problem)) == ("CQ002", 2, 1)

    def test_external_document_type_is_never_looked_at(self, tmp_path):
        secret = tmp_path / "secret.dtd"
        secret.write_text('<!ENTITY x "secret">')
        problem = problem_of(f"<!DOCTYPE definitions SYSTEM '{secret.as_uri()}'>{MODEL}".replace("Höhe", "&x;"))
        assert "'x' not defined" in problem.message

    @pytest.mark.parametrize(
        ("replaced", "start", "piece", "most"),
        [
            ("<signal", "", "<x>", 10_000),
            ("Höhe", "", "x", 11_000_000),
            ("<signal", "<documentation>", "x", 11_000_000),
        ],
        ids=["deep", "attribute", "text"],
    )
    def test_monsters_are_refused_in_linear_time(self, replaced, start, piece, most):
        documents = {size: MODEL.replace(replaced, start + piece * size).encode() for size in (most, 4 * most)}

        def refused(size: int) -> str:
            return problem_of(documents[size]).code

        assert refused(most) == "CQ002"
        assert_linear(refused, most)

    @pytest.mark.parametrize(
        ("start", "piece"),
        [(b"", b"<!--"), (b"", b"<?"), (b"", b"<!-- -->"), (b"<!DOCTYPE ", b"'")],
        ids=["comments", "instructions", "closed", "quotes"],
    )
    def test_prologs_without_end_are_read_in_linear_time(self, start, piece):
        def refused(size: int) -> None:
            assert problem_of(start + piece * size).code == "CQ001"

        assert_linear(refused, 125_001)

    def test_many_events_deep_down_are_read_in_linear_time(self):
        def read(size: int) -> None:
            events = '<endEvent><signalEventDefinition signalRef="S"/></endEvent>' * size
            deep = "<subProcess>" * 200 + events + "</subProcess>" * 200
            system = read_bytes(MODEL.replace("</process>", f"{deep}</process>").encode())
            assert len(system.endpoints) == size + 1

        assert_linear(read, 2_500)


class TestClaims:
    @pytest.mark.parametrize(
        ("name", "head"),
        [
            ("a.bpmn", b""),
            ("a.BPMN", b"<html>"),
            ("a.bpmn2", b"<definitions"),
            ("a.bpmn20.xml", b""),
            ("a.xml", MODEL.encode()),
            ("<bytes>", MODEL.encode("utf-8-sig")),
            ("<bytes>", MODEL.encode("utf-16")),
            ("<bytes>", f"<?xml version='1.0'?><!-- x -->\n{MODEL}".encode()),
            ("<bytes>", MODEL.replace("<definitions xmlns", "<bpmn2:definitions xmlns:bpmn2").encode()),
            ("<bytes>", MODEL.replace(URI, "http://schema.omg.org/spec/BPMN/2.0").encode()),
            ("a.xml", b"<definitions><process/></definitions>"),
        ],
    )
    def test_what_is_or_is_meant_to_be_bpmn(self, name, head):
        assert claims_bpmn(name, head)

    @pytest.mark.parametrize(
        ("name", "head"),
        [
            ("a.xml", b""),
            ("a.xml", b"<dds><qos_library/></dds>"),
            ("a.xml", b"<wsdl:definitions xmlns:wsdl='http://schemas.xmlsoap.org/wsdl/'/>"),
            ("a.dmn", b"<definitions xmlns='https://www.omg.org/spec/DMN/20191111/MODEL/'/>"),
            ("a.yaml", f"cqos: 1\n# {MODEL}".encode()),
            ("<bytes>", b"\x00\x01\x02"),
        ],
    )
    def test_what_is_not(self, name, head):
        assert not claims_bpmn(name, head)

    def test_needs_no_parser(self):
        script = "import sys, cqos_core.importers.format_detection; sys.exit('lxml' in sys.modules)"
        subprocess.run([sys.executable, "-c", script], check=True)
