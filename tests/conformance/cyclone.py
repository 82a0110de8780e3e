"""Eclipse Cyclone DDS, asked what it does with the settings of two endpoints: it runs in this process, on loopback only."""

import os
import time
import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any

from cqos_live.dds.prove.settings import parsed

LOOPBACK = """<CycloneDDS><Domain>
  <General>
    <Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
    <AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
os.environ["CYCLONEDDS_URI"] = LOOPBACK

from cyclonedds.core import DDSException  # noqa: E402 - it reads its configuration when it is imported
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.annotations import appendable, final, key, mutable  # noqa: E402
from cyclonedds.pub import DataWriter, Publisher  # noqa: E402
from cyclonedds.sub import DataReader, Subscriber  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402

from cqos_live.dds.prove.cyclone_qos import NAMED, group, qos  # noqa: E402
from cqos_live.dds.prove.dds import free_domain  # noqa: E402

Settings = Mapping[str, str]

PATIENCE = 0.5
"""Seconds after which nothing more is expected to arrive on loopback."""
REFUSALS = {
    DDSException.DDS_RETCODE_BAD_PARAMETER,
    DDSException.DDS_RETCODE_INCONSISTENT_POLICY,
    DDSException.DDS_RETCODE_UNSUPPORTED,
}


@dataclass
@final
class Final(IdlStruct, typename="Sample"):
    """A type that cannot grow."""

    value: int


@dataclass
@appendable
class Appendable(IdlStruct, typename="Sample"):
    """A type that can grow at its end."""

    value: int


@dataclass
@mutable
class Mutable(IdlStruct, typename="Sample"):
    """A type that can grow anywhere."""

    value: int


@dataclass
class Keyed(IdlStruct, typename="Keyed"):
    """A sample of one of several instances."""

    instance: int
    value: int
    key("instance")


def sample_type(name: str, members: Mapping[str, type]) -> Any:
    """Return a data type of this name that cannot grow."""
    made = types.new_class(
        name, (IdlStruct,), {"typename": name}, lambda body: body.update(__annotations__=dict(members))
    )
    return final(dataclass(made))


TYPES: dict[str, Any] = {"final": Final, "appendable": Appendable, "mutable": Mutable}


@dataclass(frozen=True)
class Answer:
    """What Cyclone DDS does with a pair.

    Attributes:
        created: whether it creates the writer, and the reader.
        matched: whether they match; None where one of them is not there.
        named: the policy that it names as the reason, None where it names none.
    """

    created: tuple[bool, bool]
    matched: bool | None = None
    named: str | None = None


class Cyclone:
    """Two participants on one domain of their own."""

    def __init__(self, extensibility: str = "final") -> None:
        """Join the domain twice; types are of this extensibility."""
        self.type = TYPES[extensibility]
        domain = free_domain()
        self.writing, self.reading = DomainParticipant(domain), DomainParticipant(domain)
        self.numbers = count()

    def ask(self, offered: Settings, requested: Settings) -> Answer:
        """Create a writer and a reader with these settings of the DDS pack on a topic of their own, and see."""
        name = f"cqos_{os.getpid()}_{next(self.numbers)}"
        topics = Topic(self.writing, name, self.type), Topic(self.reading, name, self.type)
        writer = _created(
            lambda: DataWriter(Publisher(self.writing, group(parsed(offered))), topics[0], qos(parsed(offered)))
        )
        reader = _created(
            lambda: DataReader(Subscriber(self.reading, group(parsed(requested))), topics[1], qos(parsed(requested)))
        )
        if writer is None or reader is None:
            return Answer((writer is not None, reader is not None))
        seen, found = writer.get_matched_subscriptions(), reader.get_matched_publications()
        if bool(seen) is not bool(found):
            raise AssertionError(f"only one side matches: {offered}, {requested}")
        status, other = writer.get_offered_incompatible_qos_status(), reader.get_requested_incompatible_qos_status()
        if (status.total_count, status.last_policy_id) != (other.total_count, other.last_policy_id):
            raise AssertionError(f"the two sides name different policies: {offered}, {requested}")
        return Answer((True, True), bool(seen), NAMED[status.last_policy_id] if status.total_count else None)

    def connected(
        self, offered: Settings, requested: Settings, sample: Any | None = None
    ) -> tuple[DataWriter[Any], Callable[[], DataReader[Any]]]:
        """Create a writer on a topic of its own; return it, and what creates a reader and waits until they match."""
        name, type_ = f"cqos_{os.getpid()}_{next(self.numbers)}", sample or self.type
        topics = Topic(self.writing, name, type_), Topic(self.reading, name, type_)
        writer = DataWriter(Publisher(self.writing, group(parsed(offered))), topics[0], qos(parsed(offered)))

        def read() -> DataReader[Any]:
            reader = DataReader(Subscriber(self.reading, group(parsed(requested))), topics[1], qos(parsed(requested)))
            until = time.monotonic() + 5
            while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
                if time.monotonic() > until:
                    raise AssertionError(f"they do not match: {offered}, {requested}")
                time.sleep(0.01)
            return reader

        return writer, read

    def beside(self, writer: DataWriter[Any], offered: Settings) -> DataWriter[Any]:
        """Create another writer on the topic of one that has a reader; return it once it has that reader too."""
        other = DataWriter(Publisher(self.writing, group(parsed(offered))), writer.topic, qos(parsed(offered)))
        until = time.monotonic() + 5
        while len(other.get_matched_subscriptions()) < len(writer.get_matched_subscriptions()):
            if time.monotonic() > until:
                raise AssertionError(f"no reader matches: {offered}")
            time.sleep(0.01)
        return other

    def meet(self, writes: Any, reads: Any) -> bool:
        """Whether a writer and a reader of these types match."""
        name = f"cqos_{os.getpid()}_{next(self.numbers)}"
        writer = DataWriter(self.writing, Topic(self.writing, name, writes))
        reader = DataReader(self.reading, Topic(self.reading, name, reads))
        seen, found = writer.get_matched_subscriptions(), reader.get_matched_publications()
        if bool(seen) is not bool(found):
            raise AssertionError(f"only one side matches: {writes}, {reads}")
        return bool(seen)

    def replayed(self, pairs: Iterable[tuple[Settings, Settings]], written: int) -> list[list[int]]:
        """For each pair write samples, then create a reader; return what each reader gets of those written before."""
        readers = []
        for offered, requested in pairs:
            name = f"cqos_{os.getpid()}_{next(self.numbers)}"
            topics = Topic(self.writing, name, self.type), Topic(self.reading, name, self.type)
            writer = DataWriter(Publisher(self.writing), topics[0], qos(parsed(offered)))
            for number in range(written):
                writer.write(self.type(number))
            readers.append((DataReader(Subscriber(self.reading), topics[1], qos(parsed(requested))), writer))
        time.sleep(PATIENCE)
        return [[sample.value for sample in reader.take(written)] for reader, _ in readers]


def taken(reader: DataReader[Any], most: int) -> list[int]:
    """Take samples until nothing more is expected to arrive, or so many are there."""
    found: list[int] = []
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and len(found) < most:
        found += [sample.value for sample in reader.take(most)]
        time.sleep(0.01)
    return found


def _created(create: Callable[[], Any]) -> Any | None:
    try:
        return create()
    except DDSException as error:
        if error.code not in REFUSALS:
            raise
        return None
