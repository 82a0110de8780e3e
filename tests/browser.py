"""How tests of pages start Chromium, how long they wait, and what they do without it."""

from __future__ import annotations

import os
import shutil
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

FLAGS = (
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    # No page lives long enough to win back what optimizing its code costs.
    "--js-flags=--no-opt --no-maglev --single-threaded",
)
PROGRAMS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
"""The first does the same with four fifths of the work: it has no windows, tabs and menus."""
WAIT = 90_000
"""Milliseconds: other tests take most of the machine meanwhile."""


def missing(what: str) -> NoReturn:
    """Skip the test because a component is missing; where CI runs, fail it."""
    if os.environ.get("CI") == "true":
        pytest.fail(f"{what} is missing")
    pytest.skip(f"{what} is missing")


def chromium() -> str:
    """Return the path of the browser."""
    found = next(filter(None, map(shutil.which, PROGRAMS)), None)
    return missing("Chromium") if found is None else found


@cache
def axe() -> str:
    """Return the script of axe-core, which comes with the build of the page."""
    file = Path(__file__).parents[1] / "modeler" / "node_modules" / "axe-core" / "axe.min.js"
    if not file.is_file():
        missing("axe-core")
    return file.read_text(encoding="utf-8")


_RUN = """async ([where, rules]) => {
    const only = rules === null ? {} : { runOnly: rules };
    const { violations } = await axe.run(where, { resultTypes: ['violations'], ...only });
    return violations.map(({ id, nodes }) => [id, nodes.map(({ html, failureSummary }) => [html.slice(0, 200), failureSummary])]);
}"""
_OF_COLORS = ["color-contrast", "link-in-text-block"]
"""The rules of axe that look at colors: a theme changes nothing else."""


def violations(page: Page, where: str = "html") -> list[tuple[str, str, object]]:
    """Return what axe finds in a part of a page, in both themes; the page is light before and after."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(axe())
    found: list[tuple[str, str, object]] = []
    page.emulate_media(color_scheme="dark")
    found += [("dark", *each) for each in page.evaluate(_RUN, [where, _OF_COLORS])]
    page.emulate_media(color_scheme="light")
    found += [("light", *each) for each in page.evaluate(_RUN, [where, None])]
    return found
