"""Writes docs/conformance-mqtt.md: how the MQTT pack agrees with a Mosquitto that runs, and where Mosquitto departs.

python -m tests.conformance.mqtt_table    write it; the tests compare it
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import version as cqos_version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tests.conformance import mqtt_comparison as ask
from tests.conformance.mosquitto import V5, running, version

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.conformance.mqtt_comparison import Section

DOCUMENT: Final = Path(__file__).resolve().parents[2] / "docs" / "conformance-mqtt.md"
QUEUED: Final = 5

SHARED_RETAINED: Final = "sends retained messages to shared subscriptions, which MQTT 5.0 forbids (4.8.2)"
ORDINARY: Final = (
    "takes malformed shared subscriptions of 3.1.1, to which they are ordinary filters that match nothing useful"
)
MALFORMED_SHARES: Final = (
    "takes malformed shared subscriptions as filters that match nothing (MQTT-4.8.2-1, MQTT-4.8.2-2)"
)
DEPARTURES: Final = {
    "retain True, retain handling 0, shared True": SHARED_RETAINED,
    "retain True, retain handling 1, shared True": SHARED_RETAINED,
    **{
        f"{v} filter `{written}`": MALFORMED_SHARES if v == V5 else ORDINARY
        for v in ask.VERSIONS
        for written in ("$share/", "$share/g", "$share//a", "$share/g/")
    },
}
"""Where Mosquitto is known to differ from the standard, which the pack follows; later versions may have fixed it."""

INTRODUCTION: Final = """# Conformance with Mosquitto

Written by `python -m tests.conformance.mqtt_table` from what Eclipse Mosquitto {version} does when it is run, compared
with C-QoS {cqos}; the tests fail where the pack differs from it, save in the departures below.

Clients of both versions of MQTT publish and subscribe on loopback. Compared is what the pack predicts (with the preset
`mosquitto` and, for late join, absence and shares, by a stated need) with what arrives: whether, with which QoS and RETAIN
flag; whether the broker takes, refuses or ends what it is asked.
"""


@cache
def sections() -> tuple[Section, ...]:
    """Ask everything, of brokers that are started for it."""
    with running() as broker:
        found = [
            question(broker)
            for question in (
                ask.online,
                ask.retained,
                ask.late_join,
                ask.offline,
                ask.expiry,
                ask.options,
                ask.wills,
                ask.matching,
                ask.validity,
            )
        ]
    with running("queue_qos0_messages true") as broker:
        found.insert(4, ask.offline(broker, "offline, with queue_qos0_messages", queue_qos0_messages=True))
    with running(*(f"{name} {str(value).lower()}" for name, value in ask.LIMITED.items())) as broker:
        found.append(ask.capabilities(broker))
    with running(f"max_queued_messages {QUEUED}") as broker:
        found.append(ask.overflow(broker, QUEUED))
    return tuple(found)


def document() -> str:
    """Return the page."""
    rows = [
        (each.name, f"{each.asked:,}", str(each.asked - len(each.differences)), str(len(each.differences)))
        for each in sections()
    ]
    parts = [
        INTRODUCTION.format(version=version(), cqos=cqos_version("cqos-core")),
        _table(("question", "cases", "agree", "departures"), [(a, b, f"{int(c):,}", d) for a, b, c, d in rows]),
    ]
    departures = [
        (f"{section.name.partition(':')[0]}: {case}", DEPARTURES.get(case, "not known before"))
        for section in sections()
        for case, _, _ in section.differences
    ]
    if departures:
        parts += [
            "## Departures\n\nThe pack follows the standard in these.",
            _table(("case", f"Mosquitto {version()}"), departures),
        ]
    return "\n".join(f"{part.rstrip()}\n" for part in parts)


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["-" * len(name) for name in header], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    DOCUMENT.write_text(document(), encoding="utf-8")
