"""One rule that works beside one whose function fails; and a pack that cannot resolve a name."""

from dataclasses import replace

from cqos_core.language.domains import Choice, Text
from cqos_core.language.expression import call, offered, requested
from cqos_core.language.policy import Policy
from cqos_core.language.vocabulary import Function
from cqos_core.packs.pack import RulePack
from cqos_core.packs.rule import requires
from cqos_core.packs.topic_matching import TopicMatching

SPEED = Policy("speed", Choice("slow", "fast"), default="slow")
GROUP = Policy("group", Text(), default="none")


def same_group(offered_group, requested_group):
    return {"none": True}[offered_group] and {"none": True}[requested_group]


def resolve(written, context):
    return written.table[context]


JUDGING = RulePack(
    id="judging",
    title="Judging",
    policies=(SPEED, GROUP),
    rules=(
        requires(offered(SPEED) >= requested(SPEED), code="JUD101", name="too-slow", because="it waits"),
        requires(
            call("same_group", offered(GROUP), requested(GROUP)),
            code="JUD102",
            name="in-another-group",
            because="groups keep to themselves",
        ),
    ),
    functions=(Function("same_group", same_group, "Whether two groups are one."),),
)
NAMING = replace(JUDGING, id="naming", title="Naming", topic_matching=TopicMatching(resolve=resolve))
