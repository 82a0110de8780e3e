"""``--select`` and ``--ignore``: which findings are reported."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import click

from cqos_core.cli.parameters import nearest
from cqos_core.model.codes import CODES
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.checking.checker import Context
    from cqos_core.model.codes import CodeInfo
    from cqos_core.model.report import Finding, Report
    from cqos_core.packs.rule import Rule


@dataclass(frozen=True, slots=True)
class Counted:
    """Which findings count: those of ``selected`` rules, or of all where there are none, but not the ``ignored``.

    Rules are beginnings of codes, or whole names, in lower case.
    """

    selected: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    def __call__(self, report: Report) -> Report:
        """Return the report without findings that do not count; verdicts of pairs stay as they are."""
        if not self.selected and not self.ignored:
            return report
        return replace(report, findings=tuple(filter(self._counts, report.findings)))

    def _counts(self, finding: Finding) -> bool:
        selected = not self.selected or _is_of(finding, self.selected)
        return selected and not _is_of(finding, self.ignored)


def _is_of(finding: Finding, rules: Iterable[str]) -> bool:
    code, name = finding.code.lower(), finding.name.lower()
    return any(name == rule or code.startswith(rule) for rule in rules)


def counted(select: Sequence[str], ignore: Sequence[str], context: Context) -> Counted:
    """Read the values of both options.

    Raises:
        click.BadParameter: no rule is meant by one of them.
    """
    if not select and not ignore:
        return Counted()
    known = _known(context)
    return Counted(_rules("--select", select, known), _rules("--ignore", ignore, known))


def _rules(option: str, values: Sequence[str], known: Mapping[str, str]) -> tuple[str, ...]:
    rules = [rule.strip() for value in values for rule in value.split(",") if rule.strip()]
    for rule in rules:
        if not any(name.startswith(rule.lower()) for name in known):
            message = f"no rule has the code or name `{rule}`{nearest(rule.lower(), known, listed=False)}"
            raise click.BadParameter(message, param_hint=f"'{option}'")
    return tuple(known.get(rule.lower(), rule.lower()) for rule in rules)


def _known(context: Context) -> Mapping[str, str]:
    """Map the codes and names of all rules to themselves and former ones to the code that replaced them, in lower case."""
    found: list[Rule | CodeInfo] = [*CODES.values()]
    for pack_id in load_plugins().packs:
        pack = context.find_pack(pack_id)
        if pack is not None:
            found += (*pack.rules, *pack.codes)
    former = {alias.lower(): each.code.lower() for each in found for alias in each.aliases}
    return former | {text.lower(): text.lower() for each in found for text in (each.code, each.name)}
