"""A session's report equals that of a fresh check, whatever was edited, and only what an edit touches is judged again."""

from dataclasses import replace

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import cqos_core as cqos
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
    Role,
    Route,
    System,
    TeamRule,
    Topic,
)
from cqos_core.packs import forbids, parse
from tests.effort import EXAMPLES
from tests.made_up_protocol import POST

PARTICIPANTS = ("a", "b", "c")
TOPICS = ("scan", "/scan", "Scan", "map", "/tf_static", "bad name")
PROFILES = ("fast", "safe", "missing", "sensor_data", "best_available")
VALUES = {
    "reliability": ("reliable", "best_effort", "system_default", "best_available", "unknown", "relaible"),
    "durability": ("volatile", "transient_local", "best_available"),
    "deadline": ("2s", "500ms", "infinite", "0", "2"),
    "depth": ("1", "10", "-1"),
    "lifespan": ("1s",),
    "relibility": ("reliable",),
}
OPTIONS = {
    "rmw": ("cyclonedds", "fastdds", "zenoh", "micro_ros", "nonsense"),
    "distro": ("humble", "jazzy", "future"),
    "comparison": ("semantic", "rmw"),
    "domain": ("0", "1"),
}

setting_maps = st.fixed_dictionaries(
    {}, optional={name: st.sampled_from(texts).map(Setting) for name, texts in VALUES.items()}
)
need_maps = st.sampled_from(({}, {"latest": Setting("true")}, {"max_age": Setting("1s"), "loss_free": Setting("true")}))
endpoints = st.builds(
    lambda number, role, topic, participant, stated, profiles, needs, observed, external, after: Endpoint(
        id=f"e{number}",
        role=role,
        topic=topic,
        participant=participant,
        settings=stated,
        profiles=tuple(ProfileRef(name) for name in profiles),
        needs=needs,
        observed=observed,
        external=external,
        starts_after=after,
    ),
    st.integers(0, 7),
    st.sampled_from(("publisher", "subscriber")),
    st.sampled_from((*TOPICS, None)),
    st.sampled_from(PARTICIPANTS),
    setting_maps,
    st.lists(st.sampled_from(PROFILES), max_size=2),
    need_maps,
    st.booleans(),
    st.booleans(),
    st.sampled_from(((), ("a",), ("e1",), ("nobody",))),
)
routes = st.builds(
    lambda source, target, sides: Route(
        Endpoint(id="", role="subscriber", topic=source, participant=sides[0]),
        Endpoint(id="", role="publisher", topic=target, participant=sides[1]),
    ),
    st.sampled_from(("scan", "map", "/sc*", "*")),
    st.sampled_from((None, "scan", "map", "far/*")),
    st.tuples(st.sampled_from((*PARTICIPANTS, "phone", "nobody")), st.sampled_from((*PARTICIPANTS, "phone"))),
)
BRIDGES = ("up", "down")
BROKERS = ("hub", "other")


class Editing(RuleBasedStateMachine):
    """Edits a session at random; after every step its report is that of a fresh check."""

    opened = cqos.Session

    @initialize()
    def open(self):
        self.session = self.opened(self.system())

    def system(self):
        system = System("edited", "ros2", participants={name: Participant(name) for name in PARTICIPANTS})
        # Beyond a bridge, where there is one.
        system.participants["phone"] = Participant("phone", "mqtt", {"broker": Setting("hub")})
        far = Endpoint(
            id="far", role="subscriber", topic="far/scan", participant="phone", needs={"latest": Setting("true")}
        )
        system.endpoints.append(far)
        return system

    @rule(endpoint=endpoints)
    def put(self, endpoint):
        if endpoint.participant in self.session.system.participants:
            self.session.put(endpoint)

    @rule(data=st.data())
    @precondition(lambda self: self.session.system.endpoints)
    def remove(self, data):
        known = [endpoint.id for endpoint in self.session.system.endpoints]
        self.session.remove(data.draw(st.sampled_from(known)))

    @rule(name=st.sampled_from(PARTICIPANTS), option=st.sampled_from([(o, v) for o in OPTIONS for v in OPTIONS[o]]))
    def put_participant(self, name, option):
        kept = {} if option[0] == "comparison" else {option[0]: Setting(option[1])}
        self.session.put_participant(Participant(name, settings=kept))

    @rule(name=st.sampled_from(PARTICIPANTS))
    def remove_participant(self, name):
        if name in self.session.system.participants:
            self.session.remove_participant(name)

    @rule(
        name=st.sampled_from(("fast", "safe", "sensor_data")),
        stated=setting_maps,
        base=st.sampled_from(((), ("safe",), ("fast",))),
    )
    def put_profile(self, name, stated, base):
        self.session.put_profile(Profile(name, stated, tuple(ProfileRef(each) for each in base)))

    @rule(name=st.sampled_from(("fast", "safe", "sensor_data")))
    def remove_profile(self, name):
        if name in self.session.system.profiles:
            self.session.remove_profile(name)

    @rule(name=st.sampled_from(TOPICS), latched=st.sampled_from(("true", "false", "perhaps")), external=st.booleans())
    def put_topic(self, name, latched, external):
        self.session.put_topic(Topic(name, {"latched": Setting(latched)}, external))

    @rule(name=st.sampled_from(TOPICS))
    def remove_topic(self, name):
        if name in self.session.system.topics:
            self.session.remove_topic(name)

    @rule(
        name=st.sampled_from(BRIDGES),
        carried=st.lists(routes, max_size=2),
        carries=st.sampled_from(((), ("liveliness",))),
    )
    def put_bridge(self, name, carried, carries):
        self.session.put_bridge(Bridge(name, tuple(carried), carries))

    @rule(name=st.sampled_from(BRIDGES))
    def remove_bridge(self, name):
        if name in self.session.system.bridges:
            self.session.remove_bridge(name)

    @rule(name=st.sampled_from(BROKERS), most=st.sampled_from(("0", "1", "2", "9")))
    def put_broker(self, name, most):
        self.session.put_broker(Broker(name, "mqtt", {"maximum_qos": Setting(most)}))

    @rule(name=st.sampled_from(BROKERS))
    def remove_broker(self, name):
        if name in self.session.system.brokers:
            self.session.remove_broker(name)

    @rule(stated=setting_maps, role=st.sampled_from((None, "subscriber")), topic=st.sampled_from(("*", "/scan")))
    def set_overlays(self, stated, role, topic):
        self.session.set_overlays([Overlay("laid over", stated, role, topic)] if stated else [])

    @rule(protocol=st.sampled_from(("ros2", "dds", None)))
    def set_protocol(self, protocol):
        self.session.set_protocol(protocol)

    @rule(name=st.sampled_from(("edited", "renamed")), notes=st.sampled_from(((), ("CQ005",), ("CQ005", "CQ040"))))
    def set_name_and_notes(self, name, notes):
        self.session.set_name(name)
        self.session.set_notes([ImportNote(code, "warning", "as the file says") for code in notes])

    @rule(option=st.sampled_from([(o, v) for o in OPTIONS for v in (*OPTIONS[o], None)]))
    def set_option(self, option):
        self.session.set_option("ros2", *option)

    @rule(
        accept=st.lists(
            st.builds(
                Acceptance,
                st.sampled_from(("ROS101", "reliability-weaker-than-requested", "CQ401", "ROS999")),
                st.just("known"),
                st.sampled_from((None, "scan", "*")),
                st.sampled_from((None, "e1", "e*")),
                st.sampled_from((None, "2000-01-01", "9999-01-01")),
            ),
            max_size=2,
        ),
        severities=st.sampled_from(({}, {"ROS101": "off"}, {"CQ401": "error"}, {"NO999": "note"})),
        checks=st.sampled_from(
            (
                [],
                [TeamRule("deep", (("role", "subscriber"),), (Bound("depth", "at_least", ("5",)),), "it is slow")],
                [TeamRule("odd", (), (Bound("dpeth", "exactly", ("5",)),), "it is misspelt")],
            )
        ),
    )
    def set_rules(self, accept, severities, checks):
        self.session.set_rules(accept=accept, severities=severities, checks=checks)

    @invariant()
    def equals_a_fresh_check(self):
        assert self.session.report() == cqos.check(self.session.system)


Editing.TestCase.settings = settings(max_examples=EXAMPLES // 2, stateful_step_count=20)
TestEditing = Editing.TestCase


class EditingOfOneProtocol(Editing):
    """The same without MQTT, where most edits of endpoints touch their topics only."""

    def system(self):
        return System("edited", "ros2", participants={name: Participant(name) for name in PARTICIPANTS})

    # Rare, so that not every system has them.
    @precondition(lambda self: len(self.session.system.endpoints) > 6)
    @rule(name=st.sampled_from(BRIDGES), carried=st.lists(routes, max_size=1), carries=st.just(()))
    def put_bridge(self, name, carried, carries):
        super().put_bridge(name, carried, carries)


EditingOfOneProtocol.TestCase.settings = settings(max_examples=EXAMPLES, stateful_step_count=25)
TestEditingOfOneProtocol = EditingOfOneProtocol.TestCase


def of_two_topics():
    system = System("robot", "ros2", participants={name: Participant(name) for name in ("driver", "planner")})
    for topic in ("/scan", "/map"):
        system.endpoints += [
            Endpoint(id=f"pub{topic}", role="publisher", topic=topic, participant="driver"),
            Endpoint(id=f"sub{topic}", role="subscriber", topic=topic, participant="planner"),
        ]
    return system


def test_an_edit_judges_only_the_topic_it_touches():
    session = cqos.Session(of_two_topics())
    session.report()
    assert session.judged == 2

    session.put(
        Endpoint(
            id="sub/scan", role="subscriber", topic="/scan", participant="planner", settings={"deadline": Setting("1s")}
        )
    )
    assert session.report().verdict == "incompatible"
    assert session.judged == 1


def test_moving_an_endpoint_judges_both_of_its_topics():
    session = cqos.Session(of_two_topics())
    session.report()
    session.put(Endpoint(id="sub/scan", role="subscriber", topic="/map", participant="planner"))
    session.report()
    assert session.judged == 2


def test_nothing_is_judged_twice_for_nothing():
    session = cqos.Session(of_two_topics())
    session.report()
    session.report()
    assert session.judged == 0


def test_an_option_that_changes_no_value_judges_nothing():
    session = cqos.Session(of_two_topics())
    session.report()
    session.set_option("ros2", "round_trip_time", "1ms")
    session.set_option("ros2", "round_trip_time", None)
    session.report()
    assert session.judged == 0


def test_an_option_that_repeats_a_default_becomes_the_origin():
    system = of_two_topics()
    system.participants["planner"].settings["domain"] = Setting("1")
    session = cqos.Session(system)
    session.report()
    session.set_option("ros2", "domain", "0")
    assert session.report() == cqos.check(session.system)
    (split,) = {fact.origin for each in session.report().findings for fact in each.sides[-1].facts if fact.value == "0"}
    assert split == "option"


def test_a_bridge_hands_needs_on_as_long_as_it_is_there():
    system = of_two_topics()
    system.endpoints[0].settings["reliability"] = Setting("best_effort")
    system.endpoints[1].settings["reliability"] = Setting("best_effort")
    session = cqos.Session(system)
    far = Endpoint(
        id="far", role="subscriber", topic="/far", participant="planner", needs={"loss_free": Setting("true")}
    )
    session.put(far)
    ends = (
        Endpoint(id="", role="subscriber", topic="/scan", participant="driver"),
        Endpoint(id="", role="publisher", topic="/far", participant="driver"),
    )

    session.put_bridge(Bridge("relay", (Route(*ends),)))
    errors = [finding for finding in session.report().findings if finding.severity == "error"]
    assert {finding.topic for finding in errors} == {"/scan"}
    session.remove_bridge("relay")
    assert not [finding for finding in session.report().findings if finding.severity == "error"]


def test_what_is_set_and_taken_away_leaves_nothing_behind():
    session = cqos.Session(of_two_topics())
    before = session.system
    session.set_option("nobody_has_this_pack", "rmw", "zenoh")
    session.set_option("nobody_has_this_pack", "rmw", None)
    session.put_bridge(Bridge("b"))
    session.remove_bridge("b")
    session.put_broker(Broker("hub"))
    session.remove_broker("hub")
    assert session.system == before


def test_the_place_of_a_default_is_that_of_a_fresh_check():
    forbidden = forbids(parse("participant(town) < 5"), code="POST801", name="near", because="it is near")
    pack = replace(POST, rules=(forbidden,))
    system = cqos.System(protocol="post", participants={name: cqos.Participant(name) for name in "ab"})
    for number, (owner, topic) in enumerate((("a", "x"), ("a", "y"), ("b", "x"))):
        role: Role = "publisher" if owner == "a" else "subscriber"
        place = cqos.Place("f.yml", number + 1)
        system.endpoints.append(Endpoint(id=f"e{number}", role=role, topic=topic, participant=owner, place=place))
    session = cqos.Session(system, packs=[pack])
    session.put(replace(system.endpoints[0], settings={"copies": cqos.Setting("7")}))
    assert session.report() == cqos.check(session.system, packs=[pack])


def test_the_session_keeps_a_copy():
    system = of_two_topics()
    session = cqos.Session(system)
    system.endpoints.clear()
    assert len(session.system.endpoints) == 4
