"""Law: on a topic of many endpoints that all differ, each pair has the verdict that it has alone."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING, Any, Final

import pytest

from cqos_core import Acceptance, Endpoint, Participant, Setting, System, check
from cqos_dds.pack import PACK as DDS
from cqos_mqtt.pack import PACK as MQTT
from cqos_ros2.pack import PACK as ROS2
from tests.effort import EXPLORE
from tests.made_up_protocol import POST

if TYPE_CHECKING:
    from cqos_core import Report
    from cqos_core.packs import Policy, RulePack

PACKS: Final = (POST, DDS, MQTT, ROS2)
PATTERNS: Final = ("a", "b", "a*", "b?", "c", "*", "[ab]", "?", "ab", "bc")
# Enough that nearly all ends of a crowd differ.
WORDS: Final = {
    "count": tuple(map(str, range(1, 60))),
    "duration": (*(f"{number}s" for number in range(1, 60)), "infinite"),
    "names": ("[]", *(f"['{one}', '{other}']" for one in PATTERNS for other in PATTERNS)),
    "text": ("x", "y"),
    "flag": ("true", "false"),
}
SEEDS: Final = 40 if EXPLORE else 2
MANY: Final = 60
ASKED: Final = 400 if EXPLORE else 60


def a_system(pack: RulePack, seed: int) -> System:
    """Endpoints of one topic, nearly all different; some values are not known, and some endpoints are accepted."""
    random = Random(seed)  # noqa: S311 - no secrets
    system = System("random", pack.id)
    compared = {use.index for scope in ("meets", "pair") for each in pack.by_scope[scope] for use in each.bound.uses}

    def settings(level: str, most: int) -> dict[str, Setting]:
        policies = [pack.policies[at] for at in sorted(compared) if pack.policies[at].level == level]
        policies = [each for each in policies if not each.derived]
        chosen = random.sample(policies, min(most, len(policies)))
        return {each.name: setting(each) for each in chosen}

    def setting(policy: Policy) -> Setting:
        words = getattr(policy.domain, "names", ()) or WORDS.get(policy.domain.kind, ("x",))
        return Setting(random.choice(words), unknown=random.choice(("",) * 5 + ("nobody knows",)))

    for name in ("p0", "p1", "p2"):
        system.participants[name] = Participant(name, settings=settings("participant", 1) | settings("option", 1))
    for number in range(MANY):
        role: Any = ("publisher", "subscriber")[number % 2]
        owner = random.choice([*system.participants])
        own = settings("endpoint", random.choice((4, 30, 30)))
        seen = random.random() < 0.2  # of which nothing is known that it does not state
        system.endpoints.append(
            Endpoint(id=f"e{number}", role=role, topic="t", participant=owner, settings=own, observed=seen)
        )
    rules = [bound.rule.code for bound in (*pack.by_scope["meets"], *pack.by_scope["pair"])]
    system.accept = [Acceptance(rule=random.choice(rules), because="known", endpoint=f"e{random.randrange(MANY)}")]
    return system


def by_pair(report: Report) -> dict[tuple[str, str], tuple[str, tuple[str, ...]]]:
    """The verdict and the codes of each pair."""
    return {
        (publisher, subscriber): (str(group.verdict), tuple(sorted(group.codes)))
        for group in report.groups
        for publisher in group.publishers
        for subscriber in group.subscribers
    }


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_a_pair_in_a_crowd_has_the_verdict_that_it_has_alone(pack, seed):
    system = a_system(pack, seed)
    crowd = by_pair(check(system, packs=[POST]))
    random = Random(seed)  # noqa: S311 - no secrets
    found = set()
    for _ in range(ASKED):
        ends = [random.choice(system.endpoints[0::2]), random.choice(system.endpoints[1::2])]
        alone = by_pair(check(replace(system, endpoints=ends), packs=[POST]))
        names = ends[0].id, ends[1].id
        assert {names: crowd.get(names)} == {names: alone.get(names)}
        found.add(alone.get(names))
    assert len(found) > 3
