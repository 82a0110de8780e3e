"""Law: where values come from peers, a known verdict is that of every order of start that the system allows."""

from __future__ import annotations

from functools import cache
from itertools import permutations
from typing import TYPE_CHECKING, Any, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cqos_core import check, check_pair
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, System
from tests.effort import EXAMPLES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core.model.system import Role

BEST: Final = "best_available"
WEAKEST_FIRST: Final = {
    "reliability": ("best_effort", "reliable"),
    "durability": ("volatile", "transient_local"),
    "liveliness": ("automatic", "manual_by_topic"),
    "deadline": ("infinite", "1s", "500ms"),
    "liveliness_lease_duration": ("infinite", "1s", "500ms"),
}
OPTIONS: Final = {"rmw": "cyclonedds", "distro": "jazzy"}


def taken(policy: str, role: Role, peers: Sequence[str]) -> str:
    """What rmw_dds_common makes of `best_available` beside peers that are known (rmw_dds_common/src/qos.cpp)."""
    weak, strong, *_ = WEAKEST_FIRST[policy]
    if policy in {"reliability", "durability"}:
        return strong if role == PUBLISHER or all(each == strong for each in peers) else weak
    if policy == "liveliness":
        several = any if role == PUBLISHER else all
        return strong if several(each == strong for each in peers) else weak
    finite = [each for each in reversed(WEAKEST_FIRST[policy]) if each in peers and each != "infinite"]
    return "infinite" if not finite else finite[0] if role == PUBLISHER else finite[-1]


def created(system: System, order: Sequence[Endpoint]) -> dict[str, dict[str, str]]:
    """The values of all endpoints where they are created in this order."""
    values: dict[str, dict[str, str]] = {}
    for each in order:
        there = [values[other.id] for other in system.endpoints if other.id in values and other.role != each.role]
        values[each.id] = {
            policy: taken(policy, each.role, [peer[policy] for peer in there]) if stated.text == BEST else stated.text
            for policy, stated in each.settings.items()
        }
    return values


def orders(system: System) -> Iterator[Sequence[Endpoint]]:
    """Yield every order that the system allows."""
    for order in permutations(system.endpoints):
        there: set[str] = set()
        for each in order:
            if not there.issuperset(each.starts_after):
                break
            there.add(each.id)
        else:
            yield order


@cache
def verdict_of(offered: tuple[tuple[str, str], ...], requested: tuple[tuple[str, str], ...]) -> str:
    return check_pair("ros2", dict(offered), dict(requested), OPTIONS).verdict


def truth(system: System, publisher: str, subscriber: str) -> set[str]:
    """The verdicts of a pair over all orders of start."""
    found = set()
    for order in orders(system):
        values = created(system, order)
        found.add(verdict_of(tuple(values[publisher].items()), tuple(values[subscriber].items())))
    return found


def system_of(ends: Sequence[tuple[Role, dict[str, str], tuple[str, ...]]]) -> System:
    system = System(protocol="ros2", options={"ros2": {name: Setting(text) for name, text in OPTIONS.items()}})
    for number, (role, values, after) in enumerate(ends):
        name = f"e{number}"
        system.participants[name] = Participant(name)
        stated = {policy: Setting(text) for policy, text in values.items()}
        system.endpoints.append(
            Endpoint(id=name, role=role, topic="topic", participant=name, settings=stated, starts_after=after)
        )
    return system


@st.composite
def systems(draw: Any, policy: str) -> System:
    ends = []
    for number in range(draw(st.integers(2, 5))):
        role = draw(st.sampled_from((PUBLISHER, SUBSCRIBER)))
        after = tuple(f"e{early}" for early in range(number) if draw(st.booleans()))
        ends.append((role, {policy: draw(st.sampled_from((BEST, *WEAKEST_FIRST[policy])))}, after))
    return system_of(ends)


@pytest.mark.parametrize("policy", WEAKEST_FIRST)
@given(st.data())
def test_a_known_verdict_is_that_of_every_order_of_start(policy: str, data: Any):
    system = data.draw(systems(policy))
    for pair in check(system).pairs:
        real = truth(system, pair.publisher, pair.subscriber)
        assert pair.verdict == "unknown" or {pair.verdict} == real, (pair, real)


@pytest.mark.parametrize("policy", WEAKEST_FIRST)
@settings(max_examples=EXAMPLES // 2)
@given(st.data())
def test_an_order_that_is_stated_as_a_whole_decides(policy: str, data: Any):
    system = data.draw(systems(policy))
    for number, each in enumerate(system.endpoints):
        each.starts_after = (f"e{number - 1}",) if number else ()
    for pair in check(system).pairs:
        assert {pair.verdict} == truth(system, pair.publisher, pair.subscriber)


@pytest.mark.parametrize(
    ("after", "verdicts"),
    [
        # Beside the first publisher alone it asks for 500ms, which the second one does not offer.
        ({"sub": ("fast",), "slow": ("sub",)}, {"fast": "compatible", "slow": "incompatible"}),
        ({"sub": ("fast",)}, {"fast": "compatible", "slow": "unknown"}),
        ({"sub": ("fast", "slow")}, {"fast": "compatible", "slow": "compatible"}),
        ({}, {"fast": "compatible", "slow": "unknown"}),
    ],
)
@pytest.mark.parametrize("policy", ["deadline", "liveliness_lease_duration"])
def test_the_order_may_be_stated_of_some_partners_only(policy, after, verdicts):
    values = {"fast": "500ms", "slow": "1s", "sub": BEST}
    system = system_of([])
    for name, text in values.items():
        system.participants[name] = Participant(name)
        role: Role = SUBSCRIBER if name == "sub" else PUBLISHER
        stated = {policy: Setting(text)}
        system.endpoints.append(
            Endpoint(
                id=name, role=role, topic="topic", participant=name, settings=stated, starts_after=after.get(name, ())
            )
        )
    assert {pair.publisher: str(pair.verdict) for pair in check(system).pairs} == verdicts
