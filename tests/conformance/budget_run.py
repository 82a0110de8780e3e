"""One end of a run that measures budgets: it reads, or writes and prints what the loopback interface carried.

python -m tests.conformance.budget_run read|write KIND SIZE COUNT, within a network namespace of its own
"""

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ["CYCLONEDDS_URI"] = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1" multicast="true"/></Interfaces>'
    "<AllowMulticast>spdp</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

PERIOD = 0.02
LENGTH = 4  # the length of a sequence is a part of the sample


@dataclass
class Blob(IdlStruct, typename="Blob"):
    """A sample of any size."""

    data: sequence[uint8]  # type: ignore[type-arg]


def carried() -> int:
    """Return how many bytes of IP packets loopback has carried."""
    lines = Path("/proc/net/dev").read_text(encoding="ascii").splitlines()
    return next(int(line.split(":")[1].split()[0]) for line in lines if line.strip().startswith("lo:"))


def resident() -> int:
    """Return how many bytes of memory this process has."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def main(role: str, kind: str, size: int, count: int) -> None:
    """Read until the writer is gone; or write, and print bytes on loopback and bytes of memory, by sample."""
    reliable = Policy.Reliability.Reliable(duration(seconds=1))
    reliability = Policy.Reliability.BestEffort if kind == "best_effort" else reliable
    kept: list[Any] = [Policy.History.KeepLast(count if kind == "history" else 1)]
    if kind == "history":
        kept.append(Policy.Durability.TransientLocal)
        kept.append(Policy.DurabilityService(0, Policy.History.KeepLast(count), -1, -1, -1))
    participant = DomainParticipant(0)
    topic = Topic(participant, "budget", Blob)
    if role == "read":
        reader = DataReader(participant, topic, qos=Qos(reliability, *kept))
        ends = time.monotonic() + 60
        while not reader.get_matched_publications() and time.monotonic() < ends:
            time.sleep(0.01)
        while reader.get_matched_publications() and time.monotonic() < ends:
            reader.take(N=100)
            time.sleep(0.002)
        return
    writer = DataWriter(participant, topic, qos=Qos(reliability, *kept))
    ends = time.monotonic() + 20
    while kind != "history" and not writer.get_matched_subscriptions() and time.monotonic() < ends:
        time.sleep(0.01)
    time.sleep(1)  # until discovery is quiet
    sample = Blob(data=[1] * (size - LENGTH))  # type: ignore[arg-type]
    writer.write(sample)
    bytes_before, memory_before = carried(), resident()
    for _ in range(count):
        writer.write(sample)
        time.sleep(0.001 if kind == "history" else PERIOD)
    sys.stdout.write(f"{(carried() - bytes_before) / count} {(resident() - memory_before) / count}\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
