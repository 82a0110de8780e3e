"""Switches of importers: what the command line may say about how a file is read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.importers.reading import listed, shown
from cqos_core.model.problems import InputError, Problem

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cqos_core.importers.source import ReadContext


def read_switches(importer: str, context: ReadContext, known: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Return the switches of ``importer`` that are given.

    Args:
        importer: its name.
        context: what the caller says.
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
