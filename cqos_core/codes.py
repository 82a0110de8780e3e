"""Codes of the core: what it reports about inputs, models, meeting and configuration. Permanent, like rule codes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class CodeInfo:
    """One thing the core may report.

    Attributes:
        name: the bad pattern in kebab case.
        severity: of the finding; a problem that stops the reading is always an error.
        summary: one sentence.
        reason: why it matters, and what to do about it.
    """

    code: str
    name: str
    severity: Literal["error", "warning", "note"]
    summary: str
    reason: str = ""


_INFOS = (
    CodeInfo(
        "CQ201",
        "protocol-without-pack",
        "warning",
        "No installed rule pack judges this protocol, so its endpoints are paired with nobody.",
        "Install the plugin that brings the pack; `cqos packs` lists those that are there.",
    ),
    CodeInfo(
        "CQ202",
        "unknown-setting",
        "error",
        "A setting has a name that its protocol does not know.",
        "A misspelt setting is silently not applied; the message names the nearest known one.",
    ),
    CodeInfo(
        "CQ203",
        "invalid-value",
        "error",
        "A setting's text is none of its policy's values.",
        "The value is treated as not known, so nothing that rests on it is called compatible.",
    ),
    CodeInfo(
        "CQ204",
        "unknown-profile",
        "error",
        "A profile is used that is neither defined nor a preset of the protocol.",
        "Define it under `profiles:`, or use one of the presets that the message lists.",
    ),
    CodeInfo(
        "CQ205",
        "setting-ignored",
        "warning",
        "A setting is stated that the middleware in use ignores, so it promises nothing.",
        "Take it away, or use a middleware that honours it.",
    ),
    CodeInfo(
        "CQ206",
        "profile-shadows-preset",
        "warning",
        "A profile has the name of a preset with other values; the profile is used.",
        "A reader who knows the preset will expect its values; give the profile a name of its own.",
    ),
    CodeInfo(
        "CQ207",
        "preset-not-available",
        "error",
        "A preset is used that the stated version of the protocol does not have yet.",
        "Write the values down instead, or target a version that has the preset.",
    ),
    CodeInfo(
        "CQ208",
        "unknown-option-value",
        "warning",
        "An option has a value that the rule pack does not know; the nearest it knows stands in.",
        "Check the spelling; a newer rule pack may know the value.",
    ),
    CodeInfo(
        "CQ209",
        "setting-stated-twice",
        "warning",
        "One policy is stated twice at one place, under different spellings and with different values.",
        "The last one is used; keep only one.",
    ),
    CodeInfo(
        "CQ210",
        "setting-without-effect",
        "warning",
        "A setting is stated for an endpoint of a role that does not have it.",
        "It changes nothing; state it on the other side.",
    ),
    CodeInfo(
        "CQ211",
        "need-not-judged",
        "warning",
        "The system states needs or bridges that no installed rule pack judges.",
        "They were read and are valid, but nothing was compared with them.",
    ),
    CodeInfo(
        "CQ212",
        "profile-cycle",
        "error",
        "Profiles are based on each other in a circle.",
        "Break the circle; the message shows it.",
    ),
    CodeInfo(
        "CQ213",
        "unknown-start",
        "warning",
        "`starts_after` names neither a participant nor an endpoint of the system.",
        "The order of start is then not known; correct the name.",
    ),
    CodeInfo(
        "CQ214",
        "overlay-without-effect",
        "warning",
        "Settings that another file lays over endpoints cover none of them.",
        "The override is silently not applied; correct the node, topic or entity it names.",
    ),
    CodeInfo(
        "CQ401",
        "subscriber-without-publisher",
        "warning",
        "Nobody in the system publishes what this endpoint subscribes to.",
        "It will never receive anything; mark the topic or participant `external: true` if its publisher is elsewhere.",
    ),
    CodeInfo(
        "CQ402",
        "publisher-without-subscriber",
        "note",
        "Nobody in the system subscribes to what this endpoint publishes.",
        "Mark the topic or participant `external: true` if its subscriber is elsewhere.",
    ),
    CodeInfo(
        "CQ403",
        "near-miss",
        "warning",
        "Two topics, one with publishers only and one with subscribers only, have names that nearly agree.",
        "They never meet; one of the two names is probably misspelt.",
    ),
    CodeInfo(
        "CQ404",
        "nothing-compared",
        "warning",
        "Not a single publisher meets a subscriber, so nothing was compared.",
        "An empty comparison says nothing about compatibility; check the names, domains and protocols.",
    ),
    CodeInfo(
        "CQ405",
        "names-collapse",
        "warning",
        "Different names stand for one topic once they are written as the protocol demands.",
        "Their endpoints will meet although the design keeps them apart; rename one of them.",
    ),
    CodeInfo(
        "CQ406",
        "pair-within-participant",
        "note",
        "A participant subscribes to what it publishes itself.",
        "That is legal, but often a slip of the model.",
    ),
    CodeInfo(
        "CQ601",
        "unused-acceptance",
        "warning",
        "An entry of `accept` matches no finding.",
        "What it excused is gone, or its names are misspelt; take it away so that it cannot hide something new.",
    ),
    CodeInfo(
        "CQ602",
        "expired-acceptance",
        "warning",
        "An entry of `accept` is past its `until` date and no longer holds.",
        "Mend what it excused, or decide anew until when it is accepted.",
    ),
    CodeInfo(
        "CQ603",
        "unknown-rule",
        "warning",
        "A rule is named in `accept` or `severities` that no installed pack has.",
        "The entry has no effect; `cqos packs` lists the rules.",
    ),
    CodeInfo(
        "CQ604",
        "invalid-check",
        "error",
        "An entry of `checks` cannot be applied: it names an unknown policy, or a value that is none.",
        "The team's rule is not checked until it is corrected.",
    ),
    CodeInfo(
        "CQ605",
        "team-rule",
        "error",
        "An endpoint does not keep one of the team's own rules.",
        "The rule and its reason stand under `checks`.",
    ),
    CodeInfo(
        "CQ606",
        "invalid-baseline",
        "error",
        "The file given as a baseline is none.",
        "Nothing in it can be taken as known; write it anew with `cqos check --write-baseline`.",
    ),
    CodeInfo(
        "CQ701",
        "rule-failed",
        "error",
        "A rule's own function raised an error, so what it says is not known.",
        "This is a fault of the rule pack, not of the design; report it to the pack's authors.",
    ),
)
CODES: dict[str, CodeInfo] = {info.code: info for info in _INFOS}
