"""Conditions that several rules and guarantees of MQTT share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cqos_core.packs import (
    Condition,
    Operand,
    Term,
    by_option,
    define,
)
from cqos_mqtt.connection_policies import (
    CLEAN,
    SESSION_EXPIRY,
)
from cqos_mqtt.policies import IMPLIED_NEEDS, VERSION


def in_3_1_1(side: Callable[[Term], Operand]) -> Condition:
    """The connection speaks the older version."""
    return define(f"{side.__name__}_in_3_1_1", side(VERSION) == "3.1.1")


def keeps_session(side: Callable[[Term], Operand]) -> Condition:
    """The broker keeps the session of this connection while it is away."""
    in_5_0 = (side(VERSION) == "5.0") & (side(SESSION_EXPIRY) > "0s")
    return define(f"{side.__name__}_keeps_session", (in_3_1_1(side) & ~side(CLEAN)) | in_5_0)


# How severe the loss of a QoS is that was stated, and that no stated need asks for.
IMPLIED: Final = by_option(IMPLIED_NEEDS.name, note="note", warning="warning")
