"""``--select`` and ``--ignore``: choose which findings are reported."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cqos_core.cli.errors import wrong_usage
from cqos_core.cli.parameters import nearest
from cqos_core.model.dataclass import dataclass
from cqos_core.model.grouping import grouped
from cqos_core.plugins import load_plugins

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cqos_core.matching.pipeline import CheckContext
    from cqos_core.model.code_info import CodeInfo
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_core.packs.rule import Rule


@dataclass(frozen=True, slots=True)
class FindingFilter:
    """Keeps findings of ``selected`` rules (all if empty) that are not ``ignored``.

    Rules are beginnings of codes, in lower case. A finding of several rules counts as long as one of them does.
    """

    selected: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    def __call__(self, report: Report) -> Report:
        """Return the report with the kept findings only; verdicts of pairs do not change."""
        if not self.selected and not self.ignored:
            return report
        return replace(report, findings=tuple(filter(self._counts, report.findings)))

    def _counts(self, finding: Finding) -> bool:
        codes = (code.lower() for code in (finding.code, *finding.more_codes))
        return any(code.startswith(self.selected or "") and not code.startswith(self.ignored) for code in codes)


def filter_of_options(select: Sequence[str], ignore: Sequence[str], context: CheckContext) -> FindingFilter:
    """Return the filter for the values of both options.

    Raises:
        RefusedError: a value names no rule.
    """
    if not select and not ignore:
        return FindingFilter()
    known = _known(context)
    codes = grouped((text.lower(), code.lower()) for text, code in known)
    names = {text for text, _ in known}
    return FindingFilter(_rules("--select", select, codes, names), _rules("--ignore", ignore, codes, names))


def code_prefixes(
    option: str, values: Sequence[str], context: CheckContext, words: Sequence[str] = ()
) -> tuple[str, ...]:
    """Return the beginnings of codes, in lower case, that the values of an option name. The option also takes ``words``.

    Raises:
        RefusedError: one of the values is neither a word nor a rule.
    """
    if not values:
        return ()
    known = _known(context)
    codes = grouped((text.lower(), code.lower()) for text, code in known)
    return _rules(option, values, codes, {text for text, _ in known}, words)


def _rules(
    option: str,
    values: Sequence[str],
    codes: Mapping[str, Sequence[str]],
    names: Iterable[str],
    words: Sequence[str] = (),
) -> tuple[str, ...]:
    rules = [rule.strip() for value in values for rule in value.split(",") if rule.strip()]
    for rule in rules:
        given = rule.lower()
        if given not in codes and not any(code.startswith(given) for own in codes.values() for code in own):
            near = nearest(rule, [*words, *names], listed=False)
            kinds = f"`{rule}` is neither {', '.join(words)} nor the code or name of a rule"
            what = kinds if words else f"no rule has the code or name `{rule}`"
            raise wrong_usage(option, what, near or "`cqos packs ID` lists the rules")
    return tuple(code for rule in rules for code in codes.get(rule.lower(), (rule.lower(),)))


def _known(context: CheckContext) -> list[tuple[str, str]]:
    """Return all codes and names of rules, also former ones, each with the present code."""
    from cqos_core.model.codes import CODES

    found: list[Rule | CodeInfo] = [*CODES.values()]
    for pack in filter(None, map(context.find_pack, load_plugins().packs)):
        found += (*pack.rules, *pack.codes)
    return [(text, each.code) for each in found for text in (each.code, each.name, *each.aliases)]
