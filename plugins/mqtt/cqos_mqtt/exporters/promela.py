"""Writes the pairs of a system as a Promela model for SPIN, with an LTL formula for each guarantee."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from cqos_core.analysis.run_plan import named, prepare
from cqos_core.checking.checker import check_system
from cqos_core.matching.pipeline import CheckContext
from cqos_core.packs.export import Exported
from cqos_core.packs.prover import NotRunnableError
from cqos_mqtt.promela.constants import body, of_pair, words
from cqos_mqtt.runnable_pairs import ensure_runnable

if TYPE_CHECKING:
    from cqos_core.model.system import System
    from cqos_core.packs.export import ExportContext

_HEAD: Final = """\
/* Written by C-QoS: pairs of MQTT and their guarantees as a model for SPIN.
 *
 *   spin -DPAIR=1 -DFAULT=LINK_OUTAGE -a FILE && gcc -DNOFAIR -DVECTORSZ=2048 -o pan pan.c
 *   ./pan -a -E -m100000 -N loss_free                `errors: 0`: all runs keep the guarantee
 *   ./pan -r -N loss_free | grep @                   the steps of a run that breaks it
 *
 * PAIR is one of the pairs below, FAULT one of the next names. `offline` also needs -DABSENT=1, `max_age` -DAGES=1.
 */
"""


def write(system: System, context: ExportContext) -> Exported:
    """Write one block of constants for each pair of MQTT, and the model that they share."""
    where = CheckContext(context.find_pack, default_protocol=context.default_protocol)
    system = named(system, where)
    notes: dict[str, None] = {}
    blocks: list[str] = []
    for group in check_system(system, where).groups:
        publisher, subscriber = group.publishers[0], group.subscribers[0]
        shown = f"`{publisher}` and `{subscriber}`"
        if group.protocol != "mqtt":
            notes[f"{shown} are left out: {group.protocol} is not MQTT"] = None
            continue
        try:
            plan = prepare(system, publisher, subscriber, where, "spin").plan
            ensure_runnable(plan)
        except NotRunnableError as error:
            notes[f"{shown} are left out: {error}"] = None
            continue
        if group.pairs > 1:
            notes[f"{shown} stand for {group.pairs} pairs with equal values"] = None
        number = len(blocks) + 1
        ends = f"{publisher} -> {subscriber}".replace("*/", "* /")
        text = of_pair(replace(plan, fault=None))
        blocks.append(
            f"/* {ends} on topic {plan.topic} */\n#{'if' if number == 1 else 'elif'} PAIR == {number}\n{text}"
        )
    if not blocks:
        return Exported("", 0, tuple(notes))
    default = "#ifndef PAIR\n#define PAIR 1\n#endif"
    return Exported("\n".join((_HEAD, words(), default, *blocks, "#endif", body())), len(blocks), tuple(notes))
