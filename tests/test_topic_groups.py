"""Who meets whom, and who falls together."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

from cqos_core import Acceptance, explain
from cqos_core.packs import by_option
from tests.made_up_protocol import POST, checked, only, participant, reader, world, writer

SIGNED = reader("a", "r", care="signed")


def together(*parts: Any, **fields: Any) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
    """The publishers and subscribers of each group of pairs that fall together in the report."""
    return sorted((each.publishers, each.subscribers) for each in checked(*parts, **fields).groups)


def test_endpoints_meet_on_their_protocol_and_topic():
    report = checked(writer("a", "w1"), reader("a", "r1"), writer("b", "w2"), reader("b", "r2"), writer(None, "w3"))
    assert [(each.protocol, each.topic, each.publishers, each.subscribers) for each in report.groups] == [
        ("post", "a", ("w1",), ("r1",)),
        ("post", "b", ("w2",), ("r2",)),
    ]


def test_equal_values_fall_together_however_they_are_written():
    assert together(
        writer("a", "w1", care="signed", delay="2s"),
        writer("a", "w2", treatment="CARE_SIGNED", delay="PT2S"),
        writer("a", "w3", care="plain"),
        SIGNED,
    ) == [(("w1", "w2"), ("r",)), (("w3",), ("r",))]


def test_what_tells_pairs_apart_beside_their_values():
    both, each = [(("w1", "w2"), ("r",))], [(("w1",), ("r",)), (("w2",), ("r",))]
    pair = [writer("a", "w1"), SIGNED]
    other = writer("a", "w2")
    assert together(*pair, other) == both
    assert together(*pair, replace(other, label="x", external=True)) == both
    assert together(*pair, writer("a", "w2", care="signed")) == each
    assert together(*pair, other, participant("w2", town=1)) == each[:1]


def test_what_is_accepted_of_one_endpoint_is_a_finding_of_its_own():
    accept = [Acceptance("POST101", "so be it", endpoint="w2")]
    report = checked(writer("a", "w1"), writer("a", "w2"), SIGNED, accept=accept)
    found = [(each.accepted, sorted({*each.endpoints} - {"r"})) for each in report.findings if each.code == "POST101"]
    assert found == [(None, ["w1"]), ("so be it", ["w2"])]


def test_groups_depend_on_nothing_but_their_content():
    parts = [writer("a", f"w{n}", care=("plain", "signed")[n % 2]) for n in range(9)]
    parts += [reader("a", f"r{n}", delay=f"{n % 3 + 1}s") for n in range(9)]
    expected = together(*parts)
    for seed in range(5):
        random.Random(seed).shuffle(parts)  # noqa: S311 - no secret
        assert together(*parts) == expected


def meet(offered: dict[str, Any], requested: dict[str, Any], **participants: Any) -> bool:
    """Whether a writer and a reader of one topic meet."""
    owners = [participant(name, **stated) for name, stated in participants.items()]
    return checked(writer("a", "w", **offered), reader("a", "r", **requested), *owners).pair_count == 1


def test_meeting_conditions_keep_endpoints_apart():
    assert meet({}, {})
    assert not meet({}, {}, w={"town": 1})
    assert meet({}, {}, w={"town": 1}, r={"town": 1})
    assert meet({"streets": "[Elm, Oak]"}, {"streets": "[Oak]"})
    assert not meet({"streets": "[Elm]"}, {"streets": "[Oak]"})
    assert not meet({"streets": "[Elm]"}, {})


def test_unknown_values_keep_no_endpoints_apart():
    assert meet({"stamp": "red"}, {})
    assert meet({"stamp": "red"}, {"stamp": "red"})
    assert not meet({"stamp": "red"}, {"stamp": "blue"})


def test_a_match_that_depends_on_an_assumption_leaves_the_pair_unknown():
    words = {"usual": by_option("carrier", bike="red", otherwise="blue")}
    policies = tuple(replace(each, words=words) if each.name == "stamp" else each for each in POST.policies)
    packs = [replace(POST, policies=policies)]
    parts = [writer("box", stamp="red"), reader("box", stamp="usual")]
    report = checked(*parts, packs=packs)
    finding = only(report, "POST403")
    assert report.verdict == finding.verdict == "unknown"
    assert finding.severity == "warning"
    assert report.groups[0].codes == ("POST403",)
    explained = explain(world(*parts), publisher="writer", subscriber="reader", packs=packs)
    assert explained.verdict == "unknown"
    assert "POST403" in [each.code for each in explained.findings]
    assert checked(*parts, packs=packs, options={"carrier": "bike"}).verdict == "compatible"
    assert not checked(*parts, packs=packs, options={"carrier": "train"}).groups
    # A fact that is not stated keeps no pair apart.
    assert checked(writer("box", stamp="red"), reader("box")).verdict == "compatible"
