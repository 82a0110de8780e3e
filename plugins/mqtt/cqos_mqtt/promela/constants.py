"""The values of one pair as the constants of the Promela model; times are whole milliseconds."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from math import ceil
from typing import TYPE_CHECKING, Final

from cqos_core.packs import INFINITE, OUTAGE
from cqos_mqtt import broker_policies as of_broker
from cqos_mqtt import connection_policies as of_connection
from cqos_mqtt import endpoint_policies as of
from cqos_mqtt import policies as of_deployment
from cqos_mqtt.names import hears
from cqos_mqtt.runnable_pairs import known

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.packs import Plain, Policy
    from cqos_core.packs.prover import End, Plan

MESSAGES: Final = 2
"""How many messages the model sends."""
ENDLESS: Final = 1 << 30
"""Milliseconds that no fault lasts."""
_SHORT: Final = 1000
"""Milliseconds that a fault lasts where nothing says how long."""
_NANOSECONDS: Final = 1_000_000
_PLENTY: Final = 9
FAULTS: Final = (
    *("connected", "slow_reader", "link_outage", "subscriber_restart", "publisher_restart"),
    *("broker_stop", "broker_crash", "publisher_lost"),
)
"""Values of FAULT in the model, by their number."""
_HANDLING: Final = ("SEND", "SEND_IF_NEW", "DO_NOT_SEND")
_SAVES: Final = ("NEVER", "NOW_AND_THEN", "AT_ONCE")
_AWAY: Final = ("connected", "subscriber_restart", "broker_stop", "broker_crash")


@dataclass(frozen=True, slots=True)
class Scene:
    """What happens in all runs of one verification.

    Attributes:
        fault: one of `FAULTS`.
        absent: the subscriber leaves before the fault, and comes back after it.
        ages: messages wait in the broker for longer than the subscriber allows.
    """

    fault: str
    absent: bool = False
    ages: bool = False

    def defines(self) -> list[str]:
        """Return the arguments of SPIN that choose this scene."""
        return [f"-DFAULT={self.fault.upper()}", f"-DABSENT={self.absent:d}", f"-DAGES={self.ages:d}"]


def scenes(fault: str, needs: Mapping[str, int]) -> dict[Scene, tuple[str, ...]]:
    """Return the words that are checked under a fault, by the scene in which each is."""
    always = ("latest", "loss_free", "duplicate_free", "ordered", "late_join")
    found: dict[Scene, tuple[str, ...]] = {
        Scene(fault): (*always, "max_gap") if fault == "connected" and "max_gap" in needs else always
    }
    if "offline" in needs and fault in _AWAY:
        found[Scene(fault, absent=True)] = ("offline",)
    if "max_age" in needs and fault in _AWAY[:2]:
        found[Scene(fault, ages=True)] = ("max_age",)
    if "liveness" in needs and fault in {"connected", "publisher_restart"}:
        found[Scene("publisher_lost")] = ("liveness",)
    return found


def model(plan: Plan) -> str:
    """Return the model of a pair; a fact that is not known has the value that promises least."""
    return "\n".join((words(), of_pair(plan), body()))


def of_pair(plan: Plan) -> str:
    """Return the constants of a pair, those that depend on the fault among them."""
    return "\n".join((_values(plan), *_times(plan)))


def body() -> str:
    """Return the part of the model that is the same for all pairs."""
    return files("cqos_mqtt.promela").joinpath("model.pml").read_text(encoding="utf-8")


def needs_of(plan: Plan) -> dict[str, int]:
    """Return the needs of the subscriber that are durations, in milliseconds."""
    return {word: _milliseconds(value) for word, value in plan.needs.items()}


def words() -> str:
    """Return the words of the constants, and the scene where the caller chooses none."""
    defined = [
        f"#define {word.upper()} {number}" for group in (FAULTS, _HANDLING, _SAVES) for number, word in enumerate(group)
    ]
    chosen = [
        f"#ifndef {name}\n#define {name} {value}\n#endif"
        for name, value in (("FAULT", "CONNECTED"), ("ABSENT", 0), ("AGES", 0))
    ]
    return "\n".join((*defined, f"#define ENDLESS {ENDLESS}", *chosen))


def _values(plan: Plan) -> str:
    broker, needs = plan.broker, needs_of(plan)
    published, requested = plan.publisher.values, plan.subscriber.values
    level = _rank(of.QOS, published)
    granted = min(_rank(of.QOS, requested), _rank(of_broker.MAXIMUM_QOS, broker), _rank(of_broker.GRANTED_QOS, broker))
    five = _is_five(plan.publisher)
    sends = known(of_connection.SENDS_AT_ONCE, plan.publisher.participant)
    stated: dict[str, object] = {
        "PUBLISHED_QOS": level,
        "DELIVERED_QOS": granted if _rank(of_broker.UPGRADES, broker) else min(level, granted),
        "RETAIN": _rank(of.RETAIN, published) & _rank(of_broker.RETAIN_AVAILABLE, broker),
        "RETAIN_HANDLING": _HANDLING[_rank(of.RETAIN_HANDLING, requested)],
        "SHARED": _rank(of.SHARED, requested),
        "OVERLAPPING": _rank(of.OVERLAPPING, requested),
        "EXPIRES_AFTER": _milliseconds(known(of.EXPIRY, published)) if five else ENDLESS,
        "PERIOD": _period(plan),
        **_session("PUBLISHER", plan.publisher, broker),
        "PUBLISHER_IN_3_1_1": int(not five),
        "SENDS_AT_ONCE": min(
            MESSAGES,
            sends if isinstance(sends, int) else MESSAGES,
            _rank(of_broker.BROKER_RECEIVE_MAXIMUM, broker) if five else MESSAGES,
        ),
        **_session("SUBSCRIBER", plan.subscriber, broker),
        "QUEUES_QOS0": _rank(of_broker.QUEUES_QOS0, broker),
        "BROKER_SAVES": _SAVES[_saves(broker)],
        **_will(plan),
        **{name: needs.get(name.lower(), ENDLESS) for name in ("MAX_AGE", "MAX_GAP", "LIVENESS")},
    }
    return "\n".join(f"#define {name} {value}" for name, value in stated.items())


def _times(plan: Plan) -> list[str]:
    """Return how long each fault lasts, and what the broker has room for meanwhile."""
    needs, fault = needs_of(plan), plan.fault
    outage = known(OUTAGE, plan.subscriber.participant)
    own = {"link_outage": _milliseconds(outage)} if isinstance(outage, int) else {}
    own |= {fault.kind: round(fault.seconds * 1000)} if fault is not None else {}
    lasting = [(f"FAULT == {name.upper()}", own.get(name, _SHORT), name == "slow_reader") for name in FAULTS]
    chosen = [
        (
            "AGES",
            max(0, needs.get("max_age", ENDLESS - 1) + 1 - _milliseconds(known(of_broker.EXPIRY_DELAY, plan.broker))),
            False,
        ),
        ("ABSENT", needs.get("offline", _SHORT), False),
        *lasting,
    ]
    lines = []
    for word, (condition, lasts, is_slow) in zip(("if", *["elif"] * len(chosen)), chosen, strict=False):
        room, window = _room(plan, lasts, is_slow=is_slow)
        lines += [f"#{word} {condition}", f"#define LASTS {lasts}", f"#define ROOM {room}", f"#define WINDOW {window}"]
    return [*lines, "#endif"]


def _room(plan: Plan, lasts: int, *, is_slow: bool) -> tuple[int, int]:
    """Return the room for waiting messages and the window, made smaller so that the few messages overflow it like the many."""
    values = plan.broker
    window = _rank(of_connection.RECEIVE_MAXIMUM, plan.subscriber.participant) if _is_five(plan.subscriber) else _PLENTY
    window = min(window, _limit(of_broker.INFLIGHT, values, _PLENTY))
    size = known(of.PAYLOAD, plan.publisher.values)
    room = _limit(of_broker.QUEUED, values, 0)
    if is_slow and known(of_broker.GROWS, values):
        room += window
    if (total := _limit(of_broker.QUEUED_BYTES, values, 0)) < INFINITE:
        room = min(room, total // max(size, 1) if isinstance(size, int) else 0)
    arrive = ceil(min(lasts, ENDLESS) / _period(plan)) + (not is_slow)
    if arrive <= room + window * is_slow:
        return _PLENTY, min(window, MESSAGES)
    window = min(window, 1) if is_slow else min(window, MESSAGES)
    return min(room, MESSAGES - 1 - is_slow), window


def _session(name: str, end: End, broker: Mapping[str, str]) -> dict[str, object]:
    """Return how the session of a client goes on."""
    values, clean = end.participant, _rank(of_connection.CLEAN, end.participant)
    kept = _milliseconds(known(of_connection.SESSION_EXPIRY, values)) if _is_five(end) else (0 if clean else ENDLESS)
    return {
        f"{name}_CLEAN": clean,
        f"{name}_SESSION_LASTS": min(kept, _milliseconds(known(of_broker.BROKER_SESSION_EXPIRY, broker))),
        f"{name}_STORES": int(bool(known(of_connection.STORES_SESSION, values))),
        f"{name}_NEW_ID": _rank(of_connection.GENERATED_ID, values),
    }


def _will(plan: Plan) -> dict[str, object]:
    """Return whether and when the subscriber gets the Will of the publisher."""
    values, broker, five = plan.publisher.participant, plan.broker, _is_five(plan.publisher)
    topic, heard = known(of_connection.WILL_TOPIC, values), known(of_connection.SUBSCRIBED, plan.subscriber.participant)
    pings = _milliseconds(known(of_connection.KEEP_ALIVE, values))
    delay = 0
    if five:
        allowed_pings = _milliseconds(known(of_broker.SERVER_KEEP_ALIVE, broker))
        pings = min(pings, allowed_pings) if allowed_pings else ENDLESS  # 0 turns them off
        delay = min(
            _milliseconds(known(each, values)) for each in (of_connection.WILL_DELAY, of_connection.SESSION_EXPIRY)
        )
        delay += 2 * _milliseconds(known(of_broker.EXPIRY_DELAY, broker)) * (delay > 0)
    allowed = bool(known(of_connection.WILL_ALLOWED, values))
    has = allowed and isinstance(topic, str) and isinstance(heard, tuple) and bool(topic) and hears(topic, heard)
    later = _milliseconds(known(of_broker.NOTICES_LATER, broker))
    return {
        "HAS_WILL": int(has),
        "KEEPS_ALIVE": int(pings < ENDLESS),
        "WILL_COMES_AFTER": min(ENDLESS, pings * 3 // 2 + later + delay),
    }


def _saves(broker: Mapping[str, str]) -> int:
    if known(of_broker.AUTOSAVE, broker) == 0:
        return 2
    return int(bool(known(of_broker.PERSISTENCE, broker)))


def _is_five(end: End) -> bool:
    return end.participant.get(of_deployment.VERSION.name, "5.0") == "5.0"


def _period(plan: Plan) -> int:
    return max(1, round(plan.period * 1000))


def _milliseconds(nanoseconds: Plain | None) -> int:
    """Return whole milliseconds, those begun included; what is not known is none."""
    if not isinstance(nanoseconds, int):
        return 0
    return min(-(-nanoseconds // _NANOSECONDS), ENDLESS)


def _rank(policy: Policy, values: Mapping[str, str]) -> int:
    """Return a number, a rank, or a flag; what is not known is the least."""
    return int(value) if isinstance(value := known(policy, values), int) else 0


def _limit(policy: Policy, values: Mapping[str, str], otherwise: int) -> int:
    value = known(policy, values)
    return value if isinstance(value, int) else otherwise
