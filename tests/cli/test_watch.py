"""``cqos check --watch``: another check after a change of any file on which the result depends."""

import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from cqos_core.cli.watch import watch
from tests.cli.conftest import COMMAND, environment

PATIENCE = 60
REST = "participants:\n  a: {publishes: {/t: {reliability: best_effort}}}\n  b: {subscribes: {/t: {profile: p}}}\n"


@contextmanager
def watching(folder, *arguments):
    """Run the command until the end of the block; give it to the block, with a way to wait for what it prints."""
    with (folder / "out").open("wb") as out, (folder / "err").open("wb") as err:
        command = [str(COMMAND), "check", *arguments, "--watch", "--format", "concise"]
        process = subprocess.Popen(command, cwd=folder, env=environment(), stdout=out, stderr=err)
        try:
            yield process, lambda *texts: waited(folder, process, *texts)
        finally:
            process.kill()
            process.wait()


def waited(folder, process, name, text, times=1):
    """Wait until a stream has a text so many times."""
    until = time.monotonic() + PATIENCE
    while (folder / name).read_text().count(text) < times:
        assert process.poll() is None, (folder / "err").read_text()
        assert time.monotonic() < until, (folder / name).read_text()
        time.sleep(0.05)


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C cannot be sent to one process there")
def test_each_change_is_checked_and_ctrl_c_ends_with_the_last_code(tmp_path):
    designs = tmp_path / "designs"
    designs.mkdir()
    profiles = tmp_path / "p.yaml"
    profiles.write_text("cqos: 1\nprofiles: {p: {reliability: reliable}}\n")
    file = designs / "a.yaml"
    file.write_text(f"cqos: 1\nprotocol: ros2\ninclude: [../p.yaml]\n{REST}")
    with watching(tmp_path, "designs") as (process, until):
        until("out", ": incompatible:")
        profiles.write_text("cqos: 1\nprofiles: {p: {reliability: best_effort}}\n")  # a file that another includes
        until("out", ": compatible:")
        until("err", "changed")
        profiles.write_text("cqos: 1\nprofiles: {p: ")  # half of an edit
        until("err", "error[CQ001]")
        profiles.write_text("cqos: 1\nprofiles: {p: {reliability: reliable}}\n")
        until("out", ": incompatible:", 2)
        (designs / "b.yaml").write_text(file.read_text())  # a new file
        until("out", "total: 2 systems")
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 1


def test_a_file_that_appears_during_a_check_is_noticed(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").write_text("cqos: 1\n")
    runs: list[int] = []

    def run():
        runs.append(len(runs))
        if len(runs) == 2:
            raise KeyboardInterrupt
        (tmp_path / "b.yaml").write_text("cqos: 1\n")
        return 0, [str(tmp_path / "a.yaml")]

    def pause(seconds):
        pytest.fail("it waits for another change")

    monkeypatch.setattr(time, "sleep", pause)
    assert watch([str(tmp_path)], None, run) == 0
    assert len(runs) == 2


def test_what_is_wrong_at_the_start_ends_it(cqos):
    assert cqos("check", "fits.yaml", "--watch", "--select", "nonsense").code == 2


@pytest.mark.parametrize("other", [["-"], ["fits.yaml", "--fix"], ["fits.yaml", "--write-baseline", "known.json"]])
def test_what_changes_files_is_not_watched(cqos, other):
    done = cqos("check", *other, "--watch")
    assert done.code == 2
    assert "--watch goes with neither" in done.err
