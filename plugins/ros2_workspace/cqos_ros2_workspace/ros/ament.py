"""`ament_cqos`: a linter with the options of ament linters, for tests of ROS packages."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from cqos_core.cli import main as cqos


def main(argv: Sequence[str] | None = None) -> int:
    """Check the systems below folders; return 0 if there is no error, as `cqos check` does."""
    parser = argparse.ArgumentParser("ament_cqos", description="Check QoS settings of publishers and subscribers.")
    parser.add_argument(
        "paths", nargs="*", default=["."], help="files or folders to check; the current folder by default"
    )
    parser.add_argument("--exclude", nargs="*", default=[], metavar="PATTERN", help="files and folders to leave out")
    parser.add_argument("--xunit-file", type=Path, help="write the result as JUnit XML too")
    wishes = parser.parse_args(argv)
    arguments = ["check", "--format", "full"]
    if wishes.xunit_file is not None:
        wishes.xunit_file.parent.mkdir(parents=True, exist_ok=True)
        arguments += ["--format", "junit", "--output", str(wishes.xunit_file)]
    arguments += [text for pattern in wishes.exclude for text in ("--exclude", pattern)]
    return cqos([*arguments, "--", *wishes.paths])
