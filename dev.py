#!/usr/bin/env python3
"""Sets the project up in .venv and runs it. Needs nothing but Python 3.10 or newer.

python3 dev.py demo             check two example diagrams, one that fits and one that does not
python3 dev.py test [ARGS]      all checks: lint, types, import contracts, tests (ARGS go to pytest; --cov adds coverage)
python3 dev.py lint             the same without the tests
python3 dev.py docs             build the documentation as a site into build/docs/site, and check every link in it
python3 dev.py conformance      run pairs and designs on the middleware itself, record it, and write the pages docs/conformance*.md
python3 dev.py tables [NAME]    write the tables of docs/paper.md (paper) and docs/incidents.md (incidents) again
python3 dev.py build [--check]  wheels and source archives of all distributions in dist/; --check tries them as users do
python3 dev.py goldens [ARGS]   record what C-QoS says of many systems as text (--check: compare; --against REV: with other code)
python3 dev.py bench [ARGS]     measure what C-QoS costs beside the bare work (--scale 0.1: shorter; --only pairs files ...)
python3 dev.py explore [ARGS]   what `test` tries in short: all of it, and many new random examples (ARGS go to pytest)
python3 dev.py run -- ARGS      the command `cqos` with ARGS
python3 dev.py setup            only set up (the others do that by themselves, when something changed)
"""

import sys

# First of all, and in words that any Python 3 understands: the rest of this file does not run on an older one.
if sys.version_info < (3, 10):  # noqa: UP036 - said before anything fails
    sys.exit("dev.py: this is Python %d.%d, C-QoS needs 3.10 or newer" % sys.version_info[:2])  # noqa: UP031

import hashlib
import importlib.util
import json
import os
import re
import shutil
import subprocess
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:  # the pip that comes with Python brings a reader of TOML
    import ensurepip

    bundled = [
        *Path(ensurepip.__file__).parent.glob("_bundled/pip-*.whl"),
        *Path("/usr/share/python-wheels").glob("pip-*.whl"),
    ]
    sys.path += map(str, bundled)
    from pip._vendor import tomli as tomllib

Step = tuple[str, list[str]]
"""A name and a command."""

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
STAMP = VENV / "cqos-setup.json"  # written when a setup is complete, and only then
LOG = VENV / "cqos-setup.log"
WINDOWS = os.name == "nt"
# What `test` and `lint` need beyond `demo` and `run`.
EXTRAS = ("test", "lint", "web", "metrics", "otel", "source", "bulk", "spark", "repair")

CONSTRAINTS = ("constraints.txt", "docs/constraints.txt")

# Of the environment's PIP_* settings those that say how to reach packages; the others (a target directory, a user
# installation, a hash check, ...) would install something else or elsewhere.
PIP_SETTINGS = frozenset(
    "PIP_" + name
    for name in (
        *(
            "CACHE_DIR",
            "CERT",
            "CLIENT_CERT",
            "CONFIG_FILE",
            "DEFAULT_TIMEOUT",
            "EXTRA_INDEX_URL",
            "FIND_LINKS",
        ),
        *("INDEX_URL", "KEYRING_PROVIDER", "NO_CACHE_DIR", "NO_INDEX", "PROXY", "RETRIES", "TIMEOUT"),
        *("TRUSTED_HOST", "USE_FEATURE"),
    )
)
# These make a Python or a type checker look elsewhere than into .venv, or compile everything again in each process.
FOREIGN_SETTINGS = frozenset(
    {"PYTHONHOME", "PYTHONPATH", "PYTHONSAFEPATH", "PYTHONDONTWRITEBYTECODE", "MYPYPATH", "__PYVENV_LAUNCHER__"}
)


class TroubleError(Exception):
    """Something went wrong that one sentence explains."""


def main(arguments: list[str]) -> int:
    """Run one command; return the exit code."""
    commands = {
        "demo": demo,
        "test": test,
        "explore": explore,
        "lint": lint,
        "docs": docs,
        "conformance": conformance,
        "tables": tables,
        "build": build,
        "bench": bench,
        "goldens": goldens,
        "run": run,
        "setup": setup_everything,
    }
    name, *rest = arguments or ["--help"]
    if name in {"-h", "--help", "help"}:
        print(__doc__)
        return 0 if arguments else 2
    if name not in commands:
        raise TroubleError(f"there is no command {name!r}; there are {', '.join(commands)}")
    if rest and name in {"demo", "lint", "docs", "conformance", "setup"}:
        raise TroubleError(f"{name} takes no arguments, found {' '.join(rest)!r}")
    return commands[name](rest[1:] if rest[:1] == ["--"] else rest)


# --- commands ---------------------------------------------------------------------------------------------------


def demo(_: list[str]) -> int:
    """Check both example diagrams; return 0 if one is compatible and the other is not."""
    setup(everything=False)
    shows = (
        ("smart_agriculture.bpmn", 0, "A drone and a weather station whose settings fit: exit code 0."),
        (
            "smart_agriculture_incompatible.bpmn",
            1,
            "The same system with settings that do not fit, and for each what to change: exit code 1.",
        ),
    )
    for file, expected, shown in shows:
        command = ["cqos", "check", f"examples/{file}"]
        print(f"\n# {shown}\n$ {' '.join(command)}", flush=True)
        code = subprocess.run([tool("cqos"), *command[1:]], cwd=ROOT, env=environment(), check=False).returncode
        if code != expected:
            raise TroubleError(f"the demo does not behave: `{' '.join(command)}` ended with {code}, not {expected}")
    return 0


def test(arguments: list[str]) -> int:
    """Run all checks and tests; return 1 if any fails."""
    setup(everything=True)
    have_programs()
    build_page()
    # One seed for the order of sets too: the same tests give the same answer every time.
    os.environ.setdefault("PYTHONHASHSEED", "0")
    return run_steps([("pytest", pytest_command(arguments))], beside=[lint_steps(), docs_steps()])


def explore(arguments: list[str]) -> int:
    """Run the long form of tests, and random examples that no run had before; a failing example becomes a case."""
    setup(everything=True)
    have_programs()
    os.environ["CQOS_HYPOTHESIS"] = "explore"
    return run_steps([("pytest", pytest_command(["-m", "hypothesis or explored", *arguments]))])


def lint(_: list[str]) -> int:
    """Run the static checks; return 1 if any fails."""
    setup(everything=True)
    return run_steps(lint_steps())


def docs(_: list[str]) -> int:
    """Build the documentation as a site; return 1 if a link or an anchor is broken."""
    setup(everything=True)
    return run_steps(docs_steps())


def conformance(_: list[str]) -> int:
    """Run many pairs and all designs on the middleware itself; return 1 if any differs from what C-QoS says."""
    setup(everything=True)
    have_programs()
    runs = (
        ("proofs", "200", "2026"),
        ("guarantees", "cyclonedds", "fastdds", "mosquitto"),
        ("spin_comparison", "record"),
        ("budgets",),
        ("table", "20000", "2026"),
        ("mqtt_table",),
    )
    steps = [(name, [tool("python"), "-m", f"tests.conformance.{name}", *arguments]) for name, *arguments in runs]
    steps += [("behaviour", [tool("python"), "-m", "tests.oracle.record", "10000", "200"])]
    os.environ["CQOS_HYPOTHESIS"] = "explore"
    return run_steps([*steps, ("faults", [tool("pytest"), "-m", "explored", "tests/conformance"])])


def tables(arguments: list[str]) -> int:
    """Write the tables of the paper and of the public incidents again; return 1 if that fails."""
    setup(everything=True)
    return run_steps([("tables", [tool("python"), "-m", "tests.paper_tables", *arguments])])


def bench(arguments: list[str]) -> int:
    """Measure what C-QoS costs, and print the table of docs/benchmarks.md."""
    setup(everything=True)
    return run_steps([("bench", [tool("python"), "-m", "tests.benchmarks", *arguments])])


def goldens(arguments: list[str]) -> int:
    """Record or compare all reports of the goldens; return 1 if a comparison finds a difference."""
    setup(everything=True)
    return run_steps([("goldens", [tool("python"), "-m", "tests.goldens.record", *arguments])])


def build(arguments: list[str]) -> int:
    """Build every distribution and check its contents; return 1 if anything is missing."""
    setup(everything=True)
    build_page()
    steps = [("build", [tool("python"), "deploy/build.py", *arguments])]
    if "--check" in arguments:
        newest = re.findall(r"Python :: (3\.\d+)", str(read_project(ROOT)["project"]["classifiers"]))[-1]
        steps += [("mypy for the newest Python", [tool("mypy"), f"--python-version={newest}", *packages()])]
    return run_steps(steps)


def run(arguments: list[str]) -> int:
    """Run `cqos` where the caller stands; return its exit code."""
    modeler = arguments[:1] == ["modeler"]
    setup(everything=modeler)
    if modeler:
        build_page()
    return subprocess.run([tool("cqos"), *arguments], env=environment(), check=False).returncode


def setup_everything(_: list[str]) -> int:
    """Set up for every command."""
    setup(everything=True)
    build_page()
    print(f"ready: {tool('cqos')}")
    return 0


# --- steps of test and lint -------------------------------------------------------------------------------------


def lint_steps() -> list[Step]:
    """Names and commands of the static checks."""
    oldest = f"--python-version={oldest_python()}"
    tests = [project / "tests" for project in projects()]
    scripts = [
        *ROOT.glob("*.py"),
        *ROOT.glob("docs/*.py"),
        *ROOT.glob("deploy/*.py"),
        *ROOT.glob("proto/*.py"),
        ROOT / "examples",
        *(path for path in tests if path.is_dir()),
    ]
    return [
        ("ruff check", [tool("ruff"), "check", "."]),
        ("ruff format", [tool("ruff"), "format", "--check", "."]),
        # for the oldest Python that they run on; what it lacks would be found by its users otherwise
        ("mypy", [tool("mypy"), oldest, *packages()]),
        # apart from the packages, which have one name when imported and another as files below plugins/; for the same Python,
        # so that what was found of the packages holds here too
        ("mypy on tests", [tool("mypy"), oldest, *(str(path.relative_to(ROOT)) for path in scripts)]),
        ("import contracts", [tool("lint-imports"), "--no-cache"]),
    ]


def docs_steps() -> list[Step]:
    """The build of the site, where its generator runs on this Python."""
    if subprocess.run([tool("python"), "-c", "import zensical"], capture_output=True, check=False).returncode:
        print("dev.py: the site is not built, its generator needs Python 3.11.5 or newer", file=sys.stderr, flush=True)
        return []
    return [("docs site", [tool("python"), "docs/build_site.py"])]


def packages() -> list[str]:
    """Arguments of mypy: every import package that a distribution ships."""
    return [argument for project in projects() for name in packages_of(project) for argument in ("-p", name)]


def pytest_command(arguments: list[str]) -> list[str]:
    """Pytest on all cores; ``arguments`` come last and win, and a bare ``--cov`` covers every package.

    Two processes more than there are cores, because many tests wait for a service, a browser or the middleware.
    """
    covered = [f"--cov={name}" for project in projects() for name in packages_of(project)]
    rest = [argument for argument in arguments if argument != "--cov"]
    # Counting lines doubles the time, so it is off by default.
    coverage = [*covered, "--cov-report=term:skip-covered"] if "--cov" in arguments else []
    return [tool("pytest"), "-n", str((os.cpu_count() or 1) + 2), "--dist", "worksteal", *coverage, *rest]


def run_steps(steps: list[Step], beside: Sequence[list[Step]] = ()) -> int:
    """Run every step, also after one failed; return 1 if any did.

    Each list in ``beside`` runs meanwhile, one step after another, and is printed at the end.
    """
    with ThreadPoolExecutor(max(len(beside), 1)) as pool:
        waiting = [pool.submit(run_quietly, others) for others in beside]
        failed = []
        for name, command in steps:
            print(f"\n== {name}", flush=True)
            if subprocess.run(command, cwd=ROOT, env=environment(), check=False).returncode != 0:
                failed.append(name)
        for name, code, output in chain.from_iterable(each.result() for each in waiting):
            if code != 0:
                failed.append(name)
            print(f"\n== {name}\n{output.rstrip()}", flush=True)
    passed = [name for name, _ in chain(steps, *beside) if name not in failed]
    print(f"\npassed: {', '.join(passed) or 'nothing'}")
    if failed:
        print(f"FAILED: {', '.join(failed)}")
    return 1 if failed else 0


def run_quietly(steps: list[Step]) -> list[tuple[str, int, str]]:
    """Run every step; return name, exit code and output of each."""
    found = []
    for name, command in steps:
        done = subprocess.run(
            command,
            cwd=ROOT,
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        found.append((name, done.returncode, done.stdout.decode(errors="replace")))
    return found


# --- projects ---------------------------------------------------------------------------------------------------


def projects() -> list[Path]:
    """The directories of all distributions: the root, the plugins, and `all` at the end.

    pip of Python 3.11 looks for parts on an index if what needs them comes before them.
    """
    plugins = (file.parent for file in ROOT.glob("plugins/*/pyproject.toml"))
    return [ROOT, *sorted(plugins, key=lambda folder: (folder.name == "all", folder))]


def read_project(project: Path) -> dict[str, dict[str, object]]:
    """The content of a distribution's pyproject.toml."""
    file = project / "pyproject.toml"
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise TroubleError(f"cannot read {file.relative_to(ROOT)}: {error}") from None


def oldest_python() -> str:
    """The oldest Python that the distributions run on, for instance ``3.10``."""
    return str(read_project(ROOT)["project"]["requires-python"]).removeprefix(">=")


def packages_of(project: Path) -> list[str]:
    """The import packages a distribution ships, as its pyproject.toml says."""
    value: object = read_project(project).get("tool", {})
    for key in ("hatch", "build", "targets", "wheel", "packages"):
        value = value.get(key) if isinstance(value, dict) else None
    if not isinstance(value, list):
        raise TroubleError(f"{project.name}/pyproject.toml names no packages in [tool.hatch.build.targets.wheel]")
    return [Path(package).name for package in value]


# --- the virtual environment ------------------------------------------------------------------------------------


def tool(name: str) -> str:
    """The path of a command in the virtual environment."""
    return str(VENV / "Scripts" / f"{name}.exe" if WINDOWS else VENV / "bin" / name)


def environment() -> dict[str, str]:
    """The caller's environment without variables that would bypass the virtual environment."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in FOREIGN_SETTINGS and (not name.startswith("PIP_") or name in PIP_SETTINGS)
    }
    path = str(Path(tool("python")).parent)
    return kept | {
        "PATH": os.pathsep.join([path, kept["PATH"]] if "PATH" in kept else [path]),
        "VIRTUAL_ENV": str(VENV),
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        "PIP_NO_INPUT": "1",
        "PIP_ROOT_USER_ACTION": "ignore",
        "PIP_USER": "0",
    }


def setup(*, everything: bool) -> None:
    """Set .venv up: with ``everything`` for all commands, else for `demo` and `run`.

    A complete setup leaves a stamp; with the right stamp there is nothing to do, without it all is made anew.
    """
    wanted = fingerprint()
    found = read_stamp()
    if found == (wanted, True) or (found == (wanted, False) and not everything):
        return
    began = time.monotonic()
    print("dev.py: setting up .venv (takes up to a minute) ...", file=sys.stderr, flush=True)
    if found == (wanted, False):
        STAMP.unlink()  # until the rest is installed too
    else:
        create_venv()
    install(everything=everything)
    STAMP.write_text(json.dumps({"fingerprint": wanted, "everything": everything}), encoding="utf-8")
    print(f"dev.py: set up in {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)


def build_page() -> None:
    """Build the page of the modeler if its sources changed; without it, all but the modeler works."""
    done = subprocess.run([tool("python"), "deploy/page.py"], cwd=ROOT, env=environment(), check=False)
    if done.returncode != 0 and os.environ.get("CI"):
        raise TroubleError("the page of the modeler is not built")


def fingerprint() -> str:
    """Return a text that differs when .venv must be rebuilt: another Python, place, dependency, entry point or plugin."""
    parts: dict[str, object] = {
        "python": [sys.version, sys.base_prefix],
        "place": str(ROOT),
        "constraints": [(ROOT / name).read_text(encoding="utf-8") for name in CONSTRAINTS],
        "groups": read_project(ROOT).get("dependency-groups"),
    }
    for project in projects():
        content = read_project(project)
        installed = {key: content.get(key) for key in ("build-system", "project")}  # and no settings of linters
        parts[str(project.relative_to(ROOT))] = [installed, packages_of(project)]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def read_stamp() -> tuple[str, bool] | None:
    """Return the fingerprint of the last complete setup; None without one."""
    try:
        stamp = json.loads(STAMP.read_text(encoding="utf-8"))
        return (stamp["fingerprint"], stamp["everything"]) if Path(tool("python")).exists() else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def create_venv() -> None:
    """Make an empty virtual environment, in place of an existing one."""
    if VENV.is_symlink() or VENV.is_file():
        VENV.unlink()
    elif VENV.exists():
        shutil.rmtree(VENV)
    if importlib.util.find_spec("venv") is None or importlib.util.find_spec("ensurepip") is None:
        install_venv_module()
    made = subprocess.run(
        [base_python(), "-m", "venv", str(VENV)],
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if made.returncode != 0:
        reason = " ".join(made.stdout.split()) or f"exit code {made.returncode}"
        raise TroubleError(f"`{base_python()} -m venv` does not work here: {reason}")


def base_python() -> str:
    """The Python that runs this script; the one it was made from, if it lives in a virtual environment itself."""
    if sys.prefix == sys.base_prefix:
        return sys.executable
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    names = ["python.exe"] if WINDOWS else [f"bin/python{version}", "bin/python3"]
    for name in names:
        if (Path(sys.base_prefix) / name).exists():
            return str(Path(sys.base_prefix) / name)
    return sys.executable


def install_venv_module() -> None:
    """Debian and its relatives package `venv` apart from Python: install it if we may, else say how."""
    package = f"python3.{sys.version_info.minor}-venv"
    apt_get = shutil.which("apt-get")
    if apt_get is None or sys.base_prefix != "/usr":  # not the distribution's own Python
        raise TroubleError(f"{sys.executable} comes without the modules venv and ensurepip; use a complete Python")
    advice = f"this Python lacks its venv module; run: apt-get install {package} (as root), then try again"
    if os.geteuid() != 0:  # type: ignore[attr-defined,unused-ignore] # not on Windows, but that is no Debian
        raise TroubleError(advice)
    print(
        f"dev.py: installing {package}, which this Python needs to make .venv ...",
        file=sys.stderr,
        flush=True,
    )
    if not installed_by(apt_get, package):
        raise TroubleError(advice)


# Programs and headers that some tests need, the package of the system that has them, and what is left out without.
PROGRAMS = (
    ("g++", "g++", "no pair runs on Fast DDS"),
    ("fastdds/config.hpp|fastrtps/config.h", "libfastrtps-dev", "no pair runs on Fast DDS"),
    ("mosquitto", "mosquitto", "the MQTT pack is not compared with Mosquitto"),
    ("spin", "spin", "SPIN gives no second opinion on MQTT"),
    ("gcc", "gcc", "SPIN gives no second opinion on MQTT"),
    ("ip", "iproute2", "the traffic of Cyclone DDS is not measured"),
    ("java", "default-jre-headless", "no audit runs on a Spark cluster"),
    (
        "chromium-headless-shell|chromium|chromium-browser|google-chrome",
        "chromium-headless-shell",
        "the page of the modeler is not tried",
    ),
    ("nvim", "neovim", "the language server is not tried in an editor"),
    ("zsh", "zsh", "completion is not tried in zsh"),
    ("fish", "fish", "completion is not tried in fish"),
    ("dot", "graphviz", "graphs are not read by Graphviz"),
    ("systemd-analyze", "systemd", "the unit of the service is not read by systemd"),
)
INCLUDES = Path("/usr/include")
SYSTEM_FOLDERS = "/usr/sbin:/usr/local/sbin:/opt/homebrew/sbin"


def have_programs() -> None:
    """Install the programs and headers that tests need where we may, else say what is left out."""
    for programs, package, left_out in PROGRAMS:
        if any(map(is_there, programs.split("|"))):
            continue
        apt_get = shutil.which("apt-get")
        if apt_get is not None and os.geteuid() == 0:  # type: ignore[attr-defined,unused-ignore]
            print(f"dev.py: installing {package}, which tests need ...", file=sys.stderr, flush=True)
            if installed_by(apt_get, package):
                continue
        message = f"dev.py: {package} is not installed, so {left_out} (apt-get install {package})"
        print(message, file=sys.stderr, flush=True)


def is_there(program: str) -> bool:
    """Whether a program can be started, or a header included."""
    if shutil.which(program) or shutil.which(program, path=SYSTEM_FOLDERS):
        return True
    return any(True for pattern in (program, f"*-linux-*/{program}") for _ in INCLUDES.glob(pattern))


def installed_by(apt_get: str, package: str) -> bool:
    """Install a package of the system; say whether that worked."""
    for arguments in (["update"], ["install", "-y", "--no-install-recommends", package]):
        done = subprocess.run(
            [apt_get, "-qq", *arguments],
            env=os.environ | {"DEBIAN_FRONTEND": "noninteractive"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            check=False,
        )
    return done.returncode == 0  # of the installation; a failed update matters only if that fails too


def install(*, everything: bool) -> None:
    """Install all distributions editable, in one pip call so that plugins find the `cqos` of this tree."""
    wanted: list[str] = []
    for project in projects():
        extras = read_project(project)["project"].get("optional-dependencies", {})
        chosen = [extra for extra in EXTRAS if everything and isinstance(extras, dict) and extra in extras]
        place = f"./{project.relative_to(ROOT).as_posix()}"
        wanted += ["-e", f"{place}[{','.join(chosen)}]" if chosen else place]
    groups = read_project(ROOT).get("dependency-groups", {})
    wanted += [
        str(requirement) for group in groups.values() if everything and isinstance(group, list) for requirement in group
    ]
    # Several of the versions that are pinned have left Python 3.10 behind; there, the ranges of pyproject.toml hold.
    pinned = CONSTRAINTS if sys.version_info >= (3, 11) else ()
    constraints = [argument for name in pinned for argument in ("-c", name)]
    with LOG.open("w", encoding="utf-8") as log:
        code = subprocess.run(
            [tool("python"), "-m", "pip", "install", *constraints, *wanted],
            cwd=ROOT,
            # The page takes as long as all the rest, and the demo does without it: `build_page` builds it.
            env=environment() | {"HATCH_BUILD_NO_HOOKS": "true"},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            check=False,
        ).returncode
    if code != 0:
        lines = LOG.read_text(encoding="utf-8", errors="replace").splitlines()
        errors = [line.strip() for line in lines if line.lstrip().startswith("ERROR:")]
        reason = errors[0] if errors else " ".join(lines[-1:])
        raise TroubleError(
            f"pip could not install what C-QoS needs: {reason} "
            f"(is a package index reachable? the whole log is {LOG.relative_to(ROOT)})"
        )


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
    except (TroubleError, OSError) as error:
        sys.exit(f"dev.py: {error}")
