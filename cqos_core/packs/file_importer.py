"""Base of importers of other programs' files: one file becomes one system, with notes by code and endpoints with ids.

An importer is a subclass of `FileImporter`, of `DocumentImporter` for YAML and JSON, or of `XmlImporter` for XML. `run` walks
the file, and the class's `load` is the function that is registered.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from cqos_core.importers.source_reading import SourceReading
from cqos_core.importers.tree import flow_text
from cqos_core.model.garbage_collection import gc_paused
from cqos_core.model.problems import InputError
from cqos_core.model.settings import Setting
from cqos_core.model.system import ImportNote, Participant, System, numbered

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.importers.tree import Node
    from cqos_core.model.codes import CodeInfo
    from cqos_core.model.settings import Place, Settings
    from cqos_core.model.source import ReadContext, Source
    from cqos_core.model.system import Part, Room


class FileImporter(SourceReading):
    """Reads one file of another program.

    Attributes:
        protocol: of the system; of its participants, where the file is of no other.
        codes: codes of the importer beside those of the core, by code.
        reports_once: references may lead to one place several times, so nothing is reported twice there.
        context: everything that the importer may use beside the file.
        system: the contents of the file, as far as it is read.
    """

    protocol: ClassVar[str | None] = None
    codes: ClassVar[Mapping[str, CodeInfo]] = {}
    reports_once: ClassVar[bool] = False

    def __init__(self, source: Source, context: ReadContext) -> None:
        super().__init__(source, [], [])
        self.context = context
        self.system = System(protocol=self.protocol, notes=self.notes, sources={source.name: source.data})
        self._numbers: dict[str, int] = {}
        self._said: set[tuple[str, Place]] = set()

    @classmethod
    def load(cls, source: Source, context: ReadContext) -> System:
        """Read a file into a system.

        Raises:
            InputError: the file is not what the importer reads; with every problem.
        """
        reading = cls(source, context)
        with gc_paused():
            reading.run()
        return reading.finish()

    def run(self) -> None:
        """Fill the system."""
        raise NotImplementedError

    def finish(self) -> System:
        """Return the system.

        Raises:
            InputError: there were problems.
        """
        if self.problems:
            raise InputError(self.problems)
        return self.system

    def note(
        self, code: str, message: str, where: Node | Place, advice: str | None = None, unread: Iterable[Part] = ()
    ) -> None:
        """Report something that is no reason to stop, with the severity of its code, and what is not read for it."""
        info = self.codes[code]
        if self.is_new(message, where):
            advice = advice or info.help or None
            made = ImportNote(code, info.severity, message, self.place(where), advice, parts=tuple(unread))
            self.notes.append(made)

    def is_new(self, message: str, where: Node | Place) -> bool:
        """Whether a message is reported for the first time at a place, to which references may lead several times."""
        key = (message, self.place(where))
        new = key not in self._said or not self.reports_once
        self._said.add(key)
        return new

    def setting(self, node: Node, text: str | None = None) -> Setting:
        """Return a value with its place; ``text`` stands for what is written."""
        written = flow_text(node)
        return Setting(written if text is None else text, self.place(node), derived=text not in {None, written})

    def participant(
        self,
        name: str,
        where: Node | Place,
        settings: Settings | None = None,
        *,
        external: bool = False,
        room: Room | None = None,
    ) -> str:
        """Add a participant, once; return its id."""
        if name not in self.system.participants:
            self.system.participants[name] = Participant(
                name, self.protocol, settings or {}, external=external, place=self.place(where), room=room
            )
        return name

    def numbered(self, name: str) -> str:
        """Return ``name`` the first time, then ``name#2``, ``name#3``."""
        return numbered(name, self._numbers)
