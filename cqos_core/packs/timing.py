"""Policies with a meaning in time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from cqos_core.language.expression import Condition


@dataclass(frozen=True, slots=True)
class Timing:
    """The policies of a pack with a meaning in time; `cqos_core.behaviour.timer_findings` and its siblings compare them with the control flow.

    Names are those of policies; where the pack has no such policy they are empty. A pair is a policy and those of its values that
    have the meaning.

    Attributes:
        gap: the longest time between two samples, offered and requested.
        lease: the time without a sign of liveliness after which a publisher counts as lost.
        asserted_on_topic: kinds of liveliness that only samples on the topic assert.
        asserted_by_participant: those that any sample of the participant asserts.
        lifespan: how long a sample lives, from when it is published, wherever it is.
        kept: the durability with which samples are kept for subscribers that come later. An end that has no such policy is not asked.
        replayed: when, with that, the last sample of a publisher reaches a subscriber that comes later; None: always.
        kept_for: how long it is kept for them, where that limits neither its time on the network nor in queues of subscribers.
        expires: when `kept_for` has an effect; None: always.
        certain: the reliability with which these get them.
        unlimited: the history that keeps all samples.
        depth: how many samples are kept otherwise.
        owned: the ownership with which one publisher counts at a time.
        strength: which publisher that is.
        strongest: of a subscriber, the largest `strength` of the publishers from which it takes samples; the core derives it.
        period: the fact of topics that says how often samples come.
        latched: the fact of topics that says that the last sample is meant for later subscribers.
        keyed: the fact of topics that says that they have instances, each with a history of its own.
    """

    gap: str = ""
    lease: str = ""
    asserted_on_topic: tuple[str, tuple[str, ...]] = ("", ())
    asserted_by_participant: tuple[str, tuple[str, ...]] = ("", ())
    lifespan: str = ""
    kept: tuple[str, tuple[str, ...]] = ("", ())
    replayed: Condition | None = None
    kept_for: str = ""
    expires: Condition | None = None
    certain: tuple[str, tuple[str, ...]] = ("", ())
    unlimited: tuple[str, tuple[str, ...]] = ("", ())
    depth: str = ""
    owned: tuple[str, tuple[str, ...]] = ("", ())
    strength: str = ""
    strongest: str = ""
    period: str = ""
    latched: str = ""
    keyed: str = ""
