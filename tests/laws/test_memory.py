"""What was checked before changes nothing: memories of the process are for speed only."""

import gc
import weakref
from dataclasses import fields, is_dataclass, replace

from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check_pair, read
from cqos_core.checking import assumptions as assumed
from cqos_core.checking import fixes
from cqos_core.checking.checker import check_system
from cqos_core.matching import judge, pair_verdicts
from cqos_core.matching import topic_shape as shape
from cqos_core.model.system import Endpoint, Participant, Place, Setting, System
from cqos_core.resolving import bases, compared, facts, participants, plainly, profiles, resolved
from cqos_core.resolving.resolve import Resolver
from tests.benchmarks import inputs
from tests.laws.forgetting import forget
from tests.laws.systems import BOTH, WHERE, systems

ANY = st.sampled_from(BOTH).flatmap(systems)


def test_everything_that_remembers_is_forgotten_here():
    modules = (
        assumed,
        bases,
        fixes,
        judge,
        facts,
        participants,
        plainly,
        profiles,
        resolved,
        shape,
        pair_verdicts,
    )
    memories = {name for module in modules for name, value in vars(module).items() if hasattr(value, "cache_clear")}
    assert memories - {"cache", "dataclass", "lru_cache"} == {
        "_remembered",
        "errors_that_read",
        "_without_assumption",
        "refusing_values",
        "_with",
        "judge_pair",
        "judge_endpoint",
        "refusals",
        "refusing_worlds",
        "steered_by_options",
        "_options",
        "apart",
        "of_end",
        "undecided_of",
        "pair_rules",
        "meeting_rules",
        "signal_rules",
        "of_one",
        "refusing_rules",
        "_over_both",
        "base_layer",
        "_deciding",
        "assuming",
        "_by_default",
        "read_in_worlds",
        "undecided_meetings",
        "_treated_as",
        "conventions",
        "conventional",
    }


@given(ANY, ANY)
def test_a_check_does_not_depend_on_what_was_checked_before(first, second):
    forget()
    alone = check_system(second, WHERE)
    forget()
    check_system(first, WHERE)
    check_system(second, WHERE)
    assert check_system(second, WHERE) == alone


def test_a_report_on_a_pair_does_not_depend_on_pairs_before_it():
    pairs = [inputs.pair(number) for number in range(1001, 1061)]
    pairs += [(requested, offered) for offered, requested in pairs[20:50]]
    pairs += [({**offered, "depth": "7"}, requested) for offered, requested in pairs]
    forget()
    found = [check_pair("ros2", *each) for each in pairs]
    assert all(each.policies and each.guarantees for each in found)
    assert compared.COMPARED
    for at in range(50, len(pairs), 25):
        forget()
        assert check_pair("ros2", *pairs[at]) == found[at]


def moved(value):
    """The same, with all that was stated ten lines further down."""
    if isinstance(value, Place):
        return replace(value, line=(value.line or 0) + 10)
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: moved(getattr(value, each.name)) for each in fields(value)})
    if isinstance(value, dict):
        return {name: moved(each) for name, each in value.items()}
    return type(value)(map(moved, value)) if isinstance(value, (list, tuple)) else value


@given(ANY)
def test_what_is_remembered_has_no_places(system):
    further_down = moved(system)
    forget()
    alone = check_system(further_down, WHERE)
    forget()
    check_system(system, WHERE)
    assert check_system(further_down, WHERE) == alone


def test_what_is_longer_than_people_write_is_not_remembered():
    long = "x" * 5_000
    forget()
    system = System(
        "long",
        "ros2",
        participants={"a": Participant("a", settings={"namespace": Setting(long)})},
        endpoints=[
            Endpoint(
                id="e",
                role="publisher",
                topic=f"/{long}",
                participant="a",
                settings={"depth": Setting(f"{'0' * 5_000}5")},
            )
        ],
    )
    check_system(system, WHERE)
    memories = (resolved.READ, plainly._NAMED, participants._SURROUNDINGS, bases._OVERRIDES)
    assert not any(memories)
    assert profiles.conventions.cache_info().currsize == 0


def test_what_resolved_a_system_is_no_circle(monkeypatch):
    """So that a process that checks many systems lets go of each at once."""
    made = []
    begin = Resolver.__init__

    def noted(self, *args, **more):
        made.append(weakref.ref(self))
        begin(self, *args, **more)

    monkeypatch.setattr(Resolver, "__init__", noted)
    for form in (inputs.diagram, inputs.system_file):
        system = read(b"".join(form(400)))
        gc.disable()
        try:
            assert [each.message for each in check_system(system, WHERE).findings]
            assert [each() for each in made] == [None] * len(made)
        finally:
            gc.enable()
