"""Plugins add packs, importers, formatters and commands; a broken one harms nothing."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

GOOD = """
import click
from cqos_core.plugins import CommandInfo, FormatterInfo, ImporterInfo, hookimpl

@hookimpl
def register_formatters(register):
    register(FormatterInfo("shout", "loud", "fine_plugin:shout"))
    register(FormatterInfo("crash", "fails", "fine_plugin:crash"))

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

def crash(report, style):
    return 1 / 0

def claims(name, head):
    return name.endswith(".csv")

def read(source, context):
    from cqos_core.system import Endpoint, Participant, System
    system = System(name="table", protocol="ros2", sources={source.name: source.data})
    if b"crash" in source.data:
        raise KeyError("x")
    for line in source.data.decode().split():
        who, role, topic = line.split(",")
        system.participants[who] = Participant(who)
        system.endpoints.append(Endpoint(f"{who}/{role}/{topic}", role, topic, who))
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


def test_what_plugins_add_is_used(real, plugins, files):
    (files / "table.csv").write_text("lidar,publisher,scan\nplanner,subscriber,scan\n")
    assert real("check", "table.csv", "--format", "shout", **plugins)[:2] == (0, "COMPATIBLE!\n")
    assert real("check", "table.csv", "fits.yaml", "--format", "shout", **plugins)[:2] == (0, "COMPATIBLE!\n")
    assert real("greet", "world", **plugins)[:2] == (5, "hello world\n")


def test_commands_of_plugins_stand_in_the_help(real, plugins):
    out = real("--help", **plugins).out
    assert "Commands of plugins:\n  greet" in out
    assert "Say hello." in out


def test_a_broken_plugin_is_reported_and_harms_nothing(real, plugins):
    done = real("check", "clashes.yaml", **plugins)
    assert done.code == 1
    assert "error[ROS101]" in done.out
    assert f"warning: {BROKEN}\n" in done.err
    assert "thief_plugin 1.2.3 could not be loaded" in done.err
    assert "formatter `json`, which cqos " in done.err
    assert "`awful`" in done.err
    assert real("check", "clashes.yaml", "--quiet", **plugins) == (1, "", "")


def test_a_pack_that_cannot_be_imported_is_left_out(real, plugins, files):
    (files / "half.yaml").write_text((files / "fits.yaml").read_text().replace("ros2", "half"))
    done = real("check", "half.yaml", "clashes.yaml", "--each", **plugins)
    assert done.code == 2
    assert "CQ201" in done.out
    assert "error[ROS101]" in done.out
    assert "rule pack `half` of half_plugin 1.2.3 could not be loaded and is left out: ModuleNotFoundError" in done.err
    assert real("rule", "ROS101", **plugins).code == 0


def test_broken_plugins_are_listed_with_the_packs(real, plugins):
    done = real("packs", **plugins)
    assert done.code == 0
    broken = done.out.partition("\nBroken plugins\n")[2]
    for name in ("broken_plugin", "half", "thief_plugin"):
        assert f"  {name} " in broken
    assert "fine_plugin 1.2.3" in done.out
    assert "it never worked" not in done.err
    assert "could not be loaded" in real("packs", "half", **plugins).err


def test_a_command_that_cannot_be_imported(real, plugins):
    done = real("gone", **plugins)
    assert done.code == 2
    assert "The command `gone` of fine_plugin 1.2.3 cannot be loaded: ModuleNotFoundError" in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["check", "fits.yaml", "--format", "crash"], "formatter `crash` of fine_plugin 1.2.3 failed: ZeroDivision"),
        (["check", "crash.csv"], "crash.csv: importer `csv` of fine_plugin 1.2.3 failed: KeyError: 'x'\n"),
    ],
    ids=["formatter", "importer"],
)
def test_a_plugin_that_fails_is_named(real, plugins, files, arguments, said):
    (files / "crash.csv").write_text("crash")
    done = real(*arguments, **plugins)
    assert done.code == 2
    assert said in done.err
    assert "Traceback" not in done.err


@pytest.mark.skipif(os.name == "nt", reason="Windows has other signals")
def test_control_c_ends_a_command_without_a_word(plugins):
    process = subprocess.Popen(
        [Path(sys.executable).with_name("cqos"), "wait"],
        env=os.environ | plugins,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"waiting\n"
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"Traceback" not in said
    assert b"Error" not in said.partition(b"warning: ")[0]
