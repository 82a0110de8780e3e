"""Small brokers at random, with what makes clients and topics count together; and what the check of each of them reports."""

from __future__ import annotations

import csv
import random
from collections import Counter
from typing import TYPE_CHECKING

from cqos_core.api import context
from cqos_core.checking.checker import assemble, judge_topics
from cqos_core.matching.pipeline import Pipeline
from cqos_core.model.codes import CODES
from cqos_fleet.whole_systems import systems_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

OF_ENDS = {
    "qos": ("", "0", "1", "2", "5"),
    "retain": ("", "", "true"),
    "max_payload": ("", "", "", "10", "300000"),
    "message_expiry_interval": ("", "", "10s"),
    "retain_handling": ("", "", "", "send_if_new"),
    "subscription_identifier": ("", "", "7"),
    "taken_every": ("", "", "", "", "1s", "10min"),
}
OF_CLIENTS = {
    "protocol_version": ("", "5.0", "5.0", "3.1.1", "9"),
    "client_id": ("", "c{n}", "c{n}", "same", "other"),
    "username": ("", "u{n}", "u"),
    "clean_start": ("", "false"),
    "session_expiry_interval": ("", "", "60s"),
    "receive_maximum": ("", "", "5"),
    "maximum_packet_size": ("", "", "", "200"),
    "will.topic": ("", "", "d/{n}/gone", "d/{n}/a", "all/gone", "d/{n}/+"),
    "will.payload": ("", "bye", "{n} is gone"),
    "will.delay_interval": ("", "", "90s"),
    "broker": ("", "", "", "", "one", "two"),
}
PUBLISHED = (
    "d/{n}/a",
    "d/{n}/a",
    "d/{n}/b",
    "d/{m}/set",
    "all/x",
    "All/x",
    "$SYS/x",
    "d/{n}/+",
    "d/{n}/telemetry",
    "e/{n}",
)
SUBSCRIBED = (
    "d/{n}/set", "d/{n}/a", "d/{m}/b", "d/{n}/telemetri", "d/{n}/#", "d/+/a", "d/#", "#", "all/x", "$share/g/d/+/a", "$share/g/all/x",
    "$SYS/#", "D/+/b", "+/+/gone", "d/#/x", "/e/+", "d/{n}/gone",
)  # fmt: skip


def write_clients(path: Path, seed: int, number: int = 40, systems: int = 1) -> None:
    """Write a table of the endpoints of clients as CSV; few clients of a seed have several of the features."""
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    own_topics = chosen.random()
    quiet = {name for name in (*OF_ENDS, *OF_CLIENTS) if chosen.random() < 0.5}
    no_local = chosen.choice((0.0, 0.1, 0.5))
    rows = []
    for at in range(number):
        stated = {
            name: "" if name in quiet else chosen.choice(texts).format(n=at) for name, texts in OF_CLIENTS.items()
        }
        for _ in range(chosen.choice((1, 2, 3, 3, 6))):
            role = chosen.choice(("publisher", "subscriber"))
            names = PUBLISHED if role == "publisher" else SUBSCRIBED
            usual = names[: 4 if role == "publisher" else 3]
            name = chosen.choice(usual if chosen.random() < own_topics else names)
            row = {each: "" if each in quiet else chosen.choice(texts) for each, texts in OF_ENDS.items()}
            hides = "true" if role == "subscriber" and chosen.random() < no_local else ""
            some = stated if chosen.random() < 0.8 else {}
            rows.append(
                {
                    "system": f"s{at % systems}" if systems > 1 else "",
                    "protocol": "mqtt",
                    "role": role,
                    "participant": f"p{at}",
                    "topic": name.format(n=at, m=chosen.randrange(number)),
                    "version": chosen.choice(("", "2")),
                    **{each: some.get(each, "") for each in OF_CLIENTS},
                    **row,
                    "no_local": hides,
                }
            )
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [*rows[0]])
        writer.writeheader()
        writer.writerows(rows)


def checked_whole(path: Path) -> tuple[Counter[str], list[dict[str, object]]]:
    """Return totals, and findings as rows, of checks of the systems one by one: those of topics before a report puts them together."""
    where = context()
    totals, rows = Counter[str](), []
    listed = sorted(csv.DictReader(path.read_text("utf-8").splitlines()), key=lambda row: row["system"])
    for name, system, *_ in systems_of(listed, where.find_pack, {}):  # type: ignore[arg-type] # the pack is there
        pipeline = Pipeline(system, where)
        topics = judge_topics(pipeline)
        report = assemble(pipeline.system, pipeline.resolver.result, topics.results, where)
        totals.update(endpoints=report.endpoints, topics=report.topics)
        for group in report.groups:
            totals[group.verdict.value] += len(group.publishers) * len(group.subscribers)
        roles = {end.id: end.role for end in pipeline.endpoints}
        found = [made.finding for result in topics.results.values() for made in result.made]
        codes = {each.code for each in found}
        for each in (*found, *(each for each in report.findings if each.code not in codes)):
            if each.code not in {"CQ404", "CQ406"}:  # notes about a whole system
                ends = Counter(roles.get(member, "") for side in each.sides for member in side.members)
                row: dict[str, object] = {
                    "publishers": ends["publisher"],
                    "subscribers": ends["subscriber"],
                    "pairs": each.pairs,
                }
                usual = CODES.get(each.code)
                row["help"] = each.help if usual is not None and each.help != usual.help else ""
                verdict = each.verdict.value if each.verdict else ""
                said = {"code": each.code, "severity": each.severity.value, "verdict": verdict}
                rows.append({**said, **row, "system": name, "topic": each.topic or ""})
    return totals, rows


def by_topic(rows: Iterable[Mapping[str, object]]) -> dict[tuple[str, ...], Counter[str]]:
    """Return numbers of endpoints and pairs by rule, verdict and topic.

    What no topic decides has no numbers: a check puts into one finding what an audit counts by topic.
    """
    found: dict[tuple[str, ...], Counter[str]] = {}
    for row in rows:
        named = [str(row[each]) for each in ("code", "severity", "verdict")]
        beyond = named[0] in BEYOND
        key = (*named, *(() if beyond else (str(row["system"]), str(row["topic"]), str(row["help"]))))
        sums = found.setdefault(key[:2] if beyond else key, Counter())
        if not beyond:
            sums.update({each: int(str(row[each])) for each in ("publishers", "subscribers", "pairs")})
    return found


BEYOND = frozenset(
    ("CQ101", "CQ102", "CQ201", "CQ202", "CQ203", "CQ204", "CQ210", "MQTT408", "MQTT409", "MQTT410", "MQTT411", "MQTT212", "MQTT508", "MQTT601", "MQTT602")
)  # fmt: skip
"""Rules about participants, names, and what reading settings reports."""
