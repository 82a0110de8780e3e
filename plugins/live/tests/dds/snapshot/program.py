"""A DDS program: joins a domain, creates the endpoints of its arguments, and waits until its standard input ends.

python program.py DOMAIN '{"name": "talker", "endpoints": [["publisher", "rt/chatter", "std_msgs::msg::dds_::String_", {}]]}'

With `"gid_size": 16, "nodes": [["/robot", "talker", [0]]]` it announces that its first endpoint belongs to the node
/robot/talker, as the middlewares of ROS 2 do.
"""

import json
import sys
from dataclasses import dataclass
from typing import Any

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.idl.annotations import key
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic

from cqos_live.dds.prove.cyclone_qos import group, qos
from cqos_live.dds.prove.settings import parsed

IDL: Any = types


def sample_type(name: str) -> Any:
    """Return a data type of this name; one that begins with ``Keyed`` has a key."""

    @dataclass
    class Sample(IdlStruct, typename=name):
        value: int
        if name.startswith("Keyed"):
            key("value")

    return Sample


def entities_type(size: int) -> Any:
    """Return rmw_dds_common/msg/ParticipantEntitiesInfo with GIDs of this size, and the types that it is made of."""

    space = "rmw_dds_common::msg::dds_::"
    gid = make_idl_struct("Gid", f"{space}Gid_", {"data": IDL.array[IDL.uint8, size]})
    node = make_idl_struct(
        "Node",
        f"{space}NodeEntitiesInfo_",
        {
            "node_namespace": IDL.bounded_str[256],
            "node_name": IDL.bounded_str[256],
            "reader_gid_seq": IDL.sequence[gid],
            "writer_gid_seq": IDL.sequence[gid],
        },
    )
    fields = {"gid": gid, "node_entities_info_seq": IDL.sequence[node]}
    return gid, node, make_idl_struct("Entities", f"{space}ParticipantEntitiesInfo_", fields)


def announce_nodes(participant: Any, given: dict[str, Any], endpoints: list[Any]) -> Any:
    """Write which endpoints belong to which node; return the writer, which must live as long as the announcement."""
    size = given["gid_size"]
    gid_type, node_type, entities = entities_type(size)

    def gid(entity: Any) -> Any:
        return gid_type(data=[*entity.guid.bytes, *bytes(size - 16)])

    topic = Topic(participant, "ros_discovery_info", entities)
    qos_of_rmw = qos(
        parsed(
            {
                "reliability": "reliable",
                "durability": "transient_local",
                "history.depth": "1",
                "data_representation": "[xcdr1]",
            }
        )
    )
    writer = DataWriter(Publisher(participant), topic, qos_of_rmw)
    nodes = []
    for namespace, name, numbers in given["nodes"]:
        own = [endpoints[number] for number in numbers]
        readers = [gid(each) for each in own if isinstance(each, DataReader)]
        writers = [gid(each) for each in own if isinstance(each, DataWriter)]
        nodes.append(node_type(namespace, name, readers, writers))
        # When a node joins a process, the middleware announces all nodes again.
        writer.write(entities(gid(participant), nodes))
    return writer


def main(domain: int, given: dict[str, Any]) -> None:
    named = [Policy.EntityName(given["name"])] if given["name"] else []
    participant = DomainParticipant(domain, Qos(*named))
    topics: dict[str, Any] = {}
    kept: list[Any] = []
    for role, name, type_name, settings in given["endpoints"]:
        if name not in topics:
            topics[name] = Topic(participant, name, sample_type(type_name))
        if role == "publisher":
            kept.append(
                DataWriter(Publisher(participant, group(parsed(settings))), topics[name], qos(parsed(settings)))
            )
        else:
            kept.append(
                DataReader(Subscriber(participant, group(parsed(settings))), topics[name], qos(parsed(settings)))
            )
    if "nodes" in given:
        kept.append(announce_nodes(participant, given, kept))
    print("up", flush=True)  # noqa: T201 - the test that started it waits for this
    sys.stdin.read()


if __name__ == "__main__":
    main(int(sys.argv[1]), json.loads(sys.argv[2]))
