"""Law: never compatible by ignorance. What was not read, and an end that is refused, leave no pair compatible."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cqos_core import check, check_pair, explain
from cqos_core.language.policy import ENDPOINT
from cqos_core.model.settings import EVERY_OTHER, Place, Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Overlay, Participant, Profile, ProfileRef, System
from cqos_core.plugins import load_plugins
from tests.effort import EXAMPLES

if TYPE_CHECKING:
    from cqos_core.model.system import Role
    from cqos_core.packs.pack import RulePack

PACKS = ("ros2", "dds", "mqtt")
LAYERS = ("settings", "overlay", "profile", "base of a profile", "laid over", "participant", "options")
UNREAD = ("a letter too many", "another name", "no value", "not read", "everything else", "no such profile")


def pack_of(name: str) -> RulePack:
    pack = load_plugins().pack(name)
    assert pack is not None
    return pack


def values(pack: RulePack, role: str) -> dict[str, list[str]]:
    """A few values of every policy that an endpoint states."""
    return {
        policy.name: [policy.format(value) for value in policy.domain.candidates()[:4]]
        for policy in pack.policies
        if policy.level == ENDPOINT and role in policy.roles and not policy.derived and policy.domain.candidates()
    }


@st.composite
def ends(draw: Any, pack: RulePack, role: Role) -> Endpoint:
    table = values(pack, role)
    names = draw(st.lists(st.sampled_from(sorted(table)), max_size=3, unique=True))
    stated = {name: Setting(draw(st.sampled_from(table[name]))) for name in names}
    return Endpoint(id=role, role=role, topic="topic", participant=role, settings=stated)


def unread_setting(pack: RulePack, kind: str, role: str) -> dict[str, Setting]:
    """A setting that is not understood."""
    name = min(values(pack, role))
    return {
        "a letter too many": {f"{name}x": Setting("1")},
        "another name": {"something_else_entirely": Setting("1")},
        "no value": {name: Setting("no such value")},
        "not read": {name: Setting("${X}", Place("f", 1), "variable `X` is not set")},
        "everything else": {EVERY_OTHER: Setting("", Place("f", 1), "base profile `B` is not in the input")},
    }[kind]


def with_unread(system: System, pack: RulePack, kind: str, layer: str, role: Role) -> None:
    """State something that is not understood, of one end, at one layer."""
    end = next(each for each in system.endpoints if each.role == role)
    if kind == "no such profile":
        end.profiles = (ProfileRef("no such profile"),)
        return
    unread = unread_setting(pack, kind, role)
    if kind != "another name" and layer in {"participant", "options"}:
        unread = {"something_else_entirely": Setting("1")}
    name = next(iter(unread))
    # A nearer value wins over what has a name; what has none, or another one, is never known to be beaten.
    end.settings.pop(name, None)
    if layer == "settings":
        end.settings |= unread
    elif layer == "overlay":
        end.overlay |= unread
    elif layer == "laid over":
        system.overlays.append(Overlay("another file", unread, role))
    elif layer == "participant":
        system.participants[role].settings |= unread
    elif layer == "options":
        system.options[pack.id] = unread
    else:
        base = (ProfileRef("q"),) if layer == "base of a profile" else ()
        system.profiles["p"] = Profile("p", {} if base else unread, base)
        system.profiles["q"] = Profile("q", unread)
        end.profiles = (ProfileRef("p"),)


@pytest.mark.parametrize("protocol", PACKS)
@pytest.mark.parametrize("kind", UNREAD)
@settings(max_examples=EXAMPLES // 2)
@given(st.data())
def test_no_pair_is_compatible_beside_what_was_not_read(protocol, kind, data):
    pack = pack_of(protocol)
    system = System(protocol=protocol)
    for role in (PUBLISHER, SUBSCRIBER):
        system.participants[role] = Participant(role)
        system.endpoints.append(data.draw(ends(pack, role)))
    layer = data.draw(st.sampled_from(LAYERS))
    with_unread(system, pack, kind, layer, data.draw(st.sampled_from((PUBLISHER, SUBSCRIBER))))
    report = check(system)
    for pair in report.pairs:
        assert pair.verdict != "compatible", (layer, str(report))
        assert explain(system, publisher=pair.publisher, subscriber=pair.subscriber).verdict == pair.verdict
    # Whatever else a team states about a rule, its severity in this design or an exception changes no verdict.
    quiet = replace(system, severities={code: "off" for group in report.groups for code in group.codes})
    assert [pair.verdict for pair in check(quiet).pairs] == [pair.verdict for pair in report.pairs]


@pytest.mark.parametrize("protocol", PACKS)
@given(st.data())
def test_no_pair_is_compatible_beside_an_error_of_its_pack(protocol, data):
    pack = pack_of(protocol)
    offered, requested = (
        {name: each.text for name, each in data.draw(ends(pack, role)).settings.items()}
        for role in (PUBLISHER, SUBSCRIBER)
    )
    report = check_pair(protocol, offered, requested)
    if any(finding.severity == "error" for finding in report.findings):
        assert report.verdict != "compatible", str(report)


@pytest.mark.parametrize(
    ("protocol", "offered", "requested", "code"),
    [
        ("dds", {"history.depth": 20, "resource_limits.max_samples_per_instance": 10}, {}, "DDS302"),
        ("dds", {}, {"history.depth": 0}, "DDS304"),
        ("ros2", {"raw": "true", "depth": 1, "reliability": "unknown"}, {}, "ROS305"),
    ],
)
def test_an_end_that_cannot_be_created_makes_its_pairs_incompatible(protocol, offered, requested, code):
    report = check_pair(protocol, offered, requested)
    assert report.verdict == "incompatible"
    assert [finding.code for finding in report.findings if finding.verdict == "incompatible"] == [code]
    system = System(protocol=protocol)
    for role, stated in ((PUBLISHER, offered), (SUBSCRIBER, requested)):
        system.participants[role] = Participant(role)
        own = {name: Setting(str(value)) for name, value in stated.items()}
        system.endpoints.append(Endpoint(id=role, role=role, topic="topic", participant=role, settings=own))
    checked = check(system)
    assert checked.verdict == "incompatible"
    undecided = {"ROS101"} if code == "ROS305" else set()  # its reliability is given as unknown
    assert set(checked.groups[0].codes) == {code} | undecided
    # An endpoint that was seen exists, whatever a rule about creating one says.
    seen = replace(system, endpoints=[replace(each, observed=True) for each in system.endpoints])
    assert code not in check(seen).groups[0].codes
    # What a team makes of the rule changes no verdict.
    assert check(replace(system, severities={code: "note"})).verdict == "incompatible"
