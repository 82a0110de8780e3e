"""The implementations of DDS that the pack knows to depart from the standard, and how sentences speak of them.

Each end of a connection judges it by itself, so an end that does not compare a policy does not keep the other
from refusing.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cqos_core.packs import Choice, Condition, OneOf, Policy, define, in_, publisher, subscriber

CYCLONE_DDS: Final = ("cyclonedds", "cyclonedds_0_10")
FAST_DDS: Final = ("fastdds_2_9", "fastdds_3_1", "fastdds_3_6")
_FAST_DDS_SPELLINGS: Final = (
    "fastdds",
    "fast_dds",
    "fastrtps",
    "fast_rtps",
    "rmw_fastrtps_cpp",
    "rmw_fastrtps_dynamic_cpp",
)

IMPLEMENTATION: Final = Policy(
    "implementation",
    Choice(
        "standard",
        *CYCLONE_DDS,
        *FAST_DDS,
        "opendds",
        "connext",
        "dust",
        "rustdds",
        ordered=False,
        synonyms={
            **dict.fromkeys(_FAST_DDS_SPELLINGS, FAST_DDS[-1]),
            "fastdds_2": "fastdds_2_9",
            "fastdds_3": "fastdds_3_6",
            "cyclonedds_11": "cyclonedds",
            "cyclonedds_0": "cyclonedds_0_10",
            "cyclone": "cyclonedds",
            "cyclone_dds": "cyclonedds",
            "rmw_cyclonedds_cpp": "cyclonedds",
            "open_dds": "opendds",
            "rti": "connext",
            "rti_connext": "connext",
            "connextdds": "connext",
            "connext_dds": "connext",
            "rmw_connextdds": "connext",
            "dust_dds": "dust",
            "dustdds": "dust",
            "rust_dds": "rustdds",
        },
    ),
    "standard",
    "The implementation of DDS, which may differ between participants; `standard` judges by the texts of the standard. "
    "Fast DDS differs by version; `fastdds` alone leaves open which one it is. `cyclonedds` is Cyclone DDS 11.",
    level="option",
    aliases=("vendor", "rmw"),
    words=dict.fromkeys(_FAST_DDS_SPELLINGS, OneOf(FAST_DDS)),
    fallback="standard",
)

# What they announce, but never refuse a match for.
NO_PRESENTATION: Final = FAST_DDS
NO_LATENCY_BUDGET: Final = FAST_DDS
NO_DESTINATION_ORDER: Final = (*FAST_DDS, "opendds")
NO_LIVELINESS_KIND: Final = ("rustdds",)
NO_REPRESENTATION: Final = ("fastdds_2_9", "rustdds")

# What announces types in full by default. Those beside Cyclone DDS look at the names of types as well.
LOOK_AT_NAMES: Final = ("fastdds_3_1", "fastdds_3_6", "opendds")
ANNOUNCE_TYPES: Final = (*CYCLONE_DDS, *LOOK_AT_NAMES)


def _listed(names: Iterable[str]) -> str:
    """Return implementations as part of a name, all versions of one in one word."""
    called = {"cyclonedds": "cyclonedds_11"}
    for word, versions in (("fastdds", FAST_DDS), ("cyclonedds", CYCLONE_DDS)):
        if set(versions) <= {*names}:
            called |= dict.fromkeys(versions, word)
    return "_or_".join(dict.fromkeys(called.get(name, name) for name in names))


def publisher_is(*names: str) -> Condition:
    """The publisher's implementation is one of these."""
    return define(f"publisher_is_{_listed(names)}", in_(publisher(IMPLEMENTATION), *names))


def subscriber_is(*names: str) -> Condition:
    """The subscriber's implementation is one of these."""
    return define(f"subscriber_is_{_listed(names)}", in_(subscriber(IMPLEMENTATION), *names))


def is_on(*names: str) -> Condition:
    """The endpoint's own implementation is one of these."""
    return define(f"is_on_{_listed(names)}", in_(IMPLEMENTATION, *names))


def both_are(*names: str) -> Condition:
    """Both ends are of these implementations."""
    return define(f"both_are_{_listed(names)}", publisher_is(*names) & subscriber_is(*names))


def either_is(*names: str) -> Condition:
    """At least one end is of these implementations."""
    return define(f"either_is_{_listed(names)}", publisher_is(*names) | subscriber_is(*names))


def only_one_is(*names: str) -> Condition:
    """One end is of these implementations and the other is not."""
    one, other = publisher_is(*names), subscriber_is(*names)
    return define(f"one_is_{_listed(names)}", (one & ~other) | (other & ~one))
