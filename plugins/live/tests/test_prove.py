"""``cqos prove``, from outside: pairs run on Cyclone DDS, as processes of their own."""

import json
import os
from pathlib import Path

import pytest

if os.environ.get("CI") != "true":
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed: pip install cyclonedds")

from cqos_core.analysis.run_plan import named, prepare
from cqos_core.api import context, read
from cqos_core.model.finding import Verdict
from cqos_core.model.report import Guarantee, GuaranteeCell, PairReport
from cqos_core.packs.prover import Fault
from cqos_live.prove.outcomes import claims, fixed

BPMN = Path(__file__).resolve().parents[3] / "examples" / "smart_agriculture_incompatible.bpmn"
PAIR = """cqos: 1
protocol: dds
participants:
  robot:
    publishes: {scan: {reliability: %s, history: keep_all}}
  nav:
    subscribes: {scan: {reliability: reliable, history: keep_all}}
"""
ENDS = ("robot/publisher/scan", "nav/subscriber/scan")


@pytest.fixture
def pair(files):
    """Write a system of one pair whose publisher has this reliability; return the file's name."""

    def write(reliability):
        (files / "pair.yaml").write_text(PAIR % reliability, encoding="utf-8")
        return "pair.yaml"

    return write


def test_a_pair_that_is_refused_runs_again_with_its_fix(cqos, pair):
    done = cqos("prove", pair("best_effort"), "--format", "text", "--format", "json", "--output", "runs.json")
    assert (done.code, done.err) == (0, "")
    lines = [line.strip() for line in done.out.splitlines()]
    assert "20 sent, 0 arrived, refused for RELIABILITY" in lines
    assert "with the fix: offer reliability `reliable` on robot/publisher/scan" in lines
    assert "20 sent, 20 arrived" in lines
    assert lines[-1] == "2 runs: all as C-QoS says"
    first, second = json.loads(Path("runs.json").read_text(encoding="utf-8"))["runs"]
    assert (first["verdict"], first["refused"], first["arrived"]) == ("incompatible", ["reliability"], [])
    assert (second["verdict"], second["matched"], second["arrived"]) == ("compatible", True, list(range(20)))
    assert first["plan"]["publisher"]["values"]["reliability"] == "best_effort"


def test_a_node_of_ros_runs_as_it_is_on_the_wire_of_dds(cqos):
    done = cqos("prove", BPMN, "ROS101", "--format", "json")
    first, second = json.loads(done.out)["runs"]
    assert (done.code, first["refused"], first["arrived"]) == (0, ["reliability"], [])
    # A depth of 1 keeps the last sample, and those before it only as long as the reader keeps up.
    assert (second["plan"]["subscriber"]["values"]["history.depth"], second["arrived"][-1]) == ("1", 19)
    assert len(second["fixes"]) == 2


def test_a_link_that_is_cut_loses_nothing_of_a_reliable_pair(cqos, pair):
    done = cqos("prove", pair("reliable"), *ENDS, "--fault", "link_outage=300ms")
    assert (done.code, done.err) == (0, "")
    assert "link        cut" in done.out
    assert "35 sent, 35 arrived" in done.out


def test_what_a_killed_subscriber_misses_is_shown(cqos, pair):
    done = cqos("prove", pair("reliable"), *ENDS, "--fault", "subscriber_restart=200ms")
    assert done.code == 0
    assert "subscriber  killed" in done.out
    assert "30 sent, 20 arrived" in done.out


def test_faults_that_needs_survive_are_injected_without_being_asked_for(cqos, pair, files):
    file = pair("reliable")
    needs = "needs: {duplicate_free: true, survives: [publisher_restart, subscriber_restart]}"
    (files / file).write_text((PAIR % "reliable").removesuffix("}}\n") + f", {needs}}}}}\n")
    done = cqos("prove", file, *ENDS)
    lines = [line.strip() for line in done.out.splitlines()]
    assert [line for line in lines if line.startswith("on Cyclone")] == [
        "on Cyclone DDS 11.0.1 with publisher_restart=1s, C-QoS says compatible",
        "on Cyclone DDS 11.0.1 with subscriber_restart=1s, C-QoS says compatible",
    ]
    assert {"publisher   killed", "subscriber  killed"} <= {line.partition(" s  ")[2] for line in lines}


def test_a_fix_is_applied_to_a_copy_of_the_file_and_read_back(pair, files):
    where = context()
    system = named(read(pair("best_effort")), where)
    texts: list[dict[str, bytes]] = []

    def again(new):
        texts.append(dict(new))
        return read(next(iter(new.values())), importer="yaml")

    done = fixed(prepare(system, *ENDS, where), where, again=again)
    assert done is not None
    found, fixes = done
    assert (found.report.verdict, len(fixes)) == ("compatible", 1)
    assert [text.decode() for each in texts for text in each.values()] == [PAIR % "reliable"]
    assert (files / "pair.yaml").read_text(encoding="utf-8") == PAIR % "best_effort"


def test_a_run_claims_the_guarantees_under_its_fault():
    cells = (GuaranteeCell("link", "3"), GuaranteeCell("subscriber_restart", "2"), GuaranteeCell("link_outage", "none"))
    report = PairReport(Verdict.COMPATIBLE, guarantees=(Guarantee("late_join", "3", cells=cells),))
    faults = (None, Fault("slow_reader", 1), Fault("subscriber_restart", 1), Fault("link_outage", 1))
    assert [claims(report, fault).get("late_join") for fault in faults] == ["3", "3", "2", None]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("DDS102",), "there is no finding DDS102 about a pair here\nhelp: the findings about pairs are DDS101"),
        (("robot/publisher/scam", ENDS[1]), "there is no endpoint `robot/publisher/scam`\nhelp: did you mean"),
        (("a", "b", "c"), "`a`, `b`, `c` are no paths"),
        (("--fault", "link_outag=1s"), "there is no fault `link_outag`\nhelp: did you mean `link_outage`?"),
        (("--fault", "link_outage=often"), "link_outage:"),
        (("--on", "mosquitto"), "DDS has no `mosquitto` to run pairs on; it has cyclonedds, fastdds"),
        (("--fault", "broker_stop=1s"), "Cyclone DDS has no broker_stop; it runs link_outage, "),
        (("--option", "dds.implementation=connext"), "`--on` cyclonedds or fastdds runs it there"),
    ],
)
def test_a_run_that_cannot_start_names_the_reason(cqos, pair, arguments, said):
    done = cqos("prove", pair("best_effort"), *arguments)
    assert done.code == 2
    assert " ".join(said.split()) in " ".join(done.err.split())


def test_without_errors_nothing_runs(cqos, pair):
    done = cqos("prove", pair("reliable"))
    assert (done.code, done.out) == (0, "")
    assert "no pair has an error; name a publisher and a subscriber to run them" in done.err


def test_samples_are_sent_at_the_period_of_the_topic(cqos, files):
    """A reader of depth 3 that takes every 500 ms loses nothing of a sample each second, and all but 3 of 20 at once."""
    facts = "topics: {scan: {period: 1s, keyed: false}}\noptions: {dds: {round_trip_time: 5ms}}\n"
    text = PAIR.replace("history: keep_all", "history.depth: 3").replace("3}}\n", "3, taken_every: 500ms}}\n")
    (files / "pair.yaml").write_text(facts + text % "reliable", encoding="utf-8")
    done = cqos("prove", "pair.yaml", *ENDS)
    assert (done.code, done.err) == (0, "")
    assert "3 sent, 3 arrived" in done.out


def test_an_outage_is_filled_with_samples(cqos, pair, files):
    file = pair("reliable")
    (files / file).write_text("topics: {scan: {period: 10ms}}\n" + PAIR % "reliable", encoding="utf-8")
    done = cqos("prove", file, *ENDS, "--fault", "link_outage=500ms")
    assert done.code == 0
    assert "sent 6 to 55" in done.out
    assert "70 sent, 70 arrived" in done.out


def test_text_and_json_go_where_they_are_sent(cqos, pair, files):
    name = pair("reliable")
    shown = cqos("prove", name, *ENDS, "--color", "always")
    assert "\x1b" in shown.out
    to_files = ("--format", "text", "--output", "runs.txt", "--format", "json", "--output", "runs.json")
    assert cqos("prove", name, *ENDS, *to_files) == (0, "", "")
    assert (files / "runs.txt").read_text(encoding="utf-8").splitlines()[-1] == "1 run: all as C-QoS says"
    assert json.loads((files / "runs.json").read_text(encoding="utf-8"))["version"] == 1
    assert cqos("prove", name, "--format", "text", "--format", "json").code == 2
