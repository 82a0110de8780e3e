"""Anchors of the page. A thing keeps its anchor in every report of its system."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.report import Report

_LONGEST: Final = 32  # letters of a name in an anchor
_OTHER: Final = re.compile(r"[^A-Za-z0-9]+")


class Anchors:
    """Makes the anchors of one system; no two on one page are the same."""

    def __init__(self, scope: str) -> None:
        """Take the unique name of the system on the page."""
        self._scope = scope
        self._given: Counter[str] = Counter()

    def give(self, kind: str, name: str, *identity: str) -> str:
        """Return a new anchor, such as ``topic-scan-1f0c2a9b77e0``; ``identity`` distinguishes things of one name."""
        text = json.dumps([self._scope, kind, *(identity or (name,))])
        digest = hashlib.sha256(text.encode()).hexdigest()[:12]
        # Names may have any characters, so the hash is the identity, and the words are for readers.
        words = [kind, _OTHER.sub("-", name)[:_LONGEST].strip("-"), digest]
        anchor = "-".join(each for each in words if each)
        self._given[anchor] += 1
        return anchor if self._given[anchor] == 1 else f"{anchor}-{self._given[anchor]}"


def scopes(reports: Sequence[Report]) -> dict[int, str]:
    """Return the scope of each report, by its ``id()``: its system, else its only source; a number where several have the same."""
    found: dict[int, str] = {}
    taken: Counter[str] = Counter()
    for each in sorted(reports, key=lambda each: each.sources):
        # Several files without system name have no common name that stays when a file is added.
        name = each.system or (each.sources[0] if len(each.sources) == 1 else "")
        taken[name] += 1
        found[id(each)] = name if taken[name] == 1 else f"{name}\n{taken[name]}"
    return found
