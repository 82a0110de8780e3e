"""Small random systems as texts, of each protocol, and what a repair of them may do, tried out without any solver."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from cqos_core import check, read
from cqos_core.api import context
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.finding import Severity, Verdict
from cqos_core.model.settings import Setting
from cqos_planning.constraints import Goals
from cqos_planning.model import build
from tests.made_up_protocol import POST

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.analysis.plan import RepairPlan
    from cqos_core.model.report import Report
    from cqos_core.model.system import System
    from cqos_planning.model import RepairModel

WHERE: Final = context([POST])
NAME: Final = "<bytes>"

SETTINGS: Final[Mapping[str, Mapping[str, tuple[str, ...]]]] = {
    "post": {
        "care": ("plain", "signed", "insured"),
        "delay": ("1ms", "1s", "2s"),
        "sealed": ("true", "false"),
    },
    "ros2": {
        "reliability": ("best_effort", "reliable"),
        "durability": ("volatile", "transient_local"),
        "deadline": ("500ms", "1s"),
        "liveliness": ("automatic", "manual_by_topic"),
    },
    "dds": {
        "reliability.kind": ("best_effort", "reliable"),
        "durability.kind": ("volatile", "transient_local", "transient"),
        "deadline.period": ("500ms", "1s"),
        "ownership.kind": ("shared", "exclusive"),
        "time_based_filter.minimum_separation": ("600ms", "2s"),
    },
    "mqtt": {
        "qos": ("0", "1", "2"),
        "retain": ("true", "false"),
        "message_expiry_interval": ("1s", "60s"),
    },
}
NEEDS: Final[Mapping[str, tuple[str, ...]]] = {
    "post": (),
    "ros2": ("latest: true", "late_join: 3", "max_gap: 1s"),
    "dds": ("latest: true", "late_join: 3", "duplicate_free: true"),
    "mqtt": ("latest: true", "late_join: 1", "duplicate_free: true"),
}


REACHABLE: Final[Mapping[str, tuple[str, ...]]] = {
    "ros2": ("late_join: 1", "late_join: 7", "latest: true", "loss_free: true", "ordered: true", "offline: 10s", "max_gap: 2s"),
    "dds": ("late_join: 1", "late_join: 7", "latest: true", "loss_free: true", "ordered: true", "max_gap: 2s"),
    "mqtt": ("late_join: 1", "latest: true", "loss_free: true", "duplicate_free: true", "ordered: true", "max_gap: 2s"),
}  # fmt: skip
"""Requirements that some settings of a protocol meet."""


FACTS: Final[Mapping[str, str]] = {
    "ros2": "options: {ros2: {repair_time: 500ms, rediscovery_time: 1s}}",
    "dds": "options: {dds: {repair_time: 500ms}}",
    "mqtt": "options: {mqtt: {repair_time: 500ms}}\nbrokers: {main: {max_queued_messages: 100}}",
}
"""What guarantees rest on, besides the period of a topic and how often programs take samples."""


GAP_FACTS: Final[Mapping[str, tuple[str, ...]]] = {
    "ros2": ("options: {ros2: {repair_time: 100ms}}", "topics: {t: {period: 500ms}}"),
}
"""What a stated `max_gap` rests on: a repair meets a requirement only where it is known to hold."""


def open_text(protocol: str, size: int, seed: int, per_topic: int = 5) -> bytes:
    """Return a random system whose endpoints state no settings, and whose subscribers have requirements."""
    chance = random.Random(f"open {protocol} {size} {seed}")  # noqa: S311 - the same systems every time
    topics = range(-(-size // per_topic))
    lines = [
        "cqos: 1",
        f"protocol: {protocol}",
        FACTS[protocol],
        "topics:",
        *(f"  t{each}: {{period: 1s}}" for each in topics),
        "participants:",
    ]
    for number in range(size):
        topic, place = divmod(number, per_topic)
        kind, stated = ("publishes", "") if place == 0 else ("subscribes", "{taken_every: 500ms}")
        if place:
            words = dict(each.split(": ") for each in chance.sample(REACHABLE[protocol], chance.randrange(3)))
            if words:
                needs = ", ".join(f"{word}: {value}" for word, value in words.items())
                stated = f"{{taken_every: 500ms, needs: {{{needs}}}}}"
        lines += [f"  n{number}:", f"    {kind}:", f"      t{topic}: {stated}".rstrip()]
    return ("\n".join(lines) + "\n").encode()


def system_text(protocol: str, seed: int, publishers: int = 2, subscribers: int = 2) -> bytes:
    """Return a random system of one topic."""
    chance = random.Random(f"{protocol} {seed}")  # noqa: S311 - the same systems every time
    lines = ["cqos: 1", f"protocol: {protocol}", *GAP_FACTS.get(protocol, ()), "participants:"]
    for kind, number in (("publishes", publishers), ("subscribes", subscribers)):
        for each in range(number):
            stated = dict(chance.choice([*_settings(protocol, kind)]) for _ in range(chance.randrange(1, 4)))
            parts = [f"{name}: {value}" for name, value in stated.items()]
            if kind == "subscribes" and NEEDS[protocol] and chance.random() < (0.9 if protocol == "mqtt" else 0.4):
                parts.append(f"needs: {{{chance.choice(NEEDS[protocol])}}}")
            lines += [f"  {kind}_{each}:", f"    {kind}:", f"      t: {{{', '.join(parts)}}}  # the {each}th"]
    return ("\n".join(lines) + "\n").encode()


def _settings(protocol: str, kind: str) -> Iterator[tuple[str, str]]:
    role = "publisher" if kind == "publishes" else "subscriber"
    pack = WHERE.find_pack(protocol)
    for name, values in SETTINGS[protocol].items():
        if role in pack.policy(name).roles:
            yield from ((name, value) for value in values)


def again(texts: Mapping[str, bytes]) -> System:
    return read(texts[NAME])


def is_repaired(before: Report, after: Report) -> bool:
    """Whether a report has no incompatible pair, no pair that is worse than before, and no new error."""
    ranks = {(each.publisher, each.subscriber): each.verdict.rank for each in before.pairs}
    fine = all(
        each.verdict.rank < 2 and each.verdict.rank <= ranks[each.publisher, each.subscriber] for each in after.pairs
    )
    return fine and errors(after) <= errors(before)


def repaired_pairs(before: Report, after: Report) -> set[tuple[str, str]] | None:
    """Return the pairs that are incompatible no more, and the errors of endpoints alone that are gone.

    None where any pair is worse, or an error is new that is not about a pair that was and is incompatible.
    """
    ranks = {(each.publisher, each.subscriber): each.verdict.rank for each in before.pairs}
    now = {(each.publisher, each.subscriber): each.verdict.rank for each in after.pairs}
    worst = Verdict.INCOMPATIBLE.rank
    stay = {pair for pair, rank in now.items() if rank == worst == ranks[pair]}
    fine = {(code, member) for code, member in errors(after) if any(member in pair for pair in stay)}
    if errors(after) - errors(before) - fine or any(rank > ranks[pair] for pair, rank in now.items()):
        return None
    alone = {
        (each.code, member)
        for each in before.findings
        if each.severity is Severity.ERROR and len(each.sides) == 1
        for member in each.sides[0].members
    }
    return {pair for pair, rank in now.items() if rank < ranks[pair] == worst} | (alone - errors(after))


def errors(report: Report) -> set[tuple[str, str]]:
    return {
        (each.code, member)
        for each in report.findings
        if each.severity is Severity.ERROR
        for side in each.sides
        for member in side.members
    }


def model_of(text: bytes, keep: Sequence[str] = ()) -> RepairModel:
    """Return the model of a repair of a whole system."""
    topics = Pipeline(again({NAME: text}), WHERE).topics
    return build(topics, [*topics], Goals(), keep)


def cheaper(model: RepairModel, limit: int) -> Iterator[dict[Any, int]]:
    """Yield every choice of less weight, by place."""
    places = [*model.slots]

    def further(at: int, weight: int, chosen: dict[Any, int]) -> Iterator[dict[Any, int]]:
        if at == len(places):
            if weight < limit:
                yield chosen
            return
        for number, candidate in enumerate(model.slots[places[at]].candidates):
            if number and model.slots[places[at]].pin:
                break
            if weight + candidate.weight < limit:
                yield from further(
                    at + 1, weight + candidate.weight, {**chosen, places[at]: number} if number else chosen
                )

    yield from further(0, 0, {})


def changed(system: System, model: RepairModel, chosen: Mapping[Any, int]) -> System:
    """Return a system with choices as settings, without any file."""
    system = replace(system, endpoints=[*system.endpoints], participants=dict(system.participants))
    for place, number in chosen.items():
        slot = model.slots[place]
        setting = Setting(slot.policy.domain.format(slot.candidates[number].value))  # type: ignore[arg-type]
        ids = {each.id for each in slot.endpoints}
        if slot.policy.level == "participant":
            for each in slot.endpoints:
                owner = system.participants[each.endpoint.participant]
                system.participants[owner.id] = replace(owner, settings={**owner.settings, slot.policy.name: setting})
            continue
        assert slot.policy.level == "endpoint"
        system.endpoints[:] = [
            replace(each, settings={**each.settings, slot.policy.name: setting}) if each.id in ids else each
            for each in system.endpoints
        ]
    return system


def report_of(system: System) -> Report:
    return check(system, packs=[POST])


def is_confirmed(plan: RepairPlan, text: bytes) -> bool:
    """Whether the texts of a plan are what it says."""
    after = report_of(again({NAME: plan.edited.texts.get(NAME, text)}))
    return is_repaired(report_of(again({NAME: text})), after)
