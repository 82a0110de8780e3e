"""Collects all findings about behaviour, which compare control flow with settings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.behaviour.catch_option import reading_of, unknown_reading
from cqos_core.behaviour.flow_model import FlowModel, has_control_flow
from cqos_core.behaviour.repetition_findings import repetition_findings
from cqos_core.behaviour.sequence_findings import sequence_findings
from cqos_core.behaviour.timer_findings import timer_findings
from cqos_core.behaviour.unreachable_findings import unreachable_findings

if TYPE_CHECKING:
    from cqos_core.matching.pipeline import Pipeline
    from cqos_core.model.finding import Finding
    from cqos_core.model.system import System

UNMET = frozenset({"BP109", "BP114"})
"""Codes of requirements that are certainly not met: the pairs of the subscriber are then incompatible."""


def behaviour_findings(pipeline: Pipeline) -> list[Finding]:
    """Return all findings about the behaviour of a system; none without control flow."""
    model = flow_model_of(pipeline)
    return [] if model is None else findings_of(model, pipeline.system)


def flow_model_of(pipeline: Pipeline) -> FlowModel | None:
    """Return the flow model of a system; None without control flow."""
    return FlowModel(pipeline) if has_control_flow(pipeline.system) else None


def findings_of(model: FlowModel, system: System) -> list[Finding]:
    """Return all findings from a flow model and the settings of its system."""
    reading = reading_of(system)
    return [
        *unknown_reading(system),
        *unreachable_findings(model),
        *timer_findings(model),
        *sequence_findings(model, reading),
        *repetition_findings(model, reading),
    ]
