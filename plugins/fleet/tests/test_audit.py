"""``cqos audit`` says of a table what ``cqos check`` says of the same system."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core.api import context
from cqos_core.plugins import load_plugins
from plugins.fleet.tests.needed import needed
from plugins.fleet.tests.random_fleet import any_options, any_settings, said_by_check, write_fleet
from tests.command_process import run_here
from tests.effort import EXPLORE

if TYPE_CHECKING:
    from pathlib import Path


def audited(folder: Path, **wanted: Any) -> tuple[dict[str, int], Counter[tuple[str, str]]]:
    """Return pairs by verdict, and pairs of findings by code and severity."""
    for name in ("narwhals", "duckdb", "polars"):
        needed(name)
    parquet = needed("pyarrow.parquet") if needed("pyarrow") else None
    from cqos_fleet.fleet import WantedAudit, run_audit

    output = folder / "findings.parquet"
    result = run_audit(WantedAudit(output=output, severity="note", **wanted), context())
    found = Counter[tuple[str, str]]()
    for row in parquet.read_table(output).to_pylist():
        found[row["code"], row["severity"]] += row["pairs"]
    return dict(result.totals), found


@pytest.mark.parametrize(
    ("protocols", "engine", "seed", "systems"),
    [
        ("ros2", "polars", 2, 3),
        ("mqtt", "duckdb", 4, 2),
        ("ros2 dds", "duckdb", 5, 2),
        ("mqtt ros2", "polars", 6, 1),
    ],
)
def test_an_audit_says_what_a_check_says(protocols, engine, seed, systems, tmp_path):
    path = tmp_path / "fleet.csv"
    write_fleet(path, protocols, seed, systems=systems)
    verdicts, findings = said_by_check(path)
    totals, found = audited(tmp_path, path=str(path), engine=engine)
    assert {name: totals.get(name, 0) for name in ("compatible", "incompatible", "unknown")} == {
        name: verdicts[name] for name in ("compatible", "incompatible", "unknown")
    }
    assert found == findings
    assert set(found) == set(findings)


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(100 if EXPLORE else 1))
@pytest.mark.parametrize("protocol", ["dds", "ros2"])
def test_an_audit_of_any_settings_says_what_a_check_says(protocol, seed, tmp_path):
    """Settings of eight policies at random, some wrong, and options of the pack that are open or not."""
    path = tmp_path / "fleet.csv"
    write_fleet(path, protocol, seed, 150, 1 + seed % 2, {protocol: any_settings(protocol, seed)})
    options = any_options(protocol, seed)
    verdicts, findings = said_by_check(path, options)
    totals, found = audited(tmp_path, path=str(path), engine=("duckdb", "polars")[seed % 2], options=options)
    assert {name: totals.get(name, 0) for name in verdicts} == verdicts
    assert found == findings


def test_two_audits_of_one_fleet_say_the_same_in_any_order_of_rows(tmp_path):
    needed("duckdb")
    write_fleet(tmp_path / "fleet.csv", "ros2", 8, 400)
    head, *rows = (tmp_path / "fleet.csv").read_text("utf-8").splitlines()
    (tmp_path / "back.csv").write_text("\n".join([head, *reversed(rows)]) + "\n", "utf-8")
    found = [run_here(["audit", name, "--format", "json"], tmp_path) for name in ("fleet.csv", "back.csv")]
    assert json.loads(found[0].out) == json.loads(found[1].out)


TABLE = """role,topic,reliability,version
publisher,/a,best_effort,2
publisher,/a,reliable,1
subscriber,/a,reliable,1
"""


def test_pairs_between_versions_are_counted(tmp_path):
    needed("duckdb")
    (tmp_path / "fleet.csv").write_text(TABLE, "utf-8")
    done = run_here(["audit", "fleet.csv", "--protocol", "ros2", "--format", "json"], tmp_path)
    assert done.code == 1, done.err
    found = json.loads(done.out)
    (finding,) = found["findings"]
    assert (finding["code"], finding["pairs"], finding["between_versions"]) == ("ROS101", 1, 1)
    assert found["totals"]["compatible"] == 1


def test_a_clean_fleet_is_one_line_and_goes_on_where_it_was(tmp_path):
    needed("duckdb")
    (tmp_path / "fleet.csv").write_text(TABLE.replace("best_effort", "reliable"), "utf-8")
    arguments = ["audit", "fleet.csv", "--protocol", "ros2", "--work", "stages"]
    for _ in range(2):
        done = run_here(arguments, tmp_path)
        assert done.code == 0, done.err
        assert done.out == "3 endpoints, 1 topic, 3 profiles; pairs: 2 compatible, 0 incompatible, 0 unknown\n"


@pytest.mark.parametrize(
    ("table", "arguments", "message"),
    [
        (TABLE, [], "no column `protocol`"),
        (TABLE, ["--protocol", "rosy"], "no rule pack `rosy`"),
        (
            TABLE.replace("reliability", "skip"),
            ["--protocol", "mqtt", "--exclude-column", "skip"],
            "needs a column `participant`",
        ),
        (TABLE.replace("reliability", "reliabilty"), ["--protocol", "ros2"], "did you mean `reliability`"),
        (TABLE.replace("subscriber", "subscribr"), ["--protocol", "ros2"], "role `subscribr`"),
        ("topic\n/a\n", ["--protocol", "ros2"], "no column `role`"),
        (TABLE.replace("role,", "Role,"), ["--protocol", "ros2"], "did you write `Role`?"),
        (TABLE.replace("subscriber,/a", "subscriber,"), ["--protocol", "ros2"], "no topic in 1 row"),
        ("role,topic\n", ["--protocol", "ros2"], "has no rows"),
        ("", ["--protocol", "ros2"], "is empty"),
        (TABLE.replace("/a,reliable,1", "/a"), ["--protocol", "ros2"], "other numbers of columns"),
        (TABLE, ["--protocol", "ros2", "--findings", "nowhere/found.parquet"], "there is no folder `nowhere`"),
        (TABLE, ["--protocol", "ros2", "--work", "fleet.csv"], "is a file\nhelp: name a folder"),
        (TABLE, ["--protocol", "ros2", "--option", "rosy.rmw=x"], "no rule pack `rosy`"),
        (TABLE, ["--protocol", "ros2", "--findings", "."], "is a folder\nhelp: name a file"),
        (TABLE, ["--protocol", "ros2", "--spark", "host:7077"], "write spark://HOST:PORT"),
        (TABLE, ["--protocol", "ros2", "--exclude-column", "verson"], "has no such column\nhelp: it has role, topic,"),
        (TABLE, ["--protocol", "ros2", "--memory", "1KB"], "Out of Memory Error"),
        (TABLE.replace("reliability", "number"), ["--protocol", "ros2"], "column `number` names no policy"),
        (TABLE.replace("subscriber,/a", "subscriber, "), ["--protocol", "ros2"], "no topic in 1 row"),
        (TABLE.replace(",/a", ',"/a', 1), ["--protocol", "ros2"], "a quote is not closed"),
        (
            TABLE + "publisher,/a,reliable,1\n" * 50_000 + "publisher,/a,reliable,1,x\n",
            ["--protocol", "ros2"],
            "Line: 50005",
        ),
        (TABLE + "publisher,/\udcff,reliable,1\n", ["--protocol", "ros2"], "not utf-8"),
    ],
)
def test_a_table_that_cannot_be_audited_is_refused(table, arguments, message, tmp_path):
    needed("duckdb")
    (tmp_path / "fleet.csv").write_text(table, "utf-8", "surrogateescape")
    done = run_here(["audit", "fleet.csv", *arguments], tmp_path)
    assert done.code == 2
    assert message in done.err


@pytest.mark.parametrize(
    ("participants", "code", "message"),
    [
        ("{}", 2, "error: robot.yaml: there is no endpoint in it, so nothing was checked\n"),
        (
            "{a: {publishes: {t: }}}",
            1,
            "error: no pair was compared: no publisher matches a subscriber in what was read\n",
        ),
        ("{a: {publishes: {t: }}, b: {subscribes: {t: }}}", 0, ""),
    ],
)
def test_an_audit_that_compares_nothing_says_so(participants, code, message, tmp_path):
    needed("duckdb")
    (tmp_path / "robot.yaml").write_text(f"cqos: 1\nprotocol: ros2\nparticipants: {participants}\n", "utf-8")
    done = run_here(["audit", "robot.yaml"], tmp_path)
    assert (done.code, done.err) == (code, message)


def test_an_endpoint_with_two_wrong_values_is_one_endpoint(tmp_path):
    needed("duckdb")
    table = "role,topic,depth,deadline\npublisher,/a,99999999999999999999999,1e400s\nsubscriber,/a,-1,-5ms\n"
    (tmp_path / "fleet.csv").write_text(table, "utf-8")
    found = json.loads(run_here(["audit", "fleet.csv", "--protocol", "ros2", "--format", "json"], tmp_path).out)
    assert [(each["code"], each["endpoints"]) for each in found["findings"]] == [("CQ203", 2)]
    assert found["totals"]["unknown"] == 1


@pytest.mark.parametrize("protocol", ["ros2", "dds"])
def test_plain_names_are_what_endpoints_match_on(protocol):
    import re

    from cqos_core.packs import NameContext

    pack = load_plugins().pack(protocol)
    for name in ("/a", "/robot_1/scan", "/a/b_c/d", "Square", "a", "/a__b", "/_a", "/1a", "/a/", "~/x", "a b"):
        if re.fullmatch(pack.topic_matching.plain, name):
            named = pack.topic_matching.resolve(
                name, NameContext("/ns/node", None, {}, {}, "message", "yaml", "publisher")
            )
            assert (named.key, named.problems) == (name, ())


def test_stages_of_other_rules_are_not_read_again():
    needed("narwhals")
    from cqos_fleet.fleet import _edition

    pack = load_plugins().pack("ros2")
    assert pack is not None
    fewer = replace(pack, rules=pack.rules[1:])
    assert _edition(fewer) != _edition(pack) == _edition(replace(pack))
