"""Law: what is put together from a base and single settings is what resolving the whole endpoint gives."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import read
from cqos_core.language.policy import ENDPOINT
from cqos_core.matching.pipeline import Pipeline, context
from cqos_core.model.system import Cases, Endpoint, Participant, Place, Setting, System, Topic
from cqos_core.resolving.bases import Bases
from cqos_core.resolving.plainly import Plainly
from cqos_core.resolving.resolved import READ
from tests.laws.forgetting import forget
from tests.laws.systems import BOTH, systems
from tests.worlds import POST

WHERE = context([POST])
ALL = ("post", "ros2", "dds", "mqtt")
ODD = ("", "0", "7", "1s", "-1", "infinite", "unspecified", "{sec: 1, nanosec: 5}", "[a, b]", "nonsense", "0s", "true")
CASES = Cases("what it means", (("one thing", "nonsense"), ("another", "")))
UNKNOWN = ("it was not written down", "it is a variable", CASES)


@cache
def settings(protocol: str, level: str) -> Any:
    """Settings of a level: names in every spelling, some of none; texts that are values, words, or neither."""
    pack = WHERE.find_pack(protocol)
    pairs = []
    for policy in (each for each in pack.policies if each.level == level):
        texts = [*policy.words, *map(policy.domain.format, policy.domain.candidates()), policy.domain.example, *ODD]
        texts += [text for text in (policy.default_for("publisher"),) if text is not None]
        names = [policy.name, policy.name.upper(), *policy.aliases]
        pairs += [(name, text) for name in names for text in dict.fromkeys(texts)]
    pairs += [("colour", "red"), ("*", ""), ("will", "{topic: a}")]
    places = st.none() | st.builds(Place, st.just("a.yaml"), st.integers(1, 9))
    unknown = st.sampled_from(["", "", "", "", "", "", *UNKNOWN])
    setting = st.builds(
        lambda pair, place, why, derived: (pair[0], Setting(pair[1], place, why, derived)),
        *(st.sampled_from(pairs), places, unknown, st.sampled_from([False, False, False, True])),
    )
    return st.lists(setting, max_size=4, unique_by=lambda each: each[0]).map(dict)


@st.composite
def stated(draw: Any, protocol: str) -> System:
    """A system whose endpoints state anything that the pack knows, and what it does not."""
    pack = WHERE.find_pack(protocol)
    system = System(protocol=protocol, options={protocol: draw(settings(protocol, "option"))})
    for name in ("a", "b"):
        system.participants[name] = Participant(name, settings=draw(settings(protocol, "participant")))
    system.topics["news"] = Topic("news", draw(settings(protocol, "topic")))
    for number in range(draw(st.integers(1, 5))):
        system.endpoints.append(
            Endpoint(
                id=f"e{number}",
                role=draw(st.sampled_from(["publisher", "subscriber"])),
                topic=draw(st.sampled_from(["news", "other", "tf_static", None])),
                participant=draw(st.sampled_from(["a", "b"])),
                settings=draw(settings(protocol, ENDPOINT)),
                type=draw(st.sampled_from([None, "a/msg/B"])),
                dialect=draw(st.sampled_from(["yaml", *pack.dialects])),
                observed=draw(st.booleans()),
                place=Place("a.yaml", 20 + number),
            )
        )
    return system


def described(system: System) -> object:
    """What resolving finds: values by identity, for equal ones are one, and where each comes from."""
    resolver = Pipeline(system, WHERE).resolver
    endpoints = [
        (each.id, each.profile, [(each.origin(index), each.written(index)) for index in range(len(each.pack.policies))])
        for each in resolver.result.endpoints
    ]
    return endpoints, resolver.result.findings


def compare(system: System, monkeypatch: pytest.MonkeyPatch) -> None:
    """Resolve by bases, twice, and without."""
    forget()
    with_bases = described(system), described(system)
    with monkeypatch.context() as patched:
        patched.setattr(Bases, "read", lambda *_: None)
        patched.setattr(Plainly, "resolved", lambda *_: None)
        READ.clear()
        whole = described(system)
    assert with_bases == (whole, whole)


@pytest.mark.parametrize("protocol", ALL)
@given(st.data())
def test_a_base_with_settings_is_the_whole_endpoint(protocol, data):
    with pytest.MonkeyPatch.context() as patch:
        compare(data.draw(stated(protocol)), patch)


@given(st.sampled_from(BOTH).flatmap(systems))
def test_so_it_is_in_any_system(system):
    with pytest.MonkeyPatch.context() as patch:
        compare(system, patch)


def test_most_endpoints_go_this_way():
    forget()
    found = []
    system = System(protocol="ros2", participants={"a": Participant("a")})
    system.endpoints = [
        Endpoint(id=f"e{each}", role="publisher", topic="t", participant="a", settings={"depth": Setting(str(each))})
        for each in range(1, 9)
    ]
    read = Plainly.resolved
    with pytest.MonkeyPatch.context() as patch:

        def noted(*each: Any) -> Any:
            found.append(read(*each))
            return found[-1]

        patch.setattr(Plainly, "resolved", noted)
        described(system)
    assert len(found) == len(system.endpoints)
    assert all(found)


@pytest.mark.parametrize("texts", [("1", "5ms"), ("0.5", "5"), ("7x", "1s"), ("3", "2h"), ("99999999999", "0.1ns")])
def test_settings_of_one_pattern_are_those_settings(texts):
    """Events of a diagram that state the same in other numbers: values that are none, or that need a remark, among them."""
    events = "".join(
        f'<{tag} id="{tag}{at}" name="e" qos:depth="{depth}" qos:reliability="{word}" qos:deadline="{deadline}">'
        f'<signalEventDefinition signalRef="S{at}"/></{tag}>'
        for at, (depth, deadline) in enumerate([("2", "10ms"), texts, ("4", "1s"), *[("6", "2s")] * 200])
        for tag, word in (("startEvent", "reliable"), ("endEvent", "best_effort"))
    )
    signals = "".join(f'<signal id="S{at}" name="s{at}"/>' for at in range(203))
    head = 'xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" xmlns:qos="http://qos"'
    system = read(f'<definitions {head}>{signals}<process id="p">{events}</process></definitions>'.encode())
    system.protocol = "ros2"
    assert sum(each.pattern() is not None for each in system.endpoints) > 400
    with pytest.MonkeyPatch.context() as patch:
        compare(system, patch)
