"""What calls may take of memory: a worker that took all of it is replaced, with what it remembers."""

import os
import signal
import sys
import time
from dataclasses import replace

import grpc
import pytest

from cqos.v1 import check_pb2, check_pb2_grpc
from cqos_core.client import ServiceError, SessionLostError
from tests.service.running import serving
from tests.service.test_robustness import refused, system, violations
from tests.service.test_sessions import two

MIB = 1024 * 1024
LITTLE = 64 * MIB
"""A worker needs more than half of it for its start."""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="no limit of memory here")


def document(endpoints, length=0):
    """A request for a YAML file of so many publishers and at least so many bytes."""
    lines = (f"  p{number}: {{publishes: {{t{number}: {{depth: 5}}}}}}\n" for number in range(endpoints))
    text = "cqos: 1\nprotocol: ros2\nparticipants:\n" + "".join(lines) + "#" * length
    return check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=text.encode())])


@pytest.fixture(scope="module")
def tight():
    with serving("--max-worker-memory", str(LITTLE), "--heavy-workers", "1") as running:
        yield running


@pytest.fixture
def checks(tight):
    with grpc.insecure_channel(tight.grpc) as channel:
        yield check_pb2_grpc.CheckServiceStub(channel)


@pytest.mark.parametrize(
    "heavy", [document(1, 15 * MIB), document(40_000)], ids=["a long request", "a request that makes much of little"]
)
def test_a_worker_that_took_all_its_memory_is_replaced(heavy, tight, checks):
    checks.CheckDocument(document(1), timeout=60)
    before, told = set(tight.children()), len(tight.lines)
    error = refused(checks.CheckDocument, heavy, timeout=60)
    assert error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED
    assert violations(error) == {"request": f"answering it takes more memory than the {LITTLE} bytes that are allowed"}
    ended = tight.wait_for(lambda line: line["event"] == "worker ended" and line in tight.lines[told:])
    assert ended["why"] == "it took all memory that it may have"
    assert checks.CheckDocument(document(2), timeout=60).report.endpoints == 2
    assert not before & set(tight.children())


def test_a_session_that_takes_all_memory_hears_so_and_those_beside_it_that_they_are_lost(tight):
    with tight.client() as client, client.session(two()) as beside:
        assert beside.report().endpoints == 2
        with (
            client.session(replace(two(), name="n" * 15 * MIB)) as greedy,
            pytest.raises(ServiceError, match="it takes more memory than") as raised,
        ):
            greedy.report()
        assert raised.value.code == "RESOURCE_EXHAUSTED"
        beside.remove("w")
        with pytest.raises(SessionLostError, match="the session is lost"):
            beside.report()
        with client.session(two()) as again:
            assert again.report().endpoints == 2


def test_a_worker_that_is_killed_during_a_call_was_most_likely_out_of_memory():
    """As the system does where all of it is short, of which the process itself hears nothing."""
    with serving("--heavy-workers", "1") as own, grpc.insecure_channel(own.grpc) as channel:
        checks = check_pb2_grpc.CheckServiceStub(channel)
        (worker,) = own.children()
        heavy = check_pb2.CheckSystemRequest(system=system(16_000, topics=4_000, varied=True))
        under_way = checks.CheckSystem.future(heavy, timeout=60)
        time.sleep(0.5)
        os.kill(worker, signal.SIGKILL)
        told = "its process ended (exit code -9), probably for lack of memory"
        assert (under_way.code(), under_way.details()) == (
            grpc.StatusCode.RESOURCE_EXHAUSTED,
            f"there is no answer: {told}",
        )
        assert own.wait_for(lambda line: line["event"] == "worker ended")["why"] == told
        assert "Unknown child process" not in own.log
        assert checks.CheckDocument(document(1), timeout=60).report.endpoints == 1
