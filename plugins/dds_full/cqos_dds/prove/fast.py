"""Runs pairs on Fast DDS 2, with a program that is compiled on first use."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from cqos_core.analysis.proving import NotRunnableError
from cqos_dds.prove.dds import Implementation

if TYPE_CHECKING:
    from collections.abc import Callable

    from cqos_dds.prove.stage import Running

_INSTALL: Final = "apt-get install g++ libfastrtps-dev (Debian and Ubuntu)"
_FLAGS: Final = ("-std=c++17", "-O1")
_ENVIRONMENT: Final = {"SKIP_DEFAULT_XML": "1", "FASTRTPS_DEFAULT_PROFILES_FILE": "", "ROS_DISCOVERY_SERVER": ""}
"""Keeps what the user has configured for other programs away."""
_LIBRARIES: Final = ("-lfastrtps", "-lfastcdr", "-lpthread")


class _FastDds(Implementation):
    title = "Fast DDS"
    name = "fastdds_2_9"
    recover = 4.0  # it sends heartbeats every 3 s

    def missing(self) -> str | None:
        """Say what to install, where the compiler or the library is not there."""
        if _compiler() is None:
            return f"a C++ compiler is not installed, which Fast DDS needs here: {_INSTALL}"
        return None if _library_version() else f"Fast DDS 2 and its headers are not installed: {_INSTALL}"

    def version(self) -> str:
        """Return the version of the library that is installed."""
        return _library_version() or "?"

    def starter(self) -> Callable[[], Running]:
        """Run the program, compiled if it is not in the cache."""
        program = str(_program())
        return lambda: _started(program)


PROVER: Final = _FastDds()


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


@cache
def _library_version() -> str | None:
    """Return the version in the headers of the library, None where there are no headers."""
    compiler = _compiler()
    if compiler is None:
        return None
    asked = subprocess.run(  # noqa: S603 - the compiler of this machine
        [compiler, "-E", "-P", "-x", "c++", "-"],
        input="#include <fastrtps/config.h>\nversion FASTRTPS_VERSION_STR\n",
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [line for line in asked.stdout.splitlines() if line.startswith("version ")]
    return lines[-1].removeprefix("version ").strip('"') if asked.returncode == 0 and lines else None


@cache
def _program() -> Path:
    """Return the program of the ends, and compile it if no earlier run did.

    Raises:
        NotRunnableError: it does not compile here.
    """
    source = files("cqos_dds.prove").joinpath("fast_end.cpp").read_bytes()
    compiler = _compiler() or "g++"
    made_of = b"\0".join([source, compiler.encode(), (_library_version() or "").encode(), " ".join(_FLAGS).encode()])
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "cqos"
    program = folder / f"fast_end-{sha256(made_of).hexdigest()[:16]}"
    if program.exists():
        return program
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            text, made = Path(scratch) / "fast_end.cpp", Path(scratch) / "fast_end"
            text.write_bytes(source)
            done = subprocess.run(  # noqa: S603 - the compiler of this machine
                [compiler, *_FLAGS, str(text), "-o", str(made), *_LIBRARIES],
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode != 0:
                first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[-200:])
                raise NotRunnableError(f"the program for Fast DDS does not compile here: {first.strip()}")
            made.replace(program)
    except OSError as error:
        raise NotRunnableError(
            f"the program for Fast DDS cannot be kept in {folder}: {error.strerror}; set XDG_CACHE_HOME to a folder "
            "that can be written"
        ) from None
    return program
