"""Writes docs/conformance-spin.md: what SPIN says of each guarantee of MQTT, beside what C-QoS gives and Mosquitto kept.

python -m tests.conformance.spin_comparison             write it from what was recorded
python -m tests.conformance.spin_comparison record      first ask SPIN about all designs, and record its answers
python -m tests.conformance.spin_comparison more        first ask SPIN about the designs that are not recorded
"""

from __future__ import annotations

import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cqos_core.analysis.run_plan import named, prepare
from cqos_core.api import context, read
from cqos_core.packs.prover import Fault
from cqos_live.prove.outcomes import claims, disagreements, meets_need
from cqos_mqtt.evidence import PROOFS
from cqos_mqtt.promela.spin import Spin, version
from tests.conformance.guarantees import COLUMNS, LINK, ROOT, SHOWN, SLOW, column_of, table, titles
from tests.conformance.guarantees import RECORDED as RUNS_RECORDED
from tests.conformance.origin import build_of, origin
from tests.conformance.test_guarantees_mosquitto import BROKER_FAULTS, FAULTS, KEPT, RUNS, design

if TYPE_CHECKING:
    from collections.abc import Iterable

DOCUMENT: Final = ROOT / "docs" / "conformance-spin.md"
RECORDED: Final = Path(__file__).with_name("spin_comparison.json")
Design = dict[str, Any]
Case = tuple[str, Design, Fault | None]
TIMED: Final = ("offline", "max_age", "max_gap", "liveness")
WORDS: Final = (*SHOWN, *TIMED)
_AT_ONCE: Final = 2

INTRODUCTION: Final = """# Second opinion of SPIN on MQTT

Written by `python -m tests.conformance.spin_comparison`. {by} checks each guarantee of MQTT in all runs of a model. The model has one
publisher, one broker, one subscriber and one fault, and {messages} messages. It is built from the values of the pair, and not from
the rules of C-QoS. [Prove it](prove.md#ask-a-model-checker) describes how to ask SPIN about a pair of your own. [Conformance of
guarantees](conformance-guarantees.md) has the same designs on {mosquitto}.
"""
SUMMARY: Final = """A cell says for how many designs the guarantee holds in all runs of the model, of those for which C-QoS gives it. In brackets:
how many of the other designs have a run that breaks it. `-`: C-QoS gives it to no design. `not given`: C-QoS gives a need in time to no design
under this fault, so there is nothing to ask. `connected`: of these C-QoS takes a slow reader as connected."""
EVERY: Final = """Each cell has three answers: whether C-QoS gives the guarantee, whether {mosquitto} kept it, and whether it holds in all runs of the
model. The run of a pair that is recorded shows `latest` to `late_join`. Of `offline` to `liveness`, whose needs are times, tests of their own
(`tests/conformance`) show what C-QoS gives. `-`: C-QoS does not give it, so no such test has to show it. Empty: the design does not need it, or
the table above says why there is no answer."""
LIMITS: Final = """## Limits of the model

- A message of QoS 0 may be dropped on each of its two ways. The broker sends a retained message of QoS 0 into an empty buffer, so only a
  break loses it.
- Only one fault happens, at any time. A fault whose length is not stated lasts one second.
- Queues are as small as the few messages need: they overflow where the queue of the design overflows. Other topics of the client are not in the
  model.
- Latency has no bound. So `max_gap` compares the period and the messages that are missing, and `max_age` the time in the broker.
- A broker that stops comes back at once. Where Mosquitto departs from the standard, the model follows the standard.
- Where C-QoS gives less than the model holds, C-QoS lacks a fact or promises less on purpose: it needs `taken_every` where messages
  expire, it promises nothing about order after a broker has restarted, and it promises no freedom from duplicates over QoS 1."""


def _needing(needs: Design, publication: Design, subscription: Design, *more: Design, **stated: Any) -> Design:
    return design(publication, {**subscription, "needs": needs}, *more, **stated)


def _with_will() -> Design:
    client = {"keep_alive": 10, "will": {"topic": "gone", "qos": 1}}
    own = _needing({"liveness": "22s"}, {"qos": 1}, {"qos": 1}, client)
    own["participants"]["s"]["subscribes"]["gone"] = {"qos": 1}
    return own


_EXPIRES: Final = {"qos": 1, "retain": True, "message_expiry_interval": 60}
TIMED_DESIGNS: Final = {
    "an absence of 10 s": _needing({"offline": "10s"}, {"qos": 2}, {"qos": 2}, KEPT, KEPT),
    "an absence of 10 s, new sessions": _needing({"offline": "10s"}, {"qos": 2}, {"qos": 2}),
    "an age of 60 s": _needing({"max_age": "60s"}, _EXPIRES, {"qos": 1}, KEPT, KEPT),
    "an age of 59 s": _needing({"max_age": "59s"}, _EXPIRES, {"qos": 1}, KEPT, KEPT),
    "a gap of 20 ms, QoS 1": _needing({"max_gap": "20ms"}, {"qos": 1}, {"qos": 1}),
    "a gap of 20 ms, QoS 0": _needing({"max_gap": "20ms"}, {"qos": 0}, {"qos": 0}),
    "a Will": _with_will(),
}
_REPAIRED: Final = {"options": {"repair_time": "20ms"}}
STATED_DESIGNS: Final = {
    "an age of 61 s": _needing({"max_age": "61s"}, _EXPIRES, {"qos": 1}, KEPT, KEPT),
    "an age of 61 s, expiry_delay 2 s": _needing(
        {"max_age": "61s"}, _EXPIRES, {"qos": 1}, KEPT, KEPT, broker={"expiry_delay": "2s"}
    ),
    "an age of 62 s, expiry_delay 2 s": _needing(
        {"max_age": "62s"}, _EXPIRES, {"qos": 1}, KEPT, KEPT, broker={"expiry_delay": "2s"}
    ),
    "an age of 62 s, taken every 1 s": _needing(
        {"max_age": "62s"}, _EXPIRES, {"qos": 1, "taken_every": "1s"}, KEPT, KEPT
    ),
    "a gap of 40 ms, QoS 1, repair_time 20 ms": _needing({"max_gap": "40ms"}, {"qos": 1}, {"qos": 1}, **_REPAIRED),
    "a gap of 60 ms, QoS 1, repair_time and taken every 20 ms": _needing(
        {"max_gap": "60ms"}, {"qos": 1}, {"qos": 1, "taken_every": "20ms"}, **_REPAIRED
    ),
    "a gap of 39 ms, QoS 0, repair_time 19 ms": _needing(
        {"max_gap": "39ms"}, {"qos": 0}, {"qos": 0}, options={"repair_time": "19ms"}
    ),
}
"""Designs that state the facts on which an age or a gap rests, under the faults under which SPIN is asked about these."""
STATED_FAULTS: Final = (None, Fault("subscriber_restart", 0.4))


def cases() -> list[Case]:
    """Return all designs, each with its faults: those that run on Mosquitto, and those whose needs are times."""
    groups = ((TIMED_DESIGNS, (*FAULTS, *BROKER_FAULTS)), (STATED_DESIGNS, STATED_FAULTS))
    timed = [(name, own, fault) for designs, faults in groups for name, own in designs.items() for fault in faults]
    return [*((name, own, fault) for (name, own), fault in RUNS), *timed]


def missing(recorded: dict[str, Any]) -> list[Case]:
    """Return the cases that are not recorded."""
    known = {(each["design"], each["fault"]) for each in recorded["runs"]}
    return [case for case in cases() if (case[0], LINK if case[2] is None else str(case[2])) not in known]


def ask(case: Case, spin: Spin) -> dict[str, Any]:
    """Return what C-QoS gives a design under a fault, and what SPIN says of each guarantee."""
    name, own, fault = case
    where = context()
    system = named(read(json.dumps(own).encode(), importer="yaml"), where)
    trial = prepare(system, "p/publisher/t", "s/subscriber/t", where, "spin", fault)
    outcome = spin.prove(trial.plan)
    given = {
        word: value
        for word, value in claims(trial.report, fault).items()
        if meets_need(word, value, trial.plan.needs.get(word))
    }
    return {
        "design": name,
        "fault": LINK if fault is None else str(fault),
        "given": {word: given[word] for word in WORDS if word in given},
        "holds": dict(outcome.answers),
        "contradicted": disagreements(trial, outcome, where),
    }


def record(some: Iterable[Case], spin: Spin) -> dict[str, Any]:
    """Ask about designs, and return what is recorded."""
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        runs = list(pool.map(lambda case: ask(case, spin), some))
    return {
        "by": f"SPIN {version()}",
        **origin(),
        "messages": spin.messages,
        "runs": runs,
    }


def record_more(spin: Spin) -> dict[str, Any]:
    """Ask about the designs that are not recorded, and return what is recorded with them."""
    earlier = json.loads(RECORDED.read_text(encoding="utf-8"))
    new = record(missing(earlier), spin)
    assert new["by"] == earlier["by"], f"{new['by']} is another version: record all designs"
    return {
        **earlier,
        "more": [*earlier.get("more", ()), {**new, "runs": len(new["runs"])}],
        "runs": [*earlier["runs"], *new["runs"]],
    }


def document() -> str:
    """Return the page."""
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    runs: list[dict[str, Any]] = recorded["runs"]
    beside = json.loads(RUNS_RECORDED.read_text(encoding="utf-8"))["mosquitto"]
    seen = {(each["design"], each["fault"]): each for each in beside["runs"]}
    given = [(each, word) for each in runs for word in each["holds"] if word in each["given"]]
    kept = sum(each["holds"][word] for each, word in given)
    cells = {
        (word, column): _cell(word, column, runs) or _reason(word, column, runs) for word in WORDS for column in COLUMNS
    }
    rows = [[word, *(cells[word, column] for column in COLUMNS)] for word in WORDS]
    parts = [
        INTRODUCTION.format(by=recorded["by"], messages=recorded["messages"], mosquitto=beside["by"]),
        _when(recorded, kept, len(given)),
        "## Guarantees and faults",
        SUMMARY,
        table(["guarantee", *titles(COLUMNS)], rows),
        "## Every cell",
        EVERY.format(mosquitto=beside["by"]),
    ]
    for column in COLUMNS:
        here = [each for each in runs if column_of(each) == column]
        rows = [[each["design"], *(_answers(each, seen, word) for word in WORDS)] for each in here]
        parts += [f"### {titles([column])[0]}", table(["design", *WORDS], rows)]
    wrong = [[each["design"], each["fault"], text] for each in runs for text in each["contradicted"]]
    if wrong:
        parts += ["## Disagreements", table(["design", "fault", "what differs"], wrong)]
    return "\n\n".join(part.rstrip() for part in (*parts, LIMITS)) + "\n"


def _when(recorded: dict[str, Any], kept: int, given: int) -> str:
    where = f"{len(recorded['runs'])} models on {recorded['date']}, {build_of(recorded)}"
    for more in recorded.get("more", ()):
        where += f", {more['runs']} of them on {more['date']}, {build_of(more)}"
    return f"{where}. {kept} of {given} guarantees that C-QoS gives hold in all runs of the model."


def _cell(word: str, column: str, runs: Iterable[dict[str, Any]]) -> str:
    here = [each for each in runs if column_of(each) == column and word in each["holds"]]
    given = [each["holds"][word] for each in here if word in each["given"]]
    others = [each["holds"][word] for each in here if word not in each["given"]]
    parts = [
        f"{sum(given)} of {len(given)}" if given else "-",
        f"({others.count(False)} of {len(others)})" if others else "",
    ]
    return " ".join(part for part in parts if part) if here else ""


def _reason(word: str, column: str, runs: Iterable[dict[str, Any]]) -> str:
    """Say why SPIN has no answer for a need in time."""
    asked = any(word in each["given"] for each in runs if column_of(each) == column)
    assert column == SLOW or not asked, (word, column)
    return titles([LINK])[0] if column == SLOW else "not given"


def _seen(one: dict[str, Any], ran: dict[str, Any], word: str) -> str:
    """Return what Mosquitto did with a guarantee; of one whose need is a time, what tests of their own have seen where C-QoS gives it."""
    if word not in SHOWN:
        seen = {(each.guarantee, each.fault) for each in PROOFS}
        return "kept" if word in one["given"] and (word, column_of(one)) in seen else "-"
    kept = ran["kept"].get(word)
    broke = word in ran["harmed"] if kept is None else not kept
    return "broke" if broke else "kept"


def _answers(one: dict[str, Any], seen: dict[tuple[str, str], dict[str, Any]], word: str) -> str:
    """Return what C-QoS, Mosquitto and SPIN say of a guarantee."""
    if word not in one["holds"]:
        return ""
    ran = seen.get((one["design"], one["fault"]))
    mosquitto = "-" if ran is None else _seen(one, ran, word)
    return f"{'yes' if word in one['given'] else 'no'}, {mosquitto}, {'holds' if one['holds'][word] else 'breaks'}"


if __name__ == "__main__":
    wrong = 0
    if sys.argv[1:] in (["record"], ["more"]):
        found = record(cases(), Spin(shows=False)) if sys.argv[1] == "record" else record_more(Spin(shows=False))
        RECORDED.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n", encoding="utf-8")
        wrong = sum(len(each["contradicted"]) for each in found["runs"])
    DOCUMENT.write_text(document(), encoding="utf-8")
    sys.exit(1 if wrong else 0)
