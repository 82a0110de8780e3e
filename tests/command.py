"""Runs the command as a user does, in a process of its own, without its start: that process is forked from one that has imported it.

Where the start itself is what is tried, tests run the installed command.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import io
import json
import os
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

EXAMPLE = Path(__file__).parents[1] / "examples" / "smart_agriculture.bpmn"


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
        order = {
            "arguments": [str(each) for each in arguments],
            "folder": str(folder),
            "environment": dict(environment),
            "files": [str(file) for file in (*files[:2], files[1 if together else 2])],
        }
        server = _server()
        assert server.stdin is not None
        assert server.stdout is not None
        server.stdin.write(json.dumps(order) + "\n")
        server.stdin.flush()
        code = int(server.stdout.readline())
        return Done(code, files[1].read_bytes().decode(), files[2].read_bytes().decode())


def run_here(arguments: Sequence[object], folder: Path) -> Done:
    """Run ``cqos`` in a folder, in this process: what it imports, such as an engine of tables, is there already."""
    from cqos_core.cli import main

    written = io.BytesIO(), io.BytesIO()
    out, err = (io.TextIOWrapper(each, "utf-8", write_through=True) for each in written)
    before = Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main([str(each) for each in arguments])
    finally:
        os.chdir(before)
    said, complained = (each.getvalue().decode() for each in written)
    return Done(code, said, complained)


@cache
def _server() -> subprocess.Popen[str]:
    """The process to fork from; it ends with the tests."""
    server = subprocess.Popen(
        [sys.executable, "-m", "tests.command"],
        cwd=Path(__file__).parents[1],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    atexit.register(server.communicate)
    return server


def _serve() -> None:
    for name in _imported():
        importlib.import_module(name)
    for line in sys.stdin:
        number = os.fork()
        if number == 0:
            _become_the_command(json.loads(line))
        _, status = os.waitpid(number, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)  # noqa: T201 - to the tests


def _imported() -> list[str]:
    """What a check imports; it runs in a process of its own, so that nothing of it is remembered."""
    script = (
        "import sys; from cqos_core.cli import main; main(sys.argv[1:]); "
        "print(*(name for name, each in sys.modules.items() if getattr(each, '__spec__', None)), file=sys.stderr)"
    )
    command = [sys.executable, "-c", script, "check", "--no-config", str(EXAMPLE)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True)
    return [name for name in done.stderr.split() if name != "__main__"]


def _become_the_command(order: dict[str, Any]) -> NoReturn:
    """Take over what a new process has from its parent, and end as one that was started."""
    code = 1
    try:
        os.chdir(order["folder"])
        os.environ.clear()
        os.environ.update(order["environment"])
        sys.path[:0] = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
        flags_of = (os.O_RDONLY, *[os.O_WRONLY | os.O_APPEND] * 2)
        for number, (name, flags) in enumerate(zip(order["files"], flags_of, strict=True)):
            opened = os.open(name, flags)
            os.dup2(opened, number)
            os.close(opened)
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
