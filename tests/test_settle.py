"""Values that an endpoint takes from its peers when it is created, and what the order of start has to do with it."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from cqos_core.api import check
from cqos_core.language.domains import Choice, Duration
from cqos_core.language.policy import Policy
from cqos_core.language.values import COMBINATIONS, FromPeers
from tests.made_up_protocol import POLICIES, POST, RULES, checked, codes, facts, only, participant, reader, writer


def settled(*parts: Any, policy: str = "care", of: str = "r", packs: Any = (POST,), **fields: Any) -> str:
    """The value of one policy of one endpoint once everybody is there, as `explain` prints it."""
    return facts(*parts, of=of, packs=packs, **fields)[policy].value


def by_order(publishers_first: str, subscribers_first: str, *others: str, word: str = "best") -> str:
    """How a value is printed that depends on the order of start."""
    cases = [f"{publishers_first} with publishers first", f"{subscribers_first} with subscribers first", *others]
    return f"{word} ({'; '.join(cases)})"


BEST = reader("box", "r", care="best")


def test_a_value_from_peers_is_what_both_orders_of_start_give():
    assert settled(BEST) == "insured"
    assert settled(BEST, writer("box", care="insured")) == "insured"
    # Alone it would have asked for insured letters; beside a plain writer it asks for plain ones.
    assert settled(BEST, writer("box", care="plain")) == by_order("plain", "insured")


def test_who_starts_after_whom_may_be_stated():
    plain = writer("box", care="plain")
    after = replace(BEST, starts_after=("writer",))
    assert settled(after, plain) == "plain"
    assert settled(BEST, plain, participant("r", {"starts_after": ("writer",)})) == "plain"
    assert settled(BEST, replace(plain, starts_after=("r",))) == "insured"
    assert settled(BEST, plain, participant("writer", {"starts_after": ("r",)})) == "insured"
    # One plain writer that is there before is enough, whatever the other is and whenever it starts.
    assert settled(after, plain, writer("box", "w2", care="insured")) == "plain"
    insured = writer("box", care="insured")
    assert settled(after, insured, writer("box", "w2", care="plain")) == by_order("plain", "insured")
    assert settled(after, insured, replace(writer("box", "w2", care="plain"), starts_after=("r",))) == "insured"
    # What starts after the writer is after all that the writer is after.
    by_way = [replace(plain, starts_after=("manager",)), participant("manager", {"starts_after": ("r",)})]
    assert settled(BEST, *by_way) == "insured"
    both = replace(BEST, starts_after=("writer", "w2"))
    assert settled(both, plain, writer("box", "w2", care="plain")) == "plain"


def test_the_finding_says_that_it_depends_on_the_start_order_and_what_to_state():
    plain = writer("box", "w", care="plain")
    report = checked(plain, BEST)
    finding = only(report, "POST101")
    assert report.verdict == "unknown"
    assert finding.message.startswith("depends on start order: whether publisher `w` and subscriber `r` fit in care")
    assert {str(world): str(verdict) for world, verdict in finding.worlds.items()} == {
        "start order=publishers first": "compatible",
        "start order=subscribers first": "incompatible",
    }
    assert "starts_after" in (finding.help or "")
    assert [fact.origin for side in finding.sides for fact in side.facts] == ["settled from best", "explicit"]
    assert codes(checked(plain, replace(BEST, starts_after=("w",)))) == []
    assert codes(checked(replace(plain, starts_after=("r",)), BEST)) == ["POST101", "POST301"]


def test_only_peers_that_it_meets_count():
    elsewhere = [writer("box", "w2", care="plain"), participant("w2", town=5)]
    assert settled(BEST, writer("box", care="insured"), *elsewhere) == "insured"
    assert settled(BEST, writer("other", "w3", care="plain")) == "insured"


def test_peers_that_are_not_known_leave_it_open():
    unknown = writer("box", care="unknown")
    for best in (BEST, replace(BEST, starts_after=("writer",))):
        report = checked(unknown, best)
        assert report.verdict == "unknown"
        assert "fit in care is not known: its peers are not known" in only(report, "POST101").message


def test_peers_that_depend_on_something_are_taken_apart():
    usual = writer("box", care="usual")
    after = replace(BEST, starts_after=("writer",))
    assert settled(after, usual) == "best (plain with bike, train; insured with ship)"
    assert settled(after, usual, options={"carrier": "train"}) == "plain"
    report = checked(usual, after)
    assert report.verdict == "compatible"  # whatever the carrier, it takes what is offered


# The ways in which peers may be put together

TIMES = ["1s", "3s", "infinite"]
WAYS: dict[str, tuple[str, str, str]] = {
    # with peers of 1s, 3s and infinite; with one peer of infinite; without peers; the word itself where it stays open
    "any": ("adapt", "infinite", "5s"),
    "constant": ("5s", "5s", "5s"),
    "largest": ("infinite", "infinite", "5s"),
    "largest_stated": ("3s", "infinite", "5s"),
    "smallest_stated": ("1s", "infinite", "5s"),
    "strongest_if_all": ("0s", "infinite", "5s"),
    "strongest_if_any": ("infinite", "infinite", "5s"),
}


def pack_with(way: str) -> Any:
    pause = Policy("pause", Duration(), "infinite", words={"adapt": FromPeers("5s", way)})
    return replace(POST, policies=(*POLICIES, pause), rules=RULES)


@pytest.mark.parametrize("way", COMBINATIONS)
def test_every_way_to_put_peers_together(way):
    packs = [pack_with(way)]

    def beside(*pauses: str) -> Any:
        writers = [writer("box", f"w{number}", pause=pause) for number, pause in enumerate(pauses)]
        after = tuple(each.id for each in writers)
        adapting = replace(reader("box", "r", pause="adapt"), starts_after=after)
        return settled(adapting, *writers, policy="pause", packs=packs)

    assert (beside(*TIMES), beside("infinite"), beside()) == WAYS[way]


def test_publishers_may_take_values_from_subscribers_too():
    pack = pack_with("smallest_stated")
    adapting = writer("box", "w", pause="adapt")
    readers = [reader("box", "r1", pause="1s"), reader("box", "r2", pause="3s")]
    value = settled(adapting, *readers, policy="pause", of="w", packs=[pack])
    # If it starts after the second reader and before the first one, it takes what the second one has.
    assert value == by_order("5s", "1s", "3s with another order that gives 3s", word="adapt")


def test_two_that_wait_for_each_other_see_each_other_as_they_are_alone():
    pack = pack_with("largest")
    pair = [writer("box", "w", pause="adapt"), reader("box", "r", pause="adapt")]
    assert settled(*pair, policy="pause", of="w", packs=[pack]) == "5s"
    assert settled(*pair, policy="pause", of="r", packs=[pack]) == "5s"


def test_one_that_is_created_with_its_peer_has_the_peers_value_at_once():
    ladder = Choice("low", "high")
    mode = Policy("mode", ladder, "low", words={"adapt": FromPeers("low", "largest", waits=True)})
    pack = replace(POST, policies=(*POLICIES, mode))
    adapting = reader("box", "r", mode="adapt")
    assert settled(adapting, writer("box", mode="high"), policy="mode", packs=[pack]) == "high"
    assert settled(adapting, policy="mode", packs=[pack]) == "low"
    two = [writer("box", "w1", mode="high"), writer("box", "w2", mode="low")]
    assert settled(adapting, *two, policy="mode", packs=[pack]) == by_order("high", "low", word="adapt")


def test_a_long_chain_of_starts_is_followed_to_its_end():
    number = 400
    participants = {
        f"x{number - at:03}": {
            "publishes" if at % 2 else "subscribes": {"/t": "best_available"},
            **({"starts_after": [f"x{number - at + 1:03}"]} if at else {}),
        }
        for at in range(number)
    }
    report = check(json.dumps({"cqos": 1, "protocol": "ros2", "participants": participants}).encode())
    assert sum(group.pairs for group in report.groups) == (number // 2) ** 2
