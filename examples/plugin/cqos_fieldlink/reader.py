"""Reads link lists: text with semicolons, one line for each device that sends or receives a signal.

    fieldlink links;2
    device;direction;signal;delivery;cycle;timeout
    press;sends;force;repeated;20;
    panel;receives;force;;;50

Settings stay text; the pack makes values of them. Everything has a place, so that findings can point at it. The reader
reports all mistakes of a list at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cqos_core.model.problems import InputError, Problem
from cqos_core.model.settings import Place, Setting
from cqos_core.model.system import PUBLISHER, SUBSCRIBER, Endpoint, Participant, Role, System

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cqos_core.model.source import ReadContext, Source

_NEEDED: Final = ("device", "direction", "signal")
_SETTINGS: Final = ("delivery", "cycle", "timeout")
_ROLES: Final[Mapping[str, Role]] = {"sends": PUBLISHER, "receives": SUBSCRIBER}


@dataclass(frozen=True, slots=True)
class Cell:
    """One text of the list, and its place."""

    text: str
    place: Place


def read(source: Source, context: ReadContext) -> System:  # noqa: ARG001 - there are no switches and no includes
    """Read a link list.

    Raises:
        InputError: with all mistakes of the list.
    """
    mark, *lines = _lines(source)
    header = lines[0] if lines else []
    problems = list(_header_problems(header, mark[0].place))
    system = System(sources={source.name: source.data})
    for cells in lines[1:] if not problems else ():
        problems += _add(system, header, cells)
    if problems:
        raise InputError(problems)
    return system


def _lines(source: Source) -> list[list[Cell]]:
    """Split all lines that are not empty into cells."""
    try:
        text = source.data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = Place(source.name, source.data.count(b"\n", 0, error.start) + 1)
        raise InputError([Problem("CQ001", "the list is not written in UTF-8", place)]) from None
    numbered = enumerate(text.split("\n"), 1)
    return [list(_cells(line, source.name, number)) for number, line in numbered if line.strip()]


def _cells(line: str, name: str, number: int) -> Iterator[Cell]:
    column = 1
    for text in line.split(";"):
        blank = len(text) - len(text.lstrip())
        yield Cell(text.strip(), Place(name, number, column + blank))
        column += len(text) + 1


def _header_problems(header: Sequence[Cell], place: Place) -> Iterator[Problem]:
    known = (*_NEEDED, *_SETTINGS)
    for cell in header:
        if cell.text not in known:
            yield Problem("CQ006", f"there is no column `{cell.text}`", cell.place, f"known: {', '.join(known)}")
    for name in _NEEDED:
        if name not in {cell.text for cell in header}:
            yield Problem("CQ010", f"the column `{name}` is missing", header[0].place if header else place)


def _add(system: System, header: Sequence[Cell], cells: Sequence[Cell]) -> Iterator[Problem]:
    """Add the endpoint of one line to the system, or yield its mistakes."""
    row = {column.text: cell for column, cell in zip(header, cells, strict=False) if cell.text}
    missing = [name for name in _NEEDED if name not in row]
    if missing or len(cells) > len(header):
        wrong = f"has no {' and no '.join(missing)}" if missing else "has more cells than there are columns"
        yield Problem("CQ010", f"the line {wrong}", cells[0].place)
        return
    device, direction, signal = (row[name] for name in _NEEDED)
    role = _ROLES.get(direction.text)
    if role is None:
        message = f"a device `sends` or `receives` a signal, it cannot `{direction.text}` one"
        yield Problem("CQ011", message, direction.place)
        return
    system.participants.setdefault(device.text, Participant(device.text, place=device.place))
    identifier = f"{device.text}/{role}/{signal.text}"
    again = sum(endpoint.id.partition("#")[0] == identifier for endpoint in system.endpoints)
    system.endpoints.append(
        Endpoint(
            id=f"{identifier}#{again + 1}" if again else identifier,
            role=role,
            topic=signal.text,
            participant=device.text,
            settings={name: Setting(row[name].text, row[name].place) for name in _SETTINGS if name in row},
            dialect="links",
            place=signal.place,
        )
    )
