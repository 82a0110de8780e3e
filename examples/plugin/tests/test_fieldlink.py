"""Tests of the plugin: the rules with case files, the rest as installed."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from cqos_fieldlink.graph import graph
from cqos_fieldlink.markdown import render
from cqos_fieldlink.reader import read

import cqos_core as cqos
from cqos_core.model.problems import InputError
from cqos_core.model.source import ReadContext, Source
from cqos_core.model.style import Style
from cqos_core.testing import Case, load_cases, run_case

HERE = Path(__file__).parent
PLANT = HERE.parent / "plant.csv"


@pytest.mark.parametrize("case", load_cases(HERE / "cases", "fieldlink"), ids=str)
def test_case(case: Case) -> None:
    run_case(case)


def test_a_link_list_is_recognised_and_checked() -> None:
    report = cqos.check(PLANT)
    assert [(finding.code, str(finding.place)) for finding in report.findings] == [
        ("FLK101", f"{PLANT}:7:23"),
        ("FLK102", f"{PLANT}:6:30"),
    ]


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        ("", ["list:1:1: the column `device` is missing"]),
        ("device;direction;signals\n", ["list:2:18: there is no column `signals`", "list:2:1: the column `signal`"]),
        ("device;direction;signal\npress;sends\n", ["list:3:1: the line has no signal"]),
        ("device;direction;signal\npress;sends;a;b\n", ["list:3:1: the line has more cells"]),
        ("device;direction;signal\n\npress; hides;a\n", ["list:4:8: a device `sends` or `receives` a signal"]),
        ("\xff", ["list:2: the list is not written in UTF-8"]),
    ],
    ids=["empty", "header", "missing", "more", "direction", "encoding"],
)
def test_the_reader_reports_all_mistakes_of_a_list(text: str, problems: list[str]) -> None:
    with pytest.raises(InputError) as raised:
        read(Source("list", b"fieldlink links;2\n" + text.encode("latin-1")), ReadContext())
    reported = [str(problem) for problem in raised.value.problems]
    assert len(reported) >= len(problems)
    for found, expected in zip(reported, problems, strict=False):
        assert found.startswith(expected)


def test_endpoints_that_are_stated_twice_have_two_ids() -> None:
    lines = b"fieldlink links;2\ndevice;direction;signal\n" + b"press;sends;force\n" * 2
    system = read(Source("list", lines), ReadContext())
    assert [endpoint.id for endpoint in system.endpoints] == ["press/publisher/force", "press/publisher/force#2"]


def test_the_table_holds_what_was_found() -> None:
    table = render(cqos.check(PLANT), Style())
    assert table.startswith("### QoS: incompatible\n")
    assert table.count("\n| error FLK10") == 2


def test_the_table_of_nothing_says_how_much_was_judged() -> None:
    system = b"cqos: 1\nprotocol: fieldlink\nparticipants: {a: {publishes: {x: {}}}, b: {subscribes: {x: {}}}}\n"
    assert "Pairs judged: 1." in render(cqos.check(system), Style())


def test_the_graph_has_a_line_for_each_pair() -> None:
    drawn = CliRunner().invoke(graph, [str(PLANT)])
    assert drawn.exit_code == 0
    assert '"press" -> "panel" [label="temperature", color=red];' in drawn.output
