"""Texts as people write them by mistake, and what the command says to the letter.

The first thirty were chosen from forty after a run. The next forty were listed before any of them was run: the ten that were left out,
and thirty new ones. Later ones came from use, and from
lists of mistakes by class that were rated before and after the messages were rewritten. Three are mistakes in a configuration. ``python -m tests.cli.test_mistakes`` writes the texts anew; then read
them as the person who made the mistake.
"""

import io
import os
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from cqos_core.cli import main
from tests.command_process import run

FOLDER = Path(__file__).with_name("mistakes")
FILES = sorted([*FOLDER.glob("*.yaml"), *FOLDER.glob("*.toml")])
RIGHT = {"lease-name", "never", "option-value", "wrong-indent"}
"""What only looks like a mistake: other names of policies and values, and another indentation."""
DOUBTFUL = {"setting-twice", "settings-with-dashes"}
"""What has a meaning of its own, which was perhaps not meant: a warning says what to write."""


def said(file):
    files = ["no-protocol.yaml", "--config", file.name] if file.suffix == ".toml" else [file.name, "--no-config"]
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed), redirect_stderr(printed):
        patch.chdir(FOLDER)
        patch.setenv("COLUMNS", "100")
        code = main(["check", *files])
    return f"{printed.getvalue()}exit code {code}\n"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_mistake_is_named_with_its_place_and_what_to_do(file):
    text = said(file)
    assert text == file.with_suffix(".txt").read_text(encoding="utf-8")
    assert f"{file.name}:" in text
    assert (": compatible: " in text) == (file.stem in RIGHT | DOUBTFUL)
    assert file.stem in RIGHT or "help: " in text or "must be " in text


OTHERS = {
    "broker.conf": ("max_queued_messages = 100\n", ["check"], "help: write `max_queued_messages 100`"),
    "pack.yaml": (
        "cqos-pack: 1\nid: mine\ntitle: Mine\nrules: {M101: {}}\n",
        ["test-pack"],
        "did you mean `cqos_pack`?",
    ),
    "role.yaml": (
        "cqos: 1\nprotocol: mqtt\nparticipants: {a: {publishes: {t: {}}}, b: {subscribes: {t: {retain: true}}}}\n",
        ["check"],
        "|                                                              ^^^^^^\n",
    ),
    "commas.json": (
        '{"cqos": 1, "protocol": "dds", "participants": {"a": {"publishes": {"T": {"reliability": "reliable",,}}}}}\n',
        ["check"],
        "this is not JSON: one comma too many",
    ),
    "claimed.yaml": (
        "cqos: 1\nasyncapi: 2.0.0\nprotocol: mqtt\n",
        ["check"],
        "help: choose one with --from: `--from yaml` or `--from asyncapi`",
    ),
    "starts.yaml": (
        "cqos: 1\nprotocol: ros2\nparticipants: {a: {publishes: {t: {liveliness: automatically}}}}\n",
        ["check"],
        "did you mean `automatic`?",
    ),
}


@pytest.mark.parametrize("name", OTHERS)
def test_mistakes_in_other_files_say_what_to_write(name, tmp_path):
    text, command, expected = OTHERS[name]
    (tmp_path / name).write_text(text, encoding="utf-8")
    done = run([*command, name], tmp_path, {**os.environ, "COLUMNS": "100"}, together=True)
    assert expected in done.out, done.out
    assert "lacks the key `cqos_pack`" not in done.out


def test_there_are_at_least_seventy():
    assert len(FILES) >= 70


if __name__ == "__main__":
    for each in FILES:
        each.with_suffix(".txt").write_text(said(each), encoding="utf-8")
