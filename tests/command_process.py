"""Runs the command as a user does, in a process of its own, without its start: that process is forked from one that has imported it and compiled the packs.

Where the start itself is what is tried, tests run the installed command. That a report depends on no check before is a law
(`tests/laws/test_memory.py`).
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import io
import itertools
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotYet
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn
from unittest import mock

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import TextIO

EXAMPLE = Path(__file__).parents[1] / "examples" / "smart_agriculture.bpmn"
SERVING = (
    "cqos_core.cli.modeler",
    *(f"cqos_core.service.{name}" for name in ("server_process", "call_dispatch", "grpc_server", "web_server")),
)
"""What a service imports besides."""
GONE = "the process to fork from has ended; its traceback says why"


class Done(NamedTuple):
    """How a run ended."""

    code: int
    out: str
    err: str


def run(
    arguments: Sequence[object],
    folder: Path,
    environment: Mapping[str, str] = os.environ,
    stdin: bytes = b"",
    *,
    together: bool = False,
) -> Done:
    """Run ``cqos`` with arguments in a folder; ``together`` puts its errors into its output."""
    if os.name != "posix":
        done = subprocess.run(
            [Path(sys.executable).with_name("cqos"), *map(str, arguments)],
            cwd=folder,
            env=environment,
            input=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT if together else subprocess.PIPE,
            check=False,
        )
        return Done(done.returncode, done.stdout.decode(), (done.stderr or b"").decode())
    with tempfile.TemporaryDirectory() as place:
        files = [Path(place, name) for name in ("in", "out", "err")]
        for file, content in zip(files, (stdin, b"", b""), strict=True):
            file.write_bytes(content)
        code = _server().fork(arguments, folder, environment, (*files[:2], files[1 if together else 2])).wait()
        return Done(code, files[1].read_bytes().decode(), files[2].read_bytes().decode())


def start(
    arguments: Sequence[object], folder: Path | None, environment: Mapping[str, str]
) -> Forked | subprocess.Popen[str]:
    """Start ``cqos`` with arguments in a folder; who starts it reads its output and its errors, and ends it."""
    if os.name != "posix":
        return start_installed(arguments, folder, environment)
    with tempfile.TemporaryDirectory() as place:
        pipes = [Path(place, name) for name in ("out", "err")]
        for each in pipes:
            os.mkfifo(each)
        # Without waiting for a writer; there is one when the process has begun, and then reading waits for it.
        opened = [os.open(each, os.O_RDONLY | os.O_NONBLOCK) for each in pipes]
        forked = _server().fork(arguments, folder or Path.cwd(), environment, (os.devnull, *pipes))
        forked.begun.result()
    for number in opened:
        os.set_blocking(number, True)
    forked.stdout, forked.stderr = (open(number, encoding="utf-8") for number in opened)  # noqa: PTH123, SIM115 - of who starts it
    return forked


def start_installed(
    arguments: Sequence[object], folder: Path | None, environment: Mapping[str, str]
) -> subprocess.Popen[str]:
    """Start ``cqos`` in a Python that imports it, as a user does."""
    script = "import sys; from cqos_core.cli import main; sys.exit(main())"
    return subprocess.Popen(
        [sys.executable, "-c", script, *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
        cwd=folder,
        text=True,
    )


class Forked:
    """A forked process, with what tests use of `subprocess.Popen`.

    Attributes:
        begun: its process id, as soon as its files are open.
        ended: its exit code; that of a signal is negative.
    """

    stdout: TextIO
    stderr: TextIO

    def __init__(self) -> None:
        """Wait for what the server says of it."""
        self.begun: Future[int] = Future()
        self.ended: Future[int] = Future()

    @property
    def pid(self) -> int:
        return self.begun.result()

    def poll(self) -> int | None:
        return self.ended.result() if self.ended.done() else None

    def wait(self, timeout: float | None = None) -> int:
        try:
            return self.ended.result(timeout)
        except NotYet:
            raise subprocess.TimeoutExpired("cqos", timeout or 0) from None

    def send_signal(self, number: int) -> None:
        if not self.ended.done():
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


def run_here(
    arguments: Sequence[object],
    folder: Path,
    environment: Mapping[str, str] | None = None,
    *,
    together: bool = False,
) -> Done:
    """Run ``cqos`` as `run` does, but in this process: what it imports, such as an engine of tables, is there already."""
    from cqos_core.cli import main

    written = io.BytesIO(), io.BytesIO()
    out, err = (io.TextIOWrapper(each, "utf-8", write_through=True) for each in written)
    before = Path.cwd()
    os.chdir(folder)
    try:
        with (
            mock.patch.dict(os.environ, environment or {}, clear=environment is not None),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(out if together else err),
        ):
            code = main([str(each) for each in arguments])
    finally:
        os.chdir(before)
    said, complained = (each.getvalue().decode() for each in written)
    return Done(code, said, complained)


class _Server:
    """The process to fork from; it ends with the tests."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.command_process"],
            cwd=Path(__file__).parents[1],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._numbers = itertools.count()
        self._forked: dict[int, Forked] = {}
        self._lock = threading.Lock()
        self._gone = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        atexit.register(self._end)

    def fork(
        self, arguments: Sequence[object], folder: Path, environment: Mapping[str, str], files: Sequence[object]
    ) -> Forked:
        """Fork a process that becomes the command, with files to read from and to write to."""
        forked = Forked()
        with self._lock:
            assert not self._gone, GONE
            number = next(self._numbers)
            self._forked[number] = forked
            order = {
                "number": number,
                "arguments": [str(each) for each in arguments],
                "folder": str(folder),
                "environment": dict(environment),
                "files": [str(file) for file in files],
            }
            assert self._process.stdin is not None
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
        return forked

    def _read(self) -> None:
        for line in self._process.stdout or ():
            what, number, value = line.split()
            forked = self._forked[int(number)]
            if what == "begun":
                forked.begun.set_result(int(value))
            else:
                del self._forked[int(number)]
                if not forked.begun.done():
                    forked.begun.set_exception(AssertionError(f"it could not begin: exit code {value}"))
                forked.ended.set_result(int(value))
        with self._lock:
            self._gone = True
            for forked in self._forked.values():
                for each in (forked.begun, forked.ended):
                    if not each.done():
                        each.set_exception(AssertionError(GONE))

    def _end(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait()
        self._reader.join()
        self._process.stdout.close()


_server = cache(_Server)


def _serve() -> None:
    """Fork a process for each order; write when it has begun and how it has ended."""
    for name in SERVING:
        with contextlib.suppress(ImportError):  # the extra `web` brings the server of pages
            importlib.import_module(name)
    for name in _imported():
        importlib.import_module(name)
    _compile_packs()
    numbers: dict[int, int] = {}

    def reap(*_: object) -> None:
        for process in list(numbers):
            ended, status = os.waitpid(process, os.WNOHANG)
            if ended:
                os.write(1, f"ended {numbers.pop(process)} {os.waitstatus_to_exitcode(status)}\n".encode())

    signal.signal(signal.SIGCHLD, reap)
    for line in sys.stdin:
        order = json.loads(line)
        # One that ends at once is reaped when its number is known.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGCHLD})
        process = os.fork()
        if process == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGCHLD})
            _become_the_command(order)
        numbers[process] = order["number"]
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGCHLD})


def _imported() -> list[str]:
    """What a check imports; it runs in a process of its own, so that nothing of it is remembered."""
    script = (
        "import sys; from cqos_core.cli import main; main(sys.argv[1:]); "
        "print(*(name for name, each in sys.modules.items() if getattr(each, '__spec__', None)), file=sys.stderr)"
    )
    command = [sys.executable, "-c", script, "check", "--no-config", str(EXAMPLE)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True)
    return [name for name in done.stderr.split() if name != "__main__"]


def _compile_packs() -> None:
    """Have the rules of every pack ready, which is most of what a small check costs; each process finds its plugins by itself."""
    import cqos_core
    from cqos_core.plugins import load_plugins

    for pack in load_plugins().packs:
        cqos_core.check_pair(pack)
    cqos_core.check(EXAMPLE)
    load_plugins.cache_clear()


def _become_the_command(order: dict[str, Any]) -> NoReturn:
    """Take over what a new process has from its parent, and end as one that was started."""
    code = 1
    try:
        os.chdir(order["folder"])
        os.environ.clear()
        os.environ.update(order["environment"])
        sys.path[:0] = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
        flags_of = (os.O_RDONLY, *[os.O_WRONLY | os.O_APPEND] * 2)
        opened = [os.open(name, flags) for name, flags in zip(order["files"], flags_of, strict=True)]
        os.write(1, f"begun {order['number']} {os.getpid()}\n".encode())
        for number, each in enumerate(opened):
            os.dup2(each, number)
            os.close(each)
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - as long as the process lives
        sys.stdout = io.TextIOWrapper(io.FileIO(1, "w", closefd=False), "utf-8", write_through=True)
        sys.stderr = open(2, "w", 1, "utf-8", "backslashreplace", closefd=False)  # noqa: SIM115
        sys.dont_write_bytecode = True
        sys.argv = ["cqos", *order["arguments"]]
        from cqos_core.cli import main

        code = main() or 0
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    _serve()
