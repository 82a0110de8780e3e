"""What a record was made with: the day, and the commit and version of C-QoS."""

from __future__ import annotations

import subprocess
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

_ROOT: Final = Path(__file__).resolve().parents[2]


def origin() -> dict[str, str]:
    """Return date, commit and version of now, as a record keeps them."""
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=_ROOT, capture_output=True, text=True, check=True)
    return {
        "date": datetime.now(timezone.utc).date().isoformat(),
        "commit": commit.stdout.strip(),
        "cqos": version("cqos-core"),
    }


def build_of(record: Mapping[str, str]) -> str:
    """Return version and commit of a record as pages say them."""
    return f"C-QoS {record['cqos']}, commit {record['commit'][:12]}"
