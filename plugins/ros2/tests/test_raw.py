"""`comparison: rmw` answers what `rmw_qos_profile_check_compatible` answers: its table, and its text as an oracle."""

from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cqos_core import check_pair
from cqos_ros2.pack import PACK
from cqos_ros2.raw import RawDuration

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


@settings(max_examples=300)
@given(SETTINGS, SETTINGS)
def test_whole_profiles_get_the_answer_of_the_reference(publisher: dict[str, Any], subscription: dict[str, Any]):
    assert verdict(written(publisher), written(subscription)) == reference(publisher, subscription)


@settings(max_examples=200)
@given(SETTINGS, SETTINGS)
def test_zenoh_has_one_warning_and_no_error(publisher: dict[str, Any], subscription: dict[str, Any]):
    lost = publisher["durability"] == "transient_local" and subscription["durability"] == "volatile"
    assert verdict(written(publisher), written(subscription), "zenoh") == (WARNING if lost else OK)


@given(st.integers(0, 2**64 - 1), st.integers(0, 2**64 - 1))
def test_raw_durations_are_printed_as_they_are_read(seconds: int, nanoseconds: int):
    domain = RawDuration()
    text = f"{{sec: {seconds}, nsec: {nanoseconds}}}"
    assert domain.format(domain.parse(text)) == text
