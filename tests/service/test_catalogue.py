"""The catalogue says everything that `cqos packs ID --format json` says, and what a property panel needs beyond that."""

import json

import grpc
import pytest

from cqos.v1 import catalogue_pb2, check_pb2, check_pb2_grpc, report_pb2
from cqos_core.packs.catalogue import describe_pack, describe_policy
from cqos_core.plugins import load_plugins
from cqos_core.remote.client import ServiceError

PACKS = sorted(load_plugins().packs)
FIELDS = {"choice", "duration", "count", "flag", "names", "text"}


@pytest.fixture(params=PACKS)
def pack(request):
    return load_plugins().pack(request.param)


def test_packs_and_formats_are_listed(client):
    listed = client.packs()
    plugins = load_plugins()
    assert [each.id for each in listed.packs] == PACKS
    assert {each.name for each in listed.importers} == set(plugins.importers)
    assert {each.name for each in listed.exporters} == set(plugins.exporters)
    yaml = next(each for each in listed.exporters if each.name == "yaml")
    assert {each.name: tuple(each.values) for each in yaml.settings} == plugins.exporters["yaml"].choices()


def test_what_is_described_for_machines_is_in_the_message(pack, client):
    described, message = describe_pack(pack), client.pack(pack.id)
    assert set(described) <= {field.name for field in catalogue_pb2.Pack.DESCRIPTOR.fields}
    for key, kind in (("rules", "Rule"), ("functions", "Function"), ("conventions", "Convention"), ("codes", "Code")):
        known = {field.name for field in getattr(catalogue_pb2, kind).DESCRIPTOR.fields}
        for entry, sent in zip(described[key], getattr(message, key), strict=True):
            assert set(entry) <= known, f"a {kind} has a key that proto/cqos/v1/catalogue.proto does not"
            plain = {
                name: value for name, value in entry.items() if isinstance(value, (str, bool)) and name != "severity"
            }
            assert {name: getattr(sent, name) for name in plain} == plain
    for entry, sent in zip(described["rules"], message.rules, strict=True):
        rows = [{**row.values, "compatible": "Yes" if row.compatible else "No"} for row in sent.table]
        assert rows == entry["table"]
    for name, preset in pack.presets.items():
        (sent,) = [each for each in message.presets if each.name == name]
        assert (dict(sent.settings), sent.doc) == (dict(preset.settings), preset.doc)
    assert (message.base_preset or None) == pack.base_preset


def test_a_panel_can_be_drawn_for_every_policy(pack, client):
    known = {field.name for field in catalogue_pb2.Policy.DESCRIPTOR.fields}
    for policy, sent in zip(pack.policies, client.pack(pack.id).policies, strict=True):
        described = describe_policy(policy)
        assert set(described) - {"default"} <= known, "proto/cqos/v1/catalogue.proto lacks a field of policies"
        assert sent.kind in FIELDS
        assert sent.level in {"endpoint", "topic", "participant", "broker", "option", "need"}
        assert list(sent.values) == described.get("values", [])
        assert sent.expected == policy.expected()
        for role in sent.roles:
            default = sent.default_value if sent.HasField("default_value") else sent.default_by_role.get(role)
            assert default == policy.default_for(role)
            if default is not None and default not in sent.words:
                policy.domain.parse(default)  # what a panel shows can be sent back


def test_the_dialect_of_diagrams_is_there(client):
    bpmn = client.pack("ros2").dialects["bpmn"]
    assert bpmn.codes["reliability"].by_code
    assert bpmn.bare_unit == "s"


def test_a_page_learns_what_to_write_and_where(client):
    """All that a modeler needs to know beforehand is the importer's name."""
    drawn = {each.name: each.drawn for each in client.packs().importers if each.HasField("drawn")}
    assert set(drawn) == {"bpmn"}
    form = drawn["bpmn"]
    assert (form.namespace, form.prefix, form.dialect) == ("http://qos", "qos", "bpmn")
    kinds = {
        catalogue_pb2.DrawnOwnerKind.Name(each.kind).removeprefix("DRAWN_OWNER_KIND_"): each for each in form.owners
    }
    assert set(kinds) == {"EVENT", "PARTICIPANT", "SIGNAL", "MODEL"}
    meanings = {word.name: word for word in kinds["EVENT"].words}
    assert meanings["need"].meaning == catalogue_pb2.DRAWN_MEANING_REQUIREMENT
    assert meanings["need"].element
    assert [(each.name, each.required) for each in meanings["accept"].attributes] == [
        ("rule", True),
        ("because", True),
        ("until", False),
    ]
    assert meanings["policy"].foreign
    assert all(word.meaning and word.doc for owner in form.owners for word in owner.words)
    descriptor = json.loads(form.moddle)
    events = next(each for each in descriptor["types"] if "bpmn:Event" in each.get("extends", ()))
    attributes = {each["name"] for each in events["properties"]}
    for name in PACKS:
        pack = client.pack(name)
        policies = {(each.level_value, each.name): each for each in pack.policies}
        for setting in pack.dialects[form.dialect].writes:
            policy = policies[setting.level, setting.policy]
            assert policy.label
            assert policy.group in pack.groups
            assert set(setting.words) <= set(policy.words)
            if setting.level == catalogue_pb2.POLICY_LEVEL_ENDPOINT:
                assert setting.name in attributes
                assert set(setting.roles) <= set(policy.role_values)


def test_each_value_has_a_name_and_a_sentence(client):
    policy = next(each for each in client.pack("ros2").policies if each.name == "reliability")
    docs = {each.value: (each.label, each.doc) for each in policy.value_docs}
    assert docs["best_effort"] == ("Best effort", "A lost sample is not sent again.")
    assert set(docs) == {*policy.values, *policy.words}
    assert (policy.label, policy.group, policy.advanced) == ("Reliability", "Delivery", False)


def test_one_rule_is_described_by_its_code(client):
    found = client.rule("ROS101")
    assert found.pack == "ros2"
    assert found.rule in client.pack("ros2").rules
    for code in ("ROS000", found.rule.name):
        with pytest.raises(ServiceError, match=f"no installed rule pack has a rule `{code}`") as raised:
            client.rule(code)
        assert raised.value.code == "NOT_FOUND"


def test_words_have_numbers_beside_them(client):
    for name in ("ros2", "dds", "mqtt"):
        pack = client.pack(name)
        for policy in pack.policies:
            assert catalogue_pb2.PolicyLevel.Name(policy.level_value) == f"POLICY_LEVEL_{policy.level.upper()}"
            assert catalogue_pb2.ValueKind.Name(policy.kind_value) == f"VALUE_KIND_{policy.kind.upper()}"
            assert [report_pb2.Role.Name(each) for each in policy.role_values] == [
                f"ROLE_{each.upper()}" for each in policy.roles
            ]
        for rule in pack.rules:
            assert catalogue_pb2.RuleKind.Name(rule.kind_value) == f"RULE_KIND_{rule.kind.upper()}"
            assert catalogue_pb2.RuleScope.Name(rule.scope_value) == f"RULE_SCOPE_{rule.scope.upper()}"


def test_reports_name_what_judged_and_where_values_come_from(service):
    with grpc.insecure_channel(service.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        text = b"cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {t: {reliability: best_effort}}}, b: {subscribes: {t: {}}}}"
        request = check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=text)])
        report = checks.CheckDocument(request, timeout=30).report
    assert {"cqos", "cqos-ros2"} <= set(report.versions)
    origins = {
        (fact.origin_kind, fact.origin_name, fact.origin)
        for finding in report.findings
        for side in finding.sides
        for fact in side.facts
    }
    assert (report_pb2.ORIGIN_KIND_EXPLICIT, "", "explicit") in origins
    assert any(kind in {report_pb2.ORIGIN_KIND_DEFAULT, report_pb2.ORIGIN_KIND_PRESET} for kind, _, _ in origins)
    sides = [side for finding in report.findings for side in finding.sides]
    assert sides
    for side in sides:
        assert report_pb2.SideRole.Name(side.role_value) == f"SIDE_ROLE_{side.role.upper()}"
