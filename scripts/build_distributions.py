"""Builds the wheel and the source archive of every distribution, and checks their contents.

python scripts/build_distributions.py [--output FOLDER]   build into dist/, or elsewhere; needs no network
python scripts/build_distributions.py --check             then test it as users do: rebuild each wheel from its source archive,
                                                          fill a wheelhouse, install from it without network, use it,
                                                          write the SBOM; check types for the newest Python, too

The bytes follow from the files and the time of the last commit alone: two builds are equal, byte for byte.
"""  # noqa: INP001 - a script

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from pathlib import Path, PurePosixPath

from packaging.metadata import Metadata

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
LICENSE = "LICENSE"
PAGE = Path("cqos_core", "service", "page")
TOOLS = ("cyclonedx-bom==7.5.0", "twine==7.0.0")
USES = (
    # a workspace of ROS 2
    (
        *("cqos", "check", "examples/robot_workspace/src"),
        *("--launch", "bot:sim.launch.xml", "--option", "ros2.distro=jazzy"),
    ),
    ("cqos", "check", "examples/smart_agriculture.bpmn", "--format", "html"),
    ("cqos", "check", "examples/smart_agriculture.yaml"),
    ("cqos", "packs"),
    ("cqos", "schema"),
    ("python", "-c", "import cqos; assert cqos.check('examples/smart_agriculture.yaml').ok"),
)


class TroubleError(Exception):
    """Something went wrong that one sentence explains."""


def main(arguments: list[str]) -> int:
    """Build, and with ``--check`` try what was built."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=ROOT / "dist")
    parser.add_argument("--check", action="store_true")
    wishes = parser.parse_args(arguments)
    shutil.rmtree(wishes.output, ignore_errors=True)
    with tempfile.TemporaryDirectory() as folder:
        tree = staged(Path(folder, "tree"))
        for project in distributions(tree):
            build(project, wishes.output, "sdist", "wheel")
            check_contents(project, wishes.output)
        if wishes.check:
            if not (tree / PAGE / "index.html").is_file():
                raise TroubleError(
                    "a release has the page of the modeler, which was not built: python modeler/hatch_build.py"
                )
            check_sources(wishes.output, Path(folder, "again"))
            check_installation(wishes.output, Path(folder))
            check_types()
    for file in sorted(wishes.output.iterdir()):
        say(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}")
    return 0


# Build


def staged(tree: Path) -> Path:
    """Copy the files that git knows, with the licence beside each pyproject.toml, so that nothing else is built."""
    listed = run(
        ["git", "-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], ROOT
    )
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, tree / name)
    if (ROOT / PAGE).is_dir():  # built, so git does not know it; the build takes it where its sources are these
        shutil.copytree(ROOT / PAGE, tree / PAGE)
    for project in distributions(tree):
        if not (project / LICENSE).exists():
            shutil.copy(ROOT / LICENSE, project)
    return tree


def distributions(tree: Path) -> list[Path]:
    """The folders of all distributions: the core, then the others."""
    return [tree, *(file.parent for file in sorted(tree.glob("plugins/*/pyproject.toml")))]


def build(project: Path, output: Path, *targets: str) -> None:
    """Build a wheel, a source archive or both with the build backend that is installed."""
    chosen = [argument for target in targets for argument in ("--target", target)]
    epoch = os.environ.get("SOURCE_DATE_EPOCH") or run(
        ["git", "-c", "safe.directory=*", "log", "-1", "--format=%ct"], ROOT
    )
    settings = {"SOURCE_DATE_EPOCH": epoch.strip()}
    run([sys.executable, "-m", "hatchling", "build", "--directory", str(output.resolve()), *chosen], project, settings)


# Contents


def check_contents(project: Path, output: Path) -> None:
    """Refuse archives that lack a file of their packages, or have one more.

    Raises:
        TroubleError: what is missing, or too much.
    """
    content = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))
    name, version = content["project"]["name"], content["project"]["version"]
    packages = [project / package for package in content["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]
    stem = f"{name.replace('-', '_')}-{version}"
    wanted = {
        file.relative_to(package.parent).as_posix()
        for package in packages
        for file in package.rglob("*")
        if file.is_file()
    }
    wanted |= {f"{package.name}/py.typed" for package in packages}
    contract = project / "proto"  # the .proto files stand beside the code that is generated from them
    wanted |= {file.relative_to(contract).as_posix() for file in contract.glob("cqos/*/*.proto")}

    with zipfile.ZipFile(output / f"{stem}-py3-none-any.whl") as wheel:
        about = f"{stem}.dist-info/"
        shipped = {entry for entry in wheel.namelist() if not entry.startswith(about)}
        compare(f"the wheel of {name}", shipped, wanted)
        compare(
            f"the licence of {name}",
            {f"{about}licenses/{LICENSE}"} & set(wheel.namelist()),
            {f"{about}licenses/{LICENSE}"},
        )
        metadata = wheel.read(f"{about}METADATA")
    Metadata.from_email(metadata, validate=True)
    with tarfile.open(output / f"{stem}.tar.gz") as archive:
        found = {PurePosixPath(member.name).relative_to(stem).as_posix() for member in archive.getmembers()}
    sources = {
        file.relative_to(project).as_posix() for package in packages for file in package.rglob("*") if file.is_file()
    }
    compare(
        f"the source archive of {name}",
        found & (sources | {LICENSE, "pyproject.toml", "PKG-INFO"}),
        sources | {LICENSE, "pyproject.toml", "PKG-INFO"},
    )


def compare(what: str, found: set[str], wanted: set[str]) -> None:
    """Refuse a difference between two sets of files."""
    if found != wanted:
        differences = [
            *(f"lacks {name}" for name in sorted(wanted - found)),
            *(f"has {name}" for name in sorted(found - wanted)),
        ]
        raise TroubleError(f"{what} {', '.join(differences)}")


# As users do


def check_sources(output: Path, again: Path) -> None:
    """Build each wheel once more from its source archive; both are equal."""
    for source in sorted(output.glob("*.tar.gz")):
        with tarfile.open(source) as archive:
            archive.extractall(again, filter="data")
        build(again / source.name.removesuffix(".tar.gz"), again, "wheel")
    for wheel in sorted(output.glob("*.whl")):
        if (again / wheel.name).read_bytes() != wheel.read_bytes():
            raise TroubleError(f"{wheel.name} differs when it is built from the source archive")


def check_installation(output: Path, folder: Path) -> None:
    """Install `cqos` from a wheelhouse without network, use it, and write down what was installed."""
    tools = environment(folder / "tools")
    pip(tools, "install", *TOOLS)
    run([str(program(tools, "twine")), "check", "--strict", *map(str, sorted(output.iterdir()))], folder)
    house = folder / "wheelhouse"
    wheels = [str(wheel) for wheel in sorted(output.glob("*.whl"))]
    pip(tools, "download", "--dest", str(house), "-c", str(ROOT / "constraints.txt"), *wheels)
    fresh = environment(folder / "fresh")
    pip(fresh, "install", "--no-index", "--find-links", str(house), "cqos")
    use(fresh)
    run(
        [
            *(str(program(tools, "cyclonedx-py")), "environment", str(program(fresh, "python"))),
            *("--pyproject", str(ROOT / "plugins" / "all" / "pyproject.toml"), "--output-reproducible"),
            *("--output-file", str(output / "cqos.cdx.json")),
        ],
        folder,
    )


def check_types() -> None:
    """Check the types once more, for the newest Python that the distributions run on."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    *_, newest = re.findall(r"Python :: (3\.\d+)", str(project["classifiers"]))
    run([sys.executable, "-m", "mypy", f"--python-version={newest}"], ROOT)


def environment(place: Path) -> Path:
    """Make an empty virtual environment."""
    venv.create(place, with_pip=True)
    return place


def program(place: Path, name: str) -> Path:
    """Return the path of a command of a virtual environment."""
    return place / "Scripts" / f"{name}.exe" if os.name == "nt" else place / "bin" / name


def pip(place: Path, *arguments: str) -> None:
    """Run pip in a virtual environment."""
    run([str(program(place, "python")), "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments], ROOT)


def use(place: Path) -> None:
    """Use an installation as people do: the command on examples, the import."""
    for name, *arguments in USES:
        run([str(program(place, name)), *arguments], ROOT, {"PYTHONSAFEPATH": "1"})


def run(command: list[str], folder: Path, settings: dict[str, str] | None = None) -> str:
    """Run a command and return what it prints.

    Raises:
        TroubleError: it fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(  # noqa: S603 - commands of this file
        command, cwd=folder, env=os.environ | (settings or {}), capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise TroubleError(f"`{' '.join(command)}` ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def say(text: str) -> None:
    """Print one line."""
    sys.stdout.write(f"{text}\n")


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except TroubleError as error:
        sys.exit(f"build_distributions.py: {error}")
