"""Law: the order in which things are declared never matters."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check
from cqos_core.formatters.json_report import render_json
from cqos_core.model.style import Style
from tests.laws.systems import BOTH, LETTERS, PACKS, ROBOTS, systems

if TYPE_CHECKING:
    from random import Random

    from cqos_core.model.system import System


def shuffled(system: System, rng: Random) -> System:
    """The same system, everything that has no order of its own written down in another one."""
    other = deepcopy(system)

    def mixed(table):
        pairs = list(table.items())
        rng.shuffle(pairs)
        return dict(pairs)

    rng.shuffle(other.endpoints)
    for name in ("participants", "profiles", "topics", "options", "severities"):
        setattr(other, name, mixed(getattr(other, name)))
    stating: list[Any] = [*other.endpoints]
    for table in (other.participants, other.profiles, other.topics):
        stating += table.values()
    for each in stating:
        each.settings = mixed(each.settings)
    other.options = {pack: mixed(stated) for pack, stated in other.options.items()}
    return other


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data(), st.randoms(use_true_random=False))
def test_declaration_order_never_matters(words, data, rng):
    system = data.draw(systems(words))
    report = check(system, packs=PACKS)
    again = check(shuffled(system, rng), packs=PACKS)
    assert again == report
    assert render_json(again, Style()) == render_json(report, Style())


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_codes_of_a_group_stand_in_the_order_of_the_pack(words, data):
    (pack,) = (each for each in PACKS if each.id == words.protocol)
    places = {rule.code: place for place, rule in enumerate(pack.rules)}
    for group in check(data.draw(systems(words)), packs=PACKS).groups:
        assert group.codes == tuple(sorted(group.codes, key=lambda code: (places.get(code, -1), code)))


@given(systems(LETTERS), systems(ROBOTS), st.randoms(use_true_random=False))
def test_not_even_where_two_protocols_are_in_one_system(letters, robots, rng):
    system = letters
    for endpoint in robots.endpoints:
        endpoint.id, endpoint.participant, endpoint.protocol = f"r-{endpoint.id}", f"r-{endpoint.participant}", "ros2"
        system.endpoints.append(endpoint)
    for participant in robots.participants.values():
        participant.id = f"r-{participant.id}"
        participant.protocol = "ros2"
        system.participants[participant.id] = participant
    system.options |= robots.options
    assert check(shuffled(system, rng), packs=PACKS) == check(system, packs=PACKS)


@pytest.mark.parametrize("words", BOTH, ids=lambda words: words.protocol)
@given(st.data())
def test_a_check_neither_changes_its_system_nor_remembers_another(words, data):
    system, other = data.draw(systems(words)), data.draw(systems(words))
    before = deepcopy(system)
    report = check(system, packs=PACKS)
    assert system == before
    check(other, packs=PACKS)
    assert check(system, packs=PACKS) == report
