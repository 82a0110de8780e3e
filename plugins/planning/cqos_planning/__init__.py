"""Changes of least weight that reach a goal, by a constraint solver: `cqos repair` and `cqos suggest`. Here are only the hooks.

Each stage is a module. `model` collects the rules and the changeable places of some topics. `formulas` translates conditions. `solver`
finds the changes of least weight, and `search` applies them and checks the result. A rule is never written a second time: a part of a
condition becomes a table of what the checker itself answers for each combination of values.
"""

from __future__ import annotations

from collections.abc import Callable

from cqos_core.plugins import CommandInfo, FunctionInfo, hookimpl

_REPAIR = "Find the smallest set of changes after which nothing is incompatible."
_SUGGEST = "Find the weakest settings that meet the requirements of endpoints without settings."


@hookimpl
def register_commands(register: Callable[[CommandInfo], None]) -> None:
    """Register ``repair`` and ``suggest``."""
    register(CommandInfo("repair", _REPAIR, "cqos_planning.repair_command:repair", after="convert"))
    register(CommandInfo("suggest", _SUGGEST, "cqos_planning.suggest_command:suggest", after="repair"))


@hookimpl
def register_functions(register: Callable[[FunctionInfo], None]) -> None:
    """Register the functions behind `cqos_core.repair` and `cqos_core.suggest`."""
    register(FunctionInfo("repair", _REPAIR, "cqos_planning.search:find_repair"))
    register(FunctionInfo("suggest", _SUGGEST, "cqos_planning.suggestion:find_suggestion"))
