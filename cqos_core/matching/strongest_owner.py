"""The strength of the strongest publisher from which a subscriber takes samples, where one publisher counts at a time.

A pair does not show it, so that a rule of a pair could not know that a weaker publisher has no effect. Only publishers count that certainly
exist, match and fit; further ones may exist outside of what was read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.language.policy import ENDPOINT
from cqos_core.language.relation import positions
from cqos_core.language.values import is_plain
from cqos_core.matching.judge import of_end, over_both, refusing_worlds
from cqos_core.model.finding import Verdict
from cqos_core.model.system import PUBLISHER

if TYPE_CHECKING:
    from cqos_core.matching.topic_groups import EndpointGroup, MatchedTopic
    from cqos_core.packs.pack import RulePack


def settle_strongest(topic: MatchedTopic) -> None:
    """Give subscribers of ``topic`` the strength of the strongest publisher that certainly fits, if that is more than they state."""
    pack = topic.pack
    timing = pack.timing
    if len(topic.publishers) < 2 or not timing.strongest:  # noqa: PLR2004 - one has no rival
        return
    strength, strongest = (pack.find(ENDPOINT, name) for name in (timing.strength, timing.strongest))
    assert strength is not None and strongest is not None  # noqa: S101, PT018 - the pack was validated
    strengths = [(value, each) for each in topic.publishers if isinstance(value := each.value(strength), int)]
    if len({value for value, _ in strengths}) < 2:  # noqa: PLR2004 - nor have equal ones
        return
    owning = [(value, each) for value, each in strengths if _owns(each, pack) and _exists(each)]
    owning.sort(key=lambda pair: pair[0], reverse=True)
    for members in topic.subscribers:
        stated = members.value(strongest)
        fitting = (value for value, each in owning if _fits(each, members, pack))
        largest = next(fitting, None)
        if largest is not None and isinstance(stated, int) and largest > stated:
            members.settled = members.profile.with_values({strongest: largest})


def _owns(members: EndpointGroup, pack: RulePack) -> bool:
    """Whether one publisher of a group counts at a time."""
    name, values = pack.timing.owned
    index = pack.find(ENDPOINT, name)
    if index is None:
        return False
    value = members.value(index)
    return is_plain(value) and pack.policies[index].format(value) in values


def _exists(members: EndpointGroup) -> bool:
    """Whether nothing refuses publishers of a group as such, under no assumption either."""
    profile, observed = members.profile, members.observed
    ends = of_end(profile, PUBLISHER, observed, members.wired)
    refused = any(verdict is Verdict.INCOMPATIBLE for verdict, _ in ends)
    return not refused and not refusing_worlds(profile, PUBLISHER, observed)


def _fits(publisher: EndpointGroup, subscriber: EndpointGroup, pack: RulePack) -> bool:
    """Whether two groups certainly match, and no rule refuses them."""
    rules = over_both(pack)
    said = rules.that_report(publisher.profile, subscriber.profile)
    return not any(rules.rules[at].rule.kind in {"meets", "requires"} for at in positions(said))
