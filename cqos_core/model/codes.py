"""Codes of findings that the core itself reports about inputs, models, matching and configuration. They are permanent, like rule codes.

``codes.json`` has them. CQ0xx: reading (CQ001-CQ029 in general, CQ030-CQ059 BPMN, CQ060 several files together, CQ061 profiles
alone, CQ062 a choice to make); CQ2xx: settings and profiles; CQ4xx: names and matching; CQ5xx: bridges; CQ6xx: accepted exceptions and the team's own rules;
CQ7xx: plugins at fault; CQ8xx: chains and budgets; BP1xx: behaviour.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

from cqos_core.model.code_info import CodeInfo


def _stated() -> list[CodeInfo]:
    rows = json.loads(Path(__file__).with_suffix(".json").read_bytes())
    return [CodeInfo(**{**row, "aliases": tuple(row.get("aliases", ()))}) for row in rows]


CODES: Final = {info.code: info for info in _stated()}
_SPELLINGS: Final = {spelling: info for info in CODES.values() for spelling in info.spellings}


def find_code(name: str) -> CodeInfo | None:
    """Return the core's code with that code, name or alias, or None."""
    return _SPELLINGS.get(name.lower())


__all__ = ["CODES", "CodeInfo", "find_code"]
