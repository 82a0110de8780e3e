"""``cqos breaking`` on a git history of ten changes, and how revisions are read."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

GIT = shutil.which("git") or ""
pytestmark = pytest.mark.skipif(not GIT and os.environ.get("CI") != "true", reason="git is missing")

BASE = """\
cqos: 1
protocol: ros2
profiles: {video: {reliability: best_effort}}
participants:
  station:
    subscribes:
      /odom: {reliability: reliable}
      /image: {profile: video}
    publishes:
      /cmd: {deadline: 500ms}
      /plan: {durability: transient_local}
  alpha:
    publishes: {/odom: {reliability: reliable}, /image: {profile: video}}
    subscribes: {/cmd: {deadline: 500ms}, /plan: }
  bravo:
    publishes: {/odom: {reliability: reliable}, /image: {profile: video}}
    subscribes: {/cmd: {deadline: 1s}}
"""
ALPHA = "  alpha:\n    publishes: {/odom: {"
# What each change does to the file, and the answer: exit code, breaks by ends and updates, order, participants changed.
HISTORY = [
    ("another name of a profile", [("video", "loose")], 0, [], [], []),
    ("a stronger offer", [("/cmd: {deadline: 500ms}\n", "/cmd: {deadline: 200ms}\n")], 0, [], [], ["station"]),
    (
        "a stronger request, and the offer for it",
        [("loose: {reliability: best_effort", "loose: {reliability: reliable")],
        1,
        [("alpha", "station", ["subscriber"], "ROS101"), ("bravo", "station", ["subscriber"], "ROS101")],
        [[["alpha"], ["bravo"]], [["station"]]],
        ["alpha", "bravo", "station"],
    ),
    (
        "a weaker offer, and the requests for it",
        [
            ("/cmd: {deadline: 200ms}\n", "/cmd: {deadline: 2s}\n"),
            ("/cmd: {deadline: 500ms}", "/cmd: "),
            ("/cmd: {deadline: 1s}", "/cmd: "),
        ],
        1,
        [("station", "alpha", ["publisher"], "ROS103"), ("station", "bravo", ["publisher"], "ROS103")],
        [[["alpha"], ["bravo"]], [["station"]]],
        ["alpha", "bravo", "station"],
    ),
    (
        "another type on both ends of one topic",
        [("/plan: {", "/plan: {type: my/Plan, "), ("/plan: }", "/plan: {type: my/Plan}}")],
        0,
        [],
        [],
        ["alpha", "station"],
    ),
    (
        "yet another type, which differs from the known one",
        [("my/Plan", "my/OtherPlan")],
        1,
        [("station", "alpha", ["publisher", "subscriber"], "ROS403")],
        [[["alpha", "station"]]],
        ["alpha", "station"],
    ),
    (
        "a topic that the subscriber still wants",
        [("/plan: {type: my/OtherPlan, durability", "/chart: {type: my/OtherPlan, durability")],
        1,
        [("station", "alpha", ["publisher", "both"], "CQ407")],
        [],
        ["station"],
    ),
    (
        "a robot less",
        [("  bravo:\n", None)],
        0,
        [],
        [],
        ["bravo"],
    ),
    (
        "an exception with a reason",
        [
            (
                "/odom: {reliability: reliable}\n",
                "/odom: {reliability: reliable}  # cqos: ignore[ROS101] one lost pose is fine\n",
            ),
            (ALPHA + "reliability: reliable", ALPHA + "reliability: best_effort"),
        ],
        0,
        [("alpha", "station", ["publisher", "both"], "ROS101")],
        [],
        ["alpha"],
    ),
    (
        "a value that C-QoS does not understand",
        [("/image: {profile: loose}}", "/image: {reliability: relable}}")],
        0,
        [("alpha", "station", ["publisher", "both"], "CQ203")],
        [],
        ["alpha"],
    ),
]


@pytest.fixture
def git(files):
    """Run git in the folder of the test, without the configuration of the user."""

    def run(*arguments):
        around = {"PATH": os.environ["PATH"], "HOME": str(files), "GIT_CONFIG_NOSYSTEM": "1"}
        who = ("-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "init.defaultBranch=main")
        return subprocess.run(
            [GIT, *who, *arguments], cwd=files, env=around, check=True, capture_output=True, text=True
        ).stdout

    for each in files.iterdir():
        each.unlink()
    run("init")
    return run


def committed(git, name, **texts):
    """Write files, commit them and put a tag there."""
    for path, text in texts.items():
        file = Path(path.replace("__", "/"))
        file.parent.mkdir(exist_ok=True)
        file.with_suffix(".yaml").write_text(text)
    git("add", "--all")
    git("commit", "--allow-empty", "-m", name)
    git("tag", name.replace(" ", "-"))


def changed(text, edits):
    for old, new in edits:
        assert old in text, old
        text = text[: text.index(old)] if new is None else text.replace(old, new)
    return text


def test_ten_changes_have_the_expected_answers(git, cqos):
    text = BASE
    committed(git, "step0", fleet=text)
    for number, (name, edits, code, breaks, order, participants) in enumerate(HISTORY, 1):
        text = changed(text, edits)
        committed(git, f"step{number}", fleet=text)
        done = cqos("breaking", "fleet.yaml", "--against", f".git#ref=step{number - 1}", "--format", "json")
        (system,) = json.loads(done.out)["systems"]
        found = [(*each["participants"], each["worse_after"], each["code"]) for each in system["breaks"]]
        assert (name, found, system["order"], system["changed"], done.code) == (name, breaks, order, participants, code)


def test_text_and_comment_say_which_pair_breaks_when_and_what_to_do(git, cqos, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    committed(git, "old", fleet=BASE)
    Path("fleet.yaml").write_text(
        changed(BASE, [("video: {reliability: best_effort", "video: {reliability: reliable")])
    )
    done = cqos("breaking", ".", "--against", ".git#ref=old")
    assert done.code == 1
    assert done.out.splitlines()[:5] == [
        "/image",
        "  error: `alpha/publisher/image` → `station/subscriber/image`: compatible → incompatible once",
        "    `station` is updated, until `alpha` is",
        "    ./fleet.yaml:8:7: ROS101: publisher `alpha/publisher/image` (and 1 more) offers reliability",
        "      best_effort, subscriber `station/subscriber/image` requests reliability reliable",
    ]
    assert "update `alpha` and `bravo`, then `station`" in done.out
    assert done.out.splitlines()[-1] == "./fleet.yaml against .git#ref=old: 2 pairs break; 3 participants changed"
    comment = cqos("breaking", ".", "--against", ".git#ref=old", "--format", "markdown").out
    assert comment.count("| error |") == 2
    assert "2 pairs break" in comment


def test_what_may_break_fails_only_where_that_is_asked_for(git, cqos):
    committed(git, "old", fleet=BASE)
    Path("fleet.yaml").write_text(BASE.replace("{profile: video}", "{reliability: system_default}", 1))
    arguments = ("breaking", "fleet.yaml", "--against", ".git#ref=old")
    assert cqos(*arguments).code == 0
    assert "may break" in cqos(*arguments).out
    assert cqos(*arguments, "--fail-on", "warning").code == 1


def test_each_system_of_a_folder_is_compared_with_its_own_old_version(git, cqos):
    committed(git, "old", designs__a=BASE, designs__gone=BASE)
    git("mv", "designs/gone.yaml", "designs/b.yaml")
    Path("designs/a.yaml").write_text(BASE.replace("/plan: }", "/chart: }"))
    done = cqos("breaking", "designs", "--against", ".git#ref=old")
    assert (done.code, "designs/a.yaml against" in done.out, "b.yaml" in done.out) == (0, True, False)
    assert "designs/b.yaml is new" in done.err
    assert "gone.yaml is there no longer" in done.err
    assert cqos("breaking", "designs/b.yaml", "--against", ".git#ref=old").code == 0  # a file of its own, new
    assert cqos("breaking", "designs/a.yaml", "--against", "designs/b.yaml").code == 0


# --- revisions ---


def test_check_and_diff_read_revisions_and_touch_nothing(git, cqos):
    committed(git, "old", fleet=BASE, part="cqos: 1\n")
    Path(".gitattributes").write_text("fleet.yaml export-ignore\n")
    committed(
        git, "new", fleet="include: [part.yaml]\n" + BASE.replace("{profile: video}", "{reliability: reliable}", 1)
    )
    Path("fleet.yaml").write_text("half of an ed")
    git("add", "part.yaml")
    before = git("status", "--porcelain")
    assert cqos("check", "fleet.yaml#ref=old", "--format", "concise").out.startswith("old:fleet.yaml: compatible")
    done = cqos("check", ".git#ref=new", "--format", "concise")
    assert (done.code, "new:fleet.yaml:" in done.out, "ROS101" in done.out) == (1, True, True)
    done = cqos("diff", "fleet.yaml#ref=HEAD", "--against", "fleet.yaml#ref=old")
    assert (done.code, "HEAD:fleet.yaml:9" in done.out) == (1, True)
    assert git("status", "--porcelain") == before


def test_the_repository_is_that_of_the_path_whatever_a_hook_says(git, cqos, monkeypatch):
    committed(git, "old", fleet=BASE)
    monkeypatch.setenv("GIT_DIR", "/nowhere")
    monkeypatch.setenv("GIT_INDEX_FILE", "/nowhere/index")
    assert cqos("check", ".git#ref=main").code == 0


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("fleet.yaml#ref=mian", "has no revision `mian`\nhelp: did you mean `main`?"),
        ("fleet.yaml#ref=0123456", "has no revision `0123456`\nhelp: a shallow clone lacks most of them"),
        ("fleet.yaml#ref=--output=x", "`--output=x` is no name of a git revision"),
        ("fleet.yaml#ref=", "`` is no name of a git revision"),
        ("fleet.yaml#ref=main:fleet.yaml", "is no name of a git revision"),
        ("other.yaml#ref=main", "there is no `other.yaml` in revision `main`"),
    ],
)
def test_a_revision_that_is_not_there_is_an_error(git, cqos, path, said):
    committed(git, "old", fleet=BASE)
    done = cqos("check", path)
    assert (done.code, said in done.err) == (2, True), done.err
    assert not Path("x").exists()


def test_a_missing_git_and_a_missing_repository_are_errors(git, cqos, tmp_path_factory, monkeypatch):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    assert "is in no git repository" in cqos("check", f"{elsewhere}#ref=main").err
    monkeypatch.setenv("PATH", str(elsewhere))
    done = cqos("check", ".git#ref=main")
    assert (done.code, done.err) == (
        2,
        "error: a revision is read with git, which is not installed\nhelp: install git\n",
    )


def test_a_file_with_such_a_name_is_a_file(git, cqos):
    Path("a#ref=main.yaml").write_text(BASE)
    assert cqos("check", "a#ref=main.yaml").code == 0
