"""The example of a rule that ``cqos audit`` prints is a pair on which the rule reports."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING, Any

import pytest

from cqos_core import check, check_pair
from cqos_core.api import context
from plugins.fleet.tests.random_clients import write_clients
from plugins.fleet.tests.random_fleet import STATED, any_options, any_settings, systems_in, write_fleet
from tests.command_process import run_here
from tests.effort import EXPLORE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from cqos_core import Setting

pytestmark = pytest.mark.usefixtures("engines")

_OF_MORE_THAN_A_PAIR = {"MQTT605"}
"""Rules of pairs that read what else the client has: here another subscription on the same topic."""


def examples(path: Path, protocol: str, options: Mapping[str, Mapping[str, Setting]]) -> list[tuple[str, Any]]:
    """Return code and example of the rules about pairs."""
    from cqos_fleet.fleet import WantedAudit, run_audit

    where = context()
    pack = where.find_pack(protocol)
    assert pack is not None
    pairs = {each.rule.code for each in pack.by_scope["pair"]} - _OF_MORE_THAN_A_PAIR
    causes = run_audit(WantedAudit(str(path), severity="note", options=options), where).causes
    return [(each.code, example) for each in causes if each.code in pairs for example in each.examples]


def said_of_two(folder: Path, protocol: str, example: Any, options: Mapping[str, Mapping[str, Setting]]) -> set[str]:
    """Return the codes of a check of nothing but the two endpoints of an example."""
    topic, *ends, _ = example
    names = sorted({*ends[0], *ends[1]} - {"profile"})
    path = folder / "two.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        columns = ("id", "system", "protocol", "role", "participant", "topic", "type", "profile", *names)
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        for role, stated in zip(("publisher", "subscriber"), ends, strict=True):
            writer.writerow(
                {"id": role, "protocol": protocol, "role": role, "participant": role, "topic": topic, **stated}
            )
    (system,) = systems_in(path, options)
    return {each.code for each in check(system).findings}


@pytest.mark.explored
@pytest.mark.parametrize("seed", range(40 if EXPLORE else 1))
@pytest.mark.parametrize("kind", ["ros2", "dds", "mqtt", "clients"])
def test_the_two_endpoints_of_an_example_alone_have_the_finding(kind, seed, tmp_path):
    path, protocol = tmp_path / "fleet.csv", "mqtt" if kind == "clients" else kind
    options: dict[str, dict[str, Setting]] = {}
    if kind == "clients":
        write_clients(path, seed, 60)
    elif kind == "mqtt" or seed % 2:
        write_fleet(path, kind, seed, 150)
    else:
        options = any_options(kind, seed)
        write_fleet(path, kind, seed, 150, 1, {**STATED, kind: any_settings(kind, seed)})
    found = examples(path, protocol, options)
    assert found or options  # settings at random may be none of pairs
    for code, example in found:
        # What follows from all publishers of the topic is not there when two ends are alone.
        if not {"best_available", "from_publishers"} & {*example[1].values(), *example[2].values()}:
            assert code in said_of_two(tmp_path, protocol, example, options), (code, example)


DEADLINES = """role,participant,topic,deadline
publisher,p1,/t,200ms
publisher,p2,/t,30ms
subscriber,s1,/t,10ms
subscriber,s2,/t,30ms
"""


def test_an_example_takes_both_ends_from_one_finding(tmp_path):
    (tmp_path / "pair.csv").write_text(DEADLINES, "utf-8")
    done = run_here(["audit", "pair.csv", "--protocol", "ros2", "--format", "json"], tmp_path)
    (finding,) = json.loads(done.out)["findings"]
    (example,) = finding["examples"]
    report = check_pair("ros2", example["publisher"], example["subscriber"])
    assert [each.code for each in report.findings] == ["ROS103"]
