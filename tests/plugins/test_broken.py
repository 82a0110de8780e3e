"""Broken plugins: each is reported by name, distribution and version, and harms nothing else."""

import json
from pathlib import Path

import pytest

from tests.plugins.distributions import install

ROOT = Path(__file__).resolve().parents[2]
BROKEN = Path(__file__).with_name("broken")
EXAMPLES = ROOT / "examples"
FITS = EXAMPLES / "smart_agriculture.bpmn"

LEFT_OUT = {
    "import_error": "ModuleNotFoundError: No module named 'no_such_module'",
    "exit_at_import": "SystemExit: no licence found",
    "hook_raises": "LookupError: no such table",
    "unknown_argument": "Argument(s) {'settings'} are declared in the hookimpl but can not be found in the hookspec",
    "unknown_hook": "unknown hook 'register_importer' in plugin",
    "no_hookimpl": "it implements no hook; is `@hookimpl` missing?",
    "wrong_descriptor": "its `register_importers` registers FormatterInfo(name='table'",
    "bad_path": "its command `bad` has the command 'bad_path.command', where \"module:object\" is expected",
    "pack_thief": "it registers rule pack `ros2`, which cqos-ros2 0.1.0 already provides",
    "importer_thief": "it registers importer `bpmn`, which cqos-core 0.1.0 already provides",
}
FAILING = ("malformed_pack", "failing_pack", "failing_importer", "failing_formatter", "failing_command")


@pytest.fixture
def everything(site):
    """All broken plugins at once."""
    for number, name in enumerate(sorted(LEFT_OUT)):
        # Sorted before ours by entry point and by module where that is possible.
        install(site, BROKEN / f"{name}.py", version=f"2.{number}", entry=f"a_{name}")
    for name in FAILING:
        path = BROKEN / name
        install(site, path if path.is_dir() else path.with_suffix(".py"), version="3.0")
    return {
        name: f"plugin `a_{name}` of {name.replace('_', '-')} 2.{number} could not be loaded and is left out: "
        for number, name in enumerate(sorted(LEFT_OUT))
    }


def write(cqos, name, text):
    (cqos.folder / name).write_text(text, encoding="utf-8")
    return name


def system(protocol, offered="", requested=""):
    return (
        f"cqos: 1\nprotocol: {protocol}\nparticipants:\n"
        f"  a: {{publishes: {{x: {{{offered}}}}}}}\n"
        f"  b: {{subscribes: {{x: {{{requested}}}}}}}\n"
    )


def test_every_broken_plugin_is_reported_once_and_what_works_works(cqos, everything):
    done = cqos("check", FITS)
    assert done.code == 0
    assert "compatible: 2 topics, 2 pairs judged" in done.out
    for name, start in everything.items():
        (reported,) = (line for line in done.err.split("warning: ") if line.startswith(start))
        assert LEFT_OUT[name] in reported
    assert done.err.count("warning: ") == len(everything) + 1  # an unused pack is not loaded
    assert "importer `unsure` of failing-importer 3.0 could not look at" in done.err
    assert "Traceback" not in done.err


def test_the_inventory_lists_what_is_broken_and_nothing_that_it_registered(cqos, everything):
    done = cqos("packs", "--format", "json")
    inventory = json.loads(done.out)
    broken = {each["name"]: each for each in inventory["broken"]}
    assert set(broken) == {f"a_{name}" for name in LEFT_OUT} | {"malformed"}
    assert broken["a_import_error"]["distribution"].startswith("import-error 2.")
    names = {each["name"] for kind in ("importers", "formatters", "commands") for each in inventory[kind]}
    assert not names & {"half", "unmarked", "table", "bad", "innocent"}
    packs = {each["id"] for each in inventory["packs"]}
    assert {"ros2", "judging", "naming"} <= packs
    assert "malformed" not in packs
    assert done.err == ""  # it is all in the list


def test_help_lists_the_commands_of_the_others(cqos, everything):
    done = cqos("--help-all")
    assert done.code == 0
    assert "Commands of plugins:\n  fail " in done.out
    assert done.err.count("warning: ") == len(LEFT_OUT)


def test_quiet_says_nothing_of_broken_plugins(cqos, everything):
    assert cqos("check", "--quiet", FITS) == (0, "", "")


def test_a_malformed_pack_in_use_is_reported_with_all_its_mistakes(cqos, site):
    install(site, BROKEN / "malformed_pack")
    files = [write(cqos, "m.yaml", system("malformed")), EXAMPLES / "smart_agriculture_incompatible.bpmn"]
    done = cqos("check", "--each", *files)
    assert done.code == 2
    assert "no installed pack judges protocol `malformed`" in done.out
    assert done.out.count("error[ROS10") == 2
    _, start, reason = done.err.partition(
        "warning: rule pack `malformed` of malformed-pack 1.0 could not be loaded and is left out: "
        "rule pack `malformed` is not well formed:\n"
    )
    assert start
    assert len(reason.splitlines()) == 4
    for mistake in ("`too-slow` names both", "`medium` is no", "`haste`", "rule MAL101 `offered(sped)"):
        assert mistake in reason
    assert "not well formed" in cqos("packs", "malformed").err
    listed = " ".join(cqos("packs").out.partition("Broken plugins")[2].split())
    assert listed.startswith("malformed rule pack `malformed` is not well formed: ")
    assert "\\n" not in listed


def test_a_rule_whose_function_raises_is_a_finding_and_the_rest_is_judged(cqos, site):
    install(site, BROKEN / "failing_pack")
    name = write(cqos, "j.yaml", system("judging", "group: red", "speed: fast"))
    done = cqos("check", name, "--format", "json")
    assert done.code == 1
    report = json.loads(done.out)
    assert report["verdict"] == "incompatible"
    found = {finding["code"]: finding["message"] for finding in report["findings"]}
    assert set(found) == {"CQ701", "JUD101"}
    assert found["CQ701"] == "rule JUD102 could not be judged: KeyError: 'red'"


def test_a_pack_that_fails_otherwise_is_named(cqos, site):
    install(site, BROKEN / "failing_pack")
    name = write(cqos, "n.yaml", system("naming"))
    done = cqos("check", name)
    assert done.code == 3
    what = "internal error in the plugin `failing_pack` of failing-pack 1.0: AttributeError: "
    assert done.err.startswith(f"error: {what}")
    assert "help: this is a fault of the plugin `failing_pack` of failing-pack 1.0, not of your input" in done.err
    assert "Traceback" not in done.err
    assert "Traceback" in cqos("--debug", "check", name).err


FAULTS = {
    "exception": "TypeError: byte indices must be integers",
    "exit": "SystemExit: 5",
    "error": "the dictionary is missing\\nlook for it",
    "silence": "InputError",
    "nothing": "TypeError: its reader returned a NoneType, not a System",
    "participant": "its reader returned endpoints of `a`, which is none of the participants",
}


def test_an_importer_that_fails_is_named_and_the_rest_is_checked(cqos, site):
    install(site, BROKEN / "failing_importer.py")
    names = [write(cqos, f"{demand}.fail", f"fail: {demand}") for demand in FAULTS]
    done = cqos("check", "--each", *names, EXAMPLES / "smart_agriculture_incompatible.bpmn")
    assert done.code == 2
    for demand, reason in FAULTS.items():
        assert f"error[CQ702] {demand}.fail: importer `failing` of failing-importer 1.0 failed: {reason}" in done.err
    assert done.out.count("error[ROS10") == 2
    assert "Traceback" not in done.err


def test_an_importer_that_fails_is_found_by_its_authors(cqos, site):
    install(site, BROKEN / "failing_importer.py")
    done = cqos("--debug", "check", write(cqos, "a.fail", "fail: exception"))
    assert done.code == 2
    assert 'return source.data["line"]' in done.err


def test_an_importer_that_fails_when_asked_leaves_the_file_to_the_others(cqos, site):
    install(site, BROKEN / "failing_importer.py")
    done = cqos("check", FITS)
    assert done.code == 0
    assert done.err == (
        f"warning: importer `unsure` of failing-importer 1.0 could not look at {FITS}: "
        "ValueError: substring not found\n"
    )
    unknown = cqos("check", write(cqos, "b.unsure", "ünsure"))
    assert unknown.code == 2
    assert "b.unsure: no installed importer recognises this format" in unknown.err
    assert "importer `unsure` of failing-importer 1.0 could not look at b.unsure: UnicodeDecodeError" in unknown.err


def test_a_formatter_that_fails_is_named_and_the_others_write(cqos, site):
    install(site, BROKEN / "failing_formatter.py")
    reasons = {
        "fails": "AttributeError: 'Style' object has no attribute 'paper_size'",
        "number": "TypeError: ",
        "missing": "AttributeError: module 'failing_formatter' has no attribute 'missing'",
    }
    sinks = [argument for name in reasons for argument in ("--format", name, "--output", f"{name}.txt")]
    done = cqos("check", FITS, *sinks, "--format", "concise")
    assert done.code == 2
    for name, reason in reasons.items():
        assert f"error: formatter `{name}` of failing-formatter 1.0 failed: {reason}" in done.err
    assert "compatible: 2 topics" in done.out
    assert list(cqos.folder.iterdir()) == []
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("name", "code", "said"),
    [
        ("fail", 3, "error: internal error in the plugin `failing_command` of failing-command 1.0: ZeroDivisionError"),
        ("plain", 2, "the command `plain` of failing-command 1.0 cannot be loaded: TypeError: `failing_command:plain`"),
        ("missing", 2, "the command `missing` of failing-command 1.0 cannot be loaded: AttributeError"),
    ],
)
def test_a_command_that_fails_is_named(cqos, site, name, code, said):
    install(site, BROKEN / "failing_command.py")
    done = cqos(name)
    assert (done.code, done.out) == (code, "")
    assert said in done.err
    assert "Traceback" not in done.err


def test_only_named_distributions_are_loaded(cqos, everything):
    none = cqos("check", FITS, CQOS_LOAD_PLUGINS="")
    assert (none.code, none.err) == (0, "")
    one = cqos("check", FITS, CQOS_LOAD_PLUGINS="Import_Error, misspelt")
    assert one.code == 0
    first, second = one.err.splitlines()
    assert "plugin `a_import_error` of import-error 2." in first
    assert second == (
        "warning: plugin `misspelt` could not be loaded and is left out: CQOS_LOAD_PLUGINS names it, "
        "but there is no installed distribution of that name with a plugin"
    )
