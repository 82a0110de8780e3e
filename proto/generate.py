"""Writes the Python code for the .proto files, below proto/python. Needs Python and a package index, and npm for buf.

python proto/generate.py            write
python proto/generate.py --check    list generated files that differ; lint the .proto files, and compare them with the last
                                    release; fail on a difference, a lint error or a breaking change
python proto/generate.py --release  write proto/released.binpb, with which later versions are compared

The tools have pinned versions, in an environment of their own below .venv. Code from newer tools refuses to run with an
older protobuf or grpcio than theirs. Users of C-QoS may have any version of the stated range.
"""  # noqa: INP001 - a script

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PROTO = Path(__file__).resolve().parent
ROOT = PROTO.parent
PYTHON = PROTO / "python"
RELEASED = PROTO / "released.binpb"
TOOLS = ROOT / ".venv" / "generate"
PINNED = ("grpcio-tools==1.74.0", "mypy-protobuf==5.1.0")
BUF = "@bufbuild/buf@1.75.0"
SHORT_NAME = '''"""C-QoS by its short name: all that `cqos_core` has, loaded on first use; in `cqos.v1`, what .proto files make."""

from typing import TYPE_CHECKING

import cqos_core

if TYPE_CHECKING:
    from cqos_core import *
else:

    def __getattr__(name):
        """Return what `cqos_core` has under this name."""
        return getattr(cqos_core, name)


def __dir__() -> list[str]:
    """List the public names."""
    return [*dir(cqos_core), "v1"]
'''
PACKAGES = {
    "cqos/__init__.py": SHORT_NAME,
    "cqos/v1/__init__.py": '"""Messages and stubs of version 1; the .proto files beside them say what each field means."""\n',
    "cqos/py.typed": "",
}


class TroubleError(Exception):
    """An error that one sentence explains."""


def main(arguments: list[str]) -> int:
    """Do what the arguments ask for."""
    known = {"--check", "--release"}
    if len(arguments) > 1 or not known.issuperset(arguments):
        sys.stderr.write(__doc__ or "")
        return 2
    if "--release" in arguments:
        run([buf(), "build", "--exclude-source-info", "-o", str(RELEASED)], PROTO)
        return 0
    wanted = generated()
    written = {
        path.relative_to(PYTHON).as_posix(): path.read_text(encoding="utf-8")
        for path in PYTHON.rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    differing = sorted(name for name in {*wanted, *written} if wanted.get(name) != written.get(name))
    for name in differing:
        say(f"{'differs' if '--check' in arguments else 'written'}: proto/python/{name}")
    if "--check" in arguments:
        if differing:
            say("run: python proto/generate.py")
        return 1 if differing or not contract_holds() else 0
    shutil.rmtree(PYTHON, ignore_errors=True)
    for name, text in wanted.items():
        file = PYTHON / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return 0


def generated() -> dict[str, str]:
    """Every file that belongs below proto/python, with its text."""
    python = tools()
    sources = sorted(path.relative_to(PROTO).as_posix() for path in PROTO.glob("cqos/v1/*.proto"))
    with tempfile.TemporaryDirectory() as folder:
        outputs = [f"--{kind}_out={folder}" for kind in ("python", "grpc_python", "mypy", "mypy_grpc")]
        # The plugins for stubs are in the folder of that Python.
        path = os.pathsep.join([str(python.parent), os.environ.get("PATH", "")])
        run([str(python), "-m", "grpc_tools.protoc", f"-I{PROTO}", *outputs, *sources], PROTO, PATH=path)
        made = {
            file.relative_to(folder).as_posix(): file.read_text(encoding="utf-8")
            for file in Path(folder).rglob("*")
            if file.is_file() and not is_empty(file)
        }
    return {**made, **PACKAGES}


def is_empty(file: Path) -> bool:
    """Whether it is made for the services of a file that has none."""
    source = PROTO / "cqos" / "v1" / f"{file.name.partition('_pb2')[0]}.proto"
    return "_pb2_grpc." in file.name and "\nservice " not in source.read_text(encoding="utf-8")


def contract_holds() -> bool:
    """Lint the .proto files and compare them with the last release."""
    try:
        tool = buf()
    except TroubleError as error:
        say(f"neither linted nor compared with the last release: {error}")
        return not os.environ.get("CI")
    steps = [[tool, "lint"], [tool, "format", "--diff", "--exit-code"], [tool, "breaking", "--against", str(RELEASED)]]
    return all([subprocess.run(step, cwd=PROTO, check=False).returncode == 0 for step in steps])  # noqa: C419, S603 - all are run


def tools() -> Path:
    """The Python of an environment with the pinned tools; creates a missing one."""
    python = TOOLS / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    stamp = TOOLS / "pinned.txt"
    if not stamp.is_file() or stamp.read_text(encoding="utf-8") != "\n".join(PINNED):
        run([sys.executable, "-m", "venv", "--clear", str(TOOLS)], ROOT)
        run([str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PINNED], ROOT)
        stamp.write_text("\n".join(PINNED), encoding="utf-8")
    return python


def buf() -> str:
    """The path of buf, which npm installs beside the other tools."""
    folder = TOOLS / BUF.rpartition("@")[2]
    tool = folder / "node_modules" / ".bin" / ("buf.cmd" if os.name == "nt" else "buf")
    if not tool.exists():
        npm = shutil.which("npm")
        if npm is None:
            raise TroubleError("buf comes through npm, which is not installed")
        # Two may install it at the same time: the first whole one is taken.
        TOOLS.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=TOOLS) as made:
            run([npm, "install", "--silent", "--no-audit", "--no-fund", "--prefix", made, BUF], ROOT)
            folder.mkdir(exist_ok=True)
            with contextlib.suppress(OSError):
                (Path(made) / "node_modules").rename(folder / "node_modules")
    return str(tool)


def run(command: list[str], folder: Path, **variables: str) -> None:
    """Run a tool; what it prints is shown where it fails."""
    done = subprocess.run(  # noqa: S603
        command,
        cwd=folder,
        env={**os.environ, **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise TroubleError(f"`{' '.join(command)}` failed:\n{done.stdout}")


def say(text: str) -> None:
    """Tell the caller."""
    sys.stdout.write(f"{text}\n")


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except (TroubleError, OSError) as error:
        sys.exit(f"generate.py: {error}")
