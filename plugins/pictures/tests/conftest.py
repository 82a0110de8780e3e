"""A headless Chromium for pages that are files."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import pytest

from tests.browser import WAIT
from tests.command_process import run

DESK = {"width": 1280, "height": 900}


@cache
def page(text, name="system.yaml"):
    """Return the page of a system, as the command writes it; the same text has the same page."""
    with tempfile.TemporaryDirectory() as folder:
        return written(Path(folder), text, name=name)


def written(folder, text, *options, name="system.yaml"):
    """Write a system beside what is in a folder, and return the page that the command writes of it."""
    (folder / name).write_text(text, encoding="utf-8")
    done = run(["check", name, "--format", "html", *options], folder)
    assert done.code in {0, 1}, done.err
    return done.out


def open_all(opened):
    """Show everything on a page: nothing filtered out or closed, and the whole graph."""
    opened.get_by_role("button", name="everything", exact=True).click()
    opened.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
    for last in opened.locator(".graph").all():
        if last.locator("label").count():
            last.locator("label").last.click()


@pytest.fixture(scope="session")
def tab(browser):
    """The tab that tests use one after the other: in a new one, a page takes three times as much of the processor."""
    return opened(browser)


def opened(browser, **options):
    """Open a tab in a context of its own."""
    context = browser.new_context(**options)
    context.set_default_timeout(WAIT)
    return context.new_page()


@pytest.fixture
def shown(browser, tab, tmp_path):
    """Show a text as a page; at the end its console must be empty, and it must have asked for nothing."""
    file = tmp_path / "report.html"
    complaints: list[str] = []
    listeners = {
        "console": lambda said: complaints.append(said.text),
        "pageerror": lambda error: complaints.append(str(error)),
        "dialog": lambda dialog: complaints.append(dialog.message),
        "request": lambda request: None if request.url.startswith(file.as_uri()) else complaints.append(request.url),
    }
    used = []

    def show(text, *, viewport=DESK, color_scheme="light", **options):
        file.write_text(text, encoding="utf-8", newline="")
        page = opened(browser, **options) if options else tab
        used.append(page)
        for event, heard in listeners.items():
            page.on(event, heard)
        page.set_viewport_size(viewport)
        page.emulate_media(media="null", color_scheme=color_scheme)
        page.mouse.move(-10, -10)
        page.goto(file.as_uri())
        return page

    yield show
    for page in used:
        for event, heard in listeners.items():
            page.remove_listener(event, heard)
        if page is not tab:
            page.context.close()
    assert complaints == []
