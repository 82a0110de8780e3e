"""C-QoS: says at design time which publishers and subscribers fit, which do not, and what cannot be known.

>>> import cqos_core as cqos
>>> pair = cqos.check_pair("ros2", offered={"reliability": "best_effort"}, requested={"reliability": "reliable"})
>>> str(pair.verdict)
'incompatible'

Names are loaded on first use, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from cqos_core.analysis.pair_judge import PairJudge, PairProfile, check_pair
    from cqos_core.analysis.planning.plan import PlannedChange, RepairPlan
    from cqos_core.api import apply, check, diff, explain, read, repair, suggest
    from cqos_core.checking.session import Session
    from cqos_core.files.edited_files import Edited
    from cqos_core.language.values import INFINITE
    from cqos_core.model.changes import Changes, Counts
    from cqos_core.model.coverage import Coverage
    from cqos_core.model.difference import Diff, Different, Missing, Named
    from cqos_core.model.finding import Edit, Fact, Finding, Remedy, Severity, Side, Verdict
    from cqos_core.model.problems import ConditionError, CqosError, InputError, PackError, Problem, SentenceError
    from cqos_core.model.report import (
        Assumption,
        Group,
        Guarantee,
        GuaranteeCell,
        HopReport,
        Pair,
        PairReport,
        PolicyComparison,
        Report,
    )
    from cqos_core.model.settings import Cases, Place, Setting
    from cqos_core.model.system import (
        Acceptance,
        Bound,
        Bridge,
        Broker,
        Endpoint,
        ImportNote,
        Overlay,
        Part,
        Participant,
        Profile,
        ProfileRef,
        Room,
        Route,
        Scope,
        System,
        TeamRule,
        Topic,
    )

_HOMES: Final = (
    "model.problems",
    "model.finding",
    "model.report",
    "model.coverage",
    "model.settings",
    "model.system",
    "model.difference",
    "model.changes",
    "language.values",
    "analysis.planning.plan",
    "analysis.pair_judge",
    "checking.session",
    "api",
    "files.edited_files",
)
"""The modules that have the public names. A name is looked for in one after another, so what loads fast stands first."""

__all__ = [
    "INFINITE",
    "Acceptance",
    "Assumption",
    "Bound",
    "Bridge",
    "Broker",
    "Cases",
    "Changes",
    "ConditionError",
    "Counts",
    "Coverage",
    "CqosError",
    "Diff",
    "Different",
    "Edit",
    "Edited",
    "Endpoint",
    "Fact",
    "Finding",
    "Group",
    "Guarantee",
    "GuaranteeCell",
    "HopReport",
    "ImportNote",
    "InputError",
    "Missing",
    "Named",
    "Overlay",
    "PackError",
    "Pair",
    "PairJudge",
    "PairProfile",
    "PairReport",
    "Part",
    "Participant",
    "Place",
    "PlannedChange",
    "PolicyComparison",
    "Problem",
    "Profile",
    "ProfileRef",
    "Remedy",
    "RepairPlan",
    "Report",
    "Room",
    "Route",
    "Scope",
    "SentenceError",
    "Session",
    "Setting",
    "Severity",
    "Side",
    "System",
    "TeamRule",
    "Topic",
    "Verdict",
    "apply",
    "check",
    "check_pair",
    "diff",
    "explain",
    "read",
    "repair",
    "suggest",
]


def __getattr__(name: str) -> Any:
    """Load a public name from its module on first use."""
    if name in __all__:
        for home in _HOMES:
            module = importlib.import_module(f"cqos_core.{home}")
            if hasattr(module, name):
                value = globals()[name] = getattr(module, name)
                return value
    raise AttributeError(f"module `cqos_core` has no attribute `{name}`")


def __dir__() -> list[str]:
    """List the public names."""
    return sorted({*globals(), *__all__})
