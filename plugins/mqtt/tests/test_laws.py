"""Laws that hold for every pair: requirements only add findings, weaker ones never add, and order never matters."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check_pair
from cqos_mqtt.pack import PACK

RANK = {"compatible": 0, "unknown": 1, "incompatible": 2}
offers = st.fixed_dictionaries(
    {},
    optional={
        "qos": st.sampled_from([0, 1, 2]),
        "retain": st.booleans(),
        "message_expiry_interval": st.sampled_from([0, 1, 60, "infinite"]),
    },
)
requests = st.fixed_dictionaries(
    {},
    optional={
        "qos": st.sampled_from([0, 1, 2]),
        "retain_handling": st.sampled_from([0, 1, 2]),
        "no_local": st.booleans(),
    },
)
options = st.sampled_from([{}, {"protocol_version": "3.1.1"}, {"protocol_version": "5.0"}])
topics = st.sampled_from([{}, {"period": "1s"}, {"period": "1h"}])
# From the weakest need to the strongest.
ORDERS: dict[str, list[Any]] = {
    "latest": [False, True],
    "loss_free": [False, True],
    "duplicate_free": [False, True],
    "ordered": [False, True],
    "late_join": [0, 1, 2, 100],
    "offline": ["0s", "1s", "1min", "infinite"],
    "max_age": ["infinite", "1h", "1s", "0s"],
    "max_gap": ["infinite", "1h", "1s", "0s"],
    "liveness": ["infinite", "10min", "90s", "1s"],
}


def judged(offered: Any, requested: Any, opts: Any, topic: Any, needs: Any) -> tuple[int, set[str]]:
    report = check_pair("mqtt", offered, requested, opts, topic, [PACK], needs)
    spoken = {each.code for each in report.findings if each.verdict is not None}
    return RANK[report.verdict], spoken


@pytest.mark.parametrize("word", ORDERS)
@given(data=st.data(), offered=offers, requested=requests, opts=options, topic=topics)
def test_a_weaker_need_never_adds_a_finding(word, data, offered, requested, opts, topic):
    order = ORDERS[word]
    low, high = sorted(data.draw(st.tuples(*(st.integers(0, len(order) - 1),) * 2)))
    weak = judged(offered, requested, opts, topic, {word: order[low]})
    strong = judged(offered, requested, opts, topic, {word: order[high]})
    assert weak[0] <= strong[0]
    assert weak[1] <= strong[1]


@given(offered=offers, requested=requests, opts=options)
def test_without_a_need_every_pair_fits(offered, requested, opts):
    assert judged(offered, requested, opts, {}, {}) == (0, set())


@pytest.mark.parametrize("word", ["loss_free", "latest", "offline"])
@given(offered=offers, requested=requests, opts=options, topic=topics)
def test_a_higher_qos_of_both_never_makes_a_need_of_delivery_worse(word, offered, requested, opts, topic):
    needs = {word: "1min" if word == "offline" else True}
    before = judged(offered, requested, opts, topic, needs)[0]
    assert judged({**offered, "qos": 2}, {**requested, "qos": 2}, opts, topic, needs)[0] <= before


@given(
    offered=offers,
    requested=requests,
    opts=options,
    topic=topics,
    needs=st.fixed_dictionaries({}, optional={word: st.just(order[-1]) for word, order in ORDERS.items()}),
)
def test_a_fix_removes_its_finding(offered, requested, opts, topic, needs):
    report = check_pair("mqtt", offered, requested, opts, topic, [PACK], needs)
    for finding in report.findings:
        for remedy in finding.remedies:
            if remedy.policy not in {"qos", "retain", "message_expiry_interval", "retain_handling"}:
                continue
            changed = {remedy.policy: remedy.value}
            fixed = (offered | changed, requested) if remedy.role == "publisher" else (offered, requested | changed)
            after = check_pair("mqtt", *fixed, opts, topic, [PACK], needs)
            assert finding.code not in {each.code for each in after.findings}, remedy.text
