"""``cqos audit`` reports of a broker's clients what ``cqos check`` reports, topic by topic, although it resolves each kind of client once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from cqos_core.api import context

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("engines")


def audited(path: Path, **wanted: Any) -> tuple[dict[str, int], list[dict[str, object]]]:
    """Return totals, and findings as rows."""
    from pyarrow import parquet

    from cqos_fleet.fleet import WantedAudit, run_audit

    output = path.with_name("findings.parquet")
    result = run_audit(WantedAudit(str(path), output=output, severity="note", **wanted), context())
    return {name: number for name, number in result.totals.items() if name != "profiles"}, parquet.read_table(
        output
    ).to_pylist()


@pytest.mark.parametrize(
    ("engine", "seed", "number", "systems"),
    [
        ("duckdb", 1, 40, 2),
        ("polars", 2, 120, 1),
        ("duckdb", 5, 90, 1),
    ],
)
def test_an_audit_of_clients_reports_what_a_check_reports(engine, seed, number, systems, tmp_path):
    from plugins.fleet.tests.random_clients import by_topic, checked_whole, write_clients

    path = tmp_path / "clients.csv"
    write_clients(path, seed, number, systems)
    expected, rows = checked_whole(path)
    totals, found = audited(path, engine=engine)
    assert {name: totals.get(name, 0) for name in {*expected, *totals}} == {
        name: expected[name] for name in {*expected, *totals}
    }
    assert by_topic(found) == by_topic(rows)


HEAD = "role,participant,topic,qos,client_id,will.topic,no_local\n"


def rows_of(path: Path, *lines: str) -> list[dict[str, object]]:
    path.write_text(HEAD + "".join(f"{line}\n" for line in lines), "utf-8")
    return audited(path, protocol="mqtt")[1]


def test_clients_that_share_an_id_are_reported_and_others_are_not(tmp_path):
    many = [f"publisher,d{at},d/{at}/x,1,c{at},," for at in range(20)]
    found = rows_of(tmp_path / "a.csv", *many, "publisher,late,d/late/x,1,c7,,")
    assert {row["topic"] for row in found if row["code"] == "MQTT410"} == {"d/7/x", "d/late/x"}


def test_an_example_does_not_show_the_id_of_another_client(tmp_path):
    many = [f"publisher,d{at},d/{at}/x,7,c{at},d/{at}/gone," for at in range(20)]
    settings = [str(row["publisher_settings"]) for row in rows_of(tmp_path / "a.csv", *many)]
    assert settings
    assert not any("c1" in text or "gone" in text for text in settings)


def test_no_local_hides_from_a_client_only_its_own_messages(tmp_path):
    both = [
        f"{role},p{at},chat,1,,,{hides}"
        for at in range(3)
        for role, hides in (("publisher", ""), ("subscriber", "true"))
    ]
    (tmp_path / "a.csv").write_text(HEAD + "\n".join(both), "utf-8")
    totals, _ = audited(tmp_path / "a.csv", protocol="mqtt")
    assert sum(totals.get(each, 0) for each in ("compatible", "incompatible", "unknown")) == 6


def test_a_filter_whose_name_nearly_agrees_is_found_among_many_topics(tmp_path):
    many = [f"publisher,d{at},devices/{at}/state,1,,," for at in range(30)]
    found = rows_of(tmp_path / "a.csv", *many, "subscriber,s,Devices/+/state,1,,,")
    (row,) = (each for each in found if each["code"] == "CQ403")
    assert (row["topic"], row["publishers"]) == ("Devices/+/state", 30)


def test_a_client_with_two_values_of_one_setting_is_refused(tmp_path):
    from cqos_core import CqosError

    for one, other in (("c1,,", "c2,,"), (",a,", ",b,")):
        with pytest.raises(CqosError, match="in one row and"):
            rows_of(tmp_path / "a.csv", f"publisher,p,a/b,1,{one}", f"publisher,p,a/c,1,{other}")
