"""What is read of installed distributions equals what `importlib.metadata` reads."""

from __future__ import annotations

import sys
import zipfile
from importlib.metadata import entry_points, metadata
from typing import TYPE_CHECKING

import pytest

from cqos_core.model import installed

if TYPE_CHECKING:
    from pathlib import Path

OURS = "Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\nAuthor: the C-QoS authors\n\nAuthor: another author\n"
THEIRS = "Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\nAuthor: another author\n\nAuthor: the C-QoS authors\n"


def install(site: Path, name: str, entries: str, head: str = OURS, folder: str = "") -> None:
    """Put what an installer leaves of a distribution into a folder."""
    info = site / (folder or f"{name.replace('-', '_')}-1.2.dist-info")
    info.mkdir(parents=True)
    (info / "METADATA").write_text(head.format(name=name))
    (info / "entry_points.txt").write_text(entries)


def found() -> tuple[list[tuple[str, str, str]], list[tuple[str, str, str]], bool]:
    """Return what is read here, what the library reads, and whether the library was asked for the former."""
    ours, theirs = (
        sorted((each.name, each.value, each.dist.metadata["Version"]) for each in entries if each.dist is not None)
        for entries in (installed.entry_points("cqos"), entry_points(group="cqos"))
    )
    asked = any(not isinstance(each, installed.InstalledEntry) for each in installed.entry_points("cqos"))
    return ours, theirs, asked


def test_our_distributions_are_read_as_the_library_does() -> None:
    ours, theirs, _ = found()
    assert ours == theirs
    for name in ("Name", "Version", "Author"):
        assert installed.headers("cqos-core")[name] == metadata("cqos-core")[name]
    for name in ("Requires-Dist", "Project-URL", "Nothing"):
        assert installed.headers("cqos-core").get_all(name) == metadata("cqos-core").get_all(name)


def test_the_first_of_a_name_on_the_path_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path / "a", "cqos-x", "# a comment\n[other]\nx = no\n\n[cqos]\nx = first\n y=also.first \n")
    install(tmp_path / "b", "Cqos.X", "[cqos]\nx = second\n", folder="Cqos.X-1.3.dist-info")
    install(tmp_path / "b", "cqos-y", "[cqos.more]\nx = no\n[cqos]\nz = third\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path / "a"), str(tmp_path / "none"), str(tmp_path / "b"), *sys.path])
    ours, theirs, asked = found()
    assert ours == theirs
    assert {("x", "first", "1.2"), ("y", "also.first", "1.2"), ("z", "third", "1.2")} <= {*ours}
    assert not asked or any(each for each in sys.meta_path if hasattr(each, "find_distributions"))


@pytest.mark.parametrize("kind", ["foreign", "attribute", "no metadata", "letters", "archive", "egg"])
def test_what_is_unusual_is_left_to_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    path = tmp_path / ("site.egg" if kind == "egg" else "site")
    install(
        path,
        "cqos-x",
        "[cqos]\nx = x:y\n" if kind == "attribute" else "[cqos]\nx = x\n",
        THEIRS if kind == "foreign" else OURS,
    )
    about = path / "cqos_x-1.2.dist-info"
    if kind == "no metadata":
        (about / "METADATA").unlink()
    if kind == "letters":
        (about / "METADATA").write_bytes(b"Name: cqos-x\nVersion: 1.2\nAuthor: the C-QoS authors\nSummary: \xff\n")
    if kind == "archive":
        packed = tmp_path / "site.zip"
        with zipfile.ZipFile(packed, "w") as archive:
            for each in about.iterdir():
                archive.write(each, f"{about.name}/{each.name}")
        path = packed
    monkeypatch.setattr(sys, "path", [str(path), *sys.path])
    if kind == "letters":
        with pytest.raises(installed.UnusualError):
            installed._entries("cqos")
        return
    entries = installed.entry_points("cqos")
    assert all(not isinstance(each, installed.InstalledEntry) for each in entries)
    assert ("x", "x:y" if kind == "attribute" else "x") in {(each.name, each.value) for each in entries}
