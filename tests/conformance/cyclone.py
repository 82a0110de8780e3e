"""Eclipse Cyclone DDS, asked what it does with the settings of two endpoints: it runs in this process, on loopback only."""

import os
import random
import socket
import time
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any, ClassVar

from cqos_core.policy import INFINITE, Plain
from cqos_dds.pack import PACK

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
from cyclonedds.internal import dds_c_t  # noqa: E402
from cyclonedds.pub import DataWriter, Publisher  # noqa: E402
from cyclonedds.qos import BasePolicy, Policy, Qos, _CQos  # noqa: E402
from cyclonedds.sub import DataReader, Subscriber  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402

Settings = Mapping[str, str]
NAMED = {
    11: "reliability",
    2: "durability",
    3: "presentation",
    4: "deadline",
    5: "latency_budget",
    6: "ownership",
    8: "liveliness",
    12: "destination_order",
    25: "data_representation",
}
"""The ids of policies in Cyclone DDS, in the order in which it compares them; it names the first that does not fit."""


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
class Representations(BasePolicy):
    """Data representations in any order, which the policy that comes with Cyclone DDS cannot say."""

    __scope__: ClassVar[str] = "DataRepresentation"
    ids: tuple[int, ...]


def _set_representations(qos: Any, policy: Representations) -> Any:
    ids = (dds_c_t.data_representation_id * len(policy.ids))(*policy.ids)
    return _CQos._set_data_representation(qos, len(policy.ids), ids)


setattr(_CQos, "_set_p_datarepresentation", staticmethod(_set_representations))  # noqa: B010 - a method is replaced


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


def free_domain() -> int:
    """Return a domain that nobody on this machine has joined."""
    for domain in random.sample(range(100, 232), 132):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
            try:
                port.bind(("127.0.0.1", 7400 + 250 * domain + 10))
            except OSError:
                continue
            return domain
    raise AssertionError("no free domain")


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
        writer = _created(lambda: DataWriter(Publisher(self.writing, group(offered)), topics[0], qos(offered)))
        reader = _created(lambda: DataReader(Subscriber(self.reading, group(requested)), topics[1], qos(requested)))
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
        writer = DataWriter(Publisher(self.writing, group(offered)), topics[0], qos(offered))

        def read() -> DataReader[Any]:
            reader = DataReader(Subscriber(self.reading, group(requested)), topics[1], qos(requested))
            until = time.monotonic() + 5
            while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
                if time.monotonic() > until:
                    raise AssertionError(f"they do not match: {offered}, {requested}")
                time.sleep(0.01)
            return reader

        return writer, read

    def meet(self, writes: Any, reads: Any) -> bool:
        """Whether a writer and a reader of these types match."""
        name = f"cqos_{os.getpid()}_{next(self.numbers)}"
        writer = DataWriter(self.writing, Topic(self.writing, name, writes))
        reader = DataReader(self.reading, Topic(self.reading, name, reads))
        seen, found = writer.get_matched_subscriptions(), reader.get_matched_publications()
        if bool(seen) is not bool(found):
            raise AssertionError(f"only one side matches: {writes}, {reads}")
        return bool(seen)

    def replayed(self, offered: Settings, requested: Settings, written: int) -> list[int]:
        """Write samples, then create a reader, and return what it gets of those written before."""
        name = f"cqos_{os.getpid()}_{next(self.numbers)}"
        topics = Topic(self.writing, name, self.type), Topic(self.reading, name, self.type)
        writer = DataWriter(Publisher(self.writing), topics[0], qos(offered))
        for number in range(written):
            writer.write(self.type(number))
        reader = DataReader(Subscriber(self.reading), topics[1], qos(requested))
        return taken(reader, written)


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


def values(settings: Settings) -> dict[str, Any]:
    """Read settings as the pack reads them; lengths and durations without limit as Cyclone DDS writes them."""
    read = {}
    for name, text in settings.items():
        policy = PACK.policy(name)
        value: Plain = policy.domain.parse(text)
        if value == INFINITE and policy.domain.kind == "count":
            value = -1
        read[policy.name] = policy.domain.format(value) if policy.domain.kind == "choice" else value
    return read


def group(settings: Settings) -> Qos:
    """Return what is set on the publisher or subscriber."""
    stated = values(settings)
    policies: list[Any] = []
    if any(name.startswith("presentation.") for name in stated):
        scope = getattr(
            Policy.PresentationAccessScope, stated.get("presentation.access_scope", "instance").capitalize()
        )
        flags = (bool(stated.get(f"presentation.{flag}_access", 0)) for flag in ("coherent", "ordered"))
        policies.append(scope(*flags))
    if "partition" in stated:
        policies.append(Policy.Partition(stated["partition"]))
    if "group_data" in stated:
        policies.append(Policy.Groupdata(stated["group_data"].encode()))
    return Qos(*policies)


def qos(settings: Settings) -> Qos:
    """Return what is set on the writer or reader."""
    stated = values(settings)
    policies = [make(stated) for name, make in _POLICIES.items() if any(_policy_of(each) == name for each in stated)]
    return Qos(*policies)


def _policy_of(name: str) -> str:
    return name.partition(".")[0]


def _history(kind: str, depth: int) -> Any:
    return Policy.History.KeepAll if kind == "keep_all" else Policy.History.KeepLast(depth)


def _camel(word: str) -> str:
    return "".join(part.capitalize() for part in word.split("_"))


def _reliability(stated: Mapping[str, Any]) -> Any:
    if stated["reliability"] == "best_effort":
        return Policy.Reliability.BestEffort
    return Policy.Reliability.Reliable(stated.get("reliability.max_blocking_time", 100_000_000))


def _limits(stated: Mapping[str, Any], of: str) -> tuple[int, int, int]:
    names = ("max_samples", "max_instances", "max_samples_per_instance")
    most, instances, each = (stated.get(f"{of}.{name}", -1) for name in names)
    return most, instances, each


def _type_consistency(stated: Mapping[str, Any]) -> Any:
    force = bool(stated.get("type_consistency.force_type_validation", 0))
    if stated.get("type_consistency") == "disallow_type_coercion":
        return Policy.TypeConsistency.DisallowTypeCoercion(force)
    flags = {
        "ignore_sequence_bounds": 1,
        "ignore_string_bounds": 1,
        "ignore_member_names": 0,
        "prevent_type_widening": 0,
    }
    chosen = {name: bool(stated.get(f"type_consistency.{name}", default)) for name, default in flags.items()}
    return Policy.TypeConsistency.AllowTypeCoercion(**chosen, force_type_validation=force)


_POLICIES: dict[str, Callable[[Mapping[str, Any]], Any]] = {
    "reliability": _reliability,
    "durability": lambda s: getattr(Policy.Durability, _camel(s["durability"])),
    "deadline": lambda s: Policy.Deadline(s["deadline"]),
    "latency_budget": lambda s: Policy.LatencyBudget(s["latency_budget"]),
    "liveliness": lambda s: getattr(Policy.Liveliness, _camel(s.get("liveliness", "automatic")))(
        s.get("liveliness.lease_duration", INFINITE)
    ),
    "ownership": lambda s: getattr(Policy.Ownership, _camel(s["ownership"])),
    "destination_order": lambda s: getattr(Policy.DestinationOrder, _camel(s["destination_order"])),
    "data_representation": lambda s: Representations(
        tuple(("xcdr1", "xml", "xcdr2").index(name) for name in s["data_representation"])
    ),
    "history": lambda s: _history(s.get("history", "keep_last"), s.get("history.depth", 1)),
    "resource_limits": lambda s: Policy.ResourceLimits(*_limits(s, "resource_limits")),
    "durability_service": lambda s: Policy.DurabilityService(
        s.get("durability_service.service_cleanup_delay", 0),
        _history(s.get("durability_service.history_kind", "keep_last"), s.get("durability_service.history_depth", 1)),
        *_limits(s, "durability_service"),
    ),
    "time_based_filter": lambda s: Policy.TimeBasedFilter(s["time_based_filter"]),
    "lifespan": lambda s: Policy.Lifespan(s["lifespan"]),
    "ownership_strength": lambda s: Policy.OwnershipStrength(s["ownership_strength"]),
    "transport_priority": lambda s: Policy.TransportPriority(s["transport_priority"]),
    "writer_data_lifecycle": lambda s: Policy.WriterDataLifecycle(bool(s["writer_data_lifecycle"])),
    "reader_data_lifecycle": lambda s: Policy.ReaderDataLifecycle(
        *(s.get(f"reader_data_lifecycle.autopurge_{of}_samples_delay", INFINITE) for of in ("nowriter", "disposed"))
    ),
    "type_consistency": _type_consistency,
    "user_data": lambda s: Policy.Userdata(s["user_data"].encode()),
}
