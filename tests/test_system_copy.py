"""Copies of systems share nothing that can change; and no collector runs while much is built."""

import gc
import json
import subprocess
import sys
from copy import deepcopy

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cqos_core as cqos
from cqos_core.files.system_copy import copied
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.system import Bridge, Endpoint, Route, System
from tests.laws.systems import BOTH, systems


def parts_that_change(value):
    """Every object below that can be changed."""
    found = [value] if isinstance(value, (dict, list)) else []
    if hasattr(value, "__dataclass_fields__"):
        frozen = value.__dataclass_params__.frozen
        found = [] if frozen else [value]
        value = [getattr(value, name) for name in value.__dataclass_fields__]
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else ()
    return [*found, *(each for below in inner for each in parts_that_change(below))]


@given(st.sampled_from(BOTH).flatmap(systems))
def test_a_copy_is_equal_and_shares_nothing_that_changes(system):
    ends = [deepcopy(each) for each in system.endpoints[:2]]
    system.bridges["b"] = Bridge("b", (Route(*ends),))
    copy = copied(system)
    assert copy == system
    assert not {id(each) for each in parts_that_change(copy)} & {id(each) for each in parts_that_change(system)}


def test_what_programs_add_is_copied_too():
    class Own(Endpoint):
        """An endpoint of a program."""

    system = System(endpoints=[Own(id="e", role="publisher", topic="t", participant="p")])
    copy = copied(system)
    assert copy.endpoints[0] == system.endpoints[0]
    assert copy.endpoints[0].settings is not system.endpoints[0].settings


def divide_without_collector():
    assert not gc.isenabled()
    return 1 / 0


def test_the_collector_runs_again_after_an_error():
    with pytest.raises(ZeroDivisionError), gc_paused(5_000), gc_paused(5_000):
        divide_without_collector()
    assert gc.isenabled()
    with gc_paused(10):
        assert gc.isenabled()


def test_a_check_leaves_nothing_to_collect():
    text = "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {t: {depth: 3}}}, b: {subscribes: {t: }}}\n"
    cqos.check(text.encode(), importer="yaml")
    gc.collect()
    gc.disable()
    try:
        cqos.check(text.encode(), importer="yaml")
        assert gc.collect() == 0
    finally:
        gc.enable()


ANSWERING = """
import gc, json
import cqos_core as cqos
from cqos_core.model.garbage_collection import collect_new_objects_only
cqos.check_pair("ros2", {}, {}).findings
collect_new_objects_only()
before = gc.get_stats()
for number in range(400):
    offered = {"depth": str(1 + number), "deadline": f"{100 + number}ms"}
    [*cqos.check_pair("ros2", offered, {"deadline": f"{200 + number}ms"}).guarantees]
print(json.dumps([after["collections"] - each["collections"] for after, each in zip(gc.get_stats(), before)]))
"""


def test_a_process_that_answers_never_stops_for_what_it_remembers():
    """With the usual thresholds, the collector looks at older objects ten times in this run."""
    run = subprocess.run([sys.executable, "-c", ANSWERING], capture_output=True, text=True, check=True)
    young, older, oldest = json.loads(run.stdout)
    assert young > 5
    assert older == oldest == 0
