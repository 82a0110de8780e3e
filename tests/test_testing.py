"""The case runner that pack authors use."""

import re

import pytest

from cqos_core.packs import Count, Policy, RulePack, forbids, offered
from cqos_core.testing import Case, run_case

SIZE = Policy("size", Count(), None, "The size of a message.")
LIMIT = Policy("limit", Count(), "8", "The largest one.", level="option")
RULE = forbids(
    offered(SIZE) > LIMIT,
    code="PO101",
    name="too-big",
    because="it does not fit",
    clause="none",
    says="{endpoint} sends {size}, and {limit} is the limit",
)
PACK = RulePack(id="posts", title="Posts", summary="Messages.", policies=(SIZE, LIMIT), rules=(RULE,))


@pytest.mark.parametrize(
    ("rule", "content", "wrong"),
    [
        ("PO101", {"publisher": {"sise": 3}, "expect": "ok"}, "CQ202 is about the case itself"),
        ("PO101", {"publisher": {"size": "three"}, "expect": "ok"}, "CQ203 is about the case itself"),
        (
            "PO101",
            {"publisher": {"size": 3}, "options": {"limits": 2}, "expect": "ok"},
            "CQ202 is about the case itself",
        ),
        ("PO999", {"publisher": {"size": 3}, "expect": "ok"}, "no rule has the code PO999; known: PO101"),
    ],
)
def test_a_case_that_tries_nothing_fails(rule, content, wrong):
    with pytest.raises(AssertionError, match=re.escape(wrong)):
        run_case(Case(rule, "posts", "mistyped", {"name": "mistyped", **content}), [PACK])


def test_a_case_may_try_what_is_wrong_with_settings():
    run_case(Case("CQ203", "posts", "text", {"publisher": {"size": "three"}, "expect": "error"}), [PACK])
    listed = {"publisher": {"size": "three"}, "expect": "ok", "findings": ["CQ203"]}
    run_case(Case("PO101", "posts", "text", {"name": "text", **listed}), [PACK])


def test_a_headline_with_braces_that_nothing_fills_fails_its_case():
    sent = {"publisher": {"size": 9}, "expect": "warning"}
    with pytest.raises(AssertionError, match=r"PO101 says \{limit\}, for which there is no value here"):
        run_case(Case("PO101", "posts", "over the default limit", {"name": "over", **sent}), iter([PACK]))
    run_case(Case("PO101", "posts", "over a stated limit", {"name": "over", **sent, "options": {"limit": 7}}), [PACK])
