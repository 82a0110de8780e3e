"""Reads what Fast DDS prints about endpoints that do not fit: versions 2.9 to 3.6, EDP.cpp, log category RTPS_EDP, level warning.

    [RTPS_EDP Warning] INCOMPATIBLE QOS (topic: HelloWorldTopic):Remote Reader 01.0f… is Reliable and local writer is BE

Both participants print the line in these words, so it does not tell whose endpoint is the discovered one. Lines about other policies
name no topic.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.system import PUBLISHER
from cqos_core.packs.log_mismatches import LogMismatch

_PROTOCOL: Final = "dds"
_LINE: Final = regular_expression(r"INCOMPATIBLE QOS \(topic: (?P<topic>[^)]{1,1024})\): ?(?P<said>.{1,500})")
_SAID: Final = (
    ("is Reliable and local writer is BE", "RELIABILITY", ("reliability",)),
    ("DURABILITY and we offer", "DURABILITY", ("durability",)),
    ("different Ownership Kind", "OWNERSHIP", ("ownership",)),
    ("smaller DEADLINE period", "DEADLINE", ("deadline",)),
    ("Different Partitions", "PARTITION", ("partition",)),
)


def read_line(line: str) -> Iterator[LogMismatch]:
    """Yield what one line reports about incompatible endpoints."""
    for found in _LINE.finditer(line):
        named = next(((name, policies) for said, name, policies in _SAID if said in found["said"]), None)
        if named is not None:
            yield LogMismatch(_PROTOCOL, PUBLISHER, found["topic"], None, *named)
