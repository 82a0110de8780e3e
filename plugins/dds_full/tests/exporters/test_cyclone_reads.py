"""Eclipse Cyclone DDS itself reads the libraries that are written, and finds in them what was stated."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec

import pytest

import cqos_core as cqos
from cqos_core import Endpoint, Participant, Setting, System
from cqos_core.api import context
from cqos_core.files.export import ExportContext
from cqos_dds.exporters import dds_xml
from cqos_dds.pack import PACK

if find_spec("cyclonedds") is None and os.environ.get("CI") != "true":
    pytest.skip("cyclonedds is not installed", allow_module_level=True)

FIND = context([PACK]).find_pack
# It runs in a process of its own: the tests of conformance import it with a configuration of theirs.
ASKED = """
import json, sys
from cyclonedds.core import Policy
from cyclonedds.qos_provider import QosProvider
answers = []
for file, kind, name, expected in json.load(sys.stdin):
    found = list(getattr(QosProvider(file, "*"), f"get_{kind}_qos")(name))
    answers.append([all(each in found for each in eval(expected)), str(found)])
print(json.dumps(answers))
"""
FOREVER = "(1 << 63) - 1"
# What is stated for a writer, and what Cyclone DDS makes of the file; it reads no durability above transient_local.
WRITER = {
    "reliability=best_effort": "Policy.Reliability.BestEffort",
    "reliability=reliable": "Policy.Reliability.Reliable(100_000_000)",
    "reliability.max_blocking_time=2s": "Policy.Reliability.Reliable(2_000_000_000)",
    "durability=volatile": "Policy.Durability.Volatile",
    "durability=transient_local": "Policy.Durability.TransientLocal",
    "deadline=1500ms": "Policy.Deadline(1_500_000_000)",
    "deadline=infinite": f"Policy.Deadline({FOREVER})",
    "latency_budget=1ns": "Policy.LatencyBudget(1)",
    "liveliness=manual_by_topic": f"Policy.Liveliness.ManualByTopic({FOREVER})",
    "liveliness.lease_duration=4s": "Policy.Liveliness.Automatic(4_000_000_000)",
    "ownership=exclusive": "Policy.Ownership.Exclusive",
    "ownership_strength=-3": "Policy.OwnershipStrength(-3)",
    "destination_order=by_source_timestamp": "Policy.DestinationOrder.BySourceTimestamp",
    "history=keep_all": "Policy.History.KeepAll",
    "history.depth=7": "Policy.History.KeepLast(7)",
    "resource_limits.max_samples=9": "Policy.ResourceLimits(9, -1, -1)",
    "lifespan=3s": "Policy.Lifespan(3_000_000_000)",
    "transport_priority=5": "Policy.TransportPriority(5)",
    "writer_data_lifecycle=false": "Policy.WriterDataLifecycle(False)",
    "durability_service.history_depth=2": "Policy.DurabilityService(0, Policy.History.KeepLast(2), -1, -1, -1)",
    "user_data=0x00ff10": r'Policy.Userdata(b"\x00\xff\x10")',
}
READER = {
    "time_based_filter=20ms": "Policy.TimeBasedFilter(20_000_000)",
    "reader_data_lifecycle.autopurge_nowriter_samples_delay=1s": f"Policy.ReaderDataLifecycle(1_000_000_000, {FOREVER})",
    "reliability=reliable": "Policy.Reliability.Reliable(100_000_000)",
}
GROUP = {
    "partition=[a, b]": r'Policy.Partition(("a", "b"))',
    "presentation.access_scope=topic": "Policy.PresentationAccessScope.Topic(False, False)",
    "presentation.ordered_access=true": "Policy.PresentationAccessScope.Instance(False, True)",
}


def asked(folder, *questions):
    """What Cyclone DDS has in the QoS of a file: for each, whether it is what is expected, and all of it."""
    listed = []
    for number, (system, kind, name, expected) in enumerate(questions):
        exported = dds_xml.write(system, ExportContext(FIND, settings={"participants": "without"}))
        file = folder / f"{number}.xml"
        file.write_text(exported.text, encoding="utf-8")
        listed.append([str(file), kind, name, f"[{expected}]"])
    command = [sys.executable, "-c", ASKED]
    done = subprocess.run(command, input=json.dumps(listed), capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def system_of(role, stated):
    policy, _, text = stated.partition("=")
    end = Endpoint(id="e", role=role, topic="t", participant="p", settings={policy: Setting(text)})
    return System(protocol="dds", participants={"p": Participant("p")}, endpoints=[end])


@pytest.mark.parametrize(
    ("role", "kind", "expected"),
    [
        ("publisher", "datawriter", WRITER),
        ("subscriber", "datareader", READER),
        ("publisher", "publisher", GROUP),
        ("subscriber", "subscriber", GROUP),
    ],
)
def test_what_is_stated_is_what_it_finds(tmp_path, role, kind, expected):
    questions = [(system_of(role, stated), kind, "Qos::t", policy) for stated, policy in expected.items()]
    answers = asked(tmp_path, *questions)
    wrong = {stated: found for stated, (right, found) in zip(expected, answers, strict=True) if not right}
    assert not wrong


def test_a_library_with_bases_is_written_so_that_it_needs_none(tmp_path):
    text = (
        '<dds><qos_library name="L"><qos_profile name="A"><datawriter_qos><history><kind>KEEP_ALL_HISTORY_QOS</kind>'
        '</history></datawriter_qos></qos_profile><qos_profile name="B" base_name="A"><datawriter_qos><ownership>'
        "<kind>EXCLUSIVE_OWNERSHIP_QOS</kind></ownership></datawriter_qos></qos_profile></qos_library></dds>"
    )
    both = "Policy.History.KeepAll, Policy.Ownership.Exclusive"
    ((right, found),) = asked(tmp_path, (cqos.read(text.encode()), "datawriter", "L::B", both))
    assert right, found
