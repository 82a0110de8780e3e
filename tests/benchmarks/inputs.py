"""Inputs of the benchmarks: values are diverse, and one topic of ten has a mistake. All are made here, from a number."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

Settings = dict[str, str]


def pair(number: int) -> tuple[Settings, Settings]:
    """Return what the publisher and the subscriber of topic ``number`` state: depth and durations are those of few others."""
    offered = {
        "reliability": "reliable",
        "depth": str(1 + number % 997),
        "deadline": f"{100 + number % 1009}ms",
        "lifespan": f"{60 + number % 101}s",
        "lease_duration": f"{1 + number % 13}s",
    }
    requested = {
        "reliability": "reliable",
        "depth": offered["depth"],
        "deadline": f"{100 + number % 1009 + number % 31}ms",
        "lease_duration": f"{20 + number % 17}s",
    }
    if number % 10 == 0:
        policy, value = (("deadline", "50ms"), ("durability", "transient_local"), ("lease_duration", "500ms"))[
            number // 10 % 3
        ]
        requested[policy] = value
    return offered, requested


def _flow(settings: Settings) -> str:
    return "{" + ", ".join(f"{name}: {value}" for name, value in settings.items()) + "}"


def system_file(endpoints: int) -> Iterator[bytes]:
    """A system file of as many endpoints, two per topic, ten topics per pair of nodes; in pieces."""
    yield b"cqos: 1\nprotocol: ros2\noptions: {ros2: {rmw: cyclonedds}}\nparticipants:\n"
    for first in range(0, endpoints // 2, 10):
        topics = range(first, min(first + 10, endpoints // 2))
        for end, name, key in ((0, "talker", "publishes"), (1, "listener", "subscribes")):
            lines = (f"      /line{each}/value: {_flow(pair(each)[end])}\n" for each in topics)
            yield f"  {name}{first}:\n    {key}:\n{''.join(lines)}".encode()


_HEAD: Final = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" '
    'xmlns:qos="http://qos" id="D" targetNamespace="t">\n'
)


def diagram(events: int) -> Iterator[bytes]:
    """A diagram of two pools with as many signal events, half of them throw and half catch; in pieces."""
    yield _HEAD.encode()
    for start in range(0, events // 2, 1000):
        signals = range(start, min(start + 1000, events // 2))
        yield "".join(f'<signal id="S{each}" name="line{each}"/>\n' for each in signals).encode()
    pools = ("A", "intermediateThrowEvent"), ("B", "intermediateCatchEvent")
    parts = "".join(f'<participant id="P{pool}" name="{pool}" processRef="{pool}"/>' for pool, _ in pools)
    yield f'<collaboration id="C">{parts}</collaboration>\n'.encode()
    for end, (pool, tag) in enumerate(pools):
        yield f'<process id="{pool}">\n'.encode()
        for start in range(0, events // 2, 1000):
            yield "".join(
                f'<{tag} id="{pool}{each}" name="e{each}"{_attributes(pair(each)[end])}>'
                f'<signalEventDefinition id="d{pool}{each}" signalRef="S{each}"/></{tag}>\n'
                for each in range(start, min(start + 1000, events // 2))
            ).encode()
        yield b"</process>\n"
    yield b"</definitions>\n"


def _attributes(settings: Settings) -> str:
    return "".join(f' qos:{name}="{value}"' for name, value in settings.items())


def known_pairs() -> list[tuple[Settings, Settings]]:
    """1,500 combinations of 64 profiles, whose values are common."""
    names = ("reliability", "durability", "deadline", "liveliness", "lease_duration", "depth")
    values = (
        ("reliable", "best_effort"),
        ("volatile", "transient_local"),
        ("10ms", "100ms"),
        ("automatic", "manual_by_topic"),
        ("1s", "2s"),
        ("1", "5"),
    )
    profiles = [dict(zip(names, each, strict=True)) for each in itertools.product(*values)]
    return list(itertools.islice(itertools.product(profiles, profiles), 1500))
