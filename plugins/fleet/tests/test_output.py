"""What ``cqos audit --findings`` writes, and what it refuses to replace."""

from __future__ import annotations

import csv
import json
import shutil

import pytest

from plugins.fleet.tests.needed import needed
from tests.command_process import run_here

pytestmark = pytest.mark.usefixtures("engines")

TABLE = "role,participant,topic,reliability\npublisher,a,/t,best_effort\nsubscriber,b,/t,reliable\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "fleet.csv").write_text(TABLE, "utf-8")
    return tmp_path


def audited(folder, output, source="fleet.csv"):
    return run_here(["audit", source, "--protocol", "ros2", "--findings", output], folder)


@pytest.mark.parametrize("output", ["fleet.csv", "./fleet.csv", "link.csv", "hard.csv", "deep/../fleet.csv"])
def test_the_source_is_never_replaced(output, folder):
    (folder / "link.csv").symlink_to("fleet.csv")
    (folder / "hard.csv").hardlink_to(folder / "fleet.csv")
    (folder / "deep").mkdir()
    done = audited(folder, output)
    assert done.code == 2
    assert f"`--findings {output.removeprefix('./')}` is a part of `fleet.csv` and would be overwritten" in done.err
    assert (folder / "fleet.csv").read_text("utf-8") == TABLE


def test_a_folder_that_is_one_table_gets_no_further_file(folder):
    parquet = needed("pyarrow.parquet")
    table = needed("pyarrow").table({"role": ["publisher", "subscriber"], "topic": ["/t", "/t"]})
    (folder / "fleet.parquet").mkdir()
    parquet.write_table(table, folder / "fleet.parquet" / "1.parquet")
    done = audited(folder, "fleet.parquet/findings.parquet", "fleet.parquet")
    assert done.code == 2
    assert [each.name for each in (folder / "fleet.parquet").iterdir()] == ["1.parquet"]


def test_a_system_in_a_folder_is_never_replaced_and_earlier_findings_are(folder):
    robots = folder / "robots"
    robots.mkdir()
    text = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/t: }}, b: {subscribes: {/t: }}}\n"
    (robots / "a.yaml").write_text(text, "utf-8")
    (robots / "a.csv").symlink_to("a.yaml")
    assert "would be overwritten" in audited(folder, "robots/a.csv", "robots").err
    assert (robots / "a.yaml").read_text("utf-8") == text
    for _ in range(2):
        assert audited(folder, "robots/findings.parquet", "robots").code == 0


@pytest.mark.parametrize(("output", "ending"), [("found.txt", "`.txt`"), ("found", "a name without an ending")])
def test_an_ending_that_is_no_format_is_refused_with_those_that_are(output, ending, folder):
    done = audited(folder, output)
    assert done.code == 2
    assert f"no format of findings has {ending}\nhelp: write one of .parquet, .csv, .ndjson, .jsonl" in done.err
    assert not (folder / output).exists()


def test_the_ending_decides_the_format(folder):
    for output in ("found.parquet", "found.csv", "found.ndjson", "found.jsonl"):
        assert audited(folder, output).code == 1
    wanted = needed("pyarrow.parquet").read_table(folder / "found.parquet").to_pylist()
    assert [each["code"] for each in wanted] == ["ROS101"]
    for name in ("found.ndjson", "found.jsonl"):
        assert [json.loads(line) for line in (folder / name).read_text("utf-8").splitlines()] == wanted
    with (folder / "found.csv").open(encoding="utf-8", newline="") as file:
        assert [*csv.DictReader(file)] == [{key: str(value) for key, value in each.items()} for each in wanted]
    assert not [each for each in folder.iterdir() if each.suffix == ".part"]


@pytest.mark.parametrize("output", ["found.parquet", "found.csv", "found.ndjson"])
def test_a_run_without_findings_replaces_those_of_the_run_before(output, folder):
    audited(folder, output)
    before = (folder / output).read_bytes()
    (folder / "fleet.csv").write_text(TABLE.replace("best_effort", "reliable"), "utf-8")
    assert audited(folder, output).code == 0
    assert (folder / output).read_bytes() != before


def test_a_part_of_another_name_is_left(folder):
    shutil.copy(folder / "fleet.csv", folder / "found.parquet.part")
    audited(folder, "found.parquet")
    assert (folder / "found.parquet.part").read_text("utf-8") == TABLE
