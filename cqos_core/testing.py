"""For pack authors: case files and the runner that turns them into tests.

A case file has the code of one rule and named cases::

    rule: ROS101
    cases:
      - name: best effort does not satisfy reliable
        offered: {reliability: best_effort}
        requested: {reliability: reliable}
        options: {rmw: cyclonedds}
        topic: {latched: true}
        needs: {latest: true}
        expect: error
        verdict: incompatible
        findings: [ROS101]
        remedies: ["publisher reliability=reliable", "subscriber reliability=best_effort"]

A case states a pair (``offered``, ``requested``, ``needs``), one endpoint (``publisher`` or ``subscriber``), or a small ``system`` in
the YAML form. ``expect`` is the severity with which the rule reports, ``ok`` if it does not, ``unknown`` if it leaves
the pair open. ``verdict``, ``findings`` (codes of all warnings and errors) and ``remedies`` are compared where they are given. In every
case, no headline may have unfilled ``{braces}`` of its rule. No two findings of a pair may name the same missing
fact: it is one finding, with the codes of all its rules.

A pack's own test module is then::

    @pytest.mark.parametrize("case", load_cases(CASES, "ros2"), ids=str)
    def test_case(case):
        run_case(case)
"""

from __future__ import annotations

import json
import re
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cqos_core.analysis.pair_judge import pair_system, stated_pairs
from cqos_core.checking.checker import check_system
from cqos_core.checking.hypothetical_pairs import with_profiles_tried
from cqos_core.files.inputs import read
from cqos_core.matching.pipeline import context, with_options
from cqos_core.model.dataclass import dataclass
from cqos_core.model.finding import Finding, Severity, Verdict
from cqos_core.model.problems import CqosError
from cqos_core.model.suggestions import suggestion
from cqos_core.model.system import PUBLISHER, SUBSCRIBER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cqos_core.packs.pack import RulePack

_NOT_READ = frozenset({"CQ202", "CQ203", "CQ204", "CQ207", "CQ208"})
_KEYS = frozenset(
    "name offered requested publisher subscriber system topic options needs expect verdict findings remedies".split()  # noqa: SIM905
)


@dataclass(frozen=True, slots=True)
class Case:
    """One case of a case file; its text is ``CODE: name``."""

    rule: str
    pack: str
    name: str
    content: Mapping[str, Any] = field(repr=False)
    source: str = ""

    def __str__(self) -> str:
        """Name the test."""
        return f"{self.rule}: {self.name}"


def load_cases(path: Path | str, pack: str) -> list[Case]:
    """Read the case files of a folder (``*.yml``), or one file.

    Raises:
        CqosError: a file is no case file; the message names it and what is wrong.
    """
    folder = Path(path)
    files = sorted(folder.glob("*.yml")) if folder.is_dir() else [folder]
    if not files:
        raise CqosError(f"there are no case files (*.yml) in {folder}", "name a folder with case files")
    return [case for file in files for case in _read(file, pack)]


def _read(file: Path, pack: str) -> Iterator[Case]:
    import yaml

    try:
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it was built
        document = yaml.load(file.read_bytes(), Loader=loader)  # noqa: S506 - both are safe
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise CqosError(f"{file} cannot be read: {error}") from error
    cases = document.get("cases") if isinstance(document, dict) and set(document) == {"rule", "cases"} else None
    if not isinstance(cases, list) or not cases or not all(isinstance(each, dict) for each in cases):
        raise CqosError(f"{file} is no case file", "write `rule:` and `cases:`, a list of maps")
    for content in cases:
        unknown = set(content) - _KEYS
        if unknown or "name" not in content or "expect" not in content:
            wrong = f"unknown keys {sorted(unknown)}" if unknown else "`name` and `expect` are needed"
            raise CqosError(f"{file}, case {content.get('name', '?')!r}: {wrong}", f"known: {', '.join(sorted(_KEYS))}")
        yield Case(document["rule"], pack, content["name"], content, str(file))


@dataclass(frozen=True, slots=True)
class Result:
    """The verdict and all findings of a case."""

    verdict: Verdict
    findings: Sequence[Finding]


def judge_case(case: Case, packs: Iterable[RulePack] = ()) -> Result:
    """Check what a case states, as the library does for any caller."""
    content, where = case.content, context(packs, case.pack)
    options = _settings(content.get("options", {}))
    if "system" in content:
        data = json.dumps({"cqos": 1} | content["system"], default=str).encode()
        system = with_profiles_tried(read(data, importer="yaml", protocol=case.pack), case.pack)
        report = check_system(with_options(system, {case.pack: options}, where), where)
        return Result(report.verdict, report.findings)
    topic = _settings(content.get("topic", {}))
    if not content.keys().isdisjoint(("offered", "requested", "needs")):
        offered, requested = _settings(content.get("offered", {})), _settings(content.get("requested", {}))
        needs = _settings(content.get("needs", {}))
        pairs = stated_pairs(case.pack, options, topic, packs, needs)
        pair = pairs.report(pairs.offer(offered), pairs.request(requested))
        return Result(pair.verdict, pair.findings)
    role = PUBLISHER if PUBLISHER in content else SUBSCRIBER
    offered, requested = (_settings(content.get(each, {})) for each in (PUBLISHER, SUBSCRIBER))
    system = pair_system(case.pack, offered, requested, options, topic)
    system.endpoints = [endpoint for endpoint in system.endpoints if endpoint.role == role]
    report = check_system(system, context(packs))
    return Result(report.verdict, [finding for finding in report.findings if finding.code != "CQ404"])


def _settings(stated: Mapping[str, Any]) -> dict[str, str]:
    """Write YAML values back as text; flow form for lists and maps."""

    def text(value: Any) -> str:
        if isinstance(value, bool):
            return "true" if value else "false"
        return value if isinstance(value, str) else json.dumps(value)

    return {name: text(value) for name, value in stated.items()}


def run_case(case: Case, packs: Iterable[RulePack] = ()) -> None:
    """Check a case and raise `AssertionError` with everything that differs from what it expects."""
    packs = list(packs)
    result = judge_case(case, packs)
    wrong = [
        *_mistyped(case, result, packs),
        *_differences(case, result),
        *_left_open(result, packs),
        *_repeated(case, result),
    ]
    if wrong:
        said = "\n".join(f"    {f.severity} {f.code} {f.message}" for f in result.findings) or "    nothing"
        raise AssertionError(f"{case} ({case.source})\n  " + "\n  ".join(wrong) + f"\n  findings:\n{said}")


def _mistyped(case: Case, result: Result, packs: Sequence[RulePack]) -> Iterator[str]:
    """Yield the reasons why a case does not test its rule: an unknown code, settings that are not read."""
    where = context(packs)
    if where.find_rule(case.rule) is None:
        pack = where.find_pack(case.pack)
        yield f"no rule has the code {case.rule}; {suggestion(case.rule, [rule.code for rule in pack.rules] if pack else ())}"
    meant = {case.rule, *case.content.get("findings", ())}
    for finding in result.findings:
        if finding.code in _NOT_READ and finding.code not in meant:
            yield f"{finding.code} is about the case itself; list it in `findings` if it is meant: {finding.message}"


def _left_open(result: Result, packs: Iterable[RulePack]) -> Iterator[str]:
    """Yield the placeholders of a rule's headline that have no value."""
    where = context(packs)
    for finding in result.findings:
        says = getattr(where.find_rule(finding.code), "says", "")
        for mark in dict.fromkeys(re.findall(r"\{[^{}]+\}", says)):
            if mark in finding.message:
                yield f"{finding.code} says {mark}, for which there is no value here: {finding.message}"


def _repeated(case: Case, result: Result) -> Iterator[str]:
    """Yield the missing facts of one pair that several findings name."""
    several = "system" in case.content
    asked = [each.message for each in result.findings if not several or " gets what it needs " in each.message]
    why = [message.partition(" is not known: ")[2] for message in asked]
    for fact in dict.fromkeys(why):
        if fact and why.count(fact) > 1:
            yield f"{why.count(fact)} findings name the same missing fact: {fact}"


def _differences(case: Case, result: Result) -> Iterator[str]:
    content = case.content
    spoken = [finding for finding in result.findings if case.rule in {finding.code, *finding.more_codes}]
    got = "ok"
    if spoken:
        open_ = spoken[0].verdict is Verdict.UNKNOWN and content["expect"] == "unknown"
        got = "unknown" if open_ else str(min((f.severity for f in spoken), key=lambda severity: severity.rank))
    if got != content["expect"]:
        yield f"expected {case.rule} to give {content['expect']}, it gave {got}"
    if "verdict" in content and content["verdict"] != result.verdict:
        yield f"expected the verdict {content['verdict']}, it is {result.verdict}"
    if "findings" in content:
        loud = sorted({c for f in result.findings if f.severity is not Severity.NOTE for c in (f.code, *f.more_codes)})
        if loud != sorted(content["findings"]):
            yield f"expected the findings {sorted(content['findings'])}, they are {loud}"
    if "remedies" in content:
        offered = sorted(f"{r.role} {r.policy}={r.value}" for finding in spoken for r in finding.remedies)
        if offered != sorted(content["remedies"]):
            yield f"expected the remedies {sorted(content['remedies'])}, they are {offered}"
