"""Conditions as columns mean what they mean in Python: in DuckDB, Polars, SQL and JavaScript."""

from __future__ import annotations

import json
import re
import subprocess
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core.plugins import load_plugins
from cqos_fleet.source_text import answers, as_javascript, as_sql, compiled_pack
from cqos_fleet.writers import pattern_of
from plugins.fleet.tests.needed import needed
from plugins.fleet.tests.random_ends import random_ends
from plugins.fleet.tests.tried_rules import PAIRS, Tried, answers_in, both_ends, both_kinds, both_kinds_over
from tests.effort import EXPLORE
from tests.random_rules import any_rules

if TYPE_CHECKING:
    from pathlib import Path

    from cqos_core.packs import RulePack
    from plugins.fleet.tests.random_ends import End

WITHOUT_FORM = {
    "ros2": {"ROS319", "ROS320", "ROS321", "ROS411"},
    "dds": {
        *("DDS112", "DDS114", "DDS225", "DDS311", "DDS321", "DDS326", "DDS327", "DDS343", "DDS344", "DDS345", "DDS355"),
        *("DDS403", "DDS404", "DDS407", "DDS408"),
    },
    "mqtt": {"MQTT621", "MQTT625"},
}
"""Rules of pairs and endpoints that are asked in Python, beside those of guarantees."""


seeds = pytest.mark.parametrize("seed", range(40 if EXPLORE else 1))


@pytest.fixture(params=sorted(WITHOUT_FORM))
def pack(request: pytest.FixtureRequest) -> RulePack:
    found = load_plugins().pack(request.param)
    assert found is not None
    return found


def test_every_rule_has_a_column_form_or_is_listed(pack):
    others = {bound.rule.code for bound, _ in compiled_pack(pack).others if not bound.rule.guarantee}
    assert others == WITHOUT_FORM[pack.id]


@pytest.mark.explored
@seeds
def test_sql_in_duckdb_says_what_python_says(pack, seed):
    duckdb = needed("duckdb")
    pyarrow = needed("pyarrow")
    text = as_sql(pack)
    queries = [each for each in text.split(";\n") if "SELECT" in each]
    assert len(queries) == 2
    for query, (_, tried) in zip(queries, both_kinds(pack, seed), strict=True):
        with duckdb.connect() as db:
            for side, table in enumerate(("offered", "requested")):
                db.register(table, pyarrow.table(tried.table(side)))
            db.execute("CREATE VIEW endpoints AS SELECT * FROM offered")
            found = db.sql(query).to_arrow_table().to_pylist()
        found.sort(key=lambda row: int(row.get("publisher", row.get("endpoint"))))
        for row, expected in zip(found, tried.expected, strict=True):
            assert None not in row.values()
            named = dict(zip(map(id, tried.rules), expected, strict=True))
            assert {name: (row[name], row[f"{name}.unknown"]) for name, _ in answers(tried.rules)} == {
                name: named[id(rule)] for name, rule in answers(tried.rules)
            }


def test_sql_runs_over_tables_made_as_its_first_lines_say(pack):
    text = as_sql(pack)
    columns = ["id VARCHAR", "topic VARCHAR"]
    for name, described in re.findall(r"^--   ([\w.]+): (.*)$", text.split("-- Columns", 1)[1], re.MULTILINE):
        kind = "VARCHAR" if described.startswith("text") else "BIGINT"
        columns += [f'"{name}.{end}" {kind} NOT NULL' for end in ("least", "most")]
    with needed("duckdb").connect() as db:
        for table in ("offered", "requested", "endpoints"):
            db.execute(f"CREATE TABLE {table} ({', '.join(columns)})")
        assert [db.sql(each).fetchall() for each in text.split(";\n") if "SELECT" in each] == [[], []]


@pytest.mark.explored
@seeds
def test_javascript_says_what_python_says(pack, seed, tmp_path):
    (tmp_path / "pack.mjs").write_text(as_javascript(pack), "utf-8")
    for kind, (_, tried) in zip(("pair", "endpoint"), both_kinds(pack, seed), strict=True):
        rows = [[_row(tried, end) for end in pair] for pair in tried.ends]
        found = in_node(tmp_path, kind, rows)
        for row, expected in zip(found, tried.expected, strict=True):
            named = dict(zip(map(id, tried.rules), expected, strict=True))
            for name, rule in answers(tried.rules):
                assert (row[name], row[f"{name}.unknown"]) == named[id(rule)], (name, row)


def _row(tried: Tried, end: End) -> dict[str, Any]:
    cells = zip(tried.columns, end.cells(tried.pack, tried.columns), strict=True)
    return {tried.name(at): {"n": str(cell)} if isinstance(cell, int) else cell for at, cell in cells}


def in_node(folder: Path, kind: str, rows: list[Any]) -> list[dict[str, bool]]:
    """Ask the module of a pack in node; whole numbers become BigInt."""
    (folder / "rows.json").write_text(json.dumps(rows), "utf-8")
    script = (
        "import * as pack from './pack.mjs'; import { readFileSync } from 'node:fs';"
        "const rows = JSON.parse(readFileSync('rows.json', 'utf-8'),"
        " (_, each) => (each !== null && typeof each === 'object' && typeof each.n === 'string' ? BigInt(each.n) : each));"
        f"console.log(JSON.stringify(rows.map((row) => pack.{kind}(...row))));"
    )
    (folder / "run.mjs").write_text(script, "utf-8")
    needed("node", program=True)
    done = subprocess.run(["node", "run.mjs"], cwd=folder, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr[:2000]
    found: list[dict[str, bool]] = json.loads(done.stdout)
    return found


@pytest.mark.explored
@seeds
def test_narwhals_says_what_python_says(pack, seed):
    """One engine, in turns: planning all rules of a pack costs more than asking them."""
    engine = ("polars", "duckdb")[(seed + sorted(WITHOUT_FORM).index(pack.id)) % 2]
    nw, native = needed("narwhals"), needed(engine)
    for _, tried in both_kinds(pack, seed):
        table = both_ends(tried)
        if engine == "duckdb":
            db = native.connect()
            frame = nw.from_native(db.from_arrow(table))
        else:
            frame = nw.from_native(native.from_arrow(table).lazy())
        assert answers_in(frame, tried) == [[*each] for each in tried.expected]


@pytest.mark.explored
@seeds
@pytest.mark.parametrize("engine", ["polars", "duckdb"])
def test_random_conditions_say_as_columns_what_python_says(engine, seed):
    pack = any_rules(150, seed)
    nw, native = needed("narwhals"), needed(engine)
    for _, some in both_kinds_over(pack, random_ends(pack, PAIRS, str(seed))):
        table = both_ends(some)
        frame = native.from_arrow(table).lazy() if engine == "polars" else native.connect().from_arrow(table)
        assert len(some.rules) > 10
        found = answers_in(nw.from_native(frame), some)
        for at, rule in enumerate(some.rules):
            expected = [each[at] for each in some.expected]
            assert [each[at] for each in found] == expected, rule.bound.rule.condition


@pytest.mark.parametrize("pattern", ["*[!A-Za-z0-9_/]*", "*//*", "*/[0-9]*", "a.b?", "*/_*", "[]a]x", "a|b(c)"])
def test_patterns_mean_what_the_shell_means(pattern):
    from fnmatch import fnmatchcase

    read = re.compile(rf"(?s)\A{pattern_of(pattern)}\Z")
    for text in ("/a/b", "a.bc", "axbc", "//", "/a//b", "/1", "a/9b", "/_a", "]x", "ax", "a|b(c)", "a\nb", ""):
        assert bool(read.match(text)) is fnmatchcase(text, pattern), text
