"""A program of DDS: joins a domain, has the endpoints that it is told, and waits until its standard input ends.

python program.py DOMAIN '{"name": "talker", "endpoints": [["publisher", "rt/chatter", "std_msgs::msg::dds_::String_", {}]]}'
"""

import json
import sys
from dataclasses import dataclass
from typing import Any

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic

from tests.conformance.cyclone import group, qos


def sample_type(name: str) -> Any:
    """Return a data type of this name."""

    @dataclass
    class Sample(IdlStruct, typename=name):
        value: int

    return Sample


def main(domain: int, told: dict[str, Any]) -> None:
    named = [Policy.EntityName(told["name"])] if told["name"] else []
    participant = DomainParticipant(domain, Qos(*named))
    topics: dict[str, Any] = {}
    kept: list[Any] = []
    for role, name, type_name, settings in told["endpoints"]:
        if name not in topics:
            topics[name] = Topic(participant, name, sample_type(type_name))
        if role == "publisher":
            kept.append(DataWriter(Publisher(participant, group(settings)), topics[name], qos(settings)))
        else:
            kept.append(DataReader(Subscriber(participant, group(settings)), topics[name], qos(settings)))
    print("up", flush=True)  # noqa: T201 - whoever started it waits for this
    sys.stdin.read()


if __name__ == "__main__":
    main(int(sys.argv[1]), json.loads(sys.argv[2]))
