"""Random systems: of ROS 2, of the made-up protocol of `tests.made_up_protocol`, and of both, with everything that may stand in one."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Final

from hypothesis import strategies as st

from cqos_core import (
    Acceptance,
    Bound,
    Endpoint,
    Participant,
    Place,
    Profile,
    ProfileRef,
    Setting,
    System,
    TeamRule,
    Topic,
)
from cqos_core.api import context
from cqos_ros2.pack import PACK as ROS2
from tests.made_up_protocol import POST

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.api import CheckContext

WHERE: Final[CheckContext] = context([POST, ROS2])
PACKS: Final = (POST, ROS2)


@dataclass(frozen=True, slots=True, eq=False)
class Vocabulary:
    """What systems of a protocol are made of.

    Attributes:
        plain: endpoint settings with plain values; `open` adds words that leave their value open or take it from peers.
        of_participants, options, of_topics: settings of participants, of the system, of topics.
        order: plain values in order of strength for an offer, the weakest first; the same for a request, the weakest last.
    """

    protocol: str
    topics: tuple[str, ...]
    plain: Mapping[str, tuple[str, ...]]
    open: Mapping[str, tuple[str, ...]]
    presets: tuple[str, ...]
    of_participants: Mapping[str, tuple[str, ...]]
    options: Mapping[str, tuple[str, ...]]
    of_topics: Mapping[str, tuple[str, ...]]
    order: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


LETTERS: Final = Vocabulary(
    "post",
    ("box", "Box", "a/urgent", "news"),
    {
        "care": ("plain", "signed", "insured"),
        "delay": ("1ms", "1s", "2s", "infinite"),
        "copies": ("1", "5", "all"),
        "sealed": ("true", "false"),
        "streets": ("[]", "[Elm]", "[Elm, Oak]"),
        "stamp": ("red", "blue"),
    },
    {"care": ("usual", "best", "unknown", "express"), "delay": ("unspecified", "5"), "colour": ("red",)},
    ("careful", "modern", "as_usual", "nonsense"),
    {"town": ("0", "1"), "carrier": ("bike", "ship", "pigeon"), "year": ("y1990", "y2000")},
    {"carrier": ("bike", "train", "pigeon", "plane"), "year": ("y1990", "y2050")},
    {"interval": ("1s", "10s", "x"), "urgent": ("true", "false")},
    {"care": ("plain", "signed", "insured"), "delay": ("infinite", "2s", "1s"), "sealed": ("false", "true")},
)

ROBOTS: Final = Vocabulary(
    "ros2",
    ("scan", "Scan", "/map", "/tf_static", "a/odom"),
    {
        "reliability": ("best_effort", "reliable"),
        "durability": ("volatile", "transient_local"),
        "deadline": ("500ms", "1s", "infinite"),
        "liveliness": ("automatic", "manual_by_node", "manual_by_topic"),
        "liveliness_lease_duration": ("500ms", "1s", "infinite"),
        "lifespan": ("1s", "infinite"),
        "history": ("keep_last", "keep_all"),
        "depth": ("0", "1", "100"),
        "avoid_ros_namespace_conventions": ("true", "false"),
    },
    {
        "reliability": ("system_default", "best_available", "unknown"),
        "durability": ("system_default", "best_available", "unknown"),
        "deadline": ("best_available", "unspecified", "7"),
        "liveliness": ("system_default", "best_available"),
        "raw": ("true",),
        "intra_process": ("true",),
    },
    ("sensor_data", "system_default", "best_available", "unknown", "services_default"),
    {
        "rmw": ("cyclonedds", "fastdds", "zenoh"),
        "domain": ("0", "1"),
        "distro": ("humble", "jazzy"),
        "namespace": ("/a", "/"),
    },
    {"rmw": ("cyclonedds", "fastdds", "connext", "zenoh"), "distro": ("foxy", "jazzy"), "round_trip_time": ("10ms",)},
    {"period": ("0s", "100ms", "10s"), "latched": ("true", "false"), "type": ("a/msg/B",)},
    {
        "reliability": ("best_effort", "reliable"),
        "durability": ("volatile", "transient_local"),
        "deadline": ("infinite", "1s", "500ms"),
        "liveliness": ("automatic", "manual_by_node", "manual_by_topic"),
        "liveliness_lease_duration": ("infinite", "1s", "500ms"),
    },
)
BOTH: Final = (LETTERS, ROBOTS)


# Strategies are made once: making one costs more than drawing from it.


@cache
def a_place() -> Any:
    """Sometimes a place."""
    return st.none() | st.builds(Place, st.just("system.yaml"), st.integers(1, 3))


def stated(table: Mapping[str, tuple[str, ...]], most: int = 3) -> Any:
    """A few settings out of a table."""
    return _stated(tuple((name, text) for name, texts in table.items() for text in texts), most)


@cache
def _stated(pairs: tuple[tuple[str, str], ...], most: int) -> Any:
    if not pairs:
        return st.builds(dict)
    setting = st.builds(lambda pair, place: (pair[0], Setting(pair[1], place)), st.sampled_from(pairs), a_place())
    return st.lists(setting, max_size=most, unique_by=lambda pair: pair[0]).map(dict)


def texts(words: Vocabulary, *, opened: bool) -> dict[str, tuple[str, ...]]:
    """The endpoint settings of a protocol, with or without those that leave something open."""
    names = [*words.plain, *(name for name in words.open if opened and name not in words.plain)]
    return {name: (*words.plain.get(name, ()), *(words.open.get(name, ()) if opened else ())) for name in names}


@cache
def endpoints(
    words: Vocabulary, owners: tuple[str, ...], profiles: tuple[str, ...], *, opened: bool, rich: bool
) -> Any:
    """One endpoint; ``rich`` ones have everything that an endpoint may have beside its settings."""
    known = [*profiles, *words.presets] if opened else []
    refs = (
        st.lists(st.builds(ProfileRef, st.sampled_from(known), a_place()), max_size=2).map(tuple)
        if known
        else st.just(())
    )
    more: dict[str, Any] = {}
    if rich:
        more = {
            "overlay": st.builds(dict) | stated(words.plain, 1),
            "observed": st.sampled_from([False, False, False, True]),
            "external": st.sampled_from([False, False, True]),
            "starts_after": st.just(()) | st.lists(st.sampled_from([*owners, "e0", "nobody"]), max_size=1).map(tuple),
            "template": st.sampled_from([None, None, "t1", "t2"]),
            "type": st.sampled_from([None, "a/msg/B", "a/msg/C"]),
            "dialect": st.sampled_from(["yaml", "yaml", "form", "bpmn"]),
            "place": a_place(),
        }
        if words.protocol == "ros2":
            more["kind"] = st.sampled_from(["message", "message", "message", "service_server", "service_client"])
    return st.builds(
        Endpoint,
        id=st.just(""),
        role=st.sampled_from(["publisher", "subscriber"]),
        topic=st.sampled_from(words.topics[:3] if not rich else (*words.topics, None)),
        participant=st.sampled_from(owners),
        settings=stated(texts(words, opened=opened)),
        profiles=refs,
        **more,
    )


@cache
def participants(words: Vocabulary, name: str) -> Any:
    """One participant."""
    return st.builds(
        Participant,
        id=st.just(name),
        settings=st.builds(dict) | stated(words.of_participants, 2),
        external=st.sampled_from([False, False, False, True]),
        starts_after=st.just(()) | st.just(("p0",)),
        label=st.sampled_from([None, "The one"]),
        place=a_place(),
    )


@cache
def profiles(words: Vocabulary, name: str, others: tuple[str, ...]) -> Any:
    """One profile, perhaps based on others, perhaps in a circle."""
    bases = [*others, *words.presets]
    refs = st.lists(st.builds(ProfileRef, st.sampled_from(bases), a_place()), max_size=1).map(tuple)
    return st.builds(Profile, st.just(name), stated(texts(words, opened=True), 2), refs, a_place())


@cache
def topics(words: Vocabulary, name: str) -> Any:
    """What is stated about one topic."""
    return st.builds(Topic, st.just(name), stated(words.of_topics, 2), st.booleans(), place=a_place())


@cache
def acceptances() -> Any:
    """An accepted exception."""
    return st.builds(
        Acceptance,
        rule=st.sampled_from(["POST101", "POST401", "ROS101", "ROS102", "CQ401", "CQ203", "POST999"]),
        because=st.just("so be it"),
        topic=st.sampled_from([None, "box", "scan"]),
        endpoint=st.sampled_from([None, "e1", "e[0-3]"]),
    )


@cache
def checks(words: Vocabulary) -> Any:
    """A check of the team."""
    pairs = [(name, text) for name, texts_of in words.plain.items() for text in texts_of]
    bounds = st.sampled_from(pairs).map(lambda pair: (Bound(pair[0], "exactly", (pair[1],)),))
    where: Any = st.sampled_from([(), (("role", "publisher"),), (("topic", "b*"),)])
    by_bound = st.builds(TeamRule, st.just("ours"), where, bounds, st.just("a reason"))
    asked = st.sampled_from([name for name in words.plain if "." not in name]).map(lambda name: f"stated({name})")
    by_sentence = st.builds(TeamRule, st.just("theirs"), where, st.just(()), st.just("a reason"), asked)
    return by_bound | by_sentence


@cache
def number(least: int, most: int) -> Any:
    """A number."""
    return st.integers(least, most)


@cache
def some(names: tuple[str, ...]) -> Any:
    """None, one or two of them."""
    return st.lists(st.sampled_from(names), max_size=2, unique=True)


@cache
def at_most_one(strategy: Any) -> Any:
    """A list of one, or of none."""
    return st.lists(strategy, max_size=1)


@st.composite
def systems(draw, words: Vocabulary, *, opened: bool = True, rich: bool = True, most: int = 6) -> System:
    """A system; ids are unique."""
    system = System("random", words.protocol)
    owners = tuple(f"p{each}" for each in range(draw(number(1, 3))))
    if rich or draw(st.booleans()):
        system.options[words.protocol] = draw(stated(words.options, 2))
    for name in owners:
        system.participants[name] = draw(participants(words, name)) if rich else Participant(name)
    names = ("q0", "q1") if opened else ()
    for name in names:
        system.profiles[name] = draw(profiles(words, name, names))
    for name in draw(some(words.topics)) if rich else ():
        system.topics[name] = draw(topics(words, name))
    for each in range(draw(number(2, most))):
        made = draw(endpoints(words, owners, names, opened=opened, rich=rich))
        made.id = f"e{each}"
        system.endpoints.append(made)
    if rich:
        system.accept = draw(at_most_one(acceptances()))
        system.checks = draw(at_most_one(checks(words)))
    return system
