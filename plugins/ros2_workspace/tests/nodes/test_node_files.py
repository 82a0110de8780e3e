"""Node files: what the reader refuses and where, what comes with C-QoS, and what the JSON schema says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from cqos_core import InputError
from cqos_core.importers.source_reading import SourceReading
from cqos_core.model.source import Source
from cqos_core.packs.document_importer import only_document
from cqos_ros2_workspace.launch.parameter_files import plain
from cqos_ros2_workspace.nodes import form
from cqos_ros2_workspace.nodes.library import SHIPPED, Library
from cqos_ros2_workspace.nodes.reading import endpoints, read_node_file

FILES = sorted(SHIPPED.glob("*.node.yaml"))
HEAD = "cqos_nodes: 1\npackage: p\n"


def problems(text):
    with pytest.raises(InputError) as error:
        read_node_file(Source("p.node.yaml", text.encode()))
    return [(each.code, each.place.line, each.message) for each in error.value.problems]


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("nodes: {n: {publishs: {a: {}}}}", ("CQ006", 3, "has no key `publishs`; did you mean `publishes`?")),
        ("nodes: {n: {publishes: {a: {qos: latched}}}}", ("CQ011", 3, "there is no profile `latched`")),
        (
            "nodes: {n: {publishes: {a: {qos: {depht: 1}}}}}",
            ("CQ006", 3, "there is no policy `depht`; did you mean `depth`?"),
        ),
        (
            "nodes: {n: {publishes: {a: {when: {distro: hunble}}}}}",
            ("CQ011", 3, "no ROS 2 distribution `hunble`; did you mean `humble`?"),
        ),
        ("versions: {jassy: 1.0.0}\nnodes: {n: {}}", ("CQ011", 3, "no ROS 2 distribution `jassy`")),
        ("nodes: {n: {publishes: {a: {overridable: [size]}}}}", ("CQ011", 3, "`overridable[0]` must be")),
        ("nodes: {n: {publishes: {a: {when: [x]}}}}", ("CQ009", 3, "`when` must be a map")),
        ("nodes: {n: {inside: [{name: x}]}}", ("CQ010", 3, "needs `node`")),
        ("profiles: {}", ("CQ010", 1, "needs `nodes` or `fragments`")),
        (
            "nodes: {driver: {}}\ncorrections: {nodes: {drivr: {}}}",
            ("CQ011", 4, "the file has no node `drivr`; did you mean `driver`?"),
        ),
        (
            "nodes: {n: {publishes: {scan: {}}}}\ncorrections:\n  nodes:\n    n:\n      publishes:\n        scn: {}",
            ("CQ011", 8, "`n` has no `scn` under `publishes`; did you mean `scan`?"),
        ),
        (
            "nodes: {n: {calls: {(unknown 1): {unknown: x}}}}\ncorrections: {nodes: {n: {calls: {(unknown 1): {}}}}}",
            ("CQ011", 4, "`n` has no `(unknown 1)` under `calls`"),
        ),
        (
            "nodes: {n: {calls: {a: {}}}}\ncorrections: {nodes: {n: {calls: {a: {qos: latched}}}}}",
            ("CQ011", 4, "there is no profile `latched`"),
        ),
    ],
)
def test_what_is_refused_has_its_place(body, expected):
    code, line, message = expected
    found = problems(HEAD + body)
    assert [(each[0], each[1]) for each in found] == [(code, line)]
    assert message in found[0][2]


def test_corrections_replace_keys_of_what_is_stated():
    text = f"""{HEAD}
nodes:
  n:
    name: old
    parameters: {{a: {{default: 1}}, b: {{default: 2}}}}
    publishes:
      one: {{type: a/msg/A, qos: {{depth: 1}}}}
      two: [{{type: a/msg/A}}, {{type: a/msg/B}}]
      three: [{{type: a/msg/A}}, {{type: a/msg/B}}]
corrections:
  nodes:
    n:
      name: new
      parameters: {{b: {{default: 3}}}}
      publishes:
        one: {{qos: {{depth: 5}}}}
        two: {{optional: true}}
        three: [{{type: a/msg/C}}, {{type: a/msg/D}}]
"""
    node = read_node_file(Source("p.node.yaml", text.encode())).nodes["n"]
    stated = [
        (each.name, each.entry.get(form.TYPE), each.entry.get(form.OPTIONAL), each.entry.place.line)
        for each in endpoints(node)
    ]
    assert stated == [
        ("one", "a/msg/A", None, 18),
        ("two", "a/msg/A", True, 19),
        ("two", "a/msg/B", True, 19),
        ("three", "a/msg/C", None, 20),
        ("three", "a/msg/D", None, 20),
    ]
    (quality,) = next(endpoints(node)).entry.require(form.QOS)
    assert (quality.settings["depth"].text, quality.settings["depth"].place.line) == ("5", 18)
    assert node.get(form.NAME) == "new"
    defaults = {name: each.value[0].get(form.DEFAULT).value for name, each in node.require(form.PARAMETERS).items()}
    assert defaults == {"a": 1, "b": 3}


def test_a_file_of_another_version_is_refused():
    assert problems("cqos_nodes: 2\npackage: p\nnodes: {n: }\n")[0][:2] == ("CQ009", 1)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_shipped_file_says_where_each_endpoint_is_from(path):
    file = read_node_file(Source(path.name, path.read_bytes()))
    assert path.name == f"{file.package}.node.yaml"
    for part in (*file.nodes.values(), *file.fragments.values()):
        for each in endpoints(part):
            assert each.entry.get(form.AT), f"{file.package}: {each.name} has no source"
            assert each.entry.get(form.TYPE) or each.entry.get(form.UNKNOWN), f"{file.package}: {each.name} has no type"
            assert file.versions


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_shipped_file_uses_fragments_that_are_there(path):
    library = Library()
    file = read_node_file(Source(path.name, path.read_bytes()))
    for part in (*file.nodes.values(), *file.fragments.values()):
        for use in part.get(form.USES) or ():
            name = use.require(form.FRAGMENT)
            assert "${" in name or library.fragment(name), name
        for slot in part.get(form.PLUGINS) or ():
            for member in (slot.get(form.CLASSES) or {}).values():
                assert library.fragment(member.value), member.value
        for inner in part.get(form.INSIDE) or ():
            assert library.node(*inner.require(form.NODE).split("/")), inner.require(form.NODE)


def test_the_schema_accepts_the_shipped_files_and_refuses_what_the_reader_refuses():
    schema = form.node_schema()
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    for path in FILES:
        root = only_document(SourceReading(Source(path.name, path.read_bytes()), [], []))
        assert root is not None
        document = plain(root)
        assert [each.message for each in validator.iter_errors(document)] == [], path.name
    wrong = {"cqos_nodes": 1, "package": "p", "nodes": {"n": {"publishs": {}}}}
    assert not validator.is_valid(wrong)


def test_the_committed_schema_is_that_of_the_reader():
    written = (Path(__file__).parents[4] / "docs" / "cqos-node-1.schema.json").read_text(encoding="utf-8")
    assert json.loads(written) == form.node_schema()
