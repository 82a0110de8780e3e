"""What other writers of a topic take from the guarantees of a pair in DDS; of those, a pair shows the strongest only."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import as_condition, define, gives, offered, requested, topic
from cqos_dds.policies import KEYED, OWNERSHIP_STRENGTH, SOLE_WRITER, STRONGEST_WRITER
from cqos_dds.requested_policies import DESTINATION_ORDER, OWNERSHIP

ONE_OF_EACH: Final = "which other writers write the instance is not seen in one pair"
ALONE: Final = as_condition(topic(SOLE_WRITER))
# Of a topic with instances, each may have another owner.
NOT_OUTWEIGHED: Final = define(
    "not_outweighed",
    (offered(OWNERSHIP) == "shared")
    | as_condition(topic(KEYED))
    | (offered(OWNERSHIP_STRENGTH) >= requested(STRONGEST_WRITER)),
)
STATE_SOLE: Final = "state `sole_writer: true` of a topic whose instances have one writer each"

# A weaker exclusive writer reached a reader with 0 of 20 samples, and a writer with a slow clock with 1 of 7; seen by running
# Cyclone DDS. The other guarantees do not ask which samples arrive: order, age, copies, liveliness.
OTHER_WRITERS: Final = (
    *(
        gives(
            word,
            NOT_OUTWEIGHED,
            code=code,
            name=f"{name}-to-stronger-writer",
            because="a reader drops the samples of all exclusive writers but the owner, and another writer is stronger",
            clause="DDS 1.4, 2.2.3.9 and 2.2.3.10",
            fixes=("ownership_strength",),
            help="drop the need where the weaker writer only stands by",
        )
        for code, word, name in (
            ("DDS572", "loss_free", "loss"),
            ("DDS573", "latest", "latest-lost"),
            ("DDS574", "late_join", "late-join-lost"),
            ("DDS575", "offline", "offline-lost"),
            ("DDS576", "max_gap", "gap"),
        )
    ),
    *(
        gives(
            word,
            (offered(OWNERSHIP) == "shared") | ALONE,
            doubt=True,
            code=code,
            name=f"{name}-by-ownership",
            because=f"a reader drops the samples of all exclusive writers but the owner, and {ONE_OF_EACH}",
            clause="DDS 1.4, 2.2.3.9",
            help=STATE_SOLE,
        )
        for code, word, name in (
            ("DDS511", "loss_free", "loss"),
            ("DDS557", "latest", "latest-lost"),
            ("DDS558", "late_join", "late-join-lost"),
            ("DDS559", "offline", "offline-lost"),
            ("DDS560", "max_gap", "gap"),
        )
    ),
    *(
        gives(
            word,
            (requested(DESTINATION_ORDER) == "by_reception_timestamp") | ALONE,
            doubt=True,
            code=code,
            name=f"{name}-by-source-order",
            because=f"a sample that comes after one that was written later, by the clocks of their writers, is dropped, and {ONE_OF_EACH}",
            clause="DDS 1.4, 2.2.3.17",
            help=STATE_SOLE,
        )
        for code, word, name in (
            ("DDS512", "loss_free", "loss"),
            ("DDS561", "latest", "latest-lost"),
            ("DDS562", "late_join", "late-join-lost"),
            ("DDS563", "offline", "offline-lost"),
            ("DDS564", "max_gap", "gap"),
        )
    ),
)
