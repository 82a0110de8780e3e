"""The tables of calls that are followed, as data: what makes nodes, endpoints, parameters and qualities of service."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import yaml

from cqos_core.importers.source_reading import did_you_mean, shown
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place
from cqos_core.plugins import GROUP
from cqos_ros2_sources.programs.names import fits, last_part

FOLDER: Final = Path(__file__).parents[1] / "tables"
ENDING: Final = ".calls.yaml"
NOT: Final = "not "
"""How a row says that a flag means the opposite."""
_LARGEST: Final = 1_000_000
_LANGUAGES: Final = ("cpp", "python")
_ROW: Final = frozenset(
    (
        "call",
        "of",
        "node",
        "makes",
        "type",
        "topic",
        "qos",
        "default_qos",
        "unknown_qos",
        "unknown_topic",
        "overridable",
        "options",
        "beside",
        "below",
        "given",
        "uses",
        "unread",
        "topic_is",
        "qos_is",
        "transport",
        "transport_parameter",
        "arguments",
        "client",
        "settings",
        "defaults",
        "fixed",
        "values",
        "new",
        "into",
    )
)
_PARAMETER: Final = frozenset(
    ("call", "of", "node", "name", "name_is", "default", "default_is", "into", "several", "prefix")
)
_NODE: Final = frozenset(("name", "namespace", "options", "lifecycle", "client", "defaults", "values"))
_LISTS: Final = (
    "same",
    "harmless",
    "without_endpoints",
    "changing",
    "calling",
    "anything",
    "bases",
    "of_node",
    "decorators",
    "lifecycle",
    "plugin",
    "plugin_nodes",
    "at_run_time",
    "files",
    "parents",
    "handlers",
    "starts",
    "flags",
)
_KEYS: Final = frozenset(
    ("cqos_calls", "language", "protocol", "nodes", "calls", "parameters", "qos", "objects", "setters", *_LISTS)
)
_DIRECTIONS: Final = ("publishes", "subscribes", "serves", "calls", "action_servers", "action_clients")


@dataclass(frozen=True, slots=True)
class Position:
    """Where an argument stands: at an index, under a keyword, among the template arguments of the call or of the object, or it is a fixed text.

    Attributes:
        path: names of members of the argument, one after the other; several where versions of a library differ.
    """

    index: int | None = None
    keyword: str = ""
    template: int | None = None
    of_object: int | None = None
    text: str = ""
    path: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class Row:
    """One call that is followed; what is not stated is empty."""

    call: str
    on: tuple[str, ...] = ()
    values: dict[str, Any] = field(default_factory=dict)
    protocol: str = ""

    def position(self, key: str) -> Position | None:
        """Return where an argument stands; None where the row names none."""
        stated = self.values.get(key)
        return None if stated is None else _position(stated)

    def positions(self, stated: Any) -> list[Position]:
        """Return the positions that a setting may stand at, the first one first."""
        return [_position(each) for each in (stated if isinstance(stated, list) else [stated])]

    def text(self, key: str) -> str:
        """Return a text of the row."""
        return str(self.values.get(key, ""))


def _position(stated: Any) -> Position:
    if isinstance(stated, int):
        return Position(stated)
    text = str(stated).removeprefix(NOT)
    first, _, rest = text.partition(" ")
    index, _, path = first.partition(".")
    if path and index.isdigit():
        return Position(int(index), path=tuple(tuple(each.split(".")) for each in path.split("|")))
    if first == "template" and rest.isdigit():
        return Position(template=int(rest))
    if first == "object" and rest.isdigit():
        return Position(of_object=int(rest))
    if first.isdigit():
        return Position(int(first), rest)
    return Position(keyword=text, text=text)


@dataclass(slots=True)
class Table:
    """What is followed in one language.

    Attributes:
        nodes: positions of name and namespace, by class.
        calls, parameters: rows by the last part of their names.
        makers, presets, setters, durations: of qualities of service.
        passes: methods of theirs that return the object itself; `reads` leave it as it is, `copies` and functions return a copy.
        numbers: words of policies by their number.
        objects: structures and classes that only carry values: members by argument.
        members: what methods of such objects set.
    """

    language: str
    nodes: dict[str, Row] = field(default_factory=dict)
    calls: dict[str, list[Row]] = field(default_factory=dict)
    parameters: dict[str, list[Row]] = field(default_factory=dict)
    makers: dict[str, dict[str, Any]] = field(default_factory=dict)
    presets: dict[str, str] = field(default_factory=dict)
    setters: dict[str, dict[str, str]] = field(default_factory=dict)
    durations: dict[str, Any] = field(default_factory=dict)
    numbers: dict[str, dict[int, str]] = field(default_factory=dict)
    passes: frozenset[str] = frozenset()
    reads: frozenset[str] = frozenset()
    copies: frozenset[str] = frozenset()
    lists: dict[str, tuple[str, ...]] = field(default_factory=dict)
    objects: dict[str, dict[str, int]] = field(default_factory=dict)
    members: dict[str, str] = field(default_factory=dict)
    _looked_up: dict[tuple[int, str], Any] = field(default_factory=dict)

    def node_class(self, name: str) -> tuple[str, Row] | None:
        """Return the class of nodes that a name means."""
        key = id(self.nodes), name
        if key not in self._looked_up:
            self._looked_up[key] = next((each for each in self.nodes.items() if _means(name, each[0])), None)
        found: tuple[str, Row] | None = self._looked_up[key]
        return found

    def rows(self, kind: str, name: str, classes: Iterable[str], *, method: bool) -> list[Row]:
        """Return the rows of a call.

        Args:
            kind: ``calls`` or ``parameters``.
            name: as called.
            classes: the library classes of what it is called on.
            method: whether it is called on an object.
        """
        rows: dict[str, list[Row]] = getattr(self, kind)
        found = [row for row in rows.get(last_part(name), []) if bool(row.on) == method]
        if not method:
            return [row for row in found if _means(name, row.call)]
        own = list(classes)
        if not own:  # the class is not known: methods of nodes have names of their own, those of other classes do not
            known = [row for row in found if not row.protocol]
            return [row for row in known if any(of == "node" or of in self.nodes for of in row.on)]
        for each in own:  # the nearest class first
            exact = [row for row in found if any(_means(each, of) for of in row.on)]
            if exact:
                return exact
        return [row for row in found if row.on == ("node",)]

    def is_class(self, name: str) -> bool:
        """Whether a name is of a class of a library whose objects make something."""
        return any(
            _means(name, known)
            for rows in self.calls.values()
            for row in rows
            for known in (row.call, *row.on)
            if last_part(known) == last_part(name) and (known not in self.nodes or row.protocol)
        )

    def lookup(self, kind: dict[str, Any], name: str) -> Any:
        """Return what one of the maps has for a name; None where it has nothing."""
        key = id(kind), name
        if key not in self._looked_up:
            last = last_part(name)
            found = [value for known, value in kind.items() if last_part(known) == last and _means(name, known)]
            self._looked_up[key] = found[0] if found and all(each == found[0] for each in found) else None
        return self._looked_up[key]

    def is_same(self, name: str) -> bool:
        """Whether a call returns what it is given."""
        return last_part(name) in self.lists["same"] or name in self.lists["same"]

    def is_listed(self, key: str, name: str) -> bool:
        """Whether a list has a function: by its last part, by how its name begins, or by how its last part begins."""
        last, names = last_part(name), self.lists.get(key, ())
        if last in names or name.startswith(names):
            return True
        return last != name and any(each.endswith("_") and last.startswith(each) for each in names)

    def hands_on(self, name: str) -> bool:
        """Whether a class only hands on the node that it is given: its methods create something there."""
        rows = [row for found in self.calls.values() for row in found]
        return any(fits(of, name) for row in rows for of in row.on) and not any(row.call == name for row in rows)


def _means(written: str, known: str) -> bool:
    """Whether a name as written may be a name of the table; a name without its module means it where it is one word."""
    return fits(known, written) and len(written) <= len(known) + 2


@lru_cache(maxsize=8)
def tables(more: tuple[str, ...] = (), protocol: str = "") -> dict[str, Table]:
    """Return the tables by language: the shipped ones, those of packs for one protocol, and those of further files.

    Raises:
        InputError: a file is no table of calls.
    """
    found = {language: Table(language) for language in _LANGUAGES}
    packs = [path for path in pack_tables() if _protocol(path) == protocol] if protocol else []
    for path in (*sorted(FOLDER.glob(f"*{ENDING}")), *packs, *map(Path, more)):
        _read(path, found)
    return found


@lru_cache(maxsize=1)
def pack_tables() -> tuple[Path, ...]:
    """Return the tables of calls that installed packs have, in their folders `calls`; no pack is imported for it."""
    found: list[Path] = []
    for each in entry_points(group=GROUP):
        spec = find_spec(each.value.partition(":")[0].partition(".")[0])
        for folder in spec.submodule_search_locations or () if spec is not None else ():
            found += sorted((Path(folder) / "calls").glob(f"*{ENDING}"))
    return tuple(found)


def protocols() -> tuple[str, ...]:
    """Return the protocols whose clients can be learned."""
    return tuple(sorted({_protocol(path) for path in pack_tables()} - {""}))


@lru_cache(maxsize=32)
def _protocol(path: Path) -> str:
    document = yaml.safe_load(path.read_bytes())
    return str(document.get("protocol", "")) if isinstance(document, dict) else ""


def _read(path: Path, found: dict[str, Table]) -> None:
    try:
        data = path.read_bytes()
        document = yaml.safe_load(data) if len(data) <= _LARGEST else None
    except (OSError, yaml.YAMLError, RecursionError, ValueError) as error:
        raise _refused(path, " ".join(str(error).split())[:200]) from None
    if not isinstance(document, dict) or document.get("cqos_calls") != 1 or document.get("language") not in found:
        raise _refused(
            path, "it is no table of calls: it needs `cqos_calls: 1` and `language: cpp` or `language: python`"
        )
    _known(document, _KEYS, path)
    table, protocol = found[document["language"]], str(document.get("protocol", ""))
    for name, row in (document.get("nodes") or {}).items():
        _known(row, _NODE, path)
        table.nodes[name] = Row(name, (), row, protocol)
    for kind, keys in (("calls", _ROW), ("parameters", _PARAMETER)):
        for row in document.get(kind) or []:
            _known(row, keys, path)
            if not isinstance(row.get("call"), str) or row.get("makes", "calls") not in _DIRECTIONS:
                raise _refused(path, f"a row of `{kind}` needs `call`, and `makes` is one of {', '.join(_DIRECTIONS)}")
            on = row.get("of", ())
            made = Row(row["call"], (on,) if isinstance(on, str) else tuple(on), row, protocol)
            getattr(table, kind).setdefault(last_part(made.call), []).append(made)
    qos = document.get("qos") or {}
    for key in ("makers", "presets", "setters", "durations", "numbers"):
        getattr(table, key).update(qos.get(key) or {})
    table.passes |= frozenset(qos.get("passes") or ())
    table.reads |= frozenset(qos.get("reads") or ())
    table.copies |= frozenset(qos.get("copies") or ())
    table.objects.update(document.get("objects") or {})
    table.members.update(document.get("setters") or {})
    for key in _LISTS:
        table.lists[key] = (*table.lists.get(key, ()), *(document.get(key) or ()))


def _known(row: Any, keys: frozenset[str], path: Path) -> None:
    if not isinstance(row, dict):
        raise _refused(path, f"{shown(str(row)[:60])} is no map")
    for key in row:
        if key not in keys:
            raise _refused(
                path,
                f"there is no key {shown(str(key)[:60])}{did_you_mean(str(key), keys)}; allowed: {', '.join(sorted(keys))}",
            )


def _refused(path: Path, message: str) -> InputError:
    return InputError(
        [Problem("CQ047", f"table of calls: {message}", Place(str(path)), "docs/learn.md has an example")]
    )
