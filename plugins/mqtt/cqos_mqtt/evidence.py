"""Which guarantees were seen under which faults on a running Mosquitto; the conformance runs hold these rows."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import LINK, Proof

_SEEN: Final = {
    LINK: (
        "latest",
        "loss_free",
        "duplicate_free",
        "ordered",
        "late_join",
        "offline",
        "max_age",
        "liveness",
        "max_gap",
    ),
    "link_outage": ("latest", "loss_free", "duplicate_free", "ordered", "late_join"),
    "subscriber_restart": ("latest", "loss_free", "duplicate_free", "ordered", "late_join", "offline", "max_age"),
    "publisher_restart": ("latest", "loss_free", "duplicate_free", "ordered", "late_join", "liveness"),
    "broker_stop": ("latest", "loss_free", "duplicate_free", "late_join", "offline"),
    "broker_crash": ("duplicate_free",),
}
PROOFS: Final = tuple(
    Proof(word, fault, "mosquitto", "Mosquitto", "2.0.11") for fault, words in _SEEN.items() for word in words
)
