"""Hook specifications and the manager that loads packs, importers, exporters, formatters and commands.

Everything C-QoS ships comes through the same entry-point group ``cqos`` as anybody's plugin. Hooks hand over light
descriptors; what they describe is imported on use, so that start-up loads only what a command needs. Plugins are
loaded one at a time: a broken one is reported in `Plugins.broken` and the rest works.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

import pluggy

from cqos_core.problems import CqosError

if TYPE_CHECKING:
    from collections.abc import Callable
    from importlib.metadata import EntryPoint

    import click

    from cqos_core.formatters.style import Style
    from cqos_core.importers.source import Claim, Reader
    from cqos_core.pack import RulePack
    from cqos_core.report import Report
    from cqos_core.system import System

GROUP = "cqos"
hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)
T = TypeVar("T")


class Lazy(Generic[T]):
    """An object named ``"module:attribute"``, imported on the first call."""

    __slots__ = ("path",)

    def __init__(self, path: str) -> None:
        """Name the object; nothing is imported yet."""
        self.path = path

    def __call__(self) -> T:
        """Import and return the object."""
        module, _, attribute = self.path.partition(":")
        return cast("T", getattr(importlib.import_module(module), attribute))


@dataclass(frozen=True, slots=True)
class RulePackInfo:
    """A rule pack.

    Attributes:
        id: what systems name it by (``ros2``).
        pack: ``"module:object"``, the `RulePack` value.
        default_for: importers whose files mean this protocol when they name none (``bpmn``).
    """

    id: str
    summary: str
    pack: str
    default_for: tuple[str, ...] = ()

    def load(self) -> RulePack:
        """Import the pack."""
        return Lazy[Any](self.pack)()  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class ImporterInfo:
    """A file format that can be read.

    Attributes:
        suffixes: endings it usually has (``.bpmn``); a directory is searched for these.
        claims: ``"module:function"``, a `Claim`; the module must be light.
        reader: ``"module:function"``, a `Reader`.
    """

    name: str
    summary: str
    suffixes: tuple[str, ...]
    claims: str
    reader: str

    def load_claim(self) -> Claim:
        """Import the function that recognises the format."""
        return Lazy[Any](self.claims)()  # type: ignore[no-any-return]

    def load_reader(self) -> Reader:
        """Import the reader."""
        return Lazy[Any](self.reader)()  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class ExporterInfo:
    """A format that can be written; ``writer`` names a function from a `System` to text."""

    name: str
    summary: str
    suffix: str
    writer: str

    def load(self) -> Callable[[System], str]:
        """Import the writer."""
        return Lazy[Any](self.writer)()  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class FormatterInfo:
    """A way to show a report.

    Attributes:
        renderer: ``"module:function"``, from a `Report` and a `Style` to text.
        for_people: read in a terminal, beside what stands on standard error; several reports follow one another. All
            others get one report of everything that was checked, with inputs that could not be read as findings.
    """

    name: str
    summary: str
    renderer: str
    for_people: bool = False

    def load(self) -> Callable[[Report, Style], str]:
        """Import the renderer."""
        return Lazy[Any](self.renderer)()  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class CommandInfo:
    """A subcommand of ``cqos``; ``command`` names a `click.Command`."""

    name: str
    summary: str
    command: str

    def load(self) -> click.Command:
        """Import the command."""
        return Lazy[Any](self.command)()  # type: ignore[no-any-return]


class Hooks:
    """What a plugin may implement. Each hook receives a ``register`` callable and calls it once per descriptor."""

    @hookspec
    def register_rule_packs(self, register: Callable[[RulePackInfo], None]) -> None:
        """Register rule packs."""

    @hookspec
    def register_importers(self, register: Callable[[ImporterInfo], None]) -> None:
        """Register importers."""

    @hookspec
    def register_exporters(self, register: Callable[[ExporterInfo], None]) -> None:
        """Register exporters."""

    @hookspec
    def register_formatters(self, register: Callable[[FormatterInfo], None]) -> None:
        """Register formatters."""

    @hookspec
    def register_commands(self, register: Callable[[CommandInfo], None]) -> None:
        """Register subcommands."""


@dataclass(frozen=True, slots=True)
class BrokenPlugin:
    """A plugin that could not be loaded: its entry-point name, distribution with version, and what went wrong."""

    name: str
    distribution: str
    reason: str

    def __str__(self) -> str:
        """One sentence for a person."""
        return f"plugin `{self.name}` of {self.distribution} could not be loaded and is left out: {self.reason}"


@dataclass(slots=True)
class Plugins:
    """Everything the installed plugins offer, by name, and the plugins that are broken."""

    packs: dict[str, RulePackInfo] = field(default_factory=dict)
    importers: dict[str, ImporterInfo] = field(default_factory=dict)
    exporters: dict[str, ExporterInfo] = field(default_factory=dict)
    formatters: dict[str, FormatterInfo] = field(default_factory=dict)
    commands: dict[str, CommandInfo] = field(default_factory=dict)
    broken: list[BrokenPlugin] = field(default_factory=list)
    owners: dict[tuple[str, str], str] = field(default_factory=dict)
    _left_out: set[tuple[str, str]] = field(default_factory=set)

    def owner(self, kind: str, name: str) -> str:
        """Distribution and version that registered ``name`` (``kind``: ``packs``, ``importers`` …)."""
        return self.owners.get((kind, name), "cqos")

    def pack(self, pack_id: str) -> RulePack | None:
        """Return the installed pack ``pack_id``, imported on first use; None if there is none, or it is broken."""
        info = self.packs.get(pack_id)
        if info is None or ("packs", pack_id) in self._left_out:
            return None
        try:
            return _load_pack(info)
        except Exception as error:  # noqa: BLE001 - whatever a foreign pack does, the rest must work
            self.leave_out("packs", pack_id, error)
            return None

    def leave_out(self, kind: str, name: str, error: BaseException) -> None:
        """Note in `broken`, once, that something registered failed when it was needed."""
        if (kind, name) not in self._left_out:
            self._left_out.add((kind, name))
            self.broken.append(BrokenPlugin(name, self.owner(kind, name), _reason(error)))


@cache
def _load_pack(info: RulePackInfo) -> RulePack:
    return info.load()


_KINDS = ("rule_packs", "importers", "exporters", "formatters", "commands")


def _reason(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__


def _distribution(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else "an unknown distribution"


def _register(plugins: Plugins, name: str, distribution: str, module: Any) -> None:
    """Call one plugin's hooks into ``plugins``; all or nothing, so that a broken one leaves no half behind."""
    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(Hooks)
    manager.register(module, name)
    manager.check_pending()
    taken: list[tuple[str, Any]] = []
    for kind in _KINDS:
        found: list[Any] = []
        getattr(manager.hook, f"register_{kind}")(register=found.append)
        taken += [(kind.removeprefix("rule_"), info) for info in found]
    for kind, info in taken:
        key = info.id if kind == "packs" else info.name
        if key in getattr(plugins, kind):
            message = (
                f"it registers {kind.removesuffix('s')} `{key}`, which {plugins.owner(kind, key)} already provides"
            )
            raise CqosError(message)
    for kind, info in taken:
        key = info.id if kind == "packs" else info.name
        getattr(plugins, kind)[key] = info
        plugins.owners[kind, key] = distribution


@cache
def load_plugins() -> Plugins:
    """Find and load every installed plugin once per process; see `Plugins.broken` for those that failed."""
    plugins = Plugins()
    # Ours first, then by name: a third party can never take a name we ship, whatever the order of installation.
    entries = sorted(entry_points(group=GROUP), key=lambda e: (not e.value.startswith("cqos_core"), e.name, e.value))
    for entry in entries:
        distribution = _distribution(entry)
        try:
            _register(plugins, entry.name, distribution, entry.load())
        except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever a foreign plugin does, the rest must work
            plugins.broken.append(BrokenPlugin(entry.name, distribution, _reason(error)))
    return plugins
