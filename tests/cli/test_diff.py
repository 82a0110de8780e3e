"""``cqos diff``: what two systems say differently."""

import json

import pytest

OLD = """\
cqos: 1
protocol: ros2
participants:
  lidar:
    publishes:
      /scan: {reliability: best_effort}
  planner:
    subscribes:
      /scan: {}
      /map: {}
"""


@pytest.fixture
def two(files):
    (files / "old.yaml").write_text(OLD)
    (files / "new.yaml").write_text(
        OLD.replace("best_effort", "reliable").replace("      /map: {}\n", "").replace("planner", "nav")
    )
    return "old.yaml", "new.yaml"


def test_text(forked, two):
    done = forked("diff", two[1], "--against", two[0], COLUMNS="200")
    assert (done.code, done.err) == (1, "")
    assert (
        done.out
        == """\
/map
  subscriber `planner/subscriber/map` is only in A (old.yaml:10:7)

/scan
  publisher `lidar/publisher/scan`
    reliability is best_effort in A (old.yaml:6:28) and reliable in B (new.yaml:6:28)

A is old.yaml, B is new.yaml: 2 differences; 2 endpoints in both, 1 of them known by topic only, because their participants \
have different names
"""
    )


def test_json(cqos, two):
    done = cqos("diff", two[1], "--against", two[0], "--format", "json")
    document = json.loads(done.out)
    assert done.code == 1
    assert {key: document[key] for key in ("version", "a", "b", "matched", "matched_by_topic", "not_compared")} == {
        "version": 1,
        "a": "old.yaml",
        "b": "new.yaml",
        "matched": 2,
        "matched_by_topic": 1,
        "not_compared": [],
    }
    (different,) = document["different"]
    assert (different["policy"], different["topic"], different["kind"]) == ("reliability", "/scan", "publisher")
    assert (different["a"]["value"], different["b"]["value"]) == ("best_effort", "reliable")
    assert different["a"]["value_place"]["column"] == 28
    (missing,) = document["missing"]
    assert (missing["only_in"], missing["endpoint"]["id"]) == ("a", "planner/subscriber/map")


def test_no_difference(cqos):
    done = cqos("diff", "fits.yaml", "--against", "fits.yaml")
    assert (done.code, done.out) == (0, "A is fits.yaml, B is fits.yaml: no difference; 2 endpoints in both\n")


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ((), 1),
        (("--fail-on", "never"), 0),
        (("--fail-on", "values"), 1),
        (("--fail-on", "endpoints"), 1),
        (("--topic", "/map"), 1),
        (("--topic", "/map", "--fail-on", "values"), 0),
        (("--exclude-topic", "/map", "--fail-on", "endpoints"), 0),
        (("--exclude-topic", "/map", "--exclude-topic", "scan"), 0),
        (("--fail-on", "often"), 2),
        (("--config", "missing.toml"), 2),
    ],
)
def test_what_counts(cqos, two, arguments, code):
    assert cqos("diff", two[1], "--against", two[0], *arguments).code == code


def test_a_folder_is_one_system(cqos, two, files):
    (files / "folder").mkdir()
    (files / two[0]).rename(files / "folder" / two[0])
    assert cqos("diff", two[1], "--against", "folder").code == 1


def test_several_paths_are_one_system(cqos, two, files):
    whole = (files / two[0]).read_text()
    (files / "a.yaml").write_text(whole[: whole.index("  planner")])
    (files / "b.yaml").write_text(whole[: whole.index("  lidar")] + whole[whole.index("  planner") :])
    done = cqos("diff", "a.yaml", "b.yaml", "--against", two[0])
    assert (done.code, done.out) == (0, "A is old.yaml, B is a.yaml b.yaml: no difference; 3 endpoints in both\n")


def test_standard_input(forked, two):
    assert forked("diff", two[1], "--against", "-", stdin=OLD).code == 1
    assert forked("diff", "-", "--against", two[0], stdin=OLD).code == 0
    assert forked("diff", "-", "--against", "-", stdin=OLD).code == 2


@pytest.mark.parametrize("bad", ["missing.yaml", "broken.yaml", "foreign.yaml"])
def test_what_cannot_be_read(cqos, bad):
    for pair in ((bad, "fits.yaml"), ("fits.yaml", bad)):
        done = cqos("diff", pair[0], "--against", pair[1])
        assert (done.code, done.out) == (2, "")
        assert bad in done.err


def test_nothing_to_compare(cqos, files):
    (files / "empty.yaml").write_text("cqos: 1\nparticipants: {a: {}}\n")
    done = cqos("diff", "empty.yaml", "--against", "fits.yaml")
    assert (done.code, done.out) == (2, "")
    assert "empty.yaml: there is no endpoint in it, so nothing was compared" in done.err
    (files / "nothing").mkdir()
    assert cqos("diff", "nothing", "--against", "fits.yaml").code == 2


def test_an_option_settles_what_depends(cqos, files):
    for name, value in (("a", "system_default"), ("b", "best_effort")):
        (files / f"{name}.yaml").write_text(
            f"cqos: 1\nprotocol: ros2\nparticipants: {{n: {{subscribes: {{/t: {{reliability: {value}}}}}}}}}\n"
        )
    assert cqos("diff", "b.yaml", "--against", "a.yaml").code == 0
    assert cqos("diff", "b.yaml", "--against", "a.yaml", "--option", "ros2.rmw=cyclonedds").code == 1
    assert cqos("diff", "b.yaml", "--against", "a.yaml", "--option", "ros2.rmw=fastdds").code == 0


def test_names_cannot_act_on_the_terminal(cqos, files):
    (files / "strange.yaml").write_text(OLD.replace("/map", '"/m\\ap"'), encoding="utf-8")
    done = cqos("diff", "strange.yaml", "--against", "fits.yaml")
    assert "\a" not in done.out
    assert "\\x07" in done.out
