"""Which guarantees were seen under which faults on the DDS that the middlewares rest on."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Proof

_SEEN: Final = {
    "link": ("latest", "loss_free", "duplicate_free", "ordered", "late_join", "max_age", "max_gap"),
    "link_outage": ("latest", "loss_free", "duplicate_free", "ordered", "late_join", "max_age", "liveness"),
    "subscriber_restart": ("latest", "loss_free", "duplicate_free", "ordered", "late_join", "offline"),
    "publisher_restart": ("latest", "duplicate_free", "ordered", "liveness"),
}
_ON: Final = (("cyclonedds", "Cyclone DDS", "11.0.1 as plain DDS"), ("fastdds", "Fast DDS", "2.9.1 as plain DDS"))
PROOFS: Final = tuple(
    Proof(word, fault, value, product, version)
    for value, product, version in _ON
    for fault, words in _SEEN.items()
    for word in words
)
