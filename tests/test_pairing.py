"""Who meets whom, and who falls together."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cqos_core.api import explain_pair
from cqos_core.language.policy import by_option
from cqos_core.matching.judge import apart
from cqos_core.matching.pairing import bucket, group, naming_endpoints
from cqos_core.matching.pipeline import context
from cqos_core.model.system import Acceptance
from cqos_core.resolving.resolve import resolve
from tests.worlds import CONTEXT, POST, checked, only, participant, reader, world, writer

if TYPE_CHECKING:
    from cqos_core.resolving.resolved import Resolved


def endpoints(*parts: Any, **fields: Any) -> list[Resolved]:
    return resolve(world(*parts, **fields), CONTEXT.find_pack).endpoints


def members(*parts: Any, accept: Any = (), **fields: Any) -> tuple[list[list[str]], list[list[str]]]:
    """Ids of the groups of publishers and of subscribers."""
    topic = group(endpoints(*parts, **fields), naming_endpoints(accept))
    sides = (topic.publishers, topic.subscribers)
    return tuple([[each.id for each in found.endpoints] for found in side] for side in sides)  # type: ignore[return-value]


def test_endpoints_are_sorted_by_protocol_and_topic():
    found = bucket(endpoints(writer("a", "w1"), reader("a", "r1"), writer("b", "w2"), writer(None, "w3")))
    assert {key: [each.id for each in value] for key, value in found.items()} == {
        ("post", "a"): ["w1", "r1"],
        ("post", "b"): ["w2"],
    }


def test_equal_values_fall_together_however_they_are_written():
    assert members(
        writer("a", "w1", care="signed", delay="2s"),
        writer("a", "w2", treatment="CARE_SIGNED", delay="PT2S"),
        writer("a", "w3", care="signed"),
        reader("a", "r1"),
    ) == ([["w1", "w2"], ["w3"]], [["r1"]])


def test_what_was_stated_divides_only_where_a_rule_asks_for_it():
    """POST302 asks whether the delay was stated; no rule asks that of the copies."""
    assert members(writer("a", "w1"), writer("a", "w2", copies="20"))[0] == [["w1", "w2"]]
    assert members(writer("a", "w1"), writer("a", "w2", delay="infinite"))[0] == [["w1"], ["w2"]]


def test_what_tells_endpoints_apart_beside_their_values():
    other = writer("a", "w2")
    accept = [Acceptance("POST101", "so be it", endpoint="w2"), Acceptance("POST101", "so be it", topic="a")]
    for parts, acceptances in (
        ((replace(other, observed=True),), ()),
        ((replace(other, starts_after=("r",)),), ()),
        ((other, participant("w2", {"starts_after": ("r",)})), ()),
        ((other, participant("w2", town=1)), ()),
        ((other,), accept),
    ):
        assert members(writer("a", "w1"), *parts, accept=acceptances)[0] == [["w1"], ["w2"]]
    assert members(writer("a", "w1"), replace(other, label="x", external=True))[0] == [["w1", "w2"]]


def test_groups_depend_on_nothing_but_their_content():
    parts = [writer("a", f"w{n}", care=("plain", "signed")[n % 2]) for n in range(9)]
    parts += [reader("a", f"r{n}", delay=f"{n % 3 + 1}s") for n in range(9)]
    expected = members(*parts)
    for seed in range(5):
        random.Random(seed).shuffle(parts)  # noqa: S311 - no secret
        assert members(*parts) == expected


def kept_apart(offered: dict[str, Any], requested: dict[str, Any], **participants: Any) -> list[str]:
    first, second = endpoints(
        writer("a", "w", **offered),
        reader("a", "r", **requested),
        *(participant(name, **stated) for name, stated in participants.items()),
    )
    return [bound.rule.code for bound in apart(first.profile, second.profile)]


def test_meeting_conditions_keep_endpoints_apart():
    assert kept_apart({}, {}) == []
    assert kept_apart({}, {}, w={"town": 1}) == ["POST401"]
    assert kept_apart({}, {}, w={"town": 1}, r={"town": 1}) == []
    assert kept_apart({"streets": "[Elm, Oak]"}, {"streets": "[Oak]"}) == []
    assert kept_apart({"streets": "[Elm]"}, {"streets": "[Oak]"}) == ["POST402"]
    assert kept_apart({"streets": "[Elm]"}, {}, r={"town": 1}) == ["POST401", "POST402"]


def test_unknown_values_keep_no_endpoints_apart():
    assert kept_apart({"stamp": "red"}, {}) == []
    assert kept_apart({"stamp": "red"}, {"stamp": "red"}) == []
    assert kept_apart({"stamp": "red"}, {"stamp": "blue"}) == ["POST403"]


def test_a_match_that_depends_on_an_assumption_leaves_the_pair_unknown():
    words = {"usual": by_option("carrier", bike="red", otherwise="blue")}
    policies = tuple(replace(each, words=words) if each.name == "stamp" else each for each in POST.policies)
    where = context([replace(POST, policies=policies)])
    parts = [writer("box", stamp="red"), reader("box", stamp="usual")]
    report = checked(*parts, where=where)
    finding = only(report, "POST403")
    assert report.verdict == finding.verdict == "unknown"
    assert finding.severity == "warning"
    assert report.groups[0].codes == ("POST403",)
    explained = explain_pair(world(*parts), "writer", "reader", where)
    assert explained.verdict == "unknown"
    assert "POST403" in [each.code for each in explained.findings]
    assert checked(*parts, where=where, options={"carrier": "bike"}).verdict == "compatible"
    assert not checked(*parts, where=where, options={"carrier": "train"}).groups
    # A fact that is not stated keeps no pair apart.
    assert checked(writer("box", stamp="red"), reader("box")).verdict == "compatible"
