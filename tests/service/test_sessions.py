"""Edit sessions: their reports equal fresh checks, their answers are small, and they say when they are lost."""

import asyncio
import os
import queue
import signal
import time
import weakref
from copy import deepcopy
from typing import Any, cast

import pytest
from hypothesis import given, settings

import cqos_core as cqos
from cqos.v1 import report_pb2, session_pb2, system_pb2
from cqos_core import check
from cqos_core.model.chains import Chain, ChainStep, StatedLink
from cqos_core.model.settings import Setting
from cqos_core.model.system import (
    Acceptance,
    Bound,
    Bridge,
    Broker,
    Endpoint,
    ImportNote,
    Overlay,
    Participant,
    Profile,
    ProfileRef,
    Route,
    System,
    TeamRule,
    Topic,
)
from cqos_core.remote.client import AsyncClient, PairQuestion, RemoteSession, ServiceError, SessionLostError
from cqos_core.remote.edit_session import EditSession, difference
from cqos_core.remote.messages import report_message
from cqos_core.remote.sessions import followed
from tests.effort import EXAMPLES
from tests.test_messages import reports
from tests.test_session import Editing


def endpoint(name, role="publisher", topic="t", participant="a", **settings):
    return Endpoint(
        id=name,
        role=role,
        topic=topic,
        participant=participant,
        settings={key: Setting(value) for key, value in settings.items()},
    )


def route(source, target, participant="a"):
    return Route(
        Endpoint(id="", role="subscriber", topic=source, participant=participant),
        Endpoint(id="", role="publisher", topic=target, participant="far"),
    )


DEEP = TeamRule("deep", (("role", "subscriber"),), (Bound("depth", "at_least", ("50",)),), "it is slow")


def two():
    system = System(protocol="ros2", participants={"a": Participant("a"), "b": Participant("b")})
    system.endpoints += [
        endpoint("w", reliability="best_effort"),
        endpoint("r", "subscriber", participant="b", reliability="reliable"),
    ]
    return system


NEAR = Bound("depth", cast("Any", "near"), ("1",))
ENDS = (
    Endpoint(id="", role="subscriber", topic="t", participant="a"),
    Endpoint(id="", role="publisher", topic="u", participant="a"),
)
EDITS = [
    lambda s: s.put(endpoint("w", reliability="reliable")),
    lambda s: s.put(endpoint("x", topic="u")),
    lambda s: s.put_participant(Participant("c", settings={"domain": Setting("3")})),
    lambda s: s.put(endpoint("y", "subscriber", "u", "c")),
    lambda s: s.put_profile(Profile("p", {"durability": Setting("transient_local")})),
    lambda s: s.put(Endpoint(id="z", role="subscriber", topic="u", participant="a", profiles=(ProfileRef("p"),))),
    lambda s: s.put_topic(Topic("u", {"latched": Setting("true")})),
    lambda s: s.set_option("ros2", "rmw", "zenoh"),
    lambda s: s.set_option("ros2", "rmw", None),
    lambda s: s.put_participant(Participant("far", "mqtt", {"broker": Setting("hub")})),
    lambda s: s.put_broker(Broker("hub", "mqtt", {"maximum_qos": Setting("1")})),
    lambda s: s.put_bridge(Bridge("up", (route("t", "site/t"), route("u*", "site/u*")), ("liveliness",))),
    lambda s: s.put(
        Endpoint(id="v", role="subscriber", topic="site/t", participant="far", needs={"loss_free": Setting("true")})
    ),
    lambda s: s.put_bridge(Bridge("up", (route("t", "site/t", "nobody"),))),
    lambda s: s.set_rules(checks=[DEEP, TeamRule("odd", (), (Bound("dpeth", "exactly", ("5",)),), "misspelt")]),
    lambda s: s.set_rules(accept=[Acceptance("deep", "known", "t", None, "9999-01-01")], severities={"CQ401": "error"}),
    lambda s: s.set_overlays([Overlay("laid over", {"depth": Setting("7")}, "subscriber", "t")]),
    lambda s: s.put_topic(Topic("t", {"period": Setting("10ms"), "size": Setting("1000")})),
    lambda s: s.put_chain(Chain("fast", (ChainStep("a"), ChainStep("b")), {"max_age": Setting("1ms")})),
    lambda s: s.put_link(StatedLink("radio", ("b",), (), {"rate": Setting("1kbit/s")})),
    lambda s: s.remove_chain("fast"),
    lambda s: s.remove_link("radio"),
    lambda s: s.remove_topic("t"),
    lambda s: s.set_notes([ImportNote("CQ005", "warning", "as a file says")]),
    lambda s: s.set_name("another"),
    lambda s: s.set_partial(True),
    lambda s: s.set_hypothetical(True),
    lambda s: s.set_hypothetical(False),
    lambda s: s.set_partial(False),
    lambda s: s.set_protocol("dds"),
    lambda s: s.set_protocol(None),
    lambda s: s.set_protocol("ros2"),
    lambda s: s.set_notes([]),
    lambda s: s.set_overlays([]),
    lambda s: s.set_rules(checks=[], accept=[], severities={}),
    lambda s: s.remove_bridge("up"),
    lambda s: s.remove_broker("hub"),
    lambda s: s.remove_participant("far"),
    lambda s: s.remove_topic("u"),
    lambda s: s.remove("z"),
    lambda s: s.remove_profile("p"),
    lambda s: s.remove_participant("c"),
    lambda s: s.remove("x"),
]


def test_every_report_of_a_session_equals_that_of_the_library(client):
    here = cqos.Session(two())
    with client.session(two()) as there:
        assert there.report() == here.report() == check(two())
        for edit in EDITS:
            edit(here)
            edit(there)
            assert there.report() == here.report()
            assert there.judged == here.judged
        for edit in EDITS:  # all of them as one edit
            edit(here)
            edit(there)
        assert there.report() == here.report()


async def ask(service):
    async with AsyncClient(service.grpc) as client:
        here = cqos.Session(two())
        assert await client.check_system(two()) == here.report()
        assert await client.check_pair("ros2") == cqos.check_pair("ros2")
        assert (await client.packs()).packs[0].id == "dds"
        assert (await client.pack("ros2")).title == "ROS 2"
        with pytest.raises(ServiceError, match="INVALID_ARGUMENT"):
            await client.explain(two(), publisher="w", subscriber="nobody")
        assert (await client.convert(two(), to="yaml")).expressed == 2
        async with client.session(two()) as there:
            for edit in EDITS:
                edit(here)
                edit(there)
                assert await there.report() == here.report()


def test_a_closed_session_forgets_its_stream_and_has_no_reports(client):
    session = client.session(System())
    session.report()
    stream = weakref.ref(session._stream)
    session.close()
    session.close()
    assert stream() is None, "grpcio waits for a lock when the program ends with a stream, sometimes for ever"
    with pytest.raises(SessionLostError):
        session.report()


def test_the_same_without_waiting(service):
    import asyncio

    asyncio.run(ask(service))


def test_an_edit_of_one_topic_of_many_is_answered_by_what_changes(client, monkeypatch):
    system = two()
    for number in range(50):
        system.endpoints += [
            endpoint(f"w{number}", topic=f"t{number}"),
            endpoint(f"r{number}", "subscriber", f"t{number}"),
        ]
    sent = []
    with client.session(system) as session:
        followed_by = session._followed

        def heard(response):
            sent.append(response)
            return followed_by(response)

        monkeypatch.setattr(session, "_followed", heard)
        session.report()
        session.put(endpoint("w7", topic="t7", reliability="best_effort"))
        report = session.report()
    assert "/t7" in {group.topic for group in report.groups if group.verdict == "incompatible"}
    whole, change = sent
    assert (whole.WhichOneof("outcome"), change.WhichOneof("outcome")) == ("report", "delta")
    assert change.judged == 1
    assert (change.revision, change.delta.base_revision) == (2, 1)
    assert len(change.delta.added_groups) == len(change.delta.removed_groups) == 1
    assert change.ByteSize() * 4 < whole.ByteSize()


def test_an_edit_that_cannot_be_done_changes_nothing(client):
    with client.session(two()) as session:
        before = session.report()
        session.remove("w")
        session.put(endpoint("n", participant="nobody"))
        session.remove("never")
        with pytest.raises(ServiceError) as raised:
            session.report()
        assert {each.field for each in raised.value.fields} == {
            "changes[1].put_endpoint.participant",
            "changes[2].remove_endpoint",
        }
        assert session.report() == before


@pytest.mark.parametrize(
    ("edit", "field"),
    [
        (lambda s: s.put_bridge(Bridge("")), "put_bridge.id"),
        (lambda s: s.put_bridge(Bridge("b", (Route(*ENDS[::-1]),))), "put_bridge.routes[0].source.role"),
        (lambda s: s.put_bridge(Bridge("b", (route("t", "u", ""),))), "put_bridge.routes[0].source.participant"),
        (lambda s: s.remove_bridge("b"), "remove_bridge"),
        (lambda s: s.remove_broker("b"), "remove_broker"),
        (lambda s: s.put_profile(Profile("", {})), "put_profile.name"),
        (lambda s: s.set_rules(checks=[TeamRule("c", (), (NEAR,), "")]), "set_checks.checks"),
        (lambda s: s.set_rules(accept=[Acceptance("ROS101", "")]), "set_accept.accept[0].because"),
        (lambda s: s.set_rules(severities={"ROS101": "loud"}), "set_severities.severities[ROS101]"),
    ],
)
def test_what_cannot_be_done_is_named(client, edit, field):
    with client.session(two()) as session:
        before = session.report()
        session.set_name("not done either")
        edit(session)
        with pytest.raises(ServiceError) as raised:
            session.report()
        assert raised.value.fields[0].field.startswith(f"changes[1].{field}")
        assert session.report() == before


def test_there_is_a_change_for_everything_that_a_system_holds():
    """So a modeler never has to open another session because of what was edited."""
    changes = set(session_pb2.Change.DESCRIPTOR.fields_by_name)
    for field in system_pb2.System.DESCRIPTOR.fields:
        one = {"bridges": "bridge", "options": "option"}.get(field.name, field.name.removesuffix("s"))
        keyed = {f"put_{one}", f"remove_{one}"} <= changes
        opened = field.name == "sources"  # what was read does not change
        assert keyed or f"set_{field.name}" in changes or f"set_{one}" in changes or opened, field.name


def test_the_first_message_opens_and_no_other_does(service, client):
    with client.session() as session:
        session._told = report_pb2.Report()
        with pytest.raises(ServiceError) as raised:
            session.report()
    assert raised.value.fields[0].field == "open"
    with client.session() as session:
        session.report()
        session._told = None
        with pytest.raises(ServiceError) as raised:
            session.report()
        assert raised.value.fields[0].field == "changes"


def test_a_session_whose_worker_is_gone_goes_on_in_another_one(start):
    with start("--heavy-workers", "1") as own, own.client() as client:
        before = set(own.children())
        with client.session(two()) as session, client.session(two()) as other:
            session.report()
            other.report()
            (home,) = set(own.children()) - before
            os.kill(home, signal.SIGKILL)
            here = cqos.Session(two())
            here.put(endpoint("w", reliability="reliable"))
            for each in (session, other):
                each.put(endpoint("w", reliability="reliable"))
                assert each.report() == here.report()
        with client.session(two()) as session:
            assert session.report() == check(two())


def test_a_worker_that_ends_between_two_edits_is_noticed_by_all_its_sessions(start):
    with start("--heavy-workers", "1") as own, own.client() as client:
        before = set(own.children())
        with client.session(two()) as session:
            session.report()
            (home,) = set(own.children()) - before
            os.kill(home, signal.SIGKILL)
            # The service sees the process end before the next edit, and starts another one that has no sessions.
            until = time.monotonic() + 60
            while home in own.children() and time.monotonic() < until:
                time.sleep(0.05)
            time.sleep(0.2)
            here = cqos.Session(two())
            for each in (here, session):
                each.put(endpoint("w", reliability="reliable"))
            assert session.report() == here.report()


def test_an_idle_session_is_closed_and_leaves_its_place(forgetful):
    with forgetful.client() as client:
        with client.session(two()) as one:
            one.report()
            time.sleep(0.8)
            one.put(endpoint("w"))
            with pytest.raises(SessionLostError, match="nothing was heard"):
                one.report()
        with client.session(two()) as session:
            assert session.report().endpoints == 2
        asked: queue.SimpleQueue[Any] = queue.SimpleQueue()
        asked.put(PairQuestion("ros2"))
        answers = client.check_pairs(iter(asked.get, None))
        next(answers)
        with pytest.raises(ServiceError, match="the stream of pairs is ended: nothing was heard") as raised:
            next(answers)
        assert not isinstance(raised.value, SessionLostError)
        asked.put(None)


def test_a_session_that_grows_too_large_refuses(narrow):
    with narrow.client() as client, client.session(two()) as session:
        before = session.report()
        for number in range(2):
            session.put(endpoint(f"more{number}"))
        with pytest.raises(ServiceError, match="4 endpoints, this service takes 3"):
            session.report()
        session.put_bridge(Bridge("b", (Route(*ENDS),)))  # one endpoint on either side
        with pytest.raises(ServiceError, match="4 endpoints, this service takes 3"):
            session.report()
        assert session.report() == before


class ServiceAndLibrarySession:
    """A session as a caller has it and one of the library, edited alike: all of the service but the network between."""

    def __init__(self, system):
        self.here = cqos.Session(system)
        self.there = RemoteSession(cast("Any", self), system)

    def _edit(self, requests):
        session = EditSession(1_000)
        for request in requests:
            yield session_pb2.EditResponse.FromString(session.edit(request.SerializeToString()))

    @property
    def system(self):
        return self.here.system

    def report(self):
        report = self.here.report()
        assert self.there.report() == report
        return report

    def __getattr__(self, name):
        def edit(*arguments, **named):
            for each in (self.there, self.here):
                getattr(each, name)(*arguments, **named)

        return edit


class ServiceEditing(Editing):
    """The differences that the service sends add up to the report of a fresh check, too."""

    opened = cast("Any", ServiceAndLibrarySession)


ServiceEditing.TestCase.settings = settings(max_examples=EXAMPLES // 3, stateful_step_count=20)
TestServiceEditing = ServiceEditing.TestCase


@given(reports, reports)
def test_what_differs_makes_the_new_report_of_the_old_one(old, new):
    delta = difference(report_message(old), report_message(new))
    if delta is not None:
        assert followed(old, session_pb2.ReportDelta.FromString(delta.SerializeToString())) == new
    # With most of it kept, in another order perhaps.
    mixed = deepcopy(new)
    object.__setattr__(mixed, "findings", (*new.findings[1:], *old.findings, *new.findings[:1]))
    delta = difference(report_message(mixed), report_message(new))
    if delta is not None:
        assert followed(mixed, delta) == new


def test_a_session_of_whom_a_report_was_cancelled_is_lost(service):
    async def ask():
        async with AsyncClient(service.grpc) as client:
            session = client.session(two())
            await session.report()
            waiting = asyncio.create_task(session.report())
            await asyncio.sleep(0)
            waiting.cancel()
            with pytest.raises(asyncio.CancelledError):
                await waiting
            with pytest.raises(SessionLostError, match="the stream has ended"):
                await session.report()

    asyncio.run(ask())
