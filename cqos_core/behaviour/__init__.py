"""What control flow says about time, for certain: which events may happen, how often, and in which order.

The room reads `cqos_core.model.flow` and names no protocol. It does not know which endpoints match: `Signals` says that. All
analyses are linear in the size of the model and exact. What they do not understand gives no claim.
"""

from cqos_core.behaviour.analysis import Behaviour, analysed
from cqos_core.behaviour.counting import Bound
from cqos_core.behaviour.graph import Signals

__all__ = ["Behaviour", "Bound", "Signals", "analysed"]
