"""Forgets what the process remembers of systems that it checked, so that the next one is as new as the first."""

from __future__ import annotations

from cqos_core.analysis import pair_judge
from cqos_core.checking import assumptions as assumed
from cqos_core.checking import fixes
from cqos_core.matching import judge, pair_guarantees, pair_outcomes
from cqos_core.matching import topic_outcomes as shape
from cqos_core.model import caches as memory_module
from cqos_core.plugins import load_plugins
from cqos_core.remote import asked
from cqos_core.resolving import (
    endpoint_classes,
    endpoint_values,
    finding_facts,
    participants,
    parts,
    policy_comparison,
    profiles,
    qos_profile,
)
from cqos_core.resolving.reader import _plain_remembered


def forget() -> None:
    """Forget all of it."""
    known = (parts.READ, qos_profile._PROFILES, endpoint_classes._NAMED, participants._SURROUNDINGS)
    of_settings = (
        qos_profile._FRAMES,
        endpoint_values._SETTINGS,
        memory_module._NUMBERED,
        pair_outcomes._OUTCOMES,
        pair_outcomes._KINDS,
        pair_guarantees._GIVEN,
        policy_comparison.COMPARED,
        asked._PARTS,
        assumed._PLAIN,
        assumed._RESTING,
    )
    for memory in (*known, *of_settings, pair_judge._PAIRS, pair_judge._REPORTS):
        memory.clear()
    for remembered in (
        *(
            shape._remembered,
            judge.judge_pair,
            judge.judge_endpoint,
            judge.refusals,
            judge.failed_match_conditions,
            judge.undecided_of,
        ),
        *(judge.of_end, fixes._with),
        *(
            judge.refusing_worlds,
            judge.assuming,
            judge.read_in_worlds,
            finding_facts.steered_by_options,
            assumed._options,
            finding_facts._remembered,
        ),
        *(
            judge.over_both,
            judge.about_one,
            judge.refusing_values,
            judge.errors_that_read,
            judge.unset_errors,
            judge._reporting,
            assumed._without_assumption,
        ),
        *(profiles.conventions, profiles.conventional, profiles.base_layer),
        *(qos_profile._deciding, qos_profile._options, qos_profile._treated_as, _plain_remembered),
        *(pair_guarantees.guarantees_of, pair_guarantees._alike, pair_guarantees._one_by_one),
    ):
        remembered.cache_clear()
    plugins = load_plugins()
    for bound in (each for name in plugins.packs if (pack := plugins.pack(name)) for each in pack.judging_rules):
        bound.bound.memory.clear()
