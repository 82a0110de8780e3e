"""Reads sources as systems: one, or several that are given together."""

from __future__ import annotations

import os
from dataclasses import field, replace
from typing import TYPE_CHECKING, Final

from cqos_core.files.importer_choice import default_protocol, depends_on_others, protocols_of, recognise, shares_names
from cqos_core.files.source_files import open_file
from cqos_core.model.dataclass import dataclass
from cqos_core.model.endpoint_rows import kinds_of
from cqos_core.model.grouping import grouped
from cqos_core.model.problems import CqosError, InputError, Problem, add_note, describe, keep_traceback
from cqos_core.model.settings import Place
from cqos_core.model.source import Opener, ReadContext, Source, SourceGroup, no_files
from cqos_core.model.system import System
from cqos_core.plugins import FAULTS, ImporterInfo, load_plugins

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence


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
        from cqos_core.files.unrecognised_files import unrecognised_problem

        raise InputError([unrecognised_problem(source, plugins)])

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
    """Read sources that are given together; return for each its system, or the error.

    A source that another one includes has an empty system: it is read as part of that. ``others`` are systems that are
    read already.
    """
    asked = [replace(each, importer=each.importer or importer, protocol=protocol) for each in given]
    found = read_all(asked, switches, others)
    pairs = zip(given, found, strict=True)
    parts = included_parts({each.source.name: result for each, result in pairs if isinstance(result, System)})
    names = [os.path.realpath(each.source.name) for each in given]
    return [System() if name in parts else result for name, result in zip(names, found, strict=True)]


def read_all(
    given: Sequence[GivenSource],
    switches: Mapping[str, Mapping[str, str]] | None,
    others: Iterable[System] = (),
    step: Callable[[], None] = lambda: None,
) -> list[System | InputError]:
    """Read sources that are given together. Those whose importer depends on the others are read last.

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


def read_texts(
    names: Sequence[str],
    texts: Mapping[str, bytes],
    importer: str | None = None,
    switches: Mapping[str, Mapping[str, str]] | None = None,
    protocol: str | None = None,
    folders: Mapping[str, GivenSource] | None = None,
) -> list[System]:
    """Read sources by name, with the bytes of ``texts``; other files that they include are opened.

    ``folders`` has the names that are folders, as they were read before.

    Raises:
        InputError: with what is wrong with all of them.
    """

    def opener(name: str, relative_to: str) -> Source:
        if name in texts and name.startswith("<bytes"):
            return Source(name, texts[name])
        source = open_file(name, relative_to)
        known = source.name if relative_to or name not in texts else name
        return replace(source, name=known, data=texts.get(known, source.data))

    whole = folders or {}
    given = [
        replace(whole[name], opener=opener) if name in whole else GivenSource(opener(name, ""), opener)
        for name in names
    ]
    found = read_together(given, importer, switches, protocol=protocol)
    problems = [problem for each in found if isinstance(each, InputError) for problem in each.problems]
    if problems:
        raise InputError(problems)
    return [each for each in found if isinstance(each, System)]


def with_own(
    switches: Mapping[str, Mapping[str, str]], own: Mapping[str, Mapping[str, str]]
) -> dict[str, Mapping[str, str]]:
    """Return switches of importers, with those of ``own`` over them."""
    return {**switches, **{name: {**switches.get(name, {}), **each} for name, each in own.items()}}


def included_parts(read: Mapping[str, System]) -> dict[str, str]:
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
        from cqos_core.files.system_merge import join_addresses  # which few files need

        join_addresses(system)  # of files that it includes
    return system


_PLUGIN_HELP: Final = "report it to the authors of the plugin, with what `cqos --debug …` prints"


def _refuse_unusable(system: object) -> None:
    """Refuse results of a plugin's importer that later stages could not use."""
    if not isinstance(system, System):
        raise TypeError(f"its reader returned a {type(system).__name__}, not a System")
    missing = {endpoint.participant for endpoint in kinds_of(system.endpoints)} - system.participants.keys()
    if missing:
        raise CqosError(f"its reader returned endpoints of `{min(missing)}`, which is none of the participants")
