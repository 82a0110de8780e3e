"""The real `cqos modeler` on a free port, and a headless Chromium that shows its page."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from cqos_core.service.settings import PAGE
from tests.browser import WAIT, missing
from tests.command_process import start

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parents[2]
LISTEN = """() => {
    const said = window.said = [];
    const listen = changes => changes.forEach(change => change.addedNodes.forEach(node => said.push(node.textContent)));
    new MutationObserver(listen).observe(document.querySelector('.status'), { childList: true });
}"""
"""Keeps what the status line says from now on."""
DESK = {"width": 1280, "height": 720}
BARE = "/healthz"
"""A page of the service without a script: what starts from it keeps what the browser has compiled."""
SOON = 1_500
"""Milliseconds after which a person clicks again."""


class Running:
    """A running `cqos modeler`, ended by its process id; `browser` is the command that it starts as one."""

    def __init__(self, *arguments, folder, browser=None):
        kept = {name: value for name, value in os.environ.items() if not name.startswith("CQOS_")}
        kept["XDG_STATE_HOME"] = str(Path(folder, "state"))  # drafts of other runs
        if browser is not None:
            kept["BROWSER"] = browser
        options = [] if browser else ["--no-browser"]
        self.process = start(("modeler", *options, *arguments), folder, kept)
        self.errors: list[str] = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        found = re.search(r"http://\S+", self.process.stdout.readline())
        if found is None:
            self.stop()
            raise AssertionError(self.errors)
        self.address = found[0]

    def _read(self):
        self.errors.extend(self.process.stderr or ())

    @property
    def page(self):
        """The address without the key."""
        return self.address.partition("#")[0]

    @property
    def key(self):
        return self.address.partition("#key=")[2]

    def stop(self):
        """End it as Ctrl-C does; its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(30)
        finally:
            self.process.kill()
            self.process.wait()
            self._reader.join()
            self.process.stdout.close()
            self.process.stderr.close()


@pytest.fixture(scope="session")
def built():
    """The folder of the page."""
    if not (PAGE / "index.html").is_file():
        missing("the page of the modeler, which `python3 dev.py setup` builds with npm,")
    return PAGE


NAME = "smart_agriculture.bpmn"


@pytest.fixture(scope="session")
def shared(built, tmp_path_factory):
    """One `cqos modeler` for all tests of a process that can share it, and the file that it was started with."""
    file = tmp_path_factory.mktemp("shared") / NAME
    running = Running(file, folder=file.parent)
    yield running, file
    running.stop()


@pytest.fixture
def example(shared):
    """The file of the shared modeler: the example of the paper."""
    file = shared[1]
    shutil.copy(ROOT / "examples" / NAME, file)
    return file


@pytest.fixture
def opens(shared, show):
    """Show a diagram, or none, in the shared modeler."""

    def opened(text=None, **options):
        running, file = shared
        file.unlink(missing_ok=True)
        if text is not None:
            file.write_text(text, encoding="utf-8")
        return show(running.address, **options)

    return opened


@pytest.fixture
def opened(shared, example, show):
    """The example of the paper in the shared modeler."""
    return show(shared[0].address)


@pytest.fixture
def run_modeler(built, tmp_path):
    """Start `cqos modeler` with files."""
    with contextlib.ExitStack() as stack:

        def start(*files):
            running = Running(*files, folder=tmp_path)
            stack.callback(running.stop)
            return running

        yield start


class Tab:
    """A tab that tests use one after the other: in a new one, a page takes three times as much of the processor."""

    def __init__(self, browser, **options):
        self.context = browser.new_context(**options)
        self.context.set_default_timeout(WAIT)
        self.page = self.context.new_page()

    def show(self, address, *, viewport=DESK, color_scheme="light"):
        """Go to an address as the first page of a new browser does: nothing is kept of what the tab has shown."""
        if self.page.is_closed():
            self.page = self.context.new_page()
        page, origin = self.page, address.partition("#")[0].rstrip("/")
        page.set_viewport_size(viewport)
        page.emulate_media(color_scheme=color_scheme)
        page.mouse.move(-10, -10)
        page.goto(f"{origin}{BARE}")
        page.evaluate("sessionStorage.clear()")
        session = self.context.new_cdp_session(page)
        session.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": "all"})
        session.detach()
        return page

    def leave(self, place):
        """Go to a place without a script, and close what was opened besides."""
        for page in self.context.pages:
            page.unroute_all()
            page.goto(place)
            if page is not self.page:
                page.close()


class Shown:
    """A page in the browser, with what must not happen there.

    Attributes:
        page: of playwright.
        complaints: errors of the page and lines in its console.
        strangers: addresses of requests that leave this machine.
        expected: a status of an answer that the browser may complain of.
    """

    expected = "none"

    def __init__(self, tab, address, *, waits=True, **options):
        self.tab, self.context = tab, tab.context
        self.complaints: list[str] = []
        self.strangers: list[str] = []
        self.own = address.partition("#")[0]
        self.is_closed = False
        self._heard = []
        self.page = tab.show(address, **options)
        self.watch(self.page)
        self.page.goto(address)
        if waits:
            self.ready()

    def watch(self, page):
        self.on("console", lambda said: self._said(f"{said.type}: {said.text}"), page)
        self.on("pageerror", lambda error: self.complaints.append(str(error)), page)
        self.on("request", lambda request: self._asked(request.url), page)

    def on(self, event, heard, page=None):
        """Listen to the page until it is closed."""
        self._heard.append((page or self.page, event, heard))
        self._heard[-1][0].on(event, heard)

    def _said(self, line):
        if f"status of {self.expected}" not in line:
            self.complaints.append(line)

    def _asked(self, url):
        if not url.startswith((self.own, "data:", "blob:")):
            self.strangers.append(url)

    def ready(self):
        """Wait until a diagram is there."""
        self.page.wait_for_selector(".djs-element")
        return self

    def close(self):
        """Leave the page as a person does, so that its session ends."""
        self._close(f"{self.own.rstrip('/')}{BARE}")

    def leave(self):
        """Leave a page whose service has ended, or ends next."""
        self._close("about:blank")

    def _close(self, place):
        if not self.is_closed:
            self.is_closed = True
            for page, event, heard in self._heard:
                page.remove_listener(event, heard)
            self.tab.leave(place)

    def shape(self, name):
        """The drawn element of an id."""
        return self.page.locator(f'.djs-shape[data-element-id="{name}"] .djs-hit').first

    def until(self, shown, act):
        """Act, and act again as a person does, until the page shows it: for 400 ms after a drag the canvas takes no click."""
        from playwright.sync_api import TimeoutError as NotSoon

        for _ in range(WAIT // SOON):
            act()
            with contextlib.suppress(NotSoon):
                self.page.wait_for_selector(shown, state="attached", timeout=SOON)
                return self
        raise AssertionError(f"the page does not show {shown}")

    def choose(self, name, **where):
        """Click a shape until it is chosen."""
        chosen = f'.djs-element.selected[data-element-id="{name}"]'
        return self.until(chosen, lambda: self.shape(name).click(force=True, **where))

    def put_beside(self, *files):
        """Open documents beside the diagram."""
        self.page.evaluate("() => { delete window.showOpenFilePicker; }")  # no test can answer the dialog of the system
        self.page.get_by_role("tab", name="Other documents").click()
        with self.page.expect_file_chooser() as waiting:
            self.page.get_by_role("button", name="Open beside the diagram").click()
        waiting.value.set_files(files)

    def press(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)
        return self

    def saved(self, name):
        """Save, and wait until the page has said so; what it says next may come at once."""
        self.page.evaluate(LISTEN)
        self.press("Control+s")
        self.page.wait_for_function(
            "name => window.said.includes(`Saved ${name}`)"
            " && document.querySelector('.bar .edited').textContent !== 'edited'",
            arg=name,
        )
        return self

    def kept(self):
        """Wait until the changes are kept as a draft."""
        self.page.wait_for_selector(".bar .edited[title*='keeps']", state="attached")
        return self

    @property
    def is_edited(self):
        return self.page.locator(".bar .edited").text_content() == "edited"

    def notice(self, text):
        return self.page.locator(".notice", has_text=text)


@pytest.fixture(scope="session")
def tab(browser):
    """The tab that all tests of a process use."""
    return Tab(browser)


@pytest.fixture
def show(built, tab) -> Iterator[object]:
    """Show an address in place of what was shown before; at the end nothing may have gone wrong, and nothing may have left this machine."""
    pages: list[Shown] = []

    def shown(address, **options):
        for each in pages:
            each.close()
        pages.append(Shown(tab, address, **options))
        return pages[-1]

    yield shown
    for each in pages:
        each.close()
    for each in pages:
        assert (each.complaints, each.strangers) == ([], [])
