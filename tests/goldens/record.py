"""Goldens: what C-QoS says of many systems, as text that a reviewer reads in a diff. Files are in tests/goldens/recorded.

python -m tests.goldens.record [NAME ...]      write them anew, all or those whose names begin so; read `git diff` then
python -m tests.goldens.record --check         compare; print what differs, and exit 1 if anything does
python -m tests.goldens.record --against REV   compare with what the code of another commit says, of 2,000 random systems too
"""

from __future__ import annotations

import argparse
import concurrent.futures
import difflib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final

from tests.goldens import inputs
from tests.goldens.inputs import ROOT, Stanzas

RECORDED: Final = Path(__file__).with_name("recorded")
HOME: Final = Path(__file__).parent.relative_to(ROOT)
_PARTS: Final = 8
"""The random systems are so many files while commits are compared."""


def text(name: str) -> str:
    """Return what a golden should hold now."""
    return written(name, inputs.files()[name]())


def written(name: str, stanzas: Stanzas) -> str:
    """Return stanzas as one text, each below the name of its system."""
    os.chdir(ROOT)  # so that places are the same wherever the project is
    found = [f"# {name}: recorded by `python3 dev.py goldens`, explained in {HOME}/README.md."]
    for system, lines in stanzas.items():
        found += ["", f"== {system}", *lines()]
    return "\n".join([*found, ""])


def recorded(name: str) -> str:
    """Return what a golden holds; nothing where there is none."""
    file = RECORDED / f"{name}.txt"
    return file.read_text(encoding="utf-8") if file.exists() else ""


def kept() -> set[str]:
    """Return the names of all goldens that are there."""
    return {str(file.relative_to(RECORDED).with_suffix("")) for file in RECORDED.rglob("*.txt")}


def difference(name: str, old: str, new: str, was: str = "recorded") -> Iterator[str]:
    """Yield the lines in which two texts differ, each with the system that it is about."""
    before, after = old.splitlines(), new.splitlines()
    for line in difflib.unified_diff(before, after, f"{name} {was}", f"{name} now", lineterm="", n=2):
        yield f"{line} {_system(before, int(line.split()[1].split(',')[0][1:]))}" if line[:2] == "@@" else line


def _system(lines: Sequence[str], number: int) -> str:
    """Return the name of the system to which a line belongs."""
    return next((each for each in reversed(lines[: number + 2]) if each.startswith("== ")), "")


def made(names: Iterable[str], make: Callable[[str], str]) -> Iterator[tuple[str, str]]:
    """Yield for names what is made of each, several at the same time."""
    with concurrent.futures.ProcessPoolExecutor() as pool:
        running = {pool.submit(make, name): name for name in names}
        for each in concurrent.futures.as_completed(running):
            yield running[each], each.result()


def record(names: Sequence[str]) -> int:
    """Write goldens; say which are new, gone and others than before."""
    for name in sorted(kept() - inputs.files().keys()):
        print(f"{name} is gone")
        RECORDED.joinpath(f"{name}.txt").unlink()
    for name, new in made(names, text):
        old, file = recorded(name), RECORDED / f"{name}.txt"
        if old != new:
            print(f"{name} {'changed' if old else 'is new'}")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(new, encoding="utf-8")
    return 0


def check(names: Sequence[str]) -> int:
    """Print how goldens differ from what is said now; return 1 if any does."""
    found = [line for name, new in made(names, text) for line in difference(name, recorded(name), new)]
    found += [f"{name} is of no system any more" for name in sorted(kept() - inputs.files().keys())]
    print("\n".join(found) if found else f"{len(names)} goldens, none differs")
    return 1 if found else 0


def against(revision: str) -> int:
    """Print how what is said of all differs from what the code at ``revision`` says of the same; return 1 if anything does."""
    with tempfile.TemporaryDirectory() as folder:
        tree, both = Path(folder, "tree"), (Path(folder, "old"), Path(folder, "new"))
        subprocess.run(["git", "worktree", "add", "-q", "--detach", tree, revision], cwd=ROOT, check=True)
        try:
            shutil.rmtree(tree / HOME, ignore_errors=True)
            shutil.copytree(ROOT / HOME, tree / HOME)
            for code, said in zip((tree, ROOT), both, strict=True):
                _dumped(code, said)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)
        names = sorted({file.name for said in both for file in said.iterdir()})
        old, new = ({file.name: file.read_text(encoding="utf-8") for file in said.iterdir()} for said in both)
    found = [
        line for name in names for line in difference(name, old.get(name, ""), new.get(name, ""), f"at {revision}")
    ]
    print("\n".join(found) if found else f"{len(names)} goldens, none differs")
    return 1 if found else 0


def _dumped(tree: Path, said: Path) -> None:
    """Write into a folder what the code of a tree says of all that it has, and of all random systems."""
    packages = [tree, tree / "proto/python", *sorted(tree.glob("plugins/*"))]
    path = {"PYTHONPATH": os.pathsep.join(map(str, packages))}
    command = [sys.executable, "-m", "tests.goldens.record", "--dump", str(said)]
    subprocess.run(command, cwd=tree, env=os.environ | path, check=True)


def dump(said: Path) -> int:
    """Write all that there is into a folder."""
    said.mkdir()
    numbers = [f"all random {part}" for part in range(_PARTS)]
    for name, new in made([*inputs.files(), *numbers], _of_all):
        (said / name.replace("/", " ")).write_text(new, encoding="utf-8")
    return 0


def _of_all(name: str) -> str:
    if not name.startswith("all random "):
        return text(name)
    numbers = range(int(name.rpartition(" ")[2]), inputs.RANDOM, _PARTS)
    return written(name, inputs.of_random(numbers))


def main(arguments: list[str]) -> int:
    """Run one of the forms above; return the exit code."""
    parser = argparse.ArgumentParser(prog="dev.py goldens", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--against", metavar="REV")
    parser.add_argument("--dump", type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.dump:
        return dump(chosen.dump)
    if chosen.against:
        return against(chosen.against)
    names = [name for name in inputs.files() if name.startswith(tuple(chosen.names) or "")]
    if not names:
        parser.error(f"no golden begins so; there are {', '.join(inputs.files())}")
    return check(names) if chosen.check else record(names)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
