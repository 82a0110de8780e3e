"""What C-QoS says of every case file, example, fixture and of 2,000 random systems, as one line of digests each.

python -m tests.goldens.record                 write tests/goldens/digests.txt anew and print what changed
python -m tests.goldens.record --check         compare with it; exit 1 if structure or text of any item differs
python -m tests.goldens.record --against REV   compare with what the code of another commit says, and print it in full
python -m tests.goldens.record --show ITEM     print structure and text of items whose name contains ITEM

Structure (verdicts, codes, severities, members, places, values, edits of fixes) and text (messages, reasons, help) have
digests of their own: a commit that changes wording leaves every digest of structure alone.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import difflib
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import yaml

import cqos_core as cqos
from tests.goldens import designs

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROOT: Final = Path(__file__).parents[2]
DIGESTS: Final = Path(__file__).with_name("digests.txt")
RANDOM: Final = 2_000
PACKS: Final = {"ros2": "ros2", "dds_full": "dds", "mqtt": "mqtt"}
FIXTURES: Final = (
    "examples",
    "tests/importers/cases",
    "tests/cli/cases",
    "tests/decisive/designs",
    "plugins/ros2/tests/importers/cases",
    "plugins/ros2/tests/exporters/every.yaml",
)
TOGETHER: Final = ("examples/robot_directory", "examples/zenoh_fleet", "examples/mixed", "tests/decisive/designs/*")
TEXTS: Final = frozenset({"because", "clause", "help", "label", "message", "not_checked", "notes", "text", "tool"})


@cache
def items() -> dict[str, Callable[[], Any]]:
    """Return by its name what makes the answer to each item."""
    found: dict[str, Callable[[], Any]] = {}
    for folder, pack in PACKS.items():
        for file in sorted((ROOT / "plugins" / folder / "tests/cases").glob("*.yml")):
            for case in yaml.safe_load(file.read_bytes())["cases"]:
                found[f"{pack}/{file.stem}/{case['name']}"] = partial(of_case, pack, case)
    for path in fixtures():
        found[path] = partial(of_inputs, path)
    for pattern in TOGETHER:
        for folder_of_parts in sorted(ROOT.glob(pattern)):
            if folder_of_parts.is_dir():
                path = str(folder_of_parts.relative_to(ROOT))
                found[path] = partial(of_inputs, path)
    for number in range(RANDOM):
        found[f"random/{number}"] = partial(of_inputs, designs.text(number))
    return found


def fixtures() -> Iterator[str]:
    """Return the files of examples and of the tests of importers."""
    for name in FIXTURES:
        path = ROOT / name
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            inside = file.relative_to(ROOT)
            skipped = {"node_modules", "__pycache__", ".pytest_cache"} & set(inside.parts)
            # an acceptance with an end changes the report on that day
            if file.is_file() and not skipped and b"until: 2027-01-01" not in file.read_bytes():
                yield str(inside)


def of_case(pack: str, case: dict[str, Any]) -> Any:
    """Return the report on a case of a pack's case file: a system, a pair, or one endpoint."""
    options = {pack: case.get("options", {})}
    if "system" in case:
        data = json.dumps(case["system"], default=str).encode()
        return answer(lambda: cqos.check(data, importer="yaml", protocol=pack, options=options))
    offered, requested = case.get("offered", case.get("publisher")), case.get("requested", case.get("subscriber"))
    facts, needs = case.get("topic", {}), case.get("needs", {})
    ends = {"offered": offered or {}, "requested": requested or {}}
    given = ends | {"options": options[pack], "topic": facts, "needs": needs}
    return answer(partial(cqos.check_pair, pack, **{name: spelled(each) for name, each in given.items()}))  # type: ignore[arg-type]


def spelled(stated: dict[str, Any]) -> dict[str, Any]:
    """Return settings of a YAML file as callers of the library give them."""
    plain = (bool, int, str, list)
    return {name: value if isinstance(value, plain) else json.dumps(value) for name, value in stated.items()}


def of_inputs(given: str | bytes) -> Any:
    """Return the report on a path or a text, and what is explained of its first pair."""
    importer = "yaml" if isinstance(given, bytes) else None
    said = answer(lambda: cqos.check(given, importer=importer))
    for group in said.get("groups", ())[:1]:
        ends = {"publisher": group["publishers"][0], "subscriber": group["subscribers"][0]}
        said["explained"] = answer(partial(cqos.explain, given, **ends))
    return said


def answer(asked: Callable[[], Any]) -> Any:
    """Return a report as plain data, or the problems of an input."""
    try:
        said = asked()
    except cqos.InputError as error:
        return {"problems": [plain(problem) for problem in error.problems]}
    except (cqos.CqosError, TypeError) as error:
        return {"problems": [{"code": type(error).__name__, "message": str(error)}]}
    return said.to_dict() if isinstance(said, cqos.Report) else plain(said)


def plain(value: Any) -> Any:
    """Return a value of the library as data of JSON, by its public attributes."""
    if isinstance(value, (str, int, float)) or value is None:
        return str(value) if isinstance(value, str) else value
    if isinstance(value, Sequence):
        return [plain(each) for each in value]
    if isinstance(value, dict) or hasattr(value, "items"):
        return {str(key): plain(each) for key, each in value.items()}
    names = getattr(value, "__dataclass_fields__", ())
    return {name: plain(getattr(value, name)) for name in names if not name.startswith("_")}


def parted(value: Any) -> tuple[Any, Any]:
    """Return structure and text of an answer apart."""
    if isinstance(value, dict):
        inside = {key: parted(each) for key, each in value.items() if key not in TEXTS}
        structure = {key: each[0] for key, each in inside.items()}
        text = {key: each[1] for key, each in inside.items() if each[1]}
        return structure, text | {key: each for key, each in value.items() if key in TEXTS - {"tool"} and each}
    if isinstance(value, list):
        both = [parted(each) for each in value]
        texts = [text for _, text in both]
        return [structure for structure, _ in both], texts if any(texts) else []
    return value, None


def digest(value: Any) -> str:
    """Return ten letters that change with the value."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:10]


def digests(names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return for items the digests of structure and of text."""
    return {
        name: (digest(structure), digest(text)) for name, (structure, text) in zip(names, map(of, names), strict=True)
    }


def of(name: str) -> tuple[Any, Any]:
    """Return structure and text of an item."""
    os.chdir(ROOT)  # so that places are the same wherever the project is
    return parted(items()[name]())


def recorded() -> dict[str, tuple[str, str]]:
    """Return the digests of the committed file."""
    lines = DIGESTS.read_text(encoding="utf-8").splitlines() if DIGESTS.exists() else []
    apart = (line.rsplit(" ", 2) for line in lines)
    return {name: (structure, text) for name, structure, text in apart}


def differing(old: dict[str, tuple[str, str]], new: dict[str, tuple[str, str]]) -> dict[str, str]:
    """Return by item what differs: it is new, gone, or its structure or text is another."""
    found = {}
    for name in [*new, *(old.keys() - new.keys())]:
        if name not in old or name not in new:
            found[name] = "is new" if name in new else "is gone"
        elif old[name][0] != new[name][0]:
            found[name] = "says other things"
        elif old[name][1] != new[name][1]:
            found[name] = "has other words"
    return found


def show(pattern: str) -> None:
    """Print the items whose name contains a text, structure and words."""
    for name in items():
        if pattern in name:
            structure, text = of(name)
            whole = {"item": name, "structure": structure, "text": text}
            print(json.dumps(whole, indent=1, sort_keys=True, ensure_ascii=False))


def against(revision: str) -> int:
    """Print in full how the answers differ from those of the code at ``revision``; return 1 if any does."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder, "tree")
        subprocess.run(["git", "worktree", "add", "-q", "--detach", tree, revision], cwd=ROOT, check=True)
        try:
            old, new = _dumped(tree), _dumped(ROOT)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)
    changed = [name for name in new if old.get(name) != new[name]]
    for name in changed:
        before, after = (
            json.dumps(each.get(name), indent=1, sort_keys=True, ensure_ascii=False).splitlines() for each in (old, new)
        )
        print("\n".join(difflib.unified_diff(before, after, f"{name} at {revision}", f"{name} now", lineterm="", n=2)))
    gone = old.keys() - new.keys()
    print(f"{len(new)} items, {len(changed)} differ, {len(gone)} gone", file=sys.stderr)
    return 1 if changed or gone else 0


def _dumped(tree: Path) -> Any:
    """Return what the code of a tree says of all items of that tree."""
    packages = [tree, tree / "proto/python", *sorted(tree.glob("plugins/*"))]
    path = {"PYTHONPATH": os.pathsep.join(map(str, packages))}
    command = [sys.executable, "-m", "tests.goldens.record", "--dump"]
    return json.loads(
        subprocess.run(command, cwd=tree, env=os.environ | path, stdout=subprocess.PIPE, check=True).stdout
    )


def main(arguments: list[str]) -> int:
    """Run one of the forms above; return the exit code."""
    parser = argparse.ArgumentParser(prog="dev.py goldens", description=__doc__, add_help=True)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--against", metavar="REV")
    parser.add_argument("--show", metavar="ITEM")
    parser.add_argument("--dump", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.dump:
        json.dump({name: of(name) for name in items()}, sys.stdout)
        return 0
    if chosen.show:
        show(chosen.show)
        return 0
    if chosen.against:
        return against(chosen.against)
    names = list(items())
    parts = [names[start :: os.cpu_count() or 1] for start in range(os.cpu_count() or 1)]
    with concurrent.futures.ProcessPoolExecutor() as pool:
        made = {name: both for part in pool.map(digests, parts) for name, both in part.items()}
    old, new = recorded(), {name: made[name] for name in names}
    found = differing(old, new)
    for name, what in found.items():
        print(f"{name} {what}")
    print(f"{len(new)} items, {len(found)} differ from {DIGESTS.relative_to(ROOT)}", file=sys.stderr)
    if not chosen.check:
        DIGESTS.write_text("".join(f"{name} {' '.join(both)}\n" for name, both in new.items()), encoding="utf-8")
    return 1 if found and chosen.check else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
