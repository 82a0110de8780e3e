"""``cqos suggest``: the weakest settings that meet all requirements, printed or written to the files."""

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
    nothing="nothing to suggest: no endpoint without settings has a requirement that needs any",
    impossible="no settings meet all requirements: these exclude each other, and none of them can be left out",
    rest="no settings meet these: they exclude each other, and none of them can be left out",
    least="no weaker settings meet the requirements",
    tried="no weaker settings among the values that were tried meet the requirements",
)


@click.command(
    epilog="Exit codes: 0 nothing has to be stated, or --fix wrote the settings; 1 settings are suggested, or none meet the "
    "requirements; 2 wrong usage or input that cannot be read; 3 internal error."
)
@usual("--fix", "--diff", "--launch", "--option", "--format")
@plan_command(_WORDS)
def suggest() -> Make:
    """Find the weakest settings that meet all requirements, for endpoints that state no settings.

    A subscriber says in `needs:` what its application requires. C-QoS finds settings for it and for the publishers on its
    topic, as far as these state none. It checks the changed files before it prints or writes anything.

    \b
    Examples:
      cqos suggest robot.yaml
      cqos suggest robot.yaml --fix
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped

    def plan(system: System, read: Callable[[Mapping[str, bytes]], System], reader: InputReader) -> RepairPlan:
        from cqos_planning.suggestion import find_suggestion

        return find_suggestion(system.sources, read, reader.context, importer=reader.options.importer)

    return plan
