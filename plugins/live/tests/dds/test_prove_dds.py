"""The runs of pairs on implementations of DDS: how their programs start and end, and how long two that never match take."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_core import CqosError
from cqos_core.packs.prover import End, Plan
from cqos_live.dds.prove import cyclone, fast, stage
from cqos_live.dds.prove.forking import Forks

PROVERS = {"cyclonedds": cyclone.PROVER, "fastdds": fast.PROVER}
CALLER = """
from cqos_live.dds.prove.forking import Forks
forks = Forks("cqos_live.dds.prove.cyclone_end")
first, second = forks.start(), forks.start()
print(forks.process.pid, first.pid, second.pid, flush=True)
input()
"""


@pytest.mark.parametrize("name", PROVERS)
def test_two_that_discover_each_other_and_do_not_match_are_given_up_at_once(name, monkeypatch):
    """Partitions keep them apart, which neither end reports."""
    patience = 90.0  # more than a busy machine needs to compile the program of Fast DDS and to start both ends
    monkeypatch.setattr(stage, "DISCOVERY", patience)
    prover = PROVERS[name]
    if (why := prover.missing()) and os.environ.get("CI") != "true":
        pytest.skip(why)
    began = time.monotonic()
    apart = prover.prove(Plan("dds", "t", End("w", {"partition": "[a]"}), End("r", {"partition": "[b]"})))
    assert (apart.matched, apart.refused, len(apart.sent), apart.arrived) == (False, (), 20, ())
    assert time.monotonic() - began < patience


@pytest.mark.parametrize(
    ("version", "variant"),
    [
        ("2.9.1", "fastdds_2_9"),
        ("2.14.4", "fastdds_2_9"),
        ("3.0.0", "fastdds_3_1"),
        ("3.4.2", "fastdds_3_1"),
        ("3.5.0", "fastdds_3_6"),
        ("4", "fastdds_3_6"),
        ("?", "fastdds_2_9"),
    ],
)
def test_a_pair_is_judged_as_the_installed_version_of_fast_dds_behaves(version, variant, monkeypatch):
    monkeypatch.setattr(fast.PROVER, "version", lambda: version)
    assert fast.PROVER.assumes["implementation"] == variant


def test_fast_dds_reports_incompatible_values_behind_a_split_of_partitions():
    """The fact behind the words of DDS403: only a split alone is reported by no status."""
    if (why := fast.PROVER.missing()) and os.environ.get("CI") != "true":
        pytest.skip(why)
    writer = End("w", {"partition": "[a]", "reliability": "best_effort"})
    reader = End("r", {"partition": "[b]", "reliability": "reliable"})
    apart = fast.PROVER.prove(Plan("dds", "t", writer, reader))
    assert (apart.matched, apart.refused) == (False, ("reliability",))


@pytest.mark.parametrize(("writer", "reader"), [("false", "true"), ("true", "false"), ("true", "true")])
def test_fast_dds_refuses_a_reader_that_alone_sends_no_positive_acks(writer, reader):
    """The fact behind DDS113."""
    if (why := fast.PROVER.missing()) and os.environ.get("CI") != "true":
        pytest.skip(why)
    settings = {"reliability": "reliable", "history": "keep_all"}
    offered, requested = (
        End(name, {**settings, "disable_positive_acks": acks}) for name, acks in (("w", writer), ("r", reader))
    )
    run = fast.PROVER.prove(Plan("dds", "t", offered, requested))
    fits = writer == "true" or reader == "false"
    assert (run.matched, run.refused) == (fits, () if fits else ("disable_positive_acks",))
    assert len(run.arrived) == (len(run.sent) if fits else 0)


def test_a_killed_caller_leaves_no_program_behind():
    caller = subprocess.Popen([sys.executable, "-c", CALLER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    pids = [int(pid) for pid in caller.stdout.readline().split()]
    assert all(alive(pid) for pid in pids)
    caller.kill()
    caller.wait()
    until = time.monotonic() + 30
    while any(alive(pid) for pid in pids) and time.monotonic() < until:
        time.sleep(0.01)
    assert [pid for pid in pids if alive(pid)] == []
    caller.stdin.close()
    caller.stdout.close()


def alive(pid):
    """Whether a process runs; one that has ended and was not waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_forks_have_pipes_and_exit_codes_of_their_own():
    forks = Forks("cqos_live.dds.prove.cyclone_end")
    one, other = forks.start(), forks.start()
    one.kill()
    assert (one.wait(), one.stdout.read()) == (-9, "")
    other.stdin.close()
    assert other.wait() != 0
    assert "KeyError: 'role'" in other.stderr.read()
    forks.close()
    for each in (one, other):
        for stream in (each.stdin, each.stdout, each.stderr):
            stream.close()


def test_a_module_that_cannot_be_imported_is_named():
    with pytest.raises(CqosError, match=r"No module named 'cqos_live\.dds\.prove\.none'"):
        Forks("cqos_live.dds.prove.none").start()
