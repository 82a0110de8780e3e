"""``cqos snapshot dds`` sees what real programs do, each in a process of its own, on loopback and a domain of its own."""

import contextlib
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cyclonedds.qos import Policy, Qos

import cqos_core as cqos
from cqos_core.model.system import PUBLISHER, SUBSCRIBER
from cqos_dds.pack import PACK
from cqos_live.dds.snapshot import discovery
from tests.command_process import Done, run
from tests.conformance.cyclone import LOOPBACK

ROOT = Path(__file__).resolve().parents[5]
PROGRAM = Path(__file__).with_name("program.py")
COMMAND = str(Path(sys.executable).with_name("cqos"))
STRING = "std_msgs::msg::dds_::String_"
OF_ROS = {"data_representation": "[xcdr1]"}
SECONDS = 2.5
ENVIRONMENT = {**os.environ, "CYCLONEDDS_URI": LOOPBACK, "PYTHONPATH": str(ROOT)}

Start = Callable[..., None]


WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % 9
OWN_DOMAINS = itertools.cycle(range(10 * WORKER + 1, 10 * WORKER + 11))


@pytest.fixture
def domain() -> int:
    """A domain that neither another process of the tests takes, nor a prover, which takes one from 100 on."""
    return next(OWN_DOMAINS)


@pytest.fixture
def start(domain: int) -> Iterator[Start]:
    """Start programs; they end when their standard input does."""
    with contextlib.ExitStack() as running:

        def begin(name: str, *endpoints: tuple[Any, ...], **more: Any) -> None:
            arguments = json.dumps({"name": name, "endpoints": endpoints, **more})
            program = subprocess.Popen(
                [sys.executable, PROGRAM, str(domain), arguments],
                env=ENVIRONMENT,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            running.callback(_end, program)
            assert program.stdout is not None
            assert program.stdout.readline() == "up\n"

        yield begin


def _end(program: subprocess.Popen[str]) -> None:
    try:
        program.communicate(timeout=10)
    except subprocess.TimeoutExpired:
        program.kill()
        program.communicate()
        raise


def snapshot(domain: int, *arguments: Any, **environ: str) -> Done:
    asked = ["snapshot", "dds", "--domain", domain, "--seconds", SECONDS, *arguments]
    return run(asked, ROOT, {**ENVIRONMENT, **environ})


def endpoints(path: Path) -> dict[str, tuple[str, str, str, dict[str, str]]]:
    return {
        each.id: (
            each.protocol or "dds",
            each.role,
            each.type or "",
            {name: one.text for name, one in each.settings.items()},
        )
        for each in cqos.read(path).endpoints
    }


def test_it_sees_exactly_what_runs(domain: int, start: Start, tmp_path: Path):
    start("talker", (PUBLISHER, "rt/chatter", STRING, {**OF_ROS, "reliability": "reliable", "deadline": "100ms"}))
    start(
        "listener",
        (SUBSCRIBER, "rt/chatter", STRING, {**OF_ROS, "deadline": "50ms"}),
        (
            PUBLISHER,
            "state",
            "KeyedState",
            {"partition": "[left, right]", "ownership": "exclusive", "ownership_strength": "3"},
        ),
    )
    start(
        "", (SUBSCRIBER, "state", "KeyedState", {"partition": "[left]", "ownership": "exclusive", "history.depth": "4"})
    )
    file = tmp_path / "running.yaml"
    done = snapshot(domain, "--output", file)
    assert (done.code, done.out) == (0, "")
    assert f"domain {domain}: 3 participants, 4 endpoints seen in" in done.err

    system = cqos.read(file)
    assert sorted(system.participants) == ["listener", "python", "talker"]
    assert {each.settings["rmw"].text for name, each in system.participants.items() if name != "python"} == {
        "cyclonedds"
    }
    assert system.participants["python"].settings["implementation"].text == "cyclonedds"
    assert all(each.observed for each in system.endpoints)
    assert system.topics["state"].settings["keyed"].text == "true", file.read_text()
    found = endpoints(file)
    assert {name: each[:3] for name, each in found.items()} == {
        "talker/publisher/chatter": ("ros2", "publisher", "std_msgs/msg/String"),
        "listener/subscriber/chatter": ("ros2", "subscriber", "std_msgs/msg/String"),
        "listener/publisher/state": ("dds", "publisher", "KeyedState"),
        "python/subscriber/state": ("dds", "subscriber", "KeyedState"),
    }
    assert found["talker/publisher/chatter"][3].items() >= {"reliability": "reliable", "deadline": "100ms"}.items()
    assert (
        found["listener/publisher/state"][3].items()
        >= {
            "partition": "[left, right]",
            "ownership": "exclusive",
            "ownership_strength": "3",
        }.items()
    )
    assert found["python/subscriber/state"][3].items() >= {"history.depth": "4", "type_information": "true"}.items()

    report = cqos.check(file)
    assert [(each.topic, str(each.verdict)) for each in report.groups] == [
        ("/chatter", "incompatible"),
        ("state", "compatible"),
    ]
    assert [each.code for each in report.findings if each.severity == "error"] == ["ROS103"]


@pytest.mark.parametrize("gid_size", [16, 24])
def test_nodes_of_one_process_are_separate_participants(domain: int, start: Start, tmp_path: Path, gid_size: int):
    start(
        "/",
        (PUBLISHER, "rt/chatter", STRING, OF_ROS),
        (SUBSCRIBER, "rt/chatter", STRING, {**OF_ROS, "deadline": "1s"}),
        (PUBLISHER, "rt/rosout", STRING, OF_ROS),
        (PUBLISHER, "state", "State", {}),
        gid_size=gid_size,
        nodes=[["/robot", "talker", [0, 2]], ["/", "listener", [1]]],
    )
    file = tmp_path / "running.yaml"
    done = snapshot(domain, "--output", file)
    assert done.code == 0, done.err
    system = cqos.read(file)
    assert {
        name: each.settings["namespace"].text
        for name, each in system.participants.items()
        if "namespace" in each.settings
    } == {"talker": "/robot"}
    assert endpoints(file).keys() >= {
        "talker/publisher/chatter",
        "talker/publisher/rosout",
        "listener/subscriber/chatter",
    }
    # What is of no node stays with the process.
    (process,) = {each.participant for each in system.endpoints} - {"talker", "listener"}
    assert {each.topic for each in system.endpoints if each.participant == process} == {"state", "ros_discovery_info"}
    report = cqos.check(file)
    assert [each.code for each in report.findings if each.severity == "error"] == ["ROS103"]


def test_check_and_diff_work_on_it(domain: int, start: Start, tmp_path: Path):
    start("sensor", (PUBLISHER, "reading", "Reading", {"durability": "transient_local"}))
    start("logger", (SUBSCRIBER, "reading", "Reading", {"reliability": "reliable"}))
    running, design = tmp_path / "running.yaml", tmp_path / "design.yaml"
    assert snapshot(domain, "--output", running).code == 0
    designed: dict[str, Any] = {
        "cqos": 1,
        "protocol": "dds",
        "options": {"dds": {"implementation": "cyclonedds", "extensibility": "final", "domain": domain}},
        "participants": {
            "sensor": {"publishes": {"reading": {"type": "Reading", "durability": "transient_local"}}},
            "logger": {"subscribes": {"reading": {"type": "Reading", "reliability": "reliable"}}},
        },
    }

    def diff() -> Done:
        design.write_text(json.dumps(designed), encoding="utf-8")
        return run(["diff", running, "--against", design], ROOT)

    same = diff()
    assert same.code == 0, same.out
    designed["participants"]["logger"]["subscribes"]["reading"]["durability"] = "transient_local"
    other = diff()
    assert other.code == 1
    assert re.search(r"durability.*transient_local.*volatile", other.out, re.DOTALL)


def test_an_interrupt_ends_it_with_what_was_seen(domain: int, start: Start, tmp_path: Path):
    start("sensor", (PUBLISHER, "reading", "Reading", {}))
    file = tmp_path / "running.yaml"
    command = [COMMAND, "snapshot", "dds", "--domain", str(domain), "--seconds", "600", "--output", str(file)]
    looking = subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    assert looking.stderr is not None
    assert looking.stderr.readline() == f"note: looking into domain {domain} for 600 s; Ctrl-C ends it early\n"
    time.sleep(SECONDS)
    looking.send_signal(signal.SIGINT)
    _, said = looking.communicate(timeout=30)
    assert looking.returncode == 0
    assert f"domain {domain}: 1 participant, 1 endpoint seen in" in said
    assert list(endpoints(file)) == ["sensor/publisher/reading"]


def test_who_left_is_not_there(domain: int, tmp_path: Path):
    file = tmp_path / "running.yaml"
    arguments = json.dumps({"name": "late", "endpoints": [(PUBLISHER, "reading", "Reading", {})]})
    command = [COMMAND, "snapshot", "dds", "--domain", str(domain), "--seconds", "600", "--output", str(file)]
    looking = subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    assert looking.stderr is not None
    assert looking.stderr.readline()
    program = subprocess.Popen(
        [sys.executable, PROGRAM, str(domain), arguments],
        env=ENVIRONMENT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert program.stdout is not None
    assert program.stdout.readline() == "up\n"
    time.sleep(1)
    _end(program)
    time.sleep(1)
    looking.send_signal(signal.SIGINT)
    _, said = looking.communicate(timeout=30)
    assert looking.returncode == 2
    assert f"error: domain {domain}: 0 participants, 0 endpoints seen in" in said


def test_an_empty_domain_is_an_error_and_nothing_is_written(domain: int, tmp_path: Path):
    file = tmp_path / "running.yaml"
    done = snapshot(domain, "--output", file)
    assert done.code == 2
    assert f"domain {domain}: 0 participants, 0 endpoints seen in" in done.err
    assert "nothing to write" in done.err
    assert not file.exists()


def test_without_cyclone_dds_the_error_names_the_package_to_install(tmp_path: Path):
    package = tmp_path / "cyclonedds"
    package.mkdir()
    (package / "__init__.py").write_text(
        "raise ModuleNotFoundError(\"No module named 'cyclonedds'\")", encoding="utf-8"
    )
    done = snapshot(1, PYTHONPATH=str(tmp_path))
    assert (done.code, done.out) == (2, "")
    assert re.search(r"^help: .*install .*plugins/live\[cyclonedds\]", done.err, re.MULTILINE)


def test_a_domain_that_cannot_be_joined_is_an_error(domain: int):
    nowhere = LOOPBACK.replace("127.0.0.1", "203.0.113.1", 1)
    done = snapshot(domain, CYCLONEDDS_URI=nowhere)
    assert (done.code, done.out) == (2, "")
    assert f"Cyclone DDS cannot join domain {domain}" in done.err
    assert "CYCLONEDDS_URI" in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--domain", "233"), "233 is not in the range 0<=x<=232"),
        (("--seconds", "0"), "0.0 is not in the range"),
        (("--output", "no/such/folder/file.yaml"), "there is no folder"),
    ],
)
def test_wrong_usage_is_refused_before_the_snapshot_starts(arguments: tuple[str, ...], said: str):
    done = run(["snapshot", "dds", *arguments], ROOT)
    assert done.code == 2
    assert said in " ".join(done.err.split())


# Policies


def test_every_policy_comes_in_the_words_of_the_pack():
    qos = Qos(
        Policy.Reliability.Reliable(5),
        Policy.Durability.TransientLocal,
        Policy.Deadline(10**9),
        Policy.LatencyBudget(2),
        Policy.Liveliness.ManualByTopic(3),
        Policy.Ownership.Exclusive,
        Policy.OwnershipStrength(-1),
        Policy.DestinationOrder.BySourceTimestamp,
        Policy.PresentationAccessScope.Group(coherent_access=True, ordered_access=False),
        Policy.Partition(["a", "b*"]),
        Policy.DataRepresentation(use_xcdrv2_representation=True),
        Policy.TypeConsistency.AllowTypeCoercion(ignore_member_names=False, force_type_validation=True),
        Policy.History.KeepAll,
        Policy.ResourceLimits(-1, 4, 5),
        Policy.DurabilityService(6, Policy.History.KeepLast(7), 8, -1, 9),
        Policy.Lifespan(2**63 - 1),
        Policy.TimeBasedFilter(0),
        Policy.TransportPriority(-1),
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.ReaderDataLifecycle(1, 2**63 - 1),
        Policy.Userdata(b"enclave=/;"),
        Policy.Groupdata(b"\x00\xff"),
    )
    written = discovery.settings(qos, PUBLISHER) | discovery.settings(qos, SUBSCRIBER)
    written |= discovery.settings(qos + Qos(Policy.History.KeepLast(3)), SUBSCRIBER)
    # What stands beside the policies, and what discovery does not tell at all.
    extensions = {"extensions", "compression_ids", "disable_positive_acks", "topic_kind"}
    never = extensions | {"taken_every", "type", "type_information", "entity_factory", "liveliness.announcement_period"}
    never |= {"strongest_writer", "type_extensibility"}
    assert set(written) == {policy.name for policy in PACK.policies if policy.level == "endpoint"} - never
    assert (
        written.items()
        >= {
            "reliability.max_blocking_time": "5ns",
            "liveliness": "manual_by_topic",
            "liveliness.lease_duration": "3ns",
            "ownership_strength": "-1",
            "presentation.access_scope": "group",
            "presentation.coherent_access": "true",
            "partition": '[a, "b*"]',
            "data_representation": "[xcdr2]",
            "type_consistency": "allow_type_coercion",
            "type_consistency.ignore_member_names": "false",
            "history": "keep_last",
            "history.depth": "3",
            "resource_limits.max_samples": "unlimited",
            "resource_limits.max_instances": "4",
            "durability_service.history_kind": "keep_last",
            "durability_service.history_depth": "7",
            "durability_service.max_instances": "unlimited",
            "lifespan": "infinite",
            "transport_priority": "-1",
            "writer_data_lifecycle": "false",
            "reader_data_lifecycle.autopurge_nowriter_samples_delay": "1ns",
            "user_data": "enclave=/;",
            "group_data": "0x00ff",
        }.items()
    )
    assert "history.depth" not in discovery.settings(qos, SUBSCRIBER)
    for name, text in written.items():
        PACK.policy(name).domain.parse(text)


def test_a_policy_of_one_side_is_written_on_that_side_only():
    qos = Qos(Policy.Lifespan(1), Policy.TimeBasedFilter(1))
    assert "lifespan" in discovery.settings(qos, PUBLISHER)
    assert "lifespan" not in discovery.settings(qos, SUBSCRIBER)
    assert "time_based_filter" not in discovery.settings(qos, PUBLISHER)


def test_what_others_do_not_announce_stays_unknown():
    qos = Qos(
        Policy.History.KeepLast(1), Policy.ResourceLimits(1, 1, 1), Policy.TransportPriority(1), Policy.Deadline(1)
    )
    assert discovery.settings(qos, PUBLISHER, "fastdds").keys() == {"partition", "deadline"}
    assert "history.depth" in discovery.settings(qos, PUBLISHER, "cyclonedds")


def test_several_representations_are_unknown_for_writers_only():
    qos = Qos(Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=True))
    assert "data_representation" not in discovery.settings(qos, PUBLISHER)
    assert discovery.settings(qos, SUBSCRIBER)["data_representation"] == "[xcdr1, xcdr2]"


def test_no_vendor_that_the_pack_does_not_know():
    domain = PACK.policy("implementation", "option")
    for name in discovery.VENDORS.values():
        assert domain.word(name) in domain.words or domain.domain.parse(name), name


def test_watching_prints_new_endpoints(domain: int, start: Start):
    command = [COMMAND, "snapshot", "dds", "--domain", str(domain), "--every", "0.5", "--watch"]
    with subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True) as watching:
        assert watching.stdout is not None
        assert watching.stdout.readline().count(":") == 2
        assert watching.stdout.readline() == "nothing is there yet\n"
        start("sensor", (PUBLISHER, "reading", "Reading", {}))
        lines = [watching.stdout.readline(), watching.stdout.readline()]
        time.sleep(1.5)
        start("panel", (SUBSCRIBER, "reading", "Reading", {}))
        lines += [watching.stdout.readline(), watching.stdout.readline()]
        watching.send_signal(signal.SIGINT)
    assert [line.count(":") for line in lines[::2]] == [2, 2]
    assert lines[1].startswith("+ sensor publishes reading (")
    assert lines[3].startswith("+ panel subscribes reading ("), "what was seen before is still there"
    assert watching.returncode == 0
