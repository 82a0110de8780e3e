"""From paths and bytes to systems: which importer reads what, and several sources as one system."""

from __future__ import annotations

import os
import posixpath
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final

from cqos_core.importers.source import Opener, ReadContext, Source, no_files
from cqos_core.plugins import FAULTS, ImporterInfo, Plugins, load_plugins
from cqos_core.problems import CqosError, InputError, Problem, describe, keep_traceback
from cqos_core.system import ImportNote, Place, System

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from cqos_core.system import Bridge, Broker, Endpoint, Participant, Route, Settings

HEAD: Final = 65_536
STDIN: Final = "-"
"""The path that stands for standard input."""
STDIN_NAME: Final = "<stdin>"
"""The name of standard input where the caller gives none; a source of another name may include files beside it."""
_MAXIMUM_BYTES: Final = 512 * 1024 * 1024
_DRIVE: Final = re.compile("[A-Za-z]:/")


def open_file(name: str, relative_to: str) -> Source:
    """Open the file ``name`` that ``relative_to`` includes.

    Raises:
        InputError: as `read_path`, and where it is a pipe or a device, which might never end: people name those themselves.
    """
    path = Path(relative_to).parent / name
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError([Problem("CQ001", "cannot be read: it is no regular file", Place(str(path)))])
    return read_path(str(path))


class SentFiles:
    """Opens files among those that were sent along, by the names that they were sent under, and never from a disk."""

    def __init__(self, sources: Iterable[Source]) -> None:
        """Open no others than these; of several with one name, the first."""
        self._sources: dict[str, Source] = {}
        for source in sources:
            self._sources.setdefault(_spelled(source.name), source)
            self._sources.setdefault(posixpath.normpath(_spelled(source.name)), source)

    def __call__(self, name: str, relative_to: str) -> Source:
        """Return the file ``name`` as it is seen from the one that includes it.

        Raises:
            InputError: it was not sent along.
        """
        if relative_to.startswith("<"):  # it was sent without a name
            return no_files(name, relative_to)
        path = _spelled(name)
        if not _DRIVE.match(path):
            path = posixpath.join(posixpath.dirname(_spelled(relative_to)), path)
        found = self._sources.get(path) or self._sources.get(posixpath.normpath(path))
        if found is None:
            message = f"cannot include `{name}`: no file of this name was sent along with {relative_to}"
            raise InputError([Problem("CQ007", message, Place(relative_to))])
        return found


def _spelled(path: str) -> str:
    """One spelling of a path, of whatever system the sender has."""
    return path.replace("\\", "/")


def read_path(path: str, limit: int | None = None) -> Source:
    """Read a file, whole or its first ``limit`` bytes.

    Raises:
        InputError: it is missing, a directory, not readable, or larger than 512 MiB.
    """
    try:
        with Path(path).open("rb") as file:
            return read_stream(path, file, limit)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError([Problem("CQ001", f"cannot be read: {reason}", Place(path))]) from None


def read_stream(name: str, stream: BinaryIO, limit: int | None = None) -> Source:
    """Read an open file, whole or its first ``limit`` bytes, as the source ``name``.

    Raises:
        InputError: it holds more than 512 MiB.
    """
    # Not the size it says it has: a pipe and a device say nothing.
    data = stream.read(_MAXIMUM_BYTES + 1 if limit is None else limit)
    if len(data) > _MAXIMUM_BYTES:
        message = f"there is more to read than {_MAXIMUM_BYTES // 1024**2} MiB"
        raise InputError([Problem("CQ002", message, Place(name))])
    return Source(name, data)


def recognise(
    source: Source, plugins: Plugins, wanted: str | None = None, beside: Collection[str] = ()
) -> ImporterInfo | None:
    """Return the importer for ``source``: the one ``wanted`` by name, else the one that claims it, else None.

    Where one that lays what it reads over endpoints of another file claims it too, ``beside`` decides: the protocols of
    the files that are given together with it.

    Raises:
        InputError: no importer has the wanted name, or two claim the source.
    """
    if wanted is not None:
        if wanted not in plugins.importers:
            known = ", ".join(sorted(plugins.importers))
            raise InputError(
                [Problem("CQ003", f"there is no importer `{wanted}`; installed: {known}", Place(source.name))]
            )
        return plugins.importers[wanted]
    claiming = _fitting(_claiming(source, plugins), beside)
    if len(claiming) > 1:
        named = " and ".join(f"`{info.name}` ({plugins.owner('importers', info.name)})" for info in claiming)
        message = f"two importers claim this file: {named}"
        raise InputError([Problem("CQ003", message, Place(source.name), "choose one with --from")])
    return claiming[0] if claiming else None


def _claiming(source: Source, plugins: Plugins) -> list[ImporterInfo]:
    return [info for info in plugins.importers.values() if _claims(info, source, plugins)]


def _fitting(claiming: list[ImporterInfo], beside: Collection[str]) -> list[ImporterInfo]:
    """Of several importers, those that lay over what is there, else those that read files that stand for themselves."""
    if len(claiming) == 1:
        return claiming
    over = [info for info in claiming if info.overlays in beside]
    return over or [info for info in claiming if not info.overlays] or claiming


def depends_on_others(source: Source) -> bool:
    """Whether the files given together with ``source`` decide who reads it, so that it has to be read after them."""
    plugins = load_plugins()
    claiming = _claiming(source, plugins)
    return len(claiming) > 1 and any(info.overlays for info in claiming)


def protocols_of(systems: Iterable[System]) -> frozenset[str]:
    """Return the protocols that anything in ``systems`` is of."""
    found: set[str | None] = set()
    for system in systems:
        found.add(system.protocol)
        found.update(participant.protocol for participant in system.participants.values())
        found.update(endpoint.protocol for endpoint in system.endpoints)
    return frozenset(protocol for protocol in found if protocol is not None)


def _claims(info: ImporterInfo, source: Source, plugins: Plugins) -> bool:
    """Ask one importer; one that fails claims nothing, so that a broken plugin cannot stop the others."""
    try:
        return info.load_claim()(source.name, source.data[:HEAD])
    except FAULTS as error:
        plugins.note_failure("importers", info.name, error, f"could not look at {source.name}")
        return False


def read_source(
    source: Source,
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    *,
    opener: Opener = no_files,
    protocol: str | None = None,
    beside: Collection[str] = (),
) -> System:
    """Read one source with the importer that claims it, or the named one.

    Args:
        source: what to read.
        importer: name of the importer.
        switches: importer switches by importer and name.
        opener: opens files that it includes.
        protocol: what it means if it states none; else the protocol that its format stands for.
        beside: the protocols of the files given together with it; see `recognise`.

    Raises:
        InputError: nobody reads the format, or the content cannot be read; with every problem found.
    """
    plugins = load_plugins()
    info = recognise(source, plugins, importer, {*beside, *_stated(protocol)})
    if info is None:
        if not source.data.strip():
            raise InputError([Problem("CQ003", "the file is empty", Place(source.name))])
        known = ", ".join(sorted(plugins.importers))
        message = "no installed importer recognises this format"
        advice = f"installed: {known}; choose one with --from"
        if source.name.lower().endswith((".yaml", ".yml", ".json")):
            advice += "; a system file begins with `cqos: 1`"
        raise InputError([Problem("CQ003", message, Place(source.name), advice)])

    def included(source: Source, protocols: frozenset[str]) -> System | None:
        found = recognise(source, plugins, None, {*protocols, *_stated(protocol)})
        return None if found is None else _read(found, source, ReadContext(opener, options=switches or {}), protocol)

    return _read(info, source, ReadContext(opener, included, switches or {}), protocol)


@dataclass(frozen=True, slots=True)
class Given:
    """A source, and what opens the files that it includes."""

    source: Source
    opener: Opener = no_files


def read_together(
    given: Sequence[Given],
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    *,
    protocol: str | None = None,
    others: Iterable[System] = (),
) -> list[System | InputError]:
    """Read sources that are given together, and ``others``: of each its system, or why there is none.

    Sources whose reader is decided by what they are given with are read last. Of one that another of them includes, the
    system is empty: it is read as part of that.
    """

    def read_one(each: Given, beside: Collection[str] = ()) -> System | InputError:
        try:
            opener = each.opener
            return read_source(each.source, importer, switches, opener=opener, protocol=protocol, beside=beside)
        except InputError as error:
            return error

    later = {n for n, each in enumerate(given) if importer is None and depends_on_others(each.source)}
    found = {n: read_one(each) for n, each in enumerate(given) if n not in later}
    beside = protocols_of([*others, *(each for each in found.values() if isinstance(each, System))]) if later else ()
    found |= {n: read_one(given[n], beside) for n in later}
    parts = _parts({given[n].source.name: each for n, each in found.items() if isinstance(each, System)})
    return [System() if os.path.realpath(each.source.name) in parts else found[n] for n, each in enumerate(given)]


def _parts(read: Mapping[str, System]) -> dict[str, str]:
    """Return the files that others include, each by its real path with one of those; ``read`` has systems by their paths."""
    return {
        included: path
        for path, system in read.items()
        for name in system.sources
        if (included := os.path.realpath(name)) != os.path.realpath(path)
    }


def included_files(
    given: Sequence[Given], importer: str | None = None, *, protocol: str | None = None
) -> tuple[Source, ...]:
    """Return every file that sources include, for whoever sends them to where their disk is not.

    What else is wrong with them is found where they are understood.

    Raises:
        InputError: they cannot be read, because a file is missing that they include.
    """
    opened: dict[str, Source] = {}
    missing: list[Problem] = []

    def remembering(opener: Opener) -> Opener:
        def open_included(name: str, relative_to: str) -> Source:
            try:
                source = opener(name, relative_to)
            except InputError as error:
                missing.extend(error.problems)
                raise
            opened[source.name] = source
            return source

        return open_included

    asking = [Given(each.source, remembering(each.opener)) for each in given]
    failed = [each for each in read_together(asking, importer, protocol=protocol) if isinstance(each, InputError)]
    if missing and failed:
        raise InputError([problem for error in failed for problem in error.problems])
    return tuple(opened.values())


def _stated(protocol: str | None) -> tuple[str, ...]:
    return () if protocol is None else (protocol,)


def _read(info: ImporterInfo, source: Source, context: ReadContext, protocol: str | None) -> System:
    """Read a source with one importer."""
    plugins = load_plugins()
    try:
        system = info.load_reader()(source, context)
        _refuse_unusable(system)
    except FAULTS as error:
        if isinstance(error, InputError) and error.problems:
            raise
        owner = plugins.owner("importers", info.name)
        if plugins.shipped("importers", info.name):
            error.add_note(f"importer `{info.name}` ({owner}) was reading {source.name}")
            raise
        keep_traceback(f"importer `{info.name}` of {owner} reading {source.name}", error)
        message = f"importer `{info.name}` of {owner} failed: {describe(error)}"
        raise InputError([Problem("CQ702", message, Place(source.name), _PLUGIN_HELP)]) from error
    if system.protocol is None:
        system.protocol = protocol or default_protocol(info.name, plugins)
    return system


_PLUGIN_HELP: Final = "report it to the authors of the plugin, with what `cqos --debug …` prints"


def _refuse_unusable(system: object) -> None:
    """Refuse what a foreign importer may return and nothing later could work with."""
    if not isinstance(system, System):
        raise TypeError(f"its reader returned a {type(system).__name__}, not a System")
    missing = {endpoint.participant for endpoint in system.endpoints} - system.participants.keys()
    if missing:
        raise CqosError(f"its reader returned endpoints of `{min(missing)}`, which is none of the participants")


def default_protocol(importer: str, plugins: Plugins) -> str | None:
    """The protocol that files of this importer mean when they name none: the one pack that says so, else None.

    Where we ship a pack that says so, no other can take its place.
    """
    claiming = [info.id for info in plugins.packs.values() if importer in info.default_for]
    first = [pack_id for pack_id in claiming if plugins.shipped("packs", pack_id)] or claiming
    return first[0] if len(first) == 1 else None


@dataclass(frozen=True, slots=True)
class File:
    """One file to read; ``named`` if its path was given, rather than found in a directory."""

    path: str
    named: bool = True


@dataclass(slots=True)
class Found:
    """What some paths stand for.

    Attributes:
        files: in order, each once.
        skipped: how many foreign files were passed over in directories.
        problems: directories that cannot be searched.
    """

    files: list[File] = field(default_factory=list)
    skipped: int = 0
    problems: list[Problem] = field(default_factory=list)


def find_files(paths: Iterable[str], plugins: Plugins, importer: str | None = None) -> Found:
    """List the files that ``paths`` name, and those below directories whose endings importers name.

    Hidden files and directories are passed over. ``importer`` limits the search to its own endings.
    """
    searched = [plugins.importers[importer]] if importer in plugins.importers else plugins.importers.values()
    suffixes = tuple(suffix for info in searched for suffix in info.suffixes)
    found = Found()
    files: dict[str, File] = {}
    for path in paths:
        if os.path.isdir(path):  # noqa: PTH112 - Path.is_dir raises where a path is too long
            for each in _files_below(path, suffixes, found):
                files.setdefault(os.path.realpath(each), File(each, named=False))
        else:
            # The same file named twice is read once; named beats found.
            identity = path if path == STDIN else os.path.realpath(path)
            known = files.get(identity)
            if known is None or not known.named:
                files[identity] = File(path)
    found.files = list(files.values())
    return found


def _files_below(folder: str, suffixes: tuple[str, ...], found: Found) -> Iterator[str]:
    def unreadable(error: OSError) -> None:
        message = f"the folder cannot be searched: {error.strerror}"
        found.problems.append(Problem("CQ001", message, Place(str(error.filename))))

    for inner, folders, names in os.walk(folder, onerror=unreadable):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            path = os.path.join(inner, name)  # noqa: PTH118 - a path is shown as the caller began it
            if name.startswith("."):
                continue
            # Only regular files: opening a pipe would wait for somebody to write into it.
            if name.lower().endswith(suffixes) and os.path.isfile(path):  # noqa: PTH113
                yield path
            else:
                found.skipped += 1


@dataclass(frozen=True, slots=True)
class Outcome:
    """What reading one file gave: a system, or what is wrong with it."""

    file: File
    system: System | None = None
    problems: tuple[Problem, ...] = ()


@dataclass(slots=True)
class Loaded:
    """What reading some paths gave.

    Attributes:
        outcomes: one per file that was read, or should have been.
        skipped: foreign files passed over in directories.
        parts: files that are no systems of their own, each with one that includes it.
        unsearched: problems of directories that cannot be searched.
    """

    outcomes: list[Outcome] = field(default_factory=list)
    skipped: int = 0
    parts: dict[str, str] = field(default_factory=dict)
    unsearched: tuple[Problem, ...] = ()

    @property
    def systems(self) -> list[tuple[str, System]]:
        """The systems that were read, each with its path."""
        return [(each.file.path, each.system) for each in self.outcomes if each.system is not None]

    @property
    def problems(self) -> list[Problem]:
        """Everything that could not be read, and why; once, also where it is in a file that several include."""
        told = (problem for each in self.outcomes for problem in each.problems)
        return [*self.unsearched, *dict.fromkeys(told)]


def load_paths(
    paths: Iterable[str],
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    stdin: Source | None = None,
    *,
    protocol: str | None = None,
    step: Callable[[int, int], None] = lambda _done, _all: None,
) -> Loaded:
    """Read every path; directories are searched. Nothing is raised: problems are collected.

    Args:
        paths: files and directories; ``-`` is ``stdin``.
        importer: read all of them with this importer.
        switches: importer switches by importer and name.
        stdin: what ``-`` stands for.
        protocol: of files that state none.
        step: told after each file how many of how many are read.
    """
    plugins = load_plugins()
    found = find_files(paths, plugins, importer)
    loaded = Loaded(skipped=found.skipped, unsearched=tuple(found.problems))
    outcomes: dict[int, Outcome] = {}
    waiting = dict(enumerate(found.files))
    done = 0
    beside: frozenset[str] | None = None  # not known while there are files that say it themselves
    while waiting:
        later: dict[int, File] = {}
        for position, file in waiting.items():
            try:
                source = stdin if file.path == STDIN and stdin is not None else _open(file, plugins, importer)
                if source is None:
                    loaded.skipped += 1
                elif beside is None and importer is None and depends_on_others(source):
                    later[position] = file
                    continue
                else:
                    outcomes[position] = Outcome(
                        file,
                        read_source(
                            source,
                            importer,
                            switches,
                            opener=no_files if source.name == STDIN_NAME else open_file,
                            protocol=protocol,
                            beside=beside or (),
                        ),
                    )
            except InputError as error:
                outcomes[position] = Outcome(file, problems=error.problems)
            done += 1
            step(done, len(found.files))
        waiting = later
        beside = protocols_of(each.system for each in outcomes.values() if each.system is not None) if later else None
    parts = _parts({each.file.path: each.system for each in outcomes.values() if each.system is not None})
    for _, each in sorted(outcomes.items()):
        whole = parts.get(os.path.realpath(each.file.path))
        if whole is None:
            loaded.outcomes.append(each)
        else:
            loaded.parts[each.file.path] = whole
    return loaded


def _open(file: File, plugins: Plugins, importer: str | None) -> Source | None:
    """Read a file; None if it was found in a directory and nobody claims it.

    A YAML file in a directory may be anything; only a file that was named must be ours.
    """
    if not file.named:
        head = read_path(file.path, HEAD)
        claimed = _claims(plugins.importers[importer], head, plugins) if importer else recognise(head, plugins)
        if not claimed:
            return None
    return read_path(file.path)


_EMPTY: Final = System()


def merge(systems: Sequence[System]) -> System:
    """Put several systems together as one.

    A participant that several sources state is one participant; profiles, topics, brokers and options that several sources
    state alike are one, and stated differently they stay those of the first source, with a warning. Endpoint ids that two
    sources use are told apart when the system is resolved.
    """
    systems = [system for system in systems if system != _EMPTY] or systems[:1]
    if len(systems) == 1:
        return systems[0]
    whole = System(name=" + ".join(dict.fromkeys(system.name for system in systems if system.name)))
    for system in systems:
        for participant in system.participants.values():
            _join_participant(whole, participant, system.protocol)
        for endpoint in system.endpoints:
            _join_endpoint(whole, endpoint, system)
        for broker in system.brokers.values():
            _join_broker(whole, broker, system.protocol)
        for bridge in system.bridges.values():
            _join_bridge(whole, bridge)
        for kind in ("profiles", "topics"):
            _join(whole, kind, getattr(system, kind))
        for pack, settings in system.options.items():
            _join_settings(whole, f"option `{pack}.{{}}`", whole.options.setdefault(pack, {}), settings)
        whole.overlays += system.overlays
        whole.checks += system.checks
        whole.accept += system.accept
        for rule, level in system.severities.items():
            if whole.severities.setdefault(rule, level) != level:
                _stated_differently(whole, f"severity of `{rule}`", whole.severities[rule], level, None)
        whole.notes += system.notes
        whole.sources.update(system.sources)
    protocols = {system.protocol for system in systems}
    whole.protocol = protocols.pop() if len(protocols) == 1 else None
    return whole


def _join_participant(whole: System, participant: Participant, protocol: str | None) -> None:
    participant.protocol = participant.protocol or protocol
    known = whole.participants.setdefault(participant.id, participant)
    if known is participant:
        return
    if known.protocol != participant.protocol:
        first, second = known.protocol or "none", participant.protocol or "none"
        _stated_differently(whole, f"protocol of participant `{known.id}`", first, second, participant.place)
    _join_settings(whole, f"`{{}}` of participant `{known.id}`", known.settings, participant.settings)
    for old, new in participant.remap.items():
        known.remap.setdefault(old, new)
    known.external = known.external and participant.external
    known.starts_after = tuple(dict.fromkeys((*known.starts_after, *participant.starts_after)))
    known.label = known.label or participant.label


def _join_broker(whole: System, broker: Broker, protocol: str | None) -> None:
    broker.protocol = broker.protocol or protocol
    known = whole.brokers.setdefault(broker.id, broker)
    if known is broker:
        return
    if known.protocol != broker.protocol:
        first, second = known.protocol or "none", broker.protocol or "none"
        _stated_differently(whole, f"protocol of broker `{known.id}`", first, second, broker.place)
    _join_settings(whole, f"`{{}}` of broker `{known.id}`", known.settings, broker.settings)
    known.profiles = tuple(dict.fromkeys((*known.profiles, *broker.profiles)))


def _join_bridge(whole: System, bridge: Bridge) -> None:
    known = whole.bridges.setdefault(bridge.id, bridge)
    if known is bridge:
        return
    carried = {_way(route) for route in known.routes}
    known.routes += tuple(route for route in bridge.routes if _way(route) not in carried)
    known.carries = tuple(dict.fromkeys((*known.carries, *bridge.carries)))


def _way(route: Route) -> object:
    """What a route carries, without where that is stated."""
    ends = (
        (end.participant, end.kind, end.topic, *sorted((name, each.text) for name, each in end.settings.items()))
        for end in (route.source, route.target)
    )
    return route.only, route.but, *ends


def _join_settings(whole: System, what: str, known: Settings, stated: Settings) -> None:
    for name, setting in stated.items():
        other = known.setdefault(name, setting)
        if other.text != setting.text:
            _stated_differently(whole, what.format(name), other.text, setting.text, setting.place)


def _stated_differently(whole: System, what: str, first: str, second: str, place: Place | None) -> None:
    message = f"{what} is stated differently, as {first} and as {second}; the first holds"
    whole.notes.append(ImportNote("CQ060", "warning", message, place))


def _join_endpoint(whole: System, endpoint: Endpoint, system: System) -> None:
    endpoint.protocol = endpoint.protocol or system.participants[endpoint.participant].protocol
    whole.endpoints.append(endpoint)


def _join(whole: System, kind: str, stated: Mapping[str, object]) -> None:
    known = getattr(whole, kind)
    for name, value in stated.items():
        other = known.setdefault(name, value)
        if other is not value and _content(other) != _content(value):
            first, second = getattr(other, "place", None), getattr(value, "place", None)
            message = (
                f"{kind.removesuffix('s')} `{name}` is stated differently at {first} and at {second}; the first holds"
            )
            whole.notes.append(ImportNote("CQ060", "warning", message, second))


def _content(value: object) -> object:
    """What is stated, without where."""
    settings = {name: setting.text for name, setting in getattr(value, "settings", {}).items()}
    base = tuple((ref.name, ref.scope) for ref in getattr(value, "base", ()))
    return settings, base, getattr(value, "external", None), getattr(value, "protocol", None)
