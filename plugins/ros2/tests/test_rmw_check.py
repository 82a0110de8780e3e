"""`comparison: rmw` answers what `rmw_qos_profile_check_compatible` answers: its table, and its text as an oracle."""

from itertools import product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check_pair
from cqos_ros2.pack import PACK
from cqos_ros2.policies import POLICIES
from cqos_ros2.rmw_check import RAW, RawDuration

OK, WARNING, ERROR = "compatible", "unknown", "incompatible"

# The table of "Compatibility of a publisher and a subscription", rows publisher, columns subscription.
TABLE = """
                | weak | strong  | undetermined | best_available
weak            | ok   | error   | warning      | ok
strong          | ok   | ok      | ok           | ok
undetermined    | ok   | warning | warning      | ok
best_available  | ok   | ok      | ok           | ok
"""
ANSWERS = {"ok": OK, "warning": WARNING, "error": ERROR}
KINDS = {
    "reliability": ("best_effort", "reliable"),
    "durability": ("volatile", "transient_local"),
    "liveliness": ("automatic", "manual_by_topic"),
}
# Everything that is not under test is such that it fits.
QUIET = {"reliability": "reliable", "durability": "volatile", "liveliness": "automatic"}


@pytest.mark.parametrize(
    ("given_as", "cause"),
    [("system_default", "it is `system_default`, which the reference check"), ("unknown", "it is given as `unknown`")],
)
def test_what_is_not_known_is_called_as_it_was_written(given_as: str, cause: str):
    offered, requested = {**QUIET, "reliability": given_as}, {**QUIET, "reliability": "reliable"}
    report = check_pair("ros2", offered, requested, {"comparison": "rmw"}, packs=[PACK])
    assert f"is not known: {cause}" in report.findings[0].message


def verdict(offered: dict[str, Any], requested: dict[str, Any], rmw: str | None = None) -> str:
    options = {"comparison": "rmw"} | ({} if rmw is None else {"rmw": rmw})
    report = check_pair("ros2", {**QUIET, **offered}, {**QUIET, **requested}, options, packs=[PACK])
    return str(report.verdict)


def table() -> list[tuple[str, str, str]]:
    head, *rows = ([cell.strip() for cell in line.split("|")] for line in TABLE.strip("\n").splitlines())
    return [(row[0], column, ANSWERS[cell]) for row in rows for column, cell in zip(head[1:], row[1:], strict=True)]


def spelled(policy: str, name: str) -> tuple[str, ...]:
    weak, strong = KINDS[policy]
    return {"weak": (weak,), "strong": (strong,), "undetermined": ("system_default", "unknown")}.get(name, (name,))


@pytest.mark.parametrize("policy", KINDS)
@pytest.mark.parametrize(("publisher", "subscription", "answer"), table())
@pytest.mark.parametrize("rmw", [None, "cyclonedds", "fastdds", "connext"])
def test_the_whole_table(policy: str, publisher: str, subscription: str, answer: str, rmw: str | None):
    for offered, requested in product(spelled(policy, publisher), spelled(policy, subscription)):
        assert verdict({policy: offered}, {policy: requested}, rmw) == answer, (offered, requested)


def test_two_default_profiles_warn_because_nothing_is_resolved():
    report = check_pair("ros2", options={"comparison": "rmw"}, packs=[PACK])
    assert report.verdict == WARNING
    assert [finding.code for finding in report.findings] == ["ROS104"]
    assert check_pair("ros2", packs=[PACK]).verdict == OK


@pytest.mark.parametrize("policy", ["deadline", "liveliness_lease_duration"])
@pytest.mark.parametrize(
    ("publisher", "subscription", "answer"),
    [
        ("unspecified", "unspecified", OK),
        ("unspecified", "2s", ERROR),
        ("2s", "unspecified", OK),
        ("2s", "2s", OK),
        ("2s", "1999999999ns", ERROR),
        ("1999999999ns", "2s", OK),
        ("0s", "{sec: 0, nsec: 0}", OK),
        # explicit infinite is not unspecified
        ("unspecified", "infinite", ERROR),
        ("infinite", "unspecified", OK),
        ("infinite", "infinite", OK),
        ("infinite", "2s", ERROR),
        # unresolved markers are huge numbers
        ("best_available", "2s", ERROR),
        ("2s", "best_available", OK),
        ("unspecified", "best_available", ERROR),
        ("infinite", "best_available", ERROR),
        ("best_available", "infinite", OK),
        # fields are compared one after the other, and never carried
        ("{sec: 1, nsec: 0}", "{sec: 0, nsec: 2000000000}", ERROR),
        ("{sec: 0, nsec: 2000000000}", "{sec: 1, nsec: 0}", OK),
        ("{sec: 1, nsec: 500}", "{sec: 1, nsec: 499}", ERROR),
        ("{sec: 2147483647, nsec: 4294967295}", "infinite", OK),
        ("infinite", "{sec: 2147483647, nsec: 4294967295}", ERROR),
    ],
)
def test_durations_are_compared_as_they_are_written(policy: str, publisher: str, subscription: str, answer: str):
    assert verdict({policy: publisher}, {policy: subscription}) == answer


def test_manual_by_node_is_in_no_clause_of_the_reference():
    for one, other in product(("automatic", "manual_by_topic", "system_default", "manual_by_node"), repeat=2):
        if "manual_by_node" in {one, other}:
            assert verdict({"liveliness": one}, {"liveliness": other}) == OK


SETTINGS = st.fixed_dictionaries(
    {
        "reliability": st.sampled_from(["best_effort", "reliable", "system_default", "unknown", "best_available"]),
        "durability": st.sampled_from(["volatile", "transient_local", "system_default", "unknown", "best_available"]),
        "liveliness": st.sampled_from(
            ["automatic", "manual_by_node", "manual_by_topic", "system_default", "unknown", "best_available"]
        ),
        "deadline": st.tuples(st.integers(0, 3), st.sampled_from([0, 1, 10**9])),
        "liveliness_lease_duration": st.tuples(st.integers(0, 3), st.sampled_from([0, 1, 10**9])),
    }
)


def reference(publisher: dict[str, Any], subscription: dict[str, Any]) -> str:
    """Section 3 of the reference, in its own order and words."""
    for kind, (weak, strong) in KINDS.items():
        if publisher[kind] == weak and subscription[kind] == strong:
            return ERROR
    for duration in ("deadline", "liveliness_lease_duration"):
        if publisher[duration] == (0, 0) != subscription[duration]:
            return ERROR
        if (0, 0) not in {publisher[duration], subscription[duration]} and subscription[duration] < publisher[duration]:
            return ERROR
    for kind, (weak, strong) in KINDS.items():
        open_offer = publisher[kind] in {"system_default", "unknown"}
        open_request = subscription[kind] in {"system_default", "unknown"}
        if (open_offer and (open_request or subscription[kind] == strong)) or (
            publisher[kind] == weak and open_request
        ):
            return WARNING
    return OK


def written(profile: dict[str, Any]) -> dict[str, str]:
    return {k: v if isinstance(v, str) else f"{{sec: {v[0]}, nsec: {v[1]}}}" for k, v in profile.items()}


@given(SETTINGS, SETTINGS)
def test_whole_profiles_get_the_answer_of_the_reference(publisher: dict[str, Any], subscription: dict[str, Any]):
    assert verdict(written(publisher), written(subscription)) == reference(publisher, subscription)


@given(SETTINGS, SETTINGS)
def test_zenoh_has_one_warning_and_no_error(publisher: dict[str, Any], subscription: dict[str, Any]):
    lost = publisher["durability"] == "transient_local" and subscription["durability"] == "volatile"
    assert verdict(written(publisher), written(subscription), "zenoh") == (WARNING if lost else OK)


@given(st.integers(0, 2**64 - 1), st.integers(0, 2**64 - 1))
def test_raw_durations_are_printed_as_they_are_read(seconds: int, nanoseconds: int):
    domain = RawDuration()
    text = f"{{sec: {seconds}, nsec: {nanoseconds}}}"
    assert domain.format(domain.parse(text)) == text


# What a bridge takes from its publishers


def test_both_comparisons_read_the_same_words():
    for policy in POLICIES:
        if policy.level == "endpoint":
            # `manual_by_node` has a place among the values of one, and is a word of the other.
            assert {*RAW.get(policy.name, policy).words} - {"manual_by_node"} == {*policy.words}, policy.name


@pytest.mark.parametrize("policy", ["reliability", "durability"])
@pytest.mark.parametrize(
    ("side", "other", "answer"),
    [
        ("subscription", "strong", OK),
        ("subscription", "weak", WARNING),
        ("publisher", "strong", WARNING),
        ("publisher", "weak", OK),
    ],
)
def test_what_a_bridge_takes_from_publishers_is_undetermined(policy: str, side: str, other: str, answer: str):
    taken, known = {policy: "from_publishers"}, {policy: KINDS[policy][other == "strong"]}
    offered, requested = (known, taken) if side == "subscription" else (taken, known)
    for rmw in (None, "cyclonedds", "fastdds", "connext"):
        assert verdict(offered, requested, rmw) == answer
    # Zenoh's one warning does not ask about what is not known.
    assert verdict(offered, requested, "zenoh") == OK


def test_the_bridge_is_named_as_the_cause():
    stated = {**QUIET, "reliability": "from_publishers"}
    report = check_pair("ros2", stated, QUIET, {"comparison": "rmw", "rmw": "cyclonedds"}, packs=[PACK])
    (finding,) = (each for each in report.findings if each.code == "ROS101")
    assert finding.message.endswith("is not known: the bridge takes it from the publishers on its other side")


@pytest.mark.parametrize(
    ("offered", "requested", "answer"),
    [
        ("1s", "from_publishers", WARNING),
        ("unspecified", "from_publishers", WARNING),
        ("from_publishers", "1s", WARNING),
        ("from_publishers", "unspecified", OK),
    ],
)
def test_a_deadline_that_a_bridge_takes_from_publishers(offered: str, requested: str, answer: str):
    assert verdict({"deadline": offered}, {"deadline": requested}, "cyclonedds") == answer


@pytest.mark.parametrize("policy", ["liveliness", "lease_duration"])
@pytest.mark.parametrize("comparison", ["semantic", "rmw"])
def test_liveliness_is_never_taken_from_publishers(policy: str, comparison: str):
    report = check_pair("ros2", {policy: "from_publishers"}, {}, {"comparison": comparison}, packs=[PACK])
    assert "CQ203" in [finding.code for finding in report.findings]
