"""Loads system files: reads their documents one by one and follows `include`, collecting every problem."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING, Final, NamedTuple

from cqos_core.importers import yaml_form as form
from cqos_core.importers.format_detection import claims_yaml
from cqos_core.importers.source_reading import SourceReading, described, shown
from cqos_core.importers.tree import MappingNode, ScalarNode, is_null, walk, whole_number
from cqos_core.importers.yaml_traps import join_calls, refuse_odd_texts, warn_of_traps
from cqos_core.importers.yaml_tree import read_tree
from cqos_core.model.problems import InputError
from cqos_core.model.settings import Place

if TYPE_CHECKING:
    from cqos_core.importers.document_form import Entry
    from cqos_core.importers.tree import Node
    from cqos_core.importers.yaml_tree import Tree
    from cqos_core.model.problems import Problem
    from cqos_core.model.settings import Setting
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import ImportNote, System

_MOST_FILES: Final = 1000
_FOR_PEOPLE: Final = (form.SYSTEM.name, form.LABEL.name, "because", "unknown")
_HEAD: Final = 64 * 1024
# Of these there is one in a system, so nothing multiplies them.
_SINGLE: Final = (form.SYSTEM, form.DEFAULT_PROTOCOL, form.OPTIONS, form.INSTANCES, form.INCLUDE, form.SEVERITIES)


class _Included(NamedTuple):
    """A file to be included: its name as written, and which file names it."""

    name: Setting
    reading: SourceReading


class Loader:
    """Reads documents and follows `include`; the caller combines them.

    Attributes:
        problems, notes: of all files.
        documents: in order: a file, then its includes.
        foreign: systems of included files of other formats.
        sources: every file that was opened.
        opened: their paths, each with that of the file that names it first, empty for the first of all.
        templates: texts that mention variables and may do so.
        variables: names of variables, also of those whose instances were refused.
    """

    def __init__(self, context: ReadContext) -> None:
        self.context = context
        self.problems: list[Problem] = []
        self.notes: list[ImportNote] = []
        self.documents: list[Entry] = []
        self.foreign: list[System] = []
        self.sources: dict[str, bytes] = {}
        self.opened: dict[str, str] = {}
        self.templates: list[tuple[ScalarNode, SourceReading]] = []
        self.variables: set[str] = set()

    def load(self, source: Source) -> None:
        """Read ``source`` and everything it includes."""
        waiting = self.read(source, "")
        while waiting:
            included = waiting.pop()
            opened = self.open(included)
            if opened is not None:
                waiting += self.read(opened, os.path.normpath(included.reading.source.name))

    def read(self, source: Source, above: str) -> list[_Included]:
        """Read the documents of one file; return its includes, the first last."""
        self.sources[source.name] = source.data
        self.opened[os.path.normpath(source.name)] = above
        before = len(self.problems)
        reading = SourceReading(source, self.problems, self.notes)
        tree = read_tree(reading)
        join_calls(tree, reading)
        refuse_odd_texts(tree, reading, _FOR_PEOPLE)
        warn_of_traps(tree, reading, (form.PUBLISHES.name, form.SUBSCRIBES.name))
        self.keep_templates(tree, reading)
        if not tree.documents and len(self.problems) == before:
            self.missing_version(reading, Place(source.name, 1, 1), "nothing stands in this file")
        entries = [entry for root in tree.documents if (entry := self.document(root, reading)) is not None]
        self.documents += entries
        wrong = {problem.place for problem in self.problems}
        names = [name for entry in entries for name in entry.get(form.INCLUDE) or () if name.place not in wrong]
        return [_Included(name, reading) for name in reversed(names)]

    def trail(self, path: str) -> list[str]:
        """Return the paths of the files that led to one, and its own."""
        found = []
        while path:
            found.append(path)
            path = self.opened[path]
        return found[::-1]

    def keep_templates(self, tree: Tree, reading: SourceReading) -> None:
        """Keep the texts that mention variables, and refuse those that the whole system has once."""
        if not tree.templates:
            return
        maps = [root for root in tree.documents if isinstance(root, MappingNode)]
        single = {id(node) for root in maps for key in _SINGLE for node in walk(root.entries.get(key.name, ()))}
        for node in tree.templates:
            if id(node) in single:
                message = f"{shown(node.text)} cannot mention a variable: there is one of it in the whole system"
                reading.problem("CQ014", message, node, "write it without a variable")
            else:
                self.templates.append((node, reading))

    def document(self, root: Node, reading: SourceReading) -> Entry | None:
        """Read one document, unless it is of another kind or version."""
        if not isinstance(root, MappingNode):
            reading.problem("CQ009", "a system file is a map with keys such as `cqos` and `participants`", root)
            return None
        reported = {problem.place for problem in self.problems}
        version = root.entries.get(form.CQOS.name)
        if any(
            reading.place(each) in reported
            for key, value in root.entries.values()
            for each in (key, value)
            if form.CQOS.name in key.text
        ):
            return None  # a problem says already what is wrong with the version
        if version is None or is_null(version[1]):
            self.missing_version(reading, reading.place(root), f"`cqos: {form.VERSION}` is missing")
            return None
        stated = version[1]
        if not isinstance(stated, ScalarNode) or whole_number(stated) != form.VERSION:
            # The meaning of another version is unknown, so only the version is reported.
            message = f"version {described(stated)} of the form is not known, only version {form.VERSION} is"
            if isinstance(stated, ScalarNode) and not stated.plain:
                message = f"`{form.CQOS.name}` must be the number {form.VERSION}, found the text {described(stated)}"
            reading.problem(
                "CQ004", message, stated, f"write `{form.CQOS.name}: {form.VERSION}`, or install a newer C-QoS"
            )
            return None
        _, instances = root.entries.get(form.INSTANCES.name, (None, None))
        if isinstance(instances, MappingNode):
            self.variables.update(instances.entries)
        return form.DOCUMENT.read(root, reading, "document")

    def missing_version(self, reading: SourceReading, place: Place, message: str) -> None:
        """Say that this is not, or not yet, a system file."""
        advice = f"begin every document with `cqos: {form.VERSION}`; other documents do not belong into a system file"
        reading.problem("CQ004", message, place, advice)

    def open(self, included: _Included) -> Source | None:
        """Open an included file, once however often it is named."""
        name, reading = included
        place = name.place or Place(reading.source.name)
        try:
            source = self.context.open(name.text, reading.source.name)
        except InputError as error:
            self.problems += [replace(problem, place=place) for problem in error.problems]
            return None
        path = os.path.normpath(source.name)
        if path in self.opened:
            trail = self.trail(os.path.normpath(reading.source.name))
            if path not in trail:
                return None
            circle = " → ".join((*trail[trail.index(path) :], path))
            reading.problem("CQ008", f"{shown(path)} includes itself: {circle}", place)
        elif len(self.opened) >= _MOST_FILES:
            reading.problem("CQ002", f"more than {_MOST_FILES} files are included, which is refused", place)
        elif _is_system_file(source):
            return source
        else:
            self.sources[source.name] = source.data
            self.opened[path] = os.path.normpath(reading.source.name)
            self.read_foreign(source, reading, place)
        return None

    def read_foreign(self, source: Source, reading: SourceReading, place: Place) -> None:
        """Read a file of another format, or say that it cannot be included."""
        try:
            system = self.context.read(source, self.protocols())
        except InputError as error:
            self.problems += error.problems
            return
        if system is None:
            message = f"{shown(source.name)} is no system file, and no installed importer reads it for `include`"
            reading.problem("CQ003", message, place, "`cqos packs` lists the formats that can be read")
            return
        self.foreign.append(system)
        self.notes += system.notes
        self.sources.update(system.sources)

    def protocols(self) -> frozenset[str]:
        """Return the protocols that the documents read so far name."""
        found = {document.get(form.DEFAULT_PROTOCOL) for document in self.documents}
        for document in self.documents:
            found.update(each.value.get(form.PROTOCOL) for each in (document.get(form.PARTICIPANTS) or {}).values())
        return frozenset(protocol for protocol in found if protocol is not None)


def _is_system_file(source: Source) -> bool:
    return source.name.lower().endswith((".yaml", ".yml", ".json")) or claims_yaml(source.name, source.data[:_HEAD])
