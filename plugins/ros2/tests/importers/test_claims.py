"""No file is claimed by two importers, and every file that an importer's tests read is claimed by that importer."""

from pathlib import Path

import pytest

from cqos_core.plugins import load_plugins
from tests.growth.linear import assert_linear

ROOT = Path(__file__).parents[4]
FOLDERS = (
    ROOT / "tests" / "importers" / "cases",
    *sorted(ROOT.glob("plugins/*/tests/importers/cases")),
    ROOT / "examples",
)
# In the folder of the core, each .txt file holds the expected messages of a case.
FILES = [
    file
    for folder in FOLDERS
    for file in sorted(folder.rglob("*"))
    if file.is_file() and not (folder == FOLDERS[0] and file.suffix == ".txt")
]
HEAD = 65_536
# Files that no importer claims: tests of the core read them with a named importer, or as parts of other files.
UNCLAIMED = ("bad", "parts", "plugin", "opcua")


def claiming(name, data, beside=("ros2",)):
    """The importers that could read a file, as far as the protocol of the files beside it does not decide."""
    claims = [info for info in load_plugins().importers.values() if info.load_claim()(name, data[:HEAD])]
    decided = [info for info in claims if info.overlays in beside] or [info for info in claims if not info.overlays]
    return sorted(info.name for info in decided or claims)


def owner(file):
    """The importer that a folder of cases is named after, or None."""
    return next((part for part in reversed(file.parts) if part in load_plugins().importers), None)


def test_every_case_file_is_claimed_by_one_importer():
    wrong = []
    for file in FILES:
        beside = () if (owner(file) or "").endswith("_xml") else ("ros2",)
        found, its = claiming(str(file), file.read_bytes(), beside), owner(file)
        right = len(found) <= 1 if set(UNCLAIMED) & set(file.parts) else its is None or found == [its]
        if not right:
            wrong.append((str(file.relative_to(ROOT)), found))
    assert wrong == []


@pytest.mark.parametrize("name", ["<stdin>", "file", "file.yaml"])
def test_whatever_it_is_called_two_importers_never_claim_it(name):
    wrong = []
    for file in FILES:
        for beside in (), ("ros2",):
            found = claiming(name, file.read_bytes(), beside)
            if len(found) > 1:
                wrong.append((str(file.relative_to(ROOT)), beside, found))
    assert wrong == []


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("notes.md", "ros__parameters and qos_overrides are explained here: ros__parameters: qos_overrides: 1"),
        ("params.yaml", "node:\n  ros__parameters:\n    rate: 10\n"),
        ("params.yaml", "node:\n  ros__parameters:\n    rate: 10  # no qos_overrides\n    # qos_overrides: x\n"),
        ("compose.yaml", "services:\n  web: {image: x}\nvolumes: [a]\n"),
        ("topics.yaml", "topics:\n- /scan\n- /tf\n"),
        ("topics.yaml", "topics: {/scan: {type: a}}\n"),
        ("list.yaml", "- name: a\n  type: b\n"),
        ("package.xml", '<?xml version="1.0"?>\n<package format="3"><name>profiles</name></package>'),
        ("log.xml", "<dds><log/></dds>"),
        ("robot.urdf", "<robot><link name='a'/></robot>"),
        ("launch.py", "parameters=[{'qos_overrides./scan.publisher.depth': 1}] # ros__parameters:"),
        ("zenohd.json5", "{plugins: {rest: {http_port: 8000}}}  // ros2dds: {}"),
        ("zenohd.json5", "{plugins: {rest: {}, /* ros2dds: {}, */}}"),
        ("notes.txt", "{plugins: {ros2dds: {}}}"),
        ("zenohd.yaml", "plugins:\n  # ros2dds: {}\n  rest: {}\n"),
        ("empty.yaml", ""),
        ("empty.xml", ""),
    ],
)
def test_no_importer_claims_files_of_other_programs(name, text):
    assert claiming(name, text.encode()) == []


@pytest.mark.parametrize(
    "inner",
    [
        '<qos_library name="l"><qos_profile name="p"/></qos_library>',
        '<x:qos_profile name="p" xmlns:x="u"/>',
        '<domain_participant_library name="l"><data_writer topic_ref="t"/></domain_participant_library>',
    ],
)
def test_libraries_of_the_omg_are_left_to_others(inner):
    assert "fastdds" not in claiming("omg.xml", f'<dds xmlns="http://www.omg.org/spec/DDS-XML">{inner}</dds>'.encode())


@pytest.mark.parametrize(
    ("expected", "text"),
    [
        ("qos_overrides", "node: {ros__parameters: {qos_overrides: {}}}"),
        ("qos_overrides", '{"node": {"ros__parameters": {"qos_overrides./a.publisher.depth": 1}}}'),
        ("rviz", '"Visualization Manager":\n  Displays: []\n'),
        ("gz_bridge", "# topics\n---\n- {gz_topic_name: a}\n"),
        ("gz_bridge", "[{ign_type_name: a}]"),
        ("ros1_bridge", "topics: [{topic: /a, type: b, queue_size: 1}]"),
        ("ros1_bridge", "{services_1_to_2: []}"),
        ("domain_bridge", "topics:\n  a: {from_domain: 1}\n"),
        ("domain_bridge", "to_domain: 1\nservices: {}\n"),
        ("zenoh_bridge", "{plugins:{ros2dds:{}}}"),
        ("zenoh_bridge", "// a 'bridge'\n{'plugins' : { \"ros2dds\" : {} } }"),
        ("zenoh_bridge", "mode: peer\nplugins:\n  ros2dds:\n    domain: 1\n"),
        ("zenoh_bridge", '{"id": "//", "plugins": {"ros2dds": {"domain": 1}}}'),
        ("fastdds", "<!-- a > b --><profiles><data_writer/></profiles>"),
        ("fastdds", '<?xml version="1.0"?><x:dds xmlns:x="u"><x:profiles/></x:dds>'),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_short_forms_and_other_encodings_are_claimed(expected, text, encoding):
    assert claiming("<stdin>", text.encode(encoding)) == [expected]


@pytest.mark.parametrize("piece", ["/*", '"\\"', "'\\'", "//", "{", "plugins ", "/* *", "ros2dds:"])
def test_looking_at_a_file_takes_linear_time(piece):
    assert_linear(lambda size: claiming("f.json5", (piece * size)[:size].encode()), HEAD // 4)


def test_a_system_file_is_no_file_of_a_bridge():
    text = "cqos: 1\nprotocol: ros2\ntopics: {a: {type: b}}\n# from_domain: queue_size: topic: services_1_to_2:\n"
    assert claiming("system.yaml", (text + "x: {from_domain: 1, topic: 2, queue_size: 3}\n").encode()) == ["yaml"]
