"""A law: a design, written as a package and learned again, is the same system."""

from __future__ import annotations

import py_compile
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import given
from hypothesis import strategies as st

from cqos_core import Endpoint, Participant, Setting, System, Topic
from cqos_core.api import context
from cqos_core.cli.app import run as command
from cqos_core.files.export import export_input
from cqos_core.model.source import OPTIONS, ReadContext, Source
from cqos_core.packs.export import ExportContext
from cqos_ros2.exporters.ros2_package import write
from cqos_ros2.exporters.values import QOS, effective, is_rmw_default
from cqos_ros2_workspace.importer import read

CONTEXT = ExportContext(context([], None).find_pack, "ros2")
NAMES = st.sampled_from(["lidar", "camera", "planner", "base_2"])
TOPICS = st.sampled_from(["/scan", "/robot/odom", "cmd_vel", "map", "~/state"])
QUALITIES = st.fixed_dictionaries(
    {},
    optional={
        "depth": st.integers(1, 50).map(str),
        "reliability": st.sampled_from(["reliable", "best_effort"]),
        "durability": st.sampled_from(["volatile", "transient_local"]),
        "deadline": st.sampled_from(["100ms", "1s", "1500ms"]),
        "lifespan": st.sampled_from(["2s", "30ms"]),
        "liveliness": st.sampled_from(["automatic", "manual_by_topic"]),
        "liveliness_lease_duration": st.sampled_from(["3s", "250ms"]),
    },
)
ENDPOINTS = st.lists(
    st.tuples(
        NAMES,
        st.sampled_from(["publisher", "subscriber"]),
        TOPICS,
        QUALITIES,
        st.sampled_from(["message", "message", "service", "action"]),
    ),
    min_size=1,
    max_size=8,
    unique_by=lambda each: (each[0], each[1], each[2], each[4]),
)
TYPES = {
    "message": "std_msgs/msg/String",
    "service": "std_srvs/srv/Trigger",
    "action": "example_interfaces/action/Fibonacci",
}


def system_of(endpoints):
    system = System(name="design", protocol="ros2")
    for number, (node, role, topic, values, kind) in enumerate(endpoints):
        system.participants.setdefault(f"/{node}", Participant(f"/{node}", "ros2"))
        side = "server" if role == "subscriber" else "client"
        found = {name: Setting(value) for name, value in values.items()} if kind != "action" else {}
        made = Endpoint(
            id=f"e{number}", role=role, topic=topic, participant=f"/{node}", settings=found, type=TYPES[kind]
        )
        if kind != "message":
            made.kind, made.topic = f"{kind}_{side}", f"{topic}_{kind}"
        system.endpoints.append(made)
    return system


def shape(system):
    """Return what the endpoints of a system are: node, role, kind, topic, type, and policies that need a mention."""
    found = []
    for each in export_input(system, CONTEXT).endpoints:
        part = each.parts[0]
        values = [effective(part, policy) for policy in QOS]
        said = tuple((value.policy.name, value.word, value.number) for value in values if not is_rmw_default(value))
        if each.endpoint.role == "subscriber":
            said = tuple(value for value in said if value[0] != "lifespan")
        node = part.pack.topic_matching.address(each.endpoint.participant, part.participant.texts)
        found.append(
            (
                node,
                each.endpoint.role,
                each.endpoint.kind,
                part.key,
                each.endpoint.type,
                said,
            )
        )
    return sorted(found, key=repr)


def learned_again(system):
    exported = write(system, CONTEXT)
    with TemporaryDirectory() as folder:
        for name, text in exported.files.items():
            path = Path(folder, "src", "design", name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            if name.endswith(".py"):
                py_compile.compile(str(path), doraise=True, cfile=str(Path(folder, "compiled")))
        switches = {"workspace": {"launch": "design:design.launch.xml"}, OPTIONS: {"ros2.distro": "jazzy"}}
        return read(Source(str(Path(folder, "src")), b""), ReadContext(options=switches))


@given(ENDPOINTS)
def test_learning_a_written_package_gives_the_same_system(endpoints):
    """The types of the topics of an action follow from its own, so they are left out here."""
    system = system_of(endpoints)
    assert shape(learned_again(system)) == shape(system)


def test_an_order_becomes_calls_and_a_period_a_timer():
    system = system_of([("lidar", "publisher", "/scan", {"deadline": "1s"}, "message")])
    system.topics["/scan"] = Topic("/scan", {"period": Setting("100ms")})
    module = write(system, CONTEXT).files["design/lidar.py"]
    assert "self.create_timer(0.1, self.publish_scan)" in module
    assert "deadline=self.on_deadline, incompatible_qos=self.on_incompatible_qos" in module


def test_the_command_writes_a_folder_or_nothing(tmp_path, capsys):
    file = tmp_path / "system.yaml"
    file.write_text("cqos: 1\nprotocol: ros2\nparticipants: {lidar: {publishes: {/scan: {depth: 5}}}}\n")
    target = tmp_path / "made"
    assert command(["convert", str(file), "--to", "ros2_package", "--output", str(target)]) == 0
    assert (target / "package.xml").is_file()
    assert command(["convert", str(file), "--to", "ros2_package", "--output", str(target)]) == 2
    assert "is a folder" in capsys.readouterr().err
