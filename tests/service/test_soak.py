"""The service under mixed load: some turns here, more of them in `dev.py explore`, `pytest tests/service/test_soak.py --soak 600` for long."""

import itertools
import os
import sys
import threading
import time
from pathlib import Path

import pytest

import cqos_core as cqos
from cqos_core import InputError
from cqos_core.remote.client import ServiceError
from tests.service.service_process import serving
from tests.service.test_sessions import EDITS, two

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
DIAGRAM = (EXAMPLES / "smart_agriculture_incompatible.bpmn").read_bytes()
GROWTH = 1.25
SLACK_KB = 25_000
LEAST = 6
"""Turns of each of the two callers."""


def used(number):
    """Resident memory in KiB and open descriptors of a process."""
    status = Path(f"/proc/{number}/status").read_text(encoding="utf-8")
    (line,) = [line for line in status.splitlines() if line.startswith("VmRSS")]
    return int(line.split()[1]), len(os.listdir(f"/proc/{number}/fd"))  # noqa: PTH208 - only their number


def load(service, seconds, worker):
    """Do a bit of everything until the time is over, and at least so often that a descriptor per turn shows; how many calls were answered."""
    until, done = time.monotonic() + seconds, 0
    for turn in itertools.count():
        if time.monotonic() > until and turn >= LEAST:
            return done
        with service.client() as client:
            depth = str(turn % 500 * 10 + worker + 1)
            assert client.check_pair("ros2", {"depth": depth}).verdict == "compatible"
            assert client.check(DIAGRAM + b" " * (turn % 7)).verdict == "incompatible"
            with pytest.raises(InputError):
                client.check(DIAGRAM[: 200 + turn % 90])
            with pytest.raises(ServiceError):
                client.check_pair("telegraph")
            session = client.session(two())
            for edit in EDITS[: turn % len(EDITS)]:
                edit(session)
            assert session.report().endpoints >= 0
            if turn % 2:
                session.close()  # else it is gone without a word
            system = cqos.System(protocol="ros2", participants={"a": cqos.Participant("a")})
            system.endpoints += [
                cqos.Endpoint(id=f"e{each}", role="publisher", topic=f"t{depth}", participant="a") for each in range(40)
            ]
            assert client.check_system(system).endpoints == 40
            done += 6
    return done


@pytest.mark.explored
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_memory_and_descriptors_do_not_grow_under_mixed_load(request):
    seconds = request.config.getoption("--soak")
    with serving("--log-level", "warning") as service:
        done: list[int] = []

        def under_load(length):
            threads = [
                threading.Thread(target=lambda worker=worker: done.append(load(service, length, worker)))
                for worker in range(2)
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            time.sleep(0.5)

        under_load(seconds / 3)  # what is loaded and remembered once
        processes = [service.process.pid, *service.children()]
        before = {number: used(number) for number in processes}
        under_load(seconds)
        assert len(done) == 4, "a thread failed"
        assert {service.process.pid, *service.children()} >= set(processes)
        until = time.monotonic() + 30
        while True:  # what callers left is closed soon
            after = {number: used(number) for number in processes}
            if all(after[each][1] <= before[each][1] + 4 for each in processes) or time.monotonic() > until:
                break
            time.sleep(0.1)
        for number in processes:
            (memory, descriptors), (then, open_then) = before[number], after[number]
            assert then < memory * GROWTH + SLACK_KB, f"{memory} KiB became {then}"
            assert open_then <= descriptors + 4
    print(f"{sum(done)} calls in {seconds:g} s; KiB and descriptors {list(before.values())} → {list(after.values())}")  # noqa: T201
