"""A plugin that takes the id of a rule pack that we ship. Its name sorts before ours on purpose, see its installation."""

from cqos_core.plugins import RulePackInfo, hookimpl


@hookimpl
def register_rule_packs(register):
    register(RulePackInfo("ros2", "not ours", "pack_thief:PACK"))
