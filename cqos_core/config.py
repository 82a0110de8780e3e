"""Configuration of a project: ``cqos.toml``, or ``[tool.cqos]`` in ``pyproject.toml``, of the nearest folder above.

It has options, severities, checks and accepted findings in the words of system files, and defaults of the command. A system
file wins over it.
"""

from __future__ import annotations

import os
import re
import sys
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

from cqos_core.files.ignore_patterns import read_ignore_patterns
from cqos_core.importers.document_form import Form, Key, OneOrMore, SettingsMap
from cqos_core.importers.source_reading import SourceReading, shown
from cqos_core.importers.team_rules import acceptance, team_rule
from cqos_core.importers.tree import MappingNode, ScalarNode, SequenceNode
from cqos_core.importers.value_types import TEXT, TEXTS, one_of
from cqos_core.importers.yaml_form import ACCEPT, CHECKS, OPTIONS, SEVERITIES
from cqos_core.model.dataclass import dataclass
from cqos_core.model.encoding import decode
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.regular_expressions import regular_expression
from cqos_core.model.settings import Place
from cqos_core.model.source import Source

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from cqos_core.files.ignore_patterns import IgnorePatterns
    from cqos_core.importers.document_form import Entry
    from cqos_core.importers.tree import Node
    from cqos_core.model.settings import Settings
    from cqos_core.model.system import Acceptance, System, TeamRule

NAME: Final = "cqos.toml"
SHARED_NAME: Final = "pyproject.toml"
_TABLE: Final = ("tool", "cqos")
_OURS: Final = regular_expression(r"^\s*\[+\s*tool\s*\.\s*[\"']?cqos", re.MULTILINE)
_UNUSUAL: Final = regular_expression(
    r"""^\s*\[+\s*(?:["']tool["']|tool\s*\]|[^\n]*\\) | ^\s*(?:tool|'tool'|"tool"|"[^"\n]*\\[^\n]*")\s*[.=]""",
    re.MULTILINE | re.VERBOSE,
)
"""Beginnings of lines by which our table may stand there in a spelling that `_OURS` does not find."""

PROTOCOL: Final = Key("protocol", TEXT, "Protocol of systems that state none, like --protocol.", hints=("packs",))
SHOW: Final = Key(
    "show",
    OneOrMore(one_of("notes", "not-checked", "subscribers", "coverage")),
    "What to show beside errors and warnings, like --show.",
)
FAIL_ON: Final = Key("fail_on", one_of("error", "warning"), "From which severity on the check fails, like --fail-on.")
FORMAT: Final = Key("format", TEXT, "Format of the output, like --format.")
BASELINE: Final = Key("baseline", TEXT, "File of known findings, relative to this file, like --baseline.")
PACKS: Final = Key("packs", TEXTS, "Rule packs in YAML files, relative to this file, like --pack.")
EXCLUDE: Final = Key(
    "exclude",
    TEXTS,
    "What a search of folders passes over: patterns as in .gitignore, relative to this file, like --exclude.",
)
SERVE: Final = Key(
    "serve",
    SettingsMap("a map of options of `cqos serve`"),
    "Options of `cqos serve`, by their names with `_` for `-`; files are relative to this one.",
)
EXTENDS: Final = Key("extends", TEXTS, "Configuration files to start from, relative to this one; this one wins.")
CONFIG: Final = Form(
    "configuration",
    "the configuration",
    (EXTENDS, PROTOCOL, OPTIONS, SEVERITIES, CHECKS, ACCEPT, PACKS, EXCLUDE, SHOW, FAIL_ON, FORMAT, BASELINE, SERVE),
    never=dict.fromkeys(("check", "cqos", "tool"), "write its keys at the top of the file, without this table"),
)


@dataclass(frozen=True, slots=True)
class Config:
    """The configuration of a project; everything may be absent.

    Attributes:
        path: the file, None without one.
        options, severities, checks, accept: as in a system file.
        packs, baseline: paths that can be opened from where the process runs.
        exclude: patterns of files that a search of folders skips.
        serve: options of ``cqos serve``, as text.
        sources: the files that were read, with their bytes, for excerpts.
    """

    path: str | None = None
    protocol: str | None = None
    options: Mapping[str, Settings] = field(default_factory=dict)
    severities: Mapping[str, str] = field(default_factory=dict)
    checks: tuple[TeamRule, ...] = ()
    accept: tuple[Acceptance, ...] = ()
    packs: tuple[str, ...] = ()
    exclude: tuple[IgnorePatterns, ...] = ()
    show: tuple[str, ...] = ()
    fail_on: str | None = None
    format: str | None = None
    baseline: str | None = None
    serve: Settings = field(default_factory=dict)
    sources: Mapping[str, bytes] = field(default_factory=dict)

    def apply_to(self, system: System) -> System:
        """Return ``system`` with this configuration below its own statements."""
        options = {pack: dict(settings) for pack, settings in self.options.items()}
        for pack, settings in system.options.items():
            options.setdefault(pack, {}).update(settings)
        names = {check.name for check in system.checks}
        return replace(
            system,
            protocol=system.protocol or self.protocol,
            options=options,
            severities={**self.severities, **system.severities},
            checks=[*(check for check in self.checks if check.name not in names), *system.checks],
            accept=[*self.accept, *system.accept],
            sources={**system.sources, **self.sources},
        )

    def over(self, base: Config) -> Config:
        """Return this configuration with the values of ``base`` where it states none."""
        names = {check.name for check in self.checks}
        packs = {*base.options, *self.options}
        return Config(
            path=self.path,
            protocol=self.protocol or base.protocol,
            options={pack: {**base.options.get(pack, {}), **self.options.get(pack, {})} for pack in sorted(packs)},
            severities={**base.severities, **self.severities},
            checks=(*(check for check in base.checks if check.name not in names), *self.checks),
            accept=(*base.accept, *self.accept),
            packs=tuple(dict.fromkeys((*base.packs, *self.packs))),
            exclude=(*base.exclude, *self.exclude),
            show=self.show or base.show,
            fail_on=self.fail_on or base.fail_on,
            format=self.format or base.format,
            baseline=self.baseline or base.baseline,
            serve={**base.serve, **self.serve},
            sources={**base.sources, **self.sources},
        )


def config_for(path: str | Path) -> Config:
    """Return the configuration that holds for a file or folder, or an empty one.

    Raises:
        InputError: with everything that is wrong with it.
    """
    found = find_config(path)
    return Config() if found is None else load_config(found)


def find_config(path: str | Path) -> Path | None:
    """Return the nearest ``cqos.toml``, or ``pyproject.toml`` with ``[tool.cqos]``, in or above ``path``."""
    # Not `pathlib`, which takes 3 ms to import. `resolve` would leave the folder for that of a link's target.
    folder = os.path.abspath(path)  # noqa: PTH100
    if os.path.isfile(folder):  # noqa: PTH113
        folder = os.path.dirname(folder)  # noqa: PTH120
    while True:
        own, shared = (os.path.join(folder, name) for name in (NAME, SHARED_NAME))  # noqa: PTH118
        if os.path.isfile(own):  # noqa: PTH113
            return _shown_path(own)
        if os.path.isfile(shared) and _has_our_table(shared):  # noqa: PTH113
            return _shown_path(shared)
        inner, folder = folder, os.path.dirname(folder)  # noqa: PTH120
        if folder == inner:
            return None


def _has_our_table(path: str) -> bool:
    try:
        with open(path, "rb") as file:  # noqa: PTH123
            text = decode(file.read())
        return _OURS.search(text) is not None or (
            _UNUSUAL.search(text) is not None and _our_table(_parsed(text)) is not None
        )
    except (OSError, ValueError, RecursionError):
        return False


def _parsed(text: str) -> Any:
    # 3 ms, and 10 ms for a pyproject.toml, which is above most files and mostly not for us.
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    return tomllib.loads(text)


def _our_table(document: Any) -> Any:
    for name in _TABLE:
        document = document.get(name) if isinstance(document, dict) else None
    return document


def _shown_path(path: str) -> Path:
    """Return the path as a person would write it here."""
    from pathlib import Path

    file, here = Path(path), Path.cwd()
    return file.relative_to(here) if file.is_relative_to(here) else file


def load_config(path: str | Path, texts: Mapping[str, bytes] | None = None) -> Config:
    """Read one configuration file with everything it extends; ``texts`` has bytes that count instead of those of files, by real path.

    Raises:
        InputError: with everything that is wrong with any of the files.
    """
    problems: list[Problem] = []
    config = _load(str(path), (), None, problems, texts or {})
    if problems:
        from cqos_core.importers.advice_notation import in_notation

        raise InputError([*map(in_notation, problems)])
    return config


def _load(
    path: str, trail: tuple[str, ...], named_at: Place | None, problems: list[Problem], texts: Mapping[str, bytes]
) -> Config:
    """Read ``path``, which ``trail`` led to."""
    above = [os.path.realpath(other) for other in trail]
    if os.path.realpath(path) in above:
        circle = " → ".join((*trail[above.index(os.path.realpath(path)) :], path))
        problems.append(Problem("CQ008", f"{shown(path)} extends itself: {circle}", named_at))
        return Config()
    try:
        open_text = texts.get(os.path.realpath(path))
        if open_text is None:
            with open(path, "rb") as file:  # noqa: PTH123 - see `find_config`
                open_text = file.read()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        problems.append(Problem("CQ007", f"cannot open {shown(path)}: {reason}", named_at or Place(path)))
        return Config()
    data = open_text
    reading = SourceReading(Source(path, data), problems, [])
    entry = _read(reading)
    if entry is None:
        return Config(path, sources={path: data})
    base = Config()
    from pathlib import Path

    for extended in entry.get(EXTENDS) or ():
        beside = str(Path(path).parent / extended.text)
        base = _load(beside, (*trail, path), extended.place, problems, texts).over(base)
    return _config(path, data, entry).over(base)


def _config(path: str, data: bytes, entry: Entry) -> Config:
    from pathlib import Path

    folder = Path(path).parent
    baseline, show = entry.get(BASELINE), entry.get(SHOW)
    return Config(
        path=path,
        protocol=entry.get(PROTOCOL),
        options={pack: options.value for pack, options in (entry.get(OPTIONS) or {}).items()},
        severities={rule: severity.value for rule, severity in (entry.get(SEVERITIES) or {}).items()},
        checks=tuple(map(team_rule, entry.get(CHECKS) or ())),
        accept=tuple(map(acceptance, entry.get(ACCEPT) or ())),
        packs=tuple(str(folder / pack.text) for pack in entry.get(PACKS) or ()),
        exclude=_excluded([each.text for each in entry.get(EXCLUDE) or ()], folder),
        show=() if show is None else tuple(show),
        fail_on=entry.get(FAIL_ON),
        format=entry.get(FORMAT),
        baseline=str(folder / baseline) if baseline is not None else None,
        serve=entry.get(SERVE) or {},
        sources={path: data},
    )


def _excluded(lines: Sequence[str], folder: Path) -> tuple[IgnorePatterns, ...]:
    return (read_ignore_patterns(lines, str(folder)),) if lines else ()


# From TOML to a tree

_AT = regular_expression(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


def _read(reading: SourceReading) -> Entry | None:
    """Read the file by its form; None where it is no TOML."""
    name = reading.source.name
    try:
        text = reading.source.data.decode("utf-8-sig")
        document = _parsed(text)
    except UnicodeDecodeError:
        reading.problem("CQ001", "this is not TOML: its bytes are not UTF-8", Place(name), "save the file as UTF-8")
        return None
    except RecursionError:
        reading.problem("CQ002", "lists and tables are nested too deep, which is refused", Place(name))
        return None
    except ValueError as error:
        at = _AT.search(str(error))
        line, column = (int(at[1]), int(at[2])) if at and at[1] else (None, None)
        message = _AT.sub("", str(error)).strip()
        advice = _unquoted(text, line, column)
        reading.problem(
            "CQ001", f"this is not TOML: {message[:1].lower()}{message[1:]}", Place(name, line, column), advice
        )
        return None
    from pathlib import Path

    prefix: _Path = _TABLE if Path(name).name == SHARED_NAME else ()
    table = _our_table(document) if prefix else document
    places: dict[_Path, _At] = {}
    for path, stated in _stated_places(text):
        for length in range(1, len(path) + 1):
            places.setdefault(path[:length], stated)
    return CONFIG.read(_node({} if table is None else table, prefix, places, _At()), reading, ".".join(_TABLE))


def _unquoted(text: str, line: int | None, column: int | None) -> str | None:
    """Suspect a text without quotes where a value is invalid."""
    lines = text.split("\n")
    rest = lines[line - 1][(column or 1) - 1 :] if line is not None and line <= len(lines) else ""
    word = re.match(r"[A-Za-z][\w./-]*", rest)
    return f'write a text in quotes: `"{word[0]}"`' if word else None


_Path: TypeAlias = tuple[str | int, ...]


class _At(NamedTuple):
    """The position of a key and of its value."""

    line: int | None = None
    key: int | None = None
    value: int | None = None


def _node(value: Any, path: _Path, places: Mapping[_Path, _At], above: _At) -> Node:
    """Return a parsed value as a tree; a part without a place of its own has the line of its parent."""
    at = places.get(path, _At(above.line))
    if isinstance(value, dict):
        node = MappingNode(at.line, at.value)
        for name, item in value.items():
            key = places.get((*path, name), _At(at.line))
            below = _node(item, (*path, name), places, at)
            node.entries[name] = (ScalarNode(name, key.line, key.key, plain=False), below)
        return node
    if isinstance(value, list):
        return SequenceNode(
            at.line, at.value, [_node(item, (*path, index), places, at) for index, item in enumerate(value)]
        )
    if isinstance(value, bool):
        return ScalarNode("true" if value else "false", at.line, at.value, plain=True)
    if isinstance(value, (int, float)):
        return ScalarNode(str(value), at.line, at.value, plain=True)
    return ScalarNode(value if isinstance(value, str) else value.isoformat(), at.line, at.value, plain=False)


_PART = r"""(?:[A-Za-z0-9_-]+|"[^"\\]*"|'[^']*')"""
_DOTTED = rf"{_PART}(?:\s*\.\s*{_PART})*"
_HEADER = regular_expression(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]\]?\s*(?:#.*)?")
_STATED = regular_expression(rf"\s*({_DOTTED})\s*=\s*")
_LONG_STRING = regular_expression("\"\"\"|'''")


def _stated_places(text: str) -> Iterator[tuple[_Path, _At]]:
    """Yield where tables and keys are stated, as far as the beginnings of lines tell; tomllib keeps no places."""
    table: _Path = ()
    counts: dict[_Path, int] = {}
    within: str | None = None
    for number, line in enumerate(text.split("\n"), 1):
        begins_within = within
        for quotes in _LONG_STRING.findall(line):
            within = quotes if within is None else None if within == quotes else within
        if begins_within is not None:
            continue
        if header := _HEADER.fullmatch(line):
            table = _indexed(_parts(header[2]), counts, new=header[1] == "[[")
            yield table, _At(number, header.start(2) + 1, header.start(2) + 1)
        elif stated := _STATED.match(line):
            yield (*table, *_parts(stated[1])), _At(number, stated.start(1) + 1, stated.end() + 1)


def _parts(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip("\"'") for part in re.findall(_PART, dotted))


def _indexed(names: tuple[str, ...], counts: dict[_Path, int], *, new: bool) -> _Path:
    """Return the path of a table, with the index where it is one of an array of tables."""
    path: _Path = ()
    for position, name in enumerate(names, 1):
        path = (*path, name)
        if new and position == len(names):
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path
