"""``cqos test-pack``: the case files of a pack, without a program."""

import pytest

PACK = """\
cqos_pack: 1
id: horn
title: Horn
policies:
  beat: {kind: duration, default: 1s, roles: [publisher]}
  wait: {kind: duration, default: infinite, roles: [subscriber]}
rules:
  - {requires: offered(beat) <= requested(wait), code: HRN101, name: too-slow, because: it is late}
  - {gives: max_gap, what: offered(beat), code: HRN501, name: gap, because: one beat is the gap}
  - {gives: max_gap, survives: publisher_restart, code: HRN502, name: silent, because: a restart takes long}
unaffected:
  - {guarantee: max_gap, faults: [subscriber_restart], because: it listens again, clause: section 3}
"""
CASES = {
    "HRN101": """\
rule: HRN101
cases:
  - {name: in time, offered: {beat: 1s}, requested: {wait: 1s}, expect: ok}
  - {name: late, offered: {beat: 2s}, requested: {wait: 1s}, expect: error, verdict: incompatible}
""",
    "HRN501": """\
rule: HRN501
cases:
  - {name: enough, offered: {beat: 1s}, needs: {max_gap: 1s}, expect: ok, verdict: compatible}
  - {name: too few, offered: {beat: 2s}, needs: {max_gap: 1s}, expect: error}
  - {name: heard again, needs: {max_gap: 1s, survives: [subscriber_restart]}, expect: ok, verdict: compatible}
""",
    "HRN502": """\
rule: HRN502
cases:
  - {name: connected, needs: {max_gap: 1s}, expect: ok}
  - {name: gone, needs: {max_gap: 1s, survives: [publisher_restart]}, expect: error, verdict: incompatible}
""",
}


@pytest.fixture
def pack(tmp_path):
    (tmp_path / "cases").mkdir()
    for code, text in CASES.items():
        (tmp_path / "cases" / f"{code}.yml").write_text(text)
    file = tmp_path / "horn.yaml"
    file.write_text(PACK)
    return file


def test_cases_beside_a_pack_run(cqos, pack):
    done = cqos("test-pack", pack)
    assert (done.code, done.out) == (0, "7 cases: all as expected\n")


def test_guarantees_of_a_pack_in_yaml_are_explained_by_fault(cqos, pack, tmp_path):
    design = "cqos: 1\nprotocol: horn\nparticipants: {a: {publishes: {t: {}}}, b: {subscribes: {t: {}}}}\n"
    (tmp_path / "s.yaml").write_text(design)
    out = cqos(
        "explain", tmp_path / "s.yaml", "a/publisher/t", "b/subscriber/t", "--pack", pack, "--show", "guarantees"
    ).out
    (row,) = [line.split() for line in out.splitlines() if line.strip().startswith("max_gap")]
    assert row[:5] == ["max_gap", "1s", "unknown", "1s", "none"]


def test_what_differs_is_listed_and_ends_with_1(cqos, pack, tmp_path):
    (tmp_path / "cases" / "HRN101.yml").write_text(CASES["HRN101"].replace("expect: ok", "expect: error"))
    done = cqos("test-pack", pack)
    assert done.code == 1
    assert done.out.startswith("HRN101: in time (")
    assert "expected HRN101 to give error, it gave ok" in done.out
    assert done.out.endswith("no case where it is silent: HRN101\n7 cases: 1 not as expected\n")


def test_single_files_and_installed_packs(cqos, pack, tmp_path):
    done = cqos("test-pack", pack, tmp_path / "cases" / "HRN101.yml")
    assert done.out.splitlines()[-1] == "2 cases: all as expected"
    assert "no case where it reports: HRN501, HRN502" in done.out
    (tmp_path / "DDS101.yml").write_text(
        "rule: DDS101\ncases:\n  - {name: equal, offered: {}, requested: {}, expect: ok}\n"
    )
    assert cqos("test-pack", "dds", tmp_path / "DDS101.yml").out.endswith("1 case: all as expected\n")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("rule: [", "cannot be read"),
        ("rule: X\n", "is no case file"),
        ("rule: X\ncases: [a]\n", "is no case file"),
        ("rule: X\ncases: [{name: a, expect: ok, offerd: {}}]\n", "offerd"),
    ],
)
def test_a_file_that_is_no_case_file_is_named(cqos, pack, tmp_path, text, says):
    (tmp_path / "cases" / "HRN502.yml").write_text(text)
    done = cqos("test-pack", pack)
    assert done.code == 2
    assert "HRN502.yml" in done.err
    assert says in done.err


def test_a_pack_without_cases_says_where_they_are_expected(cqos, tmp_path):
    file = tmp_path / "horn.yaml"
    file.write_text(PACK)
    done = cqos("test-pack", file)
    assert done.code == 2
    assert "cases" in done.err


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("gives: max_gap, what", "gives: max_gaps, what", "`max_gap`"),
        ("survives: publisher_restart", "survives: rain", "`broker_crash`"),
        ("what: offered(beat)", "what: offered(drum)", "drum"),
        ("gives: max_gap, survives", "gives: max_gap, severity: note, survives", "has no `severity`"),
        ("name: too-slow", "name: too-slow, survives: link_outage", "only a rule with `gives` has `survives`"),
        ("guarantee: max_gap", "guarantee: gap", "`max_gap`"),
    ],
)
def test_faults_of_guarantees_in_yaml_have_places(cqos, pack, old, new, says):
    pack.write_text(PACK.replace(old, new))
    done = cqos("test-pack", pack)
    assert done.code == 2
    assert "horn.yaml:" in done.err
    assert says in done.err
