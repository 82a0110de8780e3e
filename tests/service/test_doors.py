"""Law: one answer at every door. Command, library, service, session and the system file made from a design agree.

They give the same verdict, the same findings and the same coverage for each public incident of `examples`, and for each folder
below the one that the variable ``CQOS_DESIGNS`` names.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml

import cqos_core as cqos
from cqos_core.files.yaml_writer import write
from cqos_core.matching.pipeline import context
from cqos_core.model.problems import InputError
from cqos_core.packs.export import ExportContext
from tests.command_process import run_here
from tests.effort import EXPLORE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.model.problems import Problem
    from cqos_core.remote.client import Client

ROOT = Path(__file__).resolve().parents[2]
INDEX = yaml.safe_load((ROOT / "examples" / "incidents" / "incidents.yaml").read_text(encoding="utf-8"))["incidents"]
EVERY = 1 if EXPLORE else 4
"""One of so many incidents is asked for."""


def designs() -> Iterator[Any]:
    """Yield the folder and the files of each design that needs no options of the command."""
    for each in INDEX[::EVERY]:
        folder = ROOT / "examples" / "incidents" / each["id"]
        if "arguments" not in each and all((folder / name).is_file() for name in each["files"]):
            yield pytest.param(folder, each["files"], id=each["id"])
    if more := os.environ.get("CQOS_DESIGNS"):
        for folder in sorted({path.parent for path in Path(more).rglob("*") if path.is_file()}):
            files = sorted(path.name for path in folder.iterdir() if path.is_file() and path.suffix != ".py")
            yield from (pytest.param(folder, [file], id=f"{folder.name}/{file}") for file in files)


def answer(report: dict[str, Any], *, exact: bool = True) -> dict[str, Any]:
    """Return what must be the same: with ``exact``, places and fixes too."""
    findings = report["findings"] if exact else Counter((each["code"], each["severity"]) for each in report["findings"])
    coverage = report["coverage"]
    parts = coverage["unread"] if exact else [{**each, "place": None} for each in coverage["unread"]]
    pairs = sorted((group["topic"], group["verdict"], group["pairs"]) for group in report["groups"])
    return {
        "verdict": report["verdict"],
        "findings": findings,
        "coverage": {**coverage, "unread": parts},
        "groups": pairs,
    }


def problems_of(files: list[str]) -> tuple[Problem, ...]:
    """Return why files cannot be read; nothing if they can."""
    try:
        cqos.read(*files)
    except InputError as error:
        return tuple(error.problems)
    return ()


def command_answer(files: list[str], folder: Path) -> dict[str, Any] | None:
    """Return the JSON report of `cqos check`, or None where it refuses an input."""
    done = run_here(["check", *files, "--together", "--no-config", "--format", "json"], folder)
    return json.loads(done.out) if done.out else None


@pytest.mark.explored
@pytest.mark.parametrize(("folder", "files"), [*designs()])
def test_every_door_gives_the_same_answer(
    folder: Path, files: list[str], client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    problems = problems_of(files)
    if problems:
        with pytest.raises(InputError) as refused:
            client.check(*files)
        assert refused.value.problems == problems
        return
    system = cqos.read(*files)
    expected = answer(cqos.check(*files).to_dict())
    command = command_answer(files, folder)
    assert command is not None
    assert answer(command) == expected
    assert answer(client.check(*files).to_dict()) == expected
    assert answer(client.check_system(system).to_dict()) == expected
    assert answer(cqos.Session(system).report().to_dict()) == expected
    with client.session(system) as session:
        assert answer(session.report().to_dict()) == expected


@pytest.mark.explored
@pytest.mark.parametrize(("folder", "files"), [*designs()])
def test_a_system_file_made_from_a_design_claims_no_more(
    folder: Path, files: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    if problems_of(files):
        return
    system = cqos.read(*files)
    where = context()
    converted = cqos.read(write(system, ExportContext(where.find_pack, find_rule=where.find_rule)).text.encode())
    before, after = (answer(cqos.check(each).to_dict(), exact=False) for each in (system, converted))
    assert after["verdict"] == before["verdict"]
    assert after["coverage"]["unread"] == before["coverage"]["unread"]
    assert after["groups"] == before["groups"]
