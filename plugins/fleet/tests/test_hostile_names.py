"""``cqos audit`` reports of hostile names what ``cqos check`` reports: every rule about a topic or an endpoint is asked in both."""

from __future__ import annotations

import csv
import json
import random
from typing import TYPE_CHECKING

import pytest

from cqos_core import check
from plugins.fleet.tests.needed import needed
from plugins.fleet.tests.random_fleet import said_by_check, systems_in
from plugins.fleet.tests.test_audit import audited
from tests.command_process import run_here
from tests.effort import EXPLORE

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("engines")

_COMMON = ("t", "/t", "//", "/t//u", "/t/", "/", "~", "~t", "~/t", "{node}/t", "{robot}", "a b", " /t", "/t\t", "tür", "/t\u200b", "/\u2024t",
           "日本", "\U0001f600", "NULL", "null", "1", "/1", "/a/1b", "_", "/_t", "/a__b", "/T", '"', "'", "a,b", "/t%", "/t*", "/t?", "/[t]",
           "rt/t", "rq/tRequest", "/parameter_events", "/rosout", "/tf", "DCPSTopic", "$SYS/x", "$share", "$share/", "$share/g", "$share/g/",
           "$share//t", "$share/+/t", "$share/g/#", "#", "+", "+/", "/+", "t/#", "t#", "t/#/u", "t+", "+t/u", "t/+/u", "a/+b", "$SYS/#",
           "$SYS/broker/clients/total", "/t/u", "t/u")  # fmt: skip
LENGTHS = {
    "ros2": (63, 64, 65, 246, 247, 248, 1_000),
    "dds": (63, 64, 65, 255, 256, 257, 1_000),
    "mqtt": (63, 64, 65, 255, 256, 9_999, 10_001, 65_534, 65_535, 65_536),
}
PARTICIPANTS = ("p", "a node", "9p", "p/q", "p//", "_p", "ü", "p.q", "p" * 300)
SETTINGS: dict[str, dict[str, tuple[str, ...]]] = {
    "ros2": {
        "reliability": ("", "reliable", "best_effort"),
        "namespace": ("", "", "/n", "n/", "/n n", "/" + "n" * 250),
    },
    "dds": {"reliability": ("", "reliable", "best_effort")},
    "mqtt": {"qos": ("", "0", "2", "7"), "retain": ("", "true"), "client_id": ("", "", "same", "c" * 70_000, "ü")},
}


def hostile_names(protocol: str) -> list[str]:
    """Return names that rules about names speak of, and names of each length beside a boundary."""
    of_length = [
        each + letter * (long - len(each))
        for long in LENGTHS[protocol]
        for each, letter in (("/", "x"), ("x", "/x"), ("", "ü"))
    ]
    return [*_COMMON, *of_length]


def write_hostile(path: Path, protocol: str, seed: int, number: int) -> None:
    """Write a table of endpoints with such names; some of one participant, some of one topic."""
    chosen = random.Random(seed)  # noqa: S311 - no secrets
    every = hostile_names(protocol)
    names = chosen.sample(every, min(number // 3, len(every)))
    settings = SETTINGS[protocol]
    owned: dict[str, dict[str, str]] = {}
    columns = ("id", "system", "protocol", "role", "participant", "topic", "type", "profile", *settings)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        for at in range(number):
            owner = chosen.choice(PARTICIPANTS) + str(chosen.randrange(3))
            texts = {name: chosen.choice(values) for name, values in settings.items()}
            of_owner = {name: text for name, text in texts.items() if name in {"namespace", "client_id"}}
            texts |= owned.setdefault(owner, of_owner)
            role = chosen.choice(("publisher", "subscriber"))
            writer.writerow(
                {
                    "id": f"e{at}",
                    "protocol": protocol,
                    "role": role,
                    "participant": owner,
                    "topic": chosen.choice(names),
                    **texts,
                }
            )


_WITHOUT_PARTNER = {"CQ401", "CQ402", "CQ403"}
"""Which of several names that are equally near is meant depends on their order, so these are compared as one."""


def said_by_topic(path: Path) -> set[tuple[str, str, str | None]]:
    """Return code, severity and topic of each finding of a check; what several topics share has no topic."""
    found = set()
    for system in systems_in(path):
        for each in check(system).findings:
            if each.code not in {"CQ404", "CQ406"}:  # notes about a whole system
                found |= {(each.code, each.severity.value, topic) for topic in (each.topic, *each.more_topics)}
    return found


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(60 if EXPLORE else 1))
@pytest.mark.parametrize("protocol", ["ros2", "dds", "mqtt"])
def test_an_audit_of_hostile_names_says_what_a_check_says(protocol, seed, tmp_path):
    path = tmp_path / "fleet.csv"
    write_hostile(path, protocol, seed, 60)
    verdicts, findings = said_by_check(path)
    totals, found = audited(tmp_path, path=str(path), engine=("duckdb", "polars")[seed % 2])
    assert {name: totals.get(name, 0) for name in verdicts} == verdicts
    assert found == findings
    assert set(found) == set(findings)
    checked = said_by_topic(path)
    nowhere = {code for code, _, topic in checked if topic is None}
    rows = needed("pyarrow.parquet").read_table(tmp_path / "findings.parquet").to_pylist()
    listed = {(each["code"], each["severity"], None if each["code"] in nowhere else each["topic"]) for each in rows}
    assert {each for each in listed if each[0] not in _WITHOUT_PARTNER} == {
        each for each in checked if each[0] not in _WITHOUT_PARTNER
    }


@pytest.mark.parametrize(("length", "codes"), [(247, []), (248, ["ROS405"])])
def test_a_name_that_ros_2_refuses_for_its_length_is_reported(length, codes, tmp_path):
    name = "/" + "x" * (length - 1)
    (tmp_path / "fleet.csv").write_text(f"role,topic\npublisher,{name}\nsubscriber,{name}\n", "utf-8")
    done = run_here(["audit", "fleet.csv", "--protocol", "ros2", "--format", "json"], tmp_path)
    assert [each["code"] for each in json.loads(done.out)["findings"]] == codes
    assert done.code == len(codes)


@pytest.mark.parametrize(("topic", "codes"), [("/clock", []), ("/clack", ["CQ401"])])
def test_a_topic_whose_partners_are_elsewhere_by_convention_lacks_none(topic, codes, tmp_path):
    rows = f"role,topic\nsubscriber,{topic}\npublisher,/t\nsubscriber,/t\n"
    (tmp_path / "fleet.csv").write_text(rows, "utf-8")
    done = run_here(["audit", "fleet.csv", "--protocol", "ros2", "--format", "json"], tmp_path)
    assert [each["code"] for each in json.loads(done.out)["findings"]] == codes
