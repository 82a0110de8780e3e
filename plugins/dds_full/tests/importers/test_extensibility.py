"""How data types may grow, per participant and per type."""

import pytest

from cqos_core import check

SYSTEM = """cqos: 1
protocol: dds
participants:
  w: {{implementation: {}, options: {{extensibility: {}}}, publishes: {{T: {{}}}}}}
  r: {{implementation: {}, options: {{extensibility: {}}}, subscribes: {{T: {{}}}}}}
"""


@pytest.mark.parametrize(
    ("writer", "reader", "meets"),
    [
        (("cyclonedds", "appendable"), ("cyclonedds", "final"), False),
        (("opendds", "appendable"), ("cyclonedds", "final"), False),
        (("cyclonedds", "final"), ("cyclonedds", "final"), True),
        (("cyclonedds", "mutable"), ("cyclonedds", "mutable"), True),
        (("standard", "appendable"), ("standard", "final"), True),  # by name, in XCDR1
        (("standard", "mutable"), ("standard", "final"), False),
    ],
)
def test_participants_state_it_for_all_their_types(writer, reader, meets):
    found = check(SYSTEM.format(*writer, *reader).encode())
    assert ("DDS408" not in [each.code for each in found.findings]) is meets
    assert (found.verdict_words == "compatible") is meets


XML = """<dds>
<types><module name="M"><struct name="S" extensibility="{}"><member name="x" type="int32"/></struct></module></types>
<domain_library name="D"><domain name="d" domain_id="0">
<register_type name="S" type_ref="M::S"/><topic name="T" register_type_ref="S"/></domain></domain_library>
<domain_participant_library name="P"><domain_participant name="{}" domain_ref="D::d">
<{}><{} name="e" topic_ref="T"/></{}></domain_participant></domain_participant_library></dds>"""


def file(extensibility, name, group, endpoint):
    """Return a file with a type, which states no extensibility if that is empty."""
    text = XML.format(extensibility, name, f'{group} name="g"', endpoint, group)
    return text.replace(' extensibility=""', "")


def together(tmp_path, first, second, more=""):
    """Check a writer and a reader whose files define their type each."""
    for folder, text in (
        ("one", file(first, "w", "publisher", "data_writer")),
        ("two", file(second, "r", "subscriber", "data_reader")),
    ):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "f.xml").write_text(text, encoding="utf-8")
    (tmp_path / "o.yaml").write_text(f"cqos: 1\nprotocol: dds\n{more}", encoding="utf-8")
    return check(*([tmp_path / "o.yaml"] if more else []), tmp_path / "one" / "f.xml", tmp_path / "two" / "f.xml")


BY_MEMBERS = "options: {dds: {implementation: %s}}\n"
CYCLONE = BY_MEMBERS % "cyclonedds"


@pytest.mark.parametrize(
    ("first", "second", "more", "expected"),
    [
        ("mutable", "", "", "never"),
        ("", "mutable", "", "never"),
        ("", "", "", "compatible"),
        ("", "final", "", "compatible"),  # by name, in XCDR1
        ("", "final", CYCLONE, "unknown"),
        ("appendable", "", CYCLONE, "unknown"),
        ("", "mutable", CYCLONE, "never"),
        ("", "", CYCLONE, "compatible"),
    ],
)
def test_a_type_that_states_none_is_not_mutable(tmp_path, first, second, more, expected):
    found = together(tmp_path, first, second, more)
    reported = [each.message for each in found.findings if each.code == "DDS407"]
    assert found.verdict_words == ("unknown" if expected == "never" else expected)
    assert len(reported) == (expected != "compatible")
    assert any("never meet" in each for each in reported) is (expected == "never")


def test_compilers_decide_where_neither_type_states_it(tmp_path):
    more = "participants: {P::w: {implementation: cyclonedds}, P::r: {implementation: opendds}}\n"
    found = together(tmp_path, "", "", more)
    assert (found.verdict_words, "DDS408" in [each.code for each in found.findings]) == ("unknown", True)


def test_a_type_grows_as_its_base(tmp_path):
    def derived(text):
        struct = '<struct name="B" extensibility="mutable"/><struct name="S" baseType="{}">'
        return text.replace('<struct name="S">', struct)

    for base, expected in (("B", "compatible"), ("M::B", "compatible"), ("Elsewhere", "compatible")):
        (tmp_path / "w.xml").write_text(
            derived(file("", "w", "publisher", "data_writer")).format(base), encoding="utf-8"
        )
        (tmp_path / "r").mkdir(exist_ok=True)
        (tmp_path / "r" / "r.xml").write_text(file("mutable", "r", "subscriber", "data_reader"), encoding="utf-8")
        assert check(tmp_path / "w.xml", tmp_path / "r" / "r.xml").verdict_words == expected


@pytest.mark.parametrize(
    ("first", "second", "meets"),
    [("mutable", "mutable", True), ("mutable", "final", False), ("extensible", "appendable", True)],
)
def test_types_of_xml_state_it_each(tmp_path, first, second, meets):
    found = together(tmp_path, first, second)
    assert ("DDS407" not in [each.code for each in found.findings]) is meets
