"""The state of reading one source: places of its parts, and the list that collects all problems."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Final

from cqos_core.importers.tree import MappingNode, SequenceNode, is_null
from cqos_core.model.encoding import Lines, decode
from cqos_core.model.problems import InputError, Problem, collect
from cqos_core.model.settings import Place
from cqos_core.model.system import ImportNote

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from cqos_core.importers.tree import Node
    from cqos_core.model.source import ReadContext, Source

_LONGEST_EXCERPT: Final = 60
_LONGEST_TO_WRITE: Final = 160


class SourceReading:
    """The state of reading one source; it collects every problem.

    Attributes:
        source: the source.
        problems, notes: of the whole read; sources that include each other share them.
    """

    def __init__(self, source: Source, problems: list[Problem], notes: list[ImportNote]) -> None:
        self.source = source
        self.problems = problems
        self.notes = notes

    def place(self, node: Node | Place) -> Place:
        """Return where ``node`` begins."""
        return node if isinstance(node, Place) else Place(self.source.name, node.line, node.column)

    def problem(self, code: str, message: str, where: Node | Place, advice: str | None = None) -> None:
        """Collect a problem.

        Raises:
            InputError: with all of them, above a limit.
        """
        collect(self.problems, Problem(code, message, self.place(where), advice))

    def warn(self, code: str, message: str, where: Node | Place, advice: str) -> None:
        """Say something that is no reason to stop."""
        self.notes.append(ImportNote(code, "warning", message, self.place(where), advice))

    @cached_property
    def lines(self) -> Lines:
        """The lines of the source, for looking at how something was written."""
        return Lines(decode(self.source.data))

    def rest_of_line(self, line: int | None, column: int) -> str:
        """Return the text from a one-based place to the end of its line."""
        return "" if line is None else self.lines.line(line)[column - 1 :]


def read_switches(importer: str, context: ReadContext, known: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Return the switches of ``importer`` that are given.

    Args:
        importer: its name.
        context: of the caller.
        known: each switch with the values it can have; none listed: any.

    Raises:
        InputError: a switch is not known, or has a value that it cannot have.
    """
    given = dict(context.options.get(importer, {}))
    problems = []
    for name, value in given.items():
        if name not in known:
            message = f"the importer `{importer}` has no switch {shown(name)}; it has {listed(known, 'and')}"
            problems.append(Problem("CQ047", message))
        elif known[name] and value not in known[name]:
            message = f"the switch `{importer}.{name}` is {shown(value)}, it can be {listed(known[name])}"
            problems.append(Problem("CQ047", message))
    if problems:
        raise InputError(problems)
    return given


def shown(text: str) -> str:
    """Return ``text`` in back quotes for a message: on one line, and cut where it is long."""
    start = text[: _LONGEST_EXCERPT + 1]
    line = start if start.isprintable() else start.encode("unicode_escape").decode()
    return f"`{line}`" if len(line) <= _LONGEST_EXCERPT else f"`{line[:_LONGEST_EXCERPT]}…`"


def to_write(text: str) -> str:
    """Return a text that a person is to write, in back quotes and whole; only a very long one is cut."""
    return f"`{text}`" if len(text) <= _LONGEST_TO_WRITE and text.isprintable() else shown(text)


def in_quotes(text: str) -> str:
    """Return a text in the straight quotes that need no escape in it."""
    return f"'{text}'" if '"' in text or "\\" in text else f'"{text}"'


def described(node: Node) -> str:
    """Return a description of a node, for messages."""
    if isinstance(node, MappingNode):
        return "a map"
    if isinstance(node, SequenceNode):
        return "a list"
    return "nothing" if is_null(node) else shown(node.text) if node.text else "an empty text"


def listed(words: Iterable[str], last: str = "or") -> str:
    """``a, b or c``."""
    *most, final = words
    return f"{', '.join(most)} {last} {final}" if most else final


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``; did you mean `x`?`` to end a sentence with, empty where nothing is near."""
    from cqos_core.model.spelling import nearest

    found = nearest(word, known)
    return f"; did you mean `{found}`?" if found else ""
