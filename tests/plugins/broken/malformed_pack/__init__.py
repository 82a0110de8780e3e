"""A plugin whose rule pack has several mistakes."""

from cqos_core.plugins import RulePackInfo, hookimpl


@hookimpl
def register_rule_packs(register):
    register(RulePackInfo("malformed", "a pack with mistakes", "malformed_pack.pack:PACK", default_for=("bpmn",)))
