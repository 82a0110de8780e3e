"""The DDS pack: policies, rules, dialects and meeting, put together as one value."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.packs import NEEDS, CommonMistake, Convention, Function, Implementations, RulePack, Timing, TopicMatching
from cqos_dds import partitions
from cqos_dds.advice_rules import ADVICE
from cqos_dds.costs import COSTS
from cqos_dds.dialects import DIALECTS
from cqos_dds.evidence import PROOFS
from cqos_dds.guarantees import GUARANTEES, UNAFFECTED
from cqos_dds.implementation_rules import DEPARTURES
from cqos_dds.importers.codes import CODES
from cqos_dds.panel import PANEL
from cqos_dds.policies import POLICIES
from cqos_dds.presets import PRESETS
from cqos_dds.rules import RULES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cqos_core.packs.log_mismatches import LogMismatch

CONVENTIONS: Final = (
    Convention("DCPS*", external=True, doc="Built-in topics, which every participant writes and tools read."),
)

FUNCTIONS: Final = (
    Function(
        "partitions_meet",
        partitions.meet,
        "Whether an end of the given implementation takes two lists of partitions for a match.",
        many=partitions.meet_many,
    ),
)

NOT_CHECKED: Final = (
    "whether DDS Security lets the participants talk to each other",
    "whether discovery works: multicast, initial peers, discovery servers",
    "whether participants with unicast peers alone find each other again once a lease has run out",
    "samples written while endpoints are still discovering each other at start-up",
    "whether data types of one name are assignable to each other",
)

TIMING: Final = Timing(
    gap="deadline",
    lease="liveliness.lease_duration",
    asserted_on_topic=("liveliness", ("manual_by_topic",)),
    asserted_by_participant=("liveliness", ("manual_by_participant",)),
    lifespan="lifespan",
    kept=("durability", ("transient_local", "transient", "persistent")),
    certain=("reliability", ("reliable",)),
    unlimited=("history", ("keep_all",)),
    depth="history.depth",
    owned=("ownership", ("exclusive",)),
    strength="ownership_strength",
    strongest="strongest_writer",
    period="period",
    latched="latched",
    keyed="keyed",
)

SLIPS: Final = (
    CommonMistake(r"history: keep_last[ :,/_]+(\d+)", r"history: keep_last, history.depth: \1"),
    CommonMistake(r"queue_(?:size|length|depth): (\d+)", r"history.depth: \1"),
    CommonMistake(r"liveliness: manual", "liveliness: manual_by_topic"),
    CommonMistake(r"liveliness: manual_by_node", "liveliness: manual_by_participant"),
    CommonMistake(r"durability: (?:latched|retained)|(?:retain|retained|latched): true", "durability: transient_local"),
    CommonMistake(r"(?:retain|retained|latched): false", "durability: volatile"),
    CommonMistake(r"(?:qos|reliability): (?:0|at_most_once)", "reliability: best_effort"),
    CommonMistake(r"(?:qos|reliability): (?:[12]|at_least_once|exactly_once)", "reliability: reliable"),
    CommonMistake(r"sensor_data", "{reliability: best_effort, history: keep_last, history.depth: 5}"),
)
"""Words of MQTT and ROS 2."""


def _read_line(line: str) -> Iterable[LogMismatch]:
    from cqos_dds.logs import read_line

    return read_line(line)


PACK: Final = RulePack(
    id="dds",
    title="DDS",
    summary="Data distribution by DDS 1.4 and DDS-XTypes 1.3, by the standard or as an implementation of it judges.",
    policies=(*POLICIES, *NEEDS),
    rules=(*RULES, *ADVICE, *DEPARTURES, *GUARANTEES),
    presets=PRESETS,
    dialects=DIALECTS,
    conventions=CONVENTIONS,
    functions=FUNCTIONS,
    topic_matching=TopicMatching(
        plain="/?[A-Za-z][A-Za-z0-9_/]*",
        one_way={"ownership": "exclusive"},
        described="endpoints on one topic name, of one data type where both state it, in one domain and with a partition "
        "in common",
    ),
    timing=TIMING,
    costs=COSTS,
    panel=PANEL,
    not_checked=NOT_CHECKED,
    unaffected=UNAFFECTED,
    implementations=Implementations(
        "implementation",
        PROOFS,
        provers={"cyclonedds": "cqos_live.dds.prove.cyclone:PROVER", "fastdds": "cqos_live.dds.prove.fast:PROVER"},
    ),
    common_mistakes=SLIPS,
    groups=("publishers", "subscribers"),
    codes=CODES,
    read_log=_read_line,
    source="OMG DDS 1.4, DDS-XTypes 1.3; sources and manuals of the implementations; Cyclone DDS by running it",
    validated=True,
)
