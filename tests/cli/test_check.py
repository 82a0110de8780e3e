"""``cqos check``: what is a system, what counts, what goes where."""

import json
import os
import re
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FITS, CLASHES = (Path(__file__).with_name("cases").joinpath(name).read_text() for name in ("fits.yaml", "clashes.yaml"))

# --- the examples that everybody tries first ---


def test_the_paper_s_system_fits(cqos):
    done = cqos("check", EXAMPLES / "smart_agriculture.bpmn")
    assert done.code == 0
    assert "compatible: 2 topics, 2 pairs judged" in done.out
    assert "error" not in done.out
    assert done.err == ""


def test_the_paper_s_incompatibility_is_two_errors(cqos):
    done = cqos("check", EXAMPLES / "smart_agriculture_incompatible.bpmn", "--format", "json")
    report = json.loads(done.out)
    errors = [finding for finding in report["findings"] if finding["severity"] == "error"]
    assert done.code == 1
    assert [finding["code"] for finding in errors] == ["ROS101", "ROS104"]
    assert all(finding["place"]["line"] and finding["remedies"] for finding in errors)


# --- exit codes ---


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["fits.yaml"], 0),
        (["clashes.yaml"], 1),
        (["lonely.yaml"], 0),
        (["lonely.yaml", "--fail-on", "warning"], 1),
        (["unmatched.yaml"], 1),
        (["unmatched.yaml", "fits.yaml", "--each"], 0),
        (["unmatched.yaml", "--ignore", "CQ404"], 0),
        (["clashes.yaml", "--select", "CQ"], 0),
        (["clashes.yaml", "--select", "ROS1,CQ"], 1),
        (["clashes.yaml", "--ignore", "ros", "--ignore", "CQ"], 0),
        (["clashes.yaml", "--select", "MQTT155,CQ"], 0),
        (["clashes.yaml", "--select", "nonsense"], 2),
        (["snapshot.txt"], 0),
        (["snapshot.txt", "--require-pairs"], 1),
        (["fits.yaml", "--require-pairs"], 0),
        (["nothing.yaml"], 2),
        (["broken.yaml"], 2),
        (["foreign.yaml"], 2),
        (["missing.yaml"], 2),
        (["clashes.yaml", "broken.yaml"], 2),
        (["--each", "clashes.yaml", "nothing.yaml"], 2),
        (["fits.yaml", "--protocol", "nonsense"], 2),
        ([], 2),
        (["fits.yaml", "--each", "--together"], 2),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_exit_code(cqos, arguments, code):
    done = cqos("check", *arguments)
    assert done.code == code
    assert "Traceback" not in done.err


def test_an_internal_error_is_one_sentence_and_how_to_report_it(cqos, monkeypatch):
    def fail(*_):
        raise ZeroDivisionError("the answer")

    monkeypatch.setattr("cqos_core.cli.check.check_system", fail)
    done = cqos("check", "fits.yaml")
    assert done.code == 3
    assert done.out == ""
    assert done.err.startswith("error: internal error: ZeroDivisionError: the answer\nhelp: ")
    assert "Traceback" not in done.err
    for asking in (["--debug", "check", "fits.yaml"], ["check", "fits.yaml", "--debug"]):
        assert "Traceback (most recent call last)" in cqos(*asking).err
    monkeypatch.setenv("CQOS_DEBUG", "1")
    assert "Traceback (most recent call last)" in cqos("check", "fits.yaml").err


def test_control_c_ends_quietly(cqos, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("cqos_core.cli.check.check_system", interrupt)
    done = cqos("check", "fits.yaml")
    assert (done.code, done.out) == (130, "")
    assert "Traceback" not in done.err


# --- streams ---


def test_findings_go_to_standard_output_and_problems_to_standard_error(cqos):
    done = cqos("check", "clashes.yaml", "broken.yaml", "missing.yaml")
    assert done.code == 2
    assert "error[ROS101]" in done.out
    assert "broken.yaml" not in done.out
    assert "error[CQ001] broken.yaml:" in done.err
    assert "error[CQ001] missing.yaml: cannot be read: No such file or directory" in done.err


def test_an_unrecognised_format_is_an_error_with_help(cqos, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    done = cqos("check", "foreign.yaml")
    assert (done.code, done.out) == (2, "")
    assert done.err == (
        "error[CQ003] foreign.yaml: no installed importer recognises this format\n"
        "  help: a system file begins with `cqos: 1`; `cqos packs` lists the formats\n"
        "        that are read, and --from chooses one\n"
    )


def test_an_empty_file_is_reported_as_empty(cqos, files):
    (files / "blank.yaml").write_text("\n \n")
    done = cqos("check", "blank.yaml")
    assert (done.code, done.err.partition("\n")[0]) == (2, "error[CQ003] blank.yaml: the file is empty")
    assert "a system file begins with `cqos: 1` and `protocol: …`" in done.err


def test_a_system_without_endpoints_is_never_green(cqos):
    done = cqos("check", "nothing.yaml")
    assert done.code == 2
    assert done.err == (
        "error: nothing.yaml: there is no endpoint in it, so nothing was checked\n"
        "help: write `participants: {NAME: {publishes: {TOPIC: }}, OTHER: {subscribes: {TOPIC: }}}`\n"
    )


def test_a_system_without_any_checked_endpoint_is_never_green(cqos, files):
    (files / "alien.yaml").write_text(FITS.replace("ros2", "smoke_signals"))
    done = cqos("check", "alien.yaml")
    assert done.code == 2
    assert "CQ201" in done.out
    assert done.err == "error: alien.yaml: none of its 2 endpoints could be checked, see the findings\n"


def test_quiet_prints_errors_only(cqos):
    assert cqos("check", ".", "--quiet", "--each").out == ""
    done = cqos("check", "clashes.yaml", "broken.yaml", "-q", "--format", "json", "--output", "report.json")
    assert done.out == ""
    assert done.err.startswith("error[CQ001] broken.yaml:")
    assert json.loads(Path("report.json").read_text())["counts"]["errors"] >= 1


def test_quiet_still_tells_the_rest_by_the_exit_code(cqos):
    done = cqos("check", "clashes.yaml", "-q")
    assert done == (1, "", "")


# --- what is one system ---


def test_files_named_together_are_one_system(cqos, files):
    lines = FITS.splitlines(keepends=True)
    (files / "one.yaml").write_text("".join([*lines[:3], lines[3]]))
    (files / "other.yaml").write_text("".join([*lines[:3], lines[4]]))
    together = json.loads(cqos("check", "one.yaml", "other.yaml", "--format", "json").out)
    assert (together["verdict"], together["counts"]["pairs"]) == ("compatible", 1)
    apart = json.loads(cqos("check", "--each", "one.yaml", "other.yaml", "--format", "json").out)
    assert (apart["verdict"], apart["counts"]["pairs"]) == ("unknown", 0)


def test_a_file_named_twice_is_read_once(cqos, files):
    done = cqos("check", "fits.yaml", files / "fits.yaml", "--format", "json")
    assert json.loads(done.out)["counts"]["endpoints"] == 2


def test_files_in_a_directory_are_systems_of_their_own(cqos, files):
    folder = files / "designs" / "deep"
    folder.mkdir(parents=True)
    (folder / "fits.yaml").write_text(FITS)
    (folder.parent / "clashes.yaml").write_text(CLASHES)
    (folder / "foreign.yaml").write_text("a: 1\n")
    (folder / "readme.txt").write_text("hello\n")
    (folder / ".hidden.yaml").write_text("cqos: 1\n")
    (files / "designs" / ".git").mkdir()
    (files / "designs" / ".git" / "x.yaml").write_text(CLASHES)
    done = cqos("check", "designs", "--format", "concise")
    assert done.code == 1
    assert [line.rpartition(": incompatible: ")[0] for line in done.out.splitlines() if ": incompatible:" in line]
    assert "designs/deep/fits.yaml: compatible: 1 topic, 1 pair judged, no findings\n" in done.out
    assert done.err == "note: 2 files of other formats skipped\n"
    whole = json.loads(cqos("check", "designs", "--together", "--format", "json").out)
    assert whole["counts"]["topics"] == 1
    assert whole["counts"]["pairs"] == 4


def test_diagrams_without_signals_are_passed_over_in_a_directory_only(cqos, files):
    folder = files / "designs"
    folder.mkdir()
    (folder / "nothing.yaml").write_text((files / "nothing.yaml").read_text())
    alone = cqos("check", "designs")
    assert alone.code == 2
    assert "error: designs: nothing there could be checked, no endpoint was found" in alone.err
    (folder / "fits.yaml").write_text(FITS)
    both = cqos("check", "designs")
    assert both.code == 0
    assert "nothing.yaml" not in both.out
    assert both.err == "note: 1 file without any endpoint passed over\n"
    assert cqos("check", "designs/nothing.yaml").code == 2


def test_an_empty_directory_is_not_green(cqos, files):
    (files / "empty").mkdir()
    done = cqos("check", "empty")
    assert (done.code, done.out) == (2, "")
    assert "nothing there could be checked" in done.err


@pytest.mark.parametrize(
    "arguments",
    [
        ["designs"],
        ["--together", "designs"],
        ["designs/main.yaml", "designs/parts.yaml"],
        ["--each", "designs/parts.yaml", "designs/main.yaml"],
    ],
    ids=" ".join,
)
def test_a_file_that_another_one_includes_is_checked_as_part_of_that(cqos, files, arguments):
    folder = files / "designs"
    folder.mkdir()
    (folder / "main.yaml").write_text(FITS + "instances: {n: [1, 2]}\ninclude: parts.yaml\n")
    # By itself it would be refused: it says nowhere what `n` is.
    (folder / "parts.yaml").write_text("cqos: 1\nparticipants:\n  'rviz_${n}': {subscribes: {scan: default}}\n")
    done = cqos("check", *arguments, "--format", "json")
    assert (done.code, json.loads(done.out)["counts"]["endpoints"]) == (0, 4)
    assert "designs/parts.yaml is checked as part of designs/main.yaml, which includes it" in done.err


def test_a_note_counts_the_files_that_are_parts_of_others(cqos, files):
    (files / "library.yaml").write_text("cqos: 1\nprofiles: {sensors: {reliability: best_effort}}\n")
    (files / "main.yaml").write_text("cqos: 1\ninclude: [fits.yaml, library.yaml]\n")
    done = cqos("check", "main.yaml", "fits.yaml", "library.yaml")
    assert done.code == 0
    assert "note: 2 files are checked as parts of others, which include them" in done.err


def test_a_mistake_in_a_part_is_reported_once(cqos, files):
    (files / "main.yaml").write_text(FITS + "include: parts.yaml\n")
    (files / "parts.yaml").write_text("cqos: 1\nparticipant: {}\n")
    done = cqos("check", "main.yaml", "parts.yaml")
    assert (done.code, done.err.count("parts.yaml:2:1")) == (2, 1)


def test_files_that_include_each_other_are_wrong_and_no_parts(cqos, files):
    for one, other in (("a.yaml", "b.yaml"), ("b.yaml", "a.yaml")):
        (files / one).write_text(FITS + f"include: {other}\n")
    done = cqos("check", "a.yaml", "b.yaml")
    assert (done.code, "CQ008" in done.err, "as part of" in done.err) == (2, True, False)


def test_profiles_alone_are_for_the_files_beside_them(cqos, files):
    (files / "library.yaml").write_text("cqos: 1\nprofiles: {sensors: {reliability: best_effort}}\n")
    assert cqos("check", "--each", "fits.yaml", "library.yaml").code == 0
    assert cqos("check", "fits.yaml", "library.yaml").code == 0
    assert cqos("check", "library.yaml").code == 2


def test_broken_files_of_a_directory_do_not_stop_the_others(cqos, files):
    done = cqos("check", files, "--format", "json")
    report = json.loads(done.out)
    assert done.code == 2
    assert report["verdict"] == "incompatible"
    assert [finding["code"] for finding in report["findings"] if "broken.yaml" in str(finding["place"])]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_in_a_directory_is_not_waited_for(cqos, files):
    os.mkfifo(files / "pipe.yaml")
    assert cqos("check", files).code == 2


# --- standard input ---


def test_standard_input(cqos):
    done = cqos("check", "-", "--format", "concise", stdin=CLASHES)
    assert done.code == 1
    assert done.out.startswith("<stdin>:")


def test_standard_input_has_the_name_it_is_given(cqos, files):
    (files / "parts.yaml").write_text("cqos: 1\nparticipants:\n  rviz: {subscribes: {scan: default}}\n")
    text = FITS + "include: parts.yaml\n"
    done = cqos("check", "-", "--stdin-name", "main.yaml", "--format", "json", stdin=text)
    assert json.loads(done.out)["counts"]["endpoints"] == 3
    unnamed = cqos("check", "-", stdin=text)
    assert unnamed.code == 2
    assert "CQ007" in unnamed.err


def test_standard_input_and_a_file_are_one_system(cqos):
    done = cqos(
        "check", "fits.yaml", "-", "--format", "json", stdin=FITS.replace("lidar", "radar").replace("planner", "map")
    )
    assert json.loads(done.out)["counts"]["pairs"] == 4


def test_empty_standard_input_is_an_error(cqos):
    done = cqos("check", "-", stdin="")
    assert done.code == 2
    assert "<stdin>" in done.err


# --- assumptions ---


def test_an_option_of_the_command_line_wins_over_the_file(cqos, files):
    text = CLASHES.replace(
        "protocol: ros2", "protocol: ros2\noptions: {ros2: {RMW_IMPLEMENTATION: rmw_cyclonedds_cpp}}"
    )
    (files / "system.yaml").write_text(text)
    assert cqos("check", "system.yaml").code == 1
    done = cqos("check", "system.yaml", "--option", "ros2.rmw=zenoh", "--format", "json")
    assert done.code == 0
    assert "CQ209" not in done.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["--option", "rmw=zenoh"],
            "`rmw=zenoh` is not of the form PACK.NAME=VALUE\nhelp: for instance ros2.rmw=cyclonedds",
        ),
        (["--select", "ros1O1"], "no rule has the code or name `ros1O1`\nhelp: did you mean `ROS101`?"),
        (["--option", "rso2.rmw=zenoh"], "there is no rule pack `rso2`\nhelp: did you mean `ros2`?"),
        (["--option", "ros2.rnw=zenoh"], "has no option `rnw`\nhelp: did you mean `rmw`?"),
        (
            ["--option", "ros2.rmw=cyclonedss"],
            "is not one of its values\nhelp: did you mean `cyclonedds`? expected cyclonedds, ",
        ),
        (["--option", "ros2.rmw=foo"], "ros2.rmw: `foo` is not one of its values\nhelp: expected cyclonedds, fastdds"),
        (["--switch", "bpnm.x=1"], "there is no importer `bpnm`\nhelp: did you mean `bpmn`?"),
        (["--format", "sarfi"], "there is no format `sarfi`\nhelp: did you mean `sarif`?"),
        (["--from", "yml"], "there is no importer `yml`\nhelp: did you mean `yaml`?"),
        (["--protocol", "ros"], "there is no rule pack `ros`\nhelp: did you mean `ros2`?"),
        (["--fail-on", "note"], "'error', 'warning'"),
        (["--config", "missing.toml"], "missing.toml"),
        (["--config", "x.toml", "--no-config"], "--config and --no-config exclude each other"),
        (["--baseline", "missing.json"], "missing.json: cannot be read: No such file"),
        (["--pack", "missing.yaml"], "missing.yaml: cannot be read: No such file"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_wrong_value_is_refused_with_what_is_allowed(cqos, arguments, said):
    done = cqos("check", "fits.yaml", *arguments)
    assert (done.code, done.out) == (2, "")
    assert said in done.err


def test_a_protocol_is_for_files_that_state_none(cqos, files):
    (files / "bare.yaml").write_text(CLASHES.replace("protocol: ros2\n", ""))
    assert cqos("check", "bare.yaml", "--protocol", "ros2").code == 1
    (files / "alien.yaml").write_text(CLASHES.replace("ros2", "smoke_signals"))
    assert "smoke_signals" in cqos("check", "alien.yaml", "--protocol", "ros2").out


def test_a_pack_written_as_yaml(cqos):
    pack, system = EXAMPLES / "opcua" / "opcua_pack.yaml", EXAMPLES / "opcua" / "press_line.yaml"
    assert cqos("check", system).code == 2
    assert "OPC101" in cqos("check", system, "--pack", pack).out


def test_message_flows_are_read_on_request(cqos):
    file = EXAMPLES.parent / "tests" / "importers" / "cases" / "bpmn" / "message_flows.bpmn"
    without, read = (
        json.loads(cqos("check", file, "--format", "json", *more).out)["counts"]["endpoints"]
        for more in ([], ["--switch", "bpmn.message_flows=true"])
    )
    assert without < read


def test_a_finding_of_several_rules_counts_until_all_are_ignored(cqos):
    Path("outage.yaml").write_text(
        "cqos: 1\nprotocol: dds\ntopics: {t: {period: 1s, size: 8, keyed: false, external: true}}\nparticipants:\n"
        "  p: {publishes: {t: {history: keep_all, reliability.max_blocking_time: infinite}}}\n"
        "  s: {subscribes: {t: {reliability: reliable, history: keep_all, needs: {loss_free: true, ordered: true,"
        " survives: [link_outage]}}}}\n",
        encoding="utf-8",
    )

    def codes(*options):
        done = cqos("check", "outage.yaml", "--format", "json", *options)
        return [(each["code"], each["more_codes"]) for each in json.loads(done.out)["findings"]]

    ((first, more),) = codes("--select", "DDS54")
    assert more
    for one in (first, *more):
        assert codes("--select", one) == codes("--select", "DDS54", "--ignore", one) == [(first, more)]
    assert codes("--select", "DDS54", "--ignore", ",".join((first, *more))) == []


def test_two_importers_that_claim_one_file_are_both_named(cqos, monkeypatch):
    monkeypatch.setattr("cqos_core.importers.format_detection.claims_bpmn", lambda *_: True)
    done = cqos("check", "fits.yaml")
    assert done.code == 2
    assert "two importers claim this file: `bpmn` (cqos-core " in done.err
    assert "and `yaml` (cqos-core " in done.err
    assert "choose one with --from" in done.err
    assert cqos("check", "fits.yaml", "--from", "yaml").code == 0


# --- formats and outputs ---


def test_several_formats_each_with_its_file(cqos, files):
    done = cqos(
        *("check", "clashes.yaml", "--format", "concise", "--format", "json", "--output", "a.json"),
        *("--format", "sarif", "--output", "b.sarif"),
    )
    assert done.code == 1
    assert "error[ROS101]" in done.out
    assert json.loads((files / "a.json").read_text())["verdict"] == "incompatible"
    assert json.loads((files / "b.sarif").read_text())["version"] == "2.1.0"


def test_statistics_count_the_findings_of_each_rule(cqos, files):
    done = cqos("check", "clashes.yaml", "--format", "statistics")
    assert (done.code, done.out.splitlines()[0]) == (1, "1  error    ROS101  reliability-weaker-than-requested")
    beside = cqos("check", "clashes.yaml", "--format", "statistics", "--format", "json", "--output", "a.json")
    assert beside.out == done.out
    assert json.loads((files / "a.json").read_text())["verdict"] == "incompatible"
    assert cqos("check", "clashes.yaml", "--format", "statistics", "--format", "full").code == 2


@pytest.mark.parametrize(
    "arguments",
    [
        ["--output", "a.json", "--format", "json"],
        ["--output=a.json", "--format=json"],
        ["--format", "full", "--format", "json", "--output", "a.json"],
        ["--output", "a.json", "--format", "json", "--output", "b.txt", "--format", "concise"],
    ],
    ids=" ".join,
)
def test_an_output_finds_its_format(cqos, files, arguments):
    cqos("check", "fits.yaml", *arguments)
    assert json.loads((files / "a.json").read_text())["verdict"] == "compatible"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--format", "json", "--format", "sarif"], "json and sarif would both go to standard output"),
        (["--format", "json", "--output", "x", "--format", "full", "--output", "./x"], "would both go to `./x`"),
        (["--format", "json", "--output", "a", "--output", "b"], "`b` has no format of its own"),
        (["--output", "fits.yaml"], "`fits.yaml` is an input and would be overwritten"),
        (["--write-baseline", "fits.yaml"], "`fits.yaml` is an input and would be overwritten"),
        (["--output", "."], "`.` is a folder\nhelp: name a file in it"),
        (["--output", "no/such/report.txt"], "there is no folder `no/such` to write `no/such/report.txt` into"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_senseless_output_is_refused(cqos, files, arguments, said):
    before = (files / "fits.yaml").read_bytes()
    done = cqos("check", "fits.yaml", *arguments)
    assert (done.code, done.out) == (2, "")
    assert said in done.err
    assert (files / "fits.yaml").read_bytes() == before


def test_a_program_gets_one_report_of_everything(cqos):
    done = cqos("check", "--each", "fits.yaml", "clashes.yaml", "broken.yaml", "--format", "json")
    report = json.loads(done.out)
    assert report["verdict"] == "incompatible"
    assert report["sources"] == ["fits.yaml", "clashes.yaml", "broken.yaml"]
    assert report["counts"]["pairs"] == 2
    assert {"ROS101", "CQ001"} <= {finding["code"] for finding in report["findings"]}
    for form in ("sarif", "junit", "github", "jsonl", "gitlab", "rdjson", "markdown"):
        assert "broken.yaml" in cqos("check", "fits.yaml", "broken.yaml", "--format", form).out


def test_a_report_of_what_could_not_be_read_is_not_compatible(cqos):
    done = cqos("check", "--each", "fits.yaml", "broken.yaml", "--format", "json")
    assert json.loads(done.out)["verdict"] == "unknown"
    nothing = cqos("check", "broken.yaml", "--format", "json")
    assert json.loads(nothing.out)["counts"]["endpoints"] == 0


def test_notes_are_shown_on_request(cqos):
    file = EXAMPLES / "smart_agriculture.bpmn"
    assert "note[" not in cqos("check", file).out
    assert "note[" in cqos("check", file, "--show", "notes").out


# --- hostile arguments ---


@pytest.mark.parametrize(
    "path",
    ["x" * 5000, "a/" * 3000, "\x1b[31mred", "new\nline", "*", "~", "/dev/null/x", "\udcff.yaml"],
    ids=["long", "deep", "escape", "newline", "star", "home", "under a device", "surrogate"],
)
def test_a_strange_path_is_one_clear_problem(cqos, path):
    done = cqos("check", path)
    assert done.code == 2
    assert done.out == ""
    assert done.err.startswith("error[CQ001] ")
    assert "\x1b" not in done.err
    assert len(done.err.splitlines()) <= 2


def test_many_paths(cqos, files):
    names = []
    for number in range(300):
        names.append(f"p{number}.yaml")
        (files / names[-1]).write_text(
            f"cqos: 1\nprotocol: ros2\nparticipants: {{p{number}: {{publishes: {{t: default}}}}}}\n"
        )
    report = json.loads(cqos("check", *names, "--format", "json").out)
    assert report["counts"]["endpoints"] == 300


def test_options_may_stand_anywhere_and_paths_may_begin_with_a_dash(cqos, files):
    (files / "-x.yaml").write_text(FITS)
    assert cqos("check", "--format", "json", "--", "-x.yaml").code == 0
    assert cqos("check", "--no-config", "fits.yaml", "--format=json").code == 0


def test_equal_topics_of_several_files_are_tests_of_their_own(cqos, files):
    """A topic that fits in one file must not hide one of that name that does not fit in another."""
    (files / "parts").mkdir()
    for name in ("fits", "clashes", "broken"):
        (files / "parts" / f"{name}.yaml").write_text((files / f"{name}.yaml").read_text())
    done = cqos("check", "parts", "--format", "junit")
    assert done.code == 2
    suites = re.findall(r'<testsuite name="([^"]+)" tests="(\d+)" failures="(\d+)"', done.out)
    assert [(name, failures) for name, _, failures in suites] == [
        ("parts/broken.yaml", "1"),
        ("parts/clashes.yaml", "1"),
        ("parts/fits.yaml", "0"),
    ]


def test_advice_of_a_code_is_help_and_its_reason_is_why(cqos, files):
    (files / "alone.yaml").write_text("cqos: 1\nprotocol: ros2\nparticipants: {a: {subscribes: {/t: {}}}}\n")
    done = cqos("check", "alone.yaml", "--format", "full")
    finding = done.out[done.out.index("warning[CQ401]") :]
    finding = " ".join(finding[: finding.index("see:")].split())
    assert finding.endswith(
        "help: mark the topic or participant `external: true` if its publisher is elsewhere "
        "why: It will never receive anything."
    )
    (found,) = (
        each
        for each in json.loads(cqos("check", "alone.yaml", "--format", "json").out)["findings"]
        if each["code"] == "CQ401"
    )
    assert (found["because"], found["help"]) == (
        "It will never receive anything.",
        "mark the topic or participant `external: true` if its publisher is elsewhere",
    )
    said = cqos("rule", "CQ401").out
    assert said.index("Why\n") < said.index("What to do\n") < said.index("Mark the topic")


# --- wholes and parts ---

DESIGN = "cqos: 1\nprotocol: ros2\nparticipants:\n  nav: {subscribes: {map: {durability: transient_local}}}\n"


@pytest.fixture
def robot(files):
    """A folder with a whole system and a folder with nothing but a part, which fit together."""
    for file in files.iterdir():
        if file.name != "snapshot.txt":
            file.unlink()
    (files / "design").mkdir()
    (files / "design" / "system.yaml").write_text(DESIGN)
    (files / "seen").mkdir()
    (files / "snapshot.txt").rename(files / "seen" / "map_server.txt")
    return files


def test_a_part_alone_is_one_line(cqos):
    done = cqos("check", "snapshot.txt")
    assert "warning" not in done.out
    assert "snapshot.txt: part of a system: 1 endpoint read, 1 without partner in it; name the files " in done.out
    report = json.loads(cqos("check", "snapshot.txt", "--format", "json").out)
    assert (report["partial"], report["counts"]["unmatched"]) == (True, 1)


@pytest.mark.parametrize(
    "paths",
    [
        ["design/system.yaml", "seen"],
        ["design", "seen"],
        ["design", "seen/map_server.txt"],
        ["design/system.yaml", "seen/map_server.txt"],
        [".", "--together"],
    ],
    ids=" ".join,
)
def test_named_paths_are_one_system_whatever_they_are(cqos, robot, paths):
    done = cqos("check", *paths)
    assert done.code == 0
    assert "1 pair judged" in done.out.splitlines()[-1]


def test_in_a_folder_whole_systems_stand_alone_and_parts_are_put_together(cqos, robot):
    (robot / "design" / "other.yaml").write_text(DESIGN.replace("nav", "nav2"))
    (robot / "seen" / "again.txt").write_text((robot / "seen" / "map_server.txt").read_text())
    done = cqos("check", ".", "--format", "json")
    report = json.loads(done.out)
    assert done.code == 1
    assert report["counts"]["pairs"] == 0
    assert "checked 2 whole systems, one by one, and 2 parts of systems, put together" in done.err
    assert "error: no pair was compared" in done.err
    assert cqos("check", "--each", "seen").out.splitlines()[-1].startswith("total: 2 systems: 2 unknown")


def test_what_cannot_be_seen_is_counted_once_and_the_total_is_the_last_line(cqos, files):
    for number in range(3):
        (files / f"fits{number}.yaml").write_text(FITS)
    done = cqos("check", "--each", "fits0.yaml", "fits1.yaml", "fits2.yaml")
    assert "not checked: " not in done.out
    assert done.out.splitlines()[-1].startswith("total: 3 systems: 3 compatible: ")
    full = cqos("check", "--each", "fits0.yaml", "fits1.yaml", "fits2.yaml", "--format", "full")
    assert full.out.count("not checked: ") == 1
    listed = cqos("check", "fits0.yaml", "--show", "not-checked", "--show", "notes").out
    assert "listed with" not in listed
    assert "access control" in listed


def test_the_nearest_configuration_holds_for_each_system(cqos, files):
    for name, text in (("alpha", "[severities]\nROS101 = 'note'\n"), ("beta", "")):
        (files / "robots" / name).mkdir(parents=True)
        (files / "robots" / name / "system.yaml").write_text(CLASHES)
        (files / "robots" / name / "cqos.toml").write_text(text)
    report = json.loads(cqos("check", "robots", "--format", "json").out)
    severities = {f["place"]["source"]: f["severity"] for f in report["findings"] if f["code"] == "ROS101"}
    assert severities == {"robots/alpha/system.yaml": "note", "robots/beta/system.yaml": "error"}
    (files / "robots" / "beta" / "cqos.toml").write_text("nonsense")
    done = cqos("check", "robots")
    assert done.code == 2
    assert "robots/beta/cqos.toml: this is not TOML" in done.err


def test_files_can_be_excluded(cqos, files):
    (files / "designs" / "old").mkdir(parents=True)
    (files / "designs" / "old" / "clashes.yaml").write_text(CLASHES)
    (files / "designs" / "fits.yaml").write_text(FITS)
    assert cqos("check", "designs").code == 1
    assert cqos("check", "designs", "--exclude", "old/").code == 0
    (files / "cqos.toml").write_text("exclude = ['/designs/old']")
    done = cqos("check", "designs")
    assert done.code == 0
    assert "note: not searched: designs/old" in done.err


# --- what is shown ---


def test_concise_keeps_what_was_perhaps_meant(cqos, files):
    (files / "near.yaml").write_text(
        "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/x/odom: {}}}, b: {subscribes: {/odom: {}, /x/odom: {}}}}\n"
    )
    full = cqos("check", "near.yaml", "--format", "full").out
    concise = cqos("check", "near.yaml", "--format", "concise").out
    assert "help: did you mean `/x/odom`?" in full
    assert "; did you mean `/x/odom`?" in concise


def test_findings_of_rules_are_shown_by_their_codes(cqos):
    done = cqos("check", "clashes.yaml", "--show", "ros101")
    assert (done.code, done.out.count("error[ROS101]")) == (1, 1)
    none = cqos("check", "clashes.yaml", "--show", "ROS305")
    assert none.code == 1, "what is shown changes no verdict"
    assert "there is no finding of the rules that --show names" in none.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--show", "errrors"), "did you mean `errors`?"),
        (("--show", "durabil"), "nor the code or name of a rule"),
        (("--select", "durabil"), "no rule has the code or name `durabil`"),
        (("--show", "errors", "--show", "ROS101"), "severities or rules, not both"),
        (("--show", "errors,ROS101"), "severities or rules, not both"),
    ],
)
def test_what_cannot_be_shown_is_refused(cqos, arguments, said):
    done = cqos("check", "clashes.yaml", *arguments)
    assert done.code == 2
    assert said in " ".join(done.err.split())
