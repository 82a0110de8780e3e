"""What Fast DDS prints of endpoints that do not fit."""

import io

import pytest

from cqos_core.packs.log_mismatches import read_mismatches
from cqos_dds.logs import read_line

BEGIN = "2026-11-28 19:50:01.123 [RTPS_EDP Warning] INCOMPATIBLE QOS (topic: Cmd)"
GUID = "01.0f.44.88.2b.1c.00.00.00.00.00.00|0.0.1.4"


@pytest.mark.parametrize(
    ("said", "named", "policies"),
    [
        (f":Remote Reader {GUID} is Reliable and local writer is BE ", "RELIABILITY", ("reliability",)),
        (f":RemoteReader {GUID} has TRANSIENT_LOCAL DURABILITY and we offer VOLATILE", "DURABILITY", ("durability",)),
        (f":Remote reader {GUID} has different Ownership Kind", "OWNERSHIP", ("ownership",)),
        (f":Remote reader {GUID} has smaller DEADLINE period", "DEADLINE", ("deadline",)),
        (": Different Partitions", "PARTITION", ("partition",)),
    ],
)
def test_a_line_names_topic_and_policy(said, named, policies):
    (found,) = read_line(f"{BEGIN}{said} -> Function valid_matching")
    assert (found.protocol, found.topic, found.named, found.policies) == ("dds", "Cmd", named, policies)


@pytest.mark.parametrize(
    "line",
    ["", "INCOMPATIBLE QOS (topic: Cmd): something else", "[RTPS_EDP Warning] Incompatible Data Representation QoS"],
)
def test_other_lines_say_nothing(line):
    assert [*read_line(line)] == []


def test_equal_lines_are_counted():
    log = f"{BEGIN}:Remote Reader {GUID} is Reliable and local writer is BE\n" * 3
    ((found,), lines) = read_mismatches("x.log", io.BytesIO(log.encode()), [read_line])
    assert (found.count, lines) == (3, 3)
