"""Which files the YAML importer takes for its own, and that recognising them loads no parser."""

import json
import subprocess
import sys

import pytest

from cqos_core.importers.format_detection import claims_bpmn, claims_yaml
from tests.growth.linear import assert_linear


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("a.yaml", b"cqos: 1\n"),
        ("a.yml", b"# a comment\n---\nsystem: x\ncqos: 1\n"),
        ("a.json", b'{\n  "system": "x",\n  "cqos": 1\n}'),
        ("<bytes>", b"cqos: 1"),
        ("a.txt", b"'cqos' : 1"),
        ("a.yaml", b"%YAML 1.2\n---\n# flow\n{cqos: 1, system: x}"),
        ("a.yaml", b"\xef\xbb\xbfcqos: 1"),
        ("a.yaml", "cqos: 1\n".encode("utf-16")),
        ("a.yaml", b"cqos: 2\n"),
        ("a.yaml", b"\r\ncqos: 1\r\n"),
        ("forgotten.yaml", b"system: x\nparticipants:\n  a:\n    publishes: {t: }\n"),
        ("forgotten.yaml", b"participants: {a: {publishes: {t: }}}\n"),
        ("forgotten.yaml", b"participants:\n  a: {remap: {x: y}, 'publishes': {t: }}\n"),
        ("forgotten.json", b'{"participants": {"a": {"subscribes": {"t": null}}}}'),
        ("misspelt.yaml", b"cqoss: 1\nparticipants:\n  a:\n    publishes:\n      t:\n"),
        ("a.yaml", b"cqos: 1\n\xff\xfe cut off \xc3"),
    ],
)
def test_claimed(name, head):
    assert claims_yaml(name, head)
    assert not claims_bpmn(name, head)


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("a.yaml", b""),
        ("a.yaml", b"apiVersion: v1\nkind: ConfigMap\n"),
        ("workflow.yml", b"jobs:\n  cqos:\n    runs-on: linux\n"),
        ("a.yaml", b"# cqos: 1\nname: x\n"),
        ("package.json", b'{"name": "cqos"}'),
        ("a.json", b'["cqos", 1]'),
        ("a.bpmn", b'<definitions id="cqos:1"/>'),
        ("a.txt", b"participants:\n  a:\n    publishes: x\n"),
        ("compose.yaml", b"participants:\n  - a\n"),
        ("feed.yaml", b"publishes: {a: b}\nparticipants: [c]\n"),
        ("meeting.json", b'{"participants": ["ann"], "calls": [], "topic": "what it publishes: a book"}'),
        ("forgotten.txt", b"participants: {a: {publishes: {t: }}}\n"),
        ("a.bin", bytes(range(256)) * 256),
    ],
)
def test_not_claimed(name, head):
    assert not claims_yaml(name, head)


@pytest.mark.parametrize(
    ("start", "piece"),
    [
        (b"", b" "),
        (b"", b"#"),
        (b"", b"---"),
        (b"participants:\n", b" publishe:"),
        (b"", b"participants:\n"),
        (b"", b"{participants:"),
        (b"participants:", b"{ "),
    ],
)
def test_recognising_nonsense_takes_linear_time(start, piece):
    assert_linear(lambda size: claims_yaml("a.yaml", (start + piece * size)[:size]), 16_384)
    assert not claims_yaml("a.yaml", (start + piece * 65_536)[:65_536])


LOADED = """
import sys, json
{statement}
print(json.dumps([name for name in ("yaml", "lxml", "pydantic", "grpc") if name in sys.modules]))
"""


def loaded_by(statement):
    done = subprocess.run([sys.executable, "-c", LOADED.format(statement=statement)], capture_output=True, check=True)
    return json.loads(done.stdout)


def test_recognising_loads_no_parser():
    assert loaded_by("from cqos_core.importers.format_detection import claims_yaml; claims_yaml('a', b'cqos: 1')") == []


def test_reading_loads_no_other_parser():
    statement = """
from cqos_core.importers.yaml_system import read
from cqos_core.model.source import ReadContext, Source
read(Source("a", b"cqos: 1"), ReadContext())
"""
    assert loaded_by(statement) == ["yaml"]


def test_configuration_loads_no_parser():
    assert loaded_by("import cqos_core.config") == []
