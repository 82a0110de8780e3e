"""``cqos repair``: the smallest set of changes after which nothing is incompatible, printed or written to the files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from cqos_core.cli.help import usual
from cqos_planning.plan_command import plan_command
from cqos_planning.plan_text import PlanWords

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cqos_core.analysis.plan import RepairPlan
    from cqos_core.cli.input_reader import InputReader
    from cqos_core.model.system import System
    from cqos_planning.plan_command import Make


_WORDS = PlanWords(
    nothing="nothing has to change: no pair is incompatible, and no requirement is violated",
    impossible="there is no repair: these exclude each other, and none of them can be left out",
    rest="these are not repaired: they exclude each other, and none of them can be left out",
    least="no repair has less",
    tried="no repair with the values that were tried has less",
)


@click.command(
    epilog="Exit codes: 0 nothing has to change, or --fix wrote the changes; 1 changes are needed, there is no repair, or errors "
    "stay that no setting repairs; 2 wrong usage or input that cannot be read; 3 internal error."
)
@usual("--fix", "--diff", "--keep", "--decide", "--launch", "--option", "--format")
@click.option(
    "--keep",
    metavar="PATTERN",
    multiple=True,
    help="Leave these as they are: the id of an endpoint or participant, or a file, as a shell pattern. Can be repeated.",
)
@click.option("--decide", is_flag=True, help="Make unknown pairs compatible, too. Without it they may stay unknown.")
@plan_command(_WORDS)
def repair(*, keep: tuple[str, ...], decide: bool) -> Make:
    """Find the smallest repair: the changes of least weight after which nothing is incompatible.

    All requirements (`needs:`) hold then, too. A setting weighs less than a promise that the program must keep, one endpoint
    less than a shared profile, a stronger value less than a weaker one, and a near value less than a far one. C-QoS checks the
    changed files before it prints or writes anything. Where there is no repair, it prints a conflicting set: without any one
    part of it, the others can be reached. All else is repaired.

    \b
    Examples:
      cqos repair robot.yaml
      cqos repair robot.yaml station.bpmn --keep 'station/*' --diff
      cqos repair robot.yaml --fix
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped

    def plan(system: System, read: Callable[[Mapping[str, bytes]], System], reader: InputReader) -> RepairPlan:
        from cqos_planning.search import find_repair

        return find_repair(
            system.sources, read, reader.context, keep=keep, decide=decide, importer=reader.options.importer
        )

    return plan
