"""One end of a pair on Cyclone DDS, as a program of `cqos_live.dds.prove.forking`: it reads settings and commands as `cqos_live.dds.prove.stage` writes them."""

import ctypes
import os
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any, ClassVar, Final

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import appendable, final, key, mutable
from cyclonedds.internal import DDS
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic

from cqos_live.dds.prove.cyclone_qos import INFINITE, NAMED, group, qos
from cqos_live.dds.prove.settings import decoded

_EXTENSIBILITY: Final = {"final": final, "of_compiler": final, "appendable": appendable, "mutable": mutable}
_PAUSE: Final = 0.004  # between two looks at what happened
_MOST: Final = 10_000  # samples of one take


def say(what: str, number: int | str = "-", text: str = "") -> None:
    """Write one event."""
    sys.stdout.write(f"{what} {number} {text}".rstrip() + "\n")
    sys.stdout.flush()


def say_changed(what: str, status: Any) -> None:
    """Write an event with the number by which the total of a status has grown, if it has."""
    if status.total_count_change:
        say(what, "-", str(status.total_count_change))


def sample_type(settings: Mapping[str, Any]) -> Any:
    """Return a data type with the name, the key and the extensibility that are set."""
    name = (settings.get("type") or "cqos::Sample").replace("::", ".")
    grows = _EXTENSIBILITY[settings.get("extensibility", "final")]
    if settings.get("keyed"):

        @dataclass
        @grows
        class Keyed(IdlStruct, typename=name):
            instance: int
            value: int
            key("instance")

        return Keyed

    @dataclass
    @grows
    class Plain(IdlStruct, typename=name):
        value: int

    return Plain


_PREPARED: Final = sample_type({}).__idl__  # takes 0.1 s here, and in no fork
_PREPARED.populate()
_PREPARED.fill_type_data()


class End(ABC):
    """What writers and readers have in common: the participant, and what is watched.

    Attributes:
        announced: the built-in topic on which the other end is discovered.
    """

    announced: ClassVar[Any]

    def __init__(self, settings: Mapping[str, Any]) -> None:
        """Join the domain, as it is configured."""
        os.environ["CYCLONEDDS_URI"] = settings["configuration"]
        self.settings = settings
        self.type = sample_type(settings)
        self.participant = DomainParticipant(settings["domain"])
        self.topic = Topic(self.participant, settings["topic"], self.type)
        self.connected = False
        self.named: set[int] = set()
        self.discovery: Any = BuiltinDataReader(self.participant, self.announced)
        self.seen = False

    def watch(self, matched: bool, incompatible: Any) -> None:  # noqa: FBT001 - a state
        """Say what has changed about the other end."""
        if not self.seen and any(each.topic_name == self.topic.name for each in self.discovery.take(_MOST)):
            self.seen = True
            say("seen")
        if matched is not self.connected:
            self.connected = matched
            say("matched" if matched else "unmatched")
        if incompatible.total_count and incompatible.last_policy_id not in self.named:
            self.named.add(incompatible.last_policy_id)
            say("incompatible", "-", NAMED.get(incompatible.last_policy_id, str(incompatible.last_policy_id)))

    def cut(self, *, cut: bool) -> None:
        """Let nothing in or out, or everything again."""
        call = DDS._dll_handle.dds_domain_set_deafmute  # noqa: SLF001 - the binding has no name for it
        call.argtypes = [ctypes.c_int32, ctypes.c_bool, ctypes.c_bool, ctypes.c_int64]
        if call(self.participant._ref, cut, cut, INFINITE) != 0:  # noqa: SLF001
            raise DDSException(DDSException.DDS_RETCODE_ERROR, "Cyclone DDS does not cut the link")

    @abstractmethod
    def look(self) -> None:
        """Say what has happened since the last look."""

    def send(self, first: int, last: int, pause: float) -> None:
        """Write samples; the subscriber has none."""
        raise ValueError(f"the {self.settings['role']} sends no samples, asked for {first} to {last} every {pause} s")


class Writing(End):
    """The publisher."""

    announced = BuiltinTopicDcpsSubscription

    def __init__(self, settings: Mapping[str, Any]) -> None:
        """Create the writer."""
        super().__init__(settings)
        publisher = Publisher(self.participant, group(settings))
        self.writer: Any = DataWriter(publisher, self.topic, qos(settings))

    def look(self) -> None:
        """Look at the statuses of the writer."""
        matched = self.writer.get_publication_matched_status().current_count > 0
        self.watch(matched, self.writer.get_offered_incompatible_qos_status())
        say_changed("liveliness_lost", self.writer.get_liveliness_lost_status())
        say_changed("deadline_missed", self.writer.get_offered_deadline_missed_status())

    def send(self, first: int, last: int, pause: float) -> None:
        """Write samples at even times, each with its number."""
        instances = self.settings.get("instances", 1)
        due = time.monotonic()
        for number in range(first, last + 1):
            while (rest := due - time.monotonic()) > 0:
                time.sleep(min(rest, _PAUSE))
                self.look()
            due += pause
            try:
                sample = self.type(number % instances, number) if self.settings.get("keyed") else self.type(number)
                self.writer.write(sample)
            except DDSException as error:
                if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                    raise
                say("unsent", number, "timeout")
            else:
                say("sent", number)
        say("done")


class Reading(End):
    """The subscriber."""

    announced = BuiltinTopicDcpsPublication

    def __init__(self, settings: Mapping[str, Any]) -> None:
        """Create the reader."""
        super().__init__(settings)
        subscriber = Subscriber(self.participant, group(settings))
        self.reader: Any = DataReader(subscriber, self.topic, qos(settings))
        self.pause = settings.get("taken_every", 0) / 1_000_000_000
        self.due = time.monotonic() + self.pause

    def look(self) -> None:
        """Look at the statuses of the reader, and take what is there if it is time."""
        matched = self.reader.get_subscription_matched_status().current_count > 0
        self.watch(matched, self.reader.get_requested_incompatible_qos_status())
        say_changed("sample_lost", self.reader.get_sample_lost_status())
        say_changed("sample_rejected", self.reader.get_sample_rejected_status())
        say_changed("deadline_missed", self.reader.get_requested_deadline_missed_status())
        if self.reader.get_liveliness_changed_status().not_alive_count_change > 0:
            say("not_alive")
        if time.monotonic() < self.due:
            return
        self.due += self.pause
        for sample in self.reader.take(_MOST):
            if isinstance(sample, self.type):
                say("arrived", sample.value)


def main() -> int:
    """Read the settings, create the end, and do what is asked until the input ends."""
    settings: dict[str, Any] = {}
    for line in sys.stdin:
        word, *rest = line.split()
        if word == "start":
            break
        settings[rest[0]] = decoded(rest[0], rest[1] if len(rest) > 1 else "")
    try:
        end: End = (Writing if settings["role"] == "publisher" else Reading)(settings)
    except DDSException as error:
        say("refused", "-", str(error).replace("\n", " "))
        sys.stdin.read()
        return 0
    say("created")
    lines: SimpleQueue[list[str]] = SimpleQueue()

    def listen() -> None:
        for line in sys.stdin:
            lines.put(line.split())
        lines.put(["end"])

    threading.Thread(target=listen, daemon=True).start()
    while True:
        end.look()
        try:
            word, *rest = lines.get(timeout=_PAUSE)
        except Empty:
            continue
        if word == "end":
            return 0
        if word == "send":
            end.send(int(rest[0]), int(rest[1]), float(rest[2]) / 1000)
        else:
            end.cut(cut=word == "cut")
