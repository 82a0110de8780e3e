"""A process that a call activity of another file runs takes part as its caller does: as if both were in one file."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path
from random import Random
from typing import Any

import pytest

import cqos_core as cqos
from cqos_core.files.check_units import check_units
from cqos_core.files.path_loader import load_paths
from tests.behaviour.model_text import model
from tests.behaviour.test_cases import cases, reported
from tests.oracle.wild_models import wild_model

CALLER = "s: start R/PT6H\n k: call calls=PC\n s -> k -> e"
CALLED = "i: start\n p: end x deadline=2\n i -> p"


def content(report: cqos.Report) -> tuple[Any, ...]:
    """What a report says, without what names files."""
    findings = sorted((each.code, str(each.severity), each.message, each.sides[0].members) for each in report.findings)
    return report.verdict, report.pair_count, findings


def files(*pools: dict[str, str], **stated: Any) -> cqos.Report:
    """Check pools, each group of them in a file of its own."""
    return cqos.check(*[model(each, **stated) for each in pools], importer="bpmn")


def divided(pools: dict[str, str], **stated: Any) -> cqos.Report:
    return files(*[{name: text} for name, text in pools.items()], **stated)


@pytest.mark.parametrize("case", [each for each in cases() if "calls=" in str(each.values[0]["model"])])
def test_a_case_with_calls_says_the_same_with_each_pool_in_a_file(case):
    stated = {name: case[name] for name in ("external", "options") if name in case}
    assert content(divided(case["model"], **stated)) == content(files(case["model"], **stated))


def test_random_models_with_calls_say_the_same_with_each_pool_in_a_file():
    called = 0
    for seed in range(60):
        pools = wild_model(Random(seed))  # noqa: S311
        one = files(pools)
        assert content(divided(pools)) == content(one), seed
        called += "calls=" in str(pools) and len(one.findings) > 0
    assert called > 20


def test_random_models_in_files_of_several_pools_have_the_same_findings():
    for seed in range(100, 130):
        random = Random(seed)  # noqa: S311
        pools = wild_model(random)
        parts: tuple[dict[str, str], dict[str, str]] = ({}, {})
        for name, text in pools.items():
            random.choice(parts)[name] = text
        (verdict, pairs, found), one = content(files(*filter(None, parts))), content(files(pools))
        # Which of several events a message names depends on the order of files, and so do numbers of copies.
        assert (verdict, pairs, [each[:2] for each in found]) == (*one[:2], [each[:2] for each in one[2]]), seed


def test_all_callers_of_a_process_are_named_once():
    callers = {"A": CALLER, "D": "o: start\n l: call calls=PC\n o -> l", "-PC": CALLED}
    report = files(callers, {"F": "v: start\n m: call calls=PC\n v -> m"}, {"B": "c: start x"})
    assert [each.message for each in report.findings if each.code == "CQ048"] == [
        "3 participants share this process, its events count for each of them: `A`, `D`, `F`"
    ]


def test_the_order_of_files_does_not_matter():
    parts = [{"A domain=5": CALLER}, {"-PC": CALLED}, {"B domain=5": "c: start x"}]
    for each in permutations(parts):
        report = files(*each)
        assert (report.verdict, report.pair_count, reported(report)) == ("compatible", 1, ["BP101 warning p"])


def test_a_pool_of_the_called_process_wins():
    report = files({"A domain=5": CALLER}, {"C domain=6": CALLED}, {"B domain=6": "c: start x"})
    assert (report.verdict, report.pair_count) == ("compatible", 1)


def test_each_of_two_callers_has_pairs_of_its_own():
    callers = [{"A domain=5": CALLER}, {"D domain=6": "o: start R/PT6H\n l: call calls=PC\n o -> l -> f"}]
    near, far = {"B domain=5": "c: start x"}, {"E domain=6": "d: start x deadline=1"}
    report = files(*callers, {"-PC": CALLED}, near, far)
    assert (report.verdict, report.pair_count) == ("incompatible", 2)
    wrong = [[side.members for side in each.sides] for each in report.findings if each.code == "ROS103"]
    assert wrong == [[("d",), ("p@D",)]]
    assert [each.message for each in report.findings if each.code == "CQ048"] == [
        "2 participants share this process, its events count for each of them: `A`, `D`"
    ]


def test_a_caller_without_a_pool_runs_what_it_calls():
    system = cqos.read(model({"-PA": CALLER}), model({"-PC": CALLED}), importer="bpmn")
    assert [*system.participants] == ["PA"]
    assert [(each.id, each.participant) for each in system.endpoints] == [("p", "PA")]


def test_of_processes_that_only_call_each_other_one_is_a_participant():
    first, second = {"-PA": "s: start\n k: call calls=PC\n s -> k"}, {"-PC": f"{CALLED}\n l: call calls=PA\n i -> l"}
    for order in ((first, second), (second, first)):
        system = cqos.read(*map(model, order), importer="bpmn")
        assert [*system.participants] == ["PA"]
        assert [each.participant for each in system.endpoints] == ["PA"]


def test_a_file_alone_and_a_call_that_leads_nowhere_change_nothing():
    alone = cqos.read(model({"-PC": CALLED}), importer="bpmn")
    assert [*alone.participants] == ["PC"]
    elsewhere = {"A domain=5": CALLER.replace("PC", "gone")}
    report = files(elsewhere, {"-PC": CALLED}, {"B domain=5": "c: start x"})
    assert (report.verdict, report.pair_count) == ("unknown", 0)
    assert {each.code for each in report.findings} >= {"ROS401"}


def test_what_the_called_process_states_holds_where_its_caller_states_nothing():
    called = model({"-PC": CALLED}).replace(b'<process id="PC"', b'<process id="PC" qos:domain="5"')
    subscriber = model({"B domain=5": "c: start x"})
    for caller, pairs in (("A", 1), ("A domain=5", 1), ("A domain=6", 0)):
        assert cqos.check(model({caller: CALLER}), called, subscriber, importer="bpmn").pair_count == pairs


def test_settings_of_a_pool_that_nothing_reads_leave_what_it_calls_unknown():
    lost = model({"A": CALLER}).replace(b"<participant ", b'<participant xmlns:q="http://www.qos" q:depth="3" q:x="1" ')
    called, subscriber = model({"-PC": CALLED}), model({"B": "c: start x deadline=2"})
    assert cqos.check(model({"A": CALLER}), called, subscriber, importer="bpmn").verdict == "compatible"
    assert cqos.check(lost, called, subscriber, importer="bpmn").verdict == "unknown"


def test_files_of_two_protocols_are_those_of_the_caller_with_a_warning():
    parts = [model({"A": CALLER}, protocol="dds"), model({"-PC": CALLED}), model({"B": "c: start x"}, protocol="dds")]
    for each in permutations(parts):
        report = cqos.check(*each, importer="bpmn")
        assert (report.verdict, report.pair_count) == ("compatible", 1)
        assert [each.message for each in report.findings if each.code == "CQ060"] == [
            "protocol of process `PC` is stated differently, as ros2 and as dds; that of its caller holds"
        ]


def test_files_without_sequence_flows_are_called_too():
    caller, called = model({"A domain=5": "k: call calls=PC"}), model({"-PC": "p: throw x"})
    report = cqos.check(caller, called, model({"B domain=5": "c: catch x"}), importer="bpmn")
    assert (report.verdict, report.pair_count) == ("compatible", 1)
    assert reported(report) == []


def test_exceptions_of_the_called_file_hold_for_each_caller():
    accepted = b'<extensionElements><qos:accept rule="ROS103" because="known"/></extensionElements>'
    called, subscriber = (
        model({"-PC": "i: start\n p: end x deadline=3s\n i -> p"}),
        model({"B": "c: start x deadline=2s"}),
    )
    callers = [model({"A": CALLER}), model({"D": "o: start\n l: call calls=PC\n o -> l"})]
    for text, because in ((called, None), (called.replace(b'deadline="3s">', b'deadline="3s">' + accepted), "known")):
        report = cqos.check(*callers, text, subscriber, importer="bpmn")
        found = [each for each in report.findings if each.code == "ROS103"]
        members = {name for each in found for side in each.sides for name in side.members}
        assert (report.pair_count, {each.accepted for each in found}, members) == (2, {because}, {"c", "p", "p@D"})


def test_pools_of_one_name_that_differ_stay_unknown():
    callers = [model({f"A domain={domain}": CALLER.replace("k", f"k{domain}")}) for domain in (5, 6)]
    parts = [*callers, model({"-PC": CALLED}), model({"B domain=5": "c: start x"})]
    for each in permutations(parts):
        report = cqos.check(*each, importer="bpmn")
        assert report.verdict == "unknown"
        assert any("`domain` of participant `A` is stated differently" in found.message for found in report.findings)


def test_in_a_folder_a_caller_and_what_it_calls_are_one_system(tmp_path):
    files = {"a": {"A": CALLER}, "b": {"-PC": CALLED}, "c": {"B": "c: start x"}}
    for name, pools in files.items():
        (tmp_path / f"{name}.bpmn").write_bytes(model(pools))

    def together() -> list[str]:
        found, _ = check_units(load_paths([str(tmp_path)]), "")
        return ["".join(Path(file).stem for file in each.files) for each in found]

    assert together() == ["ab", "c"]
    # Which of two processes of one name is called is not known.
    (tmp_path / "d.bpmn").write_bytes(model({"-PC": "z: start\n z -> y"}))
    assert together() == ["a", "b", "c", "d"]


def test_too_many_copies_are_refused():
    callers = [model({f"A{n}": f"k{n}: call calls=PC"}) for n in range(400)]
    called = model({"-PC": "\n".join(f"p{n}: throw x" for n in range(300))})
    with pytest.raises(cqos.InputError, match="more than 100000 copies"):
        cqos.read(*callers, called, importer="bpmn")
