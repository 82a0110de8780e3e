"""Small fleets at random, with all that makes an audit take another way; and what the check of one system says of them."""

from __future__ import annotations

import csv
import random
from collections import Counter
from typing import TYPE_CHECKING

from cqos_core.checking.checker import check_system
from cqos_core.matching.pipeline import context
from cqos_core.model.system import Endpoint, Participant, ProfileRef, Setting, System

if TYPE_CHECKING:
    from pathlib import Path

SETTINGS = {
    "reliability": ("", "", "reliable", "best_effort", "system_default", "bogus", "best_available"),
    "durability": ("", "volatile", "transient_local"),
    "deadline": ("", "", "100ms", "1s", "2s", "infinite"),
    "depth": ("", "1", "10"),
}
NAMES = {
    "ros2": ("/t", "/t", "/scan/left", "/tf", "/rosout", "chatter", "~/x", "/bad//n", "/Scan"),
    "dds": ("t", "Square", "DCPSTopic", "/a/b"),
}
PROFILES = {"ros2": ("", "", "", "sensor_data", "no_such_profile"), "dds": ("",)}


def write_fleet(path: Path, protocol: str, seed: int, number: int = 250) -> None:
    """Write a table of endpoints as CSV."""
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ("id", "role", "participant", "topic", "type", "domain", "profile", *SETTINGS))
        writer.writeheader()
        for at in range(number):
            domain = chosen.choice(("", "1")) if chosen.random() < 0.2 else ""
            writer.writerow(
                {
                    "id": f"e{at}",
                    "role": chosen.choice(("publisher", "subscriber")),
                    "participant": f"n{at % 40}_{domain or 0}",
                    "topic": chosen.choice(NAMES[protocol]) + (str(chosen.randrange(30)) if at % 10 else ""),
                    "type": chosen.choice(("", "a/msg/B", "a/msg/C")) if chosen.random() < 0.2 else "",
                    "domain": domain,
                    "profile": chosen.choice(PROFILES[protocol]),
                    **{
                        name: "" if name == "depth" and protocol == "dds" else chosen.choice(texts)
                        for name, texts in SETTINGS.items()
                    },
                }
            )


def said_by_check(path: Path, protocol: str) -> tuple[Counter[str], Counter[tuple[str, str]]]:
    """Return what the check of one system says: pairs by verdict, and pairs of findings by code and severity."""
    system = System(protocol=protocol)
    for row in csv.DictReader(path.read_text("utf-8").splitlines()):
        owner = row["participant"]
        stated = {"domain": Setting(row["domain"])} if row["domain"] else {}
        system.participants.setdefault(owner, Participant(owner, protocol, stated))
        system.endpoints.append(
            Endpoint(
                id=row["id"],
                role="publisher" if row["role"] == "publisher" else "subscriber",
                topic=row["topic"],
                participant=owner,
                settings={name: Setting(row[name]) for name in SETTINGS if row[name]},
                profiles=(ProfileRef(row["profile"]),) if row["profile"] else (),
                type=row["type"] or None,
            )
        )
    report = check_system(system, context())
    verdicts, findings = Counter[str](), Counter[tuple[str, str]]()
    for each in report.groups:
        verdicts[each.verdict.value] += len(each.publishers) * len(each.subscribers)
    for finding in report.findings:
        if finding.code != "CQ406":  # a note about a participant's own topics
            findings[finding.code, finding.severity.value] += finding.pairs
    return verdicts, findings
