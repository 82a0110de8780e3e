"""Descriptors that plugins register, and the loading of plugins.

Our own parts use the entry-point group ``cqos`` as others do. Hooks hand over light descriptors; what these name is imported
on use. Each plugin is loaded alone: `Plugins.broken` has those that failed. ``docs/plugins.md`` says how to write one.
"""

from __future__ import annotations

import importlib
import os
from dataclasses import field
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import pluggy

from cqos_core.model.dataclass import dataclass
from cqos_core.model.problems import CqosError, MissingError, PackError, describe, keep_traceback
from cqos_core.model.regular_expressions import regular_expression

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable
    from importlib.metadata import EntryPoint

    import click

    from cqos_core.model.folder_suggestion import FolderSuggester
    from cqos_core.model.report import Report
    from cqos_core.model.source import Claim, Inserter, Reader
    from cqos_core.model.style import Style
    from cqos_core.packs.drawing_notation import DrawnForm
    from cqos_core.packs.export import Writer
    from cqos_core.packs.pack import RulePack

GROUP: Final = "cqos"
AUTHORS: Final = "the C-QoS authors"
"""The author of the distributions of C-QoS."""
LOAD_VARIABLE: Final = "CQOS_LOAD_PLUGINS"
"""The environment variable that names the distributions to load plugins from, beside those we ship."""
FILES_VARIABLE: Final = "CQOS_PACK_FILES"
"""The environment variable that names rule pack files, which count as installed; `cqos serve --pack` sets it for its processes."""
NOT_LOADED: Final = "could not be loaded and is left out"
FAULTS: Final = (Exception, SystemExit)
"""Exceptions to expect of a plugin: it may also call ``sys.exit``."""

hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)


def named(path: str) -> Any:
    """Import and return the object that ``"module:attribute"`` names."""
    module, _, attribute = path.partition(":")
    return getattr(importlib.import_module(module), attribute)


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

    @property
    def name(self) -> str:
        """Its id, under the attribute that all descriptors have."""
        return self.id

    def load(self) -> RulePack:
        """Import the pack."""
        return named(self.pack)  # type: ignore[no-any-return]


class PackFileInfo(RulePackInfo):
    """A rule pack in a YAML file, whose path is ``pack``."""

    __slots__ = ()

    def load(self) -> RulePack:
        """Read the file."""
        return _read_pack_file(self.pack)


@dataclass(frozen=True, slots=True)
class ImporterOption:
    """An option of the commands that read systems, which sets a switch of an importer.

    Attributes:
        option: as on the command line (``--launch``).
        switch: of the importer; its value has one line for each time that the option is given.
        metavar: name of its value in the help (``FILE``).
    """

    option: str
    switch: str
    metavar: str
    help: str


@dataclass(frozen=True, slots=True)
class ImporterInfo:
    """A file format that can be read.

    Attributes:
        suffixes: endings it usually has (``.bpmn``); a directory is searched for these.
        claims: ``"module:function"``, a `Claim`; the module must be light.
        reader: ``"module:function"``, a `Reader`.
        overlays: what it reads is laid over endpoints of this protocol (a pack's id) and is nothing by itself. Where
            another importer claims the same file, this one reads it beside files of that protocol, else the other.
        declines: ``"module:function"``; says of a name and first bytes that no importer claims what the file is, and what
            to do instead, as two texts; None where it does not know.
        whole: one of its files is a whole system; else a file is a part of one, and its partners are in other files.
        inserter: ``"module:function"``, an `Inserter`: adds settings where there is a `Room`; empty: the format has none.
        drawn: ``"module:object"``, the `DrawnForm` of a drawing; empty: it is none. The reader of a drawing has the switch
            ``lines=false``, with which places that name an element have no line.
        shares_names: its files refer to what other files of this format define, by name.
        options: what it adds to the command line.
        folder_suggestions: ``"module:function"``, a `FolderSuggester`: says how what no importer reads as it is named is read with the first
            of `options`; the module must be light. With that option it reads a folder as one system, in place of the files in
            it; the reader then has the folder as the name of a source without bytes.
    """

    name: str
    summary: str
    suffixes: tuple[str, ...]
    claims: str
    reader: str
    overlays: str = ""
    whole: bool = False
    declines: str = ""
    inserter: str = ""
    shares_names: bool = False
    drawn: str = ""
    options: tuple[ImporterOption, ...] = ()
    folder_suggestions: str = ""

    @property
    def folder_option(self) -> ImporterOption | None:
        """The option with which it reads a folder as one system, or None."""
        return self.options[0] if self.folder_suggestions else None

    def load_claim(self) -> Claim:
        """Import the function that recognises the format."""
        return named(self.claims)  # type: ignore[no-any-return]

    def load_reader(self) -> Reader:
        """Import the reader."""
        return named(self.reader)  # type: ignore[no-any-return]

    def load_drawn(self) -> DrawnForm | None:
        """Import the form of a drawing; None if the format is none."""
        return named(self.drawn) if self.drawn else None

    def load_folder_suggester(self) -> FolderSuggester:
        """Import the function that suggests folders."""
        return named(self.folder_suggestions)  # type: ignore[no-any-return]

    def load_inserter(self) -> Inserter | None:
        """Import the function that adds settings; None if the format has none."""
        return named(self.inserter) if self.inserter else None


@dataclass(frozen=True, slots=True)
class ExporterInfo:
    """A form that systems can be written in.

    Attributes:
        suffix: ending that its files usually have.
        writer: ``"module:function"``, a `Writer`.
        settings: what may be chosen, as ``name=value|value``; the first value is taken where none is chosen.
    """

    name: str
    summary: str
    suffix: str
    writer: str
    settings: tuple[str, ...] = ()

    def load(self) -> Writer:
        """Import the writer."""
        return named(self.writer)  # type: ignore[no-any-return]

    def choices(self) -> dict[str, tuple[str, ...]]:
        """Return the values of each setting, the one that is taken by default first."""
        parted = (text.partition("=") for text in self.settings)
        return {name: tuple(values.split("|")) for name, _, values in parted}


@dataclass(frozen=True, slots=True)
class FormatterInfo:
    """A way to show a report.

    Attributes:
        renderer: ``"module:function"``, from a `Report` and a `Style` to text.
        for_people: read in a terminal, beside what stands on standard error, which has the inputs that could not be
            read. For all others these are findings of the report. Where several systems were checked, the report has
            them all as its ``parts``.
        gives_way: a plugin may take its name: plugins had that name before C-QoS.
    """

    name: str
    summary: str
    renderer: str
    for_people: bool = False
    gives_way: bool = False

    def load(self) -> Callable[[Report, Style], str]:
        """Import the renderer."""
        return named(self.renderer)  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class TranslatorInfo:
    """A language into which rule packs are translated; ``translate`` names a function from a `RulePack` to text."""

    name: str
    summary: str
    translate: str

    def load(self) -> Callable[[RulePack], str]:
        """Import the function."""
        return named(self.translate)  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class FunctionInfo:
    """A function that other parts call by its name, where it is installed; ``function`` is its ``"module:object"``."""

    name: str
    summary: str
    function: str

    def load(self) -> Callable[..., Any]:
        """Import the function."""
        return named(self.function)  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class CommandInfo:
    """A subcommand of ``cqos``; ``command`` names a `click.Command`. A name of two words is in the group of the first word.

    Lists have it behind the command ``after``, where that is installed, else at the end.
    """

    name: str
    summary: str
    command: str
    after: str = ""

    def load(self) -> click.Command:
        """Import the command."""
        return named(self.command)  # type: ignore[no-any-return]


class Hooks:
    """The hooks that a plugin may implement. Each hook receives a ``register`` callable and calls it once per descriptor."""

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
    def register_translators(self, register: Callable[[TranslatorInfo], None]) -> None:
        """Register languages into which rule packs are translated."""

    @hookspec
    def register_functions(self, register: Callable[[FunctionInfo], None]) -> None:
        """Register functions that other parts call by name."""

    @hookspec
    def register_commands(self, register: Callable[[CommandInfo], None]) -> None:
        """Register subcommands."""


class _Kind(NamedTuple):
    """One kind of descriptor; ``name`` is its attribute in `Plugins`.

    ``objects`` are the fields of its descriptor that are ``"module:object"``; ``lists`` are tuples of text.
    """

    name: str
    noun: str
    hook: str
    descriptor: type[Any]
    objects: tuple[str, ...]
    lists: tuple[str, ...] = ()


KINDS: Final = {
    kind.name: kind
    for kind in (
        _Kind("packs", "rule pack", "register_rule_packs", RulePackInfo, ("pack",), ("default_for",)),
        _Kind("importers", "importer", "register_importers", ImporterInfo, ("claims", "reader"), ("suffixes",)),
        _Kind("exporters", "exporter", "register_exporters", ExporterInfo, ("writer",), ("settings",)),
        _Kind("formatters", "formatter", "register_formatters", FormatterInfo, ("renderer",)),
        _Kind("translators", "translator", "register_translators", TranslatorInfo, ("translate",)),
        _Kind("functions", "function", "register_functions", FunctionInfo, ("function",)),
        _Kind("commands", "command", "register_commands", CommandInfo, ("command",)),
    )
}
_NAME: Final = regular_expression(r"[a-z][a-z0-9_-]*")
_COMMAND: Final = regular_expression(r"[a-z][a-z0-9_-]*(?: [a-z][a-z0-9_-]*)?")
_SEPARATORS: Final = regular_expression(r"[-_.]+")
_OBJECT: Final = regular_expression(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


@dataclass(frozen=True, slots=True)
class Origin:
    """The origin of a registered object: the entry point ``plugin``, its import package, and its distribution with the version.

    A ``shipped`` one is a part of C-QoS, and comes before others.
    """

    plugin: str
    distribution: str
    shipped: bool
    package: str


@dataclass(frozen=True, slots=True)
class BrokenPlugin:
    """A plugin, or something that one registered, that does not work; ``distribution`` has name and version, or is empty."""

    name: str
    distribution: str
    reason: str
    noun: str = "plugin"
    failed: str = NOT_LOADED

    def __str__(self) -> str:
        """Return one sentence; further lines of the reason follow it."""
        owner = f" of {self.distribution}" if self.distribution else ""
        return f"{self.noun} `{self.name}`{owner} {self.failed}: {self.reason}"


@dataclass(slots=True)
class Plugins:
    """Everything that the installed plugins register, by name, and the broken plugins."""

    packs: dict[str, RulePackInfo] = field(default_factory=dict)
    importers: dict[str, ImporterInfo] = field(default_factory=dict)
    exporters: dict[str, ExporterInfo] = field(default_factory=dict)
    formatters: dict[str, FormatterInfo] = field(default_factory=dict)
    translators: dict[str, TranslatorInfo] = field(default_factory=dict)
    functions: dict[str, FunctionInfo] = field(default_factory=dict)
    commands: dict[str, CommandInfo] = field(default_factory=dict)
    broken: list[BrokenPlugin] = field(default_factory=list)
    owners: dict[tuple[str, str], Origin] = field(default_factory=dict)
    _failed: set[tuple[str, str]] = field(default_factory=set)

    def owner(self, kind: str, name: str) -> str:
        """Distribution and version that registered ``name`` (``kind``: ``packs``, ``importers`` …)."""
        return self.owners[kind, name].distribution

    def shipped(self, kind: str, name: str) -> bool:
        """Whether a part of C-QoS is registered under ``name``."""
        return self.owners[kind, name].shipped

    def culprit(self, error: BaseException) -> Origin | None:
        """Return the foreign plugin in whose code ``error`` was raised, or that called what raised it, if any."""
        import traceback  # only where something failed

        foreign = {origin.package: origin for origin in self.owners.values() if not origin.shipped}
        modules = (frame.f_globals.get("__name__", "") for frame, _ in traceback.walk_tb(error.__traceback__))
        owners = [foreign[name] for name in (module.partition(".")[0] for module in modules) if name in foreign]
        return owners[-1] if owners else None

    def pack(self, pack_id: str) -> RulePack | None:
        """Return the installed pack ``pack_id``, imported on first use; None if it is missing or broken."""
        info = self.packs.get(pack_id)
        if info is None or ("packs", pack_id) in self._failed:
            return None
        try:
            return _load_pack(info)
        except FAULTS as error:
            self.note_failure("packs", pack_id, error)
            return None

    def note_failure(self, kind: str, name: str, error: BaseException, failed: str = NOT_LOADED) -> None:
        """Note in `broken`, once, that something registered failed when it was needed."""
        if (kind, name) not in self._failed:
            self._failed.add((kind, name))
            broken = BrokenPlugin(name, self.owner(kind, name), describe(error), KINDS[kind].noun, failed)
            keep_traceback(str(broken), error)
            self.broken.append(broken)


@cache
def _load_pack(info: RulePackInfo) -> RulePack:
    from cqos_core.packs.pack import RulePack

    pack = info.load()
    if not isinstance(pack, RulePack):
        raise PackError(f"`{info.pack}` is a value of type {type(pack).__name__}, not a RulePack")
    if pack.id != info.id:
        raise PackError(f"`{info.pack}` has the id `{pack.id}`, but is registered as `{info.id}`")
    return pack


# Loading


@cache
def load_plugins() -> Plugins:
    """Find and load every installed plugin once per process; see `Plugins.broken` for those that failed."""
    plugins = load_from(entry_points(group=GROUP), os.environ.get(LOAD_VARIABLE))
    for path in filter(None, os.environ.get(FILES_VARIABLE, "").split(os.pathsep)):
        pack, file = _read_pack_file(path), path.rpartition(os.sep)[2]
        plugins.packs.setdefault(pack.id, PackFileInfo(pack.id, pack.summary, path))
        plugins.owners.setdefault(("packs", pack.id), Origin(pack.id, file, shipped=False, package=path))
    return plugins


def function(name: str) -> Callable[..., Any]:
    """Import and return the function that a plugin registers under a name.

    Raises:
        MissingError: no plugin has it; if a distribution of C-QoS does, with the line that installs that.
    """
    info = load_plugins().functions.get(name)
    if info is None:
        from cqos_core.model.optional_features import absent, missing

        row = absent("functions").get(name)
        if row is None:
            raise MissingError(f"no plugin has the function `{name}`", "`cqos packs` lists plugins, also broken ones")
        raise missing(row.name, f"`{row.distribution}` is not installed")
    return info.load()


@cache
def _read_pack_file(path: str) -> RulePack:
    from pathlib import Path

    from cqos_core.model.source import Source
    from cqos_core.packs.pack_yaml import read_pack

    return read_pack(Source(path, Path(path).read_bytes()))


def load_from(entries: Iterable[EntryPoint], only: str | None = None) -> Plugins:
    """Load the plugins of ``entries``; of others than ours those whose distributions ``only`` names, unless it is None."""
    plugins = Plugins()
    wanted = None if only is None else {_normalised(name): name.strip() for name in only.split(",") if name.strip()}
    found = [(_origin(entry), entry) for entry in entries]
    # Parts of C-QoS first, then by name: no plugin can take their names, in any order of installation.
    found.sort(key=lambda pair: (pair[0].package != "cqos_core", not pair[0].shipped, pair[1].name, pair[1].value))
    for origin, entry in found:
        name = _normalised(origin.distribution.partition(" ")[0])
        if origin.shipped or wanted is None or name in wanted:
            _load(plugins, origin, entry)
    plugins.commands = _in_order(plugins.commands.values())
    present = {_normalised(origin.distribution.partition(" ")[0]) for origin, _ in found}
    for name in sorted(set(wanted or ()) - present):
        reason = f"{LOAD_VARIABLE} names it, but there is no installed distribution of that name with a plugin"
        plugins.broken.append(BrokenPlugin((wanted or {})[name], "", reason))
    return plugins


def _in_order(commands: Collection[CommandInfo]) -> dict[str, CommandInfo]:
    """Return commands by name, in the order of lists, whatever the order in which plugins are found."""
    names = {each.name for each in commands}
    ordered = [each for each in commands if each.after not in names]
    waiting = [each for each in commands if each.after in names]
    while waiting:
        there = [each.name for each in ordered]
        info = next((each for each in waiting if each.after in there), waiting[0])  # the first of a circle comes last
        waiting.remove(info)
        ordered.insert(there.index(info.after) + 1 if info.after in there else len(there), info)
    return {info.name: info for info in ordered}


def _normalised(distribution: str) -> str:
    """Spell the name of a distribution as all its spellings are compared."""
    return _SEPARATORS.sub("-", distribution.strip()).lower()


def _origin(entry: EntryPoint) -> Origin:
    distribution, shipped = "an unknown distribution", False
    try:
        metadata = None if entry.dist is None else entry.dist.metadata  # each look at it reads the file again
        if metadata is not None:
            # From Python 3.12 on, `metadata[…]` warns of what is missing.
            name, version = (next(iter(metadata.get_all(each) or ()), "") for each in ("Name", "Version"))
            distribution = f"{name} {version}".strip() or distribution
            shipped = AUTHORS in (metadata.get_all("Author") or ())
    except Exception as error:  # noqa: BLE001 - what is left of an installation that failed may hold anything
        keep_traceback(f"reading who brings the plugin `{entry.name}`", error)
    return Origin(entry.name, distribution, shipped, entry.value.partition(":")[0].partition(".")[0].strip())


def _load(plugins: Plugins, origin: Origin, entry: EntryPoint) -> None:
    """Load one plugin, or note that it is broken."""
    try:
        _register(plugins, origin, entry.load())
    except FAULTS as error:
        broken = BrokenPlugin(origin.plugin, origin.distribution, describe(error))
        keep_traceback(str(broken), error)
        plugins.broken.append(broken)


def _register(plugins: Plugins, origin: Origin, module: Any) -> None:
    """Call one plugin's hooks into ``plugins``; all or nothing, so that a broken one leaves no half behind."""
    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(Hooks)
    manager.register(module, origin.plugin)
    manager.check_pending()
    _refuse_idle(manager, module)
    taken: dict[tuple[str, str], Any] = {}
    for kind in KINDS.values():
        infos: list[Any] = []
        getattr(manager.hook, kind.hook)(register=infos.append)
        for info in infos:
            if not origin.shipped:  # tests hold our own
                _refuse_malformed(kind, info)
            owner = "it itself" if (kind.name, info.name) in taken else None
            present = getattr(plugins, kind.name).get(info.name)
            if present is not None and not getattr(present, "gives_way", False):
                owner = plugins.owner(kind.name, info.name)
            if owner is not None:
                raise CqosError(f"it registers {kind.noun} `{info.name}`, which {owner} already provides")
            taken[kind.name, info.name] = info
    for (kind_name, name), info in taken.items():
        getattr(plugins, kind_name)[name] = info
        plugins.owners[kind_name, name] = origin


def _refuse_idle(manager: pluggy.PluginManager, module: Any) -> None:
    """Refuse a plugin without hooks, which is hardly what its author meant."""
    callers = manager.get_hookcallers(module) or []
    if not callers:
        raise CqosError("it implements no hook; is `@hookimpl` missing?")
    for caller in callers:
        if any("register" not in implementation.argnames for implementation in caller.get_hookimpls()):
            raise CqosError(f"its `{caller.name}` lacks the argument `register`")


def _refuse_malformed(kind: _Kind, info: Any) -> None:
    """Refuse a descriptor that would fail later, when its plugin is unknown."""
    if not isinstance(info, kind.descriptor):
        raise CqosError(f"its `{kind.hook}` registers {info!r}, which is no {kind.descriptor.__name__}")
    name, what = info.name, f"its {kind.noun} `{info.name}`"
    if not (isinstance(name, str) and (_COMMAND if kind.name == "commands" else _NAME).fullmatch(name)):
        raise CqosError(f"{what} needs a name of lower-case letters, digits, `-` and `_`")
    if not isinstance(info.summary, str):
        raise CqosError(f"{what} needs a summary")
    for part in kind.objects:
        if not (isinstance(path := getattr(info, part), str) and _OBJECT.fullmatch(path)):
            raise CqosError(f'{what} has the {part} {path!r}, where "module:object" is expected')
    for part in kind.lists:
        if not (isinstance(texts := getattr(info, part), tuple) and all(isinstance(text, str) for text in texts)):
            raise CqosError(f"{what} has the {part} {texts!r}, where a tuple of texts is expected")
    if isinstance(info, ImporterInfo) and info.folder_suggestions and not info.options:
        raise CqosError(f"{what} has `folder_suggestions`, but `options` lacks the option with which it reads folders")
