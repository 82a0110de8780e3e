"""What the page may ask of this machine: the files of the command line, with the key of the run, and nothing else."""

import http.client
import json
import os
import shutil
import subprocess
import sys
from urllib.parse import urlsplit

import pytest

from cqos_core.service.settings import PAGE
from tests.browser import missing, violations
from tests.modeler.conftest import NAME, ROOT, Running, Shown
from tests.modeler.screens import IN_DOCS, reach
from tests.service.service_process import serving

KEY = "x-cqos-key"


def ask(running, method, path, body=None, **headers):
    """One request to a modeler: status, headers, body."""
    return ask_at(running.page, method, path, body, **headers)


def ask_at(address, method, path, body=None, **headers):
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=30)
    try:
        connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
    finally:
        connection.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An example, a link to another file, and a file that is none of the page's."""
    made = tmp_path_factory.mktemp("named")
    shutil.copy(ROOT / "examples" / NAME, made)
    (made / "linked.bpmn").write_text("<linked/>")
    (made / "linked.bpmn").chmod(0o640)
    (made / "link.bpmn").symlink_to("linked.bpmn")
    (made / "secret.txt").write_text("secret")
    return made


@pytest.fixture(scope="module")
def running(built, folder):
    started = Running(folder / NAME, "new.bpmn", "link.bpmn", folder=folder)
    yield started
    started.stop()


def test_files_need_the_key_and_are_those_of_the_command_line(running, folder):
    example = folder / NAME

    def known(method, path, body=None, **headers):
        return ask(running, method, path, body, x_cqos_key=running.key, **headers)

    for given in ({}, {KEY: "guess"}, {KEY: running.key, "host": "evil.example"}):
        assert ask(running, "GET", "/files", **given)[0] == 403
        assert ask(running, "PUT", "/files/0", b"", **given)[0] == 403
    assert ask(running, "POST", "/files/key", x_cqos_key="guess")[0] == 403
    _, _, listed = known("GET", "/files")
    assert [each["name"] for each in json.loads(listed)["files"]] == [NAME, "new.bpmn", "link.bpmn"]
    for path in ("/files/3", "/files/-1", "/files/../secret.txt", "/files/secret.txt", "/secret.txt"):
        assert known("GET", path)[0] == 404

    # A read, and what has changed since.
    status, headers, body = known("GET", "/files/0")
    assert (status, body) == (200, example.read_bytes())
    tag = headers["etag"]
    assert known("GET", "/files/0", if_none_match=tag)[0] == 304
    # A save replaces what was read, and nothing else.
    assert known("PUT", "/files/0", b"<mine/>")[0] == 412
    status, headers, _ = known("PUT", "/files/0", b"<mine/>", if_match=tag)
    assert (status, example.read_bytes()) == (204, b"<mine/>")
    assert known("PUT", "/files/0", b"<late/>", if_match=tag)[0] == 412
    assert known("PUT", "/files/0", b"<again/>", if_match=headers["etag"])[0] == 204
    assert example.read_bytes() == b"<again/>"
    # A file that does not exist: the first save makes it, and no other does.
    new = folder / "new.bpmn"
    assert known("GET", "/files/1")[0] == 204
    assert known("PUT", "/files/1", b"<new/>", if_match='"x"')[0] == 412
    assert known("PUT", "/files/1", b"<new/>")[0] == 204
    assert known("PUT", "/files/1", b"<other/>")[0] == 412
    assert new.read_bytes() == b"<new/>"
    if os.name != "nt":
        assert new.stat().st_mode & 0o777 == 0o666 & ~umask()


def umask():
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def test_a_save_keeps_the_permissions_and_the_link(running, folder):
    link, linked = folder / "link.bpmn", folder / "linked.bpmn"
    _, headers, _ = ask(running, "GET", "/files/2", x_cqos_key=running.key)
    assert ask(running, "PUT", "/files/2", b"<mine/>", x_cqos_key=running.key, if_match=headers["etag"])[0] == 204
    assert link.is_symlink()
    assert (linked.read_bytes(), linked.stat().st_mode & 0o777) == (b"<mine/>", 0o640)


def test_the_files_of_the_page_are_compressed_and_guarded(running):
    status, headers, body = ask(running, "GET", "/", accept_encoding="gzip")
    assert (status, headers["content-encoding"], headers["cache-control"]) == (200, "gzip", "no-cache")
    policy = headers["content-security-policy"]
    assert "unsafe" not in policy
    assert "default-src 'none'" in policy
    assert ask(running, "GET", "/", if_none_match=headers["etag"])[0] == 304
    script = next(PAGE.glob("assets/*.js"))
    status, headers, body = ask(running, "GET", f"/assets/{script.name}")
    assert (status, headers["content-type"]) == (200, "text/javascript; charset=utf-8")
    assert "immutable" in headers["cache-control"]
    assert body == script.read_bytes()
    about = ask(running, "GET", "/THIRD-PARTY.txt")[2].decode()
    assert "the watermark must stay fully visible" in about
    assert "diagram-js" in about


OF_THE_TEAM = "a-token-of-the-team-0123456789abcdef"


def test_a_team_gets_no_files_and_with_tokens_asks_for_one_in_the_page(built, tmp_path, tab):
    (tmp_path / "tokens").write_text(f"{OF_THE_TEAM} name=team\n")
    with serving("--web", "127.0.0.1:0", "--modeler", "--token-file", str(tmp_path / "tokens")) as service:
        for path, expected in (("/", 200), ("/healthz", 200), ("/files", 404), ("/files/0", 404), ("/files/key", 404)):
            for token in ({}, {"authorization": f"Bearer {OF_THE_TEAM}"}):
                assert ask_at(service.web, "GET", path, **{KEY: ""}, **token)[0] == expected, path
        shown = Shown(tab, service.web, waits=False)
        shown.expected = "401"
        page = shown.page
        dialog = page.get_by_role("dialog", name="Token of the service")

        def answer(text):
            dialog.get_by_label("Token").fill(text)
            page.keyboard.press("Enter")

        reach(shown, IN_DOCS["token"], tmp_path)
        assert violations(page, "dialog") == []
        dialog.get_by_role("button", name="Cancel").click()
        page.get_by_role("button", name="Enter the token").click()
        answer(OF_THE_TEAM)
        shown.ready()
        page.locator(".list-note", has_text="Nothing to check yet").wait_for()
        kept = (
            "[Object.values(sessionStorage), Object.values(localStorage), [location.href, document.cookie]].map(String)"
        )
        assert [OF_THE_TEAM in each for each in page.evaluate(kept)] == [True, False, False]

        # The team has other tokens now: drawing goes on, and the next check asks again.
        page.evaluate("sessionStorage.setItem('cqos-token', 'an-old-token-0123456789abcdef')")
        draw = [page.locator(".canvas svg").first.focus, lambda: shown.press("n", "Enter")]
        for act in draw:
            act()
        dialog.get_by_text("The service refused this token.").wait_for()
        page.keyboard.press("Escape")
        notice = shown.notice("the service answers only callers with a token")
        notice.wait_for()
        assert page.locator(".djs-shape[data-element-id^=Event_]").count() > 0
        notice.get_by_role("button", name="Enter the token").click()
        answer(OF_THE_TEAM)
        notice.wait_for(state="detached")
        page.wait_for_selector(".qos-badge")
        shown.close()
        assert (shown.complaints, shown.strangers) == ([], [])


def test_without_the_page_the_command_says_how_to_get_it(tmp_path):
    script = (
        "from pathlib import Path; import cqos_core.service.settings as s; s.PAGE = Path('nowhere');"
        "import sys; from cqos_core.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", script, "modeler", "--no-browser"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stdout) == (2, "")
    assert "python3 dev.py setup" in done.stderr


def test_units_of_the_page():
    """Vitest, where the build has installed it."""
    folder = ROOT / "modeler"
    node, vitest = shutil.which("node"), folder / "node_modules" / "vitest" / "vitest.mjs"
    if node is None or not vitest.is_file():
        missing("vitest, which `python3 dev.py setup` installs with npm,")
    done = subprocess.run([node, vitest, "run"], cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
