"""What a user sees and pipes: the installed command in a process of its own."""

import errno
import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from cqos_core.cli import progress
from cqos_core.cli.progress import Progress

terminal = pytest.mark.skipif(os.name == "nt", reason="needs pseudo-terminals")


COMMAND = str(Path(sys.executable).with_name("cqos"))


def in_terminal(*arguments, **environ):
    """Run the command with a terminal as standard output and error; return what stands on it."""
    import pty

    master, slave = pty.openpty()
    left = {name: value for name, value in os.environ.items() if name not in {"NO_COLOR", "TERM"}}
    process = subprocess.Popen(
        [COMMAND, *arguments],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        env={**left, "TERM": "xterm", **environ},
    )
    os.close(slave)
    shown = b""
    while True:
        try:
            piece = os.read(master, 65536)
        except OSError as error:
            if error.errno != errno.EIO:  # what Linux says at the end
                raise
            break
        if not piece:
            break
        shown += piece
    os.close(master)
    process.wait(timeout=60)
    return shown.decode()


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["check", "fits.yaml"], 0),
        (["check", "clashes.yaml"], 1),
        (["check", "broken.yaml", "clashes.yaml"], 2),
        (["check"], 2),
        (["check", "--nonsense"], 2),
        (["nonsense"], 2),
        ([], 2),
        (["--version"], 0),
        (["--help"], 0),
        (["-h"], 0),
        (["check", "--help"], 0),
        (["schema"], 0),
        (["packs"], 0),
        (["rule", "ROS101"], 0),
        (["rule", "ROS999999"], 2),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_exit_codes(forked, arguments, code):
    """Those of the installed command are the same: see the full disk and the reader that goes away."""
    done = forked(*arguments)
    assert done.code == code
    assert "Traceback" not in done.err
    assert bool(done.out) is (code < 2 or "clashes.yaml" in arguments)


def test_standard_input_is_read_from_a_pipe(real, files):
    done = real("check", "-", "--stdin-name", "designs/x.yaml", stdin=(files / "clashes.yaml").read_text())
    assert done.code == 1
    assert "designs/x.yaml:" in done.out


@pytest.mark.parametrize("arguments", [["check", "clashes.yaml"], ["--help"], ["schema"]], ids=" ".join)
def test_a_reader_that_goes_away_is_no_error(files, arguments):
    read, write = os.pipe()
    os.close(read)
    process = subprocess.run(
        [COMMAND, *arguments], cwd=files, stdout=write, stderr=subprocess.PIPE, check=False, timeout=60
    )
    os.close(write)
    assert process.stderr == b""
    # Findings keep their exit code; a command without findings exits like one whose reader is gone.
    assert process.returncode == {"check": 1, "--help": 141, "schema": 0}[arguments[0]]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")  # noqa: PTH110
@pytest.mark.parametrize("arguments", [["check", "fits.yaml"], ["schema"], ["rule", "ROS101"]], ids=" ".join)
def test_a_full_disk_is_an_error(files, arguments):
    with open("/dev/full", "wb") as full:  # noqa: PTH123
        process = subprocess.run(
            [COMMAND, *arguments], cwd=files, stdout=full, stderr=subprocess.PIPE, check=False, timeout=60
        )
    assert process.returncode == 2
    assert process.stderr == b"error: cannot write to standard output: No space left on device\n"


@pytest.mark.parametrize("closed", ["stdin", "stdout", "stderr"])
def test_closed_streams_do_no_harm(files, closed):
    number = {"stdin": 0, "stdout": 1, "stderr": 2}[closed]
    line = f"'{COMMAND}' check clashes.yaml broken.yaml {number}>&-"
    process = subprocess.run(["sh", "-c", line], cwd=files, capture_output=True, check=False, timeout=60)
    assert process.returncode == 2
    assert b"Traceback" not in process.stderr


def test_an_output_is_utf8_whatever_the_locale(real, files):
    (files / "umlaut.yaml").write_text(
        (files / "clashes.yaml").read_text().replace("lidar", "größe_機"), encoding="utf-8"
    )
    done = real("check", "umlaut.yaml", "--format", "json", PYTHONIOENCODING="ascii", LC_ALL="C", PYTHONUTF8="0")
    assert "größe_機/publisher/scan" in json.dumps(json.loads(done.out), ensure_ascii=False)


# --- colours ---


@terminal
def test_colours_are_for_terminals(files):
    assert "\x1b[" in in_terminal("check", "clashes.yaml")
    assert "\x1b[" in in_terminal("check", "broken.yaml")


@terminal
@pytest.mark.parametrize(
    ("arguments", "environ"),
    [([], {"NO_COLOR": "1"}), ([], {"TERM": "dumb"}), (["--color", "never"], {})],
    ids=["NO_COLOR", "dumb", "never"],
)
def test_colours_can_be_switched_off(files, arguments, environ):
    assert "\x1b[" not in in_terminal("check", "clashes.yaml", "broken.yaml", *arguments, **environ)


def test_colours_can_be_had_anyway(real):
    assert "\x1b[" not in real("check", "clashes.yaml").out
    assert "\x1b[" in real("check", "clashes.yaml", "--color", "always", NO_COLOR="1").out
    assert "\x1b[" in real("check", "clashes.yaml", FORCE_COLOR="1").out
    assert "\x1b[" not in real("check", "clashes.yaml", FORCE_COLOR="1", NO_COLOR="1").out


# --- progress ---


class Terminal:
    """A standard error that is a terminal."""

    def __init__(self):
        self.text = ""

    def isatty(self):
        return True

    def write(self, text):
        self.text += text

    def flush(self):
        pass


@pytest.fixture
def screen(monkeypatch):
    """A terminal, on which progress is shown at once."""
    shown = Terminal()
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=shown))  # pytest has sys.stderr for itself
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(progress, "_PATIENCE", 0)
    monkeypatch.setattr(progress, "_PERIOD", 0.001)
    return shown


def seen(screen, text):
    """Wait until a thread has drawn something."""
    for _ in range(10_000):
        if text in screen.text:
            return True
        time.sleep(0.001)
    return False


def test_progress_is_shown_to_who_waits_and_wiped_away(screen):
    with Progress() as bar:
        bar.start("reading")
        bar.step(3, 12)
        assert seen(screen, "\rreading [######..................] 3/12")
        bar.start("checking")
        assert seen(screen, "checking … ")
    lines = screen.text.split("\r")
    assert lines[-1] == ""
    assert lines[-2].strip() == ""


def test_progress_is_hidden_when_quiet_or_without_a_terminal(screen, monkeypatch):
    for quiet, term, is_terminal in ((True, "xterm", True), (False, "dumb", True), (False, "xterm", False)):
        monkeypatch.setenv("TERM", term)
        monkeypatch.setattr(Terminal, "isatty", lambda _, answer=is_terminal: answer)
        with Progress(quiet=quiet) as bar:
            bar.start("reading")
            bar.step(1, 2)
    assert screen.text == ""


def test_who_waits_less_than_a_second_sees_no_progress(screen, monkeypatch):
    monkeypatch.setattr(progress, "_PATIENCE", 60)
    with Progress() as bar:
        bar.start("reading")
    assert screen.text.strip() == ""


@terminal
@pytest.mark.parametrize(
    ("arguments", "label"),
    [
        (["check", "clashes.yaml", "--format", "html", "--output", "x.html"], "writing"),
        (["explain", "clashes.yaml", "first", "second"], "resolving"),
        (["convert", "clashes.yaml", "--to", "dot"], "writing"),
        (["breaking", "clashes.yaml", "--against", "fits.yaml"], "comparing"),
        (["diff", "clashes.yaml", "--against", "fits.yaml"], "reading"),
    ],
)
def test_each_long_part_of_a_command_has_its_bar(cqos, files, monkeypatch, screen, arguments, label):
    """The terminal sees the name of each part that may take long; here every part counts as long."""
    begun = []
    start = progress.Progress.start

    def begin(bar, name):
        begun.append(name)
        start(bar, name)

    monkeypatch.setattr(progress.Progress, "start", begin)
    cqos(*arguments)
    assert label in begun


def at_terminal(ended, *arguments, **environ):
    """Run the command with a terminal as standard error, and end its input or interrupt it once a bar is there; return what was drawn."""
    import pty

    master, slave = pty.openpty()
    left = {name: value for name, value in os.environ.items() if name not in {"NO_COLOR", "TERM"}}
    process = subprocess.Popen(
        [COMMAND, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=slave,
        env={**left, "TERM": "xterm", **environ},
    )
    os.close(slave)
    shown, end = b"", time.monotonic() + (60 if ended != "quiet" else 4)
    while b"reading" not in shown and time.monotonic() < end:
        if select.select([master], [], [], 0.1)[0]:
            shown += os.read(master, 65536)
    if ended == "interrupted":
        process.send_signal(signal.SIGINT)
    else:
        process.stdin.write(
            b"cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {/a: {}}}, b: {subscribes: {/a: {}}}}\n"
        )
    process.stdin.close()
    code = process.wait(timeout=60)
    while select.select([master], [], [], 0)[0]:
        try:
            shown += os.read(master, 65536)
        except OSError:  # what Linux says at the end
            break
    os.close(master)
    return code, shown.decode()


@terminal
@pytest.mark.parametrize(("ended", "code"), [("fed", 0), ("interrupted", 130)])
def test_a_bar_is_drawn_and_wiped_away_on_a_real_terminal(ended, code):
    found, shown = at_terminal(ended, "check", "-", NO_COLOR="1")
    assert found == code
    assert re.search(r"reading … \d s", shown)
    assert "\x1b[" not in shown
    assert re.search(r"\r {10,}\r(?!.*reading)", shown, re.DOTALL)


@terminal
def test_quiet_draws_nothing_on_a_real_terminal():
    assert at_terminal("quiet", "check", "--quiet", "-") == (0, "")


# --- width ---


@terminal
@pytest.mark.parametrize("columns", [40, 80])
def test_findings_are_as_wide_as_the_terminal(files, columns):
    """Lines fit a narrow terminal, but for paths, the text of the file, and the last line, which is one line anywhere."""
    text = in_terminal("check", "clashes.yaml", COLUMNS=str(columns), NO_COLOR="1")
    shown = [line for line in text.splitlines() if line and not re.match(r"\s*(\d* \||-->|:::)|clashes.yaml: ", line)]
    assert len(shown) > 5
    assert columns * 0.7 < max(map(len, shown)) <= columns
