"""A pack with a bad default, a sentence about a policy that it has not, and a preset of another."""

from cqos_core.language.domains import Choice
from cqos_core.language.expression import offered, requested
from cqos_core.language.policy import Policy
from cqos_core.packs.pack import RulePack
from cqos_core.packs.presets import Preset
from cqos_core.packs.rule import requires

SPEED = Policy("speed", Choice("slow", "fast"), default="medium")

PACK = RulePack(
    id="malformed",
    title="Malformed",
    policies=(SPEED,),
    rules=(
        requires(offered("sped") >= requested("sped"), code="MAL101", name="too-slow", because="it waits"),
        requires(offered(SPEED) >= requested(SPEED), code="MAL102", name="too-slow", because="it waits"),
    ),
    presets={"quick": Preset({"haste": "much"})},
)
