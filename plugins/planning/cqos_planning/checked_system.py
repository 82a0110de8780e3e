"""A system that was checked, with the parts that the check was made from."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from cqos_core.checking.checker import check_system
from cqos_core.matching.pipeline import Pipeline

if TYPE_CHECKING:
    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.report import Report
    from cqos_core.model.system import System


class CheckedSystem(NamedTuple):
    """A system with its report and its endpoints by topic."""

    pipeline: Pipeline
    report: Report


def checked(system: System, context: CheckContext) -> CheckedSystem:
    """Check a system."""
    return CheckedSystem(Pipeline(system, context), check_system(system, context))
