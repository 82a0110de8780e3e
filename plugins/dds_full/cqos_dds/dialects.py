"""How different files write the settings of DDS: integer codes and units."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Dialect

# The integers that the original BPMN tool stores.
BPMN_CODES: Final = {
    "history": {"0": "keep_last", "1": "keep_all"},
    "reliability": {"0": "best_effort", "1": "reliable"},
    "durability": {"0": "transient_local", "1": "volatile"},
    "liveliness": {"0": "automatic", "1": "manual_by_topic"},
}

DIALECTS: Final = {
    # System files of C-QoS: everything in words, durations with a unit.
    "yaml": Dialect(),
    # Attributes of BPMN events: durations in seconds, and a zero is what the editor writes for nothing.
    "bpmn": Dialect(
        names={"leaseduration": "liveliness.lease_duration"},
        codes=BPMN_CODES,
        bare_unit="s",
        zero_is_unset=True,
        writes={"liveliness.lease_duration": "leaseDuration"},
        words=("default", "auto"),
    ),
}
