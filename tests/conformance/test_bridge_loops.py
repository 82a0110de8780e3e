"""Bridges of Mosquitto that close a loop, or do not: how often one message arrives (CQ503)."""

from __future__ import annotations

import asyncio
import os
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from cqos_core import check
from cqos_live.mqtt.prove.client import Subscription
from cqos_live.mqtt.prove.mosquitto import Mosquitto, program
from tests.conformance.test_guarantees_mosquitto import Watched

if TYPE_CHECKING:
    from collections.abc import Callable

MISSING = program() is None
if MISSING and os.environ.get("CI") == "true":
    raise RuntimeError("Mosquitto is not installed, and where CI runs it has to be: apt-get install mosquitto")
pytestmark = [
    pytest.mark.skipif(MISSING, reason="Mosquitto is not installed: apt-get install mosquitto"),
    pytest.mark.xdist_group("mosquitto"),
]
MANY = 50
PATIENCE = 20
BOTH = "# both 0"


@pytest.mark.parametrize(
    ("bridges", "name", "looping"),
    [
        ((("a", "b", BOTH), ("a", "c", BOTH), ("b", "a", BOTH), ("b", "c", BOTH), ("c", "a", BOTH), ("c", "b", BOTH)), "t", True),
        ((("a", "b", BOTH), ("b", "a", BOTH)), "t", True),
        ((("a", "b", "# out 0"), ("a", "b", "# in 0")), "t", True),
        ((("a", "b", "# out 0 s/ r/"), ("b", "a", "# out 0 r/ s/")), "s/t", True),
        ((("a", "b", "+/state out 0"), ("b", "a", "site/# out 0")), "site/state", True),
        ((("a", "b", BOTH),), "t", False),
        ((("a", "b", BOTH), ("b", "c", BOTH)), "t", False),
        ((("a", "b", "# out 0"), ("b", "a", "# in 0")), "t", False),
        ((("a", "b", "# out 0 s/ r/"), ("b", "a", "# out 0 q/ s/")), "s/t", False),
    ],
)  # fmt: skip
def test_a_message_goes_round_if_and_only_if_a_loop_is_found(tmp_path, bridges, name, looping):
    names = sorted({each for bridge in bridges for each in bridge[:2]})

    def blocks(broker: str, address: Callable[[str], str]) -> str:
        return "".join(
            f"connection b{number}\naddress {address(other)}\nnotifications false\nrestart_timeout 1\ntopic {topic}\n"
            for number, (own, other, topic) in enumerate(bridges)
            if own == broker
        )

    async def show() -> int:
        async with AsyncExitStack() as stack:
            brokers = {each: Mosquitto(()) for each in names}
            for each, broker in brokers.items():
                stack.push_async_callback(broker.close)
                with broker.configuration.open("a", encoding="utf-8") as written:
                    written.write(blocks(each, lambda other: f"127.0.0.1:{brokers[other].port}"))
            for broker in reversed(brokers.values()):
                await broker.start()
            here = await stack.enter_async_context(Watched(brokers["a"], "here", Subscription("#", 0)))
            far = await stack.enter_async_context(Watched(brokers[names[-1]], "far", Subscription("#", 0)))
            until = asyncio.get_running_loop().time() + PATIENCE
            number = 0
            # Until all bridges are connected: in a loop a message comes often, else the last broker gets it.
            while True:
                assert asyncio.get_running_loop().time() < until
                number += 1
                seen = len(far.arrived)
                here.publish(name, f"{number}", 0)
                await asyncio.sleep(0.3)
                if looping and len(here.arrived) > MANY + number:
                    return len(here.arrived)
                if not looping and len(far.arrived) > seen:
                    break
            here.publish(name, "counted", 0)
            here.publish(name, "last", 0)
            while not any(each.payload == b"last" for each in far.arrived):
                assert asyncio.get_running_loop().time() < until
                await asyncio.sleep(0.01)
            await asyncio.sleep(0.2)
            return sum(each.payload == b"counted" for each in here.arrived)

    arrived = asyncio.run(show())
    assert (arrived > MANY) if looping else (arrived == 1)
    for each in names:
        (tmp_path / f"{each}.conf").write_text(f"listener 1883\n{blocks(each, '{}:1883'.format)}", encoding="utf-8")
    found = {each.code for each in check(*(tmp_path / f"{each}.conf" for each in names)).findings}
    assert ("CQ503" in found) is looping
