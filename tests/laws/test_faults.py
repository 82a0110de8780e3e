"""Laws of guarantees under faults, over random pairs of the packs that we ship."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from hypothesis import assume, given
from hypothesis import strategies as st

from cqos_core import check, check_pair, explain
from cqos_core.analysis.pair_judge import pair_system
from cqos_core.language.values import INFINITE
from cqos_core.matching.derived_guarantees import give, over
from cqos_core.packs.guarantee import FAULTS, LINK, WORDS
from cqos_core.resolving.resolve import resolve
from cqos_mqtt.pack import PACK as MQTT
from tests.test_guarantee import RANK, Pair, needs, pairs, some

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cqos_core.matching.derived_guarantees import DerivedGuarantees
    from cqos_core.packs.guarantee import Word


def given_by(pair: Pair, **options: str) -> Sequence[DerivedGuarantees]:
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


@st.composite
def over_brokers(draw: Any) -> Pair:
    """A pair of MQTT, as `check_pair` takes it, with what the broker between them does."""
    both = {"qos": ["0", "1", "2"]}
    client = {"clean_start": ["true", "false"], "session_expiry_interval": ["0s", "1h"], "stores_session": ["true"]}
    return {
        "protocol": MQTT.id,
        "offered": draw(some({**both, "retain": ["true", "false"], "message_expiry_interval": ["1s", "1h"]})),
        "requested": draw(some({**both, "retain_handling": ["send", "send_if_new", "do_not_send"]})),
        "options": {"protocol_version": draw(st.sampled_from(["3.1.1", "5.0"])), **draw(some(client))},
        "topic": draw(some({"period": ["10ms", "1s"]})),
        "broker": draw(some({"persistence": ["true", "false"], "autosave_interval": ["each_message", "30min"]})),
    }


def bridged(first: Pair, second: Pair, required: dict[str, Any]) -> bytes:
    """A publisher, a bridge and a subscriber behind it, as a system file."""
    hops = {"a": first, "b": second}
    options: dict[str, Any] = {each["protocol"]: {"outage": "1s"} for each in hops.values()}

    def of(topic: str, **more: Any) -> dict[str, Any]:
        hop = hops[topic]
        broker = {"broker": f"broker {topic}"} if "broker" in hop else {}
        return {"protocol": hop["protocol"], **hop["options"], **broker, **more}

    return json.dumps(
        {
            "cqos": 1,
            "options": options,
            "topics": {topic: hop["topic"] for topic, hop in hops.items() if hop["topic"]},
            "brokers": {
                f"broker {t}": {"protocol": "mqtt", **hop["broker"]} for t, hop in hops.items() if "broker" in hop
            },
            "participants": {
                "p": of("a", publishes={"a": first["offered"]}),
                "in": of("a"),
                "out": of("b"),
                "s": of("b", subscribes={"b": {**second["requested"], **required}}),
            },
            "bridges": {
                "bridge": {
                    "routes": [
                        {
                            "from": {"participant": "in", "topic": "a", **first["requested"]},
                            "to": {"participant": "out", "topic": "b", **second["offered"]},
                        }
                    ]
                }
            },
        }
    ).encode()


@given(pairs() | over_brokers(), pairs() | over_brokers(), st.data())
def test_over_a_bridge_what_is_needed_and_what_explain_prints_agree(first: Pair, second: Pair, data: Any):
    assume(check(bridged(first, second, {}), importer="yaml").verdict == "compatible")
    way = explain(bridged(first, second, {}), publisher="p/publisher/a", subscriber="s/subscriber/b")
    for each in way.guarantees:
        word = WORDS[each.word]
        weakest = word.need.domain.format(INFINITE - 1 if word.kind == "at_most" else 1)
        cell = data.draw(st.sampled_from(each.cells))
        faults = {} if cell.fault == LINK else {"survives": [cell.fault]}
        needed = {"needs": {each.word: True if word.kind == "holds" else weakest, **faults}}
        verdict = check(bridged(first, second, needed), importer="yaml").verdict
        said = {"unknown": "unknown", "no": "incompatible", word.text(word.nothing): "incompatible"}  # type: ignore[arg-type]
        assert verdict == said.get(cell.value, "compatible"), (each.word, cell)
