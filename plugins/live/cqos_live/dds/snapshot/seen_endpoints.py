"""The contents of a domain by discovery, as plain values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cqos_core.model.system import Role


@dataclass(frozen=True, slots=True)
class SeenParticipant:
    """One participant.

    Attributes:
        key: its GUID, which changes from start to start.
        name: what its program calls it; empty where it has no name.
        implementation: as the pack names it, None where the vendor is not known.
        process, pid, host: of its program; empty if discovery does not report them.
        namespace: of a node of ROS 2 that is separated from others in its process; else empty.
    """

    key: str
    name: str = ""
    implementation: str | None = None
    process: str = ""
    pid: str = ""
    host: str = ""
    namespace: str = ""


@dataclass(frozen=True, slots=True)
class SeenEndpoint:
    """One writer or reader.

    Attributes:
        participant: key of its participant.
        settings: values of the policies that discovery reports, by their names in the pack.
        name: what its program calls it; empty where it has no name.
        keyed: whether its topic has keys; None where its GUID does not say.
    """

    key: str
    participant: str
    role: Role
    topic: str
    type: str
    settings: dict[str, str]
    name: str = ""
    keyed: bool | None = None


@dataclass(frozen=True, slots=True)
class SeenNode:
    """One node of ROS 2.

    Attributes:
        participant: key of the participant of its process.
        endpoints: keys of its writers and readers.
    """

    participant: str
    namespace: str
    name: str
    endpoints: frozenset[str]


@dataclass(frozen=True, slots=True)
class SeenTopic:
    """One declared topic."""

    name: str
    type: str


@dataclass(slots=True)
class Seen:
    """All that is there at one time, but for who looks."""

    domain: int
    participants: list[SeenParticipant] = field(default_factory=list)
    endpoints: list[SeenEndpoint] = field(default_factory=list)
    topics: list[SeenTopic] = field(default_factory=list)
    nodes: list[SeenNode] = field(default_factory=list)
