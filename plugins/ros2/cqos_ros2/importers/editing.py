"""Adds settings to configurations of RViz, and to `qos_overrides` among the parameters of nodes; comments and layout stay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.files.yaml_edits import insert_beside, state

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.model.settings import Place
    from cqos_core.model.source import Replacement

RVIZ: Final = {
    "depth": "Depth",
    "durability": "Durability Policy",
    "history": "History Policy",
    "reliability": "Reliability Policy",
}
"""The key under which a topic of RViz has a policy."""


def insert_in_rviz(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """State settings of the topic of a display in the words of RViz: ``Reliability Policy: Best Effort``."""
    return state(text, place, {RVIZ[name]: value.replace("_", " ").title() for name, value in settings.items()})


def insert_parameters(text: str, place: Place, settings: Mapping[str, str]) -> Replacement | None:
    """Add parameters of a publisher or subscription beside one that stands at ``place``."""
    return insert_beside(text, place, settings)
