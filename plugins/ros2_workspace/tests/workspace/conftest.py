"""Joins of workspaces that tests write."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from cqos_core import check
from cqos_core.model.source import OPTIONS, ReadContext, Source
from cqos_ros2_workspace.importer import read

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from cqos_core import System

MANIFEST = "<package><name>{}</name></package>"


def read_workspace(root: Path, launch: str, distro: str = "humble", **arguments: str) -> System:
    """Return the system of a launch."""
    switches = {"launch": launch, "launch_arg": "\n".join(f"{name}:={value}" for name, value in arguments.items())}
    options = {"workspace": switches, OPTIONS: {"ros2.distro": distro} if distro else {}}
    system = read(Source(str(root), b""), ReadContext(options=options))
    system.partial = True
    return system


def _findings(system: System) -> list[tuple[str, tuple[tuple[str, int | None], ...], str]]:
    """Return code, places and message of errors and warnings."""
    report = check(system)
    found = []
    for each in report.findings:
        if each.severity.value != "note":
            places = [each.place, *(side.place for side in each.sides)]
            known = dict.fromkeys(
                (place.source.rpartition("/")[2], place.line) for place in places if place is not None
            )
            found.append((each.code, tuple(known), each.message))
    return found


@pytest.fixture
def findings():
    """Return the function that returns code, places and message of the errors and warnings of a system."""
    return _findings


@pytest.fixture
def started():
    """Return the function that reads the launch of a workspace that is there."""
    return read_workspace


@pytest.fixture
def joined(tmp_path):
    """Write a workspace with one package `bot`, and return the system of its launch file."""

    def join(files: Mapping[str, str], distro: str = "humble", **arguments: str) -> System:
        root = tmp_path / "src"
        for name, content in {"bot/package.xml": MANIFEST.format("bot"), **files}.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content, encoding="utf-8")
        launch = next(name for name in files if "/launch/" in name)
        return read_workspace(root, str(root / launch), distro, **arguments)

    return join
