"""How long the page takes from an edit to its verdict, in a headless Chromium: `python -m tests.benchmarks.modeler`.

It prints a table for docs/benchmarks.md. The time begins with the change of a field, and ends when the markers of both events
show the new verdict; the 150 ms that the page waits for further edits are taken off.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Final

from tests.browser import FLAGS, chromium
from tests.modeler.conftest import Running
from tests.modeler.drawings import many, written

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

DEBOUNCE: Final = 150
EDITS: Final = 24
_FIRST: Final = 4
"""Edits that are not counted: engines compile what runs often."""

_MEASURE: Final = """([value, state]) => new Promise(resolve => {
    const select = document.querySelector('.panel [data-policy="reliability"] select');
    const marked = () => document.querySelectorAll('.djs-element.qos-incompatible').length;
    const wanted = state === 'incompatible' ? 2 : 0;
    const observer = new MutationObserver(() => {
        if (marked() === wanted) { observer.disconnect(); resolve(performance.now() - begun); }
    });
    observer.observe(document.querySelector('.canvas'), {subtree: true, attributes: true, attributeFilter: ['class']});
    select.value = value;
    const begun = performance.now();
    select.dispatchEvent(new Event('change'));
})"""


def measured(page: Page) -> list[float]:
    """Return milliseconds from edit to verdict, without the debounce."""
    page.get_by_role("tab", name="Topic matrix").click()
    page.get_by_label("Search for a topic").fill("line0")
    page.locator(".topic .link", has_text="Throw_0").first.click()
    page.get_by_role("tab", name="Problems").click()
    page.locator('.panel [data-policy="reliability"] select').wait_for()
    times = []
    for number in range(EDITS + _FIRST):
        edit = ["best_effort", "incompatible"] if number % 2 == 0 else ["reliable", "compatible"]
        times.append(page.evaluate(_MEASURE, edit) - DEBOUNCE)
        page.wait_for_timeout(100)
    return times[_FIRST:]


def run(browser: Browser, events: int) -> list[float]:
    """Measure a diagram of as many events."""
    with tempfile.TemporaryDirectory() as folder:
        running = Running(written(Path(folder), "many.bpmn", many(events)), folder=folder)
        try:
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.set_default_timeout(120_000)
            page.goto(running.address)
            page.wait_for_function(f"() => document.querySelectorAll('.qos-badge').length === {events}")
            times = measured(page)
            page.close()
            return times
        finally:
            running.stop()


def main() -> None:
    """Print the table."""
    from playwright.sync_api import sync_playwright

    sys.stdout.write("| events | median ms | p95 ms | edits |\n| ------ | --------- | ------ | ----- |\n")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=list(FLAGS))
        for events in (4, 300, 1000):
            times = sorted(run(browser, events))
            late = times[int(len(times) * 0.95)]
            sys.stdout.write(f"| {events} | {median(times):.0f} | {late:.0f} | {len(times)} |\n")
            sys.stdout.flush()
        browser.close()


if __name__ == "__main__":
    main()
