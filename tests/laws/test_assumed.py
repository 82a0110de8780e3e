"""Laws: a known verdict is that of every completion among the assumed values, and the report names what it rests on."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Assumption, Report, Setting, Verdict, check, check_pair, read
from cqos_core.api import context
from cqos_core.formatters.multi_system import combined_report
from cqos_core.matching import judge
from tests.laws.systems import BOTH, PACKS, WHERE, systems
from tests.laws.test_fixes import random_systems

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cqos_core import System
    from cqos_core.packs import Policy, RulePack

INSTALLED = context()


def left_open(pack: RulePack, system: System) -> Iterator[Policy]:
    """The options of a pack that have few values, while the system states none."""
    stated = {normal for name in system.options.get(pack.id, {}) if (normal := pack.find("option", name)) is not None}
    for index, policy in enumerate(pack.policies):
        few = policy.assume or policy.domain.candidates()
        if policy.level == "option" and policy.default is None and few and index not in stated:
            yield policy


def completed(system: System, pack: RulePack, option: str, value: str) -> System:
    options = {**system.options.get(pack.id, {}), option: Setting(value)}
    return replace(system, options={**system.options, pack.id: options})


def verdicts(system: System, packs: Sequence[RulePack]) -> dict[tuple[str, str, str], Verdict]:
    return {(pair.topic, pair.publisher, pair.subscriber): pair.verdict for pair in check(system, packs=packs).pairs}


def law(system: System, pack: RulePack, packs: Sequence[RulePack] = ()) -> Iterator[str]:
    """Yield what is wrong with what the report on a system assumes."""
    report = check(system, packs=packs)
    before = {(pair.topic, pair.publisher, pair.subscriber): pair.verdict for pair in report.pairs}
    named = {each.option: each.values for each in report.assumed}
    for policy in left_open(pack, system):
        name = f"{pack.id}.{policy.name}"
        possible = policy.assume or tuple(map(policy.domain.format, policy.domain.candidates()))
        assumed = named.get(name, possible)
        if not set(assumed) <= set(possible):
            yield f"{name} is assumed to be {possible}, the report names {assumed}"
        for value in (policy.domain.format(value) for value in policy.domain.candidates()):
            after = verdicts(completed(system, pack, policy.name, value), packs)
            turned = [
                f"{pair}: {verdict} is {after[pair]} with {name}={value}"
                for pair, verdict in before.items()
                if verdict is not Verdict.UNKNOWN and pair in after and after[pair] is not verdict
            ]
            if value in assumed:
                yield from turned
            elif turned and name not in named:
                yield f"{turned[0]}, and the report does not name {name}"


@pytest.mark.parametrize(
    ("protocol", "offered", "requested", "assumed"),
    [
        ("ros2", {}, {}, None),
        ("ros2", {"deadline": "1s"}, {"deadline": "500ms"}, ("cyclonedds", "fastdds", "connext")),
        ("ros2", {"durability": "volatile"}, {"durability": "system_default"}, ("cyclonedds", "fastdds", "connext")),
        ("mqtt", {}, {}, None),
        ("mqtt", {"topic_alias": 1}, {}, ("5.0",)),
        ("dds", {"durability": "transient"}, {}, None),
    ],
)
def test_what_a_verdict_rests_on_is_named(protocol, offered, requested, assumed):
    report = check_pair(protocol, offered, requested)
    assert [each.values for each in report.assumed] == ([] if assumed is None else [assumed])
    if protocol == "ros2":
        assert check_pair(protocol, offered, requested, {"rmw": "cyclonedds"}).assumed == ()


@pytest.mark.parametrize(
    ("requested", "assumed"),
    [
        ({"reliability": "best_available"}, ("iron", "jazzy", "kilted", "lyrical", "rolling")),
        ({"intra_process": "true"}, None),
        ({"intra_process": "true", "durability": "transient_local"}, ("jazzy", "kilted", "lyrical", "rolling")),
    ],
)
def test_distributions_in_which_an_end_does_not_exist_are_not_assumed(requested, assumed):
    report = check_pair("ros2", {"durability": "transient_local"}, requested)
    assert {each.option: each.values for each in report.assumed}.get("ros2.distro") == assumed
    stated = check_pair("ros2", {"durability": "transient_local"}, requested, {"distro": "rolling"})
    assert "ros2.distro" not in {each.option for each in stated.assumed}


def test_several_systems_name_an_assumption_once():
    one = check_pair("mqtt", {"topic_alias": 1}, {}).assumed
    other = (Assumption("mqtt.protocol_version", ("3.1.1", "5.0")), Assumption("ros2.rmw", ("fastdds",)))
    reports = [Report(Verdict.COMPATIBLE, assumed=each) for each in (one, other)]
    assert combined_report(reports).assumed == (*one, other[1])


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_a_known_verdict_is_that_of_every_assumed_value(words, data):
    system = data.draw(systems(words))
    pack = WHERE.find_pack(words.protocol)
    assert pack is not None
    assert not [*law(system, pack, PACKS)]


@pytest.mark.parametrize("protocol", ["ros2", "dds", "mqtt"])
@given(st.data())
def test_a_known_verdict_of_an_installed_pack_is_that_of_every_assumed_value(protocol: str, data: Any):
    pack = INSTALLED.find_pack(protocol)
    assert pack is not None
    text = data.draw(random_systems(pack))
    assert not [*law(read(text.encode()), pack)], text


@pytest.mark.parametrize("asked", [0, 1_000_000_000])
def test_errors_about_an_unset_option_refuse_ends_however_many_are_asked(asked: int):
    ends = "a: {publishes: {/t: }}\n  b: {subscribes: {/t: {reliability: best_available}}}"
    with patch.object(judge, "_WORTH_A_FUNCTION", asked):
        report = check(f"cqos: 1\nprotocol: ros2\nparticipants:\n  {ends}\n".encode())
        named = {each.option: each.values for each in report.assumed}
    assert named["ros2.distro"] == ("iron", "jazzy", "kilted", "lyrical", "rolling")


@given(st.data())
def test_no_error_about_an_unset_option_is_passed_over(data: Any):
    """The function that tells which errors may refuse an end agrees with asking all of them."""
    pack = INSTALLED.find_pack("ros2")
    assert pack is not None
    system = read(data.draw(random_systems(pack)).encode())
    with patch.object(judge, "_WORTH_A_FUNCTION", 0):
        found = tuple(check(system).assumed)
    with patch.object(judge, "_WORTH_A_FUNCTION", 1_000_000_000):
        assert tuple(check(system).assumed) == found
