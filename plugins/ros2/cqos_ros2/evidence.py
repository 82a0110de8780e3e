"""Which guarantees were seen under which faults on running middleware; the conformance runs hold these rows."""

from __future__ import annotations

from typing import Final

from cqos_core.guarantee import Proof

PROOFS: Final[tuple[Proof, ...]] = ()
