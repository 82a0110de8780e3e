"""Node files: what the reader refuses and where, what comes with C-QoS, and what the JSON schema says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from cqos_core.importers.reading import Reading
from cqos_core.model.problems import InputError
from cqos_core.model.source import Source
from cqos_core.packs.documents import only_document
from cqos_ros2.launch.parameter_files import plain
from cqos_ros2.nodes import form
from cqos_ros2.nodes.library import SHIPPED, Library
from cqos_ros2.nodes.reading import endpoints, read_node_file

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
    ],
)
def test_what_is_refused_has_its_place(body, expected):
    code, line, message = expected
    found = problems(HEAD + body)
    assert [(each[0], each[1]) for each in found] == [(code, line)]
    assert message in found[0][2]


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
        root = only_document(Reading(Source(path.name, path.read_bytes()), [], []))
        assert root is not None
        document = plain(root)
        assert [each.message for each in validator.iter_errors(document)] == [], path.name
    wrong = {"cqos_nodes": 1, "package": "p", "nodes": {"n": {"publishs": {}}}}
    assert not validator.is_valid(wrong)


def test_the_committed_schema_is_that_of_the_reader():
    written = (Path(__file__).parents[4] / "docs" / "cqos-node-1.schema.json").read_text(encoding="utf-8")
    assert json.loads(written) == form.node_schema()
