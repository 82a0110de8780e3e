"""Law: removing understanding never makes a report greener."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check
from cqos_core.model.settings import EVERY_OTHER, Place, Setting
from cqos_core.model.system import ImportNote, Part
from tests.laws.systems import LETTERS, PACKS, ROBOTS, systems

if TYPE_CHECKING:
    from cqos_core.model.system import System

ENDPOINT, VALUES = "an endpoint", "the values of an endpoint"


def forgotten(system: System, what: str, chosen: int) -> System:
    """The system as an importer gives it that did not understand one endpoint, or what it states."""
    less = copy.deepcopy(system)
    endpoint = less.endpoints[chosen % len(less.endpoints)]
    if what == ENDPOINT:
        less.endpoints.remove(endpoint)
        part = Part("call", endpoint.id, "it is not followed", Place("node.py", 1))
        less.notes = [*less.notes, ImportNote("CQ044", "note", "a call is not followed", parts=(part,))]
    else:
        unknown = Setting("", Place("node.py", 1), "it is not followed")
        endpoint.settings = {EVERY_OTHER: unknown}
        endpoint.overlay = {}
    return less


@given(systems(LETTERS) | systems(ROBOTS), st.sampled_from((ENDPOINT, VALUES)), st.integers(0, 100))
def test_what_is_not_understood_is_covered_less(system: Any, what: str, chosen: int) -> None:
    if not system.endpoints:
        return
    whole = check(system, packs=PACKS).coverage
    report = check(forgotten(system, what, chosen), packs=PACKS)
    assert report.coverage.percent < 100
    assert report.coverage.percent <= whole.percent
    if what == ENDPOINT:
        assert report.verdict_words != "compatible"
        assert len(report.coverage.unread) > len(whole.unread)
    else:
        assert len(report.coverage.unclear) >= len(whole.unclear)
