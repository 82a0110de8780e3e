"""The form of reviewdog's diagnostics: keys, severities and positions as its documentation states them, in bytes of UTF-8."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from tests.command_process import run_here

GOLDEN = Path(__file__).with_name("golden")
TEXT = {"type": "string"}


def form(*required, **properties):
    """A map of these keys, and no others."""
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


COUNT = {"type": "integer", "minimum": 1}
POSITION = form("line", line=COUNT, column=COUNT)
RANGE = form("start", start=POSITION, end=POSITION)
DIAGNOSTIC = form(
    *("message", "location", "severity", "code"),
    message=TEXT,
    location=form("path", path=TEXT, range=RANGE),
    severity={"enum": ["ERROR", "WARNING", "INFO"]},
    code=form("value", value=TEXT, url=TEXT),
    suggestions={"type": "array", "items": form("range", "text", range=RANGE, text=TEXT)},
)
RESULT = form(
    "source",
    "diagnostics",
    source=form("name", name=TEXT, url=TEXT),
    diagnostics={"type": "array", "items": DIAGNOSTIC},
)


@pytest.mark.parametrize("file", sorted(GOLDEN.glob("*.rdjson.txt")), ids=lambda file: file.name)
def test_every_recorded_report_has_the_form(file):
    Draft202012Validator(RESULT).validate(json.loads(file.read_text(encoding="utf-8")))


def test_a_suggestion_replaces_the_bytes_that_the_fix_replaces(tmp_path):
    text = (
        "cqos: 1\nprotocol: ros2\nparticipants:\n  a: {publishes: {/t: {label: ünï𐐀, reliability: best_effort}}}\n"
        "  b: {subscribes: {/t: {reliability: reliable}}}\n"
    )
    file = tmp_path / "a.yaml"
    file.write_text(text, encoding="utf-8")
    report = json.loads(run_here(["check", "a.yaml", "--format", "rdjson"], tmp_path).out)
    Draft202012Validator(RESULT).validate(report)
    [diagnostic] = report["diagnostics"]
    [suggestion] = diagnostic["suggestions"]
    start, end = (suggestion["range"][each] for each in ("start", "end"))
    lines = text.encode().splitlines(keepends=True)
    assert start["line"] == end["line"]
    line = lines[start["line"] - 1]
    assert line[start["column"] - 1 : end["column"] - 1] == b"best_effort"  # the end is exclusive
    lines[start["line"] - 1] = line[: start["column"] - 1] + suggestion["text"].encode() + line[end["column"] - 1 :]
    run_here(["check", "a.yaml", "--fix"], tmp_path)
    assert file.read_bytes() == b"".join(lines)
