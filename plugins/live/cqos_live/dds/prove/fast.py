"""Runs pairs on Fast DDS 2 or 3, whichever is installed, with a program that is compiled on first use."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import threading
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from cqos_core.packs.prover import NotRunnableError
from cqos_dds.implementations import FAST_DDS
from cqos_live.dds.prove.dds import Implementation

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_live.dds.prove.stage import Running

_INSTALL: Final = "apt-get install g++ libfastrtps-dev (Debian and Ubuntu)"
_FLAGS: Final = ("-std=c++17", "-O1")
_ENVIRONMENT: Final = {
    "SKIP_DEFAULT_XML": "1",
    "FASTRTPS_DEFAULT_PROFILES_FILE": "",
    "FASTDDS_DEFAULT_PROFILES_FILE": "",
    "ROS_DISCOVERY_SERVER": "",
}
"""Keeps what the user has configured for other programs away."""
_SINCE: Final = (((3, 5), FAST_DDS[2]), ((3, 0), FAST_DDS[1]), ((0, 0), FAST_DDS[0]))
"""As which variant of the pack a version behaves."""
_COMPILING: Final = threading.Lock()


class _FastDds(Implementation):
    title = "Fast DDS"
    recover = 4.0  # it sends heartbeats every 3 s

    def missing(self) -> str | None:
        """Say what to install, where the compiler or the library is not there."""
        if _compiler() is None:
            return f"a C++ compiler is not installed, which Fast DDS needs here: {_INSTALL}"
        return None if _library_version() else f"Fast DDS and its headers are not installed: {_INSTALL}"

    def version(self) -> str:
        """Return the version of the library that is installed."""
        return _library_version() or "?"

    def implementation(self) -> str:
        """Return the variant that behaves as the version that is installed; the oldest where none is."""
        return variant(self.version())

    def starter(self) -> Callable[[], Running]:
        """Run the program, compiled if it is not in the cache."""
        with _COMPILING:  # pairs that run at the same time wait for one compilation
            program = str(_program())
        return lambda: _started(program)


PROVER: Final = _FastDds()


def variant(version: str) -> str:
    """Return the value of the option ``implementation`` for a version such as ``3.1.2``, the oldest for one that is not known."""
    major, minor, *_ = (int(part) if part.isdecimal() else 0 for part in f"{version}.0".split("."))
    return next(name for since, name in _SINCE if (major, minor) >= since)


def compile_program(source: bytes, program: Path) -> None:
    """Compile a program that includes ``fast_dds.hpp``.

    Args:
        source: its text.
        program: the file to make, in a folder that exists.

    Raises:
        NotRunnableError: it does not compile here.
        OSError: nothing can be written there.
    """
    library = "fastrtps" if PROVER.implementation() == FAST_DDS[0] else "fastdds"
    with tempfile.TemporaryDirectory(dir=program.parent) as scratch:
        (Path(scratch) / "program.cpp").write_bytes(source)
        (Path(scratch) / "fast_dds.hpp").write_bytes(_header())
        done = subprocess.run(  # noqa: S603 - the compiler of this machine
            [_compiler() or "g++", *_FLAGS, "program.cpp", "-o", "made", f"-l{library}", "-lfastcdr", "-lpthread"],
            cwd=scratch,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[-200:])
            raise NotRunnableError(f"the program for Fast DDS does not compile here: {first.strip()}")
        (Path(scratch) / "made").replace(program)


def _started(program: str) -> Running:
    started = subprocess.Popen(  # noqa: S603 - what was compiled here
        [program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        errors="replace",
        env={**os.environ, **_ENVIRONMENT},
    )
    return cast("Running", started)


def _compiler() -> str | None:
    return shutil.which(os.environ.get("CXX") or "g++")


def _header() -> bytes:
    return files(__package__).joinpath("fast_dds.hpp").read_bytes()


@cache
def _library_version() -> str | None:
    """Return the version in the headers of the library, None where there are no headers."""
    compiler = _compiler()
    if compiler is None:
        return None
    asked = subprocess.run(  # noqa: S603 - the compiler of this machine
        [compiler, *_FLAGS, "-E", "-P", "-x", "c++", "-"],
        input=_header() + b"\nversion FASTDDS_VERSION_STR\n",
        capture_output=True,
        check=False,
    )
    lines = [line for line in asked.stdout.decode().splitlines() if line.startswith("version ")]
    return lines[-1].removeprefix("version ").strip('"') if asked.returncode == 0 and lines else None


@cache
def _program() -> Path:
    """Return the program of the ends, and compile it if no earlier run did.

    Raises:
        NotRunnableError: it does not compile here.
    """
    source = files(__package__).joinpath("fast_end.cpp").read_bytes()
    built_with = "\0".join([_compiler() or "", PROVER.version(), *_FLAGS])
    made_of = b"\0".join([source, _header(), built_with.encode()])
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "cqos"
    program = folder / f"fast_end-{sha256(made_of).hexdigest()[:16]}"
    if program.exists():
        return program
    try:
        folder.mkdir(parents=True, exist_ok=True)
        compile_program(source, program)
    except OSError as error:
        raise NotRunnableError(
            f"the program for Fast DDS cannot be kept in {folder}: {error.strerror}; set XDG_CACHE_HOME to a folder "
            "that can be written"
        ) from None
    return program
