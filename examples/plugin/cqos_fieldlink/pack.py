"""The Fieldlink protocol: three policies, three rules. Each rule is one condition; C-QoS derives all else from it.

Fieldlink is invented. A device sends the telegrams of a signal at a fixed cycle. A receiver reports a fault if no telegram
arrives within its timeout.
"""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Choice, Dialect, Duration, Policy, Preset, RulePack, forbids, offered, requested, requires

DELIVERY: Final = Policy(
    "delivery",
    Choice("once", "repeated", "acknowledged"),  # weakest first
    default="once",
    doc="What a device does against lost telegrams.",
    clause="Fieldlink 2.1, section 4.2",
    stronger="higher",
)
CYCLE: Final = Policy(
    "cycle",
    Duration(),
    default="100ms",
    doc="The time from one telegram to the next.",
    clause="Fieldlink 2.1, section 3.1",
    roles=("publisher",),
    stronger="lower",
    promise=True,  # a shorter cycle is more work for the device's program
)
TIMEOUT: Final = Policy(
    "timeout",
    Duration(),
    default="infinite",
    doc="After how long without a telegram a receiver reports a fault.",
    clause="Fieldlink 2.1, section 3.4",
    roles=("subscriber",),
    stronger="lower",
)

RULES: Final = (
    requires(
        offered(DELIVERY) >= requested(DELIVERY),
        code="FLK101",
        name="delivery-weaker-than-requested",
        because="the receiver waits for repetitions or questions that never come",
        clause="Fieldlink 2.1, section 4.2",
    ),
    requires(
        offered(CYCLE) <= requested(TIMEOUT),
        code="FLK102",
        name="cycle-longer-than-timeout",
        because="the receiver reports a fault between any two telegrams",
        clause="Fieldlink 2.1, section 3.4",
    ),
    forbids(
        (offered(CYCLE) <= requested(TIMEOUT))
        & (offered(CYCLE) * 2 > requested(TIMEOUT))
        & (offered(DELIVERY) == "once"),
        code="FLK201",
        name="timeout-after-one-lost-telegram",
        because="a single lost telegram is a fault for the receiver",
        clause="Fieldlink 2.1, section 3.4",
    ),
)

PACK: Final = RulePack(
    id="fieldlink",
    title="Fieldlink",
    summary="Telegrams between the devices of a plant.",
    policies=(DELIVERY, CYCLE, TIMEOUT),
    rules=RULES,
    presets={
        "fast": Preset({"cycle": "10ms"}, "Process values of drives."),
        "alarm": Preset({"cycle": "1s", "delivery": "acknowledged"}, "What an operator must see."),
    },
    # Link lists count in milliseconds; YAML states the unit.
    dialects={"links": Dialect(bare_unit="ms")},
    not_checked=("whether the bus has room for all telegrams",),
    source="Fieldlink 2.1",
)
