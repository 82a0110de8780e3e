"""The data of pictures beside the report: participants, bridges and paths of requirements."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

from cqos_core.model.dataclass import dataclass

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.report import PairReport


@dataclass(frozen=True, slots=True)
class PicturedEnd:
    """One endpoint.

    Attributes:
        owner: its participant, what its participant is an instance of, or the bridge that it is an end of.
        is_bridge: the owner is a bridge.
        topic: as the groups of the report name it.
    """

    id: str
    owner: str
    is_bridge: bool
    role: str
    topic: str
    protocol: str


@dataclass(frozen=True, slots=True)
class RequirementPath:
    """One pair, what its subscriber requires by word as text, and the pair explained."""

    publisher: str
    subscriber: str
    needs: Mapping[str, str]
    pair: PairReport


@dataclass(frozen=True, slots=True)
class Picture:
    """A system as pictures show it.

    Attributes:
        instances: how many participants an owner stands for, where it is more than one.
        paths: pairs with requirements first, the worst first; `left_out` counts those that are not among them.
        runs: recorded by ``cqos prove``, as its JSON has them.
    """

    ends: tuple[PicturedEnd, ...] = ()
    instances: Mapping[str, int] = field(default_factory=dict)
    paths: tuple[RequirementPath, ...] = ()
    left_out: int = 0
    runs: tuple[Mapping[str, Any], ...] = ()
