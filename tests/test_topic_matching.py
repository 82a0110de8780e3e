"""Topics whose names differ and match, and values that follow from a whole system; the protocol is a post office with letter boxes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core import Broker, PackError, ProfileRef, Session, Setting
from cqos_core.packs import (
    Completion,
    Count,
    Flag,
    KnownEntity,
    Policy,
    Preset,
    SystemFacts,
    Text,
    as_condition,
    broker,
    forbids,
    offered,
    requested,
    requires,
)
from tests.made_up_protocol import POST, checked, codes, only, participant, profile, reader, settings, world, writer

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence


TWICE = Policy("twice", Flag(), "false", roles=("subscriber",))
ALONE = Policy("alone", Flag(), "false", roles=("publisher",))
LIMIT = Policy("limit", Count(), "50", level="broker")
OFFICE = Policy("broker", Text(), None, level="participant", aliases=("office",))


def along_the_street(publishers: Collection[str], subscribers: Collection[str]) -> Iterator[tuple[str, str]]:
    """``main*`` meets everything that begins with `main`."""
    for published in publishers:
        for subscribed in subscribers:
            if subscribed.endswith("*") and subscribed != published and published.startswith(subscribed[:-1]):
                yield published, subscribed


def complete(
    participants: Sequence[KnownEntity], endpoints: Sequence[KnownEntity], brokers: Mapping[str, KnownEntity]
) -> Completion:
    writers = [at for at, each in enumerate(endpoints) if each.role == "publisher"]
    facts = {at: settings(alone=True) for at in writers} if len(writers) == 1 else {}
    implied = [
        writer(f"farewell/{each.id}", f"{each.id}/farewell") for each in participants if each.value(OFFICE) is not None
    ]
    return Completion({each.id: settings(town=len(brokers)) for each in participants}, facts, tuple(implied))


PACK = replace(
    POST,
    policies=(*POST.policies, TWICE, ALONE, LIMIT, OFFICE),
    rules=(
        *POST.rules,
        forbids(requested(TWICE) & offered(ALONE), code="POST901", name="twice", because="it comes twice"),
        forbids(as_condition(offered(ALONE)), code="POST902", name="alone", because="nobody else writes"),
        requires(
            offered(POST.policy("copies")) <= broker(LIMIT), code="POST903", name="over-limit", because="it is full"
        ),
    ),
    presets={**POST.presets, "small": Preset({"limit": "1"}, "A small office.", level="broker")},
    topic_matching=replace(POST.topic_matching, match=along_the_street, overlapping="twice"),
    system_facts=SystemFacts(complete),
)


def report(*parts: Any, **fields: Any) -> Any:
    return checked(world(*parts, **fields), packs=[PACK])


def met(found: Any) -> list[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    return [(group.topic, group.publishers, group.subscribers) for group in found.groups]


def test_keys_that_differ_meet_on_the_publishers_key():
    found = report(writer("main/1", "w1"), writer("main/2", "w2"), reader("main*", "r"), reader("main/2", "s"))
    assert met(found) == [("main/1", ("w1",), ("r",)), ("main/2", ("w2",), ("r", "s"))]
    assert found.topics == 2


def test_a_match_on_another_key_is_enough():
    found = report(writer("main/1"), reader("main*", "r"), reader("side*", "s"))
    assert only(found, "CQ401").endpoints == ("s",)


def test_a_mistake_of_a_subscriber_is_one_finding_for_all_its_matches():
    found = report(*(writer(f"main/{n}", f"w{n}") for n in range(3)), reader("main*", "r", returned=True))
    assert only(found, "CQ210").endpoints == ("r",)


def test_keys_that_would_meet_but_for_their_spelling_are_near_misses():
    found = report(writer("Main/1", "w"), reader("main*", "r"))
    assert set(only(found, "CQ403").endpoints) == {"w", "r"}


def test_two_subscribers_of_one_participant_differ_from_those_of_two():
    one = report(writer("main/1"), reader("main*", "a/1"), reader("main/1", "a/2"))
    assert only(one, "POST901").pairs == 2
    assert "POST901" not in codes(report(writer("main/1"), reader("main*", "a/1"), reader("main/1", "b/2")))
    assert "POST901" not in codes(report(writer("main/1"), reader("main*", "a/1"), reader("main*", "a/2")))
    assert "POST901" not in codes(report(writer("main/1"), reader("main*", "a/1"), reader("side/1", "a/2")))


def test_what_follows_from_the_whole_reaches_endpoints_and_participants():
    assert "POST902" in codes(report(writer("box"), reader("box")))
    assert "POST902" not in codes(report(writer("box", "v"), writer("box", "w"), reader("box")))


def test_participants_have_what_follows_from_their_settings():
    found = report(writer("box"), reader("farewell/w", "r"), participant("w", office="x"))
    assert ("farewell/w", ("w/farewell",), ("r",)) in met(found)


def test_a_session_follows_what_an_edit_changes_elsewhere():
    session = Session(world(writer("box", "v"), reader("box")), packs=[PACK])
    assert "POST902" in codes(session.report())
    session.put(writer("box", "v", copies=9))
    other = replace(writer("other", "v/2"), participant="v")
    session.put(other)
    assert "POST902" not in codes(session.report())
    session.remove(other.id)
    assert "POST902" in codes(session.report())


# Brokers


@pytest.mark.parametrize(
    ("stated", "profiles", "speaks"),
    [
        ({}, (), False),
        ({"limit": "19"}, (), True),
        ({}, ("small",), True),
        ({"limit": "20"}, ("small",), False),
        ({}, ("own",), True),
        ({}, ("own", "large"), False),
        ({}, ("large", "own"), True),
    ],
)
def test_a_broker_takes_values_from_profiles_and_presets(stated, profiles, speaks):
    office = Broker("main", "post", settings(**stated), tuple(ProfileRef(name) for name in profiles))
    found = report(
        writer("box"),
        reader("box"),
        profile("own", "small"),
        profile("large", limit=100),
        brokers={"main": office},
    )
    assert ("POST903" in codes(found)) is speaks


def test_unknown_settings_of_a_broker_are_reported():
    found = report(writer("box"), reader("box"), brokers={"main": Broker("main", "post", settings(limits=1))})
    assert "did you mean `limit`" in (only(found, "CQ202").help or "")


def test_a_broker_of_another_protocol_is_nobodys_here():
    found = report(writer("box"), reader("box"), brokers={"main": Broker("main", "mail", settings(limits=1))})
    assert "CQ202" not in codes(found)


def test_settings_of_a_broker_from_several_sources_add_up():
    from cqos_core.files.system_merge import merge

    one = world(writer("box"), brokers={"main": Broker("main", "post", {"limit": Setting("1")})})
    two = world(reader("box"), brokers={"main": Broker("main", "post", profiles=(ProfileRef("small"),))})
    whole = merge([one, two])
    assert whole.brokers["main"].settings["limit"].text == "1"
    assert [ref.name for ref in whole.brokers["main"].profiles] == ["small"]
    assert whole.notes == []


def test_a_preset_has_policies_of_its_level():
    with pytest.raises(PackError, match="`limit` is no endpoint policy"):
        replace(PACK, presets={"x": Preset({"limit": "1"})})
    with pytest.raises(PackError, match="`care` is no broker policy"):
        replace(PACK, presets={"x": Preset({"care": "plain"}, level="broker")})


def test_that_nothing_was_compared_is_a_note_where_all_partners_are_elsewhere():
    far = {"external": True}
    assert only(report(writer("a", more=far), reader("b", more=far)), "CQ404").severity == "note"
    assert only(report(writer("a", more=far), reader("b")), "CQ404").severity == "warning"


def test_what_is_alike_on_all_topics_that_a_subscriber_meets_is_one_finding():
    writers = [writer(f"main/{n}", f"w{n}", care="plain") for n in range(5)]
    found = report(*writers, writer("main/6", "w6", care="signed"), reader("main*", "r", care="insured"))
    findings = [each for each in found.findings if each.code == "POST101"]
    assert sorted((len(each.sides[1].members), each.pairs, len(each.more_topics)) for each in findings) == [
        (1, 1, 0),
        (5, 5, 4),
    ]
