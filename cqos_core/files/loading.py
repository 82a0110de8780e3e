"""From paths and bytes to systems: which importer reads what."""

from __future__ import annotations

import os
from dataclasses import field, replace
from functools import lru_cache
from itertools import count
from typing import TYPE_CHECKING, Final

from cqos_core.files.entrances import Ways, find_ways, read_whole
from cqos_core.files.opening import HEAD, STDIN, STDIN_NAME, File, Found, find_files, open_file, read_path
from cqos_core.model.dataclass import dataclass
from cqos_core.model.endpoint_rows import kinds_of
from cqos_core.model.folder_suggestion import ProblemWithLines
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import CqosError, InputError, Problem, add_note, describe, keep_traceback
from cqos_core.model.settings import Place
from cqos_core.model.source import Opener, ReadContext, Source, SourceGroup, no_files
from cqos_core.model.system import System
from cqos_core.plugins import FAULTS, ImporterInfo, Plugins, load_plugins

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    from cqos_core.files.entrances import Way
    from cqos_core.files.ignoring import Patterns
    from cqos_core.model.folder_suggestion import FolderSuggestion
    from cqos_core.model.optional_features import Feature
    from cqos_core.model.source import Claim


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
        advice = f"choose one with --from: {' or '.join(f'`--from {info.name}`' for info in claiming)}"
        raise InputError([Problem("CQ003", message, Place(source.name), advice)])
    return claiming[0] if claiming else None


def _claiming(source: Source, plugins: Plugins) -> list[ImporterInfo]:
    head = source.data[:HEAD]
    return [info for info in plugins.importers.values() if _claims(info, source.name, head, plugins)]


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


def shares_names(source: Source, importer: str | None = None) -> str:
    """Return the importer of ``source`` if its files define names for one another, else an empty text."""
    plugins = load_plugins()
    claiming = [plugins.importers[importer]] if importer in plugins.importers else _claiming(source, plugins)
    return next((info.name for info in claiming if info.shares_names), "")


def protocols_of(systems: Iterable[System]) -> frozenset[str]:
    """Return the protocols that anything in ``systems`` is of."""
    found: set[str | None] = set()
    for system in systems:
        found.add(system.protocol)
        found.update(participant.protocol for participant in system.participants.values())
        found.update(endpoint.protocol for endpoint in kinds_of(system.endpoints))
    return frozenset(protocol for protocol in found if protocol is not None)


def _claims(info: ImporterInfo, name: str, head: bytes, plugins: Plugins) -> bool:
    """Ask one importer; one that fails claims nothing, so that a broken plugin cannot stop the others."""
    try:
        return _claims_once(info.load_claim(), name, head)  # type: ignore[arg-type] # functions are hashable
    except FAULTS as error:
        plugins.note_failure("importers", info.name, error, f"could not look at {name}")
        return False


@lru_cache(maxsize=1024)
def _claims_once(claim: Claim, name: str, head: bytes) -> bool:
    """Ask once: a source is asked about several times, and so is a file that is edited further down."""
    return bool(claim(name, head))


def read_source(
    source: Source,
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    *,
    opener: Opener = no_files,
    protocol: str | None = None,
    beside: Collection[str] = (),
    family: SourceGroup | None = None,
) -> System:
    """Read one source with the importer that claims it, or the named one.

    Args:
        source: what to read.
        importer: name of the importer.
        switches: importer switches by importer and name.
        opener: opens files that it includes.
        protocol: what it means if it states none; else the protocol that its format stands for.
        beside: the protocols of the files given together with it; see `recognise`.
        family: the sources of its format that are read together with it.

    Raises:
        InputError: no importer reads the format, or the content cannot be read; with every problem found.
    """
    plugins = load_plugins()
    info = recognise(source, plugins, importer, {*beside, *_given_protocols(protocol)})
    if info is None:
        from cqos_core.files.unread import unread

        raise InputError([unread(source, plugins)])

    def included(source: Source, protocols: frozenset[str]) -> System | None:
        found = recognise(source, plugins, None, {*protocols, *_given_protocols(protocol)})
        return None if found is None else _read(found, source, ReadContext(opener, options=switches or {}), protocol)

    return _read(info, source, ReadContext(opener, included, switches or {}, family or SourceGroup()), protocol)


@dataclass(frozen=True, slots=True)
class GivenSource:
    """A source to read.

    Attributes:
        opener: opens the files that it includes.
        importer: reads it; None: the one that claims it.
        protocol: what it means if it states none.
        switches: of importers, over those of the run.
    """

    source: Source
    opener: Opener = no_files
    importer: str | None = None
    protocol: str | None = None
    switches: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def read_together(
    given: Sequence[GivenSource],
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    *,
    protocol: str | None = None,
    others: Iterable[System] = (),
) -> list[System | InputError]:
    """Read sources that are given together, and ``others``: for each its system, or why it has no system.

    Of a source that another of them includes, the system is empty: it is read as part of that.
    """
    asked = [replace(each, importer=each.importer or importer, protocol=protocol) for each in given]
    found = _read_all(asked, switches, others)
    pairs = zip(given, found, strict=True)
    parts = _parts({each.source.name: result for each, result in pairs if isinstance(result, System)})
    names = [os.path.realpath(each.source.name) for each in given]
    return [System() if name in parts else result for name, result in zip(names, found, strict=True)]


def _read_all(
    given: Sequence[GivenSource],
    switches: Mapping[str, Mapping[str, str]] | None,
    others: Iterable[System] = (),
    step: Callable[[], None] = lambda: None,
) -> list[System | InputError]:
    """Read sources that are given together, those last whose reader is decided by what they are given with.

    ``step`` is called after each.
    """
    shared = [shares_names(each.source, each.importer) for each in given]
    alike = grouped(zip(shared, (each.source for each in given), strict=True))
    families = {name: SourceGroup(sources) for name, sources in alike.items() if name}

    def read_one(number: int, beside: Collection[str] = ()) -> System | InputError:
        each, family = given[number], families.get(shared[number])
        try:
            return read_source(
                each.source,
                each.importer,
                with_own(switches or {}, each.switches),
                opener=each.opener,
                protocol=each.protocol,
                beside=beside,
                family=family,
            )
        except InputError as error:
            return error
        finally:
            step()

    later = {n for n, each in enumerate(given) if each.importer is None and depends_on_others(each.source)}
    found = {n: read_one(n) for n in range(len(given)) if n not in later}
    beside = protocols_of([*others, *(each for each in found.values() if isinstance(each, System))]) if later else ()
    found |= {n: read_one(n, beside) for n in later}
    return [found[n] for n in range(len(given))]


def with_own(
    switches: Mapping[str, Mapping[str, str]], own: Mapping[str, Mapping[str, str]]
) -> dict[str, Mapping[str, str]]:
    """Return switches of importers, with those of ``own`` over them."""
    return {**switches, **{name: {**switches.get(name, {}), **each} for name, each in own.items()}}


def _parts(read: Mapping[str, System]) -> dict[str, str]:
    """Return the files that others include, each by its real path with one of those; ``read`` has systems by their paths."""
    return {
        included: path
        for path, system in read.items()
        for name in system.sources
        if (included := os.path.realpath(name)) != os.path.realpath(path)
    }


def included_files(
    given: Sequence[GivenSource], importer: str | None = None, *, protocol: str | None = None
) -> tuple[Source, ...]:
    """Return every file that sources include, for a client that sends them to another machine.

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

    asking = [GivenSource(each.source, remembering(each.opener)) for each in given]
    failed = [each for each in read_together(asking, importer, protocol=protocol) if isinstance(each, InputError)]
    if missing and failed:
        raise InputError([problem for error in failed for problem in error.problems])
    return tuple(opened.values())


def _given_protocols(protocol: str | None) -> tuple[str, ...]:
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
            add_note(error, f"importer `{info.name}` ({owner}) was reading {source.name}")
            raise
        keep_traceback(f"importer `{info.name}` of {owner} reading {source.name}", error)
        message = f"importer `{info.name}` of {owner} failed: {describe(error)}"
        raise InputError([Problem("CQ702", message, Place(source.name), _PLUGIN_HELP)]) from error
    if system.protocol is None:
        system.protocol = protocol or default_protocol(info.name, plugins)
    system.partial = system.partial or not info.whole
    if any(each.addresses for each in system.brokers.values()):
        from cqos_core.files.merging import join_addresses  # which few files need

        join_addresses(system)  # of files that it includes
    return system


_PLUGIN_HELP: Final = "report it to the authors of the plugin, with what `cqos --debug …` prints"


def _refuse_unusable(system: object) -> None:
    """Refuse what a foreign importer may return and nothing later could work with."""
    if not isinstance(system, System):
        raise TypeError(f"its reader returned a {type(system).__name__}, not a System")
    missing = {endpoint.participant for endpoint in kinds_of(system.endpoints)} - system.participants.keys()
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
class FileOutcome:
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
        not_searched: folders that were passed over: generated, or excluded.
        parts: files that are no systems of their own, each with one that includes it.
        unsearched: problems of directories that cannot be searched.
        ways: how named paths are read that no importer reads as they are named.
        folders: what was read as one folder, by path, so that it can be read again.
        left: parts of systems that are not read because of such a way, each with its importer.
        covered: parts of systems where such a way reads what it refers to, and nothing else.
        lacking: files in folders that a distribution reads which is not installed, one of each.
    """

    outcomes: list[FileOutcome] = field(default_factory=list)
    skipped: int = 0
    not_searched: tuple[str, ...] = ()
    parts: dict[str, str] = field(default_factory=dict)
    unsearched: tuple[Problem, ...] = ()
    ways: Ways = field(default_factory=Ways)
    folders: dict[str, GivenSource] = field(default_factory=dict)
    left: list[tuple[File, ImporterInfo]] = field(default_factory=list)
    covered: list[File] = field(default_factory=list)
    lacking: Mapping[str, Feature] = field(default_factory=dict)

    @property
    def systems(self) -> list[tuple[str, System]]:
        """The systems that were read, each with its path."""
        return [(each.file.path, each.system) for each in self.outcomes if each.system is not None]

    @property
    def unused(self) -> list[str]:
        """The covered parts to which nothing that was read refers."""
        read = {os.path.realpath(name) for _, system in self.systems for name in system.sources}
        return [each.path for each in self.covered if os.path.realpath(each.path) not in read]

    @property
    def problems(self) -> list[Problem]:
        """Everything that could not be read, and why; once, also where it is in a file that several include."""
        found = (problem for each in self.outcomes for problem in each.problems)
        return [*self.unsearched, *dict.fromkeys(found)]


def with_texts(texts: Mapping[str, bytes]) -> Opener:
    """Return what opens files; ``texts`` has bytes that count instead of those of files, by real path."""

    def opener(name: str, relative_to: str) -> Source:
        path = os.path.join(os.path.dirname(relative_to), name)  # noqa: PTH118, PTH120 - as in `find_files`
        data = None if name.endswith("/") else texts.get(os.path.realpath(path))
        return open_file(name, relative_to) if data is None else Source(path, data)

    return opener


def folder_reader(plugins: Plugins, switches: Mapping[str, Mapping[str, str]]) -> str:
    """Return the importer that reads folders as one system, as its switch asks for; empty where none does."""
    asked = (info.name for info in plugins.importers.values() if info.folders_with in switches.get(info.name, ()))
    return next(asked, "")


def load_paths(
    paths: Iterable[str],
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    stdin: Source | None = None,
    *,
    protocol: str | Callable[[str], str | None] | None = None,
    excluded: Sequence[Patterns] = (),
    step: Callable[[int, int], None] = lambda _done, _all: None,
    texts: Mapping[str, bytes] | None = None,
    entering: bool = False,
) -> Loaded:
    """Read every path; directories are searched. Nothing is raised: problems are collected.

    Args:
        paths: files and directories; ``-`` is ``stdin``.
        importer: read all of them with this importer.
        switches: importer switches by importer and name.
        stdin: what ``-`` stands for.
        protocol: of files that state none; or what says it of each path.
        excluded: what a search of folders passes over.
        step: called after each file with the number of read files and the number of all.
        texts: bytes that count instead of those of files, by real path.
        entering: read what `find_ways` finds, unless the caller states an importer or the switch for folders. Where a
            person has to choose, only whole systems of folders are read.
    """
    plugins, named = load_plugins(), [*paths]
    reader = folder_reader(plugins, switches or {})
    found, whole = _files(named, plugins, importer, excluded, reader)
    not_searched, unsearched = tuple(found.not_searched), tuple(found.problems)
    loaded = Loaded(skipped=len(found.skipped), not_searched=not_searched, unsearched=unsearched)
    if entering and not reader and importer is None:
        _enter(named, found, loaded, plugins)
    ways = loaded.ways
    folders = whole | {file.path for file in ways.taken}
    opener = with_texts(texts) if texts else open_file
    done = count(1)
    given: dict[int, GivenSource] = {}
    results: dict[int, System | InputError] = {}
    for position, file in enumerate(found.files):
        try:
            if file.path in whole:
                given[position] = GivenSource(Source(file.path, b""), opener, reader)
                continue
            if same := ways.taken.get(file):
                given[position] = _through(same, file.path, opener)
                continue
            if file.path in ways.refused and file.named:
                results[position] = _refused(file.path, ways.refused[file.path])
                continue
            source = stdin if file.path == STDIN and stdin is not None else _open(file, plugins, importer, texts)
            if source is not None:
                own = no_files if source.name == STDIN_NAME else opener
                meant = protocol(file.path) if callable(protocol) else protocol
                given[position] = GivenSource(source, own, importer, meant)
                continue
            loaded.skipped += 1
        except InputError as error:
            results[position] = error
        step(next(done), len(found.files))
    loaded.folders = {each.source.name: each for each in given.values() if each.source.name in folders}
    read = _read_all([*given.values()], switches, step=lambda: step(next(done), len(found.files)))
    results |= zip(given, read, strict=True)
    _divide([_outcome(found.files[position], result) for position, result in sorted(results.items())], loaded)
    return loaded


def _enter(paths: Sequence[str], found: Found, loaded: Loaded, plugins: Plugins) -> None:
    """Find entrances, and put what is read through them in the place of what is named."""
    folders = [path for path in paths if os.path.isdir(path)]  # noqa: PTH112 - as in `find_files`
    if folders:
        from cqos_core.model.optional_features import unread_files

        loaded.lacking = unread_files([each.path for each in (*found.files, *found.skipped) if not each.named])
    ways = loaded.ways = find_ways(found, folders, plugins, lambda path: _is_unclaimed(path, plugins))
    entered = {way.path for same in ways.taken.values() for way in same}
    kept = []
    for file in found.files:
        part = _part(file, plugins) if file.folder in ways.narrowed else None
        if part is not None and not ways.covers(file.path):
            loaded.left.append((file, part))
        elif part is not None:
            loaded.covered.append(file)
        elif not (file.named and file.path in entered):
            kept.append(file)
    ways.leave_open({file.folder for file, _ in loaded.left})
    # Without the entrance, what is named beside it would be a system that nobody has.
    found.files = [] if ways.open and any(each.named for each in kept) else [*ways.taken, *kept]


def _is_unclaimed(path: str, plugins: Plugins) -> bool:
    """Whether there is a file that no importer reads; what else is wrong with it is found where it is read."""
    try:
        return recognise(read_path(path, HEAD), plugins) is None
    except InputError:
        return False


def _refused(path: str, entrance: FolderSuggestion) -> InputError:
    return InputError([ProblemWithLines("CQ003", entrance.message, Place(path), "write", entrance.commands)])


def _through(ways: Sequence[Way], folder: str, opener: Opener) -> GivenSource:
    info = ways[0].importer
    value = "\n".join(dict.fromkeys(way.entrance.value for way in ways))
    return GivenSource(Source(folder, b""), opener, info.name, None, {info.name: {info.folders_with: value}})


def _part(file: File, plugins: Plugins) -> ImporterInfo | None:
    """Return the importer of a file, if it is a part of a system."""
    try:
        info = recognise(read_path(file.path, HEAD), plugins)
    except InputError:
        return None  # what is wrong with it is found where it is read
    return None if info is None or info.whole else info


def _outcome(file: File, result: System | InputError) -> FileOutcome:
    return FileOutcome(file, result) if isinstance(result, System) else FileOutcome(file, problems=result.problems)


def _files(
    paths: Sequence[str], plugins: Plugins, importer: str | None, excluded: Sequence[Patterns], reader: str
) -> tuple[Found, set[str]]:
    """Return what paths stand for, and the folders among them that the importer ``reader`` reads whole."""
    if not reader:
        return find_files(paths, plugins, importer, excluded), set()
    folders = [path for path in paths if os.path.isdir(path)]  # noqa: PTH112 - as in `find_files`
    every = find_files(folders if len(folders) > 1 else (), plugins, importer, excluded)
    whole = {*read_whole(folders, every, plugins.importers[reader], plugins)}
    found = find_files([path for path in paths if path not in whole], plugins, importer, excluded)
    found.files[:0] = [File(path) for path in paths if path in whole]
    return found, whole


def _divide(outcomes: Sequence[FileOutcome], loaded: Loaded) -> None:
    """Add outcomes to what is loaded; files that others include are parts of those."""
    parts = _parts({each.file.path: each.system for each in outcomes if each.system is not None})
    for each in outcomes:
        whole = parts.get(os.path.realpath(each.file.path))
        if whole is None:
            loaded.outcomes.append(each)
        else:
            loaded.parts[each.file.path] = whole


def _open(
    file: File, plugins: Plugins, importer: str | None, texts: Mapping[str, bytes] | None = None
) -> Source | None:
    """Read a file; None if it was found in a directory and no importer claims it.

    A YAML file in a directory may be anything; only a file that was named must be ours.
    """
    data = texts.get(os.path.realpath(file.path)) if texts else None
    given = None if data is None else Source(file.path, data)
    if not file.named:
        head = given or read_path(file.path, HEAD)
        claimed = (
            _claims(plugins.importers[importer], head.name, head.data[:HEAD], plugins)
            if importer
            else recognise(head, plugins)
        )
        if not claimed:
            return None
    return given or read_path(file.path)
