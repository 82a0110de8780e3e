"""Project configuration: where it is found, what it may say, how files extend each other, what systems win over."""

import os
from pathlib import Path
from textwrap import dedent

import pytest

from cqos_core import Acceptance, InputError, Place, Setting, System, TeamRule
from cqos_core.config import CONFIG, Config, config_for, find_config, load_config


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(name, text):
    path = Path(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(dedent(text).removeprefix("\n"), encoding="utf-8")
    return name


def load(text, name="cqos.toml"):
    return load_config(write(name, text))


def problems(text, name="cqos.toml"):
    with pytest.raises(InputError) as refused:
        load(text, name)
    return [f"{problem.code} {problem}" for problem in refused.value.problems]


EVERYTHING = """
    protocol = "alpha"
    show = "notes"
    fail_on = "warning"
    format = "json"
    baseline = "known.json"
    packs = ["packs/own.yaml"]

    [options.alpha]
    mode = "strict"
    level = 3
    quick = true
    names = ["a", "b c"]

    [severities]
    X101 = "off"

    [[checks]]
    name = "c"
    where = { role = "subscriber" }
    require = { depth = { at_least = 1 }, kind = "x" }
    because = "so"

    [[accept]]
    rule = "X102"
    topic = "t"
    until = 2027-01-31
    because = "known"
    """


class TestFinding:
    def test_nearest_folder_above_a_file_or_folder(self, folder):
        write("cqos.toml", "")
        write("a/cqos.toml", "")
        write("a/b/system.yaml", "")
        assert find_config("a/b/system.yaml") == Path("a/cqos.toml")
        assert find_config("a/b") == Path("a/cqos.toml")
        assert find_config(".") == Path("cqos.toml")
        assert find_config(folder / "a") == Path("a/cqos.toml")

    def test_own_file_before_the_shared_one(self):
        write("a/pyproject.toml", "[tool.cqos]")
        assert find_config("a") == Path("a/pyproject.toml")
        write("a/cqos.toml", "")
        assert find_config("a") == Path("a/cqos.toml")

    @pytest.mark.parametrize("text", ["", "[tool.other]", "[tool]\ncqo = 1", "this is [not TOML", "tool = 3"])
    def test_shared_file_without_our_table_is_passed_by(self, text):
        write("cqos.toml", "")
        write("a/pyproject.toml", text)
        assert find_config("a") == Path("cqos.toml")

    @pytest.mark.parametrize("text", ["[tool]\ncqos = {}", "tool.cqos.show = 'notes'", "[ tool . 'cqos' ]\nbroken"])
    def test_our_table_is_found_however_it_is_written(self, text):
        write("a/pyproject.toml", text)
        assert find_config("a") == Path("a/pyproject.toml")

    def test_outside_of_the_working_folder_the_path_is_whole(self, folder, monkeypatch):
        write("a/cqos.toml", "")
        (folder / "b").mkdir()
        monkeypatch.chdir(folder / "b")
        assert find_config("../a") == folder / "a" / "cqos.toml"

    def test_a_path_that_does_not_exist_is_looked_for_as_a_folder(self):
        write("cqos.toml", "")
        assert find_config("no/such/file.yaml") == Path("cqos.toml")

    def test_without_a_file_the_configuration_is_empty(self, monkeypatch):
        monkeypatch.setattr("cqos_core.config.NAME", "no-such-name.toml")
        monkeypatch.setattr("cqos_core.config.SHARED_NAME", "no-such-name.toml")
        assert config_for(".") == Config()


class TestReading:
    def test_everything(self):
        config = load(EVERYTHING)
        assert config.path == "cqos.toml"
        assert (config.protocol, config.show, config.fail_on, config.format) == (
            "alpha",
            ("notes",),
            "warning",
            "json",
        )
        assert (config.baseline, config.packs) == ("known.json", (os.path.join("packs", "own.yaml"),))  # noqa: PTH118
        assert {name: setting.text for name, setting in config.options["alpha"].items()} == {
            "mode": "strict",
            "level": "3",
            "quick": "true",
            "names": "[a, b c]",
        }
        assert config.options["alpha"]["mode"].place == Place("cqos.toml", 9, 8)
        assert config.severities == {"X101": "off"}
        (check,) = config.checks
        assert (check.name, check.where, check.because) == ("c", (("role", "subscriber"),), "so")
        assert [(bound.policy, bound.relation, bound.values) for bound in check.require] == [
            ("depth", "at_least", ("1",)),
            ("kind", "exactly", ("x",)),
        ]
        assert check.require[0].place == Place("cqos.toml", 20)
        assert check.place == Place("cqos.toml", 17, 3)
        (accepted,) = config.accept
        assert (accepted.rule, accepted.topic, accepted.until) == ("X102", "t", "2027-01-31")
        assert list(config.sources) == ["cqos.toml"]

    def test_shared_file(self):
        config = load("[project]\nname = 'x'\n[tool.cqos.options]\nalpha = {mode = 'strict'}\n", "a/pyproject.toml")
        assert config.options["alpha"]["mode"] == Setting("strict", Place("a/pyproject.toml", 4))

    def test_paths_are_relative_to_the_file(self):
        config = load("baseline = 'b.json'\npacks = 'p.yaml'", "a/cqos.toml")
        assert (config.baseline, config.packs) == (str(Path("a/b.json")), (str(Path("a/p.yaml")),))

    def test_an_empty_file_says_nothing(self):
        assert load("") == Config(path="cqos.toml", sources={"cqos.toml": b""})


class TestProblems:
    def test_all_are_reported_with_their_lines(self):
        assert problems("""
            pack = "x"              # a comment with pack = "y"
            fail_on = "eror"
            show = ["notes", "all"]
            description = '''
            format = 7
            '''
            "format" = ["json"]
            severities = { X = "quiet" }

            [options]
            alpha = "strict"

            [[checks]]
            name = "one"
            because = "so"
            sentence = "s"

            [[checks]]
            name = "two"
            sentence = "s"

            [[checks]]
            name = "three"
            because = "so"
            [checks.require]
            depth = { atleast = 1 }
            """) == [
            (
                "CQ006 cqos.toml:1:1: the configuration has no key `pack`; did you mean `packs`? (allowed: extends, protocol,"
                " options, severities, checks, accept, packs, exclude, show, fail_on, format, baseline, serve)"
            ),
            "CQ011 cqos.toml:2:11: `fail_on` must be error or warning, found `eror`; did you mean `error`?",
            "CQ011 cqos.toml:3: `show[1]` must be notes, not-checked, subscribers or coverage, found `all`",
            (
                "CQ006 cqos.toml:4:1: the configuration has no key `description` (allowed: extends, protocol, options,"
                " severities, checks, accept, packs, exclude, show, fail_on, format, baseline, serve)"
            ),
            'CQ009 cqos.toml:7:12: `format` must be a text, found a list (write it without a list: `format = "json"`)',
            "CQ011 cqos.toml:8: `X` must be error, warning, note or off, found `quiet`",
            (
                "CQ009 cqos.toml:11:9: `alpha` must be a map of options, found `strict` "
                '(options are by rule pack: `options = { PACK = { alpha = "strict" } }`)'
            ),
            "CQ010 cqos.toml:18:3: a check needs `because` (add `because = …`: the reason, for later readers)",
            (
                "CQ006 cqos.toml:26: `depth` cannot be required `atleast`; did you mean `at_least`? (allowed: exactly,"
                " at_least, at_most, one_of, not; a bare value means exactly)"
            ),
        ]

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("a = 1\na = 2\n", "CQ001 cqos.toml:2:6: this is not TOML: cannot overwrite a value"),
            ("a =", "CQ001 cqos.toml: this is not TOML: invalid value"),
            (f"a = {'9' * 5000}", "CQ001 cqos.toml: this is not TOML"),
            (f"a = {'[' * 5000}", "CQ002 cqos.toml: lists and tables are nested too deep"),
        ],
    )
    def test_what_is_no_toml(self, text, message):
        (problem,) = problems(text)
        assert problem.startswith(message)

    def test_what_is_no_text(self, folder):
        (folder / "cqos.toml").write_bytes(b"a = '\xff'")
        with pytest.raises(InputError, match="bytes are not UTF-8"):
            load_config("cqos.toml")

    def test_a_file_that_is_not_there(self):
        with pytest.raises(InputError, match=r"cannot open `nowhere\.toml`: No such file"):
            load_config("nowhere.toml")

    def test_our_table_of_another_kind(self):
        (problem,) = problems("[tool]\ncqos = 3\n", "pyproject.toml")
        assert problem == "CQ009 pyproject.toml:2:8: `tool.cqos` must be a map (the configuration), found `3`"


class TestExtending:
    def test_the_nearer_file_wins(self):
        write(
            "base/base.toml",
            """
            protocol = "alpha"
            format = "json"
            baseline = "known.json"
            packs = ["own.yaml"]
            options.alpha = { mode = "loose", level = 1 }
            severities = { X101 = "note", X102 = "note" }
            checks = [{ name = "c", sentence = "base", because = "b" }, { name = "d", sentence = "base", because = "b" }]
            accept = [{ rule = "X1", because = "b" }]
            """,
        )
        config = load(
            """
            extends = "../base/base.toml"
            format = "full"
            packs = ["p.yaml"]
            options.alpha = { mode = "strict" }
            severities = { X101 = "off" }
            checks = [{ name = "c", sentence = "own", because = "b" }]
            accept = [{ rule = "X2", because = "b" }]
            """,
            "project/cqos.toml",
        )
        assert (config.protocol, config.format) == ("alpha", "full")
        assert config.baseline == str(Path("project/../base/known.json"))
        assert config.packs == (str(Path("project/../base/own.yaml")), str(Path("project/p.yaml")))
        assert {name: setting.text for name, setting in config.options["alpha"].items()} == {
            "mode": "strict",
            "level": "1",
        }
        assert config.severities == {"X101": "off", "X102": "note"}
        assert [(check.name, check.sentence) for check in config.checks] == [("d", "base"), ("c", "own")]
        assert [accepted.rule for accepted in config.accept] == ["X1", "X2"]
        assert list(config.sources) == [
            str(Path("project/../base/base.toml")),
            str(Path("project/cqos.toml")),
        ]

    def test_of_several_a_later_one_wins(self):
        write("a.toml", "format = 'a'\nprotocol = 'a'")
        write("b.toml", "format = 'b'")
        config = load("extends = ['a.toml', 'b.toml']")
        assert (config.format, config.protocol) == ("b", "a")

    def test_a_circle_is_printed_as_a_path(self):
        write("a/base.toml", "extends = '../cqos.toml'")
        (problem,) = problems("extends = 'a/base.toml'")
        circle = f"cqos.toml → {Path('a/base.toml')} → {Path('a/../cqos.toml')}"
        assert problem == f"CQ008 {Path('a/base.toml')}:1:11: `{Path('a/../cqos.toml')}` extends itself: {circle}"

    def test_problems_of_all_files_are_reported(self):
        write("a.toml", "x = 1")
        found = problems("extends = ['a.toml', 'nowhere.toml']\ny = 1")
        assert [problem.split(": ")[0] for problem in found] == [
            "CQ006 cqos.toml:2:1",
            "CQ006 a.toml:1:1",
            "CQ007 cqos.toml:1",
        ]


class TestApplying:
    def test_what_the_system_says_wins(self):
        config = Config(
            path="cqos.toml",
            protocol="alpha",
            options={"alpha": {"mode": Setting("loose"), "level": Setting("1")}, "beta": {"x": Setting("y")}},
            severities={"X101": "note", "X102": "note"},
            checks=(TeamRule("c", (), (), "config"), TeamRule("d", (), (), "config")),
            accept=(Acceptance("X1", "config"),),
            sources={"cqos.toml": b"x"},
        )
        system = System(
            options={"alpha": {"mode": Setting("strict")}},
            severities={"X101": "off"},
            checks=[TeamRule("c", (), (), "system")],
            accept=[Acceptance("X2", "system")],
            sources={"s.yaml": b"y"},
        )
        applied = config.apply_to(system)
        assert applied.protocol == "alpha"
        assert applied.options == {
            "alpha": {"mode": Setting("strict"), "level": Setting("1")},
            "beta": {"x": Setting("y")},
        }
        assert applied.severities == {"X101": "off", "X102": "note"}
        assert [(check.name, check.because) for check in applied.checks] == [("d", "config"), ("c", "system")]
        assert [accepted.rule for accepted in applied.accept] == ["X1", "X2"]
        assert list(applied.sources) == ["s.yaml", "cqos.toml"]

    def test_the_given_system_is_left_as_it_is(self):
        system = System(protocol="beta", options={"alpha": {}})
        config = Config(options={"alpha": {"mode": Setting("loose")}}, severities={"X": "off"})
        applied = config.apply_to(system)
        assert applied.protocol == "beta"
        assert system == System(protocol="beta", options={"alpha": {}})

    def test_an_empty_configuration_changes_nothing(self):
        system = System(name="s", severities={"X": "off"})
        assert Config().apply_to(system) == system


@pytest.mark.parametrize(
    ("text", "ours"),
    [
        ("[tool.cqos]\nformat = 'json'", True),
        (" [ tool . 'cqos' ]", True),
        ("[ 'tool' . cqos ]", True),
        ('["tool"."cqos"]', True),
        ('[tool."c\\u0071os"]', True),
        ('["t\\u006Fol".cqos]', True),
        ("tool.cqos.format = 'json'", True),
        ("tool = {cqos = {format = 'json'}}", True),
        ("'tool'.cqos.format = 'json'", True),
        ("[tool]\n[project]\n", False),
        ("[tool]\ncqos.format = 'json'", True),
        ("[[tool.cqos.checks]]", True),
        ("[tool.other]\ncqos = 1\n[project.entry-points.cqos]\na = 'b'", False),
        ("x = 1", False),
    ],
)
def test_our_table_is_found_in_any_spelling(tmp_path, text, ours):
    file = tmp_path / "pyproject.toml"
    file.write_text(text, encoding="utf-8")
    found = find_config(tmp_path)
    assert (found is not None and found.resolve() == file.resolve()) is ours


def test_every_key_is_documented():
    text = (Path(__file__).parent.parent / "docs" / "configuration.md").read_text(encoding="utf-8")
    keys = text[text.index("## All keys") :]
    assert [name for name in CONFIG.keys if f"| `{name}`" not in keys] == []
