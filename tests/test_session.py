"""A session's report equals that of a fresh check, whatever was edited, and only what an edit touches is judged again."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

import cqos_core as cqos
from cqos_core.system import (
    Acceptance,
    Bound,
    Endpoint,
    Participant,
    Profile,
    ProfileRef,
    Setting,
    System,
    TeamRule,
    Topic,
)

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
endpoints = st.builds(
    lambda number, role, topic, participant, stated, profiles, observed, external, after: Endpoint(
        f"e{number}",
        role,
        topic,
        participant,
        stated,
        tuple(ProfileRef(name) for name in profiles),
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
    st.booleans(),
    st.booleans(),
    st.sampled_from(((), ("a",), ("e1",), ("nobody",))),
)


class Editing(RuleBasedStateMachine):
    """Edits a session at random; after every step its report is that of a fresh check."""

    @initialize()
    def open(self):
        system = System("edited", "ros2", participants={name: Participant(name) for name in PARTICIPANTS})
        self.session = cqos.Session(system)

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


Editing.TestCase.settings = settings(max_examples=60, stateful_step_count=20, deadline=None)
TestEditing = Editing.TestCase


def of_two_topics():
    system = System("robot", "ros2", participants={name: Participant(name) for name in ("driver", "planner")})
    for topic in ("/scan", "/map"):
        system.endpoints += [
            Endpoint(f"pub{topic}", "publisher", topic, "driver"),
            Endpoint(f"sub{topic}", "subscriber", topic, "planner"),
        ]
    return system


def test_an_edit_judges_only_the_topic_it_touches():
    session = cqos.Session(of_two_topics())
    session.report()
    assert session.judged == 2

    session.put(Endpoint("sub/scan", "subscriber", "/scan", "planner", {"deadline": Setting("1s")}))
    assert session.report().verdict == "incompatible"
    assert session.judged == 1


def test_moving_an_endpoint_judges_both_of_its_topics():
    session = cqos.Session(of_two_topics())
    session.report()
    session.put(Endpoint("sub/scan", "subscriber", "/map", "planner"))
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


def test_the_session_keeps_a_copy():
    system = of_two_topics()
    session = cqos.Session(system)
    system.endpoints.clear()
    assert len(session.system.endpoints) == 4
