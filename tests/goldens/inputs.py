"""What the goldens are made of: by the name of each file, its stanzas, and what writes them. README.md says why these."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, Final, TypeAlias

import yaml

import cqos_core as cqos
from cqos_core.testing import judge_case, load_cases
from tests.command_process import run
from tests.goldens import designs, fleets, sessions
from tests.goldens.fleets import Fleet
from tests.goldens.stanza import Lines, Writer, spoken

ROOT: Final = Path(__file__).parents[2]
SYSTEMS: Final = "tests/goldens/systems"
PACKS: Final = {"ros2": "ros2", "dds_full": "dds", "mqtt": "mqtt"}

Stanzas: TypeAlias = Mapping[str, Callable[[], Lines]]
"""By the name of a system, what writes its lines."""


@cache
def files() -> dict[str, Callable[[], Stanzas]]:
    """Return by the name of each golden what finds its stanzas."""
    found: dict[str, Callable[[], Stanzas]] = {f"cases/{pack}": partial(of_cases, pack) for pack in PACKS.values()}
    found |= {name: partial(of_folders, name) for name in FOLDERS} | {"incidents": of_incidents}
    found |= {f"systems/{name}": partial(of_systems, name) for name in SEVERAL}
    for file in sorted((ROOT / SYSTEMS).iterdir()):
        if file.is_file():
            path = str(file.relative_to(ROOT))
            found[f"systems/{file.stem}"] = partial(dict, {path: partial(of_inputs, path, explained=MOST)})
    found |= {f"fleets/{name}": partial(of_fleet, name) for name in fleets.ALL}
    found |= {f"read/{name}": partial(of_read_fleet, name) for name in READ}
    found |= {f"sessions/{name}": partial(dict, {name: each}) for name, each in sessions.ALL.items()}
    found |= {f"pairs/{pack}": partial(dict, {pack: partial(of_grid, pack)}) for pack in GRIDS}
    found |= {f"random/{pack}": partial(of_random, RECORDED, pack) for pack in PACKS.values()}
    found |= {f"texts/{Path(path).stem}": partial(dict, {path: partial(of_text, path)}) for path in TEXTS}
    return found


# Rules: a line for each case, and for each rule the first finding in full.


def of_cases(pack: str) -> Stanzas:
    """Return what is said of the case files of a pack."""
    folder = next(folder for folder, name in PACKS.items() if name == pack)
    found = sorted((ROOT / "plugins" / folder / "tests/cases").glob("*.yml"))
    return {file.stem: partial(of_case_file, file, pack) for file in found}


def of_case_file(file: Path, pack: str) -> Lines:
    """Return a line for each case of a rule, and its first finding in full."""
    lines: Lines = []
    first = True
    for case in load_cases(file, pack):
        try:
            found = judge_case(case)
        except cqos.InputError as error:
            lines += [f"{line}: {case.name}" for line in Writer().problems(error)]
            continue
        codes = "".join(f" {each.severity}:{each.code}" for each in found.findings)
        lines.append(f"{found.verdict}{codes}: {case.name}")
        of_rule = [each for each in found.findings if each.code == case.rule]
        if of_rule and first:
            lines += [f"    {line}" for line in Writer("<bytes>").finding(of_rule[0])]
            first = False
    return lines


# Files: examples, and the fixtures of importers.

FOLDERS: Final = {
    "examples": ("examples",),
    "importers": ("tests/importers/cases", "tests/cli/cases", "plugins/ros2/tests/importers/cases"),
    "designs": ("tests/decisive/designs", "plugins/ros2/tests/exporters/every.yaml"),
}
TOGETHER: Final = ("examples/robot_directory", "examples/zenoh_fleet", "examples/mixed", "tests/decisive/designs/*")
INCIDENTS: Final = "examples/incidents"
_NO_SYSTEMS: Final = frozenset([".csv", ".js", ".md", ".py", ".toml", ".typed", ".yml"])
_FOLDERS_OF_TOOLS: Final = frozenset({"node_modules", "__pycache__", ".pytest_cache"})


def of_folders(name: str) -> Stanzas:
    """Return what is said of the files in folders, each alone, and of folders whose files are one system."""
    found = {path: partial(of_inputs, path) for path in fixtures(name)}
    for folder in (each for pattern in TOGETHER for each in sorted(ROOT.glob(pattern)) if each.is_dir()):
        path = str(folder.relative_to(ROOT))
        if path.startswith(FOLDERS[name]):
            found[path] = partial(of_inputs, path)
    return found


def fixtures(name: str) -> Iterator[str]:
    """Yield the files below folders that may be systems."""
    for folder in FOLDERS[name]:
        path = ROOT / folder
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            inside = file.relative_to(ROOT)
            other = file.suffix in _NO_SYSTEMS or file.name.startswith(".") or str(inside).startswith(INCIDENTS)
            expected = file.suffix == ".txt" and any(file.with_suffix(each).exists() for each in (".yaml", ".json"))
            if other or expected or _FOLDERS_OF_TOOLS & {*inside.parts} or not file.is_file():
                continue
            if b"until: 2027-01-01" not in file.read_bytes():  # that day would change the report
                yield str(inside)


def of_incidents() -> Stanzas:
    """Return what is said of the files of each incident together; sources of nodes are tried elsewhere."""
    found: dict[str, Callable[[], Lines]] = {}
    for incident in yaml.safe_load((ROOT / INCIDENTS / "incidents.yaml").read_bytes())["incidents"]:
        paths = [f"{INCIDENTS}/{incident['id']}/{each}" for each in incident["files"] if each != "src"]
        if paths:
            found[incident["id"]] = partial(of_inputs, *paths)
    return found


MOST: Final = 40
"""So many pairs of a system that was written for goldens are explained."""


def of_inputs(*given: str | bytes, explained: int = 1, options: Any = None) -> Lines:
    """Return what is said of a system, and of the first of its pairs."""
    importer = "yaml" if isinstance(given[0], bytes) and given[0][:1] != b"<" else None
    writer = Writer(given[0] if isinstance(given[0], str) else "<bytes>")
    try:
        report = cqos.check(*given, importer=importer, options=options)
    except cqos.InputError as error:
        return writer.problems(error)
    lines = writer.report(report)
    first = {(group.verdict, group.codes): group for group in reversed(report.groups)}
    chosen = report.groups if explained == MOST else [*reversed(first.values())]
    for group in chosen[:explained]:
        ends = group.publishers[0], group.subscribers[0]
        try:
            pair = cqos.explain(*given, publisher=ends[0], subscriber=ends[1], options=options)
        except cqos.CqosError as error:
            lines.append(f"pair {' -> '.join(ends)}: {type(error).__name__}")
        else:
            lines += writer.pair(pair, " -> ".join(ends))
    return lines


# Systems that were written to reach one part of the engine each.

SEVERAL: Final[dict[str, dict[str, tuple[tuple[str, ...], Any]]]] = {
    "overlays": {"together": ((f"{SYSTEMS}/overlays/robot.yaml", f"{SYSTEMS}/overlays/parameters.yaml"), None)},
    "by_topic": {"together": ((f"{SYSTEMS}/by_topic/programs.yaml", f"{SYSTEMS}/by_topic/profiles.xml"), None)},
    "implied_needs_by_option": {
        severity: ((f"{SYSTEMS}/implied_needs.yaml",), {"mqtt": {"implied_needs": severity}})
        for severity in ("warning", "note")
    },
    "assumptions_by_option": {
        rmw: ((f"{SYSTEMS}/open_assumptions.yaml",), {"ros2": {"rmw": rmw}})
        for rmw in ("cyclonedds", "fastdds", "zenoh")
    },
}


def of_systems(name: str) -> Stanzas:
    """Return what is said of files that are read together, or under options."""
    return {
        stanza: partial(of_inputs, *paths, options=options, explained=0 if options else MOST)
        for stanza, (paths, options) in SEVERAL[name].items()
    }


# Large systems.


def of_fleet(name: str) -> Stanzas:
    """Return what is said of a large system."""
    form, fleet = fleets.ALL[name]
    return {f"{form.__name__}({fleet})": lambda: of_inputs(form(fleet).encode())}


READ: Final = ("lines", "beside", "aliases", "copies", "attributes", "elements")
"""Forms whose endpoints, made one by one where somebody reads them, are recorded too."""


def of_read_fleet(name: str) -> Stanzas:
    """Return the endpoints of a large system."""
    form, fleet = fleets.ALL[name]
    text = form(fleet).encode()
    importer = "yaml" if text[:1] != b"<" else "bpmn"
    return {f"{form.__name__}({fleet})": lambda: Writer("<bytes>").endpoints(cqos.read(text, importer=importer))}


# Pairs that one judge judges one after the other.

GRIDS: Final[dict[str, tuple[fleets.Values, dict[str, str]]]] = {
    "ros2": (fleets.UNDECIDED, {"rmw": "cyclonedds"}),
    "dds": (fleets.DATA, {"implementation": "cyclonedds"}),
    "mqtt": (fleets.MESSAGES, {}),
}
_SIGNS: Final = {"compatible": "+", "incompatible": "-", "unknown": "?"}


def of_grid(pack: str) -> Lines:
    """Return the verdicts of 20 offers, a line each, against 20 requests."""
    values, options = GRIDS[pack]
    kinds = [pair for _, pair in Fleet(pack, values, kinds=20, times=1, seed=6).pairs()]
    judge = cqos.PairJudge(pack, options)
    lines = [f"request {number}: {spoken(request)}" for number, (_, request) in enumerate(kinds)]
    for offer, _ in kinds:
        verdicts = "".join(_SIGNS[judge.verdict(offer, request)] for _, request in kinds)
        lines.append(f"{verdicts} offer {spoken(offer)}")
    return lines


# Random systems.

RANDOM: Final = 2_000
"""So many are compared by `--against`."""
RECORDED: Final = (
    *(65, 73, 136, 151, 204, 225, 306, 308, 335, 347, 348, 368, 369, 393, 401, 424, 425, 434, 445, 481),
    *(543, 591, 647, 687, 698, 821, 836, 841, 853, 887, 893, 974, 1034, 1094, 1112, 1113, 1177, 1208, 1292, 1296),
    *(1331, 1395, 1423, 1433, 1510, 1527, 1577, 1581, 1613, 1629, 1671, 1687, 1706, 1722, 1725, 1745, 1872, 1879),
    *(1897, 1959),
)
"""What these report contains each rule that any of them all reports and no other whole system here."""


def of_random(numbers: Iterable[int], protocol: str | None = None) -> Stanzas:
    """Return what is said of random systems, perhaps of those of one protocol."""
    chosen = [each for each in numbers if protocol in {None, designs.protocol(each)}]
    return {f"random {number}": partial(of_inputs, designs.text(number)) for number in chosen}


# Whole texts, words included.

TEXTS: Final = (
    "examples/smart_agriculture_incompatible.bpmn",
    "examples/mqtt_greenhouse.yaml",
    f"{SYSTEMS}/bridges.yaml",
    f"{SYSTEMS}/best_available.yaml",
    f"{SYSTEMS}/one_wire.yaml",
)


def of_text(path: str) -> Lines:
    """Return what the command prints of a file."""
    return run(["check", path, "--no-config"], ROOT, {**os.environ, "COLUMNS": "120"}, together=True).out.splitlines()
