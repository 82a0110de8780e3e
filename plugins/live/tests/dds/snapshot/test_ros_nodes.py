"""What ROS 2 tells of nodes, byte by byte; that it arrives is tested with programs that run."""

import os
import struct
import uuid

import pytest
from hypothesis import given
from hypothesis import strategies as st

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_live.dds.snapshot.ros_nodes import decoded
from cqos_live.dds.snapshot.seen_endpoints import SeenNode

names = st.text("abc_/", max_size=9)
guids = st.uuids()
nodes = st.tuples(names, names, st.lists(guids, max_size=3), st.lists(guids, max_size=3))


def encoded(
    participant: uuid.UUID,
    announced: list[tuple[str, str, list[uuid.UUID], list[uuid.UUID]]],
    size: int,
    order: str = "<",
) -> bytes:
    """Write a message as CDR: numbers stand at multiples of four."""
    found = bytearray(participant.bytes.ljust(size, b"\0"))

    def number(value: int) -> None:
        found.extend(bytes(-len(found) % 4) + struct.pack(f"{order}I", value))

    number(len(announced))
    for namespace, name, readers, writers in announced:
        for text in (namespace, name):
            number(len(text) + 1)
            found.extend(text.encode() + b"\0")
        for guids_of_one_kind in (readers, writers):
            number(len(guids_of_one_kind))
            found.extend(b"".join(each.bytes.ljust(size, b"\0") for each in guids_of_one_kind))
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + bytes(found)


@given(guids, st.lists(nodes, max_size=3), st.sampled_from([16, 24]), st.sampled_from("<>"))
def test_messages_of_either_size_and_order_are_read(participant, announced, size, order):
    wanted = [
        SeenNode(str(participant), namespace, name, frozenset(map(str, (*readers, *writers))))
        for namespace, name, readers, writers in announced
    ]
    assert decoded(encoded(participant, announced, size, order)) == (str(participant), wanted)


@given(st.binary(max_size=100))
def test_any_bytes_are_read_without_a_fault(data):
    decoded(data)


def test_what_is_cut_off_is_no_message():
    whole = encoded(uuid.uuid4(), [("/", "talker", [uuid.uuid4()], [])], 16)
    assert decoded(whole) is not None
    assert all(decoded(whole[:length]) is None for length in range(len(whole)))
