"""A headless Chromium for pages that are files."""

from __future__ import annotations

import shutil

import pytest

from tests.modeler.conftest import ROOT, WAIT, launched, missing

AXE = ROOT / "modeler" / "node_modules" / "axe-core" / "axe.min.js"


@pytest.fixture(scope="session")
def chromium():
    """One Chromium for the tests of a process."""
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        missing("Chromium")
    return launched(program)


@pytest.fixture
def shown(chromium, tmp_path):
    """Show a text as a page; at the end its console must be empty, and it must have asked for nothing."""
    complaints: list[str] = []
    contexts = []

    def show(text, **options):
        file = tmp_path / "report.html"
        file.write_text(text, encoding="utf-8", newline="")
        contexts.append(chromium.new_context(**{"viewport": {"width": 1280, "height": 900}, **options}))
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
