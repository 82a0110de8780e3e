"""``--baseline`` and ``--write-baseline``."""

import json

TWO_MORE = """
  viewer:
    subscribes:
      scan: {reliability: reliable}
"""


def test_what_is_written_is_known_and_what_is_new_is_not(cqos, files):
    written = cqos("check", "clashes.yaml", "--write-baseline", "known.json")
    assert written.code == 0
    assert "error[ROS101]" in written.out
    assert written.err == "note: the findings are written to known.json; from now on use --baseline known.json\n"
    again = cqos("check", "clashes.yaml", "--baseline", "known.json")
    assert (again.code, again.err) == (0, "")
    assert "error[ROS101]" not in again.out
    assert "1 accepted" in again.out
    text = (files / "clashes.yaml").read_text()
    (files / "clashes.yaml").write_text("# moved\n\n" + text + TWO_MORE)
    assert cqos("check", "clashes.yaml", "--baseline", "known.json").code == 1


def test_a_baseline_can_be_written_over_itself(cqos, files):
    assert cqos("check", "clashes.yaml", "--write-baseline", "k.json", "--baseline", "k.json").code == 0
    before = (files / "k.json").read_text()
    assert cqos("check", "clashes.yaml", "--write-baseline", "k.json", "--baseline", "k.json").code == 0
    assert (files / "k.json").read_text() == before


def test_known_findings_are_in_the_json_report_with_the_reason(cqos):
    cqos("check", "clashes.yaml", "--write-baseline", "known.json")
    report = json.loads(cqos("check", "clashes.yaml", "--baseline", "known.json", "--format", "json").out)
    assert report["counts"]["accepted"] == 1
    assert [finding["accepted"] for finding in report["findings"] if finding["code"] == "ROS101"] == [
        "known: it is in the baseline known.json"
    ]


def test_entries_found_no_more_are_counted(cqos, files):
    cqos("check", "clashes.yaml", "--write-baseline", "known.json")
    (files / "clashes.yaml").write_text((files / "fits.yaml").read_text())
    done = cqos("check", "clashes.yaml", "--baseline", "known.json")
    assert done.code == 0
    assert done.err == "note: 1 entry of known.json found no more; write it anew with --write-baseline\n"


def test_one_system_does_not_hide_behind_the_entry_of_another(cqos, files):
    folder = files / "designs"
    folder.mkdir()
    (folder / "one.yaml").write_text((files / "clashes.yaml").read_text())
    (folder / "two.yaml").write_text((files / "fits.yaml").read_text())
    assert cqos("check", "designs", "--write-baseline", "known.json").code == 0
    assert cqos("check", "designs", "--baseline", "known.json").code == 0
    assert cqos("check", "designs/one.yaml", "--baseline", "known.json").code == 0
    (folder / "two.yaml").write_text((files / "clashes.yaml").read_text())
    assert cqos("check", "designs", "--baseline", "known.json").code == 1


def test_no_baseline_is_written_of_what_cannot_be_read(cqos, files):
    done = cqos("check", "clashes.yaml", "broken.yaml", "--write-baseline", "known.json")
    assert done.code == 2
    assert "error: known.json is not written: " in done.err
    assert not (files / "known.json").exists()


def test_a_file_that_is_no_baseline(cqos):
    done = cqos("check", "clashes.yaml", "--baseline", "fits.yaml")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("error[CQ606] fits.yaml: this is no baseline of C-QoS: it is no JSON")
