"""The same pairs, judged by the DDS pack and by Cyclone DDS, and what the two say side by side."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Final

from cqos_core.api import context
from cqos_core.judge import judge_endpoint, judge_pair
from cqos_core.pairing import apart
from cqos_core.resolve import resolve
from cqos_core.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, Setting, System
from cqos_dds.pack import PACK

if TYPE_CHECKING:
    from cqos_core.resolve import QosProfile
    from tests.conformance.cyclone import Answer, Cyclone

Settings = Mapping[str, str]
Pair = tuple[Settings, Settings]

NAMED_BY: Final = {
    "DDS101": "reliability",
    "DDS102": "durability",
    "DDS109": "presentation",
    "DDS110": "presentation",
    "DDS111": "presentation",
    "DDS103": "deadline",
    "DDS106": "latency_budget",
    "DDS107": "ownership",
    "DDS104": "liveliness",
    "DDS105": "liveliness",
    "DDS108": "destination_order",
    "DDS112": "data_representation",
}
"""The policy that Cyclone DDS names where a rule of ours speaks, in its order of comparing."""

DURATIONS: Final = ("0s", "1ns", "999999999ns", "1s", "1000000001ns", "1h", "infinite")
LENGTHS: Final = ("0", "1", "5", "6", "unlimited")
CHOICES: Final[dict[str, tuple[str, ...]]] = {
    "reliability": ("best_effort", "reliable"),
    "durability": ("volatile", "transient_local", "transient", "persistent"),
    "deadline": DURATIONS,
    "latency_budget": DURATIONS,
    "liveliness": ("automatic", "manual_by_participant", "manual_by_topic"),
    "liveliness.lease_duration": DURATIONS,
    "ownership": ("shared", "exclusive"),
    "destination_order": ("by_reception_timestamp", "by_source_timestamp"),
    "presentation.access_scope": ("instance", "topic", "group"),
    "presentation.coherent_access": ("false", "true"),
    "presentation.ordered_access": ("false", "true"),
    "data_representation": ("[]", "[xcdr1]", "[xcdr2]", "[xcdr1, xcdr2]", "[xcdr2, xcdr1]", "[xml]", "[xcdr1, xml]"),
    "partition": (
        "[]",
        '[""]',
        "[a]",
        "[A]",
        "[b]",
        "[a, b]",
        '[c, ""]',
        "[abc]",
        '["*"]',
        '["**"]',
        '["?"]',
        '["a*"]',
        '["a?c"]',
        '["b*", a]',
        '["[ab]"]',
        '["[!a]"]',
        '["[a-z]bc"]',
        '["a["]',
        "[a/b.c]",
        '["a/*"]',
        '["a+"]',
        '["a\\\\*"]',
    ),
    "history": ("keep_last", "keep_all"),
    "history.depth": LENGTHS,
    "resource_limits.max_samples": LENGTHS,
    "resource_limits.max_instances": LENGTHS,
    "resource_limits.max_samples_per_instance": LENGTHS,
    "time_based_filter": DURATIONS[:-1],
    "durability_service.history_kind": ("keep_last", "keep_all"),
    "durability_service.history_depth": LENGTHS,
    "durability_service.max_samples": LENGTHS,
    "durability_service.max_instances": LENGTHS,
    "durability_service.max_samples_per_instance": LENGTHS,
    "lifespan": DURATIONS,
    "ownership_strength": ("-1", "0", "1"),
}
"""The values tried of each policy."""

TOGETHER: Final = {
    "reliability": ("reliability",),
    "durability": ("durability",),
    "presentation": (
        "presentation.access_scope",
        "presentation.coherent_access",
        "presentation.ordered_access",
    ),
    "deadline": ("deadline",),
    "latency budget": ("latency_budget",),
    "ownership": ("ownership",),
    "liveliness": ("liveliness", "liveliness.lease_duration"),
    "destination order": ("destination_order",),
    "data representation": ("data_representation",),
    "partition": ("partition",),
}
"""Policies whose values are tried in all combinations, both sides."""

ALONE: Final = {
    "history and resource limits": (
        "history",
        "history.depth",
        "resource_limits.max_samples",
        "resource_limits.max_instances",
        "resource_limits.max_samples_per_instance",
    ),
    "durability service": (
        "durability_service.history_kind",
        "durability_service.history_depth",
        "durability_service.max_samples",
        "durability_service.max_instances",
        "durability_service.max_samples_per_instance",
    ),
    "deadline and time based filter": ("deadline", "time_based_filter"),
}
"""Policies whose values decide whether one endpoint can be created, tried in all combinations."""


def grid(names: Sequence[str]) -> Iterator[Settings]:
    """Every combination of values."""
    for values in product(*(CHOICES[name] for name in names)):
        yield dict(zip(names, values, strict=True))


def pairs_of(names: Sequence[str]) -> Iterator[Pair]:
    """Every combination of values on both sides, and with either side unstated."""
    settings: list[Settings] = [{}, *grid(names)]
    yield from product(settings, settings)


def single(names: Sequence[str]) -> Iterator[Pair]:
    """Every combination of values on one side, with a plain partner."""
    writer = all("publisher" in PACK.policy(name).roles for name in names)
    for settings in grid(names):
        yield (settings, {}) if writer else ({}, settings)


def random_pairs(number: int, seed: int) -> Iterator[Pair]:
    """Pairs of random values of some policies; a reader often takes over what its writer has, so that many match."""
    dice = random.Random(seed)  # noqa: S311 - dice
    for _ in range(number):
        some = dice.choice((0.1, 0.3, 0.6))
        offered = _some("publisher", some, dice)
        requested = _some("subscriber", some, dice)
        common = {name: text for name, text in offered.items() if name in CHOICES and dice.random() < 0.5}
        allowed = {name: text for name, text in common.items() if "subscriber" in PACK.policy(name).roles}
        yield offered, {**requested, **allowed}


def _some(role: str, some: float, dice: random.Random) -> Settings:
    found = {}
    for name, values in CHOICES.items():
        seldom = name.startswith(("resource_limits", "durability_service", "history", "data_representation"))
        if role in PACK.policy(name).roles and dice.random() < (some / 6 if seldom else some):
            found[name] = dice.choice(values)
    return found


@dataclass(frozen=True)
class Judgement:
    """What the pack says of a pair, in the terms of `Answer`."""

    created: tuple[bool, bool]
    matched: bool | None = None
    named: str | None = None
    unknown: bool = False


def judge(pairs: Iterable[Pair], **options: str) -> list[Judgement]:
    """Judge all pairs, each on a topic of its own."""
    system = System(protocol="dds", participants={"p": Participant("p"), "q": Participant("q")})
    system.options["dds"] = {name: Setting(text) for name, text in options.items()}
    for number, (offered, requested) in enumerate(pairs):
        for role, owner, settings in ((PUBLISHER, "p", offered), (SUBSCRIBER, "q", requested)):
            stated = {name: Setting(text) for name, text in settings.items()}
            system.endpoints.append(Endpoint(f"{role}{number}", role, f"t{number}", owner, stated))
    resolved = resolve(system, context([PACK]).find_pack)
    assert resolved.findings == []
    endpoints = iter(resolved.endpoints)
    return [
        _judgement(publisher.profile, subscriber.profile)
        for publisher, subscriber in zip(*[endpoints] * 2, strict=True)
    ]


def _judgement(publisher: QosProfile, subscriber: QosProfile) -> Judgement:
    created = _can_be_created(publisher, PUBLISHER), _can_be_created(subscriber, SUBSCRIBER)
    if not all(created):
        return Judgement(created)
    if apart(publisher, subscriber):
        return Judgement(created, matched=False)
    judged = judge_pair(publisher, subscriber)
    codes = {spoken.bound.rule.code for spoken in judged.spoken}
    broken = [name for code, name in NAMED_BY.items() if code in codes]
    matched = judged.verdict == "compatible"
    return Judgement(
        created, matched, None if matched else next(iter(broken), None), unknown=judged.verdict == "unknown"
    )


def _can_be_created(profile: QosProfile, role: str) -> bool:
    rules = (spoken.bound.rule for spoken in judge_endpoint(profile, role, observed=False))
    return not any(rule.creation and rule.severity == "error" for rule in rules)


def disagreement(pair: Pair, ours: Judgement, theirs: Answer) -> str | None:
    """Say how the two differ, None where they do not."""
    if ours.unknown:
        return f"{pair}: the pack does not know, Cyclone DDS says {theirs}"
    if (ours.created, ours.matched, ours.named) == (theirs.created, theirs.matched, theirs.named):
        return None
    return f"{pair}: the pack says {ours}, Cyclone DDS says {theirs}"


@dataclass(frozen=True)
class Section:
    """Pairs, what the pack says of them with ``cyclonedds`` and with ``standard``, and what Cyclone DDS does."""

    pairs: Sequence[Pair]
    ours: Sequence[Judgement]
    standard: Sequence[Judgement]
    seen: Sequence[Answer]

    @property
    def disagreements(self) -> list[str]:
        """Where the pack and Cyclone DDS differ, in words."""
        found = (disagreement(*each) for each in zip(self.pairs, self.ours, self.seen, strict=True))
        return [text for text in found if text is not None]


def section(cyclone: Cyclone, pairs: Iterable[Pair], extensibility: str = "final") -> Section:
    """Ask everybody for every pair."""
    listed = list(pairs)
    return Section(
        listed,
        judge(listed, implementation="cyclonedds", extensibility=extensibility),
        judge(listed, implementation="standard"),
        [cyclone.ask(offered, requested) for offered, requested in listed],
    )
