"""The same pairs, judged by a pack and by Cyclone DDS, and what the two say side by side; for the packs of DDS and ROS 2."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Final

from cqos_core.api import context
from cqos_core.matching.judge import failed_match_conditions, judge_endpoint, judge_pair
from cqos_core.model.settings import Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, System
from cqos_core.resolving.resolver import resolve
from cqos_dds.pack import PACK as DDS_PACK
from cqos_ros2.pack import PACK as ROS2_PACK

if TYPE_CHECKING:
    from cqos_core.packs.pack import RulePack
    from cqos_core.resolving.qos_profile import QosProfile
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
        '["[[:alpha:]]"]',
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
    "transport_priority": ("-1", "0", "1"),
    "writer_data_lifecycle": ("false", "true"),
    "reader_data_lifecycle.autopurge_nowriter_samples_delay": DURATIONS,
    "reader_data_lifecycle.autopurge_disposed_samples_delay": DURATIONS,
    "durability_service.service_cleanup_delay": DURATIONS,
    "type_consistency": ("disallow_type_coercion", "allow_type_coercion"),
    "type_consistency.ignore_sequence_bounds": ("false", "true"),
    "type_consistency.ignore_string_bounds": ("false", "true"),
    "type_consistency.ignore_member_names": ("false", "true"),
    "type_consistency.prevent_type_widening": ("false", "true"),
    "type_consistency.force_type_validation": ("false", "true"),
    "user_data": ("", "of a program"),
    "group_data": ("", "of a group"),
}
"""The values tried of each policy."""

TOGETHER: Final[dict[str, tuple[str, ...]]] = {
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

NEVER_COMPARED: Final = (
    "lifespan",
    "ownership_strength",
    "time_based_filter",
    "transport_priority",
    "writer_data_lifecycle",
    "reader_data_lifecycle.autopurge_nowriter_samples_delay",
    "reader_data_lifecycle.autopurge_disposed_samples_delay",
    "durability_service.service_cleanup_delay",
    "user_data",
    "group_data",
)
"""Policies that stop no match, tried one at a time."""

ALONE: Final[dict[str, tuple[str, ...]]] = {
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
    "type consistency": tuple(name for name in CHOICES if name.startswith("type_consistency")),
}
"""Policies whose values decide whether one endpoint can be created, tried in all combinations."""


@dataclass(frozen=True)
class Subject:
    """A pack, and what of it is compared.

    Attributes:
        choices: the values tried of each policy.
        together: policies whose values are tried in all combinations, on both sides.
        alone: the same on one side, with a plain partner.
        named_by: the policy that Cyclone DDS names where a rule speaks, in its order of comparing.
        options: with which the pack says what Cyclone DDS does.
        standard: with which it says what others do; None where there is no such thing.
        on_wire: from settings of the pack to those of the DDS pack with which the endpoint is created.
    """

    pack: RulePack
    choices: Mapping[str, Sequence[str]]
    together: Mapping[str, Sequence[str]]
    alone: Mapping[str, Sequence[str]]
    named_by: Mapping[str, str]
    options: Mapping[str, str]
    standard: Mapping[str, str] | None
    on_wire: Callable[[Settings], Settings]


def as_rmw_cyclonedds(settings: Settings) -> Settings:
    """What a node asks of Cyclone DDS for these settings of ROS 2 (rmw_cyclonedds, create_readwrite_qos).

    Written down from the reading of rmw_cyclonedds, not from our own pack, which is compared with it.
    """
    history = "keep_all" if settings.get("history") == "keep_all" else "keep_last"
    depth = settings.get("depth", "10")
    if depth == "0":
        depth = "1"
    stated = {
        "reliability": "best_effort" if settings.get("reliability") == "best_effort" else "reliable",
        "durability": "transient_local" if settings.get("durability") == "transient_local" else "volatile",
        "history": history,
        "history.depth": depth,
        "data_representation": "[xcdr1]",
    }
    if stated["durability"] == "transient_local":
        stated |= {"durability_service.history_kind": history, "durability_service.history_depth": depth}
    for name, on_wire in (
        ("deadline", "deadline"),
        ("lifespan", "lifespan"),
        ("liveliness_lease_duration", "liveliness.lease_duration"),
    ):
        if settings.get(name, "0s") != "0s":  # which is unspecified
            stated[on_wire] = settings[name]
    liveliness = settings.get("liveliness", "system_default")
    kinds = {"manual_by_node": "manual_by_participant", "system_default": "automatic"}
    stated["liveliness"] = kinds.get(liveliness, liveliness)
    return stated


ROS2_CHOICES: Final[dict[str, tuple[str, ...]]] = {
    "reliability": ("best_effort", "reliable", "system_default"),
    "durability": ("volatile", "transient_local", "system_default"),
    "deadline": DURATIONS,
    "liveliness": ("automatic", "manual_by_node", "manual_by_topic", "system_default"),
    "liveliness_lease_duration": DURATIONS,
    "lifespan": DURATIONS,
    "history": ("keep_last", "keep_all", "system_default"),
    "depth": ("0", "1", "5", "1000"),
}
DDS: Final = Subject(
    DDS_PACK,
    CHOICES,
    TOGETHER,
    ALONE,
    NAMED_BY,
    {"implementation": "cyclonedds", "extensibility": "final"},
    {"implementation": "standard"},
    dict,
)
ROS2: Final = Subject(
    ROS2_PACK,
    ROS2_CHOICES,
    {
        "reliability": ("reliability",),
        "durability": ("durability",),
        "deadline": ("deadline",),
        "liveliness": ("liveliness", "liveliness_lease_duration"),
        "lifespan": ("lifespan",),
        "history": ("history", "depth"),
    },
    {},
    {
        "ROS101": "reliability",
        "ROS102": "durability",
        "ROS103": "deadline",
        "ROS104": "liveliness",
        "ROS105": "liveliness",
    },
    {"rmw": "cyclonedds"},
    None,
    as_rmw_cyclonedds,
)


def grid(names: Sequence[str], subject: Subject = DDS) -> Iterator[Settings]:
    """Every combination of values."""
    for values in product(*(subject.choices[name] for name in names)):
        yield dict(zip(names, values, strict=True))


def pairs_of(names: Sequence[str], subject: Subject = DDS) -> Iterator[Pair]:
    """Every combination of values on both sides, and with either side unstated."""
    settings: list[Settings] = [{}, *grid(names, subject)]
    yield from product(settings, settings)


def single(names: Sequence[str], subject: Subject = DDS) -> Iterator[Pair]:
    """Every combination of values on one side, with a plain partner."""
    writer = all("publisher" in subject.pack.policy(name).roles for name in names)
    for settings in grid(names, subject):
        yield (settings, {}) if writer else ({}, settings)


def one_by_one(names: Sequence[str], subject: Subject = DDS) -> Iterator[Pair]:
    """Every value of each policy by itself, on the side that has it, or on both."""
    for name in names:
        for text in subject.choices[name]:
            yield tuple(  # type: ignore[misc]
                {name: text} if role in subject.pack.policy(name).roles else {} for role in (PUBLISHER, SUBSCRIBER)
            )


def random_pairs(number: int, seed: int, subject: Subject = DDS) -> Iterator[Pair]:
    """Pairs of random values of some policies; a reader often takes over what its writer has, so that many match."""
    dice = random.Random(seed)  # noqa: S311 - dice
    for _ in range(number):
        some = dice.choice((0.1, 0.3, 0.6))
        offered = _some("publisher", some, dice, subject)
        requested = _some("subscriber", some, dice, subject)
        common = {name: text for name, text in offered.items() if dice.random() < 0.5}
        allowed = {name: text for name, text in common.items() if "subscriber" in subject.pack.policy(name).roles}
        yield offered, {**requested, **allowed}


def _some(role: str, some: float, dice: random.Random, subject: Subject) -> Settings:
    found = {}
    for name, values in subject.choices.items():
        seldom = name.startswith(
            ("resource_limits", "durability_service", "history", "data_representation", "type_consistency")
        )
        if role in subject.pack.policy(name).roles and dice.random() < (some / 6 if seldom else some):
            found[name] = dice.choice(values)
    return found


@dataclass(frozen=True)
class Judgement:
    """What the pack says of a pair, in the terms of `Answer`."""

    created: tuple[bool, bool]
    matched: bool | None = None
    named: str | None = None
    unknown: bool = False


def judge(pairs: Iterable[Pair], subject: Subject = DDS, **options: str) -> list[Judgement]:
    """Judge all pairs, each on a topic of its own."""
    protocol = subject.pack.id
    system = System(protocol=protocol, participants={"p": Participant("p"), "q": Participant("q")})
    system.options[protocol] = {name: Setting(text) for name, text in options.items()}
    for number, (offered, requested) in enumerate(pairs):
        for role, owner, settings in ((PUBLISHER, "p", offered), (SUBSCRIBER, "q", requested)):
            stated = {name: Setting(text) for name, text in settings.items()}
            system.endpoints.append(
                Endpoint(id=f"{role}{number}", role=role, topic=f"t{number}", participant=owner, settings=stated)
            )
    resolved = resolve(system, context([subject.pack]).find_pack)
    assert resolved.findings == []
    endpoints = iter(resolved.endpoints)
    return [
        _judgement(publisher.profile, subscriber.profile, subject)
        for publisher, subscriber in zip(*[endpoints] * 2, strict=True)
    ]


def _judgement(publisher: QosProfile, subscriber: QosProfile, subject: Subject) -> Judgement:
    created = _can_be_created(publisher, PUBLISHER), _can_be_created(subscriber, SUBSCRIBER)
    if not all(created):
        return Judgement(created)
    if failed_match_conditions(publisher, subscriber):
        return Judgement(created, matched=False)
    judged = judge_pair(publisher, subscriber)
    codes = {violation.bound.rule.code for violation in judged.violations}
    broken = [name for code, name in subject.named_by.items() if code in codes]
    matched = judged.verdict == "compatible"
    return Judgement(
        created, matched, None if matched else next(iter(broken), None), unknown=judged.verdict == "unknown"
    )


def _can_be_created(profile: QosProfile, role: str) -> bool:
    rules = (violation.bound.rule for violation in judge_endpoint(profile, role, observed=False))
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
    """Pairs, what the pack says of them for Cyclone DDS and by the standard, and what Cyclone DDS does.

    Attributes:
        standard: None where the subject knows no such thing.
    """

    pairs: Sequence[Pair]
    ours: Sequence[Judgement]
    standard: Sequence[Judgement] | None
    seen: Sequence[Answer]

    @property
    def disagreements(self) -> list[str]:
        """Where the pack and Cyclone DDS differ, in words."""
        found = (disagreement(*each) for each in zip(self.pairs, self.ours, self.seen, strict=True))
        return [text for text in found if text is not None]

    @property
    def matching(self) -> int:
        """How many pairs match."""
        return sum(each.matched is True for each in self.seen)

    @property
    def not_created(self) -> int:
        """Of how many pairs one end cannot be created."""
        return sum(each.matched is None for each in self.seen)


def section(cyclone: Cyclone, pairs: Iterable[Pair], subject: Subject = DDS, **options: str) -> Section:
    """Ask everybody for every pair."""
    listed = list(pairs)
    return Section(
        listed,
        judge(listed, subject, **{**subject.options, **options}),
        None if subject.standard is None else judge(listed, subject, **subject.standard),
        [cyclone.ask(subject.on_wire(offered), subject.on_wire(requested)) for offered, requested in listed],
    )
