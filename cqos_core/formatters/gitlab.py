"""The format ``gitlab``: a Code Quality report, which GitLab shows in merge requests."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

from cqos_core.formatters import phrases
from cqos_core.formatters.fingerprint import fingerprint
from cqos_core.formatters.json_report import dump
from cqos_core.formatters.places import Places, relative
from cqos_core.model.finding import Severity

if TYPE_CHECKING:
    from cqos_core.model.report import Report
    from cqos_core.model.style import Style

_SEVERITIES: Final = {Severity.ERROR: "critical", Severity.WARNING: "minor", Severity.NOTE: "info"}


def render_gitlab(report: Report, style: Style) -> str:
    """Return a JSON list with one issue for each finding that is not accepted.

    An issue needs a file. A finding without a place has the first line of the first file.
    """
    findings = [finding for finding in phrases.shown(report, style) if finding.accepted is None]
    places = Places(findings, style.sources)
    seen: Counter[str] = Counter()
    issues = []
    for finding in findings:
        place = None if finding.place is None else places.exact(finding.place)
        source = place.source if place is not None else next(iter(report.sources), "")
        # GitLab shows one issue for each fingerprint.
        identity = fingerprint(finding)
        seen[identity] += 1
        issues.append(
            {
                "description": phrases.message_and_helps(finding),
                "check_name": finding.code,
                "fingerprint": identity if seen[identity] == 1 else f"{identity}-{seen[identity]}",
                "severity": _SEVERITIES[finding.severity],
                "location": {"path": relative(source, style), "lines": {"begin": (place and place.line) or 1}},
            }
        )
    return dump(issues, indent=2) + "\n"
