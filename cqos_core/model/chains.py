"""Time and capacity in a system file: chains of steps that data takes, and links that it is sent over.

Settings are text until `cqos_core.behaviour.paths` reads them, like all that importers produce.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Final

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from cqos_core.model.settings import Place, Settings

STEP_TIMES: Final = ("latency", "waits", "takes")
"""Keys of a step: ranges of durations."""
CHAIN_LIMITS: Final = ("max_age", "max_gap")
"""Keys of a chain: durations that are required at its last step."""
LINK_FACTS: Final = ("rate", "loss", "mtu", "round_trip")
"""Keys of a link."""


@dataclass(frozen=True, slots=True)
class ChainStep:
    """One step of a chain.

    Attributes:
        at: id of a participant or of an endpoint.
        topic: the topic on which data arrives here from the step before; None where there is only one.
        settings: of `STEP_TIMES`, as text.
    """

    at: str
    topic: str | None = None
    settings: Settings = field(default_factory=dict)
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Chain:
    """A path that data takes through several participants, and what is required at its end.

    Attributes:
        name: unique in the system.
        steps: from the source of the data to its last use.
        settings: of `CHAIN_LIMITS`, as text.
    """

    name: str
    steps: tuple[ChainStep, ...] = ()
    settings: Settings = field(default_factory=dict)
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class StatedLink:
    """A link of limited capacity between some participants and all others.

    Attributes:
        name: unique in the system.
        participants: patterns of the ids of those on one side of it.
        topics: patterns of the topics that it carries; empty: all.
        settings: of `LINK_FACTS`, as text.
    """

    name: str
    participants: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    settings: Settings = field(default_factory=dict)
    place: Place | None = None
