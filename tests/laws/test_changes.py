"""Law: whatever is edited, the changes of a session make the report of a fresh check of the one before."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import invariant

from cqos_core import Endpoint, Participant, Session, Setting, System, check
from cqos_core.model.changes import Changes, counted
from cqos_core.model.spelling import TypedNames, typing_errors
from tests.laws.systems import BOTH, PACKS, systems
from tests.test_session import Editing

if TYPE_CHECKING:
    from cqos_core.model.report import Finding, Group, Report


class Follower:
    """Keeps the findings and groups that changes report."""

    def __init__(self, report: Report) -> None:
        self.findings: list[Finding] = [*report.findings]
        self.groups: list[Group] = [*report.groups]

    def follow(self, changes: Changes) -> None:
        """Do what a receiver does."""
        for gone in changes.removed:
            self.findings.remove(gone)
        for left in changes.removed_groups:
            self.groups.remove(left)
        self.findings += changes.added
        self.groups += changes.added_groups
        assert not [each for each in changes.added if each in changes.removed]
        assert not [each for each in changes.added_groups if each in changes.removed_groups]

    def has(self, report: Report) -> None:
        """Compare what is known with a report."""
        left = [*report.findings]
        for each in self.findings:
            assert each in left, each
            left.remove(each)
        assert not left
        assert sorted(self.groups, key=str) == sorted(report.groups, key=str)


def edited(session: Session, other: System, data: Any) -> None:
    """Do one random edit, with what another system has."""
    system = session.system
    kinds = ["put", "put", "put", "put", "remove", "participant", "profile", "topic", "option", "accept", "severities"]
    kind = data.draw(st.sampled_from(kinds))
    if kind == "put" and other.endpoints:
        endpoint = data.draw(st.sampled_from(other.endpoints))
        if endpoint.participant in system.participants:
            session.put(endpoint)
    elif kind == "remove" and system.endpoints:
        session.remove(data.draw(st.sampled_from(system.endpoints)).id)
    elif kind == "participant":
        session.put_participant(data.draw(st.sampled_from([*other.participants.values()])))
    elif kind == "profile" and other.profiles:
        session.put_profile(data.draw(st.sampled_from([*other.profiles.values()])))
    elif kind == "topic" and other.topics:
        session.put_topic(data.draw(st.sampled_from([*other.topics.values()])))
    elif kind == "option":
        for pack, options in other.options.items():
            for name, setting in options.items():
                session.set_option(pack, name, setting.text)
    elif kind == "accept":
        session.set_rules(accept=other.accept)
    elif kind == "severities":
        session.set_rules(severities=other.severities, checks=other.checks)


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@pytest.mark.parametrize("rich", [True, False])
@given(st.data())
def test_changes_make_the_report_of_a_fresh_check(words, rich, data):
    system, other = (data.draw(systems(words, rich=rich, opened=rich)) for _ in range(2))
    session = Session(system, packs=PACKS)
    before = check(system, packs=PACKS)
    one, all_of_it = Follower(before), Follower(before)
    for _ in range(data.draw(st.integers(1, 5))):
        for _ in range(data.draw(st.integers(1, 2))):
            edited(session, other, data)
        changes = session.changes()
        one.follow(changes)
        fresh = check(session.system, packs=PACKS)
        one.has(fresh)
        assert changes.counts == counted(fresh)
        assert changes.counts.verdict == fresh.verdict
        if data.draw(st.booleans()):
            assert session.report() == fresh
    assert session.changes() == Changes(changes.revision, counts=changes.counts, before=changes.counts)
    all_of_it.follow(session.changes(since=0))
    all_of_it.has(fresh)


NAMES = st.text("abrst/1", min_size=1, max_size=9) | st.sampled_from(
    ["status", "staus", "stauts", "statuss", "line1/status"]
)


@given(st.sets(NAMES, max_size=30), st.sets(NAMES, max_size=5), st.lists(NAMES, max_size=5))
def test_names_that_come_and_go_are_found_as_names_that_are_there(others, gone, names):
    typed = TypedNames()
    for each in sorted(others | gone, reverse=True):
        typed.add(each)
    for each in gone:
        typed.discard(each)
    found = {name: near for name in names if (near := typed.near(name))}
    assert found == typing_errors(names, sorted(others - gone))


class Telling(Editing):
    """Edits a session at random, also one with bridges and MQTT; its changes make the report of a fresh check."""

    known: Follower | None = None

    @invariant()
    def equals_a_fresh_check(self) -> None:
        changes, fresh = self.session.changes(), check(self.session.system)
        self.known = self.known or Follower(fresh)
        self.known.follow(changes)
        self.known.has(fresh)
        assert changes.counts == counted(fresh)


Telling.TestCase.settings = settings(stateful_step_count=15)
TestTelling = Telling.TestCase


def crowded(count: int) -> System:
    """Some topics without a side, some values that are not known, and some participants that are instances."""
    found = System(protocol="ros2", options={"ros2": {"distro": Setting("jazzy")}})
    for number in range(count):
        template = f"t{number % 5}" if number % 7 == 0 else None
        for role in ("publisher", "subscriber"):
            owner = f"{role}{number}"
            found.participants[owner] = Participant(owner, template=template)
            if number % 10 and not (number % 50 == 1 and role == "publisher"):
                stated = {"reliability": Setting("system_default" if number % 3 == 0 else "reliable")}
                topic = f"/area{number // 10}/status"
                endpoint = Endpoint(id=f"{owner}/status", role=role, topic=topic, participant=owner, settings=stated)
                found.endpoints.append(endpoint)
    return found


@pytest.mark.parametrize("count", [100, 400])
def test_an_edit_judges_what_it_touches(count: int) -> None:
    session = Session(crowded(count))
    known = Follower(session.report())
    first = session.system.endpoints[4]
    edits = [
        replace(first, settings={"reliability": Setting("best_effort")}),
        replace(first, topic="/area0/staus"),
        replace(first, topic="/Area1/status"),
        replace(first, id="new", topic="/area2/status"),
        replace(first, template="t1"),
        replace(first, settings={"depth": Setting("-1")}),
        replace(first, settings={"dpeth": Setting("1")}),
        first,
    ]
    for endpoint in edits:
        session.put(endpoint)
        known.follow(session.changes())
        assert 0 < session.judged <= 2
        known.has(check(session.system))
    session.remove("new")
    known.follow(session.changes())
    assert session.judged == 1
    known.has(check(session.system))


def test_an_unknown_revision_is_refused() -> None:
    session = Session(crowded(10))
    with pytest.raises(KeyError):
        session.changes(since=1)
    assert not session.changes(since=0)
