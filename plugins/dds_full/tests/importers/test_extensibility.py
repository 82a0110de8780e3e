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
    return XML.format(extensibility, name, f'{group} name="g"', endpoint, group)


@pytest.mark.parametrize(
    ("first", "second", "meets"),
    [("mutable", "mutable", True), ("mutable", "final", False), ("extensible", "appendable", True)],
)
def test_types_of_xml_state_it_each(tmp_path, first, second, meets):
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    (tmp_path / "one" / "w.xml").write_text(file(first, "w", "publisher", "data_writer"), encoding="utf-8")
    (tmp_path / "two" / "r.xml").write_text(file(second, "r", "subscriber", "data_reader"), encoding="utf-8")
    found = check(tmp_path / "one" / "w.xml", tmp_path / "two" / "r.xml")
    assert ("DDS407" not in [each.code for each in found.findings]) is meets
