"""The format ``github``: workflow commands, which GitHub shows beside the changed lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cqos_core.formatters import phrases, terminal
from cqos_core.formatters.places import Places, relative
from cqos_core.model.finding import Severity

if TYPE_CHECKING:
    from cqos_core.model.finding import Finding
    from cqos_core.model.report import Report
    from cqos_core.model.settings import Place
    from cqos_core.model.style import Style

_COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}


def render_github(report: Report, style: Style) -> str:
    """Return one workflow command per finding that is not accepted, and one line with the verdict and all counts."""
    findings = [finding for finding in phrases.shown(report, style) if finding.accepted is None]
    places = Places(findings, style.sources)
    commands = [_command(finding, places, style) for finding in findings]
    # The last line is no command. A name from an input could make it one, so it has none.
    counts = phrases.counts(report, style, asks=False)
    return "\n".join([*commands, f"{report.verdict_words}{phrases.beside(report)}: {counts}"]) + "\n"


def _command(finding: Finding, places: Places, style: Style) -> str:
    place = finding.place
    properties = {} if place is None else _properties(places.exact(place), style)
    properties["title"] = f"{finding.code} {finding.name}"
    listed = ",".join(f"{name}={_property(value)}" for name, value in properties.items())
    return f"::{_COMMANDS[finding.severity]} {listed}::{_data(phrases.message_and_helps(finding))}"


def _properties(place: Place, style: Style) -> dict[str, str]:
    known = {
        "file": relative(place.source, style),
        "line": place.line,
        "col": None if place.line is None else place.column,
    }
    return {name: str(value) for name, value in known.items() if value is not None}


def _data(text: str) -> str:
    """Escape a message, in which ``%`` begins an escape and a new line would end the command."""
    return terminal.clean(text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A"))


def _property(text: str) -> str:
    """Escape a property's value, in which ``:`` and ``,`` end something, too."""
    return _data(text).replace(":", "%3A").replace(",", "%2C")
