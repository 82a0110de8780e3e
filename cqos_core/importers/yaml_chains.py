"""Chains and links of the system form: their keys, and their reading.

Times and rates stay text here; `cqos_core.behaviour.paths` reads them, and reports what it cannot read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cqos_core.importers.document_form import Form, Key, ListOf, MapOf
from cqos_core.importers.value_types import FLAT_SETTING, TEXT, TEXTS
from cqos_core.model.chains import CHAIN_LIMITS, LINK_FACTS, STEP_TIMES, Chain, ChainStep, StatedLink

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cqos_core.importers.document_form import Entry
    from cqos_core.model.settings import Settings

_RANGE: Final = "A range such as `<=20ms`, `5ms..20ms`, or one duration that is exact."
AT: Final = Key("at", TEXT, "Id of a participant, or of an endpoint.", required=True)
STEP_TOPIC: Final = Key("topic", TEXT, "The topic on which data arrives here, where the step before has several.")
_STEP_HELP: Final = {
    "latency": f"How long a sample takes to get here from the step before. {_RANGE}",
    "waits": f"How long a sample waits here before the task starts; without it, until the next sample comes. {_RANGE}",
    "takes": f"How long the task takes. {_RANGE}",
}
_LIMIT_HELP: Final = {
    "max_age": "How old data may be at the last step.",
    "max_gap": "How much time may pass at the last step from one sample to the next.",
}
_FACT_HELP: Final = {
    "rate": "How much it carries in each direction: `10Mbit/s`, `1MB/s`.",
    "loss": "Which part of the packets it loses: `1%` or `0.01`.",
    "mtu": "How many bytes an IP packet on it may have: `1500`.",
    "round_trip": "How long a packet and its answer take: `20ms`.",
}


def _facts(names: tuple[str, ...], help_of: dict[str, str]) -> tuple[Key[Any], ...]:
    return tuple(Key(name, FLAT_SETTING, help_of[name]) for name in names)


_TIMES: Final = _facts(STEP_TIMES, _STEP_HELP)
_LIMITS: Final = _facts(CHAIN_LIMITS, _LIMIT_HELP)
_FACTS: Final = _facts(LINK_FACTS, _FACT_HELP)
STEP: Final = Form("chain_step", "a step of a chain", (AT, STEP_TOPIC, *_TIMES), short=AT.name)
STEPS: Final = Key(
    "steps",
    ListOf(STEP, "a list of steps"),
    "Participants or endpoints in the order in which data takes them, at least two.",
    required=True,
)
CHAIN: Final = Form("chain", "a chain", (STEPS, *_LIMITS))
MEMBERS: Final = Key(
    "participants",
    TEXTS,
    "Ids of participants on one side of the link, with `*` and `?`; all others are on the other side.",
    required=True,
)
LINK_TOPICS: Final = Key("topics", TEXTS, "Topics that go over it, with `*` and `?`; all without it.")
LINK: Final = Form("link", "a link", (MEMBERS, LINK_TOPICS, *_FACTS))


CHAINS: Final = Key(
    "chains",
    MapOf(CHAIN, "a map of chains"),
    "Paths that data takes through several participants, with what is required of its age at the end.",
)
LINKS: Final = Key("links", MapOf(LINK, "a map of links"), "Links of limited capacity, by name.")


def chains_and_links(document: Entry) -> Iterator[tuple[str, Chain | StatedLink]]:
    """Yield the chains and links that a document states, each with its kind."""
    for name, member in (document.get(CHAINS) or {}).items():
        entry = member.value
        steps = (
            ChainStep(step.require(AT), step.get(STEP_TOPIC), _stated(step, _TIMES), step.place)
            for step in entry.require(STEPS)
        )
        yield "chain", Chain(name, tuple(steps), _stated(entry, _LIMITS), member.place)
    for name, link in (document.get(LINKS) or {}).items():
        participants, topics = (
            tuple(each.text for each in link.value.get(key) or ()) for key in (MEMBERS, LINK_TOPICS)
        )
        yield "link", StatedLink(name, participants, topics, _stated(link.value, _FACTS), link.place)


def _stated(entry: Entry, keys: tuple[Key[Any], ...]) -> Settings:
    return {key.name: setting for key in keys if (setting := entry.get(key)) is not None}
