#!/usr/bin/env python3
"""Sets C-QoS up in .venv and runs a task. Needs nothing but Python 3.10 or newer.

python3 dev.py demo          check two example diagrams, one that fits and one that does not
python3 dev.py test [ARGS]   all checks: lint, types, import contracts, documentation, tests (ARGS go to pytest)
python3 dev.py setup         install all distributions and build the page of the modeler
python3 dev.py TASK [ARGS]   any other task of [tool.poe.tasks] in pyproject.toml; `.venv/bin/poe` lists them
"""

import sys

# This file has to parse on any Python 3 up to here, so that an old one can tell what is wrong.
if sys.version_info < (3, 10):  # noqa: UP036
    sys.exit("dev.py: this is Python %d.%d, C-QoS needs 3.10 or newer" % sys.version_info[:2])  # noqa: UP031

import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
STAMP = VENV / "cqos-setup.txt"  # written when a setup is complete
LOG = VENV / "cqos-setup.log"
WINDOWS = os.name == "nt"
EXTRAS = "lint,metrics,otel,spark,test,web"
"""The extras of tests and lint. pip passes over those that a distribution does not have."""
FOREIGN_SETTINGS = (
    *("PYTHONHOME", "PYTHONPATH", "PYTHONSAFEPATH", "PYTHONDONTWRITEBYTECODE", "MYPYPATH", "__PYVENV_LAUNCHER__"),
    *("PIP_NO_DEPS", "PIP_PREFIX", "PIP_REQUIRE_HASHES", "PIP_ROOT", "PIP_TARGET", "PIP_USER"),
)
"""Variables that lead Python, pip or mypy out of .venv, or compile every module again in each process."""
DEMO = (
    ("smart_agriculture.bpmn", 0, "A drone and a weather station whose settings fit: exit code 0."),
    ("smart_agriculture_incompatible.bpmn", 1, "Settings that do not fit, with what to change: exit code 1."),
)


class TroubleError(Exception):
    """Something went wrong that one sentence explains."""


def main(arguments: list[str]) -> int:
    """Run a task; return its exit code."""
    task, *rest = arguments or ["--help"]
    if task in {"-h", "--help", "help"}:
        print(__doc__)
        return 0 if arguments else 2
    if rest and task in {"demo", "setup"}:
        raise TroubleError(f"{task} takes no arguments, found {' '.join(rest)!r}")
    if task == "demo":
        return demo()
    setup(extras=EXTRAS)
    build_page()
    if task == "setup":
        print(f"ready: {tool('cqos')}")
        return 0
    return run([tool("poe"), "-C", str(ROOT), task, *rest])


def demo() -> int:
    """Check both example diagrams; return 0 if one is compatible and the other is not."""
    setup(extras="")
    for file, expected, shown in DEMO:
        print(f"\n# {shown}\n$ cqos check examples/{file}", flush=True)
        code = run([tool("cqos"), "check", f"examples/{file}"])
        if code != expected:
            raise TroubleError(f"`cqos check examples/{file}` ended with {code}, not {expected}")
    return 0


def setup(*, extras: str) -> None:
    """Make .venv and install all distributions with these extras, or the light ones without any, unless the last setup did just that."""
    wanted = fingerprint()
    found = STAMP.read_text(encoding="utf-8").splitlines() if STAMP.is_file() else [""]
    if found[0] == wanted and extras in {"", *found[1:]}:
        return
    print("dev.py: setting up .venv (takes up to a minute) ...", file=sys.stderr, flush=True)
    if found[0] == wanted:
        STAMP.unlink()
    else:
        create_venv()
    install(extras)
    STAMP.write_text(f"{wanted}\n{extras}\n", encoding="utf-8")


def fingerprint() -> str:
    """Return a text that changes when .venv has to be made again: with Python, the folder, or what is installed."""
    files = [project / "pyproject.toml" for project in projects()]
    files += [ROOT / "constraints.txt", ROOT / "docs" / "requirements.txt"]
    # Tables of other tools than the build backend change nothing that is installed.
    other = re.compile(r"^\[+tool\.(?!hatch).*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)
    installed = [other.sub("", file.read_text(encoding="utf-8")) for file in files]
    return hashlib.sha256("\0".join([sys.version, sys.base_prefix, str(ROOT), *installed]).encode()).hexdigest()


def projects() -> list[Path]:
    """Return the folders of all distributions, each after those that it needs: pip looks for later ones on an index."""
    waiting = {
        folder: needed_names(folder)
        for folder in [ROOT, *sorted(file.parent for file in ROOT.glob("plugins/*/pyproject.toml"))]
    }
    names = {folder: project_name(folder) for folder in waiting}
    found: list[Path] = []
    while waiting:
        others = {names[folder] for folder in waiting}
        ready = [folder for folder, needed in waiting.items() if not needed & others] or [*waiting]
        found += ready
        for folder in ready:
            del waiting[folder]
    return found


def light_projects() -> list[Path]:
    """Return the core, and the distributions that need nothing else of others: solvers and engines take minutes to install."""
    light: dict[Path, str] = {}
    for folder in projects():
        if folder == ROOT or needed_names(folder) <= {*light.values()}:
            light[folder] = project_name(folder)
    return [*light]


def project_name(folder: Path) -> str:
    """Return the name of a distribution."""
    names: list[str] = re.findall(
        r'^name = "(.+)"', (folder / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE
    )
    return names[0]


def needed_names(folder: Path) -> set[str]:
    """Return the names of the packages that a distribution needs."""
    text = (folder / "pyproject.toml").read_text(encoding="utf-8")
    (listed,) = re.findall(r"^dependencies = \[(.*?)\]", text, re.MULTILINE | re.DOTALL)
    return set(re.findall(r'"([A-Za-z0-9._-]+)', listed))


def create_venv() -> None:
    """Make an empty virtual environment, in place of an existing one."""
    if importlib.util.find_spec("venv") is None or importlib.util.find_spec("ensurepip") is None:
        install_venv_module()
    if VENV.is_symlink():
        VENV.unlink()
    # The Python that .venv may be running now is cleared with it.
    command = [getattr(sys, "_base_executable", sys.executable), "-m", "venv", "--clear", str(VENV)]
    made = subprocess.run(
        command, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if made.returncode != 0:
        raise TroubleError(f"`{' '.join(command)}` failed: {' '.join(made.stdout.split())}")


def install_venv_module() -> None:
    """Install `venv` where Debian packages it apart from Python, or say how."""
    package = f"python3.{sys.version_info.minor}-venv"
    apt_get = shutil.which("apt-get")
    if apt_get is None or sys.base_prefix != "/usr":  # not the Python of the system
        raise TroubleError(f"{sys.executable} comes without the modules venv and ensurepip; use a complete Python")
    advice = f"this Python lacks its venv module; run `apt-get install {package}` as root, then try again"
    if os.geteuid() != 0:  # type: ignore[attr-defined,unused-ignore] # not on Windows, but that is no Debian
        raise TroubleError(advice)
    print(f"dev.py: installing {package}, which this Python needs to make .venv ...", file=sys.stderr, flush=True)
    for arguments in (["update"], ["install", "-y", "--no-install-recommends", package]):
        done = subprocess.run(
            [apt_get, "-qq", *arguments],
            env=os.environ | {"DEBIAN_FRONTEND": "noninteractive"},
            stdout=subprocess.DEVNULL,
            check=False,
        )
    if done.returncode != 0:  # a failed update matters only if the installation fails too
        raise TroubleError(advice)


def install(extras: str) -> None:
    """Install distributions editable, in one pip call so that plugins find the `cqos-core` of this tree."""
    chosen = f"[{extras}]" if extras else ""
    found = projects() if extras else light_projects()
    wanted = [f"--editable=./{project.relative_to(ROOT).as_posix()}{chosen}" for project in found]
    if extras:
        wanted += ["--requirement", "docs/requirements.txt"]
    # Several pinned versions have left Python 3.10 behind; there, the ranges of pyproject.toml hold.
    pinned = ["--constraint", "constraints.txt"] if sys.version_info >= (3, 11) else []
    with LOG.open("w", encoding="utf-8") as log:
        code = subprocess.run(
            [tool("python"), "-m", "pip", "install", *pinned, *wanted],
            cwd=ROOT,
            # The page takes as long as all the rest, and the demo does without it: `build_page` builds it.
            env=environment() | {"HATCH_BUILD_NO_HOOKS": "true"},
            stdout=log,
            stderr=subprocess.STDOUT,
            check=False,
        ).returncode
    if code != 0:
        lines = LOG.read_text(encoding="utf-8", errors="replace").splitlines()
        reason = next((line.strip() for line in lines if line.lstrip().startswith("ERROR:")), lines[-1])
        raise TroubleError(
            f"pip could not install what C-QoS needs: {reason} "
            f"(is a package index reachable? the whole log is {LOG.relative_to(ROOT)})"
        )


def build_page() -> None:
    """Build the page of the modeler if its sources changed; without it, all but the modeler works."""
    if run([tool("python"), "modeler/hatch_build.py"]) != 0 and os.environ.get("CI"):
        raise TroubleError("the page of the modeler is not built")


def run(command: list[str]) -> int:
    """Run a command of .venv in the root of the project; return its exit code."""
    return subprocess.run(command, cwd=ROOT, env=environment(), check=False).returncode


def tool(name: str) -> str:
    """Return the path of a command in the virtual environment."""
    return str(VENV / "Scripts" / f"{name}.exe" if WINDOWS else VENV / "bin" / name)


def environment() -> dict[str, str]:
    """Return the caller's environment without variables that lead out of the virtual environment."""
    kept = {name: value for name, value in os.environ.items() if name not in FOREIGN_SETTINGS}
    return kept | {
        "PATH": os.pathsep.join([str(Path(tool("python")).parent), kept.get("PATH", os.defpath)]),
        "VIRTUAL_ENV": str(VENV),
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        "PIP_NO_INPUT": "1",
        "PIP_ROOT_USER_ACTION": "ignore",
    }


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
    except (TroubleError, OSError) as error:
        sys.exit(f"dev.py: {error}")
