"""Laws of guarantees under faults, over random pairs of the packs that we ship."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hypothesis import given
from hypothesis import strategies as st

from cqos_core import check_pair
from cqos_core.api import pair_system
from cqos_core.given import give, over
from cqos_core.guarantee import FAULTS, LINK, WORDS
from cqos_core.resolve import resolve
from tests.test_guarantee import RANK, Pair, needs, pairs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.given import Given
    from cqos_core.guarantee import Word


def given_by(pair: Pair, **options: str) -> Sequence[Given]:
    """What a pair gives."""
    pack = pair["packs"][0]
    stated = {**pair["options"], **options}
    system = pair_system(pack.id, pair["offered"], pair["requested"], stated, pair["topic"])
    ends = resolve(system, {pack.id: pack}.get).endpoints
    return give(ends[0].profile, ends[1].profile)


def no_more(word: Word, value: int | None, than: int | None) -> bool:
    """Whether a value claims no more than another one; what is not known claims nothing."""
    if value is None or value == word.nothing:
        return True
    return than is not None and not word.stronger(value, than)


@given(pairs(), needs(), st.sampled_from(FAULTS))
def test_one_more_fault_never_makes_a_verdict_better(pair: Pair, stated: dict[str, Any], fault: str):
    listed = stated.get("survives", "[]").strip("[]")
    more = {**stated, "survives": f"[{', '.join(filter(None, (listed, fault)))}]"}
    assert RANK[check_pair(**pair, needs=stated).verdict] <= RANK[check_pair(**pair, needs=more).verdict]


@given(pairs(), st.sampled_from(FAULTS))
def test_no_more_is_given_under_a_fault_than_without(pair: Pair, fault: str):
    assert all(no_more(each.word, each.under(fault), each.value) for each in given_by(pair, outage="1s"))


@given(pairs())
def test_without_outage_nothing_is_claimed_over_a_link_outage(pair: Pair):
    assert all(each.under("link_outage") in {None, each.word.nothing} for each in given_by(pair))


@given(pairs(), st.sampled_from(["1ms", "1s"]), st.sampled_from(["1s", "10s", "1h"]))
def test_a_longer_outage_never_gives_more(pair: Pair, short: str, long: str):
    shorter = {each.word.name: each for each in given_by(pair, outage=short)}
    for each in given_by(pair, outage=long):
        assert no_more(each.word, each.under("link_outage"), shorter[each.word.name].under("link_outage"))


@given(pairs(), pairs(), st.booleans(), st.sampled_from((LINK, *FAULTS)))
def test_a_hop_never_improves_a_path_under_any_fault(first: Pair, second: Pair, carried: bool, fault: str):
    hops = [given_by(first, outage="1s"), given_by(second, outage="1s")]
    by_word = [{each.word.name: each for each in hop} for hop in hops]
    at_ends = {"subscriber_restart": (LINK, fault), "publisher_restart": (fault, LINK)}.get(fault, (fault, fault))
    for path in over(hops, carried=carried):
        word = WORDS[path.word.name]
        ends = list(zip(by_word, at_ends, strict=True))
        for hop, column in ends[1:] if word.over == "last hop" else ends:
            assert no_more(word, path.under(fault), hop[word.name].under(column))


@given(pairs(), needs())
def test_what_is_needed_and_what_explain_prints_agree(pair: Pair, stated: dict[str, Any]):
    word = next((name for name in stated if name != "survives"), None)
    fault = next(iter(filter(None, stated.get("survives", "").strip("[]").split(", "))), None)
    if word is None or check_pair(**pair).verdict != "compatible":
        return
    required = {word: stated[word]} | ({"survives": f"[{fault}]"} if fault else {})
    verdict = check_pair(**pair, needs=required).verdict
    cell = next(each for each in given_by(pair) if each.word.name == word)
    asked = cell.word.need.domain.parse(
        stated[word].replace("true", "1") if cell.word.kind == "at_least" else stated[word]
    )
    claimed = cell.under(fault or LINK)
    if isinstance(asked, int) and asked != cell.word.nothing and claimed is not None and claimed != cell.word.nothing:
        enough = claimed == asked or cell.word.stronger(claimed, asked)
        assert (verdict == "compatible") or not enough
