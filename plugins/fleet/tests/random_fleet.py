"""Small fleets at random, with all that makes an audit take another way; and what the check of each system says of them."""

from __future__ import annotations

import csv
import random
from collections import Counter
from itertools import groupby
from types import MappingProxyType
from typing import TYPE_CHECKING

from cqos_core import Endpoint, Participant, ProfileRef, Setting, System, check
from cqos_core.api import context
from cqos_core.plugins import load_plugins
from cqos_fleet.profiles import NO_SETTINGS, settings_of
from plugins.fleet.tests.random_ends import known_values

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from cqos_core.packs import RulePack

STATED = {
    "ros2": {
        "reliability": ("", "", "reliable", "best_effort", "system_default", "bogus", "best_available"),
        "durability": ("", "volatile", "transient_local"),
        "deadline": ("", "", "100ms", "1s", "2s", "infinite"),
        "depth": ("", "1", "10"),
    },
    "dds": {
        "reliability": ("", "", "reliable", "best_effort", "bogus"),
        "durability": ("", "volatile", "transient_local"),
        "deadline": ("", "", "100ms", "1s", "2s", "infinite"),
        "liveliness.kind": ("", "", "manual_by_topic"),
    },
    "mqtt": {
        "qos": ("", "0", "1", "2", "3"),
        "retain": ("", "", "true"),
        "no_local": ("", "", "", "true"),
        "message_expiry_interval": ("", "", "10s"),
        "client_id": ("", "", "", "one", "two"),
        "will.topic": ("", "", "", "s/gone"),
    },
}
NAMES = {
    "ros2": (
        "/t",
        "/t",
        "/scan/left",
        "/tf",
        "/rosout",
        "chatter",
        "~/x",
        "/bad//n",
        "/Scan",
        "/sensor/front",
        "/sensor/fronts",
    ),
    "dds": ("t", "Square", "DCPSTopic", "/a/b", "rt/t", "rt/chatter"),
    "mqtt": ("s/a", "s/b", "$SYS/x", "s/Temperature", "s//a"),
}
FILTERS = ("s/a", "s/+", "s/#", "#", "$share/g/s/+", "$SYS/#", "s/temperature", "s/#/b", "+/a", "/s/b")
PROFILES = {"ros2": ("", "", "", "sensor_data", "no_such_profile")}
_POLICIES = 8


def _pack(protocol: str) -> RulePack:
    found = load_plugins().pack(protocol)
    assert found is not None
    return found


def any_settings(protocol: str, seed: int) -> dict[str, tuple[str, ...]]:
    """Return texts of some policies at random, those that conditions compare with among them; none, and a wrong one."""
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    pack = _pack(protocol)
    known = known_values(pack)
    levels = {"endpoint", "participant", "option"}
    every = [
        at
        for at, each in enumerate(pack.policies)
        if each.level in levels and each.name not in {"domain", *NO_SETTINGS}
    ]
    found = {}
    for at in chosen.sample(every, min(_POLICIES, len(every))):
        policy = pack.policies[at]
        texts = {*map(policy.domain.format, known[at]), *policy.words}
        few = chosen.sample(sorted(texts), min(3, len(texts)))
        found[policy.name] = ("", "", *few, *few, *(["bogus"] if chosen.random() < 0.2 else []))
    return found


def any_rows(protocol: str, seed: int, number: int) -> list[dict[str, str]]:
    """Return endpoints of one topic, each a participant of its own, with any settings."""
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    stated = any_settings(protocol, seed)
    return [
        {
            "role": ("publisher", "subscriber")[at % 2],
            "topic": "/t",
            "participant": f"p{at}",
            "version": "",
            **{name: chosen.choice(values) for name, values in stated.items()},
        }
        for at in range(number)
    ]


def any_options(protocol: str, seed: int) -> dict[str, dict[str, Setting]]:
    """Return values of some options of a pack at random."""
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    found = {}
    for policy in _pack(protocol).policies:
        values = [*policy.domain.candidates()]
        if policy.level == "option" and values and chosen.random() < 0.3:
            found[policy.name] = Setting(policy.domain.format(chosen.choice(values)))
    return {protocol: found}


def write_fleet(
    path: Path,
    protocols: str,
    seed: int,
    number: int = 250,
    systems: int = 1,
    stated: Mapping[str, Mapping[str, tuple[str, ...]]] = STATED,
) -> None:
    """Write a table of endpoints as CSV, with some of the texts that are ``stated`` by protocol and setting."""
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    listed = protocols.split()
    packs = {each: _pack(each) for each in listed}
    settings = dict.fromkeys(name for each in listed for name in stated[each])
    columns = ("id", "system", "protocol", "role", "participant", "topic", "type", "domain", "profile", *settings)
    if "mqtt" in listed:
        columns = tuple(each for each in columns if each != "domain")
    rows = []
    owned: dict[str, dict[str, str]] = {}
    for at in range(number):
        protocol = listed[at % len(listed)]
        domain = chosen.choice(("", "1")) if chosen.random() < 0.2 else ""
        system, role = f"s{at % systems}" if systems > 1 else "", chosen.choice(("publisher", "subscriber"))
        owner = f"{protocol}_{at % 40}_{domain or 0}"
        texts = {name: chosen.choice(values) for name, values in stated[protocol].items()}
        of_owner = {name: text for name, text in texts.items() if packs[protocol].find("endpoint", name) is None}
        texts |= owned.setdefault(f"{system} {owner}", of_owner)
        names = FILTERS if protocol == "mqtt" and role == "subscriber" else NAMES[protocol]
        numbered = str(chosen.randrange(30)) if at % 10 and protocol != "mqtt" else ""
        rows.append(
            {
                "id": f"e{at}",
                "system": system,
                "protocol": protocol,
                "role": role,
                "participant": owner,
                "topic": chosen.choice(names) + numbered,
                "type": chosen.choice(("", "a/msg/B", "a/msg/C"))
                if chosen.random() < 0.2 and "mqtt" not in listed
                else "",
                "domain": domain,
                "profile": chosen.choice(PROFILES.get(protocol, ("",))),
                **texts,
            }
        )
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


def systems_in(path: Path, options: Mapping[str, Mapping[str, Setting]] = MappingProxyType({})) -> Iterator[System]:
    """Yield the systems of a table."""
    where = context()
    with path.open(encoding="utf-8", newline="") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: row["system"])
    for _, of_system in groupby(rows, lambda row: row["system"]):
        system = System(options={pack: dict(given) for pack, given in options.items()})
        for row in of_system:
            pack = where.find_pack(row["protocol"])
            assert pack is not None
            owner = row["participant"]
            stated = {name: Setting(text) for name, text in settings_of(pack, row, owned=True).items()}
            system.participants.setdefault(owner, Participant(owner, pack.id, stated))
            system.endpoints.append(
                Endpoint(
                    id=row["id"],
                    role="publisher" if row["role"] == "publisher" else "subscriber",
                    topic=row["topic"],
                    participant=owner,
                    settings={name: Setting(text) for name, text in settings_of(pack, row, owned=False).items()},
                    profiles=(ProfileRef(row["profile"]),) if row["profile"] else (),
                    type=row["type"] or None,
                )
            )
        yield system


def said_by_check(
    path: Path, options: Mapping[str, Mapping[str, Setting]] = MappingProxyType({})
) -> tuple[Counter[str], Counter[tuple[str, str]]]:
    """Return what the checks of the systems say: pairs by verdict, and pairs of findings by code and severity."""
    verdicts, findings = Counter[str](), Counter[tuple[str, str]]()
    for system in systems_in(path, options):
        report = check(system)
        for each in report.groups:
            verdicts[each.verdict.value] += len(each.publishers) * len(each.subscribers)
        for finding in report.findings:
            if finding.code not in {"CQ404", "CQ406"}:  # notes about a whole system
                findings[finding.code, finding.severity.value] += finding.pairs
    return verdicts, findings
