"""A plugin with two rule packs whose own functions fail: one while judging, one while names are resolved."""

from cqos_core.plugins import RulePackInfo, hookimpl


@hookimpl
def register_rule_packs(register):
    register(RulePackInfo("judging", "a rule's function fails", "failing_pack.pack:JUDGING"))
    register(RulePackInfo("naming", "its names cannot be resolved", "failing_pack.pack:NAMING"))
