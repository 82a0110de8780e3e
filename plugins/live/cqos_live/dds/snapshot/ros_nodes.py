"""The announcements of ROS 2 nodes: a participant of DDS holds all nodes of a process.

Each participant writes to one topic which of its writers and readers belong to which node. The message is
rmw_dds_common/msg/ParticipantEntitiesInfo. A GID in it has 24 bytes up to Humble and 16 from Iron on; its first 16 are the GUID.
Sources: rmw_dds_common and rmw (RMW_GID_STORAGE_SIZE).
"""

from __future__ import annotations

import struct
import uuid
from typing import TYPE_CHECKING, Any, Final

from cyclonedds.idl import make_idl_struct, types
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from cqos_live.dds.snapshot.seen_endpoints import SeenNode

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cyclonedds.domain import DomainParticipant

# Types of IDL take their arguments in brackets, by means that no type checker knows.
IDL: Final[Any] = types
NAME: Final = "ros_discovery_info"
SIZES: Final = (24, 16)
_GUID: Final = 16
_TYPES: Final = "rmw_dds_common::msg::dds_::"
_LONGEST_NAME: Final = 256
_BATCH: Final = 1000
_QOS: Final = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.Durability.TransientLocal,
    Policy.History.KeepAll,
    Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=True),
)


class RosNodes:
    """Reads the announcements of nodes, with both sizes of GIDs."""

    def __init__(self, participant: DomainParticipant) -> None:
        """Subscribe to it."""
        self._readers = [
            DataReader(participant, Topic(participant, NAME, message(size, _Undecoded)), _QOS) for size in SIZES
        ]
        self._latest: dict[str, list[SeenNode]] = {}

    def seen(self) -> list[SeenNode]:
        """Return the last announced nodes of each participant, also of those that have left."""
        for reader in self._readers:
            while samples := reader.take(_BATCH):
                for sample in samples:
                    announced = decoded(sample.data) if isinstance(sample, _Undecoded) else None
                    if announced is not None:
                        participant, nodes = announced
                        self._latest[participant] = nodes
        return [node for nodes in self._latest.values() for node in nodes]


class _Undecoded:
    """A sample as it came, to which Cyclone DDS adds what it knows of it."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.sample_info: Any = None


def message(size: int, kind: Any = None) -> Any:
    """Return the type of the messages with GIDs of ``size`` bytes; ``kind`` is what their samples become."""
    gid = make_idl_struct("Gid", f"{_TYPES}Gid_", {"data": IDL.array[IDL.uint8, size]})
    node = make_idl_struct(
        "NodeEntitiesInfo",
        f"{_TYPES}NodeEntitiesInfo_",
        {
            "node_namespace": IDL.bounded_str[_LONGEST_NAME],
            "node_name": IDL.bounded_str[_LONGEST_NAME],
            "reader_gid_seq": IDL.sequence[gid],
            "writer_gid_seq": IDL.sequence[gid],
        },
    )
    made: Any = make_idl_struct(
        "ParticipantEntitiesInfo",
        f"{_TYPES}ParticipantEntitiesInfo_",
        {"gid": gid, "node_entities_info_seq": IDL.sequence[node]},
    )
    if kind is not None:
        # By the name of the type, either size may come to either reader.
        made.deserialize = staticmethod(kind)
    return made


def decoded(data: bytes) -> tuple[str, list[SeenNode]] | None:
    """Return the GUID of a participant and its nodes; None for what is no such message of either size."""
    return next((announced for size in SIZES if (announced := _decoded(data, size)) is not None), None)


def _decoded(data: bytes, size: int) -> tuple[str, list[SeenNode]] | None:
    try:
        cursor = _Cursor(data)
        participant = cursor.guid(size)
        nodes = [
            SeenNode(participant, cursor.text(), cursor.text(), frozenset((*cursor.guids(size), *cursor.guids(size))))
            for _ in range(cursor.count())
        ]
    except (struct.error, ValueError):
        return None
    return (participant, nodes) if cursor.at_end() else None


class _Cursor:
    """Reads the plain form of CDR, as far as these messages need it."""

    def __init__(self, data: bytes) -> None:
        """Begin after the header, which says in which order the bytes of a number stand."""
        self.data = data
        self.order = "<" if data[1:2] == b"\x01" else ">"
        self.at = 4

    def count(self) -> int:
        self.at += -self.at % 4
        (number,) = struct.unpack_from(f"{self.order}I", self.data, self.at)
        self.at += 4
        return int(number)

    def take(self, length: int) -> bytes:
        found = self.data[self.at : self.at + length]
        if len(found) < length:
            raise ValueError("the message ends within a value")
        self.at += length
        return found

    def text(self) -> str:
        return self.take(self.count()).removesuffix(b"\0").decode()

    def guid(self, size: int) -> str:
        return str(uuid.UUID(bytes=self.take(size)[:_GUID]))

    def guids(self, size: int) -> Iterator[str]:
        return (self.guid(size) for _ in range(self.count()))

    def at_end(self) -> bool:
        return 0 <= len(self.data) - self.at < 4  # noqa: PLR2004 - a sample may be filled up to a multiple of four
