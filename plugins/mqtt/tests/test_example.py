"""The example of a greenhouse: each mistake that its comments count is found, at its line, and nothing else is."""

import re
from pathlib import Path

from cqos_core import Severity, check

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "mqtt_greenhouse.yaml"
EXPECTED = {1: "MQTT310", 2: "MQTT101", 3: "MQTT410", 4: "MQTT304", 5: "CQ403", 6: "MQTT602"}


def test_each_mistake_is_found_where_it_is():
    lines = EXAMPLE.read_text(encoding="utf-8").splitlines()
    marked = {int(found[1]): at for at, line in enumerate(lines, 1) if (found := re.search(r"# (\d): ", line))}
    report = check(str(EXAMPLE))
    loud = [each for each in report.findings if each.severity is not Severity.NOTE]
    assert sorted(each.code for each in loud) == sorted(EXPECTED.values())
    for number, code in EXPECTED.items():
        (finding,) = [each for each in loud if each.code == code]
        reported_lines = {side.place.line for side in finding.sides if side.place} | {
            fact.place.line for side in finding.sides for fact in side.facts if fact.place
        }
        assert any(abs((line or 0) - marked[number]) <= 1 for line in reported_lines), (number, reported_lines)


def test_what_the_controller_needs_it_gets():
    report = check(str(EXAMPLE))
    verdicts = {
        (group.topic, group.verdict)
        for group in report.groups
        if any("controller/" in name for name in group.subscribers)
    }
    assert {verdict for _, verdict in verdicts} == {"compatible"}
