"""Runs of a pair on real middleware: what a run is given, what it returns, and how packs name the programs that do it."""

from cqos_core.packs.prover import FAULTS, End, Event, Fault, NotRunnableError, Outcome, Plan, Prover, numbers

__all__ = ["FAULTS", "End", "Event", "Fault", "NotRunnableError", "Outcome", "Plan", "Prover", "numbers"]
