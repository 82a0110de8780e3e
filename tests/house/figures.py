"""How large the house is: `python3 dev.py house` prints its figures, and a test holds them against ``figures.json``.

python -m tests.house.figures            print rooms with floors, modules, lines and statements, and the figures below
python -m tests.house.figures --record   write the figures to tests/house/figures.json, which the test compares

A figure may fall, not rise. A commit that raises one records it and says by how much and why.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cqos_core as cqos

if TYPE_CHECKING:
    from types import FrameType

ROOT: Final = Path(__file__).parents[2]
RECORDED: Final = Path(__file__).with_name("figures.json")
CORE: Final = ROOT / "cqos_core"


def modules() -> tuple[list[Path], list[Path]]:
    """Return the modules of the core and those of the packs."""
    core = sorted(CORE.rglob("*.py"))
    return core, [file for file in sorted(ROOT.glob("plugins/*/cqos_*/**/*.py")) if "__pycache__" not in file.parts]


@cache
def tree(file: Path) -> ast.Module:
    """Return the syntax tree of a module."""
    return ast.parse(file.read_text(encoding="utf-8"))


def lines(file: Path) -> int:
    """Return how many lines a module has."""
    return len(file.read_text(encoding="utf-8").splitlines())


def statements(file: Path) -> int:
    """Return how many statements a module has, without imports and docstrings."""
    return sum(
        isinstance(node, ast.stmt)
        and not isinstance(node, (ast.Import, ast.ImportFrom))
        and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))
        for node in ast.walk(tree(file))
    )


def room(file: Path) -> str:
    """Return the room of a module of the core, or its own name where it stands alone."""
    inside = file.relative_to(CORE)
    return inside.parts[0] if len(inside.parts) > 1 else inside.stem


def imported(file: Path) -> set[str]:
    """Return the rooms and single modules that a module imports from."""
    names = set()
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("cqos_core."):
            names.add(node.module.split(".")[1])
    return names - {room(file)}


def floors() -> dict[str, int]:
    """Return on which floor each room and single module stands: one above the highest that it imports."""
    below: dict[str, set[str]] = defaultdict(set)
    for file in modules()[0]:
        if room(file) != "__init__":
            below[room(file)] |= imported(file) & {room(each) for each in modules()[0]}

    @cache
    def floor(name: str) -> int:
        return 1 + max(map(floor, below[name]), default=0)

    return {name: floor(name) for name in below}


def functions(file: Path) -> dict[str, int]:
    """Return the functions of a module and how many lines each has."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return {
        f"{file.relative_to(ROOT)}:{node.name}": (node.end_lineno or node.lineno) - node.lineno + 1
        for node in ast.walk(tree(file))
        if isinstance(node, kinds)
    }


def twice() -> list[str]:
    """Return the names of classes of the core that name two."""
    names = Counter(node.name for file in modules()[0] for node in tree(file).body if isinstance(node, ast.ClassDef))
    return sorted(name for name, count in names.items() if count > 1)


def crossed() -> int:
    """Return in how many files of the core code runs while `check_pair` compares a pair."""
    seen: set[str] = set()

    def note(frame: FrameType, _event: str, _argument: object) -> None:
        seen.add(frame.f_code.co_filename)

    cqos.check_pair("ros2", {"reliability": "best_effort"}, {"reliability": "reliable"})  # loads packs and plugins
    before = sys.getprofile()
    sys.setprofile(note)
    try:
        cqos.check_pair("ros2", offered={"reliability": "best_effort", "depth": 7}, requested={"depth": 8})
    finally:
        sys.setprofile(before)
    return sum(name.startswith(str(CORE)) for name in seen)


def _crossed_afresh() -> int:
    """Return `crossed` of a process in which nothing was checked before."""
    command = [sys.executable, "-c", "from tests.house import figures; print(figures.crossed())"]
    return int(subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True, text=True).stdout)


def figures() -> dict[str, int]:
    """Return everything that may not rise."""
    core, packs = modules()
    rooms = {room(file) for file in core if file.parent != CORE}
    everything = [*core, *packs]
    sizes = Counter[str]()
    for file in core:
        sizes[room(file)] += lines(file)
    return {
        "rooms": len(rooms),
        "single modules": len([file for file in core if file.parent == CORE and file.stem != "__init__"]),
        "floors": max(floors().values()),
        "statements of the core": sum(map(statements, core)),
        "statements of the packs": sum(map(statements, packs)),  # of all other distributions
        "statements altogether": sum(map(statements, everything)),
        "lines of the largest room": max(sizes.values()),
        "lines of the longest module": max(map(lines, everything)),
        "modules over 500 lines": sum(lines(file) > 500 for file in everything),
        "lines of the longest function": max(length for file in everything for length in functions(file).values()),
        "functions over 60 lines": sum(length > 60 for file in everything for length in functions(file).values()),
        "files that check_pair crosses": _crossed_afresh(),
        "class names used twice": len(twice()),
    }


def recorded() -> dict[str, int]:
    """Return the figures of the committed file."""
    found: dict[str, int] = json.loads(RECORDED.read_text(encoding="utf-8"))
    return found


def main(arguments: list[str]) -> int:
    """Print or record the figures; return the exit code."""
    core, packs = modules()
    by_floor = sorted(floors().items(), key=lambda each: (-each[1], each[0]))
    print(f"{'room':<12}{'floor':>6}{'modules':>9}{'lines':>8}{'statements':>12}")
    for name, floor in by_floor:
        files = [file for file in core if room(file) == name]
        print(f"{name:<12}{floor:>6}{len(files):>9}{sum(map(lines, files)):>8}{sum(map(statements, files)):>12}")
    print()
    for what, figure in figures().items():
        print(f"{what:<32}{figure:>7}")
    everything = [*core, *packs]
    long = {str(file.relative_to(ROOT)): lines(file) for file in everything if lines(file) > 500}
    long |= {name: length for file in everything for name, length in functions(file).items() if length > 60}
    print("\n" + "\n".join(f"{length:>6}  {name}" for name, length in sorted(long.items(), key=lambda each: -each[1])))
    print("class names used twice: " + (", ".join(twice()) or "none"))
    if "--record" in arguments:
        RECORDED.write_text(json.dumps(figures(), indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
