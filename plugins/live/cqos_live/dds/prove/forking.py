"""Starts programs of Python as forks of one process that has imported them, so that each starts within milliseconds.

The process ends with the program that started it.
"""

from __future__ import annotations

import atexit
import os
import signal
import socket
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import IO, Final

from cqos_core.model.problems import CqosError

_FORK: Final = b"fork"
_LONGEST: Final = 64  # bytes of a request or an answer


class Fork:
    """A program that runs; it has of `subprocess.Popen` what a run needs."""

    def __init__(self, forks: Forks, pid: int, stdin: int, stdout: int, stderr: int) -> None:
        """Open the pipes."""
        self.forks, self.pid = forks, pid
        self.stdin: IO[str] = open(stdin, "w", encoding="utf-8", buffering=1)  # noqa: SIM115 - closed by the run
        self.stdout: IO[str] = open(stdout, encoding="utf-8", errors="replace")  # noqa: SIM115
        self.stderr: IO[str] = open(stderr, encoding="utf-8", errors="replace")  # noqa: SIM115

    def kill(self) -> None:
        """Send SIGKILL. The process id is this program's until `wait` returns."""
        os.kill(self.pid, signal.SIGKILL)

    def wait(self) -> int:
        """Return the exit code, once, after the program has ended."""
        return self.forks.ask(b"%d" % self.pid)


class Forks:
    """The process that has imported a program, started with the first fork."""

    def __init__(self, module: str) -> None:
        """Remember the module; its `main` returns the exit code of a program."""
        self.module = module
        self.lock = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None
        self.door: socket.socket | None = None

    def start(self) -> Fork:
        """Start the program once more.

        Raises:
            CqosError: the module cannot be imported.
        """
        (read_in, stdin), (stdout, write_out), (stderr, write_err) = os.pipe(), os.pipe(), os.pipe()
        theirs = [read_in, write_out, write_err]
        try:
            pid = self.ask(_FORK, theirs)
        except CqosError:
            for end in (stdin, stdout, stderr):
                os.close(end)
            raise
        finally:
            for end in theirs:
                os.close(end)
        return Fork(self, pid, stdin, stdout, stderr)

    def ask(self, request: bytes, ends: list[int] | None = None) -> int:
        """Return the answer to a request."""
        with self.lock:
            door = self.door or self._open()
            with suppress(ConnectionError):
                socket.send_fds(door, [request], ends or [])
                if answer := door.recv(_LONGEST):
                    return int(answer)
            process, self.process, self.door = self.process, None, None
            door.close()
        _, errors = process.communicate() if process else (b"", b"")
        reason = errors.decode(errors="replace").strip().rpartition("\n")[2]
        raise CqosError(f"the programs of a run do not start: {reason or 'no reason given'}")

    def close(self) -> None:
        """End the process and all programs that it has started."""
        if self.door is not None and self.process is not None:
            self.door.close()
            self.process.communicate()
        self.door = self.process = None

    def _open(self) -> socket.socket:
        atexit.register(self.close)
        self.door, theirs = socket.socketpair()
        with theirs:
            self.process = subprocess.Popen(  # noqa: S603 - a module of this package
                [sys.executable, "-m", __name__, self.module],
                stdin=theirs.fileno(),
                stderr=subprocess.PIPE,
                start_new_session=True,  # an interrupt at the terminal is for the caller, which ends the programs
            )
        return self.door


def serve(door: socket.socket, program: Callable[[], int]) -> None:
    """Fork and wait as asked, until the other side closes the door; then end all programs."""
    running: set[int] = set()
    while True:
        request, ends, *_ = socket.recv_fds(door, _LONGEST, 3)
        if not request:
            break
        if request != _FORK:
            pid = int(request)
            _, status = os.waitpid(pid, 0)
            running.discard(pid)
            door.send(b"%d" % os.waitstatus_to_exitcode(status))
            continue
        pid = os.fork()
        if not pid:
            door.close()
            _run(ends, program)
        running.add(pid)
        for end in ends:
            os.close(end)
        door.send(b"%d" % pid)
    for pid in running:
        os.kill(pid, signal.SIGKILL)


def _run(ends: list[int], program: Callable[[], int]) -> None:
    for target, end in enumerate(ends):
        os.dup2(end, target)
    code = 1
    try:
        code = program()
    except Exception:  # noqa: BLE001 - the last words of a process
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def main() -> int:
    """Serve the door at the standard input."""
    program = import_module(sys.argv[1]).main
    with socket.socket(fileno=os.dup(0)) as door:
        serve(door, program)
    return 0


if __name__ == "__main__":
    sys.exit(main())
