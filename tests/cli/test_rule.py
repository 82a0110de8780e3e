"""``cqos rule``, ``cqos packs``, ``cqos schema``: what there is to look up."""

import json
import shutil
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from cqos_core.model.codes import CODES
from cqos_core.packs.rule_docs import Page, Sample, as_text
from cqos_core.plugins import load_plugins

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.parametrize("name", ["ROS101", "ros101", "reliability-weaker-than-requested"])
def test_table_1_of_the_paper_is_derived(cqos, name):
    done = cqos("rule", name)
    assert done.code == 0
    assert [
        line.split() for line in done.out.partition("Compatible values\n")[2].partition("\n\n")[0].splitlines()
    ] == [
        ["Publisher", "Subscriber", "Compatible"],
        ["best_effort", "best_effort", "Yes"],
        ["best_effort", "reliable", "No"],
        ["reliable", "best_effort", "Yes"],
        ["reliable", "reliable", "Yes"],
    ]


def test_a_rule_says_what_it_checks_why_and_what_to_do(cqos):
    out = cqos("rule", "ROS101").out
    assert out.startswith("ROS101 reliability-weaker-than-requested\n")
    assert "offered(reliability) >= requested(reliability)" in out
    assert "Source: " in out
    assert "Change `reliability` of the publisher, or `reliability` of the subscriber." in out


def conditions():
    for pack_id, pack in ((pack_id, load_plugins().pack(pack_id)) for pack_id in ("dds", "mqtt", "ros2")):
        for each in (pack, *pack.variants.values()):
            for rule in each.rules:
                yield f"{pack_id} {rule.code}", str(rule.condition)
            yield from ((f"{pack_id} {name}", node.text()) for name, node in each.definitions.items())


def test_no_printed_condition_is_longer_than_two_lines():
    """As ``cqos rule`` prints it, in 100 columns."""
    printed = {name: as_text(Page("", (("", (Sample(f"  {text}", "python"),)),))) for name, text in conditions()}
    lines = {name: text.strip().splitlines() for name, text in printed.items()}
    assert len(lines) > 300
    assert [name for name, each in lines.items() if len(each) > 2 or max(map(len, each)) > 100] == []


def test_definitions_are_printed_once_below_the_condition(cqos):
    out = cqos("rule", "MQTT105").out
    assert '    stated(offered(qos)) & (offered(qos) == "1") & (granted == "0")\n\n  Definitions:' in out
    assert "    granted =\n      min(requested(qos), broker(maximum_qos), broker(granted_qos))\n" in out
    document = json.loads(cqos("rule", "MQTT105", "--format", "json").out)
    assert document["condition"] == 'stated(offered(qos)) & (offered(qos) == "1") & (granted == "0")'
    assert document["definitions"] == {"granted": "min(requested(qos), broker(maximum_qos), broker(granted_qos))"}
    assert document["sentence"] == document["condition"].replace("granted ", document["definitions"]["granted"] + " ")


def test_a_withdrawn_code_leads_to_the_rule_that_replaced_it(cqos):
    out = cqos("rule", "MQTT155").out
    assert out.startswith("MQTT105 worst-pair\n")
    assert "Option `implied_needs` sets the severity: not checked for `off`, note for `note`," in " ".join(out.split())
    assert "MQTT155" in out.partition("Former codes and names")[2]


def test_a_rule_as_markdown_and_as_json(cqos):
    assert cqos("rule", "ROS101", "--format", "markdown").out.startswith("# ROS101 reliability-weaker-than-requested\n")
    document = json.loads(cqos("rule", "ROS101", "--format", "json").out)
    assert (document["version"], document["pack"], document["code"]) == (1, "ros2", "ROS101")
    assert document["sentence"] == "offered(reliability) >= requested(reliability)"
    assert len(document["table"]) == 4


@pytest.mark.parametrize("code", sorted(CODES))
def test_every_code_of_c_qos_itself_has_a_page(cqos, code):
    done = cqos("rule", code)
    assert done.code == 0
    assert done.out.startswith(f"{code} {CODES[code].name}\n")
    assert cqos("rule", CODES[code].name).out == done.out
    assert json.loads(cqos("rule", code, "--format", "json").out)["code"] == code


def test_a_rule_of_a_pack_file(cqos):
    pack = EXAMPLES / "opcua" / "opcua_pack.yaml"
    assert cqos("rule", "OPC101").code == 2
    assert "keep-alive-after-receive-timeout" in cqos("rule", "OPC101", "--pack", pack).out


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("ROS1001", "ROS101"),
        ("relibility-weaker-than-requested", "reliability-weaker-than-requested"),
        ("cqq203", "CQ203"),
    ],
)
def test_an_unknown_code_is_an_error_with_the_nearest(cqos, name, meant):
    done = cqos("rule", name)
    assert (done.code, done.out) == (2, "")
    assert f"there is no rule or code `{name}`\nhelp: did you mean `{meant}`?" in done.err


def test_a_hostile_code_gives_a_short_error(cqos):
    done = cqos("rule", "x" * 100_000)
    assert done.code == 2
    assert len(done.err) < 1000


# --- packs ---


def test_everything_installed_is_listed_with_its_distribution(cqos):
    done = cqos("packs")
    assert done.code == 0
    for name in ("ros2", "bpmn", "yaml", "sarif", "explain"):
        assert any(line.split()[:1] == [name] and "cqos" in line for line in done.out.splitlines())
    inventory = json.loads(cqos("packs", "--format", "json").out)
    assert inventory["version"] == 1
    assert {each["id"] for each in inventory["packs"]} >= {"ros2"}
    assert inventory["broken"] == []


def test_a_pack_with_its_policies_presets_options_and_rules(cqos):
    out = cqos("packs", "ros2").out
    for title in ("Policies", "Options", "Presets", "Rules"):
        assert f"\n{title}" in out
    for name in ("reliability", "rmw", "sensor_data", "ROS101"):
        assert f"\n  {name} " in out
    document = json.loads(cqos("packs", "ros2", "--format", "json").out)
    assert document["id"] == "ros2"
    assert {"policies", "presets", "rules", "functions"} <= set(document)


def test_functions_without_a_column_form_are_listed(cqos, monkeypatch):
    from dataclasses import replace

    from cqos_core.language.vocabulary import Function
    from cqos_core.plugins import Plugins, load_plugins

    pack = load_plugins().pack("ros2")
    assert pack is not None
    pack = replace(pack, functions=(Function("fits_filter", bool, "Whether a filter fits."),))
    monkeypatch.setattr(Plugins, "pack", lambda *_: pack)
    out = cqos("packs", "ros2").out
    assert "Functions without a column form\n  fits_filter  Whether a filter fits.\n" in out


def test_a_pack_file_is_listed_too(cqos):
    pack = EXAMPLES / "opcua" / "opcua_pack.yaml"
    assert "OPC101" in cqos("packs", "opcua", "--pack", pack).out
    assert "opcua" in cqos("packs", "--pack", pack).out


def test_an_unknown_pack(cqos):
    done = cqos("packs", "rso2")
    assert (done.code, done.out) == (2, "")
    assert "there is no rule pack `rso2`\nhelp: did you mean `ros2`?" in done.err


def test_a_rule_does_not_advise_to_change_what_is_derived(cqos):
    out = cqos("rule", "MQTT407").out
    assert "Change `queue_lasts`" not in out
    assert "Change what `queue_lasts` follows from: `qos`, " in out


# --- schema ---


def test_the_schema_is_one_and_fits_what_it_is_for(cqos):
    schema = json.loads(cqos("schema").out)
    Draft202012Validator.check_schema(schema)
    Draft202012Validator(schema).validate({"cqos": 1, "participants": {"a": {"publishes": {"t": "default"}}}})


def test_packs_of_the_configuration_are_known(cqos, tmp_path, monkeypatch):
    shutil.copy(EXAMPLES / "opcua" / "opcua_pack.yaml", tmp_path)
    (tmp_path / "cqos.toml").write_text('packs = ["opcua_pack.yaml"]\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert "OPC101" in cqos("rule", "OPC101").out
    assert "OPC101" in cqos("packs", "opcua").out
