"""The public incidents of examples/incidents: what C-QoS says of each is what their index states, and the page shows it."""

import sys
from pathlib import Path

import yaml

from tests import paper_tables

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "incidents"
INCIDENTS = yaml.safe_load(paper_tables.INDEX.read_text(encoding="utf-8"))["incidents"]


def test_the_index_is_what_the_tables_command_would_write():
    text = paper_tables.INDEX.read_text(encoding="utf-8")
    assert paper_tables.index(text) == text, "run: python3 dev.py tables incidents"


def test_the_tables_command_writes_only_the_answers():
    one = next(
        each for each in paper_tables.INDEX.read_text(encoding="utf-8").split("- id: ") if "codes: [ROS101]" in each
    )
    other = one.replace("verdict: incompatible", "verdict: compatible").replace("codes: [ROS101]", "codes: []")
    assert paper_tables.index(f"# head\n- id: {other}") == f"# head\n- id: {one}"


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
