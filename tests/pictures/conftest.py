"""A headless Chromium for pages that are files."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser import WAIT
from tests.command import run

AXE = Path(__file__).resolve().parents[2] / "modeler" / "node_modules" / "axe-core" / "axe.min.js"


def page(tmp_path, text, *options, name="system.yaml"):
    """Return the page of a system, as the command writes it."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    done = run(["check", name, "--format", "html", *options], tmp_path)
    assert done.code in {0, 1}, done.err
    return done.out


def open_all(opened):
    """Show everything on a page: nothing filtered out or closed, and the whole graph."""
    opened.get_by_role("button", name="everything", exact=True).click()
    opened.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
    for last in opened.locator(".graph").all():
        if last.locator("label").count():
            last.locator("label").last.click()


@pytest.fixture
def shown(browser, tmp_path):
    """Show a text as a page; at the end its console must be empty, and it must have asked for nothing."""
    complaints: list[str] = []
    contexts = []

    def show(text, **options):
        file = tmp_path / "report.html"
        file.write_text(text, encoding="utf-8", newline="")
        contexts.append(browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options}))
        contexts[-1].set_default_timeout(WAIT)
        page = contexts[-1].new_page()
        page.on("console", lambda said: complaints.append(said.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("dialog", lambda dialog: complaints.append(dialog.message))
        page.on(
            "request", lambda request: None if request.url.startswith(file.as_uri()) else complaints.append(request.url)
        )
        page.goto(file.as_uri())
        return page

    yield show
    for context in contexts:
        context.close()
    assert complaints == []
