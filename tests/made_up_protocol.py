"""A made-up protocol to test the core with, and functions that build systems of it.

The protocol is the post. A writer offers how its letters to a box are treated, and a reader of the box requests it. The
carrier of the letters is an option, as the middleware is in other protocols. It has a policy of every kind
and a rule of every scope, so that the core is tested without any real protocol.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from cqos_core import check
from cqos_core.api import context
from cqos_core.language.domains import Choice, Count, Duration, Flag, Names, Text, as_text
from cqos_core.language.expression import (
    all_equal,
    call,
    count,
    offered,
    option,
    overlaps,
    publisher,
    requested,
    stated,
)
from cqos_core.language.expression import subscriber as its_subscriber
from cqos_core.language.expression import topic as of_topic
from cqos_core.language.policy import PerRole, Policy, by_option
from cqos_core.language.values import Anything, FromPeers
from cqos_core.language.vocabulary import Function
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import Endpoint, Participant, Profile, ProfileRef, System, Topic
from cqos_core.packs.pack import RulePack
from cqos_core.packs.presets import Convention, Dialect, Preset
from cqos_core.packs.rule import forbids, matched_if, requires
from tests import explained_values

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cqos_core.language.domains import SettingValue
    from cqos_core.model.finding import Fact, Finding
    from cqos_core.model.report import Report
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Role

# What an endpoint sets

CARE: Final = Policy(
    "care",
    Choice("plain", "signed", "insured", affixes=("care_",), synonyms={"registered": "signed"}),
    "plain",
    "How carefully letters are treated.",
    "Postal code, 1",
    aliases=("treatment",),
    words={
        "usual": by_option("carrier", bike="plain", train="signed", otherwise="insured"),
        "best": PerRole(publisher="insured", subscriber=FromPeers(alone="insured", peers="strongest_if_all")),
        "unknown": Anything("nobody wrote it down"),
    },
)
DELAY: Final = Policy(
    "delay",
    Duration(),
    "infinite",
    "The longest time a letter takes.",
    "Postal code, 2",
    words={"unspecified": "infinite"},
    zero="unspecified",
    enforced={"carrier": {"pigeon": "no"}},
    promise=True,
)
COPIES: Final = Policy("copies", Count(1, 100, unlimited=("all",)), "10", "How many letters the box holds.")
SEALED: Final = Policy(
    "sealed", Flag(), "false", "Whether letters are sealed.", enforced={"carrier": {"pigeon": "unmatched"}}
)
STREETS: Final = Policy("streets", Names(), "[]", "Where letters are delivered; nothing stands for everywhere.")
STAMP: Final = Policy("stamp", Text(), None, "What is printed on the stamp.")
RETURNED: Final = Policy("returned", Flag(), "false", "Whether letters come back.", roles=("publisher",))

# What is known of a box, and of the deployment

INTERVAL: Final = Policy("interval", Duration(), None, "The time between two letters.", level="topic")
URGENT: Final = Policy("urgent", Flag(), "false", "Whether letters must not lie about.", level="topic")
CARRIER: Final = Policy(
    "carrier",
    Choice("bike", "train", "ship", "pigeon", ordered=False),
    None,
    "Who carries the letters.",
    level="option",
    assume=("bike", "train", "ship"),
    aliases=("CARRIER",),
)
YEAR: Final = Policy(
    "year", Choice("y1990", "y2000", "y2010"), None, "Of which year the rules are.", level="option", fallback="y2010"
)
TOWN: Final = Policy("town", Count(0, 99), "0", "Letters do not leave the town.", level="option")

POLICIES: Final = (CARE, DELAY, COPIES, SEALED, STREETS, STAMP, RETURNED, INTERVAL, URGENT, CARRIER, YEAR, TOWN)

RULES: Final = (
    requires(
        offered(CARE) >= requested(CARE),
        code="POST101",
        name="care-below-requested",
        because="letters are treated worse than the reader asks for",
        clause="Postal code, 1",
        aliases=("POST001",),
    ),
    requires(
        offered(DELAY) <= requested(DELAY),
        code="POST102",
        name="delay-above-requested",
        because="letters may come later than the reader waits",
    ),
    requires(
        offered(SEALED) | ~requested(SEALED),
        code="POST103",
        name="unsealed",
        because="the reader wants sealed letters",
    ),
    forbids(
        (offered(CARE) == "insured") & (requested(CARE) == "plain"),
        code="POST201",
        name="care-wasted",
        because="nobody asked for so much care",
        severity="note",
    ),
    forbids(
        (offered(COPIES) > requested(COPIES)) & of_topic(URGENT),
        code="POST202",
        name="box-too-small",
        says="{publisher} fills box `{topic}` with {offered copies}, {subscriber} takes {requested copies}",
        because="letters are dropped",
    ),
    forbids(
        (CARE == "insured") & ~SEALED,
        code="POST301",
        name="insured-unsealed",
        because="nobody insures what is open",
    ),
    forbids(
        stated(DELAY) & (DELAY < "1s"),
        code="POST302",
        name="delay-absurd",
        says="{endpoint} wants {delay}",
        because="nobody is that fast",
        severity="error",
        creation=True,
        fixes=("delay",),
    ),
    forbids(
        offered(DELAY) < of_topic(INTERVAL),
        code="POST303",
        name="delay-below-interval",
        because="the writer promises more than it writes",
        fixes=("delay",),
    ),
    forbids(
        (option(YEAR) <= "y1990") & stated(SEALED),
        code="POST304",
        name="seal-before-2000",
        because="there was no wax before 2000",
    ),
    matched_if(
        publisher(TOWN) == its_subscriber(TOWN),
        code="POST401",
        name="town-split",
        because="letters do not leave the town",
    ),
    matched_if(
        overlaps(offered(STREETS), requested(STREETS)) | call("both_everywhere", offered(STREETS), requested(STREETS)),
        code="POST402",
        name="streets-split",
        because="they have no street in common",
    ),
    matched_if(
        offered(STAMP) == requested(STAMP),
        code="POST403",
        name="stamps-differ",
        because="letters with another stamp are thrown away",
        severity="error",
        always=True,
    ),
    forbids(
        ~all_equal(offered(CARE)),
        code="POST501",
        name="writers-differ",
        because="some letters arrive and others do not",
        severity="note",
        help="treat all alike",
    ),
    forbids(
        of_topic(URGENT) & (count(requested(CARE) >= "signed") > 2),
        code="POST502",
        name="many-careful-readers",
        because="the postman has to ring too often",
    ),
)


def both_everywhere(left: tuple[str, ...], right: tuple[str, ...]) -> bool:
    """Return whether neither side names a street."""
    return not left and not right


POST: Final = RulePack(
    id="post",
    title="Post",
    summary="Letters and boxes.",
    policies=POLICIES,
    rules=RULES,
    presets={
        "standard": Preset({"care": "plain", "copies": "20"}, "What anybody sends."),
        "careful": Preset({"care": "insured", "sealed": "true"}, "Valuable letters.", aliases=("VALUE",)),
        "modern": Preset({"delay": "1h"}, "Fast letters.", needs=("year", "y2000")),
        "as_usual": Preset({"care": "usual"}, "As the carrier likes it."),
    },
    base_preset="standard",
    dialects={
        "yaml": Dialect(),
        "form": Dialect(
            names={"sorgfalt": "care"},
            codes={"care": {"1": "plain", "2": "signed"}},
            bare_unit="s",
            zero_is_unset=True,
            ignore=frozenset({"colour"}),
        ),
    },
    conventions=(
        Convention("*/urgent", {"urgent": "true"}, doc="A box for what cannot wait."),
        Convention("archive", external=True),
    ),
    functions=(Function("both_everywhere", both_everywhere, "Neither side names a street."),),
    not_checked=("whether the postman is ill",),
    source="made up",
)
CONTEXT: Final = context([POST])


# Functions that build systems


def settings(**stated_values: Any) -> Settings:
    """Return settings as a design states them."""
    return {name: Setting(as_text(value)) for name, value in stated_values.items()}


def endpoint(
    role: Role, topic: str | None, name: str, *profiles: str, more: Any = None, **stated_values: Any
) -> Endpoint:
    """Return an endpoint; its participant is what stands before the first slash of its name; ``more`` are its other fields."""
    made = Endpoint(
        id=name,
        role=role,
        topic=topic,
        participant=name.split("/", maxsplit=1)[0],
        settings=settings(**stated_values),
        profiles=tuple(ProfileRef(profile) for profile in profiles),
    )
    return replace(made, **(more or {}))


def writer(topic: str | None, name: str = "writer", *profiles: str, more: Any = None, **stated_values: Any) -> Endpoint:
    """Return a publisher."""
    return endpoint("publisher", topic, name, *profiles, more=more, **stated_values)


def reader(topic: str | None, name: str = "reader", *profiles: str, more: Any = None, **stated_values: Any) -> Endpoint:
    """Return a subscriber."""
    return endpoint("subscriber", topic, name, *profiles, more=more, **stated_values)


def world(*parts: Any, protocol: str | None = "post", options: dict[str, Any] | None = None, **fields: Any) -> System:
    """Return a system of endpoints, participants, profiles and topics; participants not given are added."""
    system = System(name="world", protocol=protocol, **fields)
    system.options = {"post": settings(**(options or {}))}
    for part in parts:
        match part:
            case Endpoint():
                system.endpoints.append(part)
            case Participant():
                system.participants[part.id] = part
            case Profile():
                system.profiles[part.name] = part
            case Topic():
                system.topics[part.name] = part
    for each in system.endpoints:
        system.participants.setdefault(each.participant, Participant(each.participant))
    return system


def participant(name: str, more: Any = None, **stated_values: Any) -> Participant:
    """Return a participant with settings; ``more`` are its other fields."""
    return replace(Participant(name, settings=settings(**stated_values)), **(more or {}))


def profile(name: str, *base: str, **stated_values: Any) -> Profile:
    """Return a profile, based on others."""
    return Profile(name, settings(**stated_values), tuple(ProfileRef(each) for each in base))


def box(name: str, external: bool = False, **stated_values: Any) -> Topic:
    """Return a topic with what is stated about it."""
    return Topic(name, settings(**stated_values), external)


def place(line: int, column: int | None = None) -> Place:
    """Return a place in a file."""
    return Place("world.yaml", line, column)


def system_of_parts(*parts: Any, **fields: Any) -> System:
    """Return a system, given as such or by its parts."""
    return parts[0] if len(parts) == 1 and isinstance(parts[0], System) else world(*parts, **fields)


def checked(*parts: Any, packs: Sequence[RulePack] = (POST,), **fields: Any) -> Report:
    """Return the report on a system, or on the parts of one."""
    return check(system_of_parts(*parts, **fields), packs=packs)


def facts(*parts: Any, of: str | None = None, packs: Sequence[RulePack] = (POST,), **fields: Any) -> dict[str, Fact]:
    """Return what `cqos explain` says of the values of an endpoint, the first where none is named, by policy.

    It is explained beside the first partner on its topic; where it has none, beside one that states nothing, in another town.
    """
    elsewhere = participant("another", town=99)
    return explained_values.facts(system_of_parts(*parts, **fields), of, packs=packs, beside=elsewhere)


def codes(report: Report) -> list[str]:
    """Return the codes of all findings, in order."""
    return [finding.code for finding in report.findings]


def only(report: Report, code: str) -> Finding:
    """Return the one finding with this code."""
    found = [finding for finding in report.findings if finding.code == code]
    assert len(found) == 1, (
        f"{code} {len(found)} times; the report has {[str(f.code) + ' ' + f.message for f in report.findings]}"
    )
    return found[0]


def pair_system(
    protocol: str,
    offered: Mapping[str, SettingValue],
    requested: Mapping[str, SettingValue],
    options: Mapping[str, SettingValue] = MappingProxyType({}),
    topic: Mapping[str, SettingValue] = MappingProxyType({}),
    needs: Mapping[str, SettingValue] = MappingProxyType({}),
) -> System:
    """Return the system of a publisher and a subscriber that `check_pair` judges by itself, with its arguments."""
    about = settings(**topic)
    name = about.pop("name", Setting("topic")).text
    system = System(protocol=protocol, options={protocol: settings(**options)})
    system.topics[name] = Topic(name, about, external=True)
    for role, stated_values in (("publisher", offered), ("subscriber", requested)):
        own = settings(**stated_values)
        preset = own.pop("profile", None)
        profiles = () if preset is None else (preset.text,)
        more = {"settings": own, "needs": settings(**needs) if role == "subscriber" else {}}
        system.endpoints.append(endpoint(role, name, role, *profiles, more=more))  # type: ignore[arg-type]
        system.participants[role] = Participant(role)
    return system
