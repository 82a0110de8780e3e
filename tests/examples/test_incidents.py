"""The public incidents of examples/incidents: what C-QoS says of each is what their index states, and the page shows it."""

import json
import sys
from pathlib import Path

import pytest
import yaml

from tests import command

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "incidents"
INCIDENTS = yaml.safe_load((FOLDER / "incidents.yaml").read_text(encoding="utf-8"))["incidents"]


@pytest.mark.parametrize("incident", INCIDENTS, ids=[each["id"] for each in INCIDENTS])
def test_an_incident_is_reported_as_its_index_says(incident):
    options = [*incident.get("arguments", []), "--together", "--no-config", "--format", "json"]
    done = command.run(["check", *incident["files"], *options], FOLDER / incident["id"])
    report = json.loads(done.out)
    codes = {finding["code"] for finding in report["findings"] if finding["severity"] != "note"}
    assert (report["verdict"], sorted(codes)) == (incident["verdict"], incident["codes"])


def test_the_index_names_every_folder_and_every_file():
    assert {each["id"] for each in INCIDENTS} == {path.name for path in FOLDER.iterdir() if path.is_dir()}
    for each in INCIDENTS:
        assert each["files"] == sorted(path.name for path in (FOLDER / each["id"]).iterdir())
        assert len([other for other in INCIDENTS if other["thread"] == each["thread"]]) == 1


def test_an_incident_is_not_found_without_a_finding():
    assert [each["id"] for each in INCIDENTS if each["result"] != "missed" and not each["codes"]] == [
        "resource-history"
    ]


def test_the_page_is_that_of_the_index():
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        from incidents import incidents_page
    finally:
        sys.path.pop(0)
    assert (ROOT / "docs" / "incidents.md").read_text(encoding="utf-8") == incidents_page(INCIDENTS)
