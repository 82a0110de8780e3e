"""The JSON schema says the same as the reader: what one refuses in structure, the other refuses too."""

import copy
import json
import re
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from cqos_core.files.schema import suggested_values, system_schema, written_name
from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import MappingNode, SequenceNode, flag, flow_text, kind_of, whole_number
from cqos_core.model.problems import InputError
from cqos_core.model.source import ReadContext, Source
from cqos_core.packs.document_importer import only_document
from cqos_core.plugins import load_plugins, named
from tests.effort import EXPLORE

read = named(load_plugins().importers["yaml"].reader)
ROOT = Path(__file__).resolve().parent.parent
CASES = ROOT / "tests" / "importers" / "cases" / "yaml"
PLUGINS = load_plugins()
PACKS = [pack for pack_id in sorted(PLUGINS.packs) if (pack := PLUGINS.pack(pack_id)) is not None]
COMPLETING = system_schema(PACKS)
SCHEMA = Draft202012Validator(COMPLETING)
PLAIN = system_schema()
STRUCTURAL = Draft202012Validator(PLAIN)
"""Without packs: quicker, and the same but for what refuses nothing."""

STRUCTURE = {"CQ004", "CQ006", "CQ009", "CQ010"}
"""Codes of the mistakes that a schema finds. CQ011 is about values; a schema finds some of its mistakes."""


def data(text):
    """The first document, as a parser for YAML 1.2 gives it to an editor."""
    return value(only_document(SourceReading(Source("f.yaml", text), [], [])))


def value(node):
    if isinstance(node, SequenceNode):
        return [value(item) for item in node.items]
    if isinstance(node, MappingNode):
        return {name: value(item) for name, (_, item) in node.entries.items()}
    kind = kind_of(node)
    if kind == "flag":
        return flag(node)
    if kind == "number":
        whole = whole_number(node)
        return float(node.text) if whole is None else whole
    return None if kind == "null" else node.text


def codes(document):
    try:
        read(Source("f.json", json.dumps(document).encode()), ReadContext())
    except InputError as refused:
        return {problem.code for problem in refused.problems}
    return set()


def test_is_a_schema_of_its_draft():
    Draft202012Validator.check_schema(COMPLETING)
    Draft202012Validator.check_schema(PLAIN)


def test_file_in_docs_is_up_to_date():
    written = (ROOT / "docs" / "cqos-1.schema.json").read_text(encoding="utf-8")
    assert len(written) < 400_000
    assert written == json.dumps(COMPLETING, indent=2, ensure_ascii=False) + "\n", "write `cqos schema` there"


def test_every_key_is_described():
    def keys(schema):
        if isinstance(schema, dict):
            yield from schema.get("properties", {}).items()
            for part in schema.values():
                yield from keys(part)
        elif isinstance(schema, list):
            for part in schema:
                yield from keys(part)

    relations = {"exactly", "at_least", "at_most", "one_of", "not"}
    undescribed = {
        name
        for name, key in keys(COMPLETING)
        if isinstance(key, dict) and "not" not in key and not key.get("description")
    }
    assert undescribed <= relations


@pytest.mark.parametrize("file", sorted((CASES / "good").glob("*.yaml")), ids=lambda file: file.name)
def test_good_files_are_valid(file):
    assert [error.message for error in SCHEMA.iter_errors(data(file.read_bytes()))] == []


@pytest.mark.parametrize(
    "name",
    [
        "a_list",
        "missing",
        "no_version",
        "other_version",
        "unknown_keys",
        "version_as_text",
        "wrong_kinds",
        "not_allowed",
    ],
)
def test_bad_files_are_not(name):
    assert not SCHEMA.is_valid(data((CASES / "bad" / f"{name}.yaml").read_bytes()))


@pytest.mark.parametrize(
    ("where", "wrong"),
    [
        (["participants", "a", "publishes", "t"], {"neds": {"latest": True}, "id": ["x"]}),
        (["participants", "a"], {"pubishes": {"t": None}}),
        (["checks"], [{"name": "x", "because": "y"}]),
        (["checks"], [{"name": "x", "because": "y", "require": None}]),
        (["accept"], [{"rule": "X"}]),
        (["severities"], {"X": "loud"}),
        (["colour"], "blue"),
    ],
)
def test_a_single_fault_is_seen_by_both(where, wrong):
    document: dict[str, Any] = {"cqos": 1, "participants": {"a": {"publishes": {"t": None}}}}
    part: dict[str, Any] = document
    for name in where[:-1]:
        part = part.setdefault(name, {})
    assert SCHEMA.is_valid(document)
    part[where[-1]] = wrong
    assert not SCHEMA.is_valid(document)
    assert codes(document) & {*STRUCTURE, "CQ011"}


def paths(document, above=()):
    yield above
    if isinstance(document, dict):
        for name, part in document.items():
            yield from paths(part, (*above, name))
    elif isinstance(document, list):
        for index, part in enumerate(document):
            yield from paths(part, (*above, index))


EVERYTHING = data((CASES / "good" / "everything.yaml").read_bytes())
del EVERYTHING["include"]


HEAD = {name: EVERYTHING.pop(name) for name in ("cqos", "instances")}


def parts(document):
    """One document for each entry of a section: no fault of one shows in another, and reading a whole takes long."""
    yield HEAD
    for name, section in document.items():
        entries = [{key: entry} for key, entry in section.items()] if isinstance(section, dict) else [section]
        yield from ({**HEAD, name: entry} for entry in entries)


VALUES: list[Any] = [
    *(None, True, False, 0, 1, 7, 1.5, -1),
    *("", "x", "a b", "(", "[a&&b]", "2027-02-30"),
    *([], [1], ["x"], ["x", "x"], [None], [""], [[]], [{}], [{"": 1}], [True, 2.5]),
    *({}, {"a": 1}, {"a": None}, {"a": {}}, {"": 1}, {"": None}, {"a": {"": {}}}, {"profile": 1}, {"at_least": 2}),
    *({"not": [None]}, {"one_of": [None]}, {"one_of": []}),
]


def changed(document):
    """Yield every document that one value, name or key less makes of ``document``, with what was done.

    In the short form each place gets a part of the values; the places take turns, and most forms stand at many places.
    """
    for number, path in enumerate(paths(document)):
        if not path or (path[0] in HEAD and document is not HEAD):
            continue
        *above, last = path
        copied = copy.deepcopy(document)
        part = copied
        for name in above:
            part = part[name]
        old = part[last]
        for new in VALUES if EXPLORE else VALUES[number % 3 :: 3]:
            part[last] = new
            yield (path, new), copied
        del part[last]
        yield (path, "removed"), copied
        if isinstance(part, dict):
            for name in ("another_key", ""):
                part[name] = old
                yield (path, f"renamed to {name!r}"), copied
                del part[name]


DOCUMENTS = list(parts(EVERYTHING))


def test_the_parts_are_read():
    assert [codes(document) for document in DOCUMENTS] == [set()] * len(DOCUMENTS)


@pytest.mark.explored
@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda document: "-".join([*document][2:]) or "head")
def test_schema_and_reader_agree(document):
    differing = []
    for how, each in changed(document):
        found = codes(each)
        valid = STRUCTURAL.is_valid(each)
        if (valid and found & STRUCTURE) or not (valid or found):
            differing.append((*how, found))
    assert differing == []


# --- what packs suggest ---

STATED = [
    (pack, policy)
    for pack in PACKS
    for policy in pack.policies
    if policy.level != "need" or "subscriber" in policy.roles
    if not policy.derived
]
ODD = ["no such value", "", 0, -1.5, True, None, [], ["a", 1, None], "${x}"]


def suggestions(part, name):
    """The values suggested for a setting, apart from the `true` that takes any other."""
    *closed, anything = COMPLETING["$defs"][part]["properties"][name].get("anyOf", [True])
    assert anything is True
    return [value for each in closed for value in each["enum"]]


def as_read(value):
    """The text that the reader makes of a value below a setting."""
    root = only_document(SourceReading(Source("f.json", json.dumps({"x": value}).encode()), [], []))
    assert isinstance(root, MappingNode)
    return flow_text(root.entries["x"][1])


def test_every_setting_is_suggested_with_values_that_its_pack_reads():
    for pack, policy in STATED:
        name = written_name(policy)
        index = pack.find(policy.level, name)
        assert index is not None
        assert pack.policies[index] is policy
        offered = suggestions(f"{policy.level}_settings", name)
        for value in suggested_values(policy):
            assert value in offered
            text = as_read(value)
            if policy.domain.word(text) not in policy.words:
                assert policy.domain.has(policy.domain.parse(text)), f"{pack.id}: {name}: {text}"


FORMS = {name: each for name, each in PLAIN["$defs"].items() if each == COMPLETING["$defs"][name]}


def test_packs_change_nothing_but_suggestions():
    assert PLAIN["$defs"].keys() == COMPLETING["$defs"].keys()
    assert {**PLAIN, "$defs": FORMS} == {**COMPLETING, "$defs": FORMS}
    suggesting = r"\w+_(settings|presets|options)|pack_options|packs"
    assert [name for name in COMPLETING["$defs"].keys() - FORMS if not re.fullmatch(suggesting, name)] == []


def test_no_suggestion_refuses_anything():
    names = {written_name(policy) for _, policy in STATED}
    for part in COMPLETING["$defs"].keys() - FORMS:
        suggested = Draft202012Validator({"$ref": f"#/$defs/{part}", "$defs": COMPLETING["$defs"]})
        for value in ODD:
            settings = dict.fromkeys(names, value)
            for each in (value, settings, {pack.id: settings for pack in PACKS}):
                assert [error.message for error in suggested.iter_errors(each)] == []


@pytest.mark.parametrize("schema", [PLAIN, COMPLETING], ids=["plain", "completing"])
def test_every_part_is_there_and_used(schema):
    assert set(re.findall(r'"#/\$defs/(\w+)"', json.dumps(schema))) == set(schema["$defs"])


def test_an_editor_completes_settings_values_presets_options_and_needs():
    ros2 = next(pack for pack in PACKS if pack.id == "ros2")
    assert {"best_effort", "reliable", "system_default"} <= {*suggestions("endpoint_settings", "reliability")}
    assert suggestions("need_settings", "latest") == [False, True]
    presets = [each["const"] for each in COMPLETING["$defs"]["endpoint_presets"]["anyOf"][:-1]]
    assert {*ros2.presets} <= {*presets}
    options = COMPLETING["$defs"]["pack_options"]["properties"]["ros2"]["properties"]
    assert "cyclonedds" in options["rmw"]["anyOf"][0]["enum"]
