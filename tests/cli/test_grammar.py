"""One grammar for all commands: of their errors, their arguments, their options and their help."""

import re
from typing import Any

import click
import pytest

from cqos_core.cli.app import cli
from cqos_core.cli.help import short_help
from cqos_core.plugins import load_plugins

NAMES = tuple(load_plugins().commands)
"""The commands, as users write them."""
ERROR = re.compile(r"error(\[\w+\])?:? \S.*")
"""The first line of an error; problems of inputs have their code, as findings have."""


def command_of(name):
    """Return a command as the group hands it out, with its context."""
    ctx = click.Context(cli, info_name="cqos", terminal_width=100)
    command: Any = cli
    for word in name.split():
        command = command.get_command(ctx, word)
        ctx = click.Context(command, info_name=word, parent=ctx, terminal_width=100)
    return command, ctx


WRONG = {
    "an option that is none": ["--no-such-option"],
    "a value that is none": ["--format", "no-such-format"],
    "an option without its value": ["--output"],
}


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("name", NAMES)
def test_wrong_usage_says_what_is_wrong_and_what_to_write(cqos, name, wrong):
    done = cqos(*name.split(), *WRONG[wrong])
    first, *rest = done.err.splitlines()
    assert (done.code, done.out) == (2, "")
    assert ERROR.fullmatch(first)
    assert rest
    assert all(line.startswith("help: ") for line in rest)


@pytest.mark.parametrize("name", [name for name in NAMES if any(p.required for p in command_of(name)[0].params)])
def test_what_is_missing_is_named(cqos, name):
    done = cqos(*name.split())
    assert done.code == 2
    assert re.fullmatch(rf"error: \S.* is missing\nhelp: write `cqos {name}[^`]* [A-Z{{][^`]*`; .*\n", done.err)


@pytest.mark.parametrize(
    ("arguments", "error", "advice"),
    [
        (["chekc"], "there is no command `chekc`", "did you mean `check`?"),
        (["check", "--fxi", "a.yaml"], "there is no option `--fxi`", "did you mean `--fix`?"),
        (
            ["check", "--fail-on", "loud", "fits.yaml"],
            "--fail-on: 'loud' is not one of 'error', 'warning'",
            "cqos check",
        ),
        (["check", "fits.yaml", "--output"], "option '--output' requires an argument", "write `cqos check PATH...`"),
        (["check", "fits.yaml", "--option", "rmw"], "--option: `rmw` is not of the form", "for instance ros2.rmw"),
        (
            ["check", "fits.yaml", "--protocol", "rso2"],
            "--protocol: there is no rule pack `rso2`",
            "did you mean `ros2`?",
        ),
        (["check", "fits.yaml", "--output", "."], "--output: `.` is a folder", "name a file in it"),
        (["schema", "more"], "got unexpected extra argument (more)", "write `cqos schema`"),
        (["convert", "fits.yaml"], "--to is missing", "write `cqos convert PATH... --to EXPORTER`"),
        (["packs", "rso2"], "ID: there is no rule pack `rso2`", "did you mean `ros2`?"),
        (["explain", "fits.yaml", "half"], "`half` is no path", "`cqos explain fits.yaml` lists them"),
        (["init", "."], "cqos.toml is there already", "remove it first"),
        (["serve", "--listen", "here"], "--listen `here` is no address", "write host:port"),
        (["serve", "--modeler"], "--modeler serves the page", "write --web HOST:PORT too"),
        (["modeler", "."], ". is a folder", "name a diagram"),
    ],
)
def test_errors_have_one_form(cqos, files, arguments, error, advice):
    (files / "cqos.toml").write_text("")
    done = cqos(*arguments)
    lines = done.err.splitlines()
    assert (done.code, lines[0].startswith(f"error: {error}")) == (2, True), done.err
    assert lines[1].startswith("help: ")
    assert advice in lines[1]


def test_a_command_line_without_a_command_gets_the_help(cqos):
    done = cqos()
    assert done.code == 2
    assert done.err == cqos("--help").out


# Help -----------------------------------------------------------------------------------------------------------


SCREEN = 24


@pytest.mark.parametrize("name", ["", *NAMES, "snapshot"])
def test_help_fits_on_a_screen_and_says_where_the_rest_is(name):
    _, ctx = command_of(name)
    lines = short_help(ctx).splitlines()
    assert len(lines) <= SCREEN
    assert max(map(len, lines)) <= 100
    assert "--help-all" in "\n".join(lines)


@pytest.mark.parametrize("name", NAMES)
def test_help_all_has_every_option_and_the_exit_codes(cqos, name):
    command, _ = command_of(name)
    text = cqos(*name.split(), "--help-all").out
    assert [option for param in options_of(command) for option in param.opts if option not in text] == []
    assert "Exit codes" in " ".join(text.split())


@pytest.mark.parametrize("name", NAMES)
def test_what_help_describes_are_options_of_the_command(name):
    command, _ = command_of(name)
    known = {option for param in options_of(command) for option in param.opts}
    assert {*getattr(command.callback, "usual_options", ())} <= known


def test_help_of_the_group_names_every_command(cqos):
    text = cqos("--help").out
    assert [name for name in NAMES if not re.search(rf"\b{name.split()[0]}\b", text)] == []
    assert all(name in cqos("--help-all").out for name in NAMES)


def options_of(command):
    return [param for param in command.params if isinstance(param, click.Option)]


# Options and arguments ------------------------------------------------------------------------------------------


OPTIONS = [(name, option) for name in NAMES for option in options_of(command_of(name)[0])]


def test_each_option_has_one_meaning():
    texts: dict[str, set[str]] = {}
    for _, option in OPTIONS:
        for spelling in option.opts:
            texts.setdefault(spelling, set()).add(option.help)
    assert {spelling: found for spelling, found in texts.items() if len(found) > 1} == {}


def test_each_meaning_has_one_option():
    names: dict[str, set[str]] = {}
    for _, option in OPTIONS:
        names.setdefault(option.help, set()).add(max(option.opts, key=len))
    assert {text: found for text, found in names.items() if len(found) > 1 or not text} == {}


def test_no_option_is_called_as_a_command_that_does_something_else():
    commands = {word for name in NAMES for word in name.split()}
    called = {spelling for _, option in OPTIONS for spelling in option.opts if spelling.lstrip("-") in commands}
    # What `cqos diff`, `cqos modeler` and `cqos launch` are about, these options bring to another command.
    assert called == {"--diff", "--modeler", "--launch"}


def test_every_command_shows_tracebacks_on_request():
    assert [
        name for name in NAMES if "--debug" not in {n for o in options_of(command_of(name)[0]) for n in o.opts}
    ] == []


INPUTS = {"PATH", "FILE", "DIR", "SOURCE", "LOG", "URL", "PACK", "CASES"}
IN_THEM = {"TOPIC", "CODE", "ID", "PUBLISHER", "SUBSCRIBER", "bash", "zsh", "fish"}
"""Names of something in the inputs, or in C-QoS itself."""


@pytest.mark.parametrize("name", NAMES)
def test_inputs_come_first_then_names(name):
    command, ctx = command_of(name)
    words = [
        word
        for param in command.params
        if isinstance(param, click.Argument)
        for word in re.findall(r"\w+", param.make_metavar(ctx))
    ]
    assert {*words} <= INPUTS | IN_THEM
    assert words == sorted(words, key=lambda word: word in IN_THEM)
