"""Plugins add packs, importers, formatters and commands; a broken one harms nothing."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import click
import pytest

from cqos_core.plugins import load_plugins

GOOD = """
import click
from cqos_core.plugins import CommandInfo, ExporterInfo, FormatterInfo, ImporterInfo, hookimpl

@hookimpl
def register_formatters(register):
    register(FormatterInfo("shout", "loud", "fine_plugin:shout"))
    for name in ("crash", "quit", "none", "octets"):
        register(FormatterInfo(name, "fails", f"fine_plugin:{name}"))

@hookimpl
def register_exporters(register):
    register(ExporterInfo("names", "one participant per line", ".txt", "fine_plugin:names"))
    register(ExporterInfo("lost", "cannot be imported", ".txt", "no_such_module:write"))
    for name in ("crash", "quit", "none", "octets"):
        register(ExporterInfo(name, "fails", ".txt", f"fine_plugin:{name}"))

@hookimpl
def register_importers(register):
    register(ImporterInfo("csv", "endpoints as lines", (".csv",), "fine_plugin:claims", "fine_plugin:read"))
    register(ImporterInfo("awful", "its claim fails", (".awful",), "no_such_module:claims", "no_such_module:read"))

@hookimpl
def register_commands(register):
    register(CommandInfo("greet", "Say hello.", "fine_plugin:greet"))
    register(CommandInfo("wait", "Wait.", "fine_plugin:wait"))
    register(CommandInfo("gone", "Cannot be imported.", "no_such_module:gone"))

def shout(report, style):
    return f"{report.verdict.upper()}!\\n"

def crash(subject, context):
    return 1 / 0

def quit(subject, context):
    raise SystemExit(7)

def none(subject, context):
    return None

def octets(subject, context):
    from cqos_core.files.export import Exported
    from cqos_core.model.system import System
    return Exported(b"x", 1) if isinstance(subject, System) else b"x"

def names(system, context):
    from cqos_core.files.export import Exported
    return Exported("".join(f"{name}\\n" for name in system.participants), len(system.participants))

def claims(name, head):
    return name.endswith(".csv")

def read(source, context):
    from cqos_core.model.system import Endpoint, Participant, System
    system = System(name="table", protocol="ros2", sources={source.name: source.data})
    if b"crash" in source.data:
        raise KeyError("x")
    if b"quit" in source.data:
        raise SystemExit(7)
    if b"none" in source.data:
        return None
    for line in source.data.decode().split():
        who, role, topic = line.split(",")
        system.participants[who] = Participant(who)
        system.endpoints.append(Endpoint(id=f"{who}/{role}/{topic}", role=role, topic=topic, participant=who))
    return system

@click.command()
@click.argument("name")
@click.pass_context
def greet(ctx, name):
    click.echo(f"hello {name}")
    ctx.exit(5)

@click.command()
def wait():
    import time
    click.echo("waiting")
    time.sleep(60)
"""

HALF = """
from cqos_core.plugins import RulePackInfo, hookimpl

@hookimpl
def register_rule_packs(register):
    register(RulePackInfo("half", "a pack that cannot be imported", "no_such_module:PACK"))
"""


THIEF = """
from cqos_core.plugins import FormatterInfo, hookimpl

@hookimpl
def register_formatters(register):
    register(FormatterInfo("json", "not ours", "thief_plugin:render"))
"""


DEPOT = """
from cqos_core.model.entrance import Entrance
from cqos_core.plugins import ImporterInfo, ImporterOption, hookimpl

@hookimpl
def register_importers(register):
    option = ImporterOption("--plan", "plan", "FILE", "the plan of a depot")
    register(ImporterInfo("depot", "depots", (), "depot_plugin:claims", "depot_plugin:read", options=(option,), folders_with="plan", entrances="depot_plugin:find"))
    register(ImporterInfo("ruin", "fails", (), "depot_plugin:claims", "depot_plugin:read", folders_with="plan", entrances="no_such_module:find"))

def claims(name, head):
    return False

def read(source, context):
    from cqos_core.model.system import Endpoint, Participant, System
    name = context.options["depot"]["plan"]
    ends = [Endpoint(id=f"{name}/{role}", role=role, topic="/t", participant=name) for role in ("publisher", "subscriber")]
    return System(name=name, protocol="ros2", participants={name: Participant(name)}, endpoints=ends)

def find(path, files):
    plans = [each.rpartition("/")[2] for each in files or () if each.endswith(".plan")]
    if len(plans) == 1:
        return [Entrance(path, "1 plan", plans[0], f"{path} has one plan")]
    return [Entrance(path, f"{len(plans)} plans", choices=tuple(plans))] if plans else []
"""


def install(folder, name, text, version="1.2.3"):
    """Put a distribution with one plugin where Python finds it."""
    (folder / f"{name}.py").write_text(text)
    info = folder / f"{name}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (info / "entry_points.txt").write_text(f"[cqos]\n{name} = {name}\n")


@pytest.fixture
def plugins(files):
    folder = files / "site"
    folder.mkdir()
    install(folder, "fine_plugin", GOOD)
    install(folder, "half_plugin", HALF)
    install(folder, "broken_plugin", "raise RuntimeError('it never worked')\n")
    install(folder, "thief_plugin", THIEF)
    return {"PYTHONPATH": str(folder)}


BROKEN = (
    "plugin `broken_plugin` of broken_plugin 1.2.3 could not be loaded and is left out: RuntimeError: it never worked"
)


def test_what_plugins_add_is_used(forked, plugins, files):
    (files / "table.csv").write_text("lidar,publisher,scan\nplanner,subscriber,scan\n")
    assert forked("check", "table.csv", "--format", "shout", **plugins)[:2] == (0, "COMPATIBLE!\n")
    assert forked("check", "table.csv", "fits.yaml", "--format", "shout", **plugins)[:2] == (0, "COMPATIBLE!\n")
    assert forked("convert", "table.csv", "--to", "names", **plugins)[:2] == (0, "lidar\nplanner\n")
    assert forked("greet", "world", **plugins)[:2] == (5, "hello world\n")


def test_an_importer_of_a_plugin_finds_what_it_reads_in_a_folder(forked, plugins, files):
    install(files / "site", "depot_plugin", DEPOT)
    (files / "depot").mkdir()
    (files / "depot" / "a.plan").write_text("")
    done = forked("check", "depot", "--format", "concise", **plugins)
    assert done.out.startswith("a.plan: compatible: 1 topic, 1 pair judged, ")
    assert "depot has one plan, so it is checked, as `cqos check depot --format concise --plan a.plan` does" in done.err
    assert "importer `ruin` of depot_plugin 1.2.3" in done.err
    (files / "depot" / "b.plan").write_text("")
    open_choice = forked("check", "depot", **plugins)
    assert open_choice.code == 1
    assert "depot: 2 plans, and --plan names none" in open_choice.err
    assert "\n          cqos check depot --plan a.plan\n" in open_choice.err


def test_commands_of_plugins_stand_in_the_help(forked, plugins):
    out = forked("--help-all", **plugins).out
    assert "Commands of plugins:\n  greet" in out
    assert "Say hello." in out


def test_every_command_says_its_exit_codes():
    def commands(name, command):
        if isinstance(command, click.Group):
            for each in command.list_commands(click.Context(command)):
                yield from commands(f"{name} {each}", command.get_command(click.Context(command), each))
        else:
            yield name, command

    every = [one for name, info in load_plugins().commands.items() for one in commands(name, info.load())]
    assert [name for name, command in every if "Exit codes" not in (command.epilog or "")] == []


def test_a_broken_plugin_is_reported_and_harms_nothing(forked, plugins):
    done = forked("check", "clashes.yaml", **plugins)
    assert done.code == 1
    assert "error[ROS101]" in done.out
    assert f"warning: {BROKEN}\n" in done.err
    assert "thief_plugin 1.2.3 could not be loaded" in done.err
    assert "formatter `json`, which cqos-core " in done.err
    assert "`awful`" in done.err
    assert forked("check", "clashes.yaml", "--quiet", **plugins) == (1, "", "")


def test_a_pack_that_cannot_be_imported_is_left_out(forked, plugins, files):
    (files / "half.yaml").write_text((files / "fits.yaml").read_text().replace("ros2", "half"))
    done = forked("check", "half.yaml", "clashes.yaml", "--each", **plugins)
    assert done.code == 2
    assert "CQ201" in done.out
    assert "error[ROS101]" in done.out
    assert "rule pack `half` of half_plugin 1.2.3 could not be loaded and is left out: ModuleNotFoundError" in done.err
    assert forked("rule", "ROS101", **plugins).code == 0


def test_broken_plugins_are_listed_with_the_packs(forked, plugins):
    done = forked("packs", **plugins)
    assert done.code == 0
    broken = done.out.partition("\nBroken plugins\n")[2]
    for name in ("broken_plugin", "half", "thief_plugin"):
        assert f"  {name} " in broken
    assert "fine_plugin 1.2.3" in done.out
    assert "it never worked" not in done.err
    assert "could not be loaded" in forked("packs", "half", **plugins).err


def test_a_pack_file_of_a_service_has_an_id_of_its_own(forked):
    pack = Path(__file__).parents[2] / "examples" / "opcua" / "opcua_pack.yaml"
    twice = forked("serve", "--pack", pack, "--pack", pack)
    assert (twice.code, twice.out) == (2, "")
    assert f"there is a rule pack `opcua` already, from {pack}" in twice.err
    missing = forked("modeler", "--no-browser", "--pack", "nowhere.yaml")
    assert missing.code == 2
    assert "nowhere.yaml: cannot be read" in missing.err


def test_a_command_that_cannot_be_imported(forked, plugins):
    done = forked("gone", **plugins)
    assert done.code == 2
    assert "the command `gone` of fine_plugin 1.2.3 cannot be loaded: ModuleNotFoundError" in done.err


FAILS = {
    "crash": "ZeroDivisionError: division by zero",
    "quit": "SystemExit: 7",
    "none": "TypeError: ",
    "octets": "TypeError: ",
}


@pytest.mark.parametrize("how", FAILS)
def test_a_formatter_that_fails_is_named_and_harms_no_other(forked, plugins, files, how):
    done = forked("check", "fits.yaml", "--format", "concise", "--format", how, "--output", "out.txt", **plugins)
    assert done.code == 2
    assert "compatible" in done.out
    assert f"error: formatter `{how}` of fine_plugin 1.2.3 failed: {FAILS[how]}" in done.err
    assert "Traceback" not in done.err
    assert not (files / "out.txt").exists()


@pytest.mark.parametrize("how", [*FAILS, "lost"])
def test_an_exporter_that_fails_is_named(forked, plugins, files, how):
    (files / "out.txt").write_text("before")
    done = forked("convert", "fits.yaml", "--to", how, "--output", "out.txt", **plugins)
    assert (done.code, done.out) == (2, "")
    said = FAILS.get(how, "ModuleNotFoundError: No module named 'no_such_module'")
    assert f"error: exporter `{how}` of fine_plugin 1.2.3 failed: {said}" in done.err
    assert "Traceback" not in done.err
    assert (files / "out.txt").read_text() == "before"


@pytest.mark.parametrize(("how", "said"), [("crash", "KeyError: 'x'"), ("quit", FAILS["quit"]), ("none", "TypeError")])
@pytest.mark.parametrize("command", [("check",), ("convert", "--to", "yaml"), ("diff", "--against", "fits.yaml")])
def test_an_importer_that_fails_is_named_and_the_rest_is_read(forked, plugins, files, how, said, command):
    (files / "bad.csv").write_text(how)
    done = forked(*command, "bad.csv", **plugins)
    assert (done.code, done.out) == (2, "")
    assert f"bad.csv: importer `csv` of fine_plugin 1.2.3 failed: {said}" in done.err
    assert "Traceback" not in done.err
    assert "error[ROS101]" in forked("check", "bad.csv", "clashes.yaml", "--each", **plugins).out


@pytest.mark.parametrize("command", [("check", "--format", "crash"), ("convert", "--to", "crash")])
def test_with_debug_the_traceback_of_what_failed_is_shown(forked, plugins, command):
    done = forked("--debug", *command, "fits.yaml", **plugins)
    assert done.code == 2
    assert "Traceback" in done.err
    assert "return 1 / 0" in done.err


@pytest.mark.skipif(os.name == "nt", reason="Windows has other signals")
def test_control_c_ends_a_command_without_a_word(plugins):
    with subprocess.Popen(
        [Path(sys.executable).with_name("cqos"), "wait"],
        env=os.environ | plugins,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        # A shell that runs the tests in the background makes them ignore SIGINT; nothing else runs between fork and exec.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == b"waiting\n"
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130
    assert b"Traceback" not in said
    assert b"Error" not in said.partition(b"warning: ")[0]
