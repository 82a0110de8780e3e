"""Chooses the importer that reads a source."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from cqos_core.files.source_files import HEAD
from cqos_core.model.endpoint_rows import kinds_of
from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place
from cqos_core.plugins import FAULTS, ImporterInfo, Plugins, load_plugins

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from cqos_core.model.source import Claim, Source
    from cqos_core.model.system import System


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
    return [info for info in plugins.importers.values() if claims_source(info, source.name, head, plugins)]


def _fitting(claiming: list[ImporterInfo], beside: Collection[str]) -> list[ImporterInfo]:
    """Return the importers of overlays for a protocol in ``beside``, else those of complete files."""
    if len(claiming) == 1:
        return claiming
    over = [info for info in claiming if info.overlays in beside]
    return over or [info for info in claiming if not info.overlays] or claiming


def depends_on_others(source: Source) -> bool:
    """Whether the importer of ``source`` depends on the other files, so that it is read after them."""
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


def claims_source(info: ImporterInfo, name: str, head: bytes, plugins: Plugins) -> bool:
    """Whether an importer claims a file; one that fails claims nothing, so that a broken plugin stops no other."""
    try:
        return _claims_once(info.load_claim(), name, head)  # type: ignore[arg-type] # functions are hashable
    except FAULTS as error:
        plugins.note_failure("importers", info.name, error, f"could not look at {name}")
        return False


@lru_cache(maxsize=1024)
def _claims_once(claim: Claim, name: str, head: bytes) -> bool:
    """Whether an importer claims a file; cached, because a file is asked about several times."""
    return bool(claim(name, head))


def default_protocol(importer: str, plugins: Plugins) -> str | None:
    """Return the default protocol of an importer: that of the one pack that claims it, else None.

    A pack that C-QoS ships wins over those of plugins.
    """
    claiming = [info.id for info in plugins.packs.values() if importer in info.default_for]
    first = [pack_id for pack_id in claiming if plugins.shipped("packs", pack_id)] or claiming
    return first[0] if len(first) == 1 else None
