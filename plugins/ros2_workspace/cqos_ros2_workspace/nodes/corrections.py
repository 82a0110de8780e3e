"""Corrections in a node file: statements of a person replace those of `cqos learn`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.importers.document_form import Entry, Member
from cqos_core.importers.source_reading import did_you_mean, shown
from cqos_ros2_workspace.nodes import form

if TYPE_CHECKING:
    from cqos_core.importers.document_form import Key
    from cqos_core.importers.source_reading import SourceReading

NAMELESS: Final = "("
"""What the name of an endpoint begins with whose name is not known; `cqos learn` counts those anew each time."""
_ADVICE: Final = "corrections change what the file states; add what it does not have with `confirmed: true`"
_Endpoints = dict[str, Member[list[Entry]]]


def corrected(document: Entry, key: Key[dict[str, Member[Entry]]], reading: SourceReading) -> dict[str, Entry]:
    """Return the nodes or fragments of a node file with their corrections; report corrections of what is not there."""
    parts = {name: each.value for name, each in (document.get(key) or {}).items()}
    corrections = document.get(form.CORRECTIONS)
    for name, each in ((corrections.get(key) if corrections else None) or {}).items():
        if name in parts:
            _check(name, parts[name], each.value, reading)
            parts[name] = parts[name].corrected(each.value, _JOINED)
        else:
            message = (
                f"there is nothing to correct: the file has no {key.name[:-1]} {shown(name)}{did_you_mean(name, parts)}"
            )
            reading.problem("CQ011", message, each.place, _ADVICE)
    return parts


def _check(name: str, part: Entry, correction: Entry, reading: SourceReading) -> None:
    """Report endpoints that a part does not have, or whose name is not known."""
    for direction, key in form.DIRECTIONS.items():
        known = [each for each in part.get(key) or () if not each.startswith(NAMELESS)]
        for endpoint, member in (correction.get(key) or {}).items():
            if endpoint not in known:
                message = f"there is nothing to correct: {shown(name)} has no {shown(endpoint)} under `{direction}`"
                reading.problem("CQ011", f"{message}{did_you_mean(endpoint, known)}", member.place, _ADVICE)


def _endpoints(before: _Endpoints, correction: _Endpoints) -> _Endpoints:
    """Return endpoints by name; one correction holds for all endpoints of its name, several take their place."""
    found = dict(before)
    for name, member in correction.items():
        if name in before and len(member.value) == 1:
            found[name] = Member([each.corrected(member.value[0]) for each in before[name].value], member.place)
        else:
            found[name] = member
    return found


_JOINED: Final = {
    **dict.fromkeys(form.DIRECTIONS, _endpoints),
    form.PARAMETERS.name: lambda before, correction: {**before, **correction},
}
