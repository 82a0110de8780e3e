"""Laws of guarantees under faults, over random pairs of the packs that we ship."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from hypothesis import assume, given
from hypothesis import strategies as st

from cqos_core import INFINITE, check, check_pair, explain
from cqos_core.packs.guarantee import FAULTS, LINK, WORDS
from cqos_mqtt.pack import PACK as MQTT
from tests.test_guarantee import RANK, Pair, needs, pairs, some

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core import Guarantee, PairReport
    from cqos_core.packs.guarantee import GuaranteeWord


def value_of(word: GuaranteeWord, text: str) -> int | None:
    """Read a value as `explain` prints it."""
    said = {"yes": 1, "no": 0, "unknown": None, "none": word.nothing}
    value = said[text] if text in said else word.need.domain.parse(text)
    assert value is None or isinstance(value, int)
    return value


def columns(guarantees: Iterable[Guarantee]) -> dict[str, dict[str, int | None]]:
    """What guarantees give, by word and fault; without a fault under `LINK`."""
    return {
        each.word: {cell.fault: value_of(WORDS[each.word], cell.value) for cell in each.cells} for each in guarantees
    }


def given_by(pair: Pair, **options: str) -> dict[str, dict[str, int | None]]:
    """What a pair gives, by word and fault."""
    return columns(check_pair(**{**pair, "options": {**pair["options"], **options}}).guarantees)


def no_more(word: GuaranteeWord, value: int | None, than: int | None) -> bool:
    """Whether a value claims no more than another one; what is not known claims nothing."""
    if value is None or value == word.nothing:
        return True
    return than is not None and not word.stronger(value, than)


@given(pairs(), needs(), st.sampled_from(FAULTS))
def test_one_more_fault_never_makes_a_verdict_better(pair: Pair, stated: dict[str, Any], fault: str):
    listed = stated.get("survives", "[]").strip("[]")
    more = {**stated, "survives": f"[{', '.join(filter(None, (listed, fault)))}]"}
    assert RANK[check_pair(**pair, needs=stated).verdict] <= RANK[check_pair(**pair, needs=more).verdict]


@given(pairs())
def test_no_more_is_given_under_a_fault_than_without(pair: Pair):
    for name, cells in given_by(pair, outage="1s").items():
        assert all(no_more(WORDS[name], value, cells[LINK]) for value in cells.values())


@given(pairs())
def test_without_outage_nothing_is_claimed_over_a_link_outage(pair: Pair):
    assert all(cells["link_outage"] in {None, WORDS[name].nothing} for name, cells in given_by(pair).items())


@given(pairs(), st.sampled_from(["1ms", "1s"]), st.sampled_from(["1s", "10s", "1h"]))
def test_a_longer_outage_never_gives_more(pair: Pair, short: str, long: str):
    shorter = given_by(pair, outage=short)
    for name, cells in given_by(pair, outage=long).items():
        assert no_more(WORDS[name], cells["link_outage"], shorter[name]["link_outage"])


@given(pairs(), needs())
def test_what_is_needed_and_what_explain_prints_agree(pair: Pair, stated: dict[str, Any]):
    word = next((name for name in stated if name != "survives"), None)
    fault = next(iter(filter(None, stated.get("survives", "").strip("[]").split(", "))), None)
    if word is None or check_pair(**pair).verdict != "compatible":
        return
    required = {word: stated[word]} | ({"survives": f"[{fault}]"} if fault else {})
    verdict = check_pair(**pair, needs=required).verdict
    about = WORDS[word]
    asked = about.need.domain.parse(stated[word].replace("true", "1") if about.kind == "at_least" else stated[word])
    claimed = given_by(pair)[word][fault or LINK]
    if isinstance(asked, int) and asked != about.nothing and claimed is not None and claimed != about.nothing:
        enough = claimed == asked or about.stronger(claimed, asked)
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


def improves_no_hop(way: PairReport) -> None:
    """Hold that a path claims no more than its hops, under any fault."""
    one, other = (columns(hop.guarantees) for hop in way.hops)
    for name, cells in columns(way.guarantees).items():
        word = WORDS[name]
        for fault, value in cells.items():
            # An end that restarts is in one hop; what befalls no hop leaves it as it is.
            at_one = LINK if fault == "subscriber_restart" else fault
            at_other = LINK if fault == "publisher_restart" else fault
            assert no_more(word, value, other[name].get(at_other, other[name][LINK])), (name, fault)
            if word.over != "last hop":
                assert no_more(word, value, one[name].get(at_one, one[name][LINK])), (name, fault)


@given(pairs() | over_brokers(), pairs() | over_brokers(), st.data())
def test_a_path_is_no_better_than_its_hops_and_gives_what_explain_prints(first: Pair, second: Pair, data: Any):
    assume(check(bridged(first, second, {}), importer="yaml").verdict == "compatible")
    way = explain(bridged(first, second, {}), publisher="p/publisher/a", subscriber="s/subscriber/b")
    improves_no_hop(way)
    for each in way.guarantees:
        word = WORDS[each.word]
        weakest = word.need.domain.format(INFINITE - 1 if word.kind == "at_most" else 1)
        cell = data.draw(st.sampled_from(each.cells))
        faults = {} if cell.fault == LINK else {"survives": [cell.fault]}
        needed = {"needs": {each.word: True if word.kind == "holds" else weakest, **faults}}
        verdict = check(bridged(first, second, needed), importer="yaml").verdict
        said = {"unknown": "unknown", "no": "incompatible", word.text(word.nothing): "incompatible"}  # type: ignore[arg-type]
        assert verdict == said.get(cell.value, "compatible"), (each.word, cell)
