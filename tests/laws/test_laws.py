"""The laws of verdicts, over the ROS 2 pack: what must hold for any system, whatever its rules say."""

from dataclasses import replace

from hypothesis import assume, given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core import Endpoint, Participant, ProfileRef, Setting, Severity, System, Verdict

ORDERED = {
    "reliability": ("best_effort", "reliable"),
    "durability": ("volatile", "transient_local"),
    "liveliness": ("automatic", "manual_by_node", "manual_by_topic"),
    # A shorter promise is a stronger one.
    "deadline": ("infinite", "2s", "1s"),
    "lease_duration": ("infinite", "2s", "1s"),
}
OPEN = {
    "reliability": ("system_default", "unknown", "best_available"),
    "durability": ("system_default", "unknown", "best_available"),
    "liveliness": ("system_default", "best_available"),
    "deadline": ("best_available",),
    "lease_duration": (),
}
REST = {"depth": ("1", "10"), "history": ("keep_last", "keep_all"), "lifespan": ("1s", "infinite")}

stated = st.fixed_dictionaries({}, optional={name: st.sampled_from(values) for name, values in ORDERED.items()})
anything = st.fixed_dictionaries(
    {},
    optional={
        **{name: st.sampled_from((*values, *OPEN[name])) for name, values in ORDERED.items()},
        **{name: st.sampled_from(values) for name, values in REST.items()},
    },
)
rmw = st.sampled_from((None, "cyclonedds", "fastdds", "connext", "zenoh", "micro_ros"))


@st.composite
def systems(draw, most=6):
    system = System("any", "ros2")
    for name in ("a", "b", "c"):
        chosen = draw(rmw)
        options = {} if chosen is None else {"rmw": Setting(chosen)}
        if draw(st.integers(0, 5)) == 0:
            options["domain"] = Setting("1")
        system.participants[name] = Participant(name, settings=options)
    for number in range(draw(st.integers(2, most))):
        system.endpoints.append(
            Endpoint(
                id=f"e{number}",
                role=draw(st.sampled_from(("publisher", "subscriber"))),
                topic=draw(st.sampled_from(("/scan", "/map"))),
                participant=draw(st.sampled_from(("a", "b", "c"))),
                settings={name: Setting(text) for name, text in draw(anything).items()},
                profiles=draw(st.sampled_from(((), (ProfileRef("sensor_data"),)))),
            )
        )
    return system


def verdict(offered, requested):
    return cqos.check_pair("ros2", offered, requested).verdict


@given(stated, stated, st.sampled_from(sorted(ORDERED)), st.data())
def test_a_stronger_offer_never_makes_a_verdict_worse(offered, requested, policy, data):
    weaker, stronger = sorted(data.draw(st.lists(st.integers(0, len(ORDERED[policy]) - 1), min_size=2, max_size=2)))
    before = verdict({**offered, policy: ORDERED[policy][weaker]}, requested)
    after = verdict({**offered, policy: ORDERED[policy][stronger]}, requested)
    assert after.rank <= before.rank


@given(stated, stated, st.sampled_from(sorted(ORDERED)), st.data())
def test_a_weaker_request_never_makes_a_verdict_worse(offered, requested, policy, data):
    weaker, stronger = sorted(data.draw(st.lists(st.integers(0, len(ORDERED[policy]) - 1), min_size=2, max_size=2)))
    before = verdict(offered, {**requested, policy: ORDERED[policy][stronger]})
    after = verdict(offered, {**requested, policy: ORDERED[policy][weaker]})
    assert after.rank <= before.rank


@given(systems(), st.randoms(use_true_random=False))
def test_the_order_of_declaration_never_matters(system, order):
    shuffled = replace(system, endpoints=list(system.endpoints), participants={})
    order.shuffle(shuffled.endpoints)
    names = list(system.participants)
    order.shuffle(names)
    shuffled.participants = {name: system.participants[name] for name in names}
    assert cqos.check(shuffled) == cqos.check(system)


@given(systems())
def test_explain_and_check_agree_on_every_pair(system):
    for pair in cqos.check(system).pairs:
        explained = cqos.explain(system, publisher=pair.publisher, subscriber=pair.subscriber)
        assert explained.verdict is pair.verdict


@given(systems())
def test_the_verdict_of_a_report_is_the_worst_of_its_pairs(system):
    report = cqos.check(system)
    worst = max((pair.verdict for pair in report.pairs), key=lambda each: each.rank, default=Verdict.UNKNOWN)
    assert report.verdict is worst
    incompatible = any(finding.verdict is Verdict.INCOMPATIBLE for finding in report.findings)
    assert incompatible == (report.verdict is Verdict.INCOMPATIBLE)


@given(systems(most=5))
def test_a_fix_removes_its_finding_and_counts_the_pairs_it_changes(system):
    report = cqos.check(system)
    verdicts = {(pair.publisher, pair.subscriber): pair.verdict.rank for pair in report.pairs}
    for finding in report.findings:
        for remedy in finding.remedies:
            changed = replace(
                system,
                endpoints=[
                    replace(each, settings={**each.settings, remedy.policy: Setting(remedy.value)})
                    if each.id in remedy.members
                    else each
                    for each in system.endpoints
                ],
            )
            # Two spellings of one policy at one place would contradict each other.
            assume(remedy.policy != "liveliness_lease_duration")
            after = cqos.check(changed)
            # The same rule may speak of the same endpoint beside others, which this remedy is not about.
            others = set(finding.endpoints) - set(remedy.members)
            same = [
                each
                for each in after.findings
                if each.code == finding.code and each.topic == finding.topic and others <= set(each.endpoints)
            ]
            left = {member for each in same for member in each.endpoints} & set(remedy.members)
            assert not left or finding.code == "CQ205", (finding.message, remedy.text)
            ranks = {(pair.publisher, pair.subscriber): pair.verdict.rank for pair in after.pairs}
            if remedy.mends is not None and not finding.more_topics and not uses_peers(system):
                assert remedy.mends == sum(ranks[pair] < verdicts[pair] for pair in verdicts)
                assert remedy.breaks == sum(ranks[pair] > verdicts[pair] for pair in verdicts)


def uses_peers(system):
    """Where values are taken from peers, a change moves the others too, which a remedy does not count."""
    return any(setting.text == "best_available" for each in system.endpoints for setting in each.settings.values())


@given(st.integers(1, 40))
def test_many_equal_endpoints_cost_one_finding(many):
    system = System("many", "ros2", participants={"p": Participant("p"), "s": Participant("s")})
    for number in range(many):
        system.endpoints.append(
            Endpoint(
                id=f"p{number}",
                role="publisher",
                topic="/t",
                participant="p",
                settings={"reliability": Setting("best_effort")},
            )
        )
        system.endpoints.append(Endpoint(id=f"s{number}", role="subscriber", topic="/t", participant="s"))
    report = cqos.check(system)
    assert len(report.groups) == 1
    assert [finding.code for finding in report.findings if finding.severity is Severity.ERROR] == ["ROS101"]
    assert report.pair_count == many**2
