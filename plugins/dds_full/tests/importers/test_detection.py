"""Who reads an XML file: the content decides, and where ROS 2 would lay profiles of Fast DDS over its nodes, the other files."""

from pathlib import Path

import pytest

import cqos_core as cqos
from cqos_core.files.importer_choice import depends_on_others, recognise
from cqos_core.files.path_loader import load_paths
from cqos_core.model.source import Source
from cqos_core.plugins import load_plugins
from cqos_dds.importers.detect import claims_dds_xml, claims_fastdds_xml

FAST = '<dds><profiles><data_writer profile_name="/t"><qos>{}</qos></data_writer></profiles></dds>'.format(
    "<deadline><period><sec>1</sec></period></deadline>"
)
OMG = '<dds><qos_library name="L"><qos_profile name="P"><datawriter_qos/></qos_profile></qos_library></dds>'
ROS = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/t: default}}}\n"
DDS = "cqos: 1\nprotocol: dds\nparticipants: {a: {publishes: {/t: {}}}}\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (OMG, "dds_xml"),
        (FAST, "fastdds_xml"),
        ('<?xml version="1.0"?>\n<!-- <profiles> are elsewhere -->\n' + OMG, "dds_xml"),
        ("<profiles><data_reader profile_name='a'/></profiles>", "fastdds_xml"),
        ('<dds><data_writer profile_name="a"/></dds>', "fastdds_xml"),
        ('<o:dds xmlns:o="http://www.omg.org/dds"><qos_profile name="p"/></o:dds>', "dds_xml"),
        ('<qos_library name="L"/>', "dds_xml"),
        ('<application_library name="L"/>', "dds_xml"),
        ("<dds><types><struct name='S'/></types></dds>", "dds_xml"),
        ('<dds><participant_library name="L"><publisher name="profile_name"/></participant_library></dds>', "dds_xml"),
        ("<dds/>", None),
        ("<dds><log/></dds>", None),
        ("<CycloneDDS><Domain/></CycloneDDS>", None),
        ("<!-- <dds> --><package><name>qos_library</name></package>", None),
        ("<robot/>", None),
        ("", None),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_the_first_elements_decide(text, expected, encoding):
    head = text.encode(encoding)
    claims = {"dds_xml": claims_dds_xml("x", head), "fastdds_xml": claims_fastdds_xml("x", head)}
    assert [name for name, claimed in claims.items() if claimed] == ([expected] if expected else [])


CYCLONE = '<CycloneDDS xmlns="https://cdds.io/config"><Domain Id="any"/></CycloneDDS>'


@pytest.mark.parametrize(
    ("text", "claimed"),
    [
        (CYCLONE, True),
        ("<CycloneDDS/>", True),
        ("<CycloneDDS><Domain/></CycloneDDS>", True),
        ("<cyclonedds>\n</cyclonedds>", True),  # Cyclone DDS does not distinguish capitals
        ("<c:CycloneDDS xmlns:c='https://cdds.io/config'/>", True),
        ('<?xml version="1.0" encoding="UTF-8" ?>\n' + CYCLONE, True),
        ("<!-- the lab -->\n" + CYCLONE, True),
        ("<!-- <dds> was here, <profiles> too -->\n" + CYCLONE, True),
        ("\n  " + CYCLONE, True),
        ("<CycloneDDSSettings/>", False),
        ("<settings><CycloneDDS/></settings>", False),
        ("<!-- <CycloneDDS/> --><robot/>", False),
        ("the file <CycloneDDS> is explained here", False),
        (FAST, False),
        (OMG, False),
        ("", False),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_configurations_of_cyclone_dds_are_claimed_by_their_root(text, claimed, encoding):
    head = text.encode(encoding)
    importers = [load_plugins().importers[name] for name in ("cyclonedds_xml", "cyclonedds")]
    assert [each.load_claim()("x.xml", head) for each in importers] == [claimed, claimed]
    others = [each for each in load_plugins().importers.values() if each not in importers]
    assert not claimed or [each.name for each in others if each.load_claim()("x.xml", head)] == []


@pytest.mark.parametrize(
    ("text", "claimed"),
    [
        (FAST, True),
        ("<profiles><data_reader profile_name='a'/></profiles>", True),
        ("<!-- <dds><qos_library/></dds> is the form of others -->\n" + FAST, True),
        ("<?xml version='1.0'?><!-- a --><?style x?>" + FAST, True),
        ("<!DOCTYPE dds [ <!ENTITY a 'b'> ]>" + FAST, True),  # the reader says what is wrong with it
        ("<!-- <profiles><data_reader profile_name='a'/></profiles> --><robot/>", False),
        ("<!-- --> the <profiles><data_reader profile_name='a'/> of others", False),
        ("<robot><profiles><data_reader profile_name='a'/></profiles></robot>", False),
        (OMG, False),
    ],
)
def test_both_packs_claim_the_same_profiles_of_fast_dds(text, claimed):
    importers = [load_plugins().importers[name] for name in ("fastdds_xml", "fastdds")]
    assert [each.load_claim()("x.xml", text.encode()) for each in importers] == [claimed, claimed]


@pytest.mark.parametrize(
    ("beside", "expected"), [((), "cyclonedds_xml"), (("ros2",), "cyclonedds"), (("dds",), "cyclonedds_xml")]
)
def test_the_protocol_of_other_files_decides_who_reads_a_configuration(beside, expected):
    source = Source("cyclonedds.xml", CYCLONE.encode())
    assert depends_on_others(source)
    assert recognise(source, load_plugins(), beside=beside).name == expected


def test_a_file_with_many_types_before_its_profiles_is_read_all_the_same():
    types = "".join(f'<struct name="S{number}"><member name="a" type="int32"/></struct>' for number in range(2000))
    text = f'<dds><types>{types}</types><profiles><data_writer profile_name="w"><qos/></data_writer></profiles></dds>'
    assert list(cqos.read(text.encode()).profiles) == ["w/data_writer", "w"]


@pytest.mark.parametrize(
    ("beside", "expected"), [((), "fastdds_xml"), (("ros2",), "fastdds"), (("dds",), "fastdds_xml")]
)
def test_the_protocol_of_other_files_decides(beside, expected):
    source = Source("p.xml", FAST.encode())
    assert depends_on_others(source)
    assert recognise(source, load_plugins(), beside=beside).name == expected
    assert recognise(source, load_plugins(), "fastdds", beside).name == "fastdds"


def kinds(system):
    return bool(system.overlays), bool(system.profiles)


OVERLAY, PROFILES = (True, False), (False, True)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (("a_profiles.xml", FAST), ("ros.yaml", ROS), ("dds.yaml", DDS)):
        Path(name).write_text(text)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("paths", "protocol", "expected"),
    [
        (["a_profiles.xml"], None, PROFILES),
        (["a_profiles.xml"], "ros2", OVERLAY),
        (["a_profiles.xml"], "dds", PROFILES),
        (["a_profiles.xml", "ros.yaml"], None, OVERLAY),
        (["ros.yaml", "a_profiles.xml"], None, OVERLAY),
        (["dds.yaml", "a_profiles.xml"], None, PROFILES),
        (["a_profiles.xml", "dds.yaml", "ros.yaml"], None, OVERLAY),
        (["."], None, OVERLAY),
    ],
)
def test_files_named_together_are_read_as_one_system(paths, protocol, expected):
    assert kinds(cqos.read(*paths, protocol=protocol)) == expected
    loaded = load_paths(paths, protocol=protocol)
    assert not loaded.problems
    systems = dict(loaded.systems)
    (read,) = [system for path, system in systems.items() if path.endswith("profiles.xml")]
    assert kinds(read) == expected
    named = [path for path in paths if path != "."]
    assert [path for path, _ in loaded.systems][: len(named)] == named


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("file", "expected"), [("ros.yaml", OVERLAY), ("dds.yaml", PROFILES)])
def test_the_file_that_includes_it_decides(file, expected):
    path = Path(file)
    path.write_text(path.read_text() + "include: a_profiles.xml\n")
    assert kinds(cqos.read(path)) == expected
    assert set(cqos.read(path).sources) == {file, "a_profiles.xml"}
