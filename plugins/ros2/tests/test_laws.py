"""Laws that hold for every pair under the standard's semantics."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check_pair
from cqos_core.packs import Choice
from cqos_ros2.pack import PACK

RANK = {"compatible": 0, "unknown": 1, "incompatible": 2}
DURATIONS = ["1ns", "999999999ns", "1s", "1000000001ns", "infinite"]
ORDERS: dict[str, list[str]] = {
    # weakest offer and weakest request first
    "reliability": ["best_effort", "reliable"],
    "durability": ["volatile", "transient_local"],
    "liveliness": ["automatic", "manual_by_node", "manual_by_topic"],
    "deadline": DURATIONS[::-1],
    "liveliness_lease_duration": DURATIONS[::-1],
}
OPEN = ["system_default", "unknown", "best_available"]

profiles = st.fixed_dictionaries({}, optional={policy: st.sampled_from(values) for policy, values in ORDERS.items()})
open_profiles = st.fixed_dictionaries(
    {},
    optional={
        policy: st.sampled_from([*values, *(word for word in OPEN if word in PACK.policy(policy).words)])
        for policy, values in ORDERS.items()
    },
)
options = st.fixed_dictionaries(
    {}, optional={"rmw": st.sampled_from(["cyclonedds", "fastdds", "connext", "zenoh", "micro_ros"])}
)


def verdict(offered: dict[str, Any], requested: dict[str, Any], opts: dict[str, Any]) -> int:
    return RANK[check_pair("ros2", offered, requested, opts, packs=[PACK]).verdict]


@given(profiles, open_profiles, options, st.data())
def test_a_stronger_offer_never_makes_a_pair_worse(offered, requested, opts, data):
    policy = data.draw(st.sampled_from(sorted(ORDERS)))
    order = ORDERS[policy]
    weak, strong = sorted(data.draw(st.tuples(st.sampled_from(order), st.sampled_from(order))), key=order.index)
    before = verdict({**offered, policy: weak}, requested, opts)
    assert verdict({**offered, policy: strong}, requested, opts) <= before


@given(open_profiles, profiles, options, st.data())
def test_a_weaker_request_never_makes_a_pair_worse(offered, requested, opts, data):
    # An offer of best_available answers to the request, so it may well be weaker for a weaker one (ROS104 has
    # the case: it looks for manual_by_topic, and manual_by_node goes unseen).
    offered = {policy: value for policy, value in offered.items() if value != "best_available"}
    policy = data.draw(st.sampled_from(sorted(ORDERS)))
    order = ORDERS[policy]
    weak, strong = sorted(data.draw(st.tuples(st.sampled_from(order), st.sampled_from(order))), key=order.index)
    before = verdict(offered, {**requested, policy: strong}, opts)
    assert verdict(offered, {**requested, policy: weak}, opts) <= before


@given(open_profiles)
def test_what_fits_under_each_middleware_fits_under_none_in_particular(profile):
    each = [verdict(profile, profile, {"rmw": rmw}) for rmw in ("cyclonedds", "fastdds", "connext")]
    together = verdict(profile, profile, {})
    assert together in each or (together == RANK["unknown"] and len(set(each)) > 1)


@given(profiles, profiles)
def test_every_pair_is_compatible_on_zenoh(offered, requested):
    assert verdict(offered, requested, {"rmw": "zenoh"}) == RANK["compatible"]


@given(open_profiles, open_profiles, options)
def test_a_fix_removes_its_finding(offered, requested, opts):
    report = check_pair("ros2", offered, requested, opts, packs=[PACK])
    for finding in report.findings:
        for remedy in finding.remedies:
            changed = {remedy.policy: remedy.value}
            publisher = {**offered, **changed} if remedy.role == "publisher" else offered
            subscriber = {**requested, **changed} if remedy.role == "subscriber" else requested
            after = check_pair("ros2", publisher, subscriber, opts, packs=[PACK])
            assert finding.code not in {
                each.code for each in after.findings if each.sides[0].role == finding.sides[0].role
            }


def test_every_order_here_is_the_order_of_the_pack():
    for policy, values in ORDERS.items():
        domain = PACK.policy(policy).domain
        ranks = [domain.parse(value) for value in values]
        assert ranks == sorted(ranks, reverse=not isinstance(domain, Choice)), policy
