"""The option ``bpmn.catch``: what becomes of a sample that comes while no token waits for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cqos_core.model.core_findings import core_finding

if TYPE_CHECKING:
    from cqos_core.model.finding import Finding
    from cqos_core.model.system import System


OWNER: Final = "bpmn"

OPTION: Final = "catch"

AT_TOKEN, UNBUFFERED, BUFFERED = READINGS = ("at_token", "standing_unbuffered", "standing_buffered")
"""What becomes of a sample that comes while no token waits for it: values of the option ``bpmn.catch``."""


def unknown_reading(system: System) -> list[Finding]:
    """Report a value of the option that is not known."""
    stated = system.options.get(OWNER, {}).get(OPTION)
    if stated is None or stated.text in READINGS:
        return []
    message = f"option `{OWNER}.{OPTION}` is `{stated.text[:60]}`, which is not known, so each of its values is assumed"
    return [core_finding("CQ208", message, place=stated.place, help=f"allowed: {', '.join(READINGS)}")]


def reading_of(system: System) -> str | None:
    """Return what the option ``bpmn.catch`` says, None where it says nothing that is known."""
    stated = system.options.get(OWNER, {}).get(OPTION)
    return stated.text if stated is not None and stated.text in READINGS else None
