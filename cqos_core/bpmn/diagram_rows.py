"""The parts of a parsed diagram: rows of its signal events, names of its signals, and a tree of everything else."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from cqos_core.bpmn.element import Element
    from cqos_core.bpmn.event_kinds import EventPlaces
    from cqos_core.model.endpoint_rows import Row


@dataclass(slots=True)
class Parts:
    """The parts of one document.

    Attributes:
        root: the first element of the tree.
        places: of the events that are rows.
        runs: neighbouring events as rows, by the first of them, which is in the tree and stands for all of them.
        signals: names by ids.
        named: ids by names.
        references: by which events name signals that were not there before them.
    """

    root: Element
    places: EventPlaces
    runs: dict[Element, list[Row]] = field(default_factory=dict)
    signals: dict[str, str] = field(default_factory=dict)
    named: dict[str, str] = field(default_factory=dict)
    references: set[str] = field(default_factory=set)
