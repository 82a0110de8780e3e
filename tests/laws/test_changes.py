"""Law: whatever is edited, the changes of a session make the report of a fresh check of the one before."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import invariant

from cqos_core import Endpoint, Participant, ProfileRef, Session, Setting, System, check
from cqos_core.language.parser import parse
from cqos_core.model.changes import Changes, counted
from cqos_core.model.system import Bound, ImportNote, Overlay, TeamRule
from cqos_core.packs.rule import forbids
from cqos_core.packs.topic_matching import Naming, TopicMatching
from tests.laws.systems import BOTH, PACKS, Vocabulary, systems
from tests.made_up_protocol import POST, participant, reader, world, writer
from tests.test_session import Editing

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Group, Report


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


def by_itself(endpoint: Endpoint) -> Endpoint:
    """Return an endpoint without what makes the values of others depend on it."""
    return replace(endpoint, starts_after=(), profiles=tuple(ref for ref in endpoint.profiles if ref.name[0] != "q"))


OVERLAYS = st.builds(
    Overlay, st.just("laid over"), st.just({"depth": Setting("7")}), topic=st.sampled_from(["*", "a*"])
)


@st.composite
def calm(draw, words: Vocabulary, more: Sequence[Endpoint]) -> System:
    """A system in which most edits of endpoints touch their topics only."""
    system: System = draw(systems(words, rich=draw(st.booleans()), opened=draw(st.booleans())))
    for each in system.participants.values():
        each.starts_after, each.template = (), draw(st.sampled_from([None, None, "t1"]))
    ends = [*system.endpoints, *(replace(each, id=f"f{at}") for at, each in enumerate(more) if draw(st.booleans()))]
    system.endpoints = [by_itself(each) for each in ends if each.participant in system.participants]
    if draw(st.booleans()):
        system.profiles = {}
    elif system.profiles:
        # Used in both roles, so that none is tried.
        refs, (owner, *_) = tuple(map(ProfileRef, system.profiles)), system.participants
        for role in ("publisher", "subscriber"):
            user = Endpoint(id=f"user/{role}", role=role, topic=words.topics[0], participant=owner, profiles=refs)
            system.endpoints.append(user)
    system.partial = draw(st.booleans())
    if draw(st.booleans()):
        system.overlays = draw(st.lists(OVERLAYS, max_size=2))
        system.severities = draw(st.sampled_from([{}, {"CQ401": "error"}, {"CQ402": "off", "ROS102": "note"}]))
        severity = draw(st.sampled_from(["warning", "error"]))
        system.notes = [ImportNote("CQ005", severity, "as the file says", endpoint="e1")]
    return system


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_changes_of_endpoints_make_the_report_of_a_fresh_check(words, data):
    drawn = data.draw(st.lists(systems(words), min_size=2, max_size=2))
    further = [each for other in drawn for each in other.endpoints]
    session = Session(data.draw(calm(words, further)), packs=PACKS)
    known = Follower(session.report())
    for _ in range(data.draw(st.integers(3, 10))):
        system = session.system
        ids = [each.id for each in system.endpoints]
        if ids and data.draw(st.integers(0, 3)) == 0:
            session.remove(data.draw(st.sampled_from(ids)))
        else:
            new, alternative = data.draw(st.sampled_from(further)), data.draw(st.sampled_from([False, False, True]))
            name, odd = data.draw(st.sampled_from([*ids, "new", "newer"])), data.draw(st.integers(0, 9))
            if new.participant in system.participants:
                protocol = data.draw(st.sampled_from(["ros2", "post", "nobody"])) if odd == 1 else None
                calmed = new if odd == 0 else by_itself(new)
                session.put(replace(calmed, id=name, alternative=alternative, protocol=protocol))
        changes, fresh = session.changes(), check(session.system, packs=PACKS)
        known.follow(changes)
        known.has(fresh)
        assert changes.counts == counted(fresh)
        if data.draw(st.integers(0, 3)) == 0:
            assert session.report() == fresh


# What concerns several endpoints beside their topics: the parts of a system, what becomes of them, and what is added.
TOWNS = replace(POST, rules=(forbids(parse("participant(town) > 5"), code="POST801", name="a", because="it is far"),))
FOLDING = replace(POST, topic_matching=TopicMatching(lambda written, _: Naming(written.casefold(), written)))
OTHER = {"more": {"template": "t", "alternative": True}}
SHARED = {
    "rules over participants": (
        TOWNS,
        [*(participant(f"p{n}", town=n * 4) for n in range(4)), *(writer("box", f"p{n}/w") for n in range(4))],
        [replace(writer("box", "p3/w"), participant="p1"), replace(writer("box", "p0/w"), participant="p2")],
        writer("box", "p3/w2"),
    ),
    "names that become one": (
        FOLDING,
        [writer("Box", "w/1"), writer("BOX", "w/2"), reader("Box", "r")],
        [writer("Box", "w/2")],
        writer("bOX", "w/3"),
    ),
    "the team's rules": (
        POST,
        [writer("box", "w"), reader("box", "r"), writer("box", "w/robot", more={"protocol": "ros2"})],
        [writer("box", "w/robot")],
        writer("box", "r/robot", more={"protocol": "ros2"}),
    ),
    "alternatives": (
        POST,
        [writer("box", "w/1", **OTHER, streets=["Elm"]), writer("news", "w/2", **OTHER), reader("box", "r")],
        [reader("box", "r", streets=["Elm"]), writer("box", "w/1", more={"template": "t"}, streets=["Elm"])],
        reader("news", "r/2"),
    ),
}


@pytest.mark.parametrize(("pack", "parts", "edits", "new"), SHARED.values(), ids=SHARED)
def test_what_concerns_several_endpoints_is_found_again(pack, parts, edits, new) -> None:
    system = world(*parts, checks=[TeamRule("ours", (), (Bound("depth", "exactly", ("5",)),), "a reason")])
    session = Session(system, packs=[pack])
    known, texts = Follower(session.report()), set()
    puts = [partial(session.put, each) for each in (new, *edits)]
    for edit in (*puts, partial(session.remove, new.id), *(partial(session.put, each) for each in system.endpoints)):
        edit()
        changes, fresh = session.changes(), check(session.system, packs=[pack])
        known.follow(changes)
        known.has(fresh)
        assert changes.counts == counted(fresh)
        texts |= {frozenset(map(str, fresh.findings))}
    known.has(check(system, packs=[pack]))
    assert len(texts) > 1


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
