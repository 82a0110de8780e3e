"""Unsaved work when `cqos modeler` ends, a save fails, or the modeler is started again."""

import json
import os
import re
import shutil
import stat
import sys

import pytest

from cqos_core.service import modeler_state
from cqos_core.service.modeler_state import Drafts
from tests.modeler.conftest import NAME, ROOT, Running
from tests.modeler.test_files import ask

REQUEST = "Drone_ThrowReq"
GONE = f'[data-element-id="{REQUEST}"]'


@pytest.fixture
def file(tmp_path):
    made = tmp_path / NAME
    shutil.copy(ROOT / "examples" / NAME, made)
    return made


def port_of(running):
    return re.search(r":(\d+)/", running.page)[1]


def left(shown):
    """Close a page whose service has ended: it complains that it cannot reach it."""
    shown.leave()
    assert all("Failed to load resource" in each for each in shown.complaints)
    shown.complaints.clear()


def drafts(folder):
    """The files of drafts that a modeler keeps."""
    return list((folder / "state").rglob("*.json"))


def deleted(shown):
    """Delete an event, and wait until the change is kept."""
    return shown.choose(REQUEST).press("Delete").kept()


def test_a_draft_is_there_after_the_modeler_was_ended_and_started_on_another_port(run_modeler, show, file, tmp_path):
    before = file.read_bytes()
    first = run_modeler(file)
    deleted(show(first.address)).leave()
    assert first.stop() == 0
    kept = drafts(tmp_path)
    assert [stat.S_IMODE(each.stat().st_mode) for each in (*kept, kept[0].parent)] == [0o600, 0o700]

    second = run_modeler(file)
    assert port_of(second) != port_of(first)
    shown = show(second.address)
    shown.notice("were recovered").wait_for()
    assert re.search(r"recovered \(.*\d:\d\d.*\)", shown.notice("were recovered").inner_text())
    assert shown.is_edited
    assert shown.page.locator(GONE).count() == 0
    assert file.read_bytes() == before
    shown.leave()
    second.stop()

    # It is there again until it is discarded.
    third = run_modeler(file)
    shown = show(third.address)
    shown.notice("were recovered").get_by_role("button", name="Discard them").click()
    shown.page.locator(f".djs-shape{GONE}").wait_for()
    shown.notice("were recovered").wait_for(state="detached")
    assert not shown.is_edited
    assert file.read_bytes() == before
    assert drafts(tmp_path) == []
    # A save removes one, too.
    deleted(shown)
    assert len(drafts(tmp_path)) == 1
    shown.saved(NAME).leave()
    assert f'id="{REQUEST}"' not in file.read_text()
    assert drafts(tmp_path) == []


def test_a_draft_of_a_diagram_without_a_file_is_offered_in_the_same_folder(run_modeler, show):
    first = run_modeler()
    shown = show(first.address)
    shown.page.locator(".canvas svg").first.focus()
    shown.press("n", "Enter").kept()
    shown.leave()
    first.stop()
    shown = show(run_modeler().address)
    assert not shown.is_edited
    shown.notice("were kept").get_by_role("button", name="Recover").click()
    shown.page.wait_for_selector('.djs-shape[data-element-id^="Event_"]')
    assert shown.is_edited


def test_a_save_works_after_the_modeler_was_started_again_on_its_port(run_modeler, show, file, tmp_path):
    first = run_modeler(file)
    shown = show(first.address)
    shown.expected = "403"
    deleted(shown)
    first.stop()
    other = tmp_path / "other.bpmn"
    shutil.copy(ROOT / "examples" / "smart_agriculture_incompatible.bpmn", other)
    again = Running("--port", port_of(first), other, file, folder=tmp_path)  # the file has another number now
    try:
        untouched = other.read_bytes()
        shown.saved(NAME)
        assert f'id="{REQUEST}"' not in file.read_text()
        assert other.read_bytes() == untouched
        # A page that is loaded again goes on, too.
        shown.page.reload()
        shown.ready()
        shown.page.get_by_role("button", name="Recent files").click()
        shown.page.get_by_role("menuitem", name=NAME).first.wait_for()
        left(shown)
    finally:
        again.stop()


def test_a_save_that_fails_says_why_and_what_to_do(run_modeler, show, file, tmp_path):
    first = run_modeler(file)
    shown = show(first.address)
    shown.expected = "403"
    shown.page.evaluate("() => { delete window.showSaveFilePicker; }")  # no test can answer the dialog of the system
    deleted(shown)
    shown.page.evaluate("sessionStorage.removeItem('cqos-resume')")
    first.stop()
    # There is no modeler: a copy can be saved.
    shown.press("Control+s")
    notice = shown.notice(f"{NAME} was not saved")
    notice.get_by_text("`cqos modeler` does not answer; start it again").wait_for()
    with shown.page.expect_download() as waiting:
        notice.get_by_role("button", name="Save a copy").click()
    assert waiting.value.suggested_filename == "smart_agriculture-copy.bpmn"
    text = waiting.value.path().read_text(encoding="utf-8")
    assert f'id="{REQUEST}"' not in text
    assert "The smart agriculture case study" in text
    assert shown.is_edited
    # There is one that the page does not know: the address that it printed connects them.
    again = Running("--port", port_of(first), file, folder=tmp_path)
    try:
        shown.press("Control+s")
        shown.notice("open the address that it printed in this tab").wait_for()
        assert shown.is_edited
        shown.page.goto(again.address)  # another hash only: the page is not loaded again
        shown.notice("was not saved").get_by_role("button", name="Save again").click()
        shown.page.wait_for_function("() => !document.title.startsWith('•')")
        assert f'id="{REQUEST}"' not in file.read_text()
        assert shown.notice("was not saved").count() == 0
        left(shown)
    finally:
        again.stop()


@pytest.mark.skipif(os.name == "nt", reason="a pipe with a name is the browser")
def test_a_ticket_holds_until_it_is_used(built, file, tmp_path):
    pipe, opener = tmp_path / "pipe", tmp_path / "opener.py"
    os.mkfifo(pipe)
    opener.write_text("import sys; from pathlib import Path; Path(sys.argv[1]).write_text(sys.argv[2])\n")
    running = Running(file, folder=tmp_path, browser=f"{sys.executable} {opener} {pipe} %s")
    try:
        ticket = pipe.read_text().partition("#ticket=")[2]  # waits for the browser

        def exchanged(given):
            return ask(running, "POST", "/files/key", x_cqos_key=given)

        assert [exchanged(each)[0] for each in ("", "guess", ticket[:-1])] == [403, 403, 403]
        assert json.loads(exchanged(ticket)[2]) == {"key": running.key}
        assert exchanged(ticket)[0] == 403
    finally:
        running.stop()


def test_drafts_need_the_key_and_have_bounds(shared):
    running, before = shared[0], {*drafts(shared[1].parent)}
    draft = json.dumps({"name": NAME, "text": "<a/>", "original": None, "tag": None, "time": 1, "file": 0})

    def known(method, path, body=None):
        return ask(running, method, path, body, x_cqos_key=running.key)[0]

    assert [
        ask(running, *each)[0] for each in (("GET", "/drafts"), ("PUT", "/drafts/a", draft), ("DELETE", "/drafts/a"))
    ] == [403] * 3
    assert known("PUT", "/drafts/a-1", draft) == 204
    for path, body in (
        ("/drafts/..%2Fb", draft),
        ("/drafts/B", draft),
        ("/drafts/b", "[]"),
        ("/drafts/b", "{"),
        ("/drafts/b", draft.replace("0}", "1}")),
    ):
        assert known("PUT", path, body) in (400, 404), path
    assert known("PUT", "/drafts/b", b" " * (64 * 1024 * 1024 + 1)) == 413
    assert [each.name for each in {*drafts(shared[1].parent)} - before] == ["a-1.json"]
    # Its own drafts are those of the tabs that are open: the page gets those of earlier runs only.
    assert json.loads(ask(running, "GET", "/drafts", x_cqos_key=running.key)[2]) == {"drafts": []}
    assert known("DELETE", "/drafts/a-1") == known("DELETE", "/drafts/a-1") == 204


def kept(tab, number, files):
    drafts = Drafts(files)
    drafts.keep(tab, {"name": tab, "text": "", "file": number})


def test_a_run_gets_the_drafts_of_its_files_and_of_its_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    here, elsewhere = tmp_path / "here", tmp_path / "elsewhere"
    for each in (here, elsewhere):
        each.mkdir()
    (here / "link.bpmn").symlink_to(here / "a.bpmn")
    monkeypatch.chdir(here)
    files = (str(here / "a.bpmn"), str(here / "b.bpmn"))
    kept("a", 0, files)
    kept("b", 1, files)
    kept("new", None, files)
    monkeypatch.chdir(elsewhere)
    kept("far", None, files)

    def found(*files):
        return sorted((each["tab"], each["file"]) for each in Drafts(files).earlier())

    assert found(files[1], str(here / "link.bpmn")) == [("a", 1), ("b", 0), ("far", None)]
    monkeypatch.chdir(here)
    assert found() == [("new", None)]


def test_the_oldest_drafts_make_room(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(modeler_state, "MOST_DRAFTS", 3)
    for number in range(5):
        kept(f"tab-{number}", None, ())
        os.utime(tmp_path / "cqos" / "drafts" / f"tab-{number}.json", (number, number))
    kept("last", None, ())
    assert {each["tab"] for each in Drafts(()).earlier()} == {"last", "tab-3", "tab-4"}


def test_the_secret_is_private_and_stays(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    secret = modeler_state.user_secret()
    file = tmp_path / "cqos" / "modeler.key"
    assert (modeler_state.user_secret(), stat.S_IMODE(file.stat().st_mode)) == (secret, 0o600)
    assert len({modeler_state.port_secret(secret, port) for port in (1, 2, 3)}) == 3
    file.write_text("")
    assert len(modeler_state.user_secret()) == len(secret)
