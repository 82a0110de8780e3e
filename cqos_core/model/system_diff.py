"""Results of a comparison of two systems: endpoints that one of them lacks, and values that differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import TextEnum

if TYPE_CHECKING:
    from cqos_core.model.finding import Fact
    from cqos_core.model.settings import Place


class ComparedSide(TextEnum):
    """Which of the two systems."""

    A = "a"
    B = "b"


@dataclass(frozen=True, slots=True)
class Named:
    """An endpoint of one of the systems.

    Attributes:
        participant: as files of its protocol name it: a node's full name.
        kind: ``publisher``, ``subscriber``, ``service_server`` …
    """

    id: str
    participant: str
    kind: str
    topic: str
    protocol: str
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Missing:
    """An endpoint that only one of the systems has, ``only_in``."""

    only_in: ComparedSide
    endpoint: Named


@dataclass(frozen=True, slots=True)
class Different:
    """A policy, or the type, to which the two systems give different values; each with where it comes from."""

    a: Named
    b: Named
    policy: str
    value_a: Fact
    value_b: Fact


@dataclass(frozen=True, slots=True)
class Diff:
    """All differences of two systems; true if there is any.

    Attributes:
        missing: endpoints that one of the systems lacks.
        different: values that differ.
        matched: how many endpoints are in both.
        by_topic: how many of them were matched by topic and kind only, because their participants have different names.
        not_compared: what one of the systems does not know, and so was left out, one sentence each.
    """

    missing: tuple[Missing, ...] = ()
    different: tuple[Different, ...] = ()
    matched: int = 0
    by_topic: int = 0
    not_compared: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        """Whether there is any difference."""
        return bool(self.missing or self.different)
