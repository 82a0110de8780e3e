"""``cqos audit`` reads tables, databases and system files, goes on after it was killed, and says in which order to update."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from plugins.fleet.tests.needed import needed
from plugins.fleet.tests.random_fleet import write_fleet
from tests.command_process import run_here

if TYPE_CHECKING:
    from collections.abc import Callable

ROWS = [
    {
        "role": "publisher",
        "topic": "/scan",
        "participant": "a",
        "reliability": "best_effort",
        "depth": "5",
        "version": "1",
    },
    {
        "role": "publisher",
        "topic": "/scan",
        "participant": "b",
        "reliability": "reliable",
        "depth": "5",
        "version": "2",
    },
    {
        "role": "subscriber",
        "topic": "/scan",
        "participant": "c",
        "reliability": "reliable",
        "depth": "5",
        "version": "2",
    },
    {
        "role": "subscriber",
        "topic": "/scan",
        "participant": "d",
        "reliability": "best_effort",
        "depth": "5",
        "version": "1",
    },
    {"role": "subscriber", "topic": "/scann", "participant": "d", "reliability": "", "depth": "", "version": "1"},
]


def said(folder: Path, *arguments: str) -> dict[str, Any]:
    needed("duckdb")
    done = run_here(["audit", *arguments, "--format", "json"], folder)
    assert done.code in {0, 1}, done.err
    found: dict[str, Any] = json.loads(done.out)
    return found


def _csv(path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [*ROWS[0]])
        writer.writeheader()
        writer.writerows(ROWS)


def _ndjson(path: Path) -> None:
    # Numbers stay what they are, and a key may appear late.
    texts = [{key: int(text) if key == "depth" else text for key, text in row.items() if text} for row in ROWS]
    path.write_text("".join(f"{json.dumps(row)}\n" for row in texts), "utf-8")


def _parquet(path: Path) -> None:
    pyarrow, parquet = needed("pyarrow"), needed("pyarrow.parquet")
    parquet.write_table(pyarrow.Table.from_pylist([{k: t or None for k, t in row.items()} for row in ROWS]), path)


def _duckdb(path: Path) -> None:
    with needed("duckdb").connect(str(path)) as db:
        db.register("rows", needed("pyarrow").Table.from_pylist(ROWS))
        db.execute("CREATE TABLE endpoints AS SELECT * FROM rows")


@pytest.mark.parametrize(
    ("name", "write", "engine"),
    [
        ("fleet.csv", _csv, "duckdb"),
        ("fleet.csv", _csv, "polars"),
        ("fleet.ndjson", _ndjson, "duckdb"),
        ("fleet.jsonl", _ndjson, "polars"),
        ("fleet.parquet", _parquet, "duckdb"),
        ("fleet.duckdb", _duckdb, "duckdb"),
    ],
)
def test_each_source_says_the_same(name: str, write: Callable[[Path], None], engine: str, tmp_path: Path) -> None:
    needed("duckdb")
    write(tmp_path / name)
    found = said(tmp_path, name, "--protocol", "ros2", "--engine", engine)
    assert [(each["code"], each["topics"], each["pairs"], each["between_versions"]) for each in found["findings"]] == [
        ("ROS101", 1, 1, 1),
        ("CQ401", 1, 0, 0),
    ]
    assert found["findings"][1]["examples"][0]["help"] == "did you mean `/scan`?"
    assert found["totals"]["compatible"] == 3
    assert found["updates"] == [
        {"old": "1", "new": "2", "publishers_first": 1, "subscribers_first": 0, "at_once": 0, "unavoidable": 0}
    ]


def test_a_folder_of_parquet_files_is_one_table(tmp_path):
    (tmp_path / "fleet.parquet" / "protocol=ros2").mkdir(parents=True)
    file = tmp_path / "fleet.parquet" / "protocol=ros2" / "part-0.parquet"
    _parquet(file)
    (tmp_path / "fleet.parquet" / "_SUCCESS").touch()
    arguments = ["fleet.parquet", "--work", "stages"]
    assert said(tmp_path, *arguments)["totals"]["incompatible"] == 1
    pyarrow, parquet = needed("pyarrow"), needed("pyarrow.parquet")
    parquet.write_table(pyarrow.Table.from_pylist([each | {"reliability": "reliable"} for each in ROWS]), file)
    assert said(tmp_path, *arguments)["totals"]["incompatible"] == 0


@pytest.mark.parametrize("line", ["[]", "1", '[{"role": "publisher", "topic": "/a"}]', ""])
def test_lines_that_are_no_objects_are_refused(line, tmp_path):
    needed("duckdb")
    (tmp_path / "fleet.ndjson").write_text(f"{line}\n", "utf-8")
    done = run_here(["audit", "fleet.ndjson", "--protocol", "ros2"], tmp_path)
    assert (done.code, "write a JSON object in each line" in done.err) == (2, True), done.err


SYSTEM = """cqos: 1
protocol: ros2
participants:
  camera: {publishes: {/image: {reliability: best_effort}}}
  viewer: {subscribes: {/image: {reliability: reliable}}}
"""


def test_a_folder_of_system_files_is_a_fleet(tmp_path):
    needed("duckdb")
    for name, text in (
        ("one", SYSTEM),
        ("", SYSTEM),
        ("three", SYSTEM.replace("best_effort", "reliable")),
    ):
        (tmp_path / "fleet" / name).mkdir(parents=True, exist_ok=True)
        (tmp_path / "fleet" / name / "robot.yaml").write_text(text, "utf-8")
    found = said(tmp_path, "fleet", "--findings", "findings.parquet")
    (finding,) = found["findings"]
    assert (finding["code"], finding["topics"], finding["pairs"]) == ("ROS101", 2, 2)
    assert found["totals"]["incompatible"] == 2
    assert found["totals"]["compatible"] == 1
    rows = needed("pyarrow.parquet").read_table(tmp_path / "findings.parquet").to_pylist()
    assert {row["system"] for row in rows} == {"fleet/one/robot.yaml", "fleet/robot.yaml"}
    assert {row["publisher_settings"] for row in rows} == {'{"reliability": "best_effort"}'}


def test_a_file_that_cannot_be_read_is_refused_with_its_place(tmp_path):
    needed("duckdb")
    (tmp_path / "fleet").mkdir()
    (tmp_path / "fleet" / "robot.yaml").write_text("cqos: 1\nparticipants: [", "utf-8")
    done = run_here(["audit", "fleet"], tmp_path)
    assert done.code == 2
    assert "robot.yaml" in done.err
    assert "Traceback" not in done.err


def test_an_audit_that_was_killed_goes_on(tmp_path):
    needed("duckdb")
    write_fleet(tmp_path / "fleet.csv", "ros2", 8, 400)
    command = [str(Path(sys.executable).with_name("cqos")), "audit", "fleet.csv", "--work", "stages"]
    started = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 120
    while started.poll() is None and not [*tmp_path.glob("stages/*/*/topics.parquet")] and time.monotonic() < end:
        time.sleep(0.01)
    os.kill(started.pid, signal.SIGKILL)
    started.wait()
    (kept,) = tmp_path.glob("stages/*/*/topics.parquet")
    written = kept.stat().st_mtime_ns
    again = run_here(["audit", "fleet.csv", "--work", "stages", "--format", "json"], tmp_path)
    assert kept.stat().st_mtime_ns == written
    afresh = run_here(["audit", "fleet.csv", "--format", "json"], tmp_path)
    assert json.loads(again.out) == json.loads(afresh.out)


def test_a_broker_of_many_clients_is_checked_with_its_filters(tmp_path):
    needed("duckdb")
    table = (
        "role,topic,participant,qos\npublisher,plant/1/temp,sensor1,0\npublisher,plant/2/temp,sensor2,1\n"
        "subscriber,plant/+/temp,panel,2\nsubscriber,$share/g/plant/#,store,0\nsubscriber,Plant/+/temp,old,0\n"
    )
    (tmp_path / "clients.csv").write_text(table, "utf-8")
    found = said(tmp_path, "clients.csv", "--protocol", "mqtt", "--show", "notes")
    pairs = {each["code"]: each["pairs"] for each in found["findings"]}
    assert pairs["MQTT103"] == 2
    assert "CQ401" in pairs
    assert sum(found["totals"].get(each, 0) for each in ("compatible", "incompatible", "unknown")) == 4
