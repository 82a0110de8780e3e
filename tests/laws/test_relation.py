"""Law: what is found at once about many values is what judging every combination says."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING, Any, Final

import pytest

from cqos_core.api import context
from cqos_core.language.relation import related
from cqos_core.matching.topic_groups import endpoints_by_topic
from cqos_core.model.settings import Setting
from cqos_core.model.system import Acceptance, Endpoint, Participant, System
from cqos_core.resolving.resolver import resolve
from cqos_dds.pack import PACK as DDS
from cqos_mqtt.pack import PACK as MQTT
from cqos_ros2.pack import PACK as ROS2
from tests.effort import EXPLORE
from tests.made_up_protocol import POST

if TYPE_CHECKING:
    from cqos_core.language.policy import Policy
    from cqos_core.language.values import Values
    from cqos_core.packs.pack import RulePack

WHERE: Final = context([POST, DDS, MQTT, ROS2])
PACKS: Final = (POST, DDS, MQTT, ROS2)
WORDS: Final = {
    "count": ("1", "2", "5"),
    "duration": ("1s", "2s", "3s", "infinite"),
    "names": ("[]", "[a]", "[a, b]", "[a*, c]", "['[ab]']", "['*']", "[b, '?']"),
    "text": ("x", "y"),
    "flag": ("true", "false"),
}


SEEDS: Final = 40 if EXPLORE else 2


def a_system(pack: RulePack, seed: int) -> System:
    """Endpoints of one topic, nearly all different; some values are not known, and some endpoints are accepted."""
    random = Random(seed)  # noqa: S311 - no secrets
    system = System("random", pack.id)

    def settings(level: str, most: int) -> dict[str, Setting]:
        policies = [each for each in pack.policies if each.level == level and not each.derived]
        chosen = random.sample(policies, min(most, len(policies)))
        return {each.name: setting(each) for each in chosen}

    def setting(policy: Policy) -> Setting:
        words = getattr(policy.domain, "names", ()) or WORDS.get(policy.domain.kind, ("x",))
        return Setting(random.choice(words), unknown=random.choice(("",) * 9 + ("nobody knows",)))

    for name in ("p0", "p1", "p2"):
        system.participants[name] = Participant(name, settings=settings("participant", 1) | settings("option", 1))
    for number in range(24):
        role: Any = ("publisher", "subscriber")[number % 2]
        owner = random.choice([*system.participants])
        own = settings("endpoint", 6)
        system.endpoints.append(Endpoint(id=f"e{number}", role=role, topic="t", participant=owner, settings=own))
    rules = [bound.rule.code for bound in (*pack.by_scope["meets"], *pack.by_scope["pair"])]
    system.accept = [Acceptance(rule=random.choice(rules), because="known", endpoint=f"e{random.randrange(24)}")]
    return system


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.id)
def test_what_is_certain_is_what_every_combination_amounts_to(pack, seed):
    resolved = resolve(a_system(pack, seed), WHERE.find_pack).endpoints
    endpoints = max(endpoints_by_topic(resolved).values(), key=len)
    firsts = [each.profile.values for each in endpoints if each.role == "publisher"]
    seconds: list[tuple[Values, int]] = []
    for each in endpoints:
        if each.role == "subscriber":
            seconds.append((each.profile.values, 1 << len(seconds)))
    decided = 0
    for bound in (*pack.by_scope["meets"], *pack.by_scope["pair"]):
        found = related(bound.bound, firsts, seconds)
        if found is None:
            continue
        for row, first in enumerate(firsts):
            for second, bit in seconds:
                result = bound.bound.judge(first, second).result
                said = True if found.true[row] & bit else False if found.false[row] & bit else None
                assert bool(found.open[row] & bit) is (said is None)
                assert said is None or said is result, bound.rule.code
                decided += said is not None
    assert decided
