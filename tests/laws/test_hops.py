"""Law: what a path over bridges gives is put together from what its hops give, as each word says, and no hop improves it."""

from __future__ import annotations

from random import Random
from typing import Any, Final

import pytest

from cqos_core import explain
from cqos_core.language.values import INFINITE
from cqos_core.matching.pair_guarantees import FaultGuarantee, PairGuarantee, over_hops
from cqos_core.packs.guarantee import FAULTS, LINK, WORDS
from tests.effort import EXPLORE
from tests.made_up_protocol import writer
from tests.test_bridge_values import PACKS, bridge, bridged, needing

SEEDS: Final = 2_000 if EXPLORE else 40
SECOND: Final = 10**9
VALUES: Final = {
    "holds": (0, 1, None),
    "at_least": (0, 1, 5, None),
    "at_most": (0, SECOND, 3 * SECOND, INFINITE - 1, INFINITE, None),
}
OF_EVERY_HOP: Final = {"latest", "loss_free", "duplicate_free", "ordered"}
OF_THE_LAST_HOP: Final = {"late_join", "offline", "max_gap"}
CELLS: Final = (LINK, *FAULTS)
Hop = dict[str, dict[str, Any]]
"""What a hop gives, by word and by fault."""


def hops(seed: int) -> list[Hop]:
    """Return what two to four hops give, mostly something."""
    random = Random(seed)  # noqa: S311 - no secrets
    return [
        {
            name: {
                fault: random.choice(VALUES[word.kind]) if random.random() < 0.5 else VALUES[word.kind][1]
                for fault in CELLS
            }
            for name, word in WORDS.items()
        }
        for _ in range(random.randint(2, 4))
    ]


def given_by(hop: Hop) -> list[PairGuarantee]:
    return [
        PairGuarantee(WORDS[name], cells[LINK], (), {fault: FaultGuarantee(value) for fault, value in cells.items()})
        for name, cells in hop.items()
    ]


def joined(path: list[Hop], *, carried: bool) -> Hop:
    given = over_hops([given_by(hop) for hop in path], carried=carried)
    return {each.word.name: {fault: each.under(fault) for fault in CELLS} for each in given}


def weakest(values: list[Any], nothing: Any, pick: Any) -> Any:
    """Nothing where a hop gives nothing; else unknown where it is not known of one."""
    if nothing in values:
        return nothing
    return None if None in values else pick(values)


def expected(path: list[Hop], name: str, fault: str, *, carried: bool) -> Any:
    word, values = WORDS[name], [hop[name][fault] for hop in path]
    pick = max if word.kind == "at_most" else min
    if name in OF_EVERY_HOP or (name == "max_gap" and fault != LINK):
        return weakest(values, word.nothing, pick)
    if name == "max_age" or (name == "liveness" and carried):
        return weakest(values, word.nothing, lambda each: min(sum(each), INFINITE))
    if name == "liveness":
        return word.nothing
    if name == "late_join" and values[-1] != word.nothing:
        filled = weakest([hop["latest"][fault] for hop in path[:-1]], 0, min)
        return word.nothing if filled == 0 else None if filled is None else values[-1]
    return values[-1]


@pytest.mark.parametrize("carried", [False, True])
@pytest.mark.parametrize("seed", range(SEEDS))
def test_each_word_comes_about_over_hops_as_it_says(seed, carried):
    path = hops(seed)
    found = joined(path, carried=carried)
    for name, cells in found.items():
        for fault, value in cells.items():
            assert value == expected(path, name, fault, carried=carried), (name, fault)
    certain = {name for name in WORDS if any(hop[name][LINK] is not None for hop in path)}
    assert found.keys() >= certain


@pytest.mark.parametrize("carried", [False, True])
@pytest.mark.parametrize("seed", range(SEEDS))
def test_no_hop_improves_what_the_others_give(seed, carried):
    path = hops(seed)
    for name, cells in joined(path, carried=carried).items():
        word = WORDS[name]
        for fault, value in cells.items():
            for hop in path[-1:] if name in OF_THE_LAST_HOP else path:
                own = hop[name][fault]
                if own is None or value is None:
                    assert own is not None or value in {None, word.nothing}, (name, fault)
                    assert own != word.nothing, (name, fault)
                else:
                    assert not word.stronger(value, own), (name, fault)


@pytest.mark.parametrize("delays", [("30s", "20s", "50s"), ("1s", "1s", "1s"), ("1h", "1s", "infinite")])
def test_ages_of_the_hops_of_an_explained_path_add_up(delays):
    first, second, third = delays
    system = bridged(
        writer("a", "w", delay=first),
        needing("c", "r"),
        bridges=[
            bridge("one", ("i1", "a"), ("o1", "b"), send={"delay": second}),
            bridge("two", ("i2", "b"), ("o2", "c"), send={"delay": third}),
        ],
    )
    way = explain(system, publisher="w", subscriber="r", packs=PACKS)

    def age(guarantees: Any) -> int:
        text = next(each.value for each in guarantees if each.word == "max_age")
        return INFINITE if text == "none" else WORDS["max_age"].need.domain.parse(text)  # type: ignore[return-value]

    assert len(way.hops) == 3
    assert age(way.guarantees) == min(sum(age(hop.guarantees) for hop in way.hops), INFINITE)
