"""Plugins are found, loaded one at a time, and kept apart."""

import logging
import sys
import tomllib
from importlib.metadata import EntryPoint, distributions, entry_points
from pathlib import Path

import pytest

from cqos_core.files.importer_choice import default_protocol
from cqos_core.model.problems import MissingError
from cqos_core.plugins import (
    KINDS,
    CommandInfo,
    ExporterInfo,
    FormatterInfo,
    FunctionInfo,
    ImporterInfo,
    RulePackInfo,
    function,
    load_from,
    load_plugins,
)
from tests.plugins.distributions import install

HOOK = """
from cqos_core.plugins import *
from cqos_core.plugins import hookimpl

@hookimpl
def {hook}(register):
    register({info})
"""
OURS = "the C-QoS authors"
ROOT = Path(__file__).resolve().parents[1]


def plugin(info, hook="register_formatters"):
    """The text of a plugin that registers one thing."""
    return HOOK.format(hook=hook, info=info)


def formatter(name):
    return plugin(f'FormatterInfo("{name}", "a summary", "some_module:render")')


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder for plugins, whose modules are forgotten afterwards."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def load(site, only=None):
    """Load the plugins of a folder, beside those of the core."""
    core = entry_points(group="cqos", name="core")
    return load_from([*core, *(entry for each in distributions(path=[str(site)]) for entry in each.entry_points)], only)


def only_broken(site):
    (broken,) = load(site).broken
    return broken


# What is found


def test_what_we_ship_is_registered_through_entry_points():
    plugins = load_plugins()
    assert plugins.owner("importers", "yaml").startswith("cqos-core ")
    assert plugins.owner("packs", "ros2").startswith("cqos-ros2 ")
    assert all(plugins.shipped(*key) for key in plugins.owners if key[1] in {"yaml", "bpmn", "ros2", "check", "full"})


def test_everything_is_registered_under_its_kind(site):
    values = {
        "packs": 'RulePackInfo("one", "a summary", "some_module:ONE")',
        "importers": 'ImporterInfo("two", "a summary", (".two",), "some_module:claims", "some_module:read")',
        "exporters": 'ExporterInfo("three", "a summary", ".three", "some_module:write")',
        "formatters": 'FormatterInfo("four", "a summary", "some_module:render")',
        "functions": 'FunctionInfo("six", "a summary", "some_module:six")',
        "commands": 'CommandInfo("five", "A summary.", "some_module:five")',
    }
    for name, info in values.items():
        install(site, (f"plugin_{name}", plugin(info, KINDS[name].hook)))
    plugins = load(site)
    assert plugins.broken == []
    assert plugins.packs["one"] == RulePackInfo("one", "a summary", "some_module:ONE")
    assert plugins.importers["two"] == ImporterInfo(
        "two", "a summary", (".two",), "some_module:claims", "some_module:read"
    )
    assert plugins.exporters["three"] == ExporterInfo("three", "a summary", ".three", "some_module:write")
    assert plugins.formatters["four"] == FormatterInfo("four", "a summary", "some_module:render")
    assert plugins.functions["six"] == FunctionInfo("six", "a summary", "some_module:six")
    assert plugins.commands["five"] == CommandInfo("five", "A summary.", "some_module:five")
    assert plugins.owner("commands", "five") == "plugin-commands 1.0"
    assert not plugins.shipped("commands", "five")


def test_what_is_registered_is_imported_on_use(site):
    (site / "lazy_parts.py").write_text("def write(system):\n    return system.name\n")
    install(
        site, ("lazy_plugin", plugin('ExporterInfo("lazy", "x", ".lazy", "lazy_parts:write")', "register_exporters"))
    )
    info = load(site).exporters["lazy"]
    assert "lazy_parts" not in sys.modules
    assert info.load().__name__ == "write"


def test_a_command_is_listed_behind_the_one_that_it_names(site):
    for name, after in (("one", ""), ("two", "three"), ("four", "one"), ("three", "nothing")):
        install(
            site, (f"plugin_{name}", plugin(f'CommandInfo("{name}", "x", "m:x", after="{after}")', "register_commands"))
        )
    assert list(load(site).commands)[-4:] == ["one", "four", "three", "two"]


def test_commands_that_name_each_other_are_listed(site):
    for name, after in (("one", "two"), ("two", "one")):
        install(
            site, (f"plugin_{name}", plugin(f'CommandInfo("{name}", "x", "m:x", after="{after}")', "register_commands"))
        )
    assert list(load(site).commands)[-2:] == ["one", "two"]


def test_a_function_that_no_plugin_has():
    with pytest.raises(MissingError, match=r"^no plugin has the function `nothing`"):
        function("nothing")


# Precedence


@pytest.mark.parametrize("project", ["", *(path.parent.name for path in ROOT.glob("plugins/*/pyproject.toml"))])
def test_what_we_ship_is_known_by_its_authors(project):
    path = ROOT / "plugins" / project if project else ROOT
    authors = tomllib.loads((path / "pyproject.toml").read_text(encoding="utf-8"))["project"]["authors"]
    assert authors == [{"name": OURS}]


def test_a_name_we_ship_cannot_be_taken_whatever_the_order(site):
    install(site, ("zzz_ours", formatter("pretty")), author=OURS, version="0.1")
    install(site, ("aaa_theirs", formatter("pretty")))
    plugins = load(site)
    assert plugins.owner("formatters", "pretty") == "zzz-ours 0.1"
    (broken,) = plugins.broken
    assert str(broken) == (
        "plugin `aaa_theirs` of aaa-theirs 1.0 could not be loaded and is left out: "
        "it registers formatter `pretty`, which zzz-ours 0.1 already provides"
    )


def test_between_others_the_name_decides(site):
    for name in ("b_plugin", "a_plugin"):
        install(site, (name, formatter("pretty")))
    plugins = load(site)
    assert plugins.owner("formatters", "pretty") == "a-plugin 1.0"
    assert [broken.name for broken in plugins.broken] == ["b_plugin"]


def test_a_protocol_of_ours_stays_the_default_of_a_format(site):
    def pack(name):
        return plugin(f'RulePackInfo("{name}", "x", "m:P", default_for=("bpmn", "csv"))', "register_rule_packs")

    install(site, ("first_pack", pack("first")))
    assert default_protocol("csv", load(site)) == "first"
    install(site, ("second_pack", pack("second")))
    assert default_protocol("csv", load(site)) is None
    install(site, ("our_pack", pack("ours")), author=OURS)
    assert default_protocol("bpmn", load(site)) == "ours"


# Which distributions are wanted


@pytest.mark.parametrize(
    ("only", "loaded"),
    [
        (None, ["ours", "one", "two"]),
        ("", ["ours"]),
        (" , ", ["ours"]),
        ("plugin-one", ["ours", "one"]),
        ("Plugin_One, plugin.two", ["ours", "one", "two"]),
    ],
)
def test_only_wanted_distributions_are_loaded(site, only, loaded):
    install(site, ("plugin_ours", formatter("ours")), author=OURS)
    install(site, ("plugin_one", formatter("one")))
    install(site, ("plugin_two", formatter("two")))
    plugins = load(site, only)
    assert [name for name in plugins.formatters if name in {"ours", "one", "two"}] == loaded
    assert plugins.broken == []


def test_a_requested_distribution_that_is_missing_is_reported(site):
    (broken,) = load(site, "nobody").broken
    assert str(broken).startswith("plugin `nobody` could not be loaded and is left out: CQOS_LOAD_PLUGINS names it")


# What is refused


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (formatter("Pretty"), "its formatter `Pretty` needs a name of lower-case letters, digits, `-` and `_`"),
        (plugin('FormatterInfo(7, "x", "m:f")'), "its formatter `7` needs a name of"),
        (plugin('FormatterInfo("a", None, "m:f")'), "its formatter `a` needs a summary"),
        (plugin('FormatterInfo("a", "x", "m")'), "its formatter `a` has the renderer 'm', where \"module:object\""),
        (plugin('FormatterInfo("a", "x", print)'), "its formatter `a` has the renderer <built-in function print>"),
        (
            plugin('ImporterInfo("a", "x", ".csv", "m:c", "m:r")', "register_importers"),
            "its importer `a` has the suffixes '.csv', where a tuple of texts is expected",
        ),
        (
            plugin('ImporterInfo("a", "s", (), "m:c", "m:r", folder_suggestions="m:e")', "register_importers"),
            "its importer `a` has `folder_suggestions`, but `options` lacks the option with which it reads folders",
        ),
        (
            plugin('RulePackInfo("a", "x", "m:P", default_for=["bpmn"])', "register_rule_packs"),
            "its rule pack `a` has the default_for ['bpmn'], where a tuple of texts is expected",
        ),
        (plugin("None"), "its `register_formatters` registers None, which is no FormatterInfo"),
        (
            formatter("twice") + '    register(FormatterInfo("twice", "x", "m:f"))\n',
            "it registers formatter `twice`, which it itself already provides",
        ),
        ("", "it implements no hook; is `@hookimpl` missing?"),
        (
            formatter("a").replace("(register)", "()").replace("register(F", "print(F"),
            "its `register_formatters` lacks the argument `register`",
        ),
    ],
)
def test_a_plugin_that_would_make_trouble_later_is_refused(site, text, reason):
    install(site, ("troublesome", text))
    broken = only_broken(site)
    assert (broken.name, broken.distribution) == ("troublesome", "troublesome 1.0")
    assert broken.reason.startswith(reason)


def test_a_plugin_is_registered_as_a_whole_or_not_at_all(site):
    install(site, ("half", formatter("good") + '    register(FormatterInfo("Bad", "x", "m:f"))\n'))
    plugins = load(site)
    assert "good" not in plugins.formatters
    assert len(plugins.broken) == 1


def test_the_remains_of_an_uninstalled_plugin_are_reported(site):
    install(site, ("remains", "raise ImportError('gone')"), version=None)
    broken = only_broken(site)
    assert "could not be loaded and is left out: ImportError: gone" in str(broken)


def test_a_plugin_whose_distribution_has_lost_its_name_is_reported(site):
    install(site, ("nameless", "raise ImportError('gone')"))
    metadata = site / "nameless-1.0.dist-info" / "METADATA"
    metadata.write_text("Metadata-Version: 2.1\nAuthor: Another\n", encoding="utf-8")
    broken = only_broken(site)
    assert (broken.name, broken.distribution) == ("nameless", "an unknown distribution")


def test_an_entry_point_without_a_distribution_is_loaded():
    plugins = load_from([EntryPoint("loose", "no_such_module", "cqos")])
    assert str(plugins.broken[0]).startswith("plugin `loose` of an unknown distribution could not be loaded")


# Packs


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("PACK = 1", "`pack_parts:PACK` is a value of type int, not a RulePack"),
        (
            'from cqos_core.packs.pack import RulePack\nPACK = RulePack("other", "Other", (), ())',
            "`pack_parts:PACK` has the id `other`, but is registered as `mine`",
        ),
        ("import sys\nsys.exit(3)", "SystemExit: 3"),
        ("", "AttributeError: module 'pack_parts' has no attribute 'PACK'"),
    ],
)
def test_an_invalid_pack_is_left_out_and_reported_once(site, text, reason):
    (site / "pack_parts.py").write_text(text)
    install(site, ("pack_plugin", plugin('RulePackInfo("mine", "x", "pack_parts:PACK")', "register_rule_packs")))
    plugins = load(site)
    assert plugins.broken == []
    assert plugins.pack("mine") is None
    assert plugins.pack("mine") is None
    (broken,) = plugins.broken
    assert str(broken) == f"rule pack `mine` of pack-plugin 1.0 could not be loaded and is left out: {reason}"


def test_a_pack_that_is_not_installed_is_none():
    plugins = load_from([])
    assert plugins.pack("mine") is None
    assert plugins.broken == []


# Whose fault it is


def test_an_error_is_traced_to_the_plugin_that_raised_it(site):
    install(site, ("guilty", formatter("a") + "def call(function):\n    return function()\n"), version="7.1")
    plugins = load(site)
    guilty = sys.modules["guilty"]
    with pytest.raises(ZeroDivisionError) as raised:
        guilty.call(lambda: 1 / 0)
    culprit = plugins.culprit(raised.value)
    assert culprit is not None
    assert (culprit.plugin, culprit.distribution) == ("guilty", "guilty 7.1")
    assert plugins.culprit(ValueError("raised by nobody")) is None


def test_the_traceback_of_a_broken_plugin_can_be_seen(site, caplog):
    install(site, ("secretive", "1 / 0"))
    with caplog.at_level(logging.DEBUG, "cqos_core"):
        load(site)
    assert "plugin `secretive` of secretive 1.0 could not be loaded" in caplog.text
    assert 'secretive.py", line 1, in <module>' in caplog.text
