"""Laws that hold for every pair under the standard's semantics."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check_pair
from cqos_core.packs import Choice
from cqos_dds.implementations import FAST_DDS
from cqos_dds.pack import PACK

RANK = {"compatible": 0, "unknown": 1, "incompatible": 2}
DURATIONS = ["0s", "1ns", "999999999ns", "1s", "1000000001ns", "infinite"]
ORDERS: dict[str, list[str]] = {
    # weakest offer and weakest request first
    "reliability": ["best_effort", "reliable"],
    "durability": ["volatile", "transient_local", "transient", "persistent"],
    "liveliness": ["automatic", "manual_by_participant", "manual_by_topic"],
    "destination_order": ["by_reception_timestamp", "by_source_timestamp"],
    "presentation.access_scope": ["instance", "topic", "group"],
    "presentation.coherent_access": ["false", "true"],
    "presentation.ordered_access": ["false", "true"],
    "deadline": DURATIONS[::-1],
    "latency_budget": DURATIONS[::-1],
    "liveliness.lease_duration": DURATIONS[::-1],
}
EQUAL = {"ownership": ["shared", "exclusive"], "data_representation": ["[]", "[xcdr1]", "[xcdr2]", "[xcdr2, xcdr1]"]}
IMPLEMENTATIONS = (*PACK.policy("implementation", "option").domain.names, "fastdds")  # type: ignore[attr-defined]

profiles = st.fixed_dictionaries(
    {}, optional={policy: st.sampled_from(values) for policy, values in (ORDERS | EQUAL).items()}
)
implementations = st.sampled_from(IMPLEMENTATIONS)


def findings(offered: dict[str, Any], requested: dict[str, Any], implementation: str = "standard") -> Any:
    return check_pair("dds", offered, requested, {"implementation": implementation}, packs=[PACK])


def verdict(offered: dict[str, Any], requested: dict[str, Any], implementation: str = "standard") -> int:
    return RANK[findings(offered, requested, implementation).verdict]


def two(data: Any) -> tuple[str, str, str]:
    policy = data.draw(st.sampled_from(sorted(ORDERS)))
    order = ORDERS[policy]
    weak, strong = sorted(data.draw(st.tuples(st.sampled_from(order), st.sampled_from(order))), key=order.index)
    return policy, weak, strong


@given(profiles, profiles, st.data())
def test_a_stronger_offer_never_makes_a_pair_worse(offered, requested, data):
    policy, weak, strong = two(data)
    assert verdict({**offered, policy: strong}, requested) <= verdict({**offered, policy: weak}, requested)


@given(profiles, profiles, st.data())
def test_a_weaker_request_never_makes_a_pair_worse(offered, requested, data):
    policy, weak, strong = two(data)
    assert verdict(offered, {**requested, policy: weak}) <= verdict(offered, {**requested, policy: strong})


@given(profiles)
def test_who_offers_what_it_requests_fits(profile):
    profile = {**profile, "reliability": "reliable"}
    if profile.get("data_representation") != "[xcdr2, xcdr1]":
        assert verdict(profile, profile) == RANK["compatible"]


@given(profiles, profiles)
def test_a_version_of_fast_dds_decides_what_fast_dds_alone_leaves_open(offered, requested):
    together = findings(offered, requested, "fastdds")
    # A version with which an end cannot be created is not assumed, and the report names those that are.
    assumed = {each.option: each.values for each in together.assumed}.get("dds.implementation", FAST_DDS)
    verdicts = {verdict(offered, requested, version) for version in assumed}
    assert RANK[together.verdict] == (verdicts.pop() if len(verdicts) == 1 else RANK["unknown"])


@given(profiles, profiles, implementations)
def test_a_fix_removes_its_finding(offered, requested, implementation):
    for finding in findings(offered, requested, implementation).findings:
        for remedy in finding.remedies:
            changed = {remedy.policy: remedy.value}
            publisher = {**offered, **changed} if remedy.role == "publisher" else offered
            subscriber = {**requested, **changed} if remedy.role == "subscriber" else requested
            after = findings(publisher, subscriber, implementation)
            assert finding.code not in {
                each.code for each in after.findings if each.sides[0].role == finding.sides[0].role
            }


def test_every_order_here_is_the_order_of_the_pack():
    for policy, values in ORDERS.items():
        domain = PACK.policy(policy).domain
        ranks = [domain.parse(value) for value in values]
        assert ranks == sorted(ranks, reverse=domain.kind == "duration"), policy
        if isinstance(domain, Choice):
            assert list(domain.names) == values
