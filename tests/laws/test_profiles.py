"""Law: where a setting stands changes nothing. Moved from an endpoint into a profile, the report says the same."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Profile, ProfileRef, Severity, check
from cqos_core.api import context, read
from tests.laws.test_fixes import random_systems

if TYPE_CHECKING:
    from cqos_core import Report, System

WHERE = context()


def moved(system: System, data: Any) -> System:
    """Move some settings of some endpoints into profiles of their own."""
    profiles, endpoints = dict(system.profiles), []
    for each in system.endpoints:
        names = [name for name in each.settings if data.draw(st.booleans())]
        if names:
            profile = f"profile of {each.id}"
            profiles[profile] = Profile(profile, {name: each.settings[name] for name in names})
            left = {name: setting for name, setting in each.settings.items() if name not in names}
            each = replace(each, settings=left, profiles=(*each.profiles, ProfileRef(profile)))  # noqa: PLW2901
        endpoints.append(each)
    return replace(system, profiles=profiles, endpoints=endpoints)


def said(report: Report, but: frozenset[str]) -> tuple[object, ...]:
    findings = {
        (each.code, each.severity, each.endpoints)
        for each in report.findings
        if each.severity is not Severity.NOTE and each.code not in but
    }
    return sorted(map(str, report.pairs)), sorted(map(str, findings))


@pytest.mark.parametrize("protocol", ["ros2", "dds", "mqtt"])
@given(st.data())
def test_a_setting_may_stand_in_a_profile(protocol, data):
    pack = WHERE.find_pack(protocol)
    assert pack is not None
    system = read(data.draw(random_systems(pack)).encode())
    here = frozenset(b.rule.code for b in pack.bound_rules if "stated_here" in str(b.rule.condition)) | {"CQ210"}
    assert said(check(moved(system, data)), here) == said(check(system), here)


def test_no_local_of_a_profile_counts():
    stated = """
cqos: 1
protocol: mqtt
participants: {client: {publishes: {t: {}}, subscribes: {t: {no_local: true}}}}
"""
    profile = """
cqos: 1
protocol: mqtt
profiles: {quiet: {no_local: true}}
participants: {client: {publishes: {t: {}}, subscribes: {t: quiet}}}
"""
    assert check(stated.encode()).pair_count == check(profile.encode()).pair_count == 0
